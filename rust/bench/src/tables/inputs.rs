//! Pictures, pairs and corners.

use super::{CORNERS, Case, CaseTruth, FRONTAL_DEG, Frame, Pair, RANGES_DEG, WINDOWS};
use crate::files::write_grey;
use crate::results::to_pixels;
use crate::scenes::clip::{self, Clip};
use crate::scenes::seen::Seen;
use geometry::{Vec2, Vec3};
use image::{GrayImage, Luma};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use vision::corners::{CornerOptions, Spread, detect};
use vision::pyramid::Pyramid;

/// What counts as the front of the face: skin this near to the tip of the nose, metres. Hair, ears and collar are not.
const FACE_RADIUS: f64 = 0.095;
/// Neighbouring pixels whose points are farther apart than this lie on both sides of an outline, metres.
const OUTLINE: f64 = 0.005;
/// Corners keep off outlines by half of the largest window, pixels: across an outline there is no one match.
const MARGIN: u32 = 4;
/// Corners keep off the edge of the frame, pixels.
const BORDER: u32 = 24;
/// Least distance of two corners, pixels.
const MIN_DISTANCE: f64 = 5.0;
/// Least score of a corner relative to the strongest: low enough that every pair has its corners.
const QUALITY: f64 = 0.001;
/// Window of the corners' gradient matrix, pixels: the paper's best, and the same for all trackers so that every column
/// of the tables is about the same corners.
const CORNER_WINDOW: usize = 7;

/// The film of the paper's size where it is there, and the project's clip.
pub(super) fn films(folder: &Path) -> anyhow::Result<(Vec<Case>, Vec<CaseTruth>)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize()?;
    let cif = root.join("../shared/data/james-cif");
    if !cif.exists() {
        eprintln!("{} is not there: the project's own clip alone is measured", cif.display());
    }
    let films = [("james-cif", cif), ("clip", root.join("tests/data/clip"))];
    let there = films.into_iter().filter(|(_, film)| film.join("truth.json").exists());
    Ok(there.map(|(name, film)| case(name, film, folder)).collect::<anyhow::Result<Vec<_>>>()?.into_iter().unzip())
}

/// Pairs of a film; pictures are written into the folder.
fn case(name: &str, film: PathBuf, folder: &Path) -> anyhow::Result<(Case, CaseTruth)> {
    let clip = Clip::open_in(&film)?;
    let body = clip.head()?;
    let frames: Vec<Seen<'_>> =
        clip.frames.par_iter().map(|frame| Seen::new(&body, clip.camera, frame.cam_from_head)).collect();
    let masks: Vec<GrayImage> = frames.par_iter().map(|seen| front(seen, &Vec3::from(clip.nose_tip))).collect();
    let pictures = (0..frames.len()).map(|i| clip.frame(i)).collect::<anyhow::Result<Vec<_>>>()?;
    let mut case = Case { name: name.to_owned(), windows: WINDOWS.to_vec(), pictures: Vec::new(), pairs: Vec::new() };
    for (i, picture) in pictures.iter().enumerate() {
        case.pictures.push(format!("{name}_{i}.png"));
        write_grey(&folder.join(&case.pictures[i]), picture)?;
    }
    let mut ranges = Vec::new();
    for (a, b, range) in pairs(&clip) {
        let shown = |p: &Vec2| frames[a].carried(p, &frames[b]).is_some_and(|q| is_white(&masks[b], &q));
        let points = to_pixels(&corners(&pictures[a], &masks[a], shown)?);
        case.pairs.push(Pair { a, b, points });
        ranges.push(range);
    }
    let frame = |f: &clip::Frame| Frame { name: f.name.clone(), cam_from_head: f.cam_from_head };
    let frames = clip.frames.iter().map(frame).collect();
    let truth = CaseTruth { film, camera: clip.camera, frames, ranges };
    Ok((case, truth))
}

/// Pairs about frontal views, and the range of the paper's that each belongs to.
fn pairs(clip: &Clip) -> Vec<(usize, usize, usize)> {
    let yaw: Vec<f64> = clip.frames.iter().map(|frame| frame.yaw_deg).collect();
    let both = (0..yaw.len()).flat_map(|a| (0..yaw.len()).map(move |b| (a, b)));
    let frontal = both.filter(|&(a, b)| (0.5 * (yaw[a] + yaw[b])).abs() <= FRONTAL_DEG);
    let range = |difference: f64| RANGES_DEG.iter().position(|&(from, to)| from <= difference && difference <= to);
    frontal.filter_map(|(a, b)| Some((a, b, range((yaw[a] - yaw[b]).abs())?))).collect()
}

/// The strongest corners that the other frame shows too.
fn corners(picture: &GrayImage, mask: &GrayImage, shown: impl Fn(&Vec2) -> bool) -> anyhow::Result<Vec<Vec2>> {
    let options = CornerOptions {
        max_count: 2 * CORNERS,
        window: CORNER_WINDOW,
        quality: QUALITY,
        min_distance: MIN_DISTANCE,
        spread: Spread::Strongest,
        ..CornerOptions::default()
    };
    let found = detect(&Pyramid::new(picture, 1), Some(mask), &options)?;
    Ok(found.iter().map(|corner| corner.position).filter(shown).take(CORNERS).collect())
}

/// 255 on the front of the face away from outlines.
fn front(seen: &Seen<'_>, nose_tip: &Vec3) -> GrayImage {
    let (width, height) = (seen.camera.width, seen.camera.height);
    let point = |x: u32, y: u32| {
        let (point, normal) = seen.point(&Vec2::new(f64::from(x), f64::from(y)))?;
        seen.pixel(&point, &normal)?;
        Some(point).filter(|point| (point - nose_tip).norm() < FACE_RADIUS)
    };
    let points: Vec<Option<Vec3>> = (0..width * height).map(|k| point(k % width, k / width)).collect();
    let smooth = |x: u32, y: u32| {
        let at = |x: u32, y: u32| points[(y * width + x) as usize];
        let here = at(x, y);
        let beside = [at(x - 1, y), at(x + 1, y), at(x, y - 1), at(x, y + 1)];
        here.is_some_and(|here| beside.iter().all(|p| p.is_some_and(|p| (p - here).norm() < OUTLINE)))
    };
    let inner = |x: u32, y: u32| (x.min(width - 1 - x).min(y).min(height - 1 - y)) >= BORDER;
    GrayImage::from_fn(width, height, |x, y| {
        let around = || (y - MARGIN..=y + MARGIN).flat_map(|v| (x - MARGIN..=x + MARGIN).map(move |u| (u, v)));
        Luma([if inner(x, y) && around().all(|(u, v)| smooth(u, v)) { 255 } else { 0 }])
    })
}

fn is_white(mask: &GrayImage, at: &Vec2) -> bool {
    mask.get_pixel_checked(at.x.round() as u32, at.y.round() as u32).is_some_and(|p| p.0[0] != 0)
}
