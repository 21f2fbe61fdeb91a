//! Optimisers, what they report, and how a run is recorded and resumed.
//!
//! * [`Lbfgs`]: limited-memory BFGS on [`argmin`], for problems without constraints; first derivatives only;
//! * [`Newton`]: trust-region Newton with the exact Hessian; the fewest evaluations where second derivatives exist;
//! * [`Slsqp`]: sequential least-squares programming on [`basin`], for problems with constraints; first derivatives only;
//! * [`Sqp`]: sequential quadratic programming in a trust region, with the curvature sampled from exact gradients: the
//!   fewest iterations where many directions matter little;
//! * [`Method`]: any of them behind one type, as a case file names it;
//! * [`Bounded`]: bounds on variables by a smooth change of variables, which the first two use by themselves;
//! * [`Journaled`], [`Checkpoint`]: every evaluation recorded, so that a killed run resumes bit for bit;
//! * [`History`]: a row per evaluation, as CSV.
//!
//! An optimiser sees a [`Problem`] and nothing else. It calls an observer after every evaluation; the observer can end
//! the run. The best point so far is always kept and returned, whatever ends the run, and the reason is a sentence.
//!
//! ```
//! use aeroform::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
//! use aeroform::optimize::{Lbfgs, Optimizer, Status};
//! use std::ops::ControlFlow;
//!
//! struct Bowl(ProblemDescription);
//! impl Problem for Bowl {
//!     fn description(&self) -> &ProblemDescription { &self.0 }
//!     fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
//!         Ok(Evaluation {
//!             objective: (x[0] - 1.0).powi(2) + 10.0 * x[1].powi(2),
//!             gradient: vec![2.0 * (x[0] - 1.0), 20.0 * x[1]],
//!             constraints: vec![], jacobian: vec![], values: vec![],
//!         })
//!     }
//!     fn hessian(&mut self, _: &[f64]) -> Option<Result<nalgebra::DMatrix<f64>, AnalysisFailure>> { None }
//! }
//!
//! let mut bowl = Bowl(ProblemDescription {
//!     variable_names: vec!["x".into(), "y".into()],
//!     start: vec![3.0, 1.0],
//!     variable_bounds: vec![Bounds::FREE; 2],
//!     ..ProblemDescription::default() // no constraints, no further values
//! });
//! let outcome = Lbfgs::default().minimize(&mut bowl, &mut |_| ControlFlow::Continue(())).unwrap();
//! assert_eq!(outcome.status, Status::Converged);
//! assert!((outcome.x[0] - 1.0).abs() < 1e-6);
//! ```
//!
//! Depends on [`design::Problem`](crate::design::Problem), `argmin`, `basin`, `nalgebra` and `serde`.

pub(crate) mod atomic;
mod bounded;
mod checkpoint;
#[cfg(test)]
mod constrained_tests;
mod history;
mod journal;
mod kkt;
mod lbfgs;
mod ledger;
mod newton;
mod outcome;
mod slsqp;
mod sqp;
#[cfg(test)]
mod testcases;
mod trust_region;
mod verdict;
mod watch;

pub use bounded::Bounded;
pub use checkpoint::{Checkpoint, CheckpointError};
pub use history::History;
pub use journal::{Answer, Journal, Journaled, Record};
pub use lbfgs::Lbfgs;
pub use newton::Newton;
pub use outcome::{OptimizeError, Outcome, Progress, Status, projected_gradient};
pub use slsqp::Slsqp;
pub use sqp::Sqp;

use crate::design::{AnalysisFailure, Evaluation, Problem, ProblemDescription};
use nalgebra::DMatrix;
use std::ops::ControlFlow;

/// When a run ends whatever its progress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Most evaluations of the problem, failed ones included; at least 1.
    pub evaluations: usize,
    /// Most iterations (accepted steps and trust-region steps tried).
    pub iterations: usize,
}

impl Default for Limits {
    /// 1000 evaluations, 1000 iterations.
    fn default() -> Self {
        Self { evaluations: 1000, iterations: 1000 }
    }
}

/// A method that minimises a [`Problem`].
pub trait Optimizer {
    /// The name of the method in case files and reports.
    fn name(&self) -> &'static str;

    /// Minimises `problem` from its start.
    ///
    /// `observer` is called after every evaluation, failed ones included; `ControlFlow::Break(())` from it ends the
    /// run with [`Status::Interrupted`].
    ///
    /// # Errors
    /// A problem the method cannot take: see [`OptimizeError`]. A run that merely goes badly is an [`Outcome`] with a
    /// [`Status`] that says so.
    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError>;
}

/// A method as a case file names it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// `"lbfgs"`.
    Lbfgs(Lbfgs),
    /// `"newton"`.
    Newton(Newton),
    /// `"slsqp"`.
    Slsqp(Slsqp),
    /// `"sqp"`.
    Sqp(Sqp),
}

impl Method {
    /// The names [`from_name`](Self::from_name) knows.
    pub const NAMES: [&'static str; 4] = [Lbfgs::NAME, Newton::NAME, Slsqp::NAME, Sqp::NAME];

    /// The method called `name` with its default settings.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            Lbfgs::NAME => Some(Self::Lbfgs(Lbfgs::default())),
            Newton::NAME => Some(Self::Newton(Newton::default())),
            Slsqp::NAME => Some(Self::Slsqp(Slsqp::default())),
            Sqp::NAME => Some(Self::Sqp(Sqp::default())),
            _ => None,
        }
    }

    /// Whether the method takes constraints.
    pub fn takes_constraints(&self) -> bool {
        matches!(self, Self::Slsqp(_) | Self::Sqp(_))
    }

    /// The limits of the run, to read or set.
    pub fn limits_mut(&mut self) -> &mut Limits {
        match self {
            Self::Lbfgs(method) => &mut method.limits,
            Self::Newton(method) => &mut method.limits,
            Self::Slsqp(method) => &mut method.limits,
            Self::Sqp(method) => &mut method.limits,
        }
    }

    fn optimizer(&self) -> &dyn Optimizer {
        match self {
            Self::Lbfgs(method) => method,
            Self::Newton(method) => method,
            Self::Slsqp(method) => method,
            Self::Sqp(method) => method,
        }
    }
}

impl Optimizer for Method {
    fn name(&self) -> &'static str {
        self.optimizer().name()
    }

    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError> {
        self.optimizer().minimize(problem, observer)
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

    fn metric(&mut self, x: &[f64]) -> Option<DMatrix<f64>> {
        (**self).metric(x)
    }
}
