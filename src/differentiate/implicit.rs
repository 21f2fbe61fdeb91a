//! Implicit function theorem: solve in `f64`, then lift the root to any scalar.

use crate::scalar::Scalar;
use nalgebra::{DMatrix, DVector, SMatrix};

/// The Jacobian of a system of equations has no inverse at their root, so that the root has no derivatives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the Jacobian of the equations is singular at their root, which therefore has no derivatives")]
pub struct SingularJacobian;

/// Why a system of equations was not solved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SolveError {
    /// Newton's method used up its iterations.
    #[error("Newton did not converge in {iterations} iterations: residual {residual:.3e}, wanted {tolerance:.1e}")]
    NotConverged {
        /// Number of iterations that were done.
        iterations: usize,
        /// Euclidean norm of the last residual.
        residual: f64,
        /// Norm of the residual that was asked for.
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

/// A solution in `f64`, with the inverse of the Jacobian *at the solution*.
#[derive(Debug, Clone)]
pub struct Root {
    /// The unknowns at the solution.
    pub u: DVector<f64>,
    inverse: DMatrix<f64>,
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
            let singular = SolveError::Singular { iteration };
            if residual <= tolerance {
                return Ok(Self { u, inverse: jacobian.try_inverse().ok_or(singular)? });
            }
            if iteration < iterations {
                u -= jacobian.lu().solve(&r).ok_or(singular)?;
            }
        }
        Err(SolveError::NotConverged { iterations, residual, tolerance })
    }

    /// The root as a function of `p` for any scalar whose real parts are those the root was solved at.
    pub fn lift<S: Scalar, I: Implicit>(&self, system: &I, p: &[S]) -> Vec<S> {
        let mut u: Vec<S> = self.u.iter().map(|&v| S::from(v)).collect();
        lift(&mut u, |u| system.residual(u, p), |k, r| self.inverse[(k, r)]);
        u
    }

    /// The adjoint `λ = (dR/du)⁻ᵀ dJ/du` of an output `J(u, p)`.
    ///
    /// Then `dJ/dp` is `∂J/∂p − ∂(λ·R(u, p))/∂p`: one scalar function of `p`, whatever the number of unknowns.
    pub fn adjoint(&self, output_by_unknown: &DVector<f64>) -> DVector<f64> {
        self.inverse.tr_mul(output_by_unknown)
    }
}

/// Carries derivatives of every order that `S` has into a root `u` that was found in `f64`.
///
/// The step is `u ← u − J⁻¹ R(u)`, once per order of derivative: with the Jacobian `J` frozen in `f64` each pass makes
/// one more order exact. `inverse` gives the entries of `J⁻¹` by row and column.
pub(crate) fn lift<S: Scalar, R: AsRef<[S]>>(
    u: &mut [S],
    residual: impl Fn(&[S]) -> R,
    inverse: impl Fn(usize, usize) -> f64,
) {
    for _ in 0..S::NDERIV {
        let residual = residual(u);
        for (k, u) in u.iter_mut().enumerate() {
            for (r, value) in residual.as_ref().iter().enumerate() {
                // the real part of the residual is round-off of the f64 solution; it must not move the root
                *u -= (*value - value.re()) * inverse(k, r);
            }
        }
    }
}

/// Lifts a root of `N` equations in `N` unknowns, already found in `f64`, to the scalar `S`.
///
/// `residual` closes over whatever carries derivatives. `jacobian` gives the Jacobian at the root, by columns: entry
/// `k` holds the derivatives of all residuals with respect to unknown `k`. It is asked for only where `S` has
/// derivatives.
///
/// ```
/// use aeroform::differentiate::lift_roots;
/// use num_dual::Dual64;
/// // x + y = p and x y = 2 at p = 3
/// let p = Dual64::new(3.0, 1.0);
/// let residual = |[x, y]: [Dual64; 2]| [x + y - p, x * y - 2.0];
/// let [x, y] = lift_roots([1.0, 2.0], || [[1.0, 2.0], [1.0, 1.0]], residual).unwrap();
/// assert_eq!((x.re, x.eps, y.re, y.eps), (1.0, -1.0, 2.0, 2.0));
/// ```
///
/// # Errors
/// A Jacobian that is singular to round-off, where `S` carries derivatives.
pub fn lift_roots<S: Scalar, const N: usize>(
    root: [f64; N],
    jacobian: impl FnOnce() -> [[f64; N]; N],
    residual: impl Fn([S; N]) -> [S; N],
) -> Result<[S; N], SingularJacobian> {
    let mut u = root.map(S::from);
    if S::NDERIV > 0 {
        let jacobian = SMatrix::<f64, N, N>::from(jacobian());
        let inverse = jacobian.try_inverse().ok_or(SingularJacobian)?;
        // a product that is large whatever the units of the unknowns; written so that NaN fails
        if !(0..N).all(|k| jacobian.column(k).amax() * inverse.row(k).amax() < 1e14) {
            return Err(SingularJacobian);
        }
        lift(&mut u, |u| residual(std::array::from_fn(|k| u[k])), |k, r| inverse[(k, r)]);
    }
    Ok(u)
}

