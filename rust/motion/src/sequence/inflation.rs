//! How much less information tracks hold than they claim: their errors are larger than announced, and correlated from frame to frame and
//! from neighbour to neighbour.
//!
//! A tracked point of the skin errs by the shape that its patch had when it was chosen, and by the skin's motion relative to
//! the skull; both last for many frames, and who talks or smiles moves all of a cheek. Counted as independent, a few hundred frames or
//! points would outvote any prior.
//!
//! The time over which errors stay correlated is the integrated autocorrelation time (Sokal 1997, section 3), taken over all
//! tracks together. The number of neighbours that err alike is found in the same way, by the neighbours' ranks instead of the lags.

use crate::bundle::{Bundle, Observation};
use geometry::Vec2;
use geometry::least_squares::Loss;
use rayon::prelude::*;

/// Errors whose correlation is below this are taken for independent.
const INDEPENDENT: f64 = 0.05;
/// Neighbours whose correlations are averaged before they are compared with that.
const RING: usize = 8;
/// Neighbours that are looked at first, whole rings of them, and how many times more where these are not enough.
const NEAR: usize = 16 * RING;
const FARTHER: usize = 4;

/// The residuals of one point, in the order of the frames.
type Errors = Vec<(usize, Vec2)>;

/// The variance inflation of a bundle's observations, all of them counted as independent: the observed variance in parts of that
/// announced, times the number of frames and the number of points over which errors stay correlated. At least 1.
pub(super) fn variance_inflation(bundle: &Bundle, loss: Loss) -> f64 {
    let tracks = residuals(bundle, loss);
    let count: usize = tracks.iter().map(Vec::len).sum();
    let unknowns = 6 * bundle.poses.len() + 3 * tracks.iter().filter(|track| !track.is_empty()).count();
    let freedom = (2 * count).saturating_sub(unknowns).max(1) as f64;
    let squares: f64 = tracks.iter().flatten().map(|(_, error)| error.norm_squared()).sum();
    (squares / freedom * correlation_time(&tracks) * correlated_points(bundle, &tracks)).max(1.0)
}

/// Residuals of each point's observations, in standard deviations, as far as the loss counts them.
fn residuals(bundle: &Bundle, loss: Loss) -> Vec<Errors> {
    let mut ordered: Vec<&Observation> = bundle.observations.iter().collect();
    ordered.sort_by_key(|o| o.frame);
    let mut tracks = vec![Vec::new(); bundle.points.len()];
    for o in ordered {
        let at = bundle.camera.project(&bundle.poses[o.frame].apply(&bundle.points[o.point]));
        let Some(residual) = at.map(|at| (at - o.pixel) / o.sigma_px) else { continue };
        tracks[o.point].push((o.frame, residual * loss.evaluate(residual.norm_squared()).1.sqrt()));
    }
    tracks
}

/// Number of frames over which errors stay correlated: 1 plus twice the correlations at all lags until they vanish.
fn correlation_time(tracks: &[Errors]) -> f64 {
    let longest = tracks.iter().map(Vec::len).max().unwrap_or(0);
    let moment = |lag: usize| {
        let pairs = tracks.iter().flat_map(|track| track.iter().zip(track.iter().skip(lag)));
        let (sum, count) = pairs.fold((0.0, 0_usize), |(sum, count), ((_, a), (_, b))| (sum + a.dot(b), count + 1));
        sum / count.max(1) as f64
    };
    let variance = moment(0);
    if variance <= 0.0 {
        return 1.0;
    }
    let correlations = (1..longest).map(|lag| moment(lag) / variance);
    1.0 + 2.0 * correlations.take_while(|correlation| *correlation > INDEPENDENT).sum::<f64>()
}

/// Number of points over which errors of one frame stay correlated: 1 plus the correlations with the nearest neighbour, the second
/// nearest and so on, until they vanish; a neighbour that a frame does not see counts nothing.
fn correlated_points(bundle: &Bundle, tracks: &[Errors]) -> f64 {
    let seen: Vec<usize> = (0..tracks.len()).filter(|&point| !tracks[point].is_empty()).collect();
    let variance: f64 = seen.iter().flat_map(|&point| &tracks[point]).map(|(_, error)| error.norm_squared()).sum();
    if variance <= 0.0 {
        return 1.0;
    }
    let mut reach = NEAR;
    loop {
        let sums = rings(bundle, tracks, &seen, reach);
        let correlations = sums.iter().map(|sum| sum / variance);
        let correlated: Vec<f64> = correlations.take_while(|ring| *ring > INDEPENDENT * RING as f64).collect();
        if correlated.len() < sums.len() || reach >= seen.len() {
            return 1.0 + correlated.iter().sum::<f64>();
        }
        reach *= FARTHER;
    }
}

