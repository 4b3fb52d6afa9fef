//! Analytic pictures, warped analytically: nothing here interpolates.

use super::*;
use crate::corners::{CornerOptions, detect};
use image::{GrayImage, Luma};

const WIDTH: u32 = 200;
const HEIGHT: u32 = 160;

/// A smooth texture with something at every scale, wavelengths of 10 to 80 pixels.
fn texture(at: Vec2) -> f64 {
    let wave = |k: u32| {
        let (length, turn) = (10.0 * 1.26_f64.powi(k as i32), 2.4 * f64::from(k));
        let phase = std::f64::consts::TAU / length * (turn.cos() * at.x + turn.sin() * at.y);
        12.0 * (phase + f64::from(k * k)).sin()
    };
    125.0 + (0..10).map(wave).sum::<f64>()
}

fn picture(grey: impl Fn(Vec2) -> f64) -> Pyramid {
    let pixel = |x: u32, y: u32| Luma([grey(Vec2::new(f64::from(x), f64::from(y))).round().clamp(0.0, 255.0) as u8]);
    Pyramid::new(&GrayImage::from_fn(WIDTH, HEIGHT, pixel), 4)
}

/// A standard normal deviate that depends on the seed alone.
fn normal(seed: u64) -> f64 {
    let uniform = |k: u64| {
        let mut z = seed.wrapping_mul(2).wrapping_add(k).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    };
    (-2.0 * (1.0 - uniform(0)).ln()).sqrt() * (std::f64::consts::TAU * uniform(1)).cos()
}

fn noise(at: Vec2, seed: u64) -> f64 {
    normal(seed * 1_000_003 + at.y as u64 * 1000 + at.x as u64)
}

/// Seventy corners of the texture, far enough inside the frame.
fn corners() -> Vec<Vec2> {
    let options = CornerOptions { max_count: 70, border: 33, min_distance: 6.0, ..Default::default() };
    let corners = detect(&picture(texture), None, &options).unwrap();
    assert_eq!(corners.len(), 70);
    corners.iter().map(|corner| corner.position).collect()
}

/// Root mean square and largest distance to the truth; every point must be found.
fn errors(tracks: &[Track], truth: impl Fn(usize) -> Vec2) -> (f64, f64) {
    let distance = |(i, track): (usize, &Track)| {
        assert_eq!(track.status, Status::Found, "point {i}");
        (track.position - truth(i)).norm()
    };
    let all: Vec<f64> = tracks.iter().enumerate().map(distance).collect();
    ((all.iter().map(|e| e * e).sum::<f64>() / all.len() as f64).sqrt(), all.iter().copied().fold(0.0, f64::max))
}

#[test]
fn shifts_are_found_to_a_fiftieth_of_a_pixel() {
    let (a, points) = (picture(texture), corners());
    for shift in [Vec2::new(0.3, -0.2), Vec2::new(3.7, 2.45), Vec2::new(-11.5, 7.25)] {
        let b = picture(|at| texture(at - shift));
        let options = TrackOptions { window: 21, ..Default::default() };
        let tracks = track(&a, &b, &points, None, &options).unwrap();
        let (rms, largest) = errors(&tracks, |i| points[i] + shift);
        assert!(rms < 0.01 && largest < 0.02, "{shift:?}: rms {rms}, largest {largest}");
    }
}

#[test]
fn the_papers_tracker_finds_shifts() {
    let (a, points, shift) = (picture(texture), corners(), Vec2::new(5.3, -3.6));
    let b = picture(|at| texture(at - shift));
    for window in [7, 9, 21] {
        let tracks = track(&a, &b, &points, None, &TrackOptions::paper(window)).unwrap();
        let (rms, largest) = errors(&tracks, |i| points[i] + shift);
        assert!(rms < 0.05 && largest < 0.15, "window {window}: rms {rms}, largest {largest}");
    }
}

/// The map from `a` to `b` about the middle of the picture, and its picture.
fn turned(warp: Matrix2<f64>, gain: f64, bias: f64) -> (impl Fn(Vec2) -> Vec2, Pyramid) {
    let (middle, shift) = (Vec2::new(100.0, 80.0), Vec2::new(2.3, -1.4));
    let back = warp.try_inverse().unwrap();
    let b = picture(move |at| gain * texture(middle + back * (at - middle - shift)) + bias);
    (move |at| middle + shift + warp * (at - middle), b)
}

