//! The film of `blend_fixtures/synthetic_person.blend`, measured against its truth.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{assets, clip};
use facewright::{
    Assets, CalibrateOptions, FrameReport, FrameSet, Given, Method, ReconstructOptions, Reconstruction, Report,
    SourcedCamera, calibrate, reconstruct,
};
use geometry::{Progress, Similarity, Transform, Vec3, mesh};
use head::surface::SkinSurface;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::LazyLock;
use synthetic::Random;

/// Vertices this near the tip of the nose are face, metres.
const FACE_RADIUS: f64 = 0.095;

/// The film's truth.
struct Truth {
    fx: f64,
    poses: BTreeMap<String, Transform>,
    nose_tip: Vec3,
    skin: Vec<Vec3>,
}

/// Everything the tests look at: made once.
struct Film {
    assets: Assets,
    truth: Truth,
    camera: SourcedCamera,
    on_one_thread: Reconstruction,
    on_two_threads: Reconstruction,
}

static FILM: LazyLock<Film> = LazyLock::new(|| {
    let assets = Assets::load(&assets().unwrap()).unwrap();
    let camera = camera_from_boards();
    let [on_one_thread, on_two_threads] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&assets, camera))
    });
    Film { assets, truth: read_truth(), camera, on_one_thread, on_two_threads }
});

fn run(assets: &Assets, camera: SourcedCamera) -> Reconstruction {
    run_on(&clip().join("frames"), assets, camera)
}

fn run_on(folder: &Path, assets: &Assets, camera: SourcedCamera) -> Reconstruction {
    run_by(Method::Default, folder, assets, camera)
}

fn run_by(method: Method, folder: &Path, assets: &Assets, camera: SourcedCamera) -> Reconstruction {
    let progress = Progress::new();
    let frames = FrameSet::open(&[folder.to_owned()], &progress).unwrap();
    let given = Given { camera: Some(camera), ..Given::default() };
    let options = ReconstructOptions { method, texture_size: 512, ..ReconstructOptions::default() };
    reconstruct(&frames, assets, &given, &options, &progress).unwrap()
}

fn camera_from_boards() -> SourcedCamera {
    let boards = FrameSet::open(&[clip().join("board")], &Progress::new()).unwrap();
    calibrate(&boards, &CalibrateOptions::default(), &Progress::new()).unwrap().camera
}

fn read_truth() -> Truth {
    let text = std::fs::read_to_string(clip().join("truth.json")).unwrap();
    let value: Value = serde_json::from_str(&text).unwrap();
    let pose = |frame: &Value| {
        let name = frame["name"].as_str().unwrap().to_owned();
        (name, serde_json::from_value(frame["cam_from_head"].clone()).unwrap())
    };
    let tip: [f64; 3] = serde_json::from_value(value["nose_tip"].clone()).unwrap();
    Truth {
        fx: value["camera"]["fx"].as_f64().unwrap(),
        poses: value["frames"].as_array().unwrap().iter().map(pose).collect(),
        nose_tip: tip.into(),
        skin: read_ply_vertices(&std::fs::read(clip().join("head.ply")).unwrap()),
    }
}

/// Vertices of a binary PLY whose vertices are three float32 and come first.
fn read_ply_vertices(bytes: &[u8]) -> Vec<Vec3> {
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..body]).unwrap();
    let count: usize = header.lines().find_map(|l| l.strip_prefix("element vertex ")).unwrap().parse().unwrap();
    let number = |b: &[u8]| f64::from(f32::from_le_bytes(b.try_into().unwrap()));
    let vertex = |b: &[u8]| Vec3::new(number(&b[0..4]), number(&b[4..8]), number(&b[8..12]));
    bytes[body..].chunks_exact(12).take(count).map(vertex).collect()
}

/// Poses of the result and the truth, frame by frame.
fn poses(film: &Film) -> Vec<(Transform, Transform)> {
    let frames = film.on_one_thread.report.frames.iter();
    frames.filter_map(|f| Some((f.cam_from_head?, film.truth.poses[&f.name]))).collect()
}

