//! Block-banded systems with a border: stations, and the global unknowns that all of them share.
//!
//! Stations are eliminated from the end of the wake to the inlet, as what a flow is at a station follows from what is
//! upstream of it, in supersonic flow from that alone. The other way round pivots inside the [blocks](super::block) of the
//! stations lose all digits in a large region of supersonic flow. Near the speed of sound this order is not good everywhere
//! either, so that an equation without a good pivot is put off to the station upstream. To the unknowns of a station belong
//! the speeds of the interval upstream of it, which the equations along the tubes give.
//!
//! The equations of a station know of one station downstream and one upstream, those along a tube of speeds up to three
//! intervals upstream and of nodes of three stations. The blocks are kept as their transposes, which is the form that the
//! elimination works on row by row: few numbers stand in the coefficients of unknowns in equations farther downstream.

use super::block::{Block, SHARED};
use super::dense::PUT_OFF;
use super::numbering::{GLOBALS, Grid, Place, Unknowns};
use super::rows::Entry;
use super::strips::{Source, Strip, put_strips};
use crate::flow::linear::{Factors, add_scaled};
use nalgebra::DMatrix;
use std::ops::Range;

/// A row of derivatives, by the unknowns of stations and the global ones.
pub(super) trait Columns {
    fn add(&mut self, column: Place, value: f64);
    fn add_global(&mut self, global: usize, value: f64);
}

/// A linearised system: derivatives of the equations of the stations and of the global equations.
#[derive(Debug, Clone)]
pub(super) struct Band {
    pub blocks: Vec<Block>,
    /// Number of unknowns of each station that are not speeds.
    pub kept: Vec<usize>,
    /// Derivatives of the global equations with respect to the global unknowns: a row for each unknown.
    pub corner: DMatrix<f64>,
    /// The corner after elimination.
    pub closing: DMatrix<f64>,
}

impl Band {
    /// Zeros for a grid.
    pub fn new(grid: &Grid) -> Self {
        let corner = DMatrix::zeros(GLOBALS, GLOBALS);
        Self {
            blocks: (0..grid.count()).map(|i| Block::new(grid, i)).collect(),
            kept: (0..grid.count()).map(|i| grid.speeds_start(i)).collect(),
            closing: corner.clone(),
            corner,
        }
    }

    /// Zeros in the memory of this system, for another one on the same grid. Fresh memory costs as much as filling it.
    pub fn cleared(mut self) -> Self {
        self.blocks.iter_mut().for_each(Block::clear);
        self.corner.fill(0.0);
        self
    }

