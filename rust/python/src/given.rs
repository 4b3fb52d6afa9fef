//! What other commands wrote, from Python: the only place that knows in which form it comes.

use crate::error::raise;
use facewright::{CalibratedRig, FacewrightError as CoreError, Given, HeadMotion, RigTracks, SourcedCamera, Tracks};
use pyo3::prelude::*;
use std::path::Path;

/// A camera.json.
pub(crate) fn camera(text: &str) -> PyResult<SourcedCamera> {
    SourcedCamera::parse(text).map_err(|e| raise(&e))
}

/// A tracks.json.
pub(crate) fn tracks(text: &str) -> PyResult<Tracks> {
    Tracks::parse(text).map_err(|e| raise(&e))
}

/// A motion.json.
pub(crate) fn motion(text: &str) -> PyResult<HeadMotion> {
    let read = |e: serde_json::Error| CoreError::Read { path: Path::new("motion.json").into(), reason: e.to_string() };
    serde_json::from_str(text).map_err(|e| raise(&read(e)))
}

/// A rig.json.
pub(crate) fn rig(text: &str) -> PyResult<CalibratedRig> {
    CalibratedRig::parse(text).map_err(|e| raise(&e))
}

/// The tracks of a rig's cameras by their names.
pub(crate) fn rig_tracks(films: &[(String, String)]) -> PyResult<Vec<RigTracks>> {
    films.iter().map(|(camera, text)| Ok(RigTracks { camera: camera.clone(), tracks: tracks(text)? })).collect()
}

/// All that is known of a clip.
pub(crate) fn given(
    known_camera: Option<&str>,
    known_tracks: Option<&str>,
    known_motion: Option<&str>,
) -> PyResult<Given> {
    let known = Given { camera: known_camera.map(camera).transpose()?, ..Given::default() };
    Ok(Given { tracks: known_tracks.map(tracks).transpose()?, motion: known_motion.map(motion).transpose()?, ..known })
}
