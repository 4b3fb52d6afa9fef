//! `tracks.json`.

use super::shared::{frame, made_by};
use super::{Numbers, Or, Rows, file_class, word};
use facewright::{FrameTracks, PointGap, PointObservation, PointTrack, Region};
use geometry::Vec2;
use numpy::ndarray::Array2;
use numpy::{AllowTypeChange, IntoPyArray, PyArray1, PyArrayLike1, PyArrayLike2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A tracks.json: the same points of a face in many frames.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Tracks(Arc<facewright::Tracks>);

file_class!(Tracks, facewright::Tracks, "tracks.json");
made_by!(
    Tracks,
    method: "How they were tracked: `default` or `paper`.",
    camera: "The camera; its focal length is the landmarks' estimate unless it was calibrated."
);

#[pymethods]
impl Tracks {
    /// The same frames with other tracks, checked; the points of each frame are counted.
    fn with_tracks(&self, tracks: Vec<Bound<'_, Track>>) -> PyResult<Self> {
        let tracks = tracks.iter().map(|track| track.get().0.clone()).collect();
        self.0.with_tracks(tracks).map(Self::new).map_err(|e| crate::raise(&e))
    }

    /// The same with other `disabled` places: frame and place (u, v) in pixels of each, near which nothing is measured.
    fn with_disabled(&self, disabled: Vec<(usize, f64, f64)>) -> PyResult<Self> {
        let disabled = disabled.into_iter().map(Into::into).collect();
        self.0.with_disabled(disabled).map(Self::new).map_err(|e| crate::raise(&e))
    }

    /// As they concern other frames of the same clip, known by their names; some may not have been tracked.
    fn of_frames(&self, names: Vec<String>) -> Self {
        Self::new(self.0.of_frames(&names))
    }

    /// Width and height of the pictures, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.0.camera.camera.width, self.0.camera.camera.height)
    }

    /// Interpupillary distance of the landmarks' head, whose poses the frames have, metres.
    #[getter]
    fn interocular(&self) -> Option<f64> {
        self.0.interocular
    }

    /// Side of the tracker's window in the first reference frame, pixels.
    #[getter]
    fn window(&self) -> usize {
        self.0.window
    }

    /// Every frame given.
    #[getter]
    fn frames(&self) -> Vec<TrackedFrame> {
        self.0.frames.iter().cloned().map(TrackedFrame).collect()
    }

    /// The points.
    #[getter]
    fn tracks(&self) -> Vec<Track> {
        self.0.tracks.iter().cloned().map(Track).collect()
    }

    /// Where an artist disabled points: index of the frame and place (u, v) in pixels of each.
    #[getter]
    fn disabled(&self) -> Vec<(usize, f64, f64)> {
        self.0.disabled.iter().copied().map(Into::into).collect()
    }

    fn __len__(&self) -> usize {
        self.0.tracks.len()
    }

    fn __repr__(&self) -> String {
        format!("<facewright.Tracks: {} tracks in {} frames>", self.0.tracks.len(), self.0.frames.len())
    }
}

/// A frame of a sequence that was tracked.
#[pyclass(frozen, module = "facewright")]
pub struct TrackedFrame(FrameTracks);

frame!(
    TrackedFrame,
    used: "Whether points were found in it.",
    reason: "What it shows, or why nothing was found.",
    cam_from_head: "(4, 4) pose of the head by its landmarks, metres; None where no face was found."
);

#[pymethods]
impl TrackedFrame {
    /// Points found.
    #[getter]
    fn points(&self) -> usize {
        self.0.points
    }

    fn __repr__(&self) -> String {
        format!("<facewright.TrackedFrame {}: {} points>", self.0.name, self.0.points)
    }
}

/// A point of the face in the frames in which it was found.
///
/// Made of its number, the indices `frames` in which it was found, ascending, the `reference` among them in which it was chosen, `points`
/// (n, 2) pixels with standard deviations `sigmas` (n,), and the `region`: skin, mouth, eyes or brows. `missing` gives a reason for
/// frames in which it was not found. What contradicts itself is refused when the track comes into a Tracks.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Track(PointTrack);

