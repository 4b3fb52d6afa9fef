//! The eyes' own texture map.
//!
//! # Entry point
//! [`eye_uvs`].
//!
//! Both balls lie side by side in one map meant for pictures twice as wide as high: the subject's right ball in the left
//! half, as one sees them. Each is drawn about its axis of gaze (+z) with true angles: the front half of the ball fills the
//! disc to 0.8 of its radius, the back half is squeezed into the ring around it, so that the iris gets many texels.

use crate::keys::ball_centre;
use geometry::Vec3;
use head::{Part, part};
use std::f64::consts::{FRAC_PI_2, PI};

/// Radius of each disc, in parts of the map's height.
const RADIUS: f64 = 0.48;
/// Part of the radius that shows the front half.
const FRONT: f64 = 0.8;

/// Texture coordinates of the corners of an eyeball's quads.
pub fn eye_uvs(positions: &[Vec3], quads: &[[u32; 4]], eye: &Part) -> Vec<[[f32; 2]; 4]> {
    let centre = ball_centre(&positions[eye.vertices.clone()]);
    let middle = if eye.name == part::EYE_LEFT { 0.75 } else { 0.25 };
    let place = |direction: Vec3, turn: f64| {
        let radius = RADIUS * squeeze(direction.z.clamp(-1.0, 1.0).acos());
        [(middle + 0.5 * radius * turn.cos()) as f32, (0.5 + radius * turn.sin()) as f32]
    };
    let corner_uvs = |quad: &[u32; 4]| {
        let directions = quad.map(|v| (positions[v as usize] - centre).normalize());
        let mean: Vec3 = directions.iter().sum();
        let turn = |d: &Vec3| d.y.atan2(d.x);
        // Around the back pole the map tears: those quads take the direction of their middle.
        let behind = mean.normalize().z < -0.9;
        directions.map(|d| place(d, if behind { turn(&mean) } else { turn(&d) }))
    };
    quads[eye.quads.clone()].iter().map(corner_uvs).collect()
}

/// Share of the disc's radius at an angle from the gaze.
fn squeeze(angle: f64) -> f64 {
    if angle <= FRAC_PI_2 {
        FRONT * angle / FRAC_PI_2
    } else {
        FRONT + (1.0 - FRONT) * (angle - FRAC_PI_2) / (PI - FRAC_PI_2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pupil_is_in_the_middle_and_angles_are_true() {
        let centre = Vec3::new(-0.03, 0.0, 0.0);
        let offsets = [[0.1, 0.0, 1.0], [0.0, 0.1, 1.0], [-0.1, 0.0, 1.0], [0.0, -0.1, 1.0]];
        let mut positions: Vec<Vec3> = offsets.map(|o| centre + Vec3::from(o) * 0.012).to_vec();
        positions.extend(offsets.map(|o| centre - Vec3::from(o) * 0.012));
        let eye = Part { name: part::EYE_RIGHT.to_owned(), vertices: 0..8, quads: 0..2 };
        let uvs = eye_uvs(&positions, &[[0, 1, 2, 3], [4, 5, 6, 7]], &eye);
        let (right, up, left) = (uvs[0][0], uvs[0][1], uvs[0][2]);
        assert!((right[0] + left[0] - 0.5).abs() < 1e-6 && right[0] > left[0]);
        assert!(((right[0] - 0.25) * 2.0 - (up[1] - 0.5)).abs() < 1e-6, "a circle in a picture of 2:1");
        assert!(uvs.iter().flatten().flatten().all(|x| (0.0..=1.0).contains(x)));
    }
}
