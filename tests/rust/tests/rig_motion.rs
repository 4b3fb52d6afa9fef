//! The size of a head from two cameras whose places are known: the true head's own points, seen by both.

mod two_cameras;

use end_to_end::truth::Truth;
use facewright::{
    CameraSource, FrameTracks, Method, PointObservation, PointTrack, Region, RigTracks, Schema, SourcedCamera, Tracks,
    solve_motion_on_rig,
};
use geometry::{Camera, Progress, Transform, Vec3, mesh::vertex_normals};
use nalgebra::{Rotation3, Vector6};
use synthetic::Random;
use two_cameras::rig;

const POINTS: usize = 150;
const NOISE_PX: f64 = 0.15;

/// The second camera, 120 mm to the right of the first and turned towards the head.
fn right_from_left() -> Transform {
    let rotation = Rotation3::from_axis_angle(&Vec3::y_axis(), 0.15);
    Transform::new(rotation, rotation * Vec3::new(-0.12, 0.004, 0.002))
}

fn lens() -> Camera {
    Camera { k1: -0.12, k2: 0.03, ..Camera::centred(640, 480, 900.0) }
}

/// The tracks of a camera's film, whose landmarks take the head for `size` times as large as it is.
fn film(truth: &Truth, camera_from_left: Transform, size: f64, seed: u64) -> Tracks {
    let mut random = Random::new(seed);
    let normals = vertex_normals(&truth.vertices, &truth.triangles);
    let is_face = |i: &usize| normals[*i].z > 0.3 && truth.vertices[*i].z > 0.0 && truth.vertices[*i].y.abs() < 0.09;
    let face: Vec<usize> = (0..truth.vertices.len()).filter(is_face).collect();
    let poses: Vec<Transform> = truth.poses.iter().map(|pose| camera_from_left * *pose).collect();
    let track = |id: usize| {
        let vertex = face[id * face.len() / POINTS];
        let (point, normal) = (truth.vertices[vertex], normals[vertex]);
        let sight = |(frame, pose): (usize, &Transform)| {
            let in_camera = pose.apply(&point);
            let facing = -(pose.rotation * normal).dot(&in_camera.normalize());
            let seen = lens().project(&in_camera).filter(|_| facing > 0.3)? + random.normal2(NOISE_PX);
            Some(PointObservation { frame, pixel: seen, sigma_px: NOISE_PX })
        };
        let observations: Vec<_> = poses.iter().enumerate().filter_map(sight).collect();
        let off = Vec3::new(random.normal(), random.normal(), random.normal()) * 0.003;
        let place = Some((point * size + off).into());
        let reference = observations.first().map_or(0, |o| o.frame);
        PointTrack { id, reference, region: Region::Skin, place, observations, gaps: Vec::new() }
    };
    let tracks: Vec<PointTrack> = (0..POINTS).map(track).collect();
    let mut frame = |(k, pose): (usize, &Transform)| {
        let rough = pose.retract(&Vector6::from_fn(|i, _| if i < 3 { 0.02 * random.normal() } else { 0.0 }));
        let seen = Some(Transform::new(rough.rotation, rough.translation * size));
        FrameTracks {
            name: format!("f{k:02}"),
            used: true,
            reason: String::new(),
            reason_kind: None,
            cam_from_head: seen,
            points: POINTS,
        }
    };
    Tracks {
        schema: Schema,
        version: String::new(),
        method: Method::Default,
        camera: SourcedCamera { camera: lens(), source: CameraSource::Board },
        interocular: Some(0.063),
        window: 11,
        frames: poses.iter().enumerate().map(&mut frame).collect(),
        tracks: tracks.into_iter().filter(|t| t.observations.len() > 3).collect(),
        disabled: Vec::new(),
        warnings: Vec::new(),
    }
}

fn films(truth: &Truth, sizes: [f64; 2]) -> [RigTracks; 2] {
    let left = film(truth, Transform::identity(), sizes[0], 1);
    let right = film(truth, right_from_left(), sizes[1], 2);
    [("left", left), ("right", right)].map(|(camera, tracks)| RigTracks { camera: camera.to_owned(), tracks })
}

/// Spread of the solved points over that of the true ones.
fn size(motion: &facewright::HeadMotion, truth: &Truth) -> f64 {
    let points: Vec<Vec3> = motion.points.iter().map(facewright::PointMotion::position).collect();
    let spread = |all: &[Vec3]| {
        let mean = all.iter().sum::<Vec3>() / all.len() as f64;
        (all.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / all.len() as f64).sqrt()
    };
    let normals = vertex_normals(&truth.vertices, &truth.triangles);
    let is_face = |i: &usize| normals[*i].z > 0.3 && truth.vertices[*i].z > 0.0 && truth.vertices[*i].y.abs() < 0.09;
    let face: Vec<usize> = (0..truth.vertices.len()).filter(is_face).collect();
    let theirs: Vec<Vec3> = motion.points.iter().map(|p| truth.vertices[face[p.id * face.len() / POINTS]]).collect();
    spread(&points) / spread(&theirs)
}

#[test]
fn the_places_of_two_cameras_give_the_size_whatever_the_landmarks_take_it_for() {
    let truth = Truth::read();
    for sizes in [[1.0, 1.0], [1.07, 0.95], [0.9, 1.1]] {
        let motion =
            solve_motion_on_rig(&films(&truth, sizes), &rig([lens(); 2], right_from_left()), &Progress::new()).unwrap();
        let (found, sigma) = (size(&motion, &truth), motion.scale.relative_sigma);
        println!("size {found:.5}, said to be good to {sigma:.5}: {}", motion.scale.source);
        assert!(sigma < 0.004 && (found - 1.0).abs() < 2.5 * sigma, "{found} ± {sigma}");
        assert!(motion.scale.source.contains("left, right"));
    }
}

#[test]
fn films_that_do_not_belong_together_are_refused_in_words() {
    let truth = Truth::read();
    let refused = |films: &[RigTracks]| {
        solve_motion_on_rig(films, &rig([lens(); 2], right_from_left()), &Progress::new()).unwrap_err().to_string()
    };
    let together = films(&truth, [1.0, 1.0]);
    let mut backwards = together.clone();
    backwards[1].tracks.tracks.iter_mut().for_each(|track| {
        track.observations.reverse();
        track.observations.iter_mut().for_each(|o| o.frame = truth.poses.len() - 1 - o.frame);
    });
    backwards[1].tracks.frames.reverse();
    assert!(refused(&backwards).contains("do not show the same moments"), "{}", refused(&backwards));
    let mut shorter = together.clone();
    shorter[1].tracks.frames.pop();
    shorter[1]
        .tracks
        .tracks
        .iter_mut()
        .for_each(|track| track.observations.retain(|o| o.frame + 1 < truth.poses.len()));
    assert!(refused(&shorter).contains("21 of left, 20 of right"), "{}", refused(&shorter));
    let mut stranger = together.clone();
    stranger[1].camera = "middle".to_owned();
    assert!(refused(&stranger).contains("no camera middle: its cameras are left, right"), "{}", refused(&stranger));
    assert!(refused(&together[..1]).contains("two or more"));
}
