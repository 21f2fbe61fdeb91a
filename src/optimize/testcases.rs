//! Problems with known answers, shared by the tests of this module.

use super::optimizer::Optimizer;
use super::outcome::Outcome;
use crate::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription, ValueAndGradient};
use crate::differentiate::{Function, VectorFunction, gradient, hessian, jacobian};
use crate::scalar::Scalar;
use crate::section::SectionDefinition;
use nalgebra::DMatrix;
use std::convert::Infallible;
use std::ops::ControlFlow;

/// A problem whose derivatives come from dual numbers; it remembers what it is asked.
#[derive(Clone)]
pub(super) struct TestProblem<F> {
    functions: F,
    pub(super) description: ProblemDescription,
    /// Where the analysis fails.
    fails: fn(&[f64]) -> bool,
    /// Constraints that are known without an evaluation.
    known: fn(usize) -> bool,
    /// Every point evaluated, in order.
    pub(super) asked: Vec<Vec<f64>>,
    pub(super) hessians: usize,
}

/// The functions of a [`TestProblem`] with their derivatives.
pub(super) trait Differentiable {
    fn evaluation(&self, x: &[f64]) -> Evaluation;
    fn hessian(&self, _: &[f64]) -> Option<DMatrix<f64>> {
        None
    }
}

/// An objective alone, with its Hessian.
pub(super) struct Objective<F>(F);

impl<F: Function<Error = Infallible>> Differentiable for Objective<F> {
    fn evaluation(&self, x: &[f64]) -> Evaluation {
        let Ok((objective, gradient)) = gradient(&self.0, x);
        Evaluation { objective, gradient, constraints: vec![], jacobian: vec![], values: vec![] }
    }
    fn hessian(&self, x: &[f64]) -> Option<DMatrix<f64>> {
        let Ok((_, _, matrix)) = hessian(&self.0, x);
        Some(matrix)
    }
}

/// Objective and constraints, in this order, without a Hessian.
#[derive(Clone)]
pub(super) struct ObjectiveAndConstraints<F>(F);

impl<F: VectorFunction<Error = Infallible>> Differentiable for ObjectiveAndConstraints<F> {
    fn evaluation(&self, x: &[f64]) -> Evaluation {
        let Ok((values, matrix)) = jacobian(&self.0, x);
        let row = |k: usize| matrix.row(k).iter().copied().collect();
        Evaluation {
            objective: values[0],
            gradient: row(0),
            constraints: values[1..].to_vec(),
            jacobian: (1..values.len()).map(row).collect(),
            values: vec![],
        }
    }
}

pub(super) type Unconstrained<F> = TestProblem<Objective<F>>;
pub(super) type Constrained<F> = TestProblem<ObjectiveAndConstraints<F>>;

impl<F> Unconstrained<F> {
    pub(super) fn new(function: F, start: &[f64]) -> Self {
        Self::with_limits(Objective(function), start, &[])
    }
}

impl<F> Constrained<F> {
    pub(super) fn new(function: F, start: &[f64], limits: &[(f64, f64)]) -> Self {
        Self::with_limits(ObjectiveAndConstraints(function), start, limits)
    }
}

impl<F> TestProblem<F> {
    fn with_limits(functions: F, start: &[f64], limits: &[(f64, f64)]) -> Self {
        let description = ProblemDescription {
            variable_names: (0..start.len()).map(|i| format!("x{i}")).collect(),
            start: start.to_vec(),
            variable_bounds: vec![Bounds::FREE; start.len()],
            constraint_names: (0..limits.len()).map(|i| format!("c{i}")).collect(),
            constraint_bounds: limits.iter().map(|&(lower, upper)| Bounds { lower, upper }).collect(),
            value_names: vec![],
        };
        Self { functions, description, fails: |_| false, known: |_| false, asked: vec![], hessians: 0 }
    }

