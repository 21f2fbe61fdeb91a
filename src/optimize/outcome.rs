//! Progress of a run, its outcome, and the errors of problems and settings.

use crate::design::{AnalysisFailure, Bounds, Evaluation, Problem};
use std::fmt;

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum Termination {
    /// A tolerance is met: the point is a minimum to that tolerance.
    #[serde(rename = "converged")]
    Converged,
    /// The iterations allowed are used up.
    #[serde(rename = "iteration limit")]
    IterationLimit,
    /// The evaluations allowed are used up.
    #[serde(rename = "evaluation limit")]
    EvaluationLimit,
    /// No step lowers the objective any more, at the precision it is computed with, though no tolerance is met.
    #[serde(rename = "stalled")]
    Stalled,
    /// No design meets all constraints as far as the run could see: every way to reduce one violation is barred.
    #[serde(rename = "infeasible")]
    Infeasible,
    /// The analysis fails at the start, or at every step from the best point.
    #[serde(rename = "failed")]
    Failed,
    /// The observer ended the run.
    #[serde(rename = "interrupted")]
    Interrupted,
}

impl Termination {
    /// The stable text of the status, as it stands in reports.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::IterationLimit => "iteration limit",
            Self::EvaluationLimit => "evaluation limit",
            Self::Stalled => "stalled",
            Self::Infeasible => "infeasible",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        }
    }
}

impl fmt::Display for Termination {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// The end of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// Why the run ended.
    pub status: Termination,
    /// The reason in a sentence with numbers.
    pub message: String,
    /// The best point (length n); the start where nothing could be evaluated. With constraints the best is the lowest
    /// objective among the points that meet them, and the least violation where none does.
    pub x: Vec<f64>,
    /// The evaluation at `x`; `None` where the analysis failed at the start.
    pub evaluation: Option<Evaluation>,
    /// Evaluations of the problem at distinct points, failed ones included.
    pub evaluations: usize,
    /// Number of evaluations that failed.
    pub failures: usize,
    /// Hessians asked for.
    pub hessians: usize,
    /// Iterations of the method.
    pub iterations: usize,
    /// How far `x` is from satisfying the first-order conditions (Karush, Kuhn and Tucker): the largest entry of the
    /// gradient of the Lagrangian `objective − Σ multiplier · constraint` by [natural steps](Problem::natural_steps) of
    /// the variables, for a variable closer to its bound than a step times that distance. The methods that take
    /// constraints divide it by a hundred times the objective: it is then the relative change of the objective that a
    /// hundredth of a natural step could still bring, whatever the scale of objective and variables. (Where the
    /// objective is next to nothing, or large against its gradient, the gradient serves.) NaN where there is no
    /// evaluation.
    pub kkt_residual: f64,
    /// Euclidean norm of that gradient, not divided by anything. NaN where there is no evaluation.
    pub gradient_norm: f64,
    /// For each constraint the derivative of the optimal objective with respect to the bound that is reached:
    /// positive at a lower bound, negative at an upper one, 0 where none is reached. They are those that fit the
    /// gradients at `x` best, from the point alone. Empty where there is no evaluation.
    pub multipliers: Vec<f64>,
    /// For each variable the derivative of the optimal objective with respect to the bound that holds it, in scaled
    /// variables: positive at a lower bound, negative at an upper one, 0 where no bound holds the variable. Empty where
    /// there is no evaluation.
    pub bound_multipliers: Vec<f64>,
    /// Largest violation of a constraint at `x`; 0 without constraints, NaN where there is no evaluation.
    pub violation: f64,
    /// Wall-clock time of the run in seconds.
    pub seconds: f64,
}

/// One evaluation, as an observer sees it.
#[derive(Debug, Clone, Copy)]
pub struct Progress<'a> {
    /// Number of this evaluation, from 1.
    pub evaluation: usize,
    /// Iterations completed.
    pub iteration: usize,
    /// The point (length n), in the variables of the problem.
    pub x: &'a [f64],
    /// The evaluation, or why there is none.
    pub result: Result<&'a Evaluation, &'a AnalysisFailure>,
    /// Objective of the best point so far, this one included; +∞ before the first success.
    pub best_objective: f64,
    /// Largest violation of a constraint, 0 without constraints; NaN for a failed evaluation.
    pub violation: f64,
    /// Euclidean norm of the gradient of the Lagrangian as in [`Outcome::gradient_norm`]; NaN for a failed evaluation.
    pub gradient_norm: f64,
    /// Euclidean distance from the best point before this evaluation; 0 for the first.
    pub step: f64,
    /// Seconds since the run began.
    pub seconds: f64,
    /// The most evaluations the run may take.
    pub evaluation_limit: usize,
    /// Whether the evaluation samples the neighbourhood of the current design for its curvature and is no trial step;
    /// such an evaluation has no `gradient_norm`.
    pub sampling: bool,
    /// Whether this is the best design so far.
    pub improved: bool,
}

