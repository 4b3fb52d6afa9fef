//! Reference patches kept for a whole sequence.

use super::arithmetic::{Scratch, is_whole};
use super::lanes::LANES;
use super::patch::Stats;
use super::tracker::Tracker;
use super::whole::WholePatch;
use super::window::Window;
use super::{Guess, Model, Track, TrackError, TrackOptions};
use crate::pyramid::{Interpolation, Pyramid};
use geometry::Vec2;
use nalgebra::Matrix2;
use rayon::prelude::*;

/// Fewer points than this are not worth a thread: in floating point, and in whole numbers.
const POINTS_PER_TASK: [usize; 2] = [16, 96];

/// Numbers kept of a pixel: two slopes and the value.
const PLANES: usize = 3;

/// Patches of a frame at every level, each with its slopes and its Hessian, ready to be looked for in any number of
/// other frames at no further cost.
///
/// A pixel of a window needs six bytes per level, rows being padded to eight; what is left is some 400 bytes per level
/// and point. The frame itself is needed for the way back, and for guesses that stretch a patch.
#[derive(Clone, Debug)]
pub struct Templates<'a> {
    a: &'a Pyramid,
    points: Vec<Vec2>,
    options: TrackOptions,
    kept: Kept,
}

impl<'a> Templates<'a> {
    /// Takes the patches of `a` around points, pixels of the finest level.
    ///
    /// # Errors
    /// If the window is even, or outside 3 … 31, or its weights have no width.
    pub fn take(a: &'a Pyramid, points: &[Vec2], options: &TrackOptions) -> Result<Self, TrackError> {
        let window = check(options)?;
        let kept = match window.strips() {
            1 => keep::<1>(a, points, options),
            2 => keep::<2>(a, points, options),
            3 => keep::<3>(a, points, options),
            _ => keep::<4>(a, points, options),
        };
        Ok(Self { a, points: points.to_vec(), options: options.clone(), kept })
    }

    /// The points, pixels of the finest level.
    pub fn points(&self) -> &[Vec2] {
        &self.points
    }

    /// Tracks the patches into another frame, as [`track`](super::track()) does and with the same result.
    ///
    /// # Errors
    /// If there are guesses, but not one for each point.
    pub fn track(&self, b: &Pyramid, guesses: Option<&[Guess]>) -> Result<Vec<Track>, TrackError> {
        run(self.a, b, &self.points, guesses, &self.options, Some(&self.kept))
    }
}

/// Patches in sixteen bits, level by level and point by point.
#[derive(Clone, Debug)]
pub(super) struct Kept {
    levels: usize,
    /// Numbers of one patch.
    length: usize,
    packed: Vec<i16>,
    stats: Vec<Stats>,
}

impl Kept {
    pub fn get(&self, point: usize, level: usize) -> (&[i16], &Stats) {
        let index = point * self.levels + level;
        (&self.packed[index * self.length..][..self.length], &self.stats[index])
    }
}

fn check(options: &TrackOptions) -> Result<Window, TrackError> {
    if !(3..=31).contains(&options.window) || options.window.is_multiple_of(2) {
        return Err(TrackError::Window(options.window));
    }
    if let Some(sigma) = options.window_sigma.filter(|sigma| !(sigma.is_finite() && *sigma > 0.0)) {
        return Err(TrackError::WindowSigma(sigma));
    }
    Ok(Window::new(options.window))
}

fn keep<const STRIPS: usize>(a: &Pyramid, points: &[Vec2], options: &TrackOptions) -> Kept {
    let tracker = Tracker::<STRIPS>::new(a, options, None);
    let levels = options.levels.clamp(1, a.levels().len());
    let whole = is_whole(options);
    let length =
        if whole { WholePatch::kept_length(tracker.window) } else { STRIPS * tracker.window.side * LANES * PLANES };
    let mut packed = vec![0; points.len() * levels * length];
    let mut stats = vec![Stats::default(); points.len() * levels];
    let patches = packed.par_chunks_exact_mut(levels * length).zip(stats.par_chunks_exact_mut(levels));
    let each = |scratch: &mut Scratch<STRIPS>, ((packed, stats), point): ((&mut [i16], &mut [Stats]), &Vec2)| {
        let outputs = packed.chunks_exact_mut(length).zip(stats);
        for (l, (level, (packed, stats))) in a.levels().iter().zip(outputs).enumerate() {
            let at = point / f64::from(1_u32 << l);
            // The others are never looked at.
            if !tracker.reaches(level, &at) {
                continue;
            }
            if whole {
                tracker.take_whole(level, at, scratch);
                scratch.whole.pack(packed);
                stats.clone_from(&scratch.whole.stats);
            } else {
                let fine = if l == 0 { options.interpolation } else { Interpolation::Bilinear };
                let affine = l == 0 && options.model == Model::Affine;
                tracker.take_fresh(level, at, Matrix2::identity(), (fine, affine), scratch);
                scratch.patch.pack(tracker.window, packed);
                stats.clone_from(&scratch.patch.stats);
            }
        }
    };
    patches.zip(points).with_min_len(POINTS_PER_TASK[usize::from(whole)]).for_each_init(Scratch::default, each);
    Kept { levels, length, packed, stats }
}

/// Tracks points of `a`, whose patches may have been kept, into `b`.
pub(super) fn run(
    a: &Pyramid,
    b: &Pyramid,
    points: &[Vec2],
    guesses: Option<&[Guess]>,
    options: &TrackOptions,
    kept: Option<&Kept>,
) -> Result<Vec<Track>, TrackError> {
    let window = check(options)?;
    if let Some(guesses) = guesses
        && guesses.len() != points.len()
    {
        return Err(TrackError::Guesses { guesses: guesses.len(), points: points.len() });
    }
    let follow = match window.strips() {
        1 => follow::<1>,
        2 => follow::<2>,
        3 => follow::<3>,
        _ => follow::<4>,
    };
    Ok(follow(a, b, points, guesses, options, kept))
}

fn follow<const STRIPS: usize>(
    a: &Pyramid,
    b: &Pyramid,
    points: &[Vec2],
    guesses: Option<&[Guess]>,
    options: &TrackOptions,
    kept: Option<&Kept>,
) -> Vec<Track> {
    let tracker = Tracker::<STRIPS>::new(a, options, kept);
    let one = |scratch: &mut Scratch<STRIPS>, i: usize| {
        let guess = guesses.map_or_else(|| Guess::at(points[i]), |guesses| guesses[i]);
        tracker.track(b, i, points[i], guess, scratch)
    };
    let fewest = POINTS_PER_TASK[usize::from(is_whole(options))];
    let indices = (0..points.len()).into_par_iter().with_min_len(fewest);
    indices.map_init(Scratch::default, one).collect()
}
