//! What a survey says of a clip in words: what was measured, and what helps.
//!
//! The good films of [`crate::judge`], by their landmarks, in the order of its table:
//!
//! | | james-cif | james-720 | cap12 | cap13 | wolf | ict-a-talk | ict-b-perform | synthetic person |
//! |---|---|---|---|---|---|---|---|---|
//! | turn; to the lesser side, ° | 54; 25 | 76; 33 | 23; 11 | 18; 5 | 20; 1 | 48; 24 | 14; 6 | 43; 21 |
//! | eyes, px | 55 | 103 | 46 | 42 | 67 | 47 | 40 | 55 |
//! | sharpness | 0.21 | 0.17 | 0.07 | 0.08 | 0.08 | 0.27 | 0.25 | 0.2 |

use super::{SurveyedFace, SurveyedFrame};
use crate::faces::COVERED;
use crate::faces::median;
use crate::judge::range::{CLIPPED, LEVEL, TURN};
use crate::reason::{ReasonKind, tally};
use crate::{Appearance, Bounds, FacewrightError};
use serde::Serialize;

/// A head seen turned to the lesser side by no more than this, degrees, shows one side only. Landmarks see less of a turn than points do,
/// and tell its middle to some 5° only: what is seen by both is 6.6° and 1° in one good film.
const LEAST_LESSER_DEG: f64 = 0.0;
/// Eyes nearer together than this, pixels, leave no points: james-cif with 18 pixels gives 222 points and a good head, cap12 with 23 pixels 141
/// and a good one, with 15 pixels none.
const SMALL_PX: f64 = 16.0;
/// A face less sharp than this is out of focus, and its texture with it: cap12 blurred by 1.5 pixels has 0.023, 271 points and a good head; by 3
/// pixels 0.011 and no point. (Strong light bears more: james-cif blurred by 4 pixels has 0.010, 367 points instead of 1000, and a good head.)
const BLURRED: f64 = 0.016;
/// Film it so.
const TURN_MORE: &str = "film the head while it turns slowly, 15° or more to each side";

/// What kind of thing speaks against a clip; in JSON a word in snake case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FindingKind {
    /// No frame that was looked at shows a face.
    NoFace,
    /// It has one frame only.
    OneFrame,
    /// Hardly a frame can be used.
    FewUsable,
    /// The head turns too little.
    TurnsLittle,
    /// It turns to one side only.
    OneSided,
    /// The face is small in the picture.
    Small,
    /// The face is out of focus.
    Blurred,
    /// The face is dark.
    Dark,
    /// The face is clipped to white.
    Clipped,
    /// Mouth, nose and chin are covered.
    MouthCovered,
    /// The eyes are covered.
    EyesCovered,
    /// Several faces are seen.
    SeveralFaces,
    /// The film is cut.
    Cut,
}

/// What speaks against a clip.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// A word for programs.
    pub kind: FindingKind,
    /// What was measured, and what helps.
    pub sentence: String,
}

/// What is said of a clip.
pub(super) struct Checked {
    pub summary: Vec<String>,
    pub findings: Vec<Finding>,
}

/// Of a clip of so many frames, by those that were looked at.
pub(super) fn check(frames: usize, looks: &[SurveyedFrame]) -> Checked {
    let faces: Vec<&SurveyedFace> = looks.iter().filter_map(|look| look.face.as_ref()).collect();
    if faces.is_empty() {
        let (kind, error) = (FindingKind::NoFace, FacewrightError::NoFace { frames: looks.len() });
        let is_any = !looks.is_empty();
        return Checked { summary: Vec::new(), findings: is_any.then(|| finding(kind, &error)).into_iter().collect() };
    }
    let usable: Vec<&SurveyedFace> =
        looks.iter().filter(|look| look.usable).filter_map(|look| look.face.as_ref()).collect();
    let turn = Turn::of(&usable);
    let mut findings = Vec::new();
    if frames < 2 {
        findings.push(finding(FindingKind::OneFrame, &FacewrightError::OneFrame));
    } else if usable.len() < 2 {
        findings.push(few_usable(usable.len(), looks));
    } else {
        findings.extend(turn.finding());
    }
    findings.extend(picture(&faces));
    findings.extend(scene(looks));
    let summary = [Some(used(usable.len(), looks)), (usable.len() > 1).then(|| turn.sentence())];
    Checked { summary: summary.into_iter().flatten().collect(), findings }
}

