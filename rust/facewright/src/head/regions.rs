//! Regions of the generic head, by its shape and its landmarks.

use crate::faces::{Appearance, COVERED};
use geometry::Vec3;
use geometry::face_mesh::{BROWS_UPPER, EYE_CONTOURS, EYE_CORNERS, LIPS_OUTER_LOWER, LIPS_OUTER_UPPER};
use head::GenericHead;
use head::ears::ear_vertices;

/// Skin this near a landmark is face, metres.
const FACE: f64 = 0.012;
/// Below this all is neck; below the second so is what lies behind the middle, metres.
const NECK: [f64; 2] = [-0.125, -0.085];

/// The sides of the nose, and what is above and below it.
const WING: usize = 358;
const NASION: usize = 168;
const SUBNASALE: usize = 2;
/// The middle of the lower lip's lower edge.
const LOWER_LIP: usize = 17;

/// A region of the skin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Region {
    Forehead,
    Nose,
    /// The subject's left.
    CheekLeft,
    /// The subject's right.
    CheekRight,
    /// Chin and jaw.
    Chin,
    /// Lids and lips, whose shape is made on its own.
    Features,
    Ears,
    Skull,
    Neck,
}

/// The region of each landmark.
pub fn of_landmarks(head: &GenericHead) -> Vec<Region> {
    let at = head.landmarks(&head.positions);
    let brows =
        BROWS_UPPER.as_flattened().iter().map(|&i| at[i].y).sum::<f64>() / BROWS_UPPER.as_flattened().len() as f64;
    let lips = || LIPS_OUTER_UPPER.iter().chain(&LIPS_OUTER_LOWER);
    let is_feature = |i: usize| {
        let inside =
            at[i].y < at[SUBNASALE].y && at[i].y > at[LOWER_LIP].y && at[i].x.abs() < at[LIPS_OUTER_UPPER[10]].x.abs();
        inside || lips().any(|&l| l == i) || EYE_CONTOURS.as_flattened().contains(&i)
    };
    let region = |i: usize| match at[i] {
        _ if is_feature(i) => Region::Features,
        p if p.y > brows => Region::Forehead,
        p if p.y < at[LOWER_LIP].y => Region::Chin,
        p if p.x.abs() < at[WING].x.abs() && p.y > at[SUBNASALE].y && p.y < at[NASION].y => Region::Nose,
        p if p.x > 0.0 => Region::CheekLeft,
        _ => Region::CheekRight,
    };
    (0..at.len()).map(region).collect()
}

/// The region of each vertex of the skin; `None` in its cavities.
pub fn of_skin(head: &GenericHead) -> Vec<Option<Region>> {
    let (at, of_landmarks) = (head.landmarks(&head.positions), of_landmarks(head));
    let skin = head.skin().vertices.clone();
    let mut is_ear = vec![false; head.positions.len()];
    ear_vertices(head).into_iter().for_each(|v| is_ear[v] = true);
    let region = |v: usize| {
        let place = head.positions[v];
        let (landmark, distance) = nearest(&at, &place);
        match () {
            () if head.cavity[v] => None,
            () if is_ear[v] => Some(Region::Ears),
            () if distance < FACE => Some(of_landmarks[landmark]),
            () if place.y < NECK[0] || (place.y < NECK[1] && place.z < 0.0) => Some(Region::Neck),
            () => Some(Region::Skull),
        }
    };
    skin.clone().map(region).collect()
}

/// The middle of the nose's ridge: a mask ends about there.
const RIDGE: usize = 197;
/// Glasses reach so far around the middle of an eye, metres.
const GLASSES: f64 = 0.026;

/// Of each landmark, whether it lies under what covers the face in most looks.
pub fn covered_landmarks(head: &GenericHead, appearance: Option<Appearance>) -> Vec<bool> {
    let at = head.landmarks(&head.positions);
    let found = appearance.unwrap_or_default();
    let (mouth, eyes) = (found.mouth_cover > COVERED.mouth_cover, found.eyes_cover > COVERED.eyes_cover);
    let middles = EYE_CORNERS.map(|ends| (at[ends[0]] + at[ends[1]]) / 2.0);
    let near = |p: &Vec3| middles.iter().any(|middle| (p - middle).norm() < GLASSES);
    at.iter().map(|p| (mouth && p.y < at[RIDGE].y) || (eyes && near(p))).collect()
}

/// Of each vertex of the skin, whether it does.
pub fn covered_skin(head: &GenericHead, appearance: Option<Appearance>) -> Vec<bool> {
    let covered = covered_landmarks(head, appearance);
    if !covered.contains(&true) {
        return vec![false; head.skin().vertices.len()];
    }
    let at = head.landmarks(&head.positions);
    let is_covered = |v: usize| {
        let (landmark, distance) = nearest(&at, &head.positions[v]);
        distance < FACE && covered[landmark]
    };
    head.skin().vertices.clone().map(is_covered).collect()
}

/// The nearest of some places, and how far it is.
pub fn nearest(places: &[Vec3], to: &Vec3) -> (usize, f64) {
    let distances = places.iter().map(|p| (p - to).norm_squared()).enumerate();
    let (index, squared) = distances.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, f64::MAX));
    (index, squared.sqrt())
}
