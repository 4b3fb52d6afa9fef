//! Plain pictures of the generic head, good enough for the landmark nets.
//!
//! # Entry points
//! [`View::around`], [`Model::new`], [`render`].
//!
//! Deferred shading: a z-buffer of triangles first, then light at each covered sample. Skin has a warm colour, wrapped
//! diffuse light (a little passes through it) and a faint shine, lips are redder, eyes have iris and pupil; lashes and
//! brows are left out. Light from above the camera, from both sides and from all around, the last dimmed where the head
//! hides the world (ambient occlusion). Every pixel is the mean of `SAMPLES`² samples.

use crate::cavity::openness;
use crate::keys::ball_centre;
use geometry::{Camera, Transform, Vec3, mesh};
use head::{GenericHead, part};
use image::{Rgb, RgbImage};
use nalgebra::{Matrix3, Rotation3};

/// Samples along each edge of a pixel.
const SAMPLES: u32 = 2;
/// Point of the head the camera looks at.
const TARGET: [f64; 3] = [0.0, -0.035, -0.03];
/// Radii of iris and pupil, metres.
const IRIS: [f64; 2] = [0.0060, 0.0022];
/// Directions towards the lights in the camera's frame (x right, y down, z away), and their strengths.
const LIGHTS: [([f64; 3], f64); 3] =
    [([-0.35, -0.7, -0.75], 0.75), ([0.8, -0.25, -0.55], 0.35), ([-0.9, 0.1, -0.4], 0.2)];
/// Strength of the light from all around.
const AMBIENT: f64 = 0.5;
/// Directions in which the surroundings are looked for.
const DIRECTIONS: usize = 96;
/// Grey of the background, linear.
const BACKGROUND: f64 = 0.18;

const SKIN: [f64; 3] = [0.56, 0.36, 0.27];
const LIPS: [f64; 3] = [0.45, 0.18, 0.16];
const SCLERA: [f64; 3] = [0.72, 0.69, 0.66];
const IRIS_COLOUR: [f64; 3] = [0.10, 0.065, 0.04];
const PUPIL: [f64; 3] = [0.006, 0.006, 0.006];
const TEETH: [f64; 3] = [0.6, 0.56, 0.48];
const TONGUE: [f64; 3] = [0.4, 0.15, 0.13];

/// A camera and where it stands.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Its lens.
    pub camera: Camera,
    /// Its pose.
    pub cam_from_head: Transform,
}

impl View {
    /// A camera one metre from the head's middle, `yaw` to the subject's left and `pitch` above, degrees; `size` pixels.
    pub fn around(yaw_deg: f64, pitch_deg: f64, size: u32) -> Self {
        let (yaw, pitch) = (yaw_deg.to_radians(), pitch_deg.to_radians());
        let back = Vec3::new(yaw.sin() * pitch.cos(), pitch.sin(), yaw.cos() * pitch.cos());
        let right = Vec3::y().cross(&back).normalize();
        let down = (-back).cross(&right);
        let rows = Matrix3::from_rows(&[right.transpose(), down.transpose(), -back.transpose()]);
        let rotation = Rotation3::from_matrix_unchecked(rows);
        let position = Vec3::from(TARGET) + back;
        Self {
            camera: Camera::centred(size, size, f64::from(size) * 100.0 / 36.0),
            cam_from_head: Transform::new(rotation, -(rotation * position)),
        }
    }
}

/// A head ready to be drawn.
pub struct Model {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// Share of the surroundings each vertex sees.
    openness: Vec<f64>,
    colours: Vec<Surface>,
}

/// What a vertex is made of.
#[derive(Clone, Copy)]
enum Surface {
    Skin([f64; 3]),
    Plain([f64; 3]),
    /// Offset from the eyeball's centre.
    Eye(Vec3),
}

impl Model {
    /// A member of the class; `lips` says how much of a lip each vertex is, 0…1.
    pub fn new(head: &GenericHead, positions: Vec<Vec3>, lips: &[f64]) -> Self {
        let drawn = head.parts.iter().filter(|p| p.name != part::LASHES);
        let triangles: Vec<[u32; 3]> = drawn.clone().flat_map(|p| head.triangles(p)).collect();
        let normals = mesh::vertex_normals(&positions, &triangles);
        let open =
            vertex_means(positions.len(), &triangles, &openness(&positions, &head.quads, &head.parts, DIRECTIONS));
        let mut colours = vec![Surface::Plain(PUPIL); positions.len()];
        for part in drawn {
            let centre = ball_centre(&positions[part.vertices.clone()]);
            for v in part.vertices.clone() {
                colours[v] = match part.name.as_str() {
                    part::SKIN => Surface::Skin(mix(&SKIN, &LIPS, lips[v])),
                    part::EYE_LEFT | part::EYE_RIGHT => Surface::Eye(positions[v] - centre),
                    part::TONGUE => Surface::Plain(TONGUE),
                    _ => Surface::Plain(TEETH),
                };
            }
        }
        Self { positions, normals, triangles, openness: open, colours }
    }
}

