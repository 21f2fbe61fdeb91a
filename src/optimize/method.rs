//! Any of the methods behind one type.

use super::gauss_newton::GaussNewton;
use super::lbfgs::Lbfgs;
use super::newton::Newton;
use super::optimizer::{Limits, Optimizer};
use super::outcome::{OptimizeError, Outcome, Progress};
use super::slsqp::Slsqp;
use super::sqp::Sqp;
use crate::design::Problem;
use std::ops::ControlFlow;

/// A method as a case file names it.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// `"lbfgs"`.
    Lbfgs(Lbfgs),
    /// `"newton"`.
    Newton(Newton),
    /// `"gauss-newton"`.
    GaussNewton(GaussNewton),
    /// `"slsqp"`.
    Slsqp(Slsqp),
    /// `"sqp"`.
    Sqp(Sqp),
}

impl Method {
    /// The names [`from_name`](Self::from_name) knows.
    pub const NAMES: [&'static str; 5] = [Lbfgs::NAME, Newton::NAME, GaussNewton::NAME, Slsqp::NAME, Sqp::NAME];

    /// The method called `name` with its default settings.
    ///
    /// # Errors
    /// [`OptimizeError::UnknownMethod`].
    pub fn from_name(name: &str) -> Result<Self, OptimizeError> {
        match name {
            Lbfgs::NAME => Ok(Self::Lbfgs(Lbfgs::default())),
            Newton::NAME => Ok(Self::Newton(Newton::default())),
            GaussNewton::NAME => Ok(Self::GaussNewton(GaussNewton::default())),
            Slsqp::NAME => Ok(Self::Slsqp(Slsqp::default())),
            Sqp::NAME => Ok(Self::Sqp(Sqp::default())),
            _ => Err(OptimizeError::UnknownMethod { name: name.into(), known: Self::NAMES }),
        }
    }

    /// Whether the method takes the constraints of `problem`, if there are any, and its number of variables.
    ///
    /// # Errors
    /// [`OptimizeError::ConstraintsNotSupported`], [`OptimizeError::TooManyVariables`].
    pub fn check_constraints(&self, problem: &dyn Problem) -> Result<(), OptimizeError> {
        match self {
            Self::Lbfgs(_) => Lbfgs::SCOPE,
            Self::Newton(_) => Newton::SCOPE,
            Self::GaussNewton(_) => GaussNewton::SCOPE,
            Self::Slsqp(_) => Slsqp::SCOPE,
            Self::Sqp(_) => Sqp::SCOPE,
        }
        .admit(problem)
    }

    /// The limits of the run, to read or set.
    pub fn limits_mut(&mut self) -> &mut Limits {
        match self {
            Self::Lbfgs(method) => &mut method.limits,
            Self::Newton(method) => &mut method.limits,
            Self::GaussNewton(method) => &mut method.limits,
            Self::Slsqp(method) => &mut method.limits,
            Self::Sqp(method) => &mut method.limits,
        }
    }

    fn optimizer(&self) -> &dyn Optimizer {
        match self {
            Self::Lbfgs(method) => method,
            Self::Newton(method) => method,
            Self::GaussNewton(method) => method,
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
