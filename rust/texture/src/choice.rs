//! Which view is right where: the views are compared on a small atlas before the large one is made.
//!
//! - [`choose_views`] picks the frames of a film that are worth the work.
//! - `compare` fits the light, finds views that contradict the others (a hand, a strand of hair, a highlight, a blink)
//!   and the best view of each region, whose fine detail the blend will take.

use crate::plane::{Plane, Texel, box_blur};
use crate::shading::{Light, Observation, Prior, fit};
use geometry::{Transform, Vec3};
use rayon::prelude::*;

/// Darkest and brightest value, of 255, that still tells about the light.
const TELLING: std::ops::RangeInclusive<f32> = 8.0..=247.0;
/// Points for the fit of the light.
const FIT_POINTS: usize = 12_000;
/// Spread of grey levels by noise and compression.
const NOISE_LEVELS: f64 = 3.0;
/// Smallest spread of log-colours between views that agree.
const AGREEMENT: f64 = 0.03;

/// At most `count` views, in ascending order, that together look at the head from all sides it was filmed from: the
/// sharpest one first, then always the one that adds most angle, less sharp ones counting less.
///
/// `sharpness` is any positive measure that is larger for sharper pictures, one per pose.
pub fn choose_views(cam_from_head: &[Transform], sharpness: &[f64], count: usize) -> Vec<usize> {
    let towards_camera = |pose: &Transform| pose.inverse().translation.try_normalize(1e-9).unwrap_or_else(Vec3::z);
    let directions: Vec<Vec3> = cam_from_head.iter().map(towards_camera).collect();
    let sharpness = |i: usize| sharpness.get(i).copied().unwrap_or(0.0).max(0.0);
    let mut gain: Vec<f64> = vec![std::f64::consts::PI; directions.len()];
    let mut chosen = Vec::new();
    while chosen.len() < count.min(directions.len()) {
        let value = |i: usize| gain[i] * sharpness(i);
        let best = (0..directions.len()).filter(|i| !chosen.contains(i)).max_by(|&a, &b| {
            // The earlier one of equals.
            value(a).total_cmp(&value(b)).then(b.cmp(&a))
        });
        let Some(best) = best else { break };
        for (gain, direction) in gain.iter_mut().zip(&directions) {
            *gain = gain.min(direction.angle(&directions[best]));
        }
        chosen.push(best);
    }
    chosen.sort_unstable();
    chosen
}

/// What the comparison of the views found.
pub(crate) struct Comparison {
    /// Light and gains; `None` when the views overlap too little.
    pub(crate) light: Option<Light>,
    /// Per view 0…1: how well it agrees with the others.
    pub(crate) consistency: Vec<Plane<f32>>,
    /// Per view 0…1: whether its detail is taken, smooth over the borders between views.
    pub(crate) selection: Vec<Plane<f32>>,
    /// Per view: share of the seen cells it was selected for.
    pub(crate) shares: Vec<f64>,
}

/// Compares the views' small atlases; `normals` are those of the cells in the head frame (zero outside the islands).
/// Without a prior no light is fitted.
pub(crate) fn compare(
    views: &[Plane<Texel>],
    poses: &[Transform],
    normals: &Plane<Vec3>,
    prior: Option<&Prior>,
) -> Comparison {
    let cells = normals.data.len();
    let observations = |cell: usize| observe(views, poses, &normals.data[cell], cell);
    let overlapping: Vec<usize> =
        (0..cells).filter(|&cell| views.iter().filter(|v| v.data[cell][3] > 0.0).count() > 1).collect();
    let stride = overlapping.len().div_ceil(FIT_POINTS).max(1);
    let points: Vec<_> = overlapping.par_iter().step_by(stride).map(|&cell| observations(cell)).collect();
    let light = prior.and_then(|prior| fit(&points, views.len(), prior));
    let assumed = light.clone().unwrap_or_else(|| Light::none(views.len()));
    let spread = spread(&points, &assumed).max(AGREEMENT);
    let agreement: Vec<Vec<(usize, f32)>> =
        (0..cells).into_par_iter().map(|cell| agree(&observations(cell), &assumed, spread)).collect();
    let consistency = consistency(&agreement, views);
    let (selection, shares) = select(views, &consistency);
    Comparison { light, consistency, selection, shares }
}

