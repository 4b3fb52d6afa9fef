//! Input that cannot work: the program says what is wrong and what to do, exits with 1 (2 for usage) and writes nothing.

#![expect(clippy::unwrap_used, reason = "the helpers of tests are tests too")]

use end_to_end::{assets, clip, program};
use image::{DynamicImage, GenericImage, RgbImage};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A folder of its own for a case: inputs go into `in`, results would go into `out`.
struct Case {
    folder: TempDir,
}

impl Case {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("in")).unwrap();
        Self { folder }
    }

    fn input(&self, name: &str) -> PathBuf {
        self.folder.path().join("in").join(name)
    }

    fn output(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn program(&self) -> Command {
        let mut command = Command::new(program().unwrap());
        command.args(["--quiet", "--assets"]).arg(assets().unwrap());
        command
    }

    fn reconstruct(&self, frames: &[PathBuf], more: &[&str]) -> Output {
        let mut command = self.program();
        command.arg("reconstruct").args(frames).arg("-o").arg(self.output());
        command.args(["--texture-size", "64"]).args(more).output().unwrap()
    }

    /// The command failed with exit code 1 and these words, and left no file beyond the input.
    fn refuses(&self, output: &Output, words: &[&str]) {
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.starts_with("facewright: ") && said.trim_end().lines().count() == 1, "not one sentence: {said}");
        for word in words {
            assert!(said.contains(word), "no “{word}” in: {said}");
        }
        assert!(output.stdout.is_empty());
        let left: Vec<_> = std::fs::read_dir(self.folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left, ["in"]);
    }
}

fn frame(i: usize) -> PathBuf {
    clip().join(format!("frames/frame_{i:02}.jpg"))
}

fn picture(path: &Path) -> RgbImage {
    image::open(path).unwrap().into_rgb8()
}

#[test]
fn a_film_without_a_face() {
    let case = Case::new();
    let frames = ["a.jpg", "b.jpg", "c.jpg"].map(|name| case.input(name));
    for path in &frames {
        std::fs::copy(clip().join("no_face.jpg"), path).unwrap();
    }
    case.refuses(
        &case.reconstruct(&frames, &[]),
        &["no face was found in any of the 3 frames", "large in the picture"],
    );
}

#[test]
fn one_frame_only() {
    let case = Case::new();
    case.refuses(&case.reconstruct(&[frame(10)], &[]), &["only one frame", "turns to both sides"]);
}

#[test]
fn a_head_that_does_not_turn() {
    let case = Case::new();
    let frames = ["a.jpg", "b.jpg", "c.jpg", "d.jpg"].map(|name| case.input(name));
    for path in &frames {
        std::fs::copy(frame(10), path).unwrap();
    }
    case.refuses(
        &case.reconstruct(&frames, &[]),
        &["the head turns by only", "°, too little to measure depth", "15° to each side"],
    );
}

#[test]
fn several_faces_follow_the_largest_with_a_warning() {
    let case = Case::new();
    for i in (0..21).step_by(2) {
        let one = picture(&frame(i));
        let (width, height) = one.dimensions();
        let mut both = RgbImage::from_pixel(width + width / 2, height, image::Rgb([120, 120, 115]));
        let other = image::imageops::resize(
            &picture(&frame(10)),
            width * 3 / 5,
            height * 3 / 5,
            image::imageops::FilterType::Triangle,
        );
        both.copy_from(&image::imageops::crop_imm(&other, 0, 0, width / 2, height * 3 / 5).to_image(), width, 0)
            .unwrap();
        both.copy_from(&one, 0, 0).unwrap();
        both.save(case.input(&format!("{i:02}.png"))).unwrap();
    }
    let output = case.reconstruct(&[case.input("")], &[]);
    let (made, said) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{said}");
    assert!(said.contains("\nwarning: ") || said.starts_with("warning: "), "{said}");
    assert!(said.contains("show several faces: the largest one was followed") && !made.contains("several"), "{said}");
    assert!(case.output().join("head.glb").is_file());
}

