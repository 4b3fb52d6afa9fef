//! Points of the face followed through the chosen frames.
//!
//! Corners are taken in a few reference frames and every other frame is searched for the *reference's* patch, warped as
//! the head's estimated pose and surface predict it: a template that is re-anchored cannot drift away over a sequence.

use geometry::{Camera, Progress, Transform, Vec2, Vec3, mesh};
use image::GrayImage;
use nalgebra::Matrix2;
use texture::raster::{self, NO_TRIANGLE, Window};
use vision::corners::{CornerOptions, detect};
use vision::pyramid::Pyramid;
use vision::track::{Guess, Status, TrackOptions, track};

use crate::FacewrightError;

/// How points are followed.
#[derive(Clone, Debug)]
pub struct FollowOptions {
    /// Corners per reference frame.
    pub corners: usize,
    /// Yaws at which a reference frame is taken (the nearest chosen frame), degrees.
    pub reference_yaws_deg: Vec<f64>,
    /// A frame turned further than this from the reference is not searched, degrees.
    pub max_turn_deg: f64,
    /// The surface must face the camera within this angle in both frames, degrees.
    pub max_slant_deg: f64,
    /// Side of the patch as part of the distance between the eyes.
    pub patch: f64,
    /// Least number of frames a point must be found in.
    pub min_frames: usize,
}

impl Default for FollowOptions {
    fn default() -> Self {
        Self {
            corners: 350,
            reference_yaws_deg: vec![0.0, -15.0, 15.0, -30.0, 30.0, -50.0, 50.0],
            max_turn_deg: 32.0,
            max_slant_deg: 68.0,
            patch: 0.22,
            min_frames: 4,
        }
    }
}

/// A frame in which points are sought.
pub struct TrackedFrame<'a> {
    /// Its picture.
    pub pyramid: &'a Pyramid,
    /// Where the face is: 255 on skin that may be tracked.
    pub mask: &'a GrayImage,
    /// Estimated pose.
    pub cam_from_head: Transform,
}

/// A point of the skin, seen in several frames.
#[derive(Clone, Debug)]
pub struct FaceTrack {
    /// Estimated place on the head, head frame, metres.
    pub point: Vec3,
    /// Triangle of the head's skin it was taken from.
    pub triangle: [u32; 3],
    /// Barycentric weights there.
    pub weights: [f64; 3],
    /// The frame it was found in as a corner.
    pub reference: usize,
    /// Its pixel there.
    pub reference_pixel: Vec2,
    /// Frame, pixel, one standard deviation in pixels; ascending frames, the reference among them.
    pub observations: Vec<(usize, Vec2, f64)>,
}

/// Skin seen from a camera.
struct Surface<'a> {
    positions: &'a [Vec3],
    normals: Vec<Vec3>,
    triangles: &'a [[u32; 3]],
}

/// Follows corners of the reference frames through all frames. `positions` and `triangles` are the head's skin as it is
/// known so far.
pub fn follow(
    frames: &[TrackedFrame],
    camera: &Camera,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &FollowOptions,
    progress: &Progress,
) -> Result<Vec<FaceTrack>, FacewrightError> {
    progress.stage("track")?;
    let surface = Surface { positions, normals: mesh::vertex_normals(positions, triangles), triangles };
    let references = references(frames, options);
    let mut tracks = Vec::new();
    for (done, &reference) in references.iter().enumerate() {
        progress.step(done, references.len())?;
        let mut seeds = seeds(&frames[reference], reference, camera, &surface, options)?;
        let normals: Vec<Vec3> = seeds.iter().map(|s| surface.normal(&s.triangle, &s.weights)).collect();
        let trackable = TrackOptions {
            window: patch_size(&frames[reference], camera, options),
            levels: 2,
            ..TrackOptions::default()
        };
        for (index, frame) in frames.iter().enumerate().filter(|&(i, _)| i != reference) {
            if frame.cam_from_head.angle_to(&frames[reference].cam_from_head).to_degrees() > options.max_turn_deg {
                continue;
            }
            search(&mut seeds, &normals, &frames[reference], (index, frame), camera, &trackable, options)?;
        }
        tracks.extend(seeds.into_iter().filter(|t| t.observations.len() >= options.min_frames));
    }
    for track in &mut tracks {
        track.observations.sort_by_key(|o| o.0);
    }
    Ok(tracks)
}

/// The chosen frame nearest to each wanted yaw, each once.
fn references(frames: &[TrackedFrame], options: &FollowOptions) -> Vec<usize> {
    let yaw = |i: usize| crate::select::yaw_pitch(&frames[i].cam_from_head).0.to_degrees();
    let mut references = Vec::new();
    for wanted in &options.reference_yaws_deg {
        let nearest = (0..frames.len()).min_by(|&a, &b| (yaw(a) - wanted).abs().total_cmp(&(yaw(b) - wanted).abs()));
        let Some(nearest) = nearest.filter(|n| (yaw(*n) - wanted).abs() < 9.0) else { continue };
        if !references.contains(&nearest) {
            references.push(nearest);
        }
    }
    references
}

/// Window of the tracker, odd pixels, in proportion to the face.
fn patch_size(frame: &TrackedFrame, camera: &Camera, options: &FollowOptions) -> usize {
    let eyes = 0.063 * camera.fx / frame.cam_from_head.translation.z.max(1e-3);
    let size = (options.patch * eyes).round() as usize;
    (size | 1).clamp(7, 31)
}

