//! Which vertices of the lids meet when an eye closes, and which of the lips touch at rest; and a blink that closes.
//!
//! # Entry points
//! [`lid_contacts`], [`close_lids`], [`lip_contacts`].
//!
//! Contacts are pairs `[upper, lower]`, from the middle of the face outwards.

use crate::loops::Loops;
use geometry::Vec3;
use head::Key;
use std::ops::Range;

/// Vertices of the loop along the edge of both lids.
const LID_LENGTH: usize = 28;
/// Lips that rest closer than this touch, metres.
const TOUCH: f64 = 1.0e-3;

/// Pairs of lid vertices that meet in a blink: the loop along the edge of the lids, folded from corner to corner.
///
/// `vertex` lies on that loop. `None` when there is no such loop.
pub fn lid_contacts(positions: &[Vec3], quads: &[[u32; 4]], vertex: u32) -> Option<Vec<[u32; 2]>> {
    let ring = Loops::new(quads.iter()).through(vertex, LID_LENGTH)?;
    let fold = |sum: usize| -> Vec<[u32; 2]> {
        let pairs = (0..LID_LENGTH).map(|i| (i, (sum + LID_LENGTH - i) % LID_LENGTH)).filter(|(i, j)| i < j);
        pairs.map(|(i, j)| [ring[i], ring[j]]).collect()
    };
    // Of all ways to fold the loop together, the one whose pairs lie above one another.
    let aside = |pairs: &[[u32; 2]]| -> f64 {
        let square = |p: &[u32; 2]| (positions[p[0] as usize].x - positions[p[1] as usize].x).powi(2);
        pairs.iter().map(square).sum::<f64>() / pairs.len() as f64
    };
    let best = (0..LID_LENGTH).map(fold).min_by(|a, b| aside(a).total_cmp(&aside(b)))?;
    let upper_first = |[a, b]: [u32; 2]| {
        if positions[a as usize].y > positions[b as usize].y { [a, b] } else { [b, a] }
    };
    Some(outwards(best.into_iter().map(upper_first).collect(), positions))
}

