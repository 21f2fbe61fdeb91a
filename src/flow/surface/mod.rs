//! The coordinate along the surface of a section: the index of the nodes, splines over it, and the map between it and
//! arc length.
//!
//! This module depends on [`linear`](super::linear), [`differentiate`](crate::differentiate) and
//! [`scalar`](crate::scalar).

mod map;
pub(crate) mod spline;

pub(crate) use map::SurfaceMap;
