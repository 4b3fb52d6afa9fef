//! Why a frame is used, or why not: a kind for programs, a sentence for people.
//!
//! # Entry points
//! - [`FrameReason`] is what steps decide by; its [`Display`] is the sentence that files keep.
//! - [`ReasonKind`] is what files keep beside it, and what frames are counted by.

use motion::MotionError;
use serde::de::IntoDeserializer;
use serde::de::value::Error as Unknown;
use serde::{Deserialize, Deserializer, Serialize};
use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter};

/// What kind of reason a frame has to be used, or not; in files a word in snake case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReasonKind {
    /// Used: its sentence says how far the head is turned.
    Yaw,
    /// Used: its pose rests on few points.
    FewPoints,
    /// No face was found.
    NoFace,
    /// Of another shot than the one that is used.
    OtherShot,
    /// Less sharp than the clip usually is.
    Blurred,
    /// Landmarks are far from the head.
    Covered,
    /// The eyes are closed.
    EyesClosed,
    /// The face is not quiet.
    Expression,
    /// Another frame shows the same and is better.
    Alike,
    /// Enough frames show the head so.
    Enough,
    /// Nobody looked: points place the head between frames that were looked at.
    BetweenLooks,
    /// Its points place the head nowhere.
    NoPose,
    /// Landmarks are guesses where the head is turned so far.
    FromTheSide,
    /// Nothing is known against it, and yet no point was found.
    NothingFound,
    /// The tracks do not know it.
    NotTracked,
    /// Points and landmarks place the head differently.
    Contradicted,
    /// Only a small part of its points agree with a pose.
    FewAgree,
    /// It shows too few points whose place on the head is known.
    TooFewPoints,
    /// No pose explains its points.
    Unexplained,
}

impl ReasonKind {
    /// What frames of the kind have in common, for counting them: `3 blurred`.
    pub fn brief(self) -> &'static str {
        match self {
            Self::Yaw => "used",
            Self::FewPoints => "few points",
            Self::NoFace => "no face",
            Self::OtherShot => "another shot",
            Self::Blurred => "blurred",
            Self::Covered => "face covered or misread",
            Self::EyesClosed => "eyes closed",
            Self::Expression => "expression too strong",
            Self::Alike => "looks like a better frame that is used",
            Self::Enough => "enough frames from this side",
            Self::BetweenLooks => "between frames that were looked at",
            Self::NoPose => "its points tell no pose",
            Self::FromTheSide => "seen too much from the side for features marked from in front",
            Self::NothingFound => "no point was found again",
            Self::NotTracked => "not tracked",
            Self::Contradicted => "points and landmarks contradict each other",
            Self::FewAgree => "few points agree",
            Self::TooFewPoints => "too few known points",
            Self::Unexplained => "no pose explains its points",
        }
    }
}

/// Why a frame is used, or why not, with the numbers of its sentence.
#[derive(Clone, Debug, PartialEq)]
pub enum FrameReason {
    /// [`ReasonKind::Yaw`], degrees.
    Yaw(f64),
    /// [`ReasonKind::FewPoints`]: how many agree.
    FewPoints(usize),
    /// [`ReasonKind::NoFace`].
    NoFace,
    /// [`ReasonKind::OtherShot`].
    OtherShot,
    /// [`ReasonKind::Blurred`]: sharpness as a part of the clip's usual one.
    Blurred(f64),
    /// [`ReasonKind::Covered`]: distance of its landmarks from the head, pixels.
    Covered(f64),
    /// [`ReasonKind::EyesClosed`].
    EyesClosed,
    /// [`ReasonKind::Expression`]: its strength.
    Expression(f64),
    /// [`ReasonKind::Alike`].
    Alike,
    /// [`ReasonKind::Enough`].
    Enough,
    /// [`ReasonKind::BetweenLooks`].
    BetweenLooks,
    /// [`ReasonKind::NoPose`].
    NoPose,
    /// [`ReasonKind::FromTheSide`].
    FromTheSide,
    /// [`ReasonKind::NothingFound`].
    NothingFound,
    /// [`ReasonKind::NotTracked`].
    NotTracked,
    /// [`ReasonKind::Contradicted`]: angle between the poses, degrees.
    Contradicted(f64),
    /// [`ReasonKind::FewAgree`].
    FewAgree {
        /// Points that agree with the pose.
        agree: usize,
        /// Points that the frame shows.
        shown: usize,
    },
    /// [`ReasonKind::TooFewPoints`] or [`ReasonKind::Unexplained`], as the solver says.
    Unplaced(MotionError),
}

