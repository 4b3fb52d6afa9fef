//! Lids, lips and what lies behind them.
//!
//! Points on lids and lips move, blink and hide, and a surface drawn through the few that were tracked opens one eye wider than the
//! other and turns lips over. The class of heads knows their form better; it is set into the measured skin around them.
//!
//! # Entry point
//! [`set_soft_parts`]

use crate::GenericHead;
use crate::extend::extend;
use geometry::{Similarity, Vec3, smooth_step};
use rayon::prelude::*;

/// Skin within the first of the edges of lids and of lips is theirs, beyond the second it is none of theirs, metres on the generic head.
/// Of a face that moves, all of them: a lid is 10 mm high, and so is a lip …
const MOVED: (f64, f64) = (0.004, 0.011);
/// … of one that keeps still, what blinks and hides.
const STILL: (f64, f64) = (0.002, 0.006);
/// How far they follow the skin around, metres.
const LENGTH: f64 = 0.03;

/// All vertices, metres: those of `positions` with lids, lips and hidden skin of `form`, a head of the class. Of lips that
/// `moved` by a share of 1 while they were filmed, the whole is not believed; of lips that kept still only the edges are not.
pub fn set_soft_parts(generic: &GenericHead, positions: &[Vec3], form: &[Vec3], moved: f64) -> Vec<Vec3> {
    let share = measured_share(generic, moved);
    let skin = generic.skin().vertices.clone();
    let firm: Vec<usize> = skin.clone().filter(|&v| share[v] >= 1.0).collect();
    let pick = |of: &[Vec3]| firm.iter().map(|&v| of[v]).collect::<Vec<_>>();
    let Some(fit) = Similarity::fit(&pick(form), &pick(positions), None, true) else { return positions.to_vec() };
    let guess: Vec<Vec3> = form.iter().map(|p| fit.apply(p)).collect();
    extend(positions, &guess, &share, skin, LENGTH)
}

/// Of each vertex, how far what is measured there is believed, 0 (lids, lips and cavities) … 1; lips that `moved` are not at all.
pub fn measured_share(generic: &GenericHead, moved: f64) -> Vec<f64> {
    firm_share(generic, (STILL.0 + (MOVED.0 - STILL.0) * moved, STILL.1 + (MOVED.1 - STILL.1) * moved))
}

/// Of each vertex, 0 within the first distance of the edges of lids and lips (metres on the generic head) and in the cavities, 1 beyond
/// the second.
pub(crate) fn firm_share(generic: &GenericHead, (soft, firm): (f64, f64)) -> Vec<f64> {
    let contacts = generic.lid_contacts.iter().flatten().chain(&generic.lip_contacts).flatten();
    let edges: Vec<Vec3> = contacts.map(|&v| generic.positions[v as usize]).collect();
    let share = |v: usize| {
        let place = &generic.positions[v];
        let nearest = edges.iter().map(|e| (e - place).norm_squared()).fold(f64::INFINITY, f64::min).sqrt();
        if generic.cavity[v] { 0.0 } else { smooth_step(soft, firm, nearest) }
    };
    (0..generic.positions.len()).into_par_iter().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{asset, person};

    /// Widest opening of an eye, metres.
    fn opening(generic: &GenericHead, positions: &[Vec3], side: usize) -> f64 {
        let pairs = generic.lid_contacts[side].iter();
        pairs.map(|[a, b]| (positions[*a as usize] - positions[*b as usize]).norm()).fold(0.0, f64::max)
    }

    fn distance(a: &[Vec3], b: &[Vec3], vertices: impl Iterator<Item = usize>) -> f64 {
        vertices.map(|v| (a[v] - b[v]).norm()).fold(0.0, f64::max)
    }

    #[test]
    fn lids_that_points_pulled_apart_are_level_again() {
        let Some(generic) = asset() else { return };
        let truth = person(&generic, 2, 1.0, 0.0);
        let mut pulled = truth.clone();
        for [upper, _] in &generic.lid_contacts[0] {
            pulled[*upper as usize] += Vec3::y() * 0.004;
        }
        let set = set_soft_parts(&generic, &pulled, &truth, 0.0);
        let wide = [0, 1].map(|side| (opening(&generic, &set, side) - opening(&generic, &truth, side)).abs());
        assert!(wide[0] < 5e-4 && wide[1] < 5e-4, "{wide:?}");
    }

    #[test]
    fn measured_skin_stays_and_lips_that_moved_are_not_believed() {
        let Some(generic) = asset() else { return };
        let truth = person(&generic, 4, 1.0, 0.0);
        let firm = firm_share(&generic, MOVED);
        let pout: Vec<Vec3> = truth.iter().zip(&firm).map(|(p, firm)| p + Vec3::z() * (0.006 * (1.0 - firm))).collect();
        let lips = || generic.lip_contacts.iter().flatten().map(|&v| v as usize);
        let [still, moved] = [0.0, 1.0].map(|moved| set_soft_parts(&generic, &pout, &truth, moved));
        assert_eq!(distance(&moved, &pout, (0..pout.len()).filter(|&v| firm[v] >= 1.0)), 0.0);
        let off = |of: &[Vec3]| distance(of, &truth, lips());
        assert!(off(&moved) < 0.001 && off(&still) > 2.0 * off(&moved), "{} {}", off(&moved), off(&still));
    }

    #[test]
    fn a_head_of_the_class_is_left_as_it_is() {
        let Some(generic) = asset() else { return };
        let truth = person(&generic, 6, 1.0, 0.0);
        let set = set_soft_parts(&generic, &truth, &truth, 1.0);
        assert!(distance(&set, &truth, generic.skin().vertices.clone()) < 1e-9);
    }
}
