//! Conditions close to the one wanted, at which the flow is easier to find.

use super::family::Family;
use crate::flow::layer::Side;

/// A condition close to the one wanted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbour {
    /// Angle of attack less that wanted, in degrees.
    pub turned: f64,
    /// Temporary trips, over the lengths of the sides.
    pub trips: f64,
}

impl Default for Neighbour {
    /// The condition wanted.
    fn default() -> Self {
        Self { turned: 0.0, trips: 1.0 }
    }
}

/// Arc lengths of trips a fraction of each side behind the stagnation point; the trips that are wanted where those come
/// first.
pub(super) fn temporary_trips(family: &impl Family, fraction: f64) -> [Option<f64>; 2] {
    let wanted = family.trips();
    if fraction >= 1.0 {
        return wanted;
    }
    let stagnation = family.stagnation();
    Side::BOTH.map(|side| {
        let distance = fraction * side.length(stagnation, family.total());
        match wanted[side.index()] {
            Some(own) if (own - stagnation).abs() < distance => Some(own),
            _ => Some(side.place(stagnation, distance)),
        }
    })
}
