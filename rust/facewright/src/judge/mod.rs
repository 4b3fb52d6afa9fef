//! The result held against what heads are, and against its film.
//!
//! # Entry point
//! - [`judge`]: every measure of [`crate::Quality`], or an error for a head that nobody can have.
//! - [`because`]: what was measured on the film of which no head could be made.
//!
//! # Conventions
//! [`range`] says what a measure may be, and why. A sentence names what was measured and what helps; a cause only where it was measured.

mod held_out;
pub(crate) mod range;
mod silhouette;
mod stretch;

use crate::camera::is_usual_focal;
use crate::faces::{Clip, median, yaw_pitch};
use crate::head::Measured;
use crate::head::regions::{self, Region};
use crate::texture::Skin;
use crate::{CameraSource, ErrorGroup, FacewrightError, FitReport, Measure, Method, Quality, SourcedCamera};
use geometry::Vec3;
use head::GenericHead;
use range::Range;
use stretch::Stretch;

/// What is judged.
pub struct Judged<'a> {
    pub clip: &'a Clip<'a>,
    pub measured: &'a Measured,
    pub skin: &'a Skin,
    pub fit: &'a FitReport,
    pub method: Method,
    pub source: CameraSource,
}

/// Frames that the head is held against at most.
const FRAMES: usize = 8;

/// So many of some frames, evenly spread over them.
fn spread<T: Copy>(all: &[T]) -> Vec<T> {
    let count = all.len().min(FRAMES);
    (0..count).map(|k| all[(2 * k + 1) * all.len() / (2 * count)]).collect()
}

/// Takes every measure.
///
/// # Errors
/// [`FacewrightError::ImpossibleHead`]; those of reading frames.
pub fn judge(judged: &Judged) -> Result<Quality, FacewrightError> {
    let (clip, measured) = (judged.clip, judged.measured);
    let mut measures = turn(measured);
    measures.extend(light(clip));
    measures.extend(sizes(judged));
    if judged.method == Method::Default && !measured.points.is_empty() {
        measures.extend(fit(judged));
        measures.extend(points(clip.head, measured));
    }
    measures.extend(stretches(judged));
    measures.extend(silhouette::outside(clip, measured)?.map(|percent| beyond(judged, percent)));
    measures.extend(held_out::correlation(clip, measured, judged.skin)?.map(overlaid));
    match measures.iter().find(|measure| !measure.is_possible()) {
        Some(impossible) => Err(FacewrightError::ImpossibleHead { reason: impossible.sentence.clone() }),
        None => Ok(Quality::of(measures)),
    }
}

/// What is said where no head could be measured: what is unusual about the light of its film, or a cover, if anything is.
pub fn because(clip: &Clip, error: FacewrightError) -> FacewrightError {
    let unusual = light(clip).into_iter().find(|measure| !measure.is_usual());
    match unusual.filter(|_| error.group() == ErrorGroup::Film) {
        Some(measure) => FacewrightError::ImpossibleHead { reason: measure.sentence },
        None => error,
    }
}

const FILM_TURN: &str = "film the head while it turns slowly, 15° or more to each side";
const CALIBRATE: &str = "look at the head from the side; if it is distorted, calibrate the camera with a board";
const CALIBRATED: &str =
    "look at the head from the side; if it is distorted, film it anew, uncovered and with the camera as calibrated";

impl Judged<'_> {
    /// What helps against a shape that is no head's.
    fn reshape(&self) -> &'static str {
        if self.source == CameraSource::Board { CALIBRATED } else { CALIBRATE }
    }
}

/// How far the head turns, and whether to both sides.
fn turn(measured: &Measured) -> Vec<Measure> {
    let yaws = measured.chosen_poses().iter().map(|(_, pose)| yaw_pitch(pose).0.to_degrees()).collect::<Vec<_>>();
    let (low, high) = yaws.iter().fold((f64::MAX, f64::MIN), |(low, high), &yaw| (low.min(yaw), high.max(yaw)));
    let span = format!("the head is seen turned from {low:+.0}° to {high:+.0}°");
    let both = (-low).min(high);
    vec![
        range::TURN.measure(high - low, format!("{span}, over {:.0}°", high - low), FILM_TURN),
        range::BOTH_SIDES.measure(
            both,
            format!("{span}, to the lesser side by {both:+.0}°"),
            "the other side of the face is not seen. Film the head while it turns to both sides",
        ),
    ]
}

