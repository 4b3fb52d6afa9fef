//! Pictures of a round piece of skin with a known relief, cast ray by ray: nothing of it is made of triangles or windows.

use crate::noise::Random;
use geometry::{Camera, Transform, Vec2, Vec3};
use image::{GrayImage, Luma};
use nalgebra::Rotation3;
use rayon::prelude::*;

/// Radius of the piece without relief, metres.
const RADIUS: f64 = 0.06;
/// Samples along a side of a pixel.
const SAMPLES: u32 = 3;
/// Steps of the search along a ray.
const STEPS: usize = 8;
/// Waves that the texture and the relief are made of.
const WAVES: usize = 90;
const BUMPS: usize = 8;

/// How a piece of skin looks, and how it is filmed.
#[derive(Clone, Debug, PartialEq)]
pub struct SkinOptions {
    /// Height of the relief, root mean square, metres.
    pub relief: f64,
    /// Contrast of the texture, root mean square, parts of the colour; zero is bare skin.
    pub contrast: f64,
    /// Noise of the camera, grey levels.
    pub noise: f64,
    /// Standard deviation of the lens's blur, pixels.
    pub blur: f32,
    /// Seed of everything random.
    pub seed: u64,
}

impl Default for SkinOptions {
    fn default() -> Self {
        Self { relief: 0.0005, contrast: 0.06, noise: 1.0, blur: 0.5, seed: 1 }
    }
}

/// A wave: one over its length over 2π, its phase and its height.
type Wave = (Vec3, f64, f64);

/// A piece of skin around +z, seen from outside.
pub struct Skin {
    options: SkinOptions,
    texture: Vec<Wave>,
    relief: Vec<Wave>,
}

impl Skin {
    /// Its texture has waves of 1.2 to 8 mm, its relief of 14 to 30 mm.
    pub fn new(options: &SkinOptions) -> Self {
        let mut random = Random::new(options.seed);
        let mut waves = |count: usize, [short, long]: [f64; 2], height: f64| -> Vec<Wave> {
            let wave = |_| {
                let way = Vec3::from_fn(|_, _| random.normal()).normalize();
                let length = short * (long / short).powf(random.uniform());
                (way * (std::f64::consts::TAU / length), random.between(0.0, std::f64::consts::TAU), height)
            };
            (0..count).map(wave).collect()
        };
        let texture = waves(WAVES, [0.0012, 0.008], options.contrast * (2.0 / WAVES as f64).sqrt());
        let relief = waves(BUMPS, [0.014, 0.03], options.relief * (2.0 / BUMPS as f64).sqrt());
        Self { options: options.clone(), texture, relief }
    }

    /// Its distance from the middle in a direction of unit length, metres.
    pub fn radius(&self, direction: &Vec3) -> f64 {
        RADIUS + sum(&self.relief, &(direction * RADIUS))
    }

    /// The direction in which a grid of so many rows and columns has a place, each `step` metres apart.
    pub fn direction(column: f64, row: f64, step: f64) -> Vec3 {
        let turn = Rotation3::from_euler_angles(-row * step / RADIUS, column * step / RADIUS, 0.0);
        turn * Vec3::z()
    }

    /// A sphere without relief, as a grid of quads, `count` vertices along a side: positions and quads.
    pub fn ball(count: u32, step: f64) -> (Vec<Vec3>, Vec<[u32; 4]>) {
        let at = |k: u32| f64::from(k) - f64::from(count - 1) / 2.0;
        let place = |i: u32| Self::direction(at(i % count), at(i / count), step) * RADIUS;
        let quad = |i: u32| [i, i + 1, i + count + 1, i + count];
        let quads = (0..count * (count - 1)).filter(|i| i % count + 1 < count).map(quad).collect();
        ((0..count * count).map(place).collect(), quads)
    }

    /// A pose of the head that is turned to the side, radians, before a camera at a distance, metres.
    pub fn pose(yaw: f64, pitch: f64, distance: f64) -> Transform {
        let facing = Rotation3::from_axis_angle(&Vec3::x_axis(), std::f64::consts::PI);
        let turn = facing * Rotation3::from_euler_angles(pitch, yaw, 0.0);
        Transform::new(turn, Vec3::new(0.0, 0.0, distance) - turn * Vec3::new(0.0, 0.0, RADIUS))
    }

