//! Pictures without lens distortion.

use crate::camera::starting_camera;
use crate::files::{Stage, json_text, unwritable};
use crate::frames::resampled;
use crate::{FacewrightError, FrameSet, SourcedCamera};
use clap::{Args, ValueEnum};
use geometry::{Pinhole, Progress};
use image::ImageFormat;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Which part of a picture is kept when its distortion is taken out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Keep {
    /// The same focal lengths and principal point
    #[default]
    SameFocal,
    /// Every pixel of the filmed picture, with empty corners
    AllPixels,
    /// The largest rectangle without empty pixels
    NoEmptyPixels,
}

impl From<Keep> for Pinhole {
    fn from(keep: Keep) -> Self {
        match keep {
            Keep::SameFocal => Self::SameFocal,
            Keep::AllPixels => Self::AllPixels,
            Keep::NoEmptyPixels => Self::NoEmptyPixels,
        }
    }
}

/// How [`undistort`] works.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct UndistortOptions {
    /// Which part of the picture is kept
    #[arg(long, value_enum, default_value_t)]
    pub keep: Keep,
}

/// Writes each picture as PNG under its name, as a pinhole camera would have taken it, and that camera as `camera.json`; the
/// camera is returned. Where the lens shows nothing, pixels are black. All are written, or none, and never into the pictures' own
/// folder.
///
/// # Examples
/// ```no_run
/// use facewright::{FrameSet, SourcedCamera, UndistortOptions, undistort};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let frames = FrameSet::open(&["clip.mp4".into()], &progress)?;
/// let camera = SourcedCamera::read(Path::new("camera.json"))?;
/// let pinhole = undistort(&frames, &camera, &UndistortOptions::default(), Path::new("undistorted"), &progress)?;
/// assert_eq!(pinhole.camera.k1, 0.0);
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn undistort(
    pictures: &FrameSet,
    camera: &SourcedCamera,
    options: &UndistortOptions,
    folder: &Path,
    progress: &Progress,
) -> Result<SourcedCamera, FacewrightError> {
    let lens = starting_camera(pictures, Some(camera))?.camera;
    let pinhole = lens.pinhole(options.keep.into());
    let map = lens.undistortion_map(&pinhole);
    pictures.check_output(folder)?;
    let stage = Stage::inside(folder)?;
    let mut names: Vec<PathBuf> = pictures.frames.iter().map(|frame| format!("{}.png", frame.name).into()).collect();
    progress.stage("undistort")?;
    let done = AtomicUsize::new(0);
    (0..pictures.len()).into_par_iter().try_for_each(|i| {
        progress.step(done.fetch_add(1, Ordering::Relaxed), pictures.len())?;
        let picture = resampled(&pictures.load(i)?, &map);
        let mut bytes = Vec::new();
        let encoded = picture.write_to(&mut Cursor::new(&mut bytes), ImageFormat::Png);
        encoded.map_err(|e| unwritable(&folder.join(&names[i]), &e))?;
        stage.write(&names[i], &bytes)
    })?;
    let pinhole = SourcedCamera { camera: pinhole, source: camera.source };
    names.push("camera.json".into());
    stage.write(Path::new("camera.json"), json_text(&pinhole).as_bytes())?;
    stage.put(names.iter().map(PathBuf::as_path))?;
    Ok(pinhole)
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Camera, Vec3};
    use image::{Rgb, RgbImage};

    #[test]
    fn straight_lines_become_straight() {
        let lens = Camera { k1: -0.3, k2: 0.1, ..Camera::centred(320, 240, 250.0) };
        // A vertical edge in space, at x = 0.4 of depth 1.
        let picture = RgbImage::from_fn(320, 240, |x, y| {
            let ray = lens.ray(&geometry::Vec2::new(f64::from(x), f64::from(y)));
            Rgb([if ray.x / ray.z < 0.4 { 30 } else { 220 }; 3])
        });
        let pinhole = lens.pinhole(Pinhole::SameFocal);
        let straight = resampled(&picture, &lens.undistortion_map(&pinhole));
        let expected = pinhole.project(&Vec3::new(0.4, 0.0, 1.0)).map_or(0.0, |p| p.x);
        for y in [10, 60, 120, 200, 230] {
            let edge = (0..320).find(|&x| straight.get_pixel(x, y)[0] > 125).map_or(0.0, f64::from);
            assert!((edge - expected).abs() < 1.6, "row {y}: {edge} {expected}");
        }
    }
}
