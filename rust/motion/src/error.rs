//! What can go wrong between observations and cameras, in sentences a user can act on.

use geometry::Cancelled;

/// Why motion or structure could not be found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MotionError {
    /// Two frames share too little.
    #[error(
        "only {found} points are matched between these two frames and {needed} are needed: \
         choose frames closer together, or track more points on the face"
    )]
    TooFewMatches {
        /// Matches given.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// The two frames show the same view.
    #[error(
        "the head hardly turns between these two frames ({agree} of {total} points move as if it did not), \
         so its depth cannot be measured: choose frames in which it has turned by 10 to 15 degrees"
    )]
    NoParallax {
        /// Matches that a mere turn of the camera explains.
        agree: usize,
        /// Matches.
        total: usize,
    },
    /// The second frame is the first one, larger or smaller.
    #[error(
        "between these two frames the picture is only magnified by {factor:.3} ({agree} of {total} points move so), as a zoom \
         does: switch zoom and autofocus off and let the head turn"
    )]
    OnlyMagnified {
        /// How many times larger.
        factor: f64,
        /// Matches that turning and zooming explain.
        agree: usize,
        /// Matches.
        total: usize,
    },
    /// No motion explains enough matches.
    #[error(
        "no single head motion explains the matches between these two frames (the best explains {agree} of {total}): \
         the face may have changed its expression or the tracks are wrong; choose frames closer together"
    )]
    NoAgreement {
        /// Matches explained by the best motion.
        agree: usize,
        /// Matches.
        total: usize,
    },
    /// A frame sees too few points whose place in space is known.
    #[error("only {found} known points are seen in this frame and {needed} are needed to place the head in it")]
    TooFewPoints {
        /// Points given.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// No head pose explains enough points of a frame.
    #[error(
        "no head pose explains this frame (the best explains {agree} of {total} points): \
         the face may be covered, blurred or changed by an expression"
    )]
    NoPose {
        /// Points explained by the best pose.
        agree: usize,
        /// Points.
        total: usize,
    },
    /// Tables that refer to each other do not fit together.
    #[error("{table} refers to {kind} {index}, but there are only {count}")]
    BadIndex {
        /// The table at fault.
        table: &'static str,
        /// What its index counts.
        kind: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A number that must be finite, or positive, is not.
    #[error("{name} is {value}, which is out of range")]
    BadNumber {
        /// Which number.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// Nothing is left to solve for.
    #[error(
        "there are too few observations ({observations}) to refine {unknowns} unknowns: track more points or longer"
    )]
    Underdetermined {
        /// Observations that count.
        observations: usize,
        /// Unknowns.
        unknowns: usize,
    },
    /// All cameras stand in one place.
    #[error(
        "the head does not turn or move between the frames of these {observations} observations, so depth cannot be \
         measured: start from poses that differ, or film a head that turns"
    )]
    NoDepth {
        /// Observations given.
        observations: usize,
    },
    /// No pair of frames could start the sequence.
    #[error(
        "no two frames could start the reconstruction; the best pair failed because: {reason} \
         Film a head that turns by at least 15 degrees, with an unchanging expression"
    )]
    NoInitialPair {
        /// Why the most promising pair failed.
        reason: String,
    },
    /// Cameras that saw hardly anything together.
    #[error(
        "only {found} points were found by two cameras at the same moment and {needed} are needed: let the cameras see the same \
         side of the face, from directions 10 to 25 degrees apart"
    )]
    FewShared {
        /// Most points of a moment.
        found: usize,
        /// Least number.
        needed: usize,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}
