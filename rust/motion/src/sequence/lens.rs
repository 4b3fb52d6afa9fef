//! Whether the picture is a whole picture: one whose principal point lies far from its middle is a part of another.
//!
//! A part of a picture fits no camera that looks straight ahead: the head seems to turn and come nearer as it moves aside. The
//! misfit tells such a picture, not the principal point: on films of whole pictures that wanders by a tenth of the width and
//! gains nothing.

use super::grow::Reconstruction;
use crate::MotionError;
use crate::bundle::{Bundle, BundleOptions, adjust, residuals};
use geometry::{Progress, median};

/// The tracks contradict the lens where another lowers their median squared distance by more than this part. A free principal point and
/// `k1` gain up to 5 % of the squared distances on films of whole pictures, 23 to 29 % on parts of pictures whose head is 20° and more
/// off the axis; at 15° the gain is less than this, and the focal length 6 % off.
const CONTRADICTION: f64 = 0.12;
/// Steps of a principal point that goes far, and what a step must lower the cost by: with a turn of the head it is nearly free.
const STEPS: usize = 60;
const FAR_COST: f64 = 1e-8;

impl Reconstruction<'_> {
    /// Whether something holds turn, shift and scale of the head: initial poses, or else the points' places alone.
    pub(super) fn is_anchored(&self) -> bool {
        let by_points = self.is_lens_free && self.options.point_priors.len() >= 3;
        by_points || self.anchors.iter().any(Option::is_some)
    }

    /// Whether the lens is kept although it is not known for certain, and could be refined: points hold the head frame.
    pub(super) fn may_free_lens(&self) -> bool {
        let may = self.options.refine_focal && self.options.lens_prior.is_some();
        may && !self.is_lens_free && self.options.point_priors.len() >= 3
    }

    /// Refines the lens too, and takes it over with all that follows if the tracks ask for it.
    pub(super) fn try_free_lens(&mut self, progress: &Progress) -> Result<(), MotionError> {
        let before = self.bundle(1.0);
        let (mut free, anchors) = (before.clone(), std::mem::take(&mut self.anchors));
        self.anchors = vec![None; anchors.len()];
        self.is_lens_free = true;
        let options = BundleOptions { relative_cost: FAR_COST, ..self.bundle_options(STEPS, true) };
        adjust(&mut free, &options, progress)?;
        self.is_lens_free = misfit(&free) < (1.0 - CONTRADICTION) * misfit(&before);
        if self.is_lens_free {
            self.adopt(&free);
            self.weigh();
        } else {
            self.anchors = anchors;
        }
        Ok(())
    }
}

/// Median squared distance of all observations from their points, standard deviations.
fn misfit(bundle: &Bundle) -> f64 {
    let squares = residuals(bundle).into_iter().map(|r| r.map_or(f64::INFINITY, |r| r * r));
    median(squares).unwrap_or(0.0)
}
