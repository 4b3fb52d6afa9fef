//! Scenes with known truth, for tests and benches only.
//!
//! # Entry points
//! - [`Scene::turning_head`]: a head-like cloud of points turning in front of a still camera, with noise, wrong matches and a
//!   background that stands still.
//! - [`Skin`]: pictures of a round piece of skin with a known relief.
//! - [`Random`]: a small seeded generator, uniform and normal.
//!
//! # Conventions
//! As in `geometry`: metres, radians, pixels; the camera looks along +z; the head frame has its origin between the eyes,
//! +x the subject's left, +y up, +z out of the face. The same options give the same bytes.
#![forbid(unsafe_code)]

mod noise;
mod scene;
mod skin;

pub use noise::Random;
pub use scene::{Observation, Scene, SceneOptions, head_from_turn, head_normal, head_radius, head_surface};
pub use skin::{Skin, SkinOptions};
