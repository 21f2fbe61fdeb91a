//! A design problem: variables, objectives, constraints, and the case file they come from.

mod problem;

pub use problem::{AnalysisFailure, Bounds, Evaluation, Problem};
