//! The flow about a shape at the operating points of a problem, with exact derivatives in the shape.

use super::DesignError;
use super::geometry::Shape;
use crate::ffd::LinearMap;
use crate::flow::{Condition, PanelledSection, Settings, Solution, panel_parameters};
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
    /// Flow conditions; at a fixed lift coefficient the angle of attack follows the shape.
    pub condition: Condition,
}

/// A number that is read off a flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlowOutput {
    /// Lift coefficient.
    Lift,
    /// Drag coefficient.
    Drag,
    /// Moment coefficient about the quarter chord, nose-up positive.
    Moment,
    /// Lift over drag.
    LiftToDrag,
    /// Lowest pressure coefficient. Continuous only where two suction peaks tie.
    LowestPressure,
    /// Angle of attack in degrees: an outcome where the lift is held.
    Alpha,
    /// Transition on the upper side, x in chords.
    TransitionUpper,
    /// Transition on the lower side, x in chords.
    TransitionLower,
}

/// Numbers of a solution that outputs are made of, in the order of [`base_values`].
const BASE: usize = 7;
type BaseDual = DualSVec64<8>;

impl FlowOutput {
    const ALL: [Self; 8] = [
        Self::Lift,
        Self::Drag,
        Self::Moment,
        Self::LiftToDrag,
        Self::LowestPressure,
        Self::Alpha,
        Self::TransitionUpper,
        Self::TransitionLower,
    ];

    /// The names in case files.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::ALL.into_iter().map(Self::name)
    }

    /// The output of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|output| output.name() == name)
    }

    /// The name of the output in case files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lift => "cl",
            Self::Drag => "cd",
            Self::Moment => "cm",
            Self::LiftToDrag => "cl/cd",
            Self::LowestPressure => "cp_min",
            Self::Alpha => "alpha",
            Self::TransitionUpper => "transition_upper",
            Self::TransitionLower => "transition_lower",
        }
    }

    fn of<S: Scalar>(self, base: &[S; BASE]) -> S {
        let [cl, cd, cm, cp_min, upper, lower, alpha] = *base;
        match self {
            Self::Lift => cl,
            Self::Drag => cd,
            Self::Moment => cm,
            Self::LiftToDrag => cl / cd,
            Self::LowestPressure => cp_min,
            Self::Alpha => alpha * 1f64.to_degrees(),
            Self::TransitionUpper => upper,
            Self::TransitionLower => lower,
        }
    }
}

fn base_values(solution: &Solution) -> [f64; BASE] {
    let [cl, cd, cm, cp_min, upper, lower] = solution.coefficients.to_array();
    [cl, cd, cm, cp_min, upper, lower, solution.alpha]
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
    solutions: Vec<Result<Solution, DesignError>>,
    gradients: Vec<OnceLock<Option<PointGradients>>>,
}

/// Derivatives of the numbers of [`base_values`] with respect to the nodes.
type PointGradients = [Vec<[f64; 2]>; BASE];

/// Panels at fixed parameters of the section and the points at which their flow is wanted.
///
/// Every flow starts from nothing but its shape, so that a value never depends on what was asked before: a resumed run
/// continues bit for bit. The flows of the latest shape are kept for all quantities to share.
#[derive(Debug)]
pub(crate) struct FlowAnalysis {
    points: Vec<OperatingPoint>,
    settings: Settings,
    edge: crate::section::TrailingEdge,
    /// Control points of the section → panel nodes.
    map: LinearMap,
    /// Flows of the latest shape. The lock is held to read or replace them, never while a flow is solved.
    latest: Mutex<Option<Arc<Flows>>>,
    /// Where flows start from, if not from nothing.
    start: Option<Arc<Flows>>,
    timing: Arc<Mutex<FlowTiming>>,
}

impl Clone for FlowAnalysis {
    /// A copy with a memory and a clock of its own, so that clones never wait for each other.
    fn clone(&self) -> Self {
        Self {
            points: self.points.clone(),
            settings: self.settings,
            edge: self.edge,
            map: self.map.clone(),
            latest: Mutex::new(self.latest().clone()),
            start: self.start.clone(),
            timing: Arc::new(Mutex::new(self.timing())),
        }
    }
}

impl FlowAnalysis {
    /// Panels chosen on the undeformed `section`; weights are scaled to add up to one.
    pub fn new(section: &Section<f64>, mut points: Vec<OperatingPoint>, panels: usize, settings: Settings) -> Self {
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
        Self {
            points,
            settings,
            edge: section.trailing_edge(),
            map,
            latest: Mutex::default(),
            start: None,
            timing: Arc::default(),
        }
    }

    pub fn points(&self) -> &[OperatingPoint] {
        &self.points
    }

