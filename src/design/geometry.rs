//! From design variables to the deformed section: one pipeline, generic over the scalar.

use super::linearised::{LinearisedShape, Tangent};
use super::motion::{Axis, BoxMotion};
use super::shape::Shape;
use super::{Bounds, DesignError};
use crate::differentiate::{self, VectorFunction};
use crate::ffd::{FfdBox, LinearMap};
use crate::scalar::Scalar;
use crate::section::{Section, SectionDefinition};
use std::collections::BTreeMap;

/// The kind of deformation between the undeformed section and the deformed one.
#[derive(Debug, Clone, PartialEq)]
pub enum Deformation {
    /// Nothing: the section moves with its parameters only.
    None,
    /// A free-form deformation box around the section (paper, Section IV).
    Box(FfdBox<f64>),
    /// The control points of the section themselves (paper, Section III; for comparison).
    Direct,
}

/// A design variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Unique name: `dx[column,row]`, `dy[column,row]`, the name of a section parameter, or `alpha` and
    /// `alpha_at(point)` for the angle of attack of an operating point.
    pub name: String,
    /// Value at the start, in the unit of the variable (chords, degrees for angles of attack; displacements are zero where
    /// nothing else is said).
    pub start: f64,
    /// Step of the variable that the optimiser sees as one.
    pub scale: f64,
    /// Bounds in the unit of the variable.
    pub bounds: Bounds,
    /// A natural size of change, for choosing finite-difference steps.
    pub step: f64,
    /// The thing that the variable moves.
    pub(crate) kind: VariableKind,
}

/// The thing that a variable moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VariableKind {
    /// Parameter of the section definition, by position.
    Parameter(usize),
    /// Variable of the box motion, by position.
    Motion(usize),
    /// Angle of attack of an operating point; its unit is the degree.
    Angle,
}

/// Section, box and variables of a design problem.
#[derive(Debug, Clone)]
pub struct Geometry {
    definition: SectionDefinition,
    /// All parameters of the definition at the start.
    parameters: Vec<f64>,
    deformation: Deformation,
    motion: BoxMotion,
    /// Curve parameters of the pinned points.
    pins: Vec<f64>,
    variables: Vec<Variable>,
    /// Undeformed control net.
    net: Vec<[f64; 2]>,
    initial: Frame<f64>,
}

/// The undeformed section and the linear maps that deform it; constant unless section parameters are variables.
#[derive(Debug, Clone)]
pub(super) struct Frame<S> {
    pub section: Section<S>,
    /// Displacements of the net → displacements of the section's control points.
    pub weights: LinearMap<S>,
    /// Motion variables → displacement components of the net (2 × control point + axis).
    pub motion: LinearMap<S>,
}

impl Geometry {
    /// Embeds the section in its deformation.
    ///
    /// `motion` is made from the pinned points' weights, so that it is passed as a function of them.
    ///
    /// # Errors
    /// A section that cannot be built or is not inside the box, and those of `motion`.
    pub(crate) fn new(
        definition: SectionDefinition,
        parameters: Vec<f64>,
        deformation: Deformation,
        pins: impl FnOnce(&Section<f64>) -> Result<Vec<f64>, DesignError>,
        motion: impl FnOnce(&Section<f64>, &LinearMap) -> Result<BoxMotion, DesignError>,
    ) -> Result<Self, DesignError> {
        let section = definition.build(&parameters)?;
        let weights = weights(&deformation, &section)?;
        let pins = pins(&section)?;
        let rows = pin_rows(&section, &weights, &pins);
        let motion = motion(&section, &rows)?;
        let net = match &deformation {
            Deformation::None => Vec::new(),
            Deformation::Box(lattice) => lattice.control_points().to_vec(),
            Deformation::Direct => section.curve().control_points().to_vec(),
        };
        let initial = Frame { motion: motion.map(&rows), section, weights };
        Ok(Self { definition, parameters, deformation, motion, pins, variables: Vec::new(), net, initial })
    }

    /// Chooses the variables.
    pub(crate) fn set_variables(&mut self, variables: Vec<Variable>) {
        self.variables = variables;
    }

