//! One evaluation of a case, and the list of cases.

use super::named::without_value;
use super::run::constraint_reports;
use super::{ConstraintReport, Named, identifiers};
use crate::case::{Case, CaseEvaluation};
use crate::design::{Bounds, Problem, Variable};
use serde::Serialize;

/// One evaluation of a case at a design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvaluationReport {
    /// The design: every variable in its own unit.
    pub variables: Named<f64>,
    /// The objective.
    pub objective: f64,
    /// Every quantity of objective, constraints and report; `None` for one that is only reported and has no value.
    pub values: Named<Option<f64>>,
    /// The reason for every quantity that has no value.
    pub without_value: Named<String>,
    /// Derivatives of every value in every variable, by the names of both; absent where they were not asked for, `None`
    /// for a quantity that is only reported and has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gradients: Option<Named<Option<Named<f64>>>>,
    /// Smallest fold indicator of the box; `None` without a box.
    pub min_fold_indicator: Option<f64>,
    /// Whether the box has folded; `None` without a box.
    pub folded: Option<bool>,
    /// Whether the section crosses itself.
    pub self_intersecting: bool,
    /// A sentence for everything that was mended in the files of the case.
    pub repairs: Vec<String>,
    /// Start of every variable, in its own unit.
    pub start: Named<f64>,
    /// Bounds of every variable, in its own unit.
    pub bounds: Named<BoundsReport>,
    /// Change of every variable that its optimisers see as one, in its own unit.
    pub scales: Named<f64>,
    /// Weight of every value in the objective, which is the weighted sum.
    pub weights: Named<f64>,
    /// The constraints with their bounds as numbers, by the name of their quantity.
    pub constraints: Named<ConstraintReport>,
    /// For every name a name that programming languages accept.
    pub identifiers: Named<String>,
}

/// Bounds; `None` where there is none.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BoundsReport {
    /// Smallest allowed value.
    pub lower: Option<f64>,
    /// Largest allowed value.
    pub upper: Option<f64>,
}

impl From<Bounds> for BoundsReport {
    fn from(bounds: Bounds) -> Self {
        let finite = |v: f64| v.is_finite().then_some(v);
        Self { lower: finite(bounds.lower), upper: finite(bounds.upper) }
    }
}

impl EvaluationReport {
    /// The report of an evaluation of `case`.
    pub fn new(case: &Case, evaluation: &CaseEvaluation) -> Self {
        let description = case.problem.description();
        let names = &description.value_names;
        let variables = case.problem.geometry().variables();
        let by_variable = |of: &dyn Fn(&Variable) -> f64| {
            Named::new(variables.iter().map(|v| v.name.as_str()), variables.iter().map(of))
        };
        let numbers: Vec<Option<f64>> = evaluation.values.iter().map(|value| value.as_ref().ok().copied()).collect();
        let value = |name: &String| names.iter().position(|n| n == name).and_then(|k| numbers[k]);
        let slopes = |g: &Option<Vec<f64>>| g.as_ref().map(|g| Named::by_variable(&case.problem, g));
        let constrained: Vec<Option<f64>> = description.constraint_names.iter().map(value).collect();
        let gradients = evaluation.gradients.as_ref();
        Self {
            variables: Named::by_variable(&case.problem, &evaluation.variables),
            objective: evaluation.objective,
            values: Named::new(names, numbers),
            without_value: without_value(names, &evaluation.values),
            gradients: gradients.map(|g| Named::new(names, g.iter().map(slopes))),
            min_fold_indicator: evaluation.fold.map(|f| f.smallest_indicator),
            folded: evaluation.fold.map(|f| f.folded),
            self_intersecting: evaluation.self_intersecting,
            repairs: case.repairs(),
            start: by_variable(&|v| v.start),
            bounds: Named::new(&description.variable_names, variables.iter().map(|v| BoundsReport::from(v.bounds))),
            scales: by_variable(&|v| v.scale),
            weights: Named::new(names, case.problem.objective_weights().iter().copied()),
            constraints: constraint_reports(description, &constrained, &[]),
            identifiers: identifiers(names.iter().chain(&description.variable_names).map(String::as_str)),
        }
    }
}

/// The built-in cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseList {
    /// One entry per case.
    pub cases: Vec<CaseEntry>,
}

/// A built-in case in a list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CaseEntry {
    /// Name of the case.
    pub name: String,
    /// One sentence on the case.
    pub description: String,
    /// Number of design variables.
    pub variables: usize,
}
