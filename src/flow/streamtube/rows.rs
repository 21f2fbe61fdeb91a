//! Inner loops of the block elimination, on matrices whose rows lie one after the other.
//!
//! The blocks of a station have 50 to 110 rows. Libraries for dense matrices copy such blocks into a form of their own before
//! they multiply, which costs as much as the product; here a few rows at a time stay in the registers of the processor.

use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Lengths of rows are multiples of this, the widest vector of any processor.
const PAD: usize = 8;

/// A length of rows that holds `count` numbers.
pub(super) const fn padded(count: usize) -> usize {
    count.next_multiple_of(PAD)
}

/// The factors of a combination of rows, one for each row of the source.
pub(super) enum Multiples<'a> {
    /// Columns of the rows from which is subtracted.
    Inside(Range<usize>),
    /// Rows of another matrix: numbers, length of a row, and number of factors in it.
    Apart(&'a [f64], usize, usize),
}

impl Multiples<'_> {
    fn count(&self) -> usize {
        match self {
            Self::Inside(columns) => columns.len(),
            Self::Apart(_, _, count) => *count,
        }
    }
}

/// Subtracts combinations of the rows of `source` from rows.
pub(super) struct Combination<'a> {
    pub rows: &'a mut [f64],
    pub stride: usize,
    pub factors: Multiples<'a>,
    /// Columns from which is subtracted. Their number is a multiple of the widest vector.
    pub columns: Range<usize>,
    pub source: &'a [f64],
    pub source_stride: usize,
    /// First column of `source`.
    pub source_from: usize,
}

impl Combination<'_> {
    pub fn subtract(self) {
        Arch::new().dispatch(self);
    }

    /// Goes over `N` rows from `row` on and `V` vectors from the vector `place` of the columns on.
    #[inline(always)]
    fn tile<S: Simd, const N: usize, const V: usize>(&mut self, simd: S, row: usize, place: usize) {
        let width = V * S::F64_LANES;
        let offset = place * S::F64_LANES;
        let (from, stride, count) = (self.columns.start + offset, self.source_stride, self.factors.count());
        let source = &self.source[self.source_from + offset..];
        let factors: [&[f64]; N] = match &self.factors {
            Multiples::Inside(columns) => {
                std::array::from_fn(|r| &self.rows[(row + r) * self.stride + columns.start..][..count])
            }
            Multiples::Apart(values, stride, _) => std::array::from_fn(|r| &values[(row + r) * stride..][..count]),
        };
        let mut sums = [[simd.splat_f64s(0.0); V]; N];
        for k in 0..count {
            let vectors = S::as_simd_f64s(&source[k * stride..][..width]).0;
            let vectors: [S::f64s; V] = std::array::from_fn(|v| vectors[v]);
            for r in 0..N {
                let factor = simd.splat_f64s(factors[r][k]);
                for v in 0..V {
                    sums[r][v] = simd.mul_add_e_f64s(factor, vectors[v], sums[r][v]);
                }
            }
        }
        for r in 0..N {
            let own = &mut self.rows[(row + r) * self.stride + from..][..width];
            for (own, sum) in S::as_mut_simd_f64s(own).0.iter_mut().zip(sums[r]) {
                *own = simd.sub_f64s(*own, sum);
            }
        }
    }

    /// Goes over `N` rows from `row` on.
    #[inline(always)]
    fn band<S: Simd, const N: usize>(&mut self, simd: S, row: usize) {
        let count = self.columns.len() / S::F64_LANES;
        let mut place = 0;
        // processors with the widest vectors have twice as many of them
        while S::F64_LANES == PAD && place + 4 <= count {
            self.tile::<S, N, 4>(simd, row, place);
            place += 4;
        }
        while place + 2 <= count {
            self.tile::<S, N, 2>(simd, row, place);
            place += 2;
        }
        if place < count {
            self.tile::<S, N, 1>(simd, row, place);
        }
    }
}

