//! The coupled viscous-inviscid system: one Newton iteration for panels, boundary layers, wake, stagnation and transition.
//!
//! Stations of the boundary layer stand at fixed fractions of stagnation point → transition → trailing edge, whose
//! arc lengths are unknowns ([`layout`], [`unknowns`]). Their mass defect is projected to the nodes ([`projection`]),
//! the panels answer with speeds at the nodes and in the wake ([`response`]), a spline over the node index gives them
//! to the stations ([`surface`], [`speeds`]), and what the panels cannot resolve is added locally ([`subpanel`]). So
//! nothing hops from node to node, and the coefficients are smooth functions of the shape.
//!
//! [`chain`] linearises the boundary-layer equations by local dual numbers, [`system`] and [`eliminate`] reduce the
//! Newton system to about one unknown per station, [`march`] and [`start`] find a start, [`newton`] iterates, [`chord`] with
//! a Jacobian that is kept.
//!
//! Depends on [`panel`](super::panel) and [`boundary_layer`](super::boundary_layer).

pub(crate) mod chain;
pub(crate) mod chord;
pub(crate) mod duals;
mod eliminate;
pub(crate) mod layout;
pub(crate) mod march;
pub(crate) mod newton;
pub(crate) mod project;
pub(crate) mod projection;
pub(crate) mod residuals;
pub(crate) mod response;
pub(crate) mod speeds;
pub(crate) mod start;
pub(crate) mod subpanel;
pub(crate) mod surface;
pub(crate) mod system;
pub(crate) mod transition;
pub(crate) mod transport;
pub(crate) mod unknowns;

#[cfg(test)]
mod tests;