    /// A picture; `frame` seeds its noise.
    pub fn picture(&self, camera: &Camera, cam_from_head: &Transform, frame: u64) -> GrayImage {
        let rows: Vec<Vec<f32>> = (0..camera.height)
            .into_par_iter()
            .map(|y| (0..camera.width).map(|x| self.pixel(camera, cam_from_head, x, y)).collect())
            .collect();
        let sharp = image::ImageBuffer::<Luma<f32>, Vec<f32>>::from_fn(camera.width, camera.height, |x, y| {
            Luma([rows[y as usize][x as usize]])
        });
        let soft = if self.options.blur > 0.0 { image::imageops::blur(&sharp, self.options.blur) } else { sharp };
        let mut random = Random::new(self.options.seed.wrapping_mul(1000) + frame);
        let level =
            |value: f32| (f64::from(value) + self.options.noise * random.normal()).round().clamp(0.0, 255.0) as u8;
        let levels = soft.into_raw().into_iter().map(level).collect();
        GrayImage::from_raw(camera.width, camera.height, levels).unwrap_or_default()
    }

    /// Mean of the samples of a pixel.
    fn pixel(&self, camera: &Camera, cam_from_head: &Transform, x: u32, y: u32) -> f32 {
        let at = |k: u32, s: u32| f64::from(k) + (f64::from(s) + 0.5) / f64::from(SAMPLES) - 0.5;
        let samples = (0..SAMPLES * SAMPLES).map(|s| {
            let ray = camera.ray(&Vec2::new(at(x, s % SAMPLES), at(y, s / SAMPLES)));
            self.light(cam_from_head, &ray)
        });
        (samples.sum::<f64>() / f64::from(SAMPLES * SAMPLES)) as f32
    }

    /// Grey level in a direction of the camera; the light stands still beside the camera.
    fn light(&self, cam_from_head: &Transform, ray: &Vec3) -> f64 {
        let head_from_cam = cam_from_head.inverse();
        let (eye, way) = (head_from_cam.translation, head_from_cam.rotation * ray);
        let along = -eye.dot(&way);
        let depth = RADIUS * RADIUS - (eye + way * along).norm_squared();
        if depth < 0.0 {
            return 40.0;
        }
        let mut distance = along - depth.sqrt();
        for _ in 0..STEPS {
            let place = eye + way * distance;
            let out = place.normalize();
            distance -= (place.norm() - self.radius(&out)) / out.dot(&way).min(-0.05);
        }
        let place = eye + way * distance;
        let normal = cam_from_head.rotation * place.normalize();
        let lamp = Vec3::new(-0.5, -0.6, -0.62);
        150.0 * (0.35 + 0.65 * normal.dot(&lamp).max(0.0)) * (1.0 + sum(&self.texture, &place))
    }
}

fn sum(waves: &[Wave], at: &Vec3) -> f64 {
    waves.iter().map(|(way, phase, height)| height * (way.dot(at) + phase).cos()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_has_the_same_texture_in_every_picture() {
        let skin = Skin::new(&SkinOptions { relief: 0.0, contrast: 0.3, noise: 0.0, blur: 0.0, seed: 3 });
        let camera = Camera { k1: -0.1, ..Camera::centred(120, 120, 700.0) };
        let poses = [Skin::pose(0.0, 0.0, 0.6), Skin::pose(0.2, 0.1, 0.6)];
        let pictures = poses.map(|pose| skin.picture(&camera, &pose, 0));
        let (grid, _) = Skin::ball(9, 0.003);
        let levels = |k: usize| -> Vec<f64> {
            let pixel = |p: &Vec3| camera.project(&poses[k].apply(p)).unwrap().map(f64::round);
            grid.iter().map(|p| f64::from(pictures[k].get_pixel(pixel(p).x as u32, pixel(p).y as u32)[0])).collect()
        };
        let (a, b) = (levels(0), levels(1));
        let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
        let (ma, mb) = (mean(&a), mean(&b));
        let product =
            |x: &[f64], mx: f64, y: &[f64], my: f64| x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>();
        let alike = product(&a, ma, &b, mb) / (product(&a, ma, &a, ma) * product(&b, mb, &b, mb)).sqrt();
        assert!(alike > 0.8, "{alike}");
    }
}
