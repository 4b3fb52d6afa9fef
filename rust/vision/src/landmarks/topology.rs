//! What the 468 points of the face mesh are: mirror images, contours, regions, uncertainties.
//!
//! # Conventions
//! "Left" and "right" are the subject's. Pairs are `[left, right]`. The numbering is that of Google's MediaPipe face
//! mesh. Contours name what they run along and from where to where.

/// Points of the mesh.
pub const LANDMARKS: usize = 468;

/// Points on the middle line, their own mirror images.
pub const MIDDLE: [usize; 28] =
    [0, 1, 2, 4, 5, 6, 8, 9, 10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 94, 151, 152, 164, 168, 175, 195, 197, 199, 200];

/// The mirror image of every point: `MIRROR[MIRROR[i]] == i`.
pub const MIRROR: [usize; LANDMARKS] = mirror_table();

/// The mesh numbers the middle and the right half first, then the left half in the order of its mirror images.
/// (Found by matching the net's answers for pictures with its answers for the mirrored pictures.)
const fn mirror_table() -> [usize; LANDMARKS] {
    const FIRST_LEFT: usize = 248;
    let mut table = [0; LANDMARKS];
    let (mut left, mut i) = (FIRST_LEFT, 0);
    while i < FIRST_LEFT {
        table[i] = i;
        let (mut k, mut in_middle) = (0, false);
        while k < MIDDLE.len() {
            in_middle |= MIDDLE[k] == i;
            k += 1;
        }
        if !in_middle {
            table[i] = left;
            table[left] = i;
            left += 1;
        }
        i += 1;
    }
    table
}

/// The mirror images of a list of points, in the same order.
const fn mirrored<const N: usize>(points: [usize; N]) -> [usize; N] {
    let mut images = points;
    let mut k = 0;
    while k < N {
        images[k] = MIRROR[points[k]];
        k += 1;
    }
    images
}

/// A right-side list and its mirror image, as `[left, right]`.
const fn pair<const N: usize>(right: [usize; N]) -> [[usize; N]; 2] {
    [mirrored(right), right]
}

/// Around the face, from the top of the forehead over the left temple, the chin and the right temple.
/// The picture's silhouette, not fixed places on the skin.
pub const FACE_OVAL: [usize; 36] = [
    10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176, 149, 150,
    136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109,
];

/// Upper lids, outer to inner corner.
pub const UPPER_LIDS: [[usize; 9]; 2] = pair([33, 246, 161, 160, 159, 158, 157, 173, 133]);
/// Lower lids, outer to inner corner.
pub const LOWER_LIDS: [[usize; 9]; 2] = pair([33, 7, 163, 144, 145, 153, 154, 155, 133]);
/// Around each eye: outer corner, lower lid, inner corner, upper lid.
pub const EYE_CONTOURS: [[usize; 16]; 2] =
    pair([33, 7, 163, 144, 145, 153, 154, 155, 133, 173, 157, 158, 159, 160, 161, 246]);
/// Corners of each eye in the order they have in an upright picture, left to right.
pub const EYE_CORNERS: [[usize; 2]; 2] = [[362, 263], [33, 133]];
/// Outer eye corners.
pub const OUTER_EYE_CORNERS: [usize; 2] = [263, 33];

/// Upper edges of the brows, outer to inner.
pub const BROWS_UPPER: [[usize; 5]; 2] = pair([70, 63, 105, 66, 107]);
/// Lower edges of the brows, outer to inner.
pub const BROWS_LOWER: [[usize; 5]; 2] = pair([46, 53, 52, 65, 55]);

/// Outer edge of the upper lip, right to left corner.
pub const LIPS_OUTER_UPPER: [usize; 11] = [61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291];
/// Outer edge of the lower lip, right to left corner.
pub const LIPS_OUTER_LOWER: [usize; 11] = [61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291];
/// Inner edge of the upper lip, right to left corner.
pub const LIPS_INNER_UPPER: [usize; 11] = [78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308];
/// Inner edge of the lower lip, right to left corner.
pub const LIPS_INNER_LOWER: [usize; 11] = [78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308];
/// Around the opening of the mouth: right corner, upper lip, left corner, lower lip.
pub const MOUTH_OPENING: [usize; 20] =
    [78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308, 324, 318, 402, 317, 14, 87, 178, 88, 95];

/// The ridge of the nose, from between the eyes to the tip, then under it to the lip.
pub const NOSE_RIDGE: [usize; 8] = [168, 6, 197, 195, 5, 4, 1, 2];
/// The skin of the nose and its wings.
pub const NOSE: [usize; 74] = [
    1, 2, 3, 4, 5, 6, 19, 20, 44, 45, 48, 51, 59, 60, 64, 75, 79, 94, 97, 98, 99, 114, 115, 122, 125, 131, 134, 141,
    168, 174, 188, 195, 196, 197, 198, 218, 220, 236, 237, 238, 241, 242, 248, 250, 274, 275, 278, 281, 289, 290, 294,
    305, 309, 326, 327, 328, 343, 344, 351, 354, 360, 363, 370, 399, 412, 419, 420, 438, 440, 456, 457, 458, 461, 462,
];

