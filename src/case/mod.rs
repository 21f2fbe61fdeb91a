//! Case files: a design problem and the method that solves it, as TOML.
//!
//! [`Case::open`] reads a file or one of the [built-in cases](builtin_cases), [`Case::run`] minimises as the file says,
//! [`Case::evaluate`] gives the values at one design. Every key is described in `validation/cases/README.md`.
//!
//! This module depends on [`optimize`](crate::optimize), [`design`](crate::design) and the modules these depend on.

mod build;
mod builtin;
mod document;
mod error;
mod flow;
mod method;
mod outcome;
mod pressure_table;
mod pressures;
mod quantities;
mod schema;

pub use builtin::{BuiltinCase, builtin_cases};
pub use error::CaseError;
pub use outcome::{CaseEvaluation, CaseOutcome, RunError};

use crate::design::{DesignError, DesignProblem, Problem, ValueAndGradient, Variable, weighted_sum};
use crate::optimize::limited::read_limited;
use crate::optimize::{Identity, Method, OptimizeError, Optimizer, Progress};
use document::Document;
use error::nearest;
use schema::{CaseTable, OptimizerTable, SectionTable};
use std::collections::HashMap;
use std::ops::ControlFlow;
use std::path::Path;

/// A design case: a problem and how to solve it.
///
/// ```
/// use aeroform::case::Case;
/// use std::ops::ControlFlow;
/// let mut case = Case::open("l2-match")?;
/// case.use_method("newton")?;
/// let design = case.run(&mut |_| ControlFlow::Continue(()))?;
/// let best = case.evaluate(&design.variables)?;
/// assert!(best.objective < 3.65e-7 && !best.fold.ok_or("no box")?.folded);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Case {
    /// Name of the case; the command writes to `out/<name>` unless told otherwise.
    pub name: String,
    /// One sentence on the case, or empty.
    pub description: String,
    /// The text of the case file.
    pub text: String,
    /// The problem.
    pub problem: DesignProblem,
    /// The optimiser with its settings.
    pub method: Method,
    /// Everything that was mended in the files of the case.
    repairs: Vec<String>,
    /// Settings of the file, for whichever method is used.
    settings: OptimizerTable,
    /// The case and the files it names, as they were read.
    sources: Identity,
}

