//! The unknowns of one station, their coefficients in the equations, and the factors of the station's own part.
//!
//! The unknowns of a station are its displacements and its layer, and the speeds of the tubes between the station upstream and
//! itself. Rows are unknowns and lie one after the other: their coefficients in the equations of the station itself, in those
//! of the station upstream, and in the global equations. The equation along a tube knows of the speeds
//! of the station this one alone, so that its diagonal is a pivot that costs nothing, and the dense factors have the size of the
//! other unknowns. That derivative vanishes in supersonic flow; speeds with such weak pivots stay among the unknowns of the
//! dense factors.

use super::dense::{Dense, PUT_OFF};
use super::numbering::{GLOBALS, Grid};
use super::rows::{Combination, Entry, FewCombined, Multiples, Sparse, padded};
use crate::flow::linear::add_scaled;
use std::ops::Range;

/// Smallest pivot of a speed that is taken out, over the largest coefficient of this speed in another equation.
const WEAK: f64 = 0.01;
/// Derivative by a speed farther upstream that counts as none. The dissipation vanishes exponentially in subsonic flow; steps
/// leave far more of what they are to take away than these derivatives do.
const NEGLIGIBLE: f64 = 1e-10;

/// Length of the part of a row for the global equations.
pub(super) const SHARED: usize = padded(GLOBALS);

/// Numbers of unknowns of a station, and where the parts of its rows begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Number of displacements and unknowns of the layer, and of the equations that belong to them.
    pub kept: usize,
    /// Number of speeds upstream of the station, and of the equations along these tubes.
    pub tubes: usize,
    /// Number of displacements and unknowns of the layer of the station upstream.
    pub ahead: usize,
    /// Number of speeds upstream of that station, and of those upstream of the one before.
    pub far: [usize; 2],
}

impl Layout {
    fn new(grid: &Grid, station: usize) -> Self {
        let tubes = |before: usize| if station > before { grid.tubes() } else { 0 };
        Self {
            kept: grid.speeds_start(station),
            tubes: tubes(0),
            ahead: if station > 0 { grid.speeds_start(station - 1) } else { 0 },
            far: [tubes(1), tubes(2)],
        }
    }

    /// Number of rows: displacements and layer, unknowns that were put off downstream, and speeds.
    pub fn size(self) -> usize {
        self.tube(0) + self.tubes
    }

    /// The row of the speed of a tube, or of the equation along it.
    pub fn tube(self, tube: usize) -> usize {
        self.kept + PUT_OFF + tube
    }

    /// Length of a row of [`Block::own`], and first column of the global equations in [`Block::lower`].
    pub fn own_stride(self) -> usize {
        padded(self.kept + PUT_OFF)
    }

    /// First column of the global equations in [`Block::next`].
    pub fn border(self) -> usize {
        padded(self.ahead + PUT_OFF)
    }

    /// Length of a row of [`Block::next`].
    pub fn next_stride(self) -> usize {
        self.border() + SHARED
    }

    /// Length of a row of [`Block::lower`].
    pub fn lower_stride(self) -> usize {
        self.own_stride() + SHARED
    }

    /// First row of [`Block::lower`] with a global unknown.
    pub fn globals(self) -> usize {
        self.ahead
    }

    /// First row of [`Block::lower`] with a speed upstream of the station upstream.
    pub fn far_rows(self) -> usize {
        self.ahead + GLOBALS
    }

    /// Puts right-hand sides of the dense factors into a row of [`Block::next`]: those with columns of the station upstream, what
    /// was put off behind them, and those of the global equations.
    fn spread(self, right: &[f64], put_off: &[f64], row: &mut [f64]) {
        let (ahead, shared) = right.split_at(padded(self.ahead));
        row[..self.ahead].copy_from_slice(&ahead[..self.ahead]);
        row[self.ahead..][..put_off.len()].copy_from_slice(put_off);
        row[self.border()..].copy_from_slice(&shared[..SHARED]);
    }

    pub fn lower_rows(self) -> usize {
        self.far_rows() + self.far[0] + self.far[1]
    }
}

