//! Why landmarks cannot be found.

use std::path::PathBuf;

/// What can go wrong before the nets run on a picture. A picture without a face is not an error.
#[derive(Debug, thiserror::Error)]
pub enum LandmarkError {
    /// A net's file is not there.
    #[error("the landmark net {} is missing: install Facewright again", path.display())]
    NetMissing {
        /// Where it should be.
        path: PathBuf,
    },
    /// A net's file cannot be read or is not the net it should be.
    #[error(
        "the landmark net {} cannot be used ({reason}): install Facewright again",
        path.display()
    )]
    NetUnusable {
        /// The file.
        path: PathBuf,
        /// What the reader said.
        reason: String,
    },
    /// The net's computation failed.
    #[error("the landmark net {net} failed ({reason}): install Facewright again")]
    NetFailed {
        /// Its name.
        net: &'static str,
        /// What the runtime said.
        reason: String,
    },
    /// The picture has no pixels.
    #[error("the picture has no pixels: load it again")]
    EmptyPicture,
}
