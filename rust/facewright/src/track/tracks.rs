//! `tracks.json`: the same points of a face in many frames.

use crate::{FacewrightError, FrameSet, Method, SourcedCamera};
use geometry::{Transform, Vec2};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What part of the face a point belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Region {
    /// Skin that follows the skull, as far as skin does.
    Skin,
    /// The lips and what touches them.
    Mouth,
    /// The lids.
    Eyes,
    /// The brows.
    Brows,
}

/// A place of the face in one frame; in files `[frame, u, v, sigma]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(usize, f64, f64, f64)", into = "(usize, f64, f64, f64)")]
pub struct PointObservation {
    /// Index of the frame.
    pub frame: usize,
    /// Where it is in the picture as filmed: x right, y down, pixel centres at integers.
    pub pixel: Vec2,
    /// One standard deviation along each axis, pixels.
    pub sigma_px: f64,
}

impl From<(usize, f64, f64, f64)> for PointObservation {
    fn from((frame, u, v, sigma_px): (usize, f64, f64, f64)) -> Self {
        Self { frame, pixel: Vec2::new(u, v), sigma_px }
    }
}

impl From<PointObservation> for (usize, f64, f64, f64) {
    fn from(seen: PointObservation) -> Self {
        (seen.frame, seen.pixel.x, seen.pixel.y, seen.sigma_px)
    }
}

/// Frames in which a point was not found; in files `[first, last, reason]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "(usize, usize, String)", into = "(usize, usize, String)")]
pub struct PointGap {
    /// Index of the first one.
    pub first: usize,
    /// Index of the last one.
    pub last: usize,
    /// Why.
    pub reason: String,
}

impl From<(usize, usize, String)> for PointGap {
    fn from((first, last, reason): (usize, usize, String)) -> Self {
        Self { first, last, reason }
    }
}

impl From<PointGap> for (usize, usize, String) {
    fn from(gap: PointGap) -> Self {
        (gap.first, gap.last, gap.reason)
    }
}

/// One point of the face.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointTrack {
    /// Its number, unique among the tracks.
    pub id: usize,
    /// Index of the frame in which it was chosen.
    pub reference: usize,
    /// What it belongs to.
    pub region: Region,
    /// Where it is on the landmarks' head at rest, head frame, metres; the artist's own points have no place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<[f64; 3]>,
    /// Where it was found; ascending frames, the reference among them.
    pub observations: Vec<PointObservation>,
    /// The frames in which it was not found, and why.
    pub gaps: Vec<PointGap>,
}

/// One frame of the sequence.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameTracks {
    /// File name without extension.
    pub name: String,
    /// Whether points were found in it.
    pub used: bool,
    /// What it shows, or why nothing was found.
    pub reason: String,
    /// Pose of the head by its landmarks; `null` where no face was found.
    pub cam_from_head: Option<Transform>,
    /// Points found.
    pub points: usize,
}

/// `tracks.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tracks {
    /// Version of Facewright.
    pub version: String,
    /// How they were tracked.
    pub method: Method,
    /// The camera; its focal length is the landmarks' estimate unless it was calibrated.
    pub camera: SourcedCamera,
    /// Distance between the pupils of the landmarks' head, whose poses the frames have, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interocular: Option<f64>,
    /// Side of the tracker's window in the first reference frame, pixels.
    pub window: usize,
    /// Every frame given.
    pub frames: Vec<FrameTracks>,
    /// The points.
    pub tracks: Vec<PointTrack>,
    /// What the artist should know.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
}

impl Tracks {
    /// Reads a `tracks.json`.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        let read = |e: std::io::Error| FacewrightError::Read { path: path.to_owned(), reason: e.to_string() };
        Self::parse(&std::fs::read_to_string(path).map_err(read)?)
    }

    /// Reads the text of a `tracks.json`.
    ///
    /// # Errors
    /// [`FacewrightError::Tracks`] where it is none, or names frames that it does not list.
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        let refused = |reason: String| FacewrightError::Tracks { reason };
        let tracks: Self = serde_json::from_str(text).map_err(|e| refused(e.to_string()))?;
        let count = tracks.frames.len();
        for track in &tracks.tracks {
            let frames = || track.observations.iter().map(|o| o.frame);
            let listed = frames().chain([track.reference]).all(|frame| frame < count);
            let ascending = frames().zip(frames().skip(1)).all(|(a, b)| a < b);
            let numbers = track.observations.iter().all(|o| o.pixel.iter().all(|x| x.is_finite()) && o.sigma_px > 0.0);
            if !(listed && ascending && numbers) {
                let reason = format!("point {} has frames that are not listed, or numbers that are none", track.id);
                return Err(refused(reason));
            }
        }
        Ok(tracks)
    }

    /// Refuses the tracks of other frames.
    pub(crate) fn check(&self, frames: &FrameSet) -> Result<(), FacewrightError> {
        let (camera, names) = (&self.camera.camera, self.frames.iter().map(|frame| &frame.name));
        frames.is_clip_of(names, (camera.width, camera.height)).map_err(|reason| FacewrightError::Tracks { reason })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CameraSource;
    use geometry::Camera;

    fn tracks(observations: &[(usize, f64, f64, f64)]) -> Tracks {
        let frame = |name: &str| FrameTracks {
            name: name.to_owned(),
            used: true,
            reason: String::new(),
            cam_from_head: None,
            points: 1,
        };
        Tracks {
            version: String::new(),
            method: Method::Default,
            camera: SourcedCamera { camera: Camera::centred(64, 48, 60.0), source: CameraSource::Board },
            interocular: None,
            window: 11,
            frames: vec![frame("a"), frame("b")],
            tracks: vec![PointTrack {
                id: 7,
                reference: 0,
                region: Region::Mouth,
                place: None,
                observations: observations.iter().copied().map(PointObservation::from).collect(),
                gaps: vec![PointGap { first: 1, last: 1, reason: "no face".to_owned() }],
            }],
            warnings: Vec::new(),
        }
    }

    fn read(tracks: &Tracks) -> Result<Tracks, FacewrightError> {
        Tracks::parse(&serde_json::to_string(tracks).unwrap())
    }

    #[test]
    fn what_was_written_is_read_again() {
        let written = tracks(&[(0, 3.25, 4.5, 0.1)]);
        let text = serde_json::to_string(&written).unwrap();
        assert!(text.contains(r#""observations":[[0,3.25,4.5,0.1]],"gaps":[[1,1,"no face"]]"#), "{text}");
        assert_eq!(read(&written).unwrap(), written);
    }

    #[test]
    fn broken_tracks_are_refused_in_words() {
        assert!(Tracks::parse("{").unwrap_err().to_string().starts_with("these are no tracks"));
        let broken: [&[(usize, f64, f64, f64)]; 3] =
            [&[(2, 1.0, 1.0, 0.1)], &[(1, 1.0, 1.0, 0.1), (0, 1.0, 1.0, 0.1)], &[(0, 1.0, 1.0, 0.0)]];
        for observations in broken {
            assert!(read(&tracks(observations)).unwrap_err().to_string().contains("point 7"));
        }
    }

    #[test]
    fn tracks_of_another_clip_are_refused() {
        let none = FrameSet::of(Vec::new(), 64, 48);
        assert!(tracks(&[]).check(&none).unwrap_err().to_string().contains("the clip has 0"));
    }
}