/// The unknowns of one station. Where a station has no good pivots for all of its equations, some equations and as many unknowns
/// are put off to the station upstream; their columns stand behind those of the equations of that station, and their rows
/// behind its displacements and layer. An equation that was put off is its own solution.
///
/// Once factorised, in the columns of the station upstream and of the global equations the
/// solutions with these as right-hand sides, a row for every equation of the station.
#[derive(Debug, Clone)]
pub(super) struct Block {
    pub layout: Layout,
    /// Coefficients of the unknowns in the equations of the station itself: a row for each unknown.
    pub own: Vec<f64>,
    /// Coefficients of the unknowns in the equations of the station upstream and in the global ones, which are read alone once
    /// the station is factorised.
    pub next: Vec<f64>,
    /// Coefficients of other unknowns in the equations of the station, and behind them what has become of their
    /// coefficients in the global equations. A row for each displacement and unknown of the layer of the station upstream; for
    /// each global unknown; for each speed upstream of that station, and of the one before.
    pub lower: Vec<f64>,
    /// Tubes whose speeds farther upstream have coefficients in [`lower`](Self::lower).
    pub reaches: [Range<usize>; 2],
    /// Coefficient of each speed in the equation along its tube.
    pub diagonal: Vec<f64>,
    /// Coefficients of the station's unknowns in the equations along the tubes: unknown, tube.
    pub by_tube: Vec<Entry>,
    /// Coefficients of the unknowns of the first and second station upstream in these equations: unknown, tube.
    pub upstream: [Vec<Entry>; 2],
    /// Coefficients of the speed of the same tube, from one to three intervals upstream.
    pub speeds: [Vec<f64>; 3],
    /// Coefficients of the global unknowns: unknown by unknown.
    pub by_globals: Vec<f64>,
    /// Number of unknowns and equations that were put off downstream.
    pub taken: usize,
    pub factors: Factors,
}

/// Factors of the station's own part.
#[derive(Debug, Clone, Default)]
pub(super) struct Factors {
    /// [`Block::upstream`], unknown by unknown.
    pub upstream: [Sparse; 2],
    /// Tubes whose speeds are not taken out.
    weak: Vec<usize>,
    /// Reciprocals of the pivots of the speeds that are taken out, zero for others.
    inverse: Vec<f64>,
    /// Coefficients in the equations along the tubes whose speeds are taken out: unknown, tube.
    by_out: Sparse,
    /// Factors of what is left, with the weak speeds last.
    dense: Dense,
}

impl Factors {
    /// Takes speeds out of the rows of the other unknowns, in some columns of all rows.
    fn take_out(&self, others: &mut [f64], speeds: &mut [f64], stride: usize, columns: Range<usize>) {
        let strong = speeds.chunks_mut(stride).zip(&self.inverse).filter(|(_, inverse)| **inverse != 0.0);
        for (row, inverse) in strong {
            row[columns.clone()].iter_mut().for_each(|value| *value *= inverse);
        }
        if !speeds.is_empty() {
            let (factors, source, source_from) = (&self.by_out, &*speeds, columns.start);
            FewCombined { rows: others, stride, columns, factors, source, source_stride: stride, source_from }
                .subtract();
        }
    }
}

impl Block {
    /// Zeros for a station of a grid.
    pub fn new(grid: &Grid, station: usize) -> Self {
        let layout = Layout::new(grid, station);
        let tubes = || vec![0.0; layout.tubes];
        Self {
            layout,
            own: vec![0.0; layout.size() * layout.own_stride()],
            next: vec![0.0; layout.size() * layout.next_stride()],
            lower: vec![0.0; layout.lower_rows() * layout.lower_stride()],
            reaches: [0..0, 0..0],
            diagonal: tubes(),
            by_tube: Vec::new(),
            upstream: [Vec::new(), Vec::new()],
            speeds: [tubes(), tubes(), tubes()],
            by_globals: vec![0.0; GLOBALS * layout.tubes],
            taken: 0,
            factors: Factors::default(),
        }
    }

