//! An objective of your own, minimised by an optimiser of the crate.
//!
//! The drag of a section is to fall while its lift is held, its area stays, and its thickness at 80 % of the chord is
//! what a structure needs. The variables are six Kulfan coefficients. The objective, drag plus a price on the moment
//! that the tail has to balance, is none that a case file knows: it is a type that implements `Problem`.
//!
//! `cargo run --example own_objective`

use aeroform::design::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
use aeroform::flow::{Condition, FlowSolver, Incidence, PanelSolver, Solution, TrailingEdge, panel_parameters};
use aeroform::optimize::{Optimizer, Slsqp};
use aeroform::scalar::Scalar;
use aeroform::section::{Kulfan, Section, SectionError};
use num_dual::DualSVec64;
use std::error::Error;
use std::ops::ControlFlow;

/// A number with its derivatives by the six variables.
type Number = DualSVec64<6>;

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

/// Drag with a price on the moment; area and rear thickness are constraints.
struct Trimmed {
    /// Curve parameters of the panel nodes.
    parameters: Vec<f64>,
    solver: PanelSolver,
    /// The last flow, from which the next one starts.
    last: Option<Solution>,
    description: ProblemDescription,
}

impl Trimmed {
    fn new() -> Result<Self, SectionError> {
        let start = section(&START)?;
        // nodes keep their parameters while the shape changes, so that they move smoothly with it
        let parameters = panel_parameters(&start, 141);
        let least = |value: f64| Bounds { lower: value, upper: f64::INFINITY };
        let description = ProblemDescription {
            variable_names: ["u0", "u1", "u2", "l0", "l1", "l2"].map(String::from).to_vec(),
            start: START.to_vec(),
            variable_bounds: START.map(|x| Bounds { lower: x - REACH, upper: x + REACH }).to_vec(),
            constraint_names: vec!["area".into(), "thickness_at(0.8)".into()],
            constraint_bounds: vec![least(start.area()), least(start.thickness_at(0.8)?)],
            value_names: vec!["cd".into(), "cm".into()],
        };
        Ok(Self { parameters, solver: PanelSolver::default(), last: None, description })
    }

    fn try_evaluate(&mut self, x: &[f64]) -> Result<Evaluation, Box<dyn Error>> {
        let variables: Vec<Number> = x.iter().enumerate().map(|(k, &x)| Number::from(x).derivative(k)).collect();
        let section = section(&variables)?;
        let nodes: Vec<[Number; 2]> = self.parameters.iter().map(|&u| section.curve().point_at(u)).collect();
        // the flow is solved with plain numbers; its adjoint carries the derivatives through
        let places: Vec<[f64; 2]> = nodes.iter().map(|node| node.map(|c| c.re)).collect();
        let solution = self.solver.section(&places, TrailingEdge::Sharp)?.analyze(&POINT, self.last.as_ref())?;
        if !solution.is_reliable() {
            return Err(format!("the flow is {}", solution.status).into());
        }
        let flow = solution.lift(&nodes)?;
        self.last = Some(solution);

        let objective = flow.cd + flow.cm * flow.cm * PRICE;
        let constraints = [section.area(), section.thickness_at(0.8)?];
        Ok(Evaluation {
            objective: objective.re,
            gradient: derivatives(&objective),
            constraints: constraints.map(|c| c.re).to_vec(),
            jacobian: constraints.iter().map(derivatives).collect(),
            values: vec![flow.cd.re, flow.cm.re],
        })
    }
}

fn derivatives(number: &Number) -> Vec<f64> {
    number.eps.unwrap_generic(nalgebra::Const::<6>, nalgebra::U1).as_slice().to_vec()
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
