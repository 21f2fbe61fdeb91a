//! Stations, lines and tubes, and where their unknowns stand.
//!
//! Stations run from far upstream over the nose to the trailing edge and down the wake. Lines run from the lower to the
//! upper edge of the domain, and the dividing line counts twice: once as the upper edge of the lower flow, once as the
//! lower edge of the upper flow. The unknowns of a station are the displacements of the lines, the states of the
//! boundary layer, and the speeds of the tubes between this station and the next.

use super::grading::Stations;
use crate::flow::layer::{Regime, Side};

/// Number of unknowns of a station of the boundary layer.
pub(super) const LAYER: usize = 4;
/// Place of the logarithm of the speed among the unknowns of a station of the layer.
pub(super) const SPEED: usize = 3;

/// Number of global unknowns.
pub(super) const GLOBALS: usize = 8;
/// Global unknown: circulation, clockwise.
pub(super) const CIRCULATION: usize = 0;
/// Global unknowns: strengths of the doublets along and across the onset flow.
pub(super) const DOUBLETS: [usize; 2] = [1, 2];
/// Global unknown: strength of the source that stands for the displacement of the wake.
pub(super) const SOURCE: usize = 3;
/// Global unknown: arc length of the stagnation point from the first node.
pub(super) const STAGNATION: usize = 4;
/// Global unknown: angle of attack against the chord line.
pub(super) const ALPHA: usize = 5;
/// Global unknowns: arc lengths from the stagnation point to transition on the upper and the lower side.
pub(super) const TRANSITION: [usize; 2] = [6, 7];

/// An unknown or an equation of a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub station: usize,
    pub index: usize,
}

/// A set of states of the layer at a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sheet {
    /// The layer on a side of the wall.
    Wall(Side),
    /// The wake, which begins at the trailing edge beside both layers of the wall.
    Wake,
}

/// Numbers of stations, lines and tubes of a grid, with or without boundary layer.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    pub stations: Stations,
    pub viscous: bool,
}

impl Grid {
    /// Number of stations.
    pub fn count(&self) -> usize {
        self.stations.count()
    }

    /// Number of tubes on one side of the dividing line.
    pub fn half(&self) -> usize {
        self.stations.heights.len() - 1
    }

    /// Number of lines, with the dividing line twice.
    pub fn lines(&self) -> usize {
        2 * self.half() + 2
    }

    /// Number of tubes.
    pub fn tubes(&self) -> usize {
        2 * self.half()
    }

    /// Number of displacements of a station.
    pub fn displacements(&self) -> usize {
        2 * self.half() + 1
    }

    /// Whether a station stands on the wall; the nose and the trailing edge do.
    pub fn on_wall(&self, station: usize) -> bool {
        (self.stations.nose()..=self.stations.edge()).contains(&station)
    }

    /// The line on the lower side of a tube; that on the upper side is the next one.
    pub fn lower_line(&self, tube: usize) -> usize {
        if tube < self.half() { tube } else { tube + 1 }
    }

    /// The line at `height` lines from the dividing line on a side.
    pub fn line(&self, side: Side, height: usize) -> usize {
        match side {
            Side::Upper => self.half() + 1 + height,
            Side::Lower => self.half() - height,
        }
    }

    /// The tube next to the dividing line on a side.
    pub fn inner_tube(&self, side: Side) -> usize {
        match side {
            Side::Upper => self.half(),
            Side::Lower => self.half() - 1,
        }
    }

    /// Side of a line and its number of lines from the dividing line.
    pub fn side_of(&self, line: usize) -> (Side, usize) {
        if line > self.half() { (Side::Upper, line - self.half() - 1) } else { (Side::Lower, self.half() - line) }
    }

    /// The displacement of a line at a station; both copies of the dividing line share one.
    pub fn displacement(&self, station: usize, line: usize) -> Place {
        Place { station, index: if line > self.half() { line - 1 } else { line } }
    }

    /// Mass flow of a tube.
    pub fn mass(&self, tube: usize) -> f64 {
        let (_, height) = self.side_of(self.lower_line(tube));
        let (low, high) = if tube >= self.half() { (height, height + 1) } else { (height - 1, height) };
        self.stations.heights[high] - self.stations.heights[low]
    }

    /// Stream function in the middle of a tube, as distance from the dividing line.
    pub fn height(&self, tube: usize) -> f64 {
        let (_, height) = self.side_of(self.lower_line(tube));
        let (low, high) = if tube >= self.half() { (height, height + 1) } else { (height - 1, height) };
        0.5 * (self.stations.heights[high] + self.stations.heights[low])
    }

