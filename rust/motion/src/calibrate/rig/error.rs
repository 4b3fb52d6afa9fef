//! Why there is no rig, and why to trust one less.

use crate::calibrate::{CalibrateError, CalibrateWarning};
use serde::{Deserialize, Serialize};

/// Why there is no rig.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RigError {
    /// Fewer than two cameras.
    #[error("a rig needs at least two cameras, and {cameras} were given")]
    TooFewCameras {
        /// Their number.
        cameras: usize,
    },
    /// Cameras with different numbers of moments.
    #[error(
        "camera {} has {found} pictures, camera 1 has {expected}: give one for each moment, in the same order",
        .camera + 1
    )]
    MomentCount {
        /// Its index.
        camera: usize,
        /// Its moments.
        found: usize,
        /// The first camera's.
        expected: usize,
    },
    /// A board that looks the same after no turn at all.
    #[error("a board looks the same after 1, 2 or 4 equal rotations, not after {turns}")]
    InvalidSymmetry {
        /// Turns given.
        turns: u32,
    },
    /// A camera that can't be calibrated alone. Pictures are counted by moments.
    #[error("camera {}: {source}", .camera + 1)]
    Camera {
        /// Its index.
        camera: usize,
        /// Why.
        source: CalibrateError,
    },
    /// A camera that never sees the board together with the others.
    #[error(
        "camera {} never sees the board at the same moment as camera 1, nor as one that does: show it to both at once",
        .camera + 1
    )]
    Unconnected {
        /// Its index.
        camera: usize,
    },
    /// Cameras that see the board together, but never twice from the same places.
    #[error(
        "cameras {} and {} see the board together {moments} times, but no two of these agree on how they stand: were \
         the pictures taken at the same moments, and did the cameras stay in place?",
        .camera + 1, .other + 1
    )]
    Disagreement {
        /// One.
        camera: usize,
        /// The other.
        other: usize,
        /// Moments at which both see the board.
        moments: usize,
    },
    /// All together do not determine what they should.
    #[error(
        "the pictures do not determine where the cameras are: show the board to all cameras, tilted to different sides"
    )]
    Degenerate,
}

/// A reason to trust a rig less.
#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum RigWarning {
    /// Of one camera. Pictures are counted by moments.
    #[error("camera {}: {warning}", .camera + 1)]
    Camera {
        /// Its index.
        camera: usize,
        /// What.
        warning: CalibrateWarning,
    },
    /// Of all pictures together.
    #[error(transparent)]
    Rig(CalibrateWarning),
    /// A picture that contradicts the others was left out.
    #[error(
        "picture {} of camera {} was left out: it shows the board in a different place than the others do, as if taken at another moment",
        .moment + 1, .camera + 1
    )]
    LeftOut {
        /// Its camera.
        camera: usize,
        /// Its moment.
        moment: usize,
    },
    /// Two cameras share little.
    #[error(
        "cameras {} and {} are connected by {moments} moments only: show the board to both more often",
        .camera + 1, .other + 1
    )]
    FewMoments {
        /// One.
        camera: usize,
        /// The other.
        other: usize,
        /// Moments at which both see the board and agree.
        moments: usize,
    },
    /// The board looks the same turned, and nothing tells how it was.
    #[error(
        "the rotation between cameras {} and {} is a guess, because the board looks the same after a rotation: show it \
         at more moments, in different places, or use one with an odd number of corners along one side",
        .camera + 1, .other + 1
    )]
    AmbiguousTurn {
        /// One.
        camera: usize,
        /// The other.
        other: usize,
    },
}
