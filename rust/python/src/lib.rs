//! Python binding: checks arguments, starts jobs, hands arrays over. Nothing is computed here.

mod files;
mod job;
mod reconstruction;

use drawing::Format;
use facewright::pictures::board::{Page, SheetOptions, sheet};
use facewright::pictures::calibration::{DPI, of_camera, of_rig};
use facewright::{
    Assets, Bend, CalibrateOptions, FacewrightError as CoreError, FrameSet, Given, KnownLength, Method, MotionOptions,
    ReconstructOptions, RigInput, RigTracks, SizeOptions, TrackClipOptions, solve_motion, solve_motion_on_rig,
    write_drawing,
};
use files::{Calibration, Camera, Motion, Or, Rig, Tracks};
use geometry::{Board, Progress};
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
    write_drawing(&path, &drawing, dpi).map_err(|e| raise(&e))
}

fn board(inner: (u32, u32), squares: Option<(u32, u32)>, gap_mm: Option<f64>, square_mm: f64) -> Board {
    let square = square_mm / 1000.0;
    match squares {
        Some((columns, rows)) => Board::squares(columns, rows, square, gap_mm.map_or(1.0, |gap| gap / square_mm)),
        None => Board::checkerboard(inner.0, inner.1, square),
    }
}

#[pyfunction]
#[pyo3(signature = (pictures, *, inner = (9, 6), squares = None, gap_mm = None, square_mm = 25.5, distortion_terms = 2, tangential = false, square_pixels = false, bend = "judged", picture = None))]
fn calibrate(
    pictures: Vec<PathBuf>,
    inner: (u32, u32),
    squares: Option<(u32, u32)>,
    gap_mm: Option<f64>,
    square_mm: f64,
    distortion_terms: usize,
    tangential: bool,
    square_pixels: bool,
    bend: &str,
    picture: Option<PathBuf>,
) -> PyResult<Job> {
    // Another kind of picture is refused before the work, not after it.
    picture.as_deref().map(Format::of).transpose().map_err(|e| raise(&e.into()))?;
    let boards = vec![board(inner, squares, gap_mm, square_mm)];
    let options = CalibrateOptions { boards, distortion_terms, tangential, square_pixels, bend: bend_of(bend)? };
    Job::start(move |progress| {
        let frames = FrameSet::open(&pictures, progress)?;
        let calibrated = facewright::calibrate(&frames, &options, progress)?;
        picture.map_or(Ok(()), |path| write_drawing(&path, &of_camera(&calibrated), DPI))?;
        Ok(Output::Camera(Box::new(calibrated)))
    })
}

#[pyfunction]
#[pyo3(signature = (cameras, *, inner = (9, 6), squares = None, gap_mm = None, square_mm = 25.5, distortion_terms = 2, tangential = false, square_pixels = false, bend = "judged", picture = None))]
fn calibrate_rig(
    cameras: Vec<(String, Vec<PathBuf>)>,
    inner: (u32, u32),
    squares: Option<(u32, u32)>,
    gap_mm: Option<f64>,
    square_mm: f64,
    distortion_terms: usize,
    tangential: bool,
    square_pixels: bool,
    bend: &str,
    picture: Option<PathBuf>,
) -> PyResult<Job> {
    picture.as_deref().map(Format::of).transpose().map_err(|e| raise(&e.into()))?;
    let boards = vec![board(inner, squares, gap_mm, square_mm)];
    let options = CalibrateOptions { boards, distortion_terms, tangential, square_pixels, bend: bend_of(bend)? };
    Job::start(move |progress| {
        let inputs: Vec<RigInput> = cameras.into_iter().map(|c| rig_input(c, progress)).collect::<Result<_, _>>()?;
        let calibrated = facewright::calibrate_rig(&inputs, &options, progress)?;
        picture.map_or(Ok(()), |path| write_drawing(&path, &of_rig(&calibrated), DPI))?;
        Ok(Output::Rig(Box::new(calibrated)))
    })
}

fn rig_input((name, pictures): (String, Vec<PathBuf>), progress: &Progress) -> Result<RigInput, CoreError> {
    Ok(RigInput { name, pictures: FrameSet::open(&pictures, progress)? })
}

fn bend_of(name: &str) -> PyResult<Bend> {
    match name {
        "never" => Ok(Bend::Never),
        "judged" => Ok(Bend::Judged),
        "always" => Ok(Bend::Always),
        other => Err(PyValueError::new_err(format!("bend is {other}, not never, judged or always"))),
    }
}

