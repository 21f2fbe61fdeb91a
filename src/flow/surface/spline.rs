//! Functions along the surface as cubic splines over the node index.
//!
//! The coordinate is the index t of the nodes, so that the knots are the integers for every section. Interpolation,
//! projection and sub-panel correction are then constant operators whatever the shape, and only the map between t and
//! arc length knows the geometry.

use crate::flow::linear::Linear;
use crate::scalar::Scalar;
use num_dual::Dual;

/// Interpolating cubic spline over the integers 0 … n − 1, with constant second derivative in the two end intervals.
#[derive(Debug, Clone)]
pub(crate) struct IndexSpline {
    /// Sub-diagonal factors and inverse pivots of the tridiagonal system.
    factors: Vec<[f64; 2]>,
}

/// The index of the first of four consecutive coefficients, and their weights.
pub(crate) type Weights<S> = (usize, [S; 4]);

impl IndexSpline {
    pub fn new(nodes: usize) -> Self {
        let mut factors = Vec::with_capacity(nodes);
        let mut pivot = 1.0;
        factors.push([0.0, 1.0]);
        for i in 1..nodes {
            let [lower, diagonal] = if i + 1 == nodes { [-1.0, 1.0] } else { [1.0, 4.0] };
            let upper = if i == 1 { -1.0 } else { 1.0 };
            let factor = lower / pivot;
            pivot = diagonal - factor * upper;
            factors.push([factor, 1.0 / pivot]);
        }
        Self { factors }
    }

    fn upper(row: usize) -> f64 {
        if row == 0 { -1.0 } else { 1.0 }
    }

    /// B-spline coefficients of the interpolating spline: two more than there are values.
    pub fn coefficients<V: Linear>(&self, values: &[V]) -> Vec<V> {
        let n = values.len();
        let mut c = vec![values[0] * 0.0; n + 2];
        c[1] = values[0] - values[1];
        for i in 1..n {
            let right = if i + 1 == n { values[i] - values[i - 1] } else { values[i] * 6.0 };
            c[i + 1] = right - c[i] * self.factors[i][0];
        }
        c[n] = c[n] * self.factors[n - 1][1];
        for i in (0..n - 1).rev() {
            c[i + 1] = (c[i + 1] - c[i + 2] * Self::upper(i)) * self.factors[i][1];
        }
        c[0] = (c[1] - c[2]) * 3.0 + c[3];
        c[n + 1] = (c[n] - c[n - 1]) * 3.0 + c[n - 2];
        c
    }

    /// The transpose of [`coefficients`](Self::coefficients): sensitivities of the values from those of the coefficients.
    pub fn coefficients_transposed<V: Linear>(&self, sensitivities: &[V]) -> Vec<V> {
        let n = sensitivities.len() - 2;
        let mut y = sensitivities[1..=n].to_vec();
        let (first, last) = (sensitivities[0], sensitivities[n + 1]);
        for (i, weight) in [3.0, -3.0, 1.0].into_iter().enumerate() {
            y[i] = y[i] + first * weight;
            y[n - 1 - i] = y[n - 1 - i] + last * weight;
        }
        // transposed factors: forward with the upper triangle, back with the lower one
        for i in 0..n {
            if i > 0 {
                y[i] = y[i] - y[i - 1] * Self::upper(i - 1);
            }
            y[i] = y[i] * self.factors[i][1];
        }
        for i in (0..n - 1).rev() {
            y[i] = y[i] - y[i + 1] * self.factors[i + 1][0];
        }
        let (start, end) = (y[0], y[n - 1]);
        for value in &mut y[1..n - 1] {
            *value = *value * 6.0;
        }
        y[1] = y[1] - start;
        y[n - 2] = y[n - 2] - end;
        y
    }

    /// The value at `t` of the function with these coefficients.
    pub fn value(&self, coefficients: &[f64], t: f64) -> f64 {
        combine_real(&self.weights(t), coefficients)
    }

    /// `factor` times the derivatives of the value at `t` with respect to the values at the nodes.
    pub fn values_transposed(&self, t: f64, factor: f64) -> Vec<f64> {
        let (first, weights) = self.weights(t);
        let mut sensitivities = vec![0.0; self.factors.len() + 2];
        for (q, w) in weights.iter().enumerate() {
            sensitivities[first + q] = factor * w;
        }
        self.coefficients_transposed(&sensitivities)
    }

    fn locate<S: Scalar>(&self, t: S) -> (usize, S) {
        let last = self.factors.len() - 2;
        let cell = (t.re().max(0.0) as usize).min(last);
        (cell, t - cell as f64)
    }

    /// Weights of the coefficients for the value at `t`.
    pub fn weights<S: Scalar>(&self, t: S) -> Weights<S> {
        let (cell, u) = self.locate(t);
        let v = -u + 1.0;
        let sixth = 1.0 / 6.0;
        let inner = |u: S| ((u * 3.0 - 6.0) * u * u + 4.0) * sixth;
        (cell, [v * v * v * sixth, inner(u), inner(v), u * u * u * sixth])
    }

