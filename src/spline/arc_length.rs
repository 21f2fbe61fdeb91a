//! Length of curves, and parameters at given lengths.

use super::roots::bracketed;
use super::{BSplineCurve, GaussRule, SplineError};
use crate::differentiate::lift_root;
use crate::scalar::Scalar;
use std::sync::LazyLock;

static SIXTEEN: LazyLock<GaussRule> = LazyLock::new(|| GaussRule::new(16));
/// Exact for the third-order Taylor polynomials that duals are.
static TWO: LazyLock<GaussRule> = LazyLock::new(|| GaussRule::new(2));

/// Halvings of a knot span. A cusp takes some 50; a span that takes this many is lost in round-off.
const MOST_HALVINGS: usize = 2_000;

/// The length of a curve tabulated once, for many queries.
///
/// Gauss quadrature with 16 points on knot spans, halved until halving changes nothing beyond `4e-15` of the length of
/// the control polygon; so lengths are good to about `1e-14` of that. Panels are chosen from the real parts and then
/// serve every scalar, so derivatives have that accuracy too. A length has no derivative where the curve stands still
/// (zero tangent).
///
/// ```
/// use aeroform::spline::{BSplineCurve, KnotVector};
/// let knots = KnotVector::clamped_uniform(2, 3).unwrap();
/// let parabola = BSplineCurve::new(knots, vec![[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]]).unwrap();
/// let lengths = parabola.arc_lengths().unwrap();
/// let exact = 0.5 * 5f64.sqrt() + 0.25 * 2f64.asinh();
/// assert!((lengths.total() - exact).abs() < 1e-14);
/// let half = lengths.parameter(0.5 * exact).unwrap();
/// assert!((lengths.at(half).unwrap() - 0.5 * exact).abs() < 1e-14);
/// ```
#[derive(Debug, Clone)]
pub struct ArcLengths<S, const D: usize = 2> {
    curve: BSplineCurve<S, D>,
    real: BSplineCurve<f64, D>,
    /// Ends of the panels, one more than panels.
    ends: Vec<f64>,
    /// Length from the start of the curve at each of the ends.
    lengths: Vec<S>,
}

impl<S: Scalar, const D: usize> ArcLengths<S, D> {
    fn new(curve: &BSplineCurve<S, D>) -> Result<Self, SplineError> {
        let real = curve.real();
        let (first, last) = curve.domain();
        let mut ends = vec![first];
        panels(&real, first, last, |_, end| ends.push(end));
        let mut sum = S::from(0.0);
        let mut lengths = vec![sum];
        for pair in ends.windows(2) {
            sum += piece(curve, pair[0], pair[1])?;
            lengths.push(sum);
        }
        Ok(Self { curve: curve.clone(), real, ends, lengths })
    }

    /// Length of the whole curve.
    pub fn total(&self) -> S {
        // the table begins with the start of the curve
        self.lengths[self.lengths.len() - 1]
    }

    /// Length from the start of the curve to the parameter `u`.
    ///
    /// # Errors
    /// `u` outside of the domain; [`SplineError::ZeroTangent`] where a derivative does not exist.
    pub fn at(&self, u: S) -> Result<S, SplineError> {
        check(&self.curve, u.re())?;
        let panel = self.panels_before(&self.ends, |end| *end <= u.re());
        Ok(self.lengths[panel] + piece(&self.curve, self.ends[panel], u.re())? + tip(&self.curve, u))
    }

    /// The parameter at a length from the start of the curve (inverse of [`at`](Self::at)).
    ///
    /// # Errors
    /// A length below zero or above the total; [`SplineError::ZeroTangent`] where a derivative does not exist.
    pub fn parameter(&self, length: S) -> Result<S, SplineError> {
        let (wanted, total) = (length.re(), self.total().re());
        // a total computed in another order may differ by round-off
        if !(wanted >= 0.0 && wanted <= total * (1.0 + 1e-14)) {
            return Err(SplineError::LengthOutside { length: wanted, total });
        }
        let panel = self.panels_before(&self.lengths, |length| length.re() <= wanted);
        let before = self.lengths[panel].re();
        let (start, end) = (self.ends[panel], self.ends[panel + 1]);
        let speed = |u: f64| norm(self.real.tangent_at(u));
        let root = bracketed(start, end, |u| (before + SIXTEEN.integrate(start, u, speed) - wanted, speed(u)));
        let fixed = self.at(S::from(root))?;
        lift_root(root, || speed(root), |u: S| fixed + tip(&self.curve, u) - length)
            .map_err(|_| SplineError::ZeroTangent { parameter: root })
    }

    /// The number of whole panels before the first of the sorted entries for which `before` fails.
    fn panels_before<T>(&self, table: &[T], before: impl Fn(&T) -> bool) -> usize {
        table[1..self.ends.len() - 1].partition_point(before)
    }
}

