//! Films and heads that are judged: what is not as usual is said with what was measured, what nobody can have is refused.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{assets, clip};
use facewright::{
    Assets, CameraSource, Faces, FrameSet, Given, Pixel, ReconstructOptions, Reconstruction, SourcedCamera, Verdict,
    find_faces, reconstruct,
};
use geometry::face_mesh::{LIPS_INNER_LOWER, LIPS_INNER_UPPER, LIPS_OUTER_LOWER, LIPS_OUTER_UPPER};
use geometry::{Camera, Progress, Similarity, Vec2};
use image::{Rgb, RgbImage, Rgba, imageops};
use std::path::Path;
use std::sync::LazyLock;
use tempfile::TempDir;
use vision::landmarks::Face;

static ASSETS: LazyLock<Assets> = LazyLock::new(|| Assets::load(&assets().unwrap()).unwrap());
static PICTURES: LazyLock<Vec<RgbImage>> = LazyLock::new(|| {
    let frame = |i: usize| image::open(clip().join(format!("frames/frame_{i:02}.jpg"))).unwrap().into_rgb8();
    (0..21).map(frame).collect()
});
static FACES: LazyLock<Faces> = LazyLock::new(|| {
    let frames = FrameSet::open(&[clip().join("frames")], &Progress::new()).unwrap();
    find_faces(&frames, &ASSETS, None, &Progress::new()).unwrap()
});

/// The head of the film as it is, of which no camera is given.
static PLAIN: LazyLock<Reconstruction> =
    LazyLock::new(|| made(film(PICTURES.iter().cloned()).path(), None, None).unwrap());

fn face(i: usize) -> &'static Face {
    FACES.face(i).unwrap()
}

/// The synthetic person's camera, as it is.
fn camera() -> SourcedCamera {
    let camera = Camera { cx: 203.2, cy: 147.1, k1: -0.12, k2: 0.04, ..Camera::centred(400, 300, 520.0) };
    SourcedCamera { camera, source: CameraSource::Board }
}

fn film(pictures: impl IntoIterator<Item = RgbImage>) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (i, picture) in pictures.into_iter().enumerate() {
        picture.save(folder.path().join(format!("frame_{i:02}.png"))).unwrap();
    }
    folder
}

fn made(folder: &Path, camera: Option<SourcedCamera>, face: Option<Pixel>) -> Result<Reconstruction, String> {
    let progress = Progress::new();
    let frames = FrameSet::open(&[folder.to_owned()], &progress).unwrap();
    let mut options = ReconstructOptions { texture_size: 256, ..ReconstructOptions::default() };
    options.person.face = face;
    let given = Given { camera, ..Given::default() };
    reconstruct(&frames, &ASSETS, &given, &options, &progress).map_err(|error| error.to_string())
}

fn head(folder: &TempDir) -> Reconstruction {
    made(folder.path(), Some(camera()), None).unwrap()
}

/// Every picture with a polygon of landmarks filled.
fn painted(polygons: &[&[usize]], colour: [u8; 3]) -> TempDir {
    film(PICTURES.iter().enumerate().map(|(i, picture)| {
        let mut picture = picture.clone();
        for polygon in polygons {
            let corners: Vec<Vec2> = polygon.iter().map(|&k| face(i).points[k].xy()).collect();
            fill(&mut picture, &corners, colour);
        }
        picture
    }))
}

fn fill(picture: &mut RgbImage, corners: &[Vec2], colour: [u8; 3]) {
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        let (x, y) = (f64::from(x), f64::from(y));
        let crosses =
            |(a, b): (&Vec2, &Vec2)| (a.y > y) != (b.y > y) && x < a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
        if corners.iter().zip(corners.iter().cycle().skip(1)).filter(|ends| crosses(*ends)).count() % 2 == 1 {
            *pixel = Rgb(colour);
        }
    }
}

fn levels(times: f64) -> TempDir {
    film(PICTURES.iter().map(|picture| {
        let mut picture = picture.clone();
        picture.pixels_mut().flat_map(|p| &mut p.0).for_each(|c| *c = (f64::from(*c) * times).round().min(255.0) as u8);
        picture
    }))
}

fn warns(head: &Reconstruction, words: &str) {
    let warnings = &head.report.warnings;
    assert!(warnings.iter().any(|warning| warning.contains(words)), "no “{words}” in {warnings:#?}");
    let quality = head.report.quality.as_ref().unwrap();
    assert!(quality.verdict == Verdict::Warned && quality.unusual().any(|m| m.sentence.contains(words)));
}

