//! The equations of one station, and their factors.
//!
//! Rows are equations and lie one after the other: the derivatives by the station's own displacements and layer, by those of
//! the next station, and by the global unknowns with the residual. The equation of a speed knows of the station's own speeds
//! this one alone, so that its diagonal is a pivot that costs nothing, and the dense factors have the size of the other
//! unknowns. That derivative vanishes at the speed of sound; speeds with such weak pivots stay among the unknowns of the
//! dense factors. What a station upstream has to do with the equations are few numbers, which are kept as a list.

use super::dense::Dense;
use super::numbering::{GLOBALS, Grid, Place};
use super::rows::{Combination, Entry, FewCombined, Sparse, padded, subtract_row, subtract_transposed};

/// Smallest pivot of a speed that is taken out, over the largest derivative of another equation by that speed.
const WEAK: f64 = 0.1;
/// Columns of the global unknowns and the residual, with those that fill up the row.
pub(super) const BORDER: usize = 16;
/// Column of the residual among these.
pub(super) const RESIDUAL: usize = GLOBALS;

const _: () = assert!(GLOBALS < BORDER);

/// Numbers of unknowns of a station, and where the parts of its rows begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Number of displacements and unknowns of the layer.
    pub kept: usize,
    /// Number of speeds.
    pub tubes: usize,
    /// Number of displacements and unknowns of the layer of the next station.
    pub ahead: usize,
}

impl Layout {
    fn new(grid: &Grid, station: usize) -> Self {
        let kept = grid.speeds_start(station);
        let ahead = if station + 1 < grid.count() { grid.speeds_start(station + 1) } else { 0 };
        Self { kept, tubes: grid.unknowns(station) - kept, ahead }
    }

    /// Number of equations.
    pub fn size(self) -> usize {
        self.kept + self.tubes
    }

    /// First column of the next station.
    pub fn next(self) -> usize {
        padded(self.kept)
    }

    /// First column of the border.
    pub fn border(self) -> usize {
        self.next() + padded(self.ahead)
    }

    /// Length of a row.
    pub fn stride(self) -> usize {
        self.border() + BORDER
    }
}

/// The equations of one station; once factorised, in the columns of the next station and of the border the solutions with
/// these as right-hand sides.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub layout: Layout,
    pub rows: Vec<f64>,
    /// Derivative of the equation of each speed by this speed.
    pub diagonal: Vec<f64>,
    /// Derivatives of the other equations by the speeds: row, tube.
    pub by_speed: Vec<Entry>,
    /// Derivatives by the unknowns of the station before: row, unknown.
    pub first: Vec<Entry>,
    /// Derivatives of the equation of each speed by the speed of this tube two and three stations upstream.
    pub farther: [Vec<f64>; 2],
    /// Derivatives by the global unknowns, which factorisation overwrites: row by row.
    pub by_globals: Vec<f64>,
    /// The derivatives by the station's own displacements and layer and by those of the next one, before factorisation and
    /// where they are kept.
    pub equations: [Sparse; 2],
    pub factors: Factors,
}

/// A row of derivatives, by the unknowns of stations and the global ones.
pub(super) trait Columns {
    fn add(&mut self, column: Place, value: f64);
    fn add_global(&mut self, global: usize, value: f64);
}

/// The derivatives of one equation of a station.
pub(super) struct Equation<'a> {
    block: &'a mut Block,
    place: Place,
}

impl Columns for Equation<'_> {
    #[inline(always)]
    fn add(&mut self, column: Place, value: f64) {
        let Self { block, place: row } = self;
        let layout = block.layout;
        let from = row.index * layout.stride();
        match row.station + 1 - column.station {
            0 => block.rows[from + layout.next() + column.index] += value,
            1 if column.index < layout.kept => block.rows[from + column.index] += value,
            1 if row.index == column.index => block.diagonal[row.index - layout.kept] += value,
            1 => block.by_speed.push(Entry::new(row.index, column.index - layout.kept, value)),
            2 => block.first.push(Entry::new(row.index, column.index, value)),
            distance => block.farther[distance - 3][row.index - layout.kept] += value,
        }
    }

    #[inline(always)]
    fn add_global(&mut self, global: usize, value: f64) {
        let layout = self.block.layout;
        self.block.rows[self.place.index * layout.stride() + layout.border() + global] += value;
    }
}

