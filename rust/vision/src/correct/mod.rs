//! Matches that contradict their neighbours, found and searched again (paper, section 2.4).
//!
//! # Entry points
//! - [`local_adjustment`]: the paper's way, order along lines of the picture.
//! - [`geometric`]: ours, order and local affine residual on the Delaunay graph, and whatever the caller expects of a
//!   match from the motion it knows.
//!
//! # Conventions
//! A [`Match`] is a point of frame `a` and the same point of the surface in frame `b`, pixels. Both ways return a
//! [`Correction`] with one match and one [`Outcome`] per match given, in the order given.

mod geometric;
mod local_adjustment;
mod neighbours;

pub use geometric::{Expectation, GeometricOptions, Known, geometric};
pub use local_adjustment::{LocalAdjustmentOptions, local_adjustment};

use geometry::Vec2;
use std::fmt::{self, Display, Formatter};

/// Why matches could not be corrected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CorrectError {
    /// Not one prediction or expectation per match.
    #[error("there are {known} predictions or expectations for {matches} matches: give one for each, or none")]
    Known {
        /// Number of predictions or expectations.
        known: usize,
        /// Number of matches.
        matches: usize,
    },
    /// A number among the options makes no sense.
    #[error("{name} is {value}: it must be positive and finite")]
    Option {
        /// Which option.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// The options of the search cannot be used.
    #[error(transparent)]
    Track(#[from] crate::track::TrackError),
}

/// A point in two frames, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Position in frame `a`.
    pub a: Vec2,
    /// Position in frame `b`.
    pub b: Vec2,
}

impl Match {
    /// A point that was not found in `b` (its `b` is NaN): it is looked for where its neighbours put it.
    pub fn missing(a: Vec2) -> Self {
        Self { a, b: Vec2::repeat(f64::NAN) }
    }
}

/// What speaks against a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Its order among its neighbours is not the same in both frames.
    Order,
    /// It is not where its neighbours' local affine map, or their shift, puts it.
    Residual,
    /// Its surroundings look different in `b`.
    Appearance,
    /// It is not where the caller expects it.
    Expectation,
    /// Too few neighbours are left to judge it by.
    Isolated,
    /// It has no position in `b`, see [`Match::missing`].
    Missing,
}

impl Display for Reason {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Order => "order",
            Self::Residual => "away from its neighbours",
            Self::Appearance => "looks different",
            Self::Expectation => "not where the motion puts it",
            Self::Isolated => "no neighbours",
            Self::Missing => "not found",
        })
    }
}

/// What became of a match.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Nothing speaks against it.
    Kept,
    /// It was searched again and found elsewhere.
    Moved(Reason),
    /// It was not found elsewhere; leave it out.
    Rejected(Reason),
}

impl Outcome {
    /// Whether the match may be used.
    pub fn is_usable(self) -> bool {
        !matches!(self, Self::Rejected(_))
    }
}

impl Display for Outcome {
    /// `kept`, `moved: REASON` or `rejected: REASON`.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Kept => f.write_str("kept"),
            Self::Moved(reason) => write!(f, "moved: {reason}"),
            Self::Rejected(reason) => write!(f, "rejected: {reason}"),
        }
    }
}

/// What a correction did.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// The matches in the order given; those that moved have their new position in `b`.
    pub matches: Vec<Match>,
    /// What became of each.
    pub outcomes: Vec<Outcome>,
    /// Cross matches (pairs on a line) or flipped triangles before the correction.
    pub violations_before: usize,
    /// The same afterwards, among usable matches.
    pub violations_after: usize,
}

impl Correction {
    /// Every match with a position kept as it is.
    pub fn unchanged(matches: &[Match]) -> Self {
        let finite = |m: &Match| m.a.iter().chain(m.b.iter()).all(|x| x.is_finite());
        let outcome = |m| if finite(m) { Outcome::Kept } else { Outcome::Rejected(Reason::Missing) };
        let outcomes = matches.iter().map(outcome).collect();
        Self { matches: matches.to_vec(), outcomes, violations_before: 0, violations_after: 0 }
    }

    /// The matches that may be used.
    pub fn usable(&self) -> impl Iterator<Item = &Match> {
        self.matches.iter().zip(&self.outcomes).filter(|(_, outcome)| outcome.is_usable()).map(|(m, _)| m)
    }
}

fn positive(name: &'static str, value: f64) -> Result<(), CorrectError> {
    if value.is_finite() && value > 0.0 { Ok(()) } else { Err(CorrectError::Option { name, value }) }
}
