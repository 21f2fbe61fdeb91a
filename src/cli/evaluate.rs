//! `aeroform evaluate`: one evaluation of a case, for outside optimisers and scripts.

use super::design_files::design_files;
use super::design_vector;
use super::failure::Failure;
use super::message::note;
use super::output::{pretty, print, print_json};
use super::overview::{groups, objective_name};
use crate::case::Case;
use crate::report::json::EvaluationReport;
use crate::report::{OutputDirectory, engineering};
use std::path::PathBuf;

/// Arguments of `aeroform evaluate`.
#[derive(Debug, clap::Args)]
pub(super) struct EvaluateArguments {
    /// A TOML file or the name of a built-in case
    case: String,
    /// JSON file with the design vector {"variable name": value, …}; missing variables keep their start; `-` reads
    /// standard input
    #[arg(long, value_name = "FILE.json")]
    at: Option<String>,
    /// Also the exact derivative of every value with respect to every variable
    #[arg(long)]
    gradients: bool,
    /// Write the design into this directory: coordinates, STEP, IGES and DXF files, figures and result.json
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(arguments: &EvaluateArguments) -> Result<(), Failure> {
    let mut case = Case::open(&arguments.case)?;
    let variables = design_vector::read(&case, arguments.at.as_deref())?;
    case.repairs().iter().for_each(note);
    let directory = match &arguments.export {
        Some(path) => Some(OutputDirectory::prepare(path).map_err(|e| Failure::Input(e.to_string()))?),
        None => None,
    };
    if let Some(directory) = &directory {
        // also where a flow, and so the objective, has no value
        write(directory, design_files(&case, &variables)?)?;
    }
    let evaluation =
        if arguments.gradients { case.evaluate_with_gradients(&variables) } else { case.evaluate(&variables) };
    let evaluation =
        evaluation.map_err(|e| Failure::Computation(format!("{}: no value at this design: {e}", case.name)))?;
    let report = EvaluationReport::new(&case, &evaluation);
    if let Some(directory) = &directory {
        write(directory, vec![("result.json".into(), pretty(&report)?)])?;
    }
    if arguments.json { print_json(&report) } else { print(&as_text(&objective_name(&case), &report)) }
}

fn write(directory: &OutputDirectory, files: Vec<(String, String)>) -> Result<(), Failure> {
    directory.write_all(files).map_err(|e| Failure::Computation(e.to_string()))
}

/// Digits of a value in text; JSON has all.
const DIGITS: usize = 7;

fn as_text(objective: &str, report: &EvaluationReport) -> String {
    let mut text = format!("objective {objective} = {}\n", engineering(report.objective, DIGITS));
    let entries: Vec<(&str, f64)> = report.values.iter().map(|(name, v)| (name, v.unwrap_or(f64::NAN))).collect();
    let names: Vec<&str> = entries.iter().map(|(name, _)| *name).collect();
    for group in groups(&names) {
        // of a family the smallest
        let smallest = group.members.iter().copied().min_by(|a, b| entries[*a].1.total_cmp(&entries[*b].1));
        let Some((name, value)) = smallest.map(|k| entries[k]) else { continue };
        if group.members.len() > 1 {
            let label = format!("{}, smallest of {}", group.name, group.members.len());
            let place = name.trim_start_matches(group.name);
            text.push_str(&format!("  {label:24} {} at {place}\n", engineering(value, DIGITS)));
            continue;
        }
        if let Some(reason) = report.without_value.get(name) {
            text.push_str(&format!("  {name:24} no value: {reason}\n"));
            continue;
        }
        text.push_str(&format!("  {name:24} {}\n", engineering(value, DIGITS)));
        let slopes = report.gradients.as_ref().and_then(|gradients| gradients.get(name));
        match slopes {
            Some(Some(slopes)) => {
                for (variable, slope) in slopes.iter() {
                    text.push_str(&format!("    d/d {variable:16} {}\n", engineering(*slope, DIGITS)));
                }
            }
            Some(None) => text.push_str("    no derivatives here\n"),
            None => {}
        }
    }
    if let (Some(folded), Some(indicator)) = (report.folded, report.min_fold_indicator) {
        let folded = if folded { "folded" } else { "not folded" };
        text.push_str(&format!("box {folded}, smallest indicator {}\n", engineering(indicator, DIGITS)));
    }
    text
}
