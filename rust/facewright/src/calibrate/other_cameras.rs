//! Cameras in the files of other programs: OpenCV's and ROS's `camera_matrix`, Kalibr's `cam0`.
//!
//! These are YAML of a few known keys, OpenCV's with a head and tags that YAML's readers refuse; so the numbers after a key are read, and
//! nothing else.

use geometry::Camera;

/// The camera of such a text, or what is wrong with it; `None` for a text of another kind.
pub(super) fn read(text: &str) -> Option<Result<Camera, String>> {
    let is = |key: &str| after(text, key).is_some();
    if text.trim_start().starts_with('{') {
        return None;
    }
    if text.trim_start().starts_with("<?xml") && text.contains("opencv_storage") {
        return Some(Err("it is OpenCV's calibration as XML: save it as .yml, which is read here".to_owned()));
    }
    if is("camera_matrix") || is("cameraMatrix") {
        return Some(opencv(text));
    }
    if is("cam0") || (is("camera_model") && is("intrinsics")) {
        return Some(kalibr(text));
    }
    None
}

fn opencv(text: &str) -> Result<Camera, String> {
    let [width, height] = ["width", "height"].map(|side| {
        let number = ["image_", "image", ""].iter().find_map(|before| numbers(text, &format!("{before}{side}")));
        number.and_then(|n| n.first().copied()).ok_or_else(|| {
            format!("it is OpenCV's calibration without image_{side}: add the {side} of the pictures in pixels, as image_{side}")
        })
    });
    let matrix = ["camera_matrix", "cameraMatrix"].iter().find_map(|key| numbers(text, key));
    let Some([fx, skew, cx, _, fy, cy, ..]) = matrix.as_deref() else {
        return Err("its camera_matrix has not 9 numbers".to_owned());
    };
    if *skew != 0.0 {
        return Err("its camera_matrix has a skew, which is not read here: calibrate without it".to_owned());
    }
    if ["equidistant", "fisheye"].iter().any(|model| after(text, "distortion_model").is_some_and(|m| m.contains(model)))
    {
        return Err(other_lens("a fisheye lens"));
    }
    let lens = ["distortion_coefficients", "distCoeffs", "dist_coeffs", "dist_coeff"]
        .iter()
        .find_map(|key| numbers(text, key));
    camera([width?, height?], [*fx, *fy, *cx, *cy], &lens.unwrap_or_default())
}

fn kalibr(text: &str) -> Result<Camera, String> {
    if after(text, "cam1").is_some() {
        return Err("it is Kalibr's calibration of several cameras: leave only one of them in it".to_owned());
    }
    let word = |key: &str| after(text, key).and_then(|rest| rest.lines().next()).unwrap_or_default().trim();
    if word("camera_model") != "pinhole" || !matches!(word("distortion_model"), "radtan" | "none") {
        return Err(other_lens(&format!("{} {}", word("camera_model"), word("distortion_model"))));
    }
    let missing = |key: &str| format!("it is Kalibr's calibration, and its {key} is missing");
    let Some([fx, fy, cx, cy]) = numbers(text, "intrinsics").as_deref().and_then(<[f64]>::first_chunk::<4>).copied()
    else {
        return Err(missing("intrinsics"));
    };
    let Some([width, height]) = numbers(text, "resolution").as_deref().and_then(<[f64]>::first_chunk::<2>).copied()
    else {
        return Err(missing("resolution"));
    };
    camera([width, height], [fx, fy, cx, cy], &numbers(text, "distortion_coeffs").unwrap_or_default())
}

fn other_lens(model: &str) -> String {
    format!(
        "its lens is of another model ({model}) than the radial and tangential one that is read here: calibrate with that one"
    )
}

fn camera([width, height]: [f64; 2], [fx, fy, cx, cy]: [f64; 4], lens: &[f64]) -> Result<Camera, String> {
    if lens.iter().skip(5).any(|more| *more != 0.0) {
        return Err(other_lens(&format!("{} coefficients", lens.len())));
    }
    let [k1, k2, p1, p2, k3] = [0, 1, 2, 3, 4].map(|i| lens.get(i).copied().unwrap_or(0.0));
    // The casts saturate; a side of no pixels is refused where the numbers are checked.
    Ok(Camera { width: width as u32, height: height as u32, fx, fy, cx, cy, k1, k2, k3, p1, p2 })
}

