//! Multi-band blending of the views in the atlas.
//!
//! Every view is split into octaves (a Laplacian pyramid that knows where the view saw nothing). The fine octaves, in
//! which a small error of the geometry would show as a ghost, are taken from the best view of the region; the coarse
//! ones are averaged by score, so that no seam of brightness is left. Views are added one at a time: the memory does
//! not grow with their number.
//!
//! Source: Burt & Adelson, A Multiresolution Spline with Application to Image Mosaics, 1983; two weightings after
//! Baumberg, Blending Images for Texturing 3D Models, 2002.

use crate::plane::{Plane, Stretched, Texel, expand_at, reduce};
use rayon::prelude::*;

/// Part of its score with which a view that is not selected counts in the fine octaves: enough to stand in where the
/// selected view is hidden.
const STAND_IN: f32 = 1e-3;

/// Sums of weighted octaves, finest first.
pub(crate) struct Blend {
    levels: Vec<Plane<Texel>>,
    fine: usize,
}

impl Blend {
    /// For atlases of a size, with the number of octaves and how many of them are taken from the best view.
    pub(crate) fn new(size: usize, levels: usize, fine: usize) -> Self {
        let sizes = std::iter::successors(Some(size), |s| Some(s.div_ceil(2)));
        let levels = sizes.take(levels.max(1)).map(|s| Plane::new(s, s, [0.0; 4])).collect();
        Self { levels, fine }
    }

    /// Adds a view's colours and scores; `selection` says how much of its detail is wanted.
    pub(crate) fn add(&mut self, view: &Plane<Texel>, selection: &Plane<f32>) {
        let count = self.levels.len();
        let mut reduced: Option<Plane<Texel>> = None;
        for (k, sum) in self.levels.iter_mut().enumerate() {
            let octave = reduced.as_ref().unwrap_or(view);
            let coarser = (k + 1 < count).then(|| reduce(octave));
            let select = (k < self.fine).then_some(selection);
            add_octave(sum, octave, coarser.as_ref(), select);
            reduced = coarser;
        }
    }

    /// The blended colours; the weight is the score of the view that gave the detail.
    pub(crate) fn finish(self) -> Plane<Texel> {
        let mut levels = self.levels.into_iter().rev();
        let Some(coarsest) = levels.next() else { return Plane::new(0, 0, [0.0; 4]) };
        let mut blended = coarsest;
        normalise(&mut blended, None);
        for mut level in levels {
            normalise(&mut level, Some(&blended));
            blended = level;
        }
        blended
    }
}

fn add_octave(
    sum: &mut Plane<Texel>,
    octave: &Plane<Texel>,
    coarser: Option<&Plane<Texel>>,
    select: Option<&Plane<f32>>,
) {
    let (width, height) = (sum.width, sum.height);
    let select = select.map(|plane| Stretched::new(plane, width, height));
    sum.data.par_chunks_mut(width).enumerate().for_each(|(y, sums)| {
        let select = select.as_ref().map(|plane| plane.row(y));
        for (x, (sum, &[r, g, b, score])) in sums.iter_mut().zip(octave.row(y)).enumerate() {
            if score <= 0.0 {
                continue;
            }
            let weight = score * select.as_ref().map_or(1.0, |row| row.at(x) + STAND_IN);
            let low = coarser.and_then(|c| expand_at(c, x, y)).unwrap_or([0.0; 3]);
            let add = [weight * (r - low[0]), weight * (g - low[1]), weight * (b - low[2]), weight];
            (0..4).for_each(|k| sum[k] += add[k]);
        }
    });
}

/// Divides the sums by their weights and adds the coarser octaves.
fn normalise(level: &mut Plane<Texel>, coarser: Option<&Plane<Texel>>) {
    let width = level.width;
    level.data.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, texel) in row.iter_mut().enumerate().filter(|(_, t)| t[3] > 0.0) {
            let low = coarser.and_then(|c| expand_at(c, x, y)).unwrap_or([0.0; 3]);
            (0..3).for_each(|k| texel[k] = texel[k] / texel[3] + low[k]);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    const N: usize = 64;

    fn view(colour: impl Fn(usize, usize) -> f32 + Sync, seen: impl Fn(usize, usize) -> bool + Sync) -> Plane<Texel> {
        Plane::from_rows(N, N, [0.0; 4], |y, row| {
            for (x, t) in row.iter_mut().enumerate().filter(|(x, _)| seen(*x, y)) {
                *t = [colour(x, y), 50.0, 10.0, 0.7];
            }
        })
    }

    fn stripes(x: usize, y: usize) -> f32 {
        100.0 + if (x + y).is_multiple_of(2) { 30.0 } else { -30.0 }
    }

    #[test]
    fn one_view_comes_back_exactly() {
        let round = |x: usize, y: usize| (x as f32 - 30.0).powi(2) + (y as f32 - 25.0).powi(2) < 500.0;
        let mut blend = Blend::new(N, 5, 3);
        blend.add(&view(stripes, round), &Plane::new(16, 16, 0.4));
        for (i, texel) in blend.finish().data.iter().enumerate() {
            let (x, y) = (i % N, i / N);
            assert_eq!(texel[3] > 0.0, round(x, y));
            if round(x, y) {
                assert!((texel[0] - stripes(x, y)).abs() < 1e-2, "{} {}", texel[0], stripes(x, y));
            }
        }
    }

    #[test]
    fn detail_of_shifted_views_does_not_cancel_and_brightness_has_no_seam() {
        let mut blend = Blend::new(N, 6, 3);
        let left = Plane::from_rows(N, N, 0.0, |_, row| row[..N / 2].fill(1.0));
        let right = Plane::from_rows(N, N, 0.0, |_, row| row[N / 2..].fill(1.0));
        blend.add(&view(stripes, |_, _| true), &left);
        blend.add(&view(|x, y| stripes(x + 1, y) + 20.0, |_, _| true), &right);
        let blended = blend.finish();
        let at = |x: usize, y: usize| blended.data[y * N + x][0];
        assert!((at(20, 30) - at(21, 30)).abs() > 55.0 && (at(40, 30) - at(41, 30)).abs() > 55.0);
        let mean = |x: usize| (at(x, 30) + at(x, 31) + at(x + 1, 30) + at(x + 1, 31)) / 4.0;
        assert!((mean(26) - mean(36)).abs() < 4.0);
    }
}
