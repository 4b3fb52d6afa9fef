//! Where the cameras stand, from each one's own poses of the board: the motion between two cameras that most moments agree
//! on, chained from the first camera; then which way round each picture counts the board.

use super::{BoardSymmetry, RigCamera, RigError, RigWarning};
use crate::calibrate::{BoardView, CalibrateError, CalibrateOptions, Calibration, calibrate};
use geometry::{Camera, Transform, Vec2};

/// Distance of a board's corners from where a motion puts them, parts of the board's size in the picture, up to which
/// they agree: half a turn moves them by 2, errors of the cameras' own poses by hundredths.
const AGREES: f64 = 0.25;
/// Motions that differ by less are the same one, radians.
const SAME_TURN: f64 = 0.35;
/// Cost that another motion may have more than the best one, parts of [`AGREES`] for each moment, and still be as good.
const AS_GOOD: f64 = 0.1;
/// Fewer shared moments give a warning.
const FEW_MOMENTS: usize = 4;

/// What the bundle starts from.
pub(super) struct Start {
    pub(super) cameras: Vec<Camera>,
    pub(super) mounts: Vec<Transform>,
    /// `rig_from_board` of the moments that are used.
    pub(super) boards: Vec<Transform>,
    /// Which moment each of these is.
    pub(super) moments: Vec<usize>,
    /// Camera, index into `moments`, and what is seen, counted the same way by all cameras of a moment.
    pub(super) views: Vec<(usize, usize, BoardView)>,
    pub(super) warnings: Vec<RigWarning>,
}

/// One camera by itself.
struct Alone<'a> {
    camera: Camera,
    /// What it sees at each moment, and the board's pose before it.
    sights: Vec<Option<(&'a BoardView, Transform)>>,
}

/// `to_from_from` of two cameras.
struct Link {
    from: usize,
    to: usize,
    motion: Transform,
    /// Moments that agree.
    support: usize,
    ambiguous: bool,
}

pub(super) fn start(
    cameras: &[RigCamera],
    symmetry: &BoardSymmetry,
    options: &CalibrateOptions,
) -> Result<Start, RigError> {
    let alone: Vec<Alone> =
        cameras.iter().enumerate().map(|(c, camera)| calibrate_alone(c, camera, options)).collect::<Result<_, _>>()?;
    let turns = symmetry.board_from_board();
    let mut warnings = Vec::new();
    let mounts = mounts(&alone, &turns, &mut warnings)?;
    let mut start = Start {
        cameras: alone.iter().map(|a| a.camera).collect(),
        mounts,
        boards: Vec::new(),
        moments: Vec::new(),
        views: Vec::new(),
        warnings,
    };
    for moment in 0..cameras[0].views.len() {
        start.place(&alone, moment, &turns);
    }
    Ok(start)
}

fn calibrate_alone<'a>(camera: usize, seen: &'a RigCamera, options: &CalibrateOptions) -> Result<Alone<'a>, RigError> {
    let numbered: Vec<(usize, &BoardView)> =
        seen.views.iter().enumerate().filter_map(|(m, view)| Some((m, view.as_ref()?))).collect();
    let views: Vec<BoardView> = numbered.iter().map(|(_, view)| (*view).clone()).collect();
    let by_moment = |source: CalibrateError| source.renumbered(|view| numbered[view].0);
    let Calibration { camera: lens, views: fits, .. } = calibrate(&views, seen.width, seen.height, options)
        .map_err(|source| RigError::Camera { camera, source: by_moment(source) })?;
    let mut sights = vec![None; seen.views.len()];
    for ((moment, view), fit) in numbered.iter().zip(fits) {
        sights[*moment] = Some((*view, fit.cam_from_board));
    }
    Ok(Alone { camera: lens, sights })
}

impl Alone<'_> {
    /// How far the corners of a moment are from where a pose of the board puts them, parts of the board's size in the
    /// picture; at most [`AGREES`], which also stands for corners that are put nowhere.
    fn distance(&self, moment: usize, cam_from_board: &Transform) -> f64 {
        let Some((view, _)) = &self.sights[moment] else { return AGREES };
        let middle = view.pixels.iter().sum::<Vec2>() / view.pixels.len() as f64;
        let size: f64 = view.pixels.iter().map(|p| (p - middle).norm_squared()).sum();
        let error = |(point, pixel): (&Vec2, &Vec2)| {
            Some((self.camera.project(&cam_from_board.apply(&point.push(0.0)))? - pixel).norm_squared())
        };
        let errors = view.points.iter().zip(&view.pixels).map(error).sum::<Option<f64>>();
        errors.map_or(AGREES, |sum| (sum / size).sqrt().min(AGREES))
    }

    /// The turn of the board that brings it nearest to what is seen, and how near.
    fn nearest(&self, moment: usize, cam_from_board: &Transform, turns: &[Transform]) -> (usize, f64) {
        let distances = turns.iter().map(|turn| self.distance(moment, &(*cam_from_board * *turn)));
        let better = |best: (usize, f64), this: (usize, f64)| if this.1 < best.1 { this } else { best };
        distances.enumerate().fold((0, f64::INFINITY), better)
    }
}

