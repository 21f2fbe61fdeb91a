//! Tensor-product B-splines of any number of parameters: surfaces, volumes and the maps that FFD boxes are.

use super::{KnotVector, SplineError};
use crate::scalar::{Over, Scalar};
use std::sync::Arc;

/// A tensor-product B-spline of `P` parameters in `D` dimensions.
///
/// Control points are stored with the first parameter running fastest: point `(i, j, …)` of an `n × m × …` net stands
/// at `i + n (j + m (…))`.
///
/// ```
/// use aeroform::spline::{KnotVector, TensorSpline};
/// let knots = KnotVector::clamped_uniform(1, 2).unwrap();
/// let square = TensorSpline::<f64, 2, 2>::new(
///     [knots.clone(), knots],
///     vec![[0.0, 0.0], [2.0, 0.0], [0.0, 1.0], [2.0, 1.0]],
/// ).unwrap();
/// assert_eq!(square.evaluate([0.25, 0.5]), [0.5, 0.5]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct TensorSpline<S, const P: usize, const D: usize> {
    axes: Arc<[KnotVector; P]>,
    control_points: Vec<[S; D]>,
}

/// A B-spline surface, in space unless told otherwise.
pub type BSplineSurface<S, const D: usize = 3> = TensorSpline<S, 2, D>;

/// A B-spline volume: three parameters in space.
pub type BSplineVolume<S> = TensorSpline<S, 3, 3>;

impl<S: Scalar, const P: usize, const D: usize> TensorSpline<S, P, D> {
    /// A spline from one knot vector per parameter and its control points, given as arrays or as `nalgebra` points or
    /// vectors.
    ///
    /// # Errors
    /// A wrong number of control points, or one that is not finite.
    pub fn new(
        axes: impl Into<Arc<[KnotVector; P]>>,
        control_points: Vec<impl Into<[S; D]>>,
    ) -> Result<Self, SplineError> {
        let axes = axes.into();
        let control_points: Vec<[S; D]> = control_points.into_iter().map(Into::into).collect();
        let expected = axes.iter().map(KnotVector::control_points).product();
        if control_points.len() != expected {
            return Err(SplineError::ControlPointCount { expected, found: control_points.len() });
        }
        if let Some(index) = control_points.iter().position(|p| p.iter().any(|c| !c.re().is_finite())) {
            return Err(SplineError::NotFinite { index });
        }
        Ok(Self { axes, control_points })
    }

    /// The knot vectors, one per parameter.
    pub fn axes(&self) -> &Arc<[KnotVector; P]> {
        &self.axes
    }

    /// The control points, the first parameter running fastest.
    pub fn control_points(&self) -> &[[S; D]] {
        &self.control_points
    }

    /// Number of control points in each direction.
    pub fn counts(&self) -> [usize; P] {
        std::array::from_fn(|axis| self.axes[axis].control_points())
    }

    /// A spline on the knots of this one with other control points, of any scalar.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_control_points<T: Scalar>(
        &self,
        points: Vec<impl Into<[T; D]>>,
    ) -> Result<TensorSpline<T, P, D>, SplineError> {
        TensorSpline::new(Arc::clone(&self.axes), points)
    }

    /// The point at parameters `u`; outside of the domain the end polynomials continue.
    pub fn evaluate(&self, u: [S; P]) -> [S; D] {
        self.at(u)
    }

    /// The point at constant parameters; cheaper than [`evaluate`](Self::evaluate) for duals.
    pub fn point_at(&self, u: [f64; P]) -> [S; D] {
        self.at(u)
    }

    fn at<W: Scalar>(&self, u: [W; P]) -> [S; D]
    where
        S: Over<W>,
    {
        let mut point = [S::from(0.0); D];
        for_each_weight(&self.axes, u, |index, weight| {
            for (p, c) in point.iter_mut().zip(&self.control_points[index]) {
                *p += *c * weight;
            }
        });
        point
    }

    /// Point and Jacobian at `u`: `jacobian[k]` is the derivative with respect to parameter `k`.
    pub fn point_and_jacobian(&self, u: [S; P]) -> ([S; D], [[S; D]; P]) {
        let spans: [usize; P] = std::array::from_fn(|k| self.axes[k].span(u[k].re()));
        let rows: [_; P] = std::array::from_fn(|k| self.axes[k].basis_derivatives(spans[k], u[k], 1));
        let mut point = [S::from(0.0); D];
        let mut jacobian = [[S::from(0.0); D]; P];
        for_each_index(&self.axes, spans, |index, local| {
            let control = &self.control_points[index];
            let mut value = S::from(1.0);
            let mut slopes = [S::from(1.0); P];
            for k in 0..P {
                value *= rows[k][0][local[k]];
                for (direction, slope) in slopes.iter_mut().enumerate() {
                    *slope *= rows[k][usize::from(direction == k)][local[k]];
                }
            }
            for d in 0..D {
                point[d] += control[d] * value;
                for k in 0..P {
                    jacobian[k][d] += control[d] * slopes[k];
                }
            }
        });
        (point, jacobian)
    }
}

