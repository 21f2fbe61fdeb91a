//! The unknowns of the coupled system and their numbering.

use super::layout::Layout;
use super::side::Side;
use super::station::{Regime, State};
use crate::differentiate::Tangent;
use crate::flow::surface::SurfaceMap;

/// Number of global directions of derivatives: the arc length of the stagnation point from the first node, the arc
/// lengths from there to transition on the upper and on the lower side, and the total arc length of the surface. The
/// last is constant during a solution and an input of the derivatives of a solution.
pub(crate) const GLOBALS: usize = 4;
/// A number with derivatives in the global directions.
pub(crate) type ByGlobal = Tangent<GLOBALS>;
/// Global direction of the arc length of the stagnation point.
pub(crate) const STAGNATION: usize = 0;
/// Global directions of the arc lengths to transition on the upper and on the lower side.
pub(crate) const TRANSITION: [usize; 2] = [1, 2];
/// Global direction of the total arc length.
pub(crate) const TOTAL: usize = 3;
/// Number of global directions that are unknowns of the system; they come first.
pub(crate) const GLOBAL_UNKNOWNS: usize = 3;

/// All unknowns of the coupled system.
///
/// Stations stand at fixed fractions, so that a solution is a start for any neighbouring section and condition.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unknowns {
    /// States of the stations: the upper side from the stagnation point on, then the lower side, then the wake.
    pub stations: Vec<State>,
    /// Arc length of the stagnation point from the first node, in chords.
    pub stagnation: f64,
    /// Arc lengths from the stagnation point to transition on the upper and on the lower side, in chords.
    pub transition: [f64; 2],
}

/// A change of all unknowns, or the derivatives of something with respect to them.
pub(crate) type Change = Unknowns;

impl Unknowns {
    /// Unknowns from the states of the stations and the numbers in the global directions.
    pub fn new(stations: Vec<State>, globals: [f64; GLOBAL_UNKNOWNS]) -> Self {
        let [stagnation, upper, lower] = globals;
        Self { stations, stagnation, transition: [upper, lower] }
    }

    /// Zeros for a number of stations, to collect a change or derivatives in.
    pub fn zeros(stations: usize) -> Self {
        Self::new(vec![State::zeros(); stations], [0.0; GLOBAL_UNKNOWNS])
    }

    /// The numbers in the global directions.
    pub fn globals(&self) -> [f64; GLOBAL_UNKNOWNS] {
        [self.stagnation, self.transition[0], self.transition[1]]
    }

    /// Length of a side, from the total arc length of the surface.
    pub fn side_length(&self, side: Side, total: f64) -> f64 {
        side.length(self.stagnation, total)
    }

    /// Arc lengths of the stations of a side from the stagnation point.
    pub fn abscissas(&self, layout: &Layout, side: Side, surface: &SurfaceMap) -> Vec<f64> {
        layout.abscissas(surface, side, [self.stagnation, self.transition[side.index()]])
    }

    /// Adds `factor` times a change.
    pub fn add(&mut self, change: &Change, factor: f64) {
        for (state, change) in self.stations.iter_mut().zip(&change.stations) {
            *state = state.step(change, factor);
        }
        self.stagnation += factor * change.stagnation;
        for (x, change) in self.transition.iter_mut().zip(change.transition) {
            *x += factor * change;
        }
    }

    /// Multiplies all numbers by a factor.
    pub fn stretch(&mut self, factor: f64) {
        for state in &mut self.stations {
            *state = state.map(|v| v * factor);
        }
        self.stagnation *= factor;
        self.transition = self.transition.map(|v| v * factor);
    }

    /// Scalar product of all numbers, without weights.
    pub fn dot(&self, other: &Self) -> f64 {
        let stations: f64 = self.stations.iter().zip(&other.stations).map(|(a, b)| a.dot(b)).sum();
        self.globals().iter().zip(other.globals()).fold(stations, |sum, (a, b)| sum + a * b)
    }

    pub fn is_finite(&self) -> bool {
        self.globals().iter().all(|v| v.is_finite()) && self.stations.iter().all(State::is_finite)
    }
}

/// Numbering of the stations, and of the points along the surface from the upper edge over the stagnation point to the
/// lower edge.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbering {
    /// Number of stations on one side.
    pub side: usize,
    /// Number of laminar stations on one side.
    pub laminar: usize,
    /// Number of stations in the wake.
    pub wake: usize,
}

impl Numbering {
    pub fn new(layout: &Layout) -> Self {
        Self { side: layout.side(), laminar: layout.laminar.len(), wake: layout.wake }
    }

    /// Number of all stations.
    pub fn stations(&self) -> usize {
        2 * self.side + self.wake
    }

    /// Number of points along the surface.
    pub fn points(&self) -> usize {
        2 * self.side + 1
    }

    /// Number of the station that is the `j`-th of a side, from the stagnation point on.
    pub fn station(&self, side: Side, j: usize) -> usize {
        side.index() * self.side + j
    }

    /// Number of the last laminar station of a side.
    pub fn last_laminar(&self, side: Side) -> usize {
        self.station(side, self.laminar - 1)
    }

    /// Numbers of the last stations of both sides.
    pub fn ends(&self) -> [usize; 2] {
        Side::BOTH.map(|side| self.station(side, self.side - 1))
    }

    /// Number of the first station of the wake.
    pub fn wake_start(&self) -> usize {
        2 * self.side
    }

    /// Number of the point of station `j` of a side. The stagnation point has the number `side`.
    pub fn point(&self, side: Side, j: usize) -> usize {
        match side {
            Side::Upper => self.side - 1 - j,
            Side::Lower => self.side + 1 + j,
        }
    }

    /// Side of a station and the position on that side; `None` in the wake.
    pub fn on_side(&self, station: usize) -> Option<(Side, usize)> {
        if station < self.side {
            Some((Side::Upper, station))
        } else if station < 2 * self.side {
            Some((Side::Lower, station - self.side))
        } else {
            None
        }
    }

    /// Kind of flow at a station.
    pub fn regime(&self, station: usize) -> Regime {
        match self.on_side(station) {
            None => Regime::Wake,
            Some((_, j)) if j < self.laminar => Regime::Laminar,
            Some(_) => Regime::Turbulent,
        }
    }
}
