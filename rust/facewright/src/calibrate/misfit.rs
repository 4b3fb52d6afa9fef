//! Whether a lens that its model does not fit is taken for a bent board.
//!
//! Both leave errors that no single picture explains. Those of a lens depend on the distance from the picture's middle alone, whatever
//! the board's pose; those of a board on the place on the board. So it is measured how much of the squared error either explains.

use super::CalibrateOptions;
use geometry::Vec2;
use motion::calibrate::{BoardView, Calibration};
use nalgebra::{SMatrix, SVector};

/// Part of the squared error that matters, as of a bend of the board. Of five cameras that the model fits it is 0.02 at most; of fisheyes, 0.5 to 0.9.
const CLEAR_SHARE: f64 = 0.1;
/// Odd powers of the distance from the middle: more than any lens model here has.
const POWERS: usize = 5;

/// What to say of a calibration whose lens is the cause of its errors, rather than the board.
pub(super) fn warning(calibration: &Calibration, views: &[BoardView], options: &CalibrateOptions) -> Option<String> {
    let share = of_lens(calibration, views);
    let of_board = calibration.bend.map_or(0.0, |bend| bend.explained);
    if share < CLEAR_SHARE || share < of_board {
        return None;
    }
    let terms = if options.distortion_terms < 3 { "use --distortion-terms 3, or " } else { "" };
    Some(format!(
        "the lens does not follow the model: {:.0} % of the squared error of {:.2} px depend on the distance from the picture's \
         middle alone, as with a fisheye. To measure it, {terms}film with a lens that is less wide",
        100.0 * share,
        calibration.rms_px
    ))
}

/// Part of the squared error of a calibration that a displacement along the radius, a function of the radius alone, explains; 0 where
/// there is no error.
fn of_lens(calibration: &Calibration, views: &[BoardView]) -> f64 {
    let camera = &calibration.camera;
    let middle = Vec2::new(camera.cx, camera.cy);
    let reach = f64::from(camera.width).hypot(f64::from(camera.height)) / 2.0;
    let (mut normal, mut side) = (SMatrix::<f64, POWERS, POWERS>::zeros(), SVector::<f64, POWERS>::zeros());
    let mut squares = 0.0;
    for (view, fit) in views.iter().zip(&calibration.views) {
        for (pixel, residual) in view.pixels.iter().zip(&fit.residuals) {
            let (outwards, error) = (pixel - middle, Vec2::from(*residual));
            let radius = outwards.norm().max(f64::MIN_POSITIVE);
            let powers = SVector::<f64, POWERS>::from_fn(|k, _| (radius / reach).powi(2 * k as i32 + 1));
            normal += powers * powers.transpose();
            side += powers * error.dot(&(outwards / radius));
            squares += error.norm_squared();
        }
    }
    let explained = normal.lu().solve(&side).map_or(0.0, |solution| solution.dot(&side));
    if squares > 0.0 { explained / squares } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Board, Camera, SplitMix64, Vec3};
    use nalgebra::Rotation3;

    /// Pictures of a board, by a lens that puts a direction at a distance from the middle by its angle.
    fn views(radius: impl Fn(f64) -> f64, bulge: f64) -> Vec<BoardView> {
        let board = Board::checkerboard(9, 6, 0.03);
        let mut random = SplitMix64::new(5);
        let mut noise = move || 0.05 * ((0..3).map(|_| random.bits() as f64 / u64::MAX as f64 - 0.5).sum::<f64>());
        let middle = board.points().iter().sum::<Vec2>() / board.points().len() as f64;
        let view = |k: usize| {
            let (tilt, across) = (k as f64 * 2.4, [-0.35, 0.0, 0.35][k % 3]);
            let turned = Rotation3::from_euler_angles(0.5 * tilt.sin(), 0.5 * tilt.cos(), 0.1 * tilt);
            let seen = |point: &Vec2| {
                let flat = point - middle;
                let x = turned * Vec3::new(flat.x, flat.y, bulge * flat.norm_squared())
                    + Vec3::new(across * 0.4, 0.25 * across, 0.28);
                let outwards = Vec2::new(x.x, x.y);
                let angle = outwards.norm().atan2(x.z);
                Vec2::new(319.5, 239.5) + outwards.normalize() * radius(angle) + Vec2::new(noise(), noise())
            };
            BoardView { points: board.points(), pixels: board.points().iter().map(seen).collect() }
        };
        (0..12).map(view).collect()
    }

    fn said(views: &[BoardView]) -> Option<String> {
        let options = CalibrateOptions::default();
        let calibration = motion::calibrate::calibrate(views, 640, 480, &options.model()).unwrap();
        warning(&calibration, views, &options)
    }

    #[test]
    fn a_fisheye_is_no_bent_board_and_a_bent_board_no_fisheye() {
        let plain = Camera { k1: -0.1, ..Camera::centred(640, 480, 500.0) };
        let pinhole = |angle: f64| 500.0 * plain.distort(&Vec2::new(angle.tan(), 0.0)).x / 500.0 - 319.5;
        assert_eq!(said(&views(pinhole, 0.0)), None);
        assert_eq!(said(&views(pinhole, 0.05)), None, "a board that bulges");
        let fisheye = said(&views(|angle| 300.0 * angle, 0.0)).unwrap();
        assert!(fisheye.contains("the lens does not follow the model") && fisheye.contains("--distortion-terms 3"));
    }
}
