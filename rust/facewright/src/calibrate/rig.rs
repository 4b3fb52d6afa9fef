//! Several cameras that saw one board at the same moments.

use super::detection::{Detection, detect_all};
use super::{BoardImage, CalibrateOptions, CalibratedCamera, PARTS, fill, images, view};
use crate::formats;
use crate::{CameraSource, FacewrightError, FrameSet, Schema, SourcedCamera};
use geometry::Progress;
use motion::calibrate::rig::{BoardSymmetry, Mount, Rig, RigCamera, RigWarning, calibrate_rig as solve};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Why a picture was found and not used.
const ELSEWHERE: &str = "it shows the board in a different place than the others do, as if taken at another moment";

/// Why there is no picture of a moment.
const NO_PICTURE: &str = "no picture of this moment";

/// One camera's pictures.
#[derive(Debug)]
pub struct RigInput {
    /// What to call the camera.
    pub name: String,
    /// Its pictures. Those of one moment have the same number at the end of their names in all cameras; without numbers, or
    /// where they do not agree, the k-th pictures belong together.
    pub pictures: FrameSet,
}

/// A camera of a rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MountedCamera {
    /// Its name.
    pub name: String,
    /// All of `camera.json`.
    #[serde(flatten)]
    pub calibrated: CalibratedCamera,
    /// Where it stands.
    #[serde(flatten)]
    pub mount: Mount,
}

/// `rig.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CalibratedRig {
    /// Version of the file's fields.
    #[serde(default)]
    pub schema: Schema,
    /// The cameras, in the order given.
    pub cameras: Vec<MountedCamera>,
    /// Root mean square reprojection error of all corners, pixels.
    pub rms_px: f64,
    /// The same with each moment left out of the calibration it is held against.
    pub hold_out_rms_px: Option<f64>,
    /// What to photograph next, and what to distrust.
    #[serde(default)]
    pub warnings: Vec<String>,
}

impl CalibratedRig {
    /// Reads a `rig.json`.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, or what it says cannot be.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        formats::read(path)
    }

    /// Reads the text of a `rig.json`; errors as those of [`CalibratedRig::read`].
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        formats::parse(text)
    }

    /// Writes a `rig.json`, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), FacewrightError> {
        formats::write(path, self)
    }

    /// One of its cameras by its name.
    ///
    /// # Errors
    /// [`FacewrightError::RigCamera`] where it has none of that name.
    pub fn camera(&self, name: &str) -> Result<&MountedCamera, FacewrightError> {
        let known = || self.cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ");
        let found = self.cameras.iter().find(|camera| camera.name == name);
        found.ok_or_else(|| FacewrightError::RigCamera { name: name.to_owned(), known: known() })
    }
}

/// Calibrates several cameras and where they stand to each other, from pictures of one board taken at the same moments.
///
/// # Examples
/// ```no_run
/// use facewright::{CalibrateOptions, FrameSet, RigInput, calibrate_rig};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let mut cameras = Vec::new();
/// for name in ["left", "right"] {
///     cameras.push(RigInput { name: name.to_owned(), pictures: FrameSet::open(&[name.into()], &progress)? });
/// }
/// let rig = calibrate_rig(&cameras, &CalibrateOptions::default(), &progress)?;
/// rig.write(Path::new("rig.json"))?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn calibrate_rig(
    cameras: &[RigInput],
    options: &CalibrateOptions,
    progress: &Progress,
) -> Result<CalibratedRig, FacewrightError> {
    options.validate()?;
    let board = options.board.board()?;
    let [looking, solving] = progress.split(&PARTS);
    let parts = looking.split_evenly(cameras.len());
    let look = |(camera, part): (&RigInput, _)| detect_all(&camera.pictures, &[board], part);
    let found: Vec<Vec<Detection>> = cameras.iter().zip(&parts).map(look).collect::<Result<_, _>>()?;
    let moments = moments(cameras)?;
    let at = |camera: usize, moment: &[Option<usize>]| view(&found[camera][moment[camera]?], &[board]);
    let seen = |camera: usize| RigCamera {
        width: cameras[camera].pictures.width,
        height: cameras[camera].pictures.height,
        views: moments.iter().map(|moment| at(camera, moment)).collect(),
    };
    let seen: Vec<RigCamera> = (0..cameras.len()).map(seen).collect();
    // Every order must be certain for the board's symmetry not to matter.
    let oriented = found.iter().flatten().flatten().all(|d| d.oriented);
    let symmetry = if oriented { BoardSymmetry::none() } else { BoardSymmetry::of(&board) };
    solving.stage("calibrate")?;
    let solved = solve(&seen, &symmetry, &options.model())?;
    let warnings = solved.warnings.iter().map(|w| sentence(w, cameras, &moments)).collect();
    let mounted = (0..cameras.len()).map(|k| {
        let images = filled(&cameras[k].pictures, &found[k], &solved, &seen[k], &moments, k);
        mounted(&cameras[k].name, &solved, k, images, options)
    });
    Ok(CalibratedRig {
        schema: Schema,
        cameras: mounted.collect(),
        rms_px: solved.rms_px,
        hold_out_rms_px: solved.hold_out_rms_px,
        warnings,
    })
}

