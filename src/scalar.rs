//! [`Scalar`]: the one number trait of the crate.
//!
//! Every geometric and aerodynamic formula is written once, generic over [`Scalar`], and runs with `f64` or with
//! any fixed-size dual number of `num-dual`. Nothing else in the crate knows which dual it is. This module adds
//! the few functions that `num-dual` lacks (error function, smooth minimum, …) or evaluates to NaN at points an
//! airfoil code visits (real powers at zero, `atan2` on the vertical axis, `tanh` of large numbers).
//!
//! This module depends on `num-dual` and `libm` only.

use num_dual::DualNum;
use std::ops::{Add, Div, Mul, Sub};

/// A real number that may carry derivatives: `f64`, or a `Copy` dual number over `f64`.
///
/// Comparisons (`<`, `==`) look at the real part only, as everywhere in `num-dual`. Literals stand on the right:
/// `x * 2.0`, `-x + 1.0`.
///
/// ```
/// use aeroform::scalar::Scalar;
/// use num_dual::{first_derivative, Dual64};
///
/// fn bump<S: Scalar>(x: S) -> S {
///     (-(x * x)).exp() + x.erfc()
/// }
/// let (value, slope) = first_derivative(bump::<Dual64>, 0.0);
/// assert_eq!(value, 2.0);
/// assert!((slope + std::f64::consts::FRAC_2_SQRT_PI).abs() < 1e-15);
/// ```
pub trait Scalar: DualNum<Primitive = f64> + Copy + Send + Sync {
    /// `f(self)` from the value and the first three derivatives of `f` at the real part of `self`.
    ///
    /// This is the Taylor series in the nilpotent part, so it is exact for every dual number with
    /// `NDERIV <= 3`. Each elementary function below is one call of it.
    #[inline]
    fn chain(self, taylor: [f64; 4]) -> Self {
        debug_assert!(Self::NDERIV <= 3, "chain carries three derivatives");
        let [f0, f1, f2, f3] = taylor;
        let d = self - self.re();
        match Self::NDERIV {
            0 => Self::from(f0),
            1 => d * f1 + f0,
            _ => ((d * (f3 / 6.0) + f2 / 2.0) * d + f1) * d + f0,
        }
    }

    /// Error function `2/√π ∫ exp(−t²) dt` from 0 to the number.
    #[inline]
    fn erf(self) -> Self {
        let x = self.re();
        let g = std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp();
        self.chain([libm::erf(x), g, -2.0 * x * g, (4.0 * x * x - 2.0) * g])
    }

    /// Complementary error function `1 − erf`, without cancellation for large numbers (paper, equation 2).
    #[inline]
    fn erfc(self) -> Self {
        let x = self.re();
        let g = -std::f64::consts::FRAC_2_SQRT_PI * (-x * x).exp();
        self.chain([libm::erfc(x), g, -2.0 * x * g, (4.0 * x * x - 2.0) * g])
    }

    /// `tanh` that saturates to ±1 where `DualNum::tanh` overflows to NaN (|x| > 710).
    #[inline]
    fn saturating_tanh(self) -> Self {
        let t = self.re().tanh();
        let s = 1.0 - t * t;
        self.chain([t, s, -2.0 * t * s, (6.0 * t * t - 2.0) * s])
    }

