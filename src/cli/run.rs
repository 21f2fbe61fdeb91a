//! `aeroform run`: runs a design case and writes its results.

use super::events::EventArguments;
use super::failure::Failure;
use super::interrupt::Interrupts;
use super::message::{note, say};
use super::output::{print, print_json};
use super::progress::{GradientGoal, RunProgress};
use super::run_files::RunResults;
use super::summary;
use crate::case::{Case, Steering};
use crate::optimize::{Checkpoint, CheckpointError, History, Identity, Journal, Journaled, Termination};
use crate::report::{OutputDirectory, OutputError};
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
    /// Go on from the checkpoint in the output directory; the result is that of an uninterrupted run, bit for bit.
    /// Limits, tolerance, comments and description may have changed
    #[arg(long)]
    resume: bool,
    /// Optimiser instead of the case's: lbfgs, newton, gauss-newton, slsqp or sqp
    #[arg(long)]
    method: Option<String>,
    /// Most evaluations, instead of the case's limit; may change with --resume
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    max_evaluations: Option<usize>,
    /// Most iterations, instead of the case's limit; may change with --resume
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    max_iterations: Option<usize>,
    /// Tolerance at which the run has converged, instead of the case's; may change with --resume
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    tolerance: Option<f64>,
    /// Print one JSON object (the content of result.json)
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    events: EventArguments,
}

pub(super) fn run(arguments: &RunArguments) -> Result<(), Failure> {
    let mut case = Case::open(&arguments.case)?;
    if let Some(method) = &arguments.method {
        case.use_method(method).map_err(|e| Failure::Input(e.to_string()))?;
    }
    let steering = Steering {
        max_evaluations: arguments.max_evaluations,
        max_iterations: arguments.max_iterations,
        tolerance: arguments.tolerance,
    };
    case.steer(&steering).map_err(|e| Failure::Input(e.to_string()))?;
    // before the output directory is touched
    case.method.check_constraints(&case.problem).map_err(|e| Failure::Input(format!("{}: {e}", case.name)))?;
    case.repairs().iter().for_each(note);
    let path = arguments.out.clone().unwrap_or_else(|| Path::new("out").join(&case.name));
    let directory = OutputDirectory::prepare(&path).map_err(|e| Failure::Input(e.to_string()))?;
    let _lock = directory.lock().map_err(|e| Failure::Input(e.to_string()))?;
    let checkpoint = path.join("checkpoint.json");
    let identity = case.identity();
    let journal = if arguments.resume { resume(&checkpoint, &identity)? } else { Journal::default() };

    let interrupts =
        Interrupts::watch().map_err(|e| Failure::Computation(format!("signals cannot be watched: {e}")))?;
    let mut history = History::new(&case.problem);
    let mut display = RunProgress::new(arguments.events.open()?, GradientGoal::of(&case.method));
    let mut problem =
        Journaled::resume(case.problem.clone(), journal).with_checkpoints(&checkpoint, identity, CHECKPOINT_INTERVAL);
    let end = case
        .run_on(&mut problem, &mut |progress| {
            history.record(progress);
            display.show(progress);
            if interrupts.exit_status().is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .map_err(|e| Failure::of_run(&case.name, &e))?;
    display.end(&end.outcome);
    if let Some(index) = problem.divergence() {
        note(format_args!(
            "the checkpoint was left at evaluation {}: this program computes differently; went on from there",
            index + 1
        ));
    }
    // whatever cannot be written must not lose the rest
    let mut lost: Vec<String> = problem.save().err().map(|e| e.to_string()).into_iter().collect();
    let timing = problem.into_parts().0.flow_timing();
    let command = format!("aeroform run {} --out {}", arguments.case, directory.path().display());
    let results = RunResults::new(&mut case, &end, timing);
    // what costs most to find again goes first
    lost.extend(directory.write_each(results.numbers(&end, &case, &history)?).iter().map(OutputError::to_string));
    match results.figures(&case, &end, &history, command) {
        Ok(figures) => lost.extend(directory.write_each(figures).iter().map(OutputError::to_string)),
        Err(failure) => lost.push(failure.to_string()),
    }
    lost.iter().for_each(say);
    if arguments.json {
        print_json(&results.report)?
    } else {
        print(&summary::text(&results.report, &results.overview, &directory))?
    }
    match end.outcome.status {
        Termination::Interrupted => {
            let message = format!("{}: {} --resume goes on from here", case.name, end.outcome.message);
            Err(Failure::Interrupted(message, interrupts.exit_status().unwrap_or(1)))
        }
        Termination::Converged | Termination::Stalled if lost.is_empty() => Ok(()),
        Termination::Converged | Termination::Stalled => {
            Err(Failure::Told(format!("{}: not all results could be written", case.name)))
        }
        _ => Err(Failure::Told(format!("{}: {}", case.name, end.outcome.message))),
    }
}

fn resume(path: &Path, identity: &Identity) -> Result<Journal, Failure> {
    if !path.exists() {
        note(format_args!("no checkpoint at {}; starting anew", path.display()));
        return Ok(Journal::default());
    }
    match Checkpoint::load(path, identity) {
        Ok(checkpoint) => Ok(checkpoint.journal),
        // the other errors say themselves what to do
        Err(error @ CheckpointError::Read { .. }) => {
            Err(Failure::Input(format!("{error}; run without --resume to start anew")))
        }
        Err(error) => Err(Failure::Input(error.to_string())),
    }
}
