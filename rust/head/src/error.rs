//! What can go wrong with a head.

/// Errors of this crate.
#[derive(Debug, thiserror::Error)]
pub enum HeadError {
    /// The bytes are no generic head, or one of another version.
    #[error("this is not a generic head of this version ({reason}): install Facewright again")]
    Format {
        /// What was missing or wrong.
        reason: String,
    },
    /// A frame's landmarks are not those of the generic head.
    #[error(
        "frame {frame} has {found} landmarks where the head has {wanted}: use the landmark net that the head was built with"
    )]
    Landmarks {
        /// Which frame.
        frame: usize,
        /// Landmarks (or standard deviations) given.
        found: usize,
        /// Anchors of the head.
        wanted: usize,
    },
    /// Not one frame shows enough landmarks to place the head.
    #[error(
        "no frame shows a face well enough to place the head: film the face from the front, larger and in better light"
    )]
    NoFace,
    /// Hardly any point of the cloud lies near the head.
    #[error("only {near} tracked points lie on the face: film with more light and less blur, or turn more slowly")]
    NoCloud {
        /// Points within reach.
        near: usize,
    },
    /// Feature points that carry nothing.
    #[error(
        "{features} feature points are too few, or too close to one place, to shape a head: track more of the face"
    )]
    Deform {
        /// Features given.
        features: usize,
    },
    /// The length that should fix the head's size is missing, zero or not a number.
    #[error("the size of the head cannot be found: give a length greater than zero between two different landmarks")]
    NoSize,
    /// A mesh that is not of the generic head's topology.
    #[error("the head has {found} vertices where the generic head has {wanted}: both must have one topology")]
    Topology {
        /// Vertices given.
        found: usize,
        /// Vertices of the generic head.
        wanted: usize,
    },
    /// Vertices that are no numbers, or all in one place.
    #[error("the head's shape is degenerate near {place}: fit it again with more frames")]
    Degenerate {
        /// Which part or key.
        place: String,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] geometry::Cancelled),
}
