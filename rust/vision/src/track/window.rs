//! The shape of a square window and the weights of its pixels.

use super::lanes::{Eight, LANES};

/// Rows that a strip has room for.
pub(super) const ROWS: usize = 32;

/// The shape of a square window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub half: usize,
    pub side: usize,
}

impl Window {
    pub fn new(side: usize) -> Self {
        Self { half: side / 2, side }
    }

    /// Strips of eight columns.
    pub fn strips(&self) -> usize {
        self.side.div_ceil(LANES)
    }
}

/// Weights of the pixels, in strips of eight columns; zero beside the window.
#[derive(Clone)]
pub(super) struct Weights<const STRIPS: usize> {
    pub lines: [[Eight; ROWS]; STRIPS],
    /// One for the columns of the window.
    pub mask: [Eight; STRIPS],
    /// Σ w.
    pub total: f64,
    /// (Σ w)² / Σ w²: as many pixels of the same weight say as much.
    pub effective: f64,
}

impl<const STRIPS: usize> Weights<STRIPS> {
    /// All alike, or a Gaussian whose standard deviation is this part of half the window.
    pub fn new(window: Window, sigma: Option<f64>) -> Self {
        let half = window.half as f64;
        let of = |i: usize| {
            let x = (i as f64 - half) / half;
            sigma.map_or(1.0, |sigma| (-0.5 * (x / sigma).powi(2)).exp())
        };
        let (mut lines, mut mask) = ([[[0.0; LANES]; ROWS]; STRIPS], [[0.0; LANES]; STRIPS]);
        let (mut total, mut squares) = (0.0, 0.0);
        for i in 0..window.side {
            mask[i / LANES][i % LANES] = 1.0;
            for (j, line) in lines[i / LANES].iter_mut().take(window.side).enumerate() {
                let weight = of(i) * of(j);
                line[i % LANES] = weight as f32;
                total += weight;
                squares += weight * weight;
            }
        }
        Self { lines, mask, total, effective: total * total / squares }
    }
}
