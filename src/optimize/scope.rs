//! The problems that a method takes.

use super::dense::refuse_size;
use super::outcome::{OptimizeError, refuse_constraints};
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