#[test]
fn a_good_film_has_a_good_verdict_and_no_warning() {
    let head = head(&film(PICTURES.iter().cloned()));
    assert_eq!(head.report.warnings, Vec::<String>::new());
    let quality = head.report.quality.unwrap();
    assert_eq!(quality.verdict, Verdict::Good, "{:#?}", quality.unusual().collect::<Vec<_>>());
    assert!(quality.measures.iter().any(|m| m.name == "held_out_correlation"));
}

#[test]
fn a_good_film_without_a_board_has_no_warning_either() {
    let head = &*PLAIN;
    assert_eq!(head.report.warnings, Vec::<String>::new());
    assert_eq!(head.report.quality.as_ref().unwrap().verdict, Verdict::Good);
    let focal = head.report.camera.camera.fx;
    assert!((focal / camera().camera.fx - 1.0).abs() < 0.06, "{focal}");
}

/// Median distance of the face's landmarks from those of the film as it is, after a similarity, millimetres.
fn off_mm(head: &Reconstruction) -> f64 {
    let [ours, plain] = [head, &*PLAIN].map(|head| ASSETS.head.landmarks(&head.positions));
    let to_plain = Similarity::fit(&ours, &plain, None, true).unwrap();
    let mut off: Vec<f64> = ours.iter().zip(&plain).map(|(a, b)| 1000.0 * (to_plain.apply(a) - b).norm()).collect();
    off.sort_by(f64::total_cmp);
    off[off.len() / 2]
}

/// The film as a window of a larger picture, whose upper left corner is there.
fn window((width, height): (u32, u32), (left, top): (i64, i64)) -> TempDir {
    film(PICTURES.iter().map(|picture| {
        let mut screen = RgbImage::from_pixel(width, height, Rgb([120, 120, 115]));
        imageops::replace(&mut screen, picture, left, top);
        screen
    }))
}

#[test]
fn a_window_off_the_middle_of_a_recorded_screen_is_found_and_said() {
    let head = made(window((1000, 600), (580, 40)).path(), None, None).unwrap();
    let (found, off) = (head.report.camera.camera, off_mm(&head));
    println!("principal point ({:.0}, {:.0}), {off:.2} mm off", found.cx, found.cy);
    assert!(off <= 0.7 && (found.fx / camera().camera.fx - 1.0).abs() < 0.08, "{off} mm, {}", found.fx);
    let said = &head.report.warnings;
    assert!(said.iter().any(|w| w.contains("the picture is a part of a larger one")), "{said:?}");
}

#[test]
fn a_short_focal_length_in_the_middle_of_a_large_picture_is_found() {
    let head = made(window((1920, 1080), (760, 390)).path(), None, None).unwrap();
    let (focal, off) = (head.report.camera.camera.fx, off_mm(&head));
    println!("focal length {focal:.1} px, {off:.2} mm off");
    assert!(off <= 0.7 && (focal / camera().camera.fx - 1.0).abs() < 0.06, "{off} mm, {focal} px");
    let said = &head.report.warnings;
    let wrong = ["part of a larger", "what cameras usually have", "more light"];
    assert!(!said.iter().any(|warning| wrong.iter().any(|words| warning.contains(words))), "{said:?}");
}

/// The film as photographs whose EXIF tells a focal length in millimetres of a 35 mm camera.
fn photographs(millimetres: u8) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let tiff = [
        // The picture's directory of one entry, where EXIF's is; and that, of one entry.
        &b"II*\0\x08\0\0\0\x01\0\x69\x87\x04\0\x01\0\0\0\x1a\0\0\0\0\0\0\0"[..],
        &[b"\x01\0\x05\xa4\x03\0\x01\0\0\0", &[millimetres, 0, 0, 0][..], &[0; 4]].concat(),
    ]
    .concat();
    let exif = [b"\xff\xe1\0", &[8 + tiff.len() as u8][..], b"Exif\0\0", &tiff].concat();
    for i in 0..PICTURES.len() {
        let jpeg = std::fs::read(clip().join(format!("frames/frame_{i:02}.jpg"))).unwrap();
        let path = folder.path().join(format!("frame_{i:02}.jpg"));
        std::fs::write(path, [&jpeg[..2], &exif, &jpeg[2..]].concat()).unwrap();
    }
    folder
}

