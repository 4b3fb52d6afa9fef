//! How many texels each place deserves, and how much their evenness matters there.
//!
//! Lengths are in units of the distance from the eye line to the lips, so that a child's head gets the same map.

use super::Sheet;
use geometry::Vec3;

/// What is wanted at a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wish {
    /// Texels per metre, relative to the back of the head.
    pub density: f64,
    /// Weight of distortion.
    pub importance: f64,
}

/// Landmarks that can be read off any sheet.
pub(super) struct Places {
    unit: f64,
    eye: Vec3,
    lips: Vec<Vec3>,
    nose: Vec3,
    ear: Vec3,
}

impl Places {
    /// Reads them from the sheet and its lip loop (x ≥ 0).
    pub fn new(sheet: &Sheet, lips: &[u32]) -> Self {
        let eye = sheet.eye;
        let lips: Vec<Vec3> = lips.iter().map(|&v| sheet.positions[v as usize]).collect();
        let unit = (eye.y - lips[0].y).abs().max(1e-9);
        let level = |p: &&Vec3| (p.y - eye.y).abs() < 0.8 * unit;
        let last = |key: fn(&Vec3) -> f64| {
            let points = sheet.positions.iter().filter(level);
            points.max_by(|a, b| key(a).total_cmp(&key(b))).copied().unwrap_or(eye)
        };
        Self { unit, eye, lips, nose: last(|p| p.z), ear: last(|p| p.x) }
    }

    /// The wish at a point with x ≥ 0.
    pub fn wish(&self, p: &Vec3, cavity: bool) -> Wish {
        let near = |q: &Vec3, inner: f64, outer: f64| ramp((p - q).norm() / self.unit, outer, inner);
        let face = self.frontal(p);
        let lids = if p.z > self.eye.z - 0.05 * self.unit { near(&self.eye, 0.3, 0.5) } else { 0.0 };
        let lips = self.lips.iter().map(|q| near(q, 0.12, 0.3)).fold(0.0, f64::max);
        let (nose, ear) = (near(&self.nose, 0.25, 0.5), near(&self.ear, 0.5, 0.75));
        let density = (1.0 + 1.1 * face) * (1.0 + 0.7 * lids.max(lips) + 0.3 * nose + 0.9 * ear);
        let importance = 1.0 + 19.0 * face + 4.0 * ear;
        if cavity { Wish { density: 0.3 * density, importance: 0.2 } } else { Wish { density, importance } }
    }

    /// 0 face, 1 lids, 2 lips, 3 ears, 4 anything else.
    pub fn region(&self, p: &Vec3) -> usize {
        let p = Vec3::new(p.x.abs(), p.y, p.z);
        let within = |q: &Vec3, r: f64| (p - q).norm() < r * self.unit;
        if within(&self.eye, 0.3) {
            1
        } else if self.lips.iter().any(|q| within(q, 0.12)) {
            2
        } else if within(&self.ear, 0.5) {
            3
        } else if self.frontal(&p) > 0.99 {
            0
        } else {
            4
        }
    }

    /// One on the mask of the face, zero behind the temples, above the hairline and below the jaw.
    fn frontal(&self, p: &Vec3) -> f64 {
        let azimuth = p.x.atan2(p.z - self.eye.z + self.unit);
        let height = (p.y - self.eye.y) / self.unit;
        ramp(azimuth, 1.65, 1.05) * ramp(height, 1.7, 1.0) * ramp(height, -2.1, -1.6)
    }
}

/// Smooth step from zero at `zero` to one at `one`.
fn ramp(x: f64, zero: f64, one: f64) -> f64 {
    let t = ((x - zero) / (one - zero)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
