//! A head from the clips, or from one photograph each, of several calibrated cameras.

use crate::motion::Rig;
use crate::reconstruct::run;
use crate::{
    Assets, CalibratedRig, CameraSource, FacewrightError, FrameSet, Given, Method, ReconstructOptions, Reconstruction,
    ReportCamera, RigFrames, SourcedCamera,
};
use geometry::{Camera, Pinhole, Progress, Vec2};

/// The frames of all cameras together see at most so much more to each side than a camera without distortion would.
const WIDER: f64 = 1.5;

/// Reconstructs the head that the cameras of a rig filmed at the same moments, or took one photograph each of: their poses give its
/// poses and its true size. Nothing is written.
///
/// Frames are brought to one camera without distortion, which the result has as its camera; its frames are named
/// `left_0012` for frame `0012` of camera `left`.
///
/// # Errors
/// Those of [`crate::reconstruct()`]; [`FacewrightError::RigCamera`] for a camera that the rig does not have,
/// [`FacewrightError::OtherCamera`] for frames of another size, [`FacewrightError::RigPictures`] for clips of different lengths,
/// [`FacewrightError::RigMoments`] for clips of other moments, [`FacewrightError::RigNarrow`] for cameras that see no depth;
/// [`FacewrightError::Option`] for the paper's method, which knows of one camera, and for a known size.
///
/// # Examples
/// ```no_run
/// use facewright::{Assets, CalibratedRig, FrameSet, ReconstructOptions, RigFrames, reconstruct_on_rig};
/// use geometry::Progress;
/// use std::path::Path;
///
/// let progress = Progress::new();
/// let rig = CalibratedRig::read(Path::new("rig.json"))?;
/// let mut clips = Vec::new();
/// for camera in ["left", "right"] {
///     clips.push(RigFrames { camera: camera.to_owned(), frames: FrameSet::open(&[camera.into()], &progress)? });
/// }
/// let assets = Assets::load(&Assets::default_folder())?;
/// let head = reconstruct_on_rig(&clips, &rig, &assets, &ReconstructOptions::default(), &progress)?;
/// head.write(Path::new("out"))?;
/// # Ok::<(), facewright::FacewrightError>(())
/// ```
pub fn reconstruct_on_rig(
    films: &[RigFrames],
    rig: &CalibratedRig,
    assets: &Assets,
    options: &ReconstructOptions,
    progress: &Progress,
) -> Result<Reconstruction, FacewrightError> {
    options.validate()?;
    check(films, options)?;
    let mut cameras = Vec::with_capacity(films.len());
    for film in films {
        let camera = rig.camera(&film.camera)?.calibrated.camera.camera;
        film.frames.check_camera(&camera)?;
        cameras.push(ReportCamera { name: film.camera.clone(), camera });
    }
    let names: Vec<&str> = films.iter().map(|film| film.camera.as_str()).collect();
    let rig = Rig::new(rig, &names, films[0].frames.len())?;
    let camera = one_camera(&cameras);
    let with_maps = films
        .iter()
        .zip(&cameras)
        .map(|(film, own)| (film.camera.as_str(), &film.frames, own.camera.undistortion_map(&camera)));
    let of_films = with_maps.collect();
    let frames = FrameSet::of_films(of_films, (camera.width, camera.height));
    let given = Given { camera: Some(SourcedCamera { camera, source: CameraSource::Board }), ..Given::default() };
    let mut result = run(&frames, assets, &given, options, Some(&rig), progress)?;
    result.report.rig = cameras;
    Ok(result)
}

fn check(films: &[RigFrames], options: &ReconstructOptions) -> Result<(), FacewrightError> {
    if options.method == Method::Paper {
        return Err(FacewrightError::Option { name: "the method on a rig", expected: "the default one" });
    }
    if options.size.interocular_mm.is_some() || !options.size.lengths.is_empty() {
        return Err(FacewrightError::Option {
            name: "the size on a rig",
            expected: "left to the positions of its cameras",
        });
    }
    let is_once = |film: &RigFrames| films.iter().filter(|other| other.camera == film.camera).count() == 1;
    if films.len() < 2 || !films.iter().all(is_once) {
        return Err(FacewrightError::Option {
            name: "the clips of a rig",
            expected: "two or more, of different cameras",
        });
    }
    if films.iter().any(|film| film.frames.len() != films[0].frames.len()) {
        let counts = films.iter().map(|film| format!("{} of {}", film.frames.len(), film.camera));
        return Err(FacewrightError::RigPictures { counts: counts.collect::<Vec<_>>().join(", ") });
    }
    Ok(())
}

/// A camera without distortion in whose picture those of all cameras find room, none of them made smaller.
fn one_camera(cameras: &[ReportCamera]) -> Camera {
    let focal = cameras.iter().map(|own| own.camera.fx.max(own.camera.fy)).fold(0.0, f64::max);
    let corners = |camera: &Camera| {
        let size = Vec2::new(f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
        [Vec2::zeros(), size].map(|pixel| camera.normalise(&pixel))
    };
    let (mut low, mut high) = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    for own in cameras {
        let [all_low, all_high] = corners(&own.camera.pinhole(Pinhole::AllPixels));
        let [plain_low, plain_high] = corners(&own.camera.pinhole(Pinhole::SameFocal));
        low = low.inf(&all_low.sup(&(plain_low * WIDER)));
        high = high.sup(&all_high.inf(&(plain_high * WIDER)));
    }
    let size = (high - low) * focal;
    let (width, height) = (size.x.ceil() as u32 + 1, size.y.ceil() as u32 + 1);
    Camera { cx: -low.x * focal, cy: -low.y * focal, ..Camera::centred(width, height, focal) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_of_every_camera_has_room_and_none_shrinks() {
        let lenses = [
            Camera { k1: -0.2, k2: 0.03, cx: 170.0, ..Camera::centred(352, 288, 300.0) },
            Camera { k1: 0.1, ..Camera::centred(640, 480, 700.0) },
        ];
        let cameras = lenses.map(|camera| ReportCamera { name: String::new(), camera });
        let one = one_camera(&cameras);
        assert_eq!((one.fx, one.fy, one.k1), (700.0, 700.0, 0.0));
        for camera in &lenses {
            let (right, bottom) = (f64::from(camera.width) - 1.0, f64::from(camera.height) - 1.0);
            for corner in [Vec2::zeros(), Vec2::new(right, 0.0), Vec2::new(0.0, bottom), Vec2::new(right, bottom)] {
                let at = one.distort(&camera.normalise(&corner));
                assert!(at.min() > -1e-6 && at.x < f64::from(one.width) && at.y < f64::from(one.height), "{at}");
            }
        }
    }
}