/// Corners of a reference frame, cast back onto the head.
fn seeds(
    frame: &TrackedFrame,
    index: usize,
    camera: &Camera,
    surface: &Surface,
    options: &FollowOptions,
) -> Result<Vec<FaceTrack>, FacewrightError> {
    let corner_options = CornerOptions { max_count: options.corners, ..CornerOptions::default() };
    let corners = detect(frame.pyramid, Some(frame.mask), &corner_options)?;
    let vertices = raster::project(camera, &frame.cam_from_head, surface.positions);
    let Some(window) = Window::around(&vertices, camera, 1) else { return Ok(Vec::new()) };
    let fragments = raster::fragments(&vertices, surface.triangles, &window);
    let cast = |pixel: Vec2| {
        let (x, y) = (pixel.x.round() as i32 - window.x, pixel.y.round() as i32 - window.y);
        let inside = x >= 0 && y >= 0 && (x as usize) < window.width && (y as usize) < window.height;
        let fragment = fragments[if inside { y as usize * window.width + x as usize } else { return None }];
        if fragment.triangle == NO_TRIANGLE {
            return None;
        }
        let triangle = surface.triangles[fragment.triangle as usize];
        let (origin, direction) = ray_in_head(camera, &frame.cam_from_head, &pixel);
        let corners = triangle.map(|i| surface.positions[i as usize]);
        // The fragment is the pixel centre's; the corner's own ray meets the same triangle's plane beside it.
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let along = normal.dot(&(corners[0] - origin)) / normal.dot(&direction);
        let point = origin + direction * along;
        let weights = mesh::closest_barycentric(&point, &corners);
        let slant = -surface.normal(&triangle, &weights).dot(&direction);
        (slant > options.max_slant_deg.to_radians().cos()).then(|| FaceTrack {
            point: mesh::at_barycentric(surface.positions, &triangle, &weights),
            triangle,
            weights,
            reference: index,
            reference_pixel: pixel,
            observations: vec![(index, pixel, 0.1)],
        })
    };
    Ok(corners.iter().filter_map(|c| cast(c.position)).collect())
}

fn ray_in_head(camera: &Camera, cam_from_head: &Transform, pixel: &Vec2) -> (Vec3, Vec3) {
    let head_from_cam = cam_from_head.inverse();
    (head_from_cam.translation, head_from_cam.rotation * camera.ray(pixel))
}

/// Searches one frame for the seeds of a reference frame and adds what it finds.
fn search(
    seeds: &mut [FaceTrack],
    normals: &[Vec3],
    reference: &TrackedFrame,
    (index, frame): (usize, &TrackedFrame),
    camera: &Camera,
    trackable: &TrackOptions,
    options: &FollowOptions,
) -> Result<(), FacewrightError> {
    let centre = frame.cam_from_head.inverse().translation;
    let limit = options.max_slant_deg.to_radians().cos();
    let mut wanted = Vec::new();
    for (i, seed) in seeds.iter().enumerate() {
        let facing = normals[i].dot(&(centre - seed.point).normalize()) > limit;
        let guess = facing.then(|| predict(seed, &normals[i], reference, frame, camera)).flatten();
        if let Some(guess) = guess {
            wanted.push((i, guess));
        }
    }
    let points: Vec<Vec2> = wanted.iter().map(|(i, _)| seeds[*i].reference_pixel).collect();
    let guesses: Vec<Guess> = wanted.iter().map(|(_, g)| *g).collect();
    let found = track(reference.pyramid, frame.pyramid, &points, Some(&guesses), trackable)?;
    for ((i, _), found) in wanted.iter().zip(found) {
        if found.status == Status::Found {
            seeds[*i].observations.push((index, found.position, found.sigma_px.max(0.05)));
        }
    }
    Ok(())
}

/// Where a seed's patch should be in another frame, and how it is warped, if the head's surface is right.
fn predict(
    seed: &FaceTrack,
    normal: &Vec3,
    reference: &TrackedFrame,
    frame: &TrackedFrame,
    camera: &Camera,
) -> Option<Guess> {
    let at = seed.reference_pixel;
    // The whole patch is taken for the tangent plane at the point.
    let transfer = |pixel: Vec2| {
        let (origin, direction) = ray_in_head(camera, &reference.cam_from_head, &pixel);
        let along = normal.dot(&(seed.point - origin)) / normal.dot(&direction);
        camera.project(&frame.cam_from_head.apply(&(origin + direction * along)))
    };
    let (dx, dy) = (Vec2::new(0.5, 0.0), Vec2::new(0.0, 0.5));
    let column = |d: Vec2| Some(transfer(at + d)? - transfer(at - d)?);
    let warp = Matrix2::from_columns(&[column(dx)?, column(dy)?]);
    let position = transfer(at)?;
    let usable = warp.determinant() > 0.15 && warp.amax() < 4.0;
    usable.then_some(Guess { position, warp })
}

impl Surface<'_> {
    fn normal(&self, triangle: &[u32; 3], weights: &[f64; 3]) -> Vec3 {
        mesh::at_barycentric(&self.normals, triangle, weights).try_normalize(1e-9).unwrap_or_else(Vec3::z)
    }
}

/// Follows corners of the first of two frames into the second.
pub fn follow_pair(
    pair: &[TrackedFrame; 2],
    camera: &Camera,
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    options: &FollowOptions,
) -> Result<Vec<FaceTrack>, FacewrightError> {
    let surface = Surface { positions, normals: mesh::vertex_normals(positions, triangles), triangles };
    let mut seeds = seeds(&pair[0], 0, camera, &surface, options)?;
    let normals: Vec<Vec3> = seeds.iter().map(|s| surface.normal(&s.triangle, &s.weights)).collect();
    let window = patch_size(&pair[0], camera, options);
    let trackable = TrackOptions { window, levels: 2, ..TrackOptions::default() };
    search(&mut seeds, &normals, &pair[0], (1, &pair[1]), camera, &trackable, options)?;
    Ok(seeds)
}
