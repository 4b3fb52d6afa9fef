//! What can go wrong with a drawing.

use std::path::PathBuf;

/// Why a drawing cannot be made a file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DrawingError {
    /// The file's name has an extension that is none of a drawing.
    #[error("{path} does not say what kind of drawing to write: end its name in .svg, .pdf or .png")]
    Format {
        /// The file.
        path: PathBuf,
    },
    /// A resolution that no PNG of a page has.
    #[error("the resolution must be from 50 to 600 dots per inch, not {dpi}")]
    Resolution {
        /// Dots per inch.
        dpi: f64,
    },
    /// An encoder failed.
    #[error("the drawing cannot be written: {reason}")]
    Encoding {
        /// What the encoder said.
        reason: String,
    },
}