/// Means over the triangles around each vertex; one where no value is known.
fn vertex_means(vertex_count: usize, triangles: &[[u32; 3]], values: &[f64]) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); vertex_count];
    for (triangle, value) in triangles.iter().zip(values) {
        for &v in triangle {
            sums[v as usize].0 += value;
            sums[v as usize].1 += 1.0;
        }
    }
    sums.iter().map(|&(sum, count)| if count > 0.0 { sum / count } else { 1.0 }).collect()
}

/// The nearest surface behind a sample.
#[derive(Clone, Copy)]
struct Fragment {
    inverse_depth: f64,
    triangle: u32,
    weights: [f64; 3],
}

/// Draws a model.
pub fn render(model: &Model, view: &View) -> RgbImage {
    let fine = view.camera.resized(f64::from(SAMPLES));
    let fragments = rasterise(model, &fine, &view.cam_from_head);
    let samples: Vec<[f64; 3]> = fragments
        .iter()
        .map(|f| f.as_ref().map_or([BACKGROUND; 3], |f| shade(model, f, &view.cam_from_head)))
        .collect();
    RgbImage::from_fn(view.camera.width, view.camera.height, |x, y| {
        let mut sum = [0.0; 3];
        for k in 0..SAMPLES * SAMPLES {
            let (i, j) = (x * SAMPLES + k % SAMPLES, y * SAMPLES + k / SAMPLES);
            let sample = &samples[(j * fine.width + i) as usize];
            (0..3).for_each(|c| sum[c] += sample[c] / f64::from(SAMPLES * SAMPLES));
        }
        Rgb(sum.map(encode))
    })
}

fn rasterise(model: &Model, camera: &Camera, cam_from_head: &Transform) -> Vec<Option<Fragment>> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let in_cam: Vec<Vec3> = model.positions.iter().map(|p| cam_from_head.apply(p)).collect();
    let mut fragments: Vec<Option<Fragment>> = vec![None; width * height];
    for (t, triangle) in model.triangles.iter().enumerate() {
        let corners = triangle.map(|v| in_cam[v as usize]);
        let [Some(a), Some(b), Some(c)] = corners.map(|p| camera.project(&p)) else { continue };
        let twice_area = (b - a).perp(&(c - a));
        // The picture's y runs down, so a triangle that faces us turns clockwise.
        if twice_area >= 0.0 {
            continue;
        }
        let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
        let range =
            |low: f64, high: f64, end: usize| (low.ceil().max(0.0) as usize)..((high + 1.0).max(0.0) as usize).min(end);
        for y in range(low.y, high.y, height) {
            for x in range(low.x, high.x, width) {
                let p = geometry::Vec2::new(x as f64, y as f64);
                let flat =
                    [(c - b).perp(&(p - b)), (a - c).perp(&(p - c)), (b - a).perp(&(p - a))].map(|w| w / twice_area);
                if flat.iter().any(|&w| w < 0.0) {
                    continue;
                }
                let over_depth = [0, 1, 2].map(|k| flat[k] / corners[k].z);
                let inverse_depth: f64 = over_depth.iter().sum();
                let slot = &mut fragments[y * width + x];
                if slot.is_none_or(|f| inverse_depth > f.inverse_depth) {
                    let weights = over_depth.map(|w| w / inverse_depth);
                    *slot = Some(Fragment { inverse_depth, triangle: t as u32, weights });
                }
            }
        }
    }
    fragments
}

