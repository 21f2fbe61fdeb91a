//! Area, centroid, second moments and perimeter.
//!
//! Contour integrals of the polynomial pieces, exact by Gauss quadrature of sufficient order. They are taken about the
//! first control point, so that nothing cancels far from the origin, and in the radial form `x dy − y dx`, to which the
//! base of a blunt trailing edge contributes nothing.

use crate::plane::{cross, length, minus};
use crate::scalar::Scalar;
use crate::section::{MeasureProblem, Section, SectionError, TrailingEdge};
use crate::spline::GaussRule;

/// Second moments of area about the centroid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SecondMoments<S> {
    /// `∫ (y − ȳ)² dA`: bending about the x direction.
    pub xx: S,
    /// `∫ (x − x̄)² dA`: bending about the y direction.
    pub yy: S,
    /// `∫ (x − x̄)(y − ȳ) dA`.
    pub xy: S,
}

impl<S: Scalar> Section<S> {
    /// Enclosed area, exact for the spline; positive for the counter-clockwise outline of a section.
    pub fn area(&self) -> S {
        let [twice] = self.moments(1, |_, swept| [swept]);
        twice / 2.0
    }

    /// Centroid of the enclosed area, exact for the spline.
    ///
    /// # Errors
    /// An area that is not positive.
    pub fn centroid(&self) -> Result<[S; 2], SectionError> {
        let [twice, x, y] = self.moments(2, |[x, y], swept| [swept, x * swept, y * swept]);
        let area = positive("centroid", twice / 2.0)?;
        let origin = self.trailing_edge_points()[0];
        Ok([origin[0] + x / (area * 3.0), origin[1] + y / (area * 3.0)])
    }

    /// Second moments of area about the centroid, exact for the spline.
    ///
    /// # Errors
    /// An area that is not positive.
    pub fn second_moments(&self) -> Result<SecondMoments<S>, SectionError> {
        let [twice, x, y, xx, yy, xy] = self.moments(3, |[x, y], swept| {
            let (sx, sy) = (x * swept, y * swept);
            [swept, sx, sy, y * sy, x * sx, x * sy]
        });
        let area = positive("second moment", twice / 2.0)?;
        // Steiner
        let about = |second: S, first: S| second / 4.0 - first / (area * 9.0);
        Ok(SecondMoments { xx: about(xx, y * y), yy: about(yy, x * x), xy: about(xy, x * y) })
    }

    /// Length of the outline, with the base of a blunt trailing edge, to about 1e-14 of itself.
    ///
    /// # Errors
    /// A derivative is asked for where the curve stands still, or where the base of a blunt trailing edge has no
    /// length.
    pub fn perimeter(&self) -> Result<S, SectionError> {
        let curve = self.curve().arc_lengths()?.total();
        if self.trailing_edge() == TrailingEdge::Sharp {
            return Ok(curve);
        }
        let [a, b] = self.trailing_edge_points();
        let base = length(minus(a, b));
        if S::NDERIV > 0 && base.re() == 0.0 {
            let reason = MeasureProblem::Singular;
            return Err(SectionError::NoMeasure { measure: "derivative of the perimeter", reason });
        }
        Ok(curve + base)
    }

    /// `∮ f(p, x dy − y dx)` with `p = (x, y)` from the first control point; `f` is linear in its second argument and
    /// of degree below `order` in `p`.
    fn moments<const N: usize>(&self, order: usize, f: impl Fn([S; 2], S) -> [S; N]) -> [S; N] {
        let curve = self.curve();
        let origin = self.trailing_edge_points()[0];
        // the integrand has degree (order + 1) p − 1 on each span, n points are exact to 2n − 1
        let rule = GaussRule::new((curve.degree() * (order + 1)).div_ceil(2));
        let mut sums = [S::from(0.0); N];
        for (_, start, end) in curve.knots().spans() {
            for (u, weight) in rule.on(start, end) {
                let p = minus(curve.point_at(u), origin);
                let swept = cross(p, curve.tangent_at(u)) * weight;
                for (sum, value) in sums.iter_mut().zip(f(p, swept)) {
                    *sum += value;
                }
            }
        }
        sums
    }
}

/// An area, if it is positive.
fn positive<S: Scalar>(measure: &'static str, area: S) -> Result<S, SectionError> {
    if area.re() > 0.0 {
        Ok(area)
    } else {
        Err(SectionError::NoMeasure { measure, reason: MeasureProblem::NoArea { area: area.re() } })
    }
}
