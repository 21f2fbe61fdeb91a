//! The trait that every method implements, and the limits of a run.

use super::outcome::{OptimizeError, Outcome, Progress};
use crate::design::Problem;
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
    /// run with [`Termination::Interrupted`](super::Termination::Interrupted).
    ///
    /// # Errors
    /// A problem the method cannot take: see [`OptimizeError`]. A run that merely goes badly is an [`Outcome`] with a
    /// [`Termination`](super::Termination) that says so.
    fn minimize(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<Outcome, OptimizeError>;
}
