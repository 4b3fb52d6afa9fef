//! The jaw as a contour: the net draws it where the skin turns away from the camera, whatever skin that is in the view.

use super::model::{LinearPoint, ShapeModel};
use crate::GenericHead;
use geometry::face_mesh::JAW_LINE;
use geometry::{Camera, Transform, Vec2, Vec3, mesh};
use std::collections::BTreeMap;

/// Skin this close to a jaw anchor may be the jaw's contour, metres.
const REACH: f64 = 0.025;

/// A sighting of the jaw: the contour's point, its pixel and the direction in the picture that counts.
pub(crate) struct ContourSighting {
    pub point: LinearPoint,
    pub pixel: Vec2,
    pub normal: Vec2,
    pub sigma_px: f64,
}

/// Edges of the skin near the jaw with the two triangles that meet there.
pub(crate) struct JawOutline {
    edges: Vec<([u32; 2], [[u32; 3]; 2])>,
    anchors: Vec<(usize, [u32; 3], [f64; 3])>,
}

impl JawOutline {
    /// Collects the edges.
    pub fn new(head: &GenericHead) -> Self {
        let anchor = |&i: &usize| head.anchors.get(i).map(|a| (i, a.triangle, a.weights));
        let anchors: Vec<_> = JAW_LINE.iter().filter_map(anchor).collect();
        let places: Vec<Vec3> = anchors.iter().map(|(_, t, w)| mesh::at_barycentric(&head.positions, t, w)).collect();
        let near = |i: u32| {
            !head.cavity[i as usize] && places.iter().any(|p| (p - head.positions[i as usize]).norm() < 2.0 * REACH)
        };
        let mut by_edge: BTreeMap<[u32; 2], Vec<[u32; 3]>> = BTreeMap::new();
        for triangle in head.triangles(head.skin()) {
            for k in 0..3 {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                if near(a) && near(b) {
                    by_edge.entry([a.min(b), a.max(b)]).or_default().push(triangle);
                }
            }
        }
        let edges =
            by_edge.into_iter().filter_map(|(e, t)| <[[u32; 3]; 2]>::try_from(t).ok().map(|t| (e, t))).collect();
        Self { edges, anchors }
    }

    /// The contour's points for the jaw landmarks of a view; `positions` in the head frame, `sigma` the net's error across
    /// the contour, metres.
    pub fn sightings(
        &self,
        shape: &ShapeModel,
        camera: &Camera,
        pose: &Transform,
        positions: &[Vec3],
        landmarks: &[Vec2],
        sigma: f64,
    ) -> Vec<ContourSighting> {
        let eye = pose.inverse().translation;
        let towards = |t: &[u32; 3]| mesh::area_normal(positions, t).dot(&(eye - positions[t[0] as usize])) > 0.0;
        let pixel = |i: u32| camera.project(&pose.apply(&positions[i as usize]));
        let turning = self.edges.iter().filter(|(_, [a, b])| towards(a) != towards(b));
        let segments: Vec<([u32; 2], Vec2, Vec2)> =
            turning.filter_map(|(e, _)| Some((*e, pixel(e[0])?, pixel(e[1])?))).collect();
        let find = |(index, triangle, weights): &(usize, [u32; 3], [f64; 3])| {
            let place = mesh::at_barycentric(positions, triangle, weights);
            let target = landmarks[*index];
            let near = segments.iter().filter(|(e, ..)| (positions[e[0] as usize] - place).norm() < REACH);
            let closest = near.map(|s| (closest_on(s, &target), s)).min_by(|a, b| a.0.1.total_cmp(&b.0.1))?;
            let ((along, _), (edge, a, b)) = closest;
            let direction = (b - a).try_normalize(1e-9)?;
            let point = shape.point(&[edge[0], edge[1], edge[0]], &[1.0 - along, along, 0.0]);
            let depth = pose.apply(&place).z;
            let normal = Vec2::new(-direction.y, direction.x);
            Some(ContourSighting { point, pixel: target, normal, sigma_px: sigma * camera.fx / depth })
        };
        self.anchors.iter().filter_map(find).collect()
    }
}

/// Fraction along a segment and distance of its point closest to a pixel.
fn closest_on((_, a, b): &([u32; 2], Vec2, Vec2), pixel: &Vec2) -> (f64, f64) {
    let d = b - a;
    let along = ((pixel - a).dot(&d) / d.norm_squared().max(1e-12)).clamp(0.0, 1.0);
    (along, (a + d * along - pixel).norm())
}
