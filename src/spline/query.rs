//! Questions to curves: extent, nearest point, parameter at a coordinate, curvature.
//!
//! Searches run on the real parts, by exact isolation of the roots of Bézier pieces; the answer is then lifted to the
//! scalar of the curve by the implicit function theorem.

use super::roots::{bracketed, isolate, isolated, product, slopes};
use super::{BSplineCurve, SplineError};
use crate::differentiate::lift_root;
use crate::scalar::Scalar;
use num_dual::{Dual64, first_derivative};

/// An axis-parallel box: its two extreme corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingBox<S, const D: usize = 2> {
    /// Smallest coordinate in each direction.
    pub lower: [S; D],
    /// Largest coordinate in each direction.
    pub upper: [S; D],
}

impl<S: Scalar, const D: usize> BoundingBox<S, D> {
    fn of(first: [S; D], rest: &[[S; D]]) -> Self {
        let mut result = Self { lower: first, upper: first };
        for point in rest {
            for (axis, coordinate) in point.iter().enumerate() {
                result.include(axis, *coordinate);
            }
        }
        result
    }

    fn include(&mut self, axis: usize, coordinate: S) {
        if coordinate < self.lower[axis] {
            self.lower[axis] = coordinate;
        }
        if coordinate > self.upper[axis] {
            self.upper[axis] = coordinate;
        }
    }
}

/// The point of a curve nearest to a given one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoint<S, const D: usize = 2> {
    /// Parameter of the nearest point.
    pub parameter: S,
    /// The nearest point itself.
    pub point: [S; D],
    /// Square of the distance; smooth also where the distance is zero.
    pub squared_distance: S,
}

impl<S: Scalar, const D: usize> ClosestPoint<S, D> {
    /// The distance. At distance zero, where it has a kink, its derivatives are not finite.
    pub fn distance(&self) -> S {
        self.squared_distance.sqrt()
    }
}

impl<S: Scalar, const D: usize> BSplineCurve<S, D> {
    /// The bounding box of the control points, which contains the curve.
    pub fn bounding_box(&self) -> BoundingBox<S, D> {
        // a curve has control points
        let points = self.control_points();
        BoundingBox::of(points[0], &points[1..])
    }

    /// The smallest box that contains the curve, from the extrema of each coordinate.
    ///
    /// Differentiable except where two extrema of a coordinate are equal.
    ///
    /// # Errors
    /// [`SplineError::NoDerivative`] where second derivatives are wanted and the curve has no curvature at an extremum.
    pub fn tight_bounding_box(&self) -> Result<BoundingBox<S, D>, SplineError> {
        let (first, last) = self.domain();
        let mut result = BoundingBox::of(self.point_at(first), &[]);
        let real = self.real();
        for piece in real.to_bezier()? {
            let (start, end) = piece.domain();
            for axis in 0..D {
                let coefficients: Vec<f64> = piece.control_points().iter().map(|p| p[axis]).collect();
                let noise = 1e-15 * coefficients.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
                let mut extrema = vec![];
                isolate(&slopes(&coefficients), noise, |low, high, rising| {
                    let range = [low, high].map(|t| start + t * (end - start));
                    extrema.push(isolated(range[0], range[1], rising, |u| {
                        let rows = piece.derivatives(u, 2);
                        (rows[1][axis], rows[2][axis])
                    }));
                });
                for u in extrema {
                    let at = piece.point_at(u)[axis];
                    if at < result.lower[axis].re() || at > result.upper[axis].re() {
                        result.include(axis, self.extremum(axis, u)?);
                    }
                }
            }
            let (before, after) = (piece.tangent_at(end), real.tangent_at(end));
            for (axis, coordinate) in self.point_at(end).into_iter().enumerate() {
                let noise = 1e-12 * piece.control_points().iter().fold(0.0, |m: f64, p| m.max(p[axis].abs()));
                let slope = before[axis].abs().max(after[axis].abs()) * (end - start);
                // an extremum at a knot moves away from it
                let outside = coordinate < result.lower[axis] || coordinate > result.upper[axis];
                let moves = end < last && outside && slope <= noise;
                result.include(axis, if moves { self.extremum(axis, end)? } else { coordinate });
            }
        }
        Ok(result)
    }

