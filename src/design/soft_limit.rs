//! Limits that give way: the square of what a quantity is beyond them.

use super::problem::Bounds;
use crate::scalar::Scalar;
use num_dual::{Dual64, first_derivative};

/// A limit that is a term of the objective: the square of the distance of a quantity from its bounds, zero within them.
///
/// The square is smooth where the limit is reached, and so is a design that gives way a little: the larger the weight,
/// the less.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoftLimit {
    /// Bounds of the quantity.
    pub bounds: Bounds,
}

impl SoftLimit {
    /// The penalty for a value of the quantity.
    pub fn square<S: Scalar>(&self, value: S) -> S {
        let Bounds { lower, upper } = self.bounds;
        let beyond = if value.re() < lower {
            value - lower
        } else if value.re() > upper {
            value - upper
        } else {
            return S::from(0.0);
        };
        beyond * beyond
    }

    /// The penalty for a value of the quantity, and its derivative with respect to that value.
    pub(super) fn square_and_slope(&self, value: f64) -> (f64, f64) {
        first_derivative(|v: Dual64| self.square(v), value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_within_and_a_square_beyond() {
        let soft = SoftLimit { bounds: Bounds { lower: 1.0, upper: 2.0 } };
        assert_eq!(soft.square_and_slope(1.5), (0.0, 0.0));
        assert_eq!(soft.square_and_slope(0.5), (0.25, -1.0));
        assert_eq!(soft.square_and_slope(4.0), (4.0, 4.0));
    }
}
