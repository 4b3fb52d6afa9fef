//! Ears that keep their form.
//!
//! An ear is seen by few points, and many of them lie on hair or on the wall behind it: what moves single vertices tears it. It is moved as
//! one piece, by the similarity that takes the generic ear to the skin that it grows on and to what was measured of it, within
//! what ears of people do.
//!
//! # Entry points
//! [`keep_ears`]; [`ear_vertices`]: which they are.

use crate::GenericHead;
use geometry::{Similarity, Transform, Vec3, smooth_step};
use nalgebra::Rotation3;

/// Skin within this of the middle of an ear is ear …
const EAR: f64 = 0.034;
/// … and from here on it is not, metres on the generic head. Ears are 50 to 75 mm long.
const ROOT: f64 = 0.046;
/// The outermost points are not higher or lower than this, metres.
const LEVEL: f64 = 0.06;
/// What the skin around says of an ear's place is half believed: from the cheeks it is guessed as badly as ears of people differ.
const BELIEVED: f64 = 0.5;
/// Ears lie within this of where the head's form puts them, metres …
const FARTHEST: f64 = 0.009;
/// … turned by no more than this, radians: ears that stand off do by some 15 degrees more than the average …
const MOST_TURNED: f64 = 0.25;
/// … and are longer or shorter than the head suggests by no more than this factor: 50 and 75 mm against 61.
const LARGEST: f64 = 1.22;

/// Moves both ears of `positions` (all vertices, metres) as one piece each. `placed` is the generic head where the head is.
pub fn keep_ears(generic: &GenericHead, positions: &mut [Vec3], placed: &[Vec3]) {
    for side in [1.0, -1.0] {
        let Some(ear) = Ear::find(generic, side) else { continue };
        let from: Vec<Vec3> = ear.vertices.iter().map(|v| placed[v.0]).collect();
        let to: Vec<Vec3> = ear.vertices.iter().map(|v| positions[v.0]).collect();
        let Some(fit) = Similarity::fit(&from, &to, None, true) else { continue };
        let centre = from.iter().sum::<Vec3>() / from.len() as f64;
        let moved = bounded(&fit, &centre);
        for (&(v, share), from) in ear.vertices.iter().zip(&from) {
            positions[v] = positions[v].lerp(&moved.apply(from), share);
        }
    }
}

/// The vertices of both ears.
pub fn ear_vertices(generic: &GenericHead) -> Vec<usize> {
    let ears = [1.0, -1.0].into_iter().filter_map(|side| Ear::find(generic, side));
    ears.flat_map(|ear| ear.vertices).filter(|(_, share)| *share >= 1.0).map(|(v, _)| v).collect()
}

/// The vertices of an ear with what is taken of the one piece.
struct Ear {
    vertices: Vec<(usize, f64)>,
}

impl Ear {
    fn find(generic: &GenericHead, side: f64) -> Option<Self> {
        let place = &generic.positions;
        let level = |&v: &usize| !generic.cavity[v] && place[v].y.abs() < LEVEL;
        let skin = || generic.skin().vertices.clone();
        let tip = skin().filter(level).max_by(|&a, &b| (side * place[a].x).total_cmp(&(side * place[b].x)))?;
        let around: Vec<Vec3> = skin().filter(|&v| (place[v] - place[tip]).norm() < EAR).map(|v| place[v]).collect();
        let centre = around.iter().sum::<Vec3>() / around.len() as f64;
        let share = |v: usize| smooth_step(ROOT, EAR, (place[v] - centre).norm());
        let vertices: Vec<(usize, f64)> = skin().map(|v| (v, share(v))).filter(|(_, share)| *share > 0.0).collect();
        (vertices.len() > 3).then_some(Self { vertices })
    }
}

