//! How good a motion with its points is, whatever frame and unit it comes in.

use super::{Answer, Case, Film, Truth};
use crate::clock::{median, rms};
use crate::feature::Figure;
use crate::results::Run;
use crate::shape::{errors_mm, similarity_of_most};
use geometry::{Camera, Similarity, Transform, Vec2, Vec3};

/// Errors of a pose where there is none: as wrong as it can be, in degrees and in percent of the distance.
const NO_POSE: (f64, f64) = (180.0, 100.0);

/// Errors of one film.
struct Errors {
    /// Of every frame's turn, degrees.
    turns: Vec<f64>,
    /// Of the camera's place in the head frame, for every frame, percent of the distance.
    shifts: Vec<f64>,
    /// Of every placed point, millimetres.
    points: Vec<f64>,
    /// Of every right observation of a posed frame and a placed point, pixels.
    pixels: Vec<f64>,
    /// Of the focal length, percent.
    focal: f64,
}

/// Every figure of a run, over all films. A frame without a pose counts among the wrong ones; a point without a place does
/// not count, for some are seen from one side only: how many were placed stands beside.
pub fn figures(run: &Run<Vec<Answer>>, case: &Case, truths: &[Truth]) -> Vec<Figure> {
    let films = run.answer.iter().zip(&case.films).zip(truths);
    let errors: Vec<Errors> = films.map(|((answer, film), truth)| errors(answer, case, film, truth)).collect();
    let all = |of: fn(&Errors) -> &Vec<f64>| errors.iter().flat_map(of).copied().collect::<Vec<f64>>();
    let posed = run.answer.iter().flat_map(|answer| &answer.poses).flatten().count();
    let percent = |found: usize, of_a_film: usize| 100.0 * found as f64 / (of_a_film * case.films.len()) as f64;
    let points = all(|errors| &errors.points);
    let mut figures = vec![
        Figure::cost("ms", run.time("map")),
        Figure::cost("ms with verification", run.time("map") + run.time("verify")),
        Figure::gain("frames posed, %", percent(posed, case.frames)),
        Figure::cost("rotation error, degrees", median(all(|errors| &errors.turns))),
        Figure::cost("position error, % of the distance", median(all(|errors| &errors.shifts))),
        Figure::gain("points placed, %", percent(points.len(), case.points)),
        Figure::cost("error of points, mm", median(points)),
        Figure::cost("reprojection of right observations, px RMS", rms(&all(|errors| &errors.pixels))),
    ];
    if case.refine_focal {
        figures.push(Figure::cost("focal length error, %", median(errors.iter().map(|errors| errors.focal).collect())));
    }
    figures
}

fn errors(answer: &Answer, case: &Case, film: &Film, truth: &Truth) -> Errors {
    let (places, true_places) = placed(answer, truth);
    // The points bring the frame of the answer to the head's.
    let fit = similarity_of_most(&places, &true_places);
    let (turns, shifts) = pose_errors(answer, truth, fit.as_ref());
    Errors {
        turns,
        shifts,
        points: fit.map_or_else(Vec::new, |fit| errors_mm(&fit, &places, &true_places)),
        pixels: reprojection_px(answer, &case.camera, film, truth),
        focal: 100.0 * (answer.focal_px / truth.focal_px - 1.0).abs(),
    }
}

/// The points that were placed, and the true ones.
fn placed(answer: &Answer, truth: &Truth) -> (Vec<Vec3>, Vec<Vec3>) {
    let both = answer.points.iter().zip(&truth.points);
    both.filter_map(|(place, truth)| Some((Vec3::from((*place)?), Vec3::from(*truth)))).unzip()
}

/// The error of every frame's turn, degrees, and of the camera's place in the head frame, percent of the distance.
fn pose_errors(answer: &Answer, truth: &Truth, fit: Option<&Similarity>) -> (Vec<f64>, Vec<f64>) {
    let of_frame = |(pose, truth): (&Option<Transform>, &Transform)| {
        let moved = pose.as_ref().zip(fit).map(|(pose, fit)| fit.move_pose(pose));
        moved.map_or(NO_POSE, |pose| {
            let [eye, true_eye] = [&pose, truth].map(|pose| pose.inverse().translation);
            (pose.angle_to(truth).to_degrees(), 100.0 * (eye - true_eye).norm() / true_eye.norm())
        })
    };
    answer.poses.iter().zip(&truth.poses).map(of_frame).unzip()
}

/// How far the right observations of posed frames and placed points are from where the answer sees them.
fn reprojection_px(answer: &Answer, camera: &Camera, film: &Film, truth: &Truth) -> Vec<f64> {
    let camera = Camera { fx: answer.focal_px, fy: answer.focal_px, ..*camera };
    let right = film.observations.iter().zip(&truth.wrong).filter(|(_, wrong)| !**wrong);
    let distance = |((frame, point, pixel), _): (&(usize, usize, [f64; 2]), &bool)| {
        let in_cam = answer.poses[*frame]?.apply(&Vec3::from(answer.points[*point]?));
        Some(camera.project(&in_cam).map_or(f64::INFINITY, |seen| (seen - Vec2::from(*pixel)).norm()))
    };
    right.filter_map(distance).collect()
}

#[cfg(test)]
mod tests {
    use super::super::cases::KINDS;
    use super::*;
    use nalgebra::Rotation3;
    use std::collections::BTreeMap;

    fn value(figures: &[Figure], what: &str) -> f64 {
        figures.iter().find(|figure| figure.what == what).unwrap().value
    }

    #[test]
    fn the_truth_in_another_frame_and_unit_has_no_error_but_the_noise() {
        let (case, truths) = KINDS[1].case();
        let turn = Rotation3::new(Vec3::new(0.3, 0.2, -0.9));
        let moved = Similarity { scale: 7.0, rigid: Transform::new(turn, Vec3::new(1.0, -2.0, 0.5)) };
        let answer = |truth: &Truth| Answer {
            focal_px: truth.focal_px,
            poses: truth.poses.iter().map(|pose| Some(moved.move_pose(pose))).collect(),
            points: truth.points.iter().map(|p| Some(moved.apply(&Vec3::from(*p)).into())).collect(),
        };
        let mut answer: Vec<Answer> = truths.iter().map(answer).collect();
        answer.iter_mut().for_each(|answer| (answer.poses[3], answer.points[5]) = (None, None));
        let (case_name, none) = (case.name.clone(), String::new());
        let run = Run { case: case_name, task: none.clone(), setting: none, times_ms: BTreeMap::new(), answer };
        let found = figures(&run, &case, &truths);
        for what in ["rotation error, degrees", "error of points, mm", "focal length error, %"] {
            assert!(value(&found, what) < 1e-6, "{what}");
        }
        assert!((value(&found, "frames posed, %") - 100.0 * 23.0 / 24.0).abs() < 1e-9);
        let noise = value(&found, "reprojection of right observations, px RMS");
        assert!((noise - case.sigma_px * 2.0_f64.sqrt()).abs() < 0.02, "{noise}");
    }
}
