//! What each measure may be, and why.
//!
//! `usual` is what good films give, with room: two films of a scan with its camera (±30° small, ±60° large), webcam films of a man, twice, and
//! of a woman without a board, and two made-up people who talk. `possible` is what adults' heads and cameras permit. The table of all
//! measures over these films:
//!
//! | | james-cif | james-720 | cap12 | cap13 | wolf | ict-a-talk | ict-b-perform | synthetic person |
//! |---|---|---|---|---|---|---|---|---|
//! | turn; to the lesser side, ° | 59; 28 | 120; 59 | 25; 12 | 23; 7.1 | 28; 6.6 | 55; 27 | 14; 6.6 | 56; 28 |
//! | level; clipped, % | 121; 0 | 120; 0 | 88; 0 | 86; 0 | 137; 0 | 105; 0 | 143; 0.9 | 148; 0.2 |
//! | eyes; breadth; depth; face, mm | 68; 173; 222; 141 | 67; 171; 220; 140 | 61; 152; 209; 122 | 59; 146; 198; 118 | 63; 151; 207; 115 | 65; 158; 214; 130 | 67; 175; 225; 130 | 57; 138; 184; 111 |
//! | coefficients | 1.90 | 2.05 | 1.56 | 0.98 | 1.24 | 0.98 | 0.99 | 1.16 |
//! | agreement, % | 96 | 90 | 95 | 87 | 73 | 86 | 79 | 95 |
//! | landmarks, % | 0.6 | 0.9 | 0.5 | 0.5 | 0.9 | 0.7 | 0.6 | 0.5 |
//! | points, mm | 0.33 | 0.30 | 0.64 | 0.76 | 0.53 | 0.33 | 0.51 | 0.24 |
//! | focal length, % | | | 18 | 16 | 17 | 9 | 21 | 4 |
//! | fewest points in a region | 165 | 220 | 38 | 7 | 0 (chin) | 154 | 39 | 147 |
//! | stretch: forehead, nose | 1.3, 1.6 | 1.2, 1.6 | 1.5, 1.9 | 1.3, 1.6 | 1.1, 1.6 | 1.2, 1.5 | 1.3, 1.4 | 1.3, 1.6 |
//! | stretch: cheeks, jaw | 2.2, 1.8 | 2.9, 1.8 | 1.6, 1.4 | 1.5, 1.2 | 1.9, 1.1 | 1.6, 1.2 | 1.6, 1.2 | 1.9, 1.3 |
//! | stretch: ears, skull | 1.0, 1.3 | 1.1, 1.5 | 1.0, 1.1 | 1.0, 1.1 | 1.0, 1.1 | 1.0, 1.2 | 1.0, 1.2 | 1.0, 1.3 |
//! | turned over, mm² | 0 | 0 | 0 | 0 | 0 | 0 | 0 | 0 |
//! | ears, mm | 6.7 | 6.8 | 2.2 | 1.2 | 2.5 | 2.4 | 0.8 | 5.9 |
//! | outside the person, % | 0 | 0 | 0 | 0 | 0 | 0 | 0 | 0 |
//! | held-out frames | 0.99 | 0.99 | 0.98 | 0.96 | 0.84 | 0.96 | 0.92 | 0.98 |
//!
//! (The last with its focal length estimated.) Where the table is outside of a range the head is truly wrong there: no point was measured on
//! the woman's chin.

use crate::camera::UNTOLD_SIGMA;
use crate::faces::COVERED;
use crate::{Bounds, Measure};

/// A measure's name, unit and ranges.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// A word in snake case.
    pub name: &'static str,
    /// Unit of the value and of both ranges.
    pub unit: &'static str,
    /// Where good films have it.
    pub usual: Bounds,
    /// Where it can be at all.
    pub possible: Bounds,
}

