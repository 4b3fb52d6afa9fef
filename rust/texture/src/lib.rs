//! From frames with known poses to the texture of a head, and back to pictures of the textured head. No files.
//!
//! # Entry points
//! - [`bake`]: views of a [`Surface`] into one texture, by the paper's method or ours.
//! - [`choose_views`]: the frames of a film that are worth baking.
//! - [`draw`] and [`Painter`]: the textured head through a camera, lit as in a frame.
//! - [`Shading`]: the light of the pictures by camera-space normal.
//!
//! # Conventions
//! Head frame, metres; pixel centres at integers; texture coordinates with `v` up, textures with the top row first;
//! triangles counter-clockwise seen from outside. Colours are display-referred sRGB, weights and gains apply to them.
#![forbid(unsafe_code)]

mod atlas;
mod blend;
mod choice;
mod draw;
mod error;
pub mod fill;
pub mod iris;
mod paper;
mod plane;
mod sample;
pub mod shading;
mod visibility;

pub use atlas::{BakeOptions, Baked, Method, Occluder, Surface, View, ViewReport, bake};
pub use choice::choose_views;
pub use draw::{DrawOptions, Layer, Painter, draw};
pub use error::{TextureError, Warning};
pub use shading::{Reference, Shading};
