//! The inputs that the kernels of a tube read.

use super::cell::{Cell, INPUTS};
use super::kernel::Input;
use super::numbering::Grid;

/// Both coordinates of a node.
#[inline(always)]
pub(super) fn node(station: usize, line: usize) -> [Input; 2] {
    [Input::Node { station, line, axis: 0 }, Input::Node { station, line, axis: 1 }]
}

/// The nodes of both lines of a tube about `station` and the speeds that a [`Cell`] reads.
#[inline(always)]
pub(super) fn cell_inputs(grid: &Grid, station: usize, tube: usize) -> [Input; INPUTS] {
    let low = grid.lower_line(tube);
    // one by one: an input that is written and read at once as part of a list makes the processor wait
    let [[a, b], [c, d], [e, f]] = [0, 1, 2].map(|k| node(station + k - 1, low));
    let [[g, h], [i, j], [k, l]] = [0, 1, 2].map(|k| node(station + k - 1, low + 1));
    // the inlet stands in for speeds ahead of it
    let [m, n, o, p] = [3, 2, 1, 0].map(|back| Input::Unknown(grid.speed(station.saturating_sub(back), tube)));
    [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p]
}

/// The nodes of both lines of a tube at a station and the next, and the speed in between.
pub(super) fn face_inputs(grid: &Grid, station: usize, tube: usize) -> [Input; 9] {
    let low = grid.lower_line(tube);
    let [a, b, c, d] = [node(station, low), node(station + 1, low), node(station, low + 1), node(station + 1, low + 1)];
    [a[0], a[1], b[0], b[1], c[0], c[1], d[0], d[1], Input::Unknown(grid.speed(station, tube))]
}

/// The cell of a tube.
pub(super) fn cell(grid: &Grid, tube: usize) -> Cell {
    Cell::new(grid.mass(tube), grid.height(tube))
}
