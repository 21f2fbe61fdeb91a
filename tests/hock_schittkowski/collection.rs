//! The form of an entry of the collection, and its problem as the crate sees it.

use aeroform::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
use nalgebra::DMatrix;
use num_dual::DualSVec64;

/// A number with its derivatives by up to ten variables.
pub type D = DualSVec64<10>;
pub const INF: f64 = f64::INFINITY;
/// Bounds of a constraint `g(x) ≥ 0`, and of `g(x) = 0`.
pub const POSITIVE: (f64, f64) = (0.0, INF);
pub const ZERO: (f64, f64) = (0.0, 0.0);
pub const FREE: (f64, f64) = (-INF, INF);

/// A problem as the book prints it: the objective, then the constraints.
pub struct Entry {
    /// Number in the book.
    pub number: usize,
    pub start: Vec<f64>,
    /// Bounds of the variables.
    pub bounds: Vec<(f64, f64)>,
    /// Bounds of the constraints.
    pub constraints: Vec<(f64, f64)>,
    /// The objective that the book prints for the solution.
    pub optimum: f64,
    /// Objectives at other local minima that a run may rightly end in.
    pub others: Vec<f64>,
    pub functions: fn(&[D]) -> Vec<D>,
}

/// An entry without bounds and constraints.
pub fn entry(number: usize, start: &[f64], optimum: f64, functions: fn(&[D]) -> Vec<D>) -> Entry {
    let bounds = vec![FREE; start.len()];
    Entry { number, start: start.to_vec(), bounds, constraints: vec![], optimum, others: vec![], functions }
}

impl Entry {
    /// Bounds of all variables in turn.
    pub fn within(mut self, bounds: &[(f64, f64)]) -> Self {
        assert_eq!(bounds.len(), self.start.len(), "problem {}", self.number);
        self.bounds = bounds.to_vec();
        self
    }

    /// Equal bounds for all variables.
    pub fn all_within(mut self, lower: f64, upper: f64) -> Self {
        self.bounds.fill((lower, upper));
        self
    }

    /// Bounds of all constraints in turn.
    pub fn under(mut self, constraints: &[(f64, f64)]) -> Self {
        self.constraints = constraints.to_vec();
        self
    }

    /// Objectives at other local minima.
    pub fn or(mut self, others: &[f64]) -> Self {
        self.others = others.to_vec();
        self
    }

    /// The problem from a start of its own.
    pub fn problem(&self, start: &[f64]) -> Collected {
        let bounds = |list: &[(f64, f64)]| list.iter().map(|&(lower, upper)| Bounds { lower, upper }).collect();
        let description = ProblemDescription {
            variable_names: (1..=self.start.len()).map(|k| format!("x{k}")).collect(),
            start: start.to_vec(),
            variable_bounds: bounds(&self.bounds),
            constraint_names: (1..=self.constraints.len()).map(|k| format!("g{k}")).collect(),
            constraint_bounds: bounds(&self.constraints),
            value_names: vec![],
        };
        Collected { functions: self.functions, description, objective: 1.0, variables: 1.0 }
    }

    /// Whether an objective is that of the solution, or of another local minimum that is known.
    pub fn knows(&self, objective: f64) -> bool {
        let near = |f: &f64| (objective - f).abs() <= 2e-5 * f.abs().max(1.0);
        std::iter::once(&self.optimum).chain(&self.others).any(near)
    }
}

/// An entry with a start; objective and variables may be scaled.
#[derive(Clone)]
pub struct Collected {
    functions: fn(&[D]) -> Vec<D>,
    description: ProblemDescription,
    objective: f64,
    variables: f64,
}

impl Collected {
    /// The objective times one factor, the variables times another.
    pub fn scaled(mut self, objective: f64, variables: f64) -> Self {
        self.objective = objective;
        self.variables = variables;
        self.description.start.iter_mut().for_each(|x| *x *= variables);
        for bounds in &mut self.description.variable_bounds {
            bounds.lower *= variables;
            bounds.upper *= variables;
        }
        self
    }
}

impl Problem for Collected {
    fn description(&self) -> &ProblemDescription {
        &self.description
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        let duals: Vec<D> = x.iter().enumerate().map(|(k, x)| D::from_re(x / self.variables).derivative(k)).collect();
        let values = (self.functions)(&duals);
        let gradient = |value: &D, factor: f64| -> Vec<f64> {
            let slopes = value.eps.unwrap_generic(nalgebra::Const::<10>, nalgebra::U1);
            slopes.iter().take(x.len()).map(|s| s * factor / self.variables).collect()
        };
        Ok(Evaluation {
            objective: values[0].re * self.objective,
            gradient: gradient(&values[0], self.objective),
            constraints: values[1..].iter().map(|v| v.re).collect(),
            jacobian: values[1..].iter().map(|v| gradient(v, 1.0)).collect(),
            values: vec![],
        })
    }

    fn hessian(&mut self, _: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        None
    }
}