    /// The value of a coordinate where its slope vanishes, with derivatives.
    fn extremum(&self, axis: usize, root: f64) -> Result<S, SplineError> {
        // the first derivative of an extremum does not depend on where it moves
        if S::NDERIV < 2 {
            return Ok(self.point_at(root)[axis]);
        }
        let bend = || self.real().derivatives(root, 2)[2][axis];
        let u = lift_root(root, bend, |u: S| self.point_and_tangent(u).1[axis]);
        Ok(self.evaluate(u.map_err(|_| SplineError::NoDerivative { parameter: root })?)[axis])
    }

    /// The point of the curve nearest to `point`, over the whole curve.
    ///
    /// All candidates of all pieces are found, so the result is the global minimum (any of several equal ones). Where
    /// the nearest point is an end of the curve or a corner, its parameter carries no derivatives.
    ///
    /// ```
    /// use aeroform::spline::{BSplineCurve, KnotVector};
    /// let knots = KnotVector::clamped_uniform(2, 3).unwrap();
    /// let parabola = BSplineCurve::new(knots, vec![[-1.0, 1.0], [0.0, -1.0], [1.0, 1.0]]).unwrap();
    /// let nearest = parabola.closest_point([0.0, -2.0]).unwrap();
    /// assert!((nearest.parameter - 0.5f64).abs() < 1e-15 && (nearest.distance() - 2.0f64).abs() < 1e-15);
    /// ```
    ///
    /// # Errors
    /// A point that is not finite; [`SplineError::NoDerivative`] where derivatives are wanted and the given point is
    /// the centre of curvature of the nearest one.
    pub fn closest_point(&self, point: impl Into<[S; D]>) -> Result<ClosestPoint<S, D>, SplineError> {
        let point = point.into();
        let centre = point.map(|c| c.re());
        if centre.iter().any(|c| !c.is_finite()) {
            return Err(SplineError::NotFinite { index: 0 });
        }
        let real = self.real();
        let found = nearest(&real, &centre)?;
        let mut parameter = S::from(found.parameter);
        if found.stationary {
            let slope = || {
                let slope = distance_slope(&real, &centre, found.parameter).1;
                let tangent = real.tangent_at(found.parameter);
                // at a nearest point the slope is positive, or round-off of nothing
                if slope <= 1e-14 * dot(&tangent, &tangent) { 0.0 } else { slope }
            };
            parameter = lift_root(found.parameter, slope, |u: S| foot(self.point_and_tangent(u), point))
                .map_err(|_| SplineError::NoDerivative { parameter: found.parameter })?;
        }
        let on = self.evaluate(parameter);
        let squared_distance = (0..D).map(|d| (on[d] - point[d]).squared()).sum();
        Ok(ClosestPoint { parameter, point: on, squared_distance })
    }

    /// The parameter between `low` and `high` at which a coordinate (counted from 0) takes a value.
    ///
    /// The coordinate must be below the value at one end of the range and above it at the other; of several crossings
    /// one is found.
    ///
    /// # Errors
    /// A coordinate that the curve does not have, a range outside of the domain, [`SplineError::NoCrossing`];
    /// [`SplineError::NoDerivative`] where derivatives are wanted and the curve crosses the value tangentially.
    pub fn parameter_at_coordinate(&self, axis: usize, value: S, low: f64, high: f64) -> Result<S, SplineError> {
        if axis >= D {
            return Err(SplineError::NoSuchAxis { axis, axes: D });
        }
        let (first, last) = self.domain();
        for parameter in [low, high] {
            if !(first..=last).contains(&parameter) {
                return Err(SplineError::OutsideDomain { parameter, first, last });
            }
        }
        let real = self.real();
        let wanted = value.re();
        let (at_low, at_high) = (real.point_at(low)[axis], real.point_at(high)[axis]);
        if !(at_low.min(at_high) <= wanted && wanted <= at_low.max(at_high)) {
            return Err(SplineError::NoCrossing { axis, value: wanted, low, high, at_low, at_high });
        }
        let root = bracketed(low.min(high), low.max(high), |u| {
            let (point, tangent) = real.point_and_tangent(u);
            (point[axis] - wanted, tangent[axis])
        });
        lift_root(root, || real.tangent_at(root)[axis], |u: S| self.evaluate(u)[axis] - value)
            .map_err(|_| SplineError::NoDerivative { parameter: root })
    }
}

