//! Whole numbers against a plain reading of the definitions, at all sizes, within the frame and over its edge.

use super::cells::Products;
use super::judge::JudgeWhole;
use super::pixels::Block;
use super::take::TakingWhole;
use super::{Cut, WholePatch};
use crate::pyramid::Pyramid;
use crate::track::lanes::{Kernel, Plain, Vectors, dispatch};
use crate::track::solve::Fit;
use crate::track::window::Window;
use geometry::Vec2;
use image::{GrayImage, Luma};

const SIZE: (u32, u32) = (91, 71);
const SIDES: [usize; 9] = [3, 5, 7, 9, 15, 17, 21, 25, 31];
const CENTRES: [Vec2; 4] = [Vec2::new(42.3, 33.6), Vec2::new(41.0, 30.0), Vec2::new(4.2, 66.9), Vec2::new(87.96, 2.01)];

fn picture() -> GrayImage {
    GrayImage::from_fn(SIZE.0, SIZE.1, |x, y| {
        let (x, y) = (f64::from(x), f64::from(y));
        Luma([(127.0 + 60.0 * (x * 0.7 + 0.2 * y).sin() + 60.0 * (0.9 * y - 0.3 * x).cos()) as u8])
    })
}

/// Bilinear, the edge repeated.
fn grey(picture: &GrayImage, at: Vec2) -> f64 {
    let pixel = |x: f64, y: f64| {
        let (x, y) = (x.clamp(0.0, f64::from(SIZE.0 - 1)), y.clamp(0.0, f64::from(SIZE.1 - 1)));
        f64::from(picture.get_pixel(x as u32, y as u32).0[0])
    };
    let (x, y) = (at.x.floor(), at.y.floor());
    let (fx, fy) = (at.x - x, at.y - y);
    let row = |y: f64| pixel(x, y) * (1.0 - fx) + pixel(x + 1.0, y) * fx;
    row(y) * (1.0 - fy) + row(y + 1.0) * fy
}

fn slope(picture: &GrayImage, at: Vec2) -> Vec2 {
    let g = |x: f64, y: f64| grey(picture, at + Vec2::new(x, y));
    let gx = 3.0 * (g(1.0, -1.0) - g(-1.0, -1.0) + g(1.0, 1.0) - g(-1.0, 1.0)) + 10.0 * (g(1.0, 0.0) - g(-1.0, 0.0));
    let gy = 3.0 * (g(-1.0, 1.0) - g(-1.0, -1.0) + g(1.0, 1.0) - g(1.0, -1.0)) + 10.0 * (g(0.0, 1.0) - g(0.0, -1.0));
    Vec2::new(gx, gy) / 32.0
}

fn offsets(window: Window) -> impl Iterator<Item = Vec2> {
    let half = window.half as f64;
    (0..window.side).flat_map(move |j| (0..window.side).map(move |i| Vec2::new(i as f64 - half, j as f64 - half)))
}

struct Multiply<'t> {
    pyramid: &'t Pyramid,
    patch: &'t WholePatch,
    window: Window,
    cell: (isize, isize),
}

impl Kernel for Multiply<'_> {
    type Output = [[f64; 4]; 2];

    fn call<V: Vectors>(self, v: V) -> Self::Output {
        let (cut, half) = (Cut::new(self.window), self.window.half as isize);
        let (left, top) = (self.cell.0 - half, self.cell.1 - half);
        let block = Block { left, top, width: cut.columns() + 1, height: cut.rows() + 1 };
        block.read(v, self.pyramid.finest(), &mut Vec::new(), Products { patch: self.patch, cut })
    }
}

fn taken(pyramid: &Pyramid, window: Window, centre: Vec2) -> WholePatch {
    let mut patches = [WholePatch::default(), WholePatch::default()];
    let mut copy = Vec::new();
    let [fast, plain] = &mut patches;
    dispatch(TakingWhole { level: pyramid.finest(), centre, window, copy: &mut copy, patch: fast });
    TakingWhole { level: pyramid.finest(), centre, window, copy: &mut copy, patch: plain }.call(Plain);
    let lines = Cut::new(window).lines();
    assert_eq!(patches[0].lines[..lines], patches[1].lines[..lines], "every instruction set takes the same patch");
    let [fast, plain] = patches;
    assert_eq!(fast.stats.hessian, plain.stats.hessian);
    assert_eq!(fast.stats.cross, plain.stats.cross);
    plain
}

