//! Boards rendered by ray casting, and the rendered films of the shared data where they are there.

use super::scene::Scene;
use super::*;
use geometry::{Camera, Transform, Vec3};
use std::path::PathBuf;

const SIZE: BoardSize = BoardSize { columns: 9, rows: 6 };

fn webcam() -> Camera {
    Camera { width: 400, height: 300, fx: 520.0, fy: 515.0, cx: 205.3, cy: 147.8, k1: -0.2, k2: 0.1 }
}

fn rms(found: &[Vec2], truth: &[Vec2]) -> f64 {
    let sum: f64 = found.iter().zip(truth).map(|(a, b)| (a - b).norm_squared()).sum();
    (sum / truth.len() as f64).sqrt()
}

fn find(image: &GrayImage) -> Result<BoardCorners, BoardError> {
    detect(image, SIZE, &BoardOptions::default())
}

/// Root mean square error of the corners found in a rendered scene, pixels.
fn error(scene: &Scene) -> f64 {
    rms(&find(&scene.render(1)).unwrap().corners, &scene.corners())
}

#[test]
fn corners_are_within_hundredths_of_a_pixel_in_the_board_s_order() {
    for angles in [[0.1, -0.1, 0.05], [0.5, 0.3, 0.4], [-0.4, 0.6, 2.0], [0.2, -0.5, 3.1], [0.1, 0.3, -1.6]] {
        let scene = Scene::new(webcam(), angles, 0.5);
        let error = error(&scene);
        assert!(error < 0.03, "{angles:?}: {error}");
    }
}

#[test]
fn stated_deviations_cover_the_errors() {
    let scene = Scene { noise: 5.0, ..Scene::new(webcam(), [0.3, 0.4, 0.2], 0.5) };
    let found = find(&scene.render(3)).unwrap();
    let squares: Vec<f64> = found.corners.iter().zip(scene.corners()).map(|(a, b)| (a - b).norm_squared()).collect();
    let mean = squares.iter().zip(&found.sigma_px).map(|(e, s)| e / (2.0 * s * s)).sum::<f64>() / squares.len() as f64;
    assert!((0.2..2.0).contains(&mean), "errors are {mean} variances");
}

#[test]
fn tilted_small_blurred_noisy_and_dim_boards_are_found() {
    let near = |angles| Scene::new(webcam(), angles, 0.5);
    let tilted = near([0.0, 1.05, 0.0]);
    let small = Scene::new(webcam(), [0.2, 0.1, 0.1], 1.5);
    let blurred = Scene { blur: 3.0, ..near([0.2, 0.2, 0.2]) };
    let noisy = Scene { noise: 15.0, ..near([0.2, -0.3, 0.2]) };
    let dim = Scene { falloff: 0.95, ..near([-0.2, 0.3, 0.0]) };
    for (name, scene, limit) in [
        ("tilted", tilted, 0.05),
        ("small", small, 0.06),
        ("blurred", blurred, 0.08),
        ("noisy", noisy, 0.12),
        ("dim", dim, 0.05),
    ] {
        let found = find(&scene.render(2)).unwrap_or_else(|e| panic!("{name}: {e}"));
        let error = rms(&found.corners, &scene.corners());
        println!("{name}: {error:.4} px, blur {:.2}", found.blur_px);
        assert!(error < limit, "{name}: {error}");
    }
}

#[test]
fn large_pictures_are_searched_from_coarse_to_fine() {
    let camera = Camera { width: 800, height: 600, fx: 1000.0, fy: 1000.0, cx: 401.0, cy: 297.0, k1: -0.1, k2: 0.0 };
    for distance in [0.5, 2.4] {
        let scene = Scene { blur: 1.0, ..Scene::new(camera, [0.3, 0.3, 0.1], distance) };
        let error = error(&scene);
        assert!(error < 0.03, "{distance} m: {error}");
    }
}

