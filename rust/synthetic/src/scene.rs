//! A head-like surface turning before a still camera.
//!
//! The surface is a star around the middle of the skull: an egg with brow, eye sockets, nose, lips, chin, cheeks and ears
//! as smooth bumps, not symmetric, so that no model of a head or of an ellipsoid fits it exactly.

use crate::Random;
use geometry::{Camera, Transform, Vec2, Vec3};
use nalgebra::Rotation3;

/// The middle of the skull in the head frame, metres.
const SKULL: Vec3 = Vec3::new(0.0, -0.025, -0.085);

/// Bumps of the surface: direction seen from the skull's middle, angular width (rad), height (m).
const BUMPS: [([f64; 3], f64, f64); 12] = [
    ([0.00, -0.02, 1.0], 0.13, 0.016),
    ([0.02, -0.17, 1.0], 0.10, 0.020),
    ([0.38, 0.20, 1.0], 0.14, -0.010),
    ([-0.36, 0.21, 1.0], 0.14, -0.011),
    ([0.30, 0.48, 1.0], 0.20, 0.006),
    ([-0.33, 0.47, 1.0], 0.18, 0.007),
    ([0.01, -0.52, 1.0], 0.14, 0.009),
    ([-0.02, -0.85, 1.0], 0.16, 0.012),
    ([0.55, -0.20, 1.0], 0.22, 0.006),
    ([-0.52, -0.24, 1.0], 0.24, 0.005),
    ([1.0, -0.03, -0.10], 0.13, 0.018),
    ([-1.0, 0.02, -0.12], 0.13, 0.017),
];

/// What [`Scene::turning_head`] makes.
#[derive(Clone, Debug)]
pub struct SceneOptions {
    /// The camera, distortion included.
    pub camera: Camera,
    /// Head turn (yaw, degrees) of the first and last frame; the frames between are spaced evenly.
    pub yaw_deg: (f64, f64),
    /// Number of frames.
    pub frames: usize,
    /// Points on the head, spread over the half that looks forward.
    pub points: usize,
    /// Distance of the head's origin from the camera, metres.
    pub distance: f64,
    /// Nod, tilt and sway beside the turn: 1 is about 2° and 5 mm, 0 turns about a fixed upright axis.
    pub wobble: f64,
    /// Standard deviation of each pixel coordinate.
    pub noise_px: f64,
    /// Share of head observations that are wrong.
    pub outliers: f64,
    /// Standard deviation by which wrong observations are off, pixels.
    pub outlier_px: f64,
    /// Points behind the head that stand still; their indices follow the head's.
    pub background: usize,
    /// A point is seen only where the cosine between its normal and the view direction exceeds this; −1 sees all.
    pub min_facing: f64,
    /// Seed of points, noise and outliers.
    pub seed: u64,
}

impl Default for SceneOptions {
    /// 120 CIF frames from −60° to 60°, 66 points, 0.3 px noise, no outliers, no background.
    fn default() -> Self {
        Self {
            camera: Camera::centred(352, 288, 615.0),
            yaw_deg: (-60.0, 60.0),
            frames: 120,
            points: 66,
            distance: 0.65,
            wobble: 1.0,
            noise_px: 0.3,
            outliers: 0.0,
            outlier_px: 15.0,
            background: 0,
            min_facing: 0.25,
            seed: 0,
        }
    }
}

/// One point seen in one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Index of the frame.
    pub frame: usize,
    /// Index of the point; background points come after the head's.
    pub point: usize,
    /// Where it was seen, noise included.
    pub pixel: Vec2,
    /// Whether it was made wrong on purpose.
    pub outlier: bool,
}

/// A scene with its truth.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The still camera.
    pub camera: Camera,
    /// True pose of each frame.
    pub cam_from_head: Vec<Transform>,
    /// True points in the head frame.
    pub points: Vec<Vec3>,
    /// Outward unit normals of the points.
    pub normals: Vec<Vec3>,
    /// Background points in the camera frame.
    pub background: Vec<Vec3>,
    /// What is seen, ordered by point, then frame.
    pub observations: Vec<Observation>,
}

