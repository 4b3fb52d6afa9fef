//! Which observations count, and which unknown stands where.

use super::gauge::{Gauge, Held, hold};
use super::squares::CAMERA;
use super::{Bundle, BundleOptions};
use crate::MotionError;
use geometry::Vec2;
use std::ops::Range;

/// Points whose blocks are handled together: 192 columns, at which a matrix product is at its best.
const CHUNK_POINTS: usize = 64;
/// Observations a frame without a prior needs: two numbers each for six unknowns.
const FEWEST_IN_FRAME: usize = 3;
/// Observations a point without a prior needs.
const FEWEST_OF_POINT: usize = 2;

/// An observation as the solver reads it.
#[derive(Clone, Copy)]
pub(super) struct Sight {
    pub(super) frame: usize,
    pub(super) point: usize,
    /// Of the point in [`Layout::points`].
    pub(super) place: usize,
    pub(super) pixel: Vec2,
    pub(super) inverse_sigma: f64,
}

/// Points side by side in the order of the solver.
pub(super) struct Chunk {
    /// Its part of [`Layout::points`].
    pub(super) points: Range<usize>,
    /// Its part of [`Layout::sights`].
    pub(super) sights: Range<usize>,
    /// Frames from the first to the last that sees one of them.
    pub(super) frames: Range<usize>,
    /// The columns of those that are free.
    pub(super) columns: Range<usize>,
}

/// The order of observations and unknowns; made once for a bundle.
pub(super) struct Layout<'a> {
    pub(super) options: &'a BundleOptions,
    /// Points that count, those seen by the same frames side by side.
    pub(super) points: Vec<usize>,
    /// The place of each point in [`Layout::points`].
    pub(super) place_of_point: Vec<Option<usize>>,
    /// Observations that count, in the order of the points, then of the frames.
    pub(super) sights: Vec<Sight>,
    pub(super) chunks: Vec<Chunk>,
    /// First column of each free frame; ascending.
    pub(super) column_of_frame: Vec<Option<usize>>,
    /// Columns of all frames: those of the camera follow.
    pub(super) frame_columns: usize,
    /// Unknowns of the camera that are refined: 0 the logarithm of the focal length, 1 `k1`, 2 `k2`, 3 `cx`, 4 `cy`.
    pub(super) camera: Vec<usize>,
    pub(super) held: Held,
}

impl<'a> Layout<'a> {
    /// Leaves out what is not determined, chooses the gauge and numbers the unknowns.
    pub(super) fn new(bundle: &Bundle, options: &'a BundleOptions) -> Result<Self, MotionError> {
        super::check::check(bundle, options)?;
        let (sights, points, sights_of) = sorted(bundle, &counted(bundle, options));
        let mut seen = vec![false; bundle.poses.len()];
        sights.iter().for_each(|sight| seen[sight.frame] = true);
        let held = match options.gauge {
            Gauge::Held => hold(bundle, options, &seen),
            Gauge::Free => Held::default(),
        };
        let mut frame_columns = 0;
        let is_free = |frame: usize| {
            let fixed = options.fixed_frames.contains(&frame) || held.frame == Some(frame);
            !fixed && (seen[frame] || options.pose_priors.iter().any(|prior| prior.frame == frame))
        };
        let column = |frame: usize| {
            is_free(frame).then(|| {
                frame_columns += 6;
                frame_columns - 6
            })
        };
        let column_of_frame: Vec<Option<usize>> = (0..seen.len()).map(column).collect();
        let mut place_of_point = vec![None; bundle.points.len()];
        points.iter().enumerate().for_each(|(place, &point)| place_of_point[point] = Some(place));
        let chunks = chunks(&sights, &sights_of, &column_of_frame);
        let lens = options.lens_prior.is_some();
        let refined = [options.refine_focal, options.refine_distortion || lens, options.refine_distortion, lens, lens];
        let camera = (0..CAMERA).filter(|&k| refined[k]).collect();
        let layout =
            Self { options, points, place_of_point, sights, chunks, column_of_frame, frame_columns, camera, held };
        let enough = !layout.sights.is_empty() && layout.numbers() >= layout.unknowns();
        let (observations, unknowns) = (layout.sights.len(), layout.unknowns());
        if enough { Ok(layout) } else { Err(MotionError::Underdetermined { observations, unknowns }) }
    }

    /// Number of unknowns, points included, without the one that holds the scale.
    pub(super) fn unknowns(&self) -> usize {
        self.reduced_unknowns() + 3 * self.points.len() - usize::from(self.held.scale.is_some())
    }

