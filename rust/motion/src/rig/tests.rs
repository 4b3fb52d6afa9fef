use super::*;
use crate::sequence::Sighting;
use nalgebra::{Rotation3, Vector6};
use synthetic::{Random, Scene, SceneOptions};

const NOISE_PX: f64 = 0.1;
const SIGMAS: [f64; 6] = [2e-4, 2e-4, 2e-4, 5e-5, 5e-5, 5e-5];

fn right_from_left() -> Transform {
    let rotation = Rotation3::from_axis_angle(&Vec3::y_axis(), 0.25);
    Transform::new(rotation, rotation * Vec3::new(-0.17, 0.004, 0.01))
}

struct Films {
    scene: Scene,
    tracks: Vec<PointTrack>,
    options: RigOptions,
}

/// Films of so many moments; the model is smaller than the head and wrong by millimetres, its poses by degrees; one track in ten is
/// lost in the second camera.
fn films(moments: usize, seed: u64) -> Films {
    let turn = if moments == 1 { (-4.0, -4.0) } else { (-20.0, 20.0) };
    let scene = Scene::turning_head(&SceneOptions {
        points: 300,
        frames: moments,
        yaw_deg: turn,
        seed,
        ..SceneOptions::default()
    });
    let mut random = Random::new(seed + 100);
    let mut normal3 = |sigma: f64| Vec3::new(random.normal(), random.normal(), random.normal()) * sigma;
    let model = scene.points.iter().map(|point| Some(point * 0.94 + normal3(0.002))).collect();
    let place = |camera: usize| if camera == 0 { Transform::identity() } else { right_from_left() };
    let rough = |frame: usize| {
        let pose = place(frame / moments) * scene.cam_from_head[frame % moments];
        let turn = normal3(0.02);
        let off = pose.retract(&Vector6::new(turn.x, turn.y, turn.z, 0.0, 0.0, 0.0));
        Some(Transform::new(off.rotation, off.translation * 0.94))
    };
    let initial_poses = (0..2 * moments).map(rough).collect();
    let mut random = Random::new(seed + 200);
    let mut see = |point: usize, frame: usize| {
        let pose = place(frame / moments) * scene.cam_from_head[frame % moments];
        let in_camera = pose.apply(&scene.points[point]);
        let facing = -(pose.rotation * scene.normals[point]).dot(&in_camera.normalize());
        let pixel = scene.camera.project(&in_camera).filter(|_| facing > 0.3)? + random.normal2(NOISE_PX);
        let off = if point.is_multiple_of(10) && frame >= moments { random.normal2(12.0) } else { Vec2::zeros() };
        Some(Sighting { frame, pixel: pixel + off, sigma_px: NOISE_PX })
    };
    let tracks = (0..scene.points.len())
        .map(|point| PointTrack { observations: (0..2 * moments).filter_map(|frame| see(point, frame)).collect() })
        .collect();
    let wrong = right_from_left().retract(&Vector6::from_fn(|k, _| SIGMAS[k] * [0.9, -1.1, 0.7, 1.2, -0.8, 0.3][k]));
    let covariance = Matrix6::from_diagonal(&Vector6::from_fn(|k, _| SIGMAS[k] * SIGMAS[k]));
    let options = RigOptions {
        places: vec![
            Place { camera_from_rig: Transform::identity(), covariance: Matrix6::zeros() },
            Place { camera_from_rig: wrong, covariance },
        ],
        moments,
        initial_poses,
        model,
        threshold_px: 1.5,
        min_parallax_rad: 0.035,
        key_moments: 16,
    };
    Films { scene, tracks, options }
}

impl Films {
    fn solve(&self) -> RigSequence {
        reconstruct_rig(&self.tracks, &self.scene.camera, &self.options, &Progress::new()).unwrap()
    }

    /// Of the points found, laid rigidly on the true ones: the median distance, their size over the true one, and how many there are.
    fn errors(&self, found: &RigSequence) -> (f64, f64, usize) {
        let pairs = found.sequence.points.iter().zip(&self.scene.points).enumerate();
        let pairs =
            pairs.filter(|(point, _)| point % 10 != 0).filter_map(|(_, (found, truth))| Some(((*found)?, *truth)));
        let (from, to): (Vec<Vec3>, Vec<Vec3>) = pairs.unzip();
        let (rigid, scaled) =
            [false, true].map(|scale| geometry::Similarity::fit(&from, &to, None, scale).unwrap()).into();
        let mut off: Vec<f64> = from.iter().zip(&to).map(|(a, b)| (rigid.apply(a) - b).norm()).collect();
        off.sort_by(f64::total_cmp);
        (off[off.len() / 2], 1.0 / scaled.scale, off.len())
    }
}