/// Sums of the products of each point's errors with those of its nearest neighbours, ring by ring, as far as to the `reach`-th neighbour.
fn rings(bundle: &Bundle, tracks: &[Errors], seen: &[usize], reach: usize) -> Vec<f64> {
    let of_point = |&point: &usize| -> Vec<f64> {
        let others = nearest(bundle, point, seen, reach);
        others
            .chunks(RING)
            .map(|ring| ring.iter().map(|&other| product(&tracks[point], &tracks[other])).sum())
            .collect()
    };
    let all: Vec<Vec<f64>> = seen.par_iter().map(of_point).collect();
    (0..all.first().map_or(0, Vec::len)).map(|ring| all.iter().map(|sums| sums[ring]).sum()).collect()
}

/// So many of the other points that are seen, the nearest first.
fn nearest(bundle: &Bundle, point: usize, seen: &[usize], count: usize) -> Vec<usize> {
    let distance = |other: usize| (bundle.points[other] - bundle.points[point]).norm_squared();
    let others = seen.iter().filter(|&&other| other != point);
    let mut others: Vec<(f64, usize)> = others.map(|&other| (distance(other), other)).collect();
    let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    if count < others.len() {
        others.select_nth_unstable_by(count, order);
        others.truncate(count);
    }
    others.sort_unstable_by(order);
    others.into_iter().map(|(_, other)| other).collect()
}

/// Sum of the products of two points' errors in the frames that see both.
fn product(a: &Errors, b: &Errors) -> f64 {
    let (mut sum, mut others) = (0.0, b.iter().peekable());
    for (frame, error) in a {
        while others.next_if(|(other, _)| other < frame).is_some() {}
        sum += others.peek().filter(|(other, _)| other == frame).map_or(0.0, |(_, other)| error.dot(other));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use geometry::{Camera, Transform, Vec3};
    use synthetic::Random;

    /// A point straight ahead in many frames, seen where errors put it that keep `memory` of themselves from frame to frame.
    fn seen(memory: f64, sigma_px: f64) -> Bundle {
        let (frames, points) = (60, 300);
        let camera = Camera::centred(640, 480, 500.0);
        let (pose, point) = (Transform::identity(), Vec3::new(0.0, 0.0, 0.5));
        let at = camera.project(&point).unwrap();
        let mut random = Random::new(3);
        let mut observations = Vec::new();
        for point in 0..points {
            let mut error = random.normal2(1.0);
            for frame in 0..frames {
                observations.push(Observation { frame, point, pixel: at + error * sigma_px, sigma_px: 0.2 });
                error = error * memory + random.normal2((1.0 - memory * memory).sqrt());
            }
        }
        Bundle { camera, poses: vec![pose; frames], points: vec![point; points], observations }
    }

    #[test]
    fn errors_that_stay_alike_count_as_fewer_frames() {
        // The autocorrelation time of an autoregressive error is (1 + memory) / (1 − memory).
        for (memory, time) in [(0.0, 1.0), (0.5, 3.0), (0.8, 9.0)] {
            let found = variance_inflation(&seen(memory, 0.2), Loss::Squared);
            assert!((found / time - 1.0).abs() < 0.15, "{found} instead of {time}");
        }
        let found = variance_inflation(&seen(0.0, 0.6), Loss::Squared);
        assert!((found / 9.0 - 1.0).abs() < 0.15, "{found} for three times the noise");
    }

    /// Points in the plane before the camera in so many groups apart from each other, whose points err alike.
    fn grouped(groups: usize, size: usize) -> Bundle {
        let alone = seen(0.0, 0.2);
        let middle = |group: usize| 0.01 * Vec3::new((group % 6) as f64, (group / 6) as f64, 50.0);
        let place = |point: usize| middle(point / size) + 1e-4 * Vec3::new((point % size) as f64, 0.0, 0.0);
        let points: Vec<Vec3> = (0..groups * size).map(place).collect();
        let mut random = Random::new(4);
        let mut observations = Vec::new();
        for frame in 0..alone.poses.len() {
            let errors: Vec<Vec2> = (0..groups).map(|_| random.normal2(0.2)).collect();
            for (point, place) in points.iter().enumerate() {
                let pixel = alone.camera.project(place).unwrap() + errors[point / size];
                observations.push(Observation { frame, point, pixel, sigma_px: 0.2 });
            }
        }
        Bundle { points, observations, ..alone }
    }

    #[test]
    fn neighbours_that_err_alike_count_as_one_point() {
        for size in [1, 3, 10] {
            let found = variance_inflation(&grouped(30, size), Loss::Squared);
            assert!((found / size as f64 - 1.0).abs() < 0.15, "{found} for groups of {size}");
        }
    }

    #[test]
    fn perfect_and_missing_observations_count_as_announced() {
        assert_eq!(variance_inflation(&seen(0.5, 0.0), Loss::Squared), 1.0);
        let none = Bundle { observations: Vec::new(), ..seen(0.0, 0.2) };
        assert_eq!(variance_inflation(&none, Loss::Squared), 1.0);
    }
}