/// Factors of the station's own part.
#[derive(Debug, Clone, Default)]
pub(super) struct Factors {
    /// [`Block::first`], row by row.
    pub first: Sparse,
    /// Tubes whose speeds are taken out.
    out: Vec<usize>,
    /// Tubes whose speeds are not.
    weak: Vec<usize>,
    /// Reciprocals of the pivots of the speeds that are taken out, by tube.
    inverse: Vec<f64>,
    /// Derivatives of the kept equations by the speeds that are taken out: row, tube.
    by_out: Sparse,
    /// Factors of what is left, with the weak speeds last.
    dense: Dense,
}

impl Block {
    /// Zeros for a station of a grid.
    pub fn new(grid: &Grid, station: usize) -> Self {
        let layout = Layout::new(grid, station);
        Self {
            layout,
            rows: vec![0.0; layout.size() * layout.stride()],
            diagonal: vec![0.0; layout.tubes],
            by_speed: Vec::new(),
            first: Vec::new(),
            farther: [vec![0.0; layout.tubes], vec![0.0; layout.tubes]],
            by_globals: Vec::new(),
            equations: [Sparse::default(), Sparse::default()],
            factors: Factors::default(),
        }
    }

    /// Sets everything to zero.
    pub fn clear(&mut self) {
        self.rows.fill(0.0);
        self.diagonal.fill(0.0);
        self.by_speed.clear();
        self.first.clear();
        self.farther.iter_mut().for_each(|values| values.fill(0.0));
    }

    /// The row of an equation.
    pub fn row(&self, row: usize) -> &[f64] {
        &self.rows[row * self.layout.stride()..][..self.layout.stride()]
    }

