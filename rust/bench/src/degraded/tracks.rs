//! What the judge reads of `tracks.json`, as everyone else who uses the program may read it.

use serde::Deserialize;

/// The tracks of a film.
#[derive(Deserialize)]
pub struct Tracks {
    pub frames: Vec<Frame>,
    pub tracks: Vec<Track>,
}

/// A frame, in the order of the film.
#[derive(Deserialize)]
pub struct Frame {
    /// Whether points were followed through it.
    pub used: bool,
}

/// A point of the head.
#[derive(Deserialize)]
pub struct Track {
    /// The frame in which it was chosen.
    pub reference: usize,
    /// Frame, two pixels and their standard deviation, by frame.
    pub observations: Vec<(usize, f64, f64, f64)>,
}
