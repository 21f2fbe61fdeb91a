//! Block-banded systems with a border: stations, and the global unknowns that all of them share.
//!
//! A station is linked to the next one by displacements and the layer, and to three stations upstream; of those farther
//! than one the equations of the speeds alone know, and of the third only the speed of the same tube. Factorisation
//! goes from upstream to downstream with pivots inside the diagonal blocks; the border is eliminated by its Schur
//! complement.

use super::numbering::{GLOBALS, Grid, Place, Unknowns};
use crate::flow::linear::{Factors, dot, subtract_product};
use nalgebra::DMatrix;

/// The equations of one station.
#[derive(Debug, Clone)]
struct Block {
    /// By the unknowns of the station itself; empty once factorised.
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
    factors: Vec<Factors>,
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

    /// Adds to the derivative of an equation of a station with respect to a global unknown.
    #[inline]
    pub fn add_global(&mut self, row: Place, global: usize, value: f64) {
        self.blocks[row.station].border[(row.index, global)] += value;
    }

    /// The residuals, which become the right-hand side.
    pub fn set_residual(&mut self, station: usize, values: &[f64]) {
        self.blocks[station].border.column_mut(GLOBALS).copy_from_slice(values);
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
                subtract_product(&mut block.first, start, &block.second, &far.next);
                subtract_product(&mut block.border, start, &block.second, &far.border);
            }
            if i > 0 {
                let far = &done[i - 1];
                subtract_product(&mut block.own, 0, &block.first, &far.next);
                subtract_product(&mut block.border, 0, &block.first, &far.border);
            }
            let own = std::mem::replace(&mut block.own, DMatrix::zeros(0, 0));
            let Some(factors) = Factors::of(own) else { return false };
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

    /// Multipliers of all equations for further row `output`: the solution of the transposed system whose right-hand
    /// side are the derivatives of that row. `border` are the derivatives of the stations' equations with respect to the
    /// global unknowns, which factorisation has overwritten.
    pub fn multipliers(&self, rows: &[usize], border: &[DMatrix<f64>]) -> Option<Vec<Unknowns>> {
        let column = |g: usize| self.transposed(|i| self.below[i].column(g).iter().copied().collect());
        let global: Vec<Vec<Vec<f64>>> = (0..GLOBALS).map(column).collect();
        let against = |solution: &[Vec<f64>], g: usize| -> f64 {
            border.iter().zip(solution).map(|(b, y)| dot(b.column(g).into_owned().as_slice(), y)).sum()
        };
        let schur =
            DMatrix::from_fn(GLOBALS, GLOBALS, |a, b| self.corner[(b, a)] - against(&global[b], a));
        let factors = Factors::new(&schur)?;
        let solve = |&row: &usize| {
            let mut own = column(GLOBALS + row);
            let mut right =
                DMatrix::from_fn(GLOBALS, 1, |a, _| self.corner[(GLOBALS + row, a)] - against(&own, a));
            factors.solve(&mut right);
            for (g, part) in global.iter().enumerate() {
                for (own, part) in own.iter_mut().zip(part) {
                    for (y, z) in own.iter_mut().zip(part) {
                        *y -= right[g] * z;
                    }
                }
            }
            Unknowns { stations: own, globals: std::array::from_fn(|g| right[g]) }
        };
        Some(rows.iter().map(solve).collect())
    }

    /// Derivatives of the stations' equations with respect to the global unknowns, before factorisation.
    pub fn border(&self) -> Vec<DMatrix<f64>> {
        self.blocks.iter().map(|block| block.border.columns(0, GLOBALS).into_owned()).collect()
    }

    /// Solves the transposed system of the stations with the factors.
    fn transposed(&self, right: impl Fn(usize) -> Vec<f64>) -> Vec<Vec<f64>> {
        let count = self.blocks.len();
        let mut y: Vec<Vec<f64>> = (0..count).map(right).collect();
        for i in 1..count {
            let (before, rest) = y.split_at_mut(i);
            for (c, value) in rest[0].iter_mut().take(self.speeds[i]).enumerate() {
                *value -= dot(self.blocks[i - 1].next.column(c).as_slice(), &before[i - 1]);
            }
        }
        let mut solution: Vec<Vec<f64>> = vec![Vec::new(); count];
        for i in (0..count).rev() {
            let mut own = std::mem::take(&mut y[i]);
            let mut subtract = |matrix: &DMatrix<f64>, from: &[f64]| {
                for (c, value) in own.iter_mut().enumerate() {
                    *value -= dot(matrix.column(c).as_slice(), from);
                }
            };
            if i + 1 < count {
                subtract(&self.blocks[i + 1].first, &solution[i + 1]);
            }
            if i + 2 < count {
                subtract(&self.blocks[i + 2].second, &solution[i + 2][self.speeds[i + 2]..]);
            }
            if i + 3 < count {
                let from = &solution[i + 3][self.speeds[i + 3]..];
                for (t, value) in self.blocks[i + 3].third.iter().enumerate() {
                    own[self.speeds[i] + t] -= value * from[t];
                }
            }
            solution[i] = self.factors[i].solve_transposed_vector(own);
        }
        solution
    }
}