    /// Sets everything to zero.
    pub fn clear(&mut self) {
        let (layout, lower_stride) = (self.layout, self.layout.lower_stride());
        for (rows, stride) in [(&mut self.own, layout.own_stride()), (&mut self.next, layout.next_stride())] {
            rows[..(layout.kept + self.taken) * stride].fill(0.0);
            rows[layout.tube(0) * stride..].fill(0.0);
        }
        // nothing else has been touched
        let (shared, far) = self.lower.split_at_mut(layout.far_rows() * lower_stride);
        shared.fill(0.0);
        for (first, touched) in [0, layout.far[0]].into_iter().zip(&mut self.reaches) {
            far[(first + touched.start) * lower_stride..(first + touched.end) * lower_stride].fill(0.0);
            *touched = 0..0;
        }
        self.taken = 0;
        self.diagonal.fill(0.0);
        self.by_tube.clear();
        self.upstream.iter_mut().for_each(Vec::clear);
        self.speeds.iter_mut().for_each(|values| values.fill(0.0));
        self.by_globals.fill(0.0);
    }

    /// The row of an unknown in the equations of the station itself.
    pub fn own_row(&self, row: usize) -> &[f64] {
        &self.own[row * self.layout.own_stride()..][..self.layout.own_stride()]
    }

    /// The row of an unknown, or once factorised of an equation, in the equations of the station upstream and the global ones.
    pub fn next_row(&self, row: usize) -> &[f64] {
        &self.next[row * self.layout.next_stride()..][..self.layout.next_stride()]
    }

    /// The coefficients of an unknown from elsewhere in the equations of the station that do not belong to tubes.
    pub fn lower_row(&self, row: usize) -> &[f64] {
        &self.lower[row * self.layout.lower_stride()..][..self.layout.kept + self.taken]
    }

    /// The coefficients of a global unknown in the equations along the tubes.
    pub fn global(&self, global: usize) -> &[f64] {
        &self.by_globals[global * self.layout.tubes..][..self.layout.tubes]
    }

    /// The tubes along which the equations know of speeds two or three intervals upstream, with those between them.
    pub fn fast(&self) -> Range<usize> {
        let is_fast = |tube: &usize| self.speeds[1..].iter().any(|values| !(values[*tube].abs() <= NEGLIGIBLE));
        let tubes = 0..self.layout.tubes;
        let first = tubes.clone().find(is_fast);
        first.map_or(0..0, |first| first..tubes.rev().find(is_fast).map_or(first, |last| last) + 1)
    }

    /// Puts the lists in order.
    pub fn prepare(&mut self) {
        let rows = [self.layout.ahead, self.upstream[1].iter().map(|e| e.row as usize + 1).max().unwrap_or(0)];
        self.factors.upstream = [0, 1].map(|k| Sparse::new(rows[k], &self.upstream[k]));
    }

    /// Factorises the station's own part and solves with the columns of the station upstream and of the border as right-hand
    /// sides, which stand in `right` afterwards as far as the dense factors know of them. Returns `false` where the part is
    /// singular or holds a number that is not finite.
    pub fn factorise(&mut self, right: &mut Vec<f64>) -> bool {
        let layout = self.layout;
        let (own_stride, next_stride) = (layout.own_stride(), layout.next_stride());
        let (border, ahead) = (layout.border(), padded(layout.ahead));
        let (kept, first) = (layout.kept + self.taken, layout.tube(0));
        self.sort_speeds();
        let (others, speeds) = self.own.split_at_mut(first * own_stride);
        self.factors.take_out(others, speeds, own_stride, 0..padded(kept));
        let (others, speeds) = self.next.split_at_mut(first * next_stride);
        for columns in [0..ahead, border..border + SHARED] {
            self.factors.take_out(others, speeds, next_stride, columns);
        }
        // there is nothing upstream of the first station
        let allowed = if ahead > 0 { PUT_OFF } else { 0 };
        let Factors { weak, dense, .. } = &mut self.factors;
        let size = kept + weak.len();
        dense.begin(size, allowed);
        let width = ahead + SHARED + padded(allowed);
        // what is left from before is not read, or written over
        right.resize(size * width, 0.0);
        let unknowns = (0..kept).chain(weak.iter().map(|&tube| first + tube));
        for ((place, row), right) in unknowns.enumerate().zip(right.chunks_mut(width)) {
            dense.put(place, &self.own[row * own_stride..][..kept]);
            let next = &self.next[row * next_stride..][..next_stride];
            right[..ahead].copy_from_slice(&next[..ahead]);
            right[ahead..][..SHARED].copy_from_slice(&next[border..]);
            right[ahead + SHARED..].fill(0.0);
        }
        for (number, &tube) in weak.iter().enumerate() {
            dense.set(kept + number, kept + number, self.diagonal[tube]);
        }
        for entry in &self.by_tube {
            if let Some(number) = weak.iter().position(|tube| *tube == entry.column as usize) {
                dense.add(entry.row as usize, kept + number, entry.value);
            }
        }
        if !dense.factorise() {
            return false;
        }
        dense.solve_lower(right, width);
        dense.put_columns(right, width, ahead + SHARED);
        dense.solve_upper(right, width);
        self.put_solutions(right, width);
        true
    }

