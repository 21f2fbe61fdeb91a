//! A flow carried over from one grid to another, as the first guess there.
//!
//! Displacements and speeds are smooth functions of the place along the dividing line and of the stream function on both
//! grids, as the background grid is one function of these. They are interpolated by cubics ahead of the nose, along
//! each side and behind the edge; the layer is interpolated straight, laminar and turbulent stations by themselves.

use super::background::WallStations;
use super::numbering::{GLOBALS, Grid, LAYER, SPEED, Sheet, Unknowns};
use super::system::Problem;
use crate::flow::layer::{Regime, Side};

/// The unknowns of `to` that a flow on the grid of `from` suggests, with the given global unknowns; `None` where the section
/// makes no grid.
pub(super) fn carried_over(
    from: &Problem,
    unknowns: &Unknowns,
    to: &Problem,
    globals: [f64; GLOBALS],
) -> Option<Unknowns> {
    let mut next = Unknowns { globals, ..Unknowns::zeros(&to.grid) };
    let (old, new) = (from.geometry(unknowns)?.wall, to.geometry(&next)?.wall);
    for side in Side::BOTH {
        let places = [places(&from.grid, &old, side), places(&to.grid, &new, side)];
        let carry = Carry { from: &from.grid, unknowns, to: &to.grid, side, places };
        carry.lines(&mut next);
        carry.speeds(&mut next);
        if to.grid.viscous && from.grid.viscous {
            carry.layer(&mut next);
        }
    }
    if to.grid.viscous && from.grid.viscous {
        wake(&from.grid, unknowns, &to.grid, &mut next);
    }
    Some(next)
}

/// Abscissas of all stations along the dividing line of a side: negative ahead of the nose, the arc length on the wall,
/// and on from there behind the edge.
fn places(grid: &Grid, wall: &WallStations<f64>, side: Side) -> Vec<f64> {
    let (nose, edge) = (grid.stations.nose(), grid.stations.edge());
    let arcs = &wall.arcs[side.index()];
    let place = |station: usize| match station {
        _ if station < nose => -wall.ahead[nose - station],
        _ if station <= edge => arcs[station - nose],
        _ => arcs[edge - nose] + grid.stations.behind[station - edge],
    };
    (0..grid.count()).map(place).collect()
}

fn middles(x: &[f64]) -> Vec<f64> {
    x.windows(2).map(|w| 0.5 * (w[0] + w[1])).collect()
}

/// Numbers of up to four neighbours of a place among rising places, and their weights in the polynomial through them.
fn cubic(places: &[f64], at: f64) -> (usize, Vec<f64>) {
    let count = places.len().min(4);
    let above = places.partition_point(|x| *x < at);
    let first = above.saturating_sub(2).min(places.len() - count);
    let nodes = &places[first..first + count];
    let weight =
        |k: usize| (0..count).filter(|&j| j != k).map(|j| (at - nodes[j]) / (nodes[k] - nodes[j])).product::<f64>();
    (first, (0..count).map(weight).collect())
}

/// Number of the lower of two neighbours of a place among rising places, and the share of the upper one, which lies
/// between none and one also outside.
pub(super) fn straight(places: &[f64], at: f64) -> (usize, f64) {
    let k = places.partition_point(|x| *x < at).clamp(1, places.len() - 1);
    (k - 1, ((at - places[k - 1]) / (places[k] - places[k - 1])).clamp(0.0, 1.0))
}

/// Stretches the stream function so that lines are about even.
fn stretched(grid: &Grid) -> Vec<f64> {
    let heights = &grid.stations.heights;
    heights.iter().map(|h| (h + heights[1]).ln()).collect()
}

/// One side of a flow on both grids.
struct Carry<'a> {
    from: &'a Grid,
    unknowns: &'a Unknowns,
    to: &'a Grid,
    side: Side,
    /// Abscissas of the stations of both grids.
    places: [Vec<f64>; 2],
}

