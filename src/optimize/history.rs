//! The history of a run.

use super::outcome::Progress;
use crate::design::Problem;

/// A row per evaluation, written as CSV text.
///
/// Columns: `evaluation, iteration, objective`, every constraint and further value once, by name,
/// `max_constraint_violation, gradient_norm, step, seconds, kind`. The kind is `start`, `trial` (a step that an
/// iteration tries), `sample` (a neighbouring design from which the curvature is read) or `failed`. A failed evaluation
/// leaves its numbers empty, as does a number that is not finite. Numbers have the shortest digits that give the same
/// `f64` when read back.
#[derive(Debug, Clone)]
pub struct History {
    header: Vec<String>,
    /// Places of the values that have a column, in the list of constraints and further values of an evaluation.
    columns: Vec<usize>,
    rows: Vec<HistoryRow>,
}

/// One evaluation in a [`History`].
#[derive(Debug, Clone, PartialEq)]
pub struct HistoryRow {
    /// Number of the evaluation, from 1.
    pub evaluation: usize,
    /// Iterations completed before the evaluation.
    pub iteration: usize,
    /// Whether the evaluation only samples the neighbourhood of a design.
    pub sampling: bool,
    /// Whether this was the best design so far.
    pub improved: bool,
    /// The objective; NaN where the evaluation failed.
    pub objective: f64,
    /// Largest violation of a constraint; NaN where the evaluation failed.
    pub violation: f64,
    values: Vec<f64>,
    gradient_norm: f64,
    step: f64,
    seconds: f64,
}

impl HistoryRow {
    /// Whether the evaluation failed.
    pub fn failed(&self) -> bool {
        self.objective.is_nan()
    }

    fn kind(&self) -> &'static str {
        kind(self.failed(), self.sampling, self.evaluation)
    }
}

impl Progress<'_> {
    /// The kind of the evaluation in one word: `"start"`, `"trial"`, `"sample"` or `"failed"`.
    pub fn kind(&self) -> &'static str {
        kind(self.result.is_err(), self.sampling, self.evaluation)
    }
}

fn kind(failed: bool, sampling: bool, evaluation: usize) -> &'static str {
    match (failed, sampling, evaluation) {
        (true, ..) => "failed",
        (_, true, _) => "sample",
        (.., 1) => "start",
        _ => "trial",
    }
}

impl History {
    /// An empty history with the columns of `problem`.
    pub fn new(problem: &dyn Problem) -> Self {
        let description = problem.description();
        let names: Vec<&String> = description.constraint_names.iter().chain(&description.value_names).collect();
        // a constrained quantity is often reported as a value, too
        let columns: Vec<usize> = (0..names.len()).filter(|&k| !names[..k].contains(&names[k])).collect();
        let mut header: Vec<_> = ["evaluation", "iteration", "objective"].map(String::from).into();
        header.extend(columns.iter().map(|&k| names[k].clone()));
        header.extend(["max_constraint_violation", "gradient_norm", "step", "seconds", "kind"].map(String::from));
        Self { header, columns, rows: Vec::new() }
    }

    /// Adds a row.
    pub fn record(&mut self, progress: &Progress<'_>) {
        let (objective, all) = match progress.result {
            Ok(e) => (e.objective, e.constraints.iter().chain(&e.values).copied().collect()),
            Err(_) => (f64::NAN, Vec::new()),
        };
        let value = |&k: &usize| all.get(k).copied().unwrap_or(f64::NAN);
        self.rows.push(HistoryRow {
            evaluation: progress.evaluation,
            iteration: progress.iteration,
            sampling: progress.sampling,
            improved: progress.improved,
            objective,
            values: self.columns.iter().map(value).collect(),
            violation: progress.violation,
            gradient_norm: progress.gradient_norm,
            step: progress.step,
            seconds: progress.seconds,
        });
    }

    /// The rows in the order of the evaluations.
    pub fn rows(&self) -> &[HistoryRow] {
        &self.rows
    }

    /// Objective of each evaluation, NaN for failed ones.
    pub fn objectives(&self) -> Vec<f64> {
        self.rows.iter().map(|row| row.objective).collect()
    }

    /// Header and rows, one line each.
    ///
    /// # Errors
    /// Memory that cannot be had; the text is written to memory only.
    pub fn to_csv(&self) -> Result<String, csv::Error> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.header)?;
        let number = |value: &f64| if value.is_finite() { format!("{value:e}") } else { String::new() };
        for row in &self.rows {
            let mut cells = vec![row.evaluation.to_string(), row.iteration.to_string()];
            let after = [row.violation, row.gradient_norm, row.step];
            cells.extend(std::iter::once(&row.objective).chain(&row.values).chain(&after).map(number));
            cells.extend([format!("{:.6}", row.seconds), row.kind().to_string()]);
            writer.write_record(&cells)?;
        }
        let bytes = writer.into_inner().map_err(|e| csv::Error::from(e.into_error()))?;
        Ok(String::from_utf8_lossy(&bytes).into_owned())
    }
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
        assert!(history.rows().is_empty());
        let observer = &mut |p: &Progress<'_>| {
            history.record(p);
            ControlFlow::Continue(())
        };
        let outcome = Lbfgs::default().minimize(&mut case, observer).unwrap();
        let text = history.to_csv().unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "evaluation,iteration,objective,max_constraint_violation,gradient_norm,step,seconds,kind");
        assert_eq!((lines.len(), history.rows().len()), (outcome.evaluations + 1, outcome.evaluations));
        assert!(lines[1].starts_with("1,0,2.4199999999999996e1,0e0,"), "{}", lines[1]);
        let best = history.rows().iter().map(|row| row.objective).fold(f64::INFINITY, f64::min);
        assert_eq!(best, outcome.evaluation.unwrap().objective);
        let failed = history.rows().iter().filter(|row| row.failed()).count();
        assert_eq!(lines.iter().filter(|line| line.ends_with(",failed")).count(), failed);
        assert_eq!(failed, outcome.failures);
        assert!(lines.iter().all(|line| line.split(',').count() == 8));
    }

    #[test]
    fn names_are_quoted_and_gaps_are_empty() {
        let mut case = rosenbrock(2);
        case.description.constraint_names = vec!["area".into(), "thickness, \"aft\"".into()];
        case.description.value_names = vec!["cd".into(), "area".into()];
        let mut history = History::new(&case);
        let evaluation = Evaluation {
            objective: 0.1,
            gradient: vec![0.0; 2],
            constraints: vec![1.5, f64::NAN],
            jacobian: vec![],
            values: vec![0.01, 1.5],
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
            sampling: true,
            improved: false,
        };
        history.record(&progress);
        progress.result = Err(&failure);
        (progress.violation, progress.gradient_norm) = (f64::NAN, f64::NAN);
        history.record(&progress);
        let text = history.to_csv().unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].contains(r#",objective,area,"thickness, ""aft""",cd,max"#), "{}", lines[0]);
        assert_eq!(lines[1], "3,2,1e-1,1.5e0,,1e-2,2.5e-1,1e-7,5e-1,1.250000,sample");
        assert_eq!(lines[2], "3,2,,,,,,,5e-1,1.250000,failed");
    }
}
