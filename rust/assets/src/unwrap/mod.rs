//! A map of the head's skin: the face dense and undistorted, the seam at the back, the mouth interior apart.
//!
//! # Entry points
//! - [`unwrap`]: texture coordinates of every quad corner, in two islands, with a report of what they are worth.
//!
//! # How
//! The sheet is cut along the back of the head from the crown to the neck, and behind the lips. The half with x ≥ 0 of
//! each island is embedded in a rectangle without folds (Tutte) and relaxed to the wanted densities (symmetric
//! Dirichlet energy); the border slides along the rectangle, so the map is filled. The other half is its mirror image:
//! left and right differ by u ↔ 1 − u exactly.
//!
//! # Conventions
//! Head frame; u right, v up, 0…1; seen from outside, quads are counter-clockwise on the map. In the map the face looks
//! out of the page, the subject's left is on the right, the crown at the top and the neck above the strip at the bottom,
//! whose middle holds the mouth bag; the rest of the strip is free for teeth and tongue.

mod density;
mod embed;
mod measure;
mod relax;
mod seams;

pub use embed::Rect;
pub use measure::MapReport;

use density::{Places, Wish};
use geometry::{Vec2, Vec3};
use relax::Element;
use seams::Half;
use std::collections::BTreeMap;

/// The skin to flatten: one sheet, open at the neck only, symmetric in topology.
#[derive(Clone, Copy, Debug)]
pub struct Sheet<'a> {
    /// Head frame, metres; symmetric.
    pub positions: &'a [Vec3],
    /// Counter-clockwise seen from outside.
    pub quads: &'a [[u32; 4]],
    /// The vertex on the other side, for every vertex.
    pub mirror: &'a [u32],
    /// Vertices that are hardly seen: mouth bag, sockets, insides of the nostrils. They get few texels.
    pub cavity: &'a [bool],
    /// Centre of the subject's left eyeball.
    pub eye: Vec3,
}

/// How to lay the map out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnwrapOptions {
    /// Quad rings between the loop where the lips touch and the cut behind it.
    pub lip_rings: usize,
    /// Height of the strip with the mouth bag.
    pub strip: f64,
    /// Width of the mouth bag in the strip.
    pub mouth_width: f64,
    /// Distance between islands, and twice that of islands from the map's border.
    pub gutter: f64,
    /// Share of the seam at the back that runs along the top of the map.
    pub top_share: f64,
}

impl Default for UnwrapOptions {
    fn default() -> Self {
        Self { lip_rings: 1, strip: 0.1, mouth_width: 0.22, gutter: 8.0 / 2048.0, top_share: 0.3 }
    }
}

/// The map.
#[derive(Clone, Debug)]
pub struct Unwrapped {
    /// Texture coordinates of each quad's corners.
    pub uvs: Vec<[[f32; 2]; 4]>,
    /// Quads of the mouth island.
    pub mouth: Vec<usize>,
    /// The free parts of the strip, left and right of the mouth island.
    pub spare: [Rect; 2],
    /// What the map is worth.
    pub report: MapReport,
}

/// Why a sheet cannot be flattened.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnwrapError {
    /// The tables do not belong together.
    #[error("positions, mirror map and cavity flags must have one entry for each vertex")]
    Tables,
    /// The own mirror images are no simple line from neck to neck.
    #[error(
        "the mesh has no middle line: its mirror map must keep one edge path from the front to the back of the neck"
    )]
    MiddleLine,
    /// No quad loop round the lips.
    #[error("no closed quad loop was found where the lips touch")]
    Mouth,
    /// The border is no loop at the neck.
    #[error("the skin must be open at the neck only")]
    Neck,
    /// A quad has no mirror image.
    #[error("quad {quad} has no mirror image")]
    Lopsided {
        /// Its index.
        quad: usize,
    },
    /// The embedding has folds: the sheet is not 3-connected.
    #[error("the sheet cannot be embedded without folds")]
    Folded,
}