#[test]
fn affine_warps_and_gain_are_found_to_a_fiftieth_of_a_pixel() {
    let warp = Matrix2::new(0.93, 0.05, -0.04, 1.04);
    let (map, b) = turned(warp, 0.8, 15.0);
    let (a, points) = (picture(texture), corners());
    let options = TrackOptions { window: 21, ..Default::default() };
    let tracks = track(&a, &b, &points, None, &options).unwrap();
    let (rms, largest) = errors(&tracks, |i| map(points[i]));
    assert!(rms < 0.01 && largest < 0.02, "rms {rms}, largest {largest}");
    assert!(tracks.iter().all(|track| (track.warp - warp).norm() < 0.02));
}

#[test]
fn a_guessed_warp_reaches_what_a_shift_cannot() {
    let warp = Matrix2::new(0.55, 0.10, 0.05, 1.05);
    let (map, b) = turned(warp, 1.0, 0.0);
    let (a, points) = (picture(texture), corners());
    let expected = Matrix2::new(0.6, 0.05, 0.0, 1.0);
    let guesses: Vec<_> =
        points.iter().map(|&p| Guess { position: map(p) + Vec2::new(0.8, -0.7), warp: expected }).collect();
    let options = TrackOptions { window: 15, levels: 1, ..Default::default() };
    let tracks = track(&a, &b, &points, Some(&guesses), &options).unwrap();
    let (rms, largest) = errors(&tracks, |i| map(points[i]));
    assert!(rms < 0.02 && largest < 0.05, "rms {rms}, largest {largest}");
    let ignorant = track(&a, &b, &points, None, &TrackOptions::default()).unwrap();
    let found = |t: &&Track| t.status == Status::Found;
    assert!(ignorant.iter().filter(found).count() < points.len() / 2);
}

#[test]
fn the_standard_deviation_is_the_error_under_noise() {
    let (shift, points) = (Vec2::new(2.6, -1.3), corners());
    for (model, window) in [(Model::Translation, 7), (Model::Translation, 15), (Model::Affine, 15), (Model::Affine, 21)]
    {
        let options = TrackOptions { model, window, ..Default::default() };
        let (mut normalised, mut rms, mut count) = (0.0, 0.0, 0.0);
        for seed in 0..4 {
            let a = picture(|at| texture(at) + 2.0 * noise(at, 2 * seed));
            let b = picture(|at| texture(at - shift) + 2.0 * noise(at, 2 * seed + 1));
            for (track, point) in track(&a, &b, &points, None, &options).unwrap().iter().zip(&points) {
                if track.status != Status::Found {
                    continue;
                }
                let error = (track.position - point - shift).norm_squared() / 2.0;
                normalised += error / track.sigma_px.powi(2);
                rms += error;
                count += 1.0;
            }
        }
        assert!(count > 0.97 * 4.0 * points.len() as f64, "{model:?} {window}: {count} found");
        let (ratio, rms): (f64, f64) = ((normalised / count).sqrt(), (rms / count).sqrt());
        assert!((0.75..1.35).contains(&ratio), "{model:?} {window}: {ratio} of the deviation, rms {rms} px");
    }
}

#[test]
fn identical_frames_do_not_move_a_point() {
    let (a, points) = (picture(texture), corners());
    for options in [TrackOptions::default(), TrackOptions::paper(7)] {
        let (_, largest) = errors(&track(&a, &a, &points, None, &options).unwrap(), |i| points[i]);
        assert!(largest < 1e-3, "{largest}");
    }
}

#[test]
fn no_texture_an_edge_and_mere_noise_are_low_texture() {
    let points = corners();
    let edge = |at: Vec2| 120.0 + 80.0 * (0.3 * (at.x + 0.5 * at.y)).sin();
    let flat = |_: Vec2| 120.0;
    let refused = |a: &Pyramid, b: &Pyramid, options: &TrackOptions| {
        let tracks = track(a, b, &points, None, options).unwrap();
        tracks.iter().filter(|track| track.status != Status::Found).count()
    };
    for options in [TrackOptions::default(), TrackOptions::paper(7)] {
        assert_eq!(refused(&picture(flat), &picture(flat), &options), points.len());
    }
    let options = TrackOptions::default();
    assert_eq!(refused(&picture(edge), &picture(edge), &options), points.len());
    let noisy = |grey: fn(Vec2) -> f64, seed| picture(move |at| grey(at) + 2.0 * noise(at, seed));
    for grey in [edge as fn(Vec2) -> f64, flat] {
        let count = refused(&noisy(grey, 1), &noisy(grey, 2), &options);
        assert!(count as f64 > 0.95 * points.len() as f64, "{count}");
    }
}

