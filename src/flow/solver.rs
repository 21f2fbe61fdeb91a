//! The interface through which the rest of the crate sees every flow solver.

use super::condition::Condition;
use super::solution::Solution;
use super::{FlowError, TrailingEdge};
use std::fmt::Debug;

/// A solver for the flow about a section.
pub trait FlowSolver: Debug + Send + Sync {
    /// The name of the solver in reports.
    fn name(&self) -> &'static str;

    /// Checks whether the solver can take an operating point.
    ///
    /// # Errors
    /// [`FlowError::Condition`] for the first number out of range.
    fn check(&self, condition: &Condition) -> Result<(), FlowError>;

    /// Whether a flow is found sooner and more surely from that about a shape some way off than from nothing. A design run
    /// then starts all its flows from the one about the undeformed section.
    fn gains_from_neighbours(&self) -> bool {
        false
    }

    /// Prepares a section: does once the work that all operating points share.
    ///
    /// `nodes` are points of the section, from the trailing edge over the upper surface to the nose and back along the
    /// lower surface, in any unit, at any place and at any angle: see [`Solution`]. For a sharp edge the first and the
    /// last node are one point.
    ///
    /// # Errors
    /// [`FlowError`] for nodes that make no section.
    fn section(&self, nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Box<dyn FlowSection>, FlowError>;
}

/// A section prepared by a [`FlowSolver`].
pub trait FlowSection: Debug + Send + Sync {
    /// Solves the flow at an operating point.
    ///
    /// `warm` is a solution of a neighbouring section or condition to start from. The result does not depend on it
    /// beyond the tolerance of the solver, except that the streamtube solver keeps the stations of `warm`: with free
    /// transition they differ from those of a start from nothing by what the grid is worth (drag by up to 0.7 % in those
    /// that were measured). A solution of another solver neither helps nor harms.
    ///
    /// # Errors
    /// [`FlowError`] for a condition out of range. A flow that does not converge is a [`Solution`] whose status says
    /// so.
    fn analyze(&self, condition: &Condition, warm: Option<&Solution>) -> Result<Solution, FlowError>;

    /// Solves the flow about a trial shape of a design, starting from the one about a neighbouring shape.
    ///
    /// A flow to which that does not lead is given up sooner than by [`analyze`](Self::analyze): a design that takes a
    /// shorter step is quicker than a long search, which seldom finds one.
    ///
    /// # Errors
    /// As [`analyze`](Self::analyze).
    fn analyze_trial(&self, condition: &Condition, near: &Solution) -> Result<Solution, FlowError> {
        self.analyze(condition, Some(near))
    }

    /// Solves the flow at the next operating point of a sweep, starting from the one at the last point.
    ///
    /// While a shape is changed step by step, a grid has to stay what it was. In a sweep it need not, and the result should be
    /// the one from nothing.
    ///
    /// # Errors
    /// As [`analyze`](Self::analyze).
    fn analyze_next(&self, condition: &Condition, last: Option<&Solution>) -> Result<Solution, FlowError> {
        self.analyze(condition, last)
    }
}
