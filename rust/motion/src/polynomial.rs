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
    if !coefficients.iter().all(|c| c.is_finite()) {
        return Vec::new();
    }
    let mut reversed = [0.0; CAPACITY];
    for (to, from) in reversed.iter_mut().zip(coefficients.iter().rev()) {
        *to = *from;
    }
    let mut roots = roots_in_unit_interval(coefficients);
    let outer = roots_in_unit_interval(&reversed[..coefficients.len()]);
    roots.extend(outer.into_iter().filter(|r| r.abs() < 1.0 && *r != 0.0).map(f64::recip));
    roots
}

/// The roots between -1 and 1: halved apart by Sturm's theorem, then found by Newton's method.
fn roots_in_unit_interval(coefficients: &[f64]) -> Vec<f64> {
    let chain = Sturm::new(coefficients);
    let mut roots = Vec::with_capacity(CAPACITY);
    let mut intervals = vec![(-1.0, chain.changes(-1.0), 1.0, chain.changes(1.0), 0)];
    while let Some((low, at_low, high, at_high, halvings)) = intervals.pop() {
        match at_low.saturating_sub(at_high) {
            0 => {}
            1 => roots.extend(root_between(chain.polynomial(0), chain.slope(), low, high)),
            _ if halvings < HALVINGS => {
                let middle = 0.5 * (low + high);
                let at_middle = chain.changes(middle);
                intervals.push((low, at_low, middle, at_middle, halvings + 1));
                intervals.push((middle, at_middle, high, at_high, halvings + 1));
            }
            _ => {}
        }
    }
    roots
}

/// Roots closer together than two to the minus so many count as one double root.
const HALVINGS: usize = 40;

/// A polynomial, its derivative and the negative remainders of dividing each by the next.
struct Sturm {
    chain: [[f64; CAPACITY]; CAPACITY],
    degrees: [usize; CAPACITY],
    length: usize,
    slope: [f64; CAPACITY],
}

impl Sturm {
    fn new(coefficients: &[f64]) -> Self {
        let degree = coefficients.len().saturating_sub(1);
        let mut sturm =
            Self { chain: [[0.0; CAPACITY]; CAPACITY], degrees: [0; CAPACITY], length: 1, slope: [0.0; CAPACITY] };
        sturm.chain[0][..=degree].copy_from_slice(coefficients);
        sturm.degrees[0] = degree;
        for i in 0..degree {
            sturm.slope[i] = coefficients[i + 1] * (i + 1) as f64;
        }
        if degree == 0 {
            return sturm;
        }
        sturm.chain[1] = scaled(sturm.slope);
        (sturm.degrees[1], sturm.length) = (degree - 1, 2);
        while sturm.degrees[sturm.length - 1] > 0 && sturm.length < CAPACITY {
            let (n, m) = (sturm.length, sturm.degrees[sturm.length - 1]);
            let (remainder, norm) =
                negative_remainder(&sturm.chain[n - 2], sturm.degrees[n - 2], &sturm.chain[n - 1], m);
            // Nothing is left where the polynomial has a double root.
            if norm.is_nan() || norm <= 1e-14 {
                break;
            }
            (sturm.chain[n], sturm.degrees[n], sturm.length) = (scaled(remainder), m - 1, n + 1);
        }
        sturm
    }

    fn polynomial(&self, k: usize) -> &[f64] {
        &self.chain[k][..=self.degrees[k]]
    }

    fn slope(&self) -> &[f64] {
        &self.slope[..self.degrees[0]]
    }

    /// How often the chain's sign changes at `x`.
    fn changes(&self, x: f64) -> usize {
        let (mut changes, mut last) = (0, 0.0);
        for k in 0..self.length {
            let value = evaluate(self.polynomial(k), x);
            changes += usize::from(value * last < 0.0);
            // A zero has no sign: the one before counts on.
            last = if value == 0.0 { last } else { value.signum() };
        }
        changes
    }
}

/// The polynomial over its largest coefficient.
fn scaled(polynomial: [f64; CAPACITY]) -> [f64; CAPACITY] {
    let largest = polynomial.iter().fold(0.0_f64, |largest, c| largest.max(c.abs()));
    if largest > 0.0 { polynomial.map(|c| c / largest) } else { polynomial }
}

/// What is left of dividing by a polynomial one degree lower, with the opposite sign, and its largest coefficient.
fn negative_remainder(of: &[f64; CAPACITY], n: usize, by: &[f64; CAPACITY], m: usize) -> ([f64; CAPACITY], f64) {
    let (mut rest, lead) = (*of, 1.0 / by[m]);
    for k in (m..=n).rev() {
        let factor = rest[k] * lead;
        for i in 0..=m {
            rest[k - m + i] -= factor * by[i];
        }
        rest[k] = 0.0;
    }
    let negative = rest.map(|c| -c);
    (negative, negative.iter().fold(0.0, |largest, c| largest.max(c.abs())))
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
    fn close_roots_are_told_apart_and_a_double_root_does_no_harm() {
        let mut found = real_roots(&with_roots(&[0.3, 0.3 + 1e-5, -0.7]));
        found.sort_by(f64::total_cmp);
        assert_eq!(found.len(), 3);
        assert!((found[1] - 0.3).abs() < 1e-8 && (found[2] - 0.3 - 1e-5).abs() < 1e-8);
        assert!(real_roots(&with_roots(&[0.25, 0.25, -0.5])).iter().any(|r| (r + 0.5).abs() < 1e-9));
    }

    #[test]
    fn constants_and_broken_numbers_have_no_roots() {
        assert!(real_roots(&[3.0]).is_empty());
        assert!(real_roots(&[f64::NAN, 1.0, 2.0]).is_empty());
    }
}
