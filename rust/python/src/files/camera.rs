//! `camera.json`.

use super::{Rows, file_class, matrix, rows, word};
use facewright::CameraFile;
use geometry::Pattern;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A camera.json: a pinhole camera with a lens, and the pictures of a board that it was calibrated from.
///
/// Pixels: x right, y down, centres at integers. A point (X, Y, Z) of the camera frame (x right, y down, z forward) with
/// x = X/Z, y = Y/Z, r² = x² + y² is seen at u = fx (x (1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2 x²)) + cx, and v
/// alike.
#[pyclass(frozen, eq, from_py_object, module = "facewright")]
#[derive(Clone, PartialEq)]
pub struct Camera(Arc<CameraFile>);

impl Camera {
    /// Wraps a calibration.
    pub fn calibrated(camera: facewright::CalibratedCamera) -> Self {
        Self::new(CameraFile::Calibrated(Box::new(camera)))
    }

    /// Wraps numbers alone.
    pub fn numbers(camera: facewright::SourcedCamera) -> Self {
        Self::new(CameraFile::Numbers(camera))
    }

    /// All of it.
    pub fn core(&self) -> &CameraFile {
        &self.0
    }

    fn lens(&self) -> geometry::Camera {
        self.0.sourced().camera
    }
}

file_class!(Camera, CameraFile, "camera.json");

#[pymethods]
impl Camera {
    /// Width of the pictures, pixels.
    #[getter]
    fn width(&self) -> u32 {
        self.lens().width
    }

    /// Height of the pictures, pixels.
    #[getter]
    fn height(&self) -> u32 {
        self.lens().height
    }

    /// Width and height of the pictures, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.lens().width, self.lens().height)
    }

    /// Focal length along x, pixels.
    #[getter]
    fn fx(&self) -> f64 {
        self.lens().fx
    }

    /// Focal length along y, pixels.
    #[getter]
    fn fy(&self) -> f64 {
        self.lens().fy
    }

    /// Principal point, pixels from the centre of the top left pixel.
    #[getter]
    fn cx(&self) -> f64 {
        self.lens().cx
    }

    /// Principal point, pixels from the centre of the top left pixel.
    #[getter]
    fn cy(&self) -> f64 {
        self.lens().cy
    }

    /// First radial coefficient.
    #[getter]
    fn k1(&self) -> f64 {
        self.lens().k1
    }

    /// Second radial coefficient.
    #[getter]
    fn k2(&self) -> f64 {
        self.lens().k2
    }

    /// Third radial coefficient.
    #[getter]
    fn k3(&self) -> f64 {
        self.lens().k3
    }

    /// First tangential coefficient.
    #[getter]
    fn p1(&self) -> f64 {
        self.lens().p1
    }

    /// Second tangential coefficient.
    #[getter]
    fn p2(&self) -> f64 {
        self.lens().p2
    }

    /// Where the numbers come from: `board`, `exif` or `estimated`.
    #[getter]
    fn source(&self) -> String {
        word(&self.0.sourced().source)
    }

    /// Root mean square reprojection error of all corners, pixels; None, as below, where the file lists no board.
    #[getter]
    fn rms_px(&self) -> Option<f64> {
        self.0.calibration().map(|c| c.rms_px)
    }

    /// The same for corners in held-out pictures.
    #[getter]
    fn hold_out_rms_px(&self) -> Option<f64> {
        self.0.calibration()?.hold_out_rms_px
    }

    /// Standard deviations of the numbers by their names; 0 where a number was fixed, empty where none are known.
    #[getter]
    fn deviations(&self) -> BTreeMap<&'static str, f64> {
        let Some(d) = self.0.calibration().map(|c| c.deviations) else { return BTreeMap::new() };
        let radial = [("k1", d.k1), ("k2", d.k2), ("k3", d.k3)];
        let rest = [("fx", d.fx), ("fy", d.fy), ("cx", d.cx), ("cy", d.cy), ("p1", d.p1), ("p2", d.p2)];
        radial.into_iter().chain(rest).collect()
    }

    /// How far the board is from flat, if the pictures determine it.
    #[getter]
    fn bend(&self) -> Option<BoardBend> {
        let bend = self.0.calibration()?.bend?;
        Some(BoardBend { bulge_mm: bend.bulge_mm, deviation_mm: bend.deviation_mm })
    }

    /// The boards looked for.
    #[getter]
    fn boards(&self) -> Vec<Board> {
        self.0.calibration().map_or(Vec::new(), |c| c.boards.iter().map(Board::of).collect())
    }

    /// What became of each picture.
    #[getter]
    fn images(&self) -> Vec<BoardImage> {
        self.0.calibration().map_or(Vec::new(), |c| c.images.iter().cloned().map(BoardImage).collect())
    }

    /// What to photograph next, and what to distrust.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.calibration().map_or(Vec::new(), |c| c.warnings.clone())
    }

    fn __repr__(&self) -> String {
        let (lens, source) = (self.lens(), self.source());
        format!("<facewright.Camera: {}x{}, focal {:.1} px, {source}>", lens.width, lens.height, lens.fx)
    }
}

