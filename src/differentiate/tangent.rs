//! A first-order dual number of fixed width for hot loops.
//!
//! `num-dual`'s vector duals keep their derivatives in an `Option`, whose branches keep the compiler from holding them
//! in registers. [`Tangent`] always carries all `N` of them. It is a [`DualNum`], so that every formula that is generic
//! over [`Scalar`](crate::scalar::Scalar) takes it.

use num_dual::{DualNum, DualStruct, Mappable};
use num_traits::{FromPrimitive, Inv, Num, One, Signed, Zero};
use std::cmp::Ordering;
use std::f64::consts::{LN_2, LN_10};
use std::fmt;
use std::iter::{Product, Sum};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign};

/// `a b + c`, rounded once where the processor built for can do that in one step. For derivatives only: values are to
/// be those of plain `f64`.
#[inline(always)]
fn fused(a: f64, b: f64, c: f64) -> f64 {
    if cfg!(any(target_feature = "fma", target_arch = "aarch64")) { a.mul_add(b, c) } else { a * b + c }
}

/// A value and its `N` first derivatives.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tangent<const N: usize> {
    pub re: f64,
    pub eps: [f64; N],
}

impl<const N: usize> Tangent<N> {
    /// A constant: all derivatives are zero.
    #[inline(always)]
    pub fn from_re(value: f64) -> Self {
        Self { re: value, eps: [0.0; N] }
    }

    /// This value as the independent variable of direction `k`.
    #[inline(always)]
    pub fn derivative(mut self, k: usize) -> Self {
        self.eps[k] = 1.0;
        self
    }

    /// Numbers as the independent variables of all directions.
    #[inline(always)]
    pub fn variables(values: [f64; N]) -> [Self; N] {
        let mut variables = values.map(Self::from_re);
        for (k, variable) in variables.iter_mut().enumerate() {
            variable.eps[k] = 1.0;
        }
        variables
    }

    /// `f` of this number, from the value and the slope of `f`.
    #[inline(always)]
    fn through(&self, value: f64, slope: f64) -> Self {
        Self { re: value, eps: self.each(|e| slope * e) }
    }

    #[inline(always)]
    fn each(&self, f: impl Fn(f64) -> f64) -> [f64; N] {
        let mut result = [0.0; N];
        for k in 0..N {
            result[k] = f(self.eps[k]);
        }
        result
    }

    #[inline(always)]
    fn both(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> [f64; N] {
        let mut result = [0.0; N];
        for k in 0..N {
            result[k] = f(self.eps[k], other.eps[k]);
        }
        result
    }

    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        Self { re: self.re + other.re, eps: self.both(other, |a, b| a + b) }
    }

    #[inline(always)]
    fn minus(&self, other: &Self) -> Self {
        Self { re: self.re - other.re, eps: self.both(other, |a, b| a - b) }
    }

    #[inline(always)]
    fn times(&self, other: &Self) -> Self {
        Self { re: self.re * other.re, eps: self.both(other, |a, b| fused(a, other.re, self.re * b)) }
    }

    #[inline(always)]
    fn over(&self, other: &Self) -> Self {
        let inverse = other.re.recip();
        let value = self.re / other.re;
        Self { re: value, eps: self.both(other, |a, b| fused(-value, b, a) * inverse) }
    }

    /// `a − b floor(a / b)` with the sign of `a`, as of `f64`.
    #[inline(always)]
    fn remainder(&self, other: &Self) -> Self {
        let whole = (self.re / other.re).trunc();
        Self { re: self.re % other.re, eps: self.both(other, |a, b| a - whole * b) }
    }
}

impl<const N: usize> From<f64> for Tangent<N> {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self { re: value, eps: [0.0; N] }
    }
}