/// The views of a cell, dark and overexposed ones left out.
fn observe(views: &[Plane<Texel>], poses: &[Transform], normal: &Vec3, cell: usize) -> Vec<Observation> {
    if *normal == Vec3::zeros() {
        return Vec::new();
    }
    let observation = |view: usize| {
        let [r, g, b, weight] = views[view].data[cell];
        let telling = weight > 0.0 && [r, g, b].iter().all(|c| TELLING.contains(c));
        telling.then(|| Observation {
            view,
            normal_in_cam: poses[view].rotation * normal,
            log_colour: [r, g, b].map(|c| f64::from(c).ln()),
            // The root: slanted views are poor texture, but they tell most about the light.
            weight: f64::from(weight).sqrt(),
        })
    };
    (0..views.len()).filter_map(observation).collect()
}

/// The log-albedo that half of the weight lies below, per channel.
fn median_albedo(point: &[Observation], light: &Light) -> [f64; 3] {
    let half = point.iter().map(|o| o.weight).sum::<f64>() / 2.0;
    let albedo: Vec<[f64; 3]> = point.iter().map(|o| light.log_albedo(o)).collect();
    [0, 1, 2].map(|k| {
        let mut order: Vec<usize> = (0..point.len()).collect();
        order.sort_by(|&a, &b| albedo[a][k].total_cmp(&albedo[b][k]));
        let mut sum = 0.0;
        let middle = order.iter().find(|&&i| {
            sum += point[i].weight;
            sum >= half
        });
        middle.map_or(0.0, |&i| albedo[i][k])
    })
}

/// Squared distance of an observation from an albedo, relative to `spread` and the noise of its colour.
fn deviation(o: &Observation, light: &Light, albedo: &[f64; 3], spread: f64) -> f64 {
    let found = light.log_albedo(o);
    let one = |k: usize| {
        let noise = NOISE_LEVELS / o.log_colour[k].exp();
        (found[k] - albedo[k]).powi(2) / (spread * spread + noise * noise)
    };
    (one(0) + one(1) + one(2)) / 3.0
}

