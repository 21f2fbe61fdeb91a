//! The small dual numbers of the local Jacobians.

use crate::differentiate::Tangent;

/// Derivatives with respect to the four unknowns of one station, or to the four global unknowns.
pub(crate) type Dual4 = Tangent<4>;
/// Derivatives with respect to the unknowns of two stations.
pub(crate) type Dual8 = Tangent<8>;
/// Derivatives with respect to the unknowns and the abscissas of two stations.
pub(crate) type Dual10 = Tangent<10>;
/// Derivatives with respect to two abscissas.
pub(crate) type Dual2 = Tangent<2>;
/// Derivatives with respect to three unknowns of a station, or to a place in the frame of a panel and its length.
pub(crate) type Dual3 = Tangent<3>;

/// The gradient a dual number carries.
#[inline(always)]
pub(crate) fn gradient<const N: usize>(x: &Tangent<N>) -> [f64; N] {
    x.eps
}

/// A dual number from value and gradient.
pub(crate) fn dual<const N: usize>(value: f64, gradient: [f64; N]) -> Tangent<N> {
    Tangent { re: value, eps: gradient }
}

/// Puts the four derivatives into the directions `offset` … `offset + 3`.
#[inline(always)]
pub(crate) fn widen<const N: usize>(x: Dual4, offset: usize) -> Tangent<N> {
    let mut wide = Tangent::from_re(x.re);
    wide.eps[offset..offset + 4].copy_from_slice(&x.eps);
    wide
}
