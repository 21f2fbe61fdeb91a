//! Block-banded systems with a border: stations, and the global unknowns that all of them share.
//!
//! A station is linked to the next one by displacements and the layer, and to three stations upstream; of those farther
//! than one the equations of the speeds alone know, and of the third only the speed of the same tube. The equation of a
//! speed knows of the station's own speeds this one alone. Factorisation goes from upstream to downstream with pivots
//! inside the diagonal blocks, from which most speeds are taken out first; the border is eliminated by its Schur
//! complement.

use super::condensed::{Condensed, subtract_product_with_speeds};
use super::numbering::{GLOBALS, Grid, Place, Unknowns};
use crate::flow::linear::{Factors, subtract_product, subtract_transposed_product};
use nalgebra::DMatrix;

/// The equations of one station.
#[derive(Debug, Clone)]
struct Block {
    /// By the unknowns of the station itself; once factorised without use.
    own: DMatrix<f64>,
    /// By displacements and layer of the next station; after factorisation the solution with them as right-hand sides.
    next: DMatrix<f64>,
    /// By all unknowns of the station before.
    first: DMatrix<f64>,
    /// Equations of the speeds by all unknowns of the second station upstream.
    second: DMatrix<f64>,
    /// Equations of the speeds by the speeds of the third station upstream, tube by tube.
    third: Vec<f64>,
    /// By the global unknowns, and in the last column the residual; after factorisation the solution with them.
    border: DMatrix<f64>,
}

/// A linearised system: residuals and derivatives of the stations, the global equations and further rows that depend on
/// all unknowns.
#[derive(Debug, Clone)]
pub(super) struct Band {
    blocks: Vec<Block>,
    /// Index of the first speed of every station.
    speeds: Vec<usize>,
    factors: Vec<Condensed>,
    /// Derivatives of the global equations and further rows with respect to the unknowns of every station: a row for
    /// each unknown of the station.
    pub below: Vec<DMatrix<f64>>,
    /// Derivatives of the global equations and further rows with respect to the global unknowns.
    pub corner: DMatrix<f64>,
}

impl Band {
    /// Zeros for a grid with further rows below the global equations.
    pub fn new(grid: &Grid, further: usize) -> Self {
        let count = grid.count();
        let size = |i: usize| grid.unknowns(i);
        let zeros = DMatrix::zeros;
        let block = |i: usize| {
            let tubes = size(i) - grid.speeds_start(i);
            Block {
                own: zeros(size(i), size(i)),
                next: zeros(size(i), if i + 1 < count { grid.speeds_start(i + 1) } else { 0 }),
                first: zeros(size(i), if i > 0 { size(i - 1) } else { 0 }),
                second: zeros(tubes, if i > 1 { size(i - 2) } else { 0 }),
                third: vec![0.0; tubes],
                border: zeros(size(i), GLOBALS + 1),
            }
        };
        Self {
            blocks: (0..count).map(block).collect(),
            speeds: (0..count).map(|i| grid.speeds_start(i)).collect(),
            factors: Vec::new(),
            below: (0..count).map(|i| zeros(size(i), GLOBALS + further)).collect(),
            corner: zeros(GLOBALS + further, GLOBALS),
        }
    }

    /// Zeros in the memory of this system, for another one on the same grid. Fresh memory costs as much as filling it.
    pub fn cleared(mut self) -> Self {
        self.factors.clear();
        for block in &mut self.blocks {
            let Block { own, next, first, second, third, border } = block;
            [own, next, first, second, border].into_iter().for_each(|matrix| matrix.fill(0.0));
            third.fill(0.0);
        }
        self.below.iter_mut().for_each(|matrix| matrix.fill(0.0));
        self.corner.fill(0.0);
        self
    }

    /// Adds to the derivative of an equation of a station with respect to an unknown of a station.
    #[inline]
    pub fn add(&mut self, row: Place, column: Place, value: f64) {
        let block = &mut self.blocks[row.station];
        match row.station + 1 - column.station {
            0 => block.next[(row.index, column.index)] += value,
            1 => block.own[(row.index, column.index)] += value,
            2 => block.first[(row.index, column.index)] += value,
            3 => block.second[(row.index - self.speeds[row.station], column.index)] += value,
            _ => block.third[row.index - self.speeds[row.station]] += value,
        }
    }

