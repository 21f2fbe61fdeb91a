//! The panel solver: linear vortex panels in stream-function form with the Kármán-Tsien correction, coupled with the
//! boundary layer.
//!
//! [`kernel`], [`polar`], [`outline`], [`inviscid`], [`edge`] and [`wake`] make up the flow without a layer, and
//! [`compressibility`] corrects it. All of it works in the own [`frame`] of the section. [`coupling`] couples it with
//! the layer. [`section`] prepares a section, [`request`] leads from an operating point to a solution by way of the
//! equations of a [`family`] of flows, and [`record`] keeps the state of a solution that is needed later ([`solved`]).
//! [`outputs`] reads the coefficients off that state, and [`adjoint`] differentiates them.
//!
//! Kernels are generic over [`Scalar`](crate::scalar::Scalar); systems are factorised in `f64`. Sources: Drela, XFOIL,
//! LNAE 54 (1989), section 2; Katz & Plotkin, "Low-Speed Aerodynamics", chapter 10.
//!
//! This module depends on the [`layer`](super::layer) and the [`search`](super::search).

mod adjoint;
mod compressibility;
pub(crate) mod coupling;
mod edge;
mod family;
mod frame;
mod inviscid;
mod kernel;
mod nose;
mod outline;
mod outputs;
mod polar;
mod record;
mod request;
mod resolution;
mod section;
mod solved;
mod streamline;
mod wake;

#[cfg(test)]
pub(crate) mod testing;
#[cfg(test)]
mod tests;

pub(in crate::flow) use frame::Nodes;
pub(in crate::flow) use record::{LAMINAR_REVERSED, REVERSED_EXTENT, TURBULENT_REVERSED};
pub use section::{InviscidSolution, PanelSolver, PanelledSection, analyze};
