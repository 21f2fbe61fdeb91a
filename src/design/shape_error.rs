//! Distance between a section and a target: at equal parameters, or to the closest points.

mod closest;
mod equal;
mod kernel;
mod matching;
mod norm;
#[cfg(test)]
mod tests;

use super::DesignError;
use crate::scalar::{Over, Scalar};
use crate::spline::BSplineCurve;
use closest::Closest;
use equal::EqualParameters;
use nalgebra::DMatrix;
pub use norm::ShapeNorm;
use num_dual::Dual2_64;

/// The shape error against one target, prepared for curves on one knot vector.
///
/// ```
/// use aeroform::design::{ShapeError, ShapeNorm};
/// use aeroform::spline::{BSplineCurve, KnotVector};
/// let knots = KnotVector::clamped_uniform(1, 2).unwrap();
/// let target = BSplineCurve::new(knots, vec![[0.0, 0.0], [2.0, 0.0]]).unwrap();
/// let error = ShapeError::new(ShapeNorm::ArcLength, &target, &target).unwrap();
/// // a unit shift of a segment of length two
/// let value: f64 = error.value(&[[0.0, 1.0], [2.0, 1.0]]);
/// assert!((value - 2.0).abs() < 1e-15);
/// // to the closest points: also the mean of the squares of 0 … 0.5 beyond an end, on half of the shape and the target
/// let error = ShapeError::new(ShapeNorm::Closest, &target, &target).unwrap();
/// let value: f64 = error.value(&[[0.5, 1.0], [2.5, 1.0]]);
/// assert!((value - 1.0 - 0.5f64.powi(3) / 6.0).abs() < 1e-4);
/// ```
#[derive(Debug, Clone)]
pub struct ShapeError<S = f64> {
    norm: ShapeNorm,
    comparison: Comparison<S>,
}

/// Distances between a shape and its target, each point from the closest one of the other as by
/// [`ShapeNorm::Closest`], in the unit of the coordinates.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct TargetDistance {
    /// Root of the mean square distance.
    pub root_mean_square: f64,
    /// The largest distance of a sample.
    pub largest: f64,
}

#[derive(Debug, Clone)]
enum Comparison<S> {
    Equal(EqualParameters<S>),
    Closest(Box<Closest<S>>),
}

impl<S: Scalar> ShapeError<S> {
    /// Prepares the comparison of curves on the knots of `start` with `target`.
    ///
    /// `start` is the undeformed shape. By [`ShapeNorm::Closest`] its lengths are the weights of the points of the
    /// shape; by the others only its knots count.
    ///
    /// # Errors
    /// Different domains, or different knots where control points are compared. The closest points need neither to be
    /// equal.
    pub fn new(norm: ShapeNorm, target: &BSplineCurve<S>, start: &BSplineCurve<S>) -> Result<Self, DesignError> {
        let comparison = match norm {
            ShapeNorm::Closest => Comparison::Closest(Box::new(Closest::new(target, start))),
            _ => Comparison::Equal(EqualParameters::new(norm, target, start.knots())?),
        };
        Ok(Self { norm, comparison })
    }

    /// The norm by which the shapes are compared.
    pub fn norm(&self) -> ShapeNorm {
        self.norm
    }

    /// Whether the error is a sum of squares, as by all norms but the root mean square.
    pub fn is_sum_of_squares(&self) -> bool {
        self.norm != ShapeNorm::RootMeanSquare
    }

    /// The error of a curve with the given control points, as many as the knots ask for.
    pub fn value<T: Over<S>>(&self, control_points: &[[T; 2]]) -> T {
        match &self.comparison {
            Comparison::Equal(equal) => equal.value(control_points),
            Comparison::Closest(closest) => closest.value(control_points),
        }
    }
}

impl ShapeError<f64> {
    /// Value; adds `factor` times its derivative with respect to the control points to `gradient`.
    pub fn value_and_gradient(&self, control_points: &[[f64; 2]], factor: f64, gradient: &mut [[f64; 2]]) -> f64 {
        match &self.comparison {
            Comparison::Equal(equal) => equal.value_and_gradient(control_points, factor, gradient),
            Comparison::Closest(closest) => closest.value_and_gradient(control_points, factor, gradient),
        }
    }

    /// Hessian in design variables through which the control points move linearly, where it does not depend on the
    /// control points; `None` for the other norms.
    ///
    /// `tangents[k]` holds the derivative of every control point with respect to variable k.
    pub fn hessian(&self, tangents: &[Vec<[f64; 2]>]) -> Option<DMatrix<f64>> {
        match &self.comparison {
            Comparison::Equal(equal) => equal.hessian(tangents),
            Comparison::Closest(_) => None,
        }
    }

    /// Exact Hessian (order 2 × control points; row and column 2 × control point + axis) at the control points of a
    /// shape; `None` for the norms at equal parameters.
    pub fn hessian_at(&self, control_points: &[[f64; 2]]) -> Option<DMatrix<f64>> {
        let Comparison::Closest(closest) = &self.comparison else { return None };
        let mut matrix = DMatrix::zeros(2 * control_points.len(), 2 * control_points.len());
        closest.add_hessian(control_points, &mut matrix);
        Some(matrix)
    }

    /// The Gauss-Newton matrix `2 Σ ∇r ∇rᵀ` of the residuals r whose squares add up to the error, in the components of
    /// the control points as in [`hessian_at`](Self::hessian_at); `None` for the root mean square, which is no sum of
    /// squares.
    pub fn gauss_newton_at(&self, control_points: &[[f64; 2]]) -> Option<DMatrix<f64>> {
        let mut matrix = DMatrix::zeros(2 * control_points.len(), 2 * control_points.len());
        match &self.comparison {
            Comparison::Equal(_) if self.norm == ShapeNorm::RootMeanSquare => return None,
            Comparison::Equal(equal) => equal.add_gauss_newton(&mut matrix),
            Comparison::Closest(closest) => closest.add_gauss_newton(control_points, &mut matrix),
        }
        Some(matrix)
    }

    /// Adds `factor` times `2 Σ ∇r r″` to `gradient`: of each residual r its derivative with respect to the control
    /// points, times its second derivative along the motion that `control_points` carry. `None` for the norms at equal
    /// parameters, whose residuals do not bend.
    pub(super) fn add_curvature(
        &self,
        control_points: &[[Dual2_64; 2]],
        factor: f64,
        gradient: &mut [[f64; 2]],
    ) -> Option<()> {
        match &self.comparison {
            Comparison::Equal(_) => None,
            Comparison::Closest(closest) => closest.add_curvature(control_points, factor, gradient),
        }
    }

    /// The distances between a shape and the target; `None` where the norm compares equal parameters.
    pub fn distances(&self, control_points: &[[f64; 2]]) -> Option<TargetDistance> {
        match &self.comparison {
            Comparison::Equal(_) => None,
            Comparison::Closest(closest) => {
                let (root_mean_square, largest) = closest.distances(control_points)?;
                Some(TargetDistance { root_mean_square, largest })
            }
        }
    }
}
