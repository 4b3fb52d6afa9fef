//! Pictures of a checkerboard by ray casting and area sampling.

use super::noisy;
use geometry::{Camera, Transform, Vec2, Vec3};
use image::GrayImage;
use nalgebra::Rotation3;
use rayon::prelude::*;
use synthetic::Random;

/// Inner corners of the board: columns, rows.
pub const INNER: (u32, u32) = (9, 6);
/// Side of a square, metres.
pub const SQUARE: f64 = 0.0255;
/// Rays per pixel, on a lattice that has each row and each column once.
const RAYS: usize = 16;
/// Standard deviation of the noise, grey levels.
const NOISE: f64 = 2.0;

/// Corners in the board's plane, row by row, metres.
pub fn corners((columns, rows): (u32, u32), square: f64) -> Vec<Vec2> {
    let corner = |i: u32, j: u32| Vec2::new(f64::from(i), f64::from(j)) * square;
    (0..rows).flat_map(|j| (0..columns).map(move |i| corner(i, j))).collect()
}

/// `cam_from_board` of a board tilted to a side of its own in each picture, shown in all parts of the frame.
pub fn pose(view: usize, distance: f64) -> Transform {
    let mut random = Random::new(view as u64);
    let turn = view as f64 * 2.4;
    let tilt = random.between(0.2, 0.6);
    let rotation = Rotation3::new(Vec3::new(turn.cos(), turn.sin(), 0.0) * tilt)
        * Rotation3::new(Vec3::z() * random.between(-0.3, 0.3));
    let middle = Vec3::new(f64::from(INNER.0 - 1), f64::from(INNER.1 - 1), 0.0) * (0.5 * SQUARE);
    let distance = distance * random.between(0.95, 1.25);
    let aside = Vec3::new(random.between(-0.12, 0.12), random.between(-0.07, 0.07), 1.0) * distance;
    Transform::new(rotation, aside - rotation * middle)
}

/// The board through a camera.
pub fn picture(camera: &Camera, cam_from_board: &Transform, seed: u64) -> GrayImage {
    let width = camera.width as usize;
    let board_from_cam = cam_from_board.inverse();
    let mean = |k: usize| {
        let ray = |n: usize| {
            let offset = Vec2::new(n as f64 + 0.5, (5 * n % RAYS) as f64 + 0.5) / RAYS as f64;
            let pixel = Vec2::new((k % width) as f64 - 0.5, (k / width) as f64 - 0.5) + offset;
            light(camera, &board_from_cam, &pixel)
        };
        (0..RAYS).map(ray).sum::<f64>() / RAYS as f64
    };
    let sharp: Vec<f64> = (0..width * camera.height as usize).into_par_iter().map(mean).collect();
    let grey: Vec<f64> = blurred(&sharp, width).iter().map(|light| 255.0 * light.powf(1.0 / 2.2)).collect();
    noisy(camera.width, &grey, NOISE, &mut Random::new(seed))
}

/// Linear light that a ray sees: the board with a white margin before a grey wall, a little darker to the right.
fn light(camera: &Camera, board_from_cam: &Transform, pixel: &Vec2) -> f64 {
    let (origin, ray) = (board_from_cam.translation, board_from_cam.rotation * camera.ray(pixel));
    let hit = (origin - ray * (origin.z / ray.z)) / SQUARE;
    let inside = |margin: f64| {
        let within = |x: f64, count: u32| x > -1.0 - margin && x < f64::from(count) + margin;
        within(hit.x, INNER.0) && within(hit.y, INNER.1)
    };
    let black = (hit.x.floor() + hit.y.floor()).rem_euclid(2.0) == 0.0;
    let reflectance = match (inside(0.0), inside(0.6)) {
        (true, _) if black => 0.03,
        (_, true) => 0.55,
        _ => 0.2,
    };
    reflectance * (1.0 - 0.2 * pixel.x / f64::from(camera.width))
}

/// A lens' blur: the binomial [1 4 1] / 6 along both axes, a standard deviation of 0.58 pixels.
fn blurred(pixels: &[f64], width: usize) -> Vec<f64> {
    let pass = |from: &[f64], step: usize| -> Vec<f64> {
        let last = from.len() - 1;
        let value = |k: usize| (from[k.saturating_sub(step)] + 4.0 * from[k] + from[(k + step).min(last)]) / 6.0;
        (0..from.len()).map(value).collect()
    };
    pass(&pass(pixels, 1), width)
}