#[pyfunction]
fn save_calibration_picture(py: Python<'_>, calibration: Calibration, path: PathBuf) -> PyResult<()> {
    let drawing = calibration.drawing()?;
    py.detach(|| write_drawing(&path, &drawing, DPI)).map_err(|e| raise(&e))
}

#[pyfunction]
#[pyo3(signature = (frames, *, assets, camera = None, method = "default", points = 200, window = None))]
fn track(
    frames: Vec<PathBuf>,
    assets: PathBuf,
    camera: Option<Or<Camera>>,
    method: &str,
    points: usize,
    window: Option<usize>,
) -> PyResult<Job> {
    let camera = camera.map(|camera| camera.sourced()).transpose()?;
    let given = Given { camera, ..Given::default() };
    let options = TrackClipOptions { method: method_of(method)?, points, window, from: None };
    Job::start(move |progress| {
        let frames = FrameSet::open(&frames, progress)?;
        let tracks = facewright::track(&frames, &Assets::load(&assets)?, &given, &options, progress)?;
        Ok(Output::Tracks(Box::new(tracks)))
    })
}

#[pyfunction]
#[pyo3(signature = (tracks, *, camera = None, interocular_mm = None, lengths = Vec::new()))]
fn motion(
    tracks: Or<Tracks>,
    camera: Option<Or<Camera>>,
    interocular_mm: Option<f64>,
    lengths: Vec<(usize, usize, f64)>,
) -> PyResult<Job> {
    let tracks = tracks.core()?;
    let camera = camera.map(|camera| camera.sourced()).transpose()?;
    let size = SizeOptions { interocular_mm, lengths: lengths.into_iter().map(KnownLength::from).collect() };
    Job::start(move |progress| {
        let motion = solve_motion(&tracks, camera.as_ref(), &MotionOptions { size }, progress)?;
        Ok(Output::Motion(Box::new(motion)))
    })
}

#[pyfunction]
fn motion_on_rig(films: Vec<(String, Or<Tracks>)>, rig: Or<Rig>) -> PyResult<Job> {
    let film = |(camera, tracks): (String, Or<Tracks>)| Ok(RigTracks { camera, tracks: tracks.core()? });
    let films: Vec<RigTracks> = films.into_iter().map(film).collect::<PyResult<_>>()?;
    let rig = rig.core()?;
    Job::start(move |progress| {
        let motion = solve_motion_on_rig(&films, &rig, progress)?;
        Ok(Output::Motion(Box::new(motion)))
    })
}

fn method_of(name: &str) -> PyResult<Method> {
    match name {
        "default" => Ok(Method::Default),
        "paper" => Ok(Method::Paper),
        other => Err(PyValueError::new_err(format!("method is {other}, not default or paper"))),
    }
}

#[pyfunction]
#[pyo3(signature = (frames, *, assets, camera = None, method = "default", texture_size = 2048, interocular_mm = None, tracks = None, motion = None))]
fn reconstruct(
    frames: Vec<PathBuf>,
    assets: PathBuf,
    camera: Option<Or<Camera>>,
    method: &str,
    texture_size: u32,
    interocular_mm: Option<f64>,
    tracks: Option<Or<Tracks>>,
    motion: Option<Or<Motion>>,
) -> PyResult<Job> {
    let options = ReconstructOptions {
        method: method_of(method)?,
        texture_size,
        size: SizeOptions { interocular_mm, lengths: Vec::new() },
    };
    let given = Given {
        camera: camera.map(|camera| camera.sourced()).transpose()?,
        tracks: tracks.map(|tracks| tracks.core()).transpose()?,
        motion: motion.map(|motion| motion.core()).transpose()?,
    };
    Job::start(move |progress| {
        let frames = FrameSet::open(&frames, progress)?;
        let result = facewright::reconstruct(&frames, &Assets::load(&assets)?, &given, &options, progress)?;
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
    files::add_classes(module)?;
    module.add_function(wrap_pyfunction!(version, module)?)?;
    module.add_function(wrap_pyfunction!(save_board, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate, module)?)?;
    module.add_function(wrap_pyfunction!(calibrate_rig, module)?)?;
    module.add_function(wrap_pyfunction!(save_calibration_picture, module)?)?;
    module.add_function(wrap_pyfunction!(track, module)?)?;
    module.add_function(wrap_pyfunction!(motion, module)?)?;
    module.add_function(wrap_pyfunction!(motion_on_rig, module)?)?;
    module.add_function(wrap_pyfunction!(reconstruct, module)?)?;
    module.add_function(wrap_pyfunction!(check_folder, module)?)?;
    module.add_function(wrap_pyfunction!(generic_head, module)?)
}
