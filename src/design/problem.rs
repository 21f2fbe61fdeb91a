//! The view that an optimiser has of a design problem.

use nalgebra::DMatrix;

/// Everything one evaluation of a design problem yields.
///
/// Derivatives are with respect to the scaled design variables `x` the evaluation was asked for.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Evaluation {
    /// The objective, to be minimised.
    pub objective: f64,
    /// Gradient of the objective, one entry per variable.
    pub gradient: Vec<f64>,
    /// Constraint values, in the order of [`ProblemDescription::constraint_bounds`].
    pub constraints: Vec<f64>,
    /// Gradients of the constraints, one row per constraint.
    pub jacobian: Vec<Vec<f64>>,
    /// Further values for the history, in the order of [`ProblemDescription::value_names`]; NaN for one that has no
    /// value here, of which an optimiser takes no notice.
    pub values: Vec<f64>,
}

impl Evaluation {
    /// Largest violation of a constraint with these bounds; 0 without constraints.
    pub fn violation(&self, constraint_bounds: &[Bounds]) -> f64 {
        self.constraints.iter().zip(constraint_bounds).map(|(&c, b)| b.violation(c)).fold(0.0, f64::max)
    }
}

/// Value of a quantity and its gradient, one entry per variable.
pub type ValueAndGradient = (f64, Vec<f64>);

/// An analysis that has no value at some point: recoverable, the optimiser takes a shorter step.
#[derive(Debug, Clone, PartialEq, thiserror::Error, serde::Serialize, serde::Deserialize)]
#[error("{reason}")]
pub struct AnalysisFailure {
    /// The reason in a sentence.
    pub reason: String,
}

/// Lower and upper bound of a variable or constraint; infinite where there is none, equal for an equality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Smallest allowed value, or −∞.
    pub lower: f64,
    /// Largest allowed value, or +∞.
    pub upper: f64,
}

impl Bounds {
    /// Bounds that every number meets.
    pub const FREE: Self = Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY };

    /// Whether neither side is bounded.
    pub fn is_free(&self) -> bool {
        self.lower == f64::NEG_INFINITY && self.upper == f64::INFINITY
    }

    /// How far `value` lies outside, 0 inside.
    pub fn violation(&self, value: f64) -> f64 {
        (self.lower - value).max(value - self.upper).max(0.0)
    }
}

/// Names, bounds and start: all that is known of a problem before anything is evaluated.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ProblemDescription {
    /// Names of the variables (length n).
    pub variable_names: Vec<String>,
    /// Point at which an optimisation starts (length n), in scaled variables.
    pub start: Vec<f64>,
    /// Bounds of the scaled variables (length n).
    pub variable_bounds: Vec<Bounds>,
    /// Names of the constraints (length m).
    pub constraint_names: Vec<String>,
    /// Bounds of the constraints (length m).
    pub constraint_bounds: Vec<Bounds>,
    /// Names of the further values that an evaluation reports.
    pub value_names: Vec<String>,
}

/// A smooth problem: minimise `objective(x)` with `x` in bounds and `constraints(x)` in bounds.
///
/// Variables are scaled: a step of one is a large but sensible change of the shape.
pub trait Problem {
    /// Names, bounds and start, which do not depend on the point.
    fn description(&self) -> &ProblemDescription;
    /// Values and exact first derivatives at `x`.
    ///
    /// # Errors
    /// [`AnalysisFailure`] where the shape at `x` has no analysis; the optimiser goes on with a shorter step.
    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure>;
    /// Evaluations at points near `base`, itself evaluated before; each is what it is whatever the other points are.
    ///
    /// A problem that can do several at once, or profit from what it knows at `base`, does so.
    fn evaluate_near(&mut self, _base: &[f64], points: &[Vec<f64>]) -> Vec<Result<Evaluation, AnalysisFailure>> {
        points.iter().map(|x| self.evaluate(x)).collect()
    }
    /// Exact Hessian (n × n) of the objective at `x`; `None` where the problem does not offer second derivatives.
    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>>;
    /// Where the objective is a sum of squares `Σ r²`: the Gauss-Newton matrix (n × n) `2 Σ ∇r ∇rᵀ` at `x`, which is the
    /// Hessian without the curvature of the residuals r and never has a negative eigenvalue. Other convex functions of
    /// residuals take the place of a square with their second derivative in that of 2. `None`, the default, for other
    /// objectives.
    fn gauss_newton(&mut self, _x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        None
    }
    /// Where the objective is a sum of squares `Σ r²`: `2 Σ ∇r r″` (length n) with the second derivatives r″ of the
    /// residuals along `step` (length n) at `x`. A step that follows the Gauss-Newton matrix can be bent by it so that
    /// the residuals go straight. `None`, the default, where the problem does not know it; residuals without known
    /// curvature count as straight.
    fn residual_curvature(&mut self, _x: &[f64], _step: &[f64]) -> Option<Vec<f64>> {
        None
    }
    /// A symmetric positive definite matrix M (n × n) that measures steps: a second-order model is trusted for steps
    /// `s` with `sᵀ M s` up to some square radius. `None`, the default, is the identity.
    fn metric(&mut self, _x: &[f64]) -> Option<DMatrix<f64>> {
        None
    }
    /// Constraints that cost next to nothing beside an evaluation, as geometry does beside a flow: value and gradient
    /// (length n) at `x` for each of them, `None` for a constraint that takes an evaluation, in the order of
    /// [`ProblemDescription::constraint_bounds`]. They are those of [`evaluate`](Self::evaluate). A method can follow
    /// them to the end of a step before it evaluates there. `None`, the default, where nothing is known in advance or
    /// at `x` nothing can be said.
    fn known_constraints(&mut self, _x: &[f64]) -> Option<Vec<Option<ValueAndGradient>>> {
        None
    }
    /// A symmetric positive semidefinite matrix (n × n) in proportion to the likely curvature of the objective near
    /// `x`, by which directions of much and of little curvature can be told apart before a step is taken. Only its
    /// shape counts, not its size. `None`, the default, is the identity.
    fn likely_curvature(&mut self, _x: &[f64]) -> Option<DMatrix<f64>> {
        None
    }
    /// A sensible change of each variable (length n, positive, in scaled variables): methods measure steps and
    /// tolerances by it, so that a run does not depend on how the variables are scaled. `None`, the default, where the
    /// problem knows none.
    fn natural_steps(&self) -> Option<Vec<f64>> {
        None
    }
}

impl<P: Problem + ?Sized> Problem for &mut P {
    fn description(&self) -> &ProblemDescription {
        (**self).description()
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        (**self).evaluate(x)
    }

    fn evaluate_near(&mut self, base: &[f64], points: &[Vec<f64>]) -> Vec<Result<Evaluation, AnalysisFailure>> {
        (**self).evaluate_near(base, points)
    }

    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        (**self).hessian(x)
    }

    fn gauss_newton(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        (**self).gauss_newton(x)
    }

    fn residual_curvature(&mut self, x: &[f64], step: &[f64]) -> Option<Vec<f64>> {
        (**self).residual_curvature(x, step)
    }

    fn metric(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        (**self).metric(x)
    }

    fn known_constraints(&mut self, x: &[f64]) -> Option<Vec<Option<ValueAndGradient>>> {
        (**self).known_constraints(x)
    }

    fn likely_curvature(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        (**self).likely_curvature(x)
    }

    fn natural_steps(&self) -> Option<Vec<f64>> {
        (**self).natural_steps()
    }
}