/// Two people who trade places in size, as if one came nearer and the other stepped back.
#[test]
fn of_two_faces_that_swap_sizes_the_first_is_followed() {
    let case = Case::new();
    for i in 0..21 {
        let one = picture(&frame(i));
        let (width, height) = one.dimensions();
        let mut both = RgbImage::from_pixel(2 * width, height, image::Rgb([120, 120, 115]));
        let (left, right) = if i < 11 { (1.0, 0.7) } else { (0.7, 1.0) };
        for (x, size) in [(0, left), (width, right)] {
            let part = |side: u32| (f64::from(side) * size) as u32;
            let scaled =
                image::imageops::resize(&one, part(width), part(height), image::imageops::FilterType::Triangle);
            both.copy_from(&scaled, x, 0).unwrap();
        }
        both.save(case.input(&format!("{i:02}.png"))).unwrap();
    }
    let output = case.output().join("tracks.json");
    let mut command = case.program();
    let done = command.arg("track").arg(case.input("")).arg("-o").arg(&output).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(said.contains("another face becomes the largest: the one of the frames before was kept"), "{said}");
    let tracks: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(output).unwrap()).unwrap();
    let poses: Vec<f64> = tracks["frames"]
        .as_array()
        .unwrap()
        .iter()
        .map(|frame| frame["cam_from_head"][0][3].as_f64().unwrap_or(f64::NAN))
        .collect();
    assert!(!poses.iter().any(|x| *x > 0.0), "the person at the left is followed throughout: {poses:?}");
    assert!(poses.iter().filter(|x| x.is_finite()).count() >= 19, "{poses:?}");
}

#[test]
fn a_board_of_another_size() {
    let case = Case::new();
    let mut command = case.program();
    command.arg("calibrate").arg(clip().join("board")).args(["--inner", "7x5", "-o"]).arg(case.output());
    case.refuses(&command.output().unwrap(), &["the board was found in 0 of 8 pictures", "9x6", "7x5"]);
}

#[test]
fn a_board_or_picture_of_another_kind() {
    let case = Case::new();
    let mut command = case.program();
    command.args(["board", "-o"]).arg(case.output().join("board.docx"));
    case.refuses(&command.output().unwrap(), &["board.docx", ".svg, .pdf or .png"]);
    let mut command = case.program();
    command.arg("calibrate").arg(clip().join("board")).arg("-o").arg(case.output()).args(["--picture", "report.tiff"]);
    case.refuses(&command.output().unwrap(), &["report.tiff", ".svg, .pdf or .png"]);
}

#[test]
fn a_board_too_large_for_the_page() {
    let case = Case::new();
    let mut command = case.program();
    command.args(["board", "--squares", "4x5", "--square-mm", "40", "-o"]).arg(case.output());
    case.refuses(&command.output().unwrap(), &["does not fit on A4", "smaller"]);
}

#[test]
fn pictures_without_a_board() {
    let case = Case::new();
    let mut command = case.program();
    command.arg("calibrate").arg(clip().join("frames")).arg("-o").arg(case.output());
    case.refuses(&command.output().unwrap(), &["the board was found in 0 of 21 pictures"]);
}

#[test]
fn frames_of_mixed_sizes() {
    let case = Case::new();
    let small = case.input("small.png");
    RgbImage::new(320, 240).save(&small).unwrap();
    case.refuses(
        &case.reconstruct(&[frame(0), small], &[]),
        &["not 400x300 as most are: small (320x240)", "one size, that of one camera"],
    );
}

#[test]
fn a_truncated_picture_is_named() {
    for name in ["cut.png", "cut.jpg"] {
        let case = Case::new();
        let cut = case.input(name);
        picture(&frame(10)).save(&cut).unwrap();
        let bytes = std::fs::read(&cut).unwrap();
        std::fs::write(&cut, &bytes[..bytes.len() / 2]).unwrap();
        let words = [&format!("{name} cannot be read: it is damaged or cut off"), "copy it again"];
        case.refuses(&case.reconstruct(&[frame(0), cut, frame(20)], &[]), &words);
    }
}

#[test]
fn files_that_are_no_pictures_are_said_to_be_what_they_are() {
    for (name, bytes, words) in [
        ("a.jpg", &b""[..], "it is empty"),
        ("a.jpg", b"<!DOCTYPE html><html>", "it is a web page"),
        ("a.heic", b"\0\0\0\x18ftypheic\0\0\0\0", "HEIC, which is not read here: save it as JPEG"),
        ("a.avif", b"\0\0\0\x18ftypavif\0\0\0\0", "AVIF, which is not read here: save it as JPEG"),
    ] {
        let case = Case::new();
        let path = case.input(name);
        std::fs::write(&path, bytes).unwrap();
        case.refuses(&case.reconstruct(&[frame(0), path], &[]), &[&format!("{name} cannot be read"), words]);
    }
}

