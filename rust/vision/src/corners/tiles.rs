//! The part of the picture that is searched, in pieces.

use image::GrayImage;

/// Largest piece: its rows fit into the nearest cache, and it is high enough that the rows above it which its first
/// windows need cost little.
const WIDTH: usize = 256;
const HEIGHT: usize = 64;
/// Pixels of a mask that are tested together, at most 255.
const PIECE: usize = 128;

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tile {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

/// The part of the picture where corners may lie.
pub(super) struct Area {
    /// The bounding box of the mask within the border.
    pub bounds: Tile,
}

impl Area {
    /// `None` if there is no pixel of the mask within the border.
    pub fn of(mask: Option<&GrayImage>, width: usize, height: usize, border: usize) -> Option<Self> {
        if width <= 2 * border || height <= 2 * border {
            return None;
        }
        let frame = Tile { left: border, top: border, width: width - 2 * border, height: height - 2 * border };
        Some(Self { bounds: frame.trimmed(mask)? })
    }

    /// Pixels of the mask within.
    pub fn allowed(&self, mask: Option<&GrayImage>) -> usize {
        let bounds = self.bounds;
        let Some(mask) = mask else { return bounds.width * bounds.height };
        let white = |piece: &[u8]| usize::from(piece.iter().map(|&v| u8::from(v != 0)).sum::<u8>());
        // Counts of a piece fit into a byte.
        bounds.rows().flat_map(|y| bounds.row(mask, y).chunks(PIECE)).map(white).sum()
    }

    /// Pieces which together hold all of the mask but the edge of its bounding box, where no peak can be told.
    pub fn tiles(&self, mask: Option<&GrayImage>) -> Vec<Tile> {
        let Tile { left, top, width, height } = self.bounds;
        let (right, bottom) = ((left + width).saturating_sub(1), (top + height).saturating_sub(1));
        let corners =
            (top + 1..bottom).step_by(HEIGHT).flat_map(|y| (left + 1..right).step_by(WIDTH).map(move |x| (x, y)));
        let tile = |(x, y)| Tile { left: x, top: y, width: WIDTH.min(right - x), height: HEIGHT.min(bottom - y) };
        corners.filter_map(|corner| tile(corner).trimmed(mask)).collect()
    }
}

impl Tile {
    /// The smallest tile that holds all the mask's pixels of this one; `None` if there are none.
    fn trimmed(&self, mask: Option<&GrayImage>) -> Option<Self> {
        let Some(mask) = mask else { return Some(*self) };
        let white = |y: &usize| first_white(self.row(mask, *y)).is_some();
        let (top, bottom) = (self.rows().find(white)?, self.rows().rfind(white)?);
        let rows = Self { top, height: bottom + 1 - top, ..*self };
        let (mut first, mut last) = (self.width, 0);
        for row in rows.rows().map(|y| rows.row(mask, y)) {
            // Only what lies beyond those known is of interest.
            first = first_white(&row[..first]).unwrap_or(first);
            last = last_white(&row[last..]).map_or(last, |x| last + x);
        }
        Some(Self { left: self.left + first, width: last + 1 - first, ..rows })
    }

    fn rows(&self) -> std::ops::Range<usize> {
        self.top..self.top + self.height
    }

    fn row<'m>(&self, mask: &'m GrayImage, y: usize) -> &'m [u8] {
        &mask.as_raw()[y * mask.width() as usize + self.left..][..self.width]
    }
}

/// Column of the first pixel that is not black.
fn first_white(row: &[u8]) -> Option<usize> {
    let start = PIECE * row.chunks(PIECE).position(has_white)?;
    row[start..].iter().position(|&v| v != 0).map(|x| start + x)
}

/// Column of the last one.
fn last_white(row: &[u8]) -> Option<usize> {
    let end = row.len() - PIECE * row.rchunks(PIECE).position(has_white)?;
    row[..end].iter().rposition(|&v| v != 0)
}

/// All pixels are tested together: most pieces are black or white altogether.
fn has_white(piece: &[u8]) -> bool {
    piece.iter().fold(0, |all, &v| all | v) != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Luma;

    #[test]
    fn the_area_is_the_masks_bounding_box_within_the_border() {
        let mask =
            GrayImage::from_fn(50, 40, |x, y| Luma([u8::from((x, y) == (20, 9) || (x, y) == (30, 33) || x == 1)]));
        let area = Area::of(Some(&mask), 50, 40, 4).unwrap();
        assert_eq!(area.bounds, Tile { left: 20, top: 9, width: 11, height: 25 });
        assert_eq!(area.allowed(Some(&mask)), 2);
        assert!(Area::of(Some(&GrayImage::new(50, 40)), 50, 40, 4).is_none());
        assert!(Area::of(None, 8, 40, 4).is_none());
    }

    #[test]
    fn tiles_hold_every_pixel_of_the_mask_once_and_little_else() {
        let mask = GrayImage::from_fn(700, 300, |x, y| {
            Luma([u8::from((x as i32 - 400).pow(2) + 4 * (y as i32 - 150).pow(2) < 200_i32.pow(2))])
        });
        for mask in [None, Some(&mask)] {
            let area = Area::of(mask, 700, 300, 10).unwrap();
            let mut seen = GrayImage::new(700, 300);
            for tile in area.tiles(mask) {
                for (y, x) in tile.rows().flat_map(|y| (tile.left..tile.left + tile.width).map(move |x| (y, x))) {
                    seen.get_pixel_mut(x as u32, y as u32).0[0] += 1;
                }
            }
            let b = area.bounds;
            let inner = |x: usize, y: usize| {
                (b.left + 1..b.left + b.width - 1).contains(&x) && (b.top + 1..b.top + b.height - 1).contains(&y)
            };
            let mut covered = 0;
            for (x, y, count) in seen.enumerate_pixels() {
                covered += usize::from(count.0[0]);
                assert!(count.0[0] < 2);
                let white = mask.is_none_or(|mask| mask.get_pixel(x, y).0[0] != 0);
                assert!(count.0[0] == 1 || !white || !inner(x as usize, y as usize), "{x} {y}");
            }
            assert!(covered as f64 <= 1.2 * area.allowed(mask) as f64, "{covered} for {}", area.allowed(mask));
        }
    }
}