    /// Real power `self^n`, exact also at zero.
    ///
    /// `DualNum::powf` is NaN at zero, even in its value. Here the value and every derivative that is finite there are
    /// exact: of `x^1.5` the value and the first derivative are 0. A derivative that is infinite there is ±∞ (the first
    /// of `x^0.5`, the second of `x^1.5`), and 0 in directions in which the number does not move. Where two infinite
    /// terms of opposite sign meet, as in a third derivative along a curved path, it is NaN. Negative numbers have real
    /// powers for integer `n` only, and NaN otherwise.
    ///
    /// ```
    /// use aeroform::scalar::Scalar;
    /// use num_dual::Dual2_64;
    /// let x = Dual2_64::new(0.0, 1.0, 0.0).real_power(1.5);
    /// assert_eq!((x.re, x.v1, x.v2), (0.0, 0.0, f64::INFINITY));
    /// ```
    #[inline]
    fn real_power(self, n: f64) -> Self {
        let x = self.re();
        let term = |c: f64, m: f64| if c == 0.0 { 0.0 } else { c * x.powf(m) };
        let taylor =
            [x.powf(n), term(n, n - 1.0), term(n * (n - 1.0), n - 2.0), term(n * (n - 1.0) * (n - 2.0), n - 3.0)];
        if taylor.iter().any(|f| f.is_infinite()) { self.infinite_chain(taylor) } else { self.chain(taylor) }
    }

    /// [`chain`](Self::chain) with infinite derivatives, of which a part that does not move makes nothing.
    #[doc(hidden)]
    fn infinite_chain(self, taylor: [f64; 4]) -> Self {
        let d = self - self.re();
        let (mut sum, mut power, mut factorial) = (Self::from(taylor[0]), Self::from(1.0), 1.0);
        for (k, f) in taylor.into_iter().enumerate().skip(1).take(Self::NDERIV) {
            power *= d;
            factorial *= k as f64;
            // twice the largest number takes everything to infinity but zero
            sum += if f.is_infinite() { power * f.signum() * f64::MAX * f64::MAX } else { power * (f / factorial) };
        }
        sum
    }

    /// Angle of the vector (`x`, `self`) in radians, in (−π, π], with derivatives also at `x = 0`.
    ///
    /// `DualNum::atan2` divides by `x`. The function is undefined at the origin and jumps across the negative axis.
    #[inline]
    fn angle(self, x: Self) -> Self {
        let (xr, yr) = (x.re(), self.re());
        if Self::NDERIV == 0 {
            return Self::from(yr.atan2(xr));
        }
        let r = xr.hypot(yr);
        let (c, s) = (xr / r, yr / r);
        ((self * c - x * s) / (x * c + self * s)).atan() + yr.atan2(xr)
    }

    /// `ln(1 + exp(self))` without overflow: zero far left, `self` far right, smooth in between.
    #[inline]
    fn softplus(self) -> Self {
        let x = self.re();
        // exp of a non-positive number only
        let e = (-x.abs()).exp();
        let logistic = if x >= 0.0 { 1.0 / (1.0 + e) } else { e / (1.0 + e) };
        let slope = e / ((1.0 + e) * (1.0 + e));
        self.chain([x.max(0.0) + e.ln_1p(), logistic, slope, slope * (1.0 - 2.0 * logistic)])
    }

    /// Smooth minimum of two numbers (paper, equation 4): `−ln(exp(−α a) + exp(−α b)) / α`.
    ///
    /// Lies below both, by at most `ln 2 / α` (at `a = b`). `sharpness` is the paper's α > 0, in units of one
    /// over those of the arguments. No overflow for any finite argument.
    #[inline]
    fn smooth_minimum(self, other: Self, sharpness: f64) -> Self {
        // one formula, written from the smaller of the two so that nothing cancels
        let (low, high) = if self.re() < other.re() { (self, other) } else { (other, self) };
        low - ((low - high) * sharpness).softplus() / sharpness
    }

    /// Smooth maximum of two numbers; above both, by at most `ln 2 / sharpness`.
    #[inline]
    fn smooth_maximum(self, other: Self, sharpness: f64) -> Self {
        let (low, high) = if self.re() < other.re() { (self, other) } else { (other, self) };
        high + ((low - high) * sharpness).softplus() / sharpness
    }

    /// Smooth positive part `(x + sqrt(x² + width²)) / 2`; above `max(x, 0)` by at most `width / 2` (at 0).
    #[inline]
    fn positive_part(self, width: f64) -> Self {
        let root = (self * self + width * width).sqrt();
        // for negative arguments the sum would cancel
        if self.re() >= 0.0 { (self + root) * 0.5 } else { (root - self).recip() * (0.5 * width * width) }
    }

