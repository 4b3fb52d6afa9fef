//! The blocks of the normal equations at a state, and the cost alone.

use super::State;
use super::block::{
    CameraSquares, FRAME_BY_CAMERA, Inputs, OF_CAMERA, OF_FRAME, OF_POINT, OF_SIGHT, POINT_BY_CAMERA, SIZE, Seen,
    Squares, TRIANGLE,
};
use super::layout::{Chunk, Layout};
use geometry::Mat3;
use nalgebra::Matrix6;
use pulp::NullaryFnOnce;
use rayon::prelude::*;

/// What a frame's observations add up to; the order of the numbers is [`Squares`]'.
#[derive(Clone, Copy)]
pub(super) struct FrameBlock {
    sums: [f64; OF_FRAME],
    by_camera: [f64; FRAME_BY_CAMERA],
}

/// What a point's observations add up to.
#[derive(Clone, Copy)]
pub(super) struct PointBlock {
    sums: [f64; OF_POINT],
    /// Against the camera: a row for each of its unknowns.
    pub(super) by_camera: [f64; POINT_BY_CAMERA],
}

/// The equations of a chunk of points.
pub(super) struct ChunkBlocks {
    cost: f64,
    /// `H R` column by column and `y` of each sight.
    pub(super) sights: Vec<[f64; OF_SIGHT]>,
    pub(super) points: Vec<PointBlock>,
    /// Of the frames of [`Chunk::frames`].
    frames: Vec<FrameBlock>,
    camera: [f64; OF_CAMERA],
}

/// The normal equations at a state.
pub(super) struct Linearised {
    pub(super) cost: f64,
    pub(super) chunks: Vec<ChunkBlocks>,
    /// A block for each frame, priors included.
    pub(super) frames: Vec<FrameBlock>,
    pub(super) camera: CameraBlock,
}

/// The camera's own block: logarithm of the focal length, `k1`, `k2`, refined or not.
#[derive(Clone, Copy, Default)]
pub(super) struct CameraBlock {
    pub(super) hessian: Mat3,
    pub(super) gradient: [f64; 3],
}

const NO_FRAME: FrameBlock = FrameBlock { sums: [0.0; OF_FRAME], by_camera: [0.0; FRAME_BY_CAMERA] };
const NO_POINT: PointBlock = PointBlock { sums: [0.0; OF_POINT], by_camera: [0.0; POINT_BY_CAMERA] };

impl FrameBlock {
    /// Lower triangle only.
    pub(super) fn hessian(&self) -> Matrix6<f64> {
        let mut hessian = Matrix6::zeros();
        for (k, (i, j)) in TRIANGLE.into_iter().enumerate() {
            hessian[(i, j)] = self.sums[15 + k];
            hessian[(3 + i, 3 + j)] = self.sums[k];
        }
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            hessian[(3 + j, i)] = self.sums[6 + 3 * j + i];
        }
        hessian
    }

    pub(super) fn gradient(&self) -> &[f64] {
        &self.sums[21..]
    }

    /// Against one unknown of the camera.
    pub(super) fn by_camera(&self, unknown: usize) -> [f64; 6] {
        let (shift, turn) = (3 * unknown, 9 + 3 * unknown);
        std::array::from_fn(|k| self.by_camera[if k < 3 { turn + k } else { shift + k - 3 }])
    }

    fn add(&mut self, other: &Self) {
        self.sums.iter_mut().zip(&other.sums).for_each(|(sum, value)| *sum += value);
        self.by_camera.iter_mut().zip(&other.by_camera).for_each(|(sum, value)| *sum += value);
    }

    fn add_prior(&mut self, hessian: &Matrix6<f64>, gradient: &[f64]) {
        for (k, (i, j)) in TRIANGLE.into_iter().enumerate() {
            self.sums[15 + k] += hessian[(i, j)];
            self.sums[k] += hessian[(3 + i, 3 + j)];
        }
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            self.sums[6 + 3 * j + i] += hessian[(3 + j, i)];
        }
        self.sums[21..].iter_mut().zip(gradient).for_each(|(sum, value)| *sum += value);
    }
}

