//! A surface before a camera: where its points are, and where another camera sees them.

use geometry::{Camera, Transform, Vec2, Vec3, mesh::area_normal};
use image::{GrayImage, Luma};
use raster::{Fragment, NO_TRIANGLE, Window, fragments, project};

/// Least cosine between a point's normal and the view direction at which it counts as face.
const MIN_FACING: f64 = 0.35;
/// A point is hidden where the surface is nearer than it by more than this, metres.
const HIDDEN_BY: f64 = 0.003;

/// A closed surface, triangles counter-clockwise seen from outside, metres.
pub struct Body {
    /// Vertices in the head frame.
    pub positions: Vec<Vec3>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
}

/// A body in one frame.
pub struct Seen<'b> {
    body: &'b Body,
    /// The camera.
    pub camera: Camera,
    /// The pose.
    pub cam_from_head: Transform,
    pixels: Vec<Fragment>,
}

impl<'b> Seen<'b> {
    /// Looks at a body.
    pub fn new(body: &'b Body, camera: Camera, cam_from_head: Transform) -> Self {
        let window = Window { x: 0, y: 0, width: camera.width as usize, height: camera.height as usize };
        let pixels = fragments(&project(&camera, &cam_from_head, &body.positions), &body.triangles, &window);
        Self { body, camera, cam_from_head, pixels }
    }

    /// What covers the pixel centre next to a position.
    fn fragment(&self, pixel: &Vec2) -> Option<&Fragment> {
        let (x, y) = (pixel.x.round(), pixel.y.round());
        let inside = x >= 0.0 && y >= 0.0 && x < f64::from(self.camera.width) && y < f64::from(self.camera.height);
        let index = inside.then(|| y as usize * self.camera.width as usize + x as usize)?;
        Some(&self.pixels[index]).filter(|f| f.triangle != NO_TRIANGLE)
    }

    /// The point of the head that a pixel shows and its normal; `None` where it shows none.
    pub fn point(&self, pixel: &Vec2) -> Option<(Vec3, Vec3)> {
        let triangle = self.body.triangles[self.fragment(pixel)?.triangle as usize];
        let normal = area_normal(&self.body.positions, &triangle).try_normalize(0.0)?;
        let head_from_cam = self.cam_from_head.inverse();
        let (origin, ray) = (head_from_cam.translation, head_from_cam.rotation * self.camera.ray(pixel));
        // The triangle's plane rather than the triangle: a position between pixels may lie just beyond its edge.
        let along = (self.body.positions[triangle[0] as usize] - origin).dot(&normal) / ray.dot(&normal);
        Some((origin + ray * along, normal))
    }

    /// Where a point of the head is seen; `None` where it is hidden, turned away or outside.
    pub fn pixel(&self, point: &Vec3, normal: &Vec3) -> Option<Vec2> {
        let in_cam = self.cam_from_head.apply(point);
        let facing = -(self.cam_from_head.rotation * normal).dot(&in_cam.normalize());
        let pixel = self.camera.project(&in_cam).filter(|_| facing > MIN_FACING)?;
        let nearest = f64::from(self.fragment(&pixel)?.depth);
        (in_cam.z < nearest + HIDDEN_BY).then_some(pixel)
    }

    /// 255 where the face looks at the camera, 0 elsewhere and within `border` pixels of the frame's edge.
    pub fn mask(&self, border: u32) -> GrayImage {
        let (width, height) = (self.camera.width, self.camera.height);
        GrayImage::from_fn(width, height, |x, y| {
            let pixel = Vec2::new(f64::from(x), f64::from(y));
            let inside = x.min(width - 1 - x).min(y).min(height - 1 - y) >= border;
            let shown = inside && self.point(&pixel).is_some_and(|(p, n)| self.pixel(&p, &n).is_some());
            Luma([if shown { 255 } else { 0 }])
        })
    }

    /// Where another frame sees what a pixel of this one shows.
    pub fn carried(&self, pixel: &Vec2, other: &Self) -> Option<Vec2> {
        let (point, normal) = self.point(pixel)?;
        self.pixel(&point, &normal)?;
        other.pixel(&point, &normal)
    }
}
