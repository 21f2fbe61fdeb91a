//! Implicit function theorem: solve in `f64`, then lift the root to any scalar.

use crate::scalar::Scalar;
use nalgebra::{DMatrix, DVector, Dyn, LU};

/// Why a system of equations was not solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Newton's method used up its iterations.
    #[error("Newton did not converge in {iterations} iterations: residual {residual:.3e}, wanted {tolerance:.1e}")]
    NotConverged {
        /// Iterations done.
        iterations: usize,
        /// Euclidean norm of the last residual.
        residual: f64,
        /// Norm asked for.
        tolerance: f64,
    },
    /// The Jacobian has no inverse.
    #[error("singular Jacobian at iteration {iteration}")]
    Singular {
        /// Iteration at which it was met.
        iteration: usize,
    },
}

/// A system `R(u, p) = 0` of as many equations as unknowns `u`, with parameters `p`.
pub trait Implicit {
    /// The residuals at `u` and `p`, as many as unknowns.
    fn residual<S: Scalar>(&self, u: &[S], p: &[S]) -> Vec<S>;
}

/// A solution in `f64`, with the factorised Jacobian *at the solution*.
#[derive(Debug, Clone)]
pub struct Root {
    /// The unknowns.
    pub u: DVector<f64>,
    factors: LU<f64, Dyn, Dyn>,
}

/// The exact Jacobian dR/du, by chunked forward mode.
fn jacobian_of<I: Implicit>(system: &I, u: &[f64], p: &[f64]) -> (Vec<f64>, DMatrix<f64>) {
    struct InUnknowns<'a, I>(&'a I, &'a [f64]);
    impl<I: Implicit> super::VectorFunction for InUnknowns<'_, I> {
        type Error = std::convert::Infallible;
        fn evaluate<S: Scalar>(&self, u: &[S]) -> Result<Vec<S>, Self::Error> {
            let p: Vec<S> = self.1.iter().map(|&v| S::from(v)).collect();
            Ok(self.0.residual(u, &p))
        }
    }
    match super::jacobian(&InUnknowns(system, p), u) {
        Ok(pair) => pair,
        Err(never) => match never {},
    }
}

impl Root {
    /// Newton's method from `start`, Jacobian by forward mode, until the residual norm is at most `tolerance`.
    ///
    /// # Errors
    /// [`SolveError`] where it does not get there.
    pub fn newton<I: Implicit>(
        system: &I,
        start: &[f64],
        p: &[f64],
        tolerance: f64,
        iterations: usize,
    ) -> Result<Self, SolveError> {
        let mut u = DVector::from_column_slice(start);
        let mut residual = f64::INFINITY;
        for iteration in 0..=iterations {
            let (r, jacobian) = jacobian_of(system, u.as_slice(), p);
            let r = DVector::from_vec(r);
            residual = r.norm();
            let factors = jacobian.lu();
            if residual <= tolerance {
                return if factors.is_invertible() {
                    Ok(Self { u, factors })
                } else {
                    Err(SolveError::Singular { iteration })
                };
            }
            if iteration < iterations {
                u -= factors.solve(&r).ok_or(SolveError::Singular { iteration })?;
            }
        }
        Err(SolveError::NotConverged { iterations, residual, tolerance })
    }

    /// The root as a function of `p` for any scalar whose real parts are those the root was solved at.
    ///
    /// `u ← u − (dR/du)⁻¹ R(u, p)`, once per order of derivative: the frozen `f64` Jacobian gains one order a pass.
    pub fn lift<S: Scalar, I: Implicit>(&self, system: &I, p: &[S]) -> Vec<S> {
        let mut u: Vec<S> = self.u.iter().map(|&v| S::from(v)).collect();
        for _ in 0..S::NDERIV {
            let mut step = system.residual(&u, p);
            self.solve_in_place(&mut step);
            for (u, step) in u.iter_mut().zip(step) {
                *u -= step;
            }
        }
        u
    }

    /// The adjoint `λ = (dR/du)⁻ᵀ dJ/du` of an output `J(u, p)`.
    ///
    /// Then `dJ/dp` is `∂J/∂p − ∂(λ·R(u, p))/∂p`: one scalar function of `p`, whatever the number of unknowns.
    pub fn adjoint(&self, output_by_unknown: &DVector<f64>) -> DVector<f64> {
        let mut y = output_by_unknown.clone();
        let (factors, n) = (self.factors.lu_internal(), y.len());
        for i in 0..n {
            for j in 0..i {
                y[i] -= factors[(j, i)] * y[j];
            }
            y[i] /= factors[(i, i)];
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                y[i] -= factors[(j, i)] * y[j];
            }
        }
        self.factors.p().inv_permute_rows(&mut y);
        y
    }

    /// Solves with the `f64` factors and a right-hand side of any scalar.
    fn solve_in_place<S: Scalar>(&self, b: &mut Vec<S>) {
        let mut permuted = DVector::from_vec(std::mem::take(b));
        self.factors.p().permute_rows(&mut permuted);
        let (factors, n) = (self.factors.lu_internal(), permuted.len());
        for j in 0..n {
            for i in j + 1..n {
                let known = permuted[j];
                permuted[i] -= known * factors[(i, j)];
            }
        }
        for j in (0..n).rev() {
            permuted[j] /= factors[(j, j)];
            for i in 0..j {
                let known = permuted[j];
                permuted[i] -= known * factors[(i, j)];
            }
        }
        *b = permuted.as_slice().to_vec();
    }
}

