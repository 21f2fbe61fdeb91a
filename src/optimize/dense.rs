//! The size of problems that methods with dense matrices take.

use super::outcome::OptimizeError;
use crate::design::Problem;

/// Most variables of a method that keeps matrices of variables by variables: several of 200 megabytes each.
const MOST_VARIABLES: usize = 5_000;

/// Rejects a problem whose matrices would fill the memory.
pub(super) fn refuse_size(problem: &dyn Problem, method: &'static str) -> Result<(), OptimizeError> {
    let variables = problem.description().variable_names.len();
    if variables > MOST_VARIABLES {
        return Err(OptimizeError::TooManyVariables { method, variables, most: MOST_VARIABLES });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use crate::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
    use crate::optimize::{Method, OptimizeError, Optimizer};
    use std::ops::ControlFlow;

    /// A bowl in many variables.
    struct Bowl(ProblemDescription);
    impl Problem for Bowl {
        fn description(&self) -> &ProblemDescription {
            &self.0
        }
        fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
            Ok(Evaluation {
                objective: x.iter().map(|v| v * v).sum(),
                gradient: x.iter().map(|v| 2.0 * v).collect(),
                constraints: vec![],
                jacobian: vec![],
                values: vec![],
            })
        }
        fn hessian(&mut self, _: &[f64]) -> Option<Result<nalgebra::DMatrix<f64>, AnalysisFailure>> {
            None
        }
    }

    #[test]
    fn only_the_method_without_matrices_takes_very_many_variables() {
        let n = 20_000;
        let mut bowl = Bowl(ProblemDescription {
            variable_names: (0..n).map(|k| format!("x{k}")).collect(),
            start: vec![1.0; n],
            variable_bounds: vec![Bounds::FREE; n],
            ..ProblemDescription::default()
        });
        for name in Method::NAMES {
            let method = Method::from_name(name).unwrap();
            let checked = method.check_constraints(&bowl);
            let ran = method.minimize(&mut bowl, &mut |_| ControlFlow::Continue(()));
            if name == "lbfgs" {
                assert!(checked.is_ok() && ran.unwrap().x.iter().all(|v| v.abs() < 1e-6));
                continue;
            }
            for error in [checked.unwrap_err(), ran.unwrap_err()] {
                assert!(matches!(error, OptimizeError::TooManyVariables { variables: 20_000, .. }), "{error}");
            }
        }
    }
}
