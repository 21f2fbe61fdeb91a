//! Least-squares fits by B-splines, with the ends interpolated.

use super::fitting::{Interpolation, averaged_knots, check_inside, check_parameters, collocation_row};
use super::{BSplineCurve, KnotVector, SplineError};
use crate::scalar::Scalar;
use std::sync::Arc;

/// A least-squares problem, factorised once in `f64`, to be solved for any number of point sets of any scalar.
///
/// The curve passes through the first and the last point exactly; the sum of squared distances at the other parameters
/// is least. Linear in the points.
///
/// ```
/// use aeroform::spline::{KnotVector, LeastSquares};
/// let parameters: Vec<f64> = (0..21).map(|i| i as f64 / 20.0).collect();
/// let points: Vec<[f64; 2]> = parameters.iter().map(|t| [*t, t * t * t]).collect();
/// let fit = LeastSquares::new(&parameters, KnotVector::clamped_uniform(3, 6).unwrap()).unwrap();
/// let curve = fit.curve(&points).unwrap();
/// assert!((curve.evaluate(0.33)[1] - 0.33f64.powi(3)).abs() < 1e-14);
/// ```
#[derive(Debug, Clone)]
pub struct LeastSquares {
    knots: Arc<KnotVector>,
    /// First control point and basis values, one row per parameter.
    rows: Vec<(usize, Vec<f64>)>,
    /// Upper triangle of the QR factorisation for the inner control points: `degree + 1` entries per row.
    triangle: Vec<f64>,
}

impl LeastSquares {
    /// Factorises the fit at strictly increasing `parameters`, the first and last of which are the ends of the domain.
    ///
    /// # Errors
    /// Parameters that do not increase or do not start and end with the domain, fewer parameters than control points,
    /// knots not clamped, [`SplineError::Singular`] where a control point sees no parameter (Schoenberg-Whitney).
    pub fn new(parameters: &[f64], knots: impl Into<Arc<KnotVector>>) -> Result<Self, SplineError> {
        let knots = knots.into();
        let n = knots.control_points();
        check_parameters(parameters, n)?;
        check_inside(parameters, &knots)?;
        let (first, last) = knots.domain();
        for (end, parameter) in [(first, parameters[0]), (last, parameters[parameters.len() - 1])] {
            if end != parameter {
                return Err(SplineError::OutsideDomain { parameter: end, first, last: parameter });
            }
        }
        if !is_clamped(&knots) {
            return Err(SplineError::NotClamped);
        }
        if !schoenberg_whitney(parameters, &knots) {
            return Err(SplineError::Singular);
        }
        let rows: Vec<_> = parameters.iter().map(|&u| collocation_row(&knots, u, 0)).collect();
        let triangle = triangularise(&rows, n, knots.degree() + 1)?;
        Ok(Self { knots, rows, triangle })
    }

    /// The knot vector of every curve this gives.
    pub fn knots(&self) -> &Arc<KnotVector> {
        &self.knots
    }

    /// The best curve for `points`, one per parameter, given as arrays or as `nalgebra` points or vectors.
    ///
    /// # Errors
    /// A wrong number of points, or one that is not finite.
    pub fn curve<S: Scalar, const D: usize>(
        &self,
        points: &[impl Into<[S; D]> + Copy],
    ) -> Result<BSplineCurve<S, D>, SplineError> {
        let points: Vec<[S; D]> = points.iter().map(|&p| p.into()).collect();
        if points.len() != self.rows.len() {
            return Err(SplineError::PointCount { expected: self.rows.len(), found: points.len() });
        }
        let n = self.knots.control_points();
        let mut control = vec![[S::from(0.0); D]; n];
        control[0] = points[0];
        control[n - 1] = points[points.len() - 1];
        // Corrected seminormal equations (Björck 1987): the second pass makes up for the squared condition number.
        for _ in 0..2 {
            let mut step = self.projected_residual(&points, &control);
            self.solve_seminormal(&mut step);
            for (c, s) in control[1..n - 1].iter_mut().zip(step) {
                for (c, s) in c.iter_mut().zip(s) {
                    *c += s;
                }
            }
        }
        BSplineCurve::new(Arc::clone(&self.knots), control)
    }

