//! The progress of a run: a bar on a terminal, a line per iteration elsewhere, events for programs.

use super::events::Events;
use super::message::Voice;
use crate::optimize::{Method, Outcome, Progress};
use crate::report::engineering;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;
use std::io::{IsTerminal, Write};

/// Shows the evaluations of a run as they come.
pub(super) struct RunProgress {
    way: Way,
    events: Events,
    expectation: Expectation,
    /// Iteration of the last line.
    told: Option<usize>,
}

enum Way {
    Silent,
    Bar(ProgressBar),
    Lines,
}

/// One evaluation as an event.
#[derive(Serialize)]
struct EvaluationEvent<'a> {
    event: &'static str,
    evaluation: usize,
    iteration: usize,
    /// `"start"`, `"trial"`, `"sample"` or `"failed"`, as in `history.csv`.
    kind: &'static str,
    objective: Option<f64>,
    best_objective: Option<f64>,
    violation: Option<f64>,
    gradient_norm: Option<f64>,
    step: f64,
    improved: bool,
    seconds: f64,
    /// Why the evaluation failed.
    failed: Option<&'a str>,
}

/// The end of a run as an event.
#[derive(Serialize)]
struct EndEvent<'a> {
    event: &'static str,
    status: &'a str,
    message: &'a str,
    objective: Option<f64>,
    evaluations: usize,
    iterations: usize,
    seconds: f64,
}

impl RunProgress {
    /// Progress as the voice of the process and standard error allow it.
    pub fn new(events: Events, goal: GradientGoal) -> Self {
        let way = if Voice::current().quiet || events.take_standard_error() {
            Way::Silent
        } else if std::io::stderr().is_terminal() {
            Way::Bar(bar())
        } else {
            Way::Lines
        };
        Self { way, events, expectation: Expectation::new(goal), told: None }
    }

    /// Shows one evaluation.
    pub fn show(&mut self, progress: &Progress<'_>) {
        let finite = |v: f64| v.is_finite().then_some(v);
        self.events.send(&EvaluationEvent {
            event: "evaluation",
            evaluation: progress.evaluation,
            iteration: progress.iteration,
            kind: progress.kind(),
            objective: progress.result.ok().map(|e| e.objective),
            best_objective: finite(progress.best_objective),
            violation: finite(progress.violation),
            gradient_norm: finite(progress.gradient_norm),
            step: progress.step,
            improved: progress.improved,
            seconds: progress.seconds,
            failed: progress.result.err().map(|f| f.reason.as_str()),
        });
        let expected = self.expectation.after(progress);
        match &self.way {
            Way::Silent => {}
            Way::Bar(bar) => {
                bar.set_length(expected as u64);
                bar.set_position(progress.evaluation as u64);
                bar.set_message(format!("iteration {}  {}", progress.iteration, standing(progress)));
            }
            Way::Lines => self.line(progress),
        }
    }

    /// A line for the first evaluation and for the first after each iteration.
    fn line(&mut self, progress: &Progress<'_>) {
        if self.told == Some(progress.iteration) || progress.sampling {
            return;
        }
        self.told = Some(progress.iteration);
        let _ = writeln!(
            std::io::stderr().lock(),
            "iteration {:4}  evaluation {:5}  {}  {:.2} s",
            progress.iteration,
            progress.evaluation,
            standing(progress),
            progress.seconds
        );
    }

    /// Ends the display.
    pub fn end(&mut self, outcome: &Outcome) {
        if let Way::Bar(bar) = &self.way {
            bar.finish_and_clear();
        }
        self.events.send(&EndEvent {
            event: "end",
            status: outcome.status.as_str(),
            message: &outcome.message,
            objective: outcome.evaluation.as_ref().map(|e| e.objective),
            evaluations: outcome.evaluations,
            iterations: outcome.iterations,
            seconds: outcome.seconds,
        });
    }
}

