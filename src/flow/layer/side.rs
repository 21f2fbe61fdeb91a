//! The two sides of a section.

use crate::scalar::Scalar;

/// One of the two sides of the section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Upper,
    Lower,
}

impl Side {
    pub const BOTH: [Self; 2] = [Self::Upper, Self::Lower];

    /// Position of the side in arrays: 0 for the upper side, 1 for the lower side.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The side across the section.
    pub fn other(self) -> Self {
        match self {
            Self::Upper => Self::Lower,
            Self::Lower => Self::Upper,
        }
    }

    /// Sign of the vortex strength and of the signed mass defect on this side.
    pub fn sign(self) -> f64 {
        match self {
            Self::Upper => 1.0,
            Self::Lower => -1.0,
        }
    }

    /// Length of this side from the stagnation point, given by the arc length there, to the trailing edge.
    pub fn length<S: Scalar>(self, stagnation: S, total: S) -> S {
        match self {
            Self::Upper => stagnation,
            Self::Lower => total - stagnation,
        }
    }

    /// Distance along this side from the stagnation point to a place, both given by their arc lengths.
    pub fn distance<S: Scalar>(self, stagnation: S, place: S) -> S {
        match self {
            Self::Upper => stagnation - place,
            Self::Lower => place - stagnation,
        }
    }

    /// Arc length from the first node of the place at a distance from the stagnation point on this side.
    pub fn place<S: Scalar>(self, stagnation: S, distance: S) -> S {
        match self {
            Self::Upper => stagnation - distance,
            Self::Lower => stagnation + distance,
        }
    }
}
