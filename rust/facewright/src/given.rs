//! What is known of a clip already.

use crate::{Faces, FacewrightError, FrameSet, HeadMotion, SourcedCamera, Tracks};

/// What other commands have found of a clip; what is missing is found anew.
#[derive(Clone, Debug, Default)]
pub struct Given {
    /// Calibrated camera; without it the focal length comes from EXIF or the landmarks, and is refined.
    pub camera: Option<SourcedCamera>,
    /// Faces in the same frames, instead of looking for them.
    pub faces: Option<Faces>,
    /// Tracks of the same frames, instead of tracking.
    pub tracks: Option<Tracks>,
    /// Motion of the same frames, instead of solving for it.
    pub motion: Option<HeadMotion>,
}

impl Given {
    /// Refuses what belongs to another clip.
    pub(crate) fn check(&self, frames: &FrameSet) -> Result<(), FacewrightError> {
        self.faces.as_ref().map_or(Ok(()), |faces| faces.check(frames))?;
        self.tracks.as_ref().map_or(Ok(()), |tracks| tracks.check(frames))?;
        self.motion.as_ref().map_or(Ok(()), |motion| motion.check(frames))
    }
}