impl PointBlock {
    pub(super) fn hessian(&self) -> Mat3 {
        let s = &self.sums;
        Mat3::new(s[0], s[1], s[3], s[1], s[2], s[4], s[3], s[4], s[5])
    }

    pub(super) fn gradient(&self) -> [f64; 3] {
        [self.sums[6], self.sums[7], self.sums[8]]
    }
}

impl ChunkBlocks {
    fn new(chunk: &Chunk) -> Self {
        Self {
            cost: 0.0,
            sights: vec![[0.0; OF_SIGHT]; chunk.sights.len()],
            points: vec![NO_POINT; chunk.points.len()],
            frames: vec![NO_FRAME; chunk.frames.len()],
            camera: [0.0; OF_CAMERA],
        }
    }
}

impl Linearised {
    /// Room for a layout's equations.
    pub(super) fn new(layout: &Layout) -> Self {
        Self {
            cost: f64::INFINITY,
            chunks: layout.chunks.iter().map(ChunkBlocks::new).collect(),
            frames: vec![NO_FRAME; layout.column_of_frame.len()],
            camera: CameraBlock::default(),
        }
    }
}

impl Layout<'_> {
    /// The sum of all losses.
    pub(super) fn cost(&self, state: &State) -> f64 {
        let of_chunk = |chunk: &Chunk| pulp::Arch::new().dispatch(Cost { layout: self, chunk, state });
        // Collected in order, then summed in order: the same bits whatever the number of threads.
        let costs: Vec<f64> = self.chunks.par_iter().map(of_chunk).collect();
        costs.iter().sum::<f64>() + self.prior_cost(state)
    }

    fn prior_cost(&self, state: &State) -> f64 {
        let counts = self.options.point_priors.iter().filter(|prior| self.place_of_point[prior.point].is_some());
        let points = counts.map(|prior| prior.evaluate(&state.points[prior.point]).0);
        let poses = self.options.pose_priors.iter().map(|p| p.evaluate(&state.poses[p.frame]).0.norm_squared());
        points.sum::<f64>() + poses.sum::<f64>() + self.focal_residual(state).map_or(0.0, |(r, _)| r * r)
    }

    /// Residual of the focal prior and its derivative by the logarithm of the focal length.
    fn focal_residual(&self, state: &State) -> Option<(f64, f64)> {
        let prior = self.options.focal_prior.filter(|_| self.options.refine_focal)?;
        Some(((state.camera.fx - prior.focal_px) / prior.sigma_px, state.camera.fx / prior.sigma_px))
    }

    pub(super) fn linearise(&self, state: &State, into: &mut Linearised) {
        let fill = |(blocks, chunk): (&mut ChunkBlocks, &Chunk)| {
            pulp::Arch::new().dispatch(Fill { layout: self, chunk, state, blocks });
        };
        into.chunks.par_iter_mut().zip(&self.chunks).for_each(fill);
        into.cost = into.chunks.iter().map(|chunk| chunk.cost).sum::<f64>() + self.prior_cost(state);
        into.frames.fill(NO_FRAME);
        let mut camera = [0.0; OF_CAMERA];
        for (blocks, chunk) in into.chunks.iter().zip(&self.chunks) {
            into.frames[chunk.frames.clone()].iter_mut().zip(&blocks.frames).for_each(|(sum, block)| sum.add(block));
            camera.iter_mut().zip(&blocks.camera).for_each(|(sum, value)| *sum += value);
        }
        let [xx, xy, yy, xz, yz, zz, x, y, z] = camera;
        into.camera = CameraBlock { hessian: Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz), gradient: [x, y, z] };
        self.add_priors(state, into);
    }

    fn add_priors(&self, state: &State, into: &mut Linearised) {
        for prior in &self.options.point_priors {
            let Some(place) = self.place_of_point[prior.point] else { continue };
            let gradient = prior.evaluate(&state.points[prior.point]).1;
            let size = self.chunks[0].points.len();
            let sums = &mut into.chunks[place / size].points[place % size].sums;
            TRIANGLE.into_iter().enumerate().for_each(|(k, at)| sums[k] += prior.information[at]);
            (0..3).for_each(|k| sums[6 + k] += gradient[k]);
        }
        for prior in &self.options.pose_priors {
            let (residual, jacobian) = prior.evaluate(&state.poses[prior.frame]);
            let gradient = jacobian.transpose() * residual;
            into.frames[prior.frame].add_prior(&(jacobian.transpose() * jacobian), gradient.as_slice());
        }
        if let Some((residual, slope)) = self.focal_residual(state) {
            into.camera.hessian[(0, 0)] += slope * slope;
            into.camera.gradient[0] += slope * residual;
        }
    }

    /// Squared distance of each sight from its observation, standard deviations.
    pub(super) fn squared(&self, state: &State) -> Vec<f64> {
        let (mut inputs, mut seen) = (Inputs::new(), Seen::new());
        let mut squared = Vec::with_capacity(self.sights.len());
        for sights in self.sights.chunks(SIZE) {
            inputs.gather(sights, state);
            seen.project(&inputs, &state.camera, self.options.loss, sights.len());
            squared.extend_from_slice(&seen.squared[..sights.len()]);
        }
        squared
    }
}

