//! The 15 visemes of Oculus lip sync as sums of the 52 keys, and the merging of keys.
//!
//! # Entry points
//! - [`visemes`]: names and weights.
//! - [`viseme_keys`]: the 15 keys for a head.
//! - [`compose`]: a weighted sum of keys as one key.
//!
//! Shapes follow the reference pictures of the Oculus viseme set: lips closed for PP, lower lip at the upper teeth for FF,
//! tongue at the teeth for TH, and so on up to the rounded O and U.

use crate::Key;
use geometry::Vec3;
use std::collections::BTreeMap;

/// A mouth shape of speech.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viseme {
    /// `viseme_sil` … `viseme_U`.
    pub name: &'static str,
    /// Key names and their weights; 1 is the whole key.
    pub weights: &'static [(&'static str, f64)],
}

const VISEMES: [Viseme; 15] = [
    Viseme { name: "viseme_sil", weights: &[] },
    Viseme {
        name: "viseme_PP",
        weights: &[
            ("mouthPressLeft", 0.7),
            ("mouthPressRight", 0.7),
            ("mouthRollLower", 0.35),
            ("mouthRollUpper", 0.3),
        ],
    },
    Viseme {
        name: "viseme_FF",
        weights: &[
            ("jawOpen", 0.03),
            ("mouthRollLower", 0.75),
            ("mouthShrugLower", 0.3),
            ("mouthUpperUpLeft", 0.6),
            ("mouthUpperUpRight", 0.6),
            ("mouthShrugUpper", 0.2),
        ],
    },
    Viseme {
        name: "viseme_TH",
        weights: &[
            ("jawOpen", 0.2),
            ("tongueOut", 0.45),
            ("mouthLowerDownLeft", 0.3),
            ("mouthLowerDownRight", 0.3),
            ("mouthUpperUpLeft", 0.2),
            ("mouthUpperUpRight", 0.2),
        ],
    },
    Viseme {
        name: "viseme_DD",
        weights: &[
            ("jawOpen", 0.15),
            ("mouthLowerDownLeft", 0.35),
            ("mouthLowerDownRight", 0.35),
            ("mouthUpperUpLeft", 0.3),
            ("mouthUpperUpRight", 0.3),
        ],
    },
    Viseme {
        name: "viseme_kk",
        weights: &[
            ("jawOpen", 0.22),
            ("mouthLowerDownLeft", 0.25),
            ("mouthLowerDownRight", 0.25),
            ("mouthStretchLeft", 0.2),
            ("mouthStretchRight", 0.2),
        ],
    },
    Viseme {
        name: "viseme_CH",
        weights: &[("jawOpen", 0.1), ("mouthFunnel", 0.55), ("mouthPucker", 0.25), ("mouthShrugUpper", 0.2)],
    },
    Viseme {
        name: "viseme_SS",
        weights: &[
            ("jawOpen", 0.05),
            ("mouthStretchLeft", 0.4),
            ("mouthStretchRight", 0.4),
            ("mouthLowerDownLeft", 0.5),
            ("mouthLowerDownRight", 0.5),
            ("mouthUpperUpLeft", 0.4),
            ("mouthUpperUpRight", 0.4),
            ("mouthDimpleLeft", 0.2),
            ("mouthDimpleRight", 0.2),
        ],
    },
    Viseme {
        name: "viseme_nn",
        weights: &[
            ("jawOpen", 0.12),
            ("mouthLowerDownLeft", 0.2),
            ("mouthLowerDownRight", 0.2),
            ("mouthUpperUpLeft", 0.2),
            ("mouthUpperUpRight", 0.2),
        ],
    },
    Viseme { name: "viseme_RR", weights: &[("jawOpen", 0.14), ("mouthFunnel", 0.4), ("mouthPucker", 0.2)] },
    Viseme {
        name: "viseme_aa",
        weights: &[
            ("jawOpen", 0.6),
            ("mouthLowerDownLeft", 0.25),
            ("mouthLowerDownRight", 0.25),
            ("mouthUpperUpLeft", 0.25),
            ("mouthUpperUpRight", 0.25),
        ],
    },
    Viseme {
        name: "viseme_E",
        weights: &[
            ("jawOpen", 0.28),
            ("mouthStretchLeft", 0.45),
            ("mouthStretchRight", 0.45),
            ("mouthSmileLeft", 0.2),
            ("mouthSmileRight", 0.2),
            ("mouthLowerDownLeft", 0.25),
            ("mouthLowerDownRight", 0.25),
        ],
    },
    Viseme {
        name: "viseme_I",
        weights: &[
            ("jawOpen", 0.16),
            ("mouthSmileLeft", 0.4),
            ("mouthSmileRight", 0.4),
            ("mouthStretchLeft", 0.3),
            ("mouthStretchRight", 0.3),
            ("mouthUpperUpLeft", 0.2),
            ("mouthUpperUpRight", 0.2),
        ],
    },
    Viseme { name: "viseme_O", weights: &[("jawOpen", 0.4), ("mouthFunnel", 0.5), ("mouthPucker", 0.35)] },
    Viseme { name: "viseme_U", weights: &[("jawOpen", 0.16), ("mouthFunnel", 0.25), ("mouthPucker", 0.8)] },
];

/// All visemes in the order of Oculus lip sync.
pub fn visemes() -> &'static [Viseme] {
    &VISEMES
}

/// The 15 viseme keys of a head with these keys; `viseme_sil` moves nothing.
pub fn viseme_keys(keys: &[Key]) -> Vec<Key> {
    VISEMES.iter().map(|v| Key { name: v.name.to_owned(), ..compose(keys, v.weights) }).collect()
}

/// The weighted sum of keys, by name, as one key without a name. Names that no key has add nothing.
pub fn compose(keys: &[Key], weights: &[(&str, f64)]) -> Key {
    let mut sum: BTreeMap<u32, Vec3> = BTreeMap::new();
    for (name, weight) in weights {
        for (v, d) in keys.iter().filter(|k| k.name == *name).flat_map(|k| &k.offsets) {
            *sum.entry(*v).or_insert_with(Vec3::zeros) += d * *weight;
        }
    }
    Key { name: String::new(), offsets: sum.into_iter().collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn composing_adds_what_two_keys_do_to_one_vertex() {
        let key = |name: &str, offsets: &[(u32, f64)]| Key {
            name: name.to_owned(),
            offsets: offsets.iter().map(|&(v, x)| (v, Vec3::new(x, 0.0, 0.0))).collect(),
        };
        let keys = [key("a", &[(1, 1.0), (4, 2.0)]), key("b", &[(0, 1.0), (4, 1.0)])];
        let sum = compose(&keys, &[("a", 0.5), ("b", 2.0), ("c", 1.0)]);
        let moved: Vec<(u32, f64)> = sum.offsets.iter().map(|(v, d)| (*v, d.x)).collect();
        assert_eq!(moved, [(0, 2.0), (1, 0.5), (4, 3.0)]);
    }

    #[test]
    fn there_are_fifteen_and_silence_moves_nothing() {
        let keys = viseme_keys(&[]);
        assert_eq!(keys.len(), 15);
        assert_eq!((keys[0].name.as_str(), keys[0].offsets.len()), ("viseme_sil", 0));
        assert!(keys.iter().all(|k| k.name.starts_with("viseme_")));
    }
}
