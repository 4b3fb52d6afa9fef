//! A view: where it shows a place of the surface, and whether it does.

use crate::sheet::Sheet;
use geometry::{Camera, Transform, Vec2, Vec3, smooth_step};
use image::GrayImage;
use nalgebra::Matrix3x2;
use raster::{Fragment, Window, fragments, project};

/// A picture of the surface and where its camera is.
pub struct View<'a> {
    /// Grey levels.
    pub image: &'a GrayImage,
    /// The lens.
    pub camera: Camera,
    /// Pose.
    pub cam_from_head: Transform,
    /// 0 where the picture does not show the surface but what is before or behind it.
    pub mask: Option<&'a GrayImage>,
    /// Of each vertex, how far it is from where it is at rest, metres; nowhere if it is empty.
    pub moved: &'a [f64],
}

/// Surfaces seen more obliquely than this are not, cosine: 66 degrees …
const OBLIQUE: f64 = 0.4;
/// A place is hidden where something stands before it by more than this, metres, and its window reaches over an edge of the surface where
/// that lies behind by more: it is more than a surface bends in a window.
const BEFORE: f64 = 0.004;
/// What has moved by less than the first of these is at rest, and what has by more than the second is another surface, metres.
const MOVED: (f64, f64) = (0.0008, 0.002);
/// Pixels at the border of a picture that windows keep clear of.
const BORDER: f64 = 3.0;

/// A view prepared for windows.
pub(crate) struct Sight<'a> {
    pub(crate) view: &'a View<'a>,
    pub(crate) sheet: Sheet,
    window: Window,
    depths: Vec<Fragment>,
}

/// A place of the surface with the axes of its window.
pub(crate) struct Place {
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
    pub(crate) tangents: Matrix3x2<f64>,
    /// Mean of the vertices around it, of what each view's [`View::moved`] says.
    pub(crate) stencil: ([u32; 4], [f64; 4]),
}

/// A place in a view, in pixels of the sheet.
#[derive(Clone)]
pub(crate) struct Seen {
    pub(crate) view: usize,
    /// Where it is …
    pub(crate) pixel: [f32; 2],
    /// … and goes by steps along the tangents and the normal, pixels per metre.
    pub(crate) axes: [[f32; 2]; 3],
    /// How far, in metres along the tangents, what is seen in the window slides per metre along the normal.
    pub(crate) slide: Vec2,
    /// Square of the cosine of the viewing angle, less where the surface is not at rest.
    pub(crate) weight: f64,
}

impl<'a> Sight<'a> {
    /// `None` where the view does not show the surface.
    pub(crate) fn new(view: &'a View<'a>, positions: &[Vec3], triangles: &[[u32; 3]]) -> Option<Self> {
        let vertices = project(&view.camera, &view.cam_from_head, positions);
        let window = Window::around(&vertices, &view.camera, 2)?;
        let depths = fragments(&vertices, triangles, &window);
        let depth = geometry::median(depths.iter().map(|f| f64::from(f.depth)).filter(|d| d.is_finite()))?;
        let sheet = Sheet::of(view.image, (view.camera.fx * view.camera.fy).sqrt() / depth);
        Some(Self { view, sheet, window, depths })
    }

    /// Where a place with a window of a half width, metres, is seen; `None` where it or a part of the window is not.
    pub(crate) fn see(&self, index: usize, place: &Place, half: f64) -> Option<Seen> {
        let Place { position, normal, tangents, stencil } = place;
        let rotation = self.view.cam_from_head.rotation;
        let in_cam = self.view.cam_from_head.apply(position);
        let ray = rotation.inverse() * in_cam.normalize();
        let cosine = -ray.dot(normal);
        if cosine < OBLIQUE {
            return None;
        }
        let rest = 1.0 - smooth_step(MOVED.0, MOVED.1, self.moved(stencil));
        let (pixel, jacobian) = self.view.camera.project_with_jacobian(&in_cam)?;
        let by_head = jacobian.point * rotation.matrix();
        let across = by_head * tangents;
        let leaning = (rotation * tangents).row(2).into_owned();
        let is_clear = |x: f64, y: f64| {
            let step = Vec2::new(x, y) * half;
            self.is_clear(&(pixel + across * step), in_cam.z + (leaning * step).x)
        };
        let corners = [(0.0, 0.0), (-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)];
        if rest <= 0.0 || !corners.iter().all(|&(x, y)| is_clear(x, y)) {
            return None;
        }
        let scale = self.sheet.scale;
        let axis = |step: Vec2| [(step.x * scale) as f32, (step.y * scale) as f32];
        let along = by_head * normal;
        Some(Seen {
            view: index,
            pixel: [0, 1].map(|k| (pixel[k] * scale + self.sheet.shift) as f32),
            axes: [axis(across.column(0).into()), axis(across.column(1).into()), axis(along)],
            // A step n of the place shows what lies in the plane at n - ray (n n) / (n ray) from it.
            slide: tangents.transpose() * ray / cosine,
            weight: cosine * cosine * rest,
        })
    }

    fn moved(&self, (corners, weights): &([u32; 4], [f64; 4])) -> f64 {
        let of = |v: u32| self.view.moved.get(v as usize).copied().unwrap_or(0.0);
        corners.iter().zip(weights).map(|(&v, w)| of(v) * w).sum()
    }

    /// Whether a pixel shows the surface, at about a depth.
    fn is_clear(&self, pixel: &Vec2, depth: f64) -> bool {
        let size = [self.view.image.width(), self.view.image.height()];
        if !(0..2).all(|k| pixel[k] >= BORDER && pixel[k] < f64::from(size[k]) - 1.0 - BORDER) {
            return false;
        }
        let (x, y) = (pixel.x.round() as i32, pixel.y.round() as i32);
        if self.view.mask.is_some_and(|mask| mask.get_pixel(x as u32, y as u32)[0] == 0) {
            return false;
        }
        let (column, row) = ((x - self.window.x) as usize, (y - self.window.y) as usize);
        let inside = column < self.window.width && row < self.window.height;
        let nearest = if inside { f64::from(self.depths[row * self.window.width + column].depth) } else { f64::MAX };
        (depth - nearest).abs() < BEFORE
    }
}
