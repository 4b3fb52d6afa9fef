//! Frames of several cameras as one set: film after film, all as one camera would have taken them.

use super::{Frame, FrameSet};
use crate::FacewrightError;
use geometry::{Camera, PixelMap};
use std::ops::Range;

/// Neighbours in time, of one camera.
#[derive(Clone, Debug)]
pub(super) struct Film {
    /// Its frames.
    pub(super) frames: Range<usize>,
    /// Where the pixels of its frames come from in the pictures; `None` for frames as they were filmed.
    pub(super) map: Option<PixelMap>,
}

/// The frames of one camera of a rig.
#[derive(Debug)]
pub struct RigFrames {
    /// The camera's name in the rig.
    pub camera: String,
    /// Its frames as filmed; the k-th frames of all cameras belong together.
    pub frames: FrameSet,
}

impl FrameSet {
    /// The films of several cameras, one after the other, as one camera without distortion would have taken them: its size and, with
    /// each film's name, where its pixels come from.
    pub(crate) fn of_films(films: Vec<(&str, &Self, PixelMap)>, (width, height): (u32, u32)) -> Self {
        let (mut frames, mut all) = (Vec::new(), Vec::new());
        for (name, film, map) in films {
            let first = frames.len();
            let named = |frame: &Frame| Frame { name: format!("{name}_{}", frame.name), ..frame.clone() };
            frames.extend(film.frames.iter().map(named));
            all.push(Film { frames: first..frames.len(), map: Some(map) });
        }
        Self { films: all, ..Self::of(frames, width, height) }
    }

    /// Refuses frames of another size than a camera's.
    pub(crate) fn check_camera(&self, camera: &Camera) -> Result<(), FacewrightError> {
        if (camera.width, camera.height) == (self.width, self.height) {
            return Ok(());
        }
        let (camera_width, camera_height) = (camera.width, camera.height);
        Err(FacewrightError::OtherCamera { camera_width, camera_height, width: self.width, height: self.height })
    }

    /// The frames of each film.
    pub(crate) fn films(&self) -> impl Iterator<Item = Range<usize>> {
        self.films.iter().map(|film| film.frames.clone())
    }

    pub(super) fn film_of(&self, i: usize) -> Option<&Film> {
        self.films.iter().find(|film| film.frames.contains(&i))
    }

    /// Whether two frames are of one film.
    pub(crate) fn is_one_film(&self, a: usize, b: usize) -> bool {
        self.film_of(a).is_some_and(|film| film.frames.contains(&b))
    }

    /// Fewest frames that tell of a point: two always agree, but for cameras whose places are known they have to do where they took a
    /// picture each.
    pub(crate) fn fewest_sightings(&self) -> usize {
        if self.films.len() > 1 && self.films.len() == self.frames.len() { 2 } else { 3 }
    }
}