impl FrameReason {
    /// The word for it.
    pub fn kind(&self) -> ReasonKind {
        match self {
            Self::Yaw(_) => ReasonKind::Yaw,
            Self::FewPoints(_) => ReasonKind::FewPoints,
            Self::NoFace => ReasonKind::NoFace,
            Self::OtherShot => ReasonKind::OtherShot,
            Self::Blurred(_) => ReasonKind::Blurred,
            Self::Covered(_) => ReasonKind::Covered,
            Self::EyesClosed => ReasonKind::EyesClosed,
            Self::Expression(_) => ReasonKind::Expression,
            Self::Alike => ReasonKind::Alike,
            Self::Enough => ReasonKind::Enough,
            Self::BetweenLooks => ReasonKind::BetweenLooks,
            Self::NoPose => ReasonKind::NoPose,
            Self::FromTheSide => ReasonKind::FromTheSide,
            Self::NothingFound => ReasonKind::NothingFound,
            Self::NotTracked => ReasonKind::NotTracked,
            Self::Contradicted(_) => ReasonKind::Contradicted,
            Self::FewAgree { .. } => ReasonKind::FewAgree,
            Self::Unplaced(MotionError::TooFewPoints { .. }) => ReasonKind::TooFewPoints,
            Self::Unplaced(_) => ReasonKind::Unexplained,
        }
    }

    /// As files have it.
    pub(crate) fn told(&self) -> Told {
        Told { reason: self.to_string(), kind: Some(self.kind()) }
    }
}

impl Display for FrameReason {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let brief = self.kind().brief();
        match self {
            Self::Yaw(degrees) => write!(f, "yaw {degrees:+.0}°"),
            Self::FewPoints(points) => write!(f, "only {points} points"),
            Self::Blurred(part) => write!(f, "{brief}: {:.0} % of the clip's usual sharpness", 100.0 * part),
            Self::Covered(rms_px) => write!(f, "{brief}: landmarks {rms_px:.1} px off"),
            Self::Expression(strength) => write!(f, "{brief} ({strength:.2})"),
            Self::Contradicted(degrees) => {
                write!(f, "{brief} by {degrees:.0}°: the face is covered or grimaces")
            }
            Self::FewAgree { agree, shown } => {
                write!(f, "only {agree} of {shown} points agree: the face is covered, blurred or grimaces")
            }
            Self::Unplaced(error) => error.fmt(f),
            _ => f.write_str(brief),
        }
    }
}

/// A reason as files have it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Told {
    /// The sentence.
    pub reason: String,
    /// Its kind; `None` in older files.
    pub kind: Option<ReasonKind>,
}

/// Reads a kind. Older files have none, and one of a newer version is passed over: its sentence is there.
pub(crate) fn known_kind<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<ReasonKind>, D::Error> {
    let word: Option<String> = Option::deserialize(deserializer)?;
    let known = |word: String| {
        let word: serde::de::value::StringDeserializer<Unknown> = word.into_deserializer();
        ReasonKind::deserialize(word).ok()
    };
    Ok(word.and_then(known))
}

/// What frames with alike reasons have in common.
pub(crate) fn brief(kind: Option<ReasonKind>, reason: &str) -> &str {
    match kind {
        Some(kind) => kind.brief(),
        // In older files what differs from frame to frame follows a colon or stands in brackets.
        None => reason.split([':', '(']).next().unwrap_or(reason).trim(),
    }
}

