//! How good a result is: what `quality` of `report.json` holds.

use crate::formats::finite;
use serde::{Deserialize, Serialize};

/// What is to be thought of a head. One that no person can have is not made, and has none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every measure is as over good films.
    #[default]
    Good,
    /// Some measure is not.
    Warned,
}

/// From and to, `null` where there is no end.
pub type Bounds = [Option<f64>; 2];

/// One measure of a result or of its film.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    /// What is measured, a word in snake case.
    pub name: String,
    /// How much it is.
    pub value: f64,
    /// Unit of the value and of both ranges.
    pub unit: String,
    /// Where good films have it.
    pub usual: Bounds,
    /// Where a person's head, filmed by a camera, can have it.
    pub possible: Bounds,
    /// What was measured, and what helps where that is not usual.
    pub sentence: String,
}

impl Measure {
    /// Whether good films have such a value.
    pub fn is_usual(&self) -> bool {
        within(&self.usual, self.value)
    }

    /// Whether it can be at all.
    pub fn is_possible(&self) -> bool {
        within(&self.possible, self.value)
    }
}

/// The verdict, and what it rests on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quality {
    /// The verdict.
    pub verdict: Verdict,
    /// Every measure that could be taken.
    pub measures: Vec<Measure>,
}

impl Quality {
    /// The verdict on measures.
    pub(crate) fn of(measures: Vec<Measure>) -> Self {
        let good = measures.iter().all(Measure::is_usual);
        Self { verdict: if good { Verdict::Good } else { Verdict::Warned }, measures }
    }

    /// What good films do not have.
    pub fn unusual(&self) -> impl Iterator<Item = &Measure> {
        self.measures.iter().filter(|measure| !measure.is_usual())
    }

    /// What is wrong with it.
    pub(crate) fn validate(&self) -> Result<(), String> {
        self.measures.iter().try_for_each(|measure| {
            let ends = measure.usual.iter().chain(&measure.possible).flatten().copied();
            let numbers: Vec<f64> = ends.chain([measure.value]).collect();
            finite(&numbers, || format!("the measure {}", measure.name))
        })
    }
}

fn within([low, high]: &Bounds, value: f64) -> bool {
    low.is_none_or(|low| value >= low) && high.is_none_or(|high| value <= high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measure(value: f64) -> Measure {
        let (name, unit, sentence) = ("eyes".to_owned(), "mm".to_owned(), "the eyes are apart".to_owned());
        Measure { name, value, unit, usual: [Some(56.0), None], possible: [Some(48.0), Some(80.0)], sentence }
    }

    #[test]
    fn a_single_unusual_measure_is_a_warning() {
        let good = Quality::of(vec![measure(60.0), measure(79.0)]);
        assert_eq!((good.verdict, good.unusual().count()), (Verdict::Good, 0));
        let warned = Quality::of(vec![measure(60.0), measure(50.0)]);
        assert_eq!((warned.verdict, warned.unusual().count()), (Verdict::Warned, 1));
        assert!(!measure(81.0).is_possible() && measure(81.0).is_usual());
    }
}
