//! An objective of your own, minimised by an optimiser of the crate.
//!
//! The drag of a section is to fall while its lift is held, its area stays, and its thickness at 80 % of the chord is
//! what a structure needs. The variables are six Kulfan coefficients. The objective, drag plus a price on the moment that
//! the tail has to balance, is none that a case file knows: it is a type that implements `Problem`.
//!
//! `cargo run --example own_objective`

use aeroform::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
use aeroform::differentiate::{VectorFunction, jacobian};
use aeroform::flow::{Condition, FlowSolver, Incidence, PanelSolver, Solution, TrailingEdge, panel_parameters};
use aeroform::optimize::{Optimizer, Slsqp};
use aeroform::scalar::Scalar;
use aeroform::section::{Kulfan, Section, SectionError};
use std::error::Error;
use std::ops::ControlFlow;

/// Variables: three coefficients of the upper side, three of the lower side.
const START: [f64; 6] = [0.17, 0.20, 0.20, -0.14, -0.10, -0.05];
const POINT: Condition = Condition {
    incidence: Incidence::Lift(0.4),
    mach: 0.1,
    reynolds: 4e6,
    n_critical: 9.0,
    trips: [Some(0.1), Some(0.1)],
};
/// Price of the square of the moment in units of drag: a moment of 0.05 costs 2.5 drag counts.
const PRICE: f64 = 0.1;
/// Most change of a variable.
const REACH: f64 = 0.06;

/// The section over any number.
fn section<S: Scalar>(x: &[S]) -> Result<Section<S>, SectionError> {
    Kulfan::new(x[..3].to_vec(), x[3..].to_vec())?.section()
}

/// Panel nodes, then area and thickness at 80 % of the chord, as one function of the variables.
struct Shape {
    parameters: Vec<f64>,
}

impl VectorFunction for Shape {
    type Error = SectionError;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SectionError> {
        let section = section(x)?;
        let curve = section.curve();
        let nodes = self.parameters.iter().flat_map(|&u| curve.point_at(u));
        Ok(nodes.chain([section.area(), section.thickness_at(0.8)?]).collect())
    }
}

/// Drag with a price on the moment; area and rear thickness are constraints.
struct Trimmed {
    shape: Shape,
    solver: PanelSolver,
    /// The last flow, from which the next one starts.
    last: Option<Solution>,
    description: ProblemDescription,
}

impl Trimmed {
    fn new() -> Result<Self, SectionError> {
        let start = section(&START)?;
        // nodes keep their parameters while the shape changes, so that they move smoothly with it
        let shape = Shape { parameters: panel_parameters(&start, 141) };
        let least = |value: f64| Bounds { lower: value, upper: f64::INFINITY };
        let description = ProblemDescription {
            variable_names: ["u0", "u1", "u2", "l0", "l1", "l2"].map(String::from).to_vec(),
            start: START.to_vec(),
            variable_bounds: START.map(|x| Bounds { lower: x - REACH, upper: x + REACH }).to_vec(),
            constraint_names: vec!["area".into(), "thickness_at(0.8)".into()],
            constraint_bounds: vec![least(start.area()), least(start.thickness_at(0.8)?)],
            value_names: vec!["cd".into(), "cm".into()],
        };
        Ok(Self { shape, solver: PanelSolver::default(), last: None, description })
    }

    fn try_evaluate(&mut self, x: &[f64]) -> Result<Evaluation, Box<dyn Error>> {
        let (values, rows) = jacobian(&self.shape, x)?;
        let count = self.shape.parameters.len();
        let nodes: Vec<[f64; 2]> = (0..count).map(|i| [values[2 * i], values[2 * i + 1]]).collect();
        let solution = self.solver.section(&nodes, TrailingEdge::Sharp)?.analyze(&POINT, self.last.as_ref())?;
        if !solution.is_reliable() {
            return Err(format!("the flow is {}", solution.status).into());
        }
        let held = solution.held_gradients().ok_or("the equations are singular")?;
        let (cd, cm) = (solution.coefficients.cd, solution.coefficients.cm);
        // the chain rule: derivatives by the nodes times derivatives of the nodes by the variables
        let gradient = (0..x.len()).map(|v| {
            let by_node = |i: usize| {
                let [dx, dy] = [rows[(2 * i, v)], rows[(2 * i + 1, v)]];
                let of = |d: &[f64; 2]| d[0] * dx + d[1] * dy;
                of(&held.coefficients.cd.nodes[i]) + 2.0 * PRICE * cm * of(&held.coefficients.cm.nodes[i])
            };
            (0..count).map(by_node).sum()
        });
        let evaluation = Evaluation {
            objective: cd + PRICE * cm * cm,
            gradient: gradient.collect(),
            constraints: values[2 * count..].to_vec(),
            jacobian: (2 * count..values.len()).map(|r| rows.row(r).iter().copied().collect()).collect(),
            values: vec![cd, cm],
        };
        self.last = Some(solution);
        Ok(evaluation)
    }
}

impl Problem for Trimmed {
    fn description(&self) -> &ProblemDescription {
        &self.description
    }

    fn evaluate(&mut self, x: &[f64]) -> Result<Evaluation, AnalysisFailure> {
        // a shape without a flow is no end: the optimiser goes on with a shorter step
        self.try_evaluate(x).map_err(|error| AnalysisFailure { reason: error.to_string() })
    }

    fn hessian(&mut self, _: &[f64]) -> Option<Result<nalgebra::DMatrix<f64>, AnalysisFailure>> {
        None
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut problem = Trimmed::new()?;
    println!("evaluation   drag counts   moment     violation");
    let outcome = Slsqp::default().minimize(&mut problem, &mut |progress| {
        if let Ok(evaluation) = progress.result {
            let [cd, cm] = [evaluation.values[0], evaluation.values[1]];
            println!("{:10}   {:11.4}   {cm:8.5}   {:.1e}", progress.evaluation, 1e4 * cd, progress.violation);
        }
        ControlFlow::Continue(())
    })?;
    println!("\n{}: {}", outcome.status, outcome.message);
    for (name, (x, start)) in problem.description().variable_names.iter().zip(outcome.x.iter().zip(START)) {
        println!("{name}: {start:8.4} -> {x:8.4}");
    }
    for (name, multiplier) in problem.description().constraint_names.iter().zip(&outcome.multipliers) {
        println!("a hundredth more {name} would cost {:.2} drag counts", 1e-2 * 1e4 * multiplier);
    }
    Ok(())
}