/// How often each reason occurs, in the alphabet's order.
pub(crate) fn counts<'a>(briefs: impl Iterator<Item = &'a str>) -> BTreeMap<&'a str, usize> {
    let mut counts = BTreeMap::new();
    briefs.for_each(|brief| *counts.entry(brief).or_default() += 1);
    counts
}

/// The same in words: `3 blurred, 2 eyes closed`.
pub(crate) fn tally<'a>(briefs: impl Iterator<Item = &'a str>) -> String {
    counts(briefs).iter().map(|(brief, count)| format!("{count} {brief}")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::{Value, from_value, json, to_value};

    fn all() -> Vec<FrameReason> {
        use FrameReason as R;
        let no_pose = MotionError::NoPose { agree: 3, total: 20 };
        let few = MotionError::TooFewPoints { found: 2, needed: 6 };
        let with_numbers = [R::Yaw(-12.4), R::FewPoints(7), R::Blurred(0.2), R::Covered(4.0), R::Expression(0.8)];
        let of_motion = [R::Contradicted(12.0), R::FewAgree { agree: 3, shown: 20 }, R::Unplaced(few)];
        let plain =
            [R::NoFace, R::OtherShot, R::EyesClosed, R::Alike, R::Enough, R::BetweenLooks, R::NoPose, R::FromTheSide];
        let rest = [R::NothingFound, R::NotTracked, R::Unplaced(no_pose)];
        with_numbers.into_iter().chain(of_motion).chain(plain).chain(rest).collect()
    }

    fn words() -> Vec<String> {
        all().iter().map(|reason| to_value(reason.kind()).unwrap().as_str().unwrap().to_owned()).collect()
    }

    #[derive(Deserialize)]
    struct Frame {
        #[serde(default, deserialize_with = "known_kind")]
        reason_kind: Option<ReasonKind>,
    }

    fn read(frame: Value) -> Option<ReasonKind> {
        from_value::<Frame>(frame).unwrap().reason_kind
    }

    #[test]
    fn every_kind_is_a_word_of_its_own_that_is_read_again() {
        for (reason, word) in all().iter().zip(words()) {
            assert!(word.chars().all(|c| c.is_ascii_lowercase() || c == '_'), "{word}");
            assert_eq!(read(json!({"reason_kind": word})), Some(reason.kind()));
        }
        let (mut words, mut briefs) = (words(), all().iter().map(|r| r.kind().brief()).collect::<Vec<_>>());
        words.sort();
        words.dedup();
        briefs.sort_unstable();
        briefs.dedup();
        assert_eq!((words.len(), briefs.len()), (all().len(), all().len()));
    }

    #[test]
    fn every_kind_is_documented() {
        let documented = include_str!("../../../docs/formats.md");
        for word in words() {
            assert!(documented.contains(&format!("`{word}`")), "{word}");
        }
    }

    #[test]
    fn files_that_do_not_tell_a_kind_or_a_newer_one_are_read() {
        for frame in [json!({}), json!({"reason_kind": null}), json!({"reason_kind": "struck_by_lightning"})] {
            assert_eq!(read(frame), None);
        }
    }

    #[test]
    fn reasons_that_differ_by_numbers_are_counted_together() {
        let told: Vec<Told> = [FrameReason::Blurred(0.1), FrameReason::EyesClosed, FrameReason::Blurred(0.3)]
            .iter()
            .map(FrameReason::told)
            .collect();
        let tally_of = |told: &[Told]| tally(told.iter().map(|told| brief(told.kind, &told.reason)));
        assert_eq!(tally_of(&told), "2 blurred, 1 eyes closed");
        let reworded = |told: &Told| Told { reason: format!("{}?", told.reason.len()), ..told.clone() };
        assert_eq!(tally_of(&told.iter().map(reworded).collect::<Vec<_>>()), "2 blurred, 1 eyes closed");
        let older = |told: &Told| Told { kind: None, ..told.clone() };
        assert_eq!(tally_of(&told.iter().map(older).collect::<Vec<_>>()), "2 blurred, 1 eyes closed");
    }
}
