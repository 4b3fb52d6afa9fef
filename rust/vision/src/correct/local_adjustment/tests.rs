use super::*;
use crate::correct::neighbours::tests::{displaced, picture, row_of_points};

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

#[test]
fn points_that_fall_together_are_a_cross_match() {
    let shift = Vec2::new(6.0, 1.0);
    let (a, b) = (picture(Vec2::zeros()), picture(shift));
    let mut matches = displaced(&row_of_points(), shift);
    matches[4].b = matches[5].b;
    let correction = local_adjustment(&a, &b, &matches, &LocalAdjustmentOptions::default()).unwrap();
    assert_eq!((correction.violations_before, correction.violations_after), (1, 0));
    assert_eq!(correction.outcomes[4], Outcome::Moved(Reason::Order));
    assert!((correction.matches[4].b - matches[4].a - shift).norm() < 0.1, "{:?}", correction.matches[4]);
}

#[test]
fn a_lost_point_is_found_between_its_neighbours() {
    let shift = Vec2::new(6.0, 1.0);
    let (a, b) = (picture(Vec2::zeros()), picture(shift));
    let mut matches = displaced(&row_of_points(), shift);
    for i in [0, 4, 5] {
        matches[i] = Match::missing(matches[i].a);
    }
    let correction = local_adjustment(&a, &b, &matches, &LocalAdjustmentOptions::default()).unwrap();
    for i in [0, 4, 5] {
        assert_eq!(correction.outcomes[i], Outcome::Moved(Reason::Missing));
        assert!((correction.matches[i].b - matches[i].a - shift).norm() < 0.1, "{:?}", correction.matches[i]);
    }
}

#[test]
fn a_match_that_keeps_its_order_but_leaves_its_range_is_moved_back() {
    let shift = Vec2::new(6.0, 1.0);
    let (a, b) = (picture(Vec2::zeros()), picture(shift));
    let mut matches = displaced(&row_of_points(), shift);
    matches[4].b.x += 10.0;
    let correction = local_adjustment(&a, &b, &matches, &LocalAdjustmentOptions::default()).unwrap();
    assert_eq!(correction.violations_before, 0);
    assert!(matches!(correction.outcomes[4], Outcome::Moved(Reason::Residual | Reason::Appearance)));
    assert!((correction.matches[4].b - matches[4].a - shift).norm() < 0.1, "{:?}", correction.matches[4]);
}

#[test]
fn columns_are_lines_too() {
    let shift = Vec2::new(1.0, 6.0);
    let (a, b) = (picture(Vec2::zeros()), picture(shift));
    let column: Vec<Vec2> = (0..8).map(|i| Vec2::new(110.0 + f64::from(i % 3), 25.0 + 15.0 * f64::from(i))).collect();
    let mut matches = displaced(&column, shift);
    matches[3].b.y += 35.0;
    let correction = local_adjustment(&a, &b, &matches, &LocalAdjustmentOptions::default()).unwrap();
    assert!(correction.violations_before >= 2);
    assert_eq!(correction.violations_after, 0);
    assert!((correction.matches[3].b - matches[3].a - shift).norm() < 0.1, "{:?}", correction.matches[3]);
}

#[test]
fn true_matches_and_lines_of_one_or_two_points_are_unchanged() {
    let shift = Vec2::new(6.0, 1.0);
    let (a, b) = (picture(Vec2::zeros()), picture(shift));
    for (to, shift) in [(&a, Vec2::zeros()), (&b, shift)] {
        for count in [1, 2, 12] {
            let matches = displaced(&row_of_points()[..count], shift);
            let correction = local_adjustment(&a, to, &matches, &LocalAdjustmentOptions::default()).unwrap();
            assert_eq!(correction.matches, matches);
            assert!(correction.outcomes.iter().all(|&outcome| outcome == Outcome::Kept));
        }
    }
}

#[test]
fn a_lost_point_without_neighbours_stays_lost() {
    let a = picture(Vec2::zeros());
    let lost = [Match::missing(Vec2::new(60.0, 60.0))];
    let correction = local_adjustment(&a, &a, &lost, &LocalAdjustmentOptions::default()).unwrap();
    assert_eq!(correction.outcomes, [Outcome::Rejected(Reason::Missing)]);
}
