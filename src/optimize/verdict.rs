//! The end of a run in words: which constraints hold the design, which cannot be met.

use super::kkt::{ActiveBound, Iterate, opposition, reached};
use super::ledger::Ledger;
use super::outcome::Termination;
use super::vector::norm;
use crate::design::Problem;

/// Names listed at most.
const MOST: usize = 6;

/// The start cannot be analysed.
pub(super) fn fails_at_start(reason: &str) -> (Termination, String) {
    (Termination::Failed, format!("The analysis fails at the start: {reason}."))
}

/// The iterations are used up in a run without constraints.
pub(super) fn iteration_limit(iterations: usize) -> (Termination, String) {
    let message = format!("Stopped at the limit of {iterations} iterations before a tolerance was met.");
    (Termination::IterationLimit, message)
}

/// Failed analyses bar the way down; `slope` is the norm of the gradient.
pub(super) fn walled_in(ledger: &Ledger<'_>, slope: f64) -> (Termination, String) {
    let message = format!(
        "The objective falls only towards points where the analysis fails: {}. The norm of the gradient is {slope:.1e}.",
        ledger.last_failure()
    );
    (Termination::Failed, message)
}

/// No step lowers the objective; `slope` is the norm of the gradient, `steepest` the largest in the run.
pub(super) fn no_descent(slope: f64, steepest: f64) -> (Termination, String) {
    let ratio = slope / steepest;
    let message = format!(
        "No step lowers the objective further at the precision it is computed with; the norm of the gradient is {slope:.1e}, {ratio:.1e} of its largest."
    );
    (Termination::Stalled, message)
}

/// The point satisfies the first-order conditions.
pub(super) fn converged(ledger: &Ledger<'_>, point: &Iterate) -> String {
    let mut message = format!(
        "No direction that keeps the constraints lowers the objective any more: KKT residual {:.1e}, largest violation {:.1e}.",
        point.optimality.residual, point.violation
    );
    message += &holding(ledger, point);
    message
}

/// The constraints that hold the design, strongest first, with what they cost.
fn holding(ledger: &Ledger<'_>, point: &Iterate) -> String {
    let bounds = &ledger.description().constraint_bounds;
    let pull = |k: &usize| point.optimality.multipliers[*k].abs() * norm(&point.evaluation.jacobian[*k]);
    let mut held: Vec<usize> = (0..bounds.len()).filter(|&k| point.optimality.multipliers[k] != 0.0).collect();
    held.sort_by(|a, b| pull(b).total_cmp(&pull(a)));
    let words: Vec<String> = held
        .iter()
        .take(MOST)
        .map(|&k| {
            let row = &point.evaluation.jacobian[k];
            let place = match reached(point.evaluation.constraints[k], &bounds[k], norm(row)) {
                Some(ActiveBound::Lower) => format!("its minimum {}", bounds[k].lower),
                Some(ActiveBound::Upper) => format!("its maximum {}", bounds[k].upper),
                _ => format!("its value {}", bounds[k].lower),
            };
            let name = &ledger.description().constraint_names[k];
            format!("{name} at {place} (objective {:+.2e} per unit of it)", point.optimality.multipliers[k])
        })
        .collect();
    if words.is_empty() {
        return if bounds.is_empty() { String::new() } else { " No constraint holds the design.".into() };
    }
    let more = if held.len() > MOST { format!(" and {} more", held.len() - MOST) } else { String::new() };
    format!(" The design is held by {}{more}.", words.join(", "))
}

/// The iterations are used up; `point` is handed out.
pub(super) fn out_of_iterations(ledger: &Ledger<'_>, point: &Iterate) -> String {
    format!(
        "Stopped at the limit of {} iterations; KKT residual {:.1e}, largest violation {:.1e}.",
        ledger.iteration, point.optimality.residual, point.violation
    )
}

/// All steps from `point` lead to failed analyses.
pub(super) fn beset(ledger: &Ledger<'_>, point: &Iterate) -> (Termination, String) {
    let message = format!(
        "Every step leads to shapes that cannot be analysed: {}. KKT residual {:.1e}, largest violation {:.1e}; try a start further off, or bounds or constraints that keep such shapes out.",
        ledger.last_failure(),
        point.optimality.residual,
        point.violation
    );
    (Termination::Failed, message)
}

/// No step leads on; `point` is handed out.
pub(super) fn at_rest(ledger: &Ledger<'_>, point: &Iterate, tolerance: f64) -> (Termination, String) {
    if point.violation > tolerance {
        return (Termination::Infeasible, contradiction(ledger, point, tolerance));
    }
    let message = format!(
        "No step leads further at the precision the problem is computed with; KKT residual {:.1e}, largest violation {:.1e}.{}",
        point.optimality.residual,
        point.violation,
        holding(ledger, point)
    );
    (Termination::Stalled, message)
}

/// Which constraints are violated, by how much, and what stands against them.
fn contradiction(ledger: &Ledger<'_>, point: &Iterate, tolerance: f64) -> String {
    let (bounds, names) = (&ledger.description().constraint_bounds, &ledger.description().constraint_names);
    let violated: Vec<String> = (0..bounds.len())
        .filter(|&k| bounds[k].violation(point.evaluation.constraints[k]) > tolerance)
        .map(|k| {
            let value = point.evaluation.constraints[k];
            let place = if bounds[k].lower == bounds[k].upper {
                format!("the value {}", bounds[k].lower)
            } else if value < bounds[k].lower {
                format!("the minimum {}", bounds[k].lower)
            } else {
                format!("the maximum {}", bounds[k].upper)
            };
            format!("{} is {value:.6e}, {:.1e} off {place}", names[k], bounds[k].violation(value))
        })
        .collect();
    let (against, by_bounds) = opposition(ledger, &point.x, &point.evaluation, tolerance);
    let mut opponents: Vec<String> = against.into_iter().map(|k| names[k].clone()).collect();
    if by_bounds {
        opponents.push("bounds of variables".into());
    }
    let against = if opponents.is_empty() {
        "they stand against each other, or nothing that is free changes them".to_owned()
    } else {
        format!("against them stand {}", opponents.join(", "))
    };
    format!(
        "No design near here meets all constraints: {}; {against}. Relax one of these, free more variables, or start elsewhere.",
        violated.join("; ")
    )
}