    /// Coefficients of the polynomial in t − `cell` between the nodes `cell` and `cell` + 1, the constant first.
    pub fn polynomial(&self, cell: usize, coefficients: &[f64]) -> [f64; 4] {
        let [a, b, c, d] = [0, 1, 2, 3].map(|q| coefficients[cell + q]);
        let sixth = 1.0 / 6.0;
        [(a + 4.0 * b + c) * sixth, 0.5 * (c - a), 0.5 * (a + c) - b, (d - a + 3.0 * (b - c)) * sixth]
    }

    /// Weights of the coefficients for the first derivative at `t`.
    pub fn slope_weights<S: Scalar>(&self, t: S) -> Weights<S> {
        let (cell, weights) = self.weights(Dual::new(t, S::from(1.0)));
        (cell, weights.map(|w| w.eps))
    }
}

/// The weighted sum of four coefficients.
pub(crate) fn combine<S: Scalar>(weights: &Weights<S>, coefficients: &[S]) -> S {
    let (first, w) = weights;
    w[0] * coefficients[*first]
        + w[1] * coefficients[first + 1]
        + w[2] * coefficients[first + 2]
        + w[3] * coefficients[first + 3]
}

/// The sum of four coefficients with real weights.
pub(crate) fn weigh<S: Scalar>((first, w): &Weights<f64>, coefficients: &[S]) -> S {
    coefficients[*first] * w[0]
        + coefficients[first + 1] * w[1]
        + coefficients[first + 2] * w[2]
        + coefficients[first + 3] * w[3]
}

/// The weighted sum of four real coefficients.
pub(crate) fn combine_real<S: Scalar>(weights: &Weights<S>, coefficients: &[f64]) -> S {
    let (first, w) = weights;
    w[0] * coefficients[*first]
        + w[1] * coefficients[first + 1]
        + w[2] * coefficients[first + 2]
        + w[3] * coefficients[first + 3]
}

/// Finds `t` in [`low`, `high`] where the spline has `value`. The spline must rise (`sign` 1) or fall (`sign` −1)
/// there.
///
/// Newton's method is kept inside a shrinking bracket. Values beyond the ends give the ends.
pub(crate) fn invert(spline: &IndexSpline, c: &[f64], value: f64, mut low: f64, mut high: f64, sign: f64) -> f64 {
    let at = |t: f64| sign * (combine_real(&spline.weights(t), c) - value);
    if at(low) >= 0.0 {
        return low;
    }
    if at(high) <= 0.0 {
        return high;
    }
    let mut t = 0.5 * (low + high);
    for _ in 0..80 {
        let f = at(t);
        if f == 0.0 {
            return t;
        }
        if f < 0.0 {
            low = t
        } else {
            high = t
        }
        let step = f / (sign * combine_real(&spline.slope_weights(t), c));
        let next = t - step;
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        if (next - t).abs() <= 4.0 * f64::EPSILON * t.abs().max(1.0) {
            return next;
        }
        t = next;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reproduces_parabolas_and_nodes() {
        let f = |t: f64| 0.3 + 0.2 * t - 0.07 * t * t;
        let spline = IndexSpline::new(12);
        let c = spline.coefficients(&(0..12).map(|i| f(i as f64)).collect::<Vec<_>>());
        for t in [0.0, 0.4, 3.0, 7.9, 11.0] {
            assert!((combine_real(&spline.weights(t), &c) - f(t)).abs() < 1e-13);
            assert!((combine_real(&spline.slope_weights(t), &c) - (0.2 - 0.14 * t)).abs() < 1e-13);
            let (cell, u) = spline.locate(t);
            let p = spline.polynomial(cell, &c);
            assert!((p[0] + u * (p[1] + u * (p[2] + u * p[3])) - f(t)).abs() < 1e-13);
        }
        let wild: Vec<f64> = (0..12).map(|i| ((i * i) as f64).sin()).collect();
        let c = spline.coefficients(&wild);
        for (i, v) in wild.iter().enumerate() {
            assert!((combine_real(&spline.weights(i as f64), &c) - v).abs() < 1e-13);
        }
    }

    #[test]
    fn the_transpose_is_the_transpose() {
        let spline = IndexSpline::new(9);
        let x: Vec<f64> = (0..9).map(|i| (i as f64 * 1.3).cos()).collect();
        let y: Vec<f64> = (0..11).map(|i| (i as f64 * 0.7).sin()).collect();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let forward = dot(&spline.coefficients(&x), &y);
        assert!((forward - dot(&x, &spline.coefficients_transposed(&y))).abs() < 1e-13);
    }

    #[test]
    fn inversion_finds_the_abscissa() {
        let spline = IndexSpline::new(30);
        let c = spline.coefficients(&(0..30).map(|i| (i as f64 / 20.0).exp()).collect::<Vec<_>>());
        for t in [0.01, 3.3, 17.0, 28.7] {
            let value = combine_real(&spline.weights(t), &c);
            assert!((invert(&spline, &c, value, 0.0, 29.0, 1.0) - t).abs() < 1e-11);
        }
        assert_eq!(invert(&spline, &c, 0.0, 0.0, 29.0, 1.0), 0.0);
        assert_eq!(invert(&spline, &c, 1e9, 0.0, 29.0, 1.0), 29.0);
    }
}
