//! `aeroform run`: runs a design case and writes its results.

use super::html::Page;
use super::{Failure, design_vector, figures, print, print_json};
use crate::cad;
use crate::design::{Bounds, Case, DesignProblem, FlowTiming, OptimizerSettings, Problem, Shape};
use crate::differentiate::{StepRange, finite_difference_jacobian};
use crate::optimize::{
    Checkpoint, CheckpointError, History, Journal, Journaled, Method, Optimizer, Outcome, Progress, Termination,
};
use crate::report::OutputDirectory;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::{Map, Value, json};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How often the checkpoint is saved at most.
const CHECKPOINT_INTERVAL: Duration = Duration::from_secs(1);

/// Arguments of `aeroform run`.
#[derive(Debug, clap::Args)]
pub(super) struct RunArguments {
    /// A TOML file or the name of a built-in case (`aeroform cases`)
    case: String,
    /// Where the results go [default: out/<case>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Go on from the checkpoint in the output directory; the result is that of an uninterrupted run, bit for bit
    #[arg(long)]
    resume: bool,
    /// Optimiser instead of the case's: lbfgs, newton, slsqp or sqp
    #[arg(long)]
    method: Option<String>,
    /// Print one JSON object (the content of result.json)
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let mut case = Case::open(&arguments.case)?;
    if let Some(method) = &arguments.method {
        case.optimizer.method.clone_from(method);
    }
    let method = method(&case.optimizer)?;
    refuse_constraints(&case, &method)?;
    let path = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(&case.name));
    let directory = OutputDirectory::prepare(&path).map_err(|e| Failure::Input(e.to_string()))?;
    let checkpoint = path.join("checkpoint.json");
    // what makes two runs the same run
    let identity = format!("{}\n# method {}\n", case.text, case.optimizer.method);
    let journal = if arguments.resume { resume(&checkpoint, &identity)? } else { Journal::default() };

    let mut history = History::new(&case.problem);
    let bar = progress_bar();
    let mut problem =
        Journaled::resume(case.problem.clone(), journal).with_checkpoints(&checkpoint, identity, CHECKPOINT_INTERVAL);
    let outcome = method
        .minimize(&mut problem, &mut |progress| {
            history.record(progress);
            show(&bar, progress);
            ControlFlow::Continue(())
        })
        .map_err(|e| Failure::Input(format!("{}: {e}", arguments.case)))?;
    bar.finish_and_clear();
    if let Some(index) = problem.divergence() {
        eprintln!(
            "aeroform: the checkpoint was left at evaluation {}: this program computes differently; went on from there",
            index + 1
        );
    }
    problem.save().map_err(|e| Failure::Computation(e.to_string()))?;
    let timing = problem.into_parts().0.flow_timing();
    finish(arguments, &mut case, &outcome, &history, &directory, timing)
}

/// The optimiser a case asks for.
fn method(settings: &OptimizerSettings) -> Result<Method, Failure> {
    let name = &settings.method;
    let mut method = Method::from_name(name)
        .ok_or_else(|| Failure::Input(format!("unknown method {name:?}; known: {}", Method::NAMES.join(", "))))?;
    match &mut method {
        Method::Lbfgs(lbfgs) => {
            lbfgs.memory = settings.memory.unwrap_or(lbfgs.memory);
            lbfgs.objective_tolerance = settings.tolerance.unwrap_or(lbfgs.objective_tolerance);
        }
        Method::Newton(newton) => {
            newton.objective_tolerance = settings.tolerance.unwrap_or(newton.objective_tolerance);
        }
        Method::Sqp(sqp) => {
            sqp.optimality_tolerance = settings.tolerance.unwrap_or(sqp.optimality_tolerance);
            sqp.feasibility_tolerance = settings.feasibility.unwrap_or(sqp.feasibility_tolerance);
        }
        Method::Slsqp(slsqp) => {
            slsqp.optimality_tolerance = settings.tolerance.unwrap_or(slsqp.optimality_tolerance);
            slsqp.feasibility_tolerance = settings.feasibility.unwrap_or(slsqp.feasibility_tolerance);
        }
    }
    let limits = method.limits_mut();
    limits.evaluations = settings.max_evaluations.unwrap_or(limits.evaluations);
    // evaluations are what costs; without a word iterations do not limit
    limits.iterations = settings.max_iterations.unwrap_or(usize::MAX);
    Ok(method)
}

