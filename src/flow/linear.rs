//! Dense factorisation and products in `f64`: a thin layer over `faer` that runs on one thread and works on the
//! column-major storage of `nalgebra`.

use super::memory::give_back;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Accum, Conj, MatMut, MatRef, Par};
use nalgebra::DMatrix;
use std::ops::{Add, Mul, Sub};

/// LU factors of a square matrix A with row pivoting.
#[derive(Debug, Clone)]
pub(crate) struct Factors {
    /// Both triangular factors in one matrix; the lower one has a unit diagonal that is not stored.
    matrix: DMatrix<f64>,
    permutation: Vec<usize>,
    inverse_permutation: Vec<usize>,
}

impl Factors {
    /// Factorises a copy of `matrix`. The result is `None` where the matrix is singular or holds a number that is not
    /// finite.
    pub fn new(matrix: &DMatrix<f64>) -> Option<Self> {
        Self::of(matrix.clone())
    }

    /// Factorises `matrix` in its own memory. The result is `None` where the matrix is singular or holds a number that
    /// is not finite.
    pub fn of(mut matrix: DMatrix<f64>) -> Option<Self> {
        let n = matrix.nrows();
        let (mut permutation, mut inverse_permutation) = (vec![0; n], vec![0; n]);
        let mut memory = MemBuffer::new(factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default()));
        factor::lu_in_place(
            view_mut(&mut matrix),
            &mut permutation,
            &mut inverse_permutation,
            Par::Seq,
            MemStack::new(&mut memory),
            Default::default(),
        );
        let regular = all_finite(matrix.as_slice()) && (0..n).all(|i| matrix[(i, i)] != 0.0);
        regular.then_some(Self { matrix, permutation, inverse_permutation })
    }

    fn rows(&self) -> PermRef<'_, usize> {
        PermRef::new_checked(&self.permutation, &self.inverse_permutation, self.permutation.len())
    }

    /// Replaces the columns of `b` by the solutions of `A x = b`.
    pub fn solve(&self, b: &mut DMatrix<f64>) {
        let (n, m) = b.shape();
        let mut memory = MemBuffer::new(solve::solve_in_place_scratch::<usize, f64>(n, m, Par::Seq));
        let lu = view(&self.matrix);
        let stack = MemStack::new(&mut memory);
        solve::solve_in_place_with_conj(lu, lu, self.rows(), Conj::No, view_mut(b), Par::Seq, stack);
    }

    /// Replaces the columns of `b` by the solutions of `Aᵀ x = b`.
    pub fn solve_transposed(&self, b: &mut DMatrix<f64>) {
        let (n, m) = b.shape();
        let mut memory = MemBuffer::new(solve::solve_transpose_in_place_scratch::<usize, f64>(n, m, Par::Seq));
        let lu = view(&self.matrix);
        let stack = MemStack::new(&mut memory);
        solve::solve_transpose_in_place_with_conj(lu, lu, self.rows(), Conj::No, view_mut(b), Par::Seq, stack);
    }

    /// The solution x of `Aᵀ x = b`. For a single right-hand side plain scalar products along the columns of the
    /// factors are quicker than the blocked algorithm.
    pub fn solve_transposed_vector(&self, mut b: Vec<f64>) -> Vec<f64> {
        let n = b.len();
        let columns = self.matrix.as_slice();
        for i in 0..n {
            let column = &columns[i * n..(i + 1) * n];
            b[i] = (b[i] - dot(&column[..i], &b[..i])) / column[i];
        }
        for i in (0..n).rev() {
            let column = &columns[i * n..(i + 1) * n];
            b[i] -= dot(&column[i + 1..], &b[i + 1..]);
        }
        self.inverse_permutation.iter().map(|&i| b[i]).collect()
    }
}

impl Drop for Factors {
    fn drop(&mut self) {
        give_back(&mut self.matrix);
    }
}

/// A number, or a vector of several numbers, to which linear formulas can be applied.
pub(crate) trait Linear: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {}
impl<V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f64, Output = V>> Linear for V {}

/// Number of partial sums accumulated side by side; a single sum would wait for every addition.
const LANES: usize = 8;