    pub(super) fn bounded(mut self, lower: f64, upper: f64) -> Self {
        self.description.variable_bounds.fill(Bounds { lower, upper });
        self
    }

    pub(super) fn knowing(mut self, known: fn(usize) -> bool) -> Self {
        self.known = known;
        self
    }

    pub(super) fn failing(mut self, fails: fn(&[f64]) -> bool) -> Self {
        self.fails = fails;
        self
    }
}

impl<F: Differentiable> Problem for TestProblem<F> {
    fn description(&self) -> &ProblemDescription {
        &self.description
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        self.asked.push(x.to_vec());
        if (self.fails)(x) {
            return Err(AnalysisFailure { reason: "the test forbids it".into() });
        }
        Ok(self.functions.evaluation(x))
    }

    fn hessian(&mut self, x: &[f64]) -> Option<Result<DMatrix<f64>, AnalysisFailure>> {
        self.hessians += 1;
        self.functions.hessian(x).map(Ok)
    }

    fn known_constraints(&mut self, x: &[f64]) -> Option<Vec<Option<ValueAndGradient>>> {
        let Evaluation { constraints, jacobian, .. } = self.functions.evaluation(x);
        let all = constraints.into_iter().zip(jacobian).enumerate();
        Some(all.map(|(k, row)| (self.known)(k).then_some(row)).collect())
    }
}

/// Runs to the end.
pub(super) fn run(method: &dyn Optimizer, problem: &mut dyn Problem) -> Outcome {
    method.minimize(problem, &mut |_| ControlFlow::Continue(())).expect("a problem that suits the method")
}

/// The chained Rosenbrock function, minimum 0 at (1, …, 1).
pub(super) struct Rosenbrock;

impl Function for Rosenbrock {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Infallible> {
        Ok(x.windows(2).map(|w| (w[1] - w[0].squared()).squared() * 100.0 + (w[0] - 1.0).squared()).sum())
    }
}

pub(super) fn rosenbrock(n: usize) -> Unconstrained<Rosenbrock> {
    // from further left the long chains end in a local minimum near (−1, 1, …)
    let start = if n == 2 { vec![-1.2, 1.0] } else { vec![0.0; n] };
    Unconstrained::new(Rosenbrock, &start)
}

/// `floor + size/2 Σ λ_i (Q (x − 1))_i²` with λ from 1 to `condition` and a reflection Q.
pub(super) struct Quadratic {
    pub(super) condition: f64,
    pub(super) size: f64,
    pub(super) floor: f64,
}

impl Function for Quadratic {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Infallible> {
        let n = x.len();
        let v: Vec<f64> = (0..n).map(|i| 1.0 + (1.7 * i as f64).sin()).collect();
        let square: f64 = v.iter().map(|v| v * v).sum();
        let along: S = x.iter().zip(&v).map(|(&x, &v)| (x - 1.0) * v).sum::<S>() * (2.0 / square);
        let terms = x.iter().zip(&v).enumerate().map(|(i, (&x, &v))| {
            let share = if n > 1 { i as f64 / (n - 1) as f64 } else { 0.0 };
            (x - 1.0 - along * v).squared() * self.condition.powf(share)
        });
        Ok(terms.sum::<S>() * (0.5 * self.size) + self.floor)
    }
}

pub(super) fn quadratic(n: usize, condition: f64, size: f64, floor: f64) -> Unconstrained<Quadratic> {
    Unconstrained::new(Quadratic { condition, size, floor }, &vec![0.0; n])
}

/// `x² − y² + y⁴`: a saddle at the origin, minima −1/4 at (0, ±1/√2).
pub(super) struct Saddle;

impl Function for Saddle {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Infallible> {
        Ok(x[0].squared() - x[1].squared() + x[1].squared().squared())
    }
}

