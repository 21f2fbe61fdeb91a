//! Case files: a design problem as TOML.

mod build;
mod builtin;
mod document;
mod error;
mod flow;
mod quantities;
mod schema;

pub use builtin::{BuiltinCase, builtin_cases};
pub use error::CaseError;
pub(crate) use error::nearest;

use super::DesignProblem;
use document::Document;
use std::path::Path;

/// The method a case asks for, with its limits; what is `None` is left to the method.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OptimizerSettings {
    /// "lbfgs", "newton" or "slsqp".
    pub method: String,
    /// Largest number of evaluations.
    pub max_evaluations: Option<usize>,
    /// Largest number of iterations.
    pub max_iterations: Option<usize>,
    /// Tolerance of the method's convergence test.
    pub tolerance: Option<f64>,
    /// Largest violation of a constraint that counts as none (slsqp).
    pub feasibility: Option<f64>,
    /// Pairs of steps and gradients that L-BFGS keeps.
    pub memory: Option<usize>,
}

/// A design case: a problem and how to solve it.
///
/// ```
/// use aeroform::design::Case;
/// let mut case = Case::open("l2-match").unwrap();
/// assert_eq!(case.problem.geometry().variables().len(), 32);
/// let start = case.problem.start_values();
/// let objective: f64 = case.problem.quantities_at(&start).unwrap().iter().sum();
/// assert!(objective > 1e-3);
/// ```
#[derive(Debug, Clone)]
pub struct Case {
    /// Name of the case; outputs go to `out/<name>` by default.
    pub name: String,
    /// One sentence on what the case is, or empty.
    pub description: String,
    /// The text of the case file, which identifies the case.
    pub text: String,
    /// The problem.
    pub problem: DesignProblem,
    /// How to solve it.
    pub optimizer: OptimizerSettings,
}

impl Case {
    /// Opens a built-in case by name, or a case file by path.
    ///
    /// Files named in a case file are sought beside it.
    ///
    /// # Errors
    /// Neither a built-in case nor a readable file, or anything wrong in it, with line and key.
    pub fn open(name_or_path: &str) -> Result<Self, CaseError> {
        if let Some(builtin) = builtin_cases().iter().find(|c| c.name == name_or_path) {
            return Self::parse(name_or_path, builtin.text, Path::new(""));
        }
        let path = Path::new(name_or_path);
        let whole =
            |message: String| CaseError { origin: name_or_path.into(), line: None, key: String::new(), message };
        if !path.exists() {
            let similar = nearest(name_or_path, builtin_cases().iter().map(|c| c.name));
            let hint = similar.map(|s| format!("; did you mean {s}?")).unwrap_or_default();
            return Err(whole(format!(
                "neither a file nor a built-in case{hint} (`aeroform cases` lists the built-in ones)"
            )));
        }
        let bytes = std::fs::read(path).map_err(|e| whole(format!("cannot be read: {e}")))?;
        let text = String::from_utf8(bytes).map_err(|e| whole(format!("is not text (UTF-8): {e}")))?;
        Self::parse(name_or_path, &text, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads a case from text; `origin` names it in messages, `folder` is where files it names are sought.
    ///
    /// # Errors
    /// Anything wrong in it, with line and key.
    pub fn parse(origin: &str, text: &str, folder: &Path) -> Result<Self, CaseError> {
        let document = Document::new(origin, text);
        let table = document.parse()?;
        build::build(&document, table, text, folder)
    }
}

#[cfg(test)]
#[path = "case_tests.rs"]
mod tests;
