//! Drivers that turn a function written over [`Scalar`] into its exact derivatives.
//!
//! * [`gradient`], [`jacobian`], [`hessian`]: forward mode in chunks of [`CHUNK`] directions, no heap-allocated duals;
//! * [`lift_root`], [`lift_roots`] for a few unknowns, [`Implicit`] and [`Root`] for many: solve in `f64`, then carry
//!   derivatives of every order through the solution by the implicit function theorem;
//! * [`finite_difference`]: Ridders' extrapolated central differences with their own error estimate. They only check.
//!
//! A Rust closure cannot be generic, so functions to differentiate are types with a generic method:
//!
//! ```
//! use aeroform::differentiate::{gradient, Function};
//! use aeroform::scalar::Scalar;
//!
//! struct Rosenbrock;
//! impl Function for Rosenbrock {
//!     type Error = std::convert::Infallible;
//!     fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Self::Error> {
//!         Ok((x[0] - 1.0).squared() + (x[1] - x[0].squared()).squared() * 100.0)
//!     }
//! }
//! let (value, gradient) = gradient(&Rosenbrock, &[0.0, 1.0]).unwrap();
//! assert_eq!((value, gradient), (101.0, vec![-2.0, 200.0]));
//! ```
//!
//! This module depends on [`scalar`](crate::scalar) and `nalgebra`.

mod forward;
mod implicit;
mod ridders;
mod tangent;

pub(crate) use tangent::Tangent;

pub use forward::{CHUNK, Direction, gradient, hessian, jacobian};
pub(crate) use implicit::lift;
pub use implicit::{Implicit, Root, SingularJacobian, SolveError, lift_root, lift_roots};
pub use ridders::{Estimate, StepRange, finite_difference, finite_difference_jacobian};

use crate::scalar::Scalar;

/// A scalar function of `n` variables, written once for every [`Scalar`].
pub trait Function {
    /// Why the function has no value at some point; [`std::convert::Infallible`] where it always has.
    type Error;
    /// The value at the point `x`, which has one entry per variable.
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Self::Error>;
}

/// A vector function of `n` variables, written once for every [`Scalar`].
pub trait VectorFunction {
    /// Why the function has no value at some point.
    type Error;
    /// The values at `x`; their number must not depend on `x` or on the scalar type.
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Self::Error>;
}
