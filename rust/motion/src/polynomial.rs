//! Real roots of small polynomials, and their products.

/// Largest number of coefficients: the tenth-degree polynomial of the five-point problem.
const CAPACITY: usize = 11;

/// `product[i + j] += left[i] * right[j]`; coefficients ascend, here and everywhere in this module.
pub(crate) fn add_product<const N: usize>(product: &mut [f64; N], left: &[f64], right: &[f64], factor: f64) {
    for (i, l) in left.iter().enumerate() {
        for (j, r) in right.iter().enumerate() {
            product[i + j] += factor * l * r;
        }
    }
}

/// The value at `x` (Horner).
pub(crate) fn evaluate(coefficients: &[f64], x: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The real roots of a polynomial of degree at most ten, in no particular order.
///
/// Roots outside `-1…1` are found as the inverses of the roots of the reversed polynomial, so that no interval is
/// unbounded. Roots of even multiplicity may be missed.
pub(crate) fn real_roots(coefficients: &[f64]) -> Vec<f64> {
    let mut reversed = [0.0; CAPACITY];
    for (to, from) in reversed.iter_mut().zip(coefficients.iter().rev()) {
        *to = *from;
    }
    let mut roots = roots_in_unit_interval(coefficients);
    let outer = roots_in_unit_interval(&reversed[..coefficients.len()]);
    roots.extend(outer.into_iter().filter(|r| r.abs() < 1.0 && *r != 0.0).map(f64::recip));
    roots
}

/// Between two neighbouring roots of its derivative a polynomial is monotonic: from the linear derivative up, each level's
/// roots bracket those of the next.
fn roots_in_unit_interval(coefficients: &[f64]) -> Vec<f64> {
    let degree = coefficients.len().saturating_sub(1);
    let mut derivatives = [[0.0; CAPACITY]; CAPACITY];
    derivatives[0][..=degree].copy_from_slice(coefficients);
    for k in 1..degree {
        for i in 0..=degree - k {
            derivatives[k][i] = derivatives[k - 1][i + 1] * (i + 1) as f64;
        }
    }
    let (mut roots, mut bounds) = (Vec::with_capacity(degree), Vec::with_capacity(degree + 2));
    for k in (0..degree).rev() {
        bounds.clear();
        bounds.push(-1.0);
        bounds.append(&mut roots);
        bounds.push(1.0);
        let (value, slope) = (&derivatives[k][..=degree - k], &derivatives[k + 1][..degree - k]);
        roots.extend(bounds.windows(2).filter_map(|w| root_between(value, slope, w[0], w[1])));
    }
    roots
}

/// The root of a function monotonic in `low…high`: Newton's method, halving wherever it would leave the bracket.
fn root_between(value: &[f64], slope: &[f64], low: f64, high: f64) -> Option<f64> {
    let (at_low, at_high) = (evaluate(value, low), evaluate(value, high));
    if at_low == 0.0 {
        return Some(low);
    }
    if at_low.signum() == at_high.signum() || !(at_low.is_finite() && at_high.is_finite()) {
        return None;
    }
    let (mut below, mut above) = if at_low < 0.0 { (low, high) } else { (high, low) };
    let mut x = 0.5 * (low + high);
    for _ in 0..80 {
        let y = evaluate(value, x);
        if y < 0.0 {
            below = x
        } else {
            above = x
        }
        let newton = x - y / if value.len() == 2 { value[1] } else { evaluate(slope, x) };
        let inside = (newton - below) * (newton - above) < 0.0;
        let next = if inside { newton } else { 0.5 * (below + above) };
        if (next - x).abs() <= 1e-15 * (1.0 + x.abs()) {
            return Some(next);
        }
        x = next;
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_roots(roots: &[f64]) -> Vec<f64> {
        roots.iter().fold(vec![1.0], |p, r| {
            let mut q = vec![0.0; p.len() + 1];
            for (i, c) in p.iter().enumerate() {
                q[i + 1] += c;
                q[i] -= r * c;
            }
            q
        })
    }

    #[test]
    fn finds_every_simple_root_near_and_far() {
        let truth = [-250.0, -3.0, -0.999, -0.2, 0.1, 0.11, 0.7, 1.5, 40.0, 1000.0];
        let mut found = real_roots(&with_roots(&truth));
        found.sort_by(f64::total_cmp);
        assert_eq!(found.len(), truth.len());
        for (f, t) in found.iter().zip(&truth) {
            assert!((f - t).abs() < 1e-9 * (1.0 + t.abs()), "{f} for {t}");
        }
    }

    #[test]
    fn complex_pairs_are_left_out() {
        // (x² + 1)(x - 0.5)
        let found = real_roots(&[-0.5, 1.0, -0.5, 1.0]);
        assert_eq!(found.len(), 1);
        assert!((found[0] - 0.5).abs() < 1e-14);
    }

    #[test]
    fn constants_and_broken_numbers_have_no_roots() {
        assert!(real_roots(&[3.0]).is_empty());
        assert!(real_roots(&[f64::NAN, 1.0, 2.0]).is_empty());
    }
}
