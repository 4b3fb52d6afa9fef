//! Python binding: checks arguments, starts jobs, hands arrays over. Nothing is computed here.

mod job;
mod reconstruction;

use drawing::Format;
use facewright::pictures::board::{Page, SheetOptions, sheet};
use facewright::pictures::calibration::{DPI, of_camera, of_rig};
use facewright::{
    Assets, CalibrateOptions, CalibratedCamera, CalibratedRig, FacewrightError as CoreError, FrameSet, Given,
    KnownLength, Method, MotionOptions, ReconstructOptions, RigInput, RigTracks, SizeOptions, SourcedCamera,
    TrackClipOptions, Tracks, solve_motion, solve_motion_on_rig, write_drawing,
};
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
#[pyo3(signature = (pictures, *, inner = (9, 6), squares = None, gap_mm = None, square_mm = 25.5, picture = None))]
fn calibrate(
    pictures: Vec<PathBuf>,
    inner: (u32, u32),
    squares: Option<(u32, u32)>,
    gap_mm: Option<f64>,
    square_mm: f64,
    picture: Option<PathBuf>,
) -> PyResult<Job> {
    // Another kind of picture is refused before the work, not after it.
    picture.as_deref().map(Format::of).transpose().map_err(|e| raise(&e.into()))?;
    let options = options(board(inner, squares, gap_mm, square_mm));
    Job::start(move |progress| {
        let frames = FrameSet::open(&pictures, progress)?;
        let calibrated = facewright::calibrate(&frames, &options, progress)?;
        picture.map_or(Ok(()), |path| write_drawing(&path, &of_camera(&calibrated), DPI))?;
        Ok(Output::Text(serde_json::to_string(&calibrated).unwrap_or_default()))
    })
}

#[pyfunction]
#[pyo3(signature = (cameras, *, inner = (9, 6), squares = None, gap_mm = None, square_mm = 25.5, picture = None))]
fn calibrate_rig(
    cameras: Vec<(String, Vec<PathBuf>)>,
    inner: (u32, u32),
    squares: Option<(u32, u32)>,
    gap_mm: Option<f64>,
    square_mm: f64,
    picture: Option<PathBuf>,
) -> PyResult<Job> {
    picture.as_deref().map(Format::of).transpose().map_err(|e| raise(&e.into()))?;
    let options = options(board(inner, squares, gap_mm, square_mm));
    Job::start(move |progress| {
        let inputs: Vec<RigInput> = cameras.into_iter().map(|c| rig_input(c, progress)).collect::<Result<_, _>>()?;
        let calibrated = facewright::calibrate_rig(&inputs, &options, progress)?;
        picture.map_or(Ok(()), |path| write_drawing(&path, &of_rig(&calibrated), DPI))?;
        Ok(Output::Text(serde_json::to_string(&calibrated).unwrap_or_default()))
    })
}

fn rig_input((name, pictures): (String, Vec<PathBuf>), progress: &Progress) -> Result<RigInput, CoreError> {
    Ok(RigInput { name, pictures: FrameSet::open(&pictures, progress)? })
}

fn options(board: Board) -> CalibrateOptions {
    CalibrateOptions { boards: vec![board], ..CalibrateOptions::default() }
}

#[pyfunction]
fn save_calibration_picture(py: Python<'_>, text: &str, path: PathBuf) -> PyResult<()> {
    let refused = |e: serde_json::Error| {
        FacewrightError::new_err(format!("this camera does not tell of the boards it was calibrated from: {e}"))
    };
    let value: serde_json::Value = serde_json::from_str(text).map_err(refused)?;
    let drawing = if value.get("cameras").is_some() {
        of_rig(&serde_json::from_value::<CalibratedRig>(value).map_err(refused)?)
    } else {
        of_camera(&serde_json::from_value::<CalibratedCamera>(value).map_err(refused)?)
    };
    py.detach(|| write_drawing(&path, &drawing, DPI)).map_err(|e| raise(&e))
}

#[pyfunction]
#[pyo3(signature = (frames, *, assets, camera = None, method = "default", points = 200, window = None))]
fn track(
    frames: Vec<PathBuf>,
    assets: PathBuf,
    camera: Option<&str>,
    method: &str,
    points: usize,
    window: Option<usize>,
) -> PyResult<Job> {
    let camera = camera.map(SourcedCamera::parse).transpose().map_err(|e| raise(&e))?;
    let given = Given { camera, ..Given::default() };
    let options = TrackClipOptions { method: method_of(method)?, points, window, from: None };
    Job::start(move |progress| {
        let frames = FrameSet::open(&frames, progress)?;
        let tracks = facewright::track(&frames, &Assets::load(&assets)?, &given, &options, progress)?;
        Ok(Output::Text(serde_json::to_string(&tracks).unwrap_or_default()))
    })
}

#[pyfunction]
#[pyo3(signature = (tracks, *, camera = None, interocular_mm = None, lengths = Vec::new()))]
fn motion(
    tracks: &str,
    camera: Option<&str>,
    interocular_mm: Option<f64>,
    lengths: Vec<(usize, usize, f64)>,
) -> PyResult<Job> {
    let tracks = Tracks::parse(tracks).map_err(|e| raise(&e))?;
    let camera = camera.map(SourcedCamera::parse).transpose().map_err(|e| raise(&e))?;
    let size = SizeOptions { interocular_mm, lengths: lengths.into_iter().map(KnownLength::from).collect() };
    Job::start(move |progress| {
        let motion = solve_motion(&tracks, camera.as_ref(), &MotionOptions { size }, progress)?;
        Ok(Output::Text(serde_json::to_string(&motion).unwrap_or_default()))
    })
}

#[pyfunction]
fn motion_on_rig(films: Vec<(String, String)>, rig: &str) -> PyResult<Job> {
    let film = |(camera, tracks): (String, String)| Ok(RigTracks { camera, tracks: Tracks::parse(&tracks)? });
    let films: Vec<RigTracks> = films.into_iter().map(film).collect::<Result<_, CoreError>>().map_err(|e| raise(&e))?;
    let rig = CalibratedRig::parse(rig).map_err(|e| raise(&e))?;
    Job::start(move |progress| {
        let motion = solve_motion_on_rig(&films, &rig, progress)?;
        Ok(Output::Text(serde_json::to_string(&motion).unwrap_or_default()))
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
#[pyo3(signature = (frames, *, assets, camera = None, method = "default", texture_size = 2048, interocular_mm = None, tracks = None))]
fn reconstruct(
    frames: Vec<PathBuf>,
    assets: PathBuf,
    camera: Option<&str>,
    method: &str,
    texture_size: u32,
    interocular_mm: Option<f64>,
    tracks: Option<&str>,
) -> PyResult<Job> {
    let options = ReconstructOptions {
        method: method_of(method)?,
        texture_size,
        size: SizeOptions { interocular_mm, lengths: Vec::new() },
    };
    let given = Given {
        camera: camera.map(SourcedCamera::parse).transpose().map_err(|e| raise(&e))?,
        tracks: tracks.map(Tracks::parse).transpose().map_err(|e| raise(&e))?,
        motion: None,
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