impl WithSimd for Combination<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let count = self.rows.len() / self.stride;
        let mut row = 0;
        // sums wait for each other where there is but one vector in a row
        while self.columns.len() == S::F64_LANES && row + 8 <= count {
            self.band::<S, 8>(simd, row);
            row += 8;
        }
        while row + 4 <= count {
            self.band::<S, 4>(simd, row);
            row += 4;
        }
        if row + 2 <= count {
            self.band::<S, 2>(simd, row);
            row += 2;
        }
        while row < count {
            self.band::<S, 1>(simd, row);
            row += 1;
        }
    }
}

/// Length of a list of right-hand sides that is solved with for itself.
pub(super) const LIST: usize = PAD;

/// Solves with a triangle of a matrix for lists of [`LIST`] right-hand sides, one list for each row. The diagonal of the
/// lower triangle is one.
pub(super) struct Substitution<'a> {
    pub right: &'a mut [f64],
    pub matrix: &'a [f64],
    /// Length of a row of the matrix.
    pub stride: usize,
    /// Number of rows of the triangle.
    pub count: usize,
    pub upper: bool,
}

impl Substitution<'_> {
    pub fn carry_out(self) {
        Arch::new().dispatch(self);
    }

    /// Goes over `N` rows from `first` on, whose lists are `V` vectors long. The other rows that they know of are done.
    #[inline(always)]
    fn rows<S: Simd, const N: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let list = |right: &[f64], row: usize| -> [S::f64s; V] {
            let vectors = S::as_simd_f64s(&right[row * LIST..][..LIST]).0;
            std::array::from_fn(|v| vectors[v])
        };
        let done = if self.upper { first + N..self.count } else { 0..first };
        let row = |r: usize| &self.matrix[(first + r) * self.stride..];
        let factors: [&[f64]; N] = std::array::from_fn(|r| &row(r)[done.start..][..done.len()]);
        let own: [[f64; N]; N] = std::array::from_fn(|r| std::array::from_fn(|k| row(r)[first + k]));
        let known = &self.right[done.start * LIST..][..done.len() * LIST];
        let mut sums = [[simd.splat_f64s(0.0); V]; N];
        for k in 0..done.len() {
            let known = list(known, k);
            for r in 0..N {
                let factor = simd.splat_f64s(factors[r][k]);
                for v in 0..V {
                    sums[r][v] = simd.mul_add_e_f64s(factor, known[v], sums[r][v]);
                }
            }
        }
        for r in 0..N {
            let before = list(self.right, first + r);
            for v in 0..V {
                sums[r][v] = simd.sub_f64s(before[v], sums[r][v]);
            }
        }
        for place in 0..N {
            let k = if self.upper { N - 1 - place } else { place };
            if self.upper {
                let inverse = simd.splat_f64s(own[k][k].recip());
                sums[k] = sums[k].map(|value| simd.mul_f64s(inverse, value));
            }
            let known = sums[k];
            for r in if self.upper { 0..k } else { k + 1..N } {
                let factor = simd.splat_f64s(-own[r][k]);
                for v in 0..V {
                    sums[r][v] = simd.mul_add_e_f64s(factor, known[v], sums[r][v]);
                }
            }
        }
        for r in 0..N {
            let after = &mut self.right[(first + r) * LIST..][..LIST];
            S::as_mut_simd_f64s(after).0.copy_from_slice(&sums[r]);
        }
    }

    #[inline(always)]
    fn all<S: Simd, const N: usize, const V: usize>(&mut self, simd: S) {
        // rows that are alone wait for each other; they stand where they know of few others
        let alone = self.count % N;
        if self.upper {
            let whole = self.count - alone;
            for row in (whole..self.count).rev() {
                self.rows::<S, 1, V>(simd, row);
            }
            for first in (0..whole).step_by(N).rev() {
                self.rows::<S, N, V>(simd, first);
            }
        } else {
            for row in 0..alone {
                self.rows::<S, 1, V>(simd, row);
            }
            for first in (alone..self.count).step_by(N) {
                self.rows::<S, N, V>(simd, first);
            }
        }
    }
}

