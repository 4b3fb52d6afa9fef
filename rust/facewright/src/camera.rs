//! A camera and where its numbers come from; the one to start with: calibrated, from EXIF, or guessed.

use crate::files::write_json;
use crate::formats::{Format, from_value, too_new, unreadable};
use crate::{CalibratedCamera, FacewrightError, FrameSet};
use geometry::Camera;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::Path;

/// Where the camera's numbers come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum CameraSource {
    /// Calibrated with a board.
    Board,
    /// Focal length from EXIF, refined.
    Exif,
    /// Focal length guessed from the usual field of view, refined: the head's depth is uncertain with it.
    Estimated,
}

/// The camera and where it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SourcedCamera {
    /// The numbers.
    #[serde(flatten)]
    pub camera: Camera,
    /// Their origin.
    #[serde(default = "board")]
    pub source: CameraSource,
}

fn board() -> CameraSource {
    CameraSource::Board
}

impl SourcedCamera {
    /// Reads a `camera.json`, or another file that holds a camera.
    ///
    /// # Errors
    /// As those of [`CameraFile::read`].
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        Ok(CameraFile::read(path)?.sourced())
    }

    /// Reads the text of a `camera.json`: the camera itself, or an object that holds it as `camera`.
    ///
    /// # Errors
    /// As those of [`CameraFile::read`].
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        Ok(CameraFile::parse(text)?.sourced())
    }
}

/// What a `camera.json` holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum CameraFile {
    /// A camera with the pictures of a board that it was calibrated from.
    Calibrated(Box<CalibratedCamera>),
    /// Its numbers alone: typed in, or of another command's file.
    Numbers(SourcedCamera),
}

impl CameraFile {
    /// Reads a `camera.json`; other files that hold a camera as `camera` will do.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, [`FacewrightError::Camera`] where its numbers are impossible.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        let text = std::fs::read_to_string(path).map_err(|e| unreadable(path, e.to_string()))?;
        Self::content(&text, path)
    }

    /// Reads the text of a `camera.json`; errors as those of [`CameraFile::read`].
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        Self::content(text, Path::new("camera.json"))
    }

    /// Writes a `camera.json`, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), FacewrightError> {
        write_json(path, self)
    }

    /// The camera and where it comes from.
    pub fn sourced(&self) -> SourcedCamera {
        match self {
            Self::Calibrated(calibrated) => calibrated.camera,
            Self::Numbers(camera) => *camera,
        }
    }

    /// How it was calibrated, if it tells.
    pub fn calibration(&self) -> Option<&CalibratedCamera> {
        match self {
            Self::Calibrated(calibrated) => Some(calibrated),
            Self::Numbers(_) => None,
        }
    }

    fn content(text: &str, path: &Path) -> Result<Self, FacewrightError> {
        let refused = |reason: String| unreadable(path, reason);
        let file = Self::of(text).map_err(refused)?;
        file.sourced().camera.validate()?;
        file.calibration().map_or(Ok(()), Format::validate).map_err(refused)?;
        Ok(file)
    }

    fn of(text: &str) -> Result<Self, String> {
        let mut whole: Value = serde_json::from_str(text).map_err(|e| format!("it is not JSON: {e}"))?;
        if let Some(sentence) = too_new(&whole) {
            return Err(sentence);
        }
        if whole.get("cameras").is_some() {
            return Err("it holds a rig of several cameras: choose one of them".to_owned());
        }
        if let Some(inside) = whole.get_mut("camera").filter(|inside| inside.is_object()) {
            whole = inside.take();
        }
        if !whole.is_object() {
            return Err("it holds no camera".to_owned());
        }
        let tells = ["images", "rms_px"].iter().any(|key| whole.get(key).is_some());
        if tells {
            from_value(whole).map(|c| Self::Calibrated(Box::new(c)))
        } else {
            from_value(whole).map(Self::Numbers)
        }
    }
}

/// Focal length of webcams and phones filming video, in picture widths: 62° across, give or take.
const USUAL_FOCAL: f64 = 0.85;

/// The camera of a clip: the calibrated one if it fits the frames, otherwise EXIF's focal length or the usual one.
pub fn starting_camera(
    frames: &FrameSet,
    calibrated: Option<&SourcedCamera>,
) -> Result<SourcedCamera, FacewrightError> {
    let (width, height) = (frames.width, frames.height);
    if let Some(known) = calibrated {
        known.camera.validate()?;
        let (camera_width, camera_height) = (known.camera.width, known.camera.height);
        if (camera_width, camera_height) != (width, height) {
            return Err(FacewrightError::OtherCamera { camera_width, camera_height, width, height });
        }
        return Ok(*known);
    }
    let (focal, source) = match frames.exif_focal {
        Some(focal) => (focal, CameraSource::Exif),
        None => (USUAL_FOCAL * f64::from(width.max(height)), CameraSource::Estimated),
    };
    Ok(SourcedCamera { camera: Camera::centred(width, height, focal), source })
}

impl CameraSource {
    /// Relative standard deviation of a focal length from this source; 0 for one that is not to be refined.
    pub fn focal_sigma(self) -> f64 {
        match self {
            Self::Board => 0.0,
            Self::Exif => 0.05,
            Self::Estimated => 0.15,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NUMBERS: &str = r#""width": 640, "height": 480, "fx": 700, "fy": 710, "cx": 319.5, "cy": 239.5"#;

    fn refused(text: &str) -> String {
        CameraFile::parse(text).unwrap_err().to_string()
    }

    #[test]
    fn a_camera_is_read_alone_and_from_another_file() {
        let alone = CameraFile::parse(&format!("{{{NUMBERS}}}")).unwrap();
        assert_eq!((alone.sourced().camera.fy, alone.sourced().source), (710.0, CameraSource::Board));
        let inside = CameraFile::parse(&format!(r#"{{"schema": 1, "camera": {{{NUMBERS}}}, "frames": []}}"#)).unwrap();
        assert_eq!(inside, alone);
        assert!(alone.calibration().is_none());
    }

    #[test]
    fn a_calibration_is_read_with_its_pictures() {
        let image = r#"{"name": "a", "found": true, "used": false}"#;
        let text = format!(r#"{{{NUMBERS}, "rms_px": 0.1, "images": [{image}]}}"#);
        let file = CameraFile::parse(&text).unwrap();
        assert_eq!(file.calibration().unwrap().images[0].name, "a");
        let again = serde_json::to_string(&file).unwrap();
        assert!(again.starts_with(r#"{"schema":1,"width":640"#), "{again}");
        assert_eq!(CameraFile::parse(&again).unwrap(), file);
        assert!(refused(&text.replace(r#""found": true, "#, "")).contains("picture a has no found"));
        let board = text.replace(r#""used""#, r#""board": 0, "used""#);
        assert!(refused(&board).contains("picture a shows board 0, and there are 0"), "{}", refused(&board));
    }

    #[test]
    fn what_is_no_camera_gets_a_sentence() {
        for (text, sentence) in [
            ("{", "it is not JSON"),
            ("[]", "it holds no camera"),
            (r#"{"cameras": []}"#, "a rig of several cameras"),
            (r#"{"width": 3}"#, "it has no height"),
            (r#"{"schema": 7, "width": 3}"#, "a newer Facewright wrote it (schema 7"),
        ] {
            assert!(refused(text).contains(sentence), "{}", refused(text));
        }
        let impossible = format!("{{{}}}", NUMBERS.replace("700", "-1"));
        assert!(matches!(CameraFile::parse(&impossible), Err(FacewrightError::Camera(_))));
    }
}