/// A warning, with cameras and pictures by their names.
fn sentence(warning: &RigWarning, cameras: &[RigInput], moments: &[Vec<Option<usize>>]) -> String {
    let camera = |k: usize| cameras[k].name.as_str();
    let picture =
        |k: usize, moment: usize| moments[moment][k].map_or("", |i| cameras[k].pictures.frames[i].name.as_str());
    match warning {
        RigWarning::Camera { camera: k, warning } => {
            format!("camera {}: {}", camera(*k), super::sentence(warning, |moment| picture(*k, moment)))
        }
        RigWarning::LeftOut { camera: k, moment } => {
            format!("picture {} of camera {} was left out: {ELSEWHERE}", picture(*k, *moment), camera(*k),)
        }
        RigWarning::FewMoments { camera: a, other: b, .. } | RigWarning::AmbiguousTurn { camera: a, other: b } => {
            warning.to_string().replacen(
                &format!("cameras {} and {}", a + 1, b + 1),
                &format!("cameras {} and {}", camera(*a), camera(*b)),
                1,
            )
        }
        RigWarning::Rig(warning) => warning.to_string(),
    }
}

/// The pictures of one camera, one for each moment: the k-th pictures of all cameras belong together.
fn filled(
    pictures: &FrameSet,
    found: &[Detection],
    solved: &Rig,
    seen: &RigCamera,
    moments: &[Vec<Option<usize>>],
    camera: usize,
) -> Vec<BoardImage> {
    let all = images(pictures, found);
    let mounted = &solved.cameras[camera];
    let each = moments.iter().zip(&seen.views).zip(&mounted.views);
    each.map(|((moment, view), fit)| {
        let Some(i) = moment[camera] else {
            return BoardImage { reason: Some(NO_PICTURE.to_owned()), ..BoardImage::default() };
        };
        let mut image = all[i].clone();
        match (view, fit) {
            (Some(_), Some(fit)) => fill(&mut image, &found[i], fit),
            (Some(_), None) => image.reason = Some(ELSEWHERE.to_owned()),
            _ => {}
        }
        image
    })
    .collect()
}

fn mounted(name: &str, solved: &Rig, k: usize, images: Vec<BoardImage>, options: &CalibrateOptions) -> MountedCamera {
    let camera = &solved.cameras[k];
    let calibrated = CalibratedCamera {
        schema: Schema,
        camera: SourcedCamera { camera: camera.camera, source: CameraSource::Board },
        rms_px: camera.rms_px,
        hold_out_rms_px: hold_out(&images),
        deviations: camera.deviations,
        bend: solved.bend,
        boards: options.board.boards(),
        images,
        warnings: Vec::new(),
    };
    MountedCamera { name: name.to_owned(), calibrated, mount: camera.mount }
}

/// Root mean square of all corners of pictures with these; `None` if one is missing.
fn hold_out(images: &[BoardImage]) -> Option<f64> {
    let used = images.iter().filter(|image| image.used);
    let (mut squares, mut corners) = (0.0, 0.0);
    for image in used {
        let count = image.corners.len() as f64;
        squares += image.hold_out_rms_px?.powi(2) * count;
        corners += count;
    }
    (corners > 0.0).then(|| (squares / corners).sqrt())
}

/// Each camera's picture of each moment: by the numbers at the end of their names where these tell, else by order.
fn moments(cameras: &[RigInput]) -> Result<Vec<Vec<Option<usize>>>, FacewrightError> {
    if let Some(numbered) = by_number(cameras) {
        return Ok(numbered);
    }
    let counts: Vec<usize> = cameras.iter().map(|c| c.pictures.len()).collect();
    if counts.iter().any(|&c| c != counts[0]) {
        let counts = cameras.iter().map(|c| format!("{} of {}", c.pictures.len(), c.name)).collect::<Vec<_>>();
        return Err(FacewrightError::RigPictures { counts: counts.join(", ") });
    }
    Ok((0..counts[0]).map(|k| vec![Some(k); cameras.len()]).collect())
}

/// `None` where a name has no number or one twice, or where too few moments have more than one camera.
fn by_number(cameras: &[RigInput]) -> Option<Vec<Vec<Option<usize>>>> {
    let mut all: BTreeMap<u64, Vec<Option<usize>>> = BTreeMap::new();
    for (k, camera) in cameras.iter().enumerate() {
        for (i, frame) in camera.pictures.frames.iter().enumerate() {
            let digits = frame.name.len() - frame.name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
            let number = frame.name[frame.name.len() - digits..].parse().ok()?;
            let moment = all.entry(number).or_insert_with(|| vec![None; cameras.len()]);
            if moment[k].replace(i).is_some() {
                return None;
            }
        }
    }
    let shared = all.values().filter(|moment| moment.iter().flatten().count() > 1).count();
    (2 * shared >= all.len()).then(|| all.into_values().collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Frame;

    fn camera(names: &[&str]) -> RigInput {
        let frames = names.iter().map(|n| Frame::file(n, n)).collect();
        RigInput { name: names[0].to_owned(), pictures: FrameSet::of(frames, 640, 480) }
    }

    #[test]
    fn pictures_belong_together_by_their_numbers() {
        let found = moments(&[camera(&["left01", "left02", "left04"]), camera(&["R_002", "R_001", "R_003"])]).unwrap();
        assert_eq!(found, [[Some(0), Some(1)], [Some(1), Some(0)], [None, Some(2)], [Some(2), None]]);
    }

    #[test]
    fn without_numbers_they_belong_together_by_order() {
        let found = moments(&[camera(&["a", "b"]), camera(&["c", "d"])]).unwrap();
        assert_eq!(found, [[Some(0), Some(0)], [Some(1), Some(1)]]);
        let error = moments(&[camera(&["a", "b"]), camera(&["c"])]).unwrap_err();
        assert!(error.to_string().contains("2 of a, 1 of c"), "{error}");
    }
}
