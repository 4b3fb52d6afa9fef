//! The size of the head: what it rests on, and how far it can be trusted.

use super::head_motion::PointMotion;
use crate::faces::median;
use crate::{FacewrightError, FrameTracks, KnownLength, Scale, Tracks};
use geometry::{Camera, Transform};

/// What a length on a face can be measured to, metres.
const LENGTH_SIGMA_M: f64 = 0.0005;

/// A factor by which everything is to grow, and what that rests on.
pub(super) struct Size {
    pub factor: f64,
    pub scale: Scale,
}

/// What the landmarks make of the size: their head is as wide in the pictures as the solved one.
pub(super) fn by_landmarks(
    tracks: &Tracks,
    poses: &[Option<Transform>],
    camera: &Camera,
    interocular: Option<f64>,
) -> Result<Size, FacewrightError> {
    let focal = tracks.camera.camera.fx;
    let ratio = |(frame, pose): (&FrameTracks, &Option<Transform>)| {
        let (theirs, ours) = (frame.cam_from_head?.translation.z / focal, pose.as_ref()?.translation.z / camera.fx);
        Some(theirs / ours)
    };
    let factor = median(tracks.frames.iter().zip(poses).filter_map(ratio));
    let scale = Scale::of_eyes(interocular);
    let Some(wanted) = interocular else { return Ok(Size { factor, scale }) };
    let theirs = tracks.interocular.filter(|metres| *metres > 0.0).ok_or(FacewrightError::NoPupils)?;
    Ok(Size { factor: factor * wanted / theirs, scale })
}

/// What measured lengths make of it: their mean, each by its certainty.
pub(super) fn by_lengths(points: &[PointMotion], lengths: &[KnownLength]) -> Result<Size, FacewrightError> {
    let place =
        |id: usize| points.iter().find(|point| point.id == id && !point.moves).ok_or(FacewrightError::Length { id });
    let (mut weights, mut sum) = (0.0, 0.0);
    for known in lengths {
        let (a, b) = (place(known.from)?, place(known.to)?);
        let found = (a.position() - b.position()).norm();
        if !(known.length > 0.0 && known.length.is_finite() && found > 0.0) {
            return Err(FacewrightError::Option { name: "a length", expected: "positive, between two points" });
        }
        let sigma = (a.sigma_mm.hypot(b.sigma_mm) / 1000.0 / found).hypot(LENGTH_SIGMA_M / known.length);
        let weight = 1.0 / (sigma * sigma);
        weights += weight;
        sum += weight * known.length / found;
    }
    let source = match lengths {
        [one] => format!("distance between points {} and {}, given as {:.1} mm", one.from, one.to, 1000.0 * one.length),
        several => format!("{} lengths measured on the head", several.len()),
    };
    Ok(Size { factor: sum / weights, scale: Scale::measured(source, (1.0 / weights).sqrt()) })
}
