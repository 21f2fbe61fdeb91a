//! The end of a run in words: which constraints hold the design, which cannot be met.

use super::engineering::engineering;
use super::kkt::{ActiveBound, Iterate, opposition, reached};
use super::ledger::Ledger;
use super::outcome::Termination;
use super::redundancy;
use super::sqp::leap::Leap;
use super::trend::standing;
use super::vector::norm;
use crate::design::{Bounds, Problem};

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
        ledger.residual(point),
        point.violation
    );
    message += &holding(ledger, point);
    message += &redundancy::in_words(ledger, point);
    message
}

/// The constraints and bounds that hold the design: the constraints, strongest first, with what they cost, and the
/// bounds of variables.
pub(super) fn holding(ledger: &Ledger<'_>, point: &Iterate) -> String {
    let bounds = &ledger.description().constraint_bounds;
    let pull = |k: &usize| point.optimality.multipliers[*k].abs() * norm(&point.evaluation.jacobian[*k]);
    let mut held: Vec<usize> = (0..bounds.len()).filter(|&k| point.optimality.multipliers[k] != 0.0).collect();
    held.sort_by(|a, b| pull(b).total_cmp(&pull(a)));
    let mut words: Vec<String> = Vec::new();
    let mut families: Vec<(String, usize)> = Vec::new();
    for k in held {
        let place = place(point.evaluation.constraints[k], &bounds[k], norm(&point.evaluation.jacobian[k]));
        let name = &ledger.description().constraint_names[k];
        if let Some((family, _)) = name.split_once('[') {
            let member = format!("{family} at {place}");
            match families.iter_mut().find(|(known, _)| *known == member) {
                Some((_, count)) => *count += 1,
                None => families.push((member, 1)),
            }
            continue;
        }
        let cost = engineering(point.optimality.multipliers[k], 3);
        words.push(format!("{name} at {place} (objective {cost} per unit of it)"));
    }
    words.extend(families.into_iter().map(|(member, count)| match count {
        1 => format!("{member} in one place"),
        _ => format!("{member} in {count} places"),
    }));
    let more = words.len().saturating_sub(MOST);
    words.truncate(MOST);
    if more > 0 {
        words.push(format!("{more} more"));
    }
    words.extend(held_variables(ledger, point));
    match &words[..] {
        [] if bounds.is_empty() => String::new(),
        [] => " Neither a constraint nor a bound of a variable holds the design.".into(),
        _ => format!(" The design is held by {}.", words.join(", ")),
    }
}

/// The side of its bounds on which a constraint stands.
fn place(value: f64, bounds: &Bounds, slope: f64) -> String {
    match reached(value, bounds, slope) {
        Some(ActiveBound::Lower) => format!("its minimum {}", engineering(bounds.lower, 5)),
        Some(ActiveBound::Upper) => format!("its maximum {}", engineering(bounds.upper, 5)),
        _ => format!("its value {}", engineering(bounds.lower, 5)),
    }
}

/// The variables that stand at bounds which hold the design.
fn held_variables(ledger: &Ledger<'_>, point: &Iterate) -> Option<String> {
    let names = ledger.description().variable_names.iter().zip(&point.optimality.bound_multipliers);
    let held: Vec<&str> = names.filter(|(_, multiplier)| **multiplier != 0.0).map(|(name, _)| name.as_str()).collect();
    let listed = held[..held.len().min(MOST)].join(", ");
    match held.len() {
        0 => None,
        1 => Some(format!("the bound of the variable {listed}")),
        count if count > MOST => Some(format!("the bounds of {count} variables ({listed}, …)")),
        count => Some(format!("the bounds of {count} variables ({listed})")),
    }
}

/// The iterations are used up; `point` is handed out.
pub(super) fn out_of_iterations(ledger: &Ledger<'_>, point: &Iterate) -> String {
    format!(
        "Stopped at the limit of {} iterations before a tolerance was met.{}",
        ledger.iteration,
        standing(ledger.residual(point), point.violation)
    )
}

