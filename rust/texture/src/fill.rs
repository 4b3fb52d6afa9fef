//! Colour for what no view saw, and a gutter around the islands of the atlas.
//!
//! An unseen texel takes the colour of its mirror image on the other side of the face, shifted by the smooth difference
//! between the two sides where both were seen; without a mirror image it takes what its neighbours have, ever farther
//! ones (pull–push), and at last the mean of the skin. Texels outside the islands continue them, so that no filter
//! reaches over a border into nothing.
//!
//! Source: pull–push after Gortler et al., The Lumigraph, 1996; the shifted mirror image is a membrane as in Pérez et
//! al., Poisson Image Editing, 2003.

use crate::atlas::Surface;
use crate::plane::{Plane, Texel, expand_at, reduce, stretched_place};
use geometry::Vec2;
use image::RgbaImage;
use raster::{Fragment, NO_TRIANGLE, texel_of, texels};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Alpha of texels that a view saw.
pub const ALPHA_SEEN: u8 = 255;
/// Alpha of texels that took the colour of the other side of the face.
pub const ALPHA_MIRRORED: u8 = 170;
/// Alpha of texels that took the colour of their neighbours.
pub const ALPHA_SPREAD: u8 = 85;
/// Alpha of texels outside the islands.
pub const ALPHA_OUTSIDE: u8 = 0;

/// Every texel of an atlas with a colour.
pub(crate) struct Filled {
    /// The colours.
    pub(crate) colours: Plane<Texel>,
    /// How each texel came by its colour, 0…255.
    pub(crate) alpha: Plane<u8>,
}

/// Fills colours of some certainty (weight 0…1).
pub(crate) fn fill(seen: Plane<Texel>, surface: &Surface, map: &Plane<Fragment>) -> Filled {
    let certainty: Vec<f32> = seen.data.par_iter().map(|texel| texel[3]).collect();
    let mut known = seen;
    if let Some(mirror) = surface.mirror {
        let found = mirrored(&known, &Mirror { uvs: mirror_uvs(surface, mirror) }, surface, map);
        let width = known.width;
        known.data.par_chunks_mut(width).zip(found).for_each(|(row, found)| {
            found.into_iter().for_each(|(x, texel)| row[x as usize] = texel);
        });
    }
    let alpha = |((seen, known), fragment): ((&f32, &Texel), &Fragment)| match fragment.triangle {
        NO_TRIANGLE => ALPHA_OUTSIDE,
        _ => alpha_of(*seen, known[3]),
    };
    let data = certainty.par_iter().zip(&known.data).zip(&map.data).map(alpha).collect();
    let alpha = Plane { width: map.width, height: map.height, data };
    Filled { colours: spread(known), alpha }
}

/// The texels of each row, by their columns, of which the other side of the face tells more than was seen. The difference between the
/// sides is smooth: half the size holds it.
fn mirrored(seen: &Plane<Texel>, mirror: &Mirror, surface: &Surface, map: &Plane<Fragment>) -> Vec<Vec<(u32, Texel)>> {
    let offset = spread({
        let half = reduce(seen);
        let map = Plane { width: half.width, height: half.height, data: texels(surface.uvs, half.width) };
        mirror.difference(&half, &map)
    });
    let mixed = |x: usize, y: usize| {
        let (texel, other) = (seen.row(y)[x], mirror.texel(seen, &map.row(y)[x]));
        let (own, rest) = (texel[3], (1.0 - texel[3]) * other[3]);
        let shift = expand_at(&offset, x, y).filter(|_| rest > 0.0)?;
        let mix = |k: usize| (own * texel[k] + rest * (other[k] + shift[k])) / (own + rest);
        Some((x as u32, [mix(0), mix(1), mix(2), own + rest]))
    };
    (0..seen.height).into_par_iter().map(|y| (0..seen.width).filter_map(|x| mixed(x, y)).collect()).collect()
}

/// Alpha of a texel by its certainty before and after the other side of the face was taken.
fn alpha_of(seen: f32, known: f32) -> u8 {
    let own = seen.clamp(0.0, 1.0);
    let mirrored = (known - own).max(0.0);
    let rest = 1.0 - own - mirrored;
    let alpha = own * f32::from(ALPHA_SEEN) + mirrored * f32::from(ALPHA_MIRRORED) + rest * f32::from(ALPHA_SPREAD);
    alpha.round() as u8
}

