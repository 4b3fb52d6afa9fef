//! Pictures, masks and points.

use super::{Case, CaseTruth, Film, Pair};
use crate::files::write_grey;
use crate::results::Pixel;
use crate::scenes::clip::Clip;
use crate::scenes::head;
use crate::scenes::seen::{Body, Seen};
use geometry::{Camera, Transform, Vec2, Vec3};
use image::GrayImage;
use rayon::prelude::*;
use std::path::Path;
use synthetic::head_from_turn;
use vision::corners::{CornerOptions, Spread, detect};
use vision::pyramid::Pyramid;

/// Nothing is looked for this close to the frame's edge, pixels: every window that is tried fits.
const BORDER: u32 = 24;
/// Yaw of the computed head in both frames, degrees.
const YAW_DEG: [f64; 2] = [8.0, 11.0];

impl Film {
    /// The surface that was filmed.
    pub(super) fn body(self) -> anyhow::Result<Body> {
        match self {
            Self::Clip => Clip::open()?.head(),
            Self::Computed => Ok(head::body()),
        }
    }
}

/// Every pair of neighbours of the project's clip.
pub(super) fn clip(folder: &Path) -> anyhow::Result<(Case, CaseTruth)> {
    let (clip, body) = (Clip::open()?, Film::Clip.body()?);
    let cam_from_head: Vec<Transform> = clip.frames.iter().map(|f| f.cam_from_head).collect();
    let pictures = (0..cam_from_head.len()).map(|i| clip.frame(i)).collect::<anyhow::Result<Vec<_>>>()?;
    let frames: Vec<Seen<'_>> = cam_from_head.par_iter().map(|pose| Seen::new(&body, clip.camera, *pose)).collect();
    let empty = Case {
        name: "clip".to_owned(),
        pictures: Vec::new(),
        masks: Vec::new(),
        corners: 66,
        min_distance: 5.0,
        quality: 0.001,
        pairs: Vec::new(),
    };
    let case = filled(empty, folder, &frames, &pictures)?;
    Ok((case, CaseTruth { film: Film::Clip, camera: clip.camera, cam_from_head }))
}

/// A pair of large pictures with many points.
pub(super) fn computed(folder: &Path) -> anyhow::Result<(Case, CaseTruth)> {
    let (camera, body) = (Camera::centred(1920, 1080, 2000.0), Film::Computed.body()?);
    let pose = |yaw: f64| head_from_turn(yaw.to_radians(), 0.02, -0.03, Vec3::zeros(), 0.65);
    let cam_from_head: Vec<Transform> = YAW_DEG.iter().map(|&yaw| pose(yaw)).collect();
    let frames: Vec<Seen<'_>> = cam_from_head.iter().map(|pose| Seen::new(&body, camera, *pose)).collect();
    let pictures: Vec<GrayImage> = frames.iter().zip(1..).map(|(seen, seed)| head::picture(seen, seed)).collect();
    let empty = Case {
        name: "1080p".to_owned(),
        pictures: Vec::new(),
        masks: Vec::new(),
        corners: 1000,
        min_distance: 8.0,
        quality: 0.001,
        pairs: Vec::new(),
    };
    let case = filled(empty, folder, &frames, &pictures)?;
    Ok((case, CaseTruth { film: Film::Computed, camera, cam_from_head }))
}

/// The case with its pictures, masks and pairs of neighbouring frames.
fn filled(mut case: Case, folder: &Path, frames: &[Seen<'_>], pictures: &[GrayImage]) -> anyhow::Result<Case> {
    let masks: Vec<GrayImage> = frames.par_iter().map(|seen| seen.mask(BORDER)).collect();
    for i in 0..pictures.len() {
        let [picture, mask] = ["", "_mask"].map(|suffix| format!("{}_{i}{suffix}.png", case.name));
        write_grey(&folder.join(&picture), &pictures[i])?;
        write_grey(&folder.join(&mask), &masks[i])?;
        case.pictures.push(picture);
        case.masks.push(mask);
    }
    for i in 1..frames.len() {
        let points = points(&pictures[i - 1], &masks[i - 1], &case, |p| {
            frames[i - 1].carried(p, &frames[i]).is_some_and(|q| is_white(&masks[i], &q))
        })?;
        case.pairs.push(Pair { a: i - 1, b: i, points });
    }
    Ok(case)
}

/// The strongest corners that both frames see. They are Shi and Tomasi's, as every side would choose them.
fn points(
    picture: &GrayImage,
    mask: &GrayImage,
    case: &Case,
    seen_in_both: impl Fn(&Vec2) -> bool,
) -> anyhow::Result<Vec<Pixel>> {
    let options = CornerOptions {
        max_count: 2 * case.corners,
        quality: case.quality,
        min_distance: case.min_distance,
        spread: Spread::Strongest,
        ..CornerOptions::default()
    };
    let found = detect(&Pyramid::new(picture, 1), Some(mask), &options)?;
    Ok(found.iter().map(|c| &c.position).filter(|p| seen_in_both(p)).take(case.corners).map(|p| [p.x, p.y]).collect())
}

fn is_white(mask: &GrayImage, at: &Vec2) -> bool {
    mask.get_pixel_checked(at.x.round() as u32, at.y.round() as u32).is_some_and(|p| p.0[0] != 0)
}
