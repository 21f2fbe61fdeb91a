//! The flow about a shape at the operating points of a problem, with exact derivatives in the shape.

mod pressures;

use super::DesignError;
use super::parallel::{in_parallel_with, processors};
use super::pressure_target::PressureError;
use super::shape::{Posed, PosedSlope, Shape};
use crate::ffd::LinearMap;
use crate::flow::{
    COEFFICIENTS, Coefficients, Condition, FlowSection, FlowSolver, HeldGradients, Incidence, Solution,
    panel_parameters,
};
use crate::scalar::Scalar;
use crate::section::Section;
use num_dual::DualSVec64;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

/// One operating point of a design problem.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatingPoint {
    /// Name of the point; empty where there is only one.
    pub name: String,
    /// Share of the point in weighted means; the shares of all points add up to one.
    pub weight: f64,
    /// Flow conditions; at a fixed lift coefficient the angle of attack follows the shape. Where the angle is a design
    /// variable, the one at the start.
    pub condition: Condition,
    /// Position among the [angles](Shape::angles) of a shape, where the angle of attack is a design variable.
    pub angle: Option<usize>,
}

impl OperatingPoint {
    /// The flow conditions for a shape: those of the point, at the angle of attack of the shape where that is a design
    /// variable.
    pub fn condition_at(&self, shape: &Shape) -> Condition {
        self.at(&shape.angles)
    }

    fn at(&self, angles: &[f64]) -> Condition {
        match self.angle.and_then(|place| angles.get(place)) {
            Some(&alpha) => Condition { incidence: Incidence::Alpha(alpha), ..self.condition },
            None => self.condition,
        }
    }
}

/// A number that is read off a flow, by its name in case files: one of the [`Coefficients`], `cl/cd` (lift over drag),
/// `cl^1.5/cd` (the lift to the power 1.5 over drag: the endurance of a glider; without a value at negative lift),
/// `alpha` (angle of attack in degrees, an outcome where the lift is held), or `cd_wave` (wave drag, zero by a solver that
/// knows no shocks).
///
/// The lowest pressure coefficient `cp_min` is only continuous where two suction peaks tie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlowOutput(Kind);

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A coefficient, by its place among all.
    Coefficient(usize),
    LiftToDrag,
    Endurance,
    Alpha,
    WaveDrag,
}

const LIFT_TO_DRAG: &str = "cl/cd";
const ENDURANCE: &str = "cl^1.5/cd";
const ALPHA: &str = "alpha";
const WAVE_DRAG: &str = "cd_wave";

/// Number of numbers that outputs are made of: the coefficients, the angle of attack and the wave drag coefficient.
const NUMBERS: usize = COEFFICIENTS + 2;
/// Derivatives of an output with respect to these numbers.
type ByNumbers = DualSVec64<NUMBERS>;

impl FlowOutput {
    /// The names in case files.
    pub fn names() -> impl Iterator<Item = &'static str> {
        <Coefficients>::NAMES.into_iter().chain([LIFT_TO_DRAG, ENDURANCE, ALPHA, WAVE_DRAG])
    }

    /// The output of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        let coefficient = || <Coefficients>::NAMES.iter().position(|known| *known == name).map(Kind::Coefficient);
        match name {
            LIFT_TO_DRAG => Some(Kind::LiftToDrag),
            ENDURANCE => Some(Kind::Endurance),
            ALPHA => Some(Kind::Alpha),
            WAVE_DRAG => Some(Kind::WaveDrag),
            _ => coefficient(),
        }
        .map(Self)
    }

    /// The name of the output in case files.
    pub fn name(self) -> &'static str {
        match self.0 {
            Kind::Coefficient(place) => <Coefficients>::NAMES[place],
            Kind::LiftToDrag => LIFT_TO_DRAG,
            Kind::Endurance => ENDURANCE,
            Kind::Alpha => ALPHA,
            Kind::WaveDrag => WAVE_DRAG,
        }
    }

    /// The output of coefficients, an angle of attack in radians and a wave drag coefficient.
    fn of<S: Scalar>(self, coefficients: &Coefficients<S>, alpha: S, wave_drag: S) -> S {
        match self.0 {
            Kind::Coefficient(place) => coefficients.to_array()[place],
            Kind::LiftToDrag => coefficients.cl / coefficients.cd,
            Kind::Endurance => coefficients.cl.real_power(1.5) / coefficients.cd,
            Kind::Alpha => alpha * 1f64.to_degrees(),
            Kind::WaveDrag => wave_drag,
        }
    }

    /// The output of a solution, with its derivatives by the numbers that it is made of.
    fn of_solution(self, solution: &Solution) -> ByNumbers {
        let mut place = 0;
        let mut variable = |value: f64| {
            place += 1;
            ByNumbers::from_re(value).derivative(place - 1)
        };
        let coefficients = solution.coefficients.map(&mut variable);
        let alpha = variable(solution.alpha);
        self.of(&coefficients, alpha, variable(solution.cd_wave))
    }
}

