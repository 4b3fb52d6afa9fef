//! Boards rendered by ray casting, and the rendered films of the shared data where they are there.

use super::scene::Scene;
use super::*;
use geometry::{Camera, Transform, Vec3};
use std::path::PathBuf;

/// Inner corners of the scenes' board.
fn board() -> Board {
    Board::checkerboard(9, 6, 0.0255)
}

fn webcam() -> Camera {
    Camera { fy: 515.0, cx: 205.3, cy: 147.8, k1: -0.2, k2: 0.1, ..Camera::centred(400, 300, 520.0) }
}

/// Root mean square distance of the corners seen from where they are.
fn rms(found: &BoardCorners, truth: &[Vec2]) -> f64 {
    let sum: f64 = found.corners.iter().map(|c| (c.position - truth[c.index]).norm_squared()).sum();
    (sum / found.corners.len() as f64).sqrt()
}

fn find(image: &GrayImage) -> Result<BoardCorners, BoardError> {
    detect(image, &[board()], &BoardOptions::default())
}

/// Root mean square error of the corners found in a rendered scene, pixels.
fn error(scene: &Scene) -> f64 {
    let found = find(&scene.render(1)).unwrap();
    assert_eq!(found.corners.len(), 54);
    rms(&found, &scene.corners())
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
    let truth = scene.corners();
    let ratio = |c: &BoardCorner| (c.position - truth[c.index]).norm_squared() / (2.0 * c.sigma_px.powi(2));
    let mean = found.corners.iter().map(ratio).sum::<f64>() / found.corners.len() as f64;
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
        let error = rms(&found, &scene.corners());
        println!("{name}: {error:.4} px, blur {:.2}", found.blur_px);
        assert!(error < limit, "{name}: {error}");
    }
}

#[test]
fn large_pictures_are_searched_from_coarse_to_fine() {
    let camera = Camera { cx: 401.0, cy: 297.0, k1: -0.1, ..Camera::centred(800, 600, 1000.0) };
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
        let asked = [Board::checkerboard(columns, rows, 0.0255)];
        let wrong = detect(&image, &asked, &BoardOptions::default());
        let expected = BoardError::WrongSize { asked: Asked(asked.to_vec()), found: board() };
        assert_eq!(wrong, Err(expected), "{columns}x{rows}");
    }
    for asked in [Board::checkerboard(2, 6, 0.0255), Board::squares(1, 4, 0.0255, 1.0), Board::squares(3, 4, 0.03, 0.0)]
    {
        let impossible = Err(BoardError::Impossible { asked: Asked(vec![asked]) });
        assert_eq!(detect(&image, &[asked], &BoardOptions::default()), impossible);
    }
}

#[test]
fn a_board_written_rows_first_is_the_same_board_turned() {
    let scene = Scene::new(webcam(), [0.2, 0.1, 0.1], 0.5);
    let image = scene.render(1);
    let wide = find(&image).unwrap();
    let tall = detect(&image, &[Board::checkerboard(6, 9, 0.0255)], &BoardOptions::default()).unwrap();
    // The square before a corner is black at both ends of a column of six only for the corner after a quarter turn.
    let ends = [wide.corners[8], wide.corners[5 * 9]];
    assert!(ends.iter().any(|c| (c.position - tall.corners[0].position).norm() < 0.01), "{:?}", tall.corners[0]);
}

#[test]
fn the_part_of_a_board_that_is_in_the_picture_is_measured() {
    for (aside, down) in [(0.11, 0.0), (-0.12, 0.0), (0.0, 0.09), (0.0, -0.09)] {
        let mut scene = Scene::new(webcam(), [0.1, 0.2, 0.1], 0.5);
        scene.cam_from_board.translation += Vec3::new(aside, down, 0.0);
        let found = find(&scene.render(1)).unwrap();
        assert!((20..54).contains(&found.corners.len()) && found.oriented, "{}", found.corners.len());
        let error = rms(&found, &scene.corners());
        assert!(error < 0.03, "{aside} {down}: {error}");
    }
}

