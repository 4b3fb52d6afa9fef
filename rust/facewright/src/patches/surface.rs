//! The head's skin as it is known so far: where a pixel meets it, and where that place is in another frame.

use geometry::{Camera, Transform, Vec2, Vec3, mesh};
use image::{GrayImage, Luma};
use nalgebra::Matrix2;
use raster::{Fragment, NO_TRIANGLE, Window};
use vision::track::Guess;

/// A place of the skin this far behind what covers it is hidden, metres: more than the head's error, less than a nose.
const HIDDEN: f64 = 0.006;
/// A patch squeezed or stretched more than this cannot be compared.
const SQUEEZED: f64 = 0.15;
const STRETCHED: f64 = 4.0;

/// The skin in one state of the face, head frame.
pub struct Surface<'a> {
    positions: &'a [Vec3],
    normals: Vec<Vec3>,
    triangles: &'a [[u32; 3]],
}

/// A place on the skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinPoint {
    /// Its triangle.
    pub triangle: [u32; 3],
    /// Barycentric weights there.
    pub weights: [f64; 3],
}

/// The skin as one frame shows it.
pub struct View<'a> {
    pub surface: &'a Surface<'a>,
    pub camera: &'a Camera,
    pub cam_from_head: Transform,
    /// The triangles that face the camera: of a head, the others are behind them.
    facing: Vec<[u32; 3]>,
    /// Where the head is in the picture, and which triangle each of its pixels shows.
    covered: Option<(Window, Vec<Fragment>)>,
}

impl<'a> Surface<'a> {
    /// The skin with all its vertices at `positions`.
    pub fn new(positions: &'a [Vec3], triangles: &'a [[u32; 3]]) -> Self {
        Self { positions, normals: mesh::vertex_normals(positions, triangles), triangles }
    }

    /// Where a place of the skin is, head frame, metres.
    pub fn place(&self, point: &SkinPoint) -> Vec3 {
        mesh::at_barycentric(self.positions, &point.triangle, &point.weights)
    }

    fn normal(&self, point: &SkinPoint) -> Vec3 {
        mesh::at_barycentric(&self.normals, &point.triangle, &point.weights).try_normalize(1e-9).unwrap_or_else(Vec3::z)
    }
}

impl<'a> View<'a> {
    /// Draws the skin's depth as the camera sees it.
    pub fn new(surface: &'a Surface<'a>, camera: &'a Camera, cam_from_head: Transform) -> Self {
        let vertices = raster::project(camera, &cam_from_head, surface.positions);
        let eye = cam_from_head.inverse().translation;
        let faces = |triangle: &&[u32; 3]| {
            let towards = eye - surface.positions[triangle[0] as usize];
            mesh::area_normal(surface.positions, triangle).dot(&towards) > 0.0
        };
        let facing: Vec<[u32; 3]> = surface.triangles.iter().filter(faces).copied().collect();
        let covered =
            Window::around(&vertices, camera, 1).map(|window| (window, raster::fragments(&vertices, &facing, &window)));
        Self { surface, camera, cam_from_head, facing, covered }
    }

    fn fragment(&self, pixel: &Vec2) -> Option<&Fragment> {
        let (window, fragments) = self.covered.as_ref()?;
        let (x, y) = (pixel.x.round() as i32 - window.x, pixel.y.round() as i32 - window.y);
        let inside = x >= 0 && y >= 0 && (x as usize) < window.width && (y as usize) < window.height;
        inside.then(|| &fragments[y as usize * window.width + x as usize]).filter(|f| f.triangle != NO_TRIANGLE)
    }

    /// The place of the skin that a pixel shows.
    pub fn cast(&self, pixel: &Vec2) -> Option<SkinPoint> {
        let triangle = self.facing[self.fragment(pixel)?.triangle as usize];
        let corners = triangle.map(|i| self.surface.positions[i as usize]);
        // The fragment is the pixel centre's; the pixel's own ray meets the same triangle's plane beside it.
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let point = self.meet(pixel, &corners[0], &normal);
        Some(SkinPoint { triangle, weights: mesh::closest_barycentric(&point, &corners) })
    }

