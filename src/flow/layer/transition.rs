//! The place of transition: where the amplification factor reaches the critical value, or at the trip or shortly ahead
//! of the trailing edge if that comes first.

use super::closure::{larger, smaller};
use crate::scalar::Scalar;

/// Rounding of the corner of the complementarity condition, in fractions of the side's length and of the critical
/// amplification.
const ROUNDING: f64 = 5e-3;
/// Distances from the corner over which the rounding fades, in fractions of the side's length and of the critical
/// amplification. Far from the corner no rounding is wanted: transition far ahead of the limit stands where
/// amplification is critical, and a layer far from critical turns turbulent at the limit.
const FADING: [f64; 2] = [0.05, 0.33];
/// Distance ahead of the trailing edge at which a free layer turns turbulent at the latest, as a fraction of the side's
/// length.
///
/// A layer that is laminar up to the edge should stay so. It is thick there, and takes more lift away if it turns
/// turbulent early: lift grows by up to 0.03 as this value falls from 0.008 to 0.0005. In XFOIL the layer turns at the
/// edge itself. A smaller value changes lift little, and stations that stand closer leave more round-off: residuals
/// stall at 1e-10 with 2e-5, and at 3e-12 with this value.
const TURBULENT_REST: f64 = 5e-4;
/// Earliest place at which a trip acts, as a fraction of the side's length.
const EARLIEST: f64 = 4e-3;
/// Earliest transition of a start by marching, as a fraction of the side's length.
const EARLIEST_MARCHED: f64 = 3e-3;
/// Distances that Newton's method keeps between transition and the two ends of the side, as fractions of the side's
/// length, so that stations can be laid.
const MARGINS: [f64; 2] = [1e-3, 1e-5];

/// The place `x`, moved to the nearest one where Newton's method may put transition on a side of the given length.
pub(crate) fn kept_inside(x: f64, length: f64) -> f64 {
    x.clamp(MARGINS[0] * length, (1.0 - MARGINS[1]) * length)
}

/// Whether stations can be laid on a side of the given length for transition at `x`.
pub(crate) fn is_inside(x: f64, length: f64) -> bool {
    x > MARGINS[0] * length && x < (1.0 - MARGINS[1]) * length
}

/// Latest transition for a march: the trip, given by the distance from the stagnation point, or shortly ahead of the
/// edge.
pub(super) fn latest(trip: Option<f64>, length: f64) -> f64 {
    trip.unwrap_or(length).clamp(EARLIEST * length, (1.0 - TURBULENT_REST) * length)
}

/// Transition of a start by marching, from the place where amplification becomes critical and the latest place.
pub(super) fn of_march(critical: f64, latest: f64, length: f64) -> f64 {
    critical.clamp(EARLIEST_MARCHED * length, latest)
}

/// Residual of the transition point of one side.
///
/// The condition "x ≤ limit and n ≤ critical, with equality in one of them" is written in Fischer-Burmeister form and
/// rounded at the corner. `x` is the distance of transition from the stagnation point, `length` the length of the side,
/// `trip` the distance of the trip from the stagnation point, `n` the amplification factor at the last laminar station.
pub(crate) fn residual<S: Scalar>(x: S, length: S, trip: Option<S>, n: S, critical: f64) -> S {
    let free = length * (1.0 - TURBULENT_REST);
    let limit = match trip {
        Some(trip) => {
            let behind = larger(trip / length, S::from(EARLIEST), 5e-4);
            length * smaller(behind, S::from(1.0 - TURBULENT_REST), 1e-4)
        }
        None => free,
    };
    let a = (limit - x) / length;
    let b = -n / critical + 1.0;
    let squares = a * a + b * b;
    let fading = (-(a / FADING[0]).powi(2) - (b / FADING[1]).powi(2)).exp();
    a + b - (squares + fading * (2.0 * ROUNDING * ROUNDING)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_of_the_two_conditions_holds() {
        // free transition half way: n is critical; tripped: x is the trip
        assert!(residual(0.5f64, 1.0, None, 9.0, 9.0).abs() < 3e-6);
        assert!(residual(0.05f64, 1.0, Some(0.05), 1.0, 9.0).abs() < 3e-6);
        assert!(residual(0.5f64, 1.0, None, 8.0, 9.0) > 0.05);
        assert!(residual(0.5f64, 1.0, None, 10.0, 9.0) < -0.05);
        assert!(residual(0.07f64, 1.0, Some(0.05), 1.0, 9.0) < -0.01);
    }
}
