//! Dense factors of the size of a station, with right-hand sides beside them in the same rows.

use super::rows::{Combination, Multiples, padded};
use crate::flow::linear::add_scaled;
use std::ops::Range;

/// Number of columns that are eliminated at a time.
const PANEL: usize = 8;

/// Smallest pivot over the largest number of its column before elimination; columns with smaller ones are put off.
const SMALLEST: f64 = 3e-3;
/// Largest number of columns that are put off; where more would have to be, weak pivots are taken.
pub(super) const PUT_OFF: usize = 15;

/// A square matrix with right-hand sides beside it; once factorised both triangular factors, of which the lower one has a
/// unit diagonal that is not stored, and the solutions. Columns without a good pivot are put off: they stand last, together
/// with as many rows, and are not eliminated.
#[derive(Debug, Clone, Default)]
pub(super) struct Dense {
    size: usize,
    /// Number of columns that are eliminated.
    done: usize,
    /// Number of columns of the right-hand sides. Behind them is room for the columns that are put off.
    right: usize,
    /// Length of a row.
    stride: usize,
    rows: Vec<f64>,
    /// Row that was exchanged with each row, in this order.
    exchanged: Vec<usize>,
    /// The column of the matrix that stands at each place.
    order: Vec<usize>,
    /// Largest number of each of these columns before elimination.
    largest: Vec<f64>,
    /// Largest number of columns that may be put off.
    allowed: usize,
}

impl Dense {
    /// Makes room for a matrix of a size beside right-hand sides of a number of columns. So many columns may be put off.
    pub fn begin(&mut self, size: usize, right: usize, allowed: usize) {
        (self.size, self.right) = (size, padded(right));
        self.stride = padded(size) + self.right + padded(allowed);
        self.rows.resize(size * self.stride, 0.0);
        self.exchanged.clear();
        (self.done, self.allowed) = (size, allowed);
        self.order.clear();
        self.order.extend(0..size);
    }

