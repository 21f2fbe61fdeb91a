//! Dense factorisation and products in `f64`: a thin layer over `faer`, one thread, column-major `nalgebra` storage.

use faer::linalg::solvers::{PartialPivLu, SolveCore};
use faer::{Accum, Conj, MatMut, MatRef, Par};
use nalgebra::DMatrix;

/// LU factors of a square matrix, with row pivoting.
#[derive(Debug, Clone)]
pub(crate) struct Factors(PartialPivLu<f64>);

impl Factors {
    /// Factorises `matrix`; `None` where it is singular or holds a number that is not finite.
    pub fn new(matrix: &DMatrix<f64>) -> Option<Self> {
        if matrix.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let factors = PartialPivLu::new(view(matrix));
        let diagonal = factors.U().diagonal();
        let regular = (0..matrix.nrows()).all(|i| diagonal[i].is_finite() && diagonal[i] != 0.0);
        regular.then_some(Self(factors))
    }

    /// Replaces the columns of `b` by the solutions of `A x = b`.
    pub fn solve(&self, b: &mut DMatrix<f64>) {
        self.0.solve_in_place_with_conj(Conj::No, view_mut(b));
    }

    /// Replaces the columns of `b` by the solutions of `Aᵀ x = b`.
    pub fn solve_transposed(&self, b: &mut DMatrix<f64>) {
        self.0.solve_transpose_in_place_with_conj(Conj::No, view_mut(b));
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
        let a = DMatrix::from_fn(7, 7, |i, j| ((i * 13 + j * 7) % 11) as f64 - 3.0 * (i == j) as usize as f64);
        let x = DMatrix::from_fn(7, 2, |i, j| 1.0 + i as f64 - 2.0 * j as f64);
        let factors = Factors::new(&a).unwrap();
        let mut b = product(&a, &x);
        factors.solve(&mut b);
        assert!((&b - &x).amax() < 1e-12);
        let mut c = product(&a.transpose(), &x);
        factors.solve_transposed(&mut c);
        assert!((&c - &x).amax() < 1e-12);
    }

    #[test]
    fn singular_matrices_have_no_factors() {
        assert!(Factors::new(&DMatrix::zeros(3, 3)).is_none());
        assert!(Factors::new(&DMatrix::from_element(2, 2, f64::NAN)).is_none());
    }
}
