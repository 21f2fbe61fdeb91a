//! Knot insertion: a spline keeps its shape with more knots, for curves and along each axis of tensor products.
//!
//! Every operation that keeps the shape is a constant linear map of the control points. Its rows come from blossoms:
//! the control point of a spline on new knots is the blossom (polar form) of the old one at consecutive new knots
//! (Ramshaw 1989); for knot insertion the weights are the non-negative ones of the Oslo algorithm (Cohen, Lyche and
//! Riesenfeld 1980), so nothing is amplified.

use super::{BSplineCurve, BasisValues, KnotVector, SplineError, TensorSpline};
use crate::scalar::Scalar;
use smallvec::SmallVec;

/// One new control point as a combination of old ones: index of the first, and weights.
pub(super) struct MapRow {
    pub(super) first: usize,
    pub(super) weights: SmallVec<[f64; 8]>,
}

impl MapRow {
    /// The combination, of points that stand `stride` apart from `offset` on.
    fn apply<S: Scalar, const D: usize>(&self, points: &[[S; D]], offset: usize, stride: usize) -> [S; D] {
        let mut sum = [S::from(0.0); D];
        for (i, weight) in self.weights.iter().enumerate().filter(|(_, w)| **w != 0.0) {
            for (s, c) in sum.iter_mut().zip(&points[offset + stride * (self.first + i)]) {
                *s += *c * *weight;
            }
        }
        sum
    }
}

/// Weights of the control points `span - degree ..= span` in the blossom of the span at `degree` arguments.
///
/// With all arguments equal these are the basis functions.
pub(crate) fn blossom(knots: &KnotVector, span: usize, arguments: impl IntoIterator<Item = f64>) -> BasisValues<f64> {
    let t = knots.as_slice();
    let mut values: BasisValues<f64> = SmallVec::from_elem(0.0, knots.degree() + 1);
    values[0] = 1.0;
    for (level, u) in arguments.into_iter().enumerate().take(knots.degree()) {
        let mut saved = 0.0;
        for r in 0..=level {
            let (left, right) = (t[span + r - level], t[span + r + 1]);
            // a ratio that is exactly zero or one at a knot leaves control points there bit for bit
            let ratio = (u - left) / (right - left);
            let value = values[r];
            values[r] = saved + value * (1.0 - ratio);
            saved = value * ratio;
        }
        values[level + 1] = saved;
    }
    values
}

/// The rows that take control points on `old` knots to control points on `new` knots, which contain the old.
fn refinement(old: &KnotVector, new: &KnotVector) -> Vec<MapRow> {
    let p = old.degree();
    let t = new.as_slice();
    (0..new.control_points())
        .map(|j| {
            let span = old.span(t[j]);
            MapRow { first: span - p, weights: blossom(old, span, t[j + 1..=j + p].iter().copied()) }
        })
        .collect()
}

/// The old knots with `inserted` ones among them.
fn merged(old: &KnotVector, inserted: &[f64]) -> Result<KnotVector, SplineError> {
    let (first, last) = old.domain();
    if let Some(&parameter) = inserted.iter().find(|u| !(first..=last).contains(*u)) {
        return Err(SplineError::OutsideDomain { parameter, first, last });
    }
    let mut knots = old.as_slice().to_vec();
    knots.extend_from_slice(inserted);
    knots.sort_by(f64::total_cmp);
    KnotVector::new(old.degree(), knots)
}

/// Old control points through a map's rows.
pub(super) fn apply<S: Scalar, const D: usize>(
    rows: impl IntoIterator<Item = MapRow>,
    points: &[[S; D]],
) -> Vec<[S; D]> {
    rows.into_iter().map(|row| row.apply(points, 0, 1)).collect()
}

impl<S: Scalar, const D: usize> BSplineCurve<S, D> {
    /// This curve with the knot `u` inserted `times` more times.
    ///
    /// The control points may be of any scalar; `u` is a plain number, as all knots are, because a moving knot would
    /// make the curve nonlinear in what it is built from.
    ///
    /// # Errors
    /// `u` outside of the domain, or a knot that would stand more often than the degree.
    pub fn insert_knot(&self, u: f64, times: usize) -> Result<Self, SplineError> {
        self.refine(&vec![u; times])
    }

