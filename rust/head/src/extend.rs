//! A shape continued over skin that was not measured.
//!
//! # Entry point
//! [`extend`]: the guess there (an average head, lids and lips of the class), moved by a smooth field that takes the guess to the
//! measured skin around. The field fades, so that what lies far from everything measured is the guess itself.

use geometry::{SmoothField, Spread, Vec3};
use rayon::prelude::*;

/// Skin that is measured holds the field at this many places at most.
const KNOTS: usize = 320;
/// Variance of the measured skin's detail over that of what it differs from the guess by.
const DETAIL: f64 = 0.01;

/// All vertices, metres: `measured` where `share` is 1, what continues it where `share` is 0, a mixture between. `guess` lies on the
/// measured skin as well as it can. Only `skin` holds the field. The guess where nothing was measured.
pub fn extend(
    measured: &[Vec3],
    guess: &[Vec3],
    share: &[f64],
    skin: std::ops::Range<usize>,
    length: f64,
) -> Vec<Vec3> {
    let held: Vec<usize> = skin.filter(|&v| share[v] >= 1.0).collect();
    let all: Vec<Vec3> = held.iter().map(|&v| guess[v]).collect();
    let knots: Vec<usize> = Spread::over(&all, KNOTS).chosen.into_iter().map(|k| held[k]).collect();
    let places: Vec<Vec3> = knots.iter().map(|&v| guess[v]).collect();
    let moves: Vec<Vec3> = knots.iter().map(|&v| measured[v] - guess[v]).collect();
    let Some(field) = SmoothField::fit(&places, &moves, length, DETAIL) else { return measured.to_vec() };
    let place = |v: usize| {
        if share[v] >= 1.0 {
            return measured[v];
        }
        (guess[v] + field.at(&guess[v])).lerp(&measured[v], share[v].max(0.0))
    };
    (0..measured.len()).into_par_iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::testing::toy_head;

    /// The front of the toy as another person's, and a wild guess of the class behind it.
    fn measured(guess: &[Vec3]) -> (Vec<Vec3>, Vec<f64>) {
        let person = |p: &Vec3| p + Vec3::new(0.0, 0.004 * (p.x * 20.0).cos(), 0.006);
        let steeple = |p: &Vec3| person(p) + Vec3::y() * (0.4 * (-0.08 - p.z).max(0.0));
        let share = |p: &Vec3| geometry::smooth_step(-0.07, -0.05, p.z);
        (guess.iter().map(steeple).collect(), guess.iter().map(share).collect())
    }

    #[test]
    fn the_rim_is_continued_and_the_far_side_is_the_guess() {
        let head = toy_head();
        let (positions, share) = measured(&head.positions);
        let whole = extend(&positions, &head.positions, &share, head.skin().vertices.clone(), 0.03);
        let off = |v: usize| (whole[v] - head.positions[v]).norm();
        for v in head.skin().vertices.clone() {
            let z = head.positions[v].z;
            if share[v] >= 1.0 {
                assert_eq!(whole[v], positions[v]);
            } else if z > -0.075 {
                assert!((whole[v] - positions[v]).norm() < 0.004, "{}", (whole[v] - positions[v]).norm());
            } else if z < -0.16 {
                assert!(off(v) < 0.0015, "{}", off(v));
            }
        }
        let steeple = head.skin().vertices.clone().map(off).fold(0.0, f64::max);
        assert!(steeple < 0.012, "{steeple}");
    }

    #[test]
    fn the_skin_has_no_step_where_measuring_ends() {
        let head = toy_head();
        let (positions, share) = measured(&head.positions);
        let whole = extend(&positions, &head.positions, &share, head.skin().vertices.clone(), 0.03);
        for [a, b] in geometry::mesh::quad_edges(&head.quads[head.skin().quads.clone()]) {
            let (a, b) = (a as usize, b as usize);
            let stretch = (whole[a] - whole[b]).norm() / (head.positions[a] - head.positions[b]).norm();
            assert!((0.6..1.6).contains(&stretch), "{stretch}");
        }
    }

    #[test]
    fn where_nothing_was_measured_there_is_the_guess() {
        let head = toy_head();
        let none = vec![0.0; head.positions.len()];
        let wild: Vec<Vec3> = head.positions.iter().map(|p| p * 2.0).collect();
        assert_eq!(extend(&wild, &head.positions, &none, head.skin().vertices.clone(), 0.03), head.positions);
    }
}