    /// The derivatives of an equation of a station.
    #[inline(always)]
    pub fn equation(&mut self, row: Place) -> Equation<'_> {
        Equation { kept: self.kept[row.station], band: self, row }
    }

    /// The derivatives of a global equation.
    #[inline(always)]
    pub fn global(&mut self, row: usize) -> GlobalEquation<'_> {
        GlobalEquation { band: self, row }
    }

    /// The block of an unknown, and its row there.
    #[inline(always)]
    pub fn home(&self, place: Place) -> (usize, usize) {
        match place.index.checked_sub(self.kept[place.station]) {
            None => (place.station, place.index),
            Some(tube) => (place.station + 1, self.blocks[place.station + 1].layout.tube(tube)),
        }
    }

    /// Factorises the system. Returns `false` where a block is singular or not finite.
    pub fn factorise(&mut self) -> bool {
        self.eliminate(|_, _| {})
    }

    /// Factorises the system, and finds the change that takes residuals of the stations and of the global equations to zero.
    /// The result is `None` where a block is singular or not finite.
    pub fn factorised_step(&mut self, stations: &[Vec<f64>], residual: &[f64]) -> Option<Unknowns> {
        let mut right = RightHandSide::new(self, stations, residual);
        // the factors of a station are at hand when they are made
        if !self.eliminate(|i, block| right.pass_on(i, block)) {
            return None;
        }
        self.solve_upper(right)
    }

    /// The change that takes residuals of the stations and of the global equations to zero, after factorisation.
    pub fn step(&self, stations: &[Vec<f64>], residual: &[f64]) -> Option<Unknowns> {
        let mut right = RightHandSide::new(self, stations, residual);
        for (i, block) in self.blocks.iter().enumerate().rev() {
            right.pass_on(i, block);
        }
        self.solve_upper(right)
    }

    /// Eliminates all stations, and tells of each one that is done.
    fn eliminate(&mut self, mut done_with: impl FnMut(usize, &Block)) -> bool {
        let mut right = Vec::new();
        for i in (0..self.blocks.len()).rev() {
            let (upstream, done) = self.blocks.split_at_mut(i + 1);
            let block = &mut upstream[i];
            block.prepare();
            if let Some(behind) = done.first() {
                block.take_on(behind, &right);
                put_solutions(behind, block);
            }
            if !block.factorise(&mut right) {
                return false;
            }
            done_with(i, block);
        }
        let first = &self.blocks[0];
        let layout = first.layout;
        self.closing.copy_from(&self.corner);
        for g in 0..GLOBALS {
            let row = &first.lower[(layout.globals() + g) * layout.lower_stride()..][..layout.lower_stride()];
            for r in 0..GLOBALS {
                let solved: f64 =
                    (0..layout.kept + first.taken).map(|e| row[e] * first.next_row(e)[layout.border() + r]).sum();
                self.closing[(g, r)] += row[layout.own_stride() + r] - solved;
            }
        }
        true
    }

    /// The change, from right-hand sides from which all equations downstream have been eliminated.
    fn solve_upper(&self, right: RightHandSide) -> Option<Unknowns> {
        let RightHandSide { stations: mut right, globals } = right;
        let count = self.blocks.len();
        let schur = self.closing.transpose();
        let mut solved = DMatrix::from_column_slice(GLOBALS, 1, &globals);
        Factors::new(&schur)?.solve(&mut solved);
        let globals: [f64; GLOBALS] = std::array::from_fn(|g| solved[g]);
        for i in 0..count {
            let (upstream, own) = right.split_at_mut(i);
            self.subtract_upstream(upstream, &globals, &mut own[0]);
            let known = upstream.last().map_or(&[][..], |upstream| &upstream[self.kept[i - 1]..]);
            self.blocks[i].solve(&mut own[0], known);
        }
        let negative = |values: &[f64]| values.iter().map(|v| -v).collect::<Vec<f64>>();
        let station = |i: usize| {
            let mut own = negative(&right[i][..self.kept[i]]);
            if i + 1 < count {
                own.extend(negative(&right[i + 1][self.blocks[i + 1].layout.tube(0)..]));
            }
            own
        };
        Some(Unknowns { stations: (0..count).map(station).collect(), globals: globals.map(|v| -v) })
    }

    /// Subtracts from the right-hand sides of a station what the unknowns upstream and the global ones have to do with them.
    fn subtract_upstream(&self, solved: &[Vec<f64>], globals: &[f64; GLOBALS], own: &mut [f64]) {
        let i = solved.len();
        let block = &self.blocks[i];
        let layout = block.layout;
        let (others, tubes) = own.split_at_mut(layout.tube(0));
        for (g, value) in globals.iter().enumerate() {
            add_scaled(others, -value, block.lower_row(layout.globals() + g));
            add_scaled(tubes, -value, block.global(g));
        }
        let Some(before) = solved.last() else { return };
        for (row, value) in before[..layout.ahead].iter().enumerate() {
            add_scaled(others, -value, block.lower_row(row));
        }
        let mut first = layout.far_rows();
        for (k, far) in layout.far.into_iter().enumerate().filter(|(_, far)| *far > 0) {
            if !block.reaches[k].is_empty() {
                let from = i - 1 - k;
                let speeds = &solved[from][self.blocks[from].layout.tube(0)..];
                for tube in block.reaches[k].clone() {
                    add_scaled(others, -speeds[tube], block.lower_row(first + tube));
                }
            }
            first += far;
        }
        for (k, entries) in block.factors.upstream.iter().enumerate().take(i) {
            for (row, value) in solved[i - 1 - k].iter().enumerate().take(entries.count()) {
                entries.row(row).iter().for_each(|&(tube, factor)| tubes[tube as usize] -= factor * value);
            }
        }
        for (k, factors) in block.speeds.iter().enumerate().take(i - 1) {
            let from = i - 1 - k;
            let speeds = &solved[from][self.blocks[from].layout.tube(0)..];
            tubes.iter_mut().zip(factors.iter().zip(speeds)).for_each(|(value, (f, q))| *value -= f * q);
        }
    }
}

