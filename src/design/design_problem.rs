//! [`DesignProblem`]: geometry, quantities, objective and constraints joined into what an optimiser sees.

mod as_problem;
mod foreknown;
mod second_order;
mod workspace;

use super::flow_analysis::{FlowAnalysis, FlowTiming, OperatingPoint};
use super::geometry::Geometry;
use super::linearised::LinearisedShape;
use super::problem::ValueAndGradient;
use super::quantity::{Instruments, Quantity, finite};
use super::shape::Shape;
use super::{Bounds, DesignError, Evaluation, ProblemDescription, ShapeError, ShapeNorm, TargetDistance};
use crate::ffd::FoldReport;
use crate::flow::{FlowSection, Solution};
use crate::scalar::Scalar;
use crate::section::{Measure, Section};
use nalgebra::DMatrix;
use num_dual::Dual64;
use std::sync::Arc;
use workspace::Workspace;

/// A constraint: a quantity within bounds.
#[derive(Debug, Clone, PartialEq)]
pub struct Constraint {
    /// The quantity that is constrained.
    pub quantity: Quantity,
    /// Bounds of the quantity.
    pub bounds: Bounds,
}

/// The flows about one shape.
#[derive(Debug, Clone)]
pub struct ShapeFlows {
    /// The panel nodes, from the trailing edge over the upper surface and back.
    pub nodes: Vec<[f64; 2]>,
    /// One solution per operating point, or why there is none.
    pub solutions: Vec<Result<Solution, DesignError>>,
}

/// A design problem over a geometry.
///
/// Built from a case file by `Case` of the module [`case`](crate::case). As a [`Problem`](super::Problem) it works in
/// scaled variables; the methods here take variables in their own units.
#[derive(Debug, Clone)]
pub struct DesignProblem {
    geometry: Geometry,
    target: Option<Section<f64>>,
    instruments: Instruments,
    /// Every quantity once: those of the objective, of the constraints, and further ones to report.
    quantities: Vec<Quantity>,
    /// Weight of each quantity in the objective.
    weights: Vec<f64>,
    /// Position of each constraint's quantity.
    constraints: Vec<usize>,
    description: ProblemDescription,
    /// Tangents of a linear geometry, which do not change.
    tangents: Option<Arc<LinearisedShape>>,
    /// Hessian of the shape error of a linear geometry, in the variables' own units.
    error_hessian: Option<DMatrix<f64>>,
    work: Workspace,
}

/// How the derivatives of a quantity are found.
enum Contribution {
    /// By slopes, which have been added to the workspace; this is the value.
    Slopes(f64),
    /// By carrying the tangents through the measure.
    Measure(Measure),
    /// By the gradient of the quantity that it limits.
    Soft,
}

impl DesignProblem {
    pub(crate) fn new(
        geometry: Geometry,
        target: Option<Section<f64>>,
        instruments: Instruments,
        objective: &[(Quantity, f64)],
        constraints: &[Constraint],
        report: &[Quantity],
    ) -> Result<Self, DesignError> {
        let mut quantities: Vec<Quantity> = Vec::new();
        let mut position = |quantity: &Quantity| {
            quantities.iter().position(|other| other == quantity).unwrap_or_else(|| {
                quantities.push(quantity.clone());
                quantities.len() - 1
            })
        };
        let terms: Vec<(usize, f64)> = objective.iter().map(|(q, weight)| (position(q), *weight)).collect();
        let constrained: Vec<usize> = constraints.iter().map(|c| position(&c.quantity)).collect();
        for quantity in report {
            position(quantity);
        }
        let mut weights = vec![0.0; quantities.len()];
        terms.into_iter().for_each(|(q, weight)| weights[q] += weight);
        let variables = geometry.variables();
        if variables.is_empty() {
            return Err(DesignError::NothingFree);
        }
        let scaled = |b: Bounds, scale: f64| Bounds { lower: b.lower / scale, upper: b.upper / scale };
        let mut problem = Self {
            constraints: constrained,
            description: ProblemDescription {
                variable_names: variables.iter().map(|v| v.name.clone()).collect(),
                start: variables.iter().map(|v| v.start / v.scale).collect(),
                variable_bounds: variables.iter().map(|v| scaled(v.bounds, v.scale)).collect(),
                constraint_names: constraints.iter().map(|c| c.quantity.name()).collect(),
                constraint_bounds: constraints.iter().map(|c| c.bounds).collect(),
                value_names: quantities.iter().map(Quantity::name).collect(),
            },
            tangents: None,
            error_hessian: None,
            work: Workspace::default(),
            weights,
            quantities,
            target,
            instruments,
            geometry,
        };
        if problem.geometry.is_linear() {
            problem.tangents = Some(Arc::new(problem.geometry.linearise(&problem.start_values())?));
        }
        Ok(problem)
    }

