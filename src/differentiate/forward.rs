//! Chunked forward mode.

use super::{Function, VectorFunction};
use nalgebra::DMatrix;
use num_dual::{DualSVec64, HyperDualSVec64};

/// Directions carried in one forward sweep.
///
/// Eight `f64` fill whole vector registers on every common target; odd widths cost two to three times as much per
/// direction.
pub const CHUNK: usize = 8;

/// The dual number of one forward sweep: a value and [`CHUNK`] directional derivatives.
pub type Direction = DualSVec64<CHUNK>;

/// Value and gradient of `function` at `x` (length n), in `ceil(n / CHUNK)` sweeps.
///
/// # Errors
/// The first error that the function returns.
pub fn gradient<F: Function>(function: &F, x: &[f64]) -> Result<(f64, Vec<f64>), F::Error> {
    struct AsVector<'a, F>(&'a F);
    impl<F: Function> VectorFunction for AsVector<'_, F> {
        type Error = F::Error;
        fn evaluate<S: crate::scalar::Scalar>(&self, x: &[S]) -> Result<Vec<S>, F::Error> {
            Ok(vec![self.0.evaluate(x)?])
        }
    }
    let (values, jacobian) = jacobian(&AsVector(function), x)?;
    Ok((values[0], jacobian.iter().copied().collect()))
}

/// Values (length m) and Jacobian (m rows × n columns) of `function` at `x` (length n), in `ceil(n / CHUNK)` sweeps.
///
/// # Errors
/// The first error that the function returns.
pub fn jacobian<F: VectorFunction>(function: &F, x: &[f64]) -> Result<(Vec<f64>, DMatrix<f64>), F::Error> {
    let n = x.len();
    let mut point: Vec<Direction> = x.iter().map(|&v| Direction::from_re(v)).collect();
    if n == 0 {
        let values = function.evaluate(&point)?.iter().map(|v| v.re).collect::<Vec<_>>();
        let rows = values.len();
        return Ok((values, DMatrix::zeros(rows, 0)));
    }
    let mut values = Vec::new();
    let mut matrix = DMatrix::zeros(0, n);
    for first in (0..n).step_by(CHUNK) {
        let columns = first..(first + CHUNK).min(n);
        for k in columns.clone() {
            point[k] = Direction::from_re(x[k]).derivative(k - first);
        }
        let result = function.evaluate(&point)?;
        if first == 0 {
            values = result.iter().map(|v| v.re).collect();
            matrix = DMatrix::zeros(result.len(), n);
        }
        for (row, value) in result.iter().enumerate() {
            if let Some(eps) = &value.eps.0 {
                for k in columns.clone() {
                    matrix[(row, k)] = eps[k - first];
                }
            }
        }
        for k in columns {
            point[k] = Direction::from_re(x[k]);
        }
    }
    Ok((values, matrix))
}

/// Value, gradient and Hessian (n × n, symmetric) of `function` at `x` (length n).
///
/// Second derivatives come from hyper-dual numbers, a block of [`CHUNK`] × [`CHUNK`] mixed derivatives per sweep.
///
/// # Errors
/// The first error that the function returns.
pub fn hessian<F: Function>(function: &F, x: &[f64]) -> Result<(f64, Vec<f64>, DMatrix<f64>), F::Error> {
    type Pair = HyperDualSVec64<CHUNK, CHUNK>;
    let n = x.len();
    let mut value = 0.0;
    let mut slope = vec![0.0; n];
    let mut matrix = DMatrix::zeros(n, n);
    if n == 0 {
        value = function.evaluate::<f64>(&[])?;
    }
    for i0 in (0..n).step_by(CHUNK) {
        let rows = i0..(i0 + CHUNK).min(n);
        for j0 in (i0..n).step_by(CHUNK) {
            let columns = j0..(j0 + CHUNK).min(n);
            let mut point: Vec<Pair> = x.iter().map(|&v| Pair::from_re(v)).collect();
            for i in rows.clone() {
                point[i] = point[i].derivative1(i - i0);
            }
            for j in columns.clone() {
                point[j] = point[j].derivative2(j - j0);
            }
            let result = function.evaluate(&point)?;
            value = result.re;
            for i in rows.clone() {
                slope[i] = result.eps1.0.map_or(0.0, |e| e[i - i0]);
                for j in columns.clone() {
                    let second = result.eps1eps2.0.map_or(0.0, |e| e[(i - i0, j - j0)]);
                    matrix[(i, j)] = second;
                    matrix[(j, i)] = second;
                }
            }
        }
    }
    Ok((value, slope, matrix))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Scalar;
    use approx::assert_relative_eq;
    use std::convert::Infallible;

    /// sum over i of exp(x_i x_{i+1}) + x_i^3: every derivative in closed form.
    struct Chain;
    impl Function for Chain {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Infallible> {
            let pairs: S = x.windows(2).map(|w| (w[0] * w[1]).exp()).sum();
            Ok(pairs + x.iter().map(|v| v.powi(3)).sum::<S>())
        }
    }

    #[test]
    fn gradient_and_hessian_match_the_closed_form() {
        for n in [1usize, 2, 7, 8, 9, 19] {
            let x: Vec<f64> = (0..n).map(|i| 0.3 * (i as f64 * 1.7).sin()).collect();
            let (value, slope) = gradient(&Chain, &x).unwrap();
            let (value2, slope2, matrix) = hessian(&Chain, &x).unwrap();
            assert_relative_eq!(value, Chain.evaluate(&x).unwrap(), max_relative = 1e-14);
            assert_relative_eq!(value, value2, max_relative = 1e-14);
            for i in 0..n {
                let mut g = 3.0 * x[i] * x[i];
                let mut h = 6.0 * x[i];
                for j in [i.wrapping_sub(1), i + 1] {
                    if j < n {
                        g += x[j] * (x[i] * x[j]).exp();
                        h += x[j] * x[j] * (x[i] * x[j]).exp();
                    }
                }
                assert_relative_eq!(slope[i], g, max_relative = 1e-13);
                assert_relative_eq!(slope2[i], g, max_relative = 1e-13);
                assert_relative_eq!(matrix[(i, i)], h, max_relative = 1e-12);
                for j in 0..n {
                    assert_eq!(matrix[(i, j)], matrix[(j, i)]);
                    if i.abs_diff(j) > 1 {
                        assert_eq!(matrix[(i, j)], 0.0);
                    } else if i != j {
                        let p = x[i] * x[j];
                        assert_relative_eq!(matrix[(i, j)], (1.0 + p) * p.exp(), max_relative = 1e-13);
                    }
                }
            }
        }
    }

    #[test]
    fn no_variables_is_a_value() {
        assert_eq!(gradient(&Chain, &[]).unwrap(), (0.0, vec![]));
    }
}
