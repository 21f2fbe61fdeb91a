//! The comparison of derivatives.

use super::Named;
use crate::case::Case;
use crate::design::DerivativeCheck;
use serde::Serialize;

/// Every derivative of a case, found in three ways.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GradientsReport {
    /// Name of the case.
    pub case: String,
    /// Whether all derivatives agree.
    pub agrees: bool,
    /// Largest difference between the two automatic routes, relative to the gradient of the quantity.
    pub worst_route_error: f64,
    /// Largest difference from the finite difference, relative to the gradient of the quantity.
    pub worst_finite_difference_deviation: f64,
    /// A sentence for everything that was mended in the files of the case.
    pub repairs: Vec<String>,
    /// The design at which the derivatives were compared: every variable in its own unit.
    pub variables: Named<f64>,
    /// One entry per quantity and variable.
    pub derivatives: Vec<DerivativeReport>,
}

/// One derivative, found in three ways, and how far they agree.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DerivativeReport {
    /// The derivative and its checks; the keys are `quantity`, `variable`, `exact`, `forward`, `finite_difference` and
    /// `finite_difference_error`.
    #[serde(flatten)]
    pub check: DerivativeCheck,
    /// Difference of the two automatic routes, relative to the gradient of the quantity.
    pub route_error: f64,
    /// Difference from the finite difference, relative to the gradient of the quantity.
    pub finite_difference_deviation: f64,
    /// Whether the three agree.
    pub agrees: bool,
}

impl GradientsReport {
    /// The report of the comparison at `variables`, one value per variable in the unit of each.
    pub fn new(case: &Case, variables: &[f64], checks: &[DerivativeCheck]) -> Self {
        let worst = |measure: fn(&DerivativeCheck) -> f64| checks.iter().map(measure).fold(0.0, f64::max);
        Self {
            case: case.name.clone(),
            agrees: checks.iter().all(DerivativeCheck::agrees),
            worst_route_error: worst(DerivativeCheck::route_error),
            worst_finite_difference_deviation: worst(DerivativeCheck::difference_deviation),
            repairs: case.repairs(),
            variables: Named::by_variable(&case.problem, variables),
            derivatives: checks.iter().map(DerivativeReport::new).collect(),
        }
    }
}

impl DerivativeReport {
    fn new(check: &DerivativeCheck) -> Self {
        Self {
            route_error: check.route_error(),
            finite_difference_deviation: check.difference_deviation(),
            agrees: check.agrees(),
            check: check.clone(),
        }
    }
}
