//! The problems and settings that a method takes.

use super::dense::refuse_size;
use super::optimizer::Limits;
use super::outcome::{OptimizeError, check, refuse_constraints};
use super::settings::{Setting, check_settings};
use crate::design::Problem;

/// The kinds of problems that a method takes, beside sound ones without constraints.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scope {
    /// The name of the method, for messages.
    pub method: &'static str,
    /// Whether constraints on other things than variables are taken.
    pub constraints: bool,
    /// Whether matrices of variables by variables are kept, which limits their number.
    pub dense: bool,
}

impl Scope {
    /// Refuses settings that are out of their range, a problem whose parts do not fit together, and one that the method
    /// does not take: the checks before a run.
    pub fn check(self, problem: &dyn Problem, limits: Limits, settings: &[Setting]) -> Result<(), OptimizeError> {
        check_settings(self.method, limits, settings)?;
        check(problem)?;
        self.admit(problem)
    }

    /// Refuses a problem that the method does not take.
    pub fn admit(self, problem: &dyn Problem) -> Result<(), OptimizeError> {
        if self.dense {
            refuse_size(problem, self.method)?;
        }
        if !self.constraints {
            refuse_constraints(problem, self.method)?;
        }
        Ok(())
    }
}
