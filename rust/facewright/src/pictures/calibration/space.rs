//! The cameras and the boards before them, seen from the side and from above.

use super::scene::{PlacedBoard, PlacedCamera, Scene};
use drawing::labels::Labels;
use drawing::style::{ACCENT, Area, GREY, HAIR, INK, MIDDLE, PALE, SMALL, THIN, TINY, plain, round_up, title};
use drawing::{Anchor, Colour, Drawing, Stroke, Text};
use geometry::{Vec2, Vec3};

/// From where the oblique view looks: turned from the camera's right to its back, and raised; degrees.
const AZIMUTH_DEG: f64 = 40.0;
const ELEVATION_DEG: f64 = 24.0;
/// How many numbers are readable in the small view.
const READABLE: usize = 20;
/// Lines of the ground's grid along its longer side, at most.
const LINES: f64 = 9.0;

/// A parallel projection to the page.
struct View {
    /// To the right, down and away on the page, in the rig's frame.
    axes: [Vec3; 3],
    /// Millimetres per metre.
    scale: f64,
    offset: Vec2,
}

impl View {
    /// A view in which points fill an area.
    fn fit(axes: [Vec3; 3], points: &[Vec3], area: Area) -> Self {
        let mut view = Self { axes, scale: 1.0, offset: Vec2::zeros() };
        let far = Vec2::repeat(f64::INFINITY);
        let (low, high) = points.iter().map(|p| view.page(p)).fold((far, -far), |(l, h), p| (l.inf(&p), h.sup(&p)));
        view.scale = area.size.component_div(&(high - low).sup(&Vec2::repeat(1e-9))).min();
        view.offset = area.from + area.size / 2.0 - view.scale * (low + high) / 2.0;
        view
    }

    fn page(&self, point: &Vec3) -> Vec2 {
        self.scale * Vec2::new(self.axes[0].dot(point), self.axes[1].dot(point)) + self.offset
    }

    fn depth(&self, points: &[Vec3]) -> f64 {
        points.iter().map(|p| self.axes[2].dot(p)).sum::<f64>() / points.len() as f64
    }
}

/// A horizontal grid below everything.
struct Ground {
    y: f64,
    step: f64,
    /// Numbers of the first and the last line, along x and along z.
    x: (i64, i64),
    z: (i64, i64),
}

impl Ground {
    fn below(points: &[Vec3]) -> Self {
        let far = Vec3::repeat(f64::INFINITY);
        let (low, high) = points.iter().fold((far, -far), |(low, high), p| (low.inf(p), high.sup(p)));
        let extent = high - low;
        let step = round_up(extent.x.max(extent.z) / LINES);
        let lines = |low: f64, high: f64| ((low / step).floor() as i64, (high / step).ceil() as i64);
        Self { y: high.y + 0.1 * extent.y, step, x: lines(low.x, high.x), z: lines(low.z, high.z) }
    }

    fn point(&self, x: i64, z: i64) -> Vec3 {
        Vec3::new(x as f64 * self.step, self.y, z as f64 * self.step)
    }

    fn corners(&self) -> [Vec3; 4] {
        let ((left, right), (near, distant)) = (self.x, self.z);
        [(left, near), (right, near), (right, distant), (left, distant)].map(|(x, z)| self.point(x, z))
    }

    fn draw(&self, drawing: &mut Drawing, view: &View) {
        let mut line = |a: Vec3, b: Vec3| drawing.line(&[view.page(&a), view.page(&b)], HAIR);
        (self.x.0..=self.x.1).for_each(|x| line(self.point(x, self.z.0), self.point(x, self.z.1)));
        (self.z.0..=self.z.1).for_each(|z| line(self.point(self.x.0, z), self.point(self.x.1, z)));
    }

    /// Millimetres along the two edges of the grid that are nearest in the oblique view.
    fn numbers(&self, drawing: &mut Drawing, view: &View) {
        let label = |n: i64| plain(n as f64 * self.step * 1000.0);
        let place = |point: Vec3, content: String, anchor: Anchor, colour: Colour| {
            let side = if anchor == Anchor::End { -1.2 } else { 1.2 };
            Text::new(content, view.page(&point) + Vec2::new(side, 2.6), TINY).anchored(anchor).coloured(colour)
        };
        for z in self.z.0..=self.z.1 {
            drawing.text(place(self.point(self.x.1, z), label(z), Anchor::Start, GREY));
        }
        for x in self.x.0..self.x.1 {
            drawing.text(place(self.point(x, self.z.0), label(x), Anchor::End, GREY));
        }
        let mut name = |a: Vec3, b: Vec3, content: &str, anchor: Anchor, shift: Vec2| {
            let at = (view.page(&a) + view.page(&b)) / 2.0 + shift;
            drawing.text(Text::new(content, at, SMALL).anchored(anchor).coloured(GREY));
        };
        let near = self.point(self.x.1, self.z.0);
        name(near, self.point(self.x.1, self.z.1), "z, mm", Anchor::Start, Vec2::new(6.0, 7.0));
        name(near, self.point(self.x.0, self.z.0), "x, mm", Anchor::End, Vec2::new(-6.0, 7.0));
    }
}

