//! From the shape as filmed to the whole head at rest.

use super::{Measured, features, unseen};
use crate::FacewrightError;
use crate::faces::Clip;
use geometry::Vec3;
use head::forehead::fill_forehead;
use head::soft::set_soft_parts;

/// All vertices: the expression that the person wore all along is taken away, what no frame measured is replaced, lids and lips are those of
/// the class and lie where the frames show them.
///
/// # Errors
/// [`head::HeadError`].
pub fn finish(clip: &Clip, measured: &Measured) -> Result<Vec<Vec3>, FacewrightError> {
    let (head, fit) = (clip.head, &clip.landmark_fit);
    let rest = &clip.rest;
    let calm = rest.apply(head, &measured.positions, fit.scale);
    let mut whole = unseen::replace_unseen(head, &calm, &measured.points);
    fill_forehead(head, &mut whole);
    let form = rest.apply(head, &head.with_identity(&fit.coefficients), 1.0);
    let soft = set_soft_parts(head, &whole, &form, rest.mouth_moved);
    features::align(clip, measured, &soft)
}
