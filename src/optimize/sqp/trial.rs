//! Steps tried, and what decides whether they are taken.

use super::bend::bend;
use super::proposal::Proposal;
use super::state::SqpRun;
use crate::design::{Evaluation, Problem};
use crate::optimize::kkt::Iterate;
use crate::optimize::ledger::Ledger;

/// Smallest trust region.
const LEAST_RADIUS: f64 = 1e-10;
/// Gain over prediction with which a step is taken.
const ENOUGH: f64 = 1e-4;
/// Gain of the objective over prediction with which a step is taken in spite of the merit function.
const ENOUGH_LOWER: f64 = 0.1;
/// Steps in a row that may be taken in spite of the merit function.
const MOST_RELAXED: usize = 3;

/// A point that may be taken.
struct Candidate {
    x: Vec<f64>,
    evaluation: Evaluation,
    /// Gain over prediction.
    ratio: f64,
    /// Whether it is taken in spite of the merit function.
    relaxed: bool,
}

/// The result of trying a proposal.
enum Trial {
    Accepted(Candidate),
    Rejected(Vec<f64>, Evaluation),
    Failed,
}

/// Takes one step; `None` where there is none to take.
pub(super) fn advance(ledger: &mut Ledger<'_>, run: &mut SqpRun) -> Option<()> {
    while run.frame.size() > 0 && run.radius > LEAST_RADIUS {
        let Some(mut proposal) = run.propose() else {
            // a curvature that numbers cannot handle is forgotten
            if !run.curvature.forget() {
                return None;
            }
            continue;
        };
        bend(ledger, run, &mut proposal);
        match attempt(ledger, run, &proposal) {
            Trial::Accepted(Candidate { x, evaluation, ratio, relaxed }) => {
                run.adapt(ratio, proposal.length);
                run.relaxed = if relaxed { run.relaxed + 1 } else { 0 };
                run.learn(&x, &evaluation, &proposal.multipliers);
                let point = Iterate::new(ledger, &x, evaluation);
                run.arrive(ledger, point, proposal.length);
                return Some(());
            }
            Trial::Failed if ledger.halted().is_some() => return None,
            Trial::Failed => run.radius = 0.25 * proposal.length,
            Trial::Rejected(x, evaluation) => {
                run.learn(&x, &evaluation, &proposal.multipliers);
                run.radius = 0.5 * proposal.length;
                run.leaps.note(&run.point, &x, &evaluation, &run.frame);
                if run.leaps.ending().is_some() {
                    return None;
                }
            }
        }
    }
    None
}

/// Evaluates a proposal, and once more with the constraints' own curvature where that spoilt it: where the step would
/// be taken if the constraints had gone as their gradients tell.
fn attempt(ledger: &mut Ledger<'_>, run: &SqpRun, proposal: &Proposal) -> Trial {
    let x = run.frame.moved(&run.point.x, &proposal.step);
    let Ok(evaluation) = ledger.evaluate(&x) else { return Trial::Failed };
    if let Some((ratio, relaxed)) = judge(run, proposal, &x, &evaluation) {
        return Trial::Accepted(Candidate { x, evaluation, ratio, relaxed });
    }
    let ends = run.values(&evaluation);
    let spoilt = run.charged(&ends) - run.charged(&proposal.linear);
    let otherwise = run.gained(&x, &evaluation) + spoilt;
    if spoilt <= noise(run) || otherwise < ENOUGH * proposal.predicted {
        return Trial::Rejected(x, evaluation);
    }
    // rows as the linear model sees them, moved by what it missed
    let now = run.values(&run.point.evaluation);
    let corrected: Vec<f64> = now.iter().zip(&ends).zip(&proposal.linear).map(|((v, e), l)| v + e - l).collect();
    let Some(mut second) = run.correct(&corrected) else { return Trial::Rejected(x, evaluation) };
    bend(ledger, run, &mut second);
    let other = run.frame.moved(&run.point.x, &second.step);
    match ledger.evaluate(&other) {
        Ok(found) => match judge(run, proposal, &other, &found) {
            Some((ratio, relaxed)) => Trial::Accepted(Candidate { x: other, evaluation: found, ratio, relaxed }),
            None => Trial::Rejected(x, evaluation),
        },
        Err(_) if ledger.halted().is_some() => Trial::Failed,
        Err(_) => Trial::Rejected(x, evaluation),
    }
}

/// Differences of the objective that say nothing.
fn noise(run: &SqpRun) -> f64 {
    1e-14 * run.point.evaluation.objective.abs()
}

/// Gain over prediction of a point that is taken, and whether that is in spite of the merit function.
///
/// The merit function decides, within the funnel. Near the constraints it refuses good steps for what the curvature of
/// the constraints costs (Maratos); there a step that lowers the objective as predicted is taken, a few times in a row.
fn judge(run: &SqpRun, proposal: &Proposal, x: &[f64], evaluation: &Evaluation) -> Option<(f64, bool)> {
    if !run.admits(evaluation) {
        return None;
    }
    let ratio = (run.gained(x, evaluation) + noise(run)) / (proposal.predicted.max(0.0) + noise(run));
    if ratio >= ENOUGH {
        return Some((ratio, false));
    }
    let lower = -run.point.height(x, evaluation);
    let charged = run.charged(&run.values(&run.point.evaluation));
    let downhill = proposal.lower > 0.1 * charged && proposal.lower > 0.0;
    let relaxed = downhill && lower >= ENOUGH_LOWER * proposal.lower && run.relaxed < MOST_RELAXED;
    relaxed.then(|| (lower / proposal.lower, true))
}

#[cfg(test)]
#[path = "trial_tests.rs"]
mod tests;
