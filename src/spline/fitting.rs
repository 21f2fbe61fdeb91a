//! Interpolation by B-splines: parameters for given points, and curves through points.
//!
//! Parameters and knots are plain numbers, so the curve is a *linear* function of the points: [`Interpolation`]
//! factorises the (banded) collocation matrix once, in `f64`, and applies it to right-hand sides of any scalar in
//! time proportional to their number. Least-squares fits are [`LeastSquares`](super::LeastSquares).

use super::banded::{BandRow, BandedFactors};
use super::{BSplineCurve, KnotVector, SplineError};
use crate::scalar::Scalar;
use std::sync::Arc;

/// The condition that a cubic interpolating spline meets at each of its two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EndCondition<S, const D: usize = 2> {
    /// Second derivative zero at both ends.
    Natural,
    /// First derivatives with respect to the parameter given at both ends.
    Clamped {
        /// Derivative at the first parameter.
        start: [S; D],
        /// Derivative at the last parameter.
        end: [S; D],
    },
    /// Third derivative continuous at the second and the last but one point, which therefore are no knots.
    NotAKnot,
}

/// The C2 cubic spline through `points` at the strictly increasing `parameters` (The NURBS Book, section 9.2.3).
///
/// `n` points give `n + 2` control points with natural or clamped ends (knots: all parameters), `n` without a knot at
/// the points next to the ends. Linear in the points and in the end derivatives.
///
/// ```
/// use aeroform::spline::{interpolate, EndCondition};
/// let parabola = [[0.0, 0.0], [0.3, 0.09], [0.7, 0.49], [1.0, 1.0]];
/// let curve = interpolate(&[0.0, 0.3, 0.7, 1.0], &parabola, EndCondition::NotAKnot).unwrap();
/// let [x, y] = curve.evaluate(0.5);
/// assert!(f64::abs(x - 0.5) < 1e-15 && f64::abs(y - 0.25) < 1e-15);
/// ```
///
/// # Errors
/// Parameters that do not increase or are not finite, fewer than two points (four for
/// [`NotAKnot`](EndCondition::NotAKnot)), a number of points that is not that of parameters, points not finite.
pub fn interpolate<S: Scalar, const D: usize>(
    parameters: &[f64],
    points: &[impl Into<[S; D]> + Copy],
    ends: EndCondition<S, D>,
) -> Result<BSplineCurve<S, D>, SplineError> {
    match ends {
        EndCondition::Natural => Interpolation::natural(parameters)?.curve(points),
        EndCondition::NotAKnot => Interpolation::not_a_knot(parameters)?.curve(points),
        EndCondition::Clamped { start, end } => {
            Interpolation::clamped(parameters)?.curve_with_tangents(points, start, end)
        }
    }
}

/// An interpolation problem with its matrix factorised, to be solved for any number of point sets of any scalar.
///
/// ```
/// use aeroform::spline::Interpolation;
/// let through = Interpolation::natural(&[0.0, 0.4, 1.0]).unwrap();
/// let arch = through.curve(&[[0.0, 0.0], [0.5, 1.0], [1.0, 0.0]]).unwrap();
/// let line = through.curve(&[[0.0], [0.4], [1.0]]).unwrap();
/// assert!(f64::abs(arch.evaluate(0.4)[1] - 1.0) < 1e-15);
/// assert!(f64::abs(line.evaluate(0.9)[0] - 0.9) < 1e-15);
/// ```
#[derive(Debug, Clone)]
pub struct Interpolation {
    knots: Arc<KnotVector>,
    factors: BandedFactors,
    points: usize,
    ends: Ends,
}

/// Which derivative, if any, is prescribed at the two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Ends {
    Nothing,
    Slope,
    ZeroCurvature,
}

impl Interpolation {
    /// Cubic, C2, second derivative zero at the ends; knots at all parameters.
    ///
    /// # Errors
    /// Fewer than two parameters, or parameters that do not increase or are not finite.
    pub fn natural(parameters: &[f64]) -> Result<Self, SplineError> {
        Self::knots_at_parameters(parameters, Ends::ZeroCurvature)
    }

    /// Cubic, C2, end derivatives given with each point set; knots at all parameters.
    ///
    /// # Errors
    /// As [`natural`](Self::natural).
    pub fn clamped(parameters: &[f64]) -> Result<Self, SplineError> {
        Self::knots_at_parameters(parameters, Ends::Slope)
    }

