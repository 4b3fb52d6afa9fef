//! Python binding: checks arguments, starts jobs, hands arrays over. Nothing is computed here.

mod job;
mod reconstruction;

use facewright::board::{Page, SheetOptions, sheet};
use facewright::calibration_picture;
use facewright::{
    Assets, CalibrateOptions, FacewrightError as CoreError, FrameSet, Method, ReconstructOptions, SourcedCamera,
};
use geometry::Board;
use job::{Job, Output};
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use reconstruction::Reconstruction;
use std::path::PathBuf;

create_exception!(facewright, FacewrightError, PyException, "A sentence that says what is wrong and what to do.");
create_exception!(facewright, Cancelled, FacewrightError, "The job was cancelled.");

/// The library's error as Python's.
pub(crate) fn raise(error: &CoreError) -> PyErr {
    match error {
        CoreError::Cancelled(_) => Cancelled::new_err(error.to_string()),
        _ => FacewrightError::new_err(error.to_string()),
    }
}

#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

#[pyfunction]
#[pyo3(signature = (path, *, inner = (9, 6), squares = None, gap_mm = None, square_mm = 25.5, page = "A4", mark = true, dpi = 300.0))]
#[expect(clippy::too_many_arguments, reason = "keywords of a Python function")]
fn save_board(
    path: PathBuf,
    inner: (u32, u32),
    squares: Option<(u32, u32)>,
    gap_mm: Option<f64>,
    square_mm: f64,
    page: &str,
    mark: bool,
    dpi: f64,
) -> PyResult<()> {
    let options = SheetOptions { page: page.parse::<Page>().map_err(PyValueError::new_err)?, mark };
    let drawing = sheet(&board(inner, squares, gap_mm, square_mm), &options).map_err(|e| raise(&e.into()))?;
    drawing.write(&path, dpi).map_err(|e| raise(&e))
}

fn board(inner: (u32, u32), squares: Option<(u32, u32)>, gap_mm: Option<f64>, square_mm: f64) -> Board {
    let square = square_mm / 1000.0;
    match squares {
        Some((columns, rows)) => Board::squares(columns, rows, square, gap_mm.map_or(1.0, |gap| gap / square_mm)),
        None => Board::checkerboard(inner.0, inner.1, square),
    }
}

#[pyfunction]
#[pyo3(signature = (pictures, *, inner = (9, 6), squares = None, gap_mm = None, square_mm = 25.5, picture = None))]
fn calibrate(
    pictures: Vec<PathBuf>,
    inner: (u32, u32),
    squares: Option<(u32, u32)>,
    gap_mm: Option<f64>,
    square_mm: f64,
    picture: Option<PathBuf>,
) -> PyResult<Job> {
    let board = board(inner, squares, gap_mm, square_mm);
    let options = CalibrateOptions { boards: vec![board], ..CalibrateOptions::default() };
    Job::start(move |progress| {
        let frames = FrameSet::open(&pictures, progress)?;
        let calibrated = facewright::calibrate(&frames, &options, progress)?;
        if let Some(path) = picture {
            calibration_picture::of_camera(&calibrated).write(&path, calibration_picture::DPI)?;
        }
        Ok(Output::Text(serde_json::to_string(&calibrated).unwrap_or_default()))
    })
}

#[pyfunction]
#[pyo3(signature = (frames, *, assets, camera = None, method = "default", texture_size = 2048, interocular_mm = None))]
fn reconstruct(
    frames: Vec<PathBuf>,
    assets: PathBuf,
    camera: Option<&str>,
    method: &str,
    texture_size: u32,
    interocular_mm: Option<f64>,
) -> PyResult<Job> {
    let method = match method {
        "default" => Method::Default,
        "paper" => Method::Paper,
        other => return Err(PyValueError::new_err(format!("method is {other}, not default or paper"))),
    };
    let camera = camera.map(SourcedCamera::parse).transpose().map_err(|e| raise(&e))?;
    let options =
        ReconstructOptions { method, camera, texture_size, interocular: interocular_mm.map(|mm| mm / 1000.0) };
    Job::start(move |progress| {
        let frames = FrameSet::open(&frames, progress)?;
        let result = facewright::reconstruct(&frames, &Assets::load(&assets)?, &options, progress)?;
        Ok(Output::Head(Box::new(result)))
    })
}

#[pyfunction]
fn generic_head(py: Python<'_>, assets: PathBuf) -> PyResult<Reconstruction> {
    let head = py.detach(|| facewright::generic_head(&assets)).map_err(|e| raise(&e))?;
    Ok(Reconstruction::new(head))
}

#[pyfunction]
fn check_folder(folder: PathBuf) -> PyResult<()> {
    facewright::check_folder(&folder).map_err(|e| raise(&e))
}

#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("FacewrightError", module.py().get_type::<FacewrightError>())?;
    module.add("Cancelled", module.py().get_type::<Cancelled>())?;
    module.add_class::<Job>()?;
    module.add_class::<Reconstruction>()?;
    module.add_function(wrap_pyfunction!(version, module)?)?;
    module.add_function(wrap_pyfunction!(save_board, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate, module)?)?;
    module.add_function(wrap_pyfunction!(reconstruct, module)?)?;
    module.add_function(wrap_pyfunction!(check_folder, module)?)?;
    module.add_function(wrap_pyfunction!(generic_head, module)?)
}