#[test]
fn a_part_that_could_be_any_is_not_measured() {
    let mut scene = Scene::new(webcam(), [0.1, 0.2, 0.1], 0.2);
    scene.cam_from_board.translation.x += 0.01;
    let error = find(&scene.render(1)).unwrap_err();
    assert!(matches!(error, BoardError::NotWhole { .. }), "{error}");
}

#[test]
fn covered_corners_are_left_out() {
    let covered = Scene { thumb: 0.8, ..Scene::new(webcam(), [0.1, 0.2, 0.1], 0.5) };
    let found = find(&covered.render(1)).unwrap();
    assert!((45..54).contains(&found.corners.len()), "{}", found.corners.len());
    assert!(rms(&found, &covered.corners()) < 0.05);
}

#[test]
fn a_hand_over_one_end_of_a_board_that_leaves_the_picture_is_no_end_of_the_board() {
    let mut scene = Scene::new(webcam(), [0.1, 0.1, 0.05], 0.5);
    scene.cam_from_board.translation.x += 0.11;
    // The picture shows columns 0 to 5; a stripe covers the first ones.
    let mut image = scene.render(1);
    let edge = scene.corners()[2].x - 8.0;
    for (x, _, pixel) in image.enumerate_pixels_mut() {
        if f64::from(x) < edge {
            *pixel = image::Luma([120]);
        }
    }
    let error = find(&image).unwrap_err();
    assert!(matches!(error, BoardError::NotWhole { .. }), "{error}");
}

#[test]
fn boards_of_many_corners_and_such_that_touch_the_border_are_found() {
    let near = Camera { cx: 300.0, cy: 225.0, k1: -0.1, ..Camera::centred(600, 450, 700.0) };
    let many = Board::checkerboard(13, 12, 0.015);
    for (board, angles, distance) in [
        (many, [0.2, -0.2, 0.1], 0.42),
        (Board::checkerboard(8, 6, 0.03), [0.02, 0.01, 0.0], 0.301),
        (Board::checkerboard(3, 3, 0.03), [0.5, 0.3, 1.0], 0.3),
    ] {
        let scene = Scene::of(board, near, angles, distance);
        let found =
            detect(&scene.render(1), &[board], &BoardOptions { min_corners: 9, ..BoardOptions::default() }).unwrap();
        assert_eq!(found.corners.len(), board.points().len(), "{board}");
        let truth = scene.corners();
        let sum = |order: &dyn Fn(usize) -> usize| -> f64 {
            found.corners.iter().map(|c| (c.position - truth[order(c.index)]).norm_squared()).sum()
        };
        let squares = sum(&|k| k).min(sum(&|k| truth.len() - 1 - k));
        let error = (squares / truth.len() as f64).sqrt();
        assert!(error < 0.04, "{board}: {error}");
    }
}

#[test]
fn of_several_boards_the_one_shown_is_found() {
    let image = Scene::new(webcam(), [0.1, -0.1, 0.05], 0.5).render(1);
    let boards =
        [Board::checkerboard(8, 6, 0.02), Board::squares(4, 3, 0.02, 1.0), board(), Board::checkerboard(12, 13, 0.02)];
    let found = detect(&image, &boards, &BoardOptions::default()).unwrap();
    assert_eq!((found.board, found.corners.len()), (2, 54));
}

#[test]
fn pictures_without_a_board_have_none() {
    let mut scene = Scene::new(webcam(), [0.1, 0.2, 0.1], 0.5);
    scene.cam_from_board.translation.x += 5.0;
    for image in [scene.render(1), GrayImage::new(320, 240), GrayImage::new(1, 1), GrayImage::new(0, 0)] {
        assert_eq!(find(&image), Err(BoardError::NotFound { asked: Asked(vec![board()]) }));
    }
    let mut random = synthetic::Random::new(1);
    let noise = GrayImage::from_fn(320, 240, |_, _| image::Luma([(random.uniform() * 255.0) as u8]));
    assert_eq!(find(&noise), Err(BoardError::NotFound { asked: Asked(vec![board()]) }));
}

