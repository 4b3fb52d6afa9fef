//! Float pictures and their pyramids: cell-centred, halved by the kernel 1 3 3 1, doubled by bilinear interpolation.
//!
//! A [`Texel`] is a colour with a weight; weight zero means "nothing known here", and every filter leaves such texels
//! out and divides by the weight it found (normalised convolution, Knutsson & Westin 1993).

use rayon::prelude::*;

/// Red, green, blue (0…255) and weight.
pub(crate) type Texel = [f32; 4];

/// Rows of values.
#[derive(Clone, Debug)]
pub(crate) struct Plane<T> {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) data: Vec<T>,
}

impl<T: Copy + Send + Sync> Plane<T> {
    /// All the same.
    pub(crate) fn new(width: usize, height: usize, value: T) -> Self {
        Self { width, height, data: vec![value; width * height] }
    }

    /// Built row by row in parallel: `row(y, row)`.
    pub(crate) fn from_rows(width: usize, height: usize, value: T, row: impl Fn(usize, &mut [T]) + Sync) -> Self {
        let mut plane = Self::new(width, height, value);
        plane.data.par_chunks_mut(width).enumerate().for_each(|(y, values)| row(y, values));
        plane
    }

    pub(crate) fn row(&self, y: usize) -> &[T] {
        &self.data[y * self.width..(y + 1) * self.width]
    }
}

/// Weights of the kernel that halves a plane.
const KERNEL: [f32; 4] = [0.125, 0.375, 0.375, 0.125];

/// The four fine cells around the centre of a coarse one.
fn children(coarse: usize, fine_size: usize) -> [usize; 4] {
    let (first, last) = (2 * coarse, fine_size - 1);
    [first.saturating_sub(1), first, (first + 1).min(last), (first + 2).min(last)]
}

/// Positions and weights of linear interpolation at the centre of fine cell `fine` among coarse cells.
fn parents(fine: usize, coarse_size: usize) -> [(usize, f32); 2] {
    let near = fine / 2;
    let far = if fine.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(coarse_size - 1) };
    [(near, 0.75), (far, 0.25)]
}

/// Half the size: mean colour by weight, and mean weight.
pub(crate) fn reduce(fine: &Plane<Texel>) -> Plane<Texel> {
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    Plane::from_rows(width, height, [0.0; 4], |y, out| {
        // First down the columns, colours times weight, then along the row; stretches without weight are passed over.
        let mut columns = vec![[0.0f32; 4]; fine.width];
        for (row, part) in children(y, fine.height).into_iter().zip(KERNEL) {
            for (sum, &[r, g, b, w]) in columns.iter_mut().zip(fine.row(row)) {
                if w > 0.0 {
                    let w = w * part;
                    *sum = [sum[0] + w * r, sum[1] + w * g, sum[2] + w * b, sum[3] + w];
                }
            }
        }
        for (x, texel) in out.iter_mut().enumerate() {
            let mut sum = [0.0f32; 4];
            for (column, part) in children(x, fine.width).into_iter().zip(KERNEL) {
                let column = &columns[column];
                (0..4).for_each(|k| sum[k] += part * column[k]);
            }
            if sum[3] > 0.0 {
                *texel = [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], sum[3]];
            }
        }
    })
}

/// The colour of a coarser plane at the centre of a fine cell, from those of its four nearest cells that are known;
/// `None` when none is.
pub(crate) fn expand_at(coarse: &Plane<Texel>, x: usize, y: usize) -> Option<[f32; 3]> {
    let (columns, rows) = (parents(x, coarse.width), parents(y, coarse.height));
    let mut sum = [0.0f32; 4];
    for (row, row_weight) in rows {
        let row = coarse.row(row);
        for (column, column_weight) in columns {
            let [r, g, b, w] = row[column];
            if w > 0.0 {
                let weight = row_weight * column_weight;
                sum = [sum[0] + weight * r, sum[1] + weight * g, sum[2] + weight * b, sum[3] + weight];
            }
        }
    }
    (sum[3] > 0.0).then(|| [sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3]])
}

/// A scalar plane stretched to another size, bilinear.
pub(crate) struct Stretched<'a> {
    plane: &'a Plane<f32>,
    height: usize,
    columns: Vec<(u32, f32)>,
}

