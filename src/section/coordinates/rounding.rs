//! Points that are rounded more coarsely than they are spaced.
//!
//! Rounding moves a point by up to half a unit of its last digit, which turns the polygon there by about the unit over
//! the spacing. Where that is more than the outline itself turns, a curve through the points wiggles, and curvature is
//! noise. A curve within the rounding of all points is as true to them.

use super::curve::{Fit, Plan, turn};
use super::deviation::deviation;
use crate::plane::distance;

/// Turns by rounding above this (radians) are looked at.
const NOISE: f64 = 0.05;
/// Share of the points at which rounding must exceed the turn of the outline.
const SHARE: f64 = 0.02;
/// Fewest such points.
const FEWEST: usize = 6;
/// Largest distances of points from the curve, in units of the last digit; half a unit in x and in y is 0.71.
const DISTANCES: [f64; 3] = [0.75, 1.0, 1.5];

/// The tolerance within which points with digits down to `step` are smoothed; `None` where they need not be.
pub(super) fn rounding_fit(plan: &Plan, points: &[[f64; 2]], step: f64) -> Option<f64> {
    if !(step > 0.0) || !is_coarse(points, step) {
        return None;
    }
    DISTANCES.into_iter().map(|share| share * step).find(|&tolerance| {
        let smooth = Plan { fit: Fit::Tolerance(tolerance), ..plan.clone() };
        let curve = smooth.curve(points);
        curve.is_ok_and(|curve| {
            2 * curve.control_points().len() < points.len()
                && deviation(&smooth, points, &curve).points <= tolerance * (1.0 + 1e-9)
        })
    })
}

/// Whether rounding turns the polygon by more than the outline does at many points.
fn is_coarse(points: &[[f64; 2]], step: f64) -> bool {
    let n = points.len();
    let noise = |i: usize| {
        let (before, behind) = (distance(points[i - 1], points[i]), distance(points[i], points[i + 1]));
        step * (1.0 / before + 1.0 / behind)
    };
    // the outline turns as the polygon does over several points
    const REACH: usize = 6;
    let shape = |i: usize| {
        let (low, high) = (i.saturating_sub(REACH).max(1), (i + REACH).min(n - 2));
        let sum: f64 = (low..=high).map(|j| signed_turn(points, j)).sum();
        sum.abs() / (high - low + 1) as f64
    };
    let coarse = (1..n - 1).filter(|&i| {
        let noise = noise(i);
        noise > NOISE && noise > 2.0 * shape(i)
    });
    let count = coarse.count();
    count >= FEWEST && count as f64 > SHARE * n as f64
}

/// Angle by which the polygon turns at a point, counter-clockwise positive.
pub(super) fn signed_turn(points: &[[f64; 2]], i: usize) -> f64 {
    let cross = crate::plane::cross(
        crate::plane::minus(points[i], points[i - 1]),
        crate::plane::minus(points[i + 1], points[i]),
    );
    turn(points, i).copysign(cross)
}