/// A problem or a setting that a method cannot take.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OptimizeError {
    /// There is no method of that name.
    #[error("unknown method {name:?}; known: {}", known.join(", "))]
    UnknownMethod {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: [&'static str; 5],
    },
    /// The method takes no constraints.
    #[error(
        "method \"{method}\" takes no constraints, and the problem has {count} (first: \"{first}\"); add them to the objective or use method \"sqp\" or \"slsqp\""
    )]
    ConstraintsNotSupported {
        /// Name of the method.
        method: &'static str,
        /// How many constraints there are.
        count: usize,
        /// Name of the first constraint.
        first: String,
    },
    /// The matrices of the method would fill the memory.
    #[error(
        "method \"{method}\" takes at most {most} variables, and the problem has {variables}; free fewer of them, or use \"lbfgs\""
    )]
    TooManyVariables {
        /// Name of the method.
        method: &'static str,
        /// Number of variables.
        variables: usize,
        /// Most variables of the method.
        most: usize,
    },
    /// The method needs second derivatives and the problem has none.
    #[error("method \"{method}\" needs second derivatives, which this problem does not offer; use \"lbfgs\"")]
    NoHessian {
        /// Name of the method.
        method: &'static str,
    },
    /// The method needs an objective that is a sum of squares.
    #[error(
        "method \"{method}\" needs an objective that is a sum of squares: shape_error (but no root mean square), fold_penalty and soft limits, all with positive weights; use \"lbfgs\" or \"sqp\""
    )]
    NoSquares {
        /// Name of the method.
        method: &'static str,
    },
    /// A setting out of its range.
    #[error("setting `{setting}` of method \"{method}\" is {value}; it must be {range}")]
    Setting {
        /// Name of the method.
        method: &'static str,
        /// Name of the setting.
        setting: &'static str,
        /// Value of the setting.
        value: f64,
        /// The values that are allowed, in words.
        range: &'static str,
    },
    /// Lists of the problem that must be equally long are not.
    #[error("the problem has {variables} variables but {what} of length {found}")]
    Length {
        /// Number of variable names.
        variables: usize,
        /// The list, in words.
        what: &'static str,
        /// Length of the list.
        found: usize,
    },
    /// As many bounds as constraints are needed.
    #[error("the problem has {constraints} constraints but {found} bounds of constraints")]
    ConstraintBounds {
        /// Number of constraint names.
        constraints: usize,
        /// Number of bounds.
        found: usize,
    },
    /// Bounds that leave no room.
    #[error("variable \"{variable}\" has no room between its bounds {lower} and {upper}")]
    EmptyBounds {
        /// Name of the variable.
        variable: String,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// Bounds of a constraint that nothing can meet.
    #[error("constraint \"{constraint}\" has no room between its bounds {lower} and {upper}")]
    EmptyConstraint {
        /// Name of the constraint.
        constraint: String,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A start that is no number.
    #[error("variable \"{variable}\" starts at {value}; it must be finite")]
    Start {
        /// Name of the variable.
        variable: String,
        /// Start of the variable.
        value: f64,
    },
}

/// The gradient as the first-order conditions see it: `x − clip(x − gradient)` with the clip to the bounds.
///
/// Entry by entry it is the gradient where the variable is free to follow it, the distance to the bound where that is
/// less, and 0 for a variable that the gradient holds at its bound. It vanishes exactly at stationary points.
pub fn projected_gradient<'a>(
    x: &'a [f64],
    gradient: &'a [f64],
    bounds: &'a [Bounds],
) -> impl Iterator<Item = f64> + 'a {
    // g clipped to [x − upper, x − lower] is x − clip(x − g) without its cancellation
    x.iter().zip(gradient).zip(bounds).map(|((&x, &g), b)| g.min(x - b.lower).max(x - b.upper))
}

/// Rejects a problem whose lists do not fit together.
pub(super) fn check(problem: &dyn Problem) -> Result<(), OptimizeError> {
    let description = problem.description();
    let names = &description.variable_names;
    let variables = names.len();
    for (what, found) in [("a start", description.start.len()), ("bounds", description.variable_bounds.len())] {
        if found != variables {
            return Err(OptimizeError::Length { variables, what, found });
        }
    }
    if let Some((name, &Bounds { lower, upper })) = without_room(names, &description.variable_bounds) {
        return Err(OptimizeError::EmptyBounds { variable: name.clone(), lower, upper });
    }
    if let Some((name, &value)) = names.iter().zip(&description.start).find(|(_, v)| !v.is_finite()) {
        return Err(OptimizeError::Start { variable: name.clone(), value });
    }
    let (constraints, found) = (description.constraint_names.len(), description.constraint_bounds.len());
    if found != constraints {
        return Err(OptimizeError::ConstraintBounds { constraints, found });
    }
    match without_room(&description.constraint_names, &description.constraint_bounds) {
        Some((name, &Bounds { lower, upper })) => {
            Err(OptimizeError::EmptyConstraint { constraint: name.clone(), lower, upper })
        }
        None => Ok(()),
    }
}

/// The first of `names` whose bounds no number can meet.
fn without_room<'a>(names: &'a [String], bounds: &'a [Bounds]) -> Option<(&'a String, &'a Bounds)> {
    // written so that NaN fails too
    let has_room = |b: &Bounds| b.lower <= b.upper && b.lower < f64::INFINITY && b.upper > f64::NEG_INFINITY;
    names.iter().zip(bounds).find(|(_, b)| !has_room(b))
}

/// Rejects a problem with constraints.
pub(super) fn refuse_constraints(problem: &dyn Problem, method: &'static str) -> Result<(), OptimizeError> {
    let names = &problem.description().constraint_names;
    if let Some(first) = names.first() {
        let count = names.len();
        return Err(OptimizeError::ConstraintsNotSupported { method, count, first: first.clone() });
    }
    Ok(())
}
