//! What other commands have found, from Python: classes, or the texts of their files.

use crate::files::{Camera, Motion, Or, Rig, Tracks};
use facewright::{CalibratedRig, Given, RigTracks, SourcedCamera};
use pyo3::prelude::*;

/// A camera, where one is given.
pub(crate) fn camera(known: Option<&Or<Camera>>) -> PyResult<Option<SourcedCamera>> {
    known.map(Or::sourced).transpose()
}

/// A rig and the tracks of its cameras by their names.
pub(crate) fn films(films: &[(String, Or<Tracks>)], rig: &Or<Rig>) -> PyResult<(Vec<RigTracks>, CalibratedRig)> {
    let film =
        |(camera, tracks): &(String, Or<Tracks>)| Ok(RigTracks { camera: camera.clone(), tracks: tracks.core()? });
    Ok((films.iter().map(film).collect::<PyResult<_>>()?, rig.core()?))
}

/// All that is known of a clip.
pub(crate) fn given(
    known_camera: Option<&Or<Camera>>,
    known_tracks: Option<&Or<Tracks>>,
    known_motion: Option<&Or<Motion>>,
) -> PyResult<Given> {
    Ok(Given {
        camera: camera(known_camera)?,
        tracks: known_tracks.map(Or::<Tracks>::core).transpose()?,
        motion: known_motion.map(Or::<Motion>::core).transpose()?,
        ..Given::default()
    })
}
