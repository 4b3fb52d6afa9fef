//! The person in the frames that are worked with, told from what is behind.

use super::Faces;
use crate::{FacewrightError, FrameSet};
use std::sync::{Arc, Mutex, PoisonError};
use vision::landmarks::{FaceLandmarker, PersonMask};

/// The person of each frame that somebody has asked for.
pub struct People<'a> {
    landmarker: &'a FaceLandmarker,
    found: Vec<Mutex<Option<Arc<PersonMask>>>>,
}

impl<'a> People<'a> {
    /// Nobody has asked so far.
    pub fn new(landmarker: &'a FaceLandmarker, frames: usize) -> Self {
        Self { landmarker, found: (0..frames).map(|_| Mutex::new(None)).collect() }
    }

    /// The person in a frame; `None` where the nets saw no face, or did not look.
    pub fn of(
        &self,
        frame: usize,
        frames: &FrameSet,
        faces: &Faces,
    ) -> Result<Option<Arc<PersonMask>>, FacewrightError> {
        let Some(face) = faces.face(frame) else { return Ok(None) };
        // Whoever asks for the same frame waits; nothing panics between two states.
        let mut found = self.found[frame].lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(mask) = &*found {
            return Ok(Some(mask.clone()));
        }
        let picture = frames.picture(frame)?;
        let mask = Arc::new(self.landmarker.person(&picture, face)?);
        *found = Some(mask.clone());
        Ok(Some(mask))
    }
}