    /// Section, box and variables.
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The target, where there is one.
    pub fn target(&self) -> Option<&Section<f64>> {
        self.target.as_ref()
    }

    /// How far a shape is from the target, whatever norm `shape_error` has; `None` without a target.
    pub fn target_distance(&self, shape: &Shape) -> Option<TargetDistance> {
        let start = self.geometry.section().curve();
        let error = ShapeError::new(ShapeNorm::Closest, self.target.as_ref()?.curve(), start).ok()?;
        error.distances(shape.section.curve().control_points())
    }

    /// Every quantity of objective, constraints and report, once.
    pub fn quantities(&self) -> &[Quantity] {
        &self.quantities
    }

    /// Weight of each quantity in the objective; zero for those not in it.
    pub fn objective_weights(&self) -> &[f64] {
        &self.weights
    }

    /// Start of the variables in their own units.
    pub fn start_values(&self) -> Vec<f64> {
        self.geometry.variables().iter().map(|v| v.start).collect()
    }

    /// A natural size of change of each variable, in its own unit.
    pub fn steps(&self) -> Vec<f64> {
        self.geometry.variables().iter().map(|v| v.step).collect()
    }

    /// Variables in their own units from scaled ones.
    pub fn unscaled(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(self.geometry.variables()).map(|(x, v)| x * v.scale).collect()
    }

    /// Scaled variables from those in their own units.
    pub fn scaled(&self, values: &[f64]) -> Vec<f64> {
        values.iter().zip(self.geometry.variables()).map(|(value, v)| value / v.scale).collect()
    }

    /// The shape at given variables.
    ///
    /// # Errors
    /// A section that cannot be built or that leaves the box.
    pub fn shape(&self, values: &[f64]) -> Result<Shape, DesignError> {
        self.geometry.shape(values)
    }

    /// Indicator and fold of the box of a shape; `None` without a box.
    pub fn fold_report(&self, shape: &Shape) -> Option<FoldReport> {
        self.instruments.penalty.as_ref().map(|p| p.report(&shape.net))
    }

    /// Whether objective or constraints are made of a quantity, given its position in
    /// [`quantities`](Self::quantities). The others are only reported: one of them that has no value at some shape
    /// fails nothing there.
    pub fn is_used(&self, quantity: usize) -> bool {
        self.weights[quantity] != 0.0 || self.constraints.contains(&quantity)
    }

    /// All quantities over any scalar, through the whole pipeline; NaN for one that is only reported and has no value.
    ///
    /// This is the plain route: whatever the structured gradients of [`gradients`](Self::gradients) shortcut,
    /// duals carried through this function must reproduce.
    ///
    /// # Errors
    /// A shape that cannot be built, or a quantity of objective or constraints that has no value.
    pub fn quantities_at<S: Scalar>(&self, values: &[S]) -> Result<Vec<S>, DesignError> {
        let shape = self.geometry.shape(values)?;
        let value = |q: usize| match self.instruments.value(&self.quantities[q], &shape) {
            Err(_) if !self.is_used(q) => Ok(S::from(f64::NAN)),
            result => result,
        };
        (0..self.quantities.len()).map(value).collect()
    }

    /// A copy whose flows start from those about the design with the given variables (their own units): flows about designs
    /// close to that one are found sooner. The flows are equal within the tolerance of the solver.
    ///
    /// # Errors
    /// A shape that cannot be built.
    pub fn near(&self, values: &[f64]) -> Result<Self, DesignError> {
        let mut near = self.clone();
        if let Some(flow) = &self.instruments.flow {
            near.instruments.flow = Some(flow.near(Some(&self.geometry.shape(values)?)));
        }
        Ok(near)
    }

