//! Settings of L-BFGS.

use super::super::optimizer::Limits;
use super::super::scope::Scope;
use super::super::settings::Setting;

/// Limited-memory BFGS with restarts, for problems without constraints.
///
/// One iteration costs one evaluation, rarely more. Bounds on variables are met by a change of variables
/// ([`Bounded`](crate::optimize::Bounded)). Failed analyses shorten the step.
///
/// The objective is divided by a constant so that the first trial step, along the negative gradient, has the length
/// [`first_step`](Self::first_step); no tolerance depends on that constant. The run has converged when
///
/// * the objective fell by less than [`objective_tolerance`](Self::objective_tolerance) of its size over
///   [`patience`](Self::patience) iterations, or
/// * the norm of the gradient is below [`gradient_tolerance`](Self::gradient_tolerance) times the largest met so far.
///
/// Where failed analyses keep the steps short the first criterion does not count: the run has then failed once the
/// objective falls by less than the root of the tolerance over `patience` iterations, all of them hindered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lbfgs {
    /// Steps remembered. The default of 500 forgets nothing in most runs, which makes it full BFGS: on an
    /// ill-conditioned problem of 32 variables it needs a quarter of the evaluations that a memory of 20 needs, and a
    /// step remembered costs two vectors only.
    pub memory: usize,
    /// Relative change of the objective, over `patience` iterations, that counts as none.
    pub objective_tolerance: f64,
    /// Iterations over which the change of the objective is measured.
    pub patience: usize,
    /// Reduction of the norm of the gradient at which the run has converged.
    pub gradient_tolerance: f64,
    /// Length of the first trial step, in scaled variables.
    pub first_step: f64,
    /// Limits of the run.
    pub limits: Limits,
}

impl Default for Lbfgs {
    fn default() -> Self {
        Self {
            memory: 500,
            objective_tolerance: 1e-7,
            patience: 10,
            gradient_tolerance: 1e-10,
            first_step: 0.1,
            limits: Limits::default(),
        }
    }
}

impl Lbfgs {
    /// The name in case files.
    pub const NAME: &'static str = "lbfgs";
    pub(in crate::optimize) const SCOPE: Scope = Scope { method: Self::NAME, constraints: false, dense: false };

    pub(super) fn settings(&self) -> [Setting; 5] {
        [
            Setting::count("memory", self.memory),
            Setting::count("patience", self.patience),
            Setting::tolerance("objective_tolerance", self.objective_tolerance),
            Setting::tolerance("gradient_tolerance", self.gradient_tolerance),
            Setting::positive("first_step", self.first_step),
        ]
    }
}