    /// Puts the solutions of the dense part into the rows, and those of the speeds that were taken out.
    fn put_solutions(&mut self, right: &[f64], width: usize) {
        let layout = self.layout;
        let (stride, border) = (layout.next_stride(), layout.border());
        let (kept, first) = (layout.kept + self.taken, layout.tube(0));
        let Factors { weak, dense, .. } = &self.factors;
        let put_off = padded(layout.ahead) + SHARED;
        // what is left of the speeds' own columns is needed until all other solutions stand
        let mut solved = vec![0.0; weak.len() * stride];
        for (place, right) in right.chunks(width).enumerate() {
            let (column, number) = dense.column(place);
            let own = match column.checked_sub(kept) {
                None => &mut self.next[column * stride..][..stride],
                Some(number) => &mut solved[number * stride..][..stride],
            };
            match number {
                None => layout.spread(right, &right[put_off..][..dense.put_off()], own),
                Some(number) => {
                    own.fill(0.0);
                    own[layout.ahead + number] = -1.0;
                }
            }
        }
        let (others, speeds) = self.next.split_at_mut(first * stride);
        for columns in [0..padded(layout.ahead + dense.put_off()), border..border + SHARED] {
            let source_from = columns.start;
            let factors = Multiples::Apart(&self.own[first * layout.own_stride()..], layout.own_stride(), kept);
            let (source, source_stride) = (&*others, stride);
            Combination { rows: speeds, stride, factors, columns, source, source_stride, source_from }.subtract();
        }
        for (&tube, solved) in weak.iter().zip(solved.chunks(stride)) {
            speeds[tube * stride..][..stride].copy_from_slice(solved);
        }
    }

    /// Replaces right-hand sides, a list of `width` numbers for each row, by the solutions with the factors. The result is
    /// what is left for the equations that are put off.
    pub fn solve_lists(&self, lists: &mut [f64], width: usize) -> Vec<f64> {
        let (layout, stride) = (self.layout, self.layout.own_stride());
        let kept = layout.kept + self.taken;
        let Factors { weak, dense, .. } = &self.factors;
        let (others, speeds) = lists.split_at_mut(layout.tube(0) * width);
        self.factors.take_out(others, speeds, width, 0..width);
        let mut right = others[..kept * width].to_vec();
        weak.iter().for_each(|tube| right.extend_from_slice(&speeds[tube * width..][..width]));
        dense.solve_lower(&mut right, width);
        let left = right[dense.done() * width..].to_vec();
        dense.solve_upper(&mut right, width);
        right[dense.done() * width..].fill(0.0);
        let mut solved = vec![0.0; weak.len() * width];
        for (place, right) in right.chunks(width).enumerate() {
            let (column, _) = dense.column(place);
            match column.checked_sub(kept) {
                None => others[column * width..][..width].copy_from_slice(right),
                Some(number) => solved[number * width..][..width].copy_from_slice(right),
            }
        }
        let product = Combination {
            rows: speeds,
            stride: width,
            factors: Multiples::Apart(&self.own[layout.tube(0) * stride..], stride, kept),
            columns: 0..width,
            source: others,
            source_stride: width,
            source_from: 0,
        };
        product.subtract();
        for (&tube, solved) in weak.iter().zip(solved.chunks(width)) {
            speeds[tube * width..][..width].copy_from_slice(solved);
        }
        left
    }

    /// Number of columns of the station's own equations, with those that were put off downstream.
    pub fn own_width(&self) -> usize {
        padded(self.layout.kept + self.taken)
    }

