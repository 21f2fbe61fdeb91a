//! Analytic curves as B-splines: segments exactly, arcs of circles and ellipses within a tolerance.
//!
//! Splines here are polynomial, so an arc is approximated by cubic pieces of equal sweep, with continuous tangent and
//! curvature. Sizes and positions are of any scalar; angles are plain numbers. The number of pieces follows from the
//! tolerance and the real size: where it changes, the spline jumps by less than the tolerance.

use super::roots::{isolate, isolated, product, slopes};
use super::{BSplineCurve, KnotVector, SplineError};
use crate::scalar::Scalar;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Most pieces an arc is cut into; the error of a full circle is round-off long before.
const MOST_PIECES: usize = 4096;

/// A spline and how far it is from the curve it stands for.
#[derive(Debug, Clone, PartialEq)]
pub struct Approximation<S, const D: usize = 2> {
    /// The spline, on the parameters [0, 1].
    pub curve: BSplineCurve<S, D>,
    /// Largest distance of the spline from the curve, in units of length.
    pub error: f64,
}

/// The straight line from `start` to `end`, of degree 1 on [0, 1]; elevate its degree where more is wanted.
///
/// # Errors
/// A point that is not finite.
pub fn line_segment<S: Scalar, const D: usize>(
    start: impl Into<[S; D]>,
    end: impl Into<[S; D]>,
) -> Result<BSplineCurve<S, D>, SplineError> {
    BSplineCurve::new(KnotVector::clamped_uniform(1, 2)?, vec![start.into(), end.into()])
}

/// An arc of a circle between two angles from the x axis (radians), within `tolerance` of it; clockwise where
/// `to < from`.
///
/// C1 in the parameter, with continuous curvature; ends and joints lie on the circle.
///
/// ```
/// use aeroform::spline::circular_arc;
/// let nose = circular_arc([0.02, 0.0], 0.02, 1.57, 4.71, 1e-9).unwrap();
/// assert!(nose.error <= 1e-9);
/// let [x, y] = nose.curve.evaluate(0.3);
/// assert!(((x - 0.02f64).hypot(y) - 0.02).abs() <= nose.error);
/// ```
///
/// # Errors
/// A radius that is not positive, a sweep of zero or more than a full turn, numbers that are not finite,
/// [`SplineError::ToleranceNotReached`] for a tolerance near round-off.
pub fn circular_arc<S: Scalar>(
    center: impl Into<[S; 2]>,
    radius: S,
    from: f64,
    to: f64,
    tolerance: f64,
) -> Result<Approximation<S>, SplineError> {
    elliptic_arc(center, [radius; 2], S::from(0.0), from, to, tolerance)
}

/// An arc of an ellipse: `center + R(inclination) (a cos t, b sin t)` for `t` between two eccentric anomalies (radians)
/// and `semi_axes = [a, b]`, within `tolerance`; clockwise where `to < from`.
///
/// The affine image of [`circular_arc`], linear in centre and semi-axes; tangent and curvature are continuous.
///
/// # Errors
/// As [`circular_arc`].
pub fn elliptic_arc<S: Scalar>(
    center: impl Into<[S; 2]>,
    semi_axes: [S; 2],
    inclination: S,
    from: f64,
    to: f64,
    tolerance: f64,
) -> Result<Approximation<S>, SplineError> {
    for axis in semi_axes {
        if !(axis.re() > 0.0 && axis.re().is_finite()) {
            return Err(SplineError::BadRadius { value: axis.re() });
        }
    }
    let center = center.into();
    let sweep = to - from;
    // a full turn may come as a difference that rounds above it
    let most = TAU * (1.0 + 4.0 * f64::EPSILON);
    if !(sweep != 0.0 && sweep.abs() <= most && from.is_finite()) {
        return Err(SplineError::BadSweep { from, to });
    }
    let largest = semi_axes[0].re().max(semi_axes[1].re());
    let (pieces, error) = pieces_for(sweep.abs(), tolerance / largest, largest)?;
    let (sine, cosine) = inclination.sin_cos();
    let place = |[x, y]: [f64; 2]| {
        let (along, across) = (semi_axes[0] * x, semi_axes[1] * y);
        [center[0] + along * cosine - across * sine, center[1] + along * sine + across * cosine]
    };
    let mut points: Vec<[S; 2]> = unit_arc(from, sweep, pieces).into_iter().map(place).collect();
    if sweep.abs() >= TAU * (1.0 - 4.0 * f64::EPSILON) {
        // a full turn ends where it starts, to the bit
        let last = points.len() - 1;
        points[last] = points[0];
    }
    let joints = (1..pieces).flat_map(|i| [i as f64 / pieces as f64; 2]);
    Ok(Approximation { curve: BSplineCurve::new(KnotVector::clamped(3, 0.0, 1.0, joints)?, points)?, error })
}