#[test]
fn films_give_shape_and_size() {
    for seed in [1, 2] {
        let films = films(40, seed);
        let found = films.solve();
        let (off, size, points) = films.errors(&found);
        println!("{:.3} mm, size {size:.5} ± {:.5}, {points} points", 1000.0 * off, found.size_sigma);
        assert!(off < 0.25e-3 && points > 150, "{off} m");
        assert!((size - 1.0).abs() < 0.003 && (size - 1.0).abs() < 2.5 * found.size_sigma, "{size}");
        assert!(found.sequence.poses.iter().all(Result::is_ok), "every moment is placed, those between too");
        // The head frame is the model's: what all moments are turned by is no error.
        let pairs = found.sequence.poses.iter().zip(&films.scene.cam_from_head);
        let turns: Vec<Transform> = pairs
            .map(|(pose, truth)| {
                Transform::new(pose.as_ref().unwrap().rotation.inverse() * truth.rotation, Vec3::zeros())
            })
            .collect();
        let sum = turns.iter().map(|turn| *turn.rotation.matrix()).sum();
        let mean = Transform::from_matrix(&sum, Vec3::zeros());
        let mut off: Vec<f64> = turns.iter().map(|turn| turn.angle_to(&mean).to_degrees()).collect();
        off.sort_by(f64::total_cmp);
        assert!(off[20] < 0.1 && off[39] < 0.2, "{}° in the median, {}° at most", off[20], off[39]);
    }
}

#[test]
fn one_moment_is_enough() {
    let films = films(1, 3);
    let found = films.solve();
    let (off, size, points) = films.errors(&found);
    println!("{:.3} mm, size {size:.5} ± {:.5}, {points} points", 1000.0 * off, found.size_sigma);
    assert!(off < 0.8e-3 && points > 80, "{off} m");
    assert!((size - 1.0).abs() < 0.004 && (size - 1.0).abs() < 2.5 * found.size_sigma, "{size}");
}

#[test]
fn wrong_tracks_are_told_apart() {
    let films = films(20, 4);
    let found = films.solve();
    let wrong = found.sequence.observations.iter().filter(|o| o.point % 10 == 0 && o.frame >= 20).count();
    assert!(wrong < found.sequence.observations.len() / 100, "{wrong} wrong observations agree");
}

#[test]
fn cameras_that_see_nothing_together_are_told_so() {
    let mut films = films(20, 5);
    for (k, track) in films.tracks.iter_mut().enumerate() {
        track.observations.retain(|o| (o.frame < 20) == (k % 2 == 0));
    }
    let error = reconstruct_rig(&films.tracks, &films.scene.camera, &films.options, &Progress::new()).unwrap_err();
    assert!(matches!(error, MotionError::FewShared { found: 0, .. }), "{error}");
    films.options.initial_poses.pop();
    let error = reconstruct_rig(&films.tracks, &films.scene.camera, &films.options, &Progress::new()).unwrap_err();
    assert!(matches!(error, MotionError::BadIndex { .. }), "{error}");
}

#[test]
fn one_step_leads_from_near_the_truth_to_it() {
    // Gauss–Newton: where the derivatives are right, what is left after a step is of the order of its square.
    let mut films = films(6, 6);
    films.options.places[1] = Place { camera_from_rig: right_from_left(), ..films.options.places[1] };
    let exact = |frame: usize| {
        let place = if frame < 6 { Transform::identity() } else { right_from_left() };
        place * films.scene.cam_from_head[frame % 6]
    };
    for (point, track) in films.tracks.iter_mut().enumerate() {
        let at = |frame: usize| films.scene.camera.project(&exact(frame).apply(&films.scene.points[point])).unwrap();
        track.observations.iter_mut().for_each(|o| o.pixel = at(o.frame));
    }
    let mut rig = Rig::new(&films.tracks, &films.scene.camera, &films.options);
    let off = |k: usize| Vector6::from_fn(|i, _| 1e-3 * f64::from((7 * k as u32 + 3 * i as u32) % 5) - 2e-3);
    rig.poses = films
        .scene
        .cam_from_head
        .iter()
        .enumerate()
        .map(|(k, p)| Some(p.retract(&(off(k) * f64::from(k.min(1) as u32)))))
        .collect();
    rig.points = films.scene.points.iter().map(|p| Some(p + Vec3::new(5e-4, -3e-4, 8e-4))).collect();
    let observations = rig.observations(1e3, true);
    let worst = |rig: &Rig| {
        let off = observations.iter().map(|o| {
            rig.sights[o.point].iter().filter(|s| s.frame == o.frame).map(|s| rig.distance_px(o.point, s)).sum::<f64>()
        });
        off.fold(0.0, f64::max)
    };
    let before = worst(&rig);
    rig.adjust(&observations, 12);
    assert!(before > 1.0 && worst(&rig) < 1e-4, "{before} px, then {} px", worst(&rig));
}
