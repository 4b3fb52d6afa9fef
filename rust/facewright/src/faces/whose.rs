//! Which of several faces is followed: the one that turns, or the one that was asked for.
//!
//! A film is made of the one who turns; a poster, a picture on a desk and most bystanders hold still. The largest face stays the choice
//! where it turns about as much as any other.

use super::Faces;
use crate::{FacewrightError, FrameSet};
use clap::Args;
use geometry::face_mesh::OUTER_EYE_CORNERS;
use geometry::{Progress, Vec2};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::str::FromStr;
use vision::landmarks::{Face, FaceLandmarker};

/// A face that turns by less than this part of another's turn is not the one whom the film is about.
const TURNS_LESS: f64 = 0.5;
/// A turn that counts, radians: two thirds of the least that a good film has.
const TURN: f64 = 0.15;
/// Between two looks a face moves by less than its size, in distances between the eyes.
const MOVES: f64 = 1.5;

/// A pixel: x to the right, y down.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "(f64, f64)", into = "(f64, f64)")]
pub struct Pixel(pub Vec2);

impl From<(f64, f64)> for Pixel {
    fn from((x, y): (f64, f64)) -> Self {
        Self(Vec2::new(x, y))
    }
}

impl From<Pixel> for (f64, f64) {
    fn from(pixel: Pixel) -> Self {
        (pixel.0.x, pixel.0.y)
    }
}

/// `320,180`.
impl FromStr for Pixel {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |part: &str| part.trim().parse::<f64>().ok().filter(|value| value.is_finite());
        let both = text.split_once(',').and_then(|(x, y)| Some(Vec2::new(number(x)?, number(y)?)));
        both.map(Self).ok_or_else(|| "a pixel, like 320,180".to_owned())
    }
}

/// Which face is followed where a clip shows several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Args, Serialize, Deserialize)]
#[serde(default)]
pub struct FaceOptions {
    /// Of several faces the one nearest to this pixel where the clip begins, instead of the largest one that turns
    #[arg(long, value_name = "X,Y")]
    pub face: Option<Pixel>,
}

/// By what the face was chosen that is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Followed {
    /// It is the largest.
    #[default]
    Largest,
    /// It turns, and the largest does not.
    Turning,
    /// It was asked for.
    Chosen,
}

impl Followed {
    /// What is said of it where there are others.
    pub(super) fn sentence(self) -> &'static str {
        match self {
            Self::Largest => "the largest one was followed. A pixel of another one chooses that instead (--face)",
            Self::Turning => "the one that turns was followed, not the largest one",
            Self::Chosen => "the one asked for was followed",
        }
    }

    /// For whom no other reason holds.
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde's signature")]
    pub(super) fn is_largest(&self) -> bool {
        *self == Self::Largest
    }
}

/// A face in each of some frames.
pub type Sightings = Vec<(usize, Face)>;

/// One person.
struct Person {
    faces: Sightings,
}

impl Person {
    /// How far it turns, radians.
    fn turn(&self) -> f64 {
        let yaws = || self.faces.iter().map(|(_, face)| yaw(face));
        yaws().fold(f64::MIN, f64::max) - yaws().fold(f64::MAX, f64::min)
    }

    /// Whether a face is this person's, by its place.
    fn is(&self, face: &Face) -> bool {
        let reach = MOVES * face.eye_distance();
        self.faces.last().is_some_and(|(_, last)| (middle(last) - middle(face)).norm() < reach)
    }
}

fn middle(face: &Face) -> Vec2 {
    face.points.iter().map(|p| p.xy()).sum::<Vec2>() / face.points.len().max(1) as f64
}

fn yaw(face: &Face) -> f64 {
    let [left, right] = OUTER_EYE_CORNERS.map(|i| face.points[i]);
    (left.z - right.z).atan2((left - right).xy().norm())
}

/// The face to follow instead of the one that was followed in `faces`, in some of the frames looked at, and why; `None` where that is the
/// right one.
pub fn another(
    faces: &Faces,
    frames: &FrameSet,
    landmarker: &FaceLandmarker,
    (options, every): (&FaceOptions, usize),
    progress: &Progress,
) -> Result<Option<(Sightings, Followed)>, FacewrightError> {
    let looked: Vec<usize> = faces.looked().into_iter().step_by(every).collect();
    let all = |&frame: &usize| {
        progress.step(0, 1)?;
        Ok((frame, landmarker.find_all(&*frames.picture(frame)?)?))
    };
    let seen: Result<Vec<_>, FacewrightError> = looked.par_iter().map(all).collect();
    let people = people(seen?);
    let Some(current) = followed(&people, faces) else { return Ok(None) };
    let (best, why) = match options.face {
        Some(Pixel(wanted)) => (nearest(&people, &wanted), Followed::Chosen),
        None => (turning(&people, current, looked.len()), Followed::Turning),
    };
    Ok(best.filter(|&best| best != current).map(|best| (people[best].faces.clone(), why)))
}

/// Faces of one place in one frame after the other.
fn people(seen: Vec<(usize, Vec<Face>)>) -> Vec<Person> {
    let mut people: Vec<Person> = Vec::new();
    for (frame, faces) in seen {
        for face in faces {
            let free = |person: &&mut Person| person.faces.last().is_none_or(|(last, _)| *last != frame);
            match people.iter_mut().filter(free).find(|person| person.is(&face)) {
                Some(person) => person.faces.push((frame, face)),
                None => people.push(Person { faces: vec![(frame, face)] }),
            }
        }
    }
    people
}

/// Who was followed.
fn followed(people: &[Person], faces: &Faces) -> Option<usize> {
    let same = |(frame, face): &&(usize, Face)| {
        faces.face(*frame).is_some_and(|own| (middle(own) - middle(face)).norm() < own.eye_distance() / 2.0)
    };
    (0..people.len()).max_by_key(|&k| (people[k].faces.iter().filter(same).count(), people.len() - k))
}

/// Who is nearest to a pixel where the clip begins.
fn nearest(people: &[Person], wanted: &Vec2) -> Option<usize> {
    let first = people.iter().filter_map(|person| person.faces.first()).map(|(frame, _)| *frame).min()?;
    let distance = |k: usize| people[k].faces.first().map_or(f64::MAX, |(_, face)| (middle(face) - wanted).norm());
    let there = (0..people.len()).filter(|&k| people[k].faces.first().is_some_and(|(frame, _)| *frame == first));
    there.min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
}

/// Who turns, where the one who was followed does not.
fn turning(people: &[Person], current: usize, looks: usize) -> Option<usize> {
    let there = (0..people.len()).filter(|&k| 2 * people[k].faces.len() > looks);
    let most = there.max_by(|&a, &b| people[a].turn().total_cmp(&people[b].turn()).then(b.cmp(&a)))?;
    let turn = people[most].turn();
    (turn > TURN && people[current].turn() < TURNS_LESS * turn).then_some(most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_two_numbers() {
        assert_eq!("320, 180.5".parse(), Ok(Pixel(Vec2::new(320.0, 180.5))));
        for wrong in ["320", "a,b", "1,inf", ""] {
            assert!(wrong.parse::<Pixel>().is_err(), "{wrong}");
        }
    }
}