/// The oblique view, with a ground measured in millimetres.
pub fn oblique(drawing: &mut Drawing, area: Area, scene: &Scene) {
    let area = title(drawing, area, "Boards in front of the camera", "");
    let (azimuth, elevation) = (AZIMUTH_DEG.to_radians(), ELEVATION_DEG.to_radians());
    let flat = elevation.cos();
    let away = Vec3::new(-flat * azimuth.cos(), elevation.sin(), flat * azimuth.sin());
    let right = away.cross(&-Vec3::y()).normalize();
    let mut points: Vec<Vec3> = scene.points().collect();
    let ground = Ground::below(&points);
    points.extend(ground.corners());
    let view = View::fit([right, away.cross(&right), away], &points, area.without(7.0, 3.0, 11.0, 8.0));
    ground.draw(drawing, &view);
    ground.numbers(drawing, &view);
    for camera in &scene.cameras {
        let foot = Vec3::new(camera.centre.x, ground.y, camera.centre.z);
        drawing.line(&[view.page(&camera.centre), view.page(&foot)], HAIR);
    }
    things(drawing, &view, scene, area, true);
}

/// The view from above, the camera looking up the page.
pub fn above(drawing: &mut Drawing, area: Area, scene: &Scene) {
    let area = title(drawing, area, "From above", "");
    let mut points: Vec<Vec3> = scene.points().collect();
    let ground = Ground::below(&points);
    points.extend(ground.corners());
    let view = View::fit([Vec3::x(), -Vec3::z(), Vec3::y()], &points, area.without(1.0, 0.0, 1.0, 6.0));
    ground.draw(drawing, &view);
    things(drawing, &view, scene, area, false);
    let (from, to) = (ground.point(ground.x.0, ground.z.0), ground.point(ground.x.0 + 1, ground.z.0));
    let (from, to) = (view.page(&from) + Vec2::new(0.0, 2.0), view.page(&to) + Vec2::new(0.0, 2.0));
    drawing.line(&[from, to], Stroke { colour: INK, width: 0.4 });
    let length = format!("{} mm", plain(ground.step * 1000.0));
    drawing.text(Text::new(length, Vec2::new(from.x, from.y + 3.0), SMALL).coloured(GREY));
}

/// Boards and cameras, the farthest first, then the boards' numbers.
fn things(drawing: &mut Drawing, view: &View, scene: &Scene, area: Area, is_large: bool) {
    enum Thing<'a> {
        Board(&'a PlacedBoard),
        Camera(&'a PlacedCamera),
    }
    let boards = scene.boards.iter().map(|board| (view.depth(&board.outline), Thing::Board(board)));
    let cameras = scene.cameras.iter().map(|camera| (view.depth(&[camera.centre]), Thing::Camera(camera)));
    let mut all: Vec<_> = boards.chain(cameras).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut labels = Labels::within(area, if is_large { SMALL } else { TINY });
    for (_, thing) in all {
        match thing {
            Thing::Board(board) => {
                draw_board(drawing, view, board);
                let colour = if board.is_bad { ACCENT } else { INK };
                labels.want(board.number.to_string(), colour, &board.outline.map(|p| view.page(&p)));
            }
            Thing::Camera(camera) => draw_camera(drawing, view, camera, is_large, scene.cameras.len() > 1),
        }
    }
    if is_large || scene.boards.len() <= READABLE {
        labels.draw(drawing);
    }
}

fn draw_board(drawing: &mut Drawing, view: &View, board: &PlacedBoard) {
    let (edge, width) = if board.is_bad { (ACCENT, 0.35) } else { (INK, 0.2) };
    let inner = Stroke { colour: if board.is_bad { ACCENT } else { MIDDLE }, width: 0.07 };
    let outline = board.outline.map(|p| view.page(&p));
    drawing.polygon(&outline, Some(Colour::WHITE.with_opacity(0.8)), None);
    board.grid.iter().for_each(|line| drawing.line(&line.map(|p| view.page(&p)), inner));
    drawing.polygon(&outline, None, Some(Stroke { colour: edge, width }));
    drawing.disc(view.page(&board.mark), 0.45, edge);
}

fn draw_camera(drawing: &mut Drawing, view: &View, camera: &PlacedCamera, is_large: bool, is_named: bool) {
    let (centre, plane) = (view.page(&camera.centre), camera.plane.map(|p| view.page(&p)));
    let stroke = Stroke { colour: INK, width: if is_large { 0.3 } else { 0.2 } };
    drawing.polygon(&plane, Some(PALE.with_opacity(0.7)), Some(stroke));
    plane.iter().for_each(|corner| drawing.line(&[centre, *corner], stroke));
    drawing.disc(centre, 2.0 * stroke.width, INK);
    if is_large {
        for (axis, name) in camera.axes.iter().map(|p| view.page(p)).zip(["x", "y", "z"]) {
            drawing.line(&[centre, axis], THIN);
            let beyond = axis + (axis - centre).try_normalize(1e-9).unwrap_or_default() * 1.8;
            let at = beyond + Vec2::new(0.0, 0.3 * SMALL);
            let text = Text::new(name, at, SMALL).anchored(Anchor::Middle).coloured(GREY);
            drawing.text(Text { rim: 0.4, ..text });
        }
    }
    if is_named && is_large {
        let at = centre + Vec2::new(-1.5, -1.5);
        let text = Text::new(camera.name.as_str(), at, SMALL).anchored(Anchor::End).coloured(INK);
        drawing.text(Text { rim: 0.4, ..text });
    }
}