/// [`Layout::cost`] of a chunk for the widest vectors of the machine.
struct Cost<'a> {
    layout: &'a Layout<'a>,
    chunk: &'a Chunk,
    state: &'a State,
}

impl NullaryFnOnce for Cost<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let (mut inputs, mut seen, mut cost) = (Inputs::new(), Seen::new(), 0.0);
        for sights in self.layout.sights[self.chunk.sights.clone()].chunks(SIZE) {
            inputs.gather(sights, self.state);
            seen.project(&inputs, &self.state.camera, self.layout.options.loss, sights.len());
            cost += seen.loss[..sights.len()].iter().sum::<f64>();
        }
        cost
    }
}

/// [`Layout::linearise`] of a chunk for the widest vectors of the machine.
struct Fill<'a> {
    layout: &'a Layout<'a>,
    chunk: &'a Chunk,
    state: &'a State,
    blocks: &'a mut ChunkBlocks,
}

impl NullaryFnOnce for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { layout, chunk, state, blocks } = self;
        let (mut inputs, mut seen, mut squares) = (Inputs::new(), Seen::new(), Squares::new());
        let mut by_camera = (!layout.camera.is_empty()).then(CameraSquares::new);
        blocks.points.fill(NO_POINT);
        blocks.frames.fill(NO_FRAME);
        (blocks.cost, blocks.camera) = (0.0, [0.0; OF_CAMERA]);
        let sights = layout.sights[chunk.sights.clone()].chunks(SIZE);
        for (sights, kept) in sights.zip(blocks.sights.chunks_mut(SIZE)) {
            inputs.gather(sights, state);
            seen.project(&inputs, &state.camera, layout.options.loss, sights.len());
            squares.fill(&inputs, &seen, &state.camera);
            for (l, (sight, kept)) in sights.iter().zip(kept).enumerate() {
                *kept = std::array::from_fn(|k| squares.of_sight[k][l]);
                let place = sight.place - chunk.points.start;
                add(&mut blocks.points[place].sums, &squares.of_point, l);
                add(&mut blocks.frames[sight.frame - chunk.frames.start].sums, &squares.of_frame, l);
                blocks.cost += seen.loss[l];
            }
            let Some(squares) = &mut by_camera else { continue };
            squares.fill(&inputs, &seen, &state.camera);
            for (l, sight) in sights.iter().enumerate() {
                let place = sight.place - chunk.points.start;
                add(&mut blocks.points[place].by_camera, &squares.by_point, l);
                add(&mut blocks.frames[sight.frame - chunk.frames.start].by_camera, &squares.by_frame, l);
                add(&mut blocks.camera, &squares.own, l);
            }
        }
    }
}

/// Adds what one observation gives.
#[inline(always)]
fn add<const N: usize>(sums: &mut [f64; N], columns: &[[f64; SIZE]; N], l: usize) {
    for (sum, column) in sums.iter_mut().zip(columns) {
        *sum += column[l];
    }
}
