//! `result.json`: the end of a run.

use super::Named;
use crate::case::{Case, CaseOutcome};
use crate::design::Problem;
use crate::optimize::{Optimizer, Termination};
use serde::Serialize;

/// The end of a run of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunReport {
    /// Name of the case.
    pub case: String,
    /// Name of the optimiser.
    pub optimizer: &'static str,
    /// Why the run ended.
    pub status: Termination,
    /// The reason in a sentence with numbers.
    pub message: String,
    /// Evaluations of the problem, failed ones included.
    pub evaluations: usize,
    /// How many evaluations failed.
    pub failed_evaluations: usize,
    /// Iterations of the optimiser.
    pub iterations: usize,
    /// Wall-clock time of the run in seconds.
    pub seconds: f64,
    /// Objective of the best design; `None` where the start could not be evaluated.
    pub objective: Option<f64>,
    /// Value of every quantity of objective, constraints and report at the best design.
    pub values: Named<Option<f64>>,
    /// The constraints by the name of their quantity.
    pub constraints: Named<ConstraintReport>,
    /// How far the best design is from the first-order conditions: see
    /// [`Outcome::kkt_residual`](crate::optimize::Outcome::kkt_residual).
    pub kkt_residual: f64,
    /// The best design: every variable in its own unit.
    pub variables: Named<f64>,
    /// Smallest fold indicator of the box; `None` without a box.
    pub min_fold_indicator: Option<f64>,
    /// Whether the box has folded; `None` without a box.
    pub folded: Option<bool>,
    /// Whether the section crosses itself.
    pub self_intersecting: bool,
}

/// A constraint at the best design.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ConstraintReport {
    /// Value of the quantity.
    pub value: Option<f64>,
    /// Smallest allowed value.
    pub lower: Option<f64>,
    /// Largest allowed value.
    pub upper: Option<f64>,
    /// How far the value lies outside of the bounds, 0 inside.
    pub violation: Option<f64>,
    /// Change of the optimal objective per unit of the bound that is reached: positive at a lower bound, negative at
    /// an upper one.
    pub multiplier: Option<f64>,
}

impl RunReport {
    /// The report of a run of `case`.
    pub fn new(case: &Case, end: &CaseOutcome) -> Self {
        let (outcome, problem) = (&end.outcome, case.problem.description());
        let evaluation = outcome.evaluation.as_ref();
        let finite = |v: f64| v.is_finite().then_some(v);
        let constraint = |(k, bounds): (usize, &crate::design::Bounds)| {
            let value = evaluation.map(|e| e.constraints[k]);
            ConstraintReport {
                value,
                lower: finite(bounds.lower),
                upper: finite(bounds.upper),
                violation: value.map(|v| bounds.violation(v)),
                multiplier: outcome.multipliers.get(k).copied(),
            }
        };
        let value = |k: usize| evaluation.map(|e| e.values[k]);
        Self {
            case: case.name.clone(),
            optimizer: case.method.name(),
            status: outcome.status,
            message: outcome.message.clone(),
            evaluations: outcome.evaluations,
            failed_evaluations: outcome.failures,
            iterations: outcome.iterations,
            seconds: outcome.seconds,
            objective: evaluation.map(|e| e.objective),
            values: Named::new(&problem.value_names, (0..problem.value_names.len()).map(value)),
            constraints: Named::new(
                &problem.constraint_names,
                problem.constraint_bounds.iter().enumerate().map(constraint),
            ),
            kkt_residual: outcome.kkt_residual,
            variables: Named::by_variable(&case.problem, &end.variables),
            min_fold_indicator: end.fold.map(|f| f.smallest_indicator),
            folded: end.fold.map(|f| f.folded),
            self_intersecting: end.shape.section.self_intersection().is_some(),
        }
    }
}
