//! Which unknown stands where, and the residuals with their derivatives.

use super::{Bundle, BundleOptions, State};
use crate::MotionError;
use geometry::{Mat3, Vec2, Vec3, skew};
use nalgebra::{Matrix2x3, Matrix3, Matrix6, Matrix6x3, SMatrix, Vector3, Vector6};
use rayon::prelude::*;
use std::ops::Range;

/// A residual of an observation that has no pixel, standard deviations: no step may move a point behind the camera.
const NO_PIXEL: f64 = 1e4;

/// An observation as the solver reads it.
pub(super) struct Sight {
    pub(super) frame: usize,
    pub(super) point: usize,
    pub(super) pixel: Vec2,
    inverse_sigma: f64,
}

impl Sight {
    /// Inverse variance of each coordinate, 1/px².
    pub(super) fn information(&self) -> f64 {
        self.inverse_sigma * self.inverse_sigma
    }
}

/// The order of observations and unknowns; made once for a bundle.
pub(super) struct Layout<'a> {
    pub(super) options: &'a BundleOptions,
    /// Observations that count, by point, then frame.
    pub(super) sights: Vec<Sight>,
    /// The sights of each point.
    pub(super) of_point: Vec<Range<usize>>,
    /// Points that are seen, those seen by the same frames side by side.
    pub(super) point_order: Vec<usize>,
    /// The sights of each frame.
    pub(super) of_frame: Vec<Vec<usize>>,
    /// First column of each free frame that sees something.
    pub(super) column_of_frame: Vec<Option<usize>>,
    /// Columns of all frames: those of the camera follow.
    pub(super) frame_columns: usize,
    /// Unknowns of the camera, 0 to 3: logarithm of the focal length, `k1`, `k2`.
    pub(super) intrinsics: usize,
}

/// A residual's derivatives, weighted, in standard deviations.
#[derive(Clone)]
pub(super) struct Row {
    pub(super) residual: Vec2,
    /// The loss of the residual before weighting.
    loss: f64,
    pub(super) by_pose: SMatrix<f64, 2, 6>,
    pub(super) by_point: Matrix2x3<f64>,
    /// By log focal, `k1`, `k2`; zero where not refined.
    pub(super) by_intrinsics: Matrix2x3<f64>,
}

/// The blocks of the normal equations at a state; the off-diagonal ones are made from the rows when they are needed.
pub(super) struct Linearised {
    pub(super) cost: f64,
    /// One for each sight.
    pub(super) rows: Vec<Row>,
    pub(super) points: Vec<(Mat3, Vec3)>,
    pub(super) frames: Vec<FrameBlock>,
    pub(super) intrinsics: (Matrix3<f64>, Vector3<f64>),
}

#[derive(Clone)]
pub(super) struct FrameBlock {
    pub(super) hessian: Matrix6<f64>,
    pub(super) gradient: Vector6<f64>,
    pub(super) by_intrinsics: Matrix6x3<f64>,
}

impl<'a> Layout<'a> {
    pub(super) fn new(bundle: &Bundle, options: &'a BundleOptions) -> Result<Self, MotionError> {
        check(bundle, options)?;
        let (frames, points) = (bundle.poses.len(), bundle.points.len());
        let mut seen = vec![0_usize; points];
        bundle.observations.iter().for_each(|o| seen[o.point] += 1);
        options.point_priors.iter().for_each(|prior| seen[prior.point] += 2);
        let counted = bundle.observations.iter().filter(|o| seen[o.point] >= 2);
        let mut sights: Vec<Sight> = counted
            .map(|o| Sight { frame: o.frame, point: o.point, pixel: o.pixel, inverse_sigma: 1.0 / o.sigma_px })
            .collect();
        sights.sort_by_key(|s| (s.point, s.frame));
        let (mut of_point, mut of_frame) = (vec![0..0; points], vec![Vec::new(); frames]);
        for (i, sight) in sights.iter().enumerate() {
            let range = &mut of_point[sight.point];
            *range = if range.end == 0 { i..i + 1 } else { range.start..i + 1 };
            of_frame[sight.frame].push(i);
        }
        let mut point_order: Vec<usize> = (0..points).filter(|&p| !of_point[p].is_empty()).collect();
        point_order.sort_by_key(|&p| (sights[of_point[p].start].frame, sights[of_point[p].end - 1].frame, p));
        let mut frame_columns = 0;
        let column_of_frame = (0..frames)
            .map(|frame| {
                let known = options.pose_priors.iter().any(|prior| prior.frame == frame);
                let free = !options.fixed_frames.contains(&frame) && (known || !of_frame[frame].is_empty());
                free.then(|| {
                    frame_columns += 6;
                    frame_columns - 6
                })
            })
            .collect();
        let intrinsics = usize::from(options.refine_focal) + 2 * usize::from(options.refine_distortion);
        let layout =
            Self { options, sights, of_point, point_order, of_frame, column_of_frame, frame_columns, intrinsics };
        let known = options.point_priors.len() * 3 + options.pose_priors.len() * 6;
        let unknowns = layout.unknowns();
        // Scale is never seen.
        if layout.sights.is_empty() || 2 * layout.sights.len() + known + 1 < unknowns {
            return Err(MotionError::Underdetermined { observations: layout.sights.len(), unknowns });
        }
        Ok(layout)
    }

