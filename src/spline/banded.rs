//! Banded linear systems: factorised once in `f64`, solved for right-hand sides of any scalar.

use super::SplineError;
use crate::scalar::Scalar;

/// A row of a banded matrix: the column of its first entry, and its entries.
pub(super) type BandRow = (usize, Vec<f64>);

/// LU factors, with row exchanges, of a square banded matrix.
#[derive(Debug, Clone)]
pub(super) struct BandedFactors {
    /// Entry `(i, j)` stands at `i * width + j + lower - i`; the columns right of the band take the fill-in of
    /// exchanges.
    entries: Vec<f64>,
    /// The row with which row `k` was exchanged at step `k`.
    exchanges: Vec<usize>,
    /// One over the largest entry of each row before elimination; the right-hand side takes the same factor.
    scales: Vec<f64>,
    lower: usize,
    width: usize,
}

impl BandedFactors {
    /// Factorises the matrix with the given rows; exact zeros at the ends of a row do not widen the band.
    ///
    /// # Errors
    /// [`SplineError::Singular`] where a pivot is no larger than round-off.
    pub(super) fn new(rows: &[BandRow]) -> Result<Self, SplineError> {
        let n = rows.len();
        let (mut lower, mut upper) = (0, 0);
        for (i, (first, values)) in rows.iter().enumerate() {
            for (j, _) in values.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                lower = lower.max(i.saturating_sub(first + j));
                upper = upper.max((first + j).saturating_sub(i));
            }
        }
        let width = 2 * lower + upper + 1;
        let mut entries = vec![0.0; n * width];
        let mut scales = Vec::with_capacity(n);
        for (i, (first, values)) in rows.iter().enumerate() {
            let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            if largest == 0.0 || !largest.is_finite() {
                return Err(SplineError::Singular);
            }
            scales.push(1.0 / largest);
            for (j, value) in values.iter().enumerate().filter(|(_, v)| **v != 0.0) {
                entries[i * width + first + j + lower - i] = value / largest;
            }
        }
        let mut factors = Self { entries, exchanges: Vec::with_capacity(n), scales, lower, width };
        factors.eliminate()?;
        Ok(factors)
    }

    fn at(&self, i: usize, j: usize) -> usize {
        i * self.width + j + self.lower - i
    }

    /// Columns right of the diagonal that can be filled.
    fn reach(&self) -> usize {
        self.width - 1 - self.lower
    }

    fn eliminate(&mut self) -> Result<(), SplineError> {
        let n = self.scales.len();
        for k in 0..n {
            let last_row = (k + self.lower).min(n - 1);
            let last_column = (k + self.reach()).min(n - 1);
            let mut pivot = k;
            for i in k + 1..=last_row {
                if self.entries[self.at(i, k)].abs() > self.entries[self.at(pivot, k)].abs() {
                    pivot = i;
                }
            }
            self.exchanges.push(pivot);
            if pivot != k {
                for j in k..=last_column {
                    let (a, b) = (self.at(k, j), self.at(pivot, j));
                    self.entries.swap(a, b);
                }
            }
            let diagonal = self.entries[self.at(k, k)];
            // rows are scaled to a largest entry of one
            if diagonal.abs() <= 1e-14 {
                return Err(SplineError::Singular);
            }
            for i in k + 1..=last_row {
                let here = self.at(i, k);
                let factor = self.entries[here] / diagonal;
                self.entries[here] = factor;
                if factor != 0.0 {
                    for j in k + 1..=last_column {
                        let (to, from) = (self.at(i, j), self.at(k, j));
                        self.entries[to] -= factor * self.entries[from];
                    }
                }
            }
        }
        Ok(())
    }

    /// Replaces the right-hand side (as many points as rows) by the solution.
    pub(super) fn solve_in_place<S: Scalar, const D: usize>(&self, b: &mut [[S; D]]) {
        let n = self.scales.len();
        for (point, scale) in b.iter_mut().zip(&self.scales) {
            for c in point.iter_mut() {
                *c *= *scale;
            }
        }
        for k in 0..n {
            b.swap(k, self.exchanges[k]);
            for i in k + 1..=(k + self.lower).min(n - 1) {
                subtract(b, i, k, self.entries[self.at(i, k)]);
            }
        }
        for k in (0..n).rev() {
            for j in k + 1..=(k + self.reach()).min(n - 1) {
                subtract(b, k, j, self.entries[self.at(k, j)]);
            }
            let diagonal = self.entries[self.at(k, k)];
            for c in b[k].iter_mut() {
                *c /= diagonal;
            }
        }
    }
}

/// `b[to] -= factor * b[from]`.
fn subtract<S: Scalar, const D: usize>(b: &mut [[S; D]], to: usize, from: usize, factor: f64) {
    if factor != 0.0 {
        let known = b[from];
        for (c, k) in b[to].iter_mut().zip(known) {
            *c -= k * factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_band_that_needs_exchanges() {
        // zero diagonal: impossible without row exchanges
        let n = 30;
        let rows: Vec<BandRow> = (0..n)
            .map(|i: usize| {
                let first = i.saturating_sub(2);
                let columns = first..(i + 3).min(n);
                (first, columns.map(|j| if i == j { 0.0 } else { ((3 * i + 7 * j) as f64).sin() + 0.1 }).collect())
            })
            .collect();
        let exact: Vec<[f64; 2]> = (0..n).map(|i| [i as f64, (i as f64).cos()]).collect();
        let mut b: Vec<[f64; 2]> = rows
            .iter()
            .map(|(first, values)| {
                let mut sum = [0.0; 2];
                for (j, v) in values.iter().enumerate() {
                    for d in 0..2 {
                        sum[d] += v * exact[first + j][d];
                    }
                }
                sum
            })
            .collect();
        BandedFactors::new(&rows).unwrap().solve_in_place(&mut b);
        for (x, e) in b.iter().zip(&exact) {
            for d in 0..2 {
                assert!((x[d] - e[d]).abs() < 1e-10, "{x:?} {e:?}");
            }
        }
    }

    #[test]
    fn a_singular_band_is_refused() {
        let rows = vec![(0, vec![1.0, 1.0]), (0, vec![2.0, 2.0])];
        assert_eq!(BandedFactors::new(&rows).unwrap_err(), SplineError::Singular);
    }
}