fn finding(kind: FindingKind, sentence: &impl ToString) -> Finding {
    Finding { kind, sentence: sentence.to_string() }
}

/// Why frames are left out, each reason with how many.
fn left_out(looks: &[SurveyedFrame]) -> String {
    tally(looks.iter().filter(|look| !look.usable).map(|look| look.reason_kind.brief()))
}

fn used(usable: usize, looks: &[SurveyedFrame]) -> String {
    match (looks.len(), left_out(looks)) {
        (all, _) if usable == all => format!("all {all} frames looked at can be used"),
        (all, reasons) => format!("{usable} of {all} frames looked at can be used ({reasons})"),
    }
}

fn few_usable(usable: usize, looks: &[SurveyedFrame]) -> Finding {
    let count = if usable == 0 { "none".to_owned() } else { "only one".to_owned() };
    let sentence = format!(
        "{count} of the {} frames looked at can be used ({}): film the face in focus, uncovered and with a neutral expression",
        looks.len(),
        left_out(looks)
    );
    finding(FindingKind::FewUsable, &sentence)
}

/// Between which directions a head is seen, degrees.
struct Turn {
    yaw: [f64; 2],
    pitch: [f64; 2],
}

impl Turn {
    fn of(faces: &[&SurveyedFace]) -> Self {
        let range = |of: fn(&SurveyedFace) -> f64| {
            let values = faces.iter().map(|face| of(face));
            values.fold([f64::MAX, f64::MIN], |[low, high], value| [low.min(value), high.max(value)])
        };
        Self { yaw: range(|face| face.yaw_deg), pitch: range(|face| face.pitch_deg) }
    }

    /// `turns 12° to the left and 14° to the right of the picture`.
    fn sides(&self) -> String {
        let [left, right] = [-self.yaw[0], self.yaw[1]];
        match (left.round() > 0.0, right.round() > 0.0) {
            (true, true) => {
                format!("the head turns about {left:.0}° to the left and {right:.0}° to the right of the picture")
            }
            (true, false) => format!("the head turns about {left:.0}° to the left of the picture only"),
            (false, true) => format!("the head turns about {right:.0}° to the right of the picture only"),
            (false, false) => "the head does not turn".to_owned(),
        }
    }

    fn sentence(&self) -> String {
        let [down, up] = self.pitch;
        format!("{}, and nods over {:.0}°", self.sides(), up - down)
    }

    /// What it lacks.
    fn finding(&self) -> Option<Finding> {
        let [low, high] = self.yaw;
        if !is_usual(high - low, TURN.usual) {
            let sentence = format!("{}, over {:.0}° in all: {TURN_MORE}", self.sides(), high - low);
            return Some(finding(FindingKind::TurnsLittle, &sentence));
        }
        let lesser = if -low < high { "left" } else { "right" };
        let sentence = format!("{}: film it while it turns to the {lesser} too", self.sides());
        ((-low).min(high) <= LEAST_LESSER_DEG).then(|| finding(FindingKind::OneSided, &sentence))
    }
}

fn is_usual(value: f64, [low, high]: Bounds) -> bool {
    low.is_none_or(|low| value >= low) && high.is_none_or(|high| value <= high)
}