#[test]
fn true_exif_is_quiet_and_wrong_exif_gives_way_to_the_turn_and_is_said() {
    // 45 mm are the 520 px that the camera has, 90 mm twice that.
    for (millimetres, words) in [(45, None), (90, Some("EXIF tells a focal length of about 1040 px"))] {
        let head = made(photographs(millimetres).path(), None, None).unwrap();
        let (used, off, said) = (head.report.camera, off_mm(&head), &head.report.warnings);
        println!("{millimetres} mm: {:.1} px, {off:.2} mm off", used.camera.fx);
        assert_eq!(used.source == CameraSource::Exif, words.is_none(), "where it comes from: {:?}", used.source);
        assert!(off <= 0.7 && (used.camera.fx / camera().camera.fx - 1.0).abs() < 0.06, "{off} mm, {used:?}");
        match words {
            None => assert_eq!(*said, Vec::<String>::new()),
            Some(words) => {
                let found = format!("one of {:.0} ± ", used.camera.fx);
                assert!(said.iter().any(|w| w.contains(words) && w.contains(&found)), "{said:?}");
            }
        }
    }
}

#[test]
fn dark_and_burnt_films_are_said_to_be_so() {
    for (times, words) in [(0.12, "half of the face is darker than level"), (2.6, "% of the face are clipped to white")]
    {
        match made(levels(times).path(), Some(camera()), None) {
            Ok(head) => warns(&head, words),
            Err(said) => assert!(said.contains("no head was made") && said.contains(words), "{said}"),
        }
    }
}

#[test]
fn a_mask_and_dark_glasses_are_said_and_leave_no_colour_on_the_skin() {
    const MASK: [usize; 25] = [
        197, 122, 118, 117, 123, 147, 58, 172, 136, 150, 149, 176, 148, 152, 377, 400, 378, 379, 365, 397, 288, 376,
        352, 346, 347,
    ];
    const GLASSES: [&[usize]; 2] = [&[46, 105, 107, 193, 47, 101, 50, 116], &[276, 334, 336, 417, 277, 330, 280, 345]];
    let blue = |head: &Reconstruction| {
        let texels = head.texture.pixels().filter(|p| i32::from(p.0[2]) > i32::from(p.0[0]) + 60);
        texels.count() as f64 / f64::from(head.texture.width() * head.texture.height())
    };
    let masked = head(&painted(&[&MASK], [60, 110, 220]));
    warns(&masked, "mouth, nose and chin differ from the brow");
    assert!(blue(&masked) < 0.01, "{}", blue(&masked));
    let hidden = head(&painted(&GLASSES, [20, 24, 160]));
    warns(&hidden, "the eyes differ from the cheeks");
    assert!(blue(&hidden) < 0.01, "{}", blue(&hidden));
}

/// Colours of a texture along both lips, half way between their edges, but for the corners.
fn lips(head: &Reconstruction) -> Vec<[f64; 3]> {
    let skin = ASSETS.head.skin();
    let corners: Vec<_> = ASSETS.head.triangles(skin).into_iter().zip(ASSETS.head.triangle_uvs(skin)).collect();
    let place = |landmark: usize| {
        let anchor = &ASSETS.head.anchors[landmark];
        let (_, uvs) = corners.iter().find(|(triangle, _)| *triangle == anchor.triangle).unwrap();
        uvs.iter().zip(anchor.weights).map(|(uv, weight)| uv * weight).sum::<Vec2>()
    };
    let (texture, size) = (&head.texture, f64::from(head.texture.width()));
    let lips = [(&LIPS_INNER_UPPER, &LIPS_OUTER_UPPER), (&LIPS_INNER_LOWER, &LIPS_OUTER_LOWER)];
    let columns = lips.into_iter().flat_map(|(inner, outer)| (3..8).map(move |k| (inner[k], outer[k])));
    let at = |(inner, outer)| {
        let uv = (place(inner) + place(outer)) / 2.0;
        Vec2::new(uv.x, 1.0 - uv.y) * size
    };
    let colour = |texel: Vec2| texture.get_pixel(texel.x as u32, texel.y as u32).0;
    columns.map(at).map(colour).map(|[r, g, b, _]| [r, g, b].map(f64::from)).collect()
}

#[test]
fn a_finger_before_the_mouth_does_not_colour_the_lips() {
    /// Whose colour the finger has, and around what it covers.
    const BROW: usize = 151;
    const FINGER: [usize; 4] = [92, 164, 18, 182];
    let hidden = film(PICTURES.iter().enumerate().map(|(i, picture)| {
        let mut picture = picture.clone();
        if (4..17).contains(&i) {
            let brow = face(i).points[BROW].map(|c| c as u32);
            let colour = picture.get_pixel(brow.x, brow.y).0;
            fill(&mut picture, &FINGER.map(|k| face(i).points[k].xy()), colour);
        }
        picture
    }));
    let head = made(hidden.path(), None, None).unwrap();
    let pairs: Vec<_> = lips(&head).into_iter().zip(lips(&PLAIN)).collect();
    let off = pairs.iter().map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, f64::max)).fold(0.0, f64::max);
    println!("{off:.1} levels");
    assert!(off < 20.0, "{off} levels: {pairs:.0?}");
}

