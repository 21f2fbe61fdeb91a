//! A run at a glance: what changed from start to end, what holds the design, and why it may be trusted. The terminal
//! and the page show the same.

use super::figures::{condition_text, surroundings_text};
use crate::case::Case;
use crate::design::DerivativeCheck;
use crate::optimize::Termination;
use crate::report::engineering;
use crate::report::json::{ActiveBoundReport, ConstraintReport, RunReport, Side};

/// Members from which on quantities such as `fold_indicator[0,0]` are shown as one.
const FAMILY: usize = 3;
/// Digits of numbers for people.
const DIGITS: usize = 4;

/// How a line of the overview is to be taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    Good,
    Warning,
    Bad,
}

/// One quantity, or a family of them, from start to end.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    pub name: String,
    pub start: String,
    pub end: String,
    pub change: String,
    pub bound: String,
    /// The effect of the bound: it holds the design, is violated, or does nothing.
    pub role: String,
    pub tone: Tone,
}

/// One reason to trust a result, or not to.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Check {
    pub text: String,
    pub tone: Tone,
}

/// The whole of a run.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Overview {
    /// The objective in words: the weighted sum of its quantities.
    pub objective: String,
    /// The operating points in words.
    pub conditions: Vec<String>,
    /// Objective at start and end, and the change.
    pub headline: [String; 3],
    /// Every quantity: the objective first.
    pub rows: Vec<Row>,
    /// The constraints and bounds that hold the design, strongest first.
    pub holds: Vec<String>,
    /// Why it may be trusted.
    pub checks: Vec<Check>,
}

/// Whether the objective of a case is a drag coefficient, or a weighted mean of some.
pub(super) fn minimises_drag(case: &Case) -> bool {
    let names = case.problem.quantities().iter().map(crate::design::Quantity::name);
    let weights = case.problem.objective_weights();
    let in_objective = || names.clone().zip(weights).filter(|(_, weight)| **weight != 0.0);
    let sum: f64 = weights.iter().sum();
    in_objective().count() > 0 && in_objective().all(|(name, _)| is_drag(&name)) && (sum - 1.0).abs() < 1e-9
}

/// The objective in words: the weighted sum of its quantities, such as `cd + 0.5 fold_penalty`; `objective` where there
/// are many.
pub(super) fn objective_name(case: &Case) -> String {
    const MOST: usize = 4;
    let quantities = case.problem.quantities().iter().map(crate::design::Quantity::name);
    let terms: Vec<(String, f64)> =
        quantities.zip(case.problem.objective_weights().iter().copied()).filter(|(_, weight)| *weight != 0.0).collect();
    if terms.len() > MOST {
        return "objective".into();
    }
    weighted_names(&terms)
}

/// A weighted sum in words.
fn weighted_names(terms: &[(String, f64)]) -> String {
    let mut text = String::new();
    for (k, (name, weight)) in terms.iter().enumerate() {
        text += match (k, *weight < 0.0) {
            (0, false) => "",
            (0, true) => "-",
            (_, false) => " + ",
            (_, true) => " - ",
        };
        if weight.abs() != 1.0 {
            text += &format!("{} ", engineering(weight.abs(), DIGITS));
        }
        text += name;
    }
    text
}

/// Whether the objective is one quantity and no more, whose row then stands for both.
fn is_single(case: &Case) -> bool {
    let weights = case.problem.objective_weights();
    let mut used = weights.iter().filter(|weight| **weight != 0.0);
    used.next() == Some(&1.0) && used.next().is_none()
}

fn is_drag(name: &str) -> bool {
    name == "cd" || name.starts_with("cd_at(")
}

/// A value of a quantity with the unit it has in case files; drag in counts.
pub(super) fn shown(name: &str, value: Option<f64>) -> String {
    let Some(value) = value.filter(|v| v.is_finite()) else { return "none".into() };
    let number = |v: f64| engineering(v, if v.abs() < 1e-6 { 2 } else { DIGITS });
    match name {
        _ if is_drag(name) => format!("{} counts", number(1e4 * value)),
        "trailing_edge_angle" | "concavity" => format!("{} rad", number(value)),
        _ if name == "alpha" || name.starts_with("alpha_at(") => format!("{}°", number(value)),
        _ => number(value),
    }
}

/// The change from start to end: in per cent where that says something, else the difference.
fn change(name: &str, start: Option<f64>, end: Option<f64>) -> String {
    let (Some(start), Some(end)) = (start.filter(|v| v.is_finite()), end.filter(|v| v.is_finite())) else {
        return String::new();
    };
    let sign = if end > start { "+" } else { "" };
    let ratio = start / end;
    if (end - start).abs() <= 1e-9 * start.abs() {
        "0".into()
    } else if ratio > 100.0 && ratio < 1e9 {
        // a fall of 99 per cent and more says little, but what has vanished has no ratio
        format!("÷ {}", engineering(ratio, 3))
    } else if start > 0.0 && end > 0.0 && end < 10.0 * start {
        format!("{sign}{} %", engineering(100.0 * (end - start) / start, 3))
    } else {
        format!("{sign}{}", shown(name, Some(end - start)))
    }
}