    /// Transposed matrix of the inner control points times what `control` leaves of the points.
    fn projected_residual<S: Scalar, const D: usize>(&self, points: &[[S; D]], control: &[[S; D]]) -> Vec<[S; D]> {
        let n = control.len();
        let mut sums = vec![[S::from(0.0); D]; n];
        for ((first, values), point) in self.rows.iter().zip(points) {
            let mut rest = *point;
            for (value, c) in values.iter().zip(&control[*first..]) {
                for (r, c) in rest.iter_mut().zip(c) {
                    *r -= *c * *value;
                }
            }
            for (value, sum) in values.iter().zip(&mut sums[*first..]) {
                for (s, r) in sum.iter_mut().zip(&rest) {
                    *s += *r * *value;
                }
            }
        }
        sums.drain(1..n - 1).collect()
    }

    /// Solves `Rᵀ R x = b` in place.
    fn solve_seminormal<S: Scalar, const D: usize>(&self, b: &mut [[S; D]]) {
        let (n, width) = (b.len(), self.knots.degree() + 1);
        let entry = |i: usize, j: usize| self.triangle[i * width + j - i];
        for i in 0..n {
            for j in i.saturating_sub(width - 1)..i {
                let known = b[j];
                for (c, k) in b[i].iter_mut().zip(known) {
                    *c -= k * entry(j, i);
                }
            }
            for c in &mut b[i] {
                *c /= entry(i, i);
            }
        }
        for i in (0..n).rev() {
            for j in i + 1..(i + width).min(n) {
                let known = b[j];
                for (c, k) in b[i].iter_mut().zip(known) {
                    *c -= k * entry(i, j);
                }
            }
            for c in &mut b[i] {
                *c /= entry(i, i);
            }
        }
    }
}

/// The least-squares curve for `points` at `parameters` on given clamped knots, its ends at the first and last point.
///
/// # Errors
/// As [`LeastSquares::new`] and [`LeastSquares::curve`].
pub fn fit<S: Scalar, const D: usize>(
    parameters: &[f64],
    points: &[impl Into<[S; D]> + Copy],
    knots: impl Into<Arc<KnotVector>>,
) -> Result<BSplineCurve<S, D>, SplineError> {
    LeastSquares::new(parameters, knots)?.curve(points)
}

/// A least-squares curve of some degree with as many knots as it takes to pass every point, at its parameter, within
/// `tolerance` (in units of the points).
///
/// The knots follow from the real parts of the points. The fit starts without inner knots and halves, at each pass,
/// every span that holds a point further off than the tolerance. Where too few points are in those spans to divide them
/// further, the curve interpolates all points instead.
///
/// # Errors
/// [`SplineError::ToleranceNotReached`] where even the interpolating curve is further off, by round-off; otherwise
/// those of [`fit`].
pub fn fit_to_tolerance<S: Scalar, const D: usize>(
    parameters: &[f64],
    points: &[impl Into<[S; D]> + Copy],
    degree: usize,
    tolerance: f64,
) -> Result<BSplineCurve<S, D>, SplineError> {
    let points: Vec<[S; D]> = points.iter().map(|&p| p.into()).collect();
    check_parameters(parameters, 2.max(degree + 1))?;
    let (first, last) = (parameters[0], parameters[parameters.len() - 1]);
    let mut inner: Vec<f64> = vec![];
    loop {
        let knots = KnotVector::clamped(degree, first, last, inner.iter().copied())?;
        let curve = match fit(parameters, &points, knots) {
            Ok(curve) => curve,
            // determined, but beyond double precision
            Err(SplineError::Singular) => return interpolate_all(parameters, &points, degree, tolerance),
            Err(error) => return Err(error),
        };
        let errors = distances(&curve, parameters, &points);
        if largest(&errors) <= tolerance {
            return Ok(curve);
        }
        let before = inner.len();
        for (_, start, end) in curve.knots().spans() {
            let range = parameters.partition_point(|&t| t < start)..parameters.partition_point(|&t| t <= end);
            if errors[range.clone()].iter().all(|&e| e <= tolerance) {
                continue;
            }
            if let Some(knot) = middle_gap(&parameters[range], start, end) {
                let at = inner.partition_point(|&k| k < knot);
                inner.insert(at, knot);
                let longer = KnotVector::clamped(degree, first, last, inner.iter().copied())?;
                if longer.control_points() > parameters.len() || !schoenberg_whitney(parameters, &longer) {
                    inner.remove(at);
                }
            }
        }
        if inner.len() == before {
            return interpolate_all(parameters, &points, degree, tolerance);
        }
    }
}