impl WithSimd for Substitution<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        // as many sums as the registers hold
        match LIST / S::F64_LANES {
            1 => self.all::<S, 8, 1>(simd),
            2 => self.all::<S, 4, 2>(simd),
            4 => self.all::<S, 2, 4>(simd),
            _ => self.all::<S, 1, LIST>(simd),
        }
    }
}

/// Scalar products of all columns of one matrix with all columns of another. Both have [`LIST`] columns.
pub(super) struct Products<'a>(pub &'a [f64], pub &'a [f64]);

impl Products<'_> {
    pub fn sums(self) -> [[f64; LIST]; LIST] {
        Arch::new().dispatch(self)
    }

    #[inline(always)]
    fn with_vectors<S: Simd, const V: usize>(self, simd: S) -> [[f64; LIST]; LIST] {
        let mut sums = [[simd.splat_f64s(0.0); V]; LIST];
        for (one, other) in self.0.chunks_exact(LIST).zip(self.1.chunks_exact(LIST)) {
            let vectors = S::as_simd_f64s(other).0;
            for (sums, value) in sums.iter_mut().zip(one) {
                let factor = simd.splat_f64s(*value);
                for v in 0..V {
                    sums[v] = simd.mul_add_e_f64s(factor, vectors[v], sums[v]);
                }
            }
        }
        let mut table = [[0.0; LIST]; LIST];
        for (row, sums) in table.iter_mut().zip(&sums) {
            S::as_mut_simd_f64s(row).0.copy_from_slice(sums);
        }
        table
    }
}

impl WithSimd for Products<'_> {
    type Output = [[f64; LIST]; LIST];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        match LIST / S::F64_LANES {
            1 => self.with_vectors::<S, 1>(simd),
            2 => self.with_vectors::<S, 2>(simd),
            4 => self.with_vectors::<S, 4>(simd),
            _ => self.with_vectors::<S, LIST>(simd),
        }
    }
}

/// A number of a matrix with few of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub row: u32,
    pub column: u32,
    pub value: f64,
}

impl Entry {
    pub fn new(row: usize, column: usize, value: f64) -> Self {
        Self { row: row as u32, column: column as u32, value }
    }
}

/// A matrix with few numbers, row by row.
#[derive(Debug, Clone, Default)]
pub(super) struct Sparse {
    /// Where each row begins among the numbers.
    starts: Vec<u32>,
    /// Columns and numbers. A column may occur several times in a row.
    numbers: Vec<(u32, f64)>,
}

impl Sparse {
    pub fn new(rows: usize, entries: &[Entry]) -> Self {
        let mut starts = vec![0u32; rows + 1];
        for entry in entries {
            starts[entry.row as usize + 1] += 1;
        }
        for row in 0..rows {
            starts[row + 1] += starts[row];
        }
        let mut ends = starts.clone();
        let mut numbers = vec![(0, 0.0); entries.len()];
        for entry in entries {
            let end = &mut ends[entry.row as usize];
            numbers[*end as usize] = (entry.column, entry.value);
            *end += 1;
        }
        Self { starts, numbers }
    }

    /// The numbers of a row, with their columns.
    pub fn row(&self, row: usize) -> &[(u32, f64)] {
        &self.numbers[self.starts[row] as usize..self.starts[row + 1] as usize]
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.starts.len() - 1
    }
}

/// Subtracts the product of a matrix with few numbers and the rows of `source` from rows.
pub(super) struct FewCombined<'a> {
    pub rows: &'a mut [f64],
    pub stride: usize,
    /// Columns from which is subtracted. Their number is a multiple of the widest vector.
    pub columns: Range<usize>,
    pub factors: &'a Sparse,
    pub source: &'a [f64],
    pub source_stride: usize,
    /// First column of `source`.
    pub source_from: usize,
}