/// A full ellipse, anticlockwise from the end of its first semi-axis, within `tolerance`. See [`elliptic_arc`].
///
/// # Errors
/// As [`circular_arc`].
pub fn ellipse<S: Scalar>(
    center: impl Into<[S; 2]>,
    semi_axes: [S; 2],
    inclination: S,
    tolerance: f64,
) -> Result<Approximation<S>, SplineError> {
    elliptic_arc(center, semi_axes, inclination, 0.0, TAU, tolerance)
}

/// Distance from the ends of a unit arc to its inner control points, along the tangents (Goldapp 1991).
fn handle(sweep: f64) -> f64 {
    4.0 / 3.0 * (0.25 * sweep).tan()
}

/// Control points of an arc of the unit circle in equal cubic pieces, double knots at the joints.
fn unit_arc(from: f64, sweep: f64, pieces: usize) -> Vec<[f64; 2]> {
    let step = sweep / pieces as f64;
    let k = handle(step);
    let mut points = vec![];
    for i in 0..=pieces {
        let (y, x) = (from + step * i as f64).sin_cos();
        // a joint itself is the middle of its two neighbours, so that a double knot needs no control point there
        if i == 0 {
            points.push([x, y]);
        } else {
            points.push([x + k * y, y - k * x]);
        }
        if i == pieces {
            points.push([x, y]);
        } else {
            points.push([x - k * y, y + k * x]);
        }
    }
    points
}

/// Number of pieces that keep a unit arc within `tolerance`, and the error times `scale`.
fn pieces_for(sweep: f64, tolerance: f64, scale: f64) -> Result<(usize, f64), SplineError> {
    let mut pieces = (sweep / FRAC_PI_2).ceil().max(1.0) as usize;
    loop {
        let error = radial_error(sweep / pieces as f64);
        if error <= tolerance {
            return Ok((pieces, error * scale));
        }
        // the error falls with the sixth power of the sweep
        let ratio = (error / tolerance).powf(1.0 / 6.0);
        let more = (pieces as f64 * ratio).min(MOST_PIECES as f64).ceil() as usize;
        if pieces >= MOST_PIECES || tolerance <= 0.0 || tolerance.is_nan() {
            return Err(SplineError::ToleranceNotReached {
                error: error * scale,
                control_points: 2 * pieces + 2,
                tolerance: tolerance * scale,
            });
        }
        pieces = more.max(pieces + 1);
    }
}

/// Largest deviation from the unit circle of the cubic piece with a given sweep.
fn radial_error(sweep: f64) -> f64 {
    let k = handle(sweep);
    let (y, x) = sweep.sin_cos();
    let points = [[1.0, 0.0], [1.0, k], [x + k * y, y - k * x], [x, y]];
    let coordinate = |d: usize| points.map(|p| p[d]);
    let squared: Vec<f64> = product(&coordinate(0), &coordinate(0))
        .iter()
        .zip(product(&coordinate(1), &coordinate(1)))
        .map(|(a, b)| a + b)
        .collect();
    let radius = |t: f64| bernstein(&coordinate(0), t).hypot(bernstein(&coordinate(1), t));
    let (slope, bend) = (slopes(&squared), slopes(&slopes(&squared)));
    // ends and joints are on the circle up to round-off
    let mut worst = f64::EPSILON;
    isolate(&slope, 1e-15, |low, high, rising| {
        let t = isolated(low, high, rising, |t| (bernstein(&slope, t), bernstein(&bend, t)));
        worst = worst.max((radius(t) - 1.0).abs());
    });
    worst
}

