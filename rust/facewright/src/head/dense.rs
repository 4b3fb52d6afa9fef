//! The skin measured densely in the chosen frames, after lips, lids and brows have found their places.

use super::regions::{Region, covered_skin, nearest, of_skin};
use super::{Measured, SurfaceTruth};
use crate::faces::{Clip, uncovered};
use crate::patches::Hair;
use crate::{DenseReport, FacewrightError, Relief};
use dense::{Dense, DenseOptions, Surface, Untouched, View, measure};
use geometry::{Camera, Transform, Vec2, Vec3, median, mesh, smooth_step};
use head::extend::extend;
use head::soft::measured_share;
use image::{GrayImage, Luma, imageops};
use raster::Window;
use rayon::prelude::*;
use std::collections::BTreeSet;
use texture::choose_views;

/// Frames that are measured in: more bring nothing, even of a small picture.
const VIEWS: usize = 28;
/// Side of the maps of what lies between the vertices, texels: about 0.4 mm each.
const RELIEF: usize = 1024;
/// Pixels around what is cut out of a frame.
const EDGE: i32 = 8;
/// Skin within the first of these of a landmark is measured, and beyond the second it is not, metres: there hair begins.
const FACE: (f64, f64) = (0.014, 0.024);
/// What is measured keeps so far from hair, pixels.
const HAIR_MARGIN: i64 = 3;
/// Skin that measuring turns by more than this is folded, cosine: 60 degrees …
const LEAST_COSINE: f64 = 0.5;
/// … and is put back so often at most.
const FOLD_ROUNDS: usize = 8;
/// How far lids and lips follow the skin around, metres.
const LENGTH: f64 = 0.03;

/// A part of a frame that shows the head.
struct Cut {
    grey: GrayImage,
    mask: GrayImage,
    camera: Camera,
    pose: Transform,
    moved: Vec<f64>,
}

impl Cut {
    fn view(&self) -> View<'_> {
        let Self { grey: image, mask, camera, pose, moved } = self;
        View { image, camera: *camera, cam_from_head: *pose, mask: Some(mask), moved }
    }
}

/// The skin as it was measured.
pub struct SkinSurface {
    /// By vertex.
    pub truth: SurfaceTruth,
    /// What lies between the vertices; `None` where the skin was left as it was.
    pub relief: Option<Relief>,
    /// How it was done.
    pub report: DenseReport,
}

/// Measures the skin of a head whose features are in their places, and moves its vertices there. Where the frames do not tell enough it stays
/// as it is, which the report says.
///
/// # Errors
/// Those of reading frames and of the net that tells the person.
pub fn refine(clip: &Clip, measured: &mut Measured) -> Result<SkinSurface, FacewrightError> {
    let (head, firm) = (clip.head, measured_share(clip.head, clip.rest.mouth_moved));
    let cuts = cuts(clip, measured)?;
    let views: Vec<View> = cuts.iter().map(Cut::view).collect();
    let skin = head.skin();
    let is_outside = |quad: &usize| head.quads[*quad].iter().all(|&v| !head.cavity[v as usize]);
    let outside: Vec<usize> = skin.quads.clone().filter(is_outside).collect();
    let quads: Vec<[u32; 4]> = outside.iter().map(|&quad| head.quads[quad]).collect();
    let share = shares(clip, &firm);
    let surface = Surface { positions: &measured.positions, quads: &quads, share: &share };
    let mut found = match measure(&surface, &views, &DenseOptions::default()) {
        Ok(found) => found,
        Err(untouched) => return Ok(left(head.positions.len(), &untouched)),
    };
    let moved = extend(&found.positions, &measured.positions, &firm, skin.vertices.clone(), LENGTH);
    let unfolded = without_folds(&head.outer_skin(), &measured.positions, moved.clone());
    let put_back: Vec<bool> = unfolded.iter().zip(&moved).map(|(is, was)| is != was).collect();
    forget(&mut found, &put_back);
    measured.positions = unfolded;
    let uvs: Vec<[[f32; 2]; 4]> = outside.iter().map(|&quad| head.uvs[quad]).collect();
    Ok(measured_surface(found, &uvs))
}

