//! Two cameras whose places are known as well as a calibration tells them.

use facewright::{CalibratedCamera, CalibratedRig, CameraSource, MountedCamera, Schema, SourcedCamera};
use geometry::{Camera, Transform};
use motion::calibrate::rig::Mount;
use nalgebra::{Matrix6, Vector6};
use synthetic::Random;

/// What the rig's calibration leaves open: turns about each axis, radians, and shifts, metres.
const MOUNT_SIGMAS: (f64, f64) = (2e-4, 5e-5);
/// Cameras `left` and `right` as a calibration would have found them; the second one is off by its own deviations.
pub fn rig(lenses: [Camera; 2], true_place: Transform) -> CalibratedRig {
    let mut random = Random::new(21);
    let (turn, shift) = MOUNT_SIGMAS;
    let sigmas = [turn, turn, turn, shift, shift, shift];
    let place = true_place.retract(&Vector6::from_fn(|k, _| sigmas[k] * random.normal()));
    let covariance = Matrix6::from_fn(|i, j| if i == j { sigmas[i] * sigmas[i] } else { 0.0 });
    let mounted = |name: &str, camera: usize, camera_from_rig: Transform, covariance: Matrix6<f64>| MountedCamera {
        name: name.to_owned(),
        calibrated: CalibratedCamera {
            schema: Schema,
            camera: SourcedCamera { camera: lenses[camera], source: CameraSource::Board },
            rms_px: 0.1,
            hold_out_rms_px: None,
            deviations: motion::calibrate::CameraDeviations::default(),
            bend: None,
            boards: Vec::new(),
            images: Vec::new(),
            warnings: Vec::new(),
        },
        mount: Mount {
            camera_from_rig,
            rotation_deviations: [turn; 3],
            translation_deviations: [shift; 3],
            covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
            baseline: camera_from_rig.translation.norm(),
            baseline_deviation: shift,
        },
    };
    let cameras =
        vec![mounted("left", 0, Transform::identity(), Matrix6::zeros()), mounted("right", 1, place, covariance)];
    CalibratedRig { schema: Schema, cameras, rms_px: 0.1, hold_out_rms_px: None, warnings: Vec::new() }
}