#[test]
fn points_that_leave_or_touch_the_frame_are_out_of_frame() {
    let (a, shift) = (picture(texture), Vec2::new(12.0, 0.0));
    let b = picture(|at| texture(at - shift));
    let points = [Vec2::new(185.0, 80.0), Vec2::new(3.0, 80.0), Vec2::new(-20.0, 5.0), Vec2::new(f64::NAN, 5.0)];
    for track in track(&a, &b, &points, None, &TrackOptions::default()).unwrap() {
        assert_eq!(track.status, Status::OutOfFrame);
    }
    let small = Pyramid::new(&GrayImage::from_fn(12, 12, |x, y| Luma([(x * y) as u8])), 4);
    let options = TrackOptions { window: 21, ..Default::default() };
    for size in [small, Pyramid::new(&GrayImage::new(0, 0), 2)] {
        let tracks = track(&size, &size, &[Vec2::new(6.0, 6.0)], None, &options).unwrap();
        assert_eq!(tracks[0].status, Status::OutOfFrame);
    }
}

#[test]
fn another_picture_is_not_found() {
    let (a, points) = (picture(texture), corners());
    let b = picture(|at| texture(Vec2::new(at.y * 1.7 + 40.0, at.x * 0.8)));
    let tracks = track(&a, &b, &points, None, &TrackOptions::default()).unwrap();
    let found = tracks.iter().filter(|track| track.status == Status::Found).count();
    assert!(found * 10 < points.len(), "{found}");
    let strict = TrackOptions { max_residual: Some(1e-6), ..Default::default() };
    let shifted = picture(|at| texture(at - Vec2::new(0.4, 0.3)));
    assert!(track(&a, &shifted, &points, None, &strict).unwrap().iter().all(|t| t.status == Status::Dissimilar));
}

#[test]
fn one_thread_and_four_give_the_same_bytes() {
    let (map, b) = turned(Matrix2::new(0.95, 0.02, 0.0, 1.0), 1.0, 0.0);
    let (a, points) = (picture(texture), corners());
    let guesses: Vec<_> = points.iter().map(|&p| Guess::at(map(p))).collect();
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| track(&a, &b, &points, Some(&guesses), &TrackOptions::default()).unwrap())
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn windows_and_guesses_that_do_not_fit_are_refused() {
    let a = picture(texture);
    for window in [0, 1, 8, 33] {
        let options = TrackOptions { window, ..Default::default() };
        assert_eq!(track(&a, &a, &[], None, &options), Err(TrackError::Window(window)));
    }
    for sigma in [0.0, -0.5, f64::INFINITY] {
        let options = TrackOptions { window_sigma: Some(sigma), ..Default::default() };
        assert_eq!(track(&a, &a, &[], None, &options), Err(TrackError::WindowSigma(sigma)));
    }
    let guesses = [Guess::at(Vec2::zeros())];
    let refused = track(&a, &a, &[], Some(&guesses), &TrackOptions::default());
    assert_eq!(refused, Err(TrackError::Guesses { guesses: 1, points: 0 }));
    let mirrored = [Guess { position: Vec2::new(80.0, 80.0), warp: Matrix2::new(-1.0, 0.0, 0.0, 1.0) }];
    let tracks = track(&a, &a, &[Vec2::new(80.0, 80.0)], Some(&mirrored), &TrackOptions::default()).unwrap();
    assert_eq!(tracks[0].status, Status::NotConverged);
}

