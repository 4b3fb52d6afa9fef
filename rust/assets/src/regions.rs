//! Where on the head it matters most.
//!
//! # Entry points
//! [`alignment_weights`], [`importance`].
//!
//! Frames show the face; cranium and neck are mostly hair and collar. The class spends its components accordingly.

use geometry::{Vec3, smooth_step};
use head::{Part, part};

/// 1 on the face from hairline to chin and on to the ears, 0 behind; positions in the head frame.
fn face(p: &Vec3) -> f64 {
    smooth_step(-0.11, -0.06, p.z) * smooth_step(-0.15, -0.12, p.y) * (1.0 - smooth_step(0.06, 0.10, p.y))
}

/// 0 on the neck, 1 on the rest of the head.
fn skull(p: &Vec3) -> f64 {
    smooth_step(-0.15, -0.11, p.y)
}

/// What each vertex counts when heads are laid over one another: skin of skull and face.
pub fn alignment_weights(positions: &[Vec3], parts: &[Part], cavity: &[bool]) -> Vec<f64> {
    let skin = parts.iter().find(|p| p.name == part::SKIN).map_or(0..0, |p| p.vertices.clone());
    let weight = |(v, p): (usize, &Vec3)| {
        if skin.contains(&v) && !cavity[v] { skull(p) * (0.2 + 0.8 * face(p)) } else { 0.0 }
    };
    positions.iter().enumerate().map(weight).collect()
}

/// What each vertex counts in the components: face 1, ears and cranium less, neck and everything hidden little.
pub fn importance(positions: &[Vec3], parts: &[Part], cavity: &[bool]) -> Vec<f64> {
    let skin = parts.iter().find(|p| p.name == part::SKIN).map_or(0..0, |p| p.vertices.clone());
    let weight = |(v, p): (usize, &Vec3)| {
        if skin.contains(&v) && !cavity[v] { 0.02 + 0.13 * skull(p) + 0.85 * face(p) } else { 0.02 }
    };
    positions.iter().enumerate().map(weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_face_counts_most_and_hidden_places_least() {
        let positions =
            [[0.0, -0.04, 0.02], [0.0, 0.13, -0.08], [0.0, -0.20, -0.08], [0.0, -0.06, 0.0]].map(Vec3::from);
        let parts = [Part { name: part::SKIN.to_owned(), vertices: 0..4, quads: 0..0 }];
        let cavity = [false, false, false, true];
        let [nose, crown, neck, mouth_bag] = importance(&positions, &parts, &cavity)[..] else { panic!() };
        assert!(nose > 0.99 && nose > 5.0 * crown && crown > 3.0 * neck && neck == mouth_bag);
        let aligned = alignment_weights(&positions, &parts, &cavity);
        assert!(aligned[0] > aligned[1] && aligned[1] > 0.0 && aligned[2] == 0.0 && aligned[3] == 0.0);
    }
}
