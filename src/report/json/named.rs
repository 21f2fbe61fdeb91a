//! JSON objects whose keys are names.

use crate::design::DesignProblem;
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

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.iter())
    }
}
