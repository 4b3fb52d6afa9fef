//! A head from pictures of two cameras whose places are known to their calibrated precision: the true head of the film, with the skin
//! that a reconstruction has of it, drawn as two cameras with lenses see it.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "the helpers of tests are tests too")]

mod two_cameras;

use end_to_end::truth::Truth;
use end_to_end::{assets, clip};
use facewright::{
    Assets, CalibratedRig, CameraSource, FrameSet, Given, Method, ReconstructOptions, Reconstruction, RigFrames,
    SizeOptions, SourcedCamera, overlay, overlay_on_rig, reconstruct, reconstruct_on_rig,
};
use geometry::{Camera, Progress, Similarity, Transform, Vec2, Vec3, mesh};
use head::surface::SkinSurface;
use head::{GenericHead, part};
use image::RgbImage;
use nalgebra::Rotation3;
use std::path::Path;
use std::sync::LazyLock;
use synthetic::Random;
use texture::{DrawOptions, Layer, Painter, Surface};
use two_cameras::rig;

/// Noise of the pictures, grey levels.
const NOISE: f64 = 1.0;
/// What is behind the head.
const BACKGROUND: [f64; 3] = [62.0, 70.0, 78.0];
/// Vertices this near the tip of the nose are face, metres.
const FACE_RADIUS: f64 = 0.095;

/// The lenses are not the same.
fn lens(camera: usize) -> Camera {
    match camera {
        0 => Camera { k1: -0.12, k2: 0.03, ..Camera::centred(640, 480, 860.0) },
        _ => Camera { k1: -0.08, cx: 325.0, cy: 236.0, ..Camera::centred(640, 480, 840.0) },
    }
}

/// The second camera, to the right of the first and turned towards the head, which is 0.65 m away.
fn right_from_left(angle: f64) -> Transform {
    let rotation = Rotation3::from_axis_angle(&Vec3::y_axis(), angle);
    let middle = Vec3::new(0.0, -0.03, 0.65);
    Transform::new(rotation, middle - rotation * middle + Vec3::new(0.003, -0.004, 0.002))
}

/// The filmed head with a skin.
struct Filmed {
    assets: Assets,
    truth: Truth,
    /// The shape is the true one where it is known: the skin. Eyes, teeth and textures are those that a reconstruction found.
    head: Reconstruction,
}

static FILMED: LazyLock<Filmed> = LazyLock::new(|| {
    let assets = Assets::load(&assets().unwrap()).unwrap();
    let (truth, progress) = (Truth::read(), Progress::new());
    let frames = FrameSet::open(&[clip().join("frames")], &progress).unwrap();
    let camera = Some(SourcedCamera { camera: truth.camera, source: CameraSource::Board });
    let options = ReconstructOptions { texture_size: 2048, ..ReconstructOptions::default() };
    let given = Given { camera, ..Given::default() };
    let mut head = reconstruct(&frames, &assets, &given, &options, &progress).unwrap();
    let skin = assets.head.skin().vertices.clone();
    let to_truth = Similarity::fit(&head.positions[skin.clone()], &truth.vertices, None, true).unwrap();
    head.positions.iter_mut().for_each(|p| *p = to_truth.apply(p));
    head.positions[skin].copy_from_slice(&truth.vertices);
    Filmed { assets, truth, head }
});

/// One part of a head as it is drawn.
struct DrawnPart {
    triangles: Vec<[u32; 3]>,
    uvs: Vec<[Vec2; 3]>,
    is_eye: bool,
}

fn parts(head: &Reconstruction) -> Vec<DrawnPart> {
    let wanted = [part::SKIN, part::EYE_LEFT, part::EYE_RIGHT];
    let drawn = head.parts.iter().filter(|part| wanted.contains(&part.name.as_str()));
    let part = |part: &head::Part| {
        let (mut triangles, mut uvs) = (Vec::new(), Vec::new());
        for (quad, uv) in head.quads[part.quads.clone()].iter().zip(&head.uvs[part.quads.clone()]) {
            let corner = |k: usize| Vec2::new(f64::from(uv[k][0]), f64::from(uv[k][1]));
            for corners in [[0, 1, 2], [0, 2, 3]] {
                triangles.push(corners.map(|k| quad[k]));
                uvs.push(corners.map(corner));
            }
        }
        DrawnPart { triangles, uvs, is_eye: part.name != part::SKIN }
    };
    drawn.map(part).collect()
}