/// Calls `visit(control point, weight)` for every tensor-product basis function that does not vanish at `u`.
///
/// This is one row of the constant linear map from control points to points.
pub fn for_each_weight<S: Scalar, const P: usize>(axes: &[KnotVector; P], u: [S; P], mut visit: impl FnMut(usize, S)) {
    let spans: [usize; P] = std::array::from_fn(|k| axes[k].span(u[k].re()));
    let values: [_; P] = std::array::from_fn(|k| axes[k].basis(spans[k], u[k]));
    for_each_index(axes, spans, |index, local| {
        let mut weight = values[0][local[0]];
        for k in 1..P {
            weight *= values[k][local[k]];
        }
        visit(index, weight);
    });
}

/// Calls `visit(control point, local indices)` for the control points of a cell, first parameter fastest.
pub(crate) fn for_each_index<const P: usize>(
    axes: &[KnotVector; P],
    spans: [usize; P],
    mut visit: impl FnMut(usize, [usize; P]),
) {
    let mut local = [0; P];
    loop {
        let mut index = 0;
        for k in (0..P).rev() {
            index = index * axes[k].control_points() + spans[k] - axes[k].degree() + local[k];
        }
        visit(index, local);
        let mut k = 0;
        loop {
            local[k] += 1;
            if local[k] <= axes[k].degree() {
                break;
            }
            local[k] = 0;
            k += 1;
            if k == P {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    /// A curved volume whose map is polynomial: control points of f(Greville) only for the linear part.
    fn volume() -> BSplineVolume<f64> {
        let axes = [(2, 4), (3, 5), (1, 2)].map(|(p, n)| KnotVector::clamped_uniform(p, n).unwrap());
        let points = (0..40).map(|i| [i as f64, (i as f64).sin(), (i as f64 * 0.7).cos()]).collect();
        TensorSpline::new(axes, points).unwrap()
    }

    #[test]
    fn jacobian_agrees_with_duals() {
        let v = volume();
        let lifted = v.with_control_points(v.control_points().iter().map(|p| p.map(Dual64::from)).collect()).unwrap();
        for u in [[0.0, 0.0, 0.0], [0.3, 0.6, 0.9], [0.5, 0.5, 0.5], [1.0, 1.0, 1.0]] {
            let (point, jacobian) = v.point_and_jacobian(u);
            assert_eq!(v.evaluate(u), v.point_at(u));
            for k in 0..3 {
                let mut dual = u.map(Dual64::from);
                dual[k].eps = 1.0;
                let moved = lifted.evaluate(dual);
                for d in 0..3 {
                    assert!((moved[d].re - point[d]).abs() < 1e-13 * 40.0);
                    assert!((moved[d].eps - jacobian[k][d]).abs() < 1e-12 * 40.0);
                }
            }
        }
    }

    #[test]
    fn corners_are_corner_control_points() {
        let v = volume();
        assert_eq!(v.evaluate([0.0; 3]), v.control_points()[0]);
        assert_eq!(v.evaluate([1.0; 3]), v.control_points()[39]);
        assert_eq!(v.evaluate([1.0, 0.0, 0.0]), v.control_points()[3]);
    }

    #[test]
    fn greville_net_is_the_identity() {
        let axes = [(2, 4), (3, 5)].map(|(p, n)| KnotVector::clamped_uniform(p, n).unwrap());
        let greville = [axes[0].greville(), axes[1].greville()];
        let points = (0..20).map(|i| [greville[0][i % 4], greville[1][i / 4]]).collect();
        let map = TensorSpline::<f64, 2, 2>::new(axes, points).unwrap();
        for u in [[0.1, 0.2], [0.55, 0.99], [1.0, 0.0]] {
            let x = map.evaluate(u);
            assert!((x[0] - u[0]).abs() < 1e-15 && (x[1] - u[1]).abs() < 1e-15);
        }
    }
}