impl Range {
    /// A measure of a value; `found` says what was measured, `remedy` what helps where it is unusual.
    pub fn measure(&self, value: f64, found: String, remedy: &str) -> Measure {
        let measure = Measure {
            name: self.name.to_owned(),
            value,
            unit: self.unit.to_owned(),
            usual: self.usual,
            possible: self.possible,
            sentence: String::new(),
        };
        let sentence = if measure.is_usual() && measure.is_possible() {
            found
        } else {
            format!("{found} ({}): {remedy}", usually(self))
        };
        Measure { sentence, ..measure }
    }
}

fn usually(range: &Range) -> String {
    let number = |value: f64| format!("{}", (10.0 * value).round() / 10.0);
    let unit = match range.unit {
        "" | "points" => String::new(),
        "deg" => "°".to_owned(),
        unit => format!(" {unit}"),
    };
    match range.usual {
        [Some(low), Some(high)] => format!("usually {} to {}{unit}", number(low), number(high)),
        [Some(low), None] => format!("usually at least {}{unit}", number(low)),
        [None, Some(high)] => format!("usually at most {}{unit}", number(high)),
        [None, None] => "anything is usual".to_owned(),
    }
}

const fn at_most(usual: f64, possible: Option<f64>) -> (Bounds, Bounds) {
    ([None, Some(usual)], [None, possible])
}

const fn at_least(usual: f64, possible: Option<f64>) -> (Bounds, Bounds) {
    ([Some(usual), None], [possible, None])
}

const fn range(name: &'static str, unit: &'static str, (usual, possible): (Bounds, Bounds)) -> Range {
    Range { name, unit, usual, possible }
}

const fn between(usual: [f64; 2], possible: [f64; 2]) -> (Bounds, Bounds) {
    ([Some(usual[0]), Some(usual[1])], [Some(possible[0]), Some(possible[1])])
}