/// Draws the head as a camera sees it at each pose; camera and moment are in the files' names.
fn film(folder: &Path, camera: usize, poses: &[Transform]) -> RigFrames {
    let name = ["left", "right"][camera];
    let folder = folder.join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let (head, parts) = (&FILMED.head, parts(&FILMED.head));
    let layers: Vec<Layer> = parts
        .iter()
        .map(|part| Layer {
            surface: Surface {
                positions: &head.positions,
                triangles: &part.triangles,
                uvs: &part.uvs,
                weight: None,
                mirror: None,
            },
            texture: if part.is_eye { &head.eyes } else { &head.texture },
        })
        .collect();
    let painter = Painter::new(&layers).unwrap();
    let mut random = Random::new(7 + camera as u64);
    for (moment, pose) in poses.iter().enumerate() {
        let options = DrawOptions { supersampling: 3, ..DrawOptions::default() };
        let drawn = painter.draw(&lens(camera), pose, &options).unwrap();
        let picture = RgbImage::from_fn(drawn.width(), drawn.height(), |x, y| {
            let [r, g, b, alpha] = drawn.get_pixel(x, y).0;
            let share = f64::from(alpha) / 255.0;
            let mut mixed = |k: usize, value: u8| {
                let clean = f64::from(value) * share + BACKGROUND[k] * (1.0 - share);
                (clean + NOISE * random.normal()).round().clamp(0.0, 255.0) as u8
            };
            image::Rgb([mixed(0, r), mixed(1, g), mixed(2, b)])
        });
        picture.save(folder.join(format!("{moment:04}.png"))).unwrap();
    }
    RigFrames { camera: name.to_owned(), frames: FrameSet::open(&[folder], &Progress::new()).unwrap() }
}

/// The films of both cameras, which see the head from directions `angle` radians apart.
fn films(folder: &Path, poses: &[Transform], angle: f64) -> [RigFrames; 2] {
    let right: Vec<Transform> = poses.iter().map(|pose| right_from_left(angle) * *pose).collect();
    [film(folder, 0, poses), film(folder, 1, &right)]
}

fn solve(films: &[RigFrames], angle: f64) -> Reconstruction {
    let options = ReconstructOptions { texture_size: 512, ..ReconstructOptions::default() };
    let rig = rig([lens(0), lens(1)], right_from_left(angle));
    reconstruct_on_rig(films, &rig, &FILMED.assets, &options, &Progress::new()).unwrap()
}

/// Pose of the result and the true one of each frame.
fn poses(result: &Reconstruction, truth: &[Transform], angle: f64) -> Vec<(Transform, Transform)> {
    let frame = |frame: &facewright::FrameReport| {
        let (camera, moment) = frame.name.split_once('_').unwrap();
        let pose = truth[moment.parse::<usize>().unwrap()];
        Some((frame.cam_from_head?, if camera == "left" { pose } else { right_from_left(angle) * pose }))
    };
    result.report.frames.iter().filter_map(frame).collect()
}

/// `truth_from_result` by the cameras: they are where they truly are when everything is `scale` times as large, in front of the first.
fn truth_from_result(poses: &[(Transform, Transform)], scale: f64) -> Similarity {
    let turn = poses.iter().map(|(p, t)| (t.rotation.inverse() * p.rotation).into_inner());
    let rotation = Transform::from_matrix(&turn.sum::<geometry::Mat3>(), Vec3::zeros()).rotation;
    let shift = |(p, t): &(Transform, Transform)| t.rotation.inverse() * (p.translation * scale - t.translation);
    let shift = poses.iter().map(shift).sum::<Vec3>() / poses.len() as f64;
    Similarity { scale, rigid: Transform::new(rotation, shift) }
}

/// Median distance of the true face's vertices from the result's surface, metres.
fn surface_distance(result: &Reconstruction, head: &GenericHead, to_truth: &Similarity) -> f64 {
    let truth = &FILMED.truth;
    let placed: Vec<Vec3> = result.positions.iter().map(|p| to_truth.apply(p)).collect();
    let surface = SkinSurface::new(head, &placed);
    let normals = mesh::vertex_normals(&truth.vertices, &truth.triangles);
    let tip = truth.nose_tip;
    let is_face =
        |i: &usize| (truth.vertices[*i] - tip).norm() < FACE_RADIUS && normals[*i].z > 0.0 && !head.cavity[*i];
    let distance = |i: usize| {
        let vertex = &truth.vertices[i];
        surface.closest(vertex, 0.02).map_or(0.02, |foot| (foot.position - vertex).norm())
    };
    let mut all: Vec<f64> = (0..truth.vertices.len()).filter(is_face).map(distance).collect();
    all.sort_by(f64::total_cmp);
    all[all.len() / 2]
}