/// The curve through all points, where it is within the tolerance.
fn interpolate_all<S: Scalar, const D: usize>(
    parameters: &[f64],
    points: &[[S; D]],
    degree: usize,
    tolerance: f64,
) -> Result<BSplineCurve<S, D>, SplineError> {
    let curve = Interpolation::at_knots(parameters, averaged_knots(degree, parameters)?)?.curve(points)?;
    let error = largest(&distances(&curve, parameters, points));
    if error <= tolerance {
        return Ok(curve);
    }
    Err(SplineError::ToleranceNotReached { error, control_points: points.len(), tolerance })
}

/// The middle between the two neighbouring parameters around the middle of a span; none where the span holds one only.
fn middle_gap(parameters: &[f64], start: f64, end: f64) -> Option<f64> {
    let middle = 0.5 * (start + end);
    parameters
        .windows(2)
        .map(|w| 0.5 * (w[0] + w[1]))
        .filter(|&k| k > start && k < end)
        .min_by(|a, b| (a - middle).abs().total_cmp(&(b - middle).abs()))
}

/// Distances of the points from the curve at their parameters.
fn distances<S: Scalar, const D: usize>(curve: &BSplineCurve<S, D>, parameters: &[f64], points: &[[S; D]]) -> Vec<f64> {
    parameters.iter().zip(points).map(|(&u, p)| distance(&curve.point_at(u), p)).collect()
}

/// Distance of the real parts of two points.
fn distance<S: Scalar, const D: usize>(a: &[S; D], b: &[S; D]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a.re() - b.re()).powi(2)).sum::<f64>().sqrt()
}

fn largest(errors: &[f64]) -> f64 {
    errors.iter().fold(0.0, |m: f64, &e| m.max(e))
}

fn is_clamped(knots: &KnotVector) -> bool {
    let (first, last) = knots.domain();
    knots.multiplicity(first) == knots.degree() + 1 && knots.multiplicity(last) == knots.degree() + 1
}

/// Whether every basis function can be given a parameter of its own at which it does not vanish.
fn schoenberg_whitney(parameters: &[f64], knots: &KnotVector) -> bool {
    let (p, n, k) = (knots.degree(), knots.control_points(), knots.as_slice());
    let mut free = parameters.iter().peekable();
    (0..n).all(|i| {
        // at the two ends of the domain, one function each does not vanish
        while free.next_if(|&&t| t <= k[i] && !(i == 0 && t == k[0])).is_some() {}
        free.next().is_some_and(|&t| t < k[i + p + 1] || (i == n - 1 && t == k[n]))
    })
}

