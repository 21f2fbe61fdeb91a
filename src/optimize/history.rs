//! The history of a run.

use super::outcome::Progress;
use crate::design::Problem;
use std::fmt::Write;

/// A row per evaluation, written as CSV text.
///
/// Columns: `evaluation, iteration, objective`, the constraints and further values by name,
/// `max_constraint_violation, gradient_norm, step, seconds`. A failed evaluation leaves its numbers empty, as does a
/// number that is not finite. Numbers have the shortest digits that give the same `f64` when read back.
#[derive(Debug, Clone)]
pub struct History {
    header: Vec<String>,
    /// How many columns of values a row has.
    values: usize,
    rows: Vec<HistoryRow>,
}

#[derive(Debug, Clone)]
struct HistoryRow {
    evaluation: usize,
    iteration: usize,
    objective: f64,
    values: Vec<f64>,
    violation: f64,
    gradient_norm: f64,
    step: f64,
    seconds: f64,
}

impl History {
    /// An empty history with the columns of `problem`.
    pub fn new(problem: &dyn Problem) -> Self {
        let names: Vec<_> = problem
            .description()
            .constraint_names
            .iter()
            .chain(&problem.description().value_names)
            .map(|n| quoted(n))
            .collect();
        let values = names.len();
        let mut header: Vec<_> = ["evaluation", "iteration", "objective"].map(String::from).into();
        header.extend(names);
        header.extend(["max_constraint_violation", "gradient_norm", "step", "seconds"].map(String::from));
        Self { header, values, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn record(&mut self, progress: &Progress<'_>) {
        let (objective, mut values) = match progress.result {
            Ok(e) => (e.objective, e.constraints.iter().chain(&e.values).copied().collect()),
            Err(_) => (f64::NAN, Vec::new()),
        };
        values.resize(self.values, f64::NAN);
        self.rows.push(HistoryRow {
            evaluation: progress.evaluation,
            iteration: progress.iteration,
            objective,
            values,
            violation: progress.violation,
            gradient_norm: progress.gradient_norm,
            step: progress.step,
            seconds: progress.seconds,
        });
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Objective of each evaluation, NaN for failed ones; what a figure of convergence draws.
    pub fn objectives(&self) -> Vec<f64> {
        self.rows.iter().map(|row| row.objective).collect()
    }

    /// Largest constraint violation of each evaluation, NaN for failed ones.
    pub fn violations(&self) -> Vec<f64> {
        self.rows.iter().map(|row| row.violation).collect()
    }

    /// Header and rows, one line each.
    pub fn to_csv(&self) -> String {
        let mut text = self.header.join(",") + "\n";
        for row in &self.rows {
            let _ = write!(text, "{},{}", row.evaluation, row.iteration);
            let after = [row.violation, row.gradient_norm, row.step];
            for value in std::iter::once(row.objective).chain(row.values.iter().copied()).chain(after) {
                text.push(',');
                if value.is_finite() {
                    let _ = write!(text, "{value:e}");
                }
            }
            let _ = writeln!(text, ",{:.6}", row.seconds);
        }
        text
    }
}

/// A name as a CSV field (RFC 4180).
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) { format!("\"{}\"", name.replace('"', "\"\"")) } else { name.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::testcases::*;
    use super::super::{Lbfgs, Optimizer};
    use super::*;
    use crate::design::{AnalysisFailure, Evaluation};
    use std::ops::ControlFlow;

    #[test]
    fn a_row_for_each_evaluation() {
        let mut case = rosenbrock(2).failing(|x| x[0] > -1.0 && x[0] < -0.9);
        let mut history = History::new(&case);
        assert!(history.is_empty());
        let observer = &mut |p: &Progress<'_>| {
            history.record(p);
            ControlFlow::Continue(())
        };
        let outcome = Lbfgs::default().minimize(&mut case, observer).unwrap();
        let text = history.to_csv();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "evaluation,iteration,objective,max_constraint_violation,gradient_norm,step,seconds");
        assert_eq!((lines.len(), history.len()), (outcome.evaluations + 1, outcome.evaluations));
        assert!(lines[1].starts_with("1,0,2.4199999999999996e1,0e0,"), "{}", lines[1]);
        let best = history.objectives().iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(best, outcome.evaluation.unwrap().objective);
        assert!(lines.iter().all(|line| line.split(',').count() == 7));
    }

    #[test]
    fn names_are_quoted_and_gaps_are_empty() {
        let mut case = rosenbrock(2);
        case.description.constraint_names = vec!["area".into(), "thickness, \"aft\"".into()];
        let mut history = History::new(&case);
        let evaluation = Evaluation {
            objective: 0.1,
            gradient: vec![0.0; 2],
            constraints: vec![1.5, f64::NAN],
            jacobian: vec![],
            values: vec![],
        };
        let failure = AnalysisFailure { reason: "why".into() };
        let mut progress = Progress {
            evaluation: 3,
            iteration: 2,
            x: &[0.0, 0.0],
            result: Ok(&evaluation),
            best_objective: 0.1,
            violation: 0.25,
            gradient_norm: 1e-7,
            step: 0.5,
            seconds: 1.25,
            evaluation_limit: 10,
        };
        history.record(&progress);
        progress.result = Err(&failure);
        (progress.violation, progress.gradient_norm) = (f64::NAN, f64::NAN);
        history.record(&progress);
        let text = history.to_csv();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].contains(r#",area,"thickness, ""aft""",max"#), "{}", lines[0]);
        assert_eq!(lines[1], "3,2,1e-1,1.5e0,,2.5e-1,1e-7,5e-1,1.250000");
        assert_eq!(lines[2], "3,2,,,,,,5e-1,1.250000");
    }
}