/// Flattens the skin.
pub fn unwrap(sheet: &Sheet, options: &UnwrapOptions) -> Result<Unwrapped, UnwrapError> {
    let n = sheet.positions.len();
    let in_range = sheet.quads.iter().flatten().chain(sheet.mirror).all(|&v| (v as usize) < n);
    if sheet.mirror.len() != n || sheet.cavity.len() != n || !in_range {
        return Err(UnwrapError::Tables);
    }
    let islands = seams::cut(sheet, options.lip_rings, options.top_share)?;
    let places = Places::new(sheet, &islands.lips);
    let (margin, middle) = (options.gutter / 2.0, 0.5 + options.mouth_width / 2.0);
    let face_rect = Rect { min: [0.5, options.strip + options.gutter], max: [1.0 - margin, 1.0 - margin] };
    let mouth_rect = Rect { min: [0.5, margin], max: [middle, options.strip] };
    let face_wish = |v: u32| places.wish(&sheet.positions[v as usize], sheet.cavity[v as usize]);
    let mouth_wish = |_| Wish { density: 1.0, importance: 1.0 };
    let face = flatten(sheet, &islands.face, &face_rect, options, &face_wish)?;
    let mouth = flatten(sheet, &islands.mouth, &mouth_rect, options, &mouth_wish)?;
    let left = [(&islands.face, &face), (&islands.mouth, &mouth)];
    let (uvs, mouth) = both_sides(sheet, &left)?;
    let report = measure::measure(sheet, &uvs, &places);
    let spare = |min, max| Rect { min: [min, margin], max: [max, options.strip] };
    let (from, to) = (1.0 - middle - options.gutter, middle + options.gutter);
    Ok(Unwrapped { uvs, mouth, spare: [spare(margin, from), spare(to, 1.0 - margin)], report })
}

/// Local map coordinates of a half island.
fn flatten(
    sheet: &Sheet,
    half: &Half,
    rect: &Rect,
    options: &UnwrapOptions,
    wish: &dyn Fn(u32) -> Wish,
) -> Result<Vec<Vec2>, UnwrapError> {
    let positions: Vec<Vec3> = half.vertices.iter().map(|&v| sheet.positions[v as usize]).collect();
    let wishes: Vec<Wish> = half.vertices.iter().map(|&v| wish(v)).collect();
    let density: Vec<f64> = wishes.iter().map(|w| w.density).collect();
    let mut uv = embed::tutte(half, &positions, &density, rect);
    let elements = elements(half, &positions, &wishes, rect.area(), options.gutter);
    let mut edges = half.edges();
    edges.extend(half.quads.iter().chain(&half.slit_quads()).flat_map(|q| [[q[0], q[2]], [q[1], q[3]]]));
    edges.iter_mut().for_each(|e| e.sort_unstable());
    edges.sort_unstable();
    edges.dedup();
    let energy = relax::relax(&elements, &embed::freedom(half), &edges, &mut uv);
    if energy.is_finite() { Ok(uv) } else { Err(UnwrapError::Folded) }
}

/// The four corner triangles of each quad in their wanted shape; of the slit too, which is kept open by a gutter.
fn elements(half: &Half, positions: &[Vec3], wishes: &[Wish], area: f64, gutter: f64) -> Vec<Element> {
    let corner = |q: &[u32; 4], k: usize| [q[k], q[(k + 1) % 4], q[(k + 2) % 4]];
    let mean = |t: &[u32; 3], get: fn(&Wish) -> f64| t.iter().map(|&v| get(&wishes[v as usize])).sum::<f64>() / 3.0;
    let triangles: Vec<[u32; 3]> = half.quads.iter().flat_map(|q| [0, 1, 2, 3].map(|k| corner(q, k))).collect();
    let wanted =
        |t: &[u32; 3]| 0.25 * geometry::mesh::area_normal(positions, t).norm() * mean(t, |w| w.density).powi(2);
    let scale = (area / triangles.iter().map(wanted).sum::<f64>()).sqrt();
    let length =
        |a: u32, b: u32, density: f64| (positions[a as usize] - positions[b as usize]).norm() * density * scale;
    let skin = triangles.iter().map(|&t| {
        let density = mean(&t, |w| w.density);
        let sides = [0, 1, 2].map(|k| length(t[k], t[(k + 1) % 3], density));
        Element::new(t, sides, mean(&t, |w| w.importance))
    });
    let slit = half.slit_quads().into_iter().flat_map(|q| {
        let density = wishes[q[0] as usize].density;
        let width = (length(q[0], q[1], density) + length(q[2], q[3], density)) / 2.0;
        let diagonal = width.hypot(gutter);
        [0, 1, 2, 3].map(|k| {
            let sides = if k % 2 == 0 { [width, gutter, diagonal] } else { [gutter, width, diagonal] };
            Element::new(corner(&q, k), sides, 1.0)
        })
    });
    skin.chain(slit).collect()
}

/// Texture coordinates of quads' corners.
type QuadUvs = Vec<[[f32; 2]; 4]>;