/// The paper's shape match in small: a NACA 0012 in a 4 × 4 cubic box is morphed to a NACA 8416.
///
/// Variables are displacements of the 16 box control points in chords (x and y of each in turn). The objective is the
/// mean square distance of 101 points, which is quadratic with condition number 6e9, plus the paper's fold penalty
/// (equations 1 to 4), a wall that holds the optimum off the quadratic's own minimum.
pub(super) struct ShapeMatch {
    /// Basis functions of the 16 control points at each point.
    weights: Vec<[f64; 16]>,
    target: Vec<[f64; 2]>,
    net: [[f64; 2]; 16],
}

const CELL: [f64; 2] = [0.4, 0.1];

impl ShapeMatch {
    pub(super) fn new(target: &str) -> Self {
        let bernstein = |t: f64| {
            let r = 1.0 - t;
            [r * r * r, 3.0 * t * r * r, 3.0 * t * t * r, t * t * t]
        };
        let weights = section("naca0012:sharp").into_iter().map(|p| {
            let (u, v) = (bernstein((p[0] + 0.1) / 1.2), bernstein((p[1] + 0.15) / 0.3));
            std::array::from_fn(|k| u[k / 4] * v[k % 4])
        });
        let net = std::array::from_fn(|k| [-0.1 + CELL[0] * (k / 4) as f64, -0.15 + CELL[1] * (k % 4) as f64]);
        Self { weights: weights.collect(), target: section(target), net }
    }

    /// Sum over the control points of the fold penalty.
    fn penalty<S: Scalar>(&self, net: &[[S; 2]; 16]) -> S {
        let mut sum = S::from(0.0);
        for k in 0..16 {
            let at = |di: i32, dj: i32| {
                let (i, j) = (k / 4 + di, k % 4 + dj);
                ((0..4).contains(&i) && (0..4).contains(&j)).then(|| net[(4 * i + j) as usize])
            };
            let around = [at(1, 0), at(0, 1), at(-1, 0), at(0, -1)];
            let areas: Vec<S> = (0..4)
                .filter_map(|side| {
                    let (p, q) = (around[side]?, around[(side + 1) % 4]?);
                    let [a, b] = net[k as usize];
                    Some(((p[0] - a) * (q[1] - b) - (p[1] - b) * (q[0] - a)) * 0.5)
                })
                .collect();
            let whole = 0.5 * CELL[0] * CELL[1];
            let m = match areas[..] {
                [a] => a / whole,
                [a, b] => a.smooth_minimum(b, 1000.0) * 2.0 / (a.abs() + b.abs() + 2e-11 * whole),
                _ => {
                    let least = areas[0]
                        .smooth_minimum(areas[1], 1000.0)
                        .smooth_minimum(areas[2].smooth_minimum(areas[3], 1000.0), 1000.0);
                    least * 4.0 / areas.iter().copied().sum::<S>()
                }
            };
            sum += (m * 10.0).erfc() * (m * -0.5 + 0.25);
        }
        sum
    }
}

impl Function for ShapeMatch {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Infallible> {
        let net: [[S; 2]; 16] = std::array::from_fn(|k| [x[2 * k] + self.net[k][0], x[2 * k + 1] + self.net[k][1]]);
        let mut sum = S::from(0.0);
        for (weights, target) in self.weights.iter().zip(&self.target) {
            for d in 0..2 {
                let point: S = weights.iter().zip(&net).map(|(&w, p)| p[d] * w).sum();
                sum += (point - target[d]).squared();
            }
        }
        Ok(sum / self.target.len() as f64 + self.penalty(&net))
    }
}

pub(super) fn shape_match() -> Unconstrained<ShapeMatch> {
    Unconstrained::new(ShapeMatch::new("naca8416:sharp"), &[0.0; 32])
}

/// 101 points of a section at cosine stations: those through which its spline is drawn.
fn section(designation: &str) -> Vec<[f64; 2]> {
    let definition = SectionDefinition::parse(designation).and_then(|d| d.with_control_points(103));
    definition.and_then(|d| d.section()).expect("a known section").points(101)
}
