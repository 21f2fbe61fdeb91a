//! Design vectors as JSON files: `{"variable name": value, …}`.

use super::Failure;
use crate::design::DesignProblem;
use serde_json::{Map, Value};

/// Reads a design vector; missing variables keep their start.
pub(super) fn read(problem: &DesignProblem, path: Option<&str>) -> Result<Vec<f64>, Failure> {
    let mut values = problem.start_values();
    let Some(path) = path else { return Ok(values) };
    let text = std::fs::read_to_string(path).map_err(|e| Failure::Input(format!("{path}: cannot be read: {e}")))?;
    let given: Map<String, Value> = serde_json::from_str(&text)
        .map_err(|e| Failure::Input(format!("{path}:{}: not a JSON object of numbers: {e}", e.line())))?;
    // what `run` and `evaluate` write is a design vector too
    let given = match given.get("variables") {
        Some(Value::Object(inner)) => inner.clone(),
        _ => given,
    };
    let variables = problem.geometry().variables();
    for (name, value) in &given {
        let Some(index) = variables.iter().position(|v| v.name == *name) else {
            let names = variables.iter().map(|v| v.name.as_str());
            let hint =
                crate::design::nearest(name, names).map(|n| format!("; did you mean {n:?}?")).unwrap_or_default();
            return Err(Failure::Input(format!("{path}: there is no design variable {name:?}{hint}")));
        };
        let number = value.as_f64().filter(|v| v.is_finite());
        values[index] =
            number.ok_or_else(|| Failure::Input(format!("{path}: {name:?} is {value}, a finite number is needed")))?;
    }
    Ok(values)
}

/// Name and value of each variable as a JSON object.
pub(super) fn to_json(problem: &DesignProblem, values: &[f64]) -> Value {
    let pairs = problem.geometry().variables().iter().zip(values);
    Value::Object(pairs.map(|(variable, value)| (variable.name.clone(), Value::from(*value))).collect())
}
