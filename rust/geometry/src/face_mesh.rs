//! What the 468 points of the face mesh are, which the landmark net finds and the generic head has as anchors: mirror
//! images, contours, the iBUG scheme.
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
/// Under the nose from the right wing to the left.
pub const NOSE_BASE: [usize; 7] = [129, 98, 97, 2, 326, 327, 358];

/// The part of [`FACE_OVAL`] along the jaw, from the subject's left ear to the right: where the skin turns away from the viewer.
#[rustfmt::skip]
pub const JAW_LINE: [usize; 19] = [
    323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176, 149, 150, 136, 172, 58, 132, 93,
];

/// The 68 landmarks of the iBUG scheme (Sagonas et al. 2013) among the 468 of the face mesh net: jaw from the subject's
/// right ear over the chin to the left ear, right brow, left brow, nose bridge, nose base, right eye, left eye, outer lip, inner lip.
#[rustfmt::skip]
pub const IBUG68: [usize; 68] = [
    127, 234, 93, 58, 172, 136, 149, 148, 152, 377, 378, 365, 397, 288, 323, 454, 356,
    70, 63, 105, 66, 107, 336, 296, 334, 293, 300,
    168, 6, 195, 4, 98, 97, 2, 326, 327,
    33, 160, 158, 133, 153, 144, 362, 385, 387, 263, 373, 380,
    61, 39, 37, 0, 267, 269, 291, 405, 314, 17, 84, 181, 78, 81, 13, 311, 308, 402, 14, 178,
];

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
        assert!(MOUTH_OPENING.iter().all(|&i| MOUTH_OPENING.contains(&MIRROR[i])));
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
}
