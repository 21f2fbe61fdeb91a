//! Cutting curves: in two, into Bézier pieces, and running them backwards.

use super::refine::{MapRow, apply, blossom};
use super::{BSplineCurve, KnotVector, SplineError};
use crate::scalar::Scalar;

impl<S: Scalar, const D: usize> BSplineCurve<S, D> {
    /// The two curves before and after a parameter strictly inside of the domain; each keeps its parameters.
    ///
    /// The control points may be of any scalar; `u` becomes a knot of both curves, and is a plain number as all knots
    /// are.
    ///
    /// # Errors
    /// `u` not strictly inside of the domain.
    pub fn split(&self, u: f64) -> Result<(Self, Self), SplineError> {
        let (first, last) = self.domain();
        if !(u > first && u < last) {
            return Err(SplineError::OutsideDomain { parameter: u, first, last });
        }
        let p = self.degree();
        let missing = p.saturating_sub(self.knots().multiplicity(u));
        let whole = self.insert_knot(u, missing)?;
        let (knots, points) = (whole.knots().as_slice(), whole.control_points());
        // the first of the p knots that stand at u; the curve passes there through the control point before it
        let at = knots.partition_point(|&k| k < u);
        let mut left = knots[..at + p].to_vec();
        left.push(u);
        let mut right = vec![u];
        right.extend_from_slice(&knots[at..]);
        Ok((
            Self::new(KnotVector::new(p, left)?, points[..at].to_vec())?,
            Self::new(KnotVector::new(p, right)?, points[at - 1..].to_vec())?,
        ))
    }

    /// The polynomial pieces, one per knot span that is not empty, each a curve without inner knots on its own span.
    ///
    /// # Errors
    /// None that a valid curve can meet.
    pub fn to_bezier(&self) -> Result<Vec<Self>, SplineError> {
        let p = self.degree();
        self.pieces().map(|(start, end, points)| Self::new(KnotVector::clamped(p, start, end, [])?, points)).collect()
    }

    /// Start, end and Bézier control points of the piece on each knot span that is not empty.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = (f64, f64, Vec<[S; D]>)> + '_ {
        let p = self.degree();
        self.knots().spans().map(move |(span, start, end)| {
            let points = (0..=p).map(|i| {
                let arguments = std::iter::repeat_n(start, p - i).chain(std::iter::repeat_n(end, i));
                MapRow { first: span - p, weights: blossom(self.knots(), span, arguments) }
            });
            (start, end, apply(points, self.control_points()))
        })
    }

    /// The curve run through backwards on the same domain: its point at `u` is that at `first + last - u`.
    ///
    /// # Errors
    /// Inner knots that differ by less than the round-off of `first + last` and would become one too many.
    pub fn reversed(&self) -> Result<Self, SplineError> {
        let (first, last) = self.domain();
        let knots = self.knots().as_slice().iter().rev().map(|&k| {
            // the ends of the domain exactly, whatever the sum rounds to
            match k {
                k if k == first => last,
                k if k == last => first,
                k if k > first && k < last => (first + last - k).clamp(first, last),
                k => first + last - k,
            }
        });
        let knots = KnotVector::new(self.degree(), knots.collect())?;
        Self::new(knots, self.control_points().iter().rev().copied().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::super::refine::tests::{any_curve, difference};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn halves_and_pieces_are_the_curve(curve in any_curve(), t in 0.01f64..0.99, at_knot in any::<bool>()) {
            let (first, last) = curve.domain();
            let inner = curve.knots().spans().nth(1).map(|(_, start, _)| start);
            let u = inner.filter(|_| at_knot).unwrap_or(first + t * (last - first));
            let (left, right) = curve.split(u).unwrap();
            prop_assert_eq!((left.domain(), right.domain()), ((first, u), (u, last)));
            prop_assert_eq!(left.control_points().last(), right.control_points().first());
            prop_assert!(difference(&left, &curve) < 1e-13);
            prop_assert!(difference(&right, &curve) < 1e-13);
            let pieces = curve.to_bezier().unwrap();
            prop_assert_eq!(pieces.len(), curve.knots().spans().count());
            for piece in pieces {
                prop_assert_eq!(piece.control_points().len(), curve.degree() + 1);
                let (a, b) = piece.domain();
                for s in [0.0, 0.1, 0.5, 0.9, 1.0] {
                    let u = a + s * (b - a);
                    for (p, q) in piece.point_at(u).iter().zip(&curve.point_at(u)) {
                        prop_assert!((p.re - q.re).abs() < 1e-13 && (p.eps - q.eps).abs() < 1e-13);
                    }
                }
            }
        }

        #[test]
        fn reversal_is_an_involution_and_mirrors_parameters(curve in any_curve()) {
            let back = curve.reversed().unwrap();
            prop_assert_eq!(back.domain(), curve.domain());
            let (first, last) = curve.domain();
            for t in [0.01, 0.233, 0.5123, 0.789, 1.0] {
                let u = first + t * (last - first);
                let (p, q) = (curve.point_at(u), back.point_at(first + last - u));
                prop_assert!((p[0].re - q[0].re).abs() < 1e-12 && (p[1].eps - q[1].eps).abs() < 1e-12);
            }
            prop_assert!(difference(&back.reversed().unwrap(), &curve) < 1e-12);
        }
    }

    #[test]
    fn no_cut_at_or_beyond_the_ends() {
        let curve = BSplineCurve::new(KnotVector::clamped_uniform(1, 2).unwrap(), vec![[0.0], [1.0]]).unwrap();
        for u in [0.0, 1.0, -1.0, f64::NAN] {
            assert!(matches!(curve.split(u), Err(SplineError::OutsideDomain { .. })));
        }
    }
}
