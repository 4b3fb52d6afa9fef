//! The outline of the head, drawn over its frames, held against that of the person.
//!
//! Only one way round: hair and clothes belong to the person and not to the head.

use super::held_out::EYES_PX;
use crate::FacewrightError;
use crate::faces::{Clip, median, yaw_pitch};
use crate::head::Measured;
use crate::head::regions::{self, Region};
use geometry::face_mesh::FACE_OVAL;
use geometry::{Camera, Transform, Vec2, Vec3};
use raster::{NO_TRIANGLE, Window, fragments, project};
use rayon::prelude::*;

/// Of the landmarks around the face, so many lie within a person that was told from what is behind: 33 of 36 or more in 71 of 72 frames of
/// good films.
const HOLDS_FACE: f64 = 0.8;
/// Fewer pixels than this tell nothing.
const FEWEST: usize = 400;

/// The part of skull and face, drawn over frames of the shape, that lies further outside the person than the person's outline is
/// known to, %: the median over the frames. `None` where no frame's person was told from what is behind.
pub fn outside(clip: &Clip, measured: &Measured) -> Result<Option<f64>, FacewrightError> {
    let drawn = Drawn::new(clip, measured);
    let all: Result<Vec<_>, FacewrightError> =
        over_the_turn(measured).par_iter().map(|(frame, pose)| drawn.outside(clip, *frame, pose)).collect();
    let found: Vec<f64> = all?.into_iter().flatten().collect();
    Ok((!found.is_empty()).then(|| 100.0 * median(found.into_iter())))
}

/// Frames that the shape was made of, with their poses, from the farthest turn to one side to the farthest to the other.
fn over_the_turn(measured: &Measured) -> Vec<(usize, Transform)> {
    let mut all = measured.chosen_poses();
    all.sort_by(|a, b| yaw_pitch(&a.1).0.total_cmp(&yaw_pitch(&b.1).0));
    super::spread(&all)
}

/// The head as it is drawn, without ears, that hair and straps lie over, and without the neck, that clothes do.
struct Drawn<'a> {
    camera: Camera,
    positions: &'a [Vec3],
    triangles: Vec<[u32; 3]>,
}

impl<'a> Drawn<'a> {
    fn new(clip: &Clip, measured: &'a Measured) -> Self {
        let regions = regions::of_skin(clip.head);
        let is_drawn = |v: u32| regions[v as usize].is_some_and(|r| !matches!(r, Region::Ears | Region::Neck));
        let triangles = clip.head.outer_skin().into_iter().filter(|t| t.iter().all(|&v| is_drawn(v))).collect();
        Self { camera: measured.camera, positions: &measured.positions, triangles }
    }

    fn outside(&self, clip: &Clip, frame: usize, pose: &Transform) -> Result<Option<f64>, FacewrightError> {
        let (Some(face), Some(person)) = (clip.faces.face(frame), clip.person(frame)?) else { return Ok(None) };
        let distance = |pixel: &Vec2| person.distance(pixel).filter(|d| d.is_finite());
        let oval: Vec<f64> = FACE_OVAL.iter().filter_map(|&i| distance(&face.points[i].xy())).collect();
        let within = oval.iter().filter(|d| **d > -person.rim()).count();
        if (within as f64) < HOLDS_FACE * FACE_OVAL.len() as f64 {
            return Ok(None);
        }
        let factor = (EYES_PX / face.eye_distance().max(1.0)).min(1.0);
        let pixels = covered(&self.camera.resized(factor), pose, self.positions, &self.triangles);
        let distances = pixels.iter().filter_map(|at| distance(&at.map(|x| (x + 0.5) / factor - 0.5)));
        Ok(share_below(&distances.collect::<Vec<_>>(), -person.rim()))
    }
}

/// Pixels of the picture that triangles cover.
fn covered(camera: &Camera, pose: &Transform, positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<Vec2> {
    let vertices = project(camera, pose, positions);
    let Some(window) = Window::around(&vertices, camera, 0) else { return Vec::new() };
    let at = |i: usize| {
        let (column, row) = (i % window.width, i / window.width);
        Vec2::new(f64::from(window.x) + column as f64, f64::from(window.y) + row as f64)
    };
    let all = fragments(&vertices, triangles, &window);
    all.iter().enumerate().filter(|(_, fragment)| fragment.triangle != NO_TRIANGLE).map(|(i, _)| at(i)).collect()
}

fn share_below(distances: &[f64], limit: f64) -> Option<f64> {
    let below = distances.iter().filter(|distance| **distance < limit).count();
    (distances.len() >= FEWEST).then(|| below as f64 / distances.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of 40 mm in front of a camera that sees a millimetre as a pixel.
    fn square() -> Vec<Vec2> {
        let camera = Camera::centred(100, 100, 1000.0);
        let corner = |x: f64, y: f64| Vec3::new(x, y, 1.0);
        let corners = [corner(-0.02, -0.02), corner(0.02, -0.02), corner(0.02, 0.02), corner(-0.02, 0.02)];
        covered(&camera, &Transform::identity(), &corners, &[[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn what_reaches_beyond_the_outline_and_its_rim_is_counted() {
        let pixels = square();
        assert_eq!(pixels.len(), 1600);
        // A person whose outline is upright, 10 pixels right of the middle, and known to 3 pixels.
        let distances: Vec<f64> = pixels.iter().map(|at| 59.5 - at.x).collect();
        let outside = share_below(&distances, -3.0).unwrap();
        assert!((outside - 7.0 / 40.0).abs() < 1e-9, "{outside}");
        assert_eq!(share_below(&distances, -30.0), Some(0.0));
        assert_eq!(share_below(&distances[..FEWEST - 1], 0.0), None);
    }
}