/// The similarity from the result's head frame to the truth's that the camera poses give; no surface is looked at.
fn truth_from_result(poses: &[(Transform, Transform)]) -> Similarity {
    let n = poses.len() as f64;
    let turn = poses.iter().map(|(p, t)| (t.rotation.inverse() * p.rotation).into_inner());
    let rotation =
        Transform::from_matrix(&turn.fold(geometry::Mat3::zeros(), |sum, r| sum + r), Vec3::zeros()).rotation;
    // A point x is seen alike when s (P x + p) = T (s Q x + q) + t, so that s T'p - q = T't in every frame.
    let pairs: Vec<(Vec3, Vec3)> = poses
        .iter()
        .map(|(p, t)| (t.rotation.inverse() * p.translation, t.rotation.inverse() * t.translation))
        .collect();
    let mean = pairs.iter().fold((Vec3::zeros(), Vec3::zeros()), |sum, (a, b)| (sum.0 + a / n, sum.1 + b / n));
    let cross: f64 = pairs.iter().map(|(a, b)| (a - mean.0).dot(&(b - mean.1))).sum();
    let spread: f64 = pairs.iter().map(|(a, _)| (a - mean.0).norm_squared()).sum();
    let scale = cross / spread;
    Similarity { scale, rigid: Transform::new(rotation, mean.0 * scale - mean.1) }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Distances of the truth's face vertices from the result's surface, metres.
fn surface_distances(film: &Film) -> Vec<f64> {
    let head = &film.assets.head;
    let to_truth = truth_from_result(&poses(film));
    let placed: Vec<Vec3> = film.on_one_thread.positions.iter().map(|p| to_truth.apply(p)).collect();
    let surface = SkinSurface::new(head, &placed);
    let skin = &film.truth.skin;
    let normals = mesh::vertex_normals(skin, &head.triangles(head.skin()));
    let is_face =
        |i: &usize| (skin[*i] - film.truth.nose_tip).norm() < FACE_RADIUS && normals[*i].z > 0.0 && !head.cavity[*i];
    let distance = |i: usize| surface.closest(&skin[i], 0.02).map_or(0.02, |foot| (foot.position - skin[i]).norm());
    (0..skin.len()).filter(is_face).map(distance).collect()
}

#[test]
fn boards_give_the_focal_length_to_half_a_percent() {
    let found = camera_from_boards().camera.fx;
    let truth = read_truth().fx;
    assert!((found / truth - 1.0).abs() < 0.005, "{found} instead of {truth}");
}

#[test]
fn every_frame_has_a_pose_good_to_a_quarter_of_a_degree() {
    let film = &*FILM;
    let poses = poses(film);
    assert_eq!(poses.len(), film.truth.poses.len());
    let rotation = truth_from_result(&poses).rigid;
    let error = |(found, truth): &(Transform, Transform)| found.angle_to(&(*truth * rotation)).to_degrees();
    let errors: Vec<f64> = poses.iter().map(error).collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    println!("pose error: median {:.2}°, worst {worst:.2}°", median(errors));
    assert!(worst <= 0.25, "{worst:.2}°");
}

/// The film with every frame followed by a second picture of the same moment, darker, coarser and noisier.
fn twice(folder: &Path) {
    let frames = FrameSet::open(&[clip().join("frames")], &Progress::new()).unwrap();
    let mut random = Random::new(17);
    for (i, frame) in frames.frames.iter().enumerate() {
        let mut picture = frames.load(i).unwrap();
        picture.save(folder.join(format!("{}_a.png", frame.name))).unwrap();
        picture = image::imageops::blur(&picture, 0.8);
        for value in picture.iter_mut() {
            *value = (0.8 * f64::from(*value) + 3.0 * random.normal()).round().clamp(0.0, 255.0) as u8;
        }
        picture.save(folder.join(format!("{}_b.png", frame.name))).unwrap();
    }
}

#[test]
fn frames_that_were_not_chosen_are_posed_by_their_points() {
    let folder = tempfile::tempdir().unwrap();
    twice(folder.path());
    let report = run_on(folder.path(), &FILM.assets, FILM.camera).report;
    let pair = |f: &FrameReport| Some((f.cam_from_head?, FILM.truth.poses[&f.name[..f.name.len() - 2]], f.used));
    let all: Vec<(Transform, Transform, bool)> = report.frames.iter().filter_map(pair).collect();
    let poses: Vec<(Transform, Transform)> = all.iter().map(|(found, truth, _)| (*found, *truth)).collect();
    let rotation = truth_from_result(&poses).rigid;
    let left_out = all.iter().filter(|(_, _, used)| !used);
    let errors: Vec<f64> =
        left_out.map(|(found, truth, _)| found.angle_to(&(*truth * rotation)).to_degrees()).collect();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    println!("{} frames left out: worst {worst:.2}°", errors.len());
    assert!(errors.len() >= 10 && worst < 0.4, "{} frames left out: worst {worst:.2}°", errors.len());
}

#[test]
fn the_face_lies_within_a_millimetre_of_the_truth() {
    let distances = surface_distances(&FILM);
    let median = 1000.0 * median(distances);
    println!("surface: median {median:.2} mm, scale {:.3}", truth_from_result(&poses(&FILM)).scale);
    assert!(median <= 1.0, "{median:.2} mm");
}

#[test]
fn the_same_bytes_come_from_one_thread_and_from_two() {
    let (one, two) = (&FILM.on_one_thread, &FILM.on_two_threads);
    let untimed = |r: &Reconstruction| Report { timings_s: BTreeMap::new(), ..r.report.clone() };
    assert_eq!(untimed(one), untimed(two));
    assert!(one.glb().unwrap() == two.glb().unwrap(), "head.glb differs");
    assert!(one.texture == two.texture && one.eyes == two.eyes, "the textures differ");
}

#[test]
fn the_calibrated_camera_stays_as_it_is() {
    let (used, given) = (FILM.on_one_thread.report.camera, FILM.camera);
    let numbers = |c: &SourcedCamera| {
        let c = &c.camera;
        [c.fx, c.fy, c.cx, c.cy, c.k1, c.k2]
    };
    let kept = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-9 * b.abs();
    assert!(numbers(&used).iter().zip(&numbers(&given)).all(kept), "{used:?} instead of {given:?}");
    assert_eq!(used.source, given.source);
}

#[test]
fn the_glb_has_every_key_by_name() {
    let glb = gltf::Gltf::from_slice(&FILM.on_one_thread.glb().unwrap()).unwrap();
    let node = glb.nodes().find(|n| n.name() == Some("skin")).unwrap();
    let skin = node.mesh().unwrap();
    let extras: Value = serde_json::from_str(skin.extras().as_ref().unwrap().get()).unwrap();
    let names: Vec<&str> = extras["targetNames"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    let expected: Vec<&str> = FILM.on_one_thread.keys.iter().map(|k| k.name.as_str()).collect();
    assert_eq!((names.len(), &names), (67, &expected));
    assert_eq!(skin.primitives().next().unwrap().morph_targets().len(), 67);
    for name in ["eyeBlinkLeft", "jawOpen", "tongueOut", "viseme_sil", "viseme_U"] {
        assert!(names.contains(&name), "{name}");
    }
}

#[test]
fn the_papers_method_writes_eyes_of_sixty_triangles_that_the_lids_take_along() {
    let head = run_by(Method::Paper, &clip().join("frames"), &FILM.assets, FILM.camera);
    let glb = gltf::Gltf::from_slice(&head.glb().unwrap()).unwrap();
    for name in ["eye_left", "eye_right"] {
        let mesh = glb.nodes().find(|n| n.name() == Some(name)).unwrap().mesh().unwrap();
        assert_eq!(mesh.primitives().next().unwrap().indices().unwrap().count(), 3 * 60);
    }
    for part in &head.parts {
        assert!(head.quads[part.quads.clone()].iter().flatten().all(|&v| part.vertices.contains(&(v as usize))));
    }
    let before = &FILM.assets.head;
    assert_eq!(head.parts[0], before.parts[0]);
    assert_eq!(head.positions.len() + before.parts[1].vertices.len() * 2, before.positions.len() + 100);
    let blink = head.keys.iter().find(|k| k.name == "eyeBlinkLeft").unwrap();
    assert!(blink.offsets.windows(2).all(|pair| pair[0].0 < pair[1].0));
    let moves =
        |part: usize| blink.offsets.iter().filter(|o| head.parts[part].vertices.contains(&(o.0 as usize))).count();
    assert!((1..=24).contains(&moves(1)) && moves(2) == 0, "{} {}", moves(1), moves(2));
}

/// The widest gap of contact pairs with a key at 1, metres.
fn gap(positions: &[Vec3], keys: &[head::Key], key: Option<&str>, pairs: &[[u32; 2]]) -> f64 {
    let mut moved = positions.to_vec();
    for (vertex, offset) in keys.iter().filter(|k| Some(k.name.as_str()) == key).flat_map(|k| &k.offsets) {
        moved[*vertex as usize] += offset;
    }
    pairs.iter().map(|&[a, b]| (moved[a as usize] - moved[b as usize]).norm()).fold(0.0, f64::max)
}

fn closes_as_on_the_generic_head(key: Option<&str>, pairs: &[[u32; 2]]) {
    let (generic, person) = (&FILM.assets.head, &FILM.on_one_thread);
    let usual = gap(&generic.positions, &generic.keys, key, pairs);
    let here = gap(&person.positions, &person.keys, key, pairs);
    assert!(here <= usual + 0.0003, "{:.2} mm apart, {:.2} mm on the generic head", 1e3 * here, 1e3 * usual);
}

#[test]
fn lids_meet_when_the_eyes_blink() {
    let [left, right] = &FILM.assets.head.lid_contacts;
    closes_as_on_the_generic_head(Some("eyeBlinkLeft"), left);
    closes_as_on_the_generic_head(Some("eyeBlinkRight"), right);
}

#[test]
fn lips_are_closed_at_rest() {
    closes_as_on_the_generic_head(None, &FILM.assets.head.lip_contacts);
}
