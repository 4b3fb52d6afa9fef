//! What values of several files must be.

use std::collections::BTreeSet;
use std::fmt::Display;

/// Refuses a list in which anything is there twice; `kind` is what to call one.
pub(crate) fn once<T: Ord + Display>(names: impl Iterator<Item = T>, kind: &str) -> Result<(), String> {
    let mut known = BTreeSet::new();
    for name in names {
        if known.contains(&name) {
            return Err(format!("it has the {kind} {name} twice"));
        }
        known.insert(name);
    }
    Ok(())
}

/// Refuses numbers that are none; `what` is what they are.
pub(crate) fn finite(values: &[f64], what: impl FnOnce() -> String) -> Result<(), String> {
    let fine = values.iter().all(|value| value.is_finite());
    if fine { Ok(()) } else { Err(format!("{} is not a finite number", what())) }
}

/// Refuses a number below 0, or none; what is not known is fine.
pub(crate) fn at_least_0(value: impl Into<Option<f64>>, what: impl FnOnce() -> String) -> Result<(), String> {
    match value.into() {
        Some(value) if !(value >= 0.0 && value.is_finite()) => {
            Err(format!("{} is {value}, and must be 0 or more", what()))
        }
        _ => Ok(()),
    }
}
