//! Pictures of boards with known corners, by ray casting and area sampling.

use geometry::{Board, Camera, Pattern, Transform, Vec2, Vec3};
use image::{GrayImage, Luma};
use nalgebra::Rotation3;
use rayon::prelude::*;
use synthetic::Random;

/// Rays per pixel, on a lattice that has each row and each column once.
const RAYS: usize = 25;

/// A board before a camera.
#[derive(Clone)]
pub(super) struct Scene {
    pub(super) camera: Camera,
    pub(super) cam_from_board: Transform,
    pub(super) board: Board,
    /// Whether the mark is printed.
    pub(super) marked: bool,
    /// Standard deviation of the lens' blur, pixels.
    pub(super) blur: f64,
    /// Standard deviation of the noise, grey levels.
    pub(super) noise: f64,
    /// Light falls from 1 to 1 − this from the left to the right side of the picture.
    pub(super) falloff: f64,
    /// A grey disc of this radius, squares, hides corner (2, 2).
    pub(super) thumb: f64,
    /// White paper around the board, squares.
    pub(super) margin: f64,
}

impl Scene {
    /// A 9×6 board of 25.5 mm squares whose middle is `distance` metres away, turned by `angles` (radians about x, y, z).
    pub(super) fn new(camera: Camera, angles: [f64; 3], distance: f64) -> Self {
        Self::of(Board::checkerboard(9, 6, 0.0255), camera, angles, distance)
    }

    /// Another board.
    pub(super) fn of(board: Board, camera: Camera, angles: [f64; 3], distance: f64) -> Self {
        let rotation = Rotation3::new(Vec3::x() * angles[0])
            * Rotation3::new(Vec3::y() * angles[1])
            * Rotation3::new(Vec3::z() * angles[2]);
        let middle = board.centre().push(0.0);
        let cam_from_board = Transform::new(rotation, Vec3::new(0.0, 0.0, distance) - rotation * middle);
        Self {
            camera,
            cam_from_board,
            board,
            marked: false,
            blur: 0.5,
            noise: 1.5,
            falloff: 0.2,
            thumb: 0.0,
            margin: 0.6,
        }
    }

    pub(super) fn corners(&self) -> Vec<Vec2> {
        let seen = |p: &Vec2| self.camera.project(&self.cam_from_board.apply(&p.push(0.0))).unwrap();
        self.board.points().iter().map(seen).collect()
    }

    pub(super) fn render(&self, seed: u64) -> GrayImage {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let board_from_cam = self.cam_from_board.inverse();
        let mean = |k: usize| {
            let ray = |n: usize| {
                let offset = Vec2::new(n as f64 + 0.5, (7 * n % RAYS) as f64 + 0.5) / RAYS as f64;
                let pixel = Vec2::new((k % width) as f64 - 0.5, (k / width) as f64 - 0.5) + offset;
                self.radiance(&board_from_cam, pixel)
            };
            (0..RAYS).map(ray).sum::<f64>() / RAYS as f64
        };
        let sharp: Vec<f64> = (0..width * height).into_par_iter().map(mean).collect();
        let light = blurred(&sharp, width, self.blur);
        let mut random = Random::new(seed);
        GrayImage::from_fn(self.camera.width, self.camera.height, |x, y| {
            let grey = 255.0 * light[y as usize * width + x as usize].powf(1.0 / 2.2) + self.noise * random.normal();
            Luma([grey.round().clamp(0.0, 255.0) as u8])
        })
    }

    /// Linear light that a ray sees: the board with a white margin, and stripes behind it.
    fn radiance(&self, board_from_cam: &Transform, pixel: Vec2) -> f64 {
        let (origin, ray) = (board_from_cam.translation, board_from_cam.rotation * self.camera.ray(&pixel));
        let hit = (origin - ray * (origin.z / ray.z)).xy() / self.board.square;
        let black = self.is_black(&hit);
        let (size, middle) = (self.board.extent() / self.board.square, self.board.centre() / self.board.square);
        let from_middle = (hit - middle).abs() - size / 2.0;
        let inside = |m: f64| from_middle.max() < m;
        let thumb = (hit - Vec2::new(2.0, 2.0)).norm() < self.thumb;
        let reflectance = match (inside(0.0), inside(self.margin)) {
            _ if thumb => 0.3,
            (true, _) if black => 0.03,
            (_, true) => 0.55,
            _ => 0.15 + 0.1 * (pixel.x * 0.9 + pixel.y * 0.4).sin().signum(),
        };
        reflectance * (1.0 - self.falloff * pixel.x / f64::from(self.camera.width))
    }
}

impl Scene {
    /// Whether the pattern, which goes on for ever, is black at a point of the board's plane, squares.
    fn is_black(&self, hit: &Vec2) -> bool {
        let mark = self.marked && (hit - Vec2::new(0.5, 0.5)).norm() < Board::MARK_RADIUS;
        let black = match self.board.pattern {
            Pattern::Checkerboard => (hit.x.floor() + hit.y.floor()).rem_euclid(2.0) == 0.0,
            Pattern::Squares { gap } => hit.x.rem_euclid(1.0 + gap) < 1.0 && hit.y.rem_euclid(1.0 + gap) < 1.0,
        };
        black && !mark
    }
}

/// A separable Gaussian of standard deviation `sigma`.
fn blurred(pixels: &[f64], width: usize, sigma: f64) -> Vec<f64> {
    let reach = (4.0 * sigma).ceil() as i64;
    let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let height = pixels.len() / width;
    let pass = |from: &[f64], across: bool| -> Vec<f64> {
        let value = |k: usize| {
            let (x, y) = ((k % width) as i64, (k / width) as i64);
            let at = |d: i64| {
                let (u, v) = if across { (x + d, y) } else { (x, y + d) };
                from[v.clamp(0, height as i64 - 1) as usize * width + u.clamp(0, width as i64 - 1) as usize]
            };
            weights.iter().zip(-reach..).map(|(w, d)| w * at(d)).sum::<f64>() / total
        };
        (0..from.len()).into_par_iter().map(value).collect()
    };
    pass(&pass(pixels, true), false)
}