#[pymethods]
impl Track {
    #[new]
    #[pyo3(signature = (id, *, reference, region, frames, points, sigmas, missing = BTreeMap::new(), place = None))]
    fn new(
        id: usize,
        reference: usize,
        region: &str,
        frames: Vec<usize>,
        points: PyArrayLike2<'_, f64, AllowTypeChange>,
        sigmas: PyArrayLike1<'_, f64, AllowTypeChange>,
        missing: BTreeMap<usize, String>,
        place: Option<[f64; 3]>,
    ) -> PyResult<Self> {
        let (points, sigmas) = (points.as_array(), sigmas.as_array());
        if points.dim() != (frames.len(), 2) || sigmas.len() != frames.len() {
            return Err(PyValueError::new_err(format!(
                "{0} frames need ({0}, 2) points and ({0},) sigmas",
                frames.len()
            )));
        }
        let seen = frames.iter().enumerate().map(|(k, &frame)| PointObservation {
            frame,
            pixel: Vec2::new(points[(k, 0)], points[(k, 1)]),
            sigma_px: sigmas[k],
        });
        let observations = seen.collect();
        Ok(Self(PointTrack {
            id,
            reference,
            region: region_of(region)?,
            place,
            observations,
            gaps: PointGap::runs(missing),
        }))
    }

    /// The same with another number.
    fn with_id(&self, id: usize) -> Self {
        Self(PointTrack { id, ..self.0.clone() })
    }

    /// Its number, unique among the tracks.
    #[getter]
    fn id(&self) -> usize {
        self.0.id
    }

    /// Index of the frame in which it was chosen.
    #[getter]
    fn reference(&self) -> usize {
        self.0.reference
    }

    /// What it belongs to: `skin`, `mouth`, `eyes` or `brows`.
    #[getter]
    fn region(&self) -> String {
        word(&self.0.region)
    }

    /// (n,) indices of the frames in which it was found, ascending.
    #[getter]
    fn frames<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.0.observations.iter().map(|o| o.frame as i64).collect::<Vec<_>>().into_pyarray(py)
    }

    /// (n, 2) where it was found, pixels of the picture as filmed: x right, y down, centres at integers.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> Rows<'py> {
        let seen = &self.0.observations;
        Array2::from_shape_fn((seen.len(), 2), |(i, k)| seen[i].pixel[k]).into_pyarray(py)
    }

    /// (n,) one standard deviation along each axis, pixels.
    #[getter]
    fn sigmas<'py>(&self, py: Python<'py>) -> Numbers<'py> {
        self.0.observations.iter().map(|o| o.sigma_px).collect::<Vec<_>>().into_pyarray(py)
    }

    /// First and last index of the frames in which it was not found, and why.
    #[getter]
    fn gaps(&self) -> Vec<(usize, usize, String)> {
        self.0.gaps.iter().cloned().map(Into::into).collect()
    }

    /// Where it is on the landmarks' head at rest, head frame, metres; the artist's own points have no place.
    #[getter]
    fn place(&self) -> Option<(f64, f64, f64)> {
        self.0.place.map(Into::into)
    }

    fn __repr__(&self) -> String {
        format!("<facewright.Track {}: {} in {} frames>", self.0.id, self.region(), self.0.observations.len())
    }
}

fn region_of(name: &str) -> PyResult<Region> {
    let known = [Region::Skin, Region::Mouth, Region::Eyes, Region::Brows];
    let found = known.into_iter().find(|region| word(region) == name);
    found.ok_or_else(|| PyValueError::new_err(format!("region is {name}, not skin, mouth, eyes or brows")))
}

impl Or<Tracks> {
    /// The tracks.
    pub fn core(&self) -> PyResult<facewright::Tracks> {
        match self {
            Self::Class(tracks) => Ok((*tracks.0).clone()),
            Self::Text(text) => facewright::Tracks::parse(text).map_err(|e| crate::raise(&e)),
        }
    }
}