impl<S: Scalar, const D: usize> BSplineCurve<S, D> {
    /// Length of the curve between the parameters `a` and `b`, negative for `b < a`, to about `1e-14` of the length of
    /// the control polygon (see [`ArcLengths`]).
    ///
    /// # Errors
    /// A parameter outside of the domain; [`SplineError::ZeroTangent`] where a derivative does not exist.
    pub fn arc_length(&self, a: S, b: S) -> Result<S, SplineError> {
        check(self, a.re())?;
        check(self, b.re())?;
        let (low, high) = (a.re().min(b.re()), a.re().max(b.re()));
        let mut sum = Ok(S::from(0.0));
        panels(&self.real(), low, high, |start, end| {
            sum = sum.clone().and_then(|sum| Ok(sum + piece(self, start, end)?));
        });
        let between = if a.re() <= b.re() { sum? } else { -sum? };
        Ok(between + tip(self, b) - tip(self, a))
    }

    /// A table of the arc length for many queries.
    ///
    /// # Errors
    /// [`SplineError::ZeroTangent`] where a derivative does not exist.
    pub fn arc_lengths(&self) -> Result<ArcLengths<S, D>, SplineError> {
        ArcLengths::new(self)
    }

    /// The parameter at a length from the start; for many of them see [`arc_lengths`](Self::arc_lengths).
    ///
    /// # Errors
    /// As [`ArcLengths::parameter`].
    pub fn parameter_at_arc_length(&self, length: S) -> Result<S, SplineError> {
        self.arc_lengths()?.parameter(length)
    }
}

/// Calls `visit(start, end)` for panels of `[a, b]` on each of which 16 points integrate the speed to round-off.
fn panels<const D: usize>(curve: &BSplineCurve<f64, D>, a: f64, b: f64, mut visit: impl FnMut(f64, f64)) {
    let speed = |u: f64| norm(curve.tangent_at(u));
    let polygon: f64 =
        curve.control_points().windows(2).map(|w| norm::<f64, D>(std::array::from_fn(|d| w[1][d] - w[0][d]))).sum();
    for (_, start, end) in curve.knots().spans() {
        let (start, end) = (start.max(a), end.min(b));
        if start >= end {
            continue;
        }
        // halving stops at cusps, where it converges no faster than the length of the panel itself, and where round-off
        // or overflow keep it from converging at all
        let smallest = 1e-15 * (end - start);
        let mut stack = vec![(start, end, SIXTEEN.integrate(start, end, speed))];
        let mut halvings = 0;
        while let Some((start, end, whole)) = stack.pop() {
            let middle = 0.5 * (start + end);
            let left = SIXTEEN.integrate(start, middle, speed);
            let right = SIXTEEN.integrate(middle, end, speed);
            halvings += 1;
            // written so that NaN ends it
            let differ = (left + right - whole).abs() > 4e-15 * polygon;
            if !differ || end - start <= smallest || halvings > MOST_HALVINGS {
                visit(start, end);
            } else {
                stack.push((middle, end, right));
                stack.push((start, middle, left));
            }
        }
    }
}

/// Length of a part of the curve that one panel holds.
fn piece<S: Scalar, const D: usize>(curve: &BSplineCurve<S, D>, start: f64, end: f64) -> Result<S, SplineError> {
    let mut still = None;
    let length = SIXTEEN.integrate(start, end, |u| {
        let speed = norm(curve.tangent_at(u));
        if speed.re() == 0.0 {
            still = Some(u);
        }
        speed
    });
    match still {
        Some(parameter) if S::NDERIV > 0 => Err(SplineError::ZeroTangent { parameter }),
        _ => Ok(length),
    }
}

/// Length from the real part of `u` to `u`: the derivatives of the length with respect to its upper limit, which are
/// not finite where the curve stands still.
fn tip<S: Scalar, const D: usize>(curve: &BSplineCurve<S, D>, u: S) -> S {
    if S::NDERIV == 0 {
        return S::from(0.0);
    }
    TWO.integrate_between(S::from(u.re()), u, |v| norm(curve.point_and_tangent(v).1))
}

/// Refuses a parameter outside of the domain, and one at which the curve stands still where derivatives are wanted.
fn check<S: Scalar, const D: usize>(curve: &BSplineCurve<S, D>, parameter: f64) -> Result<(), SplineError> {
    let (first, last) = curve.domain();
    if !(first..=last).contains(&parameter) {
        return Err(SplineError::OutsideDomain { parameter, first, last });
    }
    if S::NDERIV > 0 && norm(curve.tangent_at(parameter)).re() == 0.0 {
        return Err(SplineError::ZeroTangent { parameter });
    }
    Ok(())
}

