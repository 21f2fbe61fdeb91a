//! A design problem: variables, objectives, constraints, and the case file they come from.
//!
//! **design variables → section → FFD box → deformed section → quantities → objective and constraints**, written once
//! over any scalar ([`DesignProblem::quantities_at`]). What optimisers use ([`Problem`]) gets the same derivatives
//! from local duals carried back through the linear maps, so that a whole gradient costs a small multiple of a value;
//! [`check_gradients`] holds the two against each other and against finite differences.
//!
//! Depends on [`flow`](crate::flow), [`section`](crate::section), [`ffd`](crate::ffd), [`spline`](crate::spline),
//! [`differentiate`](crate::differentiate) and [`scalar`](crate::scalar).

mod case;
mod design_problem;
mod error;
mod flow_analysis;
mod geometry;
mod gradient_check;
mod motion;
mod problem;
mod quantity;
mod shape_error;

#[cfg(feature = "command")]
pub(crate) use case::nearest;
pub use case::{BuiltinCase, Case, CaseError, OptimizerSettings, builtin_cases};
pub use design_problem::{Constraint, DesignProblem, ShapeFlows};
pub use error::DesignError;
pub use flow_analysis::{FlowOutput, FlowQuantity, FlowTiming, OperatingPoint};
pub use geometry::{Geometry, LinearisedShape, Shape, Variable};
pub use gradient_check::{DerivativeCheck, check_gradients};
pub use problem::{AnalysisFailure, Bounds, Evaluation, Problem, ProblemDescription};
pub use quantity::Quantity;
pub use shape_error::{ShapeError, ShapeNorm};
