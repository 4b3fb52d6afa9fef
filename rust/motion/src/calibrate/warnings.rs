//! What a calibration lacks, and what to photograph next.

use super::{BoardBend, BoardView, ViewFit};
use geometry::{Camera, Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// Relative standard deviation of the focal length from which a warning is given.
const FOCAL_DEVIATION: f64 = 0.005;
/// Fewer pictures give a warning.
const FEW_VIEWS: usize = 6;
/// The board should be turned about each axis by this, degrees.
const SMALL_TILT_DEG: f64 = 20.0;
/// Tilted to a side by less than this counts as not tilted to it, degrees.
const NO_TILT_DEG: f64 = 10.0;
/// A picture with this many times the median error is suspicious.
const BAD_VIEW: f64 = 3.0;
/// Times by which pictures may differ more than their corners' noise explains.
const MAX_SCATTER: f64 = 2.0;
/// Errors below this are those of rounding, pixels.
const NO_ERROR: f64 = 1e-6;

/// A side to which a board is tilted: the one that comes nearer to the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// Its left side, in the picture.
    Left,
    /// Its right side, in the picture.
    Right,
    /// Its upper side, in the picture.
    Top,
    /// Its lower side, in the picture.
    Bottom,
}

impl std::fmt::Display for Side {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Left => "left side",
            Self::Right => "right side",
            Self::Top => "top",
            Self::Bottom => "bottom",
        })
    }
}

/// One of the eight outer ninths of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PicturePart {
    /// The corner at its origin.
    TopLeft,
    /// The middle of its upper side.
    Top,
    /// The corner at the end of its first row.
    TopRight,
    /// The middle of its left side.
    Left,
    /// The middle of its right side.
    Right,
    /// The corner at the beginning of its last row.
    BottomLeft,
    /// The middle of its lower side.
    Bottom,
    /// The corner at the end of its last row.
    BottomRight,
}

impl PicturePart {
    /// With its column and row of nine.
    const ALL: [(Self, (usize, usize)); 8] = [
        (Self::TopLeft, (0, 0)),
        (Self::Top, (1, 0)),
        (Self::TopRight, (2, 0)),
        (Self::Left, (0, 1)),
        (Self::Right, (2, 1)),
        (Self::BottomLeft, (0, 2)),
        (Self::Bottom, (1, 2)),
        (Self::BottomRight, (2, 2)),
    ];
}

impl std::fmt::Display for PicturePart {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TopLeft => "top left corner",
            Self::Top => "middle of the top",
            Self::TopRight => "top right corner",
            Self::Left => "middle of the left side",
            Self::Right => "middle of the right side",
            Self::BottomLeft => "bottom left corner",
            Self::Bottom => "middle of the bottom",
            Self::BottomRight => "bottom right corner",
        })
    }
}

/// A reason to trust a calibration less.
#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
pub enum CalibrateWarning {
    /// Few pictures.
    #[error("only {views} pictures of the board: ten to twenty, tilted to all sides, give a better camera")]
    FewViews {
        /// Their number.
        views: usize,
    },
    /// All boards face nearly the same way, or were turned about one axis only.
    #[error(
        "the board was tilted by no more than {tilt_deg:.0}° between pictures: take some with its {} 30° nearer to the camera",
        listed(missing, "or")
    )]
    SmallTilt {
        /// Largest turn between two boards about the axis with less turning.
        tilt_deg: f64,
        /// Sides that never came nearer.
        missing: Vec<Side>,
    },
    /// The focal length is not well determined.
    #[error(
        "the focal length is uncertain by {percent:.1} %: add pictures with the board tilted by 30° or more to all sides"
    )]
    UncertainFocal {
        /// Standard deviation, percent.
        percent: f64,
    },
    /// Parts of the picture never showed the board.
    #[error(
        "no board corner was seen in the picture's {}, where the distortion is extrapolated: show the board there",
        listed(missing, "and")
    )]
    SmallReach {
        /// How far the board reached from the picture's middle to its corners, percent.
        percent: f64,
        /// Parts without any corner of the board.
        missing: Vec<PicturePart>,
    },
    /// One picture fits much worse than the others.
    #[error("picture {} fits badly ({rms_px:.2} px): leave it out if the board was bent or the picture is blurred", .view + 1)]
    BadView {
        /// Its index.
        view: usize,
        /// Its error, pixels.
        rms_px: f64,
    },
    /// Pictures contradict each other more than their noise explains.
    #[error(
        "the pictures differ {factor:.1} times more than the noise of their corners explains: hold the board and the \
         camera still, use a stiff board, and fix focus and zoom"
    )]
    Scattered {
        /// How many times more.
        factor: f64,
    },
    /// The board is bent.
    #[error(
        "the board bulges by {bulge_mm:.2} ± {deviation_mm:.2} mm: glue the print onto glass or a stiff board, \
         or let the calibration solve for the bend"
    )]
    BentBoard {
        /// Height difference of its corners, millimetres.
        bulge_mm: f64,
        /// Its standard deviation.
        deviation_mm: f64,
    },
    /// The lens model folds the picture over inside the frame.
    #[error(
        "the distortion found is not valid up to the picture's corners: show the board there, or use fewer distortion terms"
    )]
    FoldedDistortion,
}

