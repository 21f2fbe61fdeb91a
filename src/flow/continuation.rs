//! Conditions close to the one wanted, at which the flow is easier to find.

use super::analysis::Case;
use super::coupled::layout::Layout;
use super::coupled::newton;
use super::coupled::response::FlowResponse;
use super::coupled::system::System;
use super::coupled::unknowns::Unknowns;
use super::ladder::{DIRECT, Ladder, PATIENCE, TOLERANCE};

/// Such a condition.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Angle of attack less that wanted, in degrees.
    pub turned: f64,
    /// Temporary trips, over the lengths of the sides.
    pub trips: f64,
}

impl Default for Place {
    /// The condition wanted.
    fn default() -> Self {
        Self { turned: 0.0, trips: 1.0 }
    }
}

impl Ladder<'_> {
    /// A solution at a place, by the direct way.
    pub(super) fn start_of_branch(&mut self, layout: &Layout, place: Place, what: &str) -> Option<Unknowns> {
        let flow = self.turned(place.turned);
        let case = self.case;
        let trips = temporary(case, self.stagnation, place.trips);
        let system = System { trips, ..case.system(&flow, &case.condition, layout) };
        let end = newton::solve_patiently(&system, system.march(&system.start()), TOLERANCE, DIRECT, PATIENCE);
        self.note(what, &end);
        end.converged.then_some(end.unknowns)
    }

    /// The onset flow at another angle of attack, the wake staying where it is.
    pub(super) fn turned(&self, degrees: f64) -> FlowResponse {
        let mut flow = self.flow.clone();
        flow.turn(flow.onset(&self.case.section.response, self.flow.alpha + degrees.to_radians()));
        flow
    }
}

/// Arc lengths of trips a fraction of each side behind the stagnation point; the case's own where those come first.
pub(super) fn temporary(case: &Case, stagnation: f64, fraction: f64) -> [Option<f64>; 2] {
    let own = case.trip_arcs();
    if fraction >= 1.0 {
        return own;
    }
    let total = case.section.response.map.total;
    let place = |own: Option<f64>, length: f64, sign: f64| match own {
        Some(own) if (own - stagnation).abs() < fraction * length => Some(own),
        _ => Some(stagnation - sign * fraction * length),
    };
    [place(own[0], stagnation, 1.0), place(own[1], total - stagnation, -1.0)]
}
