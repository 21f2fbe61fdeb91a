//! Dense factors of the size of a station, with right-hand sides beside them in the same rows.

use super::rows::{Combination, padded, subtract_row, subtract_transposed};
use crate::flow::linear::dot;

/// Number of columns that are eliminated at a time.
const PANEL: usize = 8;

/// A square matrix with right-hand sides beside it; once factorised both triangular factors, of which the lower one has a
/// unit diagonal that is not stored, and the solutions.
#[derive(Debug, Clone, Default)]
pub(super) struct Dense {
    size: usize,
    /// Length of a row.
    stride: usize,
    rows: Vec<f64>,
    /// Row that was exchanged with each row, in this order.
    exchanged: Vec<usize>,
}

impl Dense {
    /// Makes room for a matrix of a size beside right-hand sides of a number of columns.
    pub fn begin(&mut self, size: usize, right: usize) {
        (self.size, self.stride) = (size, padded(size) + padded(right));
        self.rows.clear();
        self.rows.resize(size * self.stride, 0.0);
        self.exchanged.clear();
    }

    /// Sets the first numbers of a row of the matrix, and the right-hand sides.
    pub fn put(&mut self, row: usize, own: &[f64], right: &[f64]) {
        let from = padded(self.size);
        let values = &mut self.rows[row * self.stride..][..self.stride];
        values[..own.len()].copy_from_slice(own);
        values[from..from + right.len()].copy_from_slice(right);
    }

    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row * self.stride + column] = value;
    }

    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row * self.stride + column] += value;
    }

    /// The solutions of a row, after factorisation.
    pub fn solution(&self, row: usize) -> &[f64] {
        &self.rows[row * self.stride + padded(self.size)..(row + 1) * self.stride]
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.rows[row * self.stride..][..self.size]
    }

    /// Factorises the matrix and solves for the right-hand sides. Returns `false` where it is singular or has a
    /// pivot that is not finite.
    pub fn factorise(&mut self) -> bool {
        let (size, stride) = (self.size, self.stride);
        for first in (0..size).step_by(PANEL) {
            let end = (first + PANEL).min(size);
            for column in first..end {
                if !self.eliminate(column, first) {
                    return false;
                }
            }
            // the rows of the panel to the right of it, one after the other; then all rows below
            let right = first + PANEL;
            for row in first + 1..end {
                let (above, own) = self.rows.split_at_mut(row * stride);
                let product = Combination {
                    rows: &mut own[..stride],
                    stride,
                    factors: first..row,
                    columns: right..stride,
                    source: &above[first * stride..],
                    source_stride: stride,
                    source_from: right,
                };
                product.subtract();
            }
            let (above, below) = self.rows.split_at_mut(end * stride);
            let product = Combination {
                rows: below,
                stride,
                factors: first..end,
                columns: right..stride,
                source: &above[first * stride..],
                source_stride: stride,
                source_from: right,
            };
            product.subtract();
        }
        solve_upper(&mut self.rows, size, stride, padded(size));
        true
    }

    /// Eliminates a column below the diagonal, within the panel that begins at the column `first`.
    fn eliminate(&mut self, column: usize, first: usize) -> bool {
        let (size, stride) = (self.size, self.stride);
        let (mut best, mut largest) = (column, 0.0);
        for row in column..size {
            let value = self.rows[row * stride + column].abs();
            if value > largest {
                (best, largest) = (row, value);
            }
        }
        // written so that NaN fails
        if !(largest > 0.0 && largest < f64::INFINITY) {
            return false;
        }
        self.exchanged.push(best);
        let (above, below) = self.rows.split_at_mut((column + 1) * stride);
        let own = &mut above[column * stride..];
        if best > column {
            own.swap_with_slice(&mut below[(best - column - 1) * stride..][..stride]);
        }
        let mut pivot_row = [0.0; PANEL];
        pivot_row.copy_from_slice(&own[first..first + PANEL]);
        let inverse = own[column].recip();
        // what is left of the pivot has been eliminated before
        pivot_row[..=column - first].fill(0.0);
        for row in below.chunks_mut(stride) {
            let factor = row[column] * inverse;
            row[column] = factor;
            let panel = &mut row[first..first + PANEL];
            for (value, pivot) in panel.iter_mut().zip(&pivot_row) {
                *value -= factor * pivot;
            }
        }
        true
    }

    /// Replaces a right-hand side by the solution.
    pub fn solve(&self, b: &mut [f64]) {
        for (row, &other) in self.exchanged.iter().enumerate() {
            b.swap(row, other);
        }
        for row in 1..self.size {
            b[row] -= dot(&self.row(row)[..row], &b[..row]);
        }
        for row in (0..self.size).rev() {
            let own = self.row(row);
            b[row] = (b[row] - dot(&own[row + 1..], &b[row + 1..])) / own[row];
        }
    }

    /// Replaces right-hand sides, `width` numbers for each row, by the solutions with the transpose. The width is a multiple of
    /// the widest vector.
    pub fn solve_transposed(&self, b: &mut [f64], width: usize) {
        let size = self.size;
        for first in (0..size).step_by(PANEL) {
            let end = (first + PANEL).min(size);
            for row in first..end {
                let (done, rest) = b.split_at_mut((row + 1) * width);
                let (own, values) = (&mut done[row * width..], self.row(row));
                let inverse = values[row].recip();
                own.iter_mut().for_each(|value| *value *= inverse);
                for (factor, other) in values[row + 1..end].iter().zip(rest.chunks_mut(width)) {
                    subtract_row(other, *factor, own);
                }
            }
            let (done, rest) = b.split_at_mut(end * width);
            let panel = (&self.rows[first * self.stride..], self.stride, end..size);
            subtract_transposed(rest, panel, &done[first * width..], width);
        }
        for first in (0..size).step_by(PANEL).rev() {
            let end = (first + PANEL).min(size);
            for row in (first + 1..end).rev() {
                let (before, own) = b.split_at_mut(row * width);
                let factors = &self.row(row)[first..row];
                for (factor, other) in factors.iter().zip(before[first * width..].chunks_mut(width)) {
                    subtract_row(other, *factor, &own[..width]);
                }
            }
            let (before, done) = b.split_at_mut(first * width);
            let panel = (&self.rows[first * self.stride..], self.stride, 0..first);
            subtract_transposed(before, panel, &done[..(end - first) * width], width);
        }
        for (row, &other) in self.exchanged.iter().enumerate().rev() {
            if other != row {
                let (left, right) = b.split_at_mut(other * width);
                left[row * width..][..width].swap_with_slice(&mut right[..width]);
            }
        }
    }
}