    pub fn timing(&self) -> FlowTiming {
        *self.timing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A copy whose flows start from those about `base`, and whose time counts as that of the original.
    pub fn near(&self, base: Option<&Shape<f64>>) -> Self {
        let start = base.map(|shape| self.flows(self.nodes(shape.section.curve().control_points())));
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
        self.flows(self.nodes(shape.section.curve().control_points())).solutions.clone()
    }

    /// The flows about the section through `nodes`, from memory where they are those of the latest call.
    fn flows(&self, nodes: Vec<[f64; 2]>) -> Arc<Flows> {
        let known = self.latest().clone().filter(|f| f.nodes == nodes);
        if let Some(flows) = known {
            return flows;
        }
        let solutions = match PanelledSection::new(&nodes, self.edge) {
            Ok(section) => self.solve(&section),
            Err(error) => self.points.iter().map(|_| Err(error.clone().into())).collect(),
        };
        let gradients = solutions.iter().map(|_| OnceLock::new()).collect();
        let flows = Arc::new(Flows { nodes, solutions, gradients });
        *self.latest() = Some(Arc::clone(&flows));
        flows
    }

    fn latest(&self) -> MutexGuard<'_, Option<Arc<Flows>>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All points at once, on as many threads as there are processors.
    fn solve(&self, section: &PanelledSection) -> Vec<Result<Solution, DesignError>> {
        let begin = Instant::now();
        let indices: Vec<usize> = (0..self.points.len()).collect();
        let one = |&index: &usize| -> Result<Solution, DesignError> {
            let point = &self.points[index];
            let start = self.start.as_ref().and_then(|flows| flows.solutions[index].as_ref().ok());
            let solution = section.analyze(&point.condition, &self.settings, start)?;
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
    pub fn value<S: Scalar>(&self, quantity: &FlowQuantity, control_points: &[[S; 2]]) -> Result<S, DesignError> {
        if S::NDERIV > 1 {
            return Err(DesignError::FlowSecondOrder { name: quantity.name() });
        }
        let real: Vec<[f64; 2]> = control_points.iter().map(|p| p.map(|c| c.re())).collect();
        let mut slope = vec![[0.0; 2]; if S::NDERIV > 0 { real.len() } else { 0 }];
        let mut value = S::from(self.value_and_slope(quantity, &real, 1.0, &mut slope)?);
        // Taylor's formula, exact for what the scalar carries
        for ((point, at), slope) in control_points.iter().zip(&real).zip(&slope) {
            for d in 0..2 {
                value += (point[d] - at[d]) * slope[d];
            }
        }
        Ok(value)
    }

    /// A quantity; adds `factor` times its derivatives with respect to the control points to `slope`, unless that is
    /// empty.
    pub fn value_and_slope(
        &self,
        quantity: &FlowQuantity,
        control_points: &[[f64; 2]],
        factor: f64,
        slope: &mut [[f64; 2]],
    ) -> Result<f64, DesignError> {
        let flows = self.flows(self.nodes(control_points));
        if !slope.is_empty() {
            self.differentiate(&flows);
        }
        let mut by_node = vec![[0.0; 2]; if slope.is_empty() { 0 } else { flows.nodes.len() }];
        let mut sum = 0.0;
        for (point, share) in self.shares(quantity) {
            let solution = flows.solutions[point].as_ref().map_err(DesignError::clone)?;
            let base = base_values(solution);
            let seeded = std::array::from_fn(|k| BaseDual::from_re(base[k]).derivative(k));
            let output = quantity.output.of(&seeded);
            sum += share * output.re;
            if slope.is_empty() {
                continue;
            }
            let gradients = flows.gradients[point].get().and_then(Option::as_ref);
            let gradients = gradients.ok_or_else(|| DesignError::NotFinite { name: quantity.name() })?;
            let Some(by_base) = output.eps.0 else { continue };
            for (k, gradient) in gradients.iter().enumerate().filter(|(k, _)| by_base[*k] != 0.0) {
                let weight = factor * share * by_base[k];
                for (sum, own) in by_node.iter_mut().zip(gradient) {
                    sum[0] += weight * own[0];
                    sum[1] += weight * own[1];
                }
            }
        }
        if !slope.is_empty() {
            self.map.add_transposed_to(&by_node, slope);
        }
        Ok(sum)
    }

    /// Derivatives of all points that have a flow.
    fn differentiate(&self, flows: &Flows) {
        if flows.gradients.iter().all(|g| g.get().is_some()) {
            return;
        }
        let begin = Instant::now();
        let found = in_parallel(&flows.solutions, |solution| solution.as_ref().ok().and_then(point_gradients));
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

/// Derivatives of one solution with what its condition holds held: the angle of attack, or the lift.
fn point_gradients(solution: &Solution) -> Option<PointGradients> {
    let held = solution.held_gradients()?;
    let [cl, cd, cm, cp_min, upper, lower] = held.coefficients.map(|d| d.nodes).to_array();
    Some([cl, cd, cm, cp_min, upper, lower, held.alpha.nodes])
}

/// `of` every item, in order, on as many threads as there are processors.
fn in_parallel<T: Sync, R: Send>(items: &[T], of: impl Fn(&T) -> R + Sync) -> Vec<R> {
    in_parallel_with(items, || (), |(), item| of(item))
}

/// Applies `of` to every item like [`in_parallel`], with a worker that each thread makes for itself first.
pub(super) fn in_parallel_with<T: Sync, R: Send, W>(
    items: &[T],
    make: impl Fn() -> W + Sync,
    of: impl Fn(&mut W, &T) -> R + Sync,
) -> Vec<R> {
    let threads = std::thread::available_parallelism().map_or(1, |n| n.get()).min(items.len());
    if threads < 2 {
        let mut worker = make();
        return items.iter().map(|item| of(&mut worker, item)).collect();
    }
    let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let next = Mutex::new(items.iter().zip(&mut results));
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let mut worker = make();
                loop {
                    let job = next.lock().unwrap_or_else(PoisonError::into_inner).next();
                    let Some((item, place)) = job else { break };
                    *place = Some(of(&mut worker, item));
                }
            });
        }
    });
    // every place has been filled: the threads end when there is none left
    results.into_iter().flatten().collect()
}
