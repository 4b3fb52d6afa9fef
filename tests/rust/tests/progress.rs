//! The bar of each command, on the film of the synthetic person: one bar for the whole work.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{assets, clip};
use facewright::{
    Assets, Faces, FrameSet, Given, Method, MotionOptions, ReconstructOptions, TrackClipOptions, find_faces,
    reconstruct, solve_motion, track,
};
use geometry::{Progress, Sketch, Vec3};
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// No more of the bar is skipped at once.
const LARGEST_STEP: f64 = 1.0 / 3.0;

static ASSETS: LazyLock<Assets> = LazyLock::new(|| Assets::load(&assets().unwrap()).unwrap());
static FACES: LazyLock<Faces> = LazyLock::new(|| find_faces(&frames(), &ASSETS, None, &Progress::new()).unwrap());

fn frames() -> FrameSet {
    FrameSet::open(&[clip().join("frames")], &Progress::new()).unwrap()
}

/// What the bar showed, one look after the other; the steps, the number of all with each, and the sketches that were there meanwhile.
#[derive(Default)]
struct Shown {
    fractions: Vec<f64>,
    steps: Vec<(usize, usize)>,
    sketches: Vec<Sketch>,
}

/// Does a work and looks at its bar all the while.
fn watched<T>(work: impl FnOnce(&Progress) -> T) -> (T, Shown) {
    let (progress, ended) = (Progress::new(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let watching = scope.spawn(|| {
            let mut shown = Shown::default();
            while !ended.load(Ordering::Acquire) {
                shown.look(&progress);
                std::thread::sleep(Duration::from_millis(1));
            }
            shown.look(&progress);
            shown
        });
        let result = work(&progress);
        ended.store(true, Ordering::Release);
        (result, watching.join().unwrap())
    })
}

impl Shown {
    fn look(&mut self, progress: &Progress) {
        let seen = progress.snapshot();
        self.fractions.push(seen.fraction);
        self.steps.extend(seen.step.filter(|step| self.steps.last() != Some(step)));
        let last = self.sketches.last().map_or(0, |sketch| sketch.number);
        self.sketches.extend(progress.sketch().filter(|sketch| sketch.number > last));
    }

    /// The largest step of a bar that goes from 0 to 1 and never falls.
    fn largest_step(&self, what: &str) -> f64 {
        let bar = &self.fractions;
        assert!(bar[0] < 0.01 && bar[bar.len() - 1] == 1.0, "{what} does not go from 0 to 1");
        assert!(bar.windows(2).all(|pair| pair[0] <= pair[1]), "{what} falls");
        bar.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
    }
}

/// Checks the bar of a command, and gives back what it made. Where a busy machine has kept the watcher from looking, it looks again: a
/// bar that leaps does so every time.
fn check<T>(what: &str, work: impl Fn(&Progress) -> T) -> T {
    let (mut made, shown) = watched(&work);
    let mut step = shown.largest_step(what);
    for _ in 0..2 {
        if step >= LARGEST_STEP {
            let again = watched(&work);
            (made, step) = (again.0, again.1.largest_step(what));
        }
    }
    assert!(step < LARGEST_STEP, "{what} leaps by {step:.2}");
    made
}

#[test]
fn the_bar_of_each_command_grows_from_0_to_1_without_leaps() {
    let (given, sized) = (Given::default(), ReconstructOptions { texture_size: 512, ..ReconstructOptions::default() });
    check("faces", |p| find_faces(&frames(), &ASSETS, None, p).unwrap());
    let tracks = check("track", |p| track(&frames(), &ASSETS, None, None, &TrackClipOptions::default(), p).unwrap());
    check("motion", |p| solve_motion(&tracks, None, &MotionOptions::default(), p).unwrap());
    check("reconstruct", |p| reconstruct(&frames(), &ASSETS, &given, &sized, p).unwrap());
    let with_tracks = Given { tracks: Some(tracks), faces: Some(FACES.clone()), ..Given::default() };
    check("reconstruct from tracks", |p| reconstruct(&frames(), &ASSETS, &with_tracks, &sized, p).unwrap());
    let paper = ReconstructOptions { method: Method::Paper, ..sized };
    check("reconstruct by the paper", |p| reconstruct(&frames(), &ASSETS, &given, &paper, p).unwrap());
}

/// Root mean square distance of vertices from those of another shape, metres.
fn apart(a: &[Vec3], b: &[Vec3]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).norm_squared()).sum();
    (squares / a.len() as f64).sqrt()
}

#[test]
fn a_reconstruction_counts_its_steps_and_shows_a_head_that_comes_nearer_to_what_it_makes() {
    let options = ReconstructOptions { texture_size: 64, ..ReconstructOptions::default() };
    let given = Given { faces: Some(FACES.clone()), ..Given::default() };
    let (made, shown) = watched(|progress| reconstruct(&frames(), &ASSETS, &given, &options, progress).unwrap());
    let numbers: Vec<usize> = shown.steps.iter().map(|step| step.0).collect();
    assert!(numbers.len() >= 5 && numbers.windows(2).all(|pair| pair[0] < pair[1]), "steps {numbers:?}");
    assert!(shown.steps.iter().all(|step| step.1 == 7) && numbers.last() == Some(&7), "{:?}", shown.steps);
    let distances: Vec<f64> = shown.sketches.iter().map(|s| apart(&s.positions, &made.positions)).collect();
    assert!(distances.len() >= 3, "{} sketches", distances.len());
    assert!(shown.sketches.iter().all(|sketch| sketch.positions.len() == made.positions.len()));
    let generic = apart(&made.generic_positions, &made.positions);
    assert!(distances[0] < generic, "the first sketch is no nearer than the generic head: {distances:?}, {generic}");
    assert!(distances[distances.len() - 1] < 1e-9 && distances[0] > 1e-4, "{distances:?}");
}
