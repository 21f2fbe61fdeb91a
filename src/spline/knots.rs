//! Knot vectors and B-spline basis functions.

use super::SplineError;
use crate::scalar::Scalar;
use smallvec::SmallVec;

/// The `degree + 1` basis functions that do not vanish on a span (on the stack up to degree 7).
pub type BasisValues<S> = SmallVec<[S; 8]>;

/// A knot vector with its degree.
///
/// `n` control points go with `n + degree + 1` knots. The spline lives on `[knots[degree], knots[n]]`. Knots are
/// plain numbers: the control points carry the derivatives, so a spline is linear in them.
///
/// ```
/// use aeroform::spline::KnotVector;
/// let knots = KnotVector::clamped_uniform(3, 5).unwrap();
/// assert_eq!(knots.as_slice(), [0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0]);
/// let values = knots.basis(knots.span(0.25), 0.25);
/// assert_eq!(values.iter().sum::<f64>(), 1.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
}

impl KnotVector {
    /// A knot vector from its knots.
    ///
    /// # Errors
    /// A degree of zero, fewer than `degree + 1` control points, decreasing or non-finite knots, an inner knot more
    /// than `degree` times or an end knot more than `degree + 1` times, an empty domain.
    pub fn new(degree: usize, knots: Vec<f64>) -> Result<Self, SplineError> {
        if degree == 0 {
            return Err(SplineError::DegreeZero);
        }
        if knots.len() < 2 * (degree + 1) {
            return Err(SplineError::TooFewControlPoints {
                degree,
                control_points: knots.len().saturating_sub(degree + 1),
            });
        }
        for (index, &value) in knots.iter().enumerate() {
            if !value.is_finite() || (index > 0 && value < knots[index - 1]) {
                return Err(SplineError::BadKnot { index, value });
            }
        }
        let result = Self { degree, knots };
        let (first, last) = result.domain();
        if first >= last {
            return Err(SplineError::BadKnot { index: degree, value: first });
        }
        for &value in &result.knots {
            let multiplicity = result.multiplicity(value);
            let allowed = if value > first && value < last { degree } else { degree + 1 };
            if multiplicity > allowed {
                return Err(SplineError::Multiplicity { value, multiplicity, degree, allowed });
            }
        }
        Ok(result)
    }

    /// Clamped knots on [0, 1] with evenly spaced inner knots.
    ///
    /// # Errors
    /// A degree of zero or fewer than `degree + 1` control points.
    pub fn clamped_uniform(degree: usize, control_points: usize) -> Result<Self, SplineError> {
        if degree == 0 {
            return Err(SplineError::DegreeZero);
        }
        if control_points <= degree {
            return Err(SplineError::TooFewControlPoints { degree, control_points });
        }
        let spans = control_points - degree;
        let inner = (1..spans).map(|i| i as f64 / spans as f64);
        Self::clamped(degree, 0.0, 1.0, inner)
    }