    /// Sets a row: the first numbers of the matrix, the others being zeros, and the right-hand sides, which are given in two
    /// parts.
    pub fn put(&mut self, row: usize, own: &[f64], right: [&[f64]; 2]) {
        let (from, middle) = (padded(self.size), padded(self.size) + right[0].len());
        let values = &mut self.rows[row * self.stride..][..self.stride];
        let end = middle + right[1].len();
        values[..own.len()].copy_from_slice(own);
        values[own.len()..from].fill(0.0);
        values[from..middle].copy_from_slice(right[0]);
        values[middle..end].copy_from_slice(right[1]);
        values[end..].fill(0.0);
    }

    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row * self.stride + column] = value;
    }

    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row * self.stride + column] += value;
    }

    /// The solutions of a row after factorisation, for the right-hand sides and for the columns that were put off.
    pub fn solution(&self, row: usize) -> (&[f64], &[f64]) {
        let solution = &self.rows[row * self.stride + padded(self.size)..(row + 1) * self.stride];
        let (right, off) = solution.split_at(self.right);
        (right, &off[..self.put_off()])
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.rows[row * self.stride..][..self.size]
    }

    /// Factorises the matrix and solves for the right-hand sides and the columns that are put off. Returns `false` where the
    /// matrix is singular or has a pivot that is not finite.
    pub fn factorise(&mut self) -> bool {
        if !self.measure() || !self.eliminate_all() {
            return false;
        }
        let right = padded(self.size)..padded(self.size) + self.right;
        for row in self.rows.chunks_mut(self.stride) {
            row.copy_within(self.done..self.size, right.end);
        }
        let end = right.end + padded(self.put_off());
        solve_upper(&mut self.rows, self.done, self.stride, right.start..end);
        true
    }

    /// Finds the largest number of every column. Returns `false` where there is one that is not finite.
    fn measure(&mut self) -> bool {
        self.largest.clear();
        self.largest.resize(self.size, 0.0);
        for row in self.rows.chunks(self.stride) {
            for (largest, value) in self.largest.iter_mut().zip(row) {
                // NaN stays
                *largest = if value.abs() <= *largest { *largest } else { value.abs() };
            }
        }
        self.largest.iter().all(|largest| largest.is_finite())
    }

    /// Number of columns that were put off.
    pub fn put_off(&self) -> usize {
        self.size - self.done
    }

    /// The row that stands at a place of those that are not eliminated: its right-hand sides, and its own numbers.
    pub fn left(&self, number: usize) -> (&[f64], &[f64]) {
        self.solution(self.done + number)
    }

    /// The column of the matrix to which the solutions of a row belong, and the number of those that were put off.
    pub fn column(&self, row: usize) -> (usize, Option<usize>) {
        (self.order[row], row.checked_sub(self.done))
    }

    /// Eliminates all columns, and puts those off that have no good pivot, unless they get one in the end. Returns `false`
    /// where there is no pivot.
    fn eliminate_all(&mut self) -> bool {
        let mut first = 0;
        loop {
            let last = (first / PANEL * PANEL + PANEL).min(self.done);
            let (mut end, mut weak) = (last, false);
            for column in first..last {
                match self.eliminate(column) {
                    Pivot::Good => {}
                    Pivot::Bad => return false,
                    Pivot::Weak => {
                        (end, weak) = (column, true);
                        break;
                    }
                }
            }
            self.update(first, end);
            first = end;
            if weak {
                self.done -= 1;
                self.exchange_columns(first, self.done);
            }
            if first == self.done && !self.take_back() {
                return true;
            }
        }
    }

    /// Takes a column back that was put off, where it has a good pivot now.
    fn take_back(&mut self) -> bool {
        let next = self.done;
        let good = (next..self.size).find(|&column| self.best(column, next).1 >= SMALLEST * self.largest[column]);
        let Some(column) = good else { return false };
        self.exchange_columns(column, next);
        self.done += 1;
        true
    }

    /// Exchanges two columns of the matrix.
    fn exchange_columns(&mut self, one: usize, other: usize) {
        self.rows.chunks_mut(self.stride).for_each(|row| row.swap(one, other));
        self.order.swap(one, other);
        self.largest.swap(one, other);
    }

    /// The row from `first` on with the largest number in a column, and this number.
    fn best(&self, column: usize, first: usize) -> (usize, f64) {
        let (mut best, mut largest) = (first, 0.0);
        for row in first..self.size {
            let value = self.rows[row * self.stride + column].abs();
            if value > largest {
                (best, largest) = (row, value);
            }
        }
        (best, largest)
    }

    /// Updates what stands to the right of a panel, whose columns are eliminated up to `end`: its rows one after the
    /// other; then all rows below.
    fn update(&mut self, first: usize, end: usize) {
        let (stride, right) = (self.stride, first / PANEL * PANEL + PANEL);
        let columns = right..padded(self.size) + self.right;
        if first == end {
            return;
        }
        for row in first + 1..end {
            let (above, own) = self.rows.split_at_mut(row * stride);
            let product = Combination {
                rows: &mut own[..stride],
                stride,
                factors: Multiples::Inside(first..row),
                columns: columns.clone(),
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
            factors: Multiples::Inside(first..end),
            columns,
            source: &above[first * stride..],
            source_stride: stride,
            source_from: right,
        };
        product.subtract();
    }

    /// Eliminates a column below the diagonal, within the panel in which it stands.
    fn eliminate(&mut self, column: usize) -> Pivot {
        let (stride, first) = (self.stride, column / PANEL * PANEL);
        let (best, largest) = self.best(column, column);
        // written so that NaN fails
        if !(self.largest[column] > 0.0 && largest < f64::INFINITY) {
            return Pivot::Bad;
        }
        if largest < SMALLEST * self.largest[column] && self.size - self.done < self.allowed {
            return Pivot::Weak;
        }
        if largest == 0.0 {
            return Pivot::Bad;
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
        Pivot::Good
    }

    /// Replaces a right-hand side, a number for each column, by the solution with the transpose, a number for each row. `known`
    /// are the solutions at the rows that are not eliminated.
    pub fn solve_transposed(&self, b: &mut [f64], known: &[f64]) {
        let right: Vec<f64> = self.order.iter().map(|&column| b[column]).collect();
        b.copy_from_slice(&right);
        for row in 0..self.done {
            let own = self.row(row);
            b[row] /= own[row];
            let (done, rest) = b.split_at_mut(row + 1);
            add_scaled(&mut rest[..self.done - row - 1], -done[row], &own[row + 1..self.done]);
        }
        b[self.done..].copy_from_slice(&known[..self.size - self.done]);
        for row in (1..self.size).rev() {
            let count = row.min(self.done);
            let (before, done) = b.split_at_mut(row);
            add_scaled(&mut before[..count], -done[0], &self.row(row)[..count]);
        }
        for (row, &other) in self.exchanged.iter().enumerate().rev() {
            b.swap(row, other);
        }
    }
}

/// The pivot of a column.
enum Pivot {
    Good,
    /// It is too small.
    Weak,
    /// There is none, or one that is not finite.
    Bad,
}

/// Number of rows that are solved together.
const TOGETHER: usize = 4;

/// Solves with an upper triangle in the leading columns of rows for further columns.
fn solve_upper(rows: &mut [f64], size: usize, stride: usize, columns: Range<usize>) {
    let mut end = size;
    while end > 0 {
        let start = (end - 1) / TOGETHER * TOGETHER;
        let (above, below) = rows.split_at_mut(end * stride);
        let group = &mut above[start * stride..];
        if end < size {
            let product = Combination {
                rows: group,
                stride,
                factors: Multiples::Inside(end..size),
                columns: columns.clone(),
                source: below,
                source_stride: stride,
                source_from: columns.start,
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
                    factors: Multiples::Inside(row + 1..end),
                    columns: columns.clone(),
                    source: behind,
                    source_stride: stride,
                    source_from: columns.start,
                };
                product.subtract();
            }
            let own = &mut rows[row * stride..][..stride];
            let inverse = own[row].recip();
            own[columns.clone()].iter_mut().for_each(|value| *value *= inverse);
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
            dense.begin(size, 3, 0);
            for row in 0..size {
                let of = |m: &DMatrix<f64>| m.row(row).iter().copied().collect::<Vec<f64>>();
                dense.put(row, &of(&a), [&of(&b), &[]]);
            }
            assert!(dense.factorise() && dense.put_off() == 0);
            for row in 0..size {
                assert!((0..3).all(|j| (dense.solution(row).0[j] - x[(row, j)]).abs() < 1e-9), "{size}");
            }
            let c = a.transpose() * &x;
            let mut single: Vec<f64> = c.column(1).iter().copied().collect();
            dense.solve_transposed(&mut single, &[]);
            assert!((0..size).all(|i| (single[i] - x[(i, 1)]).abs() < 1e-9), "{size}");
        }
    }

    #[test]
    fn columns_without_a_good_pivot_are_put_off() {
        let size = 19;
        let mut a = matrix(size);
        let sum = a.column(3) + a.column(11);
        a.set_column(6, &sum);
        a[(2, 6)] += 1e-7;
        let mut dense = Dense::default();
        dense.begin(size, 1, PUT_OFF);
        for row in 0..size {
            dense.put(row, &a.row(row).iter().copied().collect::<Vec<f64>>(), [&[1.0], &[]]);
        }
        assert!(dense.factorise());
        assert!((1..4).contains(&dense.put_off()), "{}", dense.put_off());
        let x: Vec<f64> = (0..size).map(|i| (1.7 * i as f64).sin()).collect();
        let mut rows: Vec<usize> = (0..size).collect();
        dense.exchanged.iter().enumerate().for_each(|(row, &other)| rows.swap(row, other));
        let known: Vec<f64> = rows[dense.done..].iter().map(|&row| x[row]).collect();
        let mut found: Vec<f64> = (0..size).map(|j| (0..size).map(|i| a[(i, j)] * x[i]).sum()).collect();
        dense.solve_transposed(&mut found, &known);
        assert!(found.iter().zip(&x).all(|(a, b)| (a - b).abs() < 1e-11), "{found:?} {x:?}");
    }

    #[test]
    fn singular_matrices_have_no_factors() {
        for bad in [0.0, f64::NAN, f64::INFINITY] {
            let mut dense = Dense::default();
            dense.begin(5, 1, 0);
            for row in 0..5 {
                dense.put(row, &[bad; 5], [&[1.0], &[]]);
            }
            assert!(!dense.factorise());
        }
    }
}
