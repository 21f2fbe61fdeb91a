//! Conditions close to the requested one at which the flow is easier to find.

use super::family::Family;
use crate::flow::layer::Side;

/// A condition close to the requested one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Neighbour {
    /// Angle of attack less the requested one, in degrees.
    pub turned: f64,
    /// Distance of temporary trips from the stagnation point over the lengths of the sides; 1 stands for no temporary
    /// trip.
    pub trips: f64,
}

impl Default for Neighbour {
    /// The requested condition.
    fn default() -> Self {
        Self { turned: 0.0, trips: 1.0 }
    }
}

/// Arc lengths of the trips on the upper and lower side when temporary trips stand at a fraction of each side behind
/// the stagnation point. A requested trip that comes earlier stays.
pub(super) fn temporary_trips(family: &impl Family, fraction: f64) -> [Option<f64>; 2] {
    let wanted = family.trips();
    if fraction >= 1.0 {
        return wanted;
    }
    let stagnation = family.stagnation();
    Side::BOTH.map(|side| {
        let distance = fraction * side.length(stagnation, family.surface().total);
        match wanted[side.index()] {
            Some(own) if (own - stagnation).abs() < distance => Some(own),
            _ => Some(side.place(stagnation, distance)),
        }
    })
}
