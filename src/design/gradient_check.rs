//! Comparison of the exact derivatives of a problem with a second automatic route and with finite differences.

use super::{DesignError, DesignProblem, Quantity};
use crate::differentiate::{StepRange, finite_difference_jacobian};
use num_dual::Dual64;

/// One derivative, three ways.
#[derive(Debug, Clone, PartialEq)]
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
    pub difference: f64,
    /// Its own estimate of its error.
    pub difference_error: f64,
    /// Norm of the quantity's gradient (variables in units of their step), for judging small entries.
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

/// Checks every quantity against every variable at the given variables (their own units).
///
/// # Errors
/// A shape or quantity that has no value, at the point or a finite step away.
pub fn check_gradients(problem: &mut DesignProblem, values: &[f64]) -> Result<Vec<DerivativeCheck>, DesignError> {
    let exact = problem.gradients(values)?;
    let forward: Vec<Vec<f64>> = (0..values.len())
        .map(|k| {
            let seeded: Vec<Dual64> =
                values.iter().enumerate().map(|(i, &v)| Dual64::new(v, if i == k { 1.0 } else { 0.0 })).collect();
            Ok(problem.quantities_at(&seeded)?.iter().map(|v| v.eps).collect())
        })
        .collect::<Result<_, DesignError>>()?;
    let steps: Vec<StepRange> = problem.steps().into_iter().map(StepRange::for_scale).collect();
    let differences = finite_difference_jacobian(|x| problem.quantities_at(x), values, &steps)?;
    let mut checks = Vec::new();
    for (q, quantity) in problem.quantities().iter().enumerate() {
        let gradient = &exact[q].1;
        // the largest change any one variable makes over its step, brought back to the unit of each variable
        // (a quantity that nothing moves is judged by its size)
        // a coefficient that vanishes by symmetry is judged by the unit it has
        let unit = if matches!(quantity, Quantity::Flow(_)) { 100.0 } else { exact[q].0.abs() };
        let still = 1e-6 * unit;
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
