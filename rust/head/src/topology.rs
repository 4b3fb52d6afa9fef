//! Which of the 468 landmarks is which.

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

/// The outline of the face as the net draws it: a contour of the view, not points of the skin.
#[rustfmt::skip]
pub const FACE_OVAL: [usize; 36] = [
    10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377,
    152, 148, 176, 149, 150, 136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109,
];

/// The part of [`FACE_OVAL`] along the jaw, from the subject's left ear to the right: where the skin turns away from the viewer.
#[rustfmt::skip]
pub const JAW_LINE: [usize; 19] = [
    323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176, 149, 150, 136, 172, 58, 132, 93,
];
