//! Where the 468 landmarks of the net sit on the generic head.
//!
//! # Entry point
//! [`find_anchors`].
//!
//! # Method
//! The mean head and random members of the class are drawn from several sides and given to the net (which averages over
//! the mirrored picture). Each landmark's rays are intersected robustly, drawn gently to the skin, and the result is snapped
//! to the nearest skin that a camera can see. All meshes share one topology, so that the places found on different people
//! are averaged on the mean head, made symmetric, and their spread over people and views says how far to trust each.

use crate::bvh::{Bvh, Hit};
use crate::random::Random;
use crate::render::{Model, View, render};
use crate::symmetry::flip;
use anyhow::Context;
use geometry::face_mesh::MIRROR;
use geometry::{Mat3, Vec3, mesh};
use head::{Anchor, GenericHead, part};
use rayon::prelude::*;
use vision::landmarks::FaceLandmarker;

/// How the anchors are found.
#[derive(Clone, Debug)]
pub struct AnchorOptions {
    /// Random members of the class besides the mean.
    pub people: usize,
    /// Their coefficients' standard deviation: the class is wider than people are.
    pub spread: f64,
    /// Yaw and pitch of each view, degrees; the first is frontal.
    pub views: Vec<[f64; 2]>,
    /// Edge of the pictures, pixels.
    pub size: u32,
    /// Rounds of intersecting and snapping.
    pub rounds: usize,
    /// Seed of the random people.
    pub seed: u64,
}

impl Default for AnchorOptions {
    fn default() -> Self {
        let yaws = [0.0, -10.0, 10.0, -20.0, 20.0, -40.0, 40.0].map(|yaw| [yaw, 0.0]);
        let views = yaws.into_iter().chain([[0.0, -15.0], [0.0, 15.0]]).collect();
        Self { people: 10, spread: 0.5, views, size: 384, rounds: 3, seed: 2 }
    }
}

/// A view that sees a landmark less squarely than this (cosine) does not count.
const LEAST_COSINE: f64 = 0.35;
/// Rays that miss by this much count half, metres.
const ROBUST: f64 = 0.003;
/// Pull to the skin, relative to all rays together.
const PULL: f64 = 0.15;

/// A landmark's ray.
#[derive(Clone, Copy)]
struct Ray {
    origin: Vec3,
    direction: Vec3,
}

/// The landmarks of one person.
struct Sighting {
    /// Place of each landmark on the visible skin, by triangle of the list of outside triangles.
    hits: Vec<Hit>,
    /// Mean squared distance of each landmark from its rays, square metres.
    scatter: Vec<f64>,
}

/// Finds the anchors of all landmarks; `lips` as for [`Model::new`].
///
/// # Errors
/// When the net fails or does not recognise the mean head.
pub fn find_anchors(
    head: &GenericHead,
    lips: &[f64],
    landmarker: &FaceLandmarker,
    options: &AnchorOptions,
) -> anyhow::Result<Vec<Anchor>> {
    let outside = outside_triangles(head);
    let people = people(head, options);
    let sightings: Vec<Option<Sighting>> = people
        .par_iter()
        .map(|positions| {
            let rays = look(head, positions, lips, landmarker, options)?;
            Ok(rays.map(|rays| locate(head, positions, &outside, &rays, options.rounds)))
        })
        .collect::<anyhow::Result<_>>()?;
    anyhow::ensure!(sightings[0].is_some(), "the net does not recognise the generic head");
    let sightings: Vec<Sighting> = sightings.into_iter().flatten().collect();
    Ok(average(head, &outside, &sightings))
}

/// The mean and random members of the class.
fn people(head: &GenericHead, options: &AnchorOptions) -> Vec<Vec<Vec3>> {
    let random_person = |i: u64| {
        let mut random = Random::new(options.seed, i);
        let coefficients: Vec<f64> =
            (0..head.identity.components).map(|_| random.normal(0.0, options.spread)).collect();
        head.with_identity(&coefficients)
    };
    std::iter::once(head.positions.clone()).chain((0..options.people as u64).map(random_person)).collect()
}

