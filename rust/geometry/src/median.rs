//! The middle of some numbers.

/// The middle value in the order of [`f64::total_cmp`], the upper one of two: always one of the values. `None` of none.
///
/// What the middle of nothing should be, nobody but the caller knows.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_the_middle_value_or_the_upper_one_of_two() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 3.0, 2.0]), Some(3.0));
        assert_eq!(median([]), None);
    }

    #[test]
    fn what_is_no_number_stands_at_the_end() {
        assert_eq!(median([f64::NAN, 1.0, f64::INFINITY, 0.0, 2.0]), Some(2.0));
    }
}