    /// Number of unknowns of the layer at a station.
    pub fn layer_unknowns(&self, station: usize) -> usize {
        let (nose, edge) = (self.stations.nose(), self.stations.edge());
        let sheets = match station {
            _ if !self.viscous || station <= nose => 0,
            _ if station < edge => 2,
            _ if station == edge => 3,
            _ => 1,
        };
        LAYER * sheets
    }

    /// Index of the first speed of a station, which is the number of the other unknowns.
    pub fn speeds_start(&self, station: usize) -> usize {
        self.displacements() + self.layer_unknowns(station)
    }

    /// Number of unknowns of a station.
    pub fn unknowns(&self, station: usize) -> usize {
        self.speeds_start(station) + if station + 1 < self.count() { self.tubes() } else { 0 }
    }

    /// The speed of a tube between a station and the next.
    pub fn speed(&self, station: usize, tube: usize) -> Place {
        Place { station, index: self.speeds_start(station) + tube }
    }

    /// Unknown `k` of a sheet of the layer at a station.
    pub fn layer(&self, station: usize, sheet: Sheet, k: usize) -> Place {
        let before = match sheet {
            Sheet::Wall(side) => side.index(),
            Sheet::Wake if station == self.stations.edge() => 2,
            Sheet::Wake => 0,
        };
        Place { station, index: self.displacements() + LAYER * before + k }
    }

    /// The sheets of the layer at a station.
    pub fn sheets(&self, station: usize) -> impl Iterator<Item = Sheet> + use<> {
        let count = self.layer_unknowns(station) / LAYER;
        let all = [Sheet::Wall(Side::Upper), Sheet::Wall(Side::Lower), Sheet::Wake];
        let range = if count == 1 { 2..3 } else { 0..count };
        all.into_iter().skip(range.start).take(range.len())
    }

    /// The sheet of the layer that displaces the lines of a side at a station.
    pub fn carrier(&self, station: usize, side: Side) -> Option<Sheet> {
        match station {
            _ if self.layer_unknowns(station) == 0 => None,
            _ if station <= self.stations.edge() => Some(Sheet::Wall(side)),
            _ => Some(Sheet::Wake),
        }
    }

    /// Kind of flow of a sheet at a station.
    pub fn regime(&self, station: usize, sheet: Sheet) -> Regime {
        match sheet {
            Sheet::Wake => Regime::Wake,
            Sheet::Wall(side) if station - self.stations.nose() > self.stations.turning[side.index()] => {
                Regime::Turbulent
            }
            Sheet::Wall(_) => Regime::Laminar,
        }
    }
}

/// All unknowns of a flow.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unknowns<S = f64> {
    /// The unknowns of each station.
    pub stations: Vec<Vec<S>>,
    pub globals: [S; GLOBALS],
}

impl<S: Copy> Unknowns<S> {
    pub fn at(&self, place: Place) -> S {
        self.stations[place.station][place.index]
    }

    /// The unknowns of a sheet of the layer at a station.
    pub fn layer(&self, grid: &Grid, station: usize, sheet: Sheet) -> [S; LAYER] {
        std::array::from_fn(|k| self.at(grid.layer(station, sheet, k)))
    }
}

impl Unknowns {
    pub fn zeros(grid: &Grid) -> Self {
        Self { stations: (0..grid.count()).map(|i| vec![0.0; grid.unknowns(i)]).collect(), globals: [0.0; GLOBALS] }
    }

    pub fn set(&mut self, place: Place, value: f64) {
        self.stations[place.station][place.index] = value;
    }

    /// The unknowns after `factor` times a change.
    pub fn stepped(&self, change: &Self, factor: f64) -> Self {
        let step = |own: &Vec<f64>, change: &Vec<f64>| own.iter().zip(change).map(|(a, b)| a + factor * b).collect();
        Self {
            stations: self.stations.iter().zip(&change.stations).map(|(a, b)| step(a, b)).collect(),
            globals: std::array::from_fn(|g| self.globals[g] + factor * change.globals[g]),
        }
    }

    /// The scalar product with another list of all unknowns.
    pub fn product(&self, other: &Self) -> f64 {
        let stations = self.stations.iter().flatten().zip(other.stations.iter().flatten());
        stations.chain(self.globals.iter().zip(&other.globals)).map(|(a, b)| a * b).sum()
    }

    /// The largest magnitude; NaN where there is one.
    pub fn largest(&self) -> f64 {
        let all = self.stations.iter().flatten().chain(&self.globals);
        all.fold(0.0, |worst: f64, v| {
            if v.is_nan() {
                f64::NAN
            } else if worst.is_nan() {
                worst
            } else {
                worst.max(v.abs())
            }
        })
    }
}
