//! Films of a turning head as observations: noise, wrong ones among them, and what landmarks would tell of the poses.

use super::{Case, Film, Truth};
use geometry::{Camera, Transform};
use nalgebra::Vector6;
use synthetic::{Random, Scene, SceneOptions};

/// Noise of each coordinate of an observation.
const SIGMA_PX: f64 = 0.3;
/// Share of the observations that are off by 15 pixels (standard deviation).
const WRONG: f64 = 0.03;
/// Deviation of the rough poses, about and along each axis of the camera.
const ROUGH_SIGMA_DEG: f64 = 3.0;
const ROUGH_SIGMA_M: f64 = 0.01;
/// Where the focal length is not known it is said to be so much of the true one.
const FOCAL_GUESS: f64 = 1.1;

/// Films of one kind.
#[derive(Clone, Copy)]
pub struct Kind {
    films: u64,
    frames: usize,
    points: usize,
    focal_is_known: bool,
}

/// Every case: short films, several because the noise of one tells little, and a long one, which takes the peer half a minute.
pub const KINDS: [Kind; 4] =
    [SHORT, Kind { focal_is_known: false, ..SHORT }, LONG, Kind { focal_is_known: false, ..LONG }];
const SHORT: Kind = Kind { films: 5, frames: 24, points: 120, focal_is_known: true };
const LONG: Kind = Kind { films: 1, frames: 120, points: 500, focal_is_known: true };

impl Kind {
    fn name(&self) -> String {
        let focal = if self.focal_is_known { "" } else { ", focal length 10 % off" };
        format!("{} frames, {} points{focal}", self.frames, self.points)
    }

    /// What both sides read, and the truth of each film.
    pub fn case(&self) -> (Case, Vec<Truth>) {
        let scenes: Vec<Scene> = (0..self.films).map(|seed| self.scene(seed)).collect();
        let case = Case {
            name: self.name(),
            camera: self.camera(),
            refine_focal: !self.focal_is_known,
            sigma_px: SIGMA_PX,
            frames: self.frames,
            points: self.points,
            films: scenes.iter().zip(0..).map(|(scene, seed)| self.film(scene, seed)).collect(),
        };
        (case, scenes.into_iter().map(truth).collect())
    }

    fn scene(&self, seed: u64) -> Scene {
        Scene::turning_head(&SceneOptions {
            frames: self.frames,
            points: self.points,
            noise_px: SIGMA_PX,
            outliers: WRONG,
            seed,
            ..SceneOptions::default()
        })
    }

    fn guess(&self) -> f64 {
        if self.focal_is_known { 1.0 } else { FOCAL_GUESS }
    }

    fn camera(&self) -> Camera {
        let camera = SceneOptions::default().camera;
        Camera { fx: self.guess() * camera.fx, fy: self.guess() * camera.fy, ..camera }
    }

    fn film(&self, scene: &Scene, seed: u64) -> Film {
        Film {
            observations: scene.observations.iter().map(|o| (o.frame, o.point, [o.pixel.x, o.pixel.y])).collect(),
            rough_poses: rough_poses(&scene.cam_from_head, self.guess(), seed),
        }
    }
}

fn truth(scene: Scene) -> Truth {
    Truth {
        focal_px: scene.camera.fx,
        poses: scene.cam_from_head,
        points: scene.points.into_iter().map(Into::into).collect(),
        wrong: scene.observations.iter().map(|o| o.outlier).collect(),
    }
}

/// The poses with an error of their own each. To a camera of a longer focal length a face appears as much farther away.
fn rough_poses(cam_from_head: &[Transform], guess: f64, seed: u64) -> Vec<Transform> {
    let mut random = Random::new(seed + 1000);
    let rough = |pose: &Transform| {
        let turn = ROUGH_SIGMA_DEG.to_radians();
        let sigmas = [turn, turn, turn, ROUGH_SIGMA_M, ROUGH_SIGMA_M, ROUGH_SIGMA_M];
        let mut seen = *pose;
        seen.translation.z *= guess;
        seen.retract(&Vector6::from(sigmas.map(|sigma| sigma * random.normal())))
    };
    cam_from_head.iter().map(rough).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_that_faces_away_is_not_seen_and_some_observations_are_wrong() {
        for kind in KINDS {
            let (case, truths) = kind.case();
            for (film, truth) in case.films.iter().zip(truths) {
                let share = film.observations.len() as f64 / (kind.frames * kind.points) as f64;
                assert!((0.3..0.9).contains(&share), "{}: {share}", case.name);
                let wrong = truth.wrong.iter().filter(|wrong| **wrong).count() as f64 / truth.wrong.len() as f64;
                assert!((wrong - WRONG).abs() < 0.01, "{}: {wrong}", case.name);
            }
        }
    }

    #[test]
    fn rough_poses_are_as_rough_as_they_say() {
        let (case, truths) = LONG.case();
        let pairs = || case.films[0].rough_poses.iter().zip(&truths[0].poses);
        let axes = 3.0 * LONG.frames as f64;
        let turn: f64 = pairs().map(|(rough, pose)| rough.angle_to(pose).powi(2)).sum();
        let shift: f64 = pairs().map(|(rough, pose)| (rough.translation - pose.translation).norm_squared()).sum();
        assert!(((turn / axes).sqrt().to_degrees() / ROUGH_SIGMA_DEG - 1.0).abs() < 0.2);
        assert!(((shift / axes).sqrt() / ROUGH_SIGMA_M - 1.0).abs() < 0.2);
    }
}
