//! Design vectors as JSON files: `{"variable name": value, …}`.

use super::failure::Failure;
use crate::case::Case;
use serde_json::{Map, Value};

/// Reads a design vector, in the unit of each variable; missing variables keep their start.
pub(super) fn read(case: &Case, path: Option<&str>) -> Result<Vec<f64>, Failure> {
    let Some(path) = path else { return Ok(case.problem.start_values()) };
    let text = std::fs::read_to_string(path).map_err(|e| Failure::Input(format!("{path}: cannot be read: {e}")))?;
    let mut given: Map<String, Value> = serde_json::from_str(&text)
        .map_err(|e| Failure::Input(format!("{path}:{}: not a JSON object of numbers: {e}", e.line())))?;
    // what `run` and `evaluate` write is a design vector too
    if let Some(Value::Object(inner)) = given.get_mut("variables") {
        given = std::mem::take(inner);
    }
    let mut numbers = Vec::with_capacity(given.len());
    for (name, value) in &given {
        let number = value.as_f64().filter(|v| v.is_finite());
        let wrong = || Failure::Input(format!("{path}: {name:?} is {value}, a finite number is needed"));
        numbers.push((name.as_str(), number.ok_or_else(wrong)?));
    }
    case.design_vector(numbers).map_err(|e| Failure::Input(format!("{path}: {e}")))
}