/// Lifts a root `u` of one scalar equation `residual(u) = 0`, already found in `f64`, to the scalar `S`.
///
/// `residual` closes over parameters that carry derivatives; `slope` is `∂residual/∂u` at the root.
pub fn lift_root<S: Scalar>(root: f64, slope: f64, residual: impl Fn(S) -> S) -> S {
    let mut u = S::from(root);
    for _ in 0..S::NDERIV {
        // the real part of the residual is round-off of the f64 solution; it must not move the root
        let r = residual(u);
        u -= (r - r.re()) / slope;
    }
    u
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use num_dual::{Dual2SVec64, Dual64, DualSVec64, first_derivative};

    /// A nonlinear tridiagonal system.
    struct Rods(usize);
    impl Implicit for Rods {
        fn residual<S: Scalar>(&self, u: &[S], p: &[S]) -> Vec<S> {
            let at = |i: usize| u.get(i).copied().unwrap_or(S::from(0.0));
            (0..self.0)
                .map(|i| {
                    at(i) * 2.2 - at(i.wrapping_sub(1)) - at(i + 1) + at(i).powi(3) * p[0]
                        - p[1] * (0.1 * i as f64).sin()
                })
                .collect()
        }
    }
    fn root(p: [f64; 2]) -> Root {
        Root::newton(&Rods(40), &[0.0; 40], &p, 1e-13, 50).unwrap()
    }

    #[test]
    fn lift_gives_first_and_second_derivatives() {
        let (p, i) = ([0.3, 1.1], 20);
        let r = root(p);
        let first =
            r.lift(&Rods(40), &[DualSVec64::<2>::from(p[0]).derivative(0), DualSVec64::from(p[1]).derivative(1)]);
        let second =
            r.lift(&Rods(40), &[Dual2SVec64::<2>::from(p[0]).derivative(0), Dual2SVec64::from(p[1]).derivative(1)]);
        for k in 0..2 {
            let at = |s: f64| {
                let mut q = p;
                q[k] += s;
                root(q).u[i]
            };
            assert_relative_eq!(first[i].eps.0.unwrap()[k], (at(1e-5) - at(-1e-5)) / 2e-5, max_relative = 1e-8);
            let curvature = (at(1e-3) - 2.0 * at(0.0) + at(-1e-3)) / 1e-6;
            assert_relative_eq!(second[i].v2.0.unwrap()[(k, k)], curvature, max_relative = 1e-5, epsilon = 1e-8);
        }
    }

    #[test]
    fn adjoint_equals_lift() {
        let p = [0.3, 1.1];
        let r = root(p);
        let lambda = r.adjoint(&r.u.map(|v| 2.0 * v));
        let duals = [DualSVec64::<2>::from(p[0]).derivative(0), DualSVec64::from(p[1]).derivative(1)];
        let u: Vec<_> = r.u.iter().map(|&v| DualSVec64::from(v)).collect();
        let residual = Rods(40).residual(&u, &duals);
        let reverse = -residual.iter().zip(lambda.iter()).map(|(r, l)| *r * *l).sum::<DualSVec64<2>>();
        let forward: DualSVec64<2> = r.lift(&Rods(40), &duals).iter().map(|u| *u * *u).sum();
        for k in 0..2 {
            assert_relative_eq!(reverse.eps.0.unwrap()[k], forward.eps.0.unwrap()[k], max_relative = 1e-12);
        }
    }

    #[test]
    fn a_lifted_scalar_root_is_the_square_root() {
        let (value, slope) = first_derivative(|x: Dual64| lift_root(3.0, 6.0, |u: Dual64| u * u - x), 9.0);
        assert_eq!((value, slope), (3.0, 1.0 / 6.0));
    }

    #[test]
    fn failures_say_why() {
        struct NoRoot;
        impl Implicit for NoRoot {
            fn residual<S: Scalar>(&self, u: &[S], _: &[S]) -> Vec<S> {
                vec![u[0] * u[0] + 1.0]
            }
        }
        assert!(matches!(
            Root::newton(&NoRoot, &[0.7], &[], 1e-12, 20),
            Err(SolveError::NotConverged { iterations: 20, .. })
        ));
        assert_eq!(Root::newton(&NoRoot, &[0.0], &[], 1e-12, 20).unwrap_err(), SolveError::Singular { iteration: 0 });
    }
}