#[test]
fn a_folder_of_pictures_of_another_kind_is_no_empty_one() {
    let case = Case::new();
    std::fs::write(case.input("IMG_0001.HEIC"), b"\0\0\0\x18ftypheic").unwrap();
    case.refuses(&case.reconstruct(&[case.input("")], &[]), &["holds HEIC pictures", "save them as JPEG"]);
}

#[test]
fn a_lens_that_no_camera_has() {
    let case = Case::new();
    let camera = case.input("camera.json");
    for (k1, words) in [("1e6", "times as far from its middle"), ("-1e6", "folds the picture over")] {
        let numbers = r#""width": 400, "height": 300, "fx": 500, "fy": 500, "cx": 199.5, "cy": 149.5, "k1": "#;
        std::fs::write(&camera, format!("\u{feff}{{{numbers}{k1}}}")).unwrap();
        let said = case.reconstruct(&[frame(0), frame(10)], &["--camera", camera.to_str().unwrap()]);
        case.refuses(&said, &[words, "calibrate again"]);
    }
}

#[test]
fn no_pictures_at_all() {
    let case = Case::new();
    case.refuses(&case.reconstruct(&[case.input("")], &[]), &["no pictures in", "a folder of images"]);
}

#[test]
fn a_missing_file_is_named() {
    let case = Case::new();
    case.refuses(&case.reconstruct(&[frame(0), case.input("gone.jpg")], &[]), &["gone.jpg cannot be read"]);
}

