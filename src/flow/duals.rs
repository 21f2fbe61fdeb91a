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