/// Points away from the oval that still slide over the skin from person to person: jaw line, temples, in front of the
/// ears, outer cheeks.
pub const LOOSE: [usize; 31] = [
    34, 71, 116, 123, 137, 138, 139, 143, 147, 171, 175, 177, 192, 213, 215, 227, 264, 301, 345, 352, 366, 367, 368,
    372, 376, 396, 401, 416, 433, 435, 447,
];

/// The mesh points that come nearest to the 68 points of the iBUG scheme, in its order: jaw 0–16 from the right, right
/// brow 17–21 from outside, left brow 22–26 from inside, nose 27–35, right eye 36–41, left eye 42–47, lips 48–67.
#[rustfmt::skip]
pub const IBUG68: [usize; 68] = [
    127, 93, 132, 58, 136, 150, 176, 148, 152, 377, 400, 379, 365, 288, 361, 323, 356, // jaw
    70, 63, 105, 66, 107, 336, 296, 334, 293, 300, // brows
    8, 6, 195, 4, 98, 97, 2, 326, 327, // nose
    33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380, // eyes
    61, 39, 37, 0, 267, 269, 291, 321, 314, 17, 84, 91, // outer lips
    78, 82, 13, 312, 308, 317, 14, 87, // inner lips
];

/// How far each point strays over the skin from person to person and view to view: one standard deviation, as a
/// fraction of the distance between the eyes.
///
/// Measured on twelve rendered heads of one topology. Points of the oval are silhouette points; their figure only says
/// that they must not be taken for places on the skin.
pub fn standard_deviations() -> [f64; LANDMARKS] {
    let mut deviations = [0.033; LANDMARKS];
    let mut set = |points: &[usize], value: f64| points.iter().for_each(|&i| deviations[i] = value);
    set(&NOSE, 0.032);
    set(&LOOSE, 0.08);
    set(&FACE_OVAL, 0.15);
    set(LIPS_OUTER_UPPER.as_slice(), 0.03);
    set(LIPS_OUTER_LOWER.as_slice(), 0.03);
    set(&MOUTH_OPENING, 0.024);
    BROWS_UPPER.iter().chain(&BROWS_LOWER).for_each(|brow| set(brow, 0.04));
    EYE_CONTOURS.iter().for_each(|lids| set(lids, 0.02));
    deviations
}

/// The points that may be taken for fixed places on the skin: all but the oval and the loose ones, in order.
pub fn inner_face() -> Vec<usize> {
    (0..LANDMARKS).filter(|i| !FACE_OVAL.contains(i) && !LOOSE.contains(i)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirroring_twice_gives_the_point_itself() {
        assert!((0..LANDMARKS).all(|i| MIRROR[MIRROR[i]] == i));
        assert_eq!((0..LANDMARKS).filter(|&i| MIRROR[i] == i).count(), 28);
    }

    #[test]
    fn known_pairs_are_mirror_images() {
        for (right, left) in [(33, 263), (61, 291), (234, 454), (133, 362), (105, 334), (64, 294), (78, 308)] {
            assert_eq!((MIRROR[right], MIRROR[left]), (left, right));
        }
    }

    #[test]
    fn contours_are_their_own_mirror_images() {
        let reversed = |points: &[usize]| points.iter().rev().map(|&i| MIRROR[i]).collect::<Vec<_>>();
        for lip in [LIPS_OUTER_UPPER, LIPS_OUTER_LOWER, LIPS_INNER_UPPER, LIPS_INNER_LOWER] {
            assert_eq!(reversed(&lip), lip);
        }
        assert_eq!(reversed(&FACE_OVAL[1..]), FACE_OVAL[1..]);
        for set in [&NOSE[..], &LOOSE[..], &MOUTH_OPENING[..]] {
            assert!(set.iter().all(|&i| set.contains(&MIRROR[i])));
        }
        assert!(NOSE_RIDGE.iter().all(|i| MIDDLE.contains(i)));
    }

    #[test]
    fn ibug_points_are_pairwise_mirror_images() {
        // The scheme's own mirror image: jaw, brows, nose base, eyes and lips read backwards.
        let runs: [(usize, usize); 4] = [(0, 17), (17, 27), (31, 36), (48, 55)];
        for (start, end) in runs {
            assert!((start..end).all(|k| IBUG68[start + end - 1 - k] == MIRROR[IBUG68[k]]), "{start}..{end}");
        }
        for (right, left) in [(36, 45), (37, 44), (38, 43), (39, 42), (40, 47), (41, 46), (59, 55), (58, 56), (67, 65)]
        {
            assert_eq!(MIRROR[IBUG68[right]], IBUG68[left]);
        }
    }

    #[test]
    fn the_inner_face_has_neither_oval_nor_loose_points() {
        assert_eq!(inner_face().len(), LANDMARKS - 36 - LOOSE.iter().filter(|i| !FACE_OVAL.contains(i)).count());
        assert!(standard_deviations().iter().all(|&d| d > 0.0));
    }
}
