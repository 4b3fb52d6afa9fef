//! The paper's eyes (section 2.8) in the place of the eyeballs.
//!
//! # Entry point
//! [`put`].
//!
//! The eyeballs fitted before say where the circles are. Shape keys and textures are made with eyeballs, which hold the lids and hide
//! the sockets; so the eyes are exchanged last, and the sockets, which were drawn onto the balls, open again. The circles rest; the
//! corners on the socket go with the lids.

use super::eye_uv;
use crate::head::eyes::Eyes;
use crate::result::PartShape;
use crate::{FacewrightError, Reconstruction};
use geometry::Vec3;
use head::eyes::{EyeOptions, fit_eyes};
use head::eyes_paper::{PaperEye, paper_eye};
use head::{GenericHead, Key, part};

/// Puts the paper's eyes where the eyeballs of a result were fitted, left one first.
///
/// # Errors
/// [`head::HeadError`] for a result that is not of the generic head's topology.
pub fn put(result: &mut Reconstruction, head: &GenericHead, eyes: &Eyes) -> Result<(), FacewrightError> {
    result.positions.clone_from(&eyes.open);
    let usual = fit_eyes(head, &head.positions, &[None; 2], &EyeOptions::default())?;
    let shape = |side: usize| -> Result<PartShape, FacewrightError> {
        let generic = paper_eye(head, &head.positions, side, &usual[side])?;
        let own = paper_eye(head, &result.positions, side, &eyes.fits[side])?;
        Ok(part_shape(side, own, generic, &result.keys))
    };
    let [left, right] = [shape(0)?, shape(1)?];
    result.replace_part(part::EYE_LEFT, left);
    result.replace_part(part::EYE_RIGHT, right);
    Ok(())
}

fn part_shape(side: usize, own: PaperEye, generic: PaperEye, keys: &[Key]) -> PartShape {
    PartShape {
        uvs: own.quads.iter().map(|quad| quad.map(|v| eye_uv(side, &own.across[v as usize]))).collect(),
        keys: keys.iter().map(|key| with_lids(&own, key)).collect(),
        positions: own.positions,
        generic_positions: generic.positions,
        quads: own.quads,
    }
}

/// What a key adds to the corners on the socket.
fn with_lids(eye: &PaperEye, key: &Key) -> Vec<(u32, Vec3)> {
    let of = |v: u32| key.offsets.binary_search_by_key(&v, |o| o.0).map_or(Vec3::zeros(), |i| key.offsets[i].1);
    let first = eye.positions.len() - eye.socket.len();
    let offsets =
        eye.socket.iter().enumerate().map(|(i, ([a, b], share))| ((first + i) as u32, of(*a).lerp(&of(*b), *share)));
    offsets.filter(|(_, d)| *d != Vec3::zeros()).collect()
}