    /// Cubic, C2, knots at all parameters but the second and the last but one.
    ///
    /// # Errors
    /// As [`natural`](Self::natural), with at least four parameters.
    pub fn not_a_knot(parameters: &[f64]) -> Result<Self, SplineError> {
        check_parameters(parameters, 4)?;
        let n = parameters.len();
        let inner = parameters[2..n - 2].iter().copied();
        Self::at_knots(parameters, KnotVector::clamped(3, parameters[0], parameters[n - 1], inner)?)
    }

    /// Any degree at given knots, as many parameters as control points; see [`averaged_knots`] for safe knots.
    ///
    /// # Errors
    /// Parameters that do not increase, lie outside of the domain or whose number is not that of the control points;
    /// [`SplineError::Singular`] where some basis function vanishes at its parameter (Schoenberg-Whitney).
    pub fn at_knots(parameters: &[f64], knots: impl Into<Arc<KnotVector>>) -> Result<Self, SplineError> {
        let knots = knots.into();
        check_parameters(parameters, 1)?;
        if parameters.len() != knots.control_points() {
            return Err(SplineError::PointCount { expected: knots.control_points(), found: parameters.len() });
        }
        check_inside(parameters, &knots)?;
        let rows: Vec<BandRow> = parameters.iter().map(|&u| collocation_row(&knots, u, 0)).collect();
        let factors = BandedFactors::new(&rows)?;
        Ok(Self { knots, factors, points: parameters.len(), ends: Ends::Nothing })
    }

    fn knots_at_parameters(parameters: &[f64], ends: Ends) -> Result<Self, SplineError> {
        check_parameters(parameters, 2)?;
        let n = parameters.len();
        let (first, last) = (parameters[0], parameters[n - 1]);
        let knots = KnotVector::clamped(3, first, last, parameters[1..n - 1].iter().copied())?;
        let order = if ends == Ends::Slope { 1 } else { 2 };
        let mut rows = vec![collocation_row(&knots, first, 0), collocation_row(&knots, first, order)];
        rows.extend(parameters[1..n - 1].iter().map(|&u| collocation_row(&knots, u, 0)));
        rows.push(collocation_row(&knots, last, order));
        rows.push(collocation_row(&knots, last, 0));
        Ok(Self { knots: Arc::new(knots), factors: BandedFactors::new(&rows)?, points: n, ends })
    }

    /// The knot vector of every curve this gives.
    pub fn knots(&self) -> &Arc<KnotVector> {
        &self.knots
    }

    /// The curve through `points`, one per parameter.
    ///
    /// # Errors
    /// A wrong number of points, a point that is not finite, or an interpolation built by
    /// [`clamped`](Self::clamped): it needs [`curve_with_tangents`](Self::curve_with_tangents).
    pub fn curve<S: Scalar, const D: usize>(
        &self,
        points: &[impl Into<[S; D]> + Copy],
    ) -> Result<BSplineCurve<S, D>, SplineError> {
        match self.ends {
            Ends::Nothing => self.solve(points, None),
            Ends::ZeroCurvature => self.solve(points, Some([[S::from(0.0); D]; 2])),
            Ends::Slope => Err(SplineError::EndTangents { wanted: true }),
        }
    }

    /// The curve through `points` with the given derivatives with respect to the parameter at its ends.
    ///
    /// # Errors
    /// As [`curve`](Self::curve), or an interpolation not built by [`clamped`](Self::clamped).
    pub fn curve_with_tangents<S: Scalar, const D: usize>(
        &self,
        points: &[impl Into<[S; D]> + Copy],
        start: [S; D],
        end: [S; D],
    ) -> Result<BSplineCurve<S, D>, SplineError> {
        match self.ends {
            Ends::Slope => self.solve(points, Some([start, end])),
            _ => Err(SplineError::EndTangents { wanted: false }),
        }
    }

    fn solve<S: Scalar, const D: usize>(
        &self,
        points: &[impl Into<[S; D]> + Copy],
        derivatives: Option<[[S; D]; 2]>,
    ) -> Result<BSplineCurve<S, D>, SplineError> {
        if points.len() != self.points {
            return Err(SplineError::PointCount { expected: self.points, found: points.len() });
        }
        let mut control: Vec<[S; D]> = points.iter().map(|&p| p.into()).collect();
        if let Some([start, end]) = derivatives {
            control.insert(self.points - 1, end);
            control.insert(1, start);
        }
        self.factors.solve_in_place(&mut control);
        BSplineCurve::new(Arc::clone(&self.knots), control)
    }
}

