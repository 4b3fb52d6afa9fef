//! What part of the face a pixel belongs to.

use super::Region;
use geometry::Vec2;
use geometry::face_mesh::{
    BROWS_LOWER, BROWS_UPPER, EYE_CONTOURS, LIPS_INNER_LOWER, LIPS_INNER_UPPER, LIPS_OUTER_LOWER, LIPS_OUTER_UPPER,
};
use vision::landmarks::Face;

/// The part that the nearest landmark belongs to: the mesh is dense enough that lips, lids and brows get about half the
/// distance to their neighbours around them.
pub fn region(face: &Face, pixel: &Vec2) -> Region {
    let distance = |i: usize| (face.points[i].xy() - pixel).norm_squared();
    let nearest = (0..face.points.len()).min_by(|&i, &j| distance(i).total_cmp(&distance(j)));
    nearest.map_or(Region::Skin, of_landmark)
}

fn of_landmark(i: usize) -> Region {
    let lips = [LIPS_OUTER_UPPER, LIPS_OUTER_LOWER, LIPS_INNER_UPPER, LIPS_INNER_LOWER];
    if lips.iter().flatten().any(|&l| l == i) {
        Region::Mouth
    } else if EYE_CONTOURS.iter().flatten().any(|&l| l == i) {
        Region::Eyes
    } else if BROWS_UPPER.iter().chain(&BROWS_LOWER).flatten().any(|&l| l == i) {
        Region::Brows
    } else {
        Region::Skin
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn landmarks_know_their_part() {
        for (landmark, region) in
            [(13, Region::Mouth), (61, Region::Mouth), (159, Region::Eyes), (105, Region::Brows), (4, Region::Skin)]
        {
            assert_eq!(of_landmark(landmark), region, "{landmark}");
        }
    }
}
