//! Farthest point sampling.

use crate::Vec3;

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
            let far = (0..places.len()).max_by(|&a, &b| nearest[a].0.total_cmp(&nearest[b].0).then(b.cmp(&a)));
            let Some(far) = far.filter(|&far| nearest[far].0 > 0.0) else { break };
            for (place, near) in places.iter().zip(&mut nearest) {
                let distance = (place - places[far]).norm();
                if distance < near.0 {
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
    fn places_at_one_spot_and_none_give_what_there_is() {
        assert_eq!(Spread::over(&[Vec3::x(); 4], 3).chosen, [0]);
        assert_eq!(Spread::over(&[], 3).chosen, [0; 0]);
        assert_eq!(Spread::over(&[Vec3::x()], 0).nearest, [0; 0]);
    }
}
