//! The report of a reconstruction: what `report.json` holds.

use super::Quality;
use crate::formats::{self, Format, Schema, at_least_0, finite, null_is_default, once};
use crate::reason::{brief, counts, known_kind};
use crate::{CameraSource, FacewrightError, Method, ReasonKind, SourcedCamera};
use geometry::{Camera, Transform};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// What became of one frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameReport {
    /// File name without extension.
    pub name: String,
    /// Whether shape and texture were taken from it.
    pub used: bool,
    /// Why, or why not.
    #[serde(default, deserialize_with = "null_is_default")]
    pub reason: String,
    /// The same as a word; `None` in older files, and where a newer one has a word that this version does not know.
    #[serde(default, deserialize_with = "known_kind", skip_serializing_if = "Option::is_none")]
    pub reason_kind: Option<ReasonKind>,
    /// Head pose; `null` where no face was found.
    pub cam_from_head: Option<Transform>,
    /// Root mean square distance of its observations from the model, pixels.
    pub reprojection_rms_px: Option<f64>,
}

/// A camera of a rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ReportCamera {
    /// Its name.
    pub name: String,
    /// The camera as it filmed.
    pub camera: Camera,
}

/// The size of the head and what it rests on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scale {
    /// What fixed the size.
    pub source: String,
    /// Metres per unit of the files written: 1.
    pub metres_per_unit: f64,
    /// Relative standard deviation of the size; 0 in reports that do not say.
    #[serde(default)]
    pub relative_sigma: f64,
    /// Whether it was measured on this head, by lengths or the places of cameras, instead of taken from what is usual.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub measured: bool,
}

/// Spread of people's heads around the usual one, by pupils and irises.
const USUAL_SIGMA: f64 = 0.04;
/// What a pair of pupils can be measured to, metres.
const PUPILS_SIGMA_M: f64 = 0.001;

impl Scale {
    /// Metres, by what is said in `source`.
    pub(crate) fn metric(source: String, relative_sigma: f64) -> Self {
        Self { source, metres_per_unit: 1.0, relative_sigma, measured: false }
    }

    /// The same, measured on this head.
    pub(crate) fn measured(source: String, relative_sigma: f64) -> Self {
        Self { measured: true, ..Self::metric(source, relative_sigma) }
    }

    /// By the eyes: their average distance and size, or the interpupillary distance, metres, where it was measured.
    pub(crate) fn of_eyes(interocular: Option<f64>) -> Self {
        match interocular {
            Some(metres) => {
                let source = format!("interpupillary distance, given as {:.1} mm", 1000.0 * metres);
                Self::metric(source, PUPILS_SIGMA_M / metres)
            }
            None => Self::metric("average interpupillary distance and iris diameter".to_owned(), USUAL_SIGMA),
        }
    }
}

/// How well the head fits what was seen.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct FitReport {
    /// Components of the face class that were used.
    pub components: usize,
    /// Root mean square of the class's coefficients, in its standard deviations: above 2, the face is unusual for it.
    pub coefficient_rms: f64,
    /// Part of the points' observations that one motion of the head explains, 0…1.
    pub rigid_agreement: f64,
    /// Median distance of the measured points from the head's surface, millimetres.
    pub points_median_mm: f64,
    /// Median distance of the landmarks from their anchors, pixels.
    pub landmarks_median_px: f64,
    /// Distance between the eyeballs' centres, millimetres.
    pub interocular_mm: f64,
}

/// How the texture was made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TextureReport {
    /// Width and height, pixels.
    pub size: u32,
    /// Part of the skin's texels that some frame saw, 0…1.
    pub seen: f64,
    /// The light of the room as the frames showed it; `overlay` lights the head with it.
    pub shading: Option<texture::Shading>,
    /// Gain of each used frame, red, green, blue.
    pub gains: BTreeMap<String, [f64; 3]>,
}

/// How the skin was measured densely.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct DenseReport {
    /// Places on the skin that were measured …
    pub measured: usize,
    /// … of so many on the face.
    pub places: usize,
    /// Median standard deviation of the vertices that were measured, millimetres.
    pub sigma_mm: Option<f64>,
    /// Median way that they went along their normals, millimetres.
    pub moved_mm: Option<f64>,
    /// Heights in `displacement.png` from black to white, metres; middle grey is no height. `None` where there is no such file.
    pub displacement_m: Option<f64>,
    /// Why the skin was left as its points give it; `None` where it was not.
    pub untouched: Option<String>,
}

