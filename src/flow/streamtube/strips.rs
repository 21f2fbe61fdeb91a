//! The elimination of a station in the columns of the rows of the station upstream.
//!
//! The solutions of a station stand in rows of columns: those of the equations of the station upstream, those of the global
//! equations, or those of right-hand sides that come later.

use super::block::{Block, Layout};
use super::numbering::GLOBALS;
use super::rows::{Combination, FewCombined, Multiples, Sparse};
use crate::flow::linear::add_scaled;
use std::ops::Range;

/// Some columns of rows.
pub(super) struct Strip<'a> {
    pub rows: &'a mut [f64],
    pub stride: usize,
    pub columns: Range<usize>,
}

/// As many columns of other rows, from the column `from` on.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub rows: &'a [f64],
    pub stride: usize,
    pub from: usize,
}

impl Source<'_> {
    fn row(&self, row: usize, width: usize) -> &[f64] {
        &self.rows[row * self.stride + self.from..][..width]
    }

    /// These columns from a row on.
    fn behind(self, row: usize) -> Self {
        Self { rows: &self.rows[row * self.stride..], ..self }
    }
}

impl Strip<'_> {
    fn width(&self) -> usize {
        self.columns.len()
    }

    /// Some of the rows.
    fn part(&mut self, rows: Range<usize>) -> Strip<'_> {
        let rows = &mut self.rows[rows.start * self.stride..rows.end * self.stride];
        Strip { rows, stride: self.stride, columns: self.columns.clone() }
    }

    fn row(&mut self, row: usize) -> &mut [f64] {
        &mut self.rows[row * self.stride..][self.columns.clone()]
    }

    /// Subtracts combinations of rows.
    pub fn combine(self, factors: Multiples, source: Source) {
        let Self { rows, stride, columns } = self;
        let Source { rows: source, stride: source_stride, from: source_from } = source;
        Combination { rows, stride, factors, columns, source, source_stride, source_from }.subtract();
    }

    /// Subtracts combinations of rows with few factors.
    fn combine_few(self, factors: &Sparse, source: Source) {
        let Self { rows, stride, columns } = self;
        let Source { rows: source, stride: source_stride, from: source_from } = source;
        FewCombined { rows, stride, columns, factors, source, source_stride, source_from }.subtract();
    }

    /// Subtracts from each row one other row times a factor.
    fn combine_each(self, factors: &[f64], source: Source) {
        for (k, (row, factor)) in self.rows.chunks_mut(self.stride).zip(factors).enumerate() {
            add_scaled(&mut row[self.columns.clone()], -factor, source.row(k, self.columns.len()));
        }
    }
}

/// Puts solutions of the station behind into some columns of the rows of a station's own unknowns, and of those of unknowns
/// farther upstream, which it makes. `known` is what such rows of the station behind hold in these columns.
pub(super) fn put_strips(
    behind: &Block,
    layout: Layout,
    [mut own, mut lower]: [Strip; 2],
    source: Source,
    known: Option<Source>,
) {
    let from = behind.layout;
    if let Some(known) = known {
        carry(behind, layout, [&mut own, &mut lower], known);
    }
    let others = Source { rows: &behind.lower, stride: from.lower_stride(), from: 0 };
    let equations = from.kept + behind.taken;
    let factors = |first: usize| Multiples::Apart(others.behind(first).rows, others.stride, equations);
    let (first, size) = (layout.tube(0), layout.size());
    let ([own_reach, reach], fast) = (&behind.reaches, behind.fast());
    let tubes = source.behind(from.tube(0));
    own.part(0..layout.kept).combine(factors(0), source);
    if !own_reach.is_empty() {
        let tubes = first + own_reach.start..first + own_reach.end;
        own.part(tubes).combine(factors(from.far_rows() + own_reach.start), source);
    }
    own.part(0..layout.kept).combine_few(&behind.factors.upstream[0], tubes);
    own.part(first..size).combine_each(&behind.speeds[0], tubes);
    let (globals, far) = (layout.globals(), layout.far_rows());
    lower.part(0..globals).combine_few(&behind.factors.upstream[1], tubes);
    lower.part(globals..far).combine(factors(from.globals()), source);
    lower.part(globals..far).combine(Multiples::Apart(&behind.by_globals, from.tubes, from.tubes), tubes);
    if !reach.is_empty() {
        let rows = far + reach.start..far + reach.end;
        lower.part(rows).combine(factors(from.far_rows() + from.far[0] + reach.start), source);
    }
    for (k, first) in [far, far + layout.far[0]].into_iter().enumerate().filter(|(k, _)| layout.far[*k] > 0) {
        let rows = lower.part(first + fast.start..first + fast.end);
        rows.combine_each(&behind.speeds[k + 1][fast.clone()], tubes.behind(fast.start));
    }
}

/// Hands on what the rows of unknowns upstream of the station behind hold in columns that are not of equations of a station.
fn carry(behind: &Block, layout: Layout, [own, lower]: [&mut Strip; 2], known: Source) {
    let (from, width) = (behind.layout, own.width());
    for row in 0..layout.kept {
        add_scaled(own.row(row), 1.0, known.row(row, width));
    }
    for tube in behind.reaches[0].clone() {
        add_scaled(own.row(layout.tube(tube)), 1.0, known.row(from.far_rows() + tube, width));
    }
    for g in 0..GLOBALS {
        lower.row(layout.globals() + g).copy_from_slice(known.row(from.globals() + g, width));
    }
    for tube in behind.reaches[1].clone() {
        lower.row(layout.far_rows() + tube).copy_from_slice(known.row(from.far_rows() + from.far[0] + tube, width));
    }
}