    /// The definition of the section.
    pub fn definition(&self) -> &SectionDefinition {
        &self.definition
    }

    /// All parameters of the definition at the start.
    pub(crate) fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The motion of the net.
    pub(crate) fn motion(&self) -> &BoxMotion {
        &self.motion
    }

    /// The variables: parameters of the section, then movements of the box, then angles of attack.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// The undeformed section at the start.
    pub fn section(&self) -> &Section<f64> {
        &self.initial.section
    }

    /// The box, where there is one.
    pub fn lattice(&self) -> Option<&FfdBox<f64>> {
        match &self.deformation {
            Deformation::Box(lattice) => Some(lattice),
            _ => None,
        }
    }

    /// Whether the shape is linear in the variables (no section parameter is one).
    pub fn is_linear(&self) -> bool {
        !self.variables.iter().any(|v| matches!(v.kind, VariableKind::Parameter(_)))
    }

    /// Number of variables of one kind.
    fn count(&self, of_kind: impl Fn(VariableKind) -> bool) -> usize {
        self.variables.iter().filter(|v| of_kind(v.kind)).count()
    }

    /// Number of section parameters among the variables, which come first.
    fn parameter_variables(&self) -> usize {
        self.count(|kind| matches!(kind, VariableKind::Parameter(_)))
    }

    /// Angles of attack among the variables (their own units), in radians.
    pub(super) fn angles<S: Scalar>(&self, values: &[S]) -> Vec<S> {
        let angles = self.count(|kind| kind == VariableKind::Angle);
        values[values.len() - angles..].iter().map(|degrees| *degrees * 1f64.to_radians()).collect()
    }

    /// The constant frame of a linear geometry.
    pub(super) fn initial_frame(&self) -> &Frame<f64> {
        &self.initial
    }

    /// The undeformed net.
    pub(crate) fn initial_net(&self) -> &[[f64; 2]] {
        &self.net
    }

    /// The frame at given variables (their own units).
    pub(super) fn frame<S: Scalar>(&self, values: &[S]) -> Result<Frame<S>, DesignError> {
        if self.is_linear() {
            let points = self.section().curve().control_points().iter().map(|p| p.map(S::from)).collect();
            return Ok(Frame {
                section: self.section().with_control_points(points)?,
                weights: self.initial.weights.lifted(),
                motion: self.initial.motion.lifted(),
            });
        }
        let mut parameters: Vec<S> = self.parameters.iter().map(|&p| S::from(p)).collect();
        for (variable, value) in self.variables.iter().zip(values) {
            if let VariableKind::Parameter(index) = variable.kind {
                parameters[index] = *value;
            }
        }
        let section = self.definition.build(&parameters)?;
        let weights = weights(&self.deformation, &section)?;
        let motion = self.motion.map(&pin_rows(&section, &weights, &self.pins));
        Ok(Frame { section, weights, motion })
    }

    /// Moves the net and the section's control points of a frame; both lists are overwritten.
    pub(super) fn deform<S: Scalar>(
        &self,
        frame: &Frame<S>,
        values: &[S],
        net: &mut Vec<[S; 2]>,
        control_points: &mut Vec<[S; 2]>,
    ) {
        net.clear();
        net.resize(self.net.len(), [S::from(0.0); 2]);
        let first = self.parameter_variables();
        for (row, displacement) in net.iter_mut().flatten().enumerate() {
            for (variable, weight) in frame.motion.row(row) {
                *displacement += values[first + variable] * weight;
            }
        }
        control_points.clear();
        control_points.extend_from_slice(frame.section.curve().control_points());
        frame.weights.add_to(net, control_points);
        for (moved, start) in net.iter_mut().zip(&self.net) {
            moved[0] += start[0];
            moved[1] += start[1];
        }
    }

    /// The shape at given variables (one each, in their own units), over any scalar.
    ///
    /// # Errors
    /// A section that cannot be built at these parameters, or that leaves the box.
    pub fn shape<S: Scalar>(&self, values: &[S]) -> Result<Shape<S>, DesignError> {
        let frame = self.frame(values)?;
        let (mut net, mut points) = (Vec::new(), Vec::new());
        self.deform(&frame, values, &mut net, &mut points);
        Ok(Shape { section: frame.section.with_control_points(points)?, net, angles: self.angles(values) })
    }

