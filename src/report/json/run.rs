//! `result.json`: the end of a run.

use super::named::without_value;
use super::{Named, identifiers};
use crate::case::{Case, CaseOutcome};
use crate::design::{DesignProblem, Problem, ProblemDescription, Shape, TargetDistance};
use crate::flow::Solution;
use crate::optimize::{Optimizer, REACHED, Termination};
use serde::Serialize;

/// The end of a run of a case.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunReport {
    /// Name of the case.
    pub case: String,
    /// Name of the optimiser.
    pub optimizer: &'static str,
    /// Why the run ended.
    pub status: Termination,
    /// The reason in a sentence with numbers.
    pub message: String,
    /// Evaluations of the problem, failed ones included.
    pub evaluations: usize,
    /// How many evaluations failed.
    pub failed_evaluations: usize,
    /// Iterations of the optimiser.
    pub iterations: usize,
    /// Wall-clock time of the run in seconds.
    pub seconds: f64,
    /// Objective of the best design; `None` where the start could not be evaluated.
    pub objective: Option<f64>,
    /// Value of every quantity of objective, constraints and report at the best design; `None` for one without. Where
    /// no evaluation succeeded these are the values at the start that could be found.
    pub values: Named<Option<f64>>,
    /// The reason for every quantity that has no value at the best design.
    pub without_value: Named<String>,
    /// The constraints by the name of their quantity.
    pub constraints: Named<ConstraintReport>,
    /// How far the best design is from the first-order conditions: see
    /// [`Outcome::kkt_residual`](crate::optimize::Outcome::kkt_residual).
    pub kkt_residual: f64,
    /// The best design: every variable in its own unit.
    pub variables: Named<f64>,
    /// Objective of the start; `None` where the start could not be evaluated.
    pub initial_objective: Option<f64>,
    /// Value of every quantity at the start; `None` where a quantity has no value there.
    pub initial: Named<Option<f64>>,
    /// The start: every variable in its own unit.
    pub initial_variables: Named<f64>,
    /// The variables that stand at one of their bounds.
    pub active_bounds: Named<ActiveBoundReport>,
    /// Name of the flow solver, which the run never changed; `None` without a flow.
    pub flow_solver: Option<&'static str>,
    /// Drag and its parts at every operating point; empty without a flow.
    pub drag: Vec<DragReport>,
    /// A sentence for everything that was mended in the files of the case.
    pub repairs: Vec<String>,
    /// Smallest fold indicator of the box; `None` without a box.
    pub min_fold_indicator: Option<f64>,
    /// Whether the box has folded; `None` without a box.
    pub folded: Option<bool>,
    /// Whether the section crosses itself.
    pub self_intersecting: bool,
    /// Distance of the best design from the target; `None` without a target.
    pub target_distance: Option<TargetDistance>,
    /// For every name of a quantity or a variable a name that programming languages accept.
    pub identifiers: Named<String>,
}

/// Drag at an operating point.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DragReport {
    /// Name of the operating point; empty where there is one without a name.
    pub point: String,
    /// Drag of the start; `None` without a flow that holds.
    pub initial: Option<DragParts>,
    /// Drag of the best design; `None` without a flow that holds.
    pub end: Option<DragParts>,
}

/// Drag coefficient with its parts. Friction and pressure add up to the whole; what shocks cost is within the pressure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DragParts {
    /// Drag coefficient.
    pub cd: f64,
    /// Drag coefficient of the friction.
    pub cd_friction: f64,
    /// Drag coefficient of the pressure.
    pub cd_pressure: f64,
    /// Drag coefficient of shocks; zero by a solver that knows none.
    pub cd_wave: f64,
}

/// Drag at every operating point of a problem about a shape; `None` for a point without a flow that holds.
fn drag_of(problem: &DesignProblem, shape: Option<&Shape>) -> Vec<Option<DragParts>> {
    let flows = shape.and_then(|shape| problem.flows(shape)).map(|flows| flows.solutions).unwrap_or_default();
    let parts = |s: &Solution| DragParts {
        cd: s.coefficients.cd,
        cd_friction: s.cd_friction,
        cd_pressure: s.cd_pressure,
        cd_wave: s.cd_wave,
    };
    let of = |k: usize| flows.get(k)?.as_ref().ok().filter(|s| s.is_solved()).map(parts);
    (0..problem.operating_points().len()).map(of).collect()
}

/// A side of the bounds of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The smallest allowed value.
    Lower,
    /// The largest allowed value.
    Upper,
}

/// A variable at one of its bounds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ActiveBoundReport {
    /// The bound that is reached.
    pub side: Side,
    /// Value of that bound, in the unit of the variable.
    pub bound: f64,
    /// Change of the optimal objective per unit of the bound: positive at a lower bound, negative at an upper one, 0
    /// where the variable stands at the bound but is not held by it.
    pub multiplier: f64,
}

