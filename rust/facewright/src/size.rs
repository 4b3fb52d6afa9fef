//! What is known of the head's size besides the pictures.

use crate::FacewrightError;
use clap::Args;
use head::fit::HeadSize;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// A length that was measured on the head.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(usize, usize, f64)", into = "(usize, usize, f64)")]
pub struct KnownLength {
    /// Number of the track at one end.
    pub from: usize,
    /// Number of the track at the other.
    pub to: usize,
    /// Metres.
    pub length: f64,
}

/// Two tracks and millimetres, as Python has them.
impl From<(usize, usize, f64)> for KnownLength {
    fn from((from, to, length_mm): (usize, usize, f64)) -> Self {
        Self { from, to, length: length_mm / 1000.0 }
    }
}

impl From<KnownLength> for (usize, usize, f64) {
    fn from(known: KnownLength) -> Self {
        (known.from, known.to, 1000.0 * known.length)
    }
}

/// `12:48=63.5`, two tracks and millimetres.
impl FromStr for KnownLength {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = || {
            let (ends, mm) = text.split_once('=')?;
            let (from, to) = ends.split_once(':')?;
            let mm = mm.parse::<f64>().ok().filter(|mm| *mm > 0.0 && mm.is_finite())?;
            Some(Self::from((from.parse().ok()?, to.parse().ok()?, mm)))
        };
        parts().ok_or_else(|| "two track numbers and millimetres, like 12:48=63.5".to_owned())
    }
}

/// What is known of the head's size.
#[derive(Clone, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct SizeOptions {
    /// Interpupillary distance, millimetres, if it is known
    #[arg(long, value_name = "MM")]
    pub interocular_mm: Option<f64>,
    /// Length measured on the head between two tracks: their numbers and millimetres; overrides all else that is known of the head's size
    #[arg(long = "length", value_name = "A:B=MM")]
    pub lengths: Vec<KnownLength>,
}

impl SizeOptions {
    /// Distance between the eyes' centres, metres, when it is known.
    pub fn interocular(&self) -> Option<f64> {
        self.interocular_mm.map(|mm| mm / 1000.0)
    }

    /// Refuses a distance that no person has, and a length that is none.
    ///
    /// # Errors
    /// [`FacewrightError::Option`].
    pub fn validate(&self) -> Result<(), FacewrightError> {
        if self.lengths.iter().any(|known| !(known.length > 0.0 && known.length.is_finite())) {
            return Err(FacewrightError::Option { name: "a measured length", expected: "longer than 0 mm" });
        }
        if self.interocular_mm.is_some_and(|mm| !(40.0..=90.0).contains(&mm)) {
            return Err(FacewrightError::Option { name: "the distance between the eyes", expected: "40 to 90 mm" });
        }
        Ok(())
    }

    /// What a fit to landmarks is told of the size.
    pub(crate) fn head_size(&self) -> HeadSize {
        self.interocular().map_or(HeadSize::Usual, HeadSize::Pupils)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_is_two_tracks_and_millimetres() {
        assert_eq!("12:48=63.5".parse(), Ok(KnownLength { from: 12, to: 48, length: 0.0635 }));
        for wrong in ["12-48=63.5", "12:48", "a:48=63.5", "12:48=-1", "12:48=inf"] {
            assert!(wrong.parse::<KnownLength>().is_err(), "{wrong}");
        }
    }
}