/// A polynomial from its Bernstein coefficients (de Casteljau).
fn bernstein(coefficients: &[f64], t: f64) -> f64 {
    let mut values = coefficients.to_vec();
    for level in (1..values.len()).rev() {
        for i in 0..level {
            values[i] += t * (values[i + 1] - values[i]);
        }
    }
    values[0]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::{StepRange, VectorFunction, finite_difference_jacobian, jacobian};
    use std::f64::consts::PI;

    #[test]
    fn the_requested_error_is_kept_and_the_reported_one_met() {
        for tolerance in [1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12] {
            let circle = ellipse([0.3, -0.2], [2.0, 2.0], 0.4, 2.0 * tolerance).unwrap();
            let n = 20_000;
            let worst = (0..=n)
                .map(|i| {
                    let [x, y] = circle.curve.point_at(i as f64 / n as f64);
                    (f64::hypot(x - 0.3, y + 0.2) - 2.0).abs()
                })
                .fold(0.0, f64::max);
            assert!(circle.error <= 2.0 * tolerance);
            assert!(worst <= circle.error + 2e-15, "{worst} {}", circle.error);
            assert!(worst >= 0.9 * circle.error - 2e-15, "{worst} {}", circle.error);
            // one piece fewer would not do: close to the sixth-order law
            let pieces = (circle.curve.control_points().len() - 2) / 2;
            assert!(pieces as f64 <= 2.0 + 4.0 * (2.8e-4 / tolerance).powf(1.0 / 6.0), "{pieces} at {tolerance}");
        }
    }

    #[test]
    fn a_quarter_circle_has_the_known_error() {
        // maximum of the standard quarter: 1.000273
        assert!((radial_error(FRAC_PI_2) - 2.725_3e-4).abs() < 1e-8, "{}", radial_error(FRAC_PI_2));
    }

    #[test]
    fn an_inclined_ellipse_stays_within_its_error() {
        let (a, b, turn) = (1.5, 0.2, 0.3);
        let arc = elliptic_arc([1.0, 2.0], [a, b], turn, 2.0, -1.0, 1e-7).unwrap();
        for i in 0..=500 {
            let [x, y] = arc.curve.point_at(i as f64 / 500.0);
            let (x, y) = (x - 1.0, y - 2.0);
            let (u, v) = (x * f64::cos(turn) + y * f64::sin(turn), y * f64::cos(turn) - x * f64::sin(turn));
            // radial deviation in the circle's plane, times the largest axis, bounds the distance
            assert!((f64::hypot(u / a, v / b) - 1.0).abs() * a <= arc.error + 1e-15);
        }
        // clockwise: curvature is negative
        assert!(arc.curve.curvature(0.4).unwrap() < 0.0);
        let end = arc.curve.point_at(1.0);
        let (u, v) = (a * f64::cos(-1.0), b * f64::sin(-1.0));
        assert!((end[0] - 1.0 - u * f64::cos(turn) + v * f64::sin(turn)).abs() < 1e-15);
        assert!((end[1] - 2.0 - u * f64::sin(turn) - v * f64::cos(turn)).abs() < 1e-15);
    }

    #[test]
    fn closed_smooth_and_of_the_right_length() {
        let circle = ellipse([0.0, 0.0], [1.0, 1.0], 0.0, 1e-11).unwrap().curve;
        assert_eq!(circle.point_at(0.0), circle.point_at(1.0));
        assert!((circle.arc_length(0.0, 1.0).unwrap() - TAU).abs() < 1e-10);
        for knot in circle.knots().spans().skip(1).map(|(_, start, _)| start) {
            let sides = [circle.curvature(knot - 1e-12).unwrap(), circle.curvature(knot).unwrap()];
            assert!((sides[0] - sides[1]).abs() < 1e-8, "{sides:?}");
        }
    }

    #[test]
    fn sizes_carry_derivatives() {
        struct Arc;
        impl VectorFunction for Arc {
            type Error = SplineError;
            fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SplineError> {
                let arc = elliptic_arc([x[0], x[1]], [x[2], x[3]], x[4], 0.1, PI, 1e-6)?;
                Ok([0.2, 0.7].iter().flat_map(|&u| arc.curve.point_at(u)).collect())
            }
        }
        let x = [0.1, 0.2, 1.3, 0.7, 0.5];
        let (_, exact) = jacobian(&Arc, &x).unwrap();
        // small steps: the number of pieces depends on the size and must not change
        let steps = [StepRange::for_scale(0.1); 5];
        let checked = finite_difference_jacobian(|x| Arc.evaluate(x), &x, &steps).unwrap();
        for (e, c) in exact.iter().zip(checked.iter()) {
            assert!((e - c.value).abs() <= c.error && c.error < 1e-9, "{e} {c:?}");
        }
    }

    #[test]
    fn bad_input_is_refused() {
        use SplineError as E;
        assert!(matches!(circular_arc([0.0; 2], 0.0, 0.0, 1.0, 1e-3), Err(E::BadRadius { .. })));
        assert!(matches!(circular_arc([0.0; 2], f64::NAN, 0.0, 1.0, 1e-3), Err(E::BadRadius { .. })));
        assert!(matches!(circular_arc([0.0; 2], 1.0, 1.0, 1.0, 1e-3), Err(E::BadSweep { .. })));
        assert!(matches!(circular_arc([0.0; 2], 1.0, 0.0, 7.0, 1e-3), Err(E::BadSweep { .. })));
        assert!(matches!(circular_arc([0.0; 2], 1.0, 0.0, f64::NAN, 1e-3), Err(E::BadSweep { .. })));
        assert!(matches!(circular_arc([f64::NAN, 0.0], 1.0, 0.0, 1.0, 1e-3), Err(E::NotFinite { .. })));
        for tolerance in [0.0, -1.0, f64::NAN, 1e-20] {
            assert!(matches!(circular_arc([0.0; 2], 1.0, 0.0, 1.0, tolerance), Err(E::ToleranceNotReached { .. })));
        }
    }
}
