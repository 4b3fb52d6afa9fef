//! Lips that touch at rest.
//!
//! The class and the free deformation move upper and lower lip apart by what the measurements err; a person who keeps the
//! mouth shut while filmed has lips that touch, out to the corners. [`close_lips`] lets the skin along the slit follow one
//! smooth map of space, which takes what touches on the generic head to what touches.

use crate::eyes::rim_edges;
use crate::transfer::control_weights;
use crate::warp::LocalWarp;
use crate::{GenericHead, HeadError};
use geometry::{Vec3, mesh, smooth_step};

/// The rim of the mouth within this of lips that touch belongs to the slit, metres on the generic head.
const CORNER: f64 = 0.015;
/// Skin within this of the slit follows the map …
const FOLLOWS: f64 = 0.002;
/// … and from here on keeps its own place, metres on the generic head.
const KEEPS: f64 = 0.009;
/// The generic head's lips leave a slit at the corners, where no vertices meet: lips swell by this there, metres.
const SEAL: f64 = 6e-4;
/// Corners begin this far from the last vertices that meet, metres on the generic head.
const LAST_CONTACT: (f64, f64) = (0.001, 0.004);
/// Vertices of lips that touch are no farther apart, metres.
const TOUCH: f64 = 2.5e-4;
/// What the map averages over, metres: the height of both lips.
const REACH: f64 = 0.014;

/// Moves the skin of `positions` (all vertices) along the slit of the mouth so that the lips touch as they do on the generic head.
///
/// # Errors
/// [`HeadError::Topology`] for another number of vertices.
pub fn close_lips(generic: &GenericHead, positions: &mut [Vec3]) -> Result<(), HeadError> {
    let (found, wanted) = (positions.len(), generic.positions.len());
    if found != wanted {
        return Err(HeadError::Topology { found, wanted });
    }
    let (contacts, slit) = slit(generic);
    let before = positions.to_vec();
    let normals = mesh::vertex_normals(&generic.positions, &generic.triangles(generic.skin()));
    let weights = control_weights(generic);
    let warp = LocalWarp::with_reach(&generic.positions, &before, &weights, REACH);
    for v in generic.skin().vertices.clone() {
        let place = &generic.positions[v];
        let follow = smooth_step(KEEPS, FOLLOWS, distance(&slit, place));
        if follow > 0.0 {
            let seal = SEAL * smooth_step(LAST_CONTACT.0, LAST_CONTACT.1, distance(&contacts, place));
            let up = Vec3::new(0.0, normals[v].y, 0.0);
            positions[v] = before[v].lerp(&(warp.at(place).position + up * seal), follow);
        }
    }
    meet(generic, &warp, positions);
    Ok(())
}

/// Vertices that touch lie by one another as they do on the generic head, but nearer than [`TOUCH`]: a face that is sheared where its
/// lips meet would part them, or push one through the other.
fn meet(generic: &GenericHead, warp: &LocalWarp<'_>, positions: &mut [Vec3]) {
    for [a, b] in generic.lip_contacts.iter().map(|pair| pair.map(|v| v as usize)) {
        let (middle, apart) = (positions[a].lerp(&positions[b], 0.5), generic.positions[a] - generic.positions[b]);
        let apart = apart * warp.at(&generic.positions[a]).scale;
        let half = apart * (0.5 * TOUCH / apart.norm().max(TOUCH));
        (positions[a], positions[b]) = (middle + half, middle - half);
    }
}

/// Distance from the nearest of some points.
fn distance(points: &[Vec3], place: &Vec3) -> f64 {
    points.iter().map(|p| (p - place).norm_squared()).fold(f64::INFINITY, f64::min).sqrt()
}

