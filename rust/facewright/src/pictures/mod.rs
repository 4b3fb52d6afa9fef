//! What is drawn for people: the board to print, a calibration, matches. [`crate::files::write_drawing`] writes them.

pub mod board;
pub mod calibration;
pub mod matches;
