//! The lips closed and the eyeballs fitted to sockets and irises.

use super::Measured;
use crate::FacewrightError;
use crate::faces::{Clip, median, yaw_pitch};
use geometry::{Transform, Vec3};
use head::eyes::{EyeFit, EyeOptions, carry_parts, fit_eyes, place_eyes};
use head::lips::close_lips;
use head::unfold::unfold;
use motion::triangulate::triangulate;

/// Frames turned further than this do not tell where the gaze usually is, degrees.
const FRONTAL_DEG: f64 = 12.0;

/// Eyeballs, fitted and placed.
pub struct Eyes {
    /// Left one first.
    pub fits: [EyeFit; 2],
    /// All vertices before the hidden skin of the sockets was drawn onto the eyeballs.
    pub open: Vec<Vec3>,
}

/// Closes the lips, fits the eyeballs and takes lashes, teeth and tongue along.
pub fn finish(clip: &Clip, measured: &mut Measured) -> Result<Eyes, FacewrightError> {
    let irises = [0, 1].map(|side| iris_radius(clip, measured, side));
    let (head, positions) = (clip.head, &mut measured.positions);
    close_lips(head, positions)?;
    unfold(head, positions);
    carry_parts(head, positions)?;
    let fits = fit_eyes(head, positions, &irises, &EyeOptions::default())?;
    let open = positions.clone();
    place_eyes(head, positions, &fits)?;
    Ok(Eyes { fits, open })
}

/// Radius of an iris, metres, from the frames in which the person looks at about the same place of the head's own frame as usual: while
/// the head turns, the gaze may stay on the camera, and then only near-frontal frames agree on how far away it is.
fn iris_radius(clip: &Clip, measured: &Measured, side: usize) -> Option<f64> {
    let camera = &measured.camera;
    let frontal = |pose: &Transform| yaw_pitch(pose).0.abs().to_degrees() < FRONTAL_DEG;
    let (mut rays, mut diameters) = (Vec::new(), Vec::new());
    for (index, pose) in measured.chosen_poses() {
        let iris = clip.faces.face(index).map(|face| &face.irises[side]);
        let Some(iris) = iris.filter(|iris| iris.visible && frontal(&pose)) else { continue };
        rays.push((pose, camera.normalise(&iris.centre)));
        diameters.push(iris.radius / camera.fx);
    }
    let found = triangulate(&rays)?;
    let depths = rays.iter().zip(&diameters).map(|((pose, _), d)| d * pose.apply(&found.point).z);
    Some(median(depths))
}