/// Skin triangles none of whose corners is hidden.
fn outside_triangles(head: &GenericHead) -> Vec<[u32; 3]> {
    let mut triangles = head.triangles(head.skin());
    triangles.retain(|t| t.iter().all(|&v| !head.cavity[v as usize]));
    triangles
}

/// Rays of every landmark, view by view, frontal first; `None` when no face is seen from the front.
fn look(
    head: &GenericHead,
    positions: &[Vec3],
    lips: &[f64],
    landmarker: &FaceLandmarker,
    options: &AnchorOptions,
) -> anyhow::Result<Option<Vec<Vec<Ray>>>> {
    let model = Model::new(head, positions.to_vec(), lips);
    let mut rays = Vec::with_capacity(options.views.len());
    for (i, &[yaw, pitch]) in options.views.iter().enumerate() {
        let view = View::around(yaw, pitch, options.size);
        let face = landmarker.find(&render(&model, &view)).context("landmarks of a rendered head")?;
        let head_from_cam = view.cam_from_head.inverse();
        let ray = |p: &Vec3| Ray {
            origin: head_from_cam.translation,
            direction: head_from_cam.rotation * view.camera.ray(&p.xy()),
        };
        match face {
            Some(face) => rays.push(face.points.iter().map(ray).collect()),
            None if i == 0 => return Ok(None),
            None => {}
        }
    }
    Ok(Some(rays))
}

/// Places every landmark of a person.
fn locate(head: &GenericHead, positions: &[Vec3], outside: &[[u32; 3]], views: &[Vec<Ray>], rounds: usize) -> Sighting {
    let skin = Bvh::new(positions, outside);
    let mut solid = outside.to_vec();
    let eyes = head.parts.iter().filter(|p| p.name == part::EYE_LEFT || p.name == part::EYE_RIGHT);
    solid.extend(eyes.flat_map(|p| head.triangles(p)));
    let solid = Bvh::new(positions, &solid);
    let frontal: Vec<Option<f64>> =
        views[0].iter().map(|r| solid.cast(&r.origin, &r.direction).map(|h| h.distance)).collect();
    let mut depths: Vec<f64> = frontal.iter().flatten().copied().collect();
    depths.sort_by(f64::total_cmp);
    let usual = depths.get(depths.len() / 2).copied().unwrap_or(1.0);
    let landmark = |i: usize| {
        let start = views[0][i].origin + views[0][i].direction * frontal[i].unwrap_or(usual);
        let rays: Vec<Ray> = views.iter().map(|view| view[i]).collect();
        intersect(positions, outside, &skin, &rays, start, rounds)
    };
    let (hits, scatter) = (0..views[0].len()).filter_map(landmark).unzip();
    Sighting { hits, scatter }
}

/// The point of the skin nearest to all rays, frontal first, and its mean squared distance from those that count.
fn intersect(
    positions: &[Vec3],
    outside: &[[u32; 3]],
    skin: &Bvh,
    rays: &[Ray],
    start: Vec3,
    rounds: usize,
) -> Option<(Hit, f64)> {
    let mut point = start;
    let mut hit = skin.closest(&point)?;
    let mut scatter = 0.0;
    for _ in 0..rounds {
        let triangle = &outside[hit.triangle];
        let normal = mesh::area_normal(positions, triangle).normalize();
        let (mut matrix, mut right, mut sum, mut misses) = (Mat3::zeros(), Vec3::zeros(), 0.0, 0.0);
        for (view, ray) in rays.iter().enumerate() {
            let cosine = -normal.dot(&ray.direction);
            if view > 0 && cosine < LEAST_COSINE {
                continue;
            }
            let across = Mat3::identity() - ray.direction * ray.direction.transpose();
            let miss = (across * (point - ray.origin)).norm_squared();
            let weight = (cosine.max(0.0).powi(2) + 0.02) / (1.0 + miss / (ROBUST * ROBUST));
            matrix += across * weight;
            right += across * ray.origin * weight;
            sum += weight;
            misses += weight * miss;
        }
        let on_skin = mesh::at_barycentric(positions, triangle, &hit.weights);
        let pull = PULL * sum;
        point = (matrix + Mat3::identity() * pull).try_inverse()? * (right + on_skin * pull);
        hit = skin.closest(&point)?;
        scatter = misses / sum;
    }
    Some((hit, scatter))
}