    /// Adds to the derivatives of an equation of a station with respect to several unknowns of one station.
    #[inline]
    pub fn add_several(&mut self, row: Place, station: usize, columns: &[usize], values: &[f64]) {
        let block = &mut self.blocks[row.station];
        let (matrix, r) = match row.station + 1 - station {
            0 => (&mut block.next, row.index),
            1 => (&mut block.own, row.index),
            2 => (&mut block.first, row.index),
            _ => {
                for (&index, &value) in columns.iter().zip(values) {
                    self.add(row, Place { station, index }, value);
                }
                return;
            }
        };
        let height = matrix.nrows();
        let all = matrix.as_mut_slice();
        for (&column, &value) in columns.iter().zip(values) {
            all[column * height + r] += value;
        }
    }

    /// Adds to the derivative of an equation of a station with respect to a global unknown.
    #[inline]
    pub fn add_global(&mut self, row: Place, global: usize, value: f64) {
        self.blocks[row.station].border[(row.index, global)] += value;
    }

    /// The residuals, which become the right-hand side.
    pub fn set_residual(&mut self, station: usize, values: &[f64]) {
        self.blocks[station].border.column_mut(GLOBALS).copy_from_slice(values);
    }

    /// An equation of a station times a change of all unknowns, before factorisation.
    #[cfg(test)]
    pub fn times(&self, row: Place, change: &Unknowns) -> f64 {
        let (i, r) = (row.station, row.index);
        let block = &self.blocks[i];
        let product = |matrix: &DMatrix<f64>, row: usize, values: &[f64]| -> f64 {
            matrix.row(row).iter().zip(values).map(|(a, b)| a * b).sum()
        };
        let mut sum = product(&block.own, r, &change.stations[i]) + product(&block.border, r, &change.globals);
        if i + 1 < self.blocks.len() {
            sum += product(&block.next, r, &change.stations[i + 1]);
        }
        if i > 0 {
            sum += product(&block.first, r, &change.stations[i - 1]);
        }
        if let Some(tube) = r.checked_sub(self.speeds[i]) {
            if i > 1 {
                sum += product(&block.second, tube, &change.stations[i - 2]);
            }
            if i > 2 {
                sum += block.third[tube] * change.stations[i - 3][self.speeds[i - 3] + tube];
            }
        }
        sum
    }

    /// A global equation or further row times a change of all unknowns.
    #[cfg(test)]
    pub fn times_global(&self, row: usize, change: &Unknowns) -> f64 {
        let stations = self.below.iter().zip(&change.stations);
        let of_stations: f64 =
            stations.map(|(b, c)| b.column(row).iter().zip(c).map(|(a, b)| a * b).sum::<f64>()).sum();
        of_stations + self.corner.row(row).iter().zip(&change.globals).map(|(a, b)| a * b).sum::<f64>()
    }

    /// Factorises the system. Returns `false` where a diagonal block is singular or not finite.
    pub fn factorise(&mut self) -> bool {
        self.factors.clear();
        for i in 0..self.blocks.len() {
            let (done, rest) = self.blocks.split_at_mut(i);
            let block = &mut rest[0];
            let start = self.speeds[i];
            if i > 2 {
                let far = &done[i - 3];
                let offset = self.speeds[i - 3];
                for (t, &value) in block.third.iter().enumerate() {
                    for c in 0..far.next.ncols() {
                        block.second[(t, c)] -= value * far.next[(offset + t, c)];
                    }
                    for c in 0..=GLOBALS {
                        block.border[(start + t, c)] -= value * far.border[(offset + t, c)];
                    }
                }
            }
            if i > 1 {
                let far = &done[i - 2];
                let dense = self.speeds[i - 2];
                subtract_product_with_speeds(&mut block.first, start, &block.second, dense, &far.next);
                subtract_product_with_speeds(&mut block.border, start, &block.second, dense, &far.border);
            }
            if i > 0 {
                let far = &done[i - 1];
                let dense = self.speeds[i - 1];
                subtract_product_with_speeds(&mut block.own, 0, &block.first, dense, &far.next);
                subtract_product_with_speeds(&mut block.border, 0, &block.first, dense, &far.border);
            }
            let Some(factors) = Condensed::of(&block.own, start) else { return false };
            factors.solve(&mut block.next);
            factors.solve(&mut block.border);
            self.factors.push(factors);
        }
        for i in (0..self.blocks.len() - 1).rev() {
            let (left, right) = self.blocks.split_at_mut(i + 1);
            let block = &mut left[i];
            subtract_product(&mut block.border, 0, &block.next, &right[0].border);
        }
        true
    }

