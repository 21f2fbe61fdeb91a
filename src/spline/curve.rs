//! B-spline curves: construction, evaluation and derivatives.

use super::{KnotVector, SplineError};
use crate::scalar::{Over, Scalar};
use std::sync::Arc;

/// A B-spline curve in `D` dimensions (two unless told), with control points over any [`Scalar`].
///
/// ```
/// use aeroform::spline::{BSplineCurve, KnotVector};
/// let knots = KnotVector::clamped_uniform(2, 3).unwrap();
/// let arch = BSplineCurve::new(knots, vec![[0.0, 0.0], [0.5, 1.0], [1.0, 0.0]]).unwrap();
/// assert_eq!(arch.evaluate(0.5), [0.5, 0.5]);
/// assert_eq!(arch.derivatives(0.5, 2), [[0.5, 0.5], [1.0, 0.0], [0.0, -4.0]]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct BSplineCurve<S, const D: usize = 2> {
    knots: Arc<KnotVector>,
    control_points: Vec<[S; D]>,
}

impl<S: Scalar, const D: usize> BSplineCurve<S, D> {
    /// A curve from knots and control points, given as arrays or as `nalgebra` points or vectors.
    ///
    /// ```
    /// use aeroform::spline::{BSplineCurve, KnotVector};
    /// use nalgebra::{Point2, Vector3};
    /// let line = |degree| KnotVector::clamped_uniform(degree, 2).unwrap();
    /// let plane = BSplineCurve::new(line(1), vec![Point2::new(0.0, 1.0), Point2::new(2.0, 1.0)]).unwrap();
    /// let space = BSplineCurve::new(line(1), vec![Vector3::zeros(), Vector3::new(0.0, 0.0, 4.0)]).unwrap();
    /// assert_eq!((plane.evaluate(0.5), space.evaluate(0.5)), ([1.0, 1.0], [0.0, 0.0, 2.0]));
    /// ```
    ///
    /// # Errors
    /// A wrong number of control points, or one that is not finite.
    pub fn new<P: Into<[S; D]>>(
        knots: impl Into<Arc<KnotVector>>,
        control_points: Vec<P>,
    ) -> Result<Self, SplineError> {
        let knots = knots.into();
        let control_points: Vec<[S; D]> = control_points.into_iter().map(Into::into).collect();
        if control_points.len() != knots.control_points() {
            return Err(SplineError::ControlPointCount {
                expected: knots.control_points(),
                found: control_points.len(),
            });
        }
        if let Some(index) = control_points.iter().position(|p| p.iter().any(|c| !c.re().is_finite())) {
            return Err(SplineError::NotFinite { index });
        }
        Ok(Self { knots, control_points })
    }

    /// The knot vector of the curve.
    pub fn knots(&self) -> &Arc<KnotVector> {
        &self.knots
    }

    /// The control points, from the first to the last parameter.
    pub fn control_points(&self) -> &[[S; D]] {
        &self.control_points
    }

    /// Polynomial degree of the curve.
    pub fn degree(&self) -> usize {
        self.knots.degree()
    }

    /// First and last parameter of the curve.
    pub fn domain(&self) -> (f64, f64) {
        self.knots.domain()
    }