/// Median distance of the observations from their points' albedo.
fn spread(points: &[Vec<Observation>], light: &Light) -> f64 {
    let distances = |p: &Vec<Observation>| -> Vec<f64> {
        let albedo = median_albedo(p, light);
        let distance = |o: &Observation| {
            let found = light.log_albedo(o);
            ((0..3).map(|k| (found[k] - albedo[k]).powi(2)).sum::<f64>() / 3.0).sqrt()
        };
        if p.len() > 2 { p.iter().map(distance).collect() } else { Vec::new() }
    };
    let mut all: Vec<f64> = points.par_iter().flat_map_iter(distances).collect();
    if all.is_empty() {
        return AGREEMENT;
    }
    let middle = all.len() / 2;
    1.5 * *all.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// How well each view of a point agrees with the others.
fn agree(point: &[Observation], light: &Light, spread: f64) -> Vec<(usize, f32)> {
    if point.len() < 2 {
        return Vec::new();
    }
    let albedo = median_albedo(point, light);
    let weight = |o: &Observation| (1.0 + deviation(o, light, &albedo, spread) / 6.0).powi(-3) as f32;
    point.iter().map(|o| (o.view, weight(o))).collect()
}

/// The agreements as planes, slightly blurred; views of cells that could not be compared agree.
fn consistency(agreement: &[Vec<(usize, f32)>], views: &[Plane<Texel>]) -> Vec<Plane<f32>> {
    let mut planes: Vec<_> = views.iter().map(|v| Plane::new(v.width, v.height, 1.0f32)).collect();
    for (cell, list) in agreement.iter().enumerate() {
        for &(view, weight) in list {
            planes[view].data[cell] = weight;
        }
    }
    planes.par_iter().map(|p| box_blur(p, 1)).collect()
}

/// The best view of each region, by scores blurred so that the regions are not torn.
fn select(views: &[Plane<Texel>], consistency: &[Plane<f32>]) -> (Vec<Plane<f32>>, Vec<f64>) {
    let score = |(view, consistency): (&Plane<Texel>, &Plane<f32>)| {
        let data = view.data.iter().zip(&consistency.data).map(|(t, c)| t[3] * c).collect();
        box_blur(&Plane { width: view.width, height: view.height, data }, 2)
    };
    let scores: Vec<Plane<f32>> = views.par_iter().zip(consistency).map(score).collect();
    let best = |cell: usize| {
        let mut best = None;
        for (view, texels) in views.iter().enumerate() {
            let score = scores[view].data[cell];
            if texels.data[cell][3] > 0.0 && best.is_none_or(|(_, found)| score > found) {
                best = Some((view, score));
            }
        }
        best.map(|(view, _)| view)
    };
    let labels: Vec<Option<usize>> = (0..views.first().map_or(0, |v| v.data.len())).map(best).collect();
    let seen = labels.iter().flatten().count().max(1) as f64;
    let share = |view: usize| labels.iter().filter(|&&l| l == Some(view)).count() as f64 / seen;
    let mask = |view: usize| {
        let data = labels.iter().map(|&l| f32::from(u8::from(l == Some(view)))).collect();
        box_blur(&Plane { width: views[view].width, height: views[view].height, data }, 1)
    };
    let masks = (0..views.len()).into_par_iter().map(mask).collect();
    (masks, (0..views.len()).map(share).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn pose(yaw: f64) -> Transform {
        let turn = Rotation3::from_axis_angle(&Vec3::y_axis(), yaw);
        Transform::new(Rotation3::from_euler_angles(std::f64::consts::PI, 0.0, 0.0) * turn, Vec3::new(0.0, 0.0, 0.7))
    }

    #[test]
    fn chosen_views_span_the_turn_and_avoid_blur() {
        let poses: Vec<_> = (0..61).map(|i| pose(f64::from(i - 30) * 0.017)).collect();
        let sharpness: Vec<f64> = (0..61).map(|i| if i % 2 == 0 { 1.0 } else { 0.3 }).collect();
        let chosen = choose_views(&poses, &sharpness, 7);
        assert_eq!(chosen.len(), 7);
        assert!(chosen.contains(&0) && chosen.contains(&60) && chosen.iter().all(|i| i % 2 == 0), "{chosen:?}");
        assert!(chosen.windows(2).all(|w| w[1] - w[0] <= 16), "{chosen:?}");
        assert_eq!(choose_views(&poses, &sharpness, 100).len(), 61);
        assert!(choose_views(&[], &[], 3).is_empty());
    }

    #[test]
    fn a_view_that_contradicts_the_others_is_not_selected() {
        let n = 40;
        let view = |colour: f32, weight: f32| {
            Plane::from_rows(n, n, [0.0; 4], |y, row| {
                for (x, t) in row.iter_mut().enumerate() {
                    let base = 100.0 + 20.0 * ((x * 7 + y * 3) % 5) as f32;
                    *t = [base * colour, base * 0.8 * colour, base * 0.6, weight];
                }
            })
        };
        let mut views = vec![view(1.0, 0.5), view(1.0, 0.6), view(1.0, 0.7), view(1.0, 1.0)];
        for y in 10..20 {
            for x in 10..20 {
                views[3].data[y * n + x] = [30.0, 60.0, 120.0, 1.0];
            }
        }
        let poses: Vec<_> = (0..4).map(|i| pose(f64::from(i) * 0.2)).collect();
        let normals = Plane::new(n, n, Vec3::new(0.0, 0.1, 0.99).normalize());
        let found = compare(&views, &poses, &normals, Some(&Prior { shading: 1e-3, gain: 2e-3 }));
        assert!(found.consistency[3].data[15 * n + 15] < 0.02 && found.consistency[2].data[15 * n + 15] > 0.6);
        assert!(found.selection[3].data[15 * n + 15] < 0.01 && found.selection[3].data[30 * n + 30] > 0.99);
        assert!(found.shares[3] > 0.8);
    }
}