/// The class's own heads have 1, the good films up to 2; films that contradict themselves 2.5 to 6.
pub const COEFFICIENTS: Range = range("coefficient_rms", "standard deviations", at_most(2.3, Some(5.0)));
/// Lips and lids that move cost a third at most; two heads, or a head and a wall, more.
pub const AGREEMENT: Range = range("rigid_agreement", "%", at_least(65.0, None));
/// Adults' pupils are about 51 to 77 mm apart, both sexes; the eyeballs' centres and a size that is 4 % off take the same on top.
pub const EYES: Range = range("interocular", "mm", between([55.0, 72.0], [48.0, 80.0]));
/// Adults' heads are about 136 to 170 mm broad and 170 to 217 mm deep, their faces 100 to 140 mm high, in 98 of 100; skin and hair of the class
/// and a size that is 4 % off take 10 to 15 mm on top.
pub const BREADTH: Range = range("head_breadth", "mm", between([130.0, 180.0], [110.0, 210.0]));
/// See [`BREADTH`].
pub const DEPTH: Range = range("head_depth", "mm", between([160.0, 235.0], [130.0, 270.0]));
/// See [`BREADTH`].
pub const FACE_HEIGHT: Range = range("face_height", "mm", between([95.0, 145.0], [75.0, 170.0]));
/// Less shows no depth beside the points' noise.
pub const TURN: Range = range("turn", "deg", at_least(10.0, None));
/// The farthest turn to the side to which it turns less; below 0 the head never faces the camera. Past 10° the cheek behind the nose is
/// not seen, and its outline slides over the wall.
pub const BOTH_SIDES: Range = range("turn_to_lesser_side", "deg", at_least(3.0, Some(-10.0)));
/// The good films have 86 and more; a face of half that stays unwarned, the same film at an eighth of its levels has 15.
pub const LEVEL: Range = range("face_level", "of 255", at_least(30.0, None));
/// Skin that shines is clipped over a few hundredths of the face.
pub const CLIPPED: Range = range("face_clipped", "%", at_most(10.0, None));
/// See [`COVERED`].
pub const MOUTH_COVER: Range = range("mouth_cover", "times", at_most(COVERED.mouth_cover, None));
/// See [`COVERED`].
pub const EYES_COVER: Range = range("eyes_cover", "times", at_most(COVERED.eyes_cover, None));
/// The net jitters by 1 %; a head that is not the person's adds to it.
pub const LANDMARKS: Range = range("landmark_error", "% of the distance between the eyes", at_most(2.0, None));
/// Soft webcams measure to 0.7 mm.
pub const POINTS_APART: Range = range("point_distance", "mm", at_most(1.2, None));
/// Turns of 13° tell it to a fifth; beyond this the film tells less of it than what cameras usually have does ([`UNTOLD_SIGMA`]).
pub const FOCAL: Range = range("focal_deviation", "%", at_most(100.0 * UNTOLD_SIGMA, None));
/// Without points a region's shape is that of the class.
pub const FOREHEAD: Range = range("points_forehead", "points", at_least(3.0, None));
/// See [`FOREHEAD`].
pub const NOSE: Range = range("points_nose", "points", at_least(3.0, None));
/// See [`FOREHEAD`].
pub const CHEEK_LEFT: Range = range("points_cheek_left", "points", at_least(3.0, None));
/// See [`FOREHEAD`].
pub const CHEEK_RIGHT: Range = range("points_cheek_right", "points", at_least(3.0, None));
/// See [`FOREHEAD`].
pub const CHIN: Range = range("points_chin", "points", at_least(3.0, None));
/// About a half above the most stretched good head.
pub const STRETCH_FOREHEAD: Range = range("stretch_forehead", "times", at_most(2.4, None));
/// See [`STRETCH_FOREHEAD`].
pub const STRETCH_NOSE: Range = range("stretch_nose", "times", at_most(2.8, None));
/// See [`STRETCH_FOREHEAD`]; the sides of the nose and the lids' rims take more.
pub const STRETCH_CHEEKS: Range = range("stretch_cheeks", "times", at_most(4.2, None));
/// See [`STRETCH_FOREHEAD`].
pub const STRETCH_JAW: Range = range("stretch_jaw", "times", at_most(2.5, None));
/// See [`STRETCH_FOREHEAD`]: they are moved in one piece, by lengths within 1.22 of the average ear's, and their roots give way.
pub const STRETCH_EARS: Range = range("stretch_ears", "times", at_most(2.0, None));
/// See [`STRETCH_FOREHEAD`].
pub const STRETCH_SKULL: Range = range("stretch_skull", "times", at_most(2.2, None));
/// Folds are undone, and none is left on any good head; a triangle of the face has 5 mm² in the median.
pub const FLIPPED: Range = range("flipped", "mm²", at_most(5.0, None));
/// Ears differ by their length and by how far they stand out: 10 mm at most.
pub const EARS: Range = range("ear_displacement", "mm", at_most(12.0, Some(40.0)));
/// No frame of the good films has more than 1.1 %; the synthetic person with the wall painted over the crown has 16 %.
pub const OUTSIDE: Range = range("outside_person", "%", at_most(3.0, None));
/// A woman with strong expressions 0.87, everybody else 0.93 or more; a head without the mask that its frames show 0.70.
pub const OVERLAY: Range = range("held_out_correlation", "", at_least(0.8, None));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eyes_further_apart_than_anybodys_are_impossible_and_the_sentence_says_what_is_usual() {
        let wide = EYES.measure(89.0, "the eyes are apart by 89 mm".to_owned(), "calibrate");
        assert!(!wide.is_possible() && !wide.is_usual());
        assert_eq!(wide.sentence, "the eyes are apart by 89 mm (usually 55 to 72 mm): calibrate");
        let usual = EYES.measure(63.0, "the eyes are apart by 63 mm".to_owned(), "calibrate");
        assert_eq!((usual.is_usual(), usual.sentence.as_str()), (true, "the eyes are apart by 63 mm"));
    }

    #[test]
    fn ranges_without_an_end_are_said_so() {
        assert_eq!(usually(&NOSE), "usually at least 3");
        assert_eq!(usually(&FOCAL), "usually at most 24.7 %");
        assert!(usually(&TURN).ends_with('°') && usually(&EARS).starts_with("usually at most"));
    }
}