#[test]
fn one_thread_gives_the_same_bytes() {
    let image = Scene::new(webcam(), [0.2, 0.1, 0.1], 0.5).render(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(find(&image), pool.install(|| find(&image)));
}

#[test]
fn marked_boards_are_read_from_their_mark() {
    for (board, angle) in [
        (Board::checkerboard(8, 6, 0.0255), 0.1),
        (Board::checkerboard(8, 6, 0.0255), 3.2),
        (Board::checkerboard(7, 5, 0.0255), -3.0),
        (Board::squares(4, 3, 0.03, 1.0), 3.0),
        (Board::squares(4, 4, 0.03, 0.5), 1.6),
    ] {
        let marked = Scene::of(board, webcam(), [0.2, 0.3, angle], 0.5);
        let found =
            detect(&Scene { marked: true, ..marked.clone() }.render(1), &[board], &BoardOptions::default()).unwrap();
        assert!(found.oriented, "{board} {angle}");
        let error = rms(&found, &marked.corners());
        assert!(error < 0.05, "{board} {angle}: {error}");
        let plain = detect(&marked.render(1), &[board], &BoardOptions::default()).unwrap();
        assert!(!plain.oriented, "{board} {angle}");
    }
}

#[test]
fn separate_squares_are_measured_like_a_checkerboard() {
    let board = Board::squares(4, 3, 0.03, 1.0);
    for angles in [[0.1, -0.1, 0.05], [0.5, 0.3, 0.4], [-0.4, 0.6, -0.3], [0.0, 1.0, 0.0]] {
        let scene = Scene::of(board, webcam(), angles, 0.55);
        let found = detect(&scene.render(1), &[board], &BoardOptions::default()).unwrap();
        assert_eq!(found.corners.len(), 48);
        let error = rms(&found, &scene.corners());
        assert!(error < 0.06, "{angles:?}: {error}");
    }
}

#[test]
fn a_part_of_separate_squares_is_measured_and_another_number_is_named() {
    let board = Board::squares(4, 3, 0.03, 1.0);
    let mut scene = Scene { margin: 2.0, ..Scene::of(board, webcam(), [0.1, -0.2, 0.05], 0.55) };
    let image = scene.render(1);
    let error = detect(&image, &[Board::squares(3, 3, 0.03, 1.0)], &BoardOptions::default()).unwrap_err();
    assert!(error.to_string().contains("found a board of 4x3 squares, asked for 3x3 squares"), "{error}");
    let several = [Board::checkerboard(9, 6, 0.03), Board::squares(4, 3, 0.03, 0.5), board];
    assert_eq!(detect(&image, &several, &BoardOptions::default()).unwrap().board, 2);
    scene.cam_from_board.translation.x += 0.13;
    let mut image = scene.render(1);
    let found = detect(&image, &[board], &BoardOptions::default()).unwrap();
    assert!((20..48).contains(&found.corners.len()), "{}", found.corners.len());
    let truth = scene.corners();
    let turned = |c: &BoardCorner| (c.position - truth[truth.len() - 1 - c.index]).norm();
    let straight = |c: &BoardCorner| (c.position - truth[c.index]).norm();
    let worst = |of: &dyn Fn(&BoardCorner) -> f64| found.corners.iter().map(of).fold(0.0, f64::max);
    assert!(worst(&straight).min(worst(&turned)) < 0.3, "{}", worst(&straight));
    // Something grey before the first squares.
    let edge = truth[2].x - 10.0;
    for (x, _, pixel) in image.enumerate_pixels_mut() {
        if f64::from(x) < edge {
            *pixel = image::Luma([100]);
        }
    }
    let error = detect(&image, &[board], &BoardOptions::default()).unwrap_err();
    assert!(matches!(error, BoardError::NotWhole { .. } | BoardError::NotFound { .. }), "{error}");
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
        sum += rms(&find(&image).unwrap(), &expected).powi(2);
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
