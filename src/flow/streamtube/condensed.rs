//! Factors of the diagonal block of a station, with the speeds taken out first.
//!
//! The equation of a speed knows of the station's own speeds this one alone, so that its diagonal is a pivot that costs
//! nothing, and the dense factors have the size of the other unknowns. That derivative vanishes at the speed of sound;
//! speeds with such weak pivots stay among the unknowns of the dense factors.

use crate::flow::linear::{Factors, subtract_leading_product, subtract_transposed_product};
use nalgebra::DMatrix;

/// Smallest pivot of a speed that is taken out, over the largest derivative of another equation by that speed.
const WEAK: f64 = 0.1;

/// Factors of a block whose last unknowns are speeds.
#[derive(Debug, Clone)]
pub(super) struct Condensed {
    /// Indices of the unknowns of the dense factors.
    kept: Vec<usize>,
    /// Indices of the speeds that are taken out.
    out: Vec<usize>,
    /// Reciprocals of the pivots of those.
    inverse: Vec<f64>,
    /// Derivatives of the kept equations by the speeds that are taken out: row, number of the speed, value.
    by_out: Vec<(usize, usize, f64)>,
    /// Derivatives of the equations of these speeds by the kept unknowns, over the pivots.
    of_out: DMatrix<f64>,
    /// Factors of what is left for the kept unknowns.
    dense: Factors,
}

/// Rows of a matrix in the order of `rows`.
fn rows(matrix: &DMatrix<f64>, rows: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), matrix.ncols(), |i, j| matrix[(rows[i], j)])
}

fn put_rows(matrix: &mut DMatrix<f64>, rows: &[usize], values: &DMatrix<f64>) {
    for j in 0..matrix.ncols() {
        for (i, &row) in rows.iter().enumerate() {
            matrix[(row, j)] = values[(i, j)];
        }
    }
}

impl Condensed {
    /// Factorises a block whose speeds begin at the index `speeds`. The result is `None` where it is singular or holds a
    /// number that is not finite.
    pub fn of(block: &DMatrix<f64>, speeds: usize) -> Option<Self> {
        let size = block.nrows();
        let strong = |&t: &usize| {
            let others = (0..size).filter(|r| *r != t);
            let largest = others.fold(0.0f64, |most, r| most.max(block[(r, t)].abs()));
            // written so that NaN is weak
            block[(t, t)].abs() >= WEAK * largest && block[(t, t)] != 0.0
        };
        let out: Vec<usize> = (speeds..size).filter(strong).collect();
        let kept: Vec<usize> = (0..size).filter(|k| *k < speeds || !strong(k)).collect();
        let inverse: Vec<f64> = out.iter().map(|&t| 1.0 / block[(t, t)]).collect();
        let mut by_out = Vec::with_capacity(4 * out.len());
        for (number, &t) in out.iter().enumerate() {
            for (i, &row) in kept.iter().enumerate() {
                let value = block[(row, t)];
                if value != 0.0 {
                    by_out.push((i, number, value));
                }
            }
        }
        let of_out = DMatrix::from_fn(out.len(), kept.len(), |i, j| block[(out[i], kept[j])] * inverse[i]);
        let mut rest = DMatrix::from_fn(kept.len(), kept.len(), |i, j| block[(kept[i], kept[j])]);
        subtract_sparse(&mut rest, &by_out, &of_out);
        Some(Self { dense: Factors::of(rest)?, kept, out, inverse, by_out, of_out })
    }

    /// Replaces the columns of `b` by the solutions of `A x = b`.
    pub fn solve(&self, b: &mut DMatrix<f64>) {
        let (mut kept, mut out) = (rows(b, &self.kept), rows(b, &self.out));
        self.scale(&mut out);
        subtract_sparse(&mut kept, &self.by_out, &out);
        self.dense.solve(&mut kept);
        subtract_leading_product(&mut out, 0, &self.of_out, self.kept.len(), &kept);
        put_rows(b, &self.kept, &kept);
        put_rows(b, &self.out, &out);
    }