/// All steps from `point` lead to failed analyses.
pub(super) fn beset(ledger: &Ledger<'_>, point: &Iterate) -> (Termination, String) {
    let message = format!(
        "Every step leads to shapes that cannot be analysed: {}. KKT residual {:.1e}, largest violation {:.1e}; try a start further off, or bounds or constraints that keep such shapes out.",
        ledger.last_failure(),
        ledger.residual(point),
        point.violation
    );
    (Termination::Failed, message)
}

/// The analysis leaps beside `point`, which is handed out.
pub(super) fn leaping(ledger: &Ledger<'_>, point: &Iterate, leap: &Leap) -> (Termination, String) {
    let names = &ledger.description().constraint_names;
    let name = leap.constraint.map_or("the objective", |k| &names[k]);
    let [from, to] = leap.values.map(|value| engineering(value, 5));
    let message = format!(
        "No derivative leads on: beside this design {name} leaps from {from} to {to} within {:.1e} of a natural step of the variables, as where a flow has two states. A constraint that keeps away from there, another start or other conditions help. KKT residual {:.1e}, largest violation {:.1e}.{}",
        leap.length,
        ledger.residual(point),
        point.violation,
        holding(ledger, point)
    );
    (Termination::Stalled, message)
}

/// No step leads on; `point` is handed out.
pub(super) fn at_rest(ledger: &Ledger<'_>, point: &Iterate, tolerance: f64) -> (Termination, String) {
    if point.violation > tolerance {
        return (Termination::Infeasible, contradiction(ledger, point, tolerance));
    }
    let message = format!(
        "No step leads further at the precision the problem is computed with; KKT residual {:.1e}, largest violation {:.1e}.{}{}",
        ledger.residual(point),
        point.violation,
        holding(ledger, point),
        redundancy::in_words(ledger, point)
    );
    (Termination::Stalled, message)
}

/// Which constraints are violated, by how much, and what stands against them.
fn contradiction(ledger: &Ledger<'_>, point: &Iterate, tolerance: f64) -> String {
    let (bounds, names) = (&ledger.description().constraint_bounds, &ledger.description().constraint_names);
    let constant = redundancy::constant(ledger, point);
    let missed = (0..bounds.len()).filter(|&k| bounds[k].violation(point.evaluation.constraints[k]) > tolerance);
    let (fixed, moving): (Vec<usize>, Vec<usize>) = missed.partition(|k| constant.contains(k));
    let violated: Vec<String> = fixed
        .iter()
        .chain(&moving)
        .map(|&k| {
            let value = point.evaluation.constraints[k];
            let place = if bounds[k].lower == bounds[k].upper {
                format!("the value {}", engineering(bounds[k].lower, 5))
            } else if value < bounds[k].lower {
                format!("the minimum {}", engineering(bounds[k].lower, 5))
            } else {
                format!("the maximum {}", engineering(bounds[k].upper, 5))
            };
            let off = bounds[k].violation(value);
            let why = if constant.contains(&k) { " (nothing that is free changes it)" } else { "" };
            format!("{} is {}, {off:.1e} off {place}{why}", names[k], engineering(value, 6))
        })
        .collect();
    let (against, by_bounds) = opposition(ledger, &point.x, &point.evaluation, tolerance);
    let mut opponents: Vec<String> = against.into_iter().map(|k| names[k].clone()).collect();
    if by_bounds {
        opponents.push("bounds of variables".into());
    }
    let against = match &opponents[..] {
        _ if moving.is_empty() => String::new(),
        [] => "; they stand against each other".to_owned(),
        _ => format!("; against them stand {}", opponents.join(", ")),
    };
    format!(
        "No design near here meets all constraints: {}{against}. Relax one of these, free more variables, or start elsewhere.",
        violated.join("; ")
    )
}
