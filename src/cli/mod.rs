//! The command `aeroform`: one file per subcommand.
//!
//! Results go to files and standard output, progress and messages to standard error. Exit status 0: done; 1: the
//! computation did not succeed, and said why; 2: bad usage or input; 130 or 143: an interrupt (Ctrl-C) or a termination
//! ended a run, which wrote everything it had; a second signal ends the process at once. May depend on everything else.

mod analyze;
mod cases;
mod design_files;
mod design_vector;
mod evaluate;
mod events;
mod export;
mod failure;
mod figures;
mod flow_arguments;
mod gradients;
mod html;
mod interrupt;
mod message;
mod output;
mod overview;
mod polar;
mod processor;
mod progress;
mod run;
mod run_files;
mod section;
mod shape_arguments;
mod summary;
mod table_csv;

use clap::{Parser, Subcommand};
use failure::Failure;
use std::process::ExitCode;

/// Aerodynamic shape design with exact gradients.
#[derive(Debug, Parser)]
#[command(name = "aeroform", version, about, long_about = None, arg_required_else_help = true)]
struct Arguments {
    #[command(flatten)]
    voice: message::Voice,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Run a design case: a TOML file or a built-in case
    Run(run::RunArguments),
    /// Evaluate a case once at a given design vector
    Evaluate(evaluate::EvaluateArguments),
    /// Compare the exact gradients of a case with a second automatic route and with finite differences
    Gradients(gradients::GradientsArguments),
    /// Build a section and measure it, or export it
    Section(section::SectionArguments),
    /// Analyse the flow about a section at one operating point
    Analyze(analyze::AnalyzeArguments),
    /// Analyse a section over a range of angles of attack
    Polar(polar::PolarArguments),
    /// List the built-in cases, or print one
    Cases(cases::CasesArguments),
}

/// Runs the command with the arguments of the process.
pub fn main() -> ExitCode {
    let arguments = match processor::check().and_then(|()| arguments()) {
        Ok(Some(arguments)) => arguments,
        Ok(None) => return ExitCode::SUCCESS,
        Err(failure) => {
            failure.report();
            return failure.exit_status().into();
        }
    };
    arguments.voice.raise();
    let as_json = arguments.command.prints_json();
    match run_command(arguments.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if let Some(reason) = failure.untold().filter(|_| as_json) {
                // a script that reads the output finds an object there in any case
                let _ = output::print_json(&FailureReport { failed: reason });
            }
            failure.report();
            failure.exit_status().into()
        }
    }
}

/// The arguments of the process; `None` where help or version was asked for, which has been printed.
fn arguments() -> Result<Option<Arguments>, Failure> {
    let error = match Arguments::try_parse() {
        Ok(arguments) => return Ok(Some(arguments)),
        Err(error) => error,
    };
    // a script that asked for JSON finds the reason there
    if error.use_stderr() && std::env::args_os().any(|argument| argument == "--json") {
        let _ = output::print_json(&FailureReport { failed: &usage(&error) });
    }
    // with the colours that the terminal takes
    match (error.print(), error.use_stderr()) {
        (_, true) => Err(Failure::Usage),
        (Err(error), false) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Computation(format!("standard output cannot be written: {error}")))
        }
        _ => Ok(None),
    }
}

/// The first paragraph of a usage error, without the word before it and in one line.
fn usage(error: &clap::Error) -> String {
    let text = error.render().to_string();
    let text = text.trim_start_matches("error: ");
    text.split("\n\n").next().unwrap_or(text).split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The JSON object that `--json` prints where there is no result.
#[derive(serde::Serialize)]
struct FailureReport<'a> {
    failed: &'a str,
}

impl Command {
    /// Whether the result is wanted as JSON.
    fn prints_json(&self) -> bool {
        match self {
            Self::Run(arguments) => arguments.json,
            Self::Evaluate(arguments) => arguments.json,
            Self::Gradients(arguments) => arguments.json,
            Self::Section(arguments) => arguments.json,
            Self::Analyze(arguments) => arguments.json,
            Self::Polar(arguments) => arguments.json,
            Self::Cases(arguments) => arguments.json,
        }
    }
}

fn run_command(command: Command) -> Result<(), Failure> {
    match command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Evaluate(arguments) => evaluate::run(&arguments),
        Command::Gradients(arguments) => gradients::run(&arguments),
        Command::Section(arguments) => section::run(&arguments),
        Command::Analyze(arguments) => analyze::run(&arguments),
        Command::Polar(arguments) => polar::run(&arguments),
        Command::Cases(arguments) => cases::run(&arguments),
    }
}