/// Linear colour of a fragment.
fn shade(model: &Model, fragment: &Fragment, cam_from_head: &Transform) -> [f64; 3] {
    let triangle = model.triangles[fragment.triangle as usize];
    let blend = |value: &dyn Fn(usize) -> Vec3| -> Vec3 {
        (0..3).map(|k| value(triangle[k] as usize) * fragment.weights[k]).sum()
    };
    let normal = cam_from_head.rotation * blend(&|v| model.normals[v]);
    let normal = normal.try_normalize(1e-12).unwrap_or(-Vec3::z());
    let eye = -cam_from_head.apply(&blend(&|v| model.positions[v])).normalize();
    let open: f64 = (0..3).map(|k| model.openness[triangle[k] as usize] * fragment.weights[k]).sum();
    let (albedo, wrap, shine) = match model.colours[triangle[0] as usize] {
        Surface::Skin(_) => (blend(&|v| colour(&model.colours[v])).into(), [0.35, 0.15, 0.1], (0.04, 18.0)),
        Surface::Plain(plain) => (plain, [0.1; 3], (0.05, 30.0)),
        Surface::Eye(_) => (eye_colour(&blend(&|v| colour(&model.colours[v]))), [0.2; 3], (0.25, 200.0)),
    };
    // Where the head hides the world it mostly hides the lamps too.
    let shadow = (open * 1.4).min(1.0);
    let mut light = [AMBIENT * open; 3];
    let mut gloss = 0.0;
    for (direction, strength) in &LIGHTS {
        let direction = Vec3::from(*direction).normalize();
        let cosine = normal.dot(&direction);
        for (c, w) in wrap.iter().enumerate() {
            light[c] += strength * shadow * ((cosine + w) / (1.0 + w)).max(0.0);
        }
        gloss += strength * shadow * shine.0 * normal.dot(&(direction + eye).normalize()).max(0.0).powf(shine.1);
    }
    [0, 1, 2].map(|c| albedo[c] * light[c] + gloss)
}

fn colour(surface: &Surface) -> Vec3 {
    match surface {
        Surface::Skin(rgb) | Surface::Plain(rgb) => Vec3::from(*rgb),
        Surface::Eye(offset) => *offset,
    }
}

/// Colour of the eyeball at an offset from its centre; it looks along +z.
fn eye_colour(offset: &Vec3) -> [f64; 3] {
    let (radius, limit) = (offset.xy().norm(), 0.0004);
    if offset.z < 0.0 {
        return SCLERA;
    }
    let inside = |edge: f64| ((edge - radius) / limit + 0.5).clamp(0.0, 1.0);
    mix(&mix(&SCLERA, &IRIS_COLOUR, inside(IRIS[0])), &PUPIL, inside(IRIS[1]))
}

fn mix(a: &[f64; 3], b: &[f64; 3], t: f64) -> [f64; 3] {
    [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * t)
}

/// sRGB byte of a linear value.
fn encode(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_look_at_the_face_upright() {
        let view = View::around(20.0, 10.0, 200);
        let pixel = |p: Vec3| view.camera.project(&view.cam_from_head.apply(&p)).unwrap();
        let middle = pixel(Vec3::from(TARGET));
        assert!((middle - geometry::Vec2::new(99.5, 99.5)).norm() < 1e-9);
        assert!(pixel(Vec3::from(TARGET) + Vec3::y() * 0.02).y < middle.y, "up is up");
        assert!(pixel(Vec3::from(TARGET) + Vec3::x() * 0.02).x > middle.x, "the subject's left is on the right");
        assert!((view.cam_from_head.rotation.matrix().determinant() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn nearer_triangles_hide_farther_ones_and_backs_are_not_drawn() {
        let square = |z: f64| {
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|p| Vec3::new(p[0] * 0.1, p[1] * 0.1 - 0.035, z))
        };
        let positions: Vec<Vec3> = square(0.0).into_iter().chain(square(0.02)).chain(square(0.05)).collect();
        let triangles = mesh::triangulate(&[[0, 1, 2, 3], [4, 5, 6, 7], [11, 10, 9, 8]]);
        let plain = |rgb| vec![Surface::Plain(rgb); 4];
        let model = Model {
            normals: vec![Vec3::z(); 12],
            openness: vec![1.0; 12],
            colours: [plain([0.0, 0.5, 0.0]), plain([0.5, 0.0, 0.0]), plain([0.0, 0.0, 0.5])].concat(),
            positions,
            triangles,
        };
        let picture = render(&model, &View::around(0.0, 0.0, 64));
        let [r, g, b] = picture.get_pixel(32, 32).0;
        assert!(r > 60 && r > g.saturating_add(40) && r > b.saturating_add(40), "{r} {g} {b}");
        assert_eq!(picture.get_pixel(0, 0).0, [encode(BACKGROUND); 3]);
    }
}
