//! Cameras and boards in the rig's frame.

use super::{Bounds, PictureInput};
use geometry::{Board, Camera, Pattern, Transform, Vec2, Vec3};

/// Length of a camera's pyramid, parts of the median distance of the boards.
const PYRAMID: f64 = 0.22;

/// A board in the rig's frame.
pub struct PlacedBoard {
    /// Number of its picture.
    pub number: usize,
    /// Whether it fits badly.
    pub is_bad: bool,
    /// Corners of the print, around it.
    pub outline: [Vec3; 4],
    /// Lines along rows and columns of corners.
    pub grid: Vec<[Vec3; 2]>,
    /// Middle of its first black square.
    pub mark: Vec3,
}

/// A camera in the rig's frame.
pub struct PlacedCamera {
    /// What to call it.
    pub name: String,
    /// Centre of projection.
    pub centre: Vec3,
    /// Corners of the image plane, from the top left around it.
    pub plane: [Vec3; 4],
    /// Ends of its x, y and z axes.
    pub axes: [Vec3; 3],
}

/// All that is seen in space.
pub struct Scene {
    /// The cameras.
    pub cameras: Vec<PlacedCamera>,
    /// The boards.
    pub boards: Vec<PlacedBoard>,
}

impl Scene {
    pub fn new(input: &PictureInput) -> Self {
        let count = input.cameras.iter().map(|c| c.calibrated.images.len()).max().unwrap_or(0);
        let boards: Vec<_> = (0..count).filter_map(|k| place_board(input, k)).collect();
        let mut distances: Vec<f64> = boards.iter().map(|(_, distance)| *distance).collect();
        distances.sort_by(f64::total_cmp);
        let length = PYRAMID * distances.get(distances.len() / 2).unwrap_or(&1.0);
        let cameras = input
            .cameras
            .iter()
            .map(|c| place_camera(c.name, &c.calibrated.camera.camera, &c.camera_from_rig.inverse(), length));
        Self { cameras: cameras.collect(), boards: boards.into_iter().map(|(board, _)| board).collect() }
    }

    /// Every point that must be on the page.
    pub fn points(&self) -> impl Iterator<Item = Vec3> {
        let boards = self.boards.iter().flat_map(|board| board.outline);
        let cameras = self.cameras.iter().flat_map(|c| c.plane.into_iter().chain(c.axes).chain([c.centre]));
        boards.chain(cameras)
    }
}

/// The board of the k-th pictures, as the first camera that found it has it, and its distance from this camera.
fn place_board(input: &PictureInput, k: usize) -> Option<(PlacedBoard, f64)> {
    let is_bad = input
        .cameras
        .iter()
        .any(|c| c.calibrated.images.get(k).is_some_and(|image| Bounds::of(c.calibrated).is_bad(image)));
    let (camera, cam_from_board) = input.cameras.iter().find_map(|c| {
        let pose = c.calibrated.images.get(k)?.cam_from_board?;
        pose.rows().iter().flatten().all(|v| v.is_finite()).then_some((c, pose))
    })?;
    let rig_from_cam = camera.camera_from_rig.inverse();
    let place = |p: Vec2| rig_from_cam.apply(&cam_from_board.apply(&Vec3::new(p.x, p.y, 0.0)));
    let (low, high) = print(&input.board);
    let corners = [low, Vec2::new(high.x, low.y), high, Vec2::new(low.x, high.y)];
    let half = Vec2::repeat(input.board.square / 2.0);
    let board = PlacedBoard {
        number: k + 1,
        is_bad,
        outline: corners.map(place),
        grid: grid(&input.board).into_iter().map(|line| line.map(place)).collect(),
        mark: place(half),
    };
    Some((board, cam_from_board.translation.norm()))
}

/// First and last corner of the print in the board's frame.
fn print(board: &Board) -> (Vec2, Vec2) {
    let low = match board.pattern {
        Pattern::Checkerboard => -Vec2::repeat(board.square),
        Pattern::Squares { .. } => Vec2::zeros(),
    };
    (low, low + board.extent())
}

/// Lines along rows and columns of corners in the board's frame.
fn grid(board: &Board) -> Vec<[Vec2; 2]> {
    let ((columns, rows), points, (low, high)) = (board.corners(), board.points(), print(board));
    let across = (0..rows).map(|j| points[j * columns].y).map(|y| [Vec2::new(low.x, y), Vec2::new(high.x, y)]);
    let down = (0..columns).map(|i| points[i].x).map(|x| [Vec2::new(x, low.y), Vec2::new(x, high.y)]);
    across.chain(down).collect()
}

fn place_camera(name: &str, camera: &Camera, rig_from_cam: &Transform, length: f64) -> PlacedCamera {
    let (right, bottom) = (f64::from(camera.width) - 0.5, f64::from(camera.height) - 0.5);
    let corners = [(-0.5, -0.5), (right, -0.5), (right, bottom), (-0.5, bottom)];
    let plane = corners.map(|(u, v)| {
        let n = camera.normalise(&Vec2::new(u, v));
        rig_from_cam.apply(&(Vec3::new(n.x, n.y, 1.0) * length))
    });
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| rig_from_cam.apply(&(axis * length * 1.5)));
    PlacedCamera { name: name.to_owned(), centre: rig_from_cam.translation, plane, axes }
}