/// Fails before the output directory is touched.
fn refuse_constraints(case: &Case, method: &Method) -> Result<(), Failure> {
    let names = &case.problem.description().constraint_names;
    if names.is_empty() || method.takes_constraints() {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: method \"{}\" takes no constraints ({}); use method \"slsqp\", or move them into the objective",
        case.name,
        method.name(),
        names.join(", ")
    )))
}

fn resume(path: &Path, identity: &str) -> Result<Journal, Failure> {
    if !path.exists() {
        eprintln!("aeroform: no checkpoint at {}; starting anew", path.display());
        return Ok(Journal::default());
    }
    match Checkpoint::load(path, identity) {
        Ok(checkpoint) => Ok(checkpoint.journal),
        Err(error @ CheckpointError::ForeignCase { .. }) => Err(Failure::Input(error.to_string())),
        Err(error) => Err(Failure::Input(format!("{error}; run without --resume to start anew"))),
    }
}

fn progress_bar() -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(0);
    if let Ok(style) = ProgressStyle::with_template("{bar:30} {pos}/{len} evaluations  {msg}  at most {eta} left") {
        bar.set_style(style);
    }
    bar
}

fn show(bar: &ProgressBar, progress: &Progress<'_>) {
    if bar.is_hidden() {
        return;
    }
    bar.set_length(progress.evaluation_limit as u64);
    bar.set_position(progress.evaluation as u64);
    let violation =
        if progress.violation > 0.0 { format!("  violation {:.1e}", progress.violation) } else { String::new() };
    bar.set_message(format!("iteration {}  best {:.6e}{violation}", progress.iteration, progress.best_objective));
}

/// Writes the files, says how it went, and turns the status into an exit status.
fn finish(
    arguments: &RunArguments,
    case: &mut Case,
    outcome: &Outcome,
    history: &History,
    directory: &OutputDirectory,
    timing: FlowTiming,
) -> Result<(), Failure> {
    let values = case.problem.unscaled(&outcome.x);
    let failed = |e: crate::design::DesignError| Failure::Computation(format!("{}: {e}", case.name));
    let initial = case.problem.shape(&case.problem.start_values()).map_err(failed)?;
    let shape = case.problem.shape(&values).map_err(failed)?;
    let result = result_json(case, outcome, &values)?;
    let wrong = |e: String| Failure::Computation(format!("{}: {e}", case.name));
    let pretty = serde_json::to_string_pretty(&result).map_err(|e| wrong(e.to_string()))?;
    let problem = &case.problem;
    let name = format!("{} (aeroform {})", shape.section.name(), case.name);
    let final_section = shape.section.clone().with_name(name.as_str());
    let mut files = vec![
        ("result.json", pretty + "\n"),
        ("history.csv", history.to_csv()),
        (
            "initial.svg",
            figures::design(problem, &initial, &format!("{}: start", case.name)).map_err(|e| wrong(e.to_string()))?,
        ),
        (
            "final.svg",
            figures::design(problem, &shape, &format!("{}: {}", case.name, outcome.status))
                .map_err(|e| wrong(e.to_string()))?,
        ),
        ("convergence.svg", figures::convergence(history, &case.name).map_err(|e| wrong(e.to_string()))?),
        ("final.dat", final_section.selig()),
        ("final.step", cad::step(final_section.curve(), &name).map_err(|e| wrong(e.to_string()))?),
    ];
    let mut shown: Vec<(String, String)> = [("Start", 2), ("End", 3), ("Convergence", 4)]
        .into_iter()
        .map(|(heading, place)| (heading.to_string(), files[place].1.clone()))
        .collect();
    for (k, (name, svg)) in
        pressures(problem, &initial, &shape).map_err(|e| wrong(e.to_string()))?.into_iter().enumerate()
    {
        if k == 0 {
            files.push(("pressure.svg", svg.clone()));
        }
        shown.insert(2 + k, (name, svg));
    }
    let page = Page {
        result: &result,
        command: format!("aeroform run {} --out {}", arguments.case, directory.path().display()),
        case: &case.text,
        figures: shown,
        tables: vec![gradient_table(&mut case.problem, &values), timing_table(timing, outcome)],
    };
    files.push(("report.html", page.render()));
    directory.write_all(files).map_err(|e| Failure::Computation(e.to_string()))?;
    if arguments.json {
        print_json(&result)?;
    } else {
        print(&summary(case, outcome, &result, directory))?;
    }
    match outcome.status {
        Termination::Converged | Termination::Stalled => Ok(()),
        _ => Err(Failure::Computation(format!("{}: {}", case.name, outcome.message))),
    }
}