fn bound(name: &str, lower: Option<f64>, upper: Option<f64>) -> String {
    match (lower, upper) {
        (Some(l), Some(u)) if l == u => format!("= {}", shown(name, lower)),
        (Some(_), Some(_)) => format!("{} … {}", shown(name, lower), shown(name, upper)),
        (Some(_), None) => format!("≥ {}", shown(name, lower)),
        (None, Some(_)) => format!("≤ {}", shown(name, upper)),
        (None, None) => String::new(),
    }
}

/// The cost of a bound: what the objective gains or loses for one per cent of it, or for a hundredth where it is zero.
fn cost(name: &str, in_counts: bool, constraint: &ConstraintReport) -> String {
    let multiplier = constraint.multiplier.unwrap_or(0.0);
    let reached = if multiplier > 0.0 { constraint.lower } else { constraint.upper }.unwrap_or(0.0);
    let (step, more) = match reached {
        0.0 => (0.01, format!("+{}", shown(name, Some(0.01)))),
        _ => (0.01 * reached.abs(), "+1 %".to_string()),
    };
    let gain = multiplier * step * if in_counts { 1e4 } else { 1.0 };
    let sign = if gain > 0.0 { "+" } else { "" };
    format!("{more} of it: objective {sign}{}{}", engineering(gain, 3), if in_counts { " counts" } else { "" })
}

/// The family of a name, such as `fold_indicator` of `fold_indicator[0,0]`.
fn family(name: &str) -> Option<&str> {
    name.split_once('[').map(|(family, _)| family)
}

/// A quantity, or several of a family that are shown as one.
pub(super) struct Group<'a> {
    /// Name of the quantity or of the family.
    pub name: &'a str,
    /// Places of the members among all names.
    pub members: Vec<usize>,
}

/// The quantities in their order, families put together.
pub(super) fn groups<'a>(names: &[&'a str]) -> Vec<Group<'a>> {
    let members =
        |wanted: &str| -> Vec<usize> { (0..names.len()).filter(|&k| family(names[k]) == Some(wanted)).collect() };
    let mut all: Vec<Group<'a>> = Vec::new();
    for (k, name) in names.iter().enumerate() {
        match family(name).map(|one| (one, members(one))).filter(|(_, members)| members.len() >= FAMILY) {
            Some((one, _)) if all.iter().any(|group| group.name == one) => {}
            Some((one, members)) => all.push(Group { name: one, members }),
            None => all.push(Group { name, members: vec![k] }),
        }
    }
    all
}

/// Violations below this share of the bound (of 1, where the bound is 0) are those of round-off and tolerances.
const VIOLATED: f64 = 1e-6;

fn is_violated(constraint: &ConstraintReport) -> bool {
    let bounds = [constraint.lower, constraint.upper].into_iter().flatten();
    let size = bounds.map(f64::abs).filter(|b| *b > 0.0).fold(1.0, f64::min);
    constraint.violation.is_some_and(|v| !(v <= VIOLATED * size))
}

impl Overview {
    /// The overview of a run of `case`, with the derivatives that were checked at its end.
    pub fn new(case: &Case, result: &RunReport, derivatives: &Derivatives) -> Self {
        let (objective, in_counts) = (objective_name(case), minimises_drag(case));
        let unit = if in_counts { "cd" } else { "" };
        let (start, end) = (result.initial_objective, result.objective);
        let headline = [shown(unit, start), shown(unit, end), change(unit, start, end)];
        let conditions = case.problem.operating_points().iter().map(|point| {
            let place = if point.name.is_empty() { String::new() } else { format!("{}: ", point.name) };
            let free = point.angle.map(|_| format!("α free, {}", surroundings_text(&point.condition)));
            format!("{place}{}", free.unwrap_or_else(|| condition_text(&point.condition)))
        });
        let mut rows = Vec::new();
        if !is_single(case) {
            rows.push(Row {
                name: "objective".into(),
                start: headline[0].clone(),
                end: headline[1].clone(),
                change: headline[2].clone(),
                bound: String::new(),
                role: "minimised".into(),
                tone: Tone::Plain,
            });
        }
        let names: Vec<&str> = result.values.iter().map(|(name, _)| name).collect();
        rows.extend(groups(&names).iter().map(|group| match group.members[..] {
            [_] => quantity_row(result, group.name, in_counts, group.name == objective),
            ref members => family_row(result, group.name, &members.iter().map(|k| names[*k]).collect::<Vec<_>>()),
        }));
        let holds = holds(result, in_counts);
        Self { conditions: conditions.collect(), objective, headline, rows, holds, checks: checks(result, derivatives) }
    }
}