/// What size, focus and light lack.
fn picture(faces: &[&SurveyedFace]) -> Vec<Finding> {
    let over = |of: fn(&SurveyedFace) -> f64| median(faces.iter().map(|face| of(face)));
    let (eyes, sharpness) = (over(|face| face.eye_distance_px), over(|face| face.sharpness));
    let usual: Vec<Appearance> = faces.iter().map(|face| face.appearance).collect();
    let usual = Appearance::usual(&usual).unwrap_or_default();
    let (level, clipped) = (usual.level, 100.0 * usual.clipped);
    let small = || format!("the eyes are only {eyes:.0} pixels apart: film the face larger in the picture");
    let blurred = || {
        format!(
            "the face is soft, with a sharpness of {sharpness:.3} (usually at least {BLURRED}): focus on it, and film it with more light"
        )
    };
    let dark = || format!("half of the face is darker than level {level:.0} of 255: film it with more light");
    let bright = || format!("{clipped:.0} % of the face are clipped to white: film it with less light");
    let mouth =
        || "mouth, nose and chin are even and unlike the brow, as a mask is: film the face uncovered".to_owned();
    let eyes_covered =
        || "the eyes are even and unlike the cheeks, as dark glasses are: film the face uncovered".to_owned();
    let all: [(bool, FindingKind, &dyn Fn() -> String); 6] = [
        (eyes < SMALL_PX, FindingKind::Small, &small),
        (eyes >= SMALL_PX && sharpness < BLURRED, FindingKind::Blurred, &blurred),
        (!is_usual(level, LEVEL.usual), FindingKind::Dark, &dark),
        (!is_usual(clipped, CLIPPED.usual), FindingKind::Clipped, &bright),
        (usual.mouth_cover > COVERED.mouth_cover, FindingKind::MouthCovered, &mouth),
        (usual.eyes_cover > COVERED.eyes_cover, FindingKind::EyesCovered, &eyes_covered),
    ];
    all.into_iter().filter(|(is_so, ..)| *is_so).map(|(_, kind, sentence)| finding(kind, &sentence())).collect()
}

