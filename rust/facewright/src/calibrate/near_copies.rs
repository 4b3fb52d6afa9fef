//! Pictures that show the board where others do: they repeat the errors of those, and add nothing to what is known.
//!
//! A camera's uncertainty falls with the root of the number of pictures only where their errors are independent. What errs together with a
//! pose (a board that bends as it is held, light that shifts its corners) is the same in copies: they count as one.

use geometry::{Vec2, Vec3};
use motion::calibrate::{BoardView, CalibrateWarning, Calibration, ViewFit};

/// Corners that are this near to those of another picture on average, parts of the picture's diagonal, are a copy: a hand that means to hold
/// still moves by less, one that shows another view by several times as much.
const NEAR: f64 = 0.02;
/// … if the board is also tilted alike, radians: what is turned by more tells of the focal length.
const ALIKE: f64 = 0.05;
/// Relative uncertainty of the focal length from which is warned, as by the solver.
const FOCAL_DEVIATION: f64 = 0.005;

/// Raises the uncertainties of a calibration to those of as many pictures as show the board in places of their own.
pub(super) fn discount(solved: &mut Calibration, views: &[BoardView]) {
    let diagonal = f64::from(solved.camera.width).hypot(f64::from(solved.camera.height));
    let different = different(views, &solved.views, NEAR * diagonal);
    if different == views.len() {
        return;
    }
    let factor = (views.len() as f64 / different as f64).sqrt();
    let all = &mut solved.deviations;
    for deviation in [
        &mut all.fx,
        &mut all.fy,
        &mut all.cx,
        &mut all.cy,
        &mut all.k1,
        &mut all.k2,
        &mut all.k3,
        &mut all.p1,
        &mut all.p2,
    ] {
        *deviation *= factor;
    }
    let focal = (all.fx / solved.camera.fx).max(all.fy / solved.camera.fy);
    solved.warnings.retain(|warning| !matches!(warning, CalibrateWarning::UncertainFocal { .. }));
    if focal > FOCAL_DEVIATION {
        solved.warnings.push(CalibrateWarning::UncertainFocal { percent: 100.0 * focal });
    }
}

/// How many of the pictures are no copies of an earlier one.
fn different(views: &[BoardView], fits: &[ViewFit], near_px: f64) -> usize {
    let mut kept: Vec<(&BoardView, Vec3)> = Vec::new();
    for (view, fit) in views.iter().zip(fits) {
        let facing = fit.cam_from_board.rotation * Vec3::z();
        let is_copy = |(other, its): &(&BoardView, Vec3)| facing.angle(its) < ALIKE && is_near(view, other, near_px);
        if !kept.iter().any(is_copy) {
            kept.push((view, facing));
        }
    }
    kept.len()
}

/// Whether two pictures show the same part of a board at the same place.
fn is_near(a: &BoardView, b: &BoardView, near_px: f64) -> bool {
    if a.points != b.points {
        return false;
    }
    let squares: f64 = a.pixels.iter().zip(&b.pixels).map(|(a, b): (&Vec2, &Vec2)| (a - b).norm_squared()).sum();
    squares < near_px * near_px * a.pixels.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Board, Camera, SplitMix64, Transform};
    use motion::calibrate::{CalibrateOptions, calibrate};
    use nalgebra::Rotation3;

    /// Pictures of a board at each of some tilts, each copied with a trembling hand.
    fn pictures(tilts: usize, copies: usize) -> Vec<BoardView> {
        let (board, lens) = (Board::checkerboard(9, 6, 0.025), Camera::centred(640, 480, 600.0));
        let mut random = SplitMix64::new(11);
        let mut any = move || random.bits() as f64 / u64::MAX as f64 - 0.5;
        let mut views = Vec::new();
        for k in 0..tilts * copies {
            let tilt = (k % tilts) as f64 * 2.4;
            let turned =
                Rotation3::from_euler_angles(0.5 * tilt.sin() + 0.01 * any(), 0.5 * tilt.cos() + 0.01 * any(), 0.0);
            let pose = Transform::new(turned, Vec3::new(-0.1 + 0.001 * any(), -0.06, 0.5));
            let seen = |point: &Vec2| {
                lens.project(&pose.apply(&Vec3::new(point.x, point.y, 0.0))).unwrap()
                    + Vec2::new(0.2 * any(), 0.2 * any())
            };
            let pixels = board.points().iter().map(seen).collect();
            views.push(BoardView { points: board.points(), pixels });
        }
        views
    }

    #[test]
    fn near_copies_count_as_one_picture_in_the_uncertainty() {
        let once = pictures(6, 1);
        let copied = pictures(6, 4);
        let solve = |views: &[BoardView]| calibrate(views, 640, 480, &CalibrateOptions::default()).unwrap();
        let (plain, mut discounted) = (solve(&copied), solve(&copied));
        discount(&mut discounted, &copied);
        assert!((discounted.deviations.fx / plain.deviations.fx - 2.0).abs() < 1e-9);
        let mut single = solve(&once);
        let before = single.deviations;
        discount(&mut single, &once);
        assert_eq!(single.deviations, before, "pictures that differ stay as they are");
    }
}