fn quantity_row(result: &RunReport, name: &str, in_counts: bool, minimised: bool) -> Row {
    let value = |values: &crate::report::json::Named<Option<f64>>| values.get(name).copied().flatten();
    let (start, end) = (value(&result.initial), value(&result.values));
    let mut row = Row {
        name: name.to_string(),
        start: shown(name, start),
        end: shown(name, end),
        change: change(name, start, end),
        bound: String::new(),
        role: if minimised { "minimised".into() } else { String::new() },
        tone: Tone::Plain,
    };
    // without any design the verdict gives the reason once
    if let Some(reason) = result.without_value.get(name) {
        let told = result.objective.is_none() && result.message.contains(reason.as_str());
        row.role = if told { "no value".into() } else { format!("no value: {reason}") };
    }
    if let Some(constraint) = result.constraints.get(name) {
        row.bound = bound(name, constraint.lower, constraint.upper);
        let multiplier = constraint.multiplier.unwrap_or(0.0);
        if is_violated(constraint) {
            row.role = format!("violated by {}", engineering(constraint.violation.unwrap_or(f64::NAN), 3));
            row.tone = Tone::Bad;
        } else if multiplier != 0.0 {
            row.role = format!("holds; {}", cost(name, in_counts, constraint));
        }
    }
    row
}

/// A row for all members of a family: the one nearest to its bound.
fn family_row(result: &RunReport, name: &str, members: &[&str]) -> Row {
    let constraints: Vec<&ConstraintReport> = members.iter().filter_map(|m| result.constraints.get(m)).collect();
    let above = constraints.iter().all(|c| c.lower.is_none()) && !constraints.is_empty();
    let extreme = |values: &crate::report::json::Named<Option<f64>>| {
        let all = members.iter().filter_map(|m| Some((*m, values.get(m).copied().flatten()?)));
        all.min_by(|a, b| if above { b.1.total_cmp(&a.1) } else { a.1.total_cmp(&b.1) })
    };
    let word = if above { "largest" } else { "smallest" };
    let place =
        |(member, value): (&str, f64)| format!("{} at {}", shown(name, Some(value)), member.trim_start_matches(name));
    let (start, end) = (extreme(&result.initial), extreme(&result.values));
    let active = constraints.iter().filter(|c| c.multiplier.unwrap_or(0.0) != 0.0).count();
    let violated = constraints.iter().filter(|c| is_violated(c)).count();
    let equal = constraints.windows(2).all(|c| (c[0].lower, c[0].upper) == (c[1].lower, c[1].upper));
    Row {
        name: format!("{name}, {word} of {}", members.len()),
        start: start.map_or("none".into(), place),
        end: end.map_or("none".into(), place),
        change: change(name, start.map(|s| s.1), end.map(|e| e.1)),
        bound: match constraints.first() {
            Some(first) if equal => bound(name, first.lower, first.upper),
            Some(_) => "several".into(),
            None => String::new(),
        },
        role: match (violated, active) {
            (0, 0) => String::new(),
            (0, _) => format!("holds in {}", places(active)),
            _ => format!("violated in {}", places(violated)),
        },
        tone: if violated > 0 { Tone::Bad } else { Tone::Plain },
    }
}

fn places(count: usize) -> String {
    if count == 1 { "one place".into() } else { format!("{count} places") }
}

/// Constraints and bounds of variables that hold the design.
fn holds(result: &RunReport, in_counts: bool) -> Vec<String> {
    let mut texts = Vec::new();
    let mut families: Vec<(&str, usize, &ConstraintReport)> = Vec::new();
    let active = result.constraints.iter().filter(|(_, c)| c.multiplier.unwrap_or(0.0) != 0.0);
    for (name, constraint) in active {
        if let Some(one) = family(name) {
            match families.iter_mut().find(|(known, ..)| *known == one) {
                Some((_, count, _)) => *count += 1,
                None => families.push((one, 1, constraint)),
            }
            continue;
        }
        texts.push(format!("{name} {} ({})", reached(name, constraint), cost(name, in_counts, constraint)));
    }
    texts.extend(
        families
            .iter()
            .map(|(name, count, constraint)| format!("{name} {} in {}", reached(name, constraint), places(*count))),
    );
    texts.extend(held_variables(result));
    texts
}

/// The bound that a constraint has reached.
fn reached(name: &str, constraint: &ConstraintReport) -> String {
    match (constraint.lower, constraint.upper) {
        (Some(l), Some(u)) if l == u => bound(name, constraint.lower, constraint.upper),
        _ if constraint.multiplier.unwrap_or(0.0) > 0.0 => bound(name, constraint.lower, None),
        _ => bound(name, None, constraint.upper),
    }
}

