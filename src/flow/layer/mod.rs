//! The integral boundary layer on both sides of a section and in the wake.
//!
//! Stations stand at fixed fractions of the way from the stagnation point to transition and from there to the trailing
//! edge; the arc lengths of the first two are unknowns ([`layout`], [`unknowns`]). [`station`] holds the four unknowns
//! of a station and what follows from them by the [`closure`]. [`interval`] holds the residuals between two stations,
//! and [`equations`] lists which stations they link. [`blocks`] gives the local Jacobians. [`march`] finds a start for
//! given speeds, [`project`] puts a state back onto the equations, [`steps`] limits a step, [`transport`] moves states
//! with their stations, and [`transition`] says where the layer turns turbulent.
//!
//! This module depends on [`scalar`](crate::scalar) and [`differentiate`](crate::differentiate) and on no outer flow.
//! It knows an outer flow only by the speeds that drive a march ([`OuterSpeeds`]) and by how a speed becomes the
//! compressible state at the edge of the layer ([`EdgeLaw`]).

pub(crate) mod blocks;
pub(crate) mod closure;
mod edge;
pub(crate) mod equations;
pub(crate) mod interval;
pub(crate) mod layout;
mod march;
mod project;
mod side;
mod station;
mod steps;
mod transition;
pub(crate) mod transport;
mod unknowns;

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub(crate) use edge::{Edge, EdgeLaw, FreeStream};
pub(crate) use equations::{EQUATIONS, Layer};
pub(crate) use layout::Layout;
pub(crate) use march::OuterSpeeds;
pub(crate) use side::Side;
pub(crate) use station::{ByStation, Derived, Regime, State, transition_state};
pub(crate) use steps::Metric;
pub(crate) use transition::{is_inside, residual as transition_residual};
pub(crate) use unknowns::{
    ByGlobal, Change, GLOBAL_UNKNOWNS, GLOBALS, Numbering, STAGNATION, TOTAL, TRANSITION, Unknowns,
};