/// An operator between two tangents, by value and by reference, and with `f64` on the right.
macro_rules! operator {
    ($trait:ident, $method:ident, $assign:ident, $assign_method:ident, $function:ident, |$a:ident, $b:ident| $real:expr) => {
        impl<const N: usize> $trait for Tangent<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.$function(&other)
            }
        }
        impl<const N: usize> $trait<&Self> for Tangent<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: &Self) -> Self {
                self.$function(other)
            }
        }
        impl<const N: usize> $trait<f64> for Tangent<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, $b: f64) -> Self {
                let $a = self;
                $real
            }
        }
        impl<const N: usize> $assign for Tangent<N> {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = self.$function(&other);
            }
        }
        impl<const N: usize> $assign<f64> for Tangent<N> {
            #[inline(always)]
            fn $assign_method(&mut self, other: f64) {
                *self = $trait::$method(*self, other);
            }
        }
    };
}

operator!(Add, add, AddAssign, add_assign, plus, |a, b| Self { re: a.re + b, eps: a.eps });
operator!(Sub, sub, SubAssign, sub_assign, minus, |a, b| Self { re: a.re - b, eps: a.eps });
operator!(Mul, mul, MulAssign, mul_assign, times, |a, b| a.through(a.re * b, b));
operator!(Div, div, DivAssign, div_assign, over, |a, b| a.through(a.re / b, b.recip()));
operator!(Rem, rem, RemAssign, rem_assign, remainder, |a, b| Self { re: a.re % b, eps: a.eps });

impl<const N: usize> Neg for Tangent<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { re: -self.re, eps: self.each(|e| -e) }
    }
}

// as everywhere in `num-dual`, comparisons look at the value only
impl<const N: usize> PartialEq for Tangent<N> {
    #[inline(always)]
    fn eq(&self, other: &Self) -> bool {
        self.re == other.re
    }
}

impl<const N: usize> PartialEq<f64> for Tangent<N> {
    #[inline(always)]
    fn eq(&self, other: &f64) -> bool {
        self.re == *other
    }
}

impl<const N: usize> PartialOrd for Tangent<N> {
    #[inline(always)]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.re.partial_cmp(&other.re)
    }
}

impl<const N: usize> PartialOrd<f64> for Tangent<N> {
    #[inline(always)]
    fn partial_cmp(&self, other: &f64) -> Option<Ordering> {
        self.re.partial_cmp(other)
    }
}

impl<const N: usize> fmt::Display for Tangent<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} + {:?}ε", self.re, self.eps)
    }
}

impl<const N: usize> Zero for Tangent<N> {
    fn zero() -> Self {
        Self::from(0.0)
    }
    fn is_zero(&self) -> bool {
        self.re == 0.0
    }
}

impl<const N: usize> One for Tangent<N> {
    fn one() -> Self {
        Self::from(1.0)
    }
}

impl<const N: usize> Num for Tangent<N> {
    type FromStrRadixErr = <f64 as Num>::FromStrRadixErr;
    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        <f64 as Num>::from_str_radix(text, radix).map(Self::from)
    }
}

impl<const N: usize> Signed for Tangent<N> {
    #[inline(always)]
    fn abs(&self) -> Self {
        if self.re.is_sign_negative() { -*self } else { *self }
    }
    fn abs_sub(&self, other: &Self) -> Self {
        if self.re > other.re { *self - *other } else { Self::from(0.0) }
    }
    fn signum(&self) -> Self {
        Self::from(self.re.signum())
    }
    fn is_positive(&self) -> bool {
        self.re.is_sign_positive()
    }
    fn is_negative(&self) -> bool {
        self.re.is_sign_negative()
    }
}

impl<const N: usize> Inv for Tangent<N> {
    type Output = Self;
    #[inline(always)]
    fn inv(self) -> Self {
        self.recip()
    }
}

impl<const N: usize> Sum for Tangent<N> {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::from(0.0), |sum, x| sum + x)
    }
}

impl<const N: usize> Product for Tangent<N> {
    fn product<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::from(1.0), |product, x| product * x)
    }
}

impl<const N: usize> FromPrimitive for Tangent<N> {
    fn from_i64(n: i64) -> Option<Self> {
        f64::from_i64(n).map(Self::from)
    }
    fn from_u64(n: u64) -> Option<Self> {
        f64::from_u64(n).map(Self::from)
    }
    fn from_f64(n: f64) -> Option<Self> {
        Some(Self::from(n))
    }
}