fn result_json(case: &mut Case, outcome: &Outcome, values: &[f64]) -> Result<Value, Failure> {
    let problem: &DesignProblem = &case.problem;
    let shape = problem.shape(values).map_err(|e| Failure::Computation(format!("{}: {e}", case.name)))?;
    let fold = problem.fold_report(&shape);
    let evaluation = outcome.evaluation.as_ref();
    let named = |names: &[String], numbers: Option<&Vec<f64>>| -> Map<String, Value> {
        let number = |k: usize| numbers.and_then(|n| n.get(k).copied());
        names.iter().enumerate().map(|(k, name)| (name.clone(), json!(number(k)))).collect()
    };
    let bound = |v: f64| if v.is_finite() { json!(v) } else { Value::Null };
    let constraint = |(k, (name, b)): (usize, (&String, &Bounds))| {
        let value = evaluation.and_then(|e| e.constraints.get(k).copied());
        let entry = json!({
            "value": value, "lower": bound(b.lower), "upper": bound(b.upper),
            "violation": value.map(|v| b.violation(v)),
            "multiplier": outcome.multipliers.get(k),
        });
        (name.clone(), entry)
    };
    let bounds = problem.description().constraint_names.iter().zip(&problem.description().constraint_bounds);
    let constraints: Map<String, Value> = bounds.enumerate().map(constraint).collect();
    Ok(json!({
        "case": case.name,
        "optimizer": case.optimizer.method,
        "status": outcome.status.as_str(),
        "message": outcome.message,
        "evaluations": outcome.evaluations,
        "failed_evaluations": outcome.failures,
        "iterations": outcome.iterations,
        "seconds": outcome.seconds,
        "objective": evaluation.map(|e| e.objective),
        "values": named(&problem.description().value_names, evaluation.map(|e| &e.values)),
        "constraints": constraints,
        "kkt_residual": outcome.kkt_residual,
        "variables": design_vector::to_json(problem, values),
        "min_fold_indicator": fold.map(|f| f.smallest_indicator),
        "folded": fold.map(|f| f.folded),
        "self_intersecting": shape.section.self_intersection().is_some(),
    }))
}

/// Pressure before and after, a heading and a figure for each operating point that has a flow at either end.
fn pressures(
    problem: &DesignProblem,
    initial: &Shape,
    shape: &Shape,
) -> Result<Vec<(String, String)>, crate::report::figures::FigureError> {
    let (Some(before), Some(after)) = (problem.flows(initial), problem.flows(shape)) else { return Ok(Vec::new()) };
    let mut figures = Vec::new();
    for (k, point) in problem.operating_points().iter().enumerate() {
        let name = if point.name.is_empty() { "Pressure".into() } else { format!("Pressure at {}", point.name) };
        let start = before.solutions[k].as_ref().ok().map(|s| (&before.nodes[..], s));
        let end = after.solutions[k].as_ref().ok().map(|s| (&after.nodes[..], s));
        if start.is_some() || end.is_some() {
            let figure = figures::pressure_change(start, end, &name)?;
            figures.push((name, figure));
        }
    }
    Ok(figures)
}

/// A table of the report: heading, columns, rows.
type ReportTable = (String, Vec<String>, Vec<Vec<String>>);