#[test]
fn deep_grey_and_transparent_pictures_are_accepted() {
    let case = Case::new();
    for i in (0..21).step_by(2) {
        let colour = DynamicImage::from(picture(&frame(i)));
        let other = match i % 6 {
            0 => DynamicImage::from(colour.to_rgb16()),
            2 => DynamicImage::from(colour.to_luma8()),
            _ => DynamicImage::from(colour.to_rgba8()),
        };
        other.save(case.input(&format!("{i:02}.png"))).unwrap();
    }
    let output = case.reconstruct(&[case.input("")], &[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(case.output().join("report.json").is_file());
    // The head is drawn over frames that it was made from, and over no others.
    let mut command = case.program();
    let output =
        command.arg("overlay").arg(case.output()).arg(frame(7)).arg("-o").arg(case.input("drawn")).output().unwrap();
    let sentence = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{sentence}");
    assert!(
        sentence.contains("none of these frames is in") && sentence.contains("frames it was made from"),
        "{sentence}"
    );
    assert!(!case.input("drawn").exists());
}

#[test]
fn the_camera_of_another_size() {
    let case = Case::new();
    let camera = case.input("camera.json");
    std::fs::write(&camera, r#"{"width":640,"height":480,"fx":800,"fy":800,"cx":320,"cy":240}"#).unwrap();
    let output = case.reconstruct(&[frame(0), frame(20)], &["--camera", &camera.display().to_string()]);
    case.refuses(&output, &["calibrated at 640x480 but the frames are 400x300", "calibrate at the size"]);
}

#[test]
fn a_camera_that_no_camera_is() {
    let case = Case::new();
    let camera = case.input("camera.json");
    let argument = camera.display().to_string();
    std::fs::write(&camera, r#"{"width":400,"height":300,"fx":-1,"fy":520,"cx":200,"cy":150}"#).unwrap();
    case.refuses(&case.reconstruct(&[frame(0), frame(20)], &["--camera", &argument]), &["which no camera has"]);
    std::fs::write(&camera, "no JSON").unwrap();
    case.refuses(&case.reconstruct(&[frame(0), frame(20)], &["--camera", &argument]), &["camera.json cannot be read"]);
}

#[test]
fn an_output_folder_that_is_a_file_keeps_its_bytes() {
    let case = Case::new();
    let file = case.input("file");
    std::fs::write(&file, "mine").unwrap();
    let mut command = case.program();
    command.arg("calibrate").arg(clip().join("board")).arg("-o").arg(file.join("camera.json"));
    case.refuses(&command.output().unwrap(), &["cannot be written", "Nothing was changed"]);
    let mut command = case.program();
    command.arg("reconstruct").arg(clip().join("frames")).args(["--texture-size", "64", "-o"]).arg(&file);
    case.refuses(&command.output().unwrap(), &["cannot be written", "Nothing was changed"]);
    assert_eq!(std::fs::read_to_string(&file).unwrap(), "mine");
    assert_eq!(std::fs::read_dir(case.input("")).unwrap().count(), 1);
}

#[test]
fn a_folder_that_is_no_result() {
    let case = Case::new();
    let mut command = case.program();
    command.arg("overlay").arg(case.input("")).arg(clip().join("frames")).arg("-o").arg(case.output());
    case.refuses(&command.output().unwrap(), &["holds no result of `facewright reconstruct`", "report.json"]);
}

#[test]
fn missing_assets() {
    let case = Case::new();
    let mut command = Command::new(program().unwrap());
    command.arg("--quiet").arg("--assets").arg(case.input("")).arg("reconstruct").arg(clip().join("frames"));
    let output = command.arg("-o").arg(case.output()).output().unwrap();
    case.refuses(&output, &["generic_head.safetensors.gz is missing", "FACEWRIGHT_ASSETS"]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!said.contains("cargo"), "a developer's command is no remedy for users: {said}");
}

#[test]
fn a_video_without_ffmpeg() {
    let case = Case::new();
    let video = case.input("film.mp4");
    std::fs::write(&video, "not looked at").unwrap();
    let mut command = case.program();
    command.env("PATH", case.input("")).arg("reconstruct").arg(&video).arg("-o").arg(case.output());
    case.refuses(&command.output().unwrap(), &["film.mp4 is a video", "install ffmpeg"]);
}

/// A film of grey frames of 400×300, the synthetic person's after them if wanted; false where there is no ffmpeg.
fn grey_film(path: &Path, frames: usize, person_follows: bool) -> bool {
    let mut make = Command::new("ffmpeg");
    make.args(["-nostdin", "-loglevel", "error", "-f", "lavfi", "-i"]);
    make.arg(format!("color=gray:s=400x300:r=25:d={}", frames / 25));
    if person_follows {
        make.arg("-i").arg(clip().join("frames/frame_%02d.jpg"));
        make.args(["-filter_complex", "[0]setsar=1,format=yuv420p[a];[1]setsar=1,format=yuv420p[b];[a][b]concat"]);
    }
    let Ok(made) = make.args(["-c:v", "mpeg4", "-q:v", "2"]).arg(path).status() else { return false };
    assert!(made.success(), "ffmpeg made no film");
    true
}

#[test]
fn a_long_video_without_a_face_is_refused_before_anything_of_it_is_kept() {
    let case = Case::new();
    let video = case.input("film.mp4");
    if !grey_film(&video, 1300, false) {
        println!("skipped: there is no ffmpeg here");
        return;
    }
    for name in ["reconstruct", "track", "faces"] {
        let mut command = case.program();
        // A frame that was kept would find no place.
        command.env("TMPDIR", case.input("nowhere")).arg(name).arg(&video).arg("-o").arg(case.output());
        case.refuses(&command.output().unwrap(), &["no face was found in any of the 1300 frames"]);
    }
}

#[test]
fn a_face_at_the_very_end_of_a_long_video_is_found() {
    let case = Case::new();
    let video = case.input("film.mp4");
    if !grey_film(&video, 1000, true) {
        println!("skipped: there is no ffmpeg here");
        return;
    }
    let mut command = case.program();
    let said = command.arg("faces").arg(&video).arg("-o").arg(case.output()).output().unwrap();
    let text = String::from_utf8_lossy(&said.stdout);
    assert!(said.status.success() && text.contains("1021 frames in all"), "{said:?}");
}

#[test]
fn options_out_of_range() {
    let case = Case::new();
    let frames = [frame(0), frame(20)];
    case.refuses(&case.reconstruct(&frames, &["--interocular-mm", "630"]), &["40 to 90 mm"]);
    let mut command = case.program();
    command.arg("reconstruct").args(&frames).args(["--texture-size", "7", "-o"]).arg(case.output());
    case.refuses(&command.output().unwrap(), &["64 to 8192 pixels"]);
}

#[test]
fn wrong_usage_exits_with_2() {
    let case = Case::new();
    for arguments in [&["reconstruct"][..], &["calibrate", "x.png", "--inner", "9by6"], &["nonsense"]] {
        let output = case.program().args(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty() && !output.stderr.is_empty());
    }
}