/// QR factorisation by Givens rotations, a row at a time: the upper triangle for the columns `1 .. n - 1`.
fn triangularise(rows: &[(usize, Vec<f64>)], n: usize, width: usize) -> Result<Vec<f64>, SplineError> {
    let inner = n - 2;
    let mut triangle = vec![0.0; inner * width];
    for (first, values) in rows {
        // column c of the triangle is control point c + 1; `row` starts at column `i`
        let mut row = vec![0.0; width];
        let start = first.saturating_sub(1);
        for (j, value) in values.iter().enumerate() {
            if (1..n - 1).contains(&(first + j)) {
                row[first + j - 1 - start] = *value;
            }
        }
        for i in start..inner {
            if row[0] != 0.0 {
                let here = &mut triangle[i * width..(i + 1) * width];
                let radius = f64::hypot(here[0], row[0]);
                let (c, s) = (here[0] / radius, row[0] / radius);
                for (t, r) in here.iter_mut().zip(&mut row) {
                    (*t, *r) = (c * *t + s * *r, c * *r - s * *t);
                }
            } else if row.iter().all(|&r| r == 0.0) {
                break;
            }
            row.rotate_left(1);
            row[width - 1] = 0.0;
        }
    }
    let largest = triangle.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    if (0..inner).any(|i| triangle[i * width].abs() <= 1e-13 * largest) {
        return Err(SplineError::Singular);
    }
    Ok(triangle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_dual::Dual64;

    fn samples(n: usize) -> (Vec<f64>, Vec<[f64; 2]>) {
        let t: Vec<f64> = (0..n).map(|i| i as f64 / (n - 1) as f64).collect();
        let points = t.iter().map(|t| [(3.0 * t).cos(), (5.0 * t).sin() + 0.2 * t]).collect();
        (t, points)
    }

    #[test]
    fn the_residual_is_orthogonal_to_the_spline_space() {
        let (t, points) = samples(60);
        let knots = KnotVector::clamped(3, 0.0, 1.0, [0.1, 0.3, 0.35, 0.35, 0.8]).unwrap();
        let curve = fit(&t, &points, knots.clone()).unwrap();
        assert_eq!((curve.control_points()[0], curve.control_points()[8]), (points[0], points[59]));
        let mut moments = vec![[0.0; 2]; 9];
        for (u, p) in t.iter().zip(&points) {
            let span = knots.span(*u);
            let q = curve.point_at(*u);
            for (j, value) in knots.basis(span, *u).iter().enumerate() {
                for d in 0..2 {
                    moments[span - 3 + j][d] += value * (p[d] - q[d]);
                }
            }
        }
        assert!(moments[1..8].iter().flatten().all(|m| m.abs() < 1e-14 * 60.0), "{moments:?}");
    }

    #[test]
    fn as_many_points_as_control_points_are_interpolated() {
        let (t, points) = samples(8);
        let curve = fit(&t, &points, super::super::averaged_knots(3, &t).unwrap()).unwrap();
        for (u, p) in t.iter().zip(&points) {
            assert!(distance(&curve.point_at(*u), p) < 1e-13);
        }
    }

    #[test]
    fn the_fit_is_linear_in_dual_points() {
        let (t, points) = samples(40);
        let fit = LeastSquares::new(&t, KnotVector::clamped_uniform(4, 9).unwrap()).unwrap();
        let dual: Vec<_> = points.iter().map(|p| [Dual64::new(p[0], p[1]), Dual64::new(p[1], p[0])]).collect();
        let (dual, real) = (fit.curve(&dual).unwrap(), fit.curve(&points).unwrap());
        for (d, r) in dual.control_points().iter().zip(real.control_points()) {
            assert!((d[0].re - r[0]).abs() + (d[0].eps - r[1]).abs() + (d[1].eps - r[0]).abs() < 1e-13);
        }
    }

    #[test]
    fn tolerances_are_kept_with_few_control_points() {
        let (t, points) = samples(400);
        let mut before = 0;
        for tolerance in [1e-2, 1e-4, 1e-6, 1e-8] {
            let curve = fit_to_tolerance(&t, &points, 3, tolerance).unwrap();
            let worst = t.iter().zip(&points).map(|(u, p)| distance(&curve.point_at(*u), p)).fold(0.0, f64::max);
            let count = curve.control_points().len();
            assert!(worst <= tolerance && count > before && count < 200, "{tolerance} {worst} {count}");
            before = count;
        }
    }

    #[test]
    fn every_degree_ends_at_the_points_or_says_why_not() {
        // data with a jump of slope and uneven spacing: in the end the curve must interpolate
        let t: Vec<f64> = (0..30).map(|i| (i as f64 / 29.0).powi(2)).collect();
        let points: Vec<[f64; 1]> = t.iter().map(|t| [(t - 0.3f64).abs()]).collect();
        for degree in 1..=5 {
            let curve = fit_to_tolerance(&t, &points, degree, 1e-3).unwrap();
            assert!(curve.control_points().len() <= 30);
            assert!(matches!(
                fit_to_tolerance(&t, &points, degree, -1.0),
                Err(SplineError::ToleranceNotReached { .. })
            ));
        }
        assert!(matches!(fit_to_tolerance(&t, &points, 3, f64::NAN), Err(SplineError::ToleranceNotReached { .. })));
    }

    #[test]
    fn bad_input_is_refused() {
        use SplineError as E;
        let (t, points) = samples(10);
        let knots = KnotVector::clamped_uniform(3, 6).unwrap();
        assert!(matches!(fit(&t, &points[1..], knots.clone()), Err(E::PointCount { expected: 10, found: 9 })));
        assert!(matches!(fit(&t[..5], &points[..5], knots.clone()), Err(E::TooFewPoints { needed: 6, found: 5 })));
        assert!(matches!(fit(&t[1..], &points[1..], knots), Err(E::OutsideDomain { .. })));
        let crowded = KnotVector::clamped(3, 0.0, 1.0, [0.01, 0.02, 0.03, 0.04, 0.05]).unwrap();
        assert_eq!(fit(&t, &points, crowded).unwrap_err(), E::Singular);
        let open = KnotVector::new(1, vec![0.0, 0.0, 0.5, 1.0, 1.5]).unwrap();
        assert_eq!(fit(&t, &points, open).unwrap_err(), E::NotClamped);
        assert!(matches!(fit_to_tolerance(&t, &points, 0, 1.0), Err(E::DegreeZero)));
    }
}
