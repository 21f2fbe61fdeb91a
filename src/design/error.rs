//! Errors of design problems.

use crate::ffd::FfdError;
use crate::flow::{FlowError, Status};
use crate::section::SectionError;
use crate::spline::SplineError;

/// Why a design problem was not built or a shape not evaluated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DesignError {
    /// The section could not be built or measured.
    #[error(transparent)]
    Section(#[from] SectionError),
    /// The box could not be built, or the section is not inside.
    #[error(transparent)]
    Ffd(#[from] FfdError),
    /// A spline operation failed.
    #[error(transparent)]
    Spline(#[from] SplineError),
    /// A flow could not be asked for.
    #[error(transparent)]
    Flow(#[from] FlowError),
    /// A flow whose numbers do not hold.
    #[error("flow{} {status}", if point.is_empty() { String::new() } else { format!(" at {point}") })]
    FlowStatus {
        /// Name of the operating point, empty where there is only one.
        point: String,
        /// Status of the flow.
        status: Status,
    },
    /// A quantity of the flow, in a problem without one.
    #[error("there is no flow: give a [flow] table with alpha or cl, and reynolds")]
    NoFlow,
    /// A fold penalty or fold indicator, in a problem without a box.
    #[error("there is no [box] that could fold")]
    NoBox,
    /// Second derivatives of a flow.
    #[error("{name} has first derivatives only")]
    FlowSecondOrder {
        /// Name of the quantity.
        name: String,
    },
    /// A selection names a control point the box does not have.
    #[error("the box has {} columns and {} rows; column {column}, row {row} is not one of them (they count from 0)", counts[0], counts[1])]
    NoControlPoint {
        /// Column asked for.
        column: i64,
        /// Row asked for.
        row: i64,
        /// Columns and rows of the box.
        counts: [usize; 2],
    },
    /// A tie contradicts the mirror or another tie.
    #[error("the tie of control point [{column}, {row}] contradicts the mirror or another tie")]
    Tie {
        /// Column of the control point.
        column: usize,
        /// Row of the control point.
        row: usize,
    },
    /// A tie coefficient is zero or not finite.
    #[error("tie coefficient {value}: it must be finite and not zero")]
    TieCoefficient {
        /// Value of the coefficient.
        value: f64,
    },
    /// A mirrored box must be symmetric about the chord line.
    #[error(
        "the box is not symmetric about the chord line (y = 0): control point [{column}, {row}] has no mirror image"
    )]
    NotSymmetric {
        /// Column of the control point.
        column: usize,
        /// Row of the control point.
        row: usize,
    },
    /// Target and section live on different parameter ranges.
    #[error("the target lives on parameters {target:?}, the section on {section:?}")]
    TargetDomain {
        /// Domain of the target.
        target: (f64, f64),
        /// Domain of the section.
        section: (f64, f64),
    },
    /// Control points can be compared only on equal knots.
    #[error("shape error over control points needs the target on the knots of the section")]
    TargetKnots,
    /// A value that compares with a target, in a problem without one.
    #[error("shape_error needs a [target]")]
    NoTarget,
    /// A difference of pressures, in a problem without wanted ones.
    #[error("cp_error needs a [pressure_target] and a [flow]")]
    NoPressureTarget,
    /// Wanted pressures that cannot be used.
    #[error("{reason}")]
    PressureTable {
        /// The reason in words.
        reason: String,
    },
    /// A section parameter that does not exist.
    #[error("the section has no parameter {name:?}; it has: {}", available.join(", "))]
    NoParameter {
        /// Name asked for.
        name: String,
        /// Names there are.
        available: Vec<String>,
    },
    /// A design variable that does not exist.
    #[error("there is no design variable {name:?}{}", suggestion.as_ref().map(|s| format!("; did you mean {s:?}?")).unwrap_or_default())]
    NoVariable {
        /// Name asked for.
        name: String,
        /// The nearest name there is.
        suggestion: Option<String>,
    },
    /// A design vector with two values for one variable.
    #[error("{name:?} is given twice")]
    Twice {
        /// Name of the variable.
        name: String,
    },
    /// A value beyond the bounds of its variable.
    #[error("{name} is {value}, outside of its bounds {lower} and {upper}")]
    OutOfBounds {
        /// Name of the variable.
        name: String,
        /// The value given.
        value: f64,
        /// The lower bound.
        lower: f64,
        /// The upper bound.
        upper: f64,
    },
    /// No variables are left to design with.
    #[error("no design variables: nothing is free")]
    NothingFree,
    /// A value that came out infinite or undefined.
    #[error("{name} is not finite at this shape")]
    NotFinite {
        /// Name of the value.
        name: String,
    },
    /// Bounds that contradict each other or the start.
    #[error("{name}: lower bound {lower}, start {start}, upper bound {upper} are not in order")]
    Bounds {
        /// Name of the variable or constraint.
        name: String,
        /// The lower bound.
        lower: f64,
        /// The value at the start.
        start: f64,
        /// The upper bound.
        upper: f64,
    },
    /// A scale that is not positive and finite.
    #[error("{name}: scale {scale} must be positive and finite")]
    Scale {
        /// Name of the variable.
        name: String,
        /// The scale.
        scale: f64,
    },
}
