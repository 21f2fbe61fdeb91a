//! Block-banded systems with a border: stations, and the global unknowns that all of them share.
//!
//! A station is linked to the next one by displacements and the layer, and to three stations upstream; of those farther
//! than one the equations of the speeds alone know, and only the speed of the same tube. Factorisation goes from upstream to
//! downstream with pivots inside the [blocks](super::block) of the stations; the border is eliminated by its Schur complement.
//!
//! The two speeds farther upstream count where the flow is supersonic, or nearly so. There they are put into the equations
//! from the solutions of these stations: an unknown of a station upstream is its solution less what the station behind it
//! has to do with it.

use super::block::{BORDER, Block, Columns, Equation, RESIDUAL};
use super::numbering::{GLOBALS, Grid, Place, Unknowns};
use super::rows::{Combination, FewCombined, padded, subtract_row};
use crate::flow::linear::{Factors, dot};
use nalgebra::DMatrix;

/// Derivative by a speed farther upstream that counts as none. The dissipation vanishes exponentially in subsonic flow.
const NEGLIGIBLE: f64 = 1e-20;

/// A linearised system: residuals and derivatives of the stations, the global equations and further rows that depend on
/// all unknowns.
#[derive(Debug, Clone)]
pub(super) struct Band {
    pub blocks: Vec<Block>,
    /// Derivatives of the global equations and further rows with respect to the unknowns of every station: a row for
    /// each unknown of the station.
    pub below: Vec<DMatrix<f64>>,
    /// Derivatives of the global equations and further rows with respect to the global unknowns.
    pub corner: DMatrix<f64>,
}

impl Band {
    /// Zeros for a grid with further rows below the global equations.
    pub fn new(grid: &Grid, further: usize) -> Self {
        Self {
            blocks: (0..grid.count()).map(|i| Block::new(grid, i)).collect(),
            below: (0..grid.count()).map(|i| DMatrix::zeros(grid.unknowns(i), GLOBALS + further)).collect(),
            corner: DMatrix::zeros(GLOBALS + further, GLOBALS),
        }
    }

    /// Zeros in the memory of this system, for another one on the same grid. Fresh memory costs as much as filling it.
    pub fn cleared(mut self) -> Self {
        self.blocks.iter_mut().for_each(Block::clear);
        self.below.iter_mut().for_each(|matrix| matrix.fill(0.0));
        self.corner.fill(0.0);
        self
    }