/// Lifts a root of one equation in one unknown, as [`lift_roots`] does for several; `slope` is the derivative of the
/// residual with respect to the unknown at the root.
///
/// # Errors
/// A slope of zero, where `S` carries derivatives.
pub fn lift_root<S: Scalar>(
    root: f64,
    slope: impl FnOnce() -> f64,
    residual: impl Fn(S) -> S,
) -> Result<S, SingularJacobian> {
    lift_roots([root], || [[slope()]], |[u]| [residual(u)]).map(|[u]| u)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use num_dual::{Dual2SVec64, Dual3_64, Dual64, DualSVec64, HyperDual64, first_derivative};

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
        let root = |x: Dual64| lift_root(3.0, || 6.0, |u: Dual64| u * u - x).unwrap();
        assert_eq!(first_derivative(root, 9.0), (3.0, 1.0 / 6.0));
    }

    /// x³ + y = a, x y² = b, over the scalar `S`, at the root (1.5, 0.7).
    fn pair<S: Scalar>(a: S, b: S) -> [S; 2] {
        let jacobian = || [[3.0 * 1.5 * 1.5, 0.7 * 0.7], [1.0, 2.0 * 1.5 * 0.7]];
        lift_roots([1.5, 0.7], jacobian, |[x, y]: [S; 2]| [x.powi(3) + y - a, x * y * y - b]).unwrap()
    }

    #[test]
    fn lifted_systems_are_exact_to_the_third_order() {
        let (a, b) = (1.5f64.powi(3) + 0.7, 1.5 * 0.49);
        let t = Dual3_64::from(0.0).derivative();
        let [x, y] = pair(t * 2.0 + a, t * t - t + b);
        // put back into the equations every order must come out as it went in
        let (first, second) = (x * x * x + y - t * 2.0 - a, x * y * y - t * t + t - b);
        for r in [first, second] {
            assert!(r.re.abs().max(r.v1.abs()).max(r.v2.abs()).max(r.v3.abs()) < 1e-12, "{r}");
        }
        assert!(x.v3.abs() > 1e-3 && y.v3.abs() > 1e-3);
        let [hx, hy] = pair(HyperDual64::new(a, 2.0, 2.0, 0.0), HyperDual64::new(b, -1.0, -1.0, 2.0));
        assert_relative_eq!(hx.eps1eps2, x.v2, max_relative = 1e-13);
        assert_relative_eq!(hy.eps1eps2, y.v2, max_relative = 1e-13);
    }

    #[test]
    fn singular_jacobians_are_refused_where_derivatives_are_wanted() {
        let flat = |x: Dual64| lift_root(0.0, || 0.0, |u: Dual64| u * u - x);
        assert_eq!(flat(Dual64::new(0.0, 1.0)), Err(SingularJacobian));
        assert!(lift_root(0.0, || f64::NAN, |u: Dual64| u).is_err());
        let parallel = || [[0.1, 0.3], [0.1 / 3.0, 0.1]];
        assert_eq!(
            lift_roots([Dual64::from(0.0); 2].map(|u| u.re), parallel, |u: [Dual64; 2]| u),
            Err(SingularJacobian)
        );
        assert_eq!(lift_roots([0.5, 0.5], parallel, |u: [f64; 2]| u), Ok([0.5, 0.5]));
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