/// Copies the half islands to the quads of both sides; also lists the quads of the second island.
fn both_sides(sheet: &Sheet, halves: &[(&Half, &Vec<Vec2>); 2]) -> Result<(QuadUvs, Vec<usize>), UnwrapError> {
    let sorted = |mut q: [u32; 4]| {
        q.sort_unstable();
        q
    };
    let mut home = BTreeMap::new();
    for (island, (half, _)) in halves.iter().enumerate() {
        home.extend(half.faces.iter().map(|&q| (sorted(sheet.quads[q]), island)));
    }
    let mut uvs = Vec::with_capacity(sheet.quads.len());
    let mut mouth = Vec::new();
    for (index, quad) in sheet.quads.iter().enumerate() {
        let own = home.get(&sorted(*quad));
        let twin = quad.map(|v| sheet.mirror[v as usize]);
        let (island, source) = match own {
            Some(&island) => (island, *quad),
            None => (*home.get(&sorted(twin)).ok_or(UnwrapError::Lopsided { quad: index })?, twin),
        };
        let (half, uv) = halves[island];
        let place = |v: u32| half.vertices.binary_search(&v).map_or_else(|_| Vec2::zeros(), |i| uv[i]);
        // Rounded before it is mirrored: a float of 0.5…1 subtracts from one without error.
        let side = |u: f32| if own.is_some() { u } else { 1.0 - u };
        uvs.push(source.map(place).map(|p| [side(p.x as f32), p.y as f32]));
        if island == 1 {
            mouth.push(index);
        }
    }
    Ok((uvs, mouth))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::mesh;

    /// Quads on each side of the box that stands for a head.
    const N: i32 = 12;

    /// Collects quads given by lattice corners; equal corners are one vertex.
    #[derive(Default)]
    struct Builder {
        index: BTreeMap<[i32; 3], u32>,
        quads: Vec<[u32; 4]>,
    }

    impl Builder {
        fn quad(&mut self, corners: [[i32; 3]; 4]) {
            let quad = corners.map(|c| {
                let next = self.index.len() as u32;
                *self.index.entry(c).or_insert(next)
            });
            self.quads.push(quad);
        }

        /// A patch over `origin + i u + j v`, without those cells that `keep` refuses; u × v points outside.
        fn patch(&mut self, origin: [i32; 3], u: [i32; 3], v: [i32; 3], size: [i32; 2], keep: fn(i32, i32) -> bool) {
            let at = |i: i32, j: i32| [0, 1, 2].map(|k| origin[k] + i * u[k] + j * v[k]);
            for (i, j) in (0..size[0]).flat_map(|i| (0..size[1]).map(move |j| (i, j))).filter(|&(i, j)| keep(i, j)) {
                self.quad([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }

    /// A box, open below, with a mouth of 6 × 3 quads four quads deep, closed at its lips on the second ring.
    fn boxed_head() -> (Vec<Vec3>, Vec<[u32; 4]>, Vec<u32>) {
        let mut b = Builder::default();
        let (x, y, z) = ([1, 0, 0], [0, 1, 0], [0, 0, 1]);
        let minus = |a: [i32; 3]| a.map(|k| -k);
        let h = N / 2;
        let no_mouth = |i: i32, j: i32| !((3..9).contains(&i) && (3..6).contains(&j));
        b.patch([-h, 0, N], x, y, [N, N], no_mouth);
        b.patch([h, 0, 0], minus(x), y, [N, N], |_, _| true);
        b.patch([h, 0, N], minus(z), y, [N, N], |_, _| true);
        b.patch([-h, 0, 0], z, y, [N, N], |_, _| true);
        b.patch([-h, N, N], x, minus(z), [N, N], |_, _| true);
        // The bag: four walls inwards, and its back.
        let deep = N - 4;
        b.patch([3, 3, deep], minus(x), z, [6, 4], |_, _| true);
        b.patch([-3, 6, deep], x, z, [6, 4], |_, _| true);
        b.patch([3, 6, deep], minus(y), z, [3, 4], |_, _| true);
        b.patch([-3, 3, deep], y, z, [3, 4], |_, _| true);
        b.patch([-3, 3, deep], x, y, [6, 3], |_, _| true);
        let mut corners: Vec<([i32; 3], u32)> = b.index.iter().map(|(c, i)| (*c, *i)).collect();
        corners.sort_by_key(|c| c.1);
        let inside = |c: &[i32; 3]| c[0].abs() <= 3 && (3..=6).contains(&c[1]) && c[2] < N && c[2] >= deep;
        let place = |(c, _): &([i32; 3], u32)| {
            // Pinched two quads in: the lips.
            let squeeze = if inside(c) && c[2] == N - 2 { 0.1 } else { 1.0 };
            let height = if inside(c) { 4.5 + (f64::from(c[1]) - 4.5) * squeeze } else { f64::from(c[1]) };
            Vec3::new(f64::from(c[0]), height - 8.0, f64::from(c[2]) - 10.0) * 0.015
        };
        let mirror = corners.iter().map(|(c, _)| b.index[&[-c[0], c[1], c[2]]]).collect();
        (corners.iter().map(place).collect(), b.quads, mirror)
    }

    fn flattened() -> (Vec<Vec3>, Vec<[u32; 4]>, Unwrapped) {
        let (positions, quads, mirror) = boxed_head();
        let cavity = vec![false; positions.len()];
        let eye = Vec3::new(0.03, 0.0, 0.02);
        let sheet = Sheet { positions: &positions, quads: &quads, mirror: &mirror, cavity: &cavity, eye };
        let map = unwrap(&sheet, &UnwrapOptions::default()).unwrap();
        (positions, quads, map)
    }

    #[test]
    fn fills_the_map_without_folds_or_overlaps() {
        let (.., map) = flattened();
        assert_eq!((map.report.folds, map.report.overlaps), (0, 0));
        assert!(map.report.usage > 0.85, "{:?}", map.report);
        let area = |c: &[[f32; 2]; 4]| {
            let at = |k: usize| Vec2::new(f64::from(c[k % 4][0]), f64::from(c[k % 4][1]));
            0.5 * (0..4).map(|k| at(k).perp(&at(k + 1))).sum::<f64>()
        };
        let sum: f64 = map.uvs.iter().map(area).sum();
        assert!((sum - map.report.usage).abs() < 2e-3, "{sum} {}", map.report.usage);
    }

    #[test]
    fn left_and_right_are_exact_mirror_images() {
        let (_, quads, map) = flattened();
        let (positions, _, mirror) = boxed_head();
        let mut halves: BTreeMap<(u32, bool), Vec<[f32; 2]>> = BTreeMap::new();
        for ((quad, uvs), index) in quads.iter().zip(&map.uvs).zip(0..) {
            let apart = map.mouth.contains(&index);
            let left = quad.iter().map(|&v| positions[v as usize].x).sum::<f64>() > 0.0;
            for (&v, uv) in quad.iter().zip(uvs) {
                let key = (if left { v } else { mirror[v as usize] }, apart);
                halves.entry(key).or_default().push([if left { uv[0] } else { 1.0 - uv[0] }, uv[1]]);
            }
        }
        assert!(halves.values().all(|uvs| uvs.iter().all(|uv| *uv == uvs[0])));
    }

    #[test]
    fn the_mouth_lies_apart_by_a_gutter() {
        let (_, quads, map) = flattened();
        // Two of the four rings, and the back of the bag.
        assert!(map.mouth.len() > 18 && map.mouth.len() < 18 + 4 * 18, "{}", map.mouth.len());
        let height = |q: usize| map.uvs[q].iter().map(|c| c[1]);
        let top = map.mouth.iter().flat_map(|&q| height(q)).fold(0.0, f32::max);
        let face = (0..quads.len()).filter(|q| !map.mouth.contains(q));
        let bottom = face.flat_map(height).fold(1.0, f32::min);
        assert!(bottom - top >= 4.0 / 2048.0, "{top} {bottom}");
        assert!(map.spare.iter().all(|r| r.area() > 0.02));
    }

    #[test]
    fn sheets_that_cannot_be_cut_say_why() {
        let (positions, quads, mirror) = boxed_head();
        let cavity = vec![false; positions.len()];
        let sheet =
            Sheet { positions: &positions, quads: &quads, mirror: &mirror, cavity: &cavity, eye: Vec3::zeros() };
        let lost: Vec<u32> = (1..=mirror.len() as u32).map(|v| v % mirror.len() as u32).collect();
        let options = UnwrapOptions::default();
        assert_eq!(unwrap(&Sheet { mirror: &lost, ..sheet }, &options).err(), Some(UnwrapError::MiddleLine));
        assert_eq!(unwrap(&Sheet { mirror: &lost[1..], ..sheet }, &options).err(), Some(UnwrapError::Tables));
        let deep = UnwrapOptions { lip_rings: 40, ..options };
        assert_eq!(unwrap(&sheet, &deep).err(), Some(UnwrapError::Mouth));
        assert!(mesh::border_edges(&quads).len() == 4 * N as usize);
    }
}
