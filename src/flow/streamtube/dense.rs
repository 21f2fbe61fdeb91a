//! Dense factors of the size of a station.

use super::rows::{Combination, LIST, Multiples, Substitution, padded};
use crate::flow::linear::add_scaled;
use std::ops::Range;

/// Number of columns that are eliminated at a time.
const PANEL: usize = 8;

/// Smallest pivot over the largest number of its column before elimination; columns with smaller ones are put off.
const SMALLEST: f64 = 3e-3;
/// Largest number of columns that are put off; where more would have to be, weak pivots are taken.
pub(super) const PUT_OFF: usize = 15;

/// A square matrix; once factorised both triangular factors, of which the lower one has a unit diagonal that is not stored.
/// Columns without a good pivot are put off: they stand last, together with as many rows, and are not eliminated.
#[derive(Debug, Clone, Default)]
pub(super) struct Dense {
    size: usize,
    /// Number of columns that are eliminated.
    done: usize,
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
    /// Makes room for a matrix of a size. So many columns may be put off.
    pub fn begin(&mut self, size: usize, allowed: usize) {
        self.size = size;
        self.stride = padded(size);
        self.rows.resize(size * self.stride, 0.0);
        self.exchanged.clear();
        (self.done, self.allowed) = (size, allowed);
        self.order.clear();
        self.order.extend(0..size);
    }

    /// Sets a row, whose last numbers are zeros.
    pub fn put(&mut self, row: usize, own: &[f64]) {
        let values = &mut self.rows[row * self.stride..][..self.stride];
        let (first, last) = values.split_at_mut(own.len());
        first.copy_from_slice(own);
        last.fill(0.0);
    }

    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row * self.stride + column] = value;
    }

    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        self.rows[row * self.stride + column] += value;
    }

    fn row(&self, row: usize) -> &[f64] {
        &self.rows[row * self.stride..][..self.size]
    }

    /// Factorises the matrix. Returns `false` where it is singular or has a pivot that is not finite.
    pub fn factorise(&mut self) -> bool {
        self.measure() && self.eliminate_all()
    }

    /// Puts right-hand sides, a row for each row of the matrix, into the order of the pivots, and solves with the lower
    /// triangle. The last rows are then what is left of the rows that are not eliminated.
    pub fn solve_lower(&self, right: &mut [f64], stride: usize) {
        for (row, &other) in self.exchanged.iter().enumerate().filter(|(row, other)| row != *other) {
            let (before, behind) = right.split_at_mut(other * stride);
            before[row * stride..][..stride].swap_with_slice(&mut behind[..stride]);
        }
        if stride == LIST {
            self.substitution(right, false).carry_out();
        } else {
            for start in (0..self.done).step_by(TOGETHER) {
                let end = (start + TOGETHER).min(self.done);
                self.subtract(right, stride, start..end, 0..start);
                for row in start + 1..end {
                    self.subtract(right, stride, row..row + 1, start..row);
                }
            }
        }
        self.subtract(right, stride, self.done..self.size, 0..self.done);
    }

    /// Puts the columns that were put off into the columns of right-hand sides from `from` on.
    pub fn put_columns(&self, right: &mut [f64], stride: usize, from: usize) {
        for (row, right) in right.chunks_mut(stride).enumerate() {
            right[from..][..self.put_off()].copy_from_slice(self.left(row));
        }
    }

    /// Solves with the upper triangle.
    pub fn solve_upper(&self, right: &mut [f64], stride: usize) {
        if stride == LIST {
            return self.substitution(right, true).carry_out();
        }
        let mut end = self.done;
        while end > 0 {
            let start = (end - 1) / TOGETHER * TOGETHER;
            self.subtract(right, stride, start..end, end..self.done);
            for row in (start..end).rev() {
                self.subtract(right, stride, row..row + 1, row + 1..end);
                let inverse = self.row(row)[row].recip();
                right[row * stride..][..stride].iter_mut().for_each(|value| *value *= inverse);
            }
            end = start;
        }
    }

    /// The solution with one of the triangles for right-hand sides of a list of numbers in every row.
    fn substitution<'a>(&'a self, right: &'a mut [f64], upper: bool) -> Substitution<'a> {
        Substitution { right, matrix: &self.rows, stride: self.stride, count: self.done, upper }
    }

    /// Subtracts from rows of right-hand sides the rows at the places of `columns` times the numbers there. The latter
    /// stand all before or all behind the former.
    fn subtract(&self, right: &mut [f64], stride: usize, rows: Range<usize>, columns: Range<usize>) {
        if rows.is_empty() || columns.is_empty() {
            return;
        }
        let factors =
            Multiples::Apart(&self.rows[rows.start * self.stride + columns.start..], self.stride, columns.len());
        let (own, source) = if columns.start < rows.start {
            let (source, own) = right.split_at_mut(rows.start * stride);
            (&mut own[..rows.len() * stride], &source[columns.start * stride..])
        } else {
            let (own, source) = right.split_at_mut(columns.start * stride);
            (&mut own[rows.start * stride..rows.end * stride], &source[..])
        };
        Combination { rows: own, stride, factors, columns: 0..stride, source, source_stride: stride, source_from: 0 }
            .subtract();
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

    /// Number of columns that are eliminated.
    pub fn done(&self) -> usize {
        self.done
    }

    /// The numbers of a row in the columns that were put off.
    pub fn left(&self, row: usize) -> &[f64] {
        &self.row(row)[self.done..]
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
        let columns = right..stride;
        if first == end || columns.is_empty() {
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    fn matrix(size: usize) -> DMatrix<f64> {
        let number = |i: usize, j: usize| ((3 * i + 7 * j * j + i * j) as f64).sin() + 0.01 * i as f64;
        DMatrix::from_fn(size, size, |i, j| number(i, j) + f64::from(u8::from(i == j)))
    }

    #[test]
    fn solves_with_the_matrix_and_its_transpose() {
        for size in [1, 4, 8, 9, 23] {
            let a = matrix(size);
            let x = DMatrix::from_fn(size, 3, |i, j| 1.0 + i as f64 - 2.5 * j as f64);
            let b = &a * &x;
            let mut dense = Dense::default();
            dense.begin(size, 0);
            let mut right = vec![0.0; 8 * size];
            for row in 0..size {
                dense.put(row, &a.row(row).iter().copied().collect::<Vec<f64>>());
                (0..3).for_each(|j| right[8 * row + j] = b[(row, j)]);
            }
            assert!(dense.factorise() && dense.put_off() == 0);
            dense.solve_lower(&mut right, 8);
            dense.solve_upper(&mut right, 8);
            for row in 0..size {
                assert!((0..3).all(|j| (right[8 * row + j] - x[(row, j)]).abs() < 1e-9), "{size}");
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
        dense.begin(size, PUT_OFF);
        for row in 0..size {
            dense.put(row, &a.row(row).iter().copied().collect::<Vec<f64>>());
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
            dense.begin(5, 0);
            for row in 0..5 {
                dense.put(row, &[bad; 5]);
            }
            assert!(!dense.factorise());
        }
    }
}
