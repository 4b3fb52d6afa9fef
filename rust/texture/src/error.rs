//! What can be wrong with the input of this crate, and what is worth telling about its output.

use geometry::{CameraError, Cancelled};

/// Why there is no texture or no picture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TextureError {
    /// No view was given.
    #[error("there is no frame to take the texture from: give at least one frame that shows the face")]
    NoViews,
    /// No view shows any part of the surface.
    #[error("none of the {views} frames shows the head from outside: check the camera poses and the masks")]
    HeadNotSeen {
        /// How many views were given.
        views: usize,
    },
    /// The surface has no triangles, or none of them covers a texel.
    #[error("the head has no faces with texture coordinates: unwrap it first")]
    NoTexels,
    /// Two arrays of the surface do not fit each other.
    #[error("the head has {found} {what}, but {expected} are needed: unwrap or export it again")]
    LengthMismatch {
        /// Which array.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A triangle or a mirror index points behind the last vertex.
    #[error("a {what} of the head names vertex {index}, but there are only {vertices}")]
    IndexOutOfRange {
        /// What names the vertex.
        what: &'static str,
        /// The index.
        index: u32,
        /// Number of vertices.
        vertices: usize,
    },
    /// A position or a texture coordinate is not finite.
    #[error("a {what} of the head is not a finite number: repair the mesh")]
    NotFinite {
        /// Which array.
        what: &'static str,
    },
    /// A picture or a mask has another size than the camera says.
    #[error("the {what} of frame {view} is {found:?} pixels, but the camera is {expected:?}: frames of one size only")]
    SizeMismatch {
        /// Picture or mask.
        what: &'static str,
        /// Number of the view, from 0.
        view: usize,
        /// Width and height.
        found: (u32, u32),
        /// Width and height of the camera.
        expected: (u32, u32),
    },
    /// An option has no meaning.
    #[error("{name} is {value}, but it must be {range}")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// The camera makes no sense.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// What the user should know about a texture that was made all the same.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Warning {
    /// A view shows nothing of the surface and was left out.
    #[error("frame {view} does not show the head and was left out of the texture")]
    ViewWithoutHead {
        /// Number of the view, from 0.
        view: usize,
    },
    /// The views overlap too little to tell the light from the skin.
    #[error("the frames overlap too little to separate the light from the skin: the light stays in the texture")]
    NoShading,
    /// Most of the surface was seen by no view.
    #[error("the frames show only {percent:.0} % of the head's surface: the rest is filled with nearby skin")]
    LowCoverage {
        /// Share of texels that were seen, percent.
        percent: f64,
    },
}