/// Limits and a tolerance of a run; `None` leaves that of the case file.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Steering {
    /// Most evaluations; at least 1.
    pub max_evaluations: Option<usize>,
    /// Most iterations; at least 1.
    pub max_iterations: Option<usize>,
    /// Tolerance at which the run has converged, as `tolerance` of the `[optimizer]` table: positive.
    pub tolerance: Option<f64>,
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
        let bytes = read_limited(path, MOST_BYTES).map_err(|e| whole(format!("cannot be read: {e}")))?;
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
        check_name(&table.name).map_err(|message| document.error(&["name"], message))?;
        let sources = sources(&document, &table, folder)?;
        let (problem, repairs) = build::design_problem(&document, &table, folder)?;
        let settings = table.optimizer;
        let method = settings
            .method(settings.method_name(&problem))
            .map_err(|e| document.error(&["optimizer", "method"], e.to_string()))?;
        settings.check(&document)?;
        let description = table.description.unwrap_or_default();
        Ok(Self { name: table.name, description, text: text.to_string(), problem, method, repairs, settings, sources })
    }

    /// Takes another method, with the settings that the case file gives for whichever method is used.
    ///
    /// # Errors
    /// [`OptimizeError::UnknownMethod`].
    pub fn use_method(&mut self, name: &str) -> Result<(), OptimizeError> {
        self.method = self.settings.method(name)?;
        Ok(())
    }

    /// Takes limits and a tolerance in place of those of the case file.
    ///
    /// # Errors
    /// [`OptimizeError::Setting`] for a limit of none or a tolerance that is not positive.
    pub fn steer(&mut self, steering: &Steering) -> Result<(), OptimizeError> {
        let method = self.method.name();
        let refuse = |setting, value, range| Err(OptimizeError::Setting { method, setting, value, range });
        for (setting, limit) in
            [("max_evaluations", steering.max_evaluations), ("max_iterations", steering.max_iterations)]
        {
            if limit == Some(0) {
                return refuse(setting, 0.0, "at least 1");
            }
        }
        if let Some(tolerance) = steering.tolerance.filter(|t| !(t.is_finite() && *t > 0.0)) {
            return refuse("tolerance", tolerance, "positive");
        }
        let settings = &mut self.settings;
        settings.max_evaluations = steering.max_evaluations.or(settings.max_evaluations);
        settings.max_iterations = steering.max_iterations.or(settings.max_iterations);
        settings.tolerance = steering.tolerance.or(settings.tolerance);
        self.method = settings.method(method)?;
        Ok(())
    }

    /// A sentence for everything that a user must know of the reading of the coordinate files of the case, the target
    /// among them, each beginning with the name of the file; empty where there is nothing to say.
    pub fn repairs(&self) -> Vec<String> {
        self.repairs.clone()
    }

    /// All that the values of a run and the steps of its method depend on, for
    /// [`Checkpoint`](crate::optimize::Checkpoint): this version of the program, the method, the content of the case
    /// and of every file it names.
    ///
    /// A run may be resumed with other limits and tolerances, and after changes of comments, layout, name and
    /// description of the case file.
    pub fn identity(&self) -> Identity {
        let program = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
        let memory = self.settings.memory.map_or("the default".into(), |memory| memory.to_string());
        let identity = self.sources.clone().with("the program", program).with("the method", self.method.name());
        identity.with("the memory of the method", memory)
    }

    /// Minimises the objective from the start, as the case file says.
    ///
    /// `observer` is called after every evaluation; `ControlFlow::Break(())` from it ends the run.
    ///
    /// # Errors
    /// [`RunError::Optimize`] for a method that cannot take the problem, [`RunError::Design`] where the design at the
    /// end has no shape. A run that merely goes badly is an outcome whose status says so.
    pub fn run(&self, observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>) -> Result<CaseOutcome, RunError> {
        self.run_on(&mut self.problem.clone(), observer)
    }

    /// Minimises like [`run`](Self::run), but asks `problem`: a wrapped copy of the problem of the case, such as
    /// [`Journaled`](crate::optimize::Journaled), which records every evaluation.
    ///
    /// # Errors
    /// See [`run`](Self::run).
    pub fn run_on(
        &self,
        problem: &mut dyn Problem,
        observer: &mut dyn FnMut(&Progress<'_>) -> ControlFlow<()>,
    ) -> Result<CaseOutcome, RunError> {
        let outcome = self.method.minimize(problem, observer)?;
        let variables = self.problem.unscaled(&outcome.x);
        let shape = self.problem.shape(&variables)?;
        let fold = self.problem.fold_report(&shape);
        Ok(CaseOutcome { outcome, variables, shape, fold })
    }

    /// Objective and values at a design, one value per variable in the unit of each.
    ///
    /// # Errors
    /// A shape that cannot be built, or a quantity of objective or constraints that has no value.
    pub fn evaluate(&self, variables: &[f64]) -> Result<CaseEvaluation, DesignError> {
        self.evaluation(variables, self.problem.values_at(variables), None)
    }

    /// Objective, values and exact gradients at a design, one value per variable in the unit of each.
    ///
    /// # Errors
    /// A shape that cannot be built, or a quantity of objective or constraints that has no value or no gradient.
    pub fn evaluate_with_gradients(&mut self, variables: &[f64]) -> Result<CaseEvaluation, DesignError> {
        let slopes = self.problem.gradients(variables)?;
        // a value may exist where its gradient does not
        let alone = if slopes.iter().any(Option::is_none) { self.problem.values_at(variables) } else { Vec::new() };
        let value = |(q, slope): (usize, &Option<ValueAndGradient>)| match slope {
            Some((value, _)) => Ok(*value),
            None => alone[q].clone(),
        };
        let values = slopes.iter().enumerate().map(value).collect();
        let gradients = slopes.into_iter().map(|slope| slope.map(|(_, gradient)| gradient)).collect();
        self.evaluation(variables, values, Some(gradients))
    }

    fn evaluation(
        &self,
        variables: &[f64],
        values: Vec<Result<f64, DesignError>>,
        gradients: Option<Vec<Option<Vec<f64>>>>,
    ) -> Result<CaseEvaluation, DesignError> {
        let lacking = values.iter().enumerate().find(|(q, value)| value.is_err() && self.problem.is_used(*q));
        if let Some((_, Err(error))) = lacking {
            return Err(error.clone());
        }
        let numbers: Vec<f64> = values.iter().map(|value| value.clone().unwrap_or(f64::NAN)).collect();
        let objective = weighted_sum(&numbers, self.problem.objective_weights());
        let shape = self.problem.shape(variables)?;
        let fold = self.problem.fold_report(&shape);
        let self_intersecting = shape.section.self_intersection().is_some();
        Ok(CaseEvaluation { variables: variables.to_vec(), objective, values, gradients, fold, self_intersecting })
    }

    /// The design with the given variables, by name and in the unit of each; the others keep their start.
    ///
    /// A value may lie beyond a bound by round-off, as the end of a run may.
    ///
    /// # Errors
    /// [`DesignError::NoVariable`], [`DesignError::Twice`], [`DesignError::NotFinite`], [`DesignError::OutOfBounds`].
    pub fn design_vector<'a>(&self, given: impl IntoIterator<Item = (&'a str, f64)>) -> Result<Vec<f64>, DesignError> {
        let variables = self.problem.geometry().variables();
        let positions: HashMap<&str, usize> = variables.iter().enumerate().map(|(k, v)| (v.name.as_str(), k)).collect();
        let mut values = self.problem.start_values();
        let mut seen = vec![false; values.len()];
        for (name, value) in given {
            let index = *positions.get(name).ok_or_else(|| {
                let suggestion = nearest(name, variables.iter().map(|v| v.name.as_str()));
                DesignError::NoVariable { name: name.into(), suggestion }
            })?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(DesignError::Twice { name: name.into() });
            }
            if !value.is_finite() {
                return Err(DesignError::NotFinite { name: name.into() });
            }
            let Variable { bounds, scale, .. } = &variables[index];
            let slack = |bound: f64| 1e-9 * scale + 8.0 * f64::EPSILON * bound.abs();
            if value < bounds.lower - slack(bounds.lower) || value > bounds.upper + slack(bounds.upper) {
                let (lower, upper) = (bounds.lower, bounds.upper);
                return Err(DesignError::OutOfBounds { name: name.into(), value, lower, upper });
            }
            values[index] = value;
        }
        Ok(values)
    }
}

