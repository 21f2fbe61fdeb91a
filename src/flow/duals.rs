//! The small dual numbers in which local derivatives are computed.

use crate::differentiate::Tangent;

/// Derivatives with respect to two numbers, such as the Mach and the Reynolds number.
pub(crate) type Dual2 = Tangent<2>;
/// Derivatives with respect to a place in the frame of a panel (two coordinates) and the length of the panel, or with
/// respect to three neighbouring points.
pub(crate) type Dual3 = Tangent<3>;
/// Derivatives with respect to the coordinates of two points of the plane.
pub(crate) type Dual4 = Tangent<4>;
/// Derivatives with respect to the coordinates of the four nodes at the trailing edge.
pub(crate) type Dual8 = Tangent<8>;

/// The gradient that a dual number carries.
#[inline(always)]
pub(crate) fn gradient<const N: usize>(x: &Tangent<N>) -> [f64; N] {
    x.eps
}

/// The chain rule: `outer` carries derivatives with respect to M numbers, which are themselves the dual numbers
/// `inner`.
#[inline(always)]
pub(crate) fn compose<const M: usize, const N: usize>(outer: &Tangent<M>, inner: [&Tangent<N>; M]) -> Tangent<N> {
    let mut eps = [0.0; N];
    for (slope, inner) in outer.eps.iter().zip(inner) {
        for k in 0..N {
            eps[k] += slope * inner.eps[k];
        }
    }
    Tangent { re: outer.re, eps }
}