    /// This curve with more knots, in any order; a knot given twice is inserted twice.
    ///
    /// Exact up to round-off; control points that no inserted knot concerns stay bit for bit.
    ///
    /// ```
    /// use aeroform::spline::{BSplineCurve, KnotVector};
    /// let knots = KnotVector::clamped_uniform(2, 3).unwrap();
    /// let arch = BSplineCurve::new(knots, vec![[0.0, 0.0], [0.5, 1.0], [1.0, 0.0]]).unwrap();
    /// let refined = arch.refine(&[0.5]).unwrap();
    /// assert_eq!(refined.control_points(), [[0.0, 0.0], [0.25, 0.5], [0.75, 0.5], [1.0, 0.0]]);
    /// ```
    ///
    /// # Errors
    /// As [`insert_knot`](Self::insert_knot).
    pub fn refine(&self, knots: &[f64]) -> Result<Self, SplineError> {
        let new = merged(self.knots(), knots)?;
        let points = apply(refinement(self.knots(), &new), self.control_points());
        Self::new(new, points)
    }
}

impl<S: Scalar, const P: usize, const D: usize> TensorSpline<S, P, D> {
    /// This spline with more knots along one axis (counted from 0), in any order.
    ///
    /// # Errors
    /// An axis that the spline does not have, a knot outside of the domain, or one that would stand more often than the
    /// degree.
    pub fn refine(&self, axis: usize, knots: &[f64]) -> Result<Self, SplineError> {
        let old = self.axes().get(axis).ok_or(SplineError::NoSuchAxis { axis, axes: P })?;
        let new = merged(old, knots)?;
        let rows = refinement(old, &new);
        self.along(axis, new, &rows)
    }

    /// This spline with `u`, a plain number as all knots are, inserted `times` more times among the knots of one axis.
    ///
    /// # Errors
    /// As [`refine`](Self::refine).
    pub fn insert_knot(&self, axis: usize, u: f64, times: usize) -> Result<Self, SplineError> {
        self.refine(axis, &vec![u; times])
    }

