//! Which matches are right.

use super::{Answer, Case, CaseTruth, RANGES_DEG, TOLERANCES_PX};
use crate::clock::median;
use crate::results::{Run, to_points};
use crate::scenes::clip::Clip;
use crate::scenes::seen::Seen;
use geometry::Vec2;
use serde::Serialize;

/// A row's shares of right matches, one per tolerance, %.
#[derive(Clone, Serialize)]
pub(super) struct Shares {
    /// Of all points.
    pub all: [f64; 3],
    /// Of the points that were not given up.
    pub kept: [f64; 3],
    /// Points that were not given up, %.
    pub kept_share: f64,
    /// Median error of these, pixels.
    pub median_px: f64,
}

/// Where every point of every pair truly is.
pub(super) struct Judge<'c> {
    truth: &'c CaseTruth,
    places: Vec<Vec<Option<Vec2>>>,
}

impl<'c> Judge<'c> {
    /// By the true surface and poses.
    pub fn new(case: &Case, truth: &'c CaseTruth) -> anyhow::Result<Self> {
        let body = Clip::open_in(&truth.film)?.head()?;
        let seen = |frame: &super::Frame| Seen::new(&body, truth.camera, frame.cam_from_head);
        let frames: Vec<Seen<'_>> = truth.frames.iter().map(seen).collect();
        let places = |pair: &super::Pair| {
            to_points(&pair.points).iter().map(|p| frames[pair.a].carried(p, &frames[pair.b])).collect()
        };
        Ok(Self { truth, places: case.pairs.iter().map(places).collect() })
    }

    /// One per row of the tables.
    pub fn shares(&self, run: &Run<Answer>) -> Vec<Shares> {
        (0..RANGES_DEG.len()).map(|range| self.row(run, range)).collect()
    }

    fn row(&self, run: &Run<Answer>, range: usize) -> Shares {
        let pairs = self.places.iter().zip(&run.answer.matches).zip(&self.truth.ranges);
        let (mut errors, mut points) = (Vec::new(), 0);
        for ((places, found), _) in pairs.filter(|(_, r)| **r == range) {
            points += places.len();
            let error = |(place, found): (&Option<Vec2>, &Option<_>)| {
                let found = Vec2::from((*found)?);
                Some(place.map_or(f64::INFINITY, |place| (place - found).norm()))
            };
            errors.extend(places.iter().zip(found).filter_map(error));
        }
        let within =
            |of: usize| TOLERANCES_PX.map(|px| 100.0 * errors.iter().filter(|e| **e <= px).count() as f64 / of as f64);
        Shares {
            all: within(points),
            kept: within(errors.len()),
            kept_share: 100.0 * errors.len() as f64 / points as f64,
            median_px: median(errors),
        }
    }
}