impl Carry<'_> {
    /// Calls `work` for the three parts ahead of the nose, on the wall and behind the edge with the first and last
    /// station of each on both grids. The part behind begins `gap` stations behind the edge.
    fn parts(&self, gap: usize, mut work: impl FnMut([usize; 2], [usize; 2])) {
        let parts = |grid: &Grid| {
            let (nose, edge) = (grid.stations.nose(), grid.stations.edge());
            [[0, nose], [nose, edge], [edge + gap, grid.count() - 1]]
        };
        for (old, new) in parts(self.from).into_iter().zip(parts(self.to)) {
            work(old, new);
        }
    }

    fn lines(&self, next: &mut Unknowns) {
        let (old, new) = (stretched(self.from), stretched(self.to));
        // at the edge the layers of the sides carry the lines, behind it the wake, and displacements jump
        self.parts(1, |[first, last], [start, end]| {
            for station in start..=end {
                let (k, along) = cubic(&self.places[0][first..=last], self.places[1][station]);
                for height in 0..new.len() {
                    if height == 0 && self.to.on_wall(station) {
                        continue;
                    }
                    let (h, across) = cubic(&old, new[height]);
                    let value = |k: usize, h: usize| {
                        self.unknowns.at(self.from.displacement(first + k, self.from.line(self.side, h)))
                    };
                    let place = self.to.displacement(station, self.to.line(self.side, height));
                    next.set(place, weighted((k, &along), (h, &across), value));
                }
            }
        });
    }

    fn speeds(&self, next: &mut Unknowns) {
        let [old, new] = [self.from, self.to].map(|grid| middles(&stretched(grid)));
        let tube = |grid: &Grid, height: usize| match self.side {
            Side::Upper => grid.half() + height,
            Side::Lower => grid.half() - 1 - height,
        };
        let [from, to] = [0, 1].map(|k| middles(&self.places[k]));
        self.parts(0, |[first, last], [start, end]| {
            for station in start..end {
                let (k, along) = cubic(&from[first..last], to[station]);
                for height in 0..new.len() {
                    let (h, across) = cubic(&old, new[height]);
                    let value =
                        |k: usize, h: usize| self.unknowns.at(self.from.speed(first + k, tube(self.from, h))).ln();
                    let speed = weighted((k, &along), (h, &across), value).exp();
                    next.set(self.to.speed(station, tube(self.to, height)), speed);
                }
            }
        });
    }

    fn layer(&self, next: &mut Unknowns) {
        let sheet = Sheet::Wall(self.side);
        let walls = |grid: &Grid| grid.stations.nose() + 1..=grid.stations.edge();
        let all: Vec<usize> = walls(self.from).collect();
        let of = |laminar: bool| -> Vec<usize> {
            let is = |i: &usize| (self.from.regime(*i, sheet) == Regime::Laminar) == laminar;
            all.iter().copied().filter(is).collect()
        };
        let (laminar, turbulent) = (of(true), of(false));
        // from the stagnation point on the layer goes with the logarithm of the arc length
        let logs = |stations: &[usize]| stations.iter().map(|&i| self.places[0][i].ln()).collect::<Vec<f64>>();
        let (log_all, log_laminar, log_turbulent) = (logs(&all), logs(&laminar), logs(&turbulent));
        for station in walls(self.to) {
            let at = self.places[1][station].ln();
            let of_regime = match self.to.regime(station, sheet) {
                Regime::Laminar => (&laminar, &log_laminar),
                _ => (&turbulent, &log_turbulent),
            };
            for q in 0..LAYER {
                // thickness and speed are continuous at transition
                let (stations, places) = if q == 0 || q == SPEED { (&all, &log_all) } else { of_regime };
                let (k, share) = straight(places, at);
                let [a, b] = [0, 1].map(|j| self.unknowns.layer(self.from, stations[k + j], sheet)[q]);
                // the speed rises from the stagnation point as the arc length does
                let ahead = if q == SPEED { (at - places[0]).min(0.0) } else { 0.0 };
                next.set(self.to.layer(station, sheet, q), a + share * (b - a) + ahead);
            }
        }
    }
}

/// The weighted sum of values over stations and lines.
fn weighted((k, along): (usize, &[f64]), (h, across): (usize, &[f64]), value: impl Fn(usize, usize) -> f64) -> f64 {
    let row = |i: usize| across.iter().enumerate().map(|(j, w)| w * value(k + i, h + j)).sum::<f64>();
    along.iter().enumerate().map(|(i, w)| w * row(i)).sum()
}

fn wake(from: &Grid, unknowns: &Unknowns, to: &Grid, next: &mut Unknowns) {
    let edge = from.stations.edge();
    for station in to.stations.edge()..to.count() {
        let (k, share) = straight(&from.stations.behind, to.stations.behind[station - to.stations.edge()]);
        let [a, b] = [0, 1].map(|j| unknowns.layer(from, edge + k + j, Sheet::Wake));
        for q in 0..LAYER {
            next.set(to.layer(station, Sheet::Wake, q), a[q] + share * (b[q] - a[q]));
        }
    }
}