/// Skin that measuring would fold goes back where it was, and the skin around it half the way, until nothing folds.
fn without_folds(triangles: &[[u32; 3]], before: &[Vec3], mut moved: Vec<Vec3>) -> Vec<Vec3> {
    for _ in 0..FOLD_ROUNDS {
        let is_folded = |t: &&[u32; 3]| {
            let (was, is) = (mesh::area_normal(before, t), mesh::area_normal(&moved, t));
            was.dot(&is) < LEAST_COSINE * was.norm() * is.norm()
        };
        let folded: BTreeSet<u32> = triangles.iter().filter(is_folded).flatten().copied().collect();
        if folded.is_empty() {
            break;
        }
        let beside = triangles.iter().filter(|t| t.iter().any(|v| folded.contains(v))).flatten();
        let around: BTreeSet<usize> = beside.map(|&v| v as usize).collect();
        for v in around {
            moved[v] = moved[v].lerp(&before[v], if folded.contains(&(v as u32)) { 1.0 } else { 0.5 });
        }
    }
    moved
}

/// Takes back what is said of vertices that are no longer where they were measured, and the heights around them.
fn forget(found: &mut Dense, vertices: &[bool]) {
    for v in (0..vertices.len()).filter(|&v| vertices[v]) {
        (found.sigma[v], found.views[v], found.residual[v]) = (f64::NAN, 0, f64::NAN);
    }
    // The four quads of each begin at its corners.
    for quad in found.detail.quads.iter().filter(|quad| vertices[quad[0] as usize]) {
        quad.iter().for_each(|&place| found.detail.heights[place as usize] = 0.0);
    }
}

fn left(vertices: usize, untouched: &Untouched) -> SkinSurface {
    let nothing = || vec![f64::NAN; vertices];
    let truth = SurfaceTruth { sigma: nothing(), views: vec![0; vertices], residual: nothing() };
    let (measured, places) = match *untouched {
        Untouched::TooFewPlaces { measured, places } => (measured, places),
        Untouched::TooFewViews { .. } => (0, 0),
    };
    let report = DenseReport { measured, places, untouched: Some(untouched.to_string()), ..DenseReport::default() };
    SkinSurface { truth, relief: None, report }
}

fn measured_surface(found: Dense, uvs: &[[[f32; 2]; 4]]) -> SkinSurface {
    let relief = Relief::of(&found.detail.maps(uvs, RELIEF));
    let is_measured = |v: &usize| found.views[*v] > 0;
    let middle = |of: &dyn Fn(usize) -> f64| median((0..found.views.len()).filter(is_measured).map(of));
    let report = DenseReport {
        measured: found.measured,
        places: found.places,
        sigma_mm: middle(&|v| 1000.0 * found.sigma[v]),
        moved_mm: middle(&|v| 1000.0 * found.moved[v].abs()),
        displacement_m: Some(relief.displacement_m),
        untouched: None,
    };
    let truth = SurfaceTruth { sigma: found.sigma, views: found.views, residual: found.residual };
    SkinSurface { truth, relief: Some(relief), report }
}

/// Of each vertex, whether it may be measured, 0…1: skin of the face that is seen and keeps its shape.
fn shares(clip: &Clip, firm: &[f64]) -> Vec<f64> {
    let head = clip.head;
    let (at, covered) = (head.landmarks(&head.positions), covered_skin(head, clip.faces.appearance()));
    let mut shares = vec![0.0; head.positions.len()];
    for (v, region) in head.skin().vertices.clone().zip(of_skin(head)) {
        let is_face = !matches!(region, None | Some(Region::Ears | Region::Neck)) && !covered[v];
        let near = smooth_step(FACE.1, FACE.0, nearest(&at, &head.positions[v]).1);
        shares[v] = if is_face { near * firm[v] } else { 0.0 };
    }
    shares
}

fn cuts(clip: &Clip, measured: &Measured) -> Result<Vec<Cut>, FacewrightError> {
    let chosen = measured.chosen_poses();
    let poses: Vec<Transform> = chosen.iter().map(|(_, pose)| *pose).collect();
    let sharpness: Vec<f64> =
        chosen.iter().map(|(frame, _)| clip.faces.look(*frame).map_or(0.0, |look| look.sharpness)).collect();
    let picked = choose_views(&poses, &sharpness, VIEWS);
    let cut = |&i: &usize| cut(clip, measured, chosen[i]);
    let cuts: Result<Vec<Option<Cut>>, FacewrightError> = picked.par_iter().map(cut).collect();
    Ok(cuts?.into_iter().flatten().collect())
}