    /// Number of unknowns, points included.
    pub(super) fn unknowns(&self) -> usize {
        self.frame_columns + self.intrinsics + 3 * self.point_order.len()
    }

    /// The sum of all losses.
    pub(super) fn cost(&self, state: &State) -> f64 {
        let of_point = |sights: &Range<usize>| -> f64 {
            self.sights[sights.clone()].iter().map(|sight| self.options.loss.evaluate(squared(sight, state)).0).sum()
        };
        // Collected in order, then summed in order: the same bits whatever the number of threads.
        let costs: Vec<f64> = self.of_point.par_iter().with_min_len(16).map(of_point).collect();
        costs.iter().sum::<f64>() + self.prior_cost(state)
    }

    fn prior_cost(&self, state: &State) -> f64 {
        let points = self.options.point_priors.iter().map(|prior| prior.evaluate(&state.points[prior.point]).0);
        let poses = self.options.pose_priors.iter().map(|p| p.evaluate(&state.poses[p.frame]).0.norm_squared());
        points.sum::<f64>() + poses.sum::<f64>() + self.focal_residual(state).map_or(0.0, |(r, _)| r * r)
    }

    /// Residual of the focal prior and its derivative by the logarithm of the focal length.
    fn focal_residual(&self, state: &State) -> Option<(f64, f64)> {
        let prior = self.options.focal_prior.filter(|_| self.options.refine_focal)?;
        Some(((state.camera.fx - prior.focal_px) / prior.sigma_px, state.camera.fx / prior.sigma_px))
    }

    pub(super) fn linearise(&self, state: &State) -> Linearised {
        let rows: Vec<Row> = self.sights.par_iter().with_min_len(512).map(|sight| self.row(sight, state)).collect();
        let cost = rows.iter().map(|row| row.loss).sum::<f64>() + self.prior_cost(state);
        let of_point = |sights: &Range<usize>| -> (Mat3, Vec3) {
            rows[sights.clone()].iter().fold((Mat3::zeros(), Vec3::zeros()), |(hessian, gradient), row| {
                let transposed = row.by_point.transpose();
                (hessian + transposed * row.by_point, gradient + transposed * row.residual)
            })
        };
        let mut points: Vec<_> = self.of_point.par_iter().with_min_len(16).map(of_point).collect();
        for prior in &self.options.point_priors {
            points[prior.point].0 += prior.information;
            points[prior.point].1 += prior.evaluate(&state.points[prior.point]).1;
        }
        let frames = self.frame_blocks(state, &rows);
        let intrinsics = self.intrinsic_block(state, &rows);
        Linearised { cost, rows, points, frames, intrinsics }
    }

