//! The inputs that the kernels of a tube read.

use super::cell::{Cell, INPUTS};
use super::kernel::Input;
use super::numbering::Grid;

/// Both coordinates of a node.
pub(super) fn node(station: usize, line: usize) -> [Input; 2] {
    [0, 1].map(|axis| Input::Node { station, line, axis })
}

/// The nodes of both lines of a tube about `station` and the speeds that a [`Cell`] reads.
pub(super) fn cell_inputs(grid: &Grid, station: usize, tube: usize) -> [Input; INPUTS] {
    let low = grid.lower_line(tube);
    std::array::from_fn(|k| match k {
        0..6 => node(station - 1 + k / 2, low)[k % 2],
        6..12 => node(station - 1 + (k - 6) / 2, low + 1)[k % 2],
        // the inlet stands in for speeds ahead of it
        _ => Input::Unknown(grid.speed((station + k).saturating_sub(15), tube)),
    })
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