/// Whether all values are finite. The test uses that `0 · v` is 0 for finite values alone.
fn all_finite(values: &[f64]) -> bool {
    let mut sums = [0.0; LANES];
    let chunks = values.chunks_exact(LANES);
    let rest = chunks.remainder().iter().all(|v| v.is_finite());
    for chunk in chunks {
        for k in 0..LANES {
            sums[k] += 0.0 * chunk[k];
        }
    }
    rest && sums.iter().all(|s| *s == 0.0)
}

/// Scalar product of two lists of equal length, accumulated in several partial sums.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (x, y) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = x.remainder().iter().zip(y.remainder()).map(|(a, b)| a * b).sum();
    for (x, y) in x.zip(y) {
        for k in 0..LANES {
            sums[k] += x[k] * y[k];
        }
    }
    rest + sums.iter().sum::<f64>()
}

/// Sum of a list, accumulated in several partial sums.
pub(crate) fn sum(values: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let chunks = values.chunks_exact(LANES);
    let rest: f64 = chunks.remainder().iter().sum();
    for chunk in chunks {
        for k in 0..LANES {
            sums[k] += chunk[k];
        }
    }
    rest + sums.iter().sum::<f64>()
}

/// Adds `factor` times `values` to `sums`.
pub(crate) fn add_scaled(sums: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// The product of two matrices.
pub(crate) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut result = DMatrix::zeros(a.nrows(), b.ncols());
    faer::linalg::matmul::matmul(view_mut(&mut result), Accum::Replace, view(a), view(b), 1.0, Par::Seq);
    result
}

fn view(m: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(m.as_slice(), m.nrows(), m.ncols())
}

fn view_mut(m: &mut DMatrix<f64>) -> MatMut<'_, f64> {
    let (rows, columns) = m.shape();
    MatMut::from_column_major_slice_mut(m.as_mut_slice(), rows, columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_and_multiplies() {
        let a = DMatrix::from_fn(29, 29, |i, j| {
            ((i * 37 + j * j * 11 + i * j) as f64).sin() + f64::from(u8::from(i + 3 == j))
        });
        let x = DMatrix::from_fn(29, 2, |i, j| 1.0 + i as f64 - 2.0 * j as f64);
        let factors = Factors::new(&a).unwrap();
        let mut b = product(&a, &x);
        factors.solve(&mut b);
        assert!((&b - &x).amax() < 1e-12);
        let mut c = product(&a.transpose(), &x);
        let single = factors.solve_transposed_vector(c.column(1).iter().copied().collect());
        factors.solve_transposed(&mut c);
        assert!((&c - &x).amax() < 1e-12);
        assert!(single.iter().zip(x.column(1).iter()).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn the_transposed_inverse_is_the_transpose_of_the_inverse() {
        let a = DMatrix::from_fn(17, 17, |i, j| (1.3 * i as f64 + 0.7 * (j * j) as f64 + (i * j) as f64).cos());
        let factors = Factors::new(&a).unwrap();
        let (b, c) = (DMatrix::from_fn(17, 1, |i, _| (2.1 * i as f64).sin()), DMatrix::from_element(17, 1, 0.6));
        let (mut solved, mut transposed) = (b.clone(), c.clone());
        factors.solve(&mut solved);
        factors.solve_transposed(&mut transposed);
        let single = factors.solve_transposed_vector(c.as_slice().to_vec());
        let expected = solved.dot(&c);
        let scale = solved.amax() * 17.0;
        assert!((b.dot(&transposed) - expected).abs() < 1e-12 * scale, "{expected}");
        assert!((dot(b.as_slice(), &single) - expected).abs() < 1e-12 * scale, "{expected}");
    }

    #[test]
    fn numbers_that_are_not_finite_are_found_anywhere() {
        let mut values = vec![1.0; 21];
        assert!(all_finite(&values));
        for i in 0..values.len() {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let good = std::mem::replace(&mut values[i], bad);
                assert!(!all_finite(&values));
                values[i] = good;
            }
        }
    }

    #[test]
    fn singular_matrices_have_no_factors() {
        assert!(Factors::new(&DMatrix::zeros(3, 3)).is_none());
        assert!(Factors::new(&DMatrix::from_element(2, 2, f64::NAN)).is_none());
    }
}