#[test]
fn another_size_is_named() {
    let image = Scene::new(webcam(), [0.2, 0.1, 0.1], 0.5).render(1);
    for (columns, rows) in [(8, 6), (9, 5), (7, 7), (10, 7)] {
        let asked = BoardSize { columns, rows };
        let wrong = detect(&image, asked, &BoardOptions::default());
        assert_eq!(wrong, Err(BoardError::WrongSize { asked, found: SIZE }), "{asked}");
    }
    let asked = BoardSize { columns: 2, rows: 6 };
    assert_eq!(detect(&image, asked, &BoardOptions::default()), Err(BoardError::InvalidSize { asked }));
}

#[test]
fn a_board_written_rows_first_is_the_same_board_turned() {
    let scene = Scene::new(webcam(), [0.2, 0.1, 0.1], 0.5);
    let image = scene.render(1);
    let wide = find(&image).unwrap();
    let tall = detect(&image, BoardSize { columns: 6, rows: 9 }, &BoardOptions::default()).unwrap();
    // The square before a corner is black at both ends of a column of six only for the corner after a quarter turn.
    let last_of_first_column = wide.corners[5 * 9];
    let corners = [wide.corners[8], last_of_first_column];
    assert!(corners.iter().any(|c| (c - tall.corners[0]).norm() < 0.01), "{:?}", tall.corners[0]);
}

#[test]
fn boards_that_leave_the_picture_or_are_covered_are_not_whole() {
    let mut scene = Scene::new(webcam(), [0.1, 0.2, 0.1], 0.5);
    scene.cam_from_board.translation.x += 0.11;
    assert!(matches!(find(&scene.render(1)), Err(BoardError::NotWhole { .. })), "{:?}", find(&scene.render(1)));
    let covered = Scene { thumb: 0.8, ..Scene::new(webcam(), [0.1, 0.2, 0.1], 0.5) };
    let error = find(&covered.render(1)).unwrap_err();
    assert!(matches!(error, BoardError::NotWhole { .. } | BoardError::UnclearCorner { .. }), "{error}");
}

#[test]
fn pictures_without_a_board_have_none() {
    let mut scene = Scene::new(webcam(), [0.1, 0.2, 0.1], 0.5);
    scene.cam_from_board.translation.x += 5.0;
    for image in [scene.render(1), GrayImage::new(320, 240), GrayImage::new(1, 1), GrayImage::new(0, 0)] {
        assert_eq!(find(&image), Err(BoardError::NotFound { asked: SIZE }));
    }
    let mut random = synthetic::Random::new(1);
    let noise = GrayImage::from_fn(320, 240, |_, _| image::Luma([(random.uniform() * 255.0) as u8]));
    assert_eq!(find(&noise), Err(BoardError::NotFound { asked: SIZE }));
}

#[test]
fn one_thread_gives_the_same_bytes() {
    let image = Scene::new(webcam(), [0.2, 0.1, 0.1], 0.5).render(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(find(&image), pool.install(|| find(&image)));
}

/// Root mean square error over all boards of a rendered film against its truth; `None`, and a word, without the data.
fn film_error(folder: &str) -> Option<f64> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(folder);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    let truth: serde_json::Value = serde_json::from_slice(&std::fs::read(path.join("truth.json")).unwrap()).unwrap();
    let camera: Camera = serde_json::from_value(truth["camera"].clone()).unwrap();
    let points: Vec<[f64; 3]> = serde_json::from_value(truth["board"]["points"].clone()).unwrap();
    let (mut sum, mut count) = (0.0, 0);
    for board in truth["boards"].as_array().unwrap() {
        let pose: Transform = serde_json::from_value(board["cam_from_board"].clone()).unwrap();
        let image = image::open(path.join(board["file"].as_str().unwrap())).unwrap().to_luma8();
        let expected: Vec<Vec2> =
            points.iter().map(|&p| camera.project(&pose.apply(&Vec3::from(p))).unwrap()).collect();
        sum += rms(&find(&image).unwrap().corners, &expected).powi(2);
        count += 1;
    }
    Some((sum / f64::from(count)).sqrt())
}

#[test]
fn rendered_films_are_measured_within_three_hundredths_of_a_pixel() {
    for folder in ["james-cif", "james-720"] {
        if let Some(error) = film_error(folder) {
            println!("{folder}: {error:.4} px");
            assert!(error < 0.03, "{folder}: {error} px");
        }
    }
}