/// `camera_from_rig` of each camera: from the first one on, always the link that most moments agree on.
fn mounts(alone: &[Alone], turns: &[Transform], warnings: &mut Vec<RigWarning>) -> Result<Vec<Transform>, RigError> {
    let mut found: Vec<Option<Transform>> = vec![None; alone.len()];
    found[0] = Some(Transform::identity());
    let mut refused = None;
    let mut links = Vec::new();
    for from in 0..alone.len() {
        for to in (0..alone.len()).filter(|&to| to != from) {
            match link(alone, from, to, turns) {
                Ok(link) => links.extend(link),
                Err(moments) if refused.is_none() => {
                    refused = Some(RigError::Disagreement { camera: from, other: to, moments });
                }
                Err(_) => {}
            }
        }
    }
    while let Some(camera) = found.iter().position(Option::is_none) {
        let leads_on = |l: &&Link| found[l.from].is_some() && found[l.to].is_none();
        // Of equals the first.
        let best = links.iter().filter(leads_on).reduce(|a, b| if b.support > a.support { b } else { a });
        let Some(link) = best else { return Err(refused.unwrap_or(RigError::Unconnected { camera })) };
        found[link.to] = found[link.from].map(|mount| link.motion * mount);
        let (camera, other) = (link.from, link.to);
        if link.support < FEW_MOMENTS {
            warnings.push(RigWarning::FewMoments { camera, other, moments: link.support });
        }
        if link.ambiguous {
            warnings.push(RigWarning::AmbiguousTurn { camera, other });
        }
    }
    Ok(found.into_iter().flatten().collect())
}

/// The motion between two cameras on which most moments agree; `None` if they never see the board together, and the number
/// of such moments if no two agree.
fn link(alone: &[Alone], from: usize, to: usize, turns: &[Transform]) -> Result<Option<Link>, usize> {
    let both = |m: &usize| alone[from].sights[*m].is_some() && alone[to].sights[*m].is_some();
    let shared: Vec<usize> = (0..alone[from].sights.len()).filter(both).collect();
    let pose = |camera: usize, m: usize| alone[camera].sights[m].as_ref().map(|(_, pose)| *pose);
    let candidates: Vec<(Transform, f64, usize)> = shared
        .iter()
        .filter_map(|&m| Some((pose(from, m)?, pose(to, m)?)))
        .flat_map(|(a, b)| turns.iter().map(move |turn| b * turn.inverse() * a.inverse()))
        .map(|motion| {
            let distance = |m: &usize| Some(alone[to].nearest(*m, &(motion * pose(from, *m)?), turns).1);
            let distances: Vec<f64> = shared.iter().filter_map(distance).collect();
            let support = distances.iter().filter(|d| **d < AGREES).count();
            (motion, distances.iter().sum(), support)
        })
        .collect();
    let Some(best) = candidates.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(None) };
    if best.2 < 2.min(shared.len()) {
        return Err(shared.len());
    }
    let limit = best.1 + AS_GOOD * AGREES * shared.len() as f64;
    let rivals = candidates.iter().filter(|c| c.1 <= limit);
    let ambiguous = rivals.clone().any(|c| c.0.angle_to(&best.0) > SAME_TURN);
    // Of motions that are equally good the one that turns the camera least.
    let straight = |c: &&(Transform, f64, usize)| c.0.angle_to(&Transform::identity());
    let chosen = if ambiguous { rivals.min_by(|a, b| straight(a).total_cmp(&straight(b))) } else { Some(best) };
    Ok(chosen.map(|&(motion, _, support)| Link { from, to, motion, support, ambiguous }))
}

impl Start {
    /// Adds a moment: of the poses that its cameras give the board the one that most of them agree with.
    fn place(&mut self, alone: &[Alone], moment: usize, turns: &[Transform]) {
        let seeing: Vec<usize> = (0..alone.len()).filter(|&c| alone[c].sights[moment].is_some()).collect();
        let board = |c: &usize| Some(self.mounts[*c].inverse() * alone[*c].sights[moment].as_ref()?.1);
        let judged = |board: Transform| {
            let nearest = |c: &usize| alone[*c].nearest(moment, &(self.mounts[*c] * board), turns);
            let each: Vec<(usize, f64)> = seeing.iter().map(nearest).collect();
            (board, each)
        };
        let total = |each: &[(usize, f64)]| each.iter().map(|(_, d)| d).sum::<f64>();
        let all: Vec<_> = seeing.iter().filter_map(board).map(judged).collect();
        let Some((board, each)) = all.into_iter().min_by(|a, b| total(&a.1).total_cmp(&total(&b.1))) else { return };
        for (&camera, (turn, distance)) in seeing.iter().zip(each) {
            let Some((view, _)) = &alone[camera].sights[moment] else { continue };
            if distance >= AGREES {
                self.warnings.push(RigWarning::LeftOut { camera, moment });
                continue;
            }
            let counted = |p: &Vec2| turns[turn].apply(&p.push(0.0)).xy();
            let points = view.points.iter().map(counted).collect();
            self.views.push((camera, self.boards.len(), BoardView { points, pixels: view.pixels.clone() }));
        }
        self.boards.push(board);
        self.moments.push(moment);
    }
}