/// Clamped knots for interpolation of any degree: averages of `degree` consecutive parameters (The NURBS Book,
/// equation 9.8). The collocation matrix is then never singular.
///
/// # Errors
/// A degree of zero, no more parameters than the degree, or parameters that do not increase.
pub fn averaged_knots(degree: usize, parameters: &[f64]) -> Result<KnotVector, SplineError> {
    if degree == 0 {
        return Err(SplineError::DegreeZero);
    }
    let n = parameters.len();
    check_parameters(parameters, degree + 1)?;
    let inner = (1..n - degree).map(|j| parameters[j..j + degree].iter().sum::<f64>() / degree as f64);
    KnotVector::clamped(degree, parameters[0], parameters[n - 1], inner)
}

/// Parameters on [0, 1] proportional to the length of the polygon through the points.
///
/// The parameters carry the derivatives of the points. An interpolation takes plain numbers as parameters, because its
/// knots are such: pass it the real parts.
///
/// # Errors
/// Fewer than two points, a point that is not finite, or one equal to the point before it.
pub fn chord_length_parameters<S: Scalar, const D: usize>(
    points: &[impl Into<[S; D]> + Copy],
) -> Result<Vec<S>, SplineError> {
    accumulated(points, |squared| squared.sqrt())
}

/// Parameters on [0, 1] that advance by the square root of the distance between points (Lee 1989).
///
/// Calmer than [`chord_length_parameters`] where the spacing of the points jumps or the curve turns sharply. They carry
/// the derivatives of the points.
///
/// # Errors
/// As [`chord_length_parameters`].
pub fn centripetal_parameters<S: Scalar, const D: usize>(
    points: &[impl Into<[S; D]> + Copy],
) -> Result<Vec<S>, SplineError> {
    accumulated(points, |squared| squared.sqrt().sqrt())
}

/// Sums of steps between points, each a function of the squared distance, over the whole sum.
fn accumulated<S: Scalar, const D: usize>(
    points: &[impl Into<[S; D]> + Copy],
    step: fn(S) -> S,
) -> Result<Vec<S>, SplineError> {
    let n = points.len();
    if n < 2 {
        return Err(SplineError::TooFewPoints { needed: 2, found: n });
    }
    let points: Vec<[S; D]> = points.iter().map(|&p| p.into()).collect();
    if let Some(index) = points.iter().position(|p| p.iter().any(|c| !c.re().is_finite())) {
        return Err(SplineError::NotFinite { index });
    }
    let mut sum = S::from(0.0);
    let mut parameters = vec![sum];
    for pair in points.windows(2) {
        sum += step((0..D).map(|d| (pair[1][d] - pair[0][d]).squared()).sum::<S>());
        parameters.push(sum);
    }
    for parameter in &mut parameters[..n - 1] {
        *parameter /= sum;
    }
    // not the sum over itself, which dual numbers round
    parameters[n - 1] = S::from(1.0);
    check_parameters(&parameters.iter().map(|u| u.re()).collect::<Vec<_>>(), 2)?;
    Ok(parameters)
}

/// At least `needed` finite, strictly increasing parameters.
pub(super) fn check_parameters(parameters: &[f64], needed: usize) -> Result<(), SplineError> {
    if parameters.len() < needed {
        return Err(SplineError::TooFewPoints { needed, found: parameters.len() });
    }
    for (index, &value) in parameters.iter().enumerate() {
        if !value.is_finite() || (index > 0 && value <= parameters[index - 1]) {
            return Err(SplineError::ParametersNotIncreasing { index, value });
        }
    }
    Ok(())
}

/// All parameters in the domain of the knots.
pub(super) fn check_inside(parameters: &[f64], knots: &KnotVector) -> Result<(), SplineError> {
    let (first, last) = knots.domain();
    match parameters.iter().find(|u| !(first..=last).contains(*u)) {
        Some(&parameter) => Err(SplineError::OutsideDomain { parameter, first, last }),
        None => Ok(()),
    }
}