/// The wall painted over all that is above the forehead.
#[test]
fn a_skull_that_reaches_beyond_the_person_is_said() {
    const FOREHEAD: usize = 10;
    const CHIN: usize = 152;
    let bald = film(PICTURES.iter().enumerate().map(|(i, picture)| {
        let mut picture = picture.clone();
        let [top, chin] = [FOREHEAD, CHIN].map(|k| face(i).points[k].xy());
        let (up, wall) = ((top - chin).normalize(), *picture.get_pixel(3, 3));
        for (x, y, pixel) in picture.enumerate_pixels_mut() {
            if (Vec2::new(f64::from(x), f64::from(y)) - top).dot(&up) > 2.0 {
                *pixel = wall;
            }
        }
        picture
    }));
    warns(&head(&bald), "% of skull and face lie outside the person's outline");
}

#[test]
fn a_film_of_one_side_is_warned_of() {
    let head = head(&film(PICTURES[13..].iter().cloned()));
    warns(&head, "the other side of the face is not seen");
    // The wall is grey with some green in it, skin is red.
    let is_wall = |p: &&Rgba<u8>| p.0[3] == 255 && p.0[1] >= p.0[0];
    let wall = head.texture.pixels().filter(is_wall).count() as f64;
    let all = f64::from(head.texture.width() * head.texture.height());
    println!("{:.2} % as the wall", 100.0 * wall / all);
    assert!(wall < 0.005 * all, "{wall} texels");
}

/// The film, then the same person mirrored, elsewhere, and in a light from the side: neither picture nor face goes on.
fn cut_film(first: usize) -> TempDir {
    let elsewhere = |picture: &RgbImage| {
        let mut other = imageops::flip_horizontal(picture);
        for (x, y, pixel) in other.enumerate_pixels_mut() {
            let ramp = 0.15 + 1.5 * f64::from(x) / 400.0;
            let wall = if (x / 40 + y / 40) % 2 == 0 { 0.4 } else { 1.0 };
            let far = (f64::from(x) - 200.0).hypot(f64::from(y) - 150.0) > 130.0;
            pixel.0 = pixel.0.map(|c| (f64::from(c) * ramp * if far { wall } else { 1.0 }).min(255.0) as u8);
        }
        other
    };
    film(PICTURES[..first].iter().cloned().chain(PICTURES[..21 - first].iter().map(elsewhere)))
}

#[test]
fn of_a_cut_film_the_longer_shot_is_used() {
    let head = head(&cut_film(13));
    assert!(
        head.report.warnings.iter().any(|w| w.contains("change at once at frame frame_13: a cut")),
        "{:?}",
        head.report.warnings
    );
    let reasons: Vec<_> = head.report.frames.iter().map(|f| f.reason.as_str()).collect();
    assert!(reasons[13..].iter().all(|reason| *reason == "another shot"), "{reasons:?}");
    assert!(head.report.frames[..13].iter().all(|frame| frame.cam_from_head.is_some()));
}

/// A poster, larger than the person who turns beside it.
fn beside_a_poster() -> TempDir {
    film(PICTURES.iter().map(|picture| {
        let mut both = RgbImage::from_pixel(800, 400, Rgb([120, 120, 115]));
        imageops::replace(&mut both, picture, 0, 50);
        let poster = imageops::resize(&PICTURES[10], 520, 390, imageops::FilterType::Triangle);
        imageops::replace(&mut both, &imageops::crop_imm(&poster, 70, 0, 380, 390).to_image(), 410, 5);
        both
    }))
}

#[test]
fn beside_a_larger_poster_the_person_who_turns_is_followed() {
    let folder = beside_a_poster();
    let head = made(folder.path(), None, None).unwrap();
    let said = &head.report.warnings;
    assert!(said.iter().any(|w| w.contains("the one that turns was followed, not the largest one")), "{said:?}");
    let asked_for = made(folder.path(), None, Some(Pixel(Vec2::new(600.0, 200.0)))).unwrap_err();
    assert!(asked_for.contains("the head turns by only"), "{asked_for}");
}

#[test]
fn a_head_that_nobody_has_is_refused_with_what_was_measured() {
    // A lens with a quarter of the true focal length.
    let wrong = SourcedCamera { camera: Camera { fx: 130.0, fy: 130.0, ..camera().camera }, ..camera() };
    let folder = film(PICTURES.iter().cloned());
    match made(folder.path(), Some(wrong), None) {
        Err(said) => assert!(said.contains("no head was made: "), "{said}"),
        Ok(head) => {
            let quality = head.report.quality.unwrap();
            assert_eq!(quality.verdict, Verdict::Warned, "{quality:#?}");
        }
    }
}