    /// The shape and its derivatives at given variables (their own units).
    ///
    /// Box variables act through the constant maps; parameters of the section by forward mode through its build, the
    /// embedding and the pins.
    ///
    /// # Errors
    /// As [`shape`](Self::shape).
    pub fn linearise(&self, values: &[f64]) -> Result<LinearisedShape, DesignError> {
        let computed;
        let frame = if self.is_linear() {
            &self.initial
        } else {
            computed = self.frame(values)?;
            &computed
        };
        let (mut net, mut points) = (Vec::new(), Vec::new());
        self.deform(frame, values, &mut net, &mut points);
        let angles = self.angles(values);
        let shape = Shape { section: frame.section.with_control_points(points)?, net, angles };
        Ok(LinearisedShape::new(shape, self.parameter_tangents(values)?, &frame.motion, &frame.weights))
    }

    /// Derivatives of section and net with respect to the section parameters among the variables.
    fn parameter_tangents(&self, values: &[f64]) -> Result<Vec<Tangent>, DesignError> {
        struct InParameters<'a>(&'a Geometry, &'a [f64]);
        impl VectorFunction for InParameters<'_> {
            type Error = DesignError;
            fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, DesignError> {
                let mut values: Vec<S> = self.1.iter().map(|&v| S::from(v)).collect();
                values[..x.len()].copy_from_slice(x);
                let shape = self.0.shape(&values)?;
                Ok(shape.section.curve().control_points().iter().chain(&shape.net).flatten().copied().collect())
            }
        }
        let count = self.parameter_variables();
        if count == 0 {
            return Ok(Vec::new());
        }
        let (_, jacobian) = differentiate::jacobian(&InParameters(self, values), &values[..count])?;
        let split = self.section().curve().control_points().len();
        let pairs = |column: usize, first: usize, last: usize| -> Vec<[f64; 2]> {
            (first..last).map(|i| [jacobian[(2 * i, column)], jacobian[(2 * i + 1, column)]]).collect()
        };
        let tangent = |k| Tangent { section: pairs(k, 0, split), net: pairs(k, split, split + self.net.len()) };
        Ok((0..count).map(tangent).collect())
    }

    /// Names, axes and start values of the motion variables and parameters, for building [`Variable`]s.
    pub(crate) fn motion_variables(&self) -> Vec<(String, Axis)> {
        self.motion.names().into_iter().zip(self.motion.axes()).collect()
    }
}

/// Displacements of the net → displacements of the section's control points.
fn weights<S: Scalar>(deformation: &Deformation, section: &Section<S>) -> Result<LinearMap<S>, DesignError> {
    let points = section.curve().control_points();
    match deformation {
        Deformation::None => {
            let mut map = LinearMap::new(0);
            points.iter().for_each(|_| map.end_row());
            Ok(map)
        }
        Deformation::Direct => {
            let mut map = LinearMap::new(points.len());
            for index in 0..points.len() {
                map.push(index, S::from(1.0));
                map.end_row();
            }
            Ok(map)
        }
        Deformation::Box(lattice) => {
            let net = lattice.control_points().iter().map(|p| p.map(S::from)).collect();
            Ok(lattice.with_control_points(net)?.embed(points)?.map().clone())
        }
    }
}

/// Displacements of the net → displacements of the pinned points of the curve.
fn pin_rows<S: Scalar>(section: &Section<S>, weights: &LinearMap<S>, pins: &[f64]) -> LinearMap<S> {
    let mut map = LinearMap::new(weights.inputs());
    let knots = section.curve().knots();
    for &u in pins {
        let span = knots.span(u);
        let mut row = BTreeMap::new();
        for (offset, basis) in knots.basis(span, u).into_iter().enumerate() {
            for (column, weight) in weights.row(span - knots.degree() + offset) {
                *row.entry(column).or_insert(S::from(0.0)) += weight * basis;
            }
        }
        for (column, weight) in row {
            map.push(column, weight);
        }
        map.end_row();
    }
    map
}
