//! Degree elevation: the same curve with a higher polynomial degree.

use super::refine::{MapRow, apply, blossom};
use super::{BSplineCurve, KnotVector, SplineError, TensorSpline};
use crate::scalar::Scalar;
use smallvec::SmallVec;

impl<S: Scalar, const D: usize> BSplineCurve<S, D> {
    /// This curve with its degree raised by `times`; each knot stands as many times more often, so that the
    /// continuity is kept.
    ///
    /// # Errors
    /// None that a valid curve can meet.
    pub fn elevate_degree(&self, times: usize) -> Result<Self, SplineError> {
        let mut curve = self.clone();
        for _ in 0..times {
            let (knots, rows) = elevation(curve.knots())?;
            let points = apply(rows, curve.control_points());
            curve = Self::new(knots, points)?;
        }
        Ok(curve)
    }
}

impl<S: Scalar, const P: usize, const D: usize> TensorSpline<S, P, D> {
    /// This spline with its degree along one axis (counted from 0) raised by `times`.
    ///
    /// # Errors
    /// An axis that the spline does not have.
    pub fn elevate_degree(&self, axis: usize, times: usize) -> Result<Self, SplineError> {
        let mut spline = self.clone();
        for _ in 0..times {
            let old = spline.axes().get(axis).ok_or(SplineError::NoSuchAxis { axis, axes: P })?;
            let (knots, rows) = elevation(old)?;
            spline = spline.along(axis, knots, &rows)?;
        }
        Ok(spline)
    }
}

/// Knots one degree higher and the map of the control points.
///
/// The blossom of the elevated curve at `degree + 1` consecutive knots is the mean of the old blossom with each of them
/// left out (Ramshaw 1989); each of those is a control point of a refinement of the old curve.
fn elevation(old: &KnotVector) -> Result<(KnotVector, Vec<MapRow>), SplineError> {
    let p = old.degree();
    let mut knots = Vec::with_capacity(2 * old.as_slice().len());
    for (i, &knot) in old.as_slice().iter().enumerate() {
        if i == 0 || knot != old.as_slice()[i - 1] {
            knots.push(knot);
        }
        knots.push(knot);
    }
    // knots outside of the domain support nothing of their own: keep as many as the degree asks for
    let (first, last) = old.domain();
    let before = knots.partition_point(|&k| k <= first);
    let after = knots.partition_point(|&k| k < last);
    let new = KnotVector::new(p + 1, knots[before - (p + 2)..after + p + 2].to_vec())?;
    let t = new.as_slice();
    let rows = (0..new.control_points())
        .map(|j| {
            let span = old.span(t[j]);
            let window = &t[j + 1..=j + p + 1];
            let mut weights: SmallVec<[f64; 8]> = SmallVec::from_elem(0.0, p + 1);
            for omitted in 0..=p {
                let rest = window.iter().enumerate().filter(|(i, _)| *i != omitted).map(|(_, &u)| u);
                for (sum, weight) in weights.iter_mut().zip(blossom(old, span, rest)) {
                    *sum += weight;
                }
            }
            // divided once, so that equal points stay equal
            weights.iter_mut().for_each(|w| *w /= (p + 1) as f64);
            MapRow { first: span - p, weights }
        })
        .collect();
    Ok((new, rows))
}

#[cfg(test)]
mod tests {
    use super::super::refine::tests::{any_curve, difference};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn elevation_keeps_the_curve(curve in any_curve(), times in 0usize..=3) {
            let raised = curve.elevate_degree(times).unwrap();
            prop_assert_eq!(raised.degree(), curve.degree() + times);
            prop_assert!(difference(&curve, &raised) < 1e-13, "{}", difference(&curve, &raised));
        }
    }

    #[test]
    fn a_line_becomes_evenly_spaced() {
        let line = BSplineCurve::new(KnotVector::clamped_uniform(1, 2).unwrap(), vec![[0.0, 1.0], [3.0, 4.0]]).unwrap();
        let cubic = line.elevate_degree(2).unwrap();
        for (point, wanted) in cubic.control_points().iter().zip([[0.0, 1.0], [1.0, 2.0], [2.0, 3.0], [3.0, 4.0]]) {
            assert!(f64::abs(point[0] - wanted[0]) < 1e-15 && f64::abs(point[1] - wanted[1]) < 1e-15);
        }
    }

    #[test]
    fn surfaces_are_elevated_along_an_axis() {
        let axes = [(2, 4), (1, 3)].map(|(p, n)| KnotVector::clamped_uniform(p, n).unwrap());
        let points = (0..12).map(|i| [(i as f64).sin()]).collect();
        let surface = TensorSpline::<f64, 2, 1>::new(axes, points).unwrap();
        let raised = surface.elevate_degree(0, 1).unwrap().elevate_degree(1, 2).unwrap();
        for u in [[0.0, 0.0], [0.3, 0.5], [0.5, 0.8], [1.0, 1.0]] {
            assert!((surface.evaluate(u)[0] - raised.evaluate(u)[0]).abs() < 1e-14);
        }
        assert!(matches!(surface.elevate_degree(2, 1), Err(SplineError::NoSuchAxis { axis: 2, axes: 2 })));
    }
}
