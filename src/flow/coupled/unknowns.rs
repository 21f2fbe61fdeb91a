//! The unknowns of the coupled system and their numbering.

use super::layout::Layout;
use crate::flow::boundary_layer::station::{Regime, State};

/// One of the two sides of the section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Upper,
    Lower,
}

impl Side {
    pub const BOTH: [Self; 2] = [Self::Upper, Self::Lower];

    pub fn index(self) -> usize {
        self as usize
    }

    /// Sign of the vortex strength, and of the signed mass defect, on this side.
    pub fn sign(self) -> f64 {
        match self {
            Self::Upper => 1.0,
            Self::Lower => -1.0,
        }
    }
}

/// All unknowns: stations of the upper side (from the stagnation point on), of the lower side, of the wake; the arc
/// length of the stagnation point; the arc lengths from there to transition.
///
/// Stations stand at fixed fractions, so that a solution is a start for any neighbouring section and condition.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Unknowns {
    pub stations: Vec<State<f64>>,
    pub stagnation: f64,
    pub transition: [f64; 2],
}

/// Numbering of stations and of the points along the surface (upper edge → stagnation → lower edge).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbering {
    pub side: usize,
    pub laminar: usize,
    pub wake: usize,
}

impl Numbering {
    pub fn new(layout: &Layout) -> Self {
        Self { side: layout.side(), laminar: layout.laminar.len(), wake: layout.wake }
    }

    pub fn stations(&self) -> usize {
        2 * self.side + self.wake
    }

    pub fn points(&self) -> usize {
        2 * self.side + 1
    }

    /// Station `j` of a side.
    pub fn station(&self, side: Side, j: usize) -> usize {
        side.index() * self.side + j
    }

    /// First station of the wake.
    pub fn wake_start(&self) -> usize {
        2 * self.side
    }

    /// Point of station `j` of a side; the stagnation point is point `side`.
    pub fn point(&self, side: Side, j: usize) -> usize {
        match side {
            Side::Upper => self.side - 1 - j,
            Side::Lower => self.side + 1 + j,
        }
    }

    /// Side and number on that side of a station; `None` in the wake.
    pub fn on_side(&self, station: usize) -> Option<(Side, usize)> {
        if station < self.side {
            Some((Side::Upper, station))
        } else if station < 2 * self.side {
            Some((Side::Lower, station - self.side))
        } else {
            None
        }
    }

    pub fn regime(&self, station: usize) -> Regime {
        match self.on_side(station) {
            None => Regime::Wake,
            Some((_, j)) if j < self.laminar => Regime::Laminar,
            Some(_) => Regime::Turbulent,
        }
    }
}