    /// Square of the number.
    #[inline]
    fn squared(self) -> Self {
        self * self
    }
}

impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Scalar for T {}

/// A scalar that arithmetic combines with numbers of another scalar `S`: with `f64` every scalar, otherwise `S` itself.
///
/// Quantities prepared from numbers of `S` (a target, an undeformed box) are so compared with ones of other scalars,
/// without turning constants into dual numbers.
pub trait Over<S>:
    Scalar + Add<S, Output = Self> + Sub<S, Output = Self> + Mul<S, Output = Self> + Div<S, Output = Self>
{
}

impl<S, T> Over<S> for T where
    T: Scalar + Add<S, Output = T> + Sub<S, Output = T> + Mul<S, Output = T> + Div<S, Output = T>
{
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use num_dual::{Dual2_64, Dual3_64, Dual64, HyperHyperDual64, first_derivative, third_derivative};

    /// Checks three derivatives of a function by differencing the one of one order less.
    fn check_three(f1: impl Fn(Dual64) -> Dual64, f3: impl Fn(Dual3_64) -> Dual3_64, x: f64) {
        let h = 1e-5;
        let (v, d1, d2, d3) = third_derivative(&f3, x);
        let first = |x: f64| first_derivative(&f1, x);
        assert_relative_eq!(v, first(x).0, max_relative = 1e-14, epsilon = 1e-300);
        assert_relative_eq!(d1, first(x).1, max_relative = 1e-13, epsilon = 1e-300);
        let slope = |a: f64, b: f64| (a - b) / (2.0 * h);
        assert_relative_eq!(d1, slope(first(x + h).0, first(x - h).0), max_relative = 1e-8, epsilon = 1e-10);
        assert_relative_eq!(d2, slope(first(x + h).1, first(x - h).1), max_relative = 1e-8, epsilon = 1e-10);
        let second = |x: f64| third_derivative(&f3, x).2;
        assert_relative_eq!(d3, slope(second(x + h), second(x - h)), max_relative = 1e-8, epsilon = 1e-9);
    }

    macro_rules! check {
        ($x:expr, |$v:ident| $e:expr) => {
            check_three(|$v: Dual64| $e, |$v: Dual3_64| $e, $x)
        };
    }

    #[test]
    fn elementary_functions_have_three_derivatives() {
        for x in [-1.3, 0.0, 0.4, 2.0] {
            check!(x, |v| v.erfc());
            check!(x, |v| v.erf());
            check!(x, |v| v.saturating_tanh());
            check!(x, |v| v.softplus());
            check!(x, |v| v.positive_part(0.3));
            check!(x, |v| v.smooth_minimum(v * v, 3.0));
            check!(x, |v| v.smooth_maximum(v * v, 3.0));
            check!(x, |v| (v + 0.1).angle(v * v - 0.5));
        }
        for x in [0.3, 1.0, 2.5] {
            check!(x, |v| v.real_power(1.7));
        }
    }

    #[test]
    fn num_dual_traps_are_closed() {
        let zero = Dual64::new(0.0, 1.0);
        assert!(DualNum::powf(&zero, 1.5).re.is_nan(), "if this fails, num-dual mended powf");
        assert_eq!((zero.real_power(1.5).re, zero.real_power(1.5).eps), (0.0, 0.0));
        assert_eq!(Dual64::from(1.0).angle(zero).eps, -1.0);
        assert_eq!(Dual64::new(800.0, 1.0).saturating_tanh().re, 1.0);
        assert_eq!(Dual64::new(800.0, 1.0).saturating_tanh().eps, 0.0);
    }

    #[test]
    fn smooth_minimum_does_not_overflow() {
        for (a, b) in [(1e3, -1e3), (-1e3, 1e3), (1e300, 1.0)] {
            let m = Dual64::new(a, 1.0).smooth_minimum(Dual64::from(b), 1000.0);
            assert_eq!(m.re, f64::min(a, b));
            assert_eq!(m.eps, if a < b { 1.0 } else { 0.0 });
        }
        let m = 0.25f64.smooth_minimum(0.25, 1000.0);
        assert_relative_eq!(m, 0.25 - 2f64.ln() / 1000.0, max_relative = 1e-15);
    }

    #[test]
    fn real_powers_at_zero_are_exact_to_third_order() {
        let (zero, inf) = (0.0, f64::INFINITY);
        for (n, expected) in [
            (0.5, [zero, inf, -inf, inf]),
            (1.0, [zero, 1.0, zero, zero]),
            (1.5, [zero, zero, inf, -inf]),
            (2.0, [zero, zero, 2.0, zero]),
            (2.5, [zero, zero, zero, inf]),
            (3.0, [zero, zero, zero, 6.0]),
            (3.5, [zero; 4]),
            (0.0, [1.0, zero, zero, zero]),
            (-1.0, [inf, -inf, inf, -inf]),
        ] {
            let (v, d1, d2, d3) = third_derivative(|x: Dual3_64| x.real_power(n), 0.0);
            assert_eq!([v, d1, d2, d3], expected, "Dual3 {n}");
            let h = HyperHyperDual64::new(0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0).real_power(n);
            assert_eq!([h.re, h.eps1, h.eps1eps2, h.eps1eps2eps3], expected, "HyperHyperDual {n}");
            assert_eq!([h.eps2, h.eps3, h.eps1eps3, h.eps2eps3], [expected[1], expected[1], expected[2], expected[2]]);
            let first = Dual64::new(0.0, 1.0).real_power(n);
            assert_eq!([first.re, first.eps], expected[..2], "Dual {n}");
            let second = Dual2_64::new(0.0, 1.0, 0.0).real_power(n);
            assert_eq!([second.re, second.v1, second.v2], expected[..3], "Dual2 {n}");
            // a number that does not move has no derivatives, and moves nothing
            assert_eq!(Dual3_64::from(0.0).real_power(n), Dual3_64::from(expected[0]));
            let still = HyperHyperDual64::new(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0).real_power(n);
            assert_eq!([still.eps1, still.eps2, still.eps1eps2, still.eps1eps2eps3], [expected[1], 0.0, 0.0, 0.0]);
        }
        // away from zero nothing changes
        for (x, n) in [(1e-3, 0.5), (2.0, 1.5), (1e-200, 3.5)] {
            check_three_values(x, n);
        }
    }

    /// Three derivatives of a power in closed form.
    fn check_three_values(x: f64, n: f64) {
        let (v, d1, d2, d3) = third_derivative(|x: Dual3_64| x.real_power(n), x);
        let exact = [x.powf(n), n * x.powf(n - 1.0), n * (n - 1.0) * x.powf(n - 2.0)];
        assert_eq!([v, d1], exact[..2]);
        assert_relative_eq!(d2, exact[2], max_relative = 1e-15);
        assert_relative_eq!(d3, n * (n - 1.0) * (n - 2.0) * x.powf(n - 3.0), max_relative = 1e-15);
    }

    #[test]
    fn smooth_minimum_is_the_printed_formula() {
        // paper, equation (4)
        let printed = |a: f64, b: f64, alpha: f64| {
            if a < b {
                a - (1.0 + (-alpha * (b - a)).exp()).ln() / alpha
            } else {
                b - (1.0 + (-alpha * (a - b)).exp()).ln() / alpha
            }
        };
        for (a, b) in [(0.01, 0.02), (0.02, 0.01), (-0.3, 0.1), (0.01, 0.0101)] {
            assert_relative_eq!(a.smooth_minimum(b, 1000.0), printed(a, b, 1000.0), max_relative = 1e-14);
        }
    }
}