    /// The derivatives of the equation at a place of this station.
    pub fn equation(&mut self, place: Place) -> Equation<'_> {
        Equation { block: self, place }
    }

    /// Keeps the equations, which factorisation overwrites.
    pub fn keep_equations(&mut self) {
        let layout = self.layout;
        let parts = [0..layout.kept, layout.next()..layout.next() + layout.ahead];
        self.equations = parts.map(|columns| {
            let mut entries = Vec::with_capacity(20 * layout.size());
            for (row, own) in self.rows.chunks(layout.stride()).enumerate() {
                let numbers = own[columns.clone()].iter().enumerate().filter(|(_, value)| **value != 0.0);
                entries.extend(numbers.map(|(column, &value)| Entry::new(row, column, value)));
            }
            Sparse::new(layout.size(), &entries)
        });
    }

    /// Keeps the derivatives by the global unknowns, which factorisation overwrites, and puts the lists in order.
    pub fn prepare(&mut self) {
        let border = self.layout.border();
        self.by_globals.clear();
        for row in self.rows.chunks(self.layout.stride()) {
            self.by_globals.extend_from_slice(&row[border..border + GLOBALS]);
        }
        self.factors.first = Sparse::new(self.layout.size(), &self.first);
    }

    /// Factorises the station's own part and solves with the other columns as right-hand sides. Returns `false` where it is
    /// singular or holds a number that is not finite.
    pub fn factorise(&mut self) -> bool {
        let Layout { kept, tubes, .. } = self.layout;
        let (stride, next) = (self.layout.stride(), self.layout.next());
        self.sort_speeds();
        let Factors { out, weak, inverse, by_out, dense, .. } = &mut self.factors;
        let (others, speeds) = self.rows.split_at_mut(kept * stride);
        for &tube in &*out {
            speeds[tube * stride..][..stride].iter_mut().for_each(|value| *value *= inverse[tube]);
        }
        if tubes > 0 {
            let product = FewCombined {
                rows: others,
                stride,
                columns: 0..stride,
                factors: by_out,
                source: speeds,
                source_stride: stride,
                source_from: 0,
            };
            product.subtract();
        }
        dense.begin(kept + weak.len(), stride - next);
        for (row, own) in self.rows.chunks(stride).take(kept).enumerate() {
            dense.put(row, &own[..kept], &own[next..]);
        }
        for (number, &tube) in weak.iter().enumerate() {
            let own = &self.rows[(kept + tube) * stride..][..stride];
            dense.put(kept + number, &own[..kept], &own[next..]);
            dense.set(kept + number, kept + number, self.diagonal[tube]);
        }
        for entry in &self.by_speed {
            if let Some(number) = weak.iter().position(|tube| *tube == entry.column as usize) {
                dense.add(entry.row as usize, kept + number, entry.value);
            }
        }
        if !dense.factorise() {
            return false;
        }
        for row in 0..kept {
            self.rows[row * stride + next..][..stride - next].copy_from_slice(dense.solution(row));
        }
        let (others, speeds) = self.rows.split_at_mut(kept * stride);
        let product = Combination {
            rows: speeds,
            stride,
            factors: 0..kept,
            columns: next..stride,
            source: others,
            source_stride: stride,
            source_from: next,
        };
        product.subtract();
        for (number, &tube) in weak.iter().enumerate() {
            speeds[tube * stride + next..][..stride - next].copy_from_slice(dense.solution(kept + number));
        }
        true
    }

    /// Tells the speeds that are taken out from those that are not.
    fn sort_speeds(&mut self) {
        let tubes = self.layout.tubes;
        let mut largest = vec![0.0f64; tubes];
        for entry in &self.by_speed {
            let most = &mut largest[entry.column as usize];
            *most = most.max(entry.value.abs());
        }
        let factors = &mut self.factors;
        factors.out.clear();
        factors.weak.clear();
        factors.inverse.clear();
        for tube in 0..tubes {
            let pivot = self.diagonal[tube];
            // written so that NaN is weak
            let strong = pivot.abs() >= WEAK * largest[tube] && pivot != 0.0;
            if strong { &mut factors.out } else { &mut factors.weak }.push(tube);
            factors.inverse.push(if strong { pivot.recip() } else { 0.0 });
        }
        let strong = |entry: &&Entry| factors.inverse[entry.column as usize] != 0.0;
        let entries: Vec<Entry> = self.by_speed.iter().filter(strong).copied().collect();
        factors.by_out = Sparse::new(self.layout.kept, &entries);
    }

    /// Replaces one right-hand side by the solution with the station's own part.
    pub fn solve(&self, b: &mut [f64]) {
        let Layout { kept, .. } = self.layout;
        let factors = &self.factors;
        for &tube in &factors.out {
            b[kept + tube] *= factors.inverse[tube];
        }
        let (others, speeds) = b.split_at_mut(kept);
        for (row, value) in others.iter_mut().enumerate() {
            for &(tube, factor) in factors.by_out.row(row) {
                *value -= factor * speeds[tube as usize];
            }
        }
        let weak = factors.weak.iter().map(|&tube| speeds[tube]);
        let mut dense: Vec<f64> = others.iter().copied().chain(weak).collect();
        factors.dense.solve(&mut dense);
        others.copy_from_slice(&dense[..kept]);
        for &tube in &factors.out {
            speeds[tube] -= crate::flow::linear::dot(&self.row(kept + tube)[..kept], others);
        }
        for (number, &tube) in factors.weak.iter().enumerate() {
            speeds[tube] = dense[kept + number];
        }
    }

    /// Replaces right-hand sides, `width` numbers for each unknown, by the solutions with the transpose of the station's own
    /// part, which stand for the equations.
    pub fn solve_transposed(&self, b: &mut [f64], width: usize) {
        let Layout { kept, .. } = self.layout;
        let factors = &self.factors;
        let (others, speeds) = b.split_at_mut(kept * width);
        // the rows of weak speeds do not belong to the factors
        let mut strong = speeds.to_vec();
        for &tube in &factors.weak {
            strong[tube * width..][..width].fill(0.0);
        }
        let stride = self.layout.stride();
        subtract_transposed(others, (&self.rows[kept * stride..], stride, 0..kept), &strong, width);
        let mut dense = others.to_vec();
        for &tube in &factors.weak {
            dense.extend_from_slice(&speeds[tube * width..][..width]);
        }
        factors.dense.solve_transposed(&mut dense, width);
        others.copy_from_slice(&dense[..kept * width]);
        for (number, &tube) in factors.weak.iter().enumerate() {
            speeds[tube * width..][..width].copy_from_slice(&dense[(kept + number) * width..][..width]);
        }
        for (row, own) in others.chunks(width).enumerate() {
            for &(tube, factor) in factors.by_out.row(row) {
                subtract_row(&mut speeds[tube as usize * width..][..width], factor, own);
            }
        }
        for &tube in &factors.out {
            speeds[tube * width..][..width].iter_mut().for_each(|value| *value *= factors.inverse[tube]);
        }
    }
}
