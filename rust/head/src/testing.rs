//! Heads for tests: the built asset, and other people made from it.

use crate::GenericHead;
use crate::eyes::{EyeOptions, carry_parts, fit_eyes, place_eyes};
use geometry::Vec3;
use std::path::Path;

/// The real head, if it has been built.
pub(crate) fn asset() -> Option<GenericHead> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/assets/generic_head.safetensors.gz");
    let bytes = std::fs::read(&path).ok();
    if bytes.is_none() {
        eprintln!("skipped: {} has not been built", path.display());
    }
    bytes.map(|b| GenericHead::from_bytes(&b).unwrap())
}

/// Normal numbers from a fixed seed (Box–Muller over a linear congruence).
fn normals(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    };
    (0..count).map(|_| (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()).collect()
}

/// A member of the class with normal coefficients times `size`, bent by a smooth wave of `wave` metres.
pub(crate) fn person(generic: &GenericHead, seed: u64, size: f64, wave: f64) -> Vec<Vec3> {
    let coefficients: Vec<f64> = normals(seed, generic.identity.components).iter().map(|x| x * size).collect();
    let phase = normals(seed + 100, 3);
    let bend = |p: &Vec3| {
        let s = |a: f64, k: usize| wave * (a / 0.02 + phase[k]).sin();
        p + Vec3::new(s(p.y, 0), s(p.z, 1), s(p.x, 2))
    };
    let mut positions: Vec<Vec3> = generic.with_identity(&coefficients).iter().map(bend).collect();
    carry_parts(generic, &mut positions).unwrap();
    positions
}

/// A person with fitted eyes.
pub(crate) fn with_eyes(generic: &GenericHead, seed: u64, size: f64, wave: f64) -> Vec<Vec3> {
    let mut positions = person(generic, seed, size, wave);
    let eyes = fit_eyes(generic, &positions, &[None; 2], &EyeOptions::default()).unwrap();
    place_eyes(generic, &mut positions, &eyes).unwrap();
    positions
}