/// Length of a vector; its derivatives are not finite where it vanishes.
fn norm<S: Scalar, const D: usize>(vector: [S; D]) -> S {
    let mut sum = S::from(0.0);
    for c in vector {
        sum += c.squared();
    }
    sum.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::{Function, StepRange, finite_difference, gradient};
    use crate::spline::KnotVector;
    use num_dual::Dual2_64;

    fn wave() -> Vec<[f64; 2]> {
        (0..9).map(|i| [i as f64 / 8.0, 0.3 * (1.7 * i as f64).sin()]).collect()
    }

    fn curve<S: Scalar>(points: Vec<[S; 2]>) -> BSplineCurve<S> {
        BSplineCurve::new(KnotVector::clamped_uniform(3, points.len()).unwrap(), points).unwrap()
    }

    #[test]
    fn lengths_add_up_and_invert() {
        let wave = curve(wave());
        let total = wave.arc_length(0.0, 1.0).unwrap();
        // composite Simpson with many intervals as an independent value
        let n = 200_000;
        let simpson = (0..=n)
            .map(|i| {
                let weight = if i == 0 || i == n { 1.0 } else { 2.0 + 2.0 * (i % 2) as f64 };
                weight * norm(wave.tangent_at(i as f64 / n as f64))
            })
            .sum::<f64>()
            / (3 * n) as f64;
        assert!((total - simpson).abs() < 1e-12, "{total} {simpson}");
        let lengths = wave.arc_lengths().unwrap();
        // the control polygon is about 3 long
        let accuracy = 3e-14;
        assert!((lengths.total() - total).abs() < accuracy);
        for i in 0..=50 {
            let u = i as f64 / 50.0;
            let s = lengths.at(u).unwrap();
            assert!((s - wave.arc_length(0.0, u).unwrap()).abs() < accuracy);
            assert!((s - wave.arc_length(1.0, u).unwrap() - total).abs() < accuracy);
            assert!((lengths.parameter(s).unwrap() - u).abs() < 1e-13, "{u}");
        }
    }

    #[test]
    fn a_cusp_is_integrated() {
        // x = u², y = u³ through the origin at u = 0
        let knots = KnotVector::clamped(3, -1.0, 1.0, []).unwrap();
        let points = vec![[1.0, -1.0], [-1.0 / 3.0, 1.0], [-1.0 / 3.0, -1.0], [1.0, 1.0]];
        let cusp = BSplineCurve::new(knots, points).unwrap();
        let exact = 2.0 * (13f64.powf(1.5) - 8.0) / 27.0;
        assert!((cusp.arc_length(-1.0, 1.0).unwrap() - exact).abs() < 1e-13);
    }

    /// Length up to a parameter and parameter at a length, of a curve with movable control points.
    struct Measures;
    impl Function for Measures {
        type Error = SplineError;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, SplineError> {
            let mut points: Vec<[S; 2]> = wave().iter().map(|p| p.map(S::from)).collect();
            points[3][1] += x[0];
            points[6][0] += x[1];
            let curve = curve(points);
            let part = curve.arc_length(x[2], x[3])?;
            Ok(part + curve.parameter_at_arc_length(x[4])? * 3.0)
        }
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let x = [0.02, -0.01, 0.3, 0.85, 0.7];
        let (_, slope) = gradient(&Measures, &x).unwrap();
        for k in 0..5 {
            let along = |v: f64| {
                let mut y = x;
                y[k] = v;
                Measures.evaluate(&y)
            };
            let estimate = finite_difference(along, x[k], StepRange::for_scale(0.5)).unwrap();
            assert!((slope[k] - estimate.value).abs() <= estimate.error, "{k} {} {estimate:?}", slope[k]);
            assert!(estimate.error < 1e-8);
        }
    }

    #[test]
    fn derivatives_with_respect_to_limits_are_speeds() {
        let real = curve(wave());
        let lifted = curve(wave().iter().map(|p| p.map(Dual2_64::from)).collect());
        let s = lifted.arc_lengths().unwrap().at(Dual2_64::from(0.37).derivative()).unwrap();
        let rows = real.derivatives(0.37, 2);
        let speed = norm(rows[1]);
        let acceleration = (rows[1][0] * rows[2][0] + rows[1][1] * rows[2][1]) / speed;
        assert!((s.v1 - speed).abs() < 1e-13 && (s.v2 - acceleration).abs() < 1e-12);
        // and back: the inverse function's derivatives
        let u = lifted.parameter_at_arc_length(Dual2_64::from(s.re).derivative()).unwrap();
        assert!((u.v1 - 1.0 / speed).abs() < 1e-12 && (u.v2 + acceleration / speed.powi(3)).abs() < 1e-11);
    }

    #[test]
    fn bad_input_is_refused() {
        let wave = curve(wave());
        assert!(matches!(wave.arc_length(0.0, 1.1), Err(SplineError::OutsideDomain { .. })));
        assert!(matches!(wave.arc_length(f64::NAN, 1.0), Err(SplineError::OutsideDomain { .. })));
        assert!(matches!(wave.parameter_at_arc_length(-0.1), Err(SplineError::LengthOutside { .. })));
        assert!(matches!(wave.parameter_at_arc_length(99.0), Err(SplineError::LengthOutside { .. })));
        let point = curve(vec![[Dual2_64::from(1.0); 2]; 4]);
        assert!(matches!(point.arc_lengths(), Err(SplineError::ZeroTangent { .. })));
        assert_eq!(point.real().arc_length(0.0, 1.0), Ok(0.0));
    }
}
