//! The reference patch at one level: its pixels, its steepest-descent images and its Hessian, all computed once.
//!
//! With gain and bias compensated, the steepest-descent images are made orthogonal to the patch and to the constant
//! ("project out", Hager and Belhumeur 1998), so that a step solved with them is the step of the joint problem and
//! iterations cost nothing more.

use super::sampler::{Region, Window, dot};
use crate::pyramid::{Interpolation, Level};
use geometry::Vec2;
use nalgebra::{Matrix2, SMatrix};

/// Unknowns: a shift and, for the affine model, the four entries of a small warp.
pub(super) const AFFINE: usize = 6;
/// Unknowns of a shift.
pub(super) const SHIFT: usize = 2;

/// A reference patch, ready to be looked for.
#[derive(Default)]
pub(super) struct Template {
    /// Grey levels minus [`Template::mean`]; zero in the padding.
    pub values: Vec<f32>,
    pub mean: f32,
    /// Σ values².
    pub energy: f64,
    /// Steepest-descent images: slope along x and y, then (affine) each of them times dx / half and dy / half.
    pub descent: [Vec<f32>; AFFINE],
    /// Σ of products of the steepest-descent images.
    pub hessian: SMatrix<f64, AFFINE, AFFINE>,
    /// Σ of products of each steepest-descent image with the values; zero when projected out.
    pub constant: [f64; AFFINE],
    /// The patch with one more pixel all round.
    framed: Vec<f32>,
    region: Region,
}

impl Template {
    /// Takes the patch around `centre`, with the steepest-descent images of the first `unknowns` unknowns.
    pub fn take(
        &mut self,
        level: &Level,
        centre: &Vec2,
        window: Window,
        interpolation: Interpolation,
        unknowns: usize,
        gain_bias: bool,
    ) {
        let frame = Window::new(window.side + 2);
        self.region.clear();
        self.region.read(level, centre, &Matrix2::identity(), frame, interpolation, 0.0, &mut self.framed);
        self.copy_values(window, frame);
        self.copy_slopes(window, frame);
        if unknowns == AFFINE {
            self.multiply_slopes(window);
        }
        for k in 0..unknowns {
            if gain_bias {
                self.project_out(k, window);
            }
            self.constant[k] = if gain_bias { 0.0 } else { dot(&self.descent[k], &self.values) };
        }
        for i in 0..unknowns {
            for j in 0..=i {
                let sum = dot(&self.descent[i], &self.descent[j]);
                self.hessian[(i, j)] = sum;
                self.hessian[(j, i)] = sum;
            }
        }
    }

    /// The paper's `G`, with gain and bias taken out if asked for.
    pub fn shift_hessian(&self) -> Matrix2<f64> {
        self.hessian.fixed_view::<SHIFT, SHIFT>(0, 0).into()
    }

    fn copy_values(&mut self, window: Window, frame: Window) {
        self.values.clear();
        self.values.resize(window.len(), 0.0);
        let mut sum = 0.0;
        for (j, line) in self.values.chunks_exact_mut(window.pitch).enumerate() {
            let line = &mut line[..window.side];
            line.copy_from_slice(&self.framed[(j + 1) * frame.pitch + 1..][..window.side]);
            sum += line.iter().sum::<f32>();
        }
        self.mean = sum / window.count() as f32;
        for line in self.values.chunks_exact_mut(window.pitch) {
            line[..window.side].iter_mut().for_each(|value| *value -= self.mean);
        }
        self.energy = dot(&self.values, &self.values);
    }

    /// Scharr's derivative, in grey levels per pixel.
    fn copy_slopes(&mut self, window: Window, frame: Window) {
        const SIDE: f32 = 3.0 / 32.0;
        const MIDDLE: f32 = 10.0 / 32.0;
        let [gx, gy, ..] = &mut self.descent;
        for slope in [&mut *gx, &mut *gy] {
            slope.clear();
            slope.resize(window.len(), 0.0);
        }
        let lines = gx.chunks_exact_mut(window.pitch).zip(gy.chunks_exact_mut(window.pitch));
        for (j, (gx, gy)) in lines.enumerate() {
            let [above, here, below] = [0, 1, 2].map(|k| &self.framed[(j + k) * frame.pitch..][..window.side + 2]);
            let (gx, gy) = (&mut gx[..window.side], &mut gy[..window.side]);
            for i in 0..window.side {
                gx[i] = SIDE * (above[i + 2] - above[i] + below[i + 2] - below[i]) + MIDDLE * (here[i + 2] - here[i]);
                gy[i] =
                    SIDE * (below[i] - above[i] + below[i + 2] - above[i + 2]) + MIDDLE * (below[i + 1] - above[i + 1]);
            }
        }
    }

    /// The steepest-descent images of the warp's entries, from the slopes.
    fn multiply_slopes(&mut self, window: Window) {
        let (half, [gx, gy, products @ ..]) = (window.half as f32, &mut self.descent);
        for (k, product) in products.iter_mut().enumerate() {
            let (slope, along_x) = (if k < 2 { &*gx } else { &*gy }, k % 2 == 0);
            product.clear();
            product.resize(window.len(), 0.0);
            for (j, (out, slope)) in
                product.chunks_exact_mut(window.pitch).zip(slope.chunks_exact(window.pitch)).enumerate()
            {
                let dy = (j as f32 - half) / half;
                for (i, (out, slope)) in out.iter_mut().zip(slope).enumerate() {
                    *out = slope * if along_x { (i as f32 - half) / half } else { dy };
                }
            }
        }
    }

    /// Makes a steepest-descent image orthogonal to the constant and to the values.
    fn project_out(&mut self, k: usize, window: Window) {
        let image = &mut self.descent[k];
        let mean = image.iter().sum::<f32>() / window.count() as f32;
        let along = if self.energy > 0.0 { (dot(image, &self.values) / self.energy) as f32 } else { 0.0 };
        let lines = image.chunks_exact_mut(window.pitch).zip(self.values.chunks_exact(window.pitch));
        for (image, values) in lines {
            for (image, value) in image.iter_mut().zip(values).take(window.side) {
                *image -= mean + along * value;
            }
        }
    }
}