    /// Where a pixel's ray meets a plane, head frame.
    fn meet(&self, pixel: &Vec2, on_plane: &Vec3, normal: &Vec3) -> Vec3 {
        let head_from_cam = self.cam_from_head.inverse();
        let (origin, direction) = (head_from_cam.translation, head_from_cam.rotation * self.camera.ray(pixel));
        origin + direction * (normal.dot(&(on_plane - origin)) / normal.dot(&direction))
    }

    /// Cosine of the angle between the skin's normal and the direction to the camera; `None` where something is before
    /// it, or no pixel shows it.
    pub fn facing(&self, point: &SkinPoint) -> Option<f64> {
        let place = self.surface.place(point);
        let in_camera = self.cam_from_head.apply(&place);
        let cover = self.fragment(&self.camera.project(&in_camera)?)?;
        let towards = (self.cam_from_head.inverse().translation - place).try_normalize(1e-9)?;
        (f64::from(cover.depth) > in_camera.z - HIDDEN).then(|| self.surface.normal(point).dot(&towards))
    }

    /// Where a place of the skin, seen in a pixel of this view, is in another view, and how its surroundings are warped
    /// there: the patch is taken for the tangent plane, moved along with the face's expression.
    pub fn predict(&self, point: &SkinPoint, pixel: &Vec2, other: &View) -> Option<Guess> {
        let (place, normal) = (self.surface.place(point), self.surface.normal(point));
        let moved = other.surface.place(point) - place;
        let transfer = |pixel: Vec2| {
            let there = self.meet(&pixel, &place, &normal) + moved;
            other.camera.project(&other.cam_from_head.apply(&there))
        };
        let column = |step: Vec2| Some(transfer(pixel + step)? - transfer(pixel - step)?);
        let warp = Matrix2::from_columns(&[column(Vec2::new(0.5, 0.0))?, column(Vec2::new(0.0, 0.5))?]);
        let usable = warp.determinant() > SQUEEZED && warp.amax() < STRETCHED;
        Some(Guess { position: transfer(*pixel)?, warp }).filter(|_| usable)
    }

    /// The pixels whose place on the skin faces this and the other camera by at least `cosine`, `margin` pixels away
    /// from those that do not.
    pub fn shared(&self, other: &View, cosine: f64, margin: usize) -> GrayImage {
        let mut mask = GrayImage::new(self.camera.width, self.camera.height);
        let Some((window, fragments)) = &self.covered else { return mask };
        let seen = |x: usize, y: usize| {
            let fragment = &fragments[y * window.width + x];
            if fragment.triangle == NO_TRIANGLE {
                return false;
            }
            let point = SkinPoint {
                triangle: self.facing[fragment.triangle as usize],
                weights: fragment.weights().map(f64::from),
            };
            let faces = |view: &View| view.facing(&point).is_some_and(|found| found > cosine);
            faces(self) && faces(other)
        };
        for y in 0..window.height {
            for x in 0..window.width {
                let (column, row) = (window.x + x as i32, window.y + y as i32);
                let inside = column >= 0 && row >= 0 && column < mask.width() as i32 && row < mask.height() as i32;
                if inside && seen(x, y) {
                    mask.put_pixel(column as u32, row as u32, Luma([255]));
                }
            }
        }
        eroded(&mask, margin)
    }
}

/// What is left of a mask `margin` pixels away from its edge.
fn eroded(mask: &GrayImage, margin: usize) -> GrayImage {
    let (width, height) = (mask.width() as usize, mask.height() as usize);
    let along = |source: &[u8], count: usize, at: &dyn Fn(usize, usize) -> usize, lines: usize| {
        let mut out = vec![0; source.len()];
        for line in 0..lines {
            let mut run = 0;
            for k in 0..count {
                run = if source[at(line, k)] == 0 { 0 } else { run + 1 };
                // A run that has reached twice the margin clears its middle.
                if run > 2 * margin {
                    out[at(line, k - margin)] = 255;
                }
            }
        }
        out
    };
    let rows = along(mask.as_raw(), width, &|y, x| y * width + x, height);
    let both = along(&rows, height, &|x, y| y * width + x, width);
    GrayImage::from_raw(mask.width(), mask.height(), both).unwrap_or_else(|| mask.clone())
}
