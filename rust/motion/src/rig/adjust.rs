//! All poses, points and, as far as they may be off, the cameras' places from all observations at once: Levenberg–Marquardt.

use super::Place;
use super::equations::{Equations, cost};
use geometry::{Camera, Mat3, Transform, Vec2, Vec3};
use nalgebra::{DMatrix, Matrix6, UnitQuaternion, Vector6};

/// A place less uncertain than this along one of its axes is held, radians and metres, squared.
const LEAST_VARIANCE: f64 = 1e-18;
/// A step that lowers the cost by less than this part of it is the last.
const RELATIVE_COST: f64 = 1e-8;

/// A point seen by a camera at a moment.
pub(super) struct Seen {
    pub(super) moment: usize,
    pub(super) camera: usize,
    pub(super) point: usize,
    pub(super) pixel: Vec2,
    pub(super) sigma_px: f64,
}

/// What is solved for.
#[derive(Clone)]
pub(super) struct State {
    /// `camera_from_rig`.
    pub(super) places: Vec<Transform>,
    /// `rig_from_head`.
    pub(super) poses: Vec<Transform>,
    pub(super) points: Vec<Vec3>,
}

/// Which unknown stands where.
pub(super) struct Layout<'a> {
    pub(super) seen: &'a [Seen],
    known: &'a [Place],
    /// Inverse covariances of the places.
    information: Vec<Option<Matrix6<f64>>>,
    /// First column of each moment's pose; the first that is seen is held, and with it the head frame.
    pub(super) poses: Vec<Option<usize>>,
    /// First column of each camera's place.
    pub(super) places: Vec<Option<usize>>,
    pub(super) unknowns: usize,
}

/// What an adjustment found besides.
pub(super) struct Adjusted {
    /// Sum of the losses.
    pub(super) cost: f64,
    /// By what factor the variances exceed those announced; at least 1.
    pub(super) excess: f64,
    /// Covariance of each camera's place.
    pub(super) places: Vec<Matrix6<f64>>,
    /// Covariance of each point, given the cameras, by the announced standard deviations; `None` where nothing determines it.
    pub(super) points: Vec<Option<Mat3>>,
}

impl<'a> Layout<'a> {
    fn new(state: &State, seen: &'a [Seen], known: &'a [Place]) -> Self {
        let mut is_seen = vec![false; state.poses.len()];
        seen.iter().for_each(|o| is_seen[o.moment] = true);
        let first = is_seen.iter().position(|seen| *seen);
        let mut unknowns = 0;
        let mut column = |is_free: bool| {
            is_free.then(|| {
                unknowns += 6;
                unknowns - 6
            })
        };
        let poses = is_seen.iter().enumerate().map(|(k, seen)| column(*seen && Some(k) != first)).collect();
        let information = |place: &Place| {
            let certain = place.covariance.diagonal().min() < LEAST_VARIANCE;
            place.covariance.cholesky().filter(|_| !certain).map(|factor| factor.inverse())
        };
        let information: Vec<_> = known.iter().map(information).collect();
        let places = information.iter().map(|information| column(information.is_some())).collect();
        Self { seen, known, information, poses, places, unknowns }
    }

    /// Column, residual and information of what is known of each place.
    pub(super) fn priors(&self, state: &State) -> Vec<(usize, Vector6<f64>, Matrix6<f64>)> {
        let prior = |camera: usize| {
            let (known, now) = (&self.known[camera].camera_from_rig, &state.places[camera]);
            let turn = UnitQuaternion::from_rotation_matrix(&(now.rotation * known.rotation.inverse())).scaled_axis();
            let shift = now.translation - known.translation;
            let step = Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z);
            Some((self.places[camera]?, step, self.information[camera]?))
        };
        (0..self.known.len()).filter_map(prior).collect()
    }

    fn moved(&self, state: &State, (step, points): &(nalgebra::DVector<f64>, Vec<Vec3>)) -> State {
        let retract = |(at, column): (&Transform, &Option<usize>)| {
            column.map_or(*at, |column| at.retract(&step.fixed_rows::<6>(column).into_owned()))
        };
        State {
            places: state.places.iter().zip(&self.places).map(retract).collect(),
            poses: state.poses.iter().zip(&self.poses).map(retract).collect(),
            points: state.points.iter().zip(points).map(|(point, step)| point + step).collect(),
        }
    }
}

/// Refines a state in place; nothing of it that is not seen changes.
pub(super) fn adjust(state: &mut State, seen: &[Seen], camera: &Camera, known: &[Place], steps: usize) -> Adjusted {
    let layout = Layout::new(state, seen, known);
    let mut equations = Equations::new(&layout, state, camera);
    let mut damping = 1e-4;
    let mut taken = 0;
    while taken < steps && damping < 1e8 {
        let candidate = equations.step(damping).map(|step| layout.moved(state, &step));
        let better = candidate.filter(|candidate| cost(&layout, candidate, camera) < equations.cost);
        let Some(better) = better else {
            damping *= 10.0;
            continue;
        };
        let before = equations.cost;
        *state = better;
        equations = Equations::new(&layout, state, camera);
        (taken, damping) = (taken + 1, damping * 0.1);
        if before - equations.cost <= RELATIVE_COST * before {
            break;
        }
    }
    report(&layout, &equations)
}

fn report(layout: &Layout, equations: &Equations) -> Adjusted {
    let placed = equations.points.iter().filter(|point| point.hessian != Mat3::zeros()).count();
    let known = 6 * layout.places.iter().flatten().count();
    let freedom = (2 * layout.seen.len() + known).saturating_sub(layout.unknowns + 3 * placed).max(1);
    let excess = (equations.cost / freedom as f64).max(1.0);
    let inverse: Option<DMatrix<f64>> =
        equations.reduced(0.0).and_then(|(matrix, ..)| Some(matrix.cholesky()?.inverse()));
    let place = |(column, known): (&Option<usize>, &Place)| match (column, &inverse) {
        (Some(column), Some(inverse)) => inverse.fixed_view::<6, 6>(*column, *column).into_owned(),
        _ => known.covariance,
    };
    Adjusted {
        cost: equations.cost,
        excess,
        places: layout.places.iter().zip(layout.known).map(place).collect(),
        points: equations.points.iter().map(|point| point.hessian.try_inverse()).collect(),
    }
}