/// A constraint at the best design.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ConstraintReport {
    /// Value of the quantity.
    pub value: Option<f64>,
    /// Smallest allowed value.
    pub lower: Option<f64>,
    /// Largest allowed value.
    pub upper: Option<f64>,
    /// How far the value lies outside of the bounds, 0 inside.
    pub violation: Option<f64>,
    /// Change of the optimal objective per unit of the bound that is reached: positive at a lower bound, negative at
    /// an upper one.
    pub multiplier: Option<f64>,
}

impl RunReport {
    /// The report of a run of `case`. The case is evaluated at its start for it.
    pub fn new(case: &Case, end: &CaseOutcome) -> Self {
        let (outcome, problem) = (&end.outcome, case.problem.description());
        let evaluation = outcome.evaluation.as_ref();
        let start = case.problem.start_values();
        // a start without a value is no error of a run that went on from there
        let initial_drag = drag_of(&case.problem, case.problem.shape(&start).ok().as_ref());
        let initial: Vec<Option<f64>> = case.problem.values_at(&start).into_iter().map(Result::ok).collect();
        let weighted = initial.iter().zip(case.problem.objective_weights()).filter(|(_, weight)| **weight != 0.0);
        let initial_objective = weighted.map(|(value, weight)| Some((*value)? * weight)).sum();
        let names = &problem.value_names;
        // found again only where a value is lacking: for the reason, and for the others where the evaluation failed
        let known = evaluation.map(|e| e.values.as_slice()).unwrap_or_default();
        let lacking = evaluation.is_none() || known.iter().any(|v| !v.is_finite());
        let alone = if lacking { case.problem.values_at(&end.variables) } else { Vec::new() };
        let at_end: Vec<Option<f64>> = match evaluation {
            Some(_) => known.iter().map(|v| v.is_finite().then_some(*v)).collect(),
            None => alone.iter().map(|v| v.as_ref().ok().copied()).collect(),
        };
        let value = |name: &String| names.iter().position(|n| n == name).and_then(|k| at_end[k]);
        let constrained: Vec<Option<f64>> = problem.constraint_names.iter().map(value).collect();
        let values = |of: &dyn Fn(usize) -> Option<f64>| Named::new(names, (0..names.len()).map(of));
        let end_drag = drag_of(&case.problem, Some(&end.shape));
        let points = case.problem.operating_points().iter().zip(initial_drag.into_iter().zip(end_drag));
        let drag = points.map(|(point, (initial, end))| DragReport { point: point.name.clone(), initial, end });
        Self {
            case: case.name.clone(),
            optimizer: case.method.name(),
            status: outcome.status,
            message: outcome.message.clone(),
            evaluations: outcome.evaluations,
            failed_evaluations: outcome.failures,
            iterations: outcome.iterations,
            seconds: outcome.seconds,
            objective: evaluation.map(|e| e.objective),
            values: values(&|k| at_end[k]),
            without_value: without_value(names, &alone),
            constraints: constraint_reports(problem, &constrained, &outcome.multipliers),
            kkt_residual: outcome.kkt_residual,
            variables: Named::by_variable(&case.problem, &end.variables),
            initial_objective,
            initial: values(&|k| initial[k]),
            initial_variables: Named::by_variable(&case.problem, &start),
            active_bounds: active_bounds(case, end),
            flow_solver: case.problem.flow_solver(),
            drag: drag.collect(),
            repairs: case.repairs(),
            min_fold_indicator: end.fold.map(|f| f.smallest_indicator),
            folded: end.fold.map(|f| f.folded),
            self_intersecting: end.shape.section.self_intersection().is_some(),
            target_distance: case.problem.target_distance(&end.shape),
            identifiers: identifiers(names.iter().chain(&problem.variable_names).map(String::as_str)),
        }
    }
}

/// The constraints of a problem at their values; without multipliers where there are none.
pub(super) fn constraint_reports(
    problem: &ProblemDescription,
    values: &[Option<f64>],
    multipliers: &[f64],
) -> Named<ConstraintReport> {
    let finite = |v: f64| v.is_finite().then_some(v);
    let constraints =
        problem.constraint_bounds.iter().zip(values).enumerate().map(|(k, (bounds, &value))| ConstraintReport {
            value,
            lower: finite(bounds.lower),
            upper: finite(bounds.upper),
            violation: value.map(|v| bounds.violation(v)),
            multiplier: multipliers.get(k).copied(),
        });
    Named::new(&problem.constraint_names, constraints)
}

/// The variables at their bounds, as near as the optimisers count as reached.
fn active_bounds(case: &Case, end: &CaseOutcome) -> Named<ActiveBoundReport> {
    let variables = case.problem.geometry().variables();
    let at_bound = variables.iter().zip(&end.variables).enumerate().filter_map(|(k, (variable, value))| {
        let near = REACHED * variable.step;
        let multiplier = end.outcome.bound_multipliers.get(k).map_or(0.0, |m| m / variable.scale);
        let (side, bound) = if value - variable.bounds.lower <= near {
            (Side::Lower, variable.bounds.lower)
        } else if variable.bounds.upper - value <= near {
            (Side::Upper, variable.bounds.upper)
        } else {
            return None;
        };
        Some((variable.name.clone(), ActiveBoundReport { side, bound, multiplier }))
    });
    Named(at_bound.collect())
}