    /// Unknowns that are left when the points are eliminated.
    pub(super) fn reduced_unknowns(&self) -> usize {
        self.frame_columns + self.camera.len()
    }

    /// Numbers that are known: two of each observation and those of the priors.
    pub(super) fn numbers(&self) -> usize {
        let focal = usize::from(self.options.refine_focal && self.options.focal_prior.is_some());
        let of_points = self.options.point_priors.iter().filter(|prior| self.place_of_point[prior.point].is_some());
        let lens = if self.options.lens_prior.is_some() { 3 } else { 0 };
        2 * self.sights.len() + 3 * of_points.count() + 6 * self.options.pose_priors.len() + focal + lens
    }

    /// The column that is held still to hold the scale.
    pub(super) fn held_column(&self) -> Option<usize> {
        let scale = self.held.scale?;
        Some(self.column_of_frame[scale.frame]? + 3 + scale.axis)
    }
}

/// Which observations count: what determines neither its point nor its frame is left out, and what depends on it.
fn counted(bundle: &Bundle, options: &BundleOptions) -> Vec<bool> {
    let mut needs_frame = vec![FEWEST_IN_FRAME; bundle.poses.len()];
    let mut needs_point = vec![FEWEST_OF_POINT; bundle.points.len()];
    options.fixed_frames.iter().for_each(|&frame| needs_frame[frame] = 0);
    options.pose_priors.iter().for_each(|prior| needs_frame[prior.frame] = 0);
    options.point_priors.iter().for_each(|prior| needs_point[prior.point] = 0);
    let mut counted = vec![true; bundle.observations.len()];
    loop {
        let (mut in_frame, mut of_point) = (vec![0; needs_frame.len()], vec![0; needs_point.len()]);
        for (o, _) in bundle.observations.iter().zip(&counted).filter(|(_, counts)| **counts) {
            in_frame[o.frame] += 1;
            of_point[o.point] += 1;
        }
        let mut changed = false;
        for (o, counts) in bundle.observations.iter().zip(&mut counted).filter(|(_, counts)| **counts) {
            *counts = in_frame[o.frame] >= needs_frame[o.frame] && of_point[o.point] >= needs_point[o.point];
            changed |= !*counts;
        }
        if !changed {
            return counted;
        }
    }
}

/// The observations that count in the order of the solver, the points in this order, and the observations of each.
fn sorted(bundle: &Bundle, counted: &[bool]) -> (Vec<Sight>, Vec<usize>, Vec<Range<usize>>) {
    let mut of_point: Vec<Vec<Sight>> = vec![Vec::new(); bundle.points.len()];
    for (o, _) in bundle.observations.iter().zip(counted).filter(|(_, counts)| **counts) {
        let sight = Sight { frame: o.frame, point: o.point, place: 0, pixel: o.pixel, inverse_sigma: 1.0 / o.sigma_px };
        of_point[o.point].push(sight);
    }
    of_point.iter_mut().for_each(|sights| sights.sort_by_key(|sight| sight.frame));
    let mut points: Vec<usize> = (0..of_point.len()).filter(|&point| !of_point[point].is_empty()).collect();
    points.sort_by_key(|&p| (of_point[p][0].frame, of_point[p][of_point[p].len() - 1].frame));
    let mut sights = Vec::with_capacity(bundle.observations.len());
    let range = |(place, &point): (usize, &usize)| {
        let first = sights.len();
        sights.extend(of_point[point].iter().map(|sight| Sight { place, ..*sight }));
        first..sights.len()
    };
    let sights_of = points.iter().enumerate().map(range).collect();
    (sights, points, sights_of)
}

fn chunks(sights: &[Sight], sights_of: &[Range<usize>], column_of_frame: &[Option<usize>]) -> Vec<Chunk> {
    let chunk = |first: usize| {
        let points = first..(first + CHUNK_POINTS).min(sights_of.len());
        let own = sights_of[first].start..sights_of[points.end - 1].end;
        let seen = || sights[own.clone()].iter().map(|sight| sight.frame);
        let frames = seen().min().unwrap_or(0)..seen().max().map_or(0, |last| last + 1);
        let free = || column_of_frame[frames.clone()].iter().flatten().copied();
        let columns = free().min().unwrap_or(0)..free().max().map_or(0, |last| last + 6);
        Chunk { points, sights: own, frames, columns }
    };
    (0..sights_of.len()).step_by(CHUNK_POINTS).map(chunk).collect()
}