/// What follows a key that begins a line.
fn after<'t>(text: &'t str, key: &str) -> Option<&'t str> {
    let is_key = |at: usize| {
        let line = text[..at].rsplit('\n').next().unwrap_or_default();
        line.chars().all(|c| c.is_whitespace() || c == '-')
    };
    let mut found = text.match_indices(key).filter(|(at, _)| is_key(*at));
    found.find_map(|(at, _)| text[at + key.len()..].trim_start_matches(' ').strip_prefix(':'))
}

/// The numbers after a key: the only one, those of a list, or those of a matrix's `data`.
fn numbers(text: &str, key: &str) -> Option<Vec<f64>> {
    let rest = after(text, key)?;
    let line = rest.lines().next().unwrap_or_default().trim();
    if let Ok(number) = line.parse() {
        return Some(vec![number]);
    }
    let inside = if line.starts_with('[') { rest } else { after(rest, "data")? };
    let (list, _) = inside.trim_start().strip_prefix('[')?.split_once(']')?;
    // OpenCV writes `1.` and `.5`, which are numbers to Rust as well.
    list.split(',').map(|number| number.trim().parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPENCV: &str = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\nboard_width: 9\ncamera_matrix: !!opencv-matrix\n   \
        rows: 3\n   cols: 3\n   dt: d\n   data: [ 6.5e+02, 0., 319.5, 0., 6.4e+02,\n       239.5, 0., 0., 1. ]\n\
        distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ -2.0e-01, 5.0e-02, 1.0e-03, -2.0e-03, .01 ]\n";
    const KALIBR: &str = "cam0:\n  cam_overlaps: []\n  camera_model: pinhole\n  distortion_coeffs: [-0.2, 0.05, 0.001, -0.002]\n  \
        distortion_model: radtan\n  intrinsics: [650.0, 640.0, 319.5, 239.5]\n  resolution: [640, 480]\n  rostopic: /cam0/image_raw\n";

    fn refused(text: &str) -> String {
        read(text).unwrap().unwrap_err()
    }

    #[test]
    fn opencvs_roses_and_kalibrs_cameras_are_read() {
        let base = Camera {
            fx: 650.0,
            fy: 640.0,
            k1: -0.2,
            k2: 0.05,
            p1: 0.001,
            p2: -0.002,
            ..Camera::centred(640, 480, 1.0)
        };
        assert_eq!(read(OPENCV), Some(Ok(Camera { k3: 0.01, ..base })));
        assert_eq!(read(KALIBR), Some(Ok(base)));
        let ros = "image_width: 640\nimage_height: 480\ncamera_name: a\ncamera_matrix:\n  rows: 3\n  cols: 3\n  \
            data: [650.0, 0.0, 319.5, 0.0, 640.0, 239.5, 0.0, 0.0, 1.0]\ndistortion_model: plumb_bob\n\
            distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.2, 0.05, 0.001, -0.002, 0.0]\n";
        assert_eq!(read(ros), Some(Ok(base)));
    }

    #[test]
    fn what_these_files_lack_or_what_lens_they_hold_is_said() {
        assert!(refused(&OPENCV.replace("image_width", "width_of")).contains("add the width"));
        assert!(refused(&OPENCV.replace(".01 ]", ".01, 0.3, 0., 0. ]")).contains("another model (8 coefficients)"));
        assert!(refused(&OPENCV.replace("02, 0.,", "02, 0.5,")).contains("skew"));
        assert!(refused(&KALIBR.replace("radtan", "equidistant")).contains("pinhole equidistant"));
        assert!(refused(&format!("{KALIBR}cam1:\n  camera_model: pinhole\n")).contains("several cameras"));
        assert!(refused(&KALIBR.replace("resolution", "size")).contains("its resolution is missing"));
        assert!(refused("<?xml version=\"1.0\"?>\n<opencv_storage>").contains("save it as .yml"));
        assert_eq!(read("{\"camera_matrix\": 3}"), None);
        assert_eq!(read("not a camera"), None);
    }
}