/// The derivatives of one equation of a station.
pub(super) struct Equation<'a> {
    band: &'a mut Band,
    row: Place,
    /// Number of equations of the station that do not belong to tubes.
    kept: usize,
}

impl Columns for Equation<'_> {
    #[inline(always)]
    fn add(&mut self, column: Place, value: f64) {
        let (home, place) = self.band.home(column);
        let Place { station, index } = self.row;
        if index < self.kept {
            let block = &mut self.band.blocks[home.max(station)];
            let layout = block.layout;
            if home >= station {
                if home == station {
                    block.own[place * layout.own_stride() + index] += value;
                } else {
                    block.next[place * layout.next_stride() + index] += value;
                }
            } else {
                block.lower[place * layout.lower_stride() + index] += value;
            }
            return;
        }
        let tube = index - self.kept;
        let block = &mut self.band.blocks[station + 1];
        let is_speed = home != column.station;
        match (station + 1 - home, is_speed) {
            (0, false) => block.by_tube.push(Entry::new(place, tube, value)),
            (0, true) => block.diagonal[tube] += value,
            (k, false) => block.upstream[k - 1].push(Entry::new(place, tube, value)),
            (k, true) => block.speeds[k - 1][tube] += value,
        }
    }

    #[inline(always)]
    fn add_global(&mut self, global: usize, value: f64) {
        let Place { station, index } = self.row;
        if index < self.kept {
            let block = &mut self.band.blocks[station];
            let layout = block.layout;
            block.lower[(layout.globals() + global) * layout.lower_stride() + index] += value;
        } else {
            let block = &mut self.band.blocks[station + 1];
            block.by_globals[global * block.layout.tubes + index - self.kept] += value;
        }
    }
}

/// The derivatives of a global equation.
pub(super) struct GlobalEquation<'a> {
    band: &'a mut Band,
    row: usize,
}

impl Columns for GlobalEquation<'_> {
    #[inline(always)]
    fn add(&mut self, column: Place, value: f64) {
        let (home, place) = self.band.home(column);
        let block = &mut self.band.blocks[home];
        block.next[place * block.layout.next_stride() + block.layout.border() + self.row] += value;
    }

    #[inline(always)]
    fn add_global(&mut self, global: usize, value: f64) {
        self.band.corner[(global, self.row)] += value;
    }
}

/// Right-hand sides of the equations of each block, those along the tubes last, and of the global ones.
struct RightHandSide {
    stations: Vec<Vec<f64>>,
    globals: [f64; GLOBALS],
}

impl RightHandSide {
    fn new(band: &Band, stations: &[Vec<f64>], globals: &[f64]) -> Self {
        let own = |i: usize| -> Vec<f64> {
            let tubes: &[f64] = if i > 0 { &stations[i - 1][band.kept[i - 1]..] } else { &[] };
            [&stations[i][..band.kept[i]], &[0.0; PUT_OFF], tubes].concat()
        };
        Self { stations: (0..stations.len()).map(own).collect(), globals: std::array::from_fn(|g| globals[g]) }
    }

    /// Takes the equations of a factorised station out of those upstream and of the global ones.
    fn pass_on(&mut self, i: usize, block: &Block) {
        let (upstream, own) = self.stations.split_at_mut(i);
        let upstream: &mut [f64] = match upstream.last_mut() {
            Some(upstream) => &mut upstream[..block.layout.ahead + block.put_off()],
            None => &mut [],
        };
        block.pass_on(&own[0], upstream, &mut self.globals);
    }
}

/// The range of two ranges and all between them.
fn both(one: &Range<usize>, other: &Range<usize>) -> Range<usize> {
    match (one.is_empty(), other.is_empty()) {
        (true, _) => other.clone(),
        (_, true) => one.clone(),
        _ => one.start.min(other.start)..one.end.max(other.end),
    }
}

