//! JSON objects whose keys are names.

use crate::design::{DesignError, DesignProblem};
use serde::{Serialize, Serializer};

/// A JSON object from names to values that keeps the order of its entries.
#[derive(Debug, Clone, PartialEq)]
pub struct Named<T>(pub Vec<(String, T)>);

impl<T> Named<T> {
    /// Pairs names with values, as many as there are of both.
    pub fn new<N: Into<String>>(names: impl IntoIterator<Item = N>, values: impl IntoIterator<Item = T>) -> Self {
        Self(names.into_iter().map(N::into).zip(values).collect())
    }

    /// The value of the first entry with this name.
    pub fn get(&self, name: &str) -> Option<&T> {
        self.iter().find(|(n, _)| *n == name).map(|(_, value)| value)
    }

    /// The entries in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &T)> {
        self.0.iter().map(|(name, value)| (name.as_str(), value))
    }
}

impl<T: Copy> Named<T> {
    /// One value per design variable, by the name of the variable.
    pub(super) fn by_variable(problem: &DesignProblem, values: &[T]) -> Self {
        Self::new(problem.geometry().variables().iter().map(|v| v.name.as_str()), values.iter().copied())
    }
}

/// A name that programming languages accept: letters, digits and underscores, no digit first.
///
/// ```
/// use aeroform::report::json::identifier;
/// let names = ["cd", "cm_at(cruise)", "dx[1,2]", "cl/cd", "thickness_at(0.7)", "2 + 2"].map(identifier);
/// assert_eq!(names, ["cd", "cm_at_cruise", "dx_1_2", "cl_cd", "thickness_at_0_7", "_2_2"]);
/// ```
pub fn identifier(name: &str) -> String {
    let words = name.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).filter(|word| !word.is_empty());
    let joined = words.collect::<Vec<_>>().join("_");
    if joined.starts_with(|c: char| c.is_ascii_digit()) || joined.is_empty() { format!("_{joined}") } else { joined }
}

/// An [`identifier`] for each name, every name once; names that would share one are numbered.
pub fn identifiers<'a>(names: impl IntoIterator<Item = &'a str>) -> Named<String> {
    let mut all: Vec<(String, String)> = Vec::new();
    for name in names {
        if all.iter().any(|(known, _)| known == name) {
            continue;
        }
        let plain = identifier(name);
        let taken = |candidate: &str| all.iter().any(|(_, other)| other == candidate);
        let free = (2..).map(|k| format!("{plain}_{k}")).find(|candidate| !taken(candidate));
        let own = if taken(&plain) { free.unwrap_or(plain) } else { plain };
        all.push((name.to_string(), own));
    }
    Named(all)
}

/// The reasons of the quantities that have no value, by name.
pub(super) fn without_value(names: &[String], values: &[Result<f64, DesignError>]) -> Named<String> {
    let reason = |(name, value): (&String, &Result<f64, DesignError>)| {
        value.as_ref().err().map(|error| (name.clone(), error.to_string()))
    };
    Named(names.iter().zip(values).filter_map(reason).collect())
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.iter())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_are_unique() {
        let names = identifiers(["cl/cd", "cl_cd", "cd", "cd", "cl cd"]);
        let pairs: Vec<(&str, &str)> = names.iter().map(|(name, own)| (name, own.as_str())).collect();
        assert_eq!(pairs, [("cl/cd", "cl_cd"), ("cl_cd", "cl_cd_2"), ("cd", "cd"), ("cl cd", "cl_cd_3")]);
    }
}
