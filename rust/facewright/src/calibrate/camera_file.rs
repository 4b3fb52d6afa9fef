//! `camera.json`: what a calibration leaves, or a camera's numbers alone.

use super::CalibratedCamera;
use super::other_cameras;
use crate::camera::check_lens;
use crate::files::write_json;
use crate::formats::{Format, from_value, text_of, too_new, unreadable, without_mark};
use crate::{CameraSource, FacewrightError, SourcedCamera};
use serde::Serialize;
use serde_json::Value;
use std::path::Path;

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
    /// Reads a `camera.json`; other files that hold a camera as `camera` will do, and those that OpenCV, ROS and Kalibr write of a
    /// pinhole camera.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, [`FacewrightError::Camera`] where its numbers are impossible.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        Self::content(&text_of(path)?, path)
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
        check_lens(&file.sourced().camera)?;
        file.calibration().map_or(Ok(()), Format::validate).map_err(refused)?;
        Ok(file)
    }

    fn of(text: &str) -> Result<Self, String> {
        let text = without_mark(text);
        if let Some(camera) = other_cameras::read(text) {
            return Ok(Self::Numbers(SourcedCamera { camera: camera?, source: CameraSource::Board }));
        }
        if !text.trim_start().starts_with(['{', '[']) {
            return Err("it is neither a camera.json nor a calibration that OpenCV, ROS or Kalibr wrote".to_owned());
        }
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
            ("pinhole:\n  fx: 700", "neither a camera.json nor a calibration that OpenCV, ROS or Kalibr wrote"),
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