/// Where the generic head's lips meet: vertices that touch, and those with the rim of the mouth out to its corners.
fn slit(generic: &GenericHead) -> (Vec<Vec3>, Vec<Vec3>) {
    let place = |v: u32| generic.positions[v as usize];
    let contacts: Vec<Vec3> = generic.lip_contacts.iter().flatten().map(|&v| place(v)).collect();
    let rim = rim_edges(generic).into_iter().flatten().map(place).filter(|p| distance(&contacts, p) < CORNER);
    let slit = contacts.iter().copied().chain(rim).collect();
    (contacts, slit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eyes::carry_parts;
    use crate::part;
    use crate::testing::{asset, person};
    use geometry::median;

    /// Lines of sight from in front, one per half millimetre, that meet a tooth before the skin.
    fn teeth_seen(generic: &GenericHead, positions: &[Vec3]) -> usize {
        let near = |t: &[u32; 3]| generic.lip_contacts.iter().any(|c| near_pair(generic, c, t));
        let skin: Vec<[u32; 3]> = generic.triangles(generic.skin()).into_iter().filter(near).collect();
        let teeth: Vec<[u32; 3]> = [part::TEETH_UPPER, part::TEETH_LOWER]
            .iter()
            .flat_map(|n| generic.triangles(generic.part(n).unwrap()))
            .collect();
        let middle = positions[generic.lip_contacts[0][0] as usize];
        let nearest = |list: &[[u32; 3]], x: f64, y: f64| {
            list.iter().filter_map(|t| depth(positions, t, x, y)).fold(f64::MIN, f64::max)
        };
        let columns = (-50..=50).map(|i| middle.x + f64::from(i) * 5e-4);
        let seen = |(x, y): (f64, f64)| nearest(&teeth, x, y) > nearest(&skin, x, y);
        columns.flat_map(|x| (-16..=16).map(move |j| (x, middle.y + f64::from(j) * 5e-4))).filter(|&p| seen(p)).count()
    }

    fn near_pair(generic: &GenericHead, pair: &[u32; 2], triangle: &[u32; 3]) -> bool {
        (generic.positions[triangle[0] as usize] - generic.positions[pair[0] as usize]).norm() < 0.04
    }

    /// Where a line along z meets a triangle.
    fn depth(positions: &[Vec3], triangle: &[u32; 3], x: f64, y: f64) -> Option<f64> {
        let normal = mesh::area_normal(positions, triangle);
        let [a, b, c] = triangle.map(|v| positions[v as usize]);
        let side = |p: &Vec3, q: &Vec3| (q.x - p.x) * (y - p.y) - (q.y - p.y) * (x - p.x);
        let sides = [side(&a, &b), side(&b, &c), side(&c, &a)];
        let inside = sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0);
        (inside && normal.z.abs() > 1e-15).then(|| a.z - (normal.x * (x - a.x) + normal.y * (y - a.y)) / normal.z)
    }

    /// Lips torn apart as measuring errors do, more on one side.
    fn torn(generic: &GenericHead, positions: &[Vec3]) -> Vec<Vec3> {
        let middle = generic.positions[generic.lip_contacts[0][0] as usize];
        let tear = |(v, p): (usize, &Vec3)| {
            let away = generic.positions[v] - middle;
            let side = if generic.lip_contacts.iter().any(|c| c[0] == v as u32) || away.y > 0.0 { 1.0 } else { -1.0 };
            p + Vec3::new(0.0, side * 0.0012 * (1.0 + 20.0 * away.x), 0.0) * (-(away.norm() / 0.03).powi(2)).exp()
        };
        positions.iter().enumerate().map(tear).collect()
    }

    #[test]
    fn no_tooth_shows_between_lips_that_were_torn_apart() {
        let Some(generic) = asset() else { return };
        for seed in 0..4 {
            let mut open = torn(&generic, &person(&generic, seed, 1.2, 6e-4));
            carry_parts(&generic, &mut open).unwrap();
            let mut closed = open.clone();
            close_lips(&generic, &mut closed).unwrap();
            carry_parts(&generic, &mut closed).unwrap();
            let (before, after) = (teeth_seen(&generic, &open), teeth_seen(&generic, &closed));
            // One line of sight is a quarter of a square millimetre.
            assert!(before > 15 && after <= 1, "seed {seed}: {before} before, {after} after");
        }
    }

    #[test]
    fn closed_lips_stay_and_so_does_the_rest_of_the_face() {
        let Some(generic) = asset() else { return };
        let mut head = generic.positions.clone();
        close_lips(&generic, &mut head).unwrap();
        assert!(head.iter().zip(&generic.positions).all(|(a, b)| (a - b).norm() <= SEAL));
        assert!(teeth_seen(&generic, &generic.positions) > 0 && teeth_seen(&generic, &head) == 0);
        let person = person(&generic, 3, 1.0, 0.0);
        let mut closed = person.clone();
        close_lips(&generic, &mut closed).unwrap();
        let slit = slit(&generic).1;
        let far = |v: &usize| distance(&slit, &generic.positions[*v]) > KEEPS;
        assert!((0..person.len()).filter(far).all(|v| person[v] == closed[v]));
        assert!(close_lips(&generic, &mut closed[1..]).is_err());
    }

    #[test]
    fn lips_of_a_sheared_face_touch_as_the_generic_heads_do() {
        let Some(generic) = asset() else { return };
        let mut sheared: Vec<Vec3> =
            generic.positions.iter().map(|p| p + Vec3::new(0.0, 0.4 * (p.z - 0.03) + 0.1 * p.x, 0.0)).collect();
        close_lips(&generic, &mut sheared).unwrap();
        let apart = |of: &[Vec3]| {
            median(generic.lip_contacts.iter().map(|[a, b]| (of[*a as usize] - of[*b as usize]).y)).unwrap()
        };
        assert!(apart(&sheared).abs() < TOUCH, "{}", apart(&sheared));
        let open = |[a, b]: &[u32; 2]| (sheared[*a as usize] - sheared[*b as usize]).norm();
        assert!(generic.lip_contacts.iter().all(|pair| open(pair) < TOUCH + 1e-9));
    }
}