/// Corrects a blink made for another fissure, so that each pair meets exactly.
///
/// What a pair lacks is spread over the upper lid by how far each vertex follows the nearest place of the lid's edge.
pub fn close_lids(blink: &mut Key, positions: &[Vec3], pairs: &[[u32; 2]]) {
    let offset = |v: u32| blink.offsets.iter().find(|(w, _)| *w == v).map_or_else(Vec3::zeros, |(_, d)| *d);
    let place = |v: u32, gap: Vec3| EdgePlace { vertex: v, place: positions[v as usize], offset: offset(v), gap };
    let target = |v: u32| positions[v as usize] + offset(v);
    let upper: Vec<EdgePlace> = pairs.iter().map(|&[u, l]| place(u, target(l) - target(u))).collect();
    let lower: Vec<EdgePlace> = pairs.iter().map(|&[_, l]| place(l, Vec3::zeros())).collect();
    for (v, d) in &mut blink.offsets {
        let p = &positions[*v as usize];
        let (distance, along, gap) = nearest_on_edge(&upper, p);
        if distance < nearest_on_edge(&lower, p).0 && along.norm() > 0.0 {
            *d += gap * (d.dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        }
    }
    // The edge itself closes exactly, also in the corners, which the blink may leave alone.
    blink.offsets.retain(|(v, _)| upper.iter().all(|e| e.vertex != *v));
    blink.offsets.extend(upper.iter().map(|e| (e.vertex, e.offset + e.gap)));
    blink.offsets.sort_unstable_by_key(|(v, _)| *v);
}

/// A vertex of a lid's edge.
struct EdgePlace {
    vertex: u32,
    place: Vec3,
    /// What the blink adds to it.
    offset: Vec3,
    /// What it then lacks to meet the other lid.
    gap: Vec3,
}

/// Distance, offset and gap at the place of the edge's polyline that is nearest to a point.
fn nearest_on_edge(edge: &[EdgePlace], point: &Vec3) -> (f64, Vec3, Vec3) {
    let on_segment = |pair: &[EdgePlace]| {
        let (a, b) = (&pair[0], &pair[1]);
        let line = b.place - a.place;
        let t = (line.dot(&(point - a.place)) / line.norm_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        ((a.place + line * t - point).norm(), a.offset.lerp(&b.offset, t), a.gap.lerp(&b.gap, t))
    };
    let nearest = edge.windows(2).map(on_segment).min_by(|a, b| a.0.total_cmp(&b.0));
    nearest.unwrap_or_else(|| (f64::MAX, Vec3::zeros(), Vec3::zeros()))
}

/// Pairs of lip vertices that touch at rest: the lower one follows the jaw, the upper one stays.
pub fn lip_contacts(positions: &[Vec3], normals: &[Vec3], skin: &Range<usize>, jaw_open: &Key) -> Vec<[u32; 2]> {
    let mut drops = vec![0.0; positions.len()];
    jaw_open.offsets.iter().for_each(|(v, d)| drops[*v as usize] = d.norm());
    let drop = |v: u32| drops[v as usize];
    let most = drops.iter().fold(0.0, |a: f64, b| a.max(*b));
    let (lower, upper): (Vec<u32>, Vec<u32>) = skin.clone().map(|v| v as u32).partition(|&v| drop(v) > 0.35 * most);
    let touches = |a: u32, b: u32| {
        let gap = (positions[a as usize] - positions[b as usize]).norm();
        let opposed = normals[a as usize].dot(&normals[b as usize]) < -0.3;
        (opposed && gap < TOUCH && drop(b) - drop(a) > 0.3 * most).then_some(gap)
    };
    outwards(mutual_nearest(&upper, &lower, touches), positions)
}

/// Pairs that are each other's nearest by `distance`, which is `None` for pairs that do not count.
fn mutual_nearest(upper: &[u32], lower: &[u32], distance: impl Fn(u32, u32) -> Option<f64>) -> Vec<[u32; 2]> {
    let nearest = |candidates: &mut dyn Iterator<Item = (u32, Option<f64>)>| {
        candidates.filter_map(|(v, d)| Some((v, d?))).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(v, _)| v)
    };
    let pair = |&a: &u32| {
        let b = nearest(&mut lower.iter().map(|&b| (b, distance(a, b))))?;
        let back = nearest(&mut upper.iter().map(|&c| (c, distance(c, b))))?;
        (back == a).then_some([a, b])
    };
    upper.iter().filter_map(pair).collect()
}

/// Sorts pairs by their distance from the middle plane.
fn outwards(mut pairs: Vec<[u32; 2]>, positions: &[Vec3]) -> Vec<[u32; 2]> {
    let aside = |p: &[u32; 2]| positions[p[0] as usize].x;
    pairs.sort_by(|a, b| aside(a).abs().total_cmp(&aside(b).abs()).then(aside(a).total_cmp(&aside(b))));
    pairs
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three rings of 28 around an opening 24 mm wide and `height` high: its edge (from vertex 0), the lids outside it
    /// (from 28) and the lids' inner side (from 56).
    fn eye(height: f64) -> (Vec<Vec3>, Vec<[u32; 4]>) {
        let ring = |radius: f64| {
            (0..28).map(move |i| {
                let angle = std::f64::consts::TAU * (f64::from(i) + 0.5) / 28.0;
                Vec3::new(0.03 + 0.012 * radius * angle.cos(), height / 2.0 * radius * angle.sin(), 0.0)
            })
        };
        let band = |a: u32, b: u32| (0..28).map(move |i| [a + i, b + i, b + (i + 1) % 28, a + (i + 1) % 28]);
        (ring(1.0).chain(ring(1.3)).chain(ring(0.9)).collect(), band(0, 28).chain(band(56, 0)).collect())
    }

    #[test]
    fn lids_pair_above_one_another_and_close_exactly() {
        let (positions, quads) = eye(0.010);
        let pairs = lid_contacts(&positions, &quads, 3).unwrap();
        assert_eq!(pairs.len(), 14);
        for [u, l] in &pairs {
            let (u, l) = (positions[*u as usize], positions[*l as usize]);
            assert!(u.y > l.y && (u.x - l.x).abs() < 1e-9);
        }
        // A blink made for a higher opening goes too far; the lid's fold follows the edge by 0.4.
        let lid = |v: &u32| positions[*v as usize].y > 0.0;
        let down = |v: u32| {
            let follows = if (28..56).contains(&v) { 0.4 / 1.3 } else { 1.0 };
            (v, Vec3::new(0.0005, -2.6 * positions[v as usize].y * follows, 0.0))
        };
        let mut blink = Key { name: "eyeBlinkLeft".into(), offsets: (0..56).filter(lid).map(down).collect() };
        let length = |key: &Key, v: u32| key.offsets.iter().find(|(w, _)| *w == v).unwrap().1.norm();
        let before = length(&blink, 35);
        close_lids(&mut blink, &positions, &pairs);
        for [u, l] in &pairs {
            let d = blink.offsets.iter().find(|(v, _)| v == u).unwrap().1;
            assert!((positions[*u as usize] + d - positions[*l as usize]).norm() < 1e-9);
        }
        assert!((0.5..0.99).contains(&(length(&blink, 35) / before)), "the fold follows");
    }

    /// Two rows of five vertices.
    fn rows(gap: f64) -> Vec<Vec3> {
        (0..10).map(|i| Vec3::new(f64::from(i % 5) * 0.004, if i < 5 { gap } else { 0.0 }, 0.0)).collect()
    }

    #[test]
    fn lips_touch_where_they_face_each_other() {
        let normals: Vec<Vec3> = (0..10).map(|v| if v < 5 { -Vec3::y() } else { Vec3::y() }).collect();
        let jaw = Key { name: "jawOpen".into(), offsets: (5..10).map(|v| (v, Vec3::new(0.0, -0.02, 0.0))).collect() };
        assert_eq!(lip_contacts(&rows(0.0004), &normals, &(0..10), &jaw).len(), 5);
        assert!(lip_contacts(&rows(0.004), &normals, &(0..10), &jaw).is_empty(), "an open mouth");
        assert!(lip_contacts(&rows(0.0004), &[Vec3::y(); 10], &(0..10), &jaw).is_empty(), "a fold, not a mouth");
    }
}
