//! Integral boundary layer and wake.
//!
//! Depends on [`scalar`](crate::scalar) only: what it needs of the outer flow are the edge speeds.

pub(crate) mod closure;
pub(crate) mod gas;
pub(crate) mod interval;
pub(crate) mod station;