impl Scene {
    /// Makes a scene; the same options give the same scene.
    pub fn turning_head(options: &SceneOptions) -> Self {
        let mut random = Random::new(options.seed);
        let (points, normals) = (0..options.points).map(|_| random_surface_point(&mut random)).unzip();
        let background = (0..options.background).map(|_| background_point(&mut random, options)).collect();
        let cam_from_head = (0..options.frames).map(|i| pose_of_frame(i, options)).collect();
        let camera = options.camera;
        let mut scene = Self { camera, cam_from_head, points, normals, background, observations: Vec::new() };
        scene.observe(options, &mut random);
        scene
    }

    /// The observations of two frames that see the same points: `(point, pixel in a, pixel in b, either is wrong)`.
    pub fn matches(&self, a: usize, b: usize) -> Vec<(usize, Vec2, Vec2, bool)> {
        let of = |frame: usize| self.observations.iter().filter(move |o| o.frame == frame);
        let mut found = Vec::new();
        let mut second = of(b).peekable();
        for first in of(a) {
            while second.next_if(|o| o.point < first.point).is_some() {}
            if let Some(o) = second.next_if(|o| o.point == first.point) {
                found.push((first.point, first.pixel, o.pixel, first.outlier || o.outlier));
            }
        }
        found
    }

    /// The true motion between two frames.
    pub fn b_from_a(&self, a: usize, b: usize) -> Transform {
        self.cam_from_head[b] * self.cam_from_head[a].inverse()
    }

    fn observe(&mut self, options: &SceneOptions, random: &mut Random) {
        for point in 0..self.points.len() + self.background.len() {
            for frame in 0..self.cam_from_head.len() {
                let head = point < self.points.len();
                let noise = random.normal2(options.noise_px);
                let outlier = random.uniform() < options.outliers && head;
                let wrong = if outlier { random.normal2(options.outlier_px) } else { Vec2::zeros() };
                let truth =
                    if head { self.head_pixel(point, frame, options.min_facing) } else { self.still_pixel(point) };
                if let Some(pixel) = truth {
                    self.observations.push(Observation { frame, point, pixel: pixel + noise + wrong, outlier });
                }
            }
        }
    }

    fn head_pixel(&self, point: usize, frame: usize, min_facing: f64) -> Option<Vec2> {
        let pose = &self.cam_from_head[frame];
        let in_cam = pose.apply(&self.points[point]);
        let facing = -(pose.rotation * self.normals[point]).dot(&in_cam.normalize());
        (facing > min_facing).then(|| self.camera.project(&in_cam)).flatten().filter(|p| inside(&self.camera, p))
    }

    fn still_pixel(&self, point: usize) -> Option<Vec2> {
        self.camera.project(&self.background[point - self.points.len()]).filter(|p| inside(&self.camera, p))
    }
}

fn inside(camera: &Camera, p: &Vec2) -> bool {
    p.x >= -0.5 && p.y >= -0.5 && p.x <= f64::from(camera.width) - 0.5 && p.y <= f64::from(camera.height) - 0.5
}

/// The distance of the surface from the skull's middle in a unit direction of the head frame, metres.
pub fn head_radius(direction: &Vec3) -> f64 {
    let d = direction;
    // An egg: narrow sideways, drawn out downwards, slightly skewed.
    let squash = Vec3::new(d.x / 0.076, d.y / if d.y < 0.0 { 0.118 } else { 0.108 }, d.z / 0.098);
    let egg = 1.0 / squash.norm() + 0.002 * d.x * d.y;
    BUMPS.iter().fold(egg, |radius, (at, width, height)| {
        let angle2 = (d - Vec3::from_row_slice(at).normalize()).norm_squared();
        radius + height * (-angle2 / (2.0 * width * width)).exp()
    })
}

/// The surface point in a unit direction seen from the skull's middle, head frame, metres.
pub fn head_surface(direction: &Vec3) -> Vec3 {
    SKULL + direction * head_radius(direction)
}

/// The outward unit normal of the surface at [`head_surface`] of the same direction.
pub fn head_normal(direction: &Vec3) -> Vec3 {
    let level = |p: &Vec3| p.norm() - head_radius(&p.normalize());
    let (p, h) = (direction * head_radius(direction), 1e-5);
    Vec3::from_fn(|k, _| {
        let step = Vec3::ith(k, h);
        level(&(p + step)) - level(&(p - step))
    })
    .normalize()
}

fn random_surface_point(random: &mut Random) -> (Vec3, Vec3) {
    loop {
        let d = Vec3::new(random.normal(), random.normal(), random.normal());
        let Some(d) = d.try_normalize(1e-6) else { continue };
        if d.z > -0.1 && d.y.abs() < 0.85 {
            return (head_surface(&d), head_normal(&d));
        }
    }
}