/// A row of a [`Stretched`] plane.
pub(crate) struct StretchedRow<'a> {
    values: Vec<f32>,
    columns: &'a [(u32, f32)],
}

impl<'a> Stretched<'a> {
    pub(crate) fn new(plane: &'a Plane<f32>, width: usize, height: usize) -> Self {
        let columns = (0..width).map(|x| stretched_place(x, plane.width, width)).collect();
        Self { plane, height, columns }
    }

    pub(crate) fn row(&self, y: usize) -> StretchedRow<'_> {
        let (j, part) = stretched_place(y, self.plane.height, self.height);
        let (top, bottom) = (self.plane.row(j as usize), self.plane.row((j as usize + 1).min(self.plane.height - 1)));
        let mut values: Vec<f32> = top.iter().zip(bottom).map(|(t, b)| t + part * (b - t)).collect();
        // One more, so that the last value has a neighbour.
        values.extend(values.last().copied());
        StretchedRow { values, columns: &self.columns }
    }
}

impl StretchedRow<'_> {
    #[inline]
    pub(crate) fn at(&self, x: usize) -> f32 {
        let (i, part) = self.columns[x];
        let (left, right) = (self.values[i as usize], self.values[i as usize + 1]);
        left + part * (right - left)
    }
}

/// The cell before the centre of cell `i` of `stretched`, among `size`, and how far it lies towards the next.
pub(crate) fn stretched_place(i: usize, size: usize, stretched: usize) -> (u32, f32) {
    let at = ((i as f32 + 0.5) * size as f32 / stretched as f32 - 0.5).clamp(0.0, (size - 1) as f32);
    (at as u32, at - (at as u32) as f32)
}

/// Mean over a (2 `radius` + 1)² square, border cells repeated.
pub(crate) fn box_blur(plane: &Plane<f32>, radius: usize) -> Plane<f32> {
    let near = move |i: usize, n: usize| (0..=2 * radius).map(move |k| (i + k).saturating_sub(radius).min(n - 1));
    let count = (2 * radius + 1) as f32;
    let along = |plane: &Plane<f32>| {
        Plane::from_rows(plane.width, plane.height, 0.0, |y, out| {
            let row = plane.row(y);
            out.iter_mut().enumerate().for_each(|(x, v)| *v = near(x, row.len()).map(|i| row[i]).sum::<f32>() / count);
        })
    };
    let rows = along(plane);
    Plane::from_rows(plane.width, plane.height, 0.0, |y, out| {
        for j in near(y, plane.height) {
            out.iter_mut().zip(rows.row(j)).for_each(|(v, r)| *v += r / count);
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flat_colour_stays_flat_and_unknown_texels_do_not_darken_it() {
        let mut plane = Plane::new(13, 9, [40.0, 90.0, 200.0, 1.0]);
        plane.data.iter_mut().step_by(3).for_each(|t| *t = [0.0; 4]);
        let half = reduce(&plane);
        assert_eq!((half.width, half.height), (7, 5));
        for y in 0..9 {
            for x in 0..13 {
                let c = expand_at(&half, x, y).unwrap();
                assert!((c[0] - 40.0).abs() < 1e-4 && (c[2] - 200.0).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_ramp_keeps_its_place_through_reduction() {
        let ramp = Plane::from_rows(32, 4, [0.0; 4], |_, row| {
            row.iter_mut().enumerate().for_each(|(x, t)| *t = [x as f32, 0.0, 0.0, 1.0]);
        });
        let half = reduce(&ramp);
        for x in 4..28 {
            assert!((expand_at(&half, x, 2).unwrap()[0] - x as f32).abs() < 1e-4);
        }
        let scalar = Plane { width: 32, height: 1, data: (0..32).map(|x| x as f32).collect() };
        let stretched = Stretched::new(&scalar, 64, 3);
        assert!((stretched.row(1).at(20) - 9.75).abs() < 1e-4 && stretched.row(2).at(63) == 31.0);
        assert!((box_blur(&scalar, 2).data[10] - 10.0).abs() < 1e-4);
    }
}