/// Largest case file that is read, in bytes.
const MOST_BYTES: u64 = 64 << 20;

/// Everything in a case that values depend on: its tables as they were understood, and the content of the files they
/// name. Comments, layout, name and description do not count, nor do limits and tolerances of the optimiser.
fn sources(document: &Document, table: &CaseTable, folder: &Path) -> Result<Identity, CaseError> {
    let tables = [
        ("section", format!("{:?}", table.section)),
        ("target", format!("{:?}", table.target)),
        ("box", format!("{:?}", table.lattice)),
        ("direct", format!("{:?}", table.direct)),
        ("variables", format!("{:?}", table.variables)),
        ("fold_penalty", format!("{:?}", table.fold_penalty)),
        ("shape_error", format!("{:?}", table.shape_error)),
        ("flow", format!("{:?}", table.flow)),
        ("pressure_target", format!("{:?}", table.pressure_target)),
        ("objective", format!("{:?}", table.objective)),
        ("constraints", format!("{:?}", table.constraints)),
        ("report", format!("{:?}", table.report)),
    ];
    let mut identity = Identity::new();
    for (name, content) in tables {
        identity = identity.with_content(format!("the table [{name}] of the case"), content.as_bytes());
    }
    let wanted = table.pressure_target.as_ref();
    let of = |section: Option<&SectionTable>| section.and_then(|section| section.file.clone());
    for (key, file) in [
        ("section", of(Some(&table.section))),
        ("target", of(table.target.as_ref())),
        ("pressure_target", wanted.and_then(|wanted| wanted.file.clone())),
        ("pressure_target", of(wanted.and_then(|wanted| wanted.section.as_ref()))),
    ] {
        if let Some(file) = &file {
            let content = read_limited(&folder.join(file), MOST_BYTES).map_err(|e| {
                document.error(&[key, "file"], format!("{}: cannot be read: {e}", folder.join(file).display()))
            })?;
            identity = identity.with_content(format!("the {key} file {file}"), &content);
        }
    }
    Ok(identity)
}

/// Refuses names that are no sound name of a folder everywhere.
fn check_name(name: &str) -> Result<(), String> {
    const MOST: usize = 100;
    let sound = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    if name.is_empty() || !name.chars().all(sound) {
        let shown: String = name.chars().take(MOST).collect();
        return Err(format!(
            "the name {shown:?} must be made of letters, digits, '-', '_' and '.' (it names a folder)"
        ));
    }
    if name.starts_with(['.', '-']) || name.ends_with('.') {
        return Err(format!("the name {name:?} must not begin with '.' or '-' or end with '.' (it names a folder)"));
    }
    if name.len() > MOST {
        let shown = &name[..40];
        return Err(format!("the name {shown:?}… has {} characters; at most {MOST} (it names a folder)", name.len()));
    }
    // names of devices on Windows, with any ending
    let stem = name.split('.').next().unwrap_or(name).to_ascii_uppercase();
    let numbered = |device: &str| stem.strip_prefix(device).is_some_and(|n| n.len() == 1 && n != "0" && n < ":");
    if ["CON", "PRN", "AUX", "NUL"].contains(&stem.as_str()) || ["COM", "LPT"].into_iter().any(numbered) {
        return Err(format!("the name {name:?} is that of a device on some systems; choose another"));
    }
    Ok(())
}

#[cfg(test)]
#[path = "case_tests.rs"]
mod tests;

#[cfg(test)]
mod angle_tests;
#[cfg(test)]
mod practice_tests;
