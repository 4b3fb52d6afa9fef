//! Bench of `calibrate`: finding the board in a picture, and the camera from all pictures.

use crate::clock::{median_ms, rms};
use crate::feature::{Feature, Figure};
use crate::files::{read_grey, write_grey};
use crate::results::{Pixel, Run, to_pixels, to_points};
use crate::scenes::{board, clip::Clip};
use geometry::least_squares::Loss;
use geometry::{Board, Camera, Transform, Vec2};
use image::GrayImage;
use motion::calibrate::{BoardView, CalibrateOptions, calibrate};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use synthetic::Random;
use vision::board::{BoardCorners, BoardOptions, detect};

/// Pictures of the computed case.
const VIEWS: usize = 14;
/// Standard deviation of the noise of given corners, pixels along each axis.
const NOISE: f64 = 0.1;
/// The task to solve from given corners.
const CORNERS: &str = "corners";

/// The bench.
pub struct Calibrate;

/// One board before one camera.
#[derive(Serialize, Deserialize)]
pub struct Case {
    name: String,
    pictures: Vec<String>,
    width: u32,
    height: u32,
    inner: (u32, u32),
    square: f64,
    /// All corners in each picture, with noise: what both sides solve from in the task `corners`.
    corners: Vec<Vec<Pixel>>,
}

/// Its truth.
#[derive(Serialize, Deserialize)]
pub struct CaseTruth {
    camera: Camera,
    /// Corners in each picture.
    corners: Vec<Vec<Pixel>>,
}

/// What a side found.
#[derive(Serialize, Deserialize)]
pub struct Answer {
    /// Corners in each picture, in the board's order or from its other end; none where it was not found.
    boards: Vec<Option<Vec<Pixel>>>,
    /// The camera; none without enough boards.
    camera: Option<Camera>,
    /// Root mean square reprojection error, pixels.
    rms_px: Option<f64>,
}

impl Feature for Calibrate {
    type Inputs = Vec<Case>;
    type Truth = Vec<CaseTruth>;
    type Answer = Answer;

    fn inputs(folder: &Path) -> anyhow::Result<(Vec<Case>, Vec<CaseTruth>)> {
        Ok([clip_case(folder)?, computed_case(folder)?].into_iter().unzip())
    }

    fn measure(inputs: &Vec<Case>, folder: &Path) -> anyhow::Result<Vec<Run<Answer>>> {
        let runs = inputs.iter().map(|case| Ok([measure(case, folder)?, solve_corners(case)]));
        Ok(runs.collect::<anyhow::Result<Vec<_>>>()?.into_iter().flatten().collect())
    }

    fn figures(run: &Run<Answer>, inputs: &Vec<Case>, truth: &Vec<CaseTruth>) -> anyhow::Result<Vec<Figure>> {
        let Some(k) = inputs.iter().position(|case| case.name == run.case) else { return Ok(Vec::new()) };
        let (answer, truth) = (&run.answer, &truth[k]);
        let solved = vec![
            Figure::cost("solve, ms", run.time("solve")),
            Figure::cost("focal length error, %", focal_error(answer, truth)),
        ];
        if run.task == CORNERS {
            let rms = Figure::cost("reprojection, px RMS", answer.rms_px.unwrap_or(f64::NAN));
            return Ok(solved.into_iter().chain([rms]).collect());
        }
        Ok(vec![
            Figure::cost("find, ms per picture", run.time("find")),
            Figure::gain("boards found, %", found_percent(answer)),
            Figure::cost("corner error, px RMS", rms(&corner_errors(answer, truth))),
        ]
        .into_iter()
        .chain(solved)
        .collect())
    }
}

fn clip_case(folder: &Path) -> anyhow::Result<(Case, CaseTruth)> {
    let clip = Clip::open()?;
    let poses: Vec<Transform> = clip.boards.iter().map(|b| b.cam_from_board).collect();
    let pictures = (0..poses.len()).map(|i| clip.board(i)).collect::<anyhow::Result<Vec<_>>>()?;
    case("clip", folder, clip.camera, &poses, &pictures, (clip.board.inner_corners, clip.board.square_m))
}

fn computed_case(folder: &Path) -> anyhow::Result<(Case, CaseTruth)> {
    let camera = Camera { fy: 1102.0, cx: 642.8, cy: 357.4, k1: -0.12, k2: 0.06, ..Camera::centred(1280, 720, 1100.0) };
    let poses: Vec<Transform> = (0..VIEWS).map(|i| board::pose(i, 0.4)).collect();
    let pictures: Vec<GrayImage> =
        poses.iter().enumerate().map(|(i, pose)| board::picture(&camera, pose, i as u64)).collect();
    case("720p", folder, camera, &poses, &pictures, (board::INNER, board::SQUARE))
}