    /// Number of unknowns and equations that are put off to the station upstream.
    pub fn put_off(&self) -> usize {
        self.factors.dense.put_off()
    }

    /// Takes on the unknowns and equations that were put off by the station behind, whose right-hand sides stand in `right`.
    /// Their columns begin with those of this station's equations.
    pub fn take_on(&mut self, behind: &Self, right: &[f64]) {
        let (layout, from) = (self.layout, behind.layout);
        let dense = &behind.factors.dense;
        let width = padded(from.ahead) + SHARED + padded(PUT_OFF);
        self.taken = behind.put_off();
        for number in 0..self.taken {
            let (row, place) = (layout.kept + number, dense.done() + number);
            let own = &mut self.own[row * layout.own_stride()..][..layout.own_stride()];
            let next = &mut self.next[row * layout.next_stride()..][..layout.next_stride()];
            let (right, shared) = right[place * width..][..width].split_at(padded(from.ahead));
            own[..from.ahead].copy_from_slice(&right[..from.ahead]);
            own[from.ahead..][..self.taken].copy_from_slice(dense.left(place));
            next[layout.border()..].copy_from_slice(&shared[..SHARED]);
        }
    }

    /// Tells the speeds that are taken out from those that are not.
    fn sort_speeds(&mut self) {
        let Layout { kept, tubes, .. } = self.layout;
        let first = self.layout.tube(0);
        let factors = &mut self.factors;
        factors.weak.clear();
        factors.inverse.clear();
        let stride = self.layout.own_stride();
        for (tube, row) in self.own[first * stride..].chunks(stride).enumerate() {
            let largest = row[..kept + self.taken].iter().fold(0.0f64, |most, value| most.max(value.abs()));
            let pivot = self.diagonal[tube];
            // written so that NaN is weak
            let strong = pivot.abs() >= WEAK * largest && pivot != 0.0;
            if !strong {
                factors.weak.push(tube);
            }
            factors.inverse.push(if strong { pivot.recip() } else { 0.0 });
        }
        debug_assert_eq!(factors.inverse.len(), tubes);
        let strong = |entry: &&Entry| factors.inverse[entry.column as usize] != 0.0;
        let entries: Vec<Entry> = self.by_tube.iter().filter(strong).copied().collect();
        factors.by_out = Sparse::new(kept, &entries);
    }

    /// Replaces a right-hand side, a number for each equation of the station, by the unknowns of the station. `known` are
    /// the unknowns that were put off.
    pub fn solve(&self, b: &mut [f64], known: &[f64]) {
        let kept = self.layout.kept + self.taken;
        let first = self.layout.tube(0);
        let factors = &self.factors;
        let (others, speeds) = b.split_at_mut(first);
        let others = &mut others[..kept];
        for (tube, value) in speeds.iter().enumerate().filter(|(tube, _)| factors.inverse[*tube] != 0.0) {
            add_scaled(others, -value, &self.own_row(first + tube)[..kept]);
        }
        let weak = factors.weak.iter().map(|&tube| speeds[tube]);
        let mut dense: Vec<f64> = others.iter().copied().chain(weak).collect();
        factors.dense.solve_transposed(&mut dense, known);
        others.copy_from_slice(&dense[..kept]);
        for (row, value) in others.iter().enumerate().take(self.layout.kept) {
            for &(tube, factor) in factors.by_out.row(row) {
                speeds[tube as usize] -= factor * value;
            }
        }
        speeds.iter_mut().zip(&factors.inverse).for_each(|(value, inverse)| *value *= inverse);
        for (number, &tube) in factors.weak.iter().enumerate() {
            speeds[tube] = dense[kept + number];
        }
    }

    /// Subtracts from the right-hand sides of the station upstream and of the global equations what the station's own
    /// has to do with them.
    pub fn pass_on(&self, own: &[f64], upstream: &mut [f64], globals: &mut [f64; GLOBALS]) {
        let border = self.layout.border();
        let with_rows = own.iter().zip(self.next.chunks(self.layout.next_stride()));
        for (value, row) in with_rows.filter(|(value, _)| **value != 0.0) {
            add_scaled(upstream, -value, &row[..upstream.len()]);
            add_scaled(globals, -value, &row[border..border + GLOBALS]);
        }
    }
}
