//! `aeroform run`: runs a design case and writes its results.

use super::failure::Failure;
use super::figures;
use super::html::{HtmlTable, Page};
use super::message::say;
use super::output::{pretty, print, print_json};
use crate::cad;
use crate::case::{Case, CaseOutcome};
use crate::design::{DesignProblem, FlowTiming, Shape};
use crate::differentiate::{StepRange, finite_difference_jacobian};
use crate::optimize::{
    Checkpoint, CheckpointError, History, Identity, Journal, Journaled, Outcome, Progress, Termination,
};
use crate::report::figures::FigureError;
use crate::report::json::{ConstraintReport, RunReport};
use crate::report::{OutputDirectory, OutputError};
use crate::section::Section;
use indicatif::{ProgressBar, ProgressStyle};
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
        case.use_method(method).map_err(|e| Failure::Input(e.to_string()))?;
    }
    // before the output directory is touched
    case.method.check_constraints(&case.problem).map_err(|e| Failure::Input(format!("{}: {e}", case.name)))?;
    let path = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(&case.name));
    let directory = OutputDirectory::prepare(&path).map_err(|e| Failure::Input(e.to_string()))?;
    let _lock = directory.lock().map_err(|e| Failure::Input(e.to_string()))?;
    let checkpoint = path.join("checkpoint.json");
    let identity = case.identity();
    let journal = if arguments.resume { resume(&checkpoint, &identity)? } else { Journal::default() };

    let mut history = History::new(&case.problem);
    let bar = progress_bar();
    let mut problem =
        Journaled::resume(case.problem.clone(), journal).with_checkpoints(&checkpoint, identity, CHECKPOINT_INTERVAL);
    let end = case
        .run_on(&mut problem, &mut |progress| {
            history.record(progress);
            show(&bar, progress);
            ControlFlow::Continue(())
        })
        .map_err(|e| Failure::of_run(&case.name, &e))?;
    bar.finish_and_clear();
    if let Some(index) = problem.divergence() {
        say(format_args!(
            "the checkpoint was left at evaluation {}: this program computes differently; went on from there",
            index + 1
        ));
    }
    // whatever cannot be written must not lose the rest; what costs most to find again goes first
    let mut lost: Vec<String> = Vec::new();
    let result = RunReport::new(&case, &end);
    let numbers = [
        ("result.json", pretty(&result)?),
        ("history.csv", history.to_csv()),
        ("final.dat", titled(&case, &end).selig()),
    ];
    lost.extend(directory.write_each(numbers).iter().map(OutputError::to_string));
    lost.extend(problem.save().err().map(|e| e.to_string()));
    let timing = problem.into_parts().0.flow_timing();
    match files(arguments, &mut case, &end, &result, &history, &directory, timing) {
        Ok(figures) => lost.extend(directory.write_each(figures).iter().map(OutputError::to_string)),
        Err(failure) => lost.push(failure.to_string()),
    }
    lost.iter().for_each(say);
    if arguments.json {
        print_json(&result)?
    } else {
        print(&summary(&result, &directory))?
    }
    match end.outcome.status {
        Termination::Converged | Termination::Stalled if lost.is_empty() => Ok(()),
        Termination::Converged | Termination::Stalled => {
            Err(Failure::Computation(format!("{}: not all results could be written", case.name)))
        }
        _ => Err(Failure::Computation(format!("{}: {}", case.name, end.outcome.message))),
    }
}

/// The section of the best design under a name that tells where it comes from.
fn titled(case: &Case, end: &CaseOutcome) -> Section<f64> {
    let section = &end.shape.section;
    section.clone().with_name(format!("{} (aeroform {})", section.name(), case.name))
}

