//! The surface of a head to a tenth of a millimetre: pixels and a mesh in, positions out. No files.
//!
//! # Entry point
//! [`measure`]: places of the mesh, their distance from the surface along its normals by photo-consistency, and vertices that agree with
//! them and bend as little as they can.
//!
//! [`Detail::maps`]: what the mesh cannot hold, as maps of heights and normals.
//!
//! # Conventions
//! Head frame, metres; pixel centres at integers. A displacement is positive outwards.
#![forbid(unsafe_code)]

mod bend;
mod detail;
mod fine;
mod refine;
mod sheet;
mod view;
mod window;

pub use detail::{Detail, Maps};
pub use refine::{Dense, DenseOptions, Surface, Untouched, measure};
pub use view::View;
