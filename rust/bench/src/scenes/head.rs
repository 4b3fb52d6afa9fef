//! Pictures of the synthetic head with a skin of waves, for resolutions that the clip has not.

use super::noisy;
use super::seen::{Body, Seen};
use geometry::{Vec2, Vec3};
use image::GrayImage;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};
use synthetic::{Random, head_surface};

/// Rows and columns of the sphere that is blown up to the head: facets of about a millimetre.
const GRID: (u32, u32) = (320, 640);
/// Standard deviation of the noise, grey levels.
const NOISE: f64 = 1.5;
/// Where the light comes from in the camera frame.
const LAMP_IN_CAM: Vec3 = Vec3::new(-0.5, -0.6, -1.0);
/// Number of waves of the skin.
const WAVES: usize = 24;

/// The synthetic head as triangles.
pub fn body() -> Body {
    let (rows, columns) = GRID;
    let vertex = |k: u32| {
        let (down, around) =
            (f64::from(k / columns) / f64::from(rows) * PI, f64::from(k % columns) / f64::from(columns) * TAU);
        head_surface(&Vec3::new(down.sin() * around.sin(), down.cos(), down.sin() * around.cos()))
    };
    let quad = |k: u32| {
        let (i, j) = (k / columns, k % columns);
        let at = |i: u32, j: u32| i * columns + j % columns;
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    Body {
        positions: (0..(rows + 1) * columns).map(vertex).collect(),
        triangles: (0..rows * columns).flat_map(quad).collect(),
    }
}

/// The head in a frame, lit by a lamp that stands still.
pub fn picture(seen: &Seen<'_>, seed: u64) -> GrayImage {
    let (skin, width) = (Skin::new(), seen.camera.width as usize);
    let lamp_in_head = seen.cam_from_head.rotation.inverse() * LAMP_IN_CAM.normalize();
    let grey = |k: usize| {
        let pixel = Vec2::new((k % width) as f64, (k / width) as f64);
        let Some((point, normal)) = seen.point(&pixel) else { return 60.0 };
        (0.5 + 0.5 * normal.dot(&lamp_in_head).max(0.0)) * skin.grey(&point)
    };
    let greys: Vec<f64> = (0..width * seen.camera.height as usize).into_par_iter().map(grey).collect();
    noisy(seen.camera.width, &greys, NOISE, &mut Random::new(seed))
}

/// Waves through space that the surface cuts: freckles and blotches from 4 to 40 millimetres, none finer than the
/// picture can hold.
struct Skin([(Vec3, f64); WAVES]);

impl Skin {
    fn new() -> Self {
        let mut random = Random::new(11);
        Self(std::array::from_fn(|k| {
            let length = 0.004 * 10.0_f64.powf(k as f64 / WAVES as f64);
            let direction = Vec3::new(random.normal(), random.normal(), random.normal()).normalize();
            (direction * (TAU / length), random.between(0.0, TAU))
        }))
    }

    fn grey(&self, point: &Vec3) -> f64 {
        150.0 + self.0.iter().map(|(wave, phase)| 4.0 * (wave.dot(point) + phase).sin()).sum::<f64>()
    }
}