/// How far a board is from flat.
#[pyclass(frozen, get_all, module = "facewright")]
pub struct BoardBend {
    /// Height difference of the highest and the lowest corner, millimetres.
    bulge_mm: f64,
    /// Its standard deviation.
    deviation_mm: f64,
}

/// A board of equal squares: x along the rows, y from row to row, z = 0, the origin in the first corner.
#[pyclass(frozen, get_all, module = "facewright")]
pub struct Board {
    /// Of a checkerboard the inner corners in a row, otherwise the black squares in a row.
    columns: u32,
    /// Rows of them.
    rows: u32,
    /// Side of a square, metres.
    square: f64,
    /// Between separate squares, in parts of a square's side; None for a checkerboard.
    gap: Option<f64>,
}

impl Board {
    fn of(board: &geometry::Board) -> Self {
        let gap = match board.pattern {
            Pattern::Checkerboard => None,
            Pattern::Squares { gap } => Some(gap),
        };
        Self { columns: board.columns, rows: board.rows, square: board.square, gap }
    }
}

/// What became of a picture of the board.
#[pyclass(frozen, module = "facewright")]
pub struct BoardImage(facewright::BoardImage);

#[pymethods]
impl BoardImage {
    /// File name without extension.
    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    /// Whether the board was found.
    #[getter]
    fn found(&self) -> bool {
        self.0.found
    }

    /// Whether the camera was calibrated from it.
    #[getter]
    fn used(&self) -> bool {
        self.0.used
    }

    /// Why not; empty if it was.
    #[getter]
    fn reason(&self) -> &str {
        self.0.reason.as_deref().unwrap_or_default()
    }

    /// Number of the board that it shows.
    #[getter]
    fn board(&self) -> Option<usize> {
        self.0.board
    }

    /// Root mean square reprojection error of its corners, pixels.
    #[getter]
    fn rms_px(&self) -> Option<f64> {
        self.0.rms_px
    }

    /// Largest error of a corner, pixels.
    #[getter]
    fn worst_px(&self) -> Option<f64> {
        self.0.worst_px
    }

    /// The same as `rms_px` with a camera calibrated without this picture.
    #[getter]
    fn hold_out_rms_px(&self) -> Option<f64> {
        self.0.hold_out_rms_px
    }

    /// (4, 4) pose of the board, metres; of a picture that was used.
    #[getter]
    fn cam_from_board<'py>(&self, py: Python<'py>) -> Option<Rows<'py>> {
        self.0.cam_from_board.as_ref().map(|pose| matrix(py, pose))
    }

    /// (n,) numbers of the corners that were seen, row by row of the board.
    #[getter]
    fn corner_indices<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        self.0.corners.iter().map(|corner| corner.0 as i64).collect::<Vec<_>>().into_pyarray(py)
    }

    /// (n, 2) where they were seen, pixels.
    #[getter]
    fn corners<'py>(&self, py: Python<'py>) -> Rows<'py> {
        rows(py, &self.0.corners.iter().map(|corner| corner.1).collect::<Vec<_>>())
    }

    /// (n, 2) seen less projected, pixels.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> Rows<'py> {
        let seen = &self.0.corners;
        Array2::from_shape_fn((seen.len(), 2), |(i, k)| seen[i].2[k]).into_pyarray(py)
    }

    fn __repr__(&self) -> String {
        let what = if self.0.used { "used" } else { self.reason() };
        format!("<facewright.BoardImage {}: {what}>", self.0.name)
    }
}

impl super::Or<Camera> {
    /// The camera and where it comes from.
    pub fn sourced(&self) -> PyResult<facewright::SourcedCamera> {
        match self {
            Self::Class(camera) => Ok(camera.0.sourced()),
            Self::Text(text) => facewright::SourcedCamera::parse(text).map_err(|e| crate::raise(&e)),
        }
    }
}
