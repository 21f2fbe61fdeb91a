//! One evaluation of a case, and the list of cases.

use super::Named;
use crate::case::{Case, CaseEvaluation};
use crate::design::Problem;
use serde::Serialize;

/// One evaluation of a case at a design.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvaluationReport {
    /// The design: every variable in its own unit.
    pub variables: Named<f64>,
    /// The objective.
    pub objective: f64,
    /// Every quantity of objective, constraints and report.
    pub values: Named<f64>,
    /// Derivatives of every value in every variable, by the names of both; absent where they were not asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gradients: Option<Named<Named<f64>>>,
    /// Smallest fold indicator of the box; `None` without a box.
    pub min_fold_indicator: Option<f64>,
    /// Whether the box has folded; `None` without a box.
    pub folded: Option<bool>,
}

impl EvaluationReport {
    /// The report of an evaluation of `case`.
    pub fn new(case: &Case, evaluation: &CaseEvaluation) -> Self {
        let names = &case.problem.description().value_names;
        let gradients = evaluation.gradients.as_ref();
        Self {
            variables: Named::by_variable(&case.problem, &evaluation.variables),
            objective: evaluation.objective,
            values: Named::new(names, evaluation.values.iter().copied()),
            gradients: gradients.map(|g| Named::new(names, g.iter().map(|g| Named::by_variable(&case.problem, g)))),
            min_fold_indicator: evaluation.fold.map(|f| f.smallest_indicator),
            folded: evaluation.fold.map(|f| f.folded),
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
