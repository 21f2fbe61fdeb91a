//! `aeroform evaluate`: one evaluation of a case, for outside optimisers and scripts.

use super::{Failure, design_vector, print, print_json};
use crate::design::{Case, DesignError, DesignProblem, Quantity};
use serde_json::{Map, Value, json};

/// Arguments of `aeroform evaluate`.
#[derive(Debug, clap::Args)]
pub(super) struct EvaluateArguments {
    /// A TOML file or the name of a built-in case
    case: String,
    /// JSON file with the design vector {"variable name": value, …}; missing variables keep their start
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
    let values = design_vector::read(&case.problem, arguments.at.as_deref())?;
    let result = evaluate(&mut case.problem, &values, arguments.gradients)
        .map_err(|e| Failure::Computation(format!("{}: no value at this design: {e}", case.name)))?;
    if arguments.json { print_json(&result) } else { print(&as_text(&result)) }
}

fn evaluate(problem: &mut DesignProblem, variables: &[f64], gradients: bool) -> Result<Value, DesignError> {
    let names: Vec<String> = problem.quantities().iter().map(Quantity::name).collect();
    let with_gradients = if gradients { Some(problem.gradients(variables)?) } else { None };
    let values: Vec<f64> = match &with_gradients {
        Some(pairs) => pairs.iter().map(|(value, _)| *value).collect(),
        None => problem.quantities_at(variables)?,
    };
    let objective: f64 = values.iter().zip(problem.objective_weights()).map(|(v, w)| v * w).sum();
    let fold = problem.fold_report(&problem.shape(variables)?);
    let named: Map<String, Value> = names.iter().cloned().zip(values.iter().map(|v| json!(v))).collect();
    let mut result = Map::new();
    result.insert("variables".into(), design_vector::to_json(problem, variables));
    result.insert("objective".into(), json!(objective));
    result.insert("values".into(), Value::Object(named));
    if let Some(pairs) = with_gradients {
        let by_name = |gradient: &[f64]| design_vector::to_json(problem, gradient);
        let table: Map<String, Value> = names.into_iter().zip(pairs.iter().map(|(_, g)| by_name(g))).collect();
        result.insert("gradients".into(), Value::Object(table));
    }
    result.insert("min_fold_indicator".into(), json!(fold.map(|f| f.smallest_indicator)));
    result.insert("folded".into(), json!(fold.map(|f| f.folded)));
    Ok(Value::Object(result))
}

fn as_text(result: &Value) -> String {
    let mut text = String::new();
    let number = |value: &Value| value.as_f64().map_or_else(|| value.to_string(), |v| format!("{v:.12e}"));
    text.push_str(&format!("objective  {}\n", number(&result["objective"])));
    for (name, value) in result["values"].as_object().into_iter().flatten() {
        text.push_str(&format!("  {name:24} {}\n", number(value)));
        for (variable, slope) in result["gradients"][name].as_object().into_iter().flatten() {
            text.push_str(&format!("    d/d {variable:16} {}\n", number(slope)));
        }
    }
    if !result["folded"].is_null() {
        let folded = if result["folded"] == true { "folded" } else { "not folded" };
        text.push_str(&format!("box {folded}, smallest indicator {}\n", number(&result["min_fold_indicator"])));
    }
    text
}
