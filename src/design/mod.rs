//! A design problem: variables, objectives and constraints.
//!
//! **design variables → section → FFD box → deformed section → quantities → objective and constraints**, written once
//! over any scalar ([`DesignProblem::quantities_at`]). What optimisers use ([`Problem`]) gets the same derivatives
//! from local duals carried back through the linear maps, so that a whole gradient costs a small multiple of a value;
//! [`check_gradients`] holds the two against each other and against finite differences.
//!
//! This module depends on [`flow`](crate::flow), [`section`](crate::section), [`ffd`](crate::ffd),
//! [`spline`](crate::spline), [`differentiate`](crate::differentiate) and [`scalar`](crate::scalar).

mod design_problem;
mod error;
mod flow_analysis;
mod geometry;
mod gradient_check;
mod linearised;
mod motion;
pub(crate) mod parallel;
mod pressure_target;
mod problem;
mod quantity;
mod shape;
mod shape_error;
mod soft_limit;

pub(crate) use design_problem::weighted_sum;
pub use design_problem::{Constraint, DesignProblem, ShapeFlows};
pub use error::DesignError;
pub(crate) use flow_analysis::FlowAnalysis;
pub use flow_analysis::{FlowOutput, FlowQuantity, FlowTiming, OperatingPoint};
pub(crate) use geometry::{Deformation, VariableKind};
pub use geometry::{Geometry, Variable};
pub use gradient_check::{DerivativeCheck, check_gradients};
pub use linearised::LinearisedShape;
pub(crate) use motion::{Axis, BoxMotion, MotionRules, Selection, Tie};
pub(crate) use pressure_target::PlacesOnChord;
pub use pressure_target::{PressureSide, PressureTarget};
pub use problem::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription, ValueAndGradient};
pub(crate) use quantity::Instruments;
pub use quantity::Quantity;
pub use shape::Shape;
pub use shape_error::{ShapeError, ShapeNorm, TargetDistance};
pub use soft_limit::SoftLimit;