    /// The change that takes the residual to zero, after factorisation; `residual` are those of the global equations.
    pub fn step(&self, residual: &[f64]) -> Option<Unknowns> {
        let mut schur = self.corner.rows(0, GLOBALS).into_owned();
        let mut right = DMatrix::from_fn(GLOBALS, 1, |g, _| -residual[g]);
        for (block, below) in self.blocks.iter().zip(&self.below) {
            let product = below.columns(0, GLOBALS).tr_mul(&block.border);
            schur -= product.columns(0, GLOBALS);
            right += product.column(GLOBALS);
        }
        Factors::new(&schur)?.solve(&mut right);
        let globals: [f64; GLOBALS] = std::array::from_fn(|g| right[g]);
        let station = |block: &Block| {
            let mut change: Vec<f64> = block.border.column(GLOBALS).iter().map(|v| -v).collect();
            for (g, global) in globals.iter().enumerate() {
                for (c, b) in change.iter_mut().zip(block.border.column(g).iter()) {
                    *c -= global * b;
                }
            }
            change
        };
        Some(Unknowns { stations: self.blocks.iter().map(station).collect(), globals })
    }

    /// Multipliers of all equations for every further row: the solutions of the transposed system whose right-hand sides
    /// are the derivatives of these rows. `border` are the derivatives of the stations' equations with respect to the
    /// global unknowns, which factorisation has overwritten. A row of a result belongs to an unknown, a column to a
    /// further row.
    pub fn multipliers(&self, border: &[DMatrix<f64>]) -> Option<Multipliers> {
        let mut stations = self.transposed();
        let further = self.corner.nrows() - GLOBALS;
        // the global equations' own multipliers close the border
        let mut closing = self.corner.transpose();
        for (border, solution) in border.iter().zip(&stations) {
            subtract_transposed_product(&mut closing, border, solution, 0);
        }
        let schur = closing.columns(0, GLOBALS).into_owned();
        let mut globals = closing.columns(GLOBALS, further).into_owned();
        Factors::new(&schur)?.solve(&mut globals);
        for solution in &mut stations {
            let [own, others] = [(0, GLOBALS), (GLOBALS, further)].map(|(c, n)| solution.columns(c, n).into_owned());
            *solution = others;
            subtract_product(solution, 0, &own, &globals);
        }
        Some(Multipliers { stations, globals })
    }

    /// Derivatives of the stations' equations with respect to the global unknowns, before factorisation.
    pub fn border(&self) -> Vec<DMatrix<f64>> {
        self.blocks.iter().map(|block| block.border.columns(0, GLOBALS).into_owned()).collect()
    }

    /// Solutions of the transposed system of the stations for the derivatives of the global equations and the further
    /// rows, as columns.
    fn transposed(&self) -> Vec<DMatrix<f64>> {
        let count = self.blocks.len();
        let mut right = self.below.clone();
        for i in 1..count {
            let (before, rest) = right.split_at_mut(i);
            subtract_transposed_product(&mut rest[0], &self.blocks[i - 1].next, &before[i - 1], 0);
        }
        for i in (0..count).rev() {
            let (left, behind) = right.split_at_mut(i + 1);
            let own = &mut left[i];
            if i + 1 < count {
                subtract_transposed_product(own, &self.blocks[i + 1].first, &behind[0], 0);
            }
            if i + 2 < count {
                subtract_transposed_product(own, &self.blocks[i + 2].second, &behind[1], self.speeds[i + 2]);
            }
            if i + 3 < count {
                let (far, start) = (&behind[2], self.speeds[i + 3]);
                for (t, value) in self.blocks[i + 3].third.iter().enumerate() {
                    for c in 0..own.ncols() {
                        own[(self.speeds[i] + t, c)] -= value * far[(start + t, c)];
                    }
                }
            }
            self.factors[i].solve_transposed(own);
        }
        right
    }
}

/// Multipliers of the equations of all stations and of the global ones; a column for every further row.
#[derive(Debug, Clone)]
pub(super) struct Multipliers {
    pub stations: Vec<DMatrix<f64>>,
    pub globals: DMatrix<f64>,
}