/// Others in the picture, and other scenes.
fn scene(looks: &[SurveyedFrame]) -> Vec<Finding> {
    let count = looks.len();
    let several = looks.iter().filter_map(|look| look.face.as_ref()).filter(|face| face.faces_in_picture > 1).count();
    let others = looks.iter().filter(|look| look.reason_kind == ReasonKind::OtherShot).count();
    let people = || {
        format!("{several} of {count} frames looked at show several faces: film one person alone, or choose the face")
    };
    let cut = || {
        format!(
            "picture and face change at once: a cut. {others} of {count} frames looked at are of another shot: use the frames of one"
        )
    };
    [
        (several > 0).then(|| finding(FindingKind::SeveralFaces, &people())),
        (others > 0).then(|| finding(FindingKind::Cut, &cut())),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::RgbImage;

    fn face(yaw_deg: f64) -> SurveyedFace {
        SurveyedFace {
            rectangle: [0; 4],
            yaw_deg,
            pitch_deg: 2.0,
            roll_deg: 0.0,
            eye_distance_px: 46.0,
            sharpness: 0.08,
            appearance: Appearance { level: 120.0, ..Appearance::default() },
            faces_in_picture: 1,
        }
    }

    fn look(number: usize, face: Option<SurveyedFace>, kind: ReasonKind) -> SurveyedFrame {
        SurveyedFrame {
            number,
            name: format!("frame_{number:06}"),
            usable: kind == ReasonKind::Yaw,
            reason: String::new(),
            reason_kind: kind,
            face,
            thumbnail: RgbImage::new(1, 1),
        }
    }

    fn turning(from: f64, to: f64, change: impl Fn(&mut SurveyedFace)) -> Vec<SurveyedFrame> {
        let turned = |k: usize| {
            let mut face = face(from + (to - from) * k as f64 / 8.0);
            change(&mut face);
            look(k, Some(face), ReasonKind::Yaw)
        };
        (0..9).map(turned).collect()
    }

    fn kinds(looks: &[SurveyedFrame]) -> Vec<FindingKind> {
        check(looks.len(), looks).findings.into_iter().map(|finding| finding.kind).collect()
    }

    #[test]
    fn nothing_is_found_against_a_head_that_turns_to_both_sides() {
        let checked = check(9, &turning(-12.0, 14.0, |_| ()));
        assert_eq!(checked.findings, []);
        let sides = "the head turns about 12° to the left and 14° to the right of the picture, and nods over 0°";
        assert_eq!(checked.summary, ["all 9 frames looked at can be used", sides]);
    }

    #[test]
    fn the_side_is_named_to_which_the_head_does_not_turn() {
        let said = |from: f64, to: f64| check(9, &turning(from, to, |_| ())).findings.remove(0);
        assert_eq!(
            said(-12.0, 0.0).sentence,
            "the head turns about 12° to the left of the picture only: film it while it turns to the right too"
        );
        assert_eq!(
            said(8.0, 30.0).sentence,
            "the head turns about 30° to the right of the picture only: film it while it turns to the left too"
        );
        assert_eq!((said(8.0, 30.0).kind, said(-2.0, 3.0).kind), (FindingKind::OneSided, FindingKind::TurnsLittle));
        assert_eq!(kinds(&turning(-19.0, 1.0, |_| ())), [], "a good film has no more by its landmarks");
    }

    #[test]
    fn each_fault_of_the_picture_is_told_and_no_other() {
        type Change = fn(&mut SurveyedFace);
        let faults: [(Change, FindingKind); 7] = [
            (|face| face.eye_distance_px = 12.0, FindingKind::Small),
            (|face| face.sharpness = 0.005, FindingKind::Blurred),
            (|face| face.appearance.level = 15.0, FindingKind::Dark),
            (|face| face.appearance.clipped = 0.3, FindingKind::Clipped),
            (|face| face.appearance.mouth_cover = 20.0, FindingKind::MouthCovered),
            (|face| face.appearance.eyes_cover = 40.0, FindingKind::EyesCovered),
            (|face| face.faces_in_picture = 2, FindingKind::SeveralFaces),
        ];
        for (change, kind) in faults {
            assert_eq!(kinds(&turning(-12.0, 14.0, change)), [kind]);
        }
    }

    #[test]
    fn frames_of_no_use_tell_nothing_of_the_turn_and_are_counted_by_their_reasons() {
        let mut looks = turning(2.0, 14.0, |_| ());
        looks.push(look(9, Some(face(-30.0)), ReasonKind::Blurred));
        looks.push(look(10, None, ReasonKind::NoFace));
        let checked = check(11, &looks);
        assert_eq!(checked.summary[0], "9 of 11 frames looked at can be used (1 blurred, 1 no face)");
        assert_eq!(checked.findings[0].kind, FindingKind::OneSided);
        looks.push(look(11, None, ReasonKind::OtherShot));
        assert_eq!(kinds(&looks), [FindingKind::OneSided, FindingKind::Cut]);
    }

    #[test]
    fn clips_without_a_face_or_with_hardly_a_frame_are_told_so_and_nothing_else() {
        let none: Vec<_> = (0..5).map(|k| look(k, None, ReasonKind::NoFace)).collect();
        assert_eq!(kinds(&none), [FindingKind::NoFace]);
        let closed: Vec<_> = (0..5).map(|k| look(k, Some(face(0.0)), ReasonKind::EyesClosed)).collect();
        let said = check(5, &closed).findings.remove(0);
        assert_eq!(said.kind, FindingKind::FewUsable);
        assert!(said.sentence.starts_with("none of the 5 frames looked at can be used (5 eyes closed)"));
        assert_eq!(kinds(&turning(0.0, 0.0, |_| ())[..1]), [FindingKind::OneFrame]);
        assert_eq!(kinds(&[]), []);
    }
}
