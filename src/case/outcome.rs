//! Results of a case: the end of a run, and a single evaluation.

use crate::design::{DesignError, Shape};
use crate::ffd::FoldReport;
use crate::optimize::{OptimizeError, Outcome};

/// The end of a run of a case.
#[derive(Debug, Clone)]
pub struct CaseOutcome {
    /// Report of the optimiser, in scaled variables.
    pub outcome: Outcome,
    /// The best design: one value per variable, in the order of
    /// [`Geometry::variables`](crate::design::Geometry::variables) and in the unit of each.
    pub variables: Vec<f64>,
    /// The section and the box of the best design.
    pub shape: Shape,
    /// Whether the box has folded; `None` where the case has no box.
    pub fold: Option<FoldReport>,
}

/// One evaluation of a case.
#[derive(Debug, Clone, PartialEq)]
pub struct CaseEvaluation {
    /// The design, one value per variable in the unit of each.
    pub variables: Vec<f64>,
    /// The objective: the weighted sum of the values.
    pub objective: f64,
    /// One value per quantity, in the order of [`DesignProblem::quantities`](crate::design::DesignProblem::quantities),
    /// or the reason why one that is only reported has none.
    pub values: Vec<Result<f64, DesignError>>,
    /// Exact derivatives, where they were asked for: one row per quantity, one entry per variable; `None` for a
    /// quantity that is only reported and has no gradient.
    pub gradients: Option<Vec<Option<Vec<f64>>>>,
    /// Whether the box has folded; `None` where the case has no box.
    pub fold: Option<FoldReport>,
    /// Whether the section crosses itself.
    pub self_intersecting: bool,
}

/// A case that could not be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RunError {
    /// The method cannot take the problem, or a setting is out of its range.
    #[error(transparent)]
    Optimize(#[from] OptimizeError),
    /// The design that the run ended at has no shape.
    #[error(transparent)]
    Design(#[from] DesignError),
}
