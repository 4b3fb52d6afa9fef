//! The bar of each command, on the film of the synthetic person: one bar for the whole work.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{assets, clip};
use facewright::{
    Assets, Faces, FrameSet, Given, Method, MotionOptions, ReconstructOptions, TrackClipOptions, find_faces,
    reconstruct, solve_motion, track,
};
use geometry::Progress;
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

/// What the bar showed, one look after the other.
struct Shown(Vec<f64>);

/// Does a work and looks at its bar all the while.
fn watched<T>(work: impl FnOnce(&Progress) -> T) -> (T, Shown) {
    let (progress, ended) = (Progress::new(), AtomicBool::new(false));
    std::thread::scope(|scope| {
        let watching = scope.spawn(|| {
            let mut shown = Vec::new();
            while !ended.load(Ordering::Acquire) {
                shown.push(progress.snapshot().fraction);
                std::thread::sleep(Duration::from_millis(1));
            }
            shown.push(progress.snapshot().fraction);
            shown
        });
        let result = work(&progress);
        ended.store(true, Ordering::Release);
        (result, Shown(watching.join().unwrap()))
    })
}

impl Shown {
    /// The largest step of a bar that goes from 0 to 1 and never falls.
    fn largest_step(&self, what: &str) -> f64 {
        assert!(self.0[0] < 0.01 && self.0[self.0.len() - 1] == 1.0, "{what} does not go from 0 to 1");
        assert!(self.0.windows(2).all(|pair| pair[0] <= pair[1]), "{what} falls");
        self.0.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max)
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
