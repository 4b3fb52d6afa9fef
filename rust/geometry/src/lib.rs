//! Nouns and pure mathematics shared by every layer: no pixels, no files.
//!
//! # Entry points
//! - [`Camera`]: pinhole with radial and tangential terms; project, undistort.
//! - [`Transform`]: rigid motion, always named `b_from_a`.
//! - [`Similarity`]: rigid motion with scale, and its least-squares fit.
//! - [`face_mesh`]: the numbering of the 468 landmarks.
//! - [`mesh`]: triangles, quads, normals, closest points.
//! - [`least_squares`]: robust losses and a dense Levenberg–Marquardt driver.
//! - [`Spread`]: places evenly spread over others.
//! - [`SmoothField`]: vectors between scattered values, zero far from them.
//! - [`rbf`]: affine + radial basis function warps (paper, eq. 8–10).
//! - [`median`], [`smooth_step`], [`SplitMix64`]: the middle of numbers, a soft threshold, random bits.
//! - [`Progress`]: what a long loop reports to, and how it is cancelled.
//!
//! # Conventions
//! Metres, radians, pixels. Cameras look along +z, x right, y down, pixel centres at integers.
//! Transforms are `b_from_a`; points are `x_in_a`. The head frame has its origin between the eyes,
//! +x to the subject's left, +y up, +z out of the face.
#![forbid(unsafe_code)]

mod board;
mod camera;
pub mod face_mesh;
mod farthest;
mod field;
pub mod least_squares;
mod median;
pub mod mesh;
mod progress;
pub mod rbf;
mod similarity;
mod smooth_step;
mod split_mix;
mod transform;
mod undistort;

pub use board::{Board, Pattern};
pub use camera::{Camera, CameraError, CameraJacobian};
pub use farthest::Spread;
pub use field::SmoothField;
pub use median::median;
pub use progress::{Cancelled, Progress, ProgressSnapshot, Sketch};
pub use similarity::Similarity;
pub use smooth_step::smooth_step;
pub use split_mix::SplitMix64;
pub use transform::{Transform, skew};
pub use undistort::{Pinhole, PixelMap};

/// A point or direction in space, metres unless a name says otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A point or direction in the image, pixels, or normalised camera coordinates.
pub type Vec2 = nalgebra::Vector2<f64>;
/// A 3×3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