/// Where the run stands: the best objective, and what is left of constraints and gradient.
fn standing(progress: &Progress<'_>) -> String {
    let mut text = format!("best {}", engineering(progress.best_objective, 6));
    if progress.violation > 0.0 {
        text += &format!("  violation {:.1e}", progress.violation);
    }
    if progress.gradient_norm.is_finite() {
        text += &format!("  gradient {:.1e}", progress.gradient_norm);
    }
    text
}

fn bar() -> ProgressBar {
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template("{bar:20} {pos} of about {len}, about {eta} left  {wide_msg}") {
        bar.set_style(style);
    }
    bar
}

/// How many evaluations a run is expected to take, by how far the gradient has come on its way to the tolerance.
///
/// Methods converge linearly at worst, so that the logarithm of the gradient falls evenly; the guess errs towards more
/// evaluations where a method speeds up at the end.
struct Expectation {
    goal: GradientGoal,
    first: Option<f64>,
    least: f64,
}

impl Expectation {
    fn new(goal: GradientGoal) -> Self {
        Self { goal, first: None, least: f64::INFINITY }
    }

    /// The evaluations expected in all; never more than the limit and never fewer than there were.
    fn after(&mut self, progress: &Progress<'_>) -> usize {
        if progress.gradient_norm.is_finite() && progress.gradient_norm > 0.0 {
            self.first.get_or_insert(progress.gradient_norm);
            self.least = self.least.min(progress.gradient_norm);
        }
        let way = |from: f64, to: f64| (from / to).ln().max(0.0);
        let first = self.first.unwrap_or(1.0);
        let last = match self.goal {
            GradientGoal::Norm(norm) => norm,
            GradientGoal::Share(share) => share * first,
        };
        let (done, all) = (way(first, self.least), way(first, last.max(f64::MIN_POSITIVE)));
        // before anything is known, and while it says little, a few dozen
        let guess = if done > 0.05 * all && all > 0.0 { progress.evaluation as f64 * all / done } else { 0.0 };
        let expected = guess.max(50.0).min(progress.evaluation_limit as f64) as usize;
        expected.max(progress.evaluation)
    }
}

/// The norm of the gradient at which a run is expected to end.
#[derive(Debug, Clone, Copy)]
pub(super) enum GradientGoal {
    /// The tolerance of the method.
    Norm(f64),
    /// A share of the norm at the start, where the method ends by the fall of the objective.
    Share(f64),
}

impl GradientGoal {
    /// The goal of a method.
    pub fn of(method: &Method) -> Self {
        match method {
            Method::Sqp(sqp) => Self::Norm(sqp.optimality_tolerance),
            Method::Slsqp(slsqp) => Self::Norm(slsqp.optimality_tolerance),
            // runs of the built-in cases end between a thousandth and a hundred-thousandth
            Method::Lbfgs(_) | Method::Newton(_) | Method::GaussNewton(_) => Self::Share(1e-4),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::AnalysisFailure;

    #[test]
    fn the_length_is_what_is_expected_and_not_the_limit() {
        let failure = AnalysisFailure { reason: "none".into() };
        let at = |evaluation: usize, gradient_norm: f64| Progress {
            evaluation,
            iteration: evaluation,
            x: &[],
            result: Err(&failure),
            best_objective: 1.0,
            violation: 0.0,
            gradient_norm,
            step: 0.0,
            seconds: 0.0,
            evaluation_limit: 1500,
            sampling: false,
            improved: true,
        };
        let mut expectation = Expectation::new(GradientGoal::Norm(1e-6));
        assert_eq!(expectation.after(&at(1, 1.0)), 50);
        // half of the way by its logarithm
        assert_eq!(expectation.after(&at(100, 1e-3)), 200);
        // it climbs for a while: nothing is lost
        assert_eq!(expectation.after(&at(110, 1e-1)), 220);
        assert_eq!(expectation.after(&at(300, 1e-6)), 300);
        assert_eq!(expectation.after(&at(400, f64::NAN)), 400);
        let mut slow = Expectation::new(GradientGoal::Share(1e-4));
        slow.after(&at(1, 10.0));
        assert_eq!(slow.after(&at(1400, 5e-1)), 1500);
    }
}
