//! `aeroform evaluate`: one evaluation of a case, for outside optimisers and scripts.

use super::design_vector;
use super::failure::Failure;
use super::output::{print, print_json};
use crate::case::Case;
use crate::report::json::{EvaluationReport, Named};

/// Arguments of `aeroform evaluate`.
#[derive(Debug, clap::Args)]
pub(super) struct EvaluateArguments {
    /// A TOML file or the name of a built-in case
    case: String,
    /// JSON file with the design vector {"variable name": value, …}; missing variables keep their start; `-` reads standard input
    #[arg(long, value_name = "FILE.json")]
    at: Option<String>,
    /// Also the exact derivative of every value with respect to every variable
    #[arg(long)]
    gradients: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &EvaluateArguments) -> Result<(), Failure> {
    let mut case = Case::open(&arguments.case)?;
    let variables = design_vector::read(&case, arguments.at.as_deref())?;
    let evaluation =
        if arguments.gradients { case.evaluate_with_gradients(&variables) } else { case.evaluate(&variables) };
    let evaluation =
        evaluation.map_err(|e| Failure::Computation(format!("{}: no value at this design: {e}", case.name)))?;
    let report = EvaluationReport::new(&case, &evaluation);
    if arguments.json { print_json(&report) } else { print(&as_text(&report)) }
}

fn as_text(report: &EvaluationReport) -> String {
    let mut text = format!("objective  {:.12e}\n", report.objective);
    for (name, value) in report.values.iter() {
        text.push_str(&format!("  {name:24} {value:.12e}\n"));
        let slopes = report.gradients.as_ref().and_then(|gradients| gradients.get(name));
        for (variable, slope) in slopes.into_iter().flat_map(Named::iter) {
            text.push_str(&format!("    d/d {variable:16} {slope:.12e}\n"));
        }
    }
    if let (Some(folded), Some(indicator)) = (report.folded, report.min_fold_indicator) {
        let folded = if folded { "folded" } else { "not folded" };
        text.push_str(&format!("box {folded}, smallest indicator {indicator:.12e}\n"));
    }
    text
}