    /// Applies a map of one axis to every line of control points along it.
    pub(super) fn along(&self, axis: usize, knots: KnotVector, rows: &[MapRow]) -> Result<Self, SplineError> {
        let counts = self.counts();
        let stride: usize = counts[..axis].iter().product();
        let block = stride * counts[axis];
        let mut points = Vec::with_capacity(self.control_points().len() / counts[axis] * rows.len());
        for outer in (0..self.control_points().len()).step_by(block) {
            for row in rows {
                points.extend((0..stride).map(|inner| row.apply(self.control_points(), outer + inner, stride)));
            }
        }
        let mut axes = (**self.axes()).clone();
        axes[axis] = knots;
        Self::new(axes, points)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use num_dual::Dual64;
    use proptest::prelude::*;

    /// Curves of degree 1 to 6 with random and with repeated knots, clamped or not, control points in `[-1, 1]²`.
    pub(in super::super) fn any_curve() -> impl Strategy<Value = BSplineCurve<Dual64>> {
        let knots = (1usize..=6, proptest::collection::vec((0.01f64..1.0, 1usize..=6), 1..6), any::<bool>());
        knots
            .prop_map(|(p, steps, clamped)| {
                let mut at = -0.7;
                let mut knots = vec![at; p + 1];
                for (step, times) in &steps {
                    at += step;
                    knots.extend(vec![at; *times.min(&p)]);
                }
                let last = at + 0.5;
                if clamped {
                    knots.extend(vec![last; p + 1]);
                } else {
                    knots.extend((0..=p).map(|i| last + 0.3 * i as f64));
                    knots[0] -= 0.2;
                }
                KnotVector::new(p, knots).unwrap()
            })
            .prop_flat_map(|knots| {
                let n = knots.control_points();
                let number = || (-1.0f64..1.0, -1.0f64..1.0).prop_map(|(re, eps)| Dual64::new(re, eps));
                (Just(knots), proptest::collection::vec((number(), number()), n))
            })
            .prop_map(|(knots, points)| {
                BSplineCurve::new(knots, points.into_iter().map(|(x, y)| [x, y]).collect()).unwrap()
            })
    }

    /// Largest difference of two curves, values and derivative parts, at parameters of the first one's domain.
    pub(in super::super) fn difference(a: &BSplineCurve<Dual64>, b: &BSplineCurve<Dual64>) -> f64 {
        let (first, last) = a.domain();
        let mut worst = 0.0f64;
        for i in 0..=40 {
            let u = first + (last - first) * i as f64 / 40.0;
            for (p, q) in a.point_at(u).iter().zip(&b.point_at(u)) {
                worst = worst.max((p.re - q.re).abs()).max((p.eps - q.eps).abs());
            }
        }
        worst
    }

    proptest! {
        #[test]
        fn refinement_keeps_the_curve(curve in any_curve(), at in proptest::collection::vec(0.0f64..1.0, 0..8)) {
            let (first, last) = curve.domain();
            let inserted: Vec<f64> = at.iter().map(|t| first + t * (last - first)).collect();
            let refined = curve.refine(&inserted).unwrap();
            prop_assert_eq!(refined.control_points().len(), curve.control_points().len() + inserted.len());
            prop_assert!(difference(&curve, &refined) < 1e-13, "{}", difference(&curve, &refined));
        }

        #[test]
        fn insertion_up_to_the_degree_and_no_further(curve in any_curve(), t in 0.01f64..0.99) {
            let (first, last) = curve.domain();
            let u = first + t * (last - first);
            let p = curve.degree();
            prop_assume!(curve.knots().multiplicity(u) == 0);
            let refined = curve.insert_knot(u, p).unwrap();
            prop_assert!(difference(&curve, &refined) < 1e-13);
            // with multiplicity p the curve passes through a control point
            let hit = refined.control_points()[refined.knots().span(u) - p];
            let point = curve.point_at(u);
            prop_assert!((hit[0].re - point[0].re).abs() < 1e-14 && (hit[1].eps - point[1].eps).abs() < 1e-13);
            let refused = matches!(curve.insert_knot(u, p + 1), Err(SplineError::Multiplicity { .. }));
            prop_assert!(refused);
        }

        #[test]
        fn tensors_refine_along_each_axis(axis in 0usize..3, at in proptest::collection::vec(0.0f64..1.0, 1..4)) {
            let axes = [(2, 4), (3, 5), (1, 2)].map(|(p, n)| KnotVector::clamped_uniform(p, n).unwrap());
            let points = (0..40).map(|i| [i as f64, (i as f64).sin(), (i as f64 * 0.7).cos()]).collect();
            let volume = TensorSpline::<f64, 3, 3>::new(axes, points).unwrap();
            let mut distinct = at;
            distinct.sort_by(f64::total_cmp);
            distinct.dedup();
            distinct.retain(|u| *u > 0.0 && volume.axes()[axis].multiplicity(*u) == 0);
            let refined = volume.refine(axis, &distinct).unwrap();
            for u in [[0.0, 0.1, 1.0], [0.3, 0.5, 0.2], [0.99, 0.77, 0.4]] {
                for (a, b) in volume.evaluate(u).iter().zip(&refined.evaluate(u)) {
                    prop_assert!((a - b).abs() < 1e-13 * 40.0);
                }
            }
        }
    }

    #[test]
    fn distant_control_points_stay_bit_for_bit() {
        let knots = KnotVector::clamped_uniform(3, 12).unwrap();
        let points: Vec<[f64; 2]> = (0..12).map(|i| [i as f64 / 7.0, (i as f64).sin()]).collect();
        let curve = BSplineCurve::new(knots, points).unwrap();
        let refined = curve.insert_knot(0.05, 1).unwrap();
        assert_eq!(refined.control_points()[0], curve.control_points()[0]);
        assert_eq!(refined.control_points()[4..], curve.control_points()[3..]);
    }

    #[test]
    fn bad_knots_are_refused() {
        let axes = [KnotVector::clamped_uniform(1, 2).unwrap()];
        let line = TensorSpline::<f64, 1, 1>::new(axes, vec![[0.0], [1.0]]).unwrap();
        assert_eq!(line.refine(1, &[0.5]).unwrap_err(), SplineError::NoSuchAxis { axis: 1, axes: 1 });
        assert!(matches!(line.refine(0, &[1.5]), Err(SplineError::OutsideDomain { .. })));
        assert!(matches!(line.insert_knot(0, f64::NAN, 1), Err(SplineError::OutsideDomain { .. })));
        assert!(matches!(line.insert_knot(0, 1.0, 1), Err(SplineError::Multiplicity { .. })));
    }
}