    /// Clamped knots on `[first, last]` with the given inner knots.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn clamped(
        degree: usize,
        first: f64,
        last: f64,
        inner: impl IntoIterator<Item = f64>,
    ) -> Result<Self, SplineError> {
        let mut knots = vec![first; degree + 1];
        knots.extend(inner);
        knots.extend(std::iter::repeat_n(last, degree + 1));
        Self::new(degree, knots)
    }

    /// Polynomial degree of the splines on these knots.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots, in increasing order.
    pub fn as_slice(&self) -> &[f64] {
        &self.knots
    }

    /// Number of control points that go with the knots.
    pub fn control_points(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// First and last parameter of the spline.
    pub fn domain(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.control_points()])
    }

    /// How often a value stands among the knots; zero where it is no knot.
    pub fn multiplicity(&self, knot: f64) -> usize {
        self.knots.iter().filter(|&&k| k == knot).count()
    }

    /// The span of a parameter: the index `i` with `knots[i] <= u < knots[i + 1]`.
    ///
    /// The last span includes the end of the domain; parameters outside take the first or last span, so that
    /// evaluation there continues the end polynomial.
    pub fn span(&self, u: f64) -> usize {
        let (low, high) = (self.degree, self.control_points());
        let beyond = self.knots[low + 1..high].partition_point(|&k| k <= u);
        // a repeated last inner knot cannot occur at the end of the domain, so this span is not empty
        low + beyond
    }

    /// The spans that are not empty: `(index, start, end)`.
    pub fn spans(&self) -> impl Iterator<Item = (usize, f64, f64)> + '_ {
        (self.degree..self.control_points())
            .map(|i| (i, self.knots[i], self.knots[i + 1]))
            .filter(|(_, start, end)| start < end)
    }

    /// Greville abscissae: averages of `degree` consecutive knots, one per control point.
    ///
    /// Control points with these abscissae reproduce the identity (linear precision).
    pub fn greville(&self) -> Vec<f64> {
        (0..self.control_points())
            .map(|i| {
                let window = &self.knots[i + 1..=i + self.degree];
                // equal knots average to themselves exactly
                if window[0] == window[self.degree - 1] {
                    window[0]
                } else {
                    window.iter().sum::<f64>() / self.degree as f64
                }
            })
            .collect()
    }

    /// The basis functions `span - degree ..= span` at `u` (Cox-de Boor; The NURBS Book, A2.2).
    pub fn basis<S: Scalar>(&self, span: usize, u: S) -> BasisValues<S> {
        self.basis_of_degree(span, u, self.degree)
    }

    /// Basis functions and their derivatives up to `order`: `result[k][j]` is the k-th derivative of function
    /// `span - degree + j` (The NURBS Book, A2.3). Orders above the degree are zero.
    pub fn basis_derivatives<S: Scalar>(&self, span: usize, u: S, order: usize) -> Vec<BasisValues<S>> {
        let p = self.degree;
        let zero = S::from(0.0);
        let mut result: Vec<BasisValues<S>> = vec![SmallVec::from_elem(zero, p + 1); order + 1];
        result[0] = self.basis(span, u);
        // values of lower degree, from which differences give the derivatives
        for (k, derivative) in result.iter_mut().enumerate().take(p + 1).skip(1) {
            let mut row: BasisValues<S> = self.basis_of_degree(span, u, p - k);
            // raise the degree k times by differencing: N' of degree q from values of degree q - 1
            for q in p - k + 1..=p {
                let mut raised: BasisValues<S> = SmallVec::from_elem(zero, q + 1);
                for (j, entry) in raised.iter_mut().enumerate() {
                    let first = span + j - q;
                    let mut sum = zero;
                    if j > 0 {
                        sum += row[j - 1] / (self.knots[first + q] - self.knots[first]);
                    }
                    if j < q {
                        sum -= row[j] / (self.knots[first + q + 1] - self.knots[first + 1]);
                    }
                    *entry = sum * q as f64;
                }
                row = raised;
            }
            *derivative = row;
        }
        result
    }

    /// The basis functions of degree `q <= degree` on the same knots that do not vanish on the span.
    pub(super) fn basis_of_degree<S: Scalar>(&self, span: usize, u: S, q: usize) -> BasisValues<S> {
        let mut values: BasisValues<S> = SmallVec::from_elem(S::from(0.0), q + 1);
        values[0] = S::from(1.0);
        for j in 1..=q {
            self.raise(span, u, &mut values[..=j]);
        }
        values
    }

    /// The basis functions and those of one degree less that do not vanish on the span.
    pub(super) fn basis_and_lower<S: Scalar>(&self, span: usize, u: S) -> [BasisValues<S>; 2] {
        let lower = self.basis_of_degree(span, u, self.degree - 1);
        let mut values = lower.clone();
        values.push(S::from(0.0));
        self.raise(span, u, &mut values);
        [values, lower]
    }

    /// Turns basis functions, which fill all places but the last, into those of the next degree, which fill all.
    fn raise<S: Scalar>(&self, span: usize, u: S, values: &mut [S]) {
        let j = values.len() - 1;
        let (left, right) = (&self.knots[span + 1 - j..][..j], &self.knots[span + 1..][..j]);
        let mut saved = S::from(0.0);
        for ((value, left), right) in values.iter_mut().zip(left).zip(right) {
            let term = *value / (right - left);
            *value = saved + term * (-u + *right);
            saved = term * (u - *left);
        }
        values[j] = saved;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use num_dual::{Dual64, first_derivative};
    use proptest::prelude::*;

    fn any_knots() -> impl Strategy<Value = KnotVector> {
        (1usize..=6, proptest::collection::vec(0.05f64..1.0, 0..6)).prop_map(|(p, gaps)| {
            let mut inner = vec![];
            let mut at = 0.0;
            for g in gaps {
                at += g;
                inner.push(at);
            }
            KnotVector::clamped(p, 0.0, at + 0.5, inner).unwrap()
        })
    }

    proptest! {
        #[test]
        fn basis_is_a_partition_of_unity(knots in any_knots(), t in 0.0f64..=1.0) {
            let (a, b) = knots.domain();
            let u = a + t * (b - a);
            let span = knots.span(u);
            prop_assert!(knots.as_slice()[span] <= u && (u < knots.as_slice()[span + 1] || u == b));
            let rows = knots.basis_derivatives(span, u, knots.degree() + 1);
            prop_assert!(rows[0].iter().all(|&v| v >= 0.0));
            prop_assert!((rows[0].iter().sum::<f64>() - 1.0).abs() < 1e-14);
            for row in &rows[1..] {
                let scale = row.iter().fold(1.0, |m: f64, v| m.max(v.abs()));
                prop_assert!(row.iter().sum::<f64>().abs() < 1e-13 * scale);
            }
            prop_assert!(rows[knots.degree() + 1].iter().all(|&v| v == 0.0));
        }

        #[test]
        fn derivatives_agree_with_duals(knots in any_knots(), t in 0.0f64..=1.0) {
            let (a, b) = knots.domain();
            let u = a + t * (b - a);
            let span = knots.span(u);
            let rows = knots.basis_derivatives(span, u, knots.degree());
            for order in 0..knots.degree() {
                let dual = knots.basis_derivatives(span, Dual64::new(u, 1.0), order);
                let scale = rows[order + 1].iter().fold(1.0, |m: f64, v| m.max(v.abs()));
                for j in 0..=knots.degree() {
                    prop_assert!((dual[order][j].eps - rows[order + 1][j]).abs() < 1e-12 * scale);
                }
            }
        }

        #[test]
        fn greville_abscissae_have_linear_precision(knots in any_knots(), t in 0.0f64..=1.0) {
            let (a, b) = knots.domain();
            let u = a + t * (b - a);
            let span = knots.span(u);
            let greville = knots.greville();
            let x: f64 = knots.basis(span, u).iter().zip(&greville[span - knots.degree()..]).map(|(n, g)| n * g).sum();
            prop_assert!((x - u).abs() < 1e-14 * b);
        }
    }

    #[test]
    fn cubic_bezier_basis_is_bernstein() {
        let knots = KnotVector::clamped_uniform(3, 4).unwrap();
        let values = knots.basis(knots.span(0.3), 0.3);
        for (value, bernstein) in values.iter().zip([0.343, 0.441, 0.189, 0.027]) {
            assert_relative_eq!(*value, bernstein, max_relative = 1e-14);
        }
        let slope = first_derivative(|u: Dual64| knots.basis(3, u)[1], 0.3).1;
        assert_relative_eq!(slope, 3.0 * (0.7 * 0.7 - 2.0 * 0.3 * 0.7), max_relative = 1e-13);
    }

    #[test]
    fn spans_at_knots_and_ends() {
        let knots = KnotVector::clamped(2, 0.0, 1.0, [0.25, 0.5, 0.5]).unwrap();
        assert_eq!([-1.0, 0.0, 0.25, 0.4, 0.5, 1.0, 2.0].map(|u| knots.span(u)), [2, 2, 3, 3, 5, 5, 5]);
        assert_eq!(knots.spans().count(), 3);
    }

    #[test]
    fn bad_knots_are_refused() {
        use SplineError as E;
        assert_eq!(KnotVector::clamped_uniform(0, 4), Err(E::DegreeZero));
        assert!(matches!(KnotVector::clamped_uniform(3, 3), Err(E::TooFewControlPoints { .. })));
        assert!(matches!(KnotVector::new(1, vec![0.0, 0.0, f64::NAN, 1.0]), Err(E::BadKnot { index: 2, .. })));
        assert!(matches!(KnotVector::new(1, vec![0.0, 0.0, 1.0, 0.5]), Err(E::BadKnot { index: 3, .. })));
        assert!(matches!(KnotVector::clamped(1, 0.0, 1.0, [0.5, 0.5]), Err(E::Multiplicity { .. })));
        assert!(matches!(KnotVector::new(1, vec![1.0; 4]), Err(E::BadKnot { .. })));
    }
}