impl FewCombined<'_> {
    pub fn subtract(self) {
        Arch::new().dispatch(self);
    }

    #[inline(always)]
    fn tile<S: Simd, const V: usize>(&mut self, simd: S, row: usize, place: usize) {
        let (width, offset) = (V * S::F64_LANES, place * S::F64_LANES);
        let source_from = self.source_from + offset;
        let own = &mut self.rows[row * self.stride + self.columns.start + offset..][..width];
        let own = S::as_mut_simd_f64s(own).0;
        let mut sums: [S::f64s; V] = std::array::from_fn(|v| own[v]);
        for &(column, value) in self.factors.row(row) {
            let source = &self.source[column as usize * self.source_stride + source_from..][..width];
            let vectors = S::as_simd_f64s(source).0;
            let factor = simd.splat_f64s(-value);
            for v in 0..V {
                sums[v] = simd.mul_add_e_f64s(factor, vectors[v], sums[v]);
            }
        }
        own.copy_from_slice(&sums);
    }
}

impl WithSimd for FewCombined<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let count = self.columns.len() / S::F64_LANES;
        for row in 0..self.factors.count() {
            if self.factors.row(row).is_empty() {
                continue;
            }
            let mut place = 0;
            while place + 4 <= count {
                self.tile::<S, 4>(simd, row, place);
                place += 4;
            }
            while place < count {
                self.tile::<S, 1>(simd, row, place);
                place += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(seed: usize) -> f64 {
        (seed as f64 * 1.7 + (seed * seed % 13) as f64).sin()
    }

    #[test]
    fn combinations_are_products() {
        for (count, width) in [(1, 24), (3, 24), (4, 24), (9, 24), (17, 8)] {
            let (stride, depth) = (56, 5);
            let mut rows: Vec<f64> = (0..count * stride).map(number).collect();
            let before = rows.clone();
            let source: Vec<f64> = (0..depth * 32).map(|k| number(7 * k + 1)).collect();
            let product = Combination {
                rows: &mut rows,
                stride,
                factors: Multiples::Inside(2..2 + depth),
                columns: 16..16 + width,
                source: &source,
                source_stride: 32,
                source_from: 8,
            };
            product.subtract();
            for r in 0..count {
                for c in 0..stride {
                    let mut expected = before[r * stride + c];
                    if (16..16 + width).contains(&c) {
                        expected -=
                            (0..depth).map(|k| before[r * stride + 2 + k] * source[32 * k + 8 + c - 16]).sum::<f64>();
                    }
                    assert!((rows[r * stride + c] - expected).abs() < 1e-14, "{count} {r} {c}");
                }
            }
        }
    }

    #[test]
    fn few_numbers_are_combined_row_by_row() {
        let entries = [(2, 1, 0.5), (0, 3, -2.0), (2, 0, 1.5), (2, 1, 0.25)].map(|(r, c, v)| Entry::new(r, c, v));
        let factors = Sparse::new(4, &entries);
        let (stride, width) = (48, 40);
        let mut rows: Vec<f64> = (0..4 * stride).map(number).collect();
        let before = rows.clone();
        let source: Vec<f64> = (0..4 * 40).map(|k| number(5 * k + 2)).collect();
        let columns = 8..8 + width;
        let product = FewCombined {
            rows: &mut rows,
            stride,
            columns,
            factors: &factors,
            source: &source,
            source_stride: 40,
            source_from: 0,
        };
        product.subtract();
        for r in 0..4 {
            for c in 0..stride {
                let mut expected = before[r * stride + c];
                if c >= 8 {
                    let at = |row: usize| source[40 * row + c - 8];
                    expected -= match r {
                        0 => -2.0 * at(3),
                        2 => 0.75 * at(1) + 1.5 * at(0),
                        _ => 0.0,
                    };
                }
                assert!((rows[r * stride + c] - expected).abs() < 1e-14, "{r} {c}");
            }
        }
    }
}