    /// Every quantity on its own at given variables (their own units), or why it has no value there, as those of a flow
    /// that cannot be solved.
    pub fn values_at(&self, values: &[f64]) -> Vec<Result<f64, DesignError>> {
        let shape = self.geometry.shape(values);
        let value = |q: &Quantity| self.instruments.value(q, shape.as_ref().map_err(Clone::clone)?);
        self.quantities.iter().map(value).collect()
    }

    /// The first quantity of objective and constraints, those of the flow aside, that lacks a value or a derivative at
    /// the start: its position, and the reason.
    ///
    /// # Errors
    /// A start that has no shape.
    pub(crate) fn lacking_at_start(&self) -> Result<Option<(usize, DesignError)>, DesignError> {
        let shape = self.geometry.shape(&self.start_values())?;
        let control_points = shape.section.curve().control_points();
        let lifted: Vec<[Dual64; 2]> = control_points.iter().map(|p| p.map(Dual64::from)).collect();
        let section = shape.section.with_control_points(lifted)?;
        let lacks = |q: usize| match &self.quantities[q] {
            quantity if quantity.needs_flow() => None,
            Quantity::Measure(measure) => measure.evaluate(&section).err().map(DesignError::from),
            plain => self.instruments.value(plain, &shape).err(),
        };
        let mut used = (0..self.quantities.len()).filter(|&q| self.is_used(q));
        Ok(used.find_map(|q| Some((q, lacks(q)?))))
    }

    /// Value and gradient of each quantity, in the variables' own units; `None` for one that is only reported and has
    /// no value or no gradient.
    ///
    /// # Errors
    /// A shape that cannot be built, or a quantity of objective or constraints that has no value.
    pub fn gradients(&mut self, values: &[f64]) -> Result<Vec<Option<ValueAndGradient>>, DesignError> {
        self.work.values.clear();
        self.work.values.extend_from_slice(values);
        let tangents = self.prepare()?;
        let mut all = Vec::with_capacity(self.quantities.len());
        for q in 0..self.quantities.len() {
            all.push(match self.quantity_gradient(q, &tangents) {
                Err(_) if !self.is_used(q) => None,
                result => Some(result?),
            });
        }
        Ok(all)
    }

    /// The objective alone, in scaled variables: what a line search without gradients would pay.
    ///
    /// # Errors
    /// A shape or quantity that has no value.
    pub fn objective(&mut self, x: &[f64]) -> Result<f64, DesignError> {
        self.set_scaled(x);
        if self.tangents.is_some() {
            self.deform_in_place();
            if let Some(value) = self.objective_in_place()? {
                return Ok(value);
            }
        }
        let shape = self.geometry.shape(&self.work.values)?;
        let terms = self.quantities.iter().zip(&self.weights).filter(|(_, weight)| **weight != 0.0);
        terms.map(|(quantity, weight)| Ok(weight * self.instruments.value(quantity, &shape)?)).sum()
    }

    /// The objective at the deformed workspace; `None` where it needs more than the control points.
    fn objective_in_place(&self) -> Result<Option<f64>, DesignError> {
        let mut sum = 0.0;
        for (quantity, weight) in self.quantities.iter().zip(&self.weights).filter(|(_, w)| **w != 0.0) {
            let value = match quantity {
                Quantity::ShapeError => self.instruments.error()?.value(&self.work.points),
                Quantity::FoldPenalty => self.instruments.penalty()?.value(&self.work.net),
                _ => return Ok(None),
            };
            finite(quantity, value)?;
            sum += weight * value;
        }
        Ok(Some(sum))
    }

    /// The operating points, where there is a flow.
    pub fn operating_points(&self) -> &[OperatingPoint] {
        self.instruments.flow.as_ref().map_or(&[], FlowAnalysis::points)
    }

    /// The flows about a shape, one per operating point, with the panel nodes they were found on; `None` without flow.
    pub fn flows(&self, shape: &Shape) -> Option<ShapeFlows> {
        let flow = self.instruments.flow.as_ref()?;
        let nodes = flow.nodes(shape.section.curve().control_points());
        Some(ShapeFlows { nodes, solutions: flow.solutions(shape) })
    }