/// Number of rows that are solved together.
const TOGETHER: usize = 4;

/// Solves with an upper triangle in the leading columns of rows for the columns from `from` on.
fn solve_upper(rows: &mut [f64], size: usize, stride: usize, from: usize) {
    let mut end = size;
    while end > 0 {
        let start = (end - 1) / TOGETHER * TOGETHER;
        let (above, below) = rows.split_at_mut(end * stride);
        let group = &mut above[start * stride..];
        if end < size {
            let product = Combination {
                rows: group,
                stride,
                factors: end..size,
                columns: from..stride,
                source: below,
                source_stride: stride,
                source_from: from,
            };
            product.subtract();
        }
        for row in (start..end).rev() {
            let (before, behind) = rows.split_at_mut((row + 1) * stride);
            let own = &mut before[row * stride..];
            if row + 1 < end {
                let product = Combination {
                    rows: own,
                    stride,
                    factors: row + 1..end,
                    columns: from..stride,
                    source: behind,
                    source_stride: stride,
                    source_from: from,
                };
                product.subtract();
            }
            let own = &mut rows[row * stride..][..stride];
            let inverse = own[row].recip();
            own[from..].iter_mut().for_each(|value| *value *= inverse);
        }
        end = start;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn matrix(size: usize) -> DMatrix<f64> {
        let number = |i: usize, j: usize| ((3 * i + 7 * j * j + i * j) as f64).sin() + 0.01 * i as f64;
        DMatrix::from_fn(size, size, |i, j| number(i, j) + f64::from(u8::from(i == j)))
    }

    #[test]
    fn solves_for_what_stands_beside_and_later() {
        for size in [1, 4, 8, 9, 23] {
            let a = matrix(size);
            let x = DMatrix::from_fn(size, 3, |i, j| 1.0 + i as f64 - 2.5 * j as f64);
            let b = &a * &x;
            let mut dense = Dense::default();
            dense.begin(size, 3);
            for row in 0..size {
                let of = |m: &DMatrix<f64>| m.row(row).iter().copied().collect::<Vec<f64>>();
                dense.put(row, &of(&a), &of(&b));
            }
            assert!(dense.factorise());
            for row in 0..size {
                assert!((0..3).all(|j| (dense.solution(row)[j] - x[(row, j)]).abs() < 1e-9), "{size}");
            }
            let mut single: Vec<f64> = b.column(1).iter().copied().collect();
            dense.solve(&mut single);
            assert!((0..size).all(|i| (single[i] - x[(i, 1)]).abs() < 1e-9), "{size}");
            let c = a.transpose() * &x;
            let width = 8;
            let mut many = vec![0.0; size * width];
            (0..size).for_each(|i| (0..3).for_each(|j| many[width * i + j] = c[(i, j)]));
            dense.solve_transposed(&mut many, width);
            assert!((0..size).all(|i| (0..3).all(|j| (many[width * i + j] - x[(i, j)]).abs() < 1e-9)), "{size}");
        }
    }

    #[test]
    fn singular_matrices_have_no_factors() {
        for bad in [0.0, f64::NAN, f64::INFINITY] {
            let mut dense = Dense::default();
            dense.begin(5, 1);
            for row in 0..5 {
                dense.put(row, &[bad; 5], &[1.0]);
            }
            assert!(!dense.factorise());
        }
    }
}