    /// A curve on the knots of this one with other control points, of any scalar.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_control_points<T: Scalar>(
        &self,
        points: Vec<impl Into<[T; D]>>,
    ) -> Result<BSplineCurve<T, D>, SplineError> {
        BSplineCurve::new(Arc::clone(&self.knots), points)
    }

    /// The curve over `f64` whose control points are the real parts of these.
    pub fn real(&self) -> BSplineCurve<f64, D> {
        BSplineCurve {
            knots: Arc::clone(&self.knots),
            control_points: self.control_points.iter().map(|p| p.map(|c| c.re())).collect(),
        }
    }

    /// The point at parameter `u`, which may carry derivatives too.
    ///
    /// Outside of the domain the end polynomial continues.
    pub fn evaluate(&self, u: S) -> [S; D] {
        let span = self.knots.span(u.re());
        let values = self.knots.basis(span, u);
        combine(&values, &self.control_points[span - self.degree()..])
    }

    /// The point at a constant parameter; cheaper than [`evaluate`](Self::evaluate) for duals.
    pub fn point_at(&self, u: f64) -> [S; D] {
        let span = self.knots.span(u);
        let values = self.knots.basis(span, u);
        let mut point = [S::from(0.0); D];
        for (value, control) in values.iter().zip(&self.control_points[span - self.degree()..]) {
            for (p, c) in point.iter_mut().zip(control) {
                *p += *c * *value;
            }
        }
        point
    }

    /// The first derivative at a constant parameter; cheaper than [`point_and_tangent`](Self::point_and_tangent) for
    /// duals.
    pub fn tangent_at(&self, u: f64) -> [S; D] {
        let p = self.degree();
        let span = self.knots.span(u);
        let points = &self.control_points[span - p..];
        let knots = self.knots.as_slice();
        let mut tangent = [S::from(0.0); D];
        for (j, value) in self.knots.basis_of_degree(span, u, p - 1).iter().enumerate() {
            let first = span - p + 1 + j;
            let weight = value * p as f64 / (knots[first + p] - knots[first]);
            for d in 0..D {
                tangent[d] += (points[j + 1][d] - points[j][d]) * weight;
            }
        }
        tangent
    }

    /// Point and derivatives up to `order` at `u`: `result[k]` is the k-th derivative with respect to the parameter.
    pub fn derivatives(&self, u: S, order: usize) -> Vec<[S; D]> {
        let span = self.knots.span(u.re());
        let points = &self.control_points[span - self.degree()..];
        self.knots.basis_derivatives(span, u, order).iter().map(|row| combine(row, points)).collect()
    }

    /// Point and first derivative with respect to the parameter at `u`, without allocation.
    ///
    /// `u` is of the scalar of the curve; for a curve over `f64` it may be any scalar.
    pub fn point_and_tangent<T: Over<S>>(&self, u: T) -> ([T; D], [T; D]) {
        let p = self.degree();
        let span = self.knots.span(u.re());
        let points = &self.control_points[span - p..];
        let [basis, lower] = self.knots.basis_and_lower(span, u);
        let point = combine(&basis, points);
        let knots = self.knots.as_slice();
        let mut tangent = [T::from(0.0); D];
        for (j, value) in lower.iter().enumerate() {
            let first = span - p + 1 + j;
            let weight = *value * (p as f64 / (knots[first + p] - knots[first]));
            for d in 0..D {
                tangent[d] += weight * (points[j + 1][d] - points[j][d]);
            }
        }
        (point, tangent)
    }
}

/// Linear combination of points.
fn combine<T: Over<S>, S: Copy, const D: usize>(weights: &[T], points: &[[S; D]]) -> [T; D] {
    let mut sum = [T::from(0.0); D];
    for (weight, point) in weights.iter().zip(points) {
        for (s, c) in sum.iter_mut().zip(point) {
            *s += *weight * *c;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::{Dual64, first_derivative};

    fn wave(degree: usize, n: usize) -> BSplineCurve<f64> {
        let knots = KnotVector::clamped_uniform(degree, n).unwrap();
        BSplineCurve::new(knots, (0..n).map(|i| [i as f64, (1.3 * i as f64).sin()]).collect()).unwrap()
    }

    #[test]
    fn tangents_agree_three_ways() {
        for degree in 1..=5 {
            let curve = wave(degree, 9);
            let lifted = BSplineCurve::<Dual64>::new(
                Arc::clone(curve.knots()),
                curve.control_points().iter().map(|p| p.map(Dual64::from)).collect(),
            )
            .unwrap();
            for u in [0.0, 0.13, 0.5, 0.77, 1.0] {
                let (point, tangent) = curve.point_and_tangent(u);
                let rows = curve.derivatives(u, 1);
                for d in 0..2 {
                    let (value, slope) = first_derivative(|u: Dual64| lifted.evaluate(u)[d], u);
                    assert!((value - point[d]).abs() < 1e-14 * 9.0 && (rows[0][d] - point[d]).abs() < 1e-14 * 9.0);
                    assert!((slope - tangent[d]).abs() < 1e-12 && (rows[1][d] - tangent[d]).abs() < 1e-12);
                }
                assert_eq!(curve.point_at(u), curve.evaluate(u));
                assert!((0..2).all(|d| (curve.tangent_at(u)[d] - tangent[d]).abs() < 1e-13));
            }
        }
    }

    #[test]
    fn ends_are_the_end_control_points() {
        let curve = wave(3, 7);
        assert_eq!(curve.evaluate(0.0), curve.control_points()[0]);
        assert_eq!(curve.evaluate(1.0), curve.control_points()[6]);
    }

    #[test]
    fn wrong_control_points_are_refused() {
        let knots = KnotVector::clamped_uniform(3, 4).unwrap();
        assert_eq!(
            BSplineCurve::new(knots.clone(), vec![[0.0, 0.0]; 5]).unwrap_err(),
            SplineError::ControlPointCount { expected: 4, found: 5 }
        );
        let mut points = vec![[0.0, 0.0]; 4];
        points[2][1] = f64::NAN;
        assert_eq!(BSplineCurve::new(knots, points).unwrap_err(), SplineError::NotFinite { index: 2 });
    }
}