/// The derivative of some order of all basis functions at `u`.
pub(super) fn collocation_row(knots: &KnotVector, u: f64, order: usize) -> BandRow {
    let span = knots.span(u);
    let mut values =
        if order == 0 { knots.basis(span, u) } else { knots.basis_derivatives(span, u, order).remove(order) };
    // the function that starts or ends here is zero up to round-off of differences: say so, the band stays narrow
    let scale = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    for value in &mut values {
        if value.abs() < 1e-15 * scale {
            *value = 0.0;
        }
    }
    (span - knots.degree(), values.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::{StepRange, VectorFunction, finite_difference_jacobian, jacobian};
    use num_dual::Dual64;
    use proptest::prelude::*;

    fn increasing() -> impl Strategy<Value = Vec<f64>> {
        proptest::collection::vec(0.02f64..1.0, 4..12).prop_map(|steps| {
            let mut at = -0.4;
            steps
                .iter()
                .map(|s| {
                    at += s;
                    at
                })
                .collect()
        })
    }

    fn sample(parameters: &[f64]) -> Vec<[f64; 2]> {
        parameters.iter().map(|t| [t.cos(), (2.0 * t).sin()]).collect()
    }

    proptest! {
        #[test]
        fn interpolants_pass_through_the_points(t in increasing()) {
            let points = sample(&t);
            let n = t.len();
            let (a, b) = ([0.3, -1.0], [2.0, 0.1]);
            let natural = interpolate(&t, &points, EndCondition::Natural).unwrap();
            let clamped = interpolate(&t, &points, EndCondition::Clamped { start: a, end: b }).unwrap();
            let free = interpolate(&t, &points, EndCondition::NotAKnot).unwrap();
            prop_assert_eq!([natural.control_points().len(), clamped.control_points().len()], [n + 2; 2]);
            prop_assert_eq!(free.control_points().len(), n);
            for curve in [&natural, &clamped, &free] {
                for (u, p) in t.iter().zip(&points) {
                    let q = curve.point_at(*u);
                    prop_assert!((q[0] - p[0]).abs() < 1e-12 && (q[1] - p[1]).abs() < 1e-12);
                }
            }
            for (u, wanted) in [(t[0], a), (t[n - 1], b)] {
                let slope = clamped.derivatives(u, 1)[1];
                prop_assert!((0..2).all(|d| (slope[d] - wanted[d]).abs() < 1e-10));
                let second = natural.derivatives(u, 2)[2];
                let scale = natural.derivatives(t[1], 2)[2].iter().fold(1.0, |m: f64, v| m.max(v.abs()));
                prop_assert!(second.iter().all(|s| s.abs() < 1e-9 * scale), "{second:?}");
            }
        }

        #[test]
        fn cubics_are_reproduced(t in increasing(), x in 0.0f64..1.0) {
            let cubic = |u: f64| [u * u * u - u, 1.0 - 2.0 * u * u];
            let slope = |u: f64| [3.0 * u * u - 1.0, -4.0 * u];
            let points: Vec<_> = t.iter().map(|&u| cubic(u)).collect();
            let (a, b) = (t[0], t[t.len() - 1]);
            let u = a + x * (b - a);
            let size = (1.0 + b.abs()).powi(3);
            let ends = EndCondition::Clamped { start: slope(a), end: slope(b) };
            for curve in [interpolate(&t, &points, ends).unwrap(), interpolate(&t, &points, EndCondition::NotAKnot).unwrap()] {
                let p = curve.point_at(u);
                prop_assert!((0..2).all(|d| (p[d] - cubic(u)[d]).abs() < 1e-10 * size));
            }
        }

        #[test]
        fn any_degree_at_averaged_knots(t in increasing(), degree in 1usize..=3) {
            let problem = Interpolation::at_knots(&t, averaged_knots(degree, &t).unwrap()).unwrap();
            let points = sample(&t);
            let curve = problem.curve(&points).unwrap();
            for (u, p) in t.iter().zip(&points) {
                let q = curve.point_at(*u);
                prop_assert!((q[0] - p[0]).abs() < 1e-12 && (q[1] - p[1]).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn natural_spline_through_three_points_is_the_textbook_one() {
        // moments: 2 (h0 + h1) M1 = 6 (slope1 - slope0), with M0 = M2 = 0
        let curve = interpolate(&[0.0, 1.0, 3.0], &[[0.0], [1.0], [0.0]], EndCondition::Natural).unwrap();
        let moment: f64 = 6.0 * (-0.5 - 1.0) / (2.0 * 3.0);
        assert!((curve.derivatives(1.0, 2)[2][0] - moment).abs() < 1e-14);
    }

    #[test]
    fn derivatives_pass_through() {
        struct Heights;
        impl VectorFunction for Heights {
            type Error = SplineError;
            fn evaluate<S: Scalar>(&self, y: &[S]) -> Result<Vec<S>, SplineError> {
                let t = [0.0, 0.3, 0.4, 0.8, 1.0];
                let points: Vec<[S; 1]> = y[..5].iter().map(|&y| [y.sin()]).collect();
                let ends = EndCondition::Clamped { start: [y[5]], end: [y[6]] };
                let curve = interpolate(&t, &points, ends)?;
                Ok([0.1, 0.35, 0.9].iter().map(|&u| curve.point_at(u)[0]).collect())
            }
        }
        let y = [0.1, 0.5, -0.2, 0.9, 0.4, 1.0, -2.0];
        let (_, forward) = jacobian(&Heights, &y).unwrap();
        let checked = finite_difference_jacobian(|y| Heights.evaluate(y), &y, &[StepRange::for_scale(1.0); 7]).unwrap();
        for (exact, estimate) in forward.iter().zip(checked.iter()) {
            assert!((exact - estimate.value).abs() <= estimate.error, "{exact} {estimate:?}");
            assert!(estimate.error < 1e-8);
        }
        // linear: a dual point set gives the interpolant of the derivative parts
        let through = Interpolation::natural(&[0.0, 0.2, 1.0]).unwrap();
        let dual = through.curve(&[1.0, 2.0, -1.0].map(|y: f64| [Dual64::new(y, y.exp())])).unwrap();
        let parts = through.curve(&[1.0, 2.0, -1.0].map(|y: f64| [y.exp()])).unwrap();
        for (d, p) in dual.control_points().iter().zip(parts.control_points()) {
            assert!((d[0].eps - p[0]).abs() < 1e-14 * (1.0 + p[0].abs()));
        }
    }

    #[test]
    fn parameters_of_a_right_angle() {
        let points = [[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]];
        assert_eq!(chord_length_parameters(&points).unwrap(), [0.0, 0.75, 1.0]);
        let root = 3f64.sqrt();
        assert_eq!(centripetal_parameters(&points).unwrap(), [0.0, root / (root + 1.0), 1.0]);
    }

    #[test]
    fn bad_input_is_refused() {
        use SplineError as E;
        let p = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]];
        assert!(matches!(chord_length_parameters(&p), Err(E::ParametersNotIncreasing { index: 2, .. })));
        assert!(matches!(chord_length_parameters(&p[..1]), Err(E::TooFewPoints { needed: 2, found: 1 })));
        assert!(matches!(chord_length_parameters(&[[0.0], [f64::NAN]]), Err(E::NotFinite { index: 1 })));
        assert!(matches!(
            interpolate(&[0.0, 0.5, 0.5], &p, EndCondition::Natural),
            Err(E::ParametersNotIncreasing { index: 2, .. })
        ));
        assert!(matches!(
            interpolate(&[0.0, f64::NAN, 0.5], &p, EndCondition::Natural),
            Err(E::ParametersNotIncreasing { index: 1, .. })
        ));
        let natural = Interpolation::natural(&[0.0, 1.0]).unwrap();
        assert!(matches!(natural.curve(&p), Err(E::PointCount { expected: 2, found: 3 })));
        assert!(matches!(natural.curve_with_tangents(&p[..2], [0.0; 2], [0.0; 2]), Err(E::EndTangents { .. })));
        assert!(matches!(Interpolation::clamped(&[0.0, 1.0]).unwrap().curve(&p[..2]), Err(E::EndTangents { .. })));
        assert!(matches!(Interpolation::not_a_knot(&[0.0, 1.0, 2.0]), Err(E::TooFewPoints { needed: 4, .. })));
        let knots = KnotVector::clamped(1, 0.0, 1.0, [0.5]).unwrap();
        assert_eq!(Interpolation::at_knots(&[0.0, 0.1, 0.2], knots.clone()).unwrap_err(), E::Singular);
        assert!(matches!(Interpolation::at_knots(&[0.0, 0.1, 1.2], knots), Err(E::OutsideDomain { .. })));
    }
}
