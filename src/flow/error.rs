//! Errors of requests for a flow solution.

/// Why there is no flow solution at all, or no derivatives of one. A solution that is not to be trusted has a
/// [`Status`](super::Status) that says so, and is no error.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FlowError {
    /// Too few nodes to resolve a section.
    #[error("{found} nodes on the section; at least {needed} are needed")]
    TooFewNodes {
        /// Number of nodes given.
        found: usize,
        /// Number of nodes needed.
        needed: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error("node {index} has a coordinate that is not a finite number")]
    NodeNotFinite {
        /// Index of the node in the list, from 0.
        index: usize,
    },
    /// No node is farthest from the middle of the trailing edge, so that the section has no chord line.
    #[error("the nodes have no nose: no point is farthest from the middle of the trailing edge")]
    NoNose,
    /// Two neighbouring nodes are the same point.
    #[error("nodes {first} and {second} coincide; remove one of them")]
    CoincidentNodes {
        /// Index of the first node.
        first: usize,
        /// Index of the second node.
        second: usize,
    },
    /// A sharp trailing edge was announced, but the first and last node differ.
    #[error("the trailing edge is open by {gap:.3e} chords: call it blunt, or close it")]
    TrailingEdgeOpen {
        /// Distance between first and last node, in chords.
        gap: f64,
    },
    /// A blunt trailing edge was announced, but the first and last node are the same point.
    #[error("the trailing edge is closed (gap {gap:.3e} chords): call it sharp, or open it")]
    TrailingEdgeClosed {
        /// Distance between first and last node, in chords.
        gap: f64,
    },
    /// The nodes run clockwise, or the outline crosses itself.
    #[error("the outline encloses an area of {area:.3e}: nodes must run from the trailing edge over the upper surface")]
    NotCounterClockwise {
        /// Signed area, in chords squared.
        area: f64,
    },
    /// Neighbouring panels differ so much in length that functions over the node index lose their meaning.
    #[error("the panels are too uneven: neighbours should not differ in length by more than a factor of about three")]
    UnevenNodes,
    /// The panel equations have no unique solution for this outline.
    #[error("the panel equations are singular; does the outline cross itself?")]
    SingularPanels,
    /// Coefficients are requested over a scalar that carries more than first derivatives.
    #[error("the coefficients of a flow carry first derivatives only; give the nodes in a first-order dual number")]
    FirstOrderOnly,
    /// Coefficients are requested for other nodes than those of the solution.
    #[error("the real parts of the nodes are not the nodes that the flow was solved for")]
    OtherNodes,
    /// A flow that is not converged has no derivatives.
    #[error("the flow is not converged, so that its coefficients have no derivatives")]
    NoDerivatives,
    /// A number of the operating point is out of range.
    #[error("{name} is {value:?}; it must be {allowed}")]
    Condition {
        /// Name of the number, with its unit where it has one.
        name: &'static str,
        /// Value that was given.
        value: f64,
        /// Range that is allowed, in words.
        allowed: &'static str,
    },
}
