//! The panels coupled with the boundary layer: one Newton iteration for panels, layer, wake, stagnation and transition.
//!
//! The mass defect of the stations is projected to the nodes ([`projection`]). The panels answer with speeds at the
//! nodes and in the wake ([`response`]). A spline over the node index gives these to the stations ([`speeds`]),
//! and the part that the panels cannot resolve is added locally ([`subpanel`]). So
//! nothing jumps from node to node, and the coefficients are smooth functions of the shape.
//!
//! [`system`] puts the equations together. [`eliminate`] and [`reduced`] reduce the Newton system to about one unknown
//! per station, and give Newton's method and the search ([`Equations`](crate::flow::search::Equations)) what they ask
//! for.
//!
//! This module depends on the rest of [`panel`](super) and on the [`layer`](crate::flow::layer).

mod eliminate;
pub(crate) mod projection;
pub(crate) mod reduced;
pub(crate) mod response;
pub(crate) mod speeds;
pub(crate) mod subpanel;
pub(crate) mod system;

#[cfg(test)]
mod tests;