impl<S: Scalar> BSplineCurve<S, 2> {
    /// Signed curvature at `u`, in one over the units of length; positive where the curve turns left (anticlockwise).
    ///
    /// # Errors
    /// [`SplineError::ZeroTangent`] where the curve stands still.
    pub fn curvature(&self, u: S) -> Result<S, SplineError> {
        let rows = self.derivatives(u, 2);
        let ([dx, dy], [ddx, ddy]) = (rows[1], rows[2]);
        let squared_speed = dx.squared() + dy.squared();
        if squared_speed.re() == 0.0 {
            return Err(SplineError::ZeroTangent { parameter: u.re() });
        }
        Ok((dx * ddy - dy * ddx) / (squared_speed * squared_speed.sqrt()))
    }

    /// Angle of the tangent to the first axis at `u`, in radians, in (−π, π].
    ///
    /// # Errors
    /// [`SplineError::ZeroTangent`] where the curve stands still.
    pub fn tangent_angle(&self, u: S) -> Result<S, SplineError> {
        let [dx, dy] = self.point_and_tangent(u).1;
        if dx.re() == 0.0 && dy.re() == 0.0 {
            return Err(SplineError::ZeroTangent { parameter: u.re() });
        }
        Ok(dy.angle(dx))
    }
}

struct Nearest {
    parameter: f64,
    /// Whether the distance has a vanishing slope there; not at an end or a corner.
    stationary: bool,
}

/// The global minimum of the distance, on real numbers.
fn nearest<const D: usize>(curve: &BSplineCurve<f64, D>, centre: &[f64; D]) -> Result<Nearest, SplineError> {
    let mut pieces: Vec<_> = curve
        .to_bezier()?
        .into_iter()
        .map(|piece| {
            let coefficients = squared_distance(&piece, centre);
            // the coefficients enclose the polynomial
            let bound = coefficients.iter().copied().fold(f64::INFINITY, f64::min);
            (bound, piece, coefficients)
        })
        .collect();
    pieces.sort_by(|a, b| a.0.total_cmp(&b.0));
    let distance_at = |u: f64| curve.point_at(u).iter().zip(centre).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let (first, _) = curve.domain();
    let mut best = (distance_at(first), first, false);
    for (bound, piece, coefficients) in pieces {
        let scale = coefficients.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        if bound > best.0 + 1e-15 * scale {
            break;
        }
        let (start, end) = piece.domain();
        isolate(&slopes(&coefficients), 1e-15 * scale, |low, high, rising| {
            let range = [low, high].map(|t| start + t * (end - start));
            let u = isolated(range[0], range[1], rising, |u| distance_slope(&piece, centre, u));
            let distance = distance_at(u);
            // a foot of a perpendicular wins over an end that is as near up to round-off
            let tie = if best.2 { 0.0 } else { 1e-15 * scale };
            if distance <= best.0 + tie {
                best = (distance, u, true);
            }
        });
        for u in [start, end] {
            let distance = distance_at(u);
            if distance < best.0 - 1e-15 * scale {
                best = (distance, u, is_foot(curve, centre, u));
            }
        }
    }
    Ok(Nearest { parameter: best.1, stationary: best.2 })
}

