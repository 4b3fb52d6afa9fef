//! Farthest point sampling.

use crate::Vec3;

/// Distances that differ by less than this part are equal, and the first place counts: those of a symmetric head's halves differ by
/// rounding alone, which must not decide.
const TIE: f64 = 1e-6;

/// Places spread as evenly as others allow.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spread {
    /// The chosen ones, as indices: each the farthest from those before it.
    pub chosen: Vec<usize>,
    /// Of every place, which of the chosen is nearest, as an index into [`Self::chosen`].
    pub nearest: Vec<usize>,
}

impl Spread {
    /// Chooses up to `limit` of `places`, the first one first; fewer where no others are apart (Gonzalez 1985).
    pub fn over(places: &[Vec3], limit: usize) -> Self {
        let Some(first) = places.first().filter(|_| limit > 0) else {
            return Self { chosen: Vec::new(), nearest: Vec::new() };
        };
        let mut chosen = vec![0];
        let mut nearest: Vec<(f64, usize)> = places.iter().map(|p| ((p - first).norm(), 0)).collect();
        while chosen.len() < limit {
            let farthest = nearest.iter().map(|(distance, _)| *distance).fold(0.0, f64::max);
            let is_far = |(distance, _): &(f64, usize)| farthest > 0.0 && *distance >= farthest * (1.0 - TIE);
            let Some(far) = nearest.iter().position(is_far) else { break };
            for (place, near) in places.iter().zip(&mut nearest) {
                let distance = (place - places[far]).norm();
                if distance < near.0 * (1.0 - TIE) {
                    *near = (distance, chosen.len());
                }
            }
            chosen.push(far);
        }
        Self { chosen, nearest: nearest.into_iter().map(|(_, k)| k).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_the_farthest_from_those_before_and_the_rest_belong_to_the_nearest() {
        let line: Vec<Vec3> = (0..9).map(|k| Vec3::x() * f64::from(k)).collect();
        let spread = Spread::over(&line, 3);
        assert_eq!(spread.chosen, [0, 8, 4]);
        assert_eq!(spread.nearest, [0, 0, 0, 2, 2, 2, 1, 1, 1]);
    }

    #[test]
    fn rounding_does_not_decide_between_the_halves_of_what_is_symmetric() {
        let half = (0..40).map(|k| Vec3::new(0.1 + 0.01 * f64::from(k % 7), 0.02 * f64::from(k / 7), 0.0));
        let head: Vec<Vec3> = half.flat_map(|p| [p, Vec3::new(-p.x, p.y, p.z)]).collect();
        let spread = Spread::over(&head, 20);
        for seed in 1..20 {
            let shaken = |(k, p): (usize, &Vec3)| p + Vec3::repeat(1e-12 * f64::from((k as i32 * seed * 37) % 11 - 5));
            assert_eq!(Spread::over(&head.iter().enumerate().map(shaken).collect::<Vec<_>>(), 20), spread);
        }
    }

    #[test]
    fn places_at_one_spot_and_none_give_what_there_is() {
        assert_eq!(Spread::over(&[Vec3::x(); 4], 3).chosen, [0]);
        assert_eq!(Spread::over(&[], 3).chosen, [0; 0]);
        assert_eq!(Spread::over(&[Vec3::x()], 0).nearest, [0; 0]);
    }
}