/// What the pixels of the faces say of light and cover, over all looks.
fn light(clip: &Clip) -> Vec<Measure> {
    let Some(usual) = clip.faces.appearance() else { return Vec::new() };
    let (level, clipped) = (usual.level, 100.0 * usual.clipped);
    let (mouth, eyes) = (usual.mouth_cover, usual.eyes_cover);
    let even = |what: &str, times: f64, beside: &str| {
        format!("{what} differ from the {beside} {times:.1} times more than they vary in themselves")
    };
    vec![
        range::LEVEL.measure(
            level,
            format!("half of the face is darker than level {level:.0}"),
            "film with even light, and let the camera expose for the face",
        ),
        range::CLIPPED.measure(
            clipped,
            format!("{clipped:.0} % of the face are clipped to white"),
            "film with less light, or let the camera expose for the face",
        ),
        range::MOUTH_COVER.measure(
            mouth,
            even("mouth, nose and chin", mouth, "brow"),
            "they are covered, as by a mask, and were neither measured nor textured. Film the face uncovered",
        ),
        range::EYES_COVER.measure(
            eyes,
            even("the eyes", eyes, "cheeks"),
            "they are covered, as by dark glasses, and were neither measured nor textured. Film the face uncovered",
        ),
    ]
}

/// The size of head and face.
fn sizes(judged: &Judged) -> Vec<Measure> {
    let (head, measured, fit) = (judged.clip.head, judged.measured, judged.fit);
    let landmarks = crate::head::landmarks68(head, &measured.positions);
    let regions = regions::of_skin(head);
    let skull: Vec<Vec3> = (0..regions.len())
        .filter(|&v| regions[v].is_some_and(|r| !matches!(r, Region::Ears | Region::Neck)))
        .map(|v| measured.positions[v])
        .collect();
    let nasion = landmarks[27];
    let spread = |axis: usize, above: f64| {
        let values = || skull.iter().filter(|p| p.y > above).map(|p| p[axis]);
        1000.0 * (values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min))
    };
    let (breadth, height) = (spread(0, nasion.y), 1000.0 * (nasion - landmarks[8]).norm());
    let depth = spread(2, nasion.y);
    let size =
        |range: &Range, value: f64, what: &str| range.measure(value, format!("{what} {value:.0} mm"), judged.reshape());
    vec![
        size(&range::EYES, fit.interocular_mm, "the eyes are apart by"),
        size(&range::BREADTH, breadth, "the head is broad by"),
        size(&range::DEPTH, depth, "the head is deep by"),
        size(&range::FACE_HEIGHT, height, "the face is high, from the nose's root to the chin, by"),
    ]
}

/// How well class, points and landmarks agree.
fn fit(judged: &Judged) -> Vec<Measure> {
    let (clip, measured, fit) = (judged.clip, judged.measured, judged.fit);
    let eyes = median((0..clip.frames.len()).filter_map(|f| clip.faces.face(f)).map(|face| face.eye_distance()));
    let landmarks = 100.0 * fit.landmarks_median_px / eyes.max(1.0);
    let agreement = 100.0 * fit.rigid_agreement;
    let mut measures = vec![
        range::COEFFICIENTS.measure(
            fit.coefficient_rms,
            format!("the head's shape is {:.1} standard deviations from the average one", fit.coefficient_rms),
            judged.reshape(),
        ),
        range::AGREEMENT.measure(
            agreement,
            format!("a single motion of the head explains {agreement:.0} % of what was tracked"),
            "film one head with nothing before it, and with a quiet face",
        ),
        range::LANDMARKS.measure(
            landmarks,
            format!("landmarks are {landmarks:.1} % of the distance between the eyes away from the head"),
            judged.reshape(),
        ),
        range::POINTS_APART.measure(
            fit.points_median_mm,
            format!("tracked points are {:.2} mm away from the surface", fit.points_median_mm),
            judged.reshape(),
        ),
    ];
    let refined = SourcedCamera { camera: measured.camera, source: judged.source };
    measures.extend(measured.focal_sigma_px.map(|sigma| focal(&refined, sigma)));
    measures
}