/// An output at one operating point, or its weighted mean over all of them.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowQuantity {
    /// The number that is read off.
    pub output: FlowOutput,
    /// The operating point, by position; `None` for the weighted mean.
    pub point: Option<usize>,
    /// Name of the operating point, where it has one and is meant alone.
    pub label: String,
}

impl FlowQuantity {
    /// `cd`, or `cd_at(cruise)`.
    pub fn name(&self) -> String {
        let name = self.output.name();
        if self.label.is_empty() { name.into() } else { format!("{name}_at({})", self.label) }
    }
}

/// How long flows took so far, in seconds, and how many there were.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FlowTiming {
    /// Number of flow solutions.
    pub solutions: usize,
    /// Time spent on solutions in seconds, summed over threads.
    pub solution_seconds: f64,
    /// Number of solutions that were differentiated.
    pub gradients: usize,
    /// Time spent on derivatives in seconds.
    pub gradient_seconds: f64,
}

/// The flows about one shape.
#[derive(Debug)]
pub(super) struct Flows {
    nodes: Vec<[f64; 2]>,
    angles: Vec<f64>,
    solutions: Vec<Result<Solution, DesignError>>,
    gradients: Vec<OnceLock<Option<HeldGradients>>>,
}

/// Panels at fixed parameters of the section and the points at which their flow is wanted.
///
/// Every flow starts from nothing but its shape, or from the flow about the undeformed section where the solver
/// [gains](FlowSolver::gains_from_neighbours) from that. Either way a value never depends on what was asked before: a
/// resumed run continues bit for bit. The flows of the latest shape are kept for all quantities to share.
#[derive(Debug)]
pub(crate) struct FlowAnalysis {
    points: Vec<OperatingPoint>,
    solver: Arc<dyn FlowSolver>,
    edge: crate::section::TrailingEdge,
    /// Control points of the section → panel nodes.
    map: LinearMap,
    /// Flows of the latest shape. The lock is held to read or replace them, never while a flow is solved.
    latest: Mutex<Option<Arc<Flows>>>,
    /// Where flows start from, if not from nothing.
    start: Option<Arc<Flows>>,
    /// Nodes of the undeformed section, and the flows about it once they are known, for a solver that gains from them.
    home: Option<Arc<Home>>,
    timing: Arc<Mutex<FlowTiming>>,
    /// Wanted pressures, where there are any.
    pressures: Option<PressureError>,
}

/// The undeformed section.
#[derive(Debug)]
struct Home {
    nodes: Vec<[f64; 2]>,
    /// Flows of the design, one per operating point; `None` where there is none.
    solutions: OnceLock<Vec<Option<Solution>>>,
}

impl Clone for FlowAnalysis {
    /// A copy with a memory and a clock of its own, so that clones never wait for each other.
    fn clone(&self) -> Self {
        Self {
            points: self.points.clone(),
            solver: Arc::clone(&self.solver),
            edge: self.edge,
            map: self.map.clone(),
            latest: Mutex::new(self.latest().clone()),
            start: self.start.clone(),
            home: self.home.clone(),
            timing: Arc::new(Mutex::new(self.timing())),
            pressures: self.pressures.clone(),
        }
    }
}

impl FlowAnalysis {
    /// Panels chosen on the undeformed `section`; weights are scaled to add up to one.
    pub fn new(
        section: &Section<f64>,
        mut points: Vec<OperatingPoint>,
        panels: usize,
        solver: Arc<dyn FlowSolver>,
    ) -> Self {
        let total: f64 = points.iter().map(|p| p.weight).sum();
        points.iter_mut().for_each(|p| p.weight /= total);
        let curve = section.curve();
        let mut map = LinearMap::new(curve.control_points().len());
        for u in panel_parameters(section, panels + 1) {
            let span = curve.knots().span(u);
            for (offset, basis) in curve.knots().basis(span, u).into_iter().enumerate() {
                map.push(span - curve.knots().degree() + offset, basis);
            }
            map.end_row();
        }
        let home = solver.gains_from_neighbours().then(|| {
            let mut nodes = vec![[0.0; 2]; map.outputs()];
            map.add_to(curve.control_points(), &mut nodes);
            Arc::new(Home { nodes, solutions: OnceLock::new() })
        });
        Self {
            points,
            solver,
            edge: section.trailing_edge(),
            map,
            latest: Mutex::default(),
            start: None,
            home,
            timing: Arc::default(),
            pressures: None,
        }
    }