/// Every derivative at the end along one fixed direction of all variables, exact and by differences.
fn gradient_table(problem: &mut DesignProblem, values: &[f64]) -> ReportTable {
    let direction: Vec<f64> =
        problem.steps().iter().enumerate().map(|(k, step)| step * (12.9898 * (k + 1) as f64).sin()).collect();
    let exact = problem.gradients(values).unwrap_or_default();
    let names: Vec<String> = problem.quantities().iter().map(crate::design::Quantity::name).collect();
    let folds = |name: &str| name.starts_with("fold_indicator");
    let at = |t: &[f64]| {
        let moved: Vec<f64> = values.iter().zip(&direction).map(|(v, d)| v + t[0] * d).collect();
        problem.quantities_at(&moved)
    };
    let steps = [StepRange { first: 4e-3, levels: 4 }];
    let differences = finite_difference_jacobian(at, &[0.0], &steps).ok();
    let mut rows = Vec::new();
    for (q, (name, (_, gradient))) in names.iter().zip(&exact).enumerate().filter(|(_, (name, _))| !folds(name)) {
        let along: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
        let numbers = differences.as_ref().map(|d| &d[(q, 0)]);
        let cells = numbers
            .map(|e| [format!("{:.9e}", e.value), format!("{:.1e}", e.value - along), format!("{:.1e}", e.error)]);
        let [difference, deviation, estimate] = cells.unwrap_or_else(|| ["none".into(), String::new(), String::new()]);
        rows.push(vec![name.clone(), format!("{along:.9e}"), difference, deviation, estimate]);
    }
    let columns = ["quantity", "exact", "finite difference", "deviation", "its own estimate"].map(String::from);
    ("Gradient check along one direction of all variables (aeroform gradients has all)".into(), columns.to_vec(), rows)
}

fn timing_table(timing: FlowTiming, outcome: &Outcome) -> ReportTable {
    let row = |name: &str, count: String, seconds: f64| {
        let share = if outcome.seconds > 0.0 { 100.0 * seconds / outcome.seconds } else { 0.0 };
        vec![name.to_string(), count, format!("{seconds:.3}"), format!("{share:.0} %")]
    };
    let rows = vec![
        row("flow solutions", timing.solutions.to_string(), timing.solution_seconds),
        row("their gradients", timing.gradients.to_string(), timing.gradient_seconds),
        row("whole run (wall clock)", outcome.evaluations.to_string(), outcome.seconds),
    ];
    let columns = ["what", "number", "seconds (over all threads)", "share of the run"].map(String::from);
    ("Timing".into(), columns.to_vec(), rows)
}

/// The constraints that hold the design or are violated; the others only as a number.
fn constraints_text(result: &Value) -> String {
    let constraints = result["constraints"].as_object();
    let mut text = String::new();
    let mut slack = 0;
    for (name, entry) in constraints.into_iter().flatten() {
        let (multiplier, violation) = (&entry["multiplier"], &entry["violation"]);
        let number = |v: &Value| v.as_f64().unwrap_or(0.0);
        if number(multiplier) == 0.0 && number(violation) == 0.0 {
            slack += 1;
            continue;
        }
        let value = entry["value"].as_f64().map_or("none".into(), |v| format!("{v:.6e}"));
        text.push_str(&format!(
            "  {name:24} {value}  violation {:.1e}  multiplier {:+.3e}\n",
            number(violation),
            number(multiplier)
        ));
    }
    match (text.is_empty(), slack) {
        (true, 0) => String::new(),
        (true, _) => format!("  no constraint holds the design ({slack} are met with room to spare)\n"),
        (false, 0) => format!("constraints that hold the design\n{text}"),
        (false, _) => format!("constraints that hold the design ({slack} more are met with room to spare)\n{text}"),
    }
}

fn summary(case: &Case, outcome: &Outcome, result: &Value, directory: &OutputDirectory) -> String {
    let mut text = format!(
        "{}: {} by {} in {} evaluations, {} iterations, {:.3} s\n{}\n\n",
        case.name,
        outcome.status,
        case.optimizer.method,
        outcome.evaluations,
        outcome.iterations,
        outcome.seconds,
        outcome.message
    );
    let number = |v: &Value| v.as_f64().map_or("none".into(), |v| format!("{v:.6e}"));
    text.push_str(&format!("  {:24} {}\n", "objective", number(&result["objective"])));
    for (name, value) in result["values"].as_object().into_iter().flatten() {
        text.push_str(&format!("  {name:24} {}\n", number(value)));
    }
    text.push_str(&constraints_text(result));
    if let Some(folded) = result["folded"].as_bool() {
        let words = if folded { "the box has folded" } else { "the box has not folded" };
        let indicator = number(&result["min_fold_indicator"]);
        text.push_str(&format!("  {:24} {indicator} ({words})\n", "smallest fold indicator"));
    }
    text.push_str(&format!("\nresults in {}\n", directory.path().display()));
    text
}
