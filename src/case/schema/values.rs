//! Reading of single values, and the error of those that are none.

use serde::de;
use toml::Value;

/// The number that a value is.
pub fn number(value: &Value) -> Option<f64> {
    value.as_float().or(value.as_integer().map(|i| i as f64))
}

/// The items of a list; a value that is no list is its only item.
pub fn items(value: &Value) -> &[Value] {
    value.as_array().map_or(std::slice::from_ref(value), Vec::as_slice)
}

/// The error of a value that is not what a key takes.
pub fn refuse<T, E: de::Error>(value: &Value, expected: &str) -> Result<T, E> {
    Err(E::custom(format!("invalid value {value}, expected {expected}")))
}