/// `a`, `a or b`, `a, b or c`.
fn listed<T: std::fmt::Display>(items: &[T], last: &str) -> String {
    let words: Vec<String> = items.iter().map(ToString::to_string).collect();
    match words.as_slice() {
        [] => String::new(),
        [only] => only.clone(),
        [others @ .., end] => format!("{} {last} {end}", others.join(", ")),
    }
}

/// What is judged.
pub(super) struct Evidence<'a> {
    pub(super) camera: &'a Camera,
    pub(super) pictures: &'a [&'a BoardView],
    pub(super) views: &'a [ViewFit],
    /// Parts of it.
    pub(super) focal_deviation: f64,
}

/// What is wrong with the board or with how it was held. A bend that was allowed for is not given.
pub(super) fn of_board(bend: Option<&BoardBend>, scatter: Option<f64>) -> Option<CalibrateWarning> {
    match (bend.filter(|b| b.is_clear()), scatter) {
        // A bent board explains scatter.
        (Some(b), _) => Some(CalibrateWarning::BentBoard { bulge_mm: b.bulge_mm, deviation_mm: b.deviation_mm }),
        (None, Some(factor)) if factor > MAX_SCATTER => Some(CalibrateWarning::Scattered { factor }),
        _ => None,
    }
}

impl Evidence<'_> {
    pub(super) fn warnings(&self) -> Vec<CalibrateWarning> {
        let mut warnings = Vec::new();
        if self.views.len() < FEW_VIEWS {
            warnings.push(CalibrateWarning::FewViews { views: self.views.len() });
        }
        warnings.extend(self.tilt());
        if self.focal_deviation > FOCAL_DEVIATION {
            warnings.push(CalibrateWarning::UncertainFocal { percent: 100.0 * self.focal_deviation });
        }
        warnings.extend(self.reach());
        warnings.extend(self.bad_views());
        if self.is_folded() {
            warnings.push(CalibrateWarning::FoldedDistortion);
        }
        warnings
    }

    /// A plane's picture gives a camera two numbers by its tilt; parallel planes give the same two.
    fn tilt(&self) -> Option<CalibrateWarning> {
        // A board whose face looks to the right has its left side nearer.
        let tilts = |k: usize| -> Vec<f64> {
            let normals = self.views.iter().map(|v| v.cam_from_board.rotation * Vec3::z());
            normals.map(|n| (-n[k] * n.z.signum()).atan2(n.z.abs()).to_degrees()).collect()
        };
        let axes = [(tilts(0), [Side::Right, Side::Left]), (tilts(1), [Side::Bottom, Side::Top])];
        let (mut tilt_deg, mut missing) = (f64::INFINITY, Vec::new());
        for (tilts, [negative, positive]) in axes {
            let least = tilts.iter().copied().fold(f64::INFINITY, f64::min);
            let most = tilts.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            if most - least < SMALL_TILT_DEG {
                tilt_deg = tilt_deg.min(most - least);
                missing.extend((most < NO_TILT_DEG).then_some(positive));
                missing.extend((least > -NO_TILT_DEG).then_some(negative));
            }
        }
        (!missing.is_empty()).then_some(CalibrateWarning::SmallTilt { tilt_deg, missing })
    }

    fn reach(&self) -> Option<CalibrateWarning> {
        let border = Vec2::new(f64::from(self.camera.width) - 1.0, f64::from(self.camera.height) - 1.0);
        let pixels = || self.pictures.iter().flat_map(|p| &p.pixels);
        let radius = pixels().map(|p| (p - border / 2.0).norm()).fold(0.0, f64::max);
        let third = |p: &Vec2| {
            let of = |k: usize| (3.0 * (p[k] + 0.5) / (border[k] + 1.0)).clamp(0.0, 2.0) as usize;
            (of(0), of(1))
        };
        let mut seen = [[false; 3]; 3];
        pixels().map(third).for_each(|(column, row)| seen[row][column] = true);
        let unseen = PicturePart::ALL.iter().filter(|(_, (column, row))| !seen[*row][*column]);
        let missing: Vec<PicturePart> = unseen.map(|(part, _)| *part).collect();
        let percent = 100.0 * radius / (border.norm() / 2.0);
        (!missing.is_empty()).then_some(CalibrateWarning::SmallReach { percent, missing })
    }

    fn bad_views(&self) -> Vec<CalibrateWarning> {
        let mut errors: Vec<f64> = self.views.iter().map(|v| v.rms_px).collect();
        errors.sort_by(f64::total_cmp);
        let limit = (BAD_VIEW * errors.get(errors.len() / 2).copied().unwrap_or(0.0)).max(NO_ERROR);
        let bad = self.views.iter().enumerate().filter(|(_, v)| v.rms_px > limit);
        bad.map(|(view, v)| CalibrateWarning::BadView { view, rms_px: v.rms_px }).collect()
    }

    fn is_folded(&self) -> bool {
        let (right, bottom) = (f64::from(self.camera.width) - 1.0, f64::from(self.camera.height) - 1.0);
        let corners = [(0.0, 0.0), (right, 0.0), (0.0, bottom), (right, bottom)];
        corners.iter().any(|&(x, y)| self.camera.try_normalise(&Vec2::new(x, y)).is_none())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_and_parts_are_listed_as_in_a_sentence() {
        assert_eq!(listed(&[Side::Left], "or"), "left side");
        assert_eq!(listed(&[Side::Left, Side::Right, Side::Top], "or"), "left side, right side or top");
        assert_eq!(listed::<Side>(&[], "or"), "");
    }
}