/// How well a focal length is known that nobody gave.
fn focal(refined: &SourcedCamera, sigma_px: f64) -> Measure {
    let relative = sigma_px / refined.camera.fx;
    let percent = 100.0 * relative;
    let (found, remedy) = match is_usual_focal(refined, relative) {
        true => (
            format!(
                "the head's turn does not tell the focal length, which is mostly what cameras usually have, uncertain by {percent:.0} %"
            ),
            "turn the head further, calibrate the camera with a board, or take photographs whose EXIF tells the focal length",
        ),
        false => (
            format!("the focal length was found with the head's motion, and is uncertain by {percent:.0} %"),
            "turn the head further, or calibrate the camera with a board",
        ),
    };
    range::FOCAL.measure(percent, found, remedy)
}

/// Points in each region of the face.
fn points(head: &GenericHead, measured: &Measured) -> Vec<Measure> {
    let (of_landmarks, at) = (regions::of_landmarks(head), head.landmarks(&measured.positions));
    let of_points: Vec<Region> =
        measured.points.iter().map(|point| of_landmarks[regions::nearest(&at, point).0]).collect();
    let count = |(range, region, where_): (&Range, Region, &str)| {
        let count = of_points.iter().filter(|r| **r == region).count();
        let found = format!("{count} points were measured on the {where_}");
        range.measure(
            count as f64,
            found,
            "its shape is the average one there. Film it uncovered, sharp and evenly lit",
        )
    };
    [
        (&range::FOREHEAD, Region::Forehead, "forehead"),
        (&range::NOSE, Region::Nose, "nose"),
        (&range::CHEEK_LEFT, Region::CheekLeft, "left cheek"),
        (&range::CHEEK_RIGHT, Region::CheekRight, "right cheek"),
        (&range::CHIN, Region::Chin, "chin"),
    ]
    .map(count)
    .to_vec()
}

/// Stretch of every region against the generic head.
fn stretches(judged: &Judged) -> Vec<Measure> {
    let (head, positions) = (judged.clip.head, &judged.measured.positions);
    let regions = regions::of_skin(head);
    let Some(stretch) = Stretch::new(head, &regions, positions) else { return Vec::new() };
    let one = |range: &Range, regions: &[Region], where_: &str| {
        let times = stretch.of(|region| regions.contains(&region));
        range.measure(
            times,
            format!("the skin of the {where_} is stretched or squeezed {times:.1} times"),
            judged.reshape(),
        )
    };
    let (flipped, ears) = (1e6 * stretch.flipped(), 1000.0 * stretch.ears());
    vec![
        one(&range::STRETCH_FOREHEAD, &[Region::Forehead], "forehead"),
        one(&range::STRETCH_NOSE, &[Region::Nose], "nose"),
        one(&range::STRETCH_CHEEKS, &[Region::CheekLeft, Region::CheekRight], "cheeks"),
        one(&range::STRETCH_JAW, &[Region::Chin], "jaw"),
        one(&range::STRETCH_EARS, &[Region::Ears], "ears"),
        one(&range::STRETCH_SKULL, &[Region::Skull], "skull"),
        range::FLIPPED.measure(flipped, format!("{flipped:.0} mm² of the skin are turned over"), judged.reshape()),
        range::EARS.measure(ears, format!("an ear is {ears:.1} mm from its usual place"), judged.reshape()),
    ]
}

fn beyond(judged: &Judged, percent: f64) -> Measure {
    let found = format!("drawn over its frames, {percent:.1} % of skull and face lie outside the person's outline");
    range::OUTSIDE.measure(percent, found, judged.reshape())
}

fn overlaid(correlation: f64) -> Measure {
    let found = format!("drawn over frames that it was not made of, the head correlates with them by {correlation:.2}");
    range::OVERLAY.measure(correlation, found, "look at it over the frames with `facewright overlay`")
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::Camera;

    #[test]
    fn a_focal_length_that_the_turn_does_not_tell_is_warned_of_as_that_of_cameras() {
        let focal =
            |source, sigma_px| focal(&SourcedCamera { camera: Camera::centred(900, 600, 1000.0), source }, sigma_px);
        let found = focal(CameraSource::Estimated, 240.0);
        assert!(found.is_usual() && found.sentence.contains("found with the head's motion"), "{}", found.sentence);
        let prior = focal(CameraSource::Estimated, 250.0);
        let said = &prior.sentence;
        assert!(
            !prior.is_usual() && said.contains("mostly what cameras usually have") && said.contains("EXIF"),
            "{said}"
        );
        let exif = focal(CameraSource::Exif, 250.0);
        assert!(!exif.is_usual() && exif.sentence.contains("found with the head's motion"), "{}", exif.sentence);
    }
}
