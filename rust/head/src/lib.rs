//! The generic head and what is done with it: linear class, fit, deformation, expressions, eyes. No pixels, no files.
//!
//! # Entry points
//! - [`GenericHead`]: topology, UVs, identity class, expression keys, landmark anchors.
//! - [`fit::fit_landmarks`], [`fit::fit_cloud`]: from observations to the person's head.
//! - [`deform`]: warps the whole head to measured features.
//! - [`features::align_features`]: lips, lids and brows slid to where the frames show them.
//! - [`surface::SkinSurface`]: closest points on the skin.
//! - [`transfer::KeyTransfer`]: all expression keys transferred to the person.
//! - [`neutral::Rest`]: the face at rest. [`extend`], [`soft`], [`ears`],
//!   [`forehead`]: what was not measured, lids and lips, ears in one piece, foreheads without a hollow.
//! - [`unfold::unfold`]: no triangle turned over.
//! - [`eyes`]: eyeballs fitted to sockets and irises; lashes, teeth and tongue. [`eyes_paper`]: the paper's eyes.
//! - [`expressions::expressions`], [`visemes::viseme_keys`]: named sums of keys.
//!
//! # Conventions
//! Head frame: origin between the eyes, +x the subject's left, +y up, +z out of the face; metres. "Left" is the
//! subject's left everywhere. Vertices, quads and keys keep the order of the generic head from the asset to the GLB.
#![forbid(unsafe_code)]

pub mod contact;
pub mod deform;
pub mod ears;
mod error;
pub mod expressions;
pub mod extend;
pub mod eyes;
pub mod eyes_paper;
pub mod features;
pub mod fit;
pub mod forehead;
mod format;
mod generic;
pub mod gradient;
pub mod lips;
pub mod neutral;
pub mod soft;
pub mod surface;
#[cfg(test)]
mod testing;
pub mod transfer;
pub mod unfold;
pub mod visemes;
pub mod warp;

pub use error::HeadError;
pub use generic::{Anchor, GenericHead, IdentityClass, Key, Part, part};
