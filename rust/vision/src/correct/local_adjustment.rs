//! The paper's local adjustment: no two matches on a line may cross (section 2.4, after Jia, Zhang and Lin 2000).
//!
//! A line is a band of rows. Two points of it are a cross match if their order from left to right is not the same in
//! both frames. The point with the most cross matches is taken, and its match is searched again between the matches of
//! its neighbours, by the least sum of squared differences of a window, where it has fewer; until none is left. A
//! point for which there is no such place is rejected. Of two points that cross equally often the one whose windows
//! differ more is taken.

use super::{CorrectError, Correction, Match, Outcome, Reason, positive};
use crate::pyramid::{Level, Pyramid};
use geometry::Vec2;

/// How lines are made and searched.
#[derive(Clone, Debug)]
pub struct LocalAdjustmentOptions {
    /// Height of the band of rows of `a` that counts as a line, pixels; the paper gives none.
    pub band_px: f64,
    /// Side of the compared windows, pixels; odd.
    pub window: usize,
    /// How far from the place its neighbours' displacement suggests a match is searched along the line, pixels.
    pub search_px: f64,
    /// The same across the line.
    pub across_px: f64,
}

impl Default for LocalAdjustmentOptions {
    fn default() -> Self {
        Self { band_px: 12.0, window: 7, search_px: 12.0, across_px: 3.0 }
    }
}

/// Moves or rejects matches until no two on a line cross.
pub fn local_adjustment(
    a: &Pyramid,
    b: &Pyramid,
    matches: &[Match],
    options: &LocalAdjustmentOptions,
) -> Result<Correction, CorrectError> {
    positive("band_px", options.band_px)?;
    positive("search_px", options.search_px)?;
    positive("across_px", options.across_px)?;
    let mut correction = Correction::unchanged(matches);
    let mut adjuster = Adjuster { a: a.finest(), b: b.finest(), options, windows: Default::default() };
    for line in lines(&correction, options.band_px) {
        adjuster.line(line, &mut correction);
    }
    Ok(correction)
}

/// Indices of the usable matches of each band, from left to right in `a`.
fn lines(correction: &Correction, band_px: f64) -> Vec<Vec<usize>> {
    let mut bands = std::collections::BTreeMap::<i64, Vec<usize>>::new();
    for (i, m) in correction.matches.iter().enumerate() {
        if correction.outcomes[i].is_usable() {
            bands.entry((m.a.y / band_px).floor() as i64).or_default().push(i);
        }
    }
    let mut lines: Vec<_> = bands.into_values().collect();
    for line in &mut lines {
        line.sort_by(|&i, &j| correction.matches[i].a.x.total_cmp(&correction.matches[j].a.x));
    }
    lines
}

/// Whether two matches change their order, or fall together in `b`.
fn cross(m: &Match, n: &Match) -> bool {
    (m.a.x < n.a.x && m.b.x >= n.b.x) || (m.a.x > n.a.x && m.b.x <= n.b.x)
}

/// Cross matches of `m` on a line, itself left out.
fn crossings(m: &Match, line: &[usize], but: usize, matches: &[Match]) -> usize {
    line.iter().filter(|&&i| i != but && cross(m, &matches[i])).count()
}

struct Adjuster<'a> {
    a: &'a Level,
    b: &'a Level,
    options: &'a LocalAdjustmentOptions,
    windows: [Vec<f32>; 2],
}

