//! The quantities that objectives and constraints are made of.

use super::flow_analysis::{FlowAnalysis, FlowQuantity};
use super::linearised::LinearisedShape;
use super::soft_limit::SoftLimit;
use super::{DesignError, ShapeError};
use crate::differentiate::{CHUNK, Direction};
use crate::ffd::BoxPenalty;
use crate::scalar::Scalar;
use crate::section::{Measure, Section};

use super::shape::Shape;

/// One quantity of a shape, with a name a case file can use.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// Distance to the target.
    ShapeError,
    /// Fold penalty of the box (paper, equations 1 to 4).
    FoldPenalty,
    /// Fold indicator of one control point of the box (paper, equation 1): positive as long as the box has not folded
    /// there.
    FoldIndicator {
        /// Column of the control point.
        column: usize,
        /// Row of the control point.
        row: usize,
        /// Position of the control point in the list of all of them.
        index: usize,
    },
    /// A measure of the section.
    Measure(Measure),
    /// Something read off the flow.
    Flow(FlowQuantity),
    /// Mean square difference of the pressures from those wanted, over the panel nodes of the undeformed section.
    PressureError,
    /// The square of what another quantity is beyond its bounds.
    Soft {
        /// The quantity that is limited.
        quantity: Box<Quantity>,
        /// The limit, with the weight of what goes beyond it.
        limit: SoftLimit,
    },
}

impl Quantity {
    /// The quantity of a name: `shape_error`, `fold_penalty`, `cp_error`, or a measure of the section. Those of a flow belong to an
    /// operating point and are made by `Case` of the module [`case`](crate::case).
    ///
    /// # Errors
    /// An unknown name.
    pub fn parse(name: &str) -> Result<Self, DesignError> {
        match name {
            "shape_error" => Ok(Self::ShapeError),
            "fold_penalty" => Ok(Self::FoldPenalty),
            "cp_error" => Ok(Self::PressureError),
            _ => Ok(Self::Measure(Measure::parse(name)?)),
        }
    }

    /// The name, as [`parse`](Self::parse) takes it.
    pub fn name(&self) -> String {
        match self {
            Self::ShapeError => "shape_error".into(),
            Self::FoldPenalty => "fold_penalty".into(),
            Self::FoldIndicator { column, row, .. } => format!("fold_indicator[{column},{row}]"),
            Self::Measure(measure) => measure.name(),
            Self::Flow(flow) => flow.name(),
            Self::PressureError => "cp_error".into(),
            Self::Soft { quantity, .. } => format!("soft({})", quantity.name()),
        }
    }

    /// Whether a flow has to be solved for it.
    pub fn needs_flow(&self) -> bool {
        match self {
            Self::Flow(_) | Self::PressureError => true,
            Self::Soft { quantity, .. } => quantity.needs_flow(),
            _ => false,
        }
    }
}

/// Target, penalty and flow: the things that quantities of a problem need beside the shape.
#[derive(Debug, Clone)]
pub(crate) struct Instruments {
    pub shape_error: Option<ShapeError>,
    pub penalty: Option<BoxPenalty>,
    pub flow: Option<FlowAnalysis>,
}

impl Instruments {
    /// A quantity of a shape over any scalar.
    pub fn value<S: Scalar>(&self, quantity: &Quantity, shape: &Shape<S>) -> Result<S, DesignError> {
        let value = match quantity {
            Quantity::ShapeError => self.error()?.value(shape.section.curve().control_points()),
            Quantity::FoldPenalty => self.penalty()?.value(&shape.net),
            Quantity::FoldIndicator { index, .. } => self.penalty()?.indicator_at(*index, &shape.net),
            Quantity::Measure(measure) => measure.evaluate(&shape.section)?,
            Quantity::Flow(flow) => self.flow()?.value(flow, shape.posed())?,
            Quantity::PressureError => self.pressures()?.pressure_error(shape.posed())?,
            Quantity::Soft { quantity, limit } => limit.square(self.value(quantity, shape)?),
        };
        finite(quantity, value.re())?;
        Ok(value)
    }

    pub fn error(&self) -> Result<&ShapeError, DesignError> {
        self.shape_error.as_ref().ok_or(DesignError::NoTarget)
    }

    pub fn penalty(&self) -> Result<&BoxPenalty, DesignError> {
        self.penalty.as_ref().ok_or(DesignError::NoBox)
    }

    /// The flow, where there are wanted pressures.
    pub fn pressures(&self) -> Result<&FlowAnalysis, DesignError> {
        self.flow.as_ref().filter(|flow| flow.has_pressure_target()).ok_or(DesignError::NoPressureTarget)
    }

    pub fn flow(&self) -> Result<&FlowAnalysis, DesignError> {
        self.flow.as_ref().ok_or(DesignError::NoFlow)
    }

    /// A measure with its gradient in the variables, by chunks of the tangents of the shape.
    pub fn measure_gradient(
        &self,
        measure: &Measure,
        section: &Section<f64>,
        tangents: &LinearisedShape,
    ) -> Result<(f64, Vec<f64>), DesignError> {
        let mut value = Err(DesignError::NothingFree);
        let variables = tangents.variables();
        let mut gradient = Vec::with_capacity(variables);
        for first in (0..variables).step_by(CHUNK) {
            let chunk = tangents.section_tangents(first..variables.min(first + CHUNK));
            let result = measure.evaluate(&seed(section, &chunk)?)?;
            value = Ok(result.re);
            // a result without a derivative part depends on no direction
            gradient.extend((0..chunk.len()).map(|slot| result.eps.0.map_or(0.0, |eps| eps[slot])));
        }
        let value = value?;
        let quantity = Quantity::Measure(*measure);
        finite(&quantity, value)?;
        gradient.iter().try_for_each(|g| finite(&quantity, *g))?;
        Ok((value, gradient))
    }
}

pub(super) fn finite(quantity: &Quantity, value: f64) -> Result<(), DesignError> {
    if value.is_finite() { Ok(()) } else { Err(DesignError::NotFinite { name: quantity.name() }) }
}

/// The section with its control points carrying one chunk of directions.
fn seed(section: &Section<f64>, tangents: &[Vec<[f64; 2]>]) -> Result<Section<Direction>, DesignError> {
    let points = section.curve().control_points().iter().enumerate().map(|(i, point)| {
        std::array::from_fn(|d| {
            let mut eps = nalgebra::SVector::zeros();
            for (slot, tangent) in tangents.iter().enumerate() {
                eps[slot] = tangent[i][d];
            }
            Direction::new(point[d], num_dual::Derivative::some(eps))
        })
    });
    Ok(section.with_control_points(points.collect())?)
}