    /// The section of a shape, prepared for the flow solver of the problem to be analysed at any operating point;
    /// `None` without flow.
    ///
    /// # Errors
    /// A shape that the solver cannot take.
    pub fn prepared_flow(&self, shape: &Shape) -> Option<Result<Box<dyn FlowSection>, DesignError>> {
        Some(self.instruments.flow.as_ref()?.prepared(shape))
    }

    /// Name of the flow solver; `None` without flow.
    pub fn flow_solver(&self) -> Option<&'static str> {
        self.instruments.flow.as_ref().map(FlowAnalysis::solver)
    }

    /// Number of flows so far and the time they took.
    pub fn flow_timing(&self) -> FlowTiming {
        self.instruments.flow.as_ref().map_or_else(FlowTiming::default, FlowAnalysis::timing)
    }

    fn set_scaled(&mut self, x: &[f64]) {
        self.work.values.clear();
        self.work.values.extend(x.iter().zip(self.geometry.variables()).map(|(x, v)| x * v.scale));
    }

    fn deform_in_place(&mut self) {
        let work = &mut self.work;
        self.geometry.deform(self.geometry.initial_frame(), &work.values, &mut work.net, &mut work.points);
        work.angles = self.geometry.angles(&work.values);
    }

    /// Deforms the workspace to its variables and gives the tangents there.
    ///
    /// The tangents of a linear geometry are equal at every shape, whichever they were taken at.
    fn prepare(&mut self) -> Result<Arc<LinearisedShape>, DesignError> {
        if let Some(tangents) = &self.tangents {
            let tangents = Arc::clone(tangents);
            self.deform_in_place();
            return Ok(tangents);
        }
        let linearised = self.geometry.linearise(&self.work.values)?;
        self.work.net.clone_from(&linearised.shape.net);
        self.work.points.clear();
        self.work.points.extend_from_slice(linearised.shape.section.curve().control_points());
        self.work.angles.clone_from(&linearised.shape.angles);
        Ok(Arc::new(linearised))
    }

    fn clear_slopes(&mut self) {
        for (slope, len) in
            [(&mut self.work.net_slope, self.work.net.len()), (&mut self.work.point_slope, self.work.points.len())]
        {
            slope.clear();
            slope.resize(len, [0.0; 2]);
        }
        self.work.angle_slope.clear();
        self.work.angle_slope.resize(self.work.angles.len(), 0.0);
    }

    /// Adds a quantity's slopes times `factor` to the workspace, unless it is a measure.
    fn add_slopes(&mut self, quantity: &Quantity, factor: f64) -> Result<Contribution, DesignError> {
        let work = &mut self.work;
        let value = match quantity {
            Quantity::ShapeError => {
                self.instruments.error()?.value_and_gradient(&work.points, factor, &mut work.point_slope)
            }
            Quantity::FoldPenalty => {
                self.instruments.penalty()?.value_and_gradient(&work.net, factor, &mut work.net_slope)
            }
            Quantity::FoldIndicator { index, .. } => {
                self.instruments.penalty()?.indicator_and_gradient(*index, &work.net, factor, &mut work.net_slope)
            }
            Quantity::Flow(flow) => {
                let (shape, mut slope) = work.posed();
                self.instruments.flow()?.value_and_slope(flow, shape, factor, &mut slope)?
            }
            Quantity::PressureError => {
                let (shape, mut slope) = work.posed();
                self.instruments.pressures()?.pressure_error_and_slope(shape, factor, &mut slope)?
            }
            Quantity::Measure(measure) => return Ok(Contribution::Measure(*measure)),
            Quantity::Soft { .. } => return Ok(Contribution::Soft),
        };
        finite(quantity, value)?;
        Ok(Contribution::Slopes(value))
    }

    /// Carries the slopes in the workspace back to the variables.
    fn pull_back(&mut self, tangents: &LinearisedShape) -> Vec<f64> {
        tangents.pull_back(&self.work.point_slope, &mut self.work.net_slope, &self.work.angle_slope)
    }

    /// A measure with its gradient, by chunks of tangents.
    fn measure_gradient(&self, measure: &Measure, tangents: &LinearisedShape) -> Result<(f64, Vec<f64>), DesignError> {
        let section = self.geometry.section().with_control_points(self.work.points.clone())?;
        self.instruments.measure_gradient(measure, &section, tangents)
    }

    fn quantity_gradient(
        &mut self,
        quantity: usize,
        tangents: &LinearisedShape,
    ) -> Result<(f64, Vec<f64>), DesignError> {
        let quantity = self.quantities[quantity].clone();
        self.gradient_of(&quantity, tangents)
    }

    fn gradient_of(&mut self, quantity: &Quantity, tangents: &LinearisedShape) -> Result<(f64, Vec<f64>), DesignError> {
        if let Quantity::Soft { quantity, limit } = quantity {
            let (value, mut gradient) = self.gradient_of(quantity, tangents)?;
            let (square, slope) = limit.square_and_slope(value);
            gradient.iter_mut().for_each(|g| *g *= slope);
            return Ok((square, gradient));
        }
        self.clear_slopes();
        match self.add_slopes(quantity, 1.0)? {
            Contribution::Slopes(value) => Ok((value, self.pull_back(tangents))),
            Contribution::Measure(measure) => self.measure_gradient(&measure, tangents),
            // taken above
            Contribution::Soft => Err(DesignError::NotFinite { name: quantity.name() }),
        }
    }

    fn try_evaluate(&mut self, x: &[f64]) -> Result<Evaluation, DesignError> {
        self.set_scaled(x);
        let tangents = self.prepare()?;
        let mut values = vec![0.0; self.quantities.len()];
        // objective: all slopes are carried back together
        self.clear_slopes();
        let (mut measures, mut soft) = (Vec::new(), Vec::new());
        for q in 0..self.quantities.len() {
            let weight = self.weights[q];
            if weight != 0.0 {
                let quantity = self.quantities[q].clone();
                match self.add_slopes(&quantity, weight)? {
                    Contribution::Slopes(value) => values[q] = value,
                    Contribution::Measure(measure) => measures.push((q, measure)),
                    Contribution::Soft => soft.push(q),
                }
            }
        }
        let mut gradient = self.pull_back(&tangents);
        for (q, measure) in measures {
            let (value, slope) = self.measure_gradient(&measure, &tangents)?;
            values[q] = value;
            gradient.iter_mut().zip(slope).for_each(|(g, s)| *g += self.weights[q] * s);
        }
        for q in soft {
            let (value, slope) = self.quantity_gradient(q, &tangents)?;
            values[q] = value;
            gradient.iter_mut().zip(slope).for_each(|(g, s)| *g += self.weights[q] * s);
        }
        let mut jacobian = Vec::with_capacity(self.constraints.len());
        for index in 0..self.constraints.len() {
            let q = self.constraints[index];
            let (value, slope) = self.quantity_gradient(q, &tangents)?;
            values[q] = value;
            jacobian.push(slope);
        }
        self.fill_reported(&mut values)?;
        for row in jacobian.iter_mut().chain(std::iter::once(&mut gradient)) {
            row.iter_mut().zip(self.geometry.variables()).for_each(|(g, v)| *g *= v.scale);
        }
        Ok(Evaluation {
            objective: weighted_sum(&values, &self.weights),
            gradient,
            constraints: self.constraints.iter().map(|&q| values[q]).collect(),
            jacobian,
            values,
        })
    }

    /// Quantities that are only reported: NaN where one has no value, which must not fail what the optimiser needs.
    fn fill_reported(&self, values: &mut [f64]) -> Result<(), DesignError> {
        let reported: Vec<usize> = (0..self.quantities.len()).filter(|&q| !self.is_used(q)).collect();
        if reported.is_empty() {
            return Ok(());
        }
        let section = self.geometry.section().with_control_points(self.work.points.clone())?;
        let shape = Shape { section, net: self.work.net.clone(), angles: self.work.angles.clone() };
        for q in reported {
            values[q] = self.instruments.value(&self.quantities[q], &shape).unwrap_or(f64::NAN);
        }
        Ok(())
    }
}

/// The objective: the sum of the values that have a weight, so that those without one may be NaN.
pub(crate) fn weighted_sum(values: &[f64], weights: &[f64]) -> f64 {
    values.iter().zip(weights).filter(|(_, weight)| **weight != 0.0).map(|(value, weight)| value * weight).sum()
}
