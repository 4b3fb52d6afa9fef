//! Two frames of a turning head, with noise and wrong matches of two kinds.

use super::{Case, Matches};
use geometry::{Camera, Transform, Vec3};
use nalgebra::Rotation3;
use synthetic::{Random, Scene, SceneOptions};

/// Scenes of each case.
const TRIALS: u64 = 100;
/// Focal length, pixels, of a picture of 352 x 288.
const FOCAL_PX: f64 = 700.0;
/// Distance of a right match from its epipolar line at most, for every side.
const THRESHOLD_PX: f64 = 1.0;
/// Deviation of the turns that one of our ways is told, about each axis.
const ROUGH_TURN_SIGMA_DEG: f64 = 2.0;
/// A crossed match takes the place of one of so many nearest points.
const NEIGHBOURS: usize = 6;

/// What wrong matches look like.
#[derive(Clone, Copy, PartialEq)]
enum Mistake {
    /// Off by 15 pixels (standard deviation), wherever that is.
    Anywhere,
    /// On a neighbouring point: repeated texture.
    Crossed,
}

/// One kind of pair.
#[derive(Clone, Copy)]
pub struct Kind {
    turn_deg: f64,
    points: usize,
    wrong: f64,
    mistake: Mistake,
}

const fn kind(turn_deg: f64, points: usize, wrong: f64, mistake: Mistake) -> Kind {
    Kind { turn_deg, points, wrong, mistake }
}

/// Every case.
pub const KINDS: [Kind; 10] = [
    kind(10.0, 66, 0.0, Mistake::Anywhere),
    kind(10.0, 66, 0.2, Mistake::Anywhere),
    kind(10.0, 66, 0.4, Mistake::Anywhere),
    kind(10.0, 500, 0.3, Mistake::Anywhere),
    kind(20.0, 66, 0.0, Mistake::Anywhere),
    kind(20.0, 66, 0.2, Mistake::Anywhere),
    kind(20.0, 66, 0.4, Mistake::Anywhere),
    kind(20.0, 500, 0.3, Mistake::Anywhere),
    kind(10.0, 66, 0.2, Mistake::Crossed),
    kind(20.0, 66, 0.2, Mistake::Crossed),
];

impl Kind {
    fn name(&self) -> String {
        let mistake = if self.mistake == Mistake::Crossed { "crossed" } else { "wrong" };
        format!("{} degrees, {} points, {:.0} % {mistake}", self.turn_deg, self.points, 100.0 * self.wrong)
    }

    /// The matches of every trial and the true motions.
    pub fn case(&self) -> (Case, Vec<Transform>) {
        let scenes: Vec<Scene> = (0..TRIALS).map(|seed| self.scene(seed)).collect();
        let trials = scenes.iter().zip(0..).map(|(scene, seed)| self.matches(scene, seed)).collect();
        let truth = scenes.iter().map(|scene| scene.b_from_a(0, 1)).collect();
        let rough_turn_sigma_rad = ROUGH_TURN_SIGMA_DEG.to_radians();
        let (name, camera, threshold_px) = (self.name(), camera(), THRESHOLD_PX);
        (Case { name, camera, threshold_px, rough_turn_sigma_rad, trials }, truth)
    }

    fn scene(&self, seed: u64) -> Scene {
        Scene::turning_head(&SceneOptions {
            camera: camera(),
            yaw_deg: (-0.5 * self.turn_deg, 0.5 * self.turn_deg),
            frames: 2,
            // Those that both frames see are taken from a larger number.
            points: self.points * 4,
            min_facing: 0.3,
            // A match is wrong when either of its ends is.
            outliers: if self.mistake == Mistake::Anywhere { 1.0 - (1.0 - self.wrong).sqrt() } else { 0.0 },
            seed,
            ..SceneOptions::default()
        })
    }

    fn matches(&self, scene: &Scene, seed: u64) -> Matches {
        let found = scene.matches(0, 1).into_iter().take(self.points);
        let (a, mut b): (Vec<_>, Vec<_>) = found.map(|(_, a, b, _)| ([a.x, a.y], [b.x, b.y])).unzip();
        if self.mistake == Mistake::Crossed {
            let (mut random, places) = (Random::new(seed + 1000), b.clone());
            for (place, at) in b.iter_mut().enumerate() {
                if random.uniform() < self.wrong {
                    *at = neighbour(&places, place, &mut random);
                }
            }
        }
        Matches { a, b, rough_turn: rough_turn(&scene.b_from_a(0, 1), seed) }
    }
}

fn camera() -> Camera {
    Camera::centred(352, 288, FOCAL_PX)
}

/// The rotation of a motion with an error of its own.
fn rough_turn(b_from_a: &Transform, seed: u64) -> Transform {
    let mut random = Random::new(seed + 2000);
    let (one, other) = (random.normal2(ROUGH_TURN_SIGMA_DEG), random.normal2(ROUGH_TURN_SIGMA_DEG));
    let error = Rotation3::new(Vec3::new(one.x, one.y, other.x).map(f64::to_radians));
    Transform::new(error * b_from_a.rotation, Vec3::zeros())
}

/// The place of one of the points nearest to a point.
fn neighbour(places: &[[f64; 2]], of: usize, random: &mut Random) -> [f64; 2] {
    let squared = |i: &usize| {
        let [x, y] = [0, 1].map(|k| places[*i][k] - places[of][k]);
        x * x + y * y
    };
    let mut others: Vec<usize> = (0..places.len()).filter(|i| *i != of).collect();
    others.sort_by(|i, j| squared(i).total_cmp(&squared(j)));
    places[others[(random.uniform() * NEIGHBOURS as f64) as usize % NEIGHBOURS]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_case_has_the_points_and_the_turn_it_names() {
        for kind in KINDS {
            let (case, truth) = kind.case();
            let points = kind.points;
            assert!(case.trials.iter().all(|m| m.a.len() == points && m.b.len() == points), "{}", case.name);
            let turned = |t: &Transform| t.angle_to(&Transform::identity()).to_degrees();
            assert!(truth.iter().all(|t| (turned(t) - kind.turn_deg).abs() < 3.0 && t.translation.norm() > 0.0));
        }
    }

    #[test]
    fn crossed_matches_end_on_other_points() {
        let (right, crossed) = (kind(10.0, 66, 0.0, Mistake::Anywhere), kind(10.0, 66, 0.2, Mistake::Crossed));
        let [(right, _), (crossed, _)] = [right, crossed].map(|kind| kind.case());
        let mut moved = 0;
        for (right, crossed) in right.trials.iter().zip(&crossed.trials) {
            moved += right.b.iter().zip(&crossed.b).filter(|(r, c)| r != c).count();
            assert!(crossed.b.iter().all(|at| right.b.contains(at)));
        }
        let share = moved as f64 / (66 * right.trials.len()) as f64;
        assert!((share - 0.2).abs() < 0.02, "{share}");
    }
}