fn background_point(random: &mut Random, options: &SceneOptions) -> Vec3 {
    let camera = &options.camera;
    let z = options.distance * random.between(1.8, 4.0);
    let pixel = Vec2::new(random.uniform() * f64::from(camera.width), random.uniform() * f64::from(camera.height));
    (camera.normalise(&pixel) * z).push(z)
}

/// The head frame before the camera, upright, after a turn of `yaw`, a nod of `pitch` and a tilt of `roll` (radians) about
/// the top of the neck; the head's origin is `distance` metres before the camera when nothing is turned.
pub fn head_from_turn(yaw: f64, pitch: f64, roll: f64, sway: Vec3, distance: f64) -> Transform {
    let neck = Vec3::new(0.0, -0.09, -0.09);
    let turn = Rotation3::new(Vec3::y() * yaw) * Rotation3::new(Vec3::x() * pitch) * Rotation3::new(Vec3::z() * roll);
    let turned = Transform::new(turn, neck - turn * neck + sway);
    // The camera's x right, y down, z forward against the head's x left (of the subject), y up, z out of the face.
    let facing = Rotation3::new(Vec3::x() * std::f64::consts::PI);
    Transform::new(facing, Vec3::new(0.0, 0.0, distance)) * turned
}

fn pose_of_frame(i: usize, options: &SceneOptions) -> Transform {
    let s = i as f64 / (options.frames.max(2) - 1) as f64;
    let (from, to) = options.yaw_deg;
    let (w, phase) = (options.wobble, options.seed as f64);
    let wave = |rate: f64, offset: f64| (rate * s + offset + phase).sin() * w;
    let sway = Vec3::new(wave(3.1, 0.2), wave(4.3, 1.1), wave(2.3, 2.0)) * 0.005;
    let yaw = (from + (to - from) * s).to_radians();
    head_from_turn(yaw, 0.035 * wave(5.0, 0.7), 0.03 * wave(3.7, 1.9), sway, options.distance)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_noiseless_observation_is_the_projection_of_its_point() {
        let options = SceneOptions { noise_px: 0.0, background: 20, frames: 9, ..SceneOptions::default() };
        let scene = Scene::turning_head(&options);
        assert!(scene.observations.len() > 66 * 3);
        for o in scene.observations.iter().filter(|o| o.point < 66) {
            let expected = scene.camera.project(&scene.cam_from_head[o.frame].apply(&scene.points[o.point])).unwrap();
            assert!((expected - o.pixel).norm() < 1e-12);
        }
    }

    #[test]
    fn the_background_stands_still_and_the_head_does_not() {
        let options = SceneOptions { noise_px: 0.0, background: 5, frames: 20, ..SceneOptions::default() };
        let scene = Scene::turning_head(&options);
        for (point, a, b, _) in scene.matches(8, 11) {
            assert_eq!(point >= 66, a == b, "point {point}");
        }
    }

    #[test]
    fn normals_stand_on_the_surface() {
        for d in [Vec3::z(), Vec3::new(0.3, -0.2, 0.9).normalize(), Vec3::new(-0.7, 0.1, 0.4).normalize()] {
            let normal = head_normal(&d);
            let near = [Vec3::x(), Vec3::y(), Vec3::z()].map(|k| head_surface(&(d + k * 1e-4).normalize()));
            assert!(near.iter().all(|p| ((p - head_surface(&d)).dot(&normal)).abs() < 1e-6));
        }
    }

    #[test]
    fn a_head_at_rest_faces_the_camera_upright() {
        let pose = head_from_turn(0.0, 0.0, 0.0, Vec3::zeros(), 0.65);
        assert!((pose.apply(&Vec3::zeros()) - Vec3::new(0.0, 0.0, 0.65)).norm() < 1e-12);
        assert!((pose.rotation * Vec3::y() + Vec3::y()).norm() < 1e-12);
        assert!((pose.rotation * Vec3::z() + Vec3::z()).norm() < 1e-12);
    }

    #[test]
    fn the_share_of_outliers_is_the_one_asked_for() {
        let scene = Scene::turning_head(&SceneOptions { outliers: 0.4, ..SceneOptions::default() });
        let wrong = scene.observations.iter().filter(|o| o.outlier).count() as f64;
        assert!((wrong / scene.observations.len() as f64 - 0.4).abs() < 0.03);
    }
}
