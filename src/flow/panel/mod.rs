//! Inviscid flow by panels: linear vortices in stream-function form, sources, wake, pressure forces.
//!
//! Kernels are generic over [`Scalar`](crate::scalar::Scalar); the system is factorised once in `f64`.
//! Sources: Drela, XFOIL, LNAE 54 (1989), section 2; Katz & Plotkin, "Low-Speed Aerodynamics", chapter 10.

pub(crate) mod edge;
pub(crate) mod forces;
pub(crate) mod inviscid;
pub(crate) mod kernel;
pub(crate) mod outline;
pub(crate) mod polar;
pub(crate) mod wake;

#[cfg(test)]
mod tests;