    fn frame_blocks(&self, state: &State, rows: &[Row]) -> Vec<FrameBlock> {
        let zero =
            FrameBlock { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), by_intrinsics: Matrix6x3::zeros() };
        let of_frame = |sights: &Vec<usize>| {
            let mut block = zero.clone();
            for row in sights.iter().map(|&i| &rows[i]) {
                let transposed = row.by_pose.transpose();
                block.hessian += transposed * row.by_pose;
                block.gradient += transposed * row.residual;
                block.by_intrinsics += transposed * row.by_intrinsics;
            }
            block
        };
        let mut frames: Vec<_> = self.of_frame.par_iter().map(of_frame).collect();
        for prior in &self.options.pose_priors {
            let (residual, jacobian) = prior.evaluate(&state.poses[prior.frame]);
            frames[prior.frame].hessian += jacobian.transpose() * jacobian;
            frames[prior.frame].gradient += jacobian.transpose() * residual;
        }
        frames
    }

    fn intrinsic_block(&self, state: &State, rows: &[Row]) -> (Matrix3<f64>, Vector3<f64>) {
        let mut sum = (Matrix3::zeros(), Vector3::zeros());
        if self.intrinsics > 0 {
            for row in rows {
                let transposed = row.by_intrinsics.transpose();
                sum.0 += transposed * row.by_intrinsics;
                sum.1 += transposed * row.residual;
            }
        }
        if let Some((residual, slope)) = self.focal_residual(state) {
            sum.0[(0, 0)] += slope * slope;
            sum.1[0] += slope * residual;
        }
        sum
    }

    fn row(&self, sight: &Sight, state: &State) -> Row {
        let pose = &state.poses[sight.frame];
        let turned = pose.rotation * state.points[sight.point];
        let Some((pixel, jacobian)) = state.camera.project_with_jacobian(&(turned + pose.translation)) else {
            return Row {
                residual: Vec2::zeros(),
                loss: self.options.loss.evaluate(NO_PIXEL * NO_PIXEL).0,
                by_pose: SMatrix::zeros(),
                by_point: Matrix2x3::zeros(),
                by_intrinsics: Matrix2x3::zeros(),
            };
        };
        let residual = (pixel - sight.pixel) * sight.inverse_sigma;
        let (loss, weight) = self.options.loss.evaluate(residual.norm_squared());
        let root = weight.sqrt();
        let by_cam = jacobian.point * (root * sight.inverse_sigma);
        let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
        by_pose.fixed_columns_mut::<3>(0).copy_from(&(-by_cam * skew(&turned)));
        by_pose.fixed_columns_mut::<3>(3).copy_from(&by_cam);
        let by_intrinsics = self.by_intrinsics(&jacobian.intrinsics, state) * (root * sight.inverse_sigma);
        let by_point = by_cam * pose.rotation.matrix();
        Row { residual: residual * root, loss, by_pose, by_point, by_intrinsics }
    }

    fn by_intrinsics(&self, by_all: &SMatrix<f64, 2, 9>, state: &State) -> Matrix2x3<f64> {
        let mut by = Matrix2x3::zeros();
        if self.options.refine_focal {
            by.set_column(0, &(by_all.column(0) * state.camera.fx + by_all.column(1) * state.camera.fy));
        }
        if self.options.refine_distortion {
            let first = usize::from(self.options.refine_focal);
            by.set_column(first, &by_all.column(4));
            by.set_column(first + 1, &by_all.column(5));
        }
        by
    }
}

/// Squared distance of a sight from its observation, standard deviations.
pub(super) fn squared(sight: &Sight, state: &State) -> f64 {
    let in_cam = state.poses[sight.frame].apply(&state.points[sight.point]);
    match state.camera.project(&in_cam) {
        Some(pixel) => ((pixel - sight.pixel) * sight.inverse_sigma).norm_squared(),
        None => NO_PIXEL * NO_PIXEL,
    }
}

fn check(bundle: &Bundle, options: &BundleOptions) -> Result<(), MotionError> {
    let (frames, points) = (bundle.poses.len(), bundle.points.len());
    let index = |table, kind, index, count| match index < count {
        true => Ok(()),
        false => Err(MotionError::BadIndex { table, kind, index, count }),
    };
    let positive = |name, value: f64| match value > 0.0 && value.is_finite() {
        true => Ok(()),
        false => Err(MotionError::BadNumber { name, value }),
    };
    for o in &bundle.observations {
        index("observation table", "frame", o.frame, frames)?;
        index("observation table", "point", o.point, points)?;
        positive("an observation's standard deviation", o.sigma_px)?;
        if let Some(&value) = o.pixel.iter().find(|v| !v.is_finite()) {
            return Err(MotionError::BadNumber { name: "an observed pixel", value });
        }
    }
    for &frame in &options.fixed_frames {
        index("list of fixed frames", "frame", frame, frames)?;
    }
    for prior in &options.point_priors {
        index("table of point priors", "point", prior.point, points)?;
        positive("a point prior's information", prior.information.trace())?;
    }
    for prior in &options.pose_priors {
        index("table of pose priors", "frame", prior.frame, frames)?;
        positive("a pose prior's standard deviation", prior.sigma_rad.min(prior.sigma_m))?;
    }
    positive("the focal length", bundle.camera.fx.min(bundle.camera.fy))?;
    options.focal_prior.map_or(Ok(()), |prior| positive("the focal prior's standard deviation", prior.sigma_px))
}