fn resume(path: &Path, identity: &Identity) -> Result<Journal, Failure> {
    if !path.exists() {
        say(format_args!("no checkpoint at {}; starting anew", path.display()));
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

/// Names and contents of the files of a run that show what its numbers say.
fn files(
    arguments: &RunArguments,
    case: &mut Case,
    end: &CaseOutcome,
    result: &RunReport,
    history: &History,
    directory: &OutputDirectory,
    timing: FlowTiming,
) -> Result<Vec<(&'static str, String)>, Failure> {
    let name = case.name.clone();
    let wrong = |e: &dyn std::fmt::Display| Failure::Computation(format!("{name}: {e}"));
    let (problem, shape) = (&case.problem, &end.shape);
    let initial = problem.shape(&problem.start_values()).map_err(|e| wrong(&e))?;
    let design = |shape: &Shape, title: &str| figures::design(problem, shape, title).map_err(|e| wrong(&e));
    let start_figure = design(&initial, &format!("{name}: start"))?;
    let end_figure = design(shape, &format!("{name}: {}", end.outcome.status))?;
    let convergence = figures::convergence(history, &name).map_err(|e| wrong(&e))?;
    let pressures = pressures(problem, &initial, shape).map_err(|e| wrong(&e))?;
    let section = titled(case, end);
    let mut files = vec![
        ("initial.svg", start_figure.clone()),
        ("final.svg", end_figure.clone()),
        ("convergence.svg", convergence.clone()),
        ("final.step", cad::step(section.curve(), section.name()).map_err(|e| wrong(&e))?),
    ];
    files.extend(pressures.first().map(|(_, svg)| ("pressure.svg", svg.clone())));
    let mut shown = vec![("Start".to_string(), start_figure), ("End".to_string(), end_figure)];
    shown.extend(pressures);
    shown.push(("Convergence".to_string(), convergence));
    let page = Page {
        result,
        command: format!("aeroform run {} --out {}", arguments.case, directory.path().display()),
        figures: shown,
        tables: vec![gradient_table(&mut case.problem, &end.variables), timing_table(timing, &end.outcome)],
        case: &case.text,
    };
    files.push(("report.html", page.render()));
    Ok(files)
}

/// Pressure before and after, a heading and a figure for each operating point that has a flow at either end.
fn pressures(problem: &DesignProblem, initial: &Shape, shape: &Shape) -> Result<Vec<(String, String)>, FigureError> {
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

/// Every derivative at the end along one fixed direction of all variables, exact and by differences.
fn gradient_table(problem: &mut DesignProblem, values: &[f64]) -> HtmlTable {
    let direction: Vec<f64> =
        problem.steps().iter().enumerate().map(|(k, step)| step * (12.9898 * (k + 1) as f64).sin()).collect();
    let exact = problem.gradients(values).ok();
    let names: Vec<String> = problem.quantities().iter().map(crate::design::Quantity::name).collect();
    let folds = |name: &str| name.starts_with("fold_indicator");
    let at = |t: &[f64]| {
        let moved: Vec<f64> = values.iter().zip(&direction).map(|(v, d)| v + t[0] * d).collect();
        problem.quantities_at(&moved)
    };
    let steps = [StepRange { first: 4e-3, levels: 4 }];
    let differences = finite_difference_jacobian(at, &[0.0], &steps).ok();
    let mut rows = Vec::new();
    for (q, name) in names.into_iter().enumerate().filter(|(_, name)| !folds(name)) {
        let along = exact.as_ref().map(|e| e[q].1.iter().zip(&direction).map(|(g, d)| g * d).sum::<f64>());
        let difference = differences.as_ref().map(|d| &d[(q, 0)]);
        rows.push(vec![
            name,
            along.map_or("none".into(), |a| format!("{a:.9e}")),
            difference.map_or("none".into(), |d| format!("{:.9e}", d.value)),
            difference.zip(along).map_or(String::new(), |(d, a)| format!("{:.1e}", d.value - a)),
            difference.map_or(String::new(), |d| format!("{:.1e}", d.error)),
        ]);
    }
    HtmlTable {
        heading: "Gradient check along one direction of all variables (aeroform gradients has all)",
        columns: vec!["quantity", "exact", "finite difference", "deviation", "its own estimate"],
        rows,
    }
}

fn timing_table(timing: FlowTiming, outcome: &Outcome) -> HtmlTable {
    let row = |name: &str, count: String, seconds: f64| {
        let share = if outcome.seconds > 0.0 { 100.0 * seconds / outcome.seconds } else { 0.0 };
        vec![name.to_string(), count, format!("{seconds:.3}"), format!("{share:.0} %")]
    };
    let rows = vec![
        row("flow solutions", timing.solutions.to_string(), timing.solution_seconds),
        row("their gradients", timing.gradients.to_string(), timing.gradient_seconds),
        row("whole run (wall clock)", outcome.evaluations.to_string(), outcome.seconds),
    ];
    let columns = vec!["what", "number", "seconds (over all threads)", "share of the run"];
    HtmlTable { heading: "Timing", columns, rows }
}

/// The constraints that hold the design or are violated; the others only as a number.
fn constraints_text(result: &RunReport) -> String {
    let mut text = String::new();
    let mut slack = 0;
    for (name, ConstraintReport { value, violation, multiplier, .. }) in result.constraints.iter() {
        let (multiplier, violation) = (multiplier.unwrap_or(0.0), violation.unwrap_or(0.0));
        if multiplier == 0.0 && violation == 0.0 {
            slack += 1;
            continue;
        }
        let value = number(*value);
        text.push_str(&format!("  {name:24} {value}  violation {violation:.1e}  multiplier {multiplier:+.3e}\n"));
    }
    match (text.is_empty(), slack) {
        (true, 0) => String::new(),
        (true, _) => format!("  no constraint holds the design ({slack} are met with room to spare)\n"),
        (false, 0) => format!("constraints that hold the design\n{text}"),
        (false, _) => format!("constraints that hold the design ({slack} more are met with room to spare)\n{text}"),
    }
}

fn number(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map_or("none".into(), |v| format!("{v:.6e}"))
}

fn summary(result: &RunReport, directory: &OutputDirectory) -> String {
    let mut text = format!(
        "{}: {} by {} in {} evaluations, {} iterations, {:.3} s\n{}\n\n",
        result.case,
        result.status,
        result.optimizer,
        result.evaluations,
        result.iterations,
        result.seconds,
        result.message
    );
    text.push_str(&format!("  {:24} {}\n", "objective", number(result.objective)));
    for (name, value) in result.values.iter() {
        text.push_str(&format!("  {name:24} {}\n", number(*value)));
    }
    text.push_str(&constraints_text(result));
    if let Some(folded) = result.folded {
        let words = if folded { "the box has folded" } else { "the box has not folded" };
        let indicator = number(result.min_fold_indicator);
        text.push_str(&format!("  {:24} {indicator} ({words})\n", "smallest fold indicator"));
    }
    text.push_str(&format!("\nresults in {}\n", directory.path().display()));
    text
}
