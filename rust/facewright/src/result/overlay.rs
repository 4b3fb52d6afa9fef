//! The reconstructed head drawn over its frames.

use super::Report;
use super::nodes::{Node, read_nodes};
use crate::files::{png, write_together};
use crate::{FacewrightError, FrameSet, RigFrames};
use geometry::{Camera, Progress};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use texture::{DrawOptions, Layer, Painter};

/// Draws the head of a result folder as it lies over each frame that has a pose: RGBA PNG of the frame's name and size,
/// transparent where the head is not, lit as the frames were. Gives back the names of the frames drawn.
///
/// # Errors
/// [`FacewrightError::NoResult`], [`FacewrightError::OtherCamera`], [`FacewrightError::OtherFrames`]; [`FacewrightError::RigResult`] for the result of a rig.
///
/// # Examples
/// ```no_run
/// use facewright::{FrameSet, overlay};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let frames = FrameSet::open(&["clip.mp4".into()], &progress)?;
/// let drawn = overlay(Path::new("out"), &frames, Path::new("overlays"), &progress)?;
/// println!("{} of {} frames drawn", drawn.len(), frames.len());
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn overlay(
    result: &Path,
    frames: &FrameSet,
    folder: &Path,
    progress: &Progress,
) -> Result<Vec<String>, FacewrightError> {
    let report = Report::read(&result.join("report.json"))?;
    if !report.rig.is_empty() {
        return Err(rig_result(&report));
    }
    let film = Film { name: String::new(), frames, camera: report.camera.camera };
    draw(result, &report, &[film], folder, progress)
}

/// The same for the result of a rig, over the frames of some of its cameras as they were filmed; the pictures have the names of the
/// report, `left_0012` for frame `0012` of camera `left`.
///
/// # Errors
/// As those of [`overlay()`]; [`FacewrightError::RigCamera`] for a camera that took no part.
pub fn overlay_on_rig(
    result: &Path,
    films: &[RigFrames],
    folder: &Path,
    progress: &Progress,
) -> Result<Vec<String>, FacewrightError> {
    let report = Report::read(&result.join("report.json"))?;
    let of_films = films.iter().map(|film| Film::of(film, &report)).collect::<Result<Vec<_>, FacewrightError>>()?;
    draw(result, &report, &of_films, folder, progress)
}

fn rig_result(report: &Report) -> FacewrightError {
    let names: Vec<&str> = report.rig.iter().map(|camera| camera.name.as_str()).collect();
    FacewrightError::RigResult { first: names[0].to_owned(), known: names.join(", ") }
}

/// Frames of one camera.
struct Film<'a> {
    /// What the report's names of its frames begin with.
    name: String,
    frames: &'a FrameSet,
    camera: Camera,
}

impl<'a> Film<'a> {
    fn of(film: &'a RigFrames, report: &Report) -> Result<Self, FacewrightError> {
        let known = || report.rig.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>().join(", ");
        let camera = report.rig.iter().find(|camera| camera.name == film.camera);
        let camera = camera.ok_or_else(|| FacewrightError::RigCamera { name: film.camera.clone(), known: known() })?;
        Ok(Self { name: format!("{}_", film.camera), frames: &film.frames, camera: camera.camera })
    }

    /// The name of a frame in the report.
    fn named(&self, frame: &crate::Frame) -> String {
        format!("{}{}", self.name, frame.name)
    }
}

/// Refuses frames of which the report knows none.
fn check_names(result: &Path, report: &Report, mut names: impl Iterator<Item = String>) -> Result<(), FacewrightError> {
    let known = &report.frames;
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return Ok(()) };
    if names.any(|name| known.iter().any(|frame| frame.name == name)) {
        return Ok(());
    }
    let (first, last) = (first.name.clone(), last.name.clone());
    Err(FacewrightError::OtherFrames { path: result.join("report.json"), first, last })
}

fn draw(
    result: &Path,
    report: &Report,
    films: &[Film],
    folder: &Path,
    progress: &Progress,
) -> Result<Vec<String>, FacewrightError> {
    films.iter().try_for_each(|film| {
        film.frames.check_camera(&film.camera)?;
        film.frames.check_output(folder)
    })?;
    let all: Vec<(&Film, &crate::Frame)> =
        films.iter().flat_map(|film| film.frames.frames.iter().map(move |frame| (film, frame))).collect();
    check_names(result, report, all.iter().map(|(film, frame)| film.named(frame)))?;
    let nodes = read_nodes(&result.join("head.glb"))?;
    let layers: Vec<Layer> = nodes.iter().map(Node::layer).collect();
    let painter = Painter::new(&layers)?;
    progress.stage("overlay")?;
    let (done, total) = (AtomicUsize::new(0), films.iter().map(|film| film.frames.len()).sum());
    let draw = |(film, frame): (&Film, &crate::Frame)| -> Result<Option<(PathBuf, Vec<u8>)>, FacewrightError> {
        progress.step(done.fetch_add(1, Ordering::Relaxed), total)?;
        let name = film.named(frame);
        let pose = report.frames.iter().find(|f| f.name == name).and_then(|f| f.cam_from_head);
        let Some(pose) = pose else { return Ok(None) };
        let gain = report.texture.gains.get(&name).copied().unwrap_or([1.0; 3]);
        let options = DrawOptions { shading: report.texture.shading.as_ref(), gain, ..DrawOptions::default() };
        let picture = painter.draw(&film.camera, &pose, &options)?;
        Ok(Some((PathBuf::from(format!("{name}.png")), png(&picture)?)))
    };
    let drawn: Result<Vec<_>, _> = all.into_par_iter().map(draw).collect();
    let files: Vec<_> = drawn?.into_iter().flatten().collect();
    write_together(folder, &files)?;
    progress.done()?;
    Ok(files.iter().map(|(name, _)| name.with_extension("").display().to_string()).collect())
}
