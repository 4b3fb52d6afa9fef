//! The blocks of the normal equations at a state, and the cost alone.

use super::State;
use super::block::{Column, Inputs, SIZE, Seen, ZERO};
use super::layout::{Chunk, Layout, Sight};
use super::squares::{
    CAMERA, CAMERA_TRIANGLE, CameraSquares, FRAME_BY_CAMERA, OF_CAMERA, OF_FRAME, OF_POINT, OF_SIGHT, POINT_BY_CAMERA,
    Squares, TRIANGLE,
};
use geometry::Mat3;
use nalgebra::{Matrix5, Matrix6};
use pulp::{NullaryFnOnce, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

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
    /// `H R` column by column and `y` of each sight, in blocks of sights.
    pub(super) sights: Vec<[Column; OF_SIGHT]>,
    pub(super) points: Vec<PointBlock>,
    /// A column of [`Chunk::frames`] for each number of [`FrameBlock`].
    frames: Vec<f64>,
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

/// The camera's own block: its [`CAMERA`] unknowns, refined or not.
#[derive(Clone, Copy, Default)]
pub(super) struct CameraBlock {
    pub(super) hessian: Matrix5<f64>,
    pub(super) gradient: [f64; CAMERA],
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
        let (shift, turn) = (3 * unknown, 3 * (CAMERA + unknown));
        std::array::from_fn(|k| self.by_camera[if k < 3 { turn + k } else { shift + k - 3 }])
    }

    /// Adds a frame's numbers out of the columns of a chunk.
    fn add(&mut self, columns: &[f64], frame: usize, frames: usize) {
        let sums = self.sums.iter_mut().chain(&mut self.by_camera);
        sums.zip(columns.chunks_exact(frames)).for_each(|(sum, column)| *sum += column[frame]);
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
            sights: vec![[ZERO; OF_SIGHT]; chunk.sights.len().div_ceil(SIZE)],
            points: vec![NO_POINT; chunk.points.len()],
            frames: vec![0.0; chunk.frames.len() * (OF_FRAME + FRAME_BY_CAMERA)],
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
        points.sum::<f64>() + poses.sum::<f64>() + self.camera_residuals(state).map(|(_, r, _)| r * r).sum::<f64>()
    }

    /// What is known of the camera's unknowns: which, the residual, and its derivative by the unknown.
    fn camera_residuals(&self, state: &State) -> impl Iterator<Item = (usize, f64, f64)> {
        let (camera, options) = (state.camera, self.options);
        let focal = options.focal_prior.filter(|_| options.refine_focal).map(|prior| prior.evaluate(&camera));
        let lens = options.lens_prior.iter().flat_map(move |prior| prior.evaluate(&camera));
        focal.map(|(residual, slope)| (0, residual, slope)).into_iter().chain(lens)
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
            let sums = into.frames[chunk.frames.clone()].iter_mut().enumerate();
            sums.for_each(|(frame, sum)| sum.add(&blocks.frames, frame, chunk.frames.len()));
            camera.iter_mut().zip(&blocks.camera).for_each(|(sum, value)| *sum += value);
        }
        let product = |i: usize, j: usize| camera[i.max(j) * (i.max(j) + 1) / 2 + i.min(j)];
        into.camera = CameraBlock {
            hessian: Matrix5::from_fn(product),
            gradient: std::array::from_fn(|k| camera[CAMERA_TRIANGLE + k]),
        };
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
        for (k, residual, slope) in self.camera_residuals(state) {
            into.camera.hessian[(k, k)] += slope * slope;
            into.camera.gradient[k] += slope * residual;
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

impl WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { layout, chunk, state, blocks } = self;
        let (mut inputs, mut seen, mut squares) = (Inputs::new(), Seen::new(), Squares::new());
        let mut by_camera = (!layout.camera.is_empty()).then(CameraSquares::new);
        blocks.points.fill(NO_POINT);
        blocks.frames.fill(0.0);
        (blocks.cost, blocks.camera) = (0.0, [0.0; OF_CAMERA]);
        let frames = chunk.frames.len();
        let (of_frame, frame_by_camera) = blocks.frames.split_at_mut(OF_FRAME * frames);
        let sights = layout.sights[chunk.sights.clone()].chunks(SIZE);
        for (sights, of_sight) in sights.zip(&mut blocks.sights) {
            inputs.gather(sights, state);
            seen.project(&inputs, &state.camera, layout.options.loss, sights.len());
            squares.fill(simd, (&inputs, &seen), &state.camera, of_sight);
            blocks.cost += seen.loss[..sights.len()].iter().sum::<f64>();
            if let Some(squares) = &mut by_camera {
                squares.fill(simd, (&inputs, &seen), &state.camera, &layout.camera);
                for (sum, column) in blocks.camera.iter_mut().zip(&squares.own) {
                    *sum += column[..sights.len()].iter().sum::<f64>();
                }
            }
            let mut first = 0;
            while first < sights.len() {
                let run = first..first + run(&sights[first..]);
                let (frame, place) = (sights[first].frame - chunk.frames.start, sights[first].place);
                let point = &mut blocks.points[place - chunk.points.start];
                add_up(&mut point.sums, &squares.of_point, run.clone());
                add(of_frame, &squares.of_frame, run.clone(), frame, frames);
                if let Some(squares) = &by_camera {
                    add_up(&mut point.by_camera, &squares.by_point, run.clone());
                    add(frame_by_camera, &squares.by_frame, run.clone(), frame, frames);
                }
                first = run.end;
            }
        }
    }
}

/// How many of the first sights are of one point in consecutive frames.
#[inline(always)]
fn run(sights: &[Sight]) -> usize {
    let first = &sights[0];
    let follows = |(i, sight): &(usize, &Sight)| sight.place == first.place && sight.frame == first.frame + i;
    sights.iter().enumerate().take_while(follows).count()
}

/// Adds what a run of observations gives to their point's sums.
#[inline(always)]
fn add_up<const N: usize>(sums: &mut [f64; N], columns: &[Column; N], run: Range<usize>) {
    for (sum, column) in sums.iter_mut().zip(columns) {
        *sum += column[run.clone()].iter().sum::<f64>();
    }
}

/// Adds what a run of observations gives to the sums of their frames, of which the first is `frame`.
#[inline(always)]
fn add<const N: usize>(sums: &mut [f64], columns: &[Column; N], run: Range<usize>, frame: usize, frames: usize) {
    for (sums, column) in sums.chunks_exact_mut(frames).zip(columns) {
        let sums = &mut sums[frame..frame + run.len()];
        sums.iter_mut().zip(&column[run.clone()]).for_each(|(sum, value)| *sum += value);
    }
}