/// Brings all people's places to the mean head, averages them with their mirror images and measures their spread.
fn average(head: &GenericHead, outside: &[[u32; 3]], sightings: &[Sighting]) -> Vec<Anchor> {
    let place = |hit: &Hit| mesh::at_barycentric(&head.positions, &outside[hit.triangle], &hit.weights);
    let skin = Bvh::new(&head.positions, outside);
    let anchor = |i: usize| {
        let own = sightings.iter().map(|s| place(&s.hits[i]));
        let mirrored = sightings.iter().map(|s| flip(&place(&s.hits[MIRROR[i]])));
        let places: Vec<Vec3> = own.chain(mirrored).collect();
        let count = places.len() as f64;
        let mean = places.iter().sum::<Vec3>() / count;
        let people = places.iter().map(|p| (p - mean).norm_squared()).sum::<f64>() / (count - 1.0).max(1.0);
        let views = sightings.iter().map(|s| s.scatter[i] + s.scatter[MIRROR[i]]).sum::<f64>() / count;
        let hit = skin.closest(&mean)?;
        Some(Anchor { triangle: outside[hit.triangle], weights: hit.weights, sigma: (people + views).sqrt() })
    };
    (0..MIRROR.len()).filter_map(anchor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wavy sheet of 21 × 21 vertices, 5 mm apart, facing +z.
    fn sheet() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let height = |x: f64, y: f64| 0.01 * (30.0 * x).cos() + 0.005 * (40.0 * y).sin();
        let at = |i: u32| (f64::from(i % 21) * 0.005 - 0.05, f64::from(i / 21) * 0.005 - 0.05);
        let positions = (0..441).map(|i| Vec3::new(at(i).0, at(i).1, height(at(i).0, at(i).1))).collect();
        let quads: Vec<[u32; 4]> = (0..400).map(|i| i % 20 + i / 20 * 21).map(|i| [i, i + 1, i + 22, i + 21]).collect();
        (positions, mesh::triangulate(&quads))
    }

    fn rays(target: &Vec3, noise: f64) -> Vec<Ray> {
        let mut random = Random::new(11, 0);
        let views = AnchorOptions::default().views;
        let ray = |&[yaw, pitch]: &[f64; 2]| {
            let origin = View::around(yaw, pitch, 100).cam_from_head.inverse().translation;
            let wrong = Vec3::from_fn(|_, _| random.normal(0.0, noise));
            Ray { origin, direction: (target + wrong - origin).normalize() }
        };
        views.iter().map(ray).collect()
    }

    #[test]
    fn a_point_is_found_despite_noise_and_one_wild_view() {
        let (positions, triangles) = sheet();
        let skin = Bvh::new(&positions, &triangles);
        let target = skin.closest(&Vec3::new(0.012, -0.017, 0.0)).unwrap();
        let target = mesh::at_barycentric(&positions, &triangles[target.triangle], &target.weights);
        let mut rays = rays(&target, 0.001);
        rays[4].direction = (target + Vec3::new(0.03, 0.02, 0.0) - rays[4].origin).normalize();
        let start = target + Vec3::new(0.002, -0.002, 0.01);
        let (hit, scatter) = intersect(&positions, &triangles, &skin, &rays, start, 5).unwrap();
        let found = mesh::at_barycentric(&positions, &triangles[hit.triangle], &hit.weights);
        assert!((found - target).norm() < 0.001, "{}", (found - target).norm());
        assert!(scatter.sqrt() > 0.0005 && scatter.sqrt() < 0.006, "{}", scatter.sqrt());
    }

    #[test]
    fn exact_rays_have_no_scatter() {
        let (positions, triangles) = sheet();
        let target = positions[230];
        let skin = Bvh::new(&positions, &triangles);
        let (hit, scatter) = intersect(&positions, &triangles, &skin, &rays(&target, 0.0), target, 3).unwrap();
        assert!(hit.distance < 1e-9 && scatter < 1e-18);
    }
}
