//! A soft threshold.

/// 0 at `from` and before it, 1 at `to` and beyond, smooth between; `from` may be the larger one.
pub fn smooth_step(from: f64, to: f64, x: f64) -> f64 {
    let t = ((x - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::smooth_step;

    #[test]
    fn it_rises_from_one_end_to_the_other_whichever_is_larger() {
        assert_eq!([1.0, 2.0, 3.0, 4.0, 5.0].map(|x| smooth_step(2.0, 4.0, x)), [0.0, 0.0, 0.5, 1.0, 1.0]);
        assert_eq!([1.0, 2.0, 3.0, 4.0, 5.0].map(|x| smooth_step(4.0, 2.0, x)), [1.0, 1.0, 0.5, 0.0, 0.0]);
    }
}