/// The head in a frame; `None` where it is not, or where nobody saw the face.
fn cut(clip: &Clip, measured: &Measured, (frame, pose): (usize, Transform)) -> Result<Option<Cut>, FacewrightError> {
    let vertices = raster::project(&measured.camera, &pose, &measured.positions);
    let Some(window) = Window::around(&vertices, &measured.camera, EDGE) else { return Ok(None) };
    let Some((face, person)) = clip.faces.face(frame).zip(clip.person(frame)?) else { return Ok(None) };
    let picture = clip.frames.picture(frame)?;
    let (x, y) = (window.x.max(0) as u32, window.y.max(0) as u32);
    let size = |start: i32, length: usize, limit: u32| (start + length as i32).clamp(1, limit as i32) as u32;
    let (right, bottom) =
        (size(window.x, window.width, picture.width()), size(window.y, window.height, picture.height()));
    let (width, height) = (right.saturating_sub(x).max(1), bottom.saturating_sub(y).max(1));
    let grey = imageops::grayscale(&*imageops::crop_imm(&*picture, x, y, width, height));
    let corner = Vec2::new(f64::from(x), f64::from(y));
    let mut mask = GrayImage::from_pixel(width, height, Luma([255]));
    person.clear_outside(&mut mask, 0.0, |pixel| pixel + corner);
    if let Some(hair) = Hair::of(&picture, face, &person) {
        hair.clear(&mut mask, HAIR_MARGIN, |pixel| pixel + corner);
    }
    let bare = clip.faces.appearance().and_then(|usual| uncovered(&picture, face, &usual, ([x, y], (width, height))));
    if let Some(bare) = bare {
        mask.iter_mut().zip(bare.iter()).for_each(|(mask, bare)| *mask = (*mask).min(*bare));
    }
    let camera = Camera {
        width,
        height,
        cx: measured.camera.cx - corner.x,
        cy: measured.camera.cy - corner.y,
        ..measured.camera
    };
    Ok(Some(Cut { grey, mask, camera, pose, moved: moved(clip, frame) }))
}

/// How far each vertex is from where it rests, metres.
fn moved(clip: &Clip, frame: usize) -> Vec<f64> {
    let rest = vec![Vec3::zeros(); clip.head.positions.len()];
    let Some(fitted) = &clip.landmark_fit.frames[frame] else { return vec![0.0; rest.len()] };
    let offsets = clip.head.with_expression(&rest, &clip.rest.from_rest(&fitted.expression));
    offsets.iter().map(|offset| offset.norm()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dense::Detail;

    #[test]
    fn a_vertex_pushed_over_its_neighbours_goes_back_and_the_rest_stays() {
        let (side, step) = (9, 0.003);
        let before: Vec<Vec3> =
            (0..side * side).map(|i| Vec3::new(f64::from(i % side), f64::from(i / side), 0.0) * step).collect();
        let corner = |i: u32| [[i, i + 1, i + side + 1], [i, i + side + 1, i + side]];
        let triangles: Vec<[u32; 3]> =
            (0..side * (side - 1)).filter(|i| i % side + 1 < side).flat_map(corner).collect();
        let mut moved: Vec<Vec3> = before.iter().map(|p| p + Vec3::z() * 0.0003).collect();
        let (pushed, measured) = ((side * side / 2) as usize, moved.clone());
        moved[pushed] += Vec3::x() * (2.5 * step);
        let found = without_folds(&triangles, &before, moved);
        let turned = |t: &&[u32; 3]| mesh::area_normal(&found, t).z <= 0.0;
        assert_eq!(triangles.iter().filter(turned).count(), 0);
        assert_eq!(found[pushed], before[pushed]);
        let far = |v: &usize| (before[*v] - before[pushed]).norm() > 3.0 * step;
        assert!((0..found.len()).filter(far).all(|v| found[v] == measured[v]));
    }

    #[test]
    fn of_a_vertex_that_was_put_back_nothing_is_said_and_it_has_no_heights() {
        // One quad in four: its corners, the middles of its edges, its own.
        let detail = Detail {
            heights: vec![1e-4; 9],
            places: vec![Vec3::zeros(); 9],
            quads: vec![[0, 4, 8, 7], [1, 5, 8, 4], [2, 6, 8, 5], [3, 7, 8, 6]],
        };
        let mut found = Dense {
            positions: vec![Vec3::zeros(); 4],
            sigma: vec![1e-4; 4],
            views: vec![9; 4],
            residual: vec![0.01; 4],
            moved: vec![0.0; 4],
            detail,
            measured: 4,
            places: 4,
        };
        forget(&mut found, &[true, false, false, false]);
        assert!(found.sigma[0].is_nan() && found.residual[0].is_nan());
        assert_eq!((&found.views[..], found.sigma[1]), (&[0, 9, 9, 9][..], 1e-4));
        let flat: Vec<usize> = (0..9).filter(|&place| found.detail.heights[place] == 0.0).collect();
        assert_eq!(flat, [0, 4, 7, 8]);
    }
}
