//! Lists of places in files: a ten-thousandth of a pixel is finer than any net, and half of the text.

use nalgebra::SVector;
use serde::{Deserialize, Deserializer, Serializer};

/// A number as files have it.
pub fn round(value: f64) -> f64 {
    let parts = 10_000.0 * value;
    // What is too large for that has no such digits.
    if parts.is_finite() { parts.round() / 10_000.0 } else { value }
}

pub fn serialize<S: Serializer, const D: usize>(places: &[SVector<f64, D>], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(places.iter().map(|place| place.iter().map(|v| round(*v)).collect::<Vec<f64>>()))
}

pub fn deserialize<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Vec<SVector<f64, N>>, D::Error> {
    let rows: Vec<Vec<f64>> = Vec::deserialize(deserializer)?;
    let place = |row: Vec<f64>| {
        let count = row.len();
        (count == N)
            .then(|| SVector::from_vec(row))
            .ok_or_else(|| serde::de::Error::custom(format!("a place has {count} numbers instead of {N}")))
    };
    rows.into_iter().map(place).collect()
}

/// A single place.
pub mod one {
    use super::SVector;
    use serde::{Deserializer, Serializer, de::Error};

    pub fn serialize<S: Serializer, const D: usize>(place: &SVector<f64, D>, serializer: S) -> Result<S::Ok, S::Error> {
        super::serialize(std::slice::from_ref(place), serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>, const N: usize>(
        deserializer: D,
    ) -> Result<SVector<f64, N>, D::Error> {
        super::deserialize(deserializer)?.into_iter().next().ok_or_else(|| D::Error::custom("a place is missing"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_finite_stays_finite() {
        assert_eq!(round(12.345_678), 12.3457);
        assert_eq!(round(-1e308), -1e308);
    }
}