    /// The derivatives of an equation of a station.
    #[inline(always)]
    pub fn equation(&mut self, row: Place) -> Equation<'_> {
        self.blocks[row.station].equation(row)
    }

    /// The derivatives of a global equation or further row.
    #[inline(always)]
    pub fn further(&mut self, row: usize) -> FurtherRow<'_> {
        FurtherRow { band: self, row }
    }

    /// The residuals, which become the right-hand side.
    pub fn set_residual(&mut self, station: usize, values: &[f64]) {
        let block = &mut self.blocks[station];
        let (stride, place) = (block.layout.stride(), block.layout.border() + RESIDUAL);
        for (row, value) in block.rows.chunks_mut(stride).zip(values) {
            row[place] = *value;
        }
    }

    /// Keeps the equations of the stations, which factorisation overwrites.
    pub fn keep_equations(&mut self) {
        self.blocks.iter_mut().for_each(Block::keep_equations);
    }

    /// Factorises the system. Returns `false` where a block is singular or not finite.
    pub fn factorise(&mut self) -> bool {
        for i in 0..self.blocks.len() {
            let (done, rest) = self.blocks.split_at_mut(i);
            let block = &mut rest[0];
            block.prepare();
            put_farther(done, block);
            if let Some(before) = done.last() {
                put_first(before, block);
            }
            if !block.factorise() {
                return false;
            }
        }
        for i in (0..self.blocks.len() - 1).rev() {
            let (left, right) = self.blocks.split_at_mut(i + 1);
            let (block, behind) = (&mut left[i], &right[0]);
            let (layout, border) = (block.layout, block.layout.border());
            let product = Combination {
                rows: &mut block.rows,
                stride: layout.stride(),
                factors: layout.next()..layout.next() + layout.ahead,
                columns: border..border + BORDER,
                source: &behind.rows,
                source_stride: behind.layout.stride(),
                source_from: behind.layout.border(),
            };
            product.subtract();
        }
        true
    }

    /// The change that takes the residual to zero, after factorisation; `residual` are those of the global equations.
    pub fn step(&self, residual: &[f64]) -> Option<Unknowns> {
        let column = |block: &Block| -> Vec<f64> {
            let place = block.layout.border() + RESIDUAL;
            block.rows.chunks(block.layout.stride()).map(|row| row[place]).collect()
        };
        self.closed(self.blocks.iter().map(column).collect(), residual)
    }

    /// The change for other residuals than those that were factorised, of the stations and of the global equations.
    pub fn step_for(&self, stations: &[Vec<f64>], residual: &[f64]) -> Option<Unknowns> {
        let mut solved: Vec<Vec<f64>> = Vec::with_capacity(stations.len());
        for (block, right) in self.blocks.iter().zip(stations) {
            let mut own = right.clone();
            self.subtract_upstream(&solved, &mut own);
            block.solve(&mut own);
            solved.push(own);
        }
        for i in (0..solved.len() - 1).rev() {
            let (left, right) = solved.split_at_mut(i + 1);
            let block = &self.blocks[i];
            let next = block.layout.next()..block.layout.next() + block.layout.ahead;
            for (row, value) in left[i].iter_mut().enumerate() {
                *value -= dot(&block.row(row)[next.clone()], &right[0][..next.len()]);
            }
        }
        self.closed(solved, residual)
    }

    /// Subtracts from a right-hand side what the stations upstream, which are solved, have to do with it.
    fn subtract_upstream(&self, solved: &[Vec<f64>], own: &mut [f64]) {
        let i = solved.len();
        let block = &self.blocks[i];
        let Some(before) = solved.last() else { return };
        for (row, value) in own.iter_mut().enumerate() {
            for &(column, factor) in block.factors.first.row(row) {
                *value -= factor * before[column as usize];
            }
        }
        let tubes = supersonic(block);
        if tubes.is_empty() || i < 2 {
            return;
        }
        // the unknowns upstream where those of the station itself are none
        let two = &self.blocks[i - 2];
        let less = |block: &Block, row: usize, solved: &[f64], behind: &[f64]| {
            let next = block.layout.next();
            solved[row] - dot(&block.row(row)[next..next + block.layout.ahead], &behind[..block.layout.ahead])
        };
        let kept: Vec<f64> = (0..two.layout.kept).map(|row| less(two, row, &solved[i - 2], before)).collect();
        for tube in tubes {
            let place = &mut own[block.layout.kept + tube];
            *place -= block.farther[0][tube] * less(two, two.layout.kept + tube, &solved[i - 2], before);
            if i > 2 {
                let three = &self.blocks[i - 3];
                *place -= block.farther[1][tube] * less(three, three.layout.kept + tube, &solved[i - 3], &kept);
            }
        }
    }

    /// The change from the solutions of the stations with their residuals as right-hand sides, with the global unknowns.
    fn closed(&self, solved: Vec<Vec<f64>>, residual: &[f64]) -> Option<Unknowns> {
        let mut schur = self.corner.rows(0, GLOBALS).into_owned();
        let mut right = DMatrix::from_fn(GLOBALS, 1, |g, _| -residual[g]);
        for ((block, below), solved) in self.blocks.iter().zip(&self.below).zip(&solved) {
            let border = block.layout.border();
            for g in 0..GLOBALS {
                let height = below.nrows();
                let column = &below.as_slice()[g * height..(g + 1) * height];
                if column.iter().all(|v| *v == 0.0) {
                    continue;
                }
                right[g] += dot(column, solved);
                for (factor, row) in column.iter().zip(block.rows.chunks(block.layout.stride())) {
                    for k in 0..GLOBALS {
                        schur[(g, k)] -= factor * row[border + k];
                    }
                }
            }
        }
        Factors::new(&schur)?.solve(&mut right);
        let globals: [f64; GLOBALS] = std::array::from_fn(|g| right[g]);
        let station = |(block, solved): (&Block, &Vec<f64>)| -> Vec<f64> {
            let border = block.layout.border();
            let rows = block.rows.chunks(block.layout.stride());
            rows.zip(solved).map(|(row, value)| -value - dot(&row[border..border + GLOBALS], &globals)).collect()
        };
        Some(Unknowns { stations: self.blocks.iter().zip(&solved).map(station).collect(), globals })
    }
}

/// The derivatives of a global equation or further row.
pub(super) struct FurtherRow<'a> {
    band: &'a mut Band,
    row: usize,
}

impl Columns for FurtherRow<'_> {
    #[inline(always)]
    fn add(&mut self, column: Place, value: f64) {
        self.band.below[column.station][(column.index, self.row)] += value;
    }

    #[inline(always)]
    fn add_global(&mut self, global: usize, value: f64) {
        self.band.corner[(self.row, global)] += value;
    }
}