impl Adjuster<'_> {
    fn line(&mut self, mut line: Vec<usize>, correction: &mut Correction) {
        let pairs = |line: &[usize], matches: &[Match]| {
            line.iter().map(|&i| crossings(&matches[i], line, i, matches)).sum::<usize>() / 2
        };
        correction.violations_before += pairs(&line, &correction.matches);
        while let Some((place, count)) = self.worst(&line, &correction.matches) {
            let i = line[place];
            match self.search(&line, place, count, &correction.matches) {
                Some(found) => {
                    correction.matches[i].b = found;
                    correction.outcomes[i] = Outcome::Moved(Reason::Order);
                }
                None => {
                    correction.outcomes[i] = Outcome::Rejected(Reason::Order);
                    line.remove(place);
                }
            }
        }
        correction.violations_after += pairs(&line, &correction.matches);
    }

    /// The place on the line, and the count, of the match with the most cross matches; `None` if there are none.
    fn worst(&mut self, line: &[usize], matches: &[Match]) -> Option<(usize, usize)> {
        let counts: Vec<usize> = line.iter().map(|&i| crossings(&matches[i], line, i, matches)).collect();
        let most = counts.iter().copied().max().filter(|&most| most > 0)?;
        let candidates = (0..line.len()).filter(|&place| counts[place] == most);
        let differences =
            candidates.map(|place| (place, self.difference(&matches[line[place]].a, &matches[line[place]].b)));
        differences.reduce(|x, y| if y.1 > x.1 { y } else { x }).map(|(place, _)| (place, most))
    }

    /// The best place with fewer cross matches, between the matches of the neighbours.
    fn search(&mut self, line: &[usize], place: usize, count: usize, matches: &[Match]) -> Option<Vec2> {
        let (i, options) = (line[place], self.options);
        // A neighbour that crosses others is no bound.
        let sound = |j: &&usize| line.iter().all(|&k| k == i || k == **j || !cross(&matches[k], &matches[**j]));
        let left = line[..place].iter().rev().find(sound).map(|&j| matches[j]);
        let right = line[place + 1..].iter().find(sound).map(|&j| matches[j]);
        let displacements: Vec<Vec2> = [left, right].into_iter().flatten().map(|m| m.b - m.a).collect();
        let u = matches[i].a;
        let expected = u + displacements.iter().sum::<Vec2>() / displacements.len().max(1) as f64;
        let low = left.map_or(f64::NEG_INFINITY, |m| m.b.x).max(expected.x - options.search_px);
        let high = right.map_or(f64::INFINITY, |m| m.b.x).min(expected.x + options.search_px);
        // Candidates are whole pixels away from `u`, so that windows can be compared without interpolation.
        let (from, to) = ((low - u.x).floor() as i64 + 1, (high - u.x).ceil() as i64 - 1);
        let (above, below) =
            ((expected.y - options.across_px - u.y).ceil(), (expected.y + options.across_px - u.y).floor());
        let mut best = None;
        for dy in above as i64..=below as i64 {
            for dx in from..=to {
                let candidate = u + Vec2::new(dx as f64, dy as f64);
                if crossings(&Match { a: u, b: candidate }, line, i, matches) < count {
                    let difference = self.difference(&u, &candidate);
                    if difference.is_finite() && best.is_none_or(|(least, _)| difference < least) {
                        best = Some((difference, candidate));
                    }
                }
            }
        }
        let (least, coarse) = best?;
        let fine = self.refined(&u, &coarse, least);
        let fewer = low < fine.x && fine.x < high && crossings(&Match { a: u, b: fine }, line, i, matches) < count;
        Some(if fewer { fine } else { coarse })
    }

    /// The minimum between whole pixels, by parabolas along both axes.
    fn refined(&mut self, u: &Vec2, coarse: &Vec2, least: f64) -> Vec2 {
        let mut offset = |step: Vec2| {
            let (before, after) = (self.difference(u, &(coarse - step)), self.difference(u, &(coarse + step)));
            let curvature = before - 2.0 * least + after;
            let offset = 0.5 * (before - after) / curvature;
            if curvature > 0.0 && offset.abs() <= 0.5 { offset } else { 0.0 }
        };
        coarse + Vec2::new(offset(Vec2::x()), offset(Vec2::y()))
    }

    /// Sum of squared differences of the windows around a point of `a` and a point of `b`, to the whole pixel between
    /// them; infinite where a window leaves the frame.
    fn difference(&mut self, u: &Vec2, v: &Vec2) -> f64 {
        let (half, side) = ((self.options.window / 2) as isize, self.options.window / 2 * 2 + 1);
        let shift = (v - u).map(|d| d.round());
        let first = u.map(|x| x.round());
        if !self.a.contains(&first, half as f64) || !self.b.contains(&(first + shift), half as f64) {
            return f64::INFINITY;
        }
        let [p, q] = &mut self.windows;
        for (level, at, window) in [(self.a, first, &mut *p), (self.b, first + shift, &mut *q)] {
            level.copy_window(at.x as isize - half, at.y as isize - half, side, side, window);
        }
        p.iter().zip(&*q).map(|(p, q)| f64::from(p - q).powi(2)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::neighbours::tests::{displaced, picture, row_of_points};
    use super::*;

    #[test]
    fn a_planted_cross_match_is_moved_back() {
        let shift = Vec2::new(6.0, 1.0);
        let (a, b) = (picture(Vec2::zeros()), picture(shift));
        let mut matches = displaced(&row_of_points(), shift);
        matches[4].b.x += 35.0;
        let correction = local_adjustment(&a, &b, &matches, &LocalAdjustmentOptions::default()).unwrap();
        assert!(correction.violations_before >= 2);
        assert_eq!(correction.violations_after, 0);
        assert_eq!(correction.outcomes[4], Outcome::Moved(Reason::Order));
        assert!((correction.matches[4].b - matches[4].a - shift).norm() < 0.1, "{:?}", correction.matches[4]);
        assert_eq!(correction.outcomes.iter().filter(|&&outcome| outcome == Outcome::Kept).count(), matches.len() - 1);
    }

    #[test]
    fn every_cross_match_goes_even_when_half_of_a_line_is_wrong() {
        let shift = Vec2::new(4.0, 0.0);
        let (a, b) = (picture(Vec2::zeros()), picture(shift));
        let mut matches = displaced(&row_of_points(), shift);
        for (k, m) in matches.iter_mut().enumerate().filter(|(k, _)| k % 2 == 1) {
            m.b.x += if k % 4 == 1 { 40.0 } else { -45.0 };
        }
        let correction = local_adjustment(&a, &b, &matches, &LocalAdjustmentOptions::default()).unwrap();
        assert!(correction.violations_before > 0);
        assert_eq!(correction.violations_after, 0);
    }

    #[test]
    fn matches_in_order_and_none_at_all_are_left_alone() {
        let (a, shift) = (picture(Vec2::zeros()), Vec2::new(3.0, 0.0));
        let matches = displaced(&row_of_points(), shift);
        let correction = local_adjustment(&a, &a, &matches, &LocalAdjustmentOptions::default()).unwrap();
        assert_eq!(correction.matches, matches);
        assert!(correction.outcomes.iter().all(|&outcome| outcome == Outcome::Kept));
        assert!(local_adjustment(&a, &a, &[], &LocalAdjustmentOptions::default()).unwrap().matches.is_empty());
    }

    #[test]
    fn a_line_without_height_is_refused_and_nan_is_rejected() {
        let a = picture(Vec2::zeros());
        let flat = LocalAdjustmentOptions { band_px: 0.0, ..Default::default() };
        assert!(matches!(local_adjustment(&a, &a, &[], &flat), Err(CorrectError::Option { name: "band_px", .. })));
        let broken = [Match { a: Vec2::new(f64::NAN, 0.0), b: Vec2::zeros() }];
        let correction = local_adjustment(&a, &a, &broken, &LocalAdjustmentOptions::default()).unwrap();
        assert_eq!(correction.outcomes, [Outcome::Rejected(Reason::Missing)]);
    }
}
