//! B-splines over any [`Scalar`](crate::scalar::Scalar): knot vectors, curves, surfaces and volumes.
//!
//! Knots and parameters of construction are plain numbers, control points are generic, so every spline is linear in
//! its control points and every derivative is exact.
//!
//! This module depends on [`scalar`](crate::scalar) and [`differentiate`](crate::differentiate).

mod analytic;
mod arc_length;
mod banded;
mod curve;
mod elevate;
mod error;
mod fitting;
mod knots;
mod least_squares;
mod quadrature;
mod query;
mod refine;
mod roots;
mod split;
mod tensor;

pub use analytic::{Approximation, circular_arc, ellipse, elliptic_arc, line_segment};
pub use arc_length::ArcLengths;
pub use curve::BSplineCurve;
pub use error::SplineError;
pub use fitting::{
    EndCondition, Interpolation, averaged_knots, centripetal_parameters, chord_length_parameters, interpolate,
};
pub use knots::{BasisValues, KnotVector};
pub use least_squares::{LeastSquares, fit, fit_to_tolerance};
pub use quadrature::GaussRule;
pub use query::{BoundingBox, ClosestPoint};
pub(crate) use query::{distance_slope, foot};
pub(crate) use refine::blossom;
pub(crate) use roots::{halve, isolated};
pub(crate) use tensor::for_each_index;
pub use tensor::{BSplineSurface, BSplineVolume, TensorSpline, for_each_weight};