/// Puts the solutions of the station behind into the rows of a station, in the columns of its own equations and in the
/// global ones.
fn put_solutions(behind: &Block, block: &mut Block) {
    let (layout, from) = (block.layout, behind.layout);
    let (own_width, fast) = (block.own_width(), behind.fast());
    // there are no speeds ahead of the inlet
    let there_are = |k: usize, tubes: Range<usize>| if layout.far[k] > 0 { tubes } else { 0..0 };
    block.reaches = [there_are(0, both(&fast, &behind.reaches[1])), there_are(1, fast)];
    let Block { own, next, lower, .. } = block;
    let (shared, border) = (layout.own_stride(), layout.border());
    let solutions = |column| Source { rows: &behind.next, stride: from.next_stride(), from: column };
    let strips = [
        Strip { rows: own, stride: layout.own_stride(), columns: 0..own_width },
        Strip { rows: lower, stride: layout.lower_stride(), columns: 0..own_width },
    ];
    put_strips(behind, layout, strips, solutions(0), None);
    let known = Source { rows: &behind.lower, stride: from.lower_stride(), from: from.own_stride() };
    let strips = [
        Strip { rows: next, stride: layout.next_stride(), columns: border..border + SHARED },
        Strip { rows: lower, stride: layout.lower_stride(), columns: shared..shared + SHARED },
    ];
    put_strips(behind, layout, strips, solutions(from.border()), Some(known));
}

#[cfg(test)]
impl Band {
    /// Adds to the derivative of an equation of a station with respect to an unknown of a station.
    pub fn add(&mut self, row: Place, column: Place, value: f64) {
        self.equation(row).add(column, value);
    }

    /// Adds to the derivative of an equation of a station with respect to a global unknown.
    pub fn add_global(&mut self, row: Place, global: usize, value: f64) {
        self.equation(row).add_global(global, value);
    }

    /// An equation of a station times a change of all unknowns, before factorisation.
    pub fn times(&self, row: Place, change: &Unknowns) -> f64 {
        let (i, r) = (row.station, row.index);
        let Some(tube) = r.checked_sub(self.kept[i]) else {
            let block = &self.blocks[i];
            let of = |block: &Block, row: &dyn Fn(usize) -> f64| -> f64 {
                (0..block.layout.size()).map(|u| row(u) * self.at(change, block, u)).sum()
            };
            let mut sum = of(block, &|u| block.own_row(u)[r]);
            if let Some(next) = self.blocks.get(i + 1) {
                sum += of(next, &|u| next.next_row(u)[r]);
            }
            if i > 0 {
                sum += (0..block.layout.ahead).map(|u| block.lower_row(u)[r] * change.stations[i - 1][u]).sum::<f64>();
            }
            let globals = block.layout.globals();
            return sum + (0..GLOBALS).map(|g| block.lower_row(globals + g)[r] * change.globals[g]).sum::<f64>();
        };
        let block = &self.blocks[i + 1];
        let few = |entries: &[Entry], values: &[f64]| -> f64 {
            entries.iter().filter(|e| e.column as usize == tube).map(|e| e.value * values[e.row as usize]).sum()
        };
        let mut sum = few(&block.by_tube, &change.stations[i + 1]) + few(&block.upstream[0], &change.stations[i]);
        if i > 0 {
            sum += few(&block.upstream[1], &change.stations[i - 1]);
        }
        sum += block.diagonal[tube] * change.stations[i][r];
        for k in 1..=i.min(3) {
            sum += block.speeds[k - 1][tube] * change.stations[i - k][self.kept[i - k] + tube];
        }
        sum + (0..GLOBALS).map(|g| block.global(g)[tube] * change.globals[g]).sum::<f64>()
    }

    /// The change of the unknown of a row of a block.
    fn at(&self, change: &Unknowns, block: &Block, unknown: usize) -> f64 {
        let i = self.blocks.iter().position(|own| std::ptr::eq(own, block)).unwrap();
        match unknown.checked_sub(block.layout.tube(0)) {
            None if unknown >= block.layout.kept => 0.0,
            None => change.stations[i][unknown],
            Some(tube) => change.stations[i - 1][self.kept[i - 1] + tube],
        }
    }

    /// A global equation times a change of all unknowns.
    pub fn times_global(&self, row: usize, change: &Unknowns) -> f64 {
        let of = |block: &Block| -> f64 {
            let column = block.layout.border() + row;
            (0..block.layout.size()).map(|u| block.next_row(u)[column] * self.at(change, block, u)).sum()
        };
        let of_globals: f64 = (0..GLOBALS).map(|g| self.corner[(g, row)] * change.globals[g]).sum();
        self.blocks.iter().map(of).sum::<f64>() + of_globals
    }
}
