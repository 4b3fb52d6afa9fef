//! The paper's tracker over a sequence: from each frame to the next (section 2.3), cross matches adjusted at each step (2.4).

use super::PointObservation;
use super::findings::{Findings, Loss};
use super::sequence::{Sequence, Shot};
use crate::FacewrightError;
use crate::patches::REFERENCE_PX;
use crate::track::pair::PAPER_WINDOW;
use geometry::{Progress, Vec2};
use vision::corners::{CornerOptions, Spread, detect};
use vision::correct::{LocalAdjustmentOptions, Match, local_adjustment};
use vision::track::{Status, TrackOptions, track};

/// A point on its way: where it is and one standard deviation, or why it is no longer followed.
type Follow = Result<(Vec2, f64), Loss>;

/// Chooses corners in one frame and hands them on to both ends of the sequence; the window, and what was found.
pub(super) fn chain(sequence: &Sequence, progress: &Progress) -> Result<(usize, Findings), FacewrightError> {
    let window = sequence.options.window.unwrap_or(PAPER_WINDOW);
    let mut findings = Findings::default();
    let start = sequence.references()?.first().copied();
    let Some(shot) = start.map(|i| sequence.shoot(i)).transpose()?.flatten() else { return Ok((window, findings)) };
    let corner_options = CornerOptions {
        max_count: sequence.options.points,
        window,
        spread: Spread::Strongest,
        min_distance: 5.0,
        ..CornerOptions::default()
    };
    let corners = detect(&shot.skin.pyramid, Some(&shot.skin.mask), &corner_options)?;
    let begin: Vec<Follow> = corners.iter().map(|corner| Ok((corner.position, REFERENCE_PX))).collect();
    corners.iter().for_each(|corner| findings.add(shot.index, sequence.region(shot.index, &corner.position), None));
    let mut of_frame: Vec<Vec<Follow>> = vec![Vec::new(); sequence.len()];
    let (index, mut done) = (shot.index, 0);
    let ways: [Vec<usize>; 2] = [(index + 1..sequence.len()).collect(), (0..index).rev().collect()];
    for way in ways {
        let (mut points, mut last) = (begin.clone(), None::<Shot>);
        for next in way {
            progress.step(done, of_frame.len())?;
            done += 1;
            let there = sequence.shoot(next)?;
            match &there {
                Some(there) => step(last.as_ref().unwrap_or(&shot), there, &mut points, window)?,
                None => points.iter_mut().for_each(|point| *point = point.and(Err(Loss::NoFace))),
            }
            of_frame[next].clone_from(&points);
            last = there.or(last);
        }
    }
    of_frame[index] = begin;
    for (frame, points) in of_frame.iter().enumerate() {
        for (number, point) in points.iter().enumerate() {
            let found = point
                .map(|(pixel, sigma_px)| PointObservation { frame, pixel, sigma_px })
                .map_err(|loss| (frame, loss));
            findings.note(number, found);
        }
    }
    Ok((window, findings))
}

/// Follows the points that are left from one frame to the next.
fn step(from: &Shot, to: &Shot, points: &mut [Follow], window: usize) -> Result<(), FacewrightError> {
    let left: Vec<usize> = (0..points.len()).filter(|&i| points[i].is_ok()).collect();
    let at: Vec<Vec2> = left.iter().filter_map(|&i| points[i].ok()).map(|point| point.0).collect();
    let tracked = track(&from.skin.pyramid, &to.skin.pyramid, &at, None, &TrackOptions::paper(window))?;
    let matches: Vec<Match> = at
        .iter()
        .zip(&tracked)
        .map(|(a, t)| if t.status == Status::Found { Match { a: *a, b: t.position } } else { Match::missing(*a) })
        .collect();
    let options = LocalAdjustmentOptions { window, ..LocalAdjustmentOptions::default() };
    let corrected = local_adjustment(&from.skin.pyramid, &to.skin.pyramid, &matches, &options)?;
    for (k, &i) in left.iter().enumerate() {
        points[i] = match (Loss::of(tracked[k].status, corrected.outcomes[k]), points[i]) {
            (None, Ok((_, sigma_px))) => {
                let own = if tracked[k].sigma_px.is_finite() { tracked[k].sigma_px } else { 1.0 };
                Ok((corrected.matches[k].b, sigma_px.hypot(own)))
            }
            (Some(loss), _) | (None, Err(loss)) => Err(loss),
        };
    }
    Ok(())
}
