//! Comparison of the exact derivatives of a problem with a second automatic route and with finite differences.

use super::{DesignError, DesignProblem, Quantity, ValueAndGradient};
use crate::differentiate::{StepRange, finite_difference_jacobian};
use num_dual::Dual64;

/// One derivative, found in three ways.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct DerivativeCheck {
    /// Name of the quantity.
    pub quantity: String,
    /// Name of the variable.
    pub variable: String,
    /// The derivative that optimisers use: local duals carried back through the linear maps.
    pub exact: f64,
    /// Plain forward mode through the whole pipeline, one variable at a time.
    pub forward: f64,
    /// Extrapolated finite difference.
    #[serde(rename = "finite_difference")]
    pub difference: f64,
    /// Error of the finite difference, as its own extrapolation estimates it.
    #[serde(rename = "finite_difference_error")]
    pub difference_error: f64,
    /// Norm of the quantity's gradient (variables in units of their step), for judging small entries.
    #[serde(skip)]
    pub scale: f64,
}

impl DerivativeCheck {
    /// |exact − forward| relative to the gradient of the quantity.
    pub fn route_error(&self) -> f64 {
        relative(self.exact - self.forward, self.scale)
    }

    /// |exact − difference| relative to the gradient of the quantity.
    pub fn difference_deviation(&self) -> f64 {
        relative(self.exact - self.difference, self.scale)
    }

    /// Whether the two automatic routes agree to 1e-12 of the gradient, and the difference within its own estimate
    /// (or 1e-9 of the gradient, where the estimate is smaller still).
    pub fn agrees(&self) -> bool {
        let allowed = self.difference_error.max(1e-9 * self.scale);
        self.route_error() <= 1e-12 && (self.exact - self.difference).abs() <= allowed
    }
}

fn relative(difference: f64, scale: f64) -> f64 {
    if difference == 0.0 { 0.0 } else { difference.abs() / scale }
}

/// Checks every quantity against every variable at the given variables (their own units); a quantity that is only
/// reported and has no gradient there is left out.
///
/// # Errors
/// A shape or quantity of objective or constraints that has no value, at the point or a finite step away.
pub fn check_gradients(problem: &mut DesignProblem, values: &[f64]) -> Result<Vec<DerivativeCheck>, DesignError> {
    let exact = problem.gradients(values)?;
    let forward = (0..values.len()).map(|k| forward_derivatives(problem, values, k)).collect::<Result<Vec<_>, _>>()?;
    compare(problem, values, &exact, &forward)
}

/// Derivatives of all quantities in variable `k`, by plain forward mode through the whole pipeline.
fn forward_derivatives(problem: &DesignProblem, values: &[f64], k: usize) -> Result<Vec<f64>, DesignError> {
    let seed = |(i, &v): (usize, &f64)| Dual64::new(v, if i == k { 1.0 } else { 0.0 });
    let seeded: Vec<Dual64> = values.iter().enumerate().map(seed).collect();
    Ok(problem.quantities_at(&seeded)?.iter().map(|v| v.eps).collect())
}

/// Compares value and gradient of every quantity (`exact`), and the derivatives of all quantities in every variable
/// (`forward`), with finite differences of the quantities.
fn compare(
    problem: &DesignProblem,
    values: &[f64],
    exact: &[Option<ValueAndGradient>],
    forward: &[Vec<f64>],
) -> Result<Vec<DerivativeCheck>, DesignError> {
    let steps: Vec<StepRange> = problem.steps().into_iter().map(StepRange::for_scale).collect();
    let differences = finite_difference_jacobian(|x| problem.quantities_at(x), values, &steps)?;
    let mut checks = Vec::new();
    for (q, (quantity, exact)) in problem.quantities().iter().zip(exact).enumerate() {
        let Some((value, gradient)) = exact else { continue };
        // a coefficient that vanishes by symmetry is judged by the unit it has
        let unit = if matches!(quantity, Quantity::Flow(_)) { 100.0 } else { value.abs() };
        // a quantity that nothing moves is judged by its size
        let still = 1e-6 * unit;
        // the largest change any one variable makes over its step, brought back to the unit of each variable
        let reach = gradient.iter().zip(&steps).fold(still, |m: f64, (g, s)| m.max((g * s.first).abs()));
        for (k, variable) in problem.geometry().variables().iter().enumerate() {
            checks.push(DerivativeCheck {
                quantity: quantity.name(),
                variable: variable.name.clone(),
                exact: gradient[k],
                forward: forward[k][q],
                difference: differences[(q, k)].value,
                difference_error: differences[(q, k)].error,
                scale: reach / steps[k].first,
            });
        }
    }
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::Case;

    /// A linear and a nonlinear geometry, a little off the start.
    fn problems() -> [(DesignProblem, Vec<f64>); 2] {
        ["mirrored", "l2-mixed"].map(|name| {
            let problem = Case::open(name).unwrap().problem;
            let shaken = problem.start_values().into_iter().zip(problem.steps()).enumerate();
            let values = shaken.map(|(k, (v, step))| v + 0.05 * step * (3.1 * k as f64).sin()).collect();
            (problem, values)
        })
    }

    /// Plants an error in one derivative and gives the checks that disagree.
    fn planted(plant: impl Fn(&mut f64, &mut f64)) {
        for (mut problem, values) in problems() {
            let mut exact = problem.gradients(&values).unwrap();
            let mut forward: Vec<Vec<f64>> =
                (0..values.len()).map(|k| forward_derivatives(&problem, &values, k).unwrap()).collect();
            let sound = compare(&problem, &values, &exact, &forward).unwrap();
            assert!(sound.iter().all(DerivativeCheck::agrees));
            let (q, k) = (exact.len() - 1, values.len() / 2);
            plant(&mut exact[q].as_mut().unwrap().1[k], &mut forward[k][q]);
            let checks = compare(&problem, &values, &exact, &forward).unwrap();
            let disagreeing: Vec<usize> = (0..checks.len()).filter(|&c| !checks[c].agrees()).collect();
            assert_eq!(disagreeing, [q * values.len() + k], "{:?}", checks[q * values.len() + k]);
        }
    }

    #[test]
    fn a_wrong_exact_derivative_is_caught_by_the_second_route() {
        planted(|exact, _| *exact *= 1.0 + 1e-6);
        planted(|exact, _| *exact = -*exact);
        planted(|_, forward| *forward *= 1.0 + 1e-6);
    }

    #[test]
    fn a_derivative_that_is_wrong_in_both_routes_is_caught_by_the_finite_difference() {
        planted(|exact, forward| {
            *exact *= 1.0 + 1e-4;
            *forward = *exact;
        });
        planted(|exact, forward| (*exact, *forward) = (0.0, 0.0));
    }

    #[test]
    fn a_derivative_that_is_no_number_is_caught() {
        planted(|exact, _| *exact = f64::NAN);
        planted(|exact, forward| (*exact, *forward) = (f64::NAN, f64::NAN));
    }
}
