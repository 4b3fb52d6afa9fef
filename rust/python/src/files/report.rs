//! `report.json`.

use super::shared::{frame, made_by, measured};
use super::{Rows, file_class, rows};
use facewright::FrameReport;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A report.json: what was done for a head, and how well.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Report(Arc<facewright::Report>);

file_class!(Report, facewright::Report, "report.json");
made_by!(Report, method: "Chain of steps: `default` or `paper`.", camera: "The camera.");
measured!(Report);

#[pymethods]
impl Report {
    /// Every frame given.
    #[getter]
    fn frames(&self) -> Vec<ReportFrame> {
        self.0.frames.iter().cloned().map(ReportFrame).collect()
    }

    /// How many frames were left out for each reason, in a few words each.
    #[getter]
    fn left_out(&self) -> Vec<(usize, String)> {
        self.0.left_out()
    }

    /// Number of measured 3D points.
    #[getter]
    fn points(&self) -> usize {
        self.0.points
    }

    /// (68, 3) iBUG landmarks on the result, head frame, metres.
    #[getter]
    fn landmarks68<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, &self.0.landmarks68)
    }

    /// How well the head fits what was seen.
    #[getter]
    fn fit(&self) -> FitReport {
        let fit = &self.0.fit;
        FitReport {
            components: fit.components,
            coefficient_rms: fit.coefficient_rms,
            rigid_agreement: fit.rigid_agreement,
            points_median_mm: fit.points_median_mm,
            landmarks_median_px: fit.landmarks_median_px,
            interocular_mm: fit.interocular_mm,
        }
    }

    /// How the skin was measured densely; None where it was not, and in older files.
    #[getter]
    fn dense(&self) -> Option<DenseReport> {
        let dense = self.0.dense.clone()?;
        Some(DenseReport {
            measured: dense.measured,
            places: dense.places,
            sigma_mm: dense.sigma_mm,
            moved_mm: dense.moved_mm,
            displacement_m: dense.displacement_m,
            untouched: dense.untouched,
        })
    }

    /// How the texture was made.
    #[getter]
    fn texture(&self) -> TextureReport {
        let texture = &self.0.texture;
        let gains = texture.gains.iter().map(|(name, gain)| (name.clone(), (*gain).into())).collect();
        TextureReport { size: texture.size, seen: texture.seen, gains }
    }

    /// How good the head is; None in older files.
    #[getter]
    fn quality(&self) -> Option<Quality> {
        self.0.quality.clone().map(Quality)
    }

    fn __repr__(&self) -> String {
        let used = self.0.frames.iter().filter(|frame| frame.used).count();
        format!("<facewright.Report: {used} of {} frames, {} points>", self.0.frames.len(), self.0.points)
    }
}

/// What became of a frame.
#[pyclass(frozen, module = "facewright")]
pub struct ReportFrame(FrameReport);

frame!(
    ReportFrame,
    used: "Whether shape and texture were taken from it.",
    reason: "Why, or why not.",
    cam_from_head: "(4, 4) pose of the head, metres; None where no face was found."
);

#[pymethods]
impl ReportFrame {
    /// Root mean square distance of its observations from the model, pixels.
    #[getter]
    fn reprojection_rms_px(&self) -> Option<f64> {
        self.0.reprojection_rms_px
    }

    fn __repr__(&self) -> String {
        format!("<facewright.ReportFrame {}: {}>", self.0.name, self.0.reason)
    }
}

/// How well a head fits what was seen.
#[pyclass(frozen, get_all, module = "facewright")]
pub struct FitReport {
    /// Components of the face class that were used.
    components: usize,
    /// Root mean square of the class's coefficients, in its standard deviations.
    coefficient_rms: f64,
    /// Fraction of the points' observations that a single motion of the head explains, 0 to 1.
    rigid_agreement: f64,
    /// Median distance of the measured points from the head's surface, millimetres.
    points_median_mm: f64,
    /// Median distance of the landmarks from their anchors, pixels.
    landmarks_median_px: f64,
    /// Distance between the eyeballs' centres, millimetres.
    interocular_mm: f64,
}

/// How the skin was measured densely.
#[pyclass(frozen, get_all, module = "facewright")]
pub struct DenseReport {
    /// Places on the skin that were measured.
    measured: usize,
    /// Places on the face.
    places: usize,
    /// Median standard deviation of the vertices that were measured, millimetres.
    sigma_mm: Option<f64>,
    /// Median way that they went along their normals, millimetres.
    moved_mm: Option<f64>,
    /// Heights in displacement.png from black to white, metres; None where there is no such file.
    displacement_m: Option<f64>,
    /// Why the skin was left as its points give it; None where it was not.
    untouched: Option<String>,
}

/// How a texture was made.
#[pyclass(frozen, get_all, module = "facewright")]
pub struct TextureReport {
    /// Width and height, pixels.
    size: u32,
    /// Fraction of the skin's texels that some frame saw, 0 to 1.
    seen: f64,
    /// Gain of each used frame: red, green, blue.
    gains: BTreeMap<String, (f64, f64, f64)>,
}

/// How good a head is.
#[pyclass(frozen, module = "facewright")]
pub struct Quality(facewright::Quality);

#[pymethods]
impl Quality {
    /// `good`, or `warned` where a measure is not as over good films.
    #[getter]
    fn verdict(&self) -> &'static str {
        match self.0.verdict {
            facewright::Verdict::Good => "good",
            facewright::Verdict::Warned => "warned",
        }
    }

    /// Every measure that was taken.
    #[getter]
    fn measures(&self) -> Vec<Measure> {
        self.0.measures.iter().cloned().map(Measure).collect()
    }

    /// The measures that good films do not have.
    #[getter]
    fn unusual(&self) -> Vec<Measure> {
        self.0.unusual().cloned().map(Measure).collect()
    }

    fn __repr__(&self) -> String {
        let (all, unusual) = (self.0.measures.len(), self.0.unusual().count());
        format!("<facewright.Quality {}: {unusual} of {all} measures unusual>", self.verdict())
    }
}

/// One measure of a head or its film.
#[pyclass(frozen, module = "facewright")]
pub struct Measure(facewright::Measure);

#[pymethods]
impl Measure {
    /// What is measured, a word.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// How much it is.
    #[getter]
    fn value(&self) -> f64 {
        self.0.value
    }

    /// Unit of the value and of both ranges.
    #[getter]
    fn unit(&self) -> &str {
        &self.0.unit
    }

    /// Where good films have it: low and high, None where there is no end.
    #[getter]
    fn usual(&self) -> (Option<f64>, Option<f64>) {
        self.0.usual.into()
    }

    /// Where a person's head can have it: low and high, None where there is no end.
    #[getter]
    fn possible(&self) -> (Option<f64>, Option<f64>) {
        self.0.possible.into()
    }

    /// What was measured, and what helps where that is unusual.
    #[getter]
    fn sentence(&self) -> &str {
        &self.0.sentence
    }

    fn __repr__(&self) -> String {
        format!("<facewright.Measure {}: {} {}>", self.0.name, self.0.value, self.0.unit)
    }
}