impl<const N: usize> DualStruct for Tangent<N> {
    type Real = f64;
    type Inner = f64;
    #[inline(always)]
    fn re(&self) -> f64 {
        self.re
    }
    fn from_inner(inner: &f64) -> Self {
        Self::from(*inner)
    }
}

impl<const N: usize> Mappable<Self> for Tangent<N> {
    type Output<O> = O;
    fn map_dual<M: Fn(Self) -> O, O>(self, f: M) -> O {
        f(self)
    }
}

impl<const N: usize> DualNum for Tangent<N> {
    type Primitive = f64;
    type InnerDual = f64;
    const NDERIV: usize = 1;

    #[inline(always)]
    fn from_re(re: f64) -> Self {
        Self::from(re)
    }
    #[inline(always)]
    fn scale(self, factor: &f64) -> Self {
        self * *factor
    }
    #[inline(always)]
    fn recip(&self) -> Self {
        let value = self.re.recip();
        self.through(value, -value * value)
    }
    #[inline]
    fn powi(&self, n: i32) -> Self {
        match n {
            0 => Self::from(1.0),
            1 => *self,
            2 => self.times(self),
            _ => {
                let lower = self.re.powi(n - 1);
                self.through(lower * self.re, f64::from(n) * lower)
            }
        }
    }
    #[inline]
    fn powf(&self, n: f64) -> Self {
        self.through(self.re.powf(n), n * self.re.powf(n - 1.0))
    }
    #[inline(always)]
    fn sqrt(&self) -> Self {
        let value = self.re.sqrt();
        self.through(value, 0.5 / value)
    }
    fn cbrt(&self) -> Self {
        let value = self.re.cbrt();
        self.through(value, 1.0 / (3.0 * value * value))
    }
    #[inline]
    fn exp(&self) -> Self {
        let value = self.re.exp();
        self.through(value, value)
    }
    fn exp2(&self) -> Self {
        let value = self.re.exp2();
        self.through(value, value * LN_2)
    }
    fn exp_m1(&self) -> Self {
        self.through(self.re.exp_m1(), self.re.exp())
    }
    #[inline]
    fn ln(&self) -> Self {
        self.through(self.re.ln(), self.re.recip())
    }
    fn log(&self, base: f64) -> Self {
        self.through(self.re.log(base), (self.re * base.ln()).recip())
    }
    fn log2(&self) -> Self {
        self.through(self.re.log2(), (self.re * LN_2).recip())
    }
    fn log10(&self) -> Self {
        self.through(self.re.log10(), (self.re * LN_10).recip())
    }
    fn ln_1p(&self) -> Self {
        self.through(self.re.ln_1p(), (1.0 + self.re).recip())
    }
    fn sin(&self) -> Self {
        self.sin_cos().0
    }
    fn cos(&self) -> Self {
        self.sin_cos().1
    }
    fn tan(&self) -> Self {
        let value = self.re.tan();
        self.through(value, 1.0 + value * value)
    }
    #[inline]
    fn sin_cos(&self) -> (Self, Self) {
        let (sin, cos) = self.re.sin_cos();
        (self.through(sin, cos), self.through(cos, -sin))
    }
    fn asin(&self) -> Self {
        self.through(self.re.asin(), (1.0 - self.re * self.re).sqrt().recip())
    }
    fn acos(&self) -> Self {
        self.through(self.re.acos(), -(1.0 - self.re * self.re).sqrt().recip())
    }
    #[inline]
    fn atan(&self) -> Self {
        self.through(self.re.atan(), (1.0 + self.re * self.re).recip())
    }
    #[inline]
    fn atan2(&self, other: Self) -> Self {
        let square = (self.re * self.re + other.re * other.re).recip();
        let eps = self.both(&other, |a, b| fused(a, other.re, -(b * self.re)) * square);
        Self { re: self.re.atan2(other.re), eps }
    }
    fn sinh(&self) -> Self {
        self.through(self.re.sinh(), self.re.cosh())
    }
    fn cosh(&self) -> Self {
        self.through(self.re.cosh(), self.re.sinh())
    }
    #[inline]
    fn tanh(&self) -> Self {
        let value = self.re.tanh();
        self.through(value, 1.0 - value * value)
    }
    fn asinh(&self) -> Self {
        self.through(self.re.asinh(), (self.re * self.re + 1.0).sqrt().recip())
    }
    fn acosh(&self) -> Self {
        self.through(self.re.acosh(), (self.re * self.re - 1.0).sqrt().recip())
    }
    fn atanh(&self) -> Self {
        self.through(self.re.atanh(), (1.0 - self.re * self.re).recip())
    }
    fn sph_j0(&self) -> Self {
        self.like(num_dual::Dual64::sph_j0)
    }
    fn sph_j1(&self) -> Self {
        self.like(num_dual::Dual64::sph_j1)
    }
    fn sph_j2(&self) -> Self {
        self.like(num_dual::Dual64::sph_j2)
    }
}

