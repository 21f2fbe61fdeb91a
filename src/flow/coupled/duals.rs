//! The small dual numbers of the local Jacobians.

use nalgebra::SVector;
use num_dual::{Derivative, DualSVec64};

/// Derivatives with respect to the four unknowns of one station, or to the four global unknowns.
pub(crate) type Dual4 = DualSVec64<4>;
/// Derivatives with respect to the unknowns of two stations.
pub(crate) type Dual8 = DualSVec64<8>;
/// Derivatives with respect to two abscissas.
pub(crate) type Dual2 = DualSVec64<2>;

/// The gradient a dual number carries.
pub(crate) fn gradient<const N: usize>(x: &DualSVec64<N>) -> [f64; N] {
    match &x.eps.0 {
        Some(eps) => std::array::from_fn(|k| eps[k]),
        None => [0.0; N],
    }
}

/// A dual number from value and gradient.
pub(crate) fn dual<const N: usize>(value: f64, gradient: [f64; N]) -> DualSVec64<N> {
    DualSVec64::new(value, Derivative::some(SVector::from(gradient)))
}

/// Puts the four derivatives into the directions `offset` … `offset + 3`.
pub(crate) fn widen(x: Dual4, offset: usize) -> Dual8 {
    let Some(eps) = &x.eps.0 else { return Dual8::from_re(x.re) };
    let mut wide = SVector::<f64, 8>::zeros();
    for k in 0..4 {
        wide[offset + k] = eps[k];
    }
    Dual8::new(x.re, Derivative::some(wide))
}