/// `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Version of the file's fields.
    #[serde(default)]
    pub schema: Schema,
    /// Version of Facewright.
    pub version: String,
    /// Chain of steps.
    pub method: Method,
    /// The camera. With a rig, that of all its cameras' frames without distortion.
    pub camera: SourcedCamera,
    /// The cameras of a rig; empty for a single camera.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rig: Vec<ReportCamera>,
    /// Every frame given; with a rig `left_0012` for frame `0012` of camera `left`.
    pub frames: Vec<FrameReport>,
    /// Number of measured 3D points.
    pub points: usize,
    /// iBUG landmarks on the result, head frame, metres.
    pub landmarks68: Vec<[f64; 3]>,
    /// Size.
    pub scale: Scale,
    /// Fit.
    #[serde(default)]
    pub fit: FitReport,
    /// The dense surface; `None` where it was not asked for, and in older files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dense: Option<DenseReport>,
    /// Texture.
    #[serde(default)]
    pub texture: TextureReport,
    /// How good it is; `None` in older files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<Quality>,
    /// Seconds per stage.
    #[serde(default)]
    pub timings_s: BTreeMap<String, f64>,
    /// What the artist should know.
    #[serde(default)]
    pub warnings: Vec<String>,
}

impl Report {
    /// The report of a head that nothing was measured of.
    pub(crate) fn empty() -> Self {
        Self {
            schema: Schema,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            method: Method::Default,
            camera: SourcedCamera { camera: Camera::centred(1, 1, 1.0), source: CameraSource::Estimated },
            rig: Vec::new(),
            frames: Vec::new(),
            points: 0,
            landmarks68: Vec::new(),
            scale: Scale::metric("generic head".to_owned(), 0.0),
            fit: FitReport::default(),
            dense: None,
            texture: TextureReport::default(),
            quality: None,
            timings_s: BTreeMap::new(),
            warnings: Vec::new(),
        }
    }

    /// Reads `report.json` of a result folder.
    ///
    /// # Errors
    /// [`FacewrightError::NoResult`] where there is none, or what it says cannot be.
    pub fn read(path: &Path) -> Result<Self, FacewrightError> {
        let no_result = |reason: String| FacewrightError::NoResult {
            path: path.parent().unwrap_or(Path::new(".")).to_owned(),
            reason: format!("report.json: {reason}"),
        };
        let text = std::fs::read_to_string(path).map_err(|e| no_result(e.to_string()))?;
        formats::content(&text).map_err(no_result)
    }

    /// Reads the text of a `report.json`.
    ///
    /// # Errors
    /// [`FacewrightError::Read`] where it is none, or what it says cannot be.
    pub fn parse(text: &str) -> Result<Self, FacewrightError> {
        formats::parse(text)
    }

    /// How many frames were left out for each reason, in a few words each.
    pub fn left_out(&self) -> Vec<(usize, String)> {
        let left_out = self.frames.iter().filter(|frame| !frame.used);
        let counts = counts(left_out.map(|frame| brief(frame.reason_kind, &frame.reason)));
        counts.into_iter().map(|(brief, count)| (count, brief.to_owned())).collect()
    }

    /// Writes a `report.json`, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), FacewrightError> {
        formats::write(path, self)
    }
}

impl Format for Report {
    const FILE: &'static str = "report.json";
    const HOLDS: &'static str = "report";
    const KEYS: &'static [&'static str] = &["frames", "landmarks68"];

    fn validate(&self) -> Result<(), String> {
        self.camera.camera.validate().map_err(|e| e.to_string())?;
        self.scale.validate()?;
        self.quality.as_ref().map_or(Ok(()), Quality::validate)?;
        once(self.frames.iter().map(|frame| frame.name.as_str()), "frame")?;
        for frame in &self.frames {
            at_least_0(frame.reprojection_rms_px, || format!("the reprojection_rms_px of frame {}", frame.name))?;
        }
        self.landmarks68.iter().try_for_each(|point| finite(point, || "a landmark".to_owned()))
    }
}

impl Scale {
    /// What is wrong with it.
    pub(crate) fn validate(&self) -> Result<(), String> {
        if self.metres_per_unit != 1.0 {
            return Err("its unit is not the metre".to_owned());
        }
        at_least_0(self.relative_sigma, || "the relative_sigma of its scale".to_owned())
    }
}