impl<const N: usize> Tangent<N> {
    /// A function of one variable by `num-dual`'s number.
    fn like(&self, f: impl Fn(&num_dual::Dual64) -> num_dual::Dual64) -> Self {
        let at = f(&num_dual::Dual64::new(self.re, 1.0));
        self.through(at.re, at.eps)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Scalar;
    use num_dual::Dual64;

    /// Value and slope by both kinds of numbers.
    fn compare(name: &str, own: impl Fn(Tangent<3>) -> Tangent<3>, other: impl Fn(Dual64) -> Dual64, x: f64) {
        let expected = other(Dual64::new(x, 1.0));
        let found = own(Tangent { re: x, eps: [1.0, 0.0, -2.0] });
        let close = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * (a.abs() + b.abs());
        assert!(close(found.re, expected.re), "{name} at {x}: {} {}", found.re, expected.re);
        for (e, factor) in found.eps.iter().zip([1.0, 0.0, -2.0]) {
            assert!(close(*e, factor * expected.eps), "{name}' at {x}: {e} {}", expected.eps);
        }
    }

    macro_rules! check {
        ($x:expr; $($v:ident => $e:expr),* $(,)?) => {
            $(compare(stringify!($e), |$v: Tangent<3>| $e, |$v: Dual64| $e, $x);)*
        };
    }

    #[test]
    fn functions_and_operators_are_those_of_num_dual() {
        for x in [0.3, 0.71] {
            check!(x;
                v => v * v + v, v => v / (v * v + 1.0), v => v - v * 3.0, v => -v / 7.0, v => (v - 2.0).abs(),
                v => v.recip(), v => v.powi(0), v => v.powi(1), v => v.powi(2), v => v.powi(5), v => v.powi(-2),
                v => v.powf(1.7), v => v.sqrt(), v => v.cbrt(), v => v.exp(), v => v.exp2(), v => v.exp_m1(),
                v => v.ln(), v => v.log(3.0), v => v.log2(), v => v.log10(), v => v.ln_1p(), v => v.sin(), v => v.cos(),
                v => v.tan(), v => v.asin(), v => v.acos(), v => v.atan(), v => v.atan2(v * v + 0.5), v => v.sinh(),
                v => v.cosh(), v => v.tanh(), v => v.asinh(), v => (v + 1.0).acosh(), v => v.atanh(), v => v.sph_j0(),
                v => v.sph_j1(), v => v.sph_j2(), v => v.saturating_tanh(), v => v.positive_part(0.2),
                v => (v - 0.5).angle(v), v => v.powd(v + 1.0), v => v.mul_add(v, v),
            );
        }
    }

    #[test]
    fn comparisons_look_at_the_value() {
        let (a, b) = (Tangent::<2>::from_re(1.0).derivative(0), Tangent::<2>::from_re(1.0).derivative(1));
        assert!(a == b && a < 1.5 && a == 1.0 && !(a > b));
        assert_eq!((a % 0.75).re, 0.25);
        assert_eq!((a % Tangent::from_re(0.75).derivative(1)).eps, [1.0, -1.0]);
    }
}
