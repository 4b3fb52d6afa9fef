//! Which pictures of a film to calibrate from.
//!
//! Neighbouring frames show nearly the same; hundreds of them cost time and tell little more. Pictures that differ most in where
//! the board's corners are, and sharp ones among those, are taken first.

use super::detection::Detection;
use geometry::{Board, Vec2};
use vision::board::BoardCorners;

/// No more pictures than this are taken.
const MAX_PICTURES: usize = 60;
/// A picture blurred by this many times the median is taken only where there are few.
const MAX_BLUR: f64 = 2.0;
/// Why a picture was found and not used.
pub(super) const TOO_ALIKE: &str = "too similar to another picture, which was used";

/// The pictures to calibrate from, in their order: all with a board, or those that differ most.
pub(super) fn choose(detections: &[Detection], boards: &[Board], size: (u32, u32)) -> Vec<usize> {
    let found: Vec<usize> = (0..detections.len()).filter(|&i| detections[i].is_ok()).collect();
    if found.len() <= MAX_PICTURES {
        return found;
    }
    let mut blurs: Vec<f64> = detections.iter().flatten().map(|d| d.blur_px).collect();
    blurs.sort_by(f64::total_cmp);
    let sharp = MAX_BLUR * blurs[blurs.len() / 2];
    let diagonal = f64::from(size.0).hypot(f64::from(size.1));
    let seen: Vec<(usize, Outline)> = found
        .into_iter()
        .filter_map(|i| Some((i, detections[i].as_ref().ok().filter(|d| d.blur_px <= sharp)?)))
        .map(|(i, d)| (i, Outline::of(d, &boards[d.board], diagonal)))
        .collect();
    let mut chosen = farthest_first(&seen);
    chosen.sort_unstable();
    chosen
}

/// Again and again the picture that is farthest from those chosen.
fn farthest_first(seen: &[(usize, Outline)]) -> Vec<usize> {
    let mut distance = vec![f64::INFINITY; seen.len()];
    let mut chosen = Vec::new();
    let mut next = 0;
    while chosen.len() < MAX_PICTURES.min(seen.len()) {
        chosen.push(seen[next].0);
        for (k, (_, outline)) in seen.iter().enumerate() {
            distance[k] = distance[k].min(outline.distance(&seen[next].1));
        }
        next = (0..seen.len()).max_by(|&a, &b| distance[a].total_cmp(&distance[b])).unwrap_or(0);
    }
    chosen
}

/// Where a board is, by mean position and by the affinity of its plane, in parts of the picture's diagonal.
struct Outline([Vec2; 3]);

impl Outline {
    fn of(found: &BoardCorners, board: &Board, diagonal: f64) -> Self {
        let points = board.points();
        let extent = board.extent();
        let count = found.corners.len() as f64;
        let middle = found.corners.iter().map(|c| points[c.index]).sum::<Vec2>() / count;
        let mean = found.corners.iter().map(|c| c.position).sum::<Vec2>() / count;
        let along = |axis: usize| {
            let from_middle = |c: &vision::board::BoardCorner| points[c.index][axis] - middle[axis];
            let spread: f64 = found.corners.iter().map(|c| from_middle(c).powi(2)).sum();
            let sum: Vec2 = found.corners.iter().map(|c| (c.position - mean) * from_middle(c)).sum();
            sum * (extent[axis] / spread.max(f64::MIN_POSITIVE))
        };
        // The mean of a part of the board says where the part is, not where the board is: both tell pictures apart.
        Self([mean, along(0), along(1)].map(|v| v / diagonal))
    }

    fn distance(&self, other: &Self) -> f64 {
        self.0.iter().zip(&other.0).map(|(a, b)| (a - b).norm_squared()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vision::board::{BoardCorner, BoardError};

    /// A board whose middle is at `x`, blurred by `blur`.
    fn seen(x: f64, blur: f64) -> Detection {
        let corner =
            |(index, p): (usize, &Vec2)| BoardCorner { index, position: p * 1000.0 + Vec2::new(x, 0.0), sigma_px: 0.1 };
        let corners = board().points().iter().enumerate().map(corner).collect();
        Ok(BoardCorners { board: 0, corners, oriented: true, blur_px: blur, contrast: 100.0 })
    }

    fn board() -> Board {
        Board::checkerboard(9, 6, 0.0255)
    }

    #[test]
    fn few_pictures_are_all_taken() {
        let none: Detection = Err(BoardError::Unclear { asked: vec![board()].into() });
        let detections = vec![seen(0.0, 1.0), none, seen(0.0, 9.0)];
        assert_eq!(choose(&detections, &[board()], (640, 480)), [0, 2]);
    }

    #[test]
    fn of_a_film_sharp_pictures_all_over_the_frame_are_taken() {
        let film: Vec<Detection> =
            (0..400).map(|k| seen(f64::from(k.min(300)), if k % 7 == 0 { 5.0 } else { 1.0 })).collect();
        let chosen = choose(&film, &[board()], (640, 480));
        assert_eq!(chosen.len(), MAX_PICTURES);
        assert!(chosen.iter().all(|k| k % 7 != 0) && chosen.is_sorted());
        // The board stands still in the last hundred pictures.
        assert!(chosen.iter().filter(|&&k| k > 300).count() < 10, "{chosen:?}");
    }
}