/// Tubes of a block whose equations know of speeds farther upstream.
pub(super) fn supersonic(block: &Block) -> Vec<usize> {
    let counts = |tube: &usize| block.farther.iter().any(|values| !(values[*tube].abs() <= NEGLIGIBLE));
    (0..block.layout.tubes).filter(counts).collect()
}

/// Puts the solutions of the station before into the equations of a station.
fn put_first(before: &Block, block: &mut Block) {
    let (layout, from) = (block.layout, before.layout);
    let parts = [(0, padded(layout.kept), from.next()), (layout.border(), BORDER, from.border())];
    for (column, width, source_from) in parts {
        let product = FewCombined {
            rows: &mut block.rows,
            stride: layout.stride(),
            columns: column..column + width,
            factors: &block.factors.first,
            source: &before.rows,
            source_stride: from.stride(),
            source_from,
        };
        product.subtract();
    }
}

/// Puts the solutions of the second and third station upstream into the equations of the speeds of a station.
fn put_farther(done: &[Block], block: &mut Block) {
    let tubes = supersonic(block);
    let [.., two, one] = done else { return };
    if tubes.is_empty() {
        return;
    }
    let three = done.len().checked_sub(3).map(|k| &done[k]);
    // columns of a row: derivatives by the second station upstream; by the first, with the border; by the own, with the border
    let layout = block.layout;
    let by_one = padded(two.layout.kept);
    let border = by_one + padded(one.layout.kept);
    let by_own = border + BORDER;
    let stride = by_own + padded(layout.kept) + BORDER;
    let mut rows = vec![0.0; tubes.len() * stride];
    for (row, &tube) in rows.chunks_mut(stride).zip(&tubes) {
        let [second, third] = [0, 1].map(|k| block.farther[k][tube]);
        let solution = two.row(two.layout.kept + tube);
        subtract_row(&mut row[by_one..by_own], second, &solution[two.layout.next()..]);
        if let Some(three) = three {
            let solution = three.row(three.layout.kept + tube);
            subtract_row(&mut row[..by_one], third, &solution[three.layout.next()..three.layout.border()]);
            subtract_row(&mut row[border..by_own], third, &solution[three.layout.border()..]);
        }
    }
    let steps = [(two, 0..two.layout.kept, by_one..by_own), (one, by_one..by_one + one.layout.kept, by_own..stride)];
    for (from, factors, columns) in steps {
        let product = Combination {
            rows: &mut rows,
            stride,
            factors,
            columns,
            source: &from.rows,
            source_stride: from.layout.stride(),
            source_from: from.layout.next(),
        };
        product.subtract();
    }
    for (row, &tube) in rows.chunks(stride).zip(&tubes) {
        let own = &mut block.rows[(layout.kept + tube) * layout.stride()..][..layout.stride()];
        let width = padded(layout.kept);
        subtract_row(&mut own[..width], -1.0, &row[by_own..]);
        subtract_row(&mut own[layout.border()..], -1.0, &row[border..by_own]);
        subtract_row(&mut own[layout.border()..], -1.0, &row[by_own + width..]);
    }
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
        let block = &self.blocks[i];
        let (layout, own) = (block.layout, block.row(r));
        let product = |factors: &[f64], values: &[f64]| -> f64 { factors.iter().zip(values).map(|(a, b)| a * b).sum() };
        let mut sum = product(&own[..layout.kept], &change.stations[i]);
        sum += product(&own[layout.border()..][..GLOBALS], &change.globals);
        if let Some(next) = change.stations.get(i + 1) {
            sum += product(&own[layout.next()..][..layout.ahead], next);
        }
        let few = |entries: &[super::rows::Entry], values: &[f64]| -> f64 {
            entries.iter().filter(|e| e.row as usize == r).map(|e| e.value * values[e.column as usize]).sum()
        };
        sum += few(&block.by_speed, &change.stations[i][layout.kept..]);
        if i > 0 {
            sum += few(&block.first, &change.stations[i - 1]);
        }
        if let Some(tube) = r.checked_sub(layout.kept) {
            sum += block.diagonal[tube] * change.stations[i][r];
            for k in 2..=i.min(3) {
                sum += block.farther[k - 2][tube] * change.stations[i - k][self.blocks[i - k].layout.kept + tube];
            }
        }
        sum
    }

    /// A global equation or further row times a change of all unknowns.
    pub fn times_global(&self, row: usize, change: &Unknowns) -> f64 {
        let stations = self.below.iter().zip(&change.stations);
        let of_stations: f64 =
            stations.map(|(b, c)| b.column(row).iter().zip(c).map(|(a, b)| a * b).sum::<f64>()).sum();
        of_stations + self.corner.row(row).iter().zip(&change.globals).map(|(a, b)| a * b).sum::<f64>()
    }
}