/// A similarity about `centre`, no larger than ears of people differ.
fn bounded(fit: &Similarity, centre: &Vec3) -> Similarity {
    let shift = (fit.apply(centre) - centre) * BELIEVED;
    let shift = shift * (FARTHEST / shift.norm().max(FARTHEST));
    let turn = fit.rigid.rotation.angle();
    let rotation =
        fit.rigid.rotation.axis().map_or_else(Rotation3::identity, |axis| {
            Rotation3::from_axis_angle(&axis, (turn * BELIEVED).min(MOST_TURNED))
        });
    let scale = fit.scale.powf(BELIEVED).clamp(1.0 / LARGEST, LARGEST);
    let translation = centre + shift - (rotation * centre) * scale;
    Similarity { scale, rigid: Transform::new(rotation, translation) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{asset, person};

    fn ear(generic: &GenericHead, side: f64) -> Vec<usize> {
        let ear = Ear::find(generic, side).unwrap();
        ear.vertices.into_iter().filter(|(_, share)| *share >= 1.0).map(|(v, _)| v).collect()
    }

    /// Least-squares similarity and what it leaves, metres.
    fn against(generic: &GenericHead, positions: &[Vec3], ear: &[usize]) -> (Similarity, f64) {
        let pick = |of: &[Vec3]| ear.iter().map(|&v| of[v]).collect::<Vec<_>>();
        let (from, to) = (pick(&generic.positions), pick(positions));
        let fit = Similarity::fit(&from, &to, None, true).unwrap();
        let left = from.iter().zip(&to).map(|(a, b)| (fit.apply(a) - b).norm()).fold(0.0, f64::max);
        (fit, left)
    }

    #[test]
    fn torn_ears_are_whole_again() {
        let Some(generic) = asset() else { return };
        for side in [1.0, -1.0] {
            let ear = ear(&generic, side);
            assert!((150..700).contains(&ear.len()), "{}", ear.len());
            let mut torn = generic.positions.clone();
            for (k, &v) in ear.iter().enumerate() {
                torn[v] += Vec3::new(side * 0.03, 0.004 * (k % 5) as f64, -0.01) * f64::from(u8::from(k % 3 == 0));
            }
            keep_ears(&generic, &mut torn, &generic.positions);
            let (fit, left) = against(&generic, &torn, &ear);
            assert!(left < 1e-9 && (0.8..1.25).contains(&fit.scale), "{left} {}", fit.scale);
            let moved = ear.iter().map(|&v| (torn[v] - generic.positions[v]).norm()).fold(0.0, f64::max);
            assert!(moved < 0.025, "{moved}");
        }
    }

    #[test]
    fn an_ear_that_was_pulled_away_stays_within_what_ears_do() {
        let Some(generic) = asset() else { return };
        let ear = ear(&generic, 1.0);
        let mut pulled = generic.positions.clone();
        ear.iter().for_each(|&v| pulled[v] += Vec3::new(0.06, 0.0, 0.0));
        keep_ears(&generic, &mut pulled, &generic.positions);
        let middle = |of: &[Vec3]| ear.iter().map(|&v| of[v]).sum::<Vec3>() / ear.len() as f64;
        assert!((middle(&pulled) - middle(&generic.positions)).norm() < 0.0125);
    }

    #[test]
    fn ears_of_other_people_are_moved_by_a_part_of_what_they_differ() {
        let Some(generic) = asset() else { return };
        let apart = |a: &[Vec3], b: &[Vec3]| {
            geometry::median(ear(&generic, 1.0).iter().map(|&v| (a[v] - b[v]).norm())).unwrap()
        };
        for seed in 0..4 {
            let before = person(&generic, seed, 1.0, 0.0);
            let mut kept = before.clone();
            keep_ears(&generic, &mut kept, &generic.positions);
            let (moved, differs) = (apart(&kept, &before), apart(&before, &generic.positions));
            // Half of the place, and the form with it.
            assert!(moved < 0.85 * differs && apart(&kept, &generic.positions) < differs, "{moved} of {differs}");
        }
    }
}