/// Whether the distance has a vanishing slope at a knot inside of the domain, from both sides.
fn is_foot<const D: usize>(curve: &BSplineCurve<f64, D>, centre: &[f64; D], u: f64) -> bool {
    let (first, last) = curve.domain();
    let flat = |curve: &BSplineCurve<f64, D>| {
        let (point, tangent) = curve.point_and_tangent(u);
        let away: [f64; D] = std::array::from_fn(|d| point[d] - centre[d]);
        dot(&away, &tangent).abs() <= 1e-7 * (dot(&away, &away) * dot(&tangent, &tangent)).sqrt()
    };
    // the end polynomial of the left part is evaluated at its own end
    u > first && u < last && curve.split(u).is_ok_and(|(left, right)| flat(&left) && flat(&right))
}

/// Half the derivative of the squared distance of a point of a curve, given with its tangent, from `centre`.
pub(crate) fn foot<S: Scalar, const D: usize>((on, tangent): ([S; D], [S; D]), centre: [S; D]) -> S {
    (0..D).map(|d| (on[d] - centre[d]) * tangent[d]).sum()
}

/// Half the derivative of the squared distance from `centre` at `u`, and the slope of that.
pub(crate) fn distance_slope<const D: usize>(curve: &BSplineCurve<f64, D>, centre: &[f64; D], u: f64) -> (f64, f64) {
    first_derivative(|u: Dual64| foot(curve.point_and_tangent(u), centre.map(Dual64::from)), u)
}

/// Bernstein coefficients of the squared distance of a Bézier piece from a point.
fn squared_distance<const D: usize>(piece: &BSplineCurve<f64, D>, centre: &[f64; D]) -> Vec<f64> {
    let mut sum = vec![0.0; 2 * piece.degree() + 1];
    for (d, c) in centre.iter().enumerate() {
        let away: Vec<f64> = piece.control_points().iter().map(|p| p[d] - c).collect();
        for (s, x) in sum.iter_mut().zip(product(&away, &away)) {
            *s += x;
        }
    }
    sum
}

fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::super::refine::tests::any_curve;
    use super::*;
    use crate::differentiate::{StepRange, VectorFunction, finite_difference, finite_difference_jacobian, jacobian};
    use crate::spline::KnotVector;
    use num_dual::{Dual2_64, Dual64};
    use proptest::prelude::*;

    /// Points of every span, its ends included.
    fn samples(curve: &BSplineCurve<f64>) -> Vec<[f64; 2]> {
        let spans = curve.knots().spans();
        spans.flat_map(|(_, a, b)| (0..=400).map(move |i| curve.point_at(a + (b - a) * i as f64 / 400.0))).collect()
    }

    proptest! {
        #[test]
        fn the_closest_point_beats_every_sample(curve in any_curve(), x in -1.5f64..1.5, y in -1.5f64..1.5) {
            let curve = curve.real();
            let found = curve.closest_point([x, y]).unwrap();
            let best = samples(&curve).iter().map(|[a, b]| (a - x).hypot(b - y)).fold(f64::INFINITY, f64::min);
            prop_assert!(found.distance() <= best + 1e-14, "{} {best}", found.distance());
            let [a, b] = curve.point_at(found.parameter);
            prop_assert!(((a - x).hypot(b - y) - found.distance()).abs() < 1e-14);
        }

        #[test]
        fn points_on_the_curve_are_found(curve in any_curve(), t in 0.0f64..=1.0) {
            let curve = curve.real();
            let (first, last) = curve.domain();
            let found = curve.closest_point(curve.point_at(first + t * (last - first))).unwrap();
            prop_assert!(found.distance() < 1e-13, "{}", found.distance());
        }

        #[test]
        fn boxes_are_tight(curve in any_curve()) {
            let curve = curve.real();
            let (outer, tight) = (curve.bounding_box(), curve.tight_bounding_box().unwrap());
            let points = samples(&curve);
            let sampled = BoundingBox::of(points[0], &points);
            for d in 0..2 {
                prop_assert!(outer.lower[d] <= tight.lower[d] + 1e-14 && tight.upper[d] <= outer.upper[d] + 1e-14);
                prop_assert!(tight.lower[d] <= sampled.lower[d] + 1e-14 && sampled.upper[d] <= tight.upper[d] + 1e-14);
                // samples miss an extremum by the square of their spacing
                prop_assert!(sampled.lower[d] - tight.lower[d] < 1e-3 && tight.upper[d] - sampled.upper[d] < 1e-3);
            }
        }
    }

    fn points<S: Scalar>(x: &[S]) -> Vec<[S; 2]> {
        let base = [[0.0, 0.0], [0.1, 0.6], [0.5, 0.7], [0.8, -0.4], [1.2, 0.1], [1.5, 0.9]];
        base.iter().enumerate().map(|(i, p)| [x[2 * i] + p[0], x[2 * i + 1] + p[1]]).collect()
    }

    /// Everything that a query returns, as a function of all control points and of the query itself.
    struct Queries;
    impl VectorFunction for Queries {
        type Error = SplineError;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SplineError> {
            let curve = BSplineCurve::new(KnotVector::clamped(3, 0.0, 2.0, [0.5, 1.1])?, points(x))?;
            let near = curve.closest_point([x[12] + 0.6, x[13] + 0.9])?;
            let tight = curve.tight_bounding_box()?;
            Ok(vec![
                near.parameter,
                near.point[0],
                near.point[1],
                near.distance(),
                tight.lower[1],
                tight.upper[1],
                curve.parameter_at_coordinate(0, x[12] + 0.7, 0.0, 2.0)?,
                curve.curvature(x[13] + 0.8)?,
                curve.tangent_angle(x[13] + 0.8)?,
            ])
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let x = [0.0; 14];
        let (values, exact) = jacobian(&Queries, &x).unwrap();
        assert_eq!(values, Queries.evaluate(&x).unwrap());
        let steps = [StepRange::for_scale(0.5); 14];
        let checked = finite_difference_jacobian(|x| Queries.evaluate(x), &x, &steps).unwrap();
        for (e, c) in exact.iter().zip(checked.iter()) {
            assert!((e - c.value).abs() <= c.error, "{e} {c:?}");
            assert!(c.error < 1e-7 * (1.0 + e.abs()), "{c:?}");
        }
    }

    #[test]
    fn an_extremum_at_a_knot_moves_away_from_it() {
        fn lowest<S: Scalar>(x: S) -> S {
            let mut points = [1.0, 0.0, -1.0, 0.0, 1.0].map(|y| [S::from(y); 2]).to_vec();
            points[1][1] += x;
            let curve = BSplineCurve::new(KnotVector::clamped_uniform(3, 5).unwrap(), points).unwrap();
            curve.tight_bounding_box().unwrap().lower[1]
        }
        let exact = lowest(Dual2_64::from(0.0).derivative());
        let slope = |x: f64| Ok::<_, SplineError>(lowest(Dual64::new(x, 1.0)).eps);
        let steps = StepRange { first: 1e-3, levels: 6 };
        let estimate = finite_difference(slope, 0.0, steps).unwrap();
        assert!(exact.v2 < -1e-3, "{exact}");
        assert!((exact.v2 - estimate.value).abs() <= 1e-6 + 10.0 * estimate.error, "{exact} {estimate:?}");
    }

    #[test]
    fn second_derivatives_are_lifted_too() {
        fn queries<S: Scalar>(x: S) -> [S; 3] {
            let mut points = points(&[S::from(0.0); 12]);
            points[2][1] += x;
            let curve = BSplineCurve::new(KnotVector::clamped(3, 0.0, 2.0, [0.5, 1.1]).unwrap(), points).unwrap();
            let near = curve.closest_point([x + 0.6, S::from(0.9)]).unwrap();
            let crossing = curve.parameter_at_coordinate(0, x + 0.7, 0.0, 2.0).unwrap();
            [near.parameter, crossing, curve.tight_bounding_box().unwrap().upper[1]]
        }
        let second = queries(Dual2_64::from(0.0).derivative());
        for (k, exact) in second.iter().enumerate() {
            let slope = |x: f64| Ok::<_, SplineError>(queries(Dual64::new(x, 1.0))[k].eps);
            let estimate = finite_difference(slope, 0.0, StepRange::for_scale(0.5)).unwrap();
            assert!((exact.v2 - estimate.value).abs() <= estimate.error, "{k} {} {estimate:?}", exact.v2);
            assert!(estimate.error < 1e-7);
        }
    }

    #[test]
    fn ends_and_corners_carry_no_derivative_but_the_point_does() {
        let corner = |x: f64| {
            let points = [[-1.0, -1.0], [0.0, x], [1.0, -1.0]].map(|p| p.map(Dual64::from)).to_vec();
            BSplineCurve::new(KnotVector::clamped_uniform(1, 3).unwrap(), points).unwrap()
        };
        let near = corner(0.0).closest_point([Dual64::new(0.1, 1.0), Dual64::from(1.0)]).unwrap();
        assert_eq!((near.parameter.re, near.parameter.eps), (0.5, 0.0));
        assert!((near.distance().eps - 0.1 / 1.01f64.sqrt()).abs() < 1e-15);
        let end = corner(0.0).closest_point([Dual64::new(3.0, 1.0), Dual64::from(-1.0)]).unwrap();
        assert_eq!((end.parameter.re, end.parameter.eps, end.distance().eps), (1.0, 0.0, 1.0));
    }

    #[test]
    fn a_circle_is_equally_near_everywhere() {
        // degenerate on purpose: the squared distance is almost constant
        let k = 4.0 / 3.0 * (std::f64::consts::PI / 8.0).tan();
        let quarter = vec![[1.0, 0.0], [1.0, k], [k, 1.0], [0.0, 1.0]];
        let arc = BSplineCurve::new(KnotVector::clamped_uniform(3, 4).unwrap(), quarter).unwrap();
        assert!((arc.closest_point([0.0, 0.0]).unwrap().distance() - 1.0).abs() < 1e-15);
        assert!((arc.curvature(0.5).unwrap() - 1.0).abs() < 1e-2, "{}", arc.curvature(0.5).unwrap());
        assert!((arc.tangent_angle(0.5).unwrap() - 0.75 * std::f64::consts::PI).abs() < 1e-15);
        assert!(arc.reversed().unwrap().curvature(0.3).unwrap() < 0.0);
    }

    #[test]
    fn bad_input_is_refused() {
        use SplineError as E;
        let curve = BSplineCurve::new(KnotVector::clamped_uniform(3, 6).unwrap(), points(&[0.0; 12])).unwrap();
        assert!(matches!(curve.closest_point([f64::NAN, 0.0]), Err(E::NotFinite { .. })));
        assert!(matches!(curve.parameter_at_coordinate(2, 0.5, 0.0, 1.0), Err(E::NoSuchAxis { .. })));
        assert!(matches!(curve.parameter_at_coordinate(0, 0.5, 0.0, 1.5), Err(E::OutsideDomain { .. })));
        assert!(matches!(curve.parameter_at_coordinate(0, 5.0, 0.0, 1.0), Err(E::NoCrossing { .. })));
        assert!(matches!(curve.parameter_at_coordinate(0, f64::NAN, 0.0, 1.0), Err(E::NoCrossing { .. })));
        let dot = BSplineCurve::new(KnotVector::clamped_uniform(3, 4).unwrap(), vec![[1.0, 1.0]; 4]).unwrap();
        assert!(matches!(dot.curvature(0.5), Err(E::ZeroTangent { .. })));
        assert!(matches!(dot.tangent_angle(0.5), Err(E::ZeroTangent { .. })));
    }
}