impl Filled {
    /// As a picture of a size, at least as large: colours are interpolated, alpha is the nearest texel's of an island. Texels
    /// that `uvs` do not cover stay outside.
    pub(crate) fn picture(&self, uvs: &[[Vec2; 3]], size: usize) -> RgbaImage {
        let colours = &self.colours;
        let islands = (size > colours.width).then(|| texels(uvs, size));
        let columns: Vec<(u32, f32)> = (0..size).map(|x| stretched_place(x, colours.width, size)).collect();
        let mut bytes = vec![0u8; size * size * 4];
        bytes.par_chunks_mut(4 * size.max(1)).enumerate().for_each(|(y, row)| {
            let (j, down) = stretched_place(y, colours.height, size);
            let rows = [j as usize, (j as usize + 1).min(colours.height - 1)];
            for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
                let (i, right) = columns[x];
                let cells = [i as usize, (i as usize + 1).min(colours.width - 1)];
                let parts = [[1.0 - right, right].map(|p| p * (1.0 - down)), [1.0 - right, right].map(|p| p * down)];
                let mut sum = [0.5f32; 3];
                let mut nearest = (0.0, ALPHA_OUTSIDE);
                for (row, parts) in rows.into_iter().zip(parts) {
                    for (cell, part) in cells.into_iter().zip(parts) {
                        let (texel, alpha) = (colours.row(row)[cell], self.alpha.row(row)[cell]);
                        (0..3).for_each(|k| sum[k] += part * texel[k]);
                        if alpha != ALPHA_OUTSIDE && part > nearest.0 {
                            nearest = (part, alpha);
                        }
                    }
                }
                let is_outside = islands.as_ref().is_some_and(|map| map[y * size + x].triangle == NO_TRIANGLE);
                // The cast holds the value within 0…255.
                (0..3).for_each(|k| pixel[k] = sum[k] as u8);
                pixel[3] = if is_outside { ALPHA_OUTSIDE } else { nearest.1 };
            }
        });
        RgbaImage::from_raw(size as u32, size as u32, bytes).unwrap_or_default()
    }
}

/// Pull–push: every texel mixes its own colour, by its weight (0…1), with that of the coarser level.
pub(crate) fn spread(plane: Plane<Texel>) -> Plane<Texel> {
    let mut levels = vec![plane];
    while let Some(last) = levels.last().filter(|l| l.width.max(l.height) > 1) {
        let mut coarser = reduce(last);
        // A coarse cell is certain as soon as a quarter of it is known.
        coarser.data.iter_mut().for_each(|t| t[3] = (4.0 * t[3]).min(1.0));
        levels.push(coarser);
    }
    let mut coarser = levels.pop();
    while let Some(mut level) = levels.pop() {
        if let Some(coarser) = &coarser {
            let width = level.width;
            level.data.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
                for (x, t) in row.iter_mut().enumerate().filter(|(_, t)| t[3] < 1.0) {
                    let Some(low) = expand_at(coarser, x, y) else { continue };
                    let own = t[3].max(0.0);
                    (0..3).for_each(|k| t[k] = own * t[k] + (1.0 - own) * low[k]);
                    t[3] = 1.0;
                }
            });
        }
        coarser = Some(level);
    }
    coarser.unwrap_or_else(|| Plane::new(0, 0, [0.0; 4]))
}

/// The other side of the face.
struct Mirror {
    /// Of each triangle, the texture coordinates of its corners' mirror images.
    uvs: Vec<Option<[Vec2; 3]>>,
}

impl Mirror {
    /// Colour and certainty of a texel's mirror image; weight 0 where there is none.
    fn texel(&self, seen: &Plane<Texel>, fragment: &Fragment) -> Texel {
        let Some(Some(corners)) = self.uvs.get(fragment.triangle as usize) else { return [0.0; 4] };
        let uv = (0..3).fold(Vec2::zeros(), |sum, k| sum + corners[k] * f64::from(fragment.weights()[k]));
        let place = texel_of(&uv, seen.width, seen.height);
        let inside = |t: f64, n: usize| t.round().clamp(0.0, (n - 1) as f64) as usize;
        seen.row(inside(place.y, seen.height))[inside(place.x, seen.width)]
    }

    /// Own colour minus mirrored colour where both are certain.
    fn difference(&self, seen: &Plane<Texel>, map: &Plane<Fragment>) -> Plane<Texel> {
        Plane::from_rows(seen.width, seen.height, [0.0; 4], |y, row| {
            for ((texel, own), fragment) in row.iter_mut().zip(seen.row(y)).zip(map.row(y)) {
                let other = self.texel(seen, fragment);
                let weight = own[3].min(other[3]);
                if weight > 0.0 {
                    *texel = [own[0] - other[0], own[1] - other[1], own[2] - other[2], weight];
                }
            }
        })
    }
}

