//! How alike the surroundings of two points are.

use crate::pyramid::Level;
use geometry::Vec2;

/// Compares windows of two pictures.
pub(super) struct Windows<'p> {
    a: &'p Level,
    b: &'p Level,
    side: usize,
    buffers: [Vec<f32>; 2],
}

impl<'p> Windows<'p> {
    /// Windows of an odd side, pixels.
    pub fn new(a: &'p Level, b: &'p Level, side: usize) -> Self {
        Self { a, b, side: side / 2 * 2 + 1, buffers: Default::default() }
    }

    /// Normalised cross correlation of the windows around a point of `a` and a point of `b`, to the whole pixel between
    /// them; `None` where a window leaves the frame.
    pub fn likeness(&mut self, u: &Vec2, v: &Vec2) -> Option<f64> {
        let half = (self.side / 2) as isize;
        let first = u.map(f64::round);
        let second = first + (v - u).map(f64::round);
        if !self.a.contains(&first, half as f64) || !self.b.contains(&second, half as f64) {
            return None;
        }
        let [p, q] = &mut self.buffers;
        for (level, at, window) in [(self.a, first, &mut *p), (self.b, second, &mut *q)] {
            level.copy_window(at.x as isize - half, at.y as isize - half, self.side, self.side, window);
        }
        Some(correlation(p, q))
    }
}

/// Zero where a window is flat.
fn correlation(p: &[f32], q: &[f32]) -> f64 {
    let n = p.len() as f32;
    let (mean_p, mean_q) = (p.iter().sum::<f32>() / n, q.iter().sum::<f32>() / n);
    let (mut pp, mut qq, mut pq) = (0.0, 0.0, 0.0);
    for (p, q) in p.iter().zip(q) {
        let (p, q) = (p - mean_p, q - mean_q);
        pp += p * p;
        qq += q * q;
        pq += p * q;
    }
    let product = pp * qq;
    if product > 0.0 { f64::from(pq / product.sqrt()) } else { 0.0 }
}
