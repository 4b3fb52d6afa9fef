//! Robust losses and a dense Levenberg–Marquardt driver.
//!
//! The driver sees normal equations only, so that each problem sums its own structure (blocks, Schur complements,
//! parallel parts in a fixed order) the way that suits it.

use nalgebra::{DMatrix, DVector};

/// A robust loss on a squared residual that was divided by its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Loss {
    /// Plain least squares.
    Squared,
    /// Linear beyond the given number of standard deviations.
    Huber(f64),
    /// Logarithmic beyond the given number of standard deviations.
    Cauchy(f64),
}

impl Loss {
    /// The loss of a squared residual, and its derivative: the weight of iteratively re-weighted least squares.
    #[inline]
    pub fn evaluate(self, squared: f64) -> (f64, f64) {
        match self {
            Self::Squared => (squared, 1.0),
            Self::Huber(limit) => {
                if squared <= limit * limit {
                    return (squared, 1.0);
                }
                let r = squared.sqrt();
                (2.0 * limit * r - limit * limit, limit / r)
            }
            Self::Cauchy(limit) => {
                let s = squared / (limit * limit);
                (limit * limit * s.ln_1p(), 1.0 / (1.0 + s))
            }
        }
    }
}

/// What one linearisation of a problem gives: `cost = Σ ρ(r²)`, `hessian = Jᵀ W J`, `gradient = Jᵀ W r`.
pub struct NormalEquations {
    /// Sum of the losses.
    pub cost: f64,
    /// `n × n`, symmetric.
    pub hessian: DMatrix<f64>,
    /// `n`.
    pub gradient: DVector<f64>,
}

/// A problem for [`minimise`].
pub trait Problem {
    /// The unknowns.
    type State: Clone;
    /// Linearises at a state.
    fn linearise(&self, state: &Self::State) -> NormalEquations;
    /// Cost alone, cheaper than [`Problem::linearise`].
    fn cost(&self, state: &Self::State) -> f64 {
        self.linearise(state).cost
    }
    /// The state after a step of the unknowns.
    fn retract(&self, state: &Self::State, step: &DVector<f64>) -> Self::State;
}

/// When to stop and how carefully to begin.
#[derive(Clone, Copy, Debug)]
pub struct MinimiseOptions {
    /// At most this many accepted steps.
    pub max_iterations: usize,
    /// Stop when a step lowers the cost by less than this part of it.
    pub relative_cost: f64,
    /// First damping, relative to the Hessian's diagonal.
    pub damping: f64,
}

impl Default for MinimiseOptions {
    fn default() -> Self {
        Self { max_iterations: 50, relative_cost: 1e-10, damping: 1e-4 }
    }
}

/// What [`minimise`] found.
pub struct Minimum<S> {
    /// The unknowns at the end.
    pub state: S,
    /// Cost at the end.
    pub cost: f64,
    /// Accepted steps.
    pub iterations: usize,
    /// Whether it stopped by its own tolerance.
    pub converged: bool,
}

/// Minimises by Levenberg–Marquardt with Marquardt's diagonal scaling and Nielsen's damping update.
pub fn minimise<P: Problem>(problem: &P, start: P::State, options: &MinimiseOptions) -> Minimum<P::State> {
    let mut state = start;
    let mut equations = problem.linearise(&state);
    let (mut damping, mut growth) = (options.damping, 2.0);
    let (mut iterations, mut converged) = (0, false);
    while iterations < options.max_iterations && !converged {
        let Some(step) = damped_step(&equations, damping) else {
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                break;
            }
            continue;
        };
        let candidate = problem.retract(&state, &step);
        let cost = problem.cost(&candidate);
        let predicted = -2.0 * step.dot(&equations.gradient) - step.dot(&(&equations.hessian * &step));
        let ratio = (equations.cost - cost) / predicted.max(f64::MIN_POSITIVE);
        if cost.is_finite() && ratio > 0.0 {
            converged = equations.cost - cost <= options.relative_cost * equations.cost;
            state = candidate;
            equations = problem.linearise(&state);
            iterations += 1;
            damping = (damping * (1.0 - (2.0 * ratio - 1.0).powi(3)).max(1.0 / 3.0)).max(1e-14);
            growth = 2.0;
        } else {
            converged = predicted <= options.relative_cost * equations.cost;
            damping *= growth;
            growth *= 2.0;
            if damping > 1e12 {
                break;
            }
        }
    }
    Minimum { cost: equations.cost, state, iterations, converged }
}

fn damped_step(equations: &NormalEquations, damping: f64) -> Option<DVector<f64>> {
    let mut matrix = equations.hessian.clone();
    let floor = matrix.diagonal().max() * 1e-12 + f64::MIN_POSITIVE;
    for i in 0..matrix.nrows() {
        matrix[(i, i)] += damping * matrix[(i, i)].max(floor);
    }
    let step = -matrix.cholesky()?.solve(&equations.gradient);
    step.iter().all(|v| v.is_finite()).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Rosenbrock;

    impl Problem for Rosenbrock {
        type State = DVector<f64>;
        fn linearise(&self, x: &DVector<f64>) -> NormalEquations {
            let r = DVector::from_vec(vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]]);
            let j = DMatrix::from_row_slice(2, 2, &[-20.0 * x[0], 10.0, -1.0, 0.0]);
            NormalEquations { cost: r.norm_squared(), hessian: j.transpose() * &j, gradient: j.transpose() * r }
        }
        fn retract(&self, x: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
            x + step
        }
    }

    #[test]
    fn finds_the_bottom_of_the_banana_valley() {
        let found = minimise(&Rosenbrock, DVector::from_vec(vec![-1.2, 1.0]), &MinimiseOptions::default());
        assert!(found.converged && (found.state - DVector::from_element(2, 1.0)).norm() < 1e-8);
    }

    #[test]
    fn losses_are_quadratic_near_zero_and_their_weights_are_derivatives() {
        for loss in [Loss::Squared, Loss::Huber(1.5), Loss::Cauchy(2.0)] {
            assert!((loss.evaluate(1e-6).0 - 1e-6).abs() < 1e-11);
            let (s, h) = (7.0, 1e-5);
            let numeric = (loss.evaluate(s + h).0 - loss.evaluate(s - h).0) / (2.0 * h);
            assert!((numeric - loss.evaluate(s).1).abs() < 1e-8, "{loss:?}");
        }
    }
}