/// Size of the result over the true one, and the median distance of the surfaces, metres: the first is the one that brings the surfaces
/// together, cameras where they are.
fn errors(result: &Reconstruction, truth: &[Transform], angle: f64) -> (f64, f64) {
    let (head, poses) = (&FILMED.assets.head, poses(result, truth, angle));
    let of_first: Vec<_> = poses.iter().take(truth.len()).copied().collect();
    let at = |step: i32| {
        let scale = 1.0 + 5e-4 * f64::from(step);
        (1.0 / scale, surface_distance(result, head, &truth_from_result(&of_first, scale)))
    };
    (-24..=24).map(at).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

fn tell(what: &str, result: &Reconstruction, (size, surface): (f64, f64)) {
    let scale = &result.report.scale;
    println!(
        "{what}: size {size:.4}, said to be good to {:.4}; surface {:.2} mm, {} points, {} frames used, {:?}",
        scale.relative_sigma,
        1000.0 * surface,
        result.report.points,
        result.report.frames.iter().filter(|f| f.used).count(),
        result.report.warnings,
    );
}

#[test]
fn films_of_two_cameras_give_the_true_size_and_shape() {
    let (folder, angle) = (tempfile::tempdir().unwrap(), 0.2);
    let truth = &FILMED.truth.poses;
    let films = films(folder.path(), truth, angle);
    let result = solve(&films, angle);
    let (size, surface) = errors(&result, truth, angle);
    tell("films", &result, (size, surface));
    assert!((size - 1.0).abs() <= 0.005, "size {size}");
    assert!(surface <= 0.6e-3, "surface {surface}");
    assert!(result.report.scale.measured && result.report.scale.source.contains("left, right"));
    let (frames, cameras) = (&result.report.frames, &result.report.rig);
    assert_eq!((frames.len(), &frames[0].name[..], &frames[21].name[..]), (42, "left_0000", "right_0000"));
    assert_eq!((cameras.len(), &cameras[1].name[..], cameras[1].camera), (2, "right", lens(1)));
    overlays(&result, films, folder.path());
}

/// The result is drawn over each camera's frames as that camera filmed.
fn overlays(result: &Reconstruction, films: [RigFrames; 2], folder: &Path) {
    let (head, drawn) = (folder.join("head"), folder.join("drawn"));
    result.write(&head).unwrap();
    let refused = overlay(&head, &films[0].frames, &drawn, &Progress::new()).unwrap_err().to_string();
    assert!(refused.contains("left=DIR; its cameras are left, right"), "{refused}");
    let names = overlay_on_rig(&head, &films[1..], &drawn, &Progress::new()).unwrap();
    assert_eq!((names.len(), &names[3][..]), (21, "right_0003"));
    let picture = image::open(drawn.join("right_0010.png")).unwrap().into_rgba8();
    let filmed = films[1].frames.load(10).unwrap();
    let opaque = picture.pixels().zip(filmed.pixels()).filter(|(p, _)| p.0[3] == 255);
    let off: Vec<f64> = opaque.map(|(p, f)| (f64::from(p.0[1]) - f64::from(f.0[1])).abs()).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    println!("overlay: {} pixels, {mean:.1} grey levels off", off.len());
    assert!(off.len() > 20_000 && mean < 12.0, "{} pixels, {mean} grey levels", off.len());
}

#[test]
fn one_photograph_of_each_camera_is_enough() {
    for (angle, moment) in [(0.3, 8), (0.2, 9)] {
        let folder = tempfile::tempdir().unwrap();
        // The head looks between the cameras.
        let truth = &FILMED.truth.poses[moment..=moment];
        let result = solve(&films(folder.path(), truth, angle), angle);
        let (size, surface) = errors(&result, truth, angle);
        tell(&format!("photographs {:.0}° apart", angle.to_degrees()), &result, (size, surface));
        assert!((size - 1.0).abs() <= 0.005, "size {size}");
        assert!(surface <= 0.6e-3, "surface {surface}");
    }
}

#[test]
fn what_cannot_be_one_head_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let moments = &FILMED.truth.poses[8..10];
    let mut films = films(folder.path(), moments, 0.2);
    let place = right_from_left(0.2);
    let on = |films: &[RigFrames], rig: &CalibratedRig, options: &ReconstructOptions| {
        reconstruct_on_rig(films, rig, &FILMED.assets, options, &Progress::new()).unwrap_err().to_string()
    };
    let usual = ReconstructOptions::default();
    let refused = |films: &[RigFrames]| on(films, &rig([lens(0), lens(1)], place), &usual);
    assert!(refused(&films[..1]).contains("two or more"), "{}", refused(&films[..1]));
    let paper = ReconstructOptions { method: Method::Paper, ..usual.clone() };
    assert!(on(&films, &rig([lens(0), lens(1)], place), &paper).contains("the method on a rig"));
    let size = SizeOptions { interocular_mm: Some(63.0), ..SizeOptions::default() };
    assert!(
        on(&films, &rig([lens(0), lens(1)], place), &ReconstructOptions { size, ..usual.clone() })
            .contains("the size on a rig")
    );
    let mut other = rig([lens(0), lens(1)], place);
    other.cameras[1].calibrated.camera.camera.width = 1280;
    assert!(on(&films, &other, &usual).contains("calibrated at 1280x480"), "{}", on(&films, &other, &usual));
    let narrow = rig([lens(0), lens(1)], Transform::new(Rotation3::identity(), Vec3::new(-0.01, 0.0, 0.0)));
    let found = on(&films, &narrow, &usual);
    assert!(found.contains("only") && found.contains("° apart, too little to measure depth"), "{found}");
    films[1].camera = "middle".to_owned();
    assert!(refused(&films).contains("no camera middle: its cameras are left, right"), "{}", refused(&films));
    films[1].camera = "left".to_owned();
    assert!(refused(&films).contains("of different cameras"), "{}", refused(&films));
    let one = FrameSet::open(&[folder.path().join("right/0000.png")], &Progress::new()).unwrap();
    films[1] = RigFrames { camera: "right".to_owned(), frames: one };
    assert!(refused(&films).contains("2 of left, 1 of right"), "{}", refused(&films));
}