#[test]
fn slopes_and_their_sums_are_those_of_the_definition() {
    let picture = picture();
    let pyramid = Pyramid::new(&picture, 1);
    for side in SIDES {
        for centre in CENTRES {
            let window = Window::new(side);
            let patch = taken(&pyramid, window, centre);
            let (mut hessian, mut cross, mut scale) = (nalgebra::Matrix2::zeros(), Vec2::zeros(), 0.0);
            let (mut sum, mut squares) = (0.0, 0.0);
            for offset in offsets(window) {
                let (g, value) = (slope(&picture, centre + offset), grey(&picture, centre + offset));
                hessian += g * g.transpose();
                cross += g * value;
                scale += g.norm() * value;
                (sum, squares) = (sum + value, squares + value * value);
            }
            let pixels = (side * side) as f64;
            let off = (patch.stats.shift_hessian() - hessian).norm() / hessian.norm();
            assert!(off < 5e-3, "{side} at {centre}: {off}");
            let off = (Vec2::new(patch.stats.cross[0], patch.stats.cross[1]) - cross).norm() / scale;
            assert!(off < 2e-3, "{side} at {centre}: {off}");
            assert!((f64::from(patch.stats.mean) - sum / pixels).abs() < 0.05);
            let energy = squares - sum * sum / pixels;
            assert!((patch.stats.energy / energy - 1.0).abs() < 2e-3, "{side}: {} is not {energy}", patch.stats.energy);
        }
    }
}

#[test]
fn products_at_the_corners_of_a_cell_are_exact() {
    let picture = picture();
    let pyramid = Pyramid::new(&picture, 1);
    for side in SIDES {
        for (centre, cell) in CENTRES.into_iter().zip([(44, 31), (40, 30), (3, 68), (89, 0)]) {
            let window = Window::new(side);
            let patch = taken(&pyramid, window, centre);
            let multiply = || Multiply { pyramid: &pyramid, patch: &patch, window, cell };
            let products = multiply().call(Plain);
            assert_eq!(dispatch(multiply()), products, "{side} at {cell:?}");
            for (k, (x, y)) in [(0, 0), (1, 0), (0, 1), (1, 1)].into_iter().enumerate() {
                let corner = Vec2::new((cell.0 + x) as f64, (cell.1 + y) as f64);
                let (mut truth, mut scale) = (Vec2::zeros(), 0.0);
                for offset in offsets(window) {
                    let (g, value) = (slope(&picture, centre + offset), grey(&picture, corner + offset));
                    truth += g * value;
                    scale += g.norm() * value;
                }
                let off = (Vec2::new(products[0][k], products[1][k]) - truth).norm() / scale;
                assert!(off < 2e-3, "{side} at {cell:?}, corner {k}: {off}");
            }
        }
    }
}

#[test]
fn the_fit_is_that_of_the_definition() {
    let picture = picture();
    let pyramid = Pyramid::new(&picture, 1);
    for side in SIDES {
        for centre in CENTRES {
            let (window, position) = (Window::new(side), centre + Vec2::new(0.4, -0.7));
            let patch = taken(&pyramid, window, centre);
            let (mut copy, level) = (Vec::new(), pyramid.finest());
            let mut judge = |fast: bool| -> Fit {
                let judge = JudgeWhole { level, window, patch: &patch, copy: &mut copy, position };
                if fast { dispatch(judge) } else { judge.call(Plain) }
            };
            let (fast, plain) = (judge(true), judge(false));
            assert_eq!((fast.variance, fast.ncc), (plain.variance, plain.ncc), "{side} at {position}");
            let pixels = (side * side) as f64;
            let difference = |o: Vec2| grey(&picture, position + o) - grey(&picture, centre + o);
            let truth = offsets(window).map(|o| difference(o).powi(2)).sum::<f64>() / pixels;
            assert!((plain.variance - truth).abs() < 0.01 * truth + 0.02, "{side}: {} is not {truth}", plain.variance);
        }
    }
}
