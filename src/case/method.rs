//! The `[optimizer]` table: method and settings.

use super::document::Document;
use super::error::CaseError;
use super::schema::OptimizerTable;
use crate::design::{DesignProblem, Problem};
use crate::optimize::{GaussNewton, Lbfgs, Method, OptimizeError, Sqp};

impl OptimizerTable {
    /// Refuses settings that no method can take.
    pub fn check(&self, document: &Document) -> Result<(), CaseError> {
        for (key, value) in [("tolerance", self.tolerance), ("feasibility", self.feasibility)] {
            if let Some(value) = value
                && !(value.is_finite() && value > 0.0)
            {
                return Err(document.error(&["optimizer", key], format!("{value} must be positive")));
            }
        }
        for (key, value) in [
            ("max_evaluations", self.max_evaluations),
            ("max_iterations", self.max_iterations),
            ("memory", self.memory),
        ] {
            if value == Some(0) {
                return Err(document.error(&["optimizer", key], "must be at least 1"));
            }
        }
        Ok(())
    }

    /// Name of the method; constraints and the kind of objective decide where the table names none.
    pub fn method_name(&self, problem: &DesignProblem) -> &str {
        let constrained = !problem.description().constraint_names.is_empty();
        let chosen = match (constrained, problem.is_sum_of_squares()) {
            (true, _) => Sqp::NAME,
            (false, true) => GaussNewton::NAME,
            (false, false) => Lbfgs::NAME,
        };
        self.method.as_deref().unwrap_or(chosen)
    }

    /// The method of a name with the settings of the table, as far as the method has them.
    pub fn method(&self, name: &str) -> Result<Method, OptimizeError> {
        let mut method = Method::from_name(name)?;
        let set = |setting: &mut f64, value: Option<f64>| *setting = value.unwrap_or(*setting);
        match &mut method {
            Method::Lbfgs(lbfgs) => {
                lbfgs.memory = self.memory.unwrap_or(lbfgs.memory);
                set(&mut lbfgs.objective_tolerance, self.tolerance);
            }
            Method::GaussNewton(method) => set(&mut method.objective_tolerance, self.tolerance),
            Method::Newton(newton) => set(&mut newton.objective_tolerance, self.tolerance),
            Method::Sqp(sqp) => {
                set(&mut sqp.optimality_tolerance, self.tolerance);
                set(&mut sqp.feasibility_tolerance, self.feasibility);
            }
            Method::Slsqp(slsqp) => {
                set(&mut slsqp.optimality_tolerance, self.tolerance);
                set(&mut slsqp.feasibility_tolerance, self.feasibility);
            }
        }
        let limits = method.limits_mut();
        limits.evaluations = self.max_evaluations.unwrap_or(limits.evaluations);
        // evaluations are what costs; iterations limit a run only where the file says so
        limits.iterations = self.max_iterations.unwrap_or(usize::MAX);
        Ok(method)
    }
}