fn case(
    name: &str,
    folder: &Path,
    camera: Camera,
    poses: &[Transform],
    pictures: &[GrayImage],
    (inner, square): ((u32, u32), f64),
) -> anyhow::Result<(Case, CaseTruth)> {
    let names: Vec<String> = (0..pictures.len()).map(|i| format!("{name}_{i}.png")).collect();
    for (file, picture) in names.iter().zip(pictures) {
        write_grey(&folder.join(file), picture)?;
    }
    let board = board::corners(inner, square);
    let seen = |pose: &Transform| -> Vec<Vec2> {
        board.iter().filter_map(|p| camera.project(&pose.apply(&p.push(0.0)))).collect()
    };
    let truth = CaseTruth { camera, corners: poses.iter().map(|pose| to_pixels(&seen(pose))).collect() };
    let mut random = Random::new(1);
    let noisy = |pixels: &Vec<Pixel>| -> Vec<Pixel> {
        pixels.iter().map(|p| (Vec2::from(*p) + random.normal2(NOISE)).into()).collect()
    };
    let corners = truth.corners.iter().map(noisy).collect();
    let (width, height) = (camera.width, camera.height);
    Ok((Case { name: name.to_owned(), pictures: names, width, height, inner, square, corners }, truth))
}

fn measure(case: &Case, folder: &Path) -> anyhow::Result<Run<Answer>> {
    let pictures =
        case.pictures.iter().map(|file| read_grey(&folder.join(file))).collect::<anyhow::Result<Vec<_>>>()?;
    let asked = [Board::checkerboard(case.inner.0, case.inner.1, case.square)];
    let find = || pictures.iter().map(|p| detect(p, &asked, &BoardOptions::default()).ok()).collect::<Vec<_>>();
    let found = find();
    let points = asked[0].points();
    let view = |board: &BoardCorners| BoardView {
        points: board.corners.iter().map(|c| points[c.index]).collect(),
        pixels: board.corners.iter().map(|c| c.position).collect(),
    };
    let views: Vec<BoardView> = found.iter().flatten().map(view).collect();
    let solve = || calibrate(&views, case.width, case.height, &CalibrateOptions::default());
    let find_ms = median_ms(find) / pictures.len() as f64;
    let times_ms = BTreeMap::from([("find".to_owned(), find_ms), ("solve".to_owned(), median_ms(solve))]);
    let boards = found.iter().map(|board| Some(to_pixels(&view(board.as_ref()?).pixels))).collect();
    let solved = solve().ok();
    let answer = Answer { boards, camera: solved.as_ref().map(|s| s.camera), rms_px: solved.map(|s| s.rms_px) };
    Ok(Run { case: case.name.clone(), task: "board".to_owned(), setting: String::new(), times_ms, answer })
}

/// From the same corners as the peer, minimising the same sum of squares.
fn solve_corners(case: &Case) -> Run<Answer> {
    let board = Board::checkerboard(case.inner.0, case.inner.1, case.square);
    let views: Vec<BoardView> = case.corners.iter().map(|c| BoardView::whole(&board, to_points(c))).collect();
    let options = CalibrateOptions { loss: Loss::Squared, ..CalibrateOptions::default() };
    let solve = || calibrate(&views, case.width, case.height, &options);
    let times_ms = BTreeMap::from([("solve".to_owned(), median_ms(solve))]);
    let solved = solve().ok();
    let (camera, rms_px) = (solved.as_ref().map(|s| s.camera), solved.map(|s| s.rms_px));
    let answer = Answer { boards: Vec::new(), camera, rms_px };
    Run { case: case.name.clone(), task: CORNERS.to_owned(), setting: String::new(), times_ms, answer }
}

fn found_percent(answer: &Answer) -> f64 {
    100.0 * answer.boards.iter().flatten().count() as f64 / answer.boards.len() as f64
}

/// Distances of all corners found from the truth. A board looks the same from its other end, so that either end counts.
fn corner_errors(answer: &Answer, truth: &CaseTruth) -> Vec<f64> {
    let of_board = |(found, truth): (&Option<Vec<Pixel>>, &Vec<Pixel>)| -> Vec<f64> {
        let Some(found) = found else { return Vec::new() };
        let (found, truth) = (to_points(found), to_points(truth));
        let straight: Vec<f64> = found.iter().zip(&truth).map(|(a, b)| (a - b).norm()).collect();
        let turned: Vec<f64> = found.iter().rev().zip(&truth).map(|(a, b)| (a - b).norm()).collect();
        if rms(&straight) < rms(&turned) { straight } else { turned }
    };
    answer.boards.iter().zip(&truth.corners).flat_map(of_board).collect()
}

/// The larger of the errors of both focal lengths.
fn focal_error(answer: &Answer, truth: &CaseTruth) -> f64 {
    let Some(found) = answer.camera else { return f64::NAN };
    let error = |found: f64, truth: f64| 100.0 * (found / truth - 1.0).abs();
    error(found.fx, truth.camera.fx).max(error(found.fy, truth.camera.fy))
}
