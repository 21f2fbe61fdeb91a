//! Squares of distances, and how they change with the points they are measured between.

use crate::plane::{cross, dot, length};
use crate::scalar::{Over, Scalar};
use num_dual::DualSVec64;

/// The kernel that everything here differentiates.
pub(super) fn weighted_square<S, T: Over<S>>(distance: [T; 2], weight: S) -> T {
    dot(distance, distance) * weight
}

/// A distance along the normal of a direction, positive to its left.
pub(super) fn signed_distance<T: Scalar>(away: [T; 2], direction: [T; 2]) -> T {
    cross(direction, away) / length(direction)
}

/// A weighted square with its derivative in the two components of the distance.
pub(super) struct WeightedSquare {
    pub value: f64,
    slope: [f64; 2],
}

impl WeightedSquare {
    pub fn at(distance: [f64; 2], weight: f64) -> Self {
        let seeded: [DualSVec64<2>; 2] = std::array::from_fn(|d| DualSVec64::from_re(distance[d]).derivative(d));
        let square = weighted_square(seeded, weight);
        Self { value: square.re, slope: square.eps.0.map_or([0.0; 2], |slope| [slope[0], slope[1]]) }
    }

    /// Carries the slope back to the control points that the distance is made of, by their weights.
    pub fn add_slope(&self, factor: f64, basis: &[f64], gradient: &mut [[f64; 2]]) {
        let slope = self.slope.map(|s| s * factor);
        for (weight, point) in basis.iter().zip(gradient) {
            point[0] += slope[0] * weight;
            point[1] += slope[1] * weight;
        }
    }
}
