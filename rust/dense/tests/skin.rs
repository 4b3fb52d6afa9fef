//! The surface measured in pictures that are cast ray by ray.

use dense::{Dense, DenseOptions, Surface, Untouched, View, measure};
use geometry::{Camera, Transform, Vec3, median};
use image::GrayImage;
use nalgebra::Vector6;
use synthetic::{Random, Skin, SkinOptions};

const SIDE: u32 = 15;
const STEP: f64 = 0.004;

struct Film {
    skin: Skin,
    camera: Camera,
    poses: Vec<Transform>,
    pictures: Vec<GrayImage>,
}

impl Film {
    /// A head that turns to both sides by an angle, degrees.
    fn of(options: &SkinOptions, frames: u32, turn: f64) -> Self {
        let skin = Skin::new(options);
        let camera = Camera { k1: -0.15, k2: 0.05, ..Camera::centred(170, 170, 800.0) };
        let part = |k: u32| 2.0 * f64::from(k) / f64::from(frames - 1) - 1.0;
        let pose =
            |k: u32| Skin::pose((turn * part(k)).to_radians(), (0.3 * turn * (3.0 * part(k)).sin()).to_radians(), 0.6);
        let poses: Vec<Transform> = (0..frames).map(pose).collect();
        let pictures = poses.iter().zip(0..).map(|(pose, k)| skin.picture(&camera, pose, k)).collect();
        Self { skin, camera, poses, pictures }
    }

    /// The ball without relief, measured; how far its vertices are from the skin before and after, median mm, of those that may be measured.
    fn measured(&self) -> (Result<Dense, Untouched>, f64, f64) {
        let (positions, quads) = Skin::ball(SIDE, STEP);
        let share = share();
        let views: Vec<View> =
            self.poses.iter().zip(&self.pictures).map(|(pose, image)| self.view(pose, image)).collect();
        let surface = Surface { positions: &positions, quads: &quads, share: &share };
        let found = measure(&surface, &views, &DenseOptions::default());
        let after = found.as_ref().map_or(f64::NAN, |found| self.error(&found.positions));
        (found, self.error(&positions), after)
    }

    fn view<'a>(&self, pose: &Transform, image: &'a GrayImage) -> View<'a> {
        View { image, camera: self.camera, cam_from_head: *pose, mask: None, moved: &[] }
    }

    fn error(&self, positions: &[Vec3]) -> f64 {
        let off = |p: &Vec3| 1000.0 * (p.norm() - self.skin.radius(&p.normalize())).abs();
        let measured = positions.iter().zip(share()).filter(|(_, share)| *share > 0.5);
        median(measured.map(|(p, _)| off(p))).unwrap_or(f64::NAN)
    }
}

/// All but the rim.
fn share() -> Vec<f64> {
    let inside = |k: u32| (2..SIDE - 2).contains(&k);
    (0..SIDE * SIDE).map(|i| if inside(i % SIDE) && inside(i / SIDE) { 1.0 } else { 0.0 }).collect()
}

#[test]
fn a_relief_of_half_a_millimetre_is_found_to_a_twentieth_of_one() {
    let film = Film::of(&SkinOptions::default(), 11, 25.0);
    let (found, before, after) = film.measured();
    let found = found.unwrap();
    assert!(before > 0.25 && after < 0.05, "{before} {after}");
    assert!(found.measured * 10 > found.places * 9, "{} of {}", found.measured, found.places);
    // What it says of itself is about right.
    let sigma = 1000.0 * median(found.sigma.iter().copied().filter(|s| s.is_finite())).unwrap();
    assert!((0.4 * after..6.0 * after).contains(&sigma), "{sigma} {after}");
}

#[test]
fn noise_blur_compression_and_uncertain_poses_leave_a_fifth() {
    let options = SkinOptions { noise: 3.0, blur: 1.0, ..SkinOptions::default() };
    let mut film = Film::of(&options, 13, 30.0);
    let mut random = Random::new(5);
    for picture in &mut film.pictures {
        let mut bytes = Vec::new();
        let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, 60);
        picture.write_with_encoder(encoder).unwrap();
        *picture = image::load_from_memory(&bytes).unwrap().to_luma8();
    }
    for pose in &mut film.poses {
        *pose = pose.retract(&Vector6::from_fn(|k, _| random.normal() * if k < 3 { 0.0008 } else { 0.0001 }));
    }
    let (_, before, after) = film.measured();
    assert!(before > 0.25 && after < 0.2, "{before} {after}");
}

#[test]
fn bare_skin_is_left_as_it_is() {
    let (found, ..) =
        Film::of(&SkinOptions { contrast: 0.0, noise: 2.0, ..SkinOptions::default() }, 9, 25.0).measured();
    assert!(matches!(found, Err(Untouched::TooFewPlaces { .. })), "{found:?}");
}

#[test]
fn three_frames_or_a_head_that_hardly_turns_are_too_little() {
    let few = Film::of(&SkinOptions::default(), 3, 25.0).measured().0;
    assert!(matches!(few, Err(Untouched::TooFewViews { views: 3, .. })), "{few:?}");
    let still = Film::of(&SkinOptions::default(), 9, 0.5).measured().0;
    assert!(matches!(still, Err(Untouched::TooFewPlaces { .. })), "{:?}", still.map(|s| s.measured));
}

#[test]
fn what_a_mask_hides_is_not_measured() {
    let film = Film::of(&SkinOptions::default(), 9, 25.0);
    let (positions, quads) = Skin::ball(SIDE, STEP);
    let mask = GrayImage::from_fn(170, 170, |x, _| image::Luma([if x < 85 { 0 } else { 255 }]));
    let views: Vec<View> = film
        .poses
        .iter()
        .zip(&film.pictures)
        .map(|(pose, image)| View { mask: Some(&mask), ..film.view(pose, image) })
        .collect();
    let share = share();
    let surface = Surface { positions: &positions, quads: &quads, share: &share };
    let found = measure(&surface, &views, &DenseOptions::default()).unwrap();
    let left = (0..SIDE).map(|row| (row * SIDE + 2) as usize);
    assert!(left.clone().all(|v| found.sigma[v].is_nan() && found.views[v] == 0));
    assert!(left.clone().all(|v| (found.positions[v] - positions[v]).norm() < 3e-4));
}

#[test]
fn the_same_pictures_give_the_same_bytes_on_one_thread_and_on_four() {
    let film = Film::of(&SkinOptions::default(), 7, 25.0);
    let [one, four] = [1, 4].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| film.measured().0.unwrap())
    });
    assert_eq!(one.positions, four.positions);
    assert_eq!(one.detail, four.detail);
}