    /// Replaces the columns of `b` by the solutions of `Aᵀ x = b`.
    pub fn solve_transposed(&self, b: &mut DMatrix<f64>) {
        let (mut kept, mut out) = (rows(b, &self.kept), rows(b, &self.out));
        subtract_transposed_product(&mut kept, &self.of_out, &out, 0);
        self.dense.solve_transposed(&mut kept);
        for j in 0..out.ncols() {
            for &(row, number, value) in &self.by_out {
                out[(number, j)] -= value * kept[(row, j)];
            }
        }
        self.scale(&mut out);
        put_rows(b, &self.kept, &kept);
        put_rows(b, &self.out, &out);
    }

    /// Divides the rows of the speeds by their pivots.
    fn scale(&self, out: &mut DMatrix<f64>) {
        for j in 0..out.ncols() {
            for (i, inverse) in self.inverse.iter().enumerate() {
                out[(i, j)] *= inverse;
            }
        }
    }
}

/// Subtracts the product of a matrix with few entries (row, column, value) and `b` from `target`.
fn subtract_sparse(target: &mut DMatrix<f64>, entries: &[(usize, usize, f64)], b: &DMatrix<f64>) {
    let (height, depth) = (target.nrows(), b.nrows());
    if height == 0 || depth == 0 {
        return;
    }
    let columns = target.as_mut_slice().chunks_exact_mut(height).zip(b.as_slice().chunks_exact(depth));
    for (target, b) in columns {
        for &(row, column, value) in entries {
            target[row] -= value * b[column];
        }
    }
}

/// Subtracts the product of `a` and `b` from `target` from its row `row` on, where `a` has few entries from its column
/// `dense` on.
pub(super) fn subtract_product_with_speeds(
    target: &mut DMatrix<f64>,
    row: usize,
    a: &DMatrix<f64>,
    dense: usize,
    b: &DMatrix<f64>,
) {
    subtract_leading_product(target, row, a, dense, b);
    let mut entries = Vec::with_capacity(4 * (a.ncols() - dense));
    for column in dense..a.ncols() {
        for (i, &value) in a.column(column).iter().enumerate() {
            if value != 0.0 {
                entries.push((row + i, column, value));
            }
        }
    }
    subtract_sparse(target, &entries, b);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of four other unknowns and three speeds, one of them at the speed of sound.
    fn block() -> DMatrix<f64> {
        DMatrix::from_fn(7, 7, |i, j| match (i, j) {
            (4.., 4..) if i != j => 0.0,
            (5, 5) => 1e-9,
            (4 | 6, _) if i == j => -0.8 + 0.1 * i as f64,
            _ => ((3 * i + 7 * j * j + i * j) as f64).sin(),
        })
    }

    #[test]
    fn solves_and_solves_transposed() {
        let a = block();
        let factors = Condensed::of(&a, 4).unwrap();
        assert_eq!((factors.kept.clone(), factors.out.clone()), (vec![0, 1, 2, 3, 5], vec![4, 6]));
        let x = DMatrix::from_fn(7, 2, |i, j| 1.0 + i as f64 - 2.5 * j as f64);
        let mut b = &a * &x;
        factors.solve(&mut b);
        assert!((&b - &x).amax() < 1e-12, "{b}");
        let mut c = a.transpose() * &x;
        factors.solve_transposed(&mut c);
        assert!((&c - &x).amax() < 1e-12, "{c}");
        assert!(Condensed::of(&DMatrix::zeros(5, 5), 3).is_none());
        assert!(Condensed::of(&DMatrix::from_element(5, 5, f64::NAN), 3).is_none());
    }

    #[test]
    fn products_with_few_entries_are_products() {
        let (a, b) = (block(), DMatrix::from_fn(7, 3, |i, j| (i as f64 - 2.0 * j as f64).cos()));
        let mut found = DMatrix::from_element(9, 3, 1.0);
        subtract_product_with_speeds(&mut found, 1, &a, 4, &b);
        let expected = DMatrix::from_element(7, 3, 1.0) - &a * &b;
        assert!((found.rows(1, 7) - expected).amax() < 1e-14);
        assert!(found.row(0).iter().chain(found.row(8).iter()).all(|v| *v == 1.0));
    }
}