/// Variables at their bounds, in one text.
fn held_variables(result: &RunReport) -> Option<String> {
    let all: Vec<(&str, &ActiveBoundReport)> = result.active_bounds.iter().collect();
    let one = |(name, active): &(&str, &ActiveBoundReport)| {
        let side = match active.side {
            Side::Lower => "≥",
            Side::Upper => "≤",
        };
        let idle = if active.multiplier == 0.0 { " without need" } else { "" };
        format!("{name} {side} {}{idle}", engineering(active.bound, 3))
    };
    const MOST: usize = 8;
    let listed: Vec<String> = all.iter().take(MOST).map(one).collect();
    let more = if all.len() > MOST { format!(" and {} more", all.len() - MOST) } else { String::new() };
    let total = result.variables.0.len();
    match all.len() {
        0 => None,
        count => Some(format!("bounds of {count} of {total} variables: {}{more}", listed.join(", "))),
    }
}

/// How the exact derivatives at the end compare with finite differences along one direction of all variables.
#[derive(Debug, Clone, Default)]
pub(super) struct Derivatives {
    /// One comparison for each quantity that is no member of a family; empty where they could not be made.
    pub checks: Vec<DerivativeCheck>,
}

fn checks(result: &RunReport, derivatives: &Derivatives) -> Vec<Check> {
    let check = |tone: Tone, text: String| Check { text, tone };
    let mut all = vec![convergence_check(result), gradient_check(derivatives)];
    let worst = result.constraints.iter().filter(|(_, c)| is_violated(c)).count();
    if !result.constraints.0.is_empty() {
        let unknown = result.constraints.iter().any(|(_, c)| c.value.is_none());
        all.push(match worst {
            _ if unknown => check(Tone::Bad, "the constraints could not be evaluated".into()),
            0 => check(Tone::Good, "all constraints are met".into()),
            1 => check(Tone::Bad, "one constraint is violated".into()),
            _ => check(Tone::Bad, format!("{worst} constraints are violated")),
        });
    }
    if let Some(folded) = result.folded {
        let indicator = engineering(result.min_fold_indicator.unwrap_or(f64::NAN), 3);
        all.push(match folded {
            true => check(Tone::Bad, format!("the box has folded (smallest indicator {indicator})")),
            false => check(Tone::Good, format!("the box has not folded (smallest indicator {indicator})")),
        });
    }
    if let Some(distance) = result.target_distance {
        let [mean, largest] = [distance.root_mean_square, distance.largest].map(|d| engineering(d, 3));
        all.push(check(Tone::Plain, format!("distance to the target: rms {mean}, largest {largest}")));
    }
    all.push(match result.self_intersecting {
        true => check(Tone::Bad, "the section crosses itself".into()),
        false => check(Tone::Good, "the section does not cross itself".into()),
    });
    if result.failed_evaluations > 0 {
        let text = format!("{} of {} evaluations failed on the way", result.failed_evaluations, result.evaluations);
        all.push(check(Tone::Plain, text));
    }
    all.push(match result.repairs.len() {
        0 => check(Tone::Good, "no input was repaired".into()),
        1 => check(Tone::Warning, "one repair of the input, listed below".into()),
        count => check(Tone::Warning, format!("{count} repairs of the input, listed below")),
    });
    all
}

fn convergence_check(result: &RunReport) -> Check {
    let residual = match result.kkt_residual {
        residual if residual.is_finite() => format!(" (KKT residual {})", engineering(residual, 2)),
        _ => String::new(),
    };
    let tone = match result.status {
        Termination::Converged => Tone::Good,
        Termination::Stalled | Termination::IterationLimit | Termination::EvaluationLimit => Tone::Warning,
        _ => Tone::Bad,
    };
    Check { text: format!("{}{residual}", result.status), tone }
}

fn gradient_check(derivatives: &Derivatives) -> Check {
    let checks = &derivatives.checks;
    let wrong: Vec<&str> = checks.iter().filter(|c| !c.agrees()).map(|c| c.quantity.as_str()).collect();
    match (checks.is_empty(), &wrong[..]) {
        (true, _) => Check { text: "the gradients could not be checked here".into(), tone: Tone::Warning },
        (_, []) => Check {
            text: format!("exact gradients agree with finite differences ({} quantities)", checks.len()),
            tone: Tone::Good,
        },
        _ => {
            Check { text: format!("gradients disagree with finite differences: {}", wrong.join(", ")), tone: Tone::Bad }
        }
    }
}

#[cfg(test)]
#[path = "overview_tests.rs"]
mod tests;