/// The texture coordinates of the three mirrored corners of each triangle, in the mirrored triangle.
fn mirror_uvs(surface: &Surface, mirror: &[u32]) -> Vec<Option<[Vec2; 3]>> {
    let sorted = |mut t: [u32; 3]| {
        t.sort_unstable();
        t
    };
    let by_corners: BTreeMap<[u32; 3], usize> =
        surface.triangles.iter().enumerate().map(|(i, t)| (sorted(*t), i)).collect();
    let mirrored = |triangle: &[u32; 3]| {
        let corners = triangle.map(|i| mirror[i as usize]);
        let other = *by_corners.get(&sorted(corners))?;
        let uv = |corner: u32| {
            let k = surface.triangles[other].iter().position(|&i| i == corner)?;
            Some(surface.uvs[other][k])
        };
        Some([uv(corners[0])?, uv(corners[1])?, uv(corners[2])?])
    };
    surface.triangles.iter().map(mirrored).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Vec3;

    const N: usize = 32;

    struct Strip {
        positions: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        uvs: Vec<[Vec2; 3]>,
        mirror: Vec<u32>,
    }

    /// Two mirrored squares side by side in the atlas: vertices 0…3 left, 4…7 right.
    fn strip() -> Strip {
        let uv: Vec<Vec2> = [[0.1, 0.1], [0.4, 0.1], [0.4, 0.9], [0.1, 0.9]]
            .iter()
            .flat_map(|p| [Vec2::new(p[0], p[1]), Vec2::new(1.0 - p[0], p[1])])
            .collect();
        let order: Vec<Vec2> = (0..2).flat_map(|side| (0..4).map(move |k| 2 * k + side)).map(|i| uv[i]).collect();
        let triangles = vec![[0, 1, 2], [0, 2, 3], [5, 4, 6], [6, 4, 7]];
        let uvs = triangles.iter().map(|t: &[u32; 3]| t.map(|i| order[i as usize])).collect();
        let positions = order.iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect();
        Strip { positions, triangles, uvs, mirror: vec![4, 5, 6, 7, 0, 1, 2, 3] }
    }

    fn pattern(x: usize, y: usize) -> f32 {
        120.0 + 10.0 * ((x / 2 + y / 2) % 3) as f32
    }

    fn filled(with_mirror: bool, size: usize) -> (RgbaImage, Plane<Fragment>) {
        let Strip { positions, triangles, uvs, mirror } = strip();
        let surface = Surface {
            positions: &positions,
            triangles: &triangles,
            uvs: &uvs,
            weight: None,
            mirror: with_mirror.then_some(&mirror[..]),
        };
        let map = Plane { width: N, height: N, data: texels(&uvs, N) };
        // The left side is seen, of the right side the lower half, five levels brighter.
        let seen = Plane::from_rows(N, N, [0.0; 4], |y, row| {
            for (x, t) in row.iter_mut().enumerate().filter(|(x, _)| map.row(y)[*x].triangle != NO_TRIANGLE) {
                let right = x >= N / 2;
                let colour = if right { pattern(N - 1 - x, y) + 5.0 } else { pattern(x, y) };
                *t = [colour, 60.0, 30.0, if right && y < N / 2 { 0.0 } else { 1.0 }];
            }
        });
        (fill(seen, &surface, &map).picture(&uvs, size), map)
    }

    #[test]
    fn the_unseen_side_takes_the_other_sides_pattern_in_its_own_brightness() {
        let (texture, map) = filled(true, N);
        for y in 4..N / 2 {
            for x in N / 2 + 4..N - 4 {
                let pixel = texture.get_pixel(x as u32, y as u32);
                assert_eq!(pixel[3], ALPHA_MIRRORED, "{x} {y} {:?}", map.row(y)[x]);
                // Towards the seen half all of the five levels, farther away less of them.
                let shift = f32::from(pixel[0]) - pattern(N - 1 - x, y);
                let slack = if y + 3 > N / 2 { 1.6 } else { 4.0 };
                assert!((shift - 5.0).abs() < slack, "{x} {y} {shift}");
            }
        }
    }

    #[test]
    fn without_a_mirror_the_neighbours_spread_and_the_gutter_continues_the_island() {
        let (texture, map) = filled(false, N);
        let pixel = texture.get_pixel(24, 8);
        assert!(pixel[3] == ALPHA_SPREAD && (115..=145).contains(&pixel[0]), "{pixel:?}");
        for (i, fragment) in map.data.iter().enumerate().filter(|(_, f)| f.triangle == NO_TRIANGLE) {
            let pixel = texture.get_pixel((i % N) as u32, (i / N) as u32);
            assert!(pixel[3] == ALPHA_OUTSIDE && pixel[0] > 100, "{fragment:?}");
        }
        assert_eq!(texture.get_pixel(6, 16)[3], ALPHA_SEEN);
    }

    #[test]
    fn a_larger_picture_has_the_same_colours_and_islands_of_its_own_texels() {
        let Strip { uvs, .. } = strip();
        let ((small, _), (large, _)) = (filled(true, N), filled(true, 4 * N));
        let islands = texels(&uvs, 4 * N);
        for (x, y, pixel) in large.enumerate_pixels() {
            let is_island = islands[(y * 4 * N as u32 + x) as usize].triangle != NO_TRIANGLE;
            assert_eq!(pixel[3] > ALPHA_OUTSIDE, is_island, "{x} {y}");
        }
        // The four texels in the middle of a small one lie around its centre.
        let (x, y) = (6, 20);
        for (right, down) in [(1, 1), (2, 1), (1, 2), (2, 2)] {
            let (here, there) = (large.get_pixel(4 * x + right, 4 * y + down), small.get_pixel(x, y));
            assert!(here[0].abs_diff(there[0]) <= 3 && here[3] == ALPHA_SEEN, "{here:?} {there:?}");
        }
    }

    #[test]
    fn nothing_known_stays_black() {
        assert!(spread(Plane::new(5, 3, [0.0; 4])).data.iter().all(|t| t[0] == 0.0));
    }
}