#[test]
fn both_updates_and_weights_agree_on_shifts_at_odd_sizes() {
    let (a, points, shift) = (picture(texture), corners(), Vec2::new(3.3, -2.6));
    let b = picture(|at| texture(at - shift));
    let guesses: Vec<_> = points.iter().map(|p| Guess::at(p + shift + Vec2::new(0.7, -0.6))).collect();
    // Weighed, a window holds as much as a plain one of half its side.
    for (window, weighed) in [(7, false), (9, false), (13, true), (17, true), (25, true), (31, true)] {
        for window_sigma in [None, Some(0.5)].into_iter().take(1 + usize::from(weighed)) {
            let [added, composed] = [Update::ForwardAdditive, Update::InverseCompositional].map(|update| {
                // Nothing here is noise, and a shift is all there is: small windows can tell no more.
                let quiet = TrackOptions { model: Model::Translation, noise: 0.0, levels: 1, ..Default::default() };
                let options = TrackOptions { window, window_sigma, update, ..quiet };
                track(&a, &b, &points, Some(&guesses), &options).unwrap()
            });
            let (rms, largest) = errors(&composed, |i| points[i] + shift);
            // Whole grey levels move what small windows find: the limits are those of the paper's tracker.
            let limits = if window < 11 { (0.05, 0.15) } else { (0.02, 0.08) };
            assert!(rms < limits.0 && largest < limits.1, "{window}: rms {rms}, largest {largest}");
            for (added, composed) in added.iter().zip(&composed) {
                assert!((added.position - composed.position).norm() < 0.01, "{window}");
            }
        }
    }
}

#[test]
fn kept_templates_track_as_fresh_ones_do() {
    let (a, points) = (picture(texture), corners());
    let (map, b) = turned(Matrix2::new(1.2, 0.05, 0.0, 1.0), 0.9, 4.0);
    let warp = Matrix2::new(1.18, 0.03, 0.0, 1.0);
    let guesses: Vec<_> = points.iter().map(|&p| Guess { position: map(p) + Vec2::new(1.0, 0.5), warp }).collect();
    for window in [5, 11, 21, 31] {
        for window_sigma in [None, Some(0.5)] {
            let options = TrackOptions { window, window_sigma, ..Default::default() };
            let templates = Templates::take(&a, &points, &options).unwrap();
            assert_eq!(templates.points(), points);
            for (guesses, b) in [(Some(&guesses[..]), &b), (None, &b), (None, &a)] {
                let fresh = track(&a, b, &points, guesses, &options).unwrap();
                assert_eq!(templates.track(b, guesses).unwrap(), fresh, "window {window}");
            }
        }
    }
    let refused = Templates::take(&a, &points, &TrackOptions { window: 4, ..Default::default() });
    assert_eq!(refused.err(), Some(TrackError::Window(4)));
}

#[test]
fn the_correlation_tells_the_same_patch_from_another() {
    let (a, points) = (picture(texture), corners());
    let brighter = picture(|at| 0.7 * texture(at - Vec2::new(1.2, 0.4)) + 30.0);
    let options = TrackOptions { min_ncc: Some(0.95), ..Default::default() };
    for track in track(&a, &brighter, &points, None, &options).unwrap() {
        assert_eq!(track.status, Status::Found);
        assert!(track.ncc > 0.99, "{}", track.ncc);
    }
    let other = picture(|at| texture(Vec2::new(at.y * 1.7 + 40.0, at.x * 0.8)));
    let options = TrackOptions { forward_backward_px: None, ..options };
    let tracks = track(&a, &other, &points, None, &options).unwrap();
    let found = tracks.iter().filter(|track| track.status == Status::Found).count();
    assert!(found * 10 < points.len(), "{found}");
    let early = tracks.iter().filter(|track| track.status == Status::Dissimilar && track.residual.is_infinite());
    assert!(early.count() * 2 > points.len(), "most are given up before their residual is measured");
}

#[test]
fn a_stretched_patch_is_found_at_the_size_it_has_there() {
    let warp = Matrix2::new(1.5, 0.1, -0.05, 1.1);
    let (map, b) = turned(warp, 1.0, 0.0);
    let a = picture(texture);
    let points: Vec<Vec2> = corners().into_iter().filter(|p| (p - Vec2::new(100.0, 80.0)).amax() < 40.0).collect();
    let expected = warp + Matrix2::new(0.03, -0.02, 0.02, -0.03);
    let guesses: Vec<_> =
        points.iter().map(|&p| Guess { position: map(p) + Vec2::new(0.7, -0.6), warp: expected }).collect();
    let options = TrackOptions { window: 15, levels: 1, ..Default::default() };
    let tracks = track(&a, &b, &points, Some(&guesses), &options).unwrap();
    let (rms, largest) = errors(&tracks, |i| map(points[i]));
    assert!(rms < 0.02 && largest < 0.06, "rms {rms}, largest {largest}");
    assert!(tracks.iter().all(|track| (track.warp - warp).norm() < 0.04));
}