    /// Name of the flow solver.
    pub fn solver(&self) -> &'static str {
        self.solver.name()
    }

    pub fn points(&self) -> &[OperatingPoint] {
        &self.points
    }

    pub fn timing(&self) -> FlowTiming {
        *self.timing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A copy whose flows start from those about `base`, and whose time counts as that of the original.
    pub fn near(&self, base: Option<&Shape<f64>>) -> Self {
        let start = base.map(|shape| self.flows(shape.posed()));
        // flows in memory started elsewhere: they are right, but not to the last bit those asked for
        Self { start, latest: Mutex::default(), ..self.on_the_same_clock() }
    }

    /// A copy whose time counts as that of the original.
    pub fn on_the_same_clock(&self) -> Self {
        Self { timing: Arc::clone(&self.timing), ..self.clone() }
    }

    pub fn nodes(&self, control_points: &[[f64; 2]]) -> Vec<[f64; 2]> {
        let mut nodes = vec![[0.0; 2]; self.map.outputs()];
        self.map.add_to(control_points, &mut nodes);
        nodes
    }

    /// The solutions about a shape, one per operating point, or why there is none.
    pub fn solutions(&self, shape: &Shape<f64>) -> Vec<Result<Solution, DesignError>> {
        self.flows(shape.posed()).solutions.clone()
    }

    /// The section of a shape, prepared for the solver of the problem.
    pub fn prepared(&self, shape: &Shape<f64>) -> Result<Box<dyn FlowSection>, DesignError> {
        let nodes = self.nodes(shape.section.curve().control_points());
        Ok(self.solver.section(&nodes, self.edge)?)
    }

    /// The flows about a shape, from memory where they are those of the latest call.
    fn flows(&self, shape: Posed<'_>) -> Arc<Flows> {
        let nodes = self.nodes(shape.points);
        let known = self.latest().clone().filter(|f| f.nodes == nodes && f.angles == shape.angles);
        if let Some(flows) = known {
            return flows;
        }
        let solutions = match self.solver.section(&nodes, self.edge) {
            Ok(section) => self.solve(&*section, shape.angles),
            Err(error) => self.points.iter().map(|_| Err(error.clone().into())).collect(),
        };
        let gradients = solutions.iter().map(|_| OnceLock::new()).collect();
        let flows = Arc::new(Flows { nodes, angles: shape.angles.to_vec(), solutions, gradients });
        *self.latest() = Some(Arc::clone(&flows));
        flows
    }

    fn latest(&self) -> MutexGuard<'_, Option<Arc<Flows>>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The flows about the undeformed section, where the solver gains from them.
    fn at_home(&self) -> Option<&[Option<Solution>]> {
        let home = self.home.as_ref()?;
        let find = || {
            let Ok(section) = self.solver.section(&home.nodes, self.edge) else { return Vec::new() };
            in_parallel(&self.points, |point| {
                section.analyze(&point.condition, None).ok().filter(Solution::is_reliable)
            })
        };
        Some(home.solutions.get_or_init(find))
    }

    /// All points at once, on as many threads as there are processors.
    fn solve(&self, section: &dyn FlowSection, angles: &[f64]) -> Vec<Result<Solution, DesignError>> {
        let begin = Instant::now();
        let indices: Vec<usize> = (0..self.points.len()).collect();
        let home = self.at_home();
        let one = |&index: &usize| -> Result<Solution, DesignError> {
            let point = &self.points[index];
            let near = self.start.as_ref().and_then(|flows| flows.solutions[index].as_ref().ok());
            let condition = point.at(angles);
            let solution = match near.or_else(|| home?.get(index)?.as_ref()) {
                Some(near) => section.analyze_trial(&condition, near)?,
                None => section.analyze(&condition, None)?,
            };
            if solution.is_reliable() {
                return Ok(solution);
            }
            Err(DesignError::FlowStatus { point: point.name.clone(), status: solution.status })
        };
        let solutions = in_parallel(&indices, one);
        self.book(|timing| {
            timing.solutions += solutions.len();
            timing.solution_seconds += begin.elapsed().as_secs_f64();
        });
        solutions
    }

    fn book(&self, entry: impl FnOnce(&mut FlowTiming)) {
        entry(&mut self.timing.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// The points that a quantity is made of, with their shares.
    fn shares(&self, quantity: &FlowQuantity) -> Vec<(usize, f64)> {
        match quantity.point {
            Some(point) => vec![(point, 1.0)],
            None => self.points.iter().enumerate().map(|(k, p)| (k, p.weight)).collect(),
        }
    }

    /// A quantity over any scalar that carries first derivatives at most.
    pub(super) fn value<S: Scalar>(&self, quantity: &FlowQuantity, shape: Posed<'_, S>) -> Result<S, DesignError> {
        if S::NDERIV > 1 {
            return Err(DesignError::FlowSecondOrder { name: quantity.name() });
        }
        taylor(shape, |real, slope| self.value_and_slope(quantity, real, 1.0, slope))
    }

    /// A quantity; adds `factor` times its derivatives to `slope` where they are wanted.
    pub(super) fn value_and_slope(
        &self,
        quantity: &FlowQuantity,
        shape: Posed<'_>,
        factor: f64,
        slope: &mut PosedSlope<'_>,
    ) -> Result<f64, DesignError> {
        let flows = self.flows(shape);
        if slope.is_wanted() {
            self.differentiate(&flows);
        }
        let mut by_node = vec![[0.0; 2]; if slope.is_wanted() { flows.nodes.len() } else { 0 }];
        let mut sum = 0.0;
        for (point, share) in self.shares(quantity) {
            let solution = flows.solutions[point].as_ref().map_err(DesignError::clone)?;
            let output = quantity.output.of_solution(solution);
            sum += share * output.re;
            if !slope.is_wanted() {
                continue;
            }
            let gradients = flows.gradients[point].get().and_then(Option::as_ref);
            let gradients = gradients.ok_or_else(|| DesignError::NotFinite { name: quantity.name() })?;
            let numbers = gradients.coefficients.iter().chain([&gradients.alpha, &gradients.cd_wave]);
            let by_number = output.eps.unwrap_generic(nalgebra::Const::<NUMBERS>, nalgebra::U1);
            for (gradient, by_number) in numbers.zip(&by_number).filter(|(_, by_number)| **by_number != 0.0) {
                let weight = factor * share * by_number;
                for (sum, own) in by_node.iter_mut().zip(&gradient.nodes) {
                    sum[0] += weight * own[0];
                    sum[1] += weight * own[1];
                }
                if let Some(angle) = self.points[point].angle {
                    slope.angles[angle] += weight * gradient.alpha;
                }
            }
        }
        if slope.is_wanted() {
            self.map.add_transposed_to(&by_node, slope.points);
        }
        Ok(sum)
    }

    /// Derivatives of all points that have a flow.
    fn differentiate(&self, flows: &Flows) {
        if flows.gradients.iter().all(|g| g.get().is_some()) {
            return;
        }
        let begin = Instant::now();
        let found = in_parallel(&flows.solutions, |solution| solution.as_ref().ok()?.held_gradients());
        let count = found.iter().flatten().count();
        for (place, gradients) in flows.gradients.iter().zip(found) {
            place.get_or_init(|| gradients);
        }
        self.book(|timing| {
            timing.gradients += count;
            timing.gradient_seconds += begin.elapsed().as_secs_f64();
        });
    }
}

/// A function of a shape over any scalar that carries first derivatives at most, from its value and slope: by Taylor's
/// formula, which is exact for what the scalar carries.
fn taylor<S: Scalar>(
    shape: Posed<'_, S>,
    with_slope: impl FnOnce(Posed<'_>, &mut PosedSlope<'_>) -> Result<f64, DesignError>,
) -> Result<S, DesignError> {
    let points: Vec<[f64; 2]> = shape.points.iter().map(|p| p.map(|c| c.re())).collect();
    let angles: Vec<f64> = shape.angles.iter().map(S::re).collect();
    let mut by_point = vec![[0.0; 2]; if S::NDERIV > 0 { points.len() } else { 0 }];
    let mut by_angle = vec![0.0; angles.len()];
    let mut slope = PosedSlope { points: &mut by_point, angles: &mut by_angle };
    let mut value = S::from(with_slope(Posed { points: &points, angles: &angles }, &mut slope)?);
    let numbers = shape.points.as_flattened().iter().chain(shape.angles);
    let slopes = by_point.as_flattened().iter().chain(&by_angle);
    if S::NDERIV > 0 {
        for (number, slope) in numbers.zip(slopes) {
            value += (*number - number.re()) * *slope;
        }
    }
    Ok(value)
}

/// `of` every item, in order, on as many threads as there are processors.
fn in_parallel<T: Sync, R: Send>(items: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    in_parallel_with(processors(), items, || (), |(), item| of(item))
}
