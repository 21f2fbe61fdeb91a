//! Derivatives of all equations and outputs of a flow with respect to what their terms read, term by term.
//!
//! A system that is weighed with multipliers needs no matrix: the derivatives of every term are kept as they are, and weighed
//! sums of them pass on to the unknowns by way of the [`Moves`] of the nodes.

use super::gas::Flow;
use super::kernel::{Input, Kernel, Pass, Row, Target};
use super::moves::{DISPLACING, Moves, NodeMoves, PLACES};
use super::numbering::{GLOBALS, Grid};
use super::outputs::OUTPUTS;
use super::system::Numbers;
use crate::differentiate::Tangent;
use crate::flow::layer::Side;
use crate::flow::memory::{Recycled, kept};
use std::ops::Range;

/// One number for every output.
pub(super) type Lanes = [f64; OUTPUTS];

kept!(Lanes, 16);
kept!(u32);
kept!([u8; 2]);

/// Largest number of results of a term.
const RESULTS: usize = 5;

/// Adds `factor` times numbers to other numbers.
#[inline(always)]
pub(super) fn add(sums: &mut Lanes, factor: f64, lanes: &Lanes) {
    for (sum, lane) in sums.iter_mut().zip(lanes) {
        *sum += factor * lane;
    }
}

/// Where the numbers that terms read stand in one list: the unknowns of all stations, the global ones, and the geometry.
#[derive(Debug, Clone)]
pub(super) struct Slots {
    /// First unknown of every station.
    starts: Vec<usize>,
    globals: usize,
    pub nodes: Range<usize>,
    lines: usize,
    /// Coordinates of the wall points of both sides.
    pub points: [Range<usize>; 2],
    pub arcs: [Range<usize>; 2],
    pub gaps: Range<usize>,
    pub trips: Range<usize>,
    pub total: usize,
}

impl Slots {
    pub fn new(grid: &Grid) -> Self {
        let mut end = 0;
        let mut next = |count: usize| {
            end += count;
            end - count..end
        };
        let starts = (0..grid.count()).map(|i| next(grid.unknowns(i)).start).collect();
        let wall = grid.stations.fractions.len();
        Self {
            starts,
            globals: next(GLOBALS).start,
            nodes: next(2 * grid.count() * grid.lines()),
            lines: grid.lines(),
            points: [next(2 * wall), next(2 * wall)],
            arcs: [next(wall), next(wall)],
            gaps: next(grid.stations.behind.len()),
            trips: next(2),
            total: next(1).start,
        }
    }

    /// Number of unknowns, and of equations.
    pub fn unknowns(&self) -> usize {
        self.nodes.start
    }

    /// The unknowns of a station, or its equations.
    pub fn station(&self, station: usize) -> Range<usize> {
        self.starts[station]..self.starts.get(station + 1).copied().unwrap_or(self.globals)
    }

    /// The global unknowns, or their equations.
    pub fn globals(&self) -> Range<usize> {
        self.globals..self.globals + GLOBALS
    }

    #[inline(always)]
    fn of(&self, input: Input) -> usize {
        match input {
            Input::Node { station, line, axis } => self.nodes.start + 2 * (station * self.lines + line) + axis,
            Input::Unknown(place) => self.starts[place.station] + place.index,
            Input::Global(g) => self.globals + g,
            Input::Wall { side, point, axis } => self.points[side.index()].start + 2 * point + axis,
            Input::Arc { side, point } => self.arcs[side.index()].start + point,
            Input::Gap(number) => self.gaps.start + number,
            Input::Trip(side) => self.trips.start + side.index(),
            Input::Total => self.total,
        }
    }

    /// The number of an equation, which is that of its unknown; outputs follow the equations.
    #[inline(always)]
    pub fn of_row(&self, row: Row) -> usize {
        match row {
            Row::Station(place) => self.starts[place.station] + place.index,
            Row::Global(g) => self.globals + g,
            Row::Output(k) => self.unknowns() + k,
        }
    }
}

/// Passes over the terms of the equations and over those of the outputs.
pub(super) struct Terms<E, O> {
    pub equations: E,
    pub outputs: O,
}

/// Derivatives of all terms.
#[derive(Debug, Clone)]
pub(super) struct Local {
    pub slots: Slots,
    /// Numbers of inputs and of results of every term.
    sizes: Recycled<[u8; 2]>,
    /// Inputs of the terms, one term after the other.
    inputs: Recycled<u32>,
    /// Rows to which the results of the terms are added.
    rows: Recycled<u32>,
    /// Derivatives, result by result.
    values: Recycled<f64>,
    /// Numbers of terms, inputs, rows and derivatives of the equations, behind which those of the outputs stand.
    equations: [usize; 4],
}

impl Local {
    fn new(grid: &Grid) -> Self {
        // most terms are those of cells
        let cells = grid.count() * grid.tubes();
        Self {
            slots: Slots::new(grid),
            sizes: Recycled::with_capacity(2 * cells),
            inputs: Recycled::with_capacity(20 * cells),
            rows: Recycled::with_capacity(4 * cells),
            values: Recycled::with_capacity(60 * cells),
            equations: [0; 4],
        }
    }

    /// The derivatives of all terms.
    pub fn of(
        grid: &Grid,
        numbers: Numbers<f64>,
        flow: &Flow<f64>,
        terms: Terms<impl Fn(&mut Recording), impl Fn(&mut Recording)>,
    ) -> Self {
        let mut pass = Recording { numbers, flow, local: Self::new(grid) };
        (terms.equations)(&mut pass);
        let Self { sizes, inputs, rows, values, .. } = &pass.local;
        pass.local.equations = [sizes.len(), inputs.len(), rows.len(), values.len()];
        (terms.outputs)(&mut pass);
        pass.local
    }

    /// Weights of nothing: of all equations, and behind them of every output in its own lane.
    pub fn no_weights(&self) -> Recycled<Lanes> {
        Recycled::of([0.0; OUTPUTS], self.slots.unknowns() + OUTPUTS)
    }

    /// Weights of every output in its own lane, and of no equation.
    pub fn output_weights(&self) -> Recycled<Lanes> {
        let mut weights = self.no_weights();
        weights[self.slots.unknowns()..].iter_mut().enumerate().for_each(|(k, lanes)| lanes[k] = 1.0);
        weights
    }

    /// Sums of the derivatives with respect to every slot, with weights of the equations and outputs.
    pub fn weighed(&self, weights: &[Lanes]) -> Recycled<Lanes> {
        self.weighed_from([0; 4], weights)
    }

    /// Sums of the derivatives of the outputs with respect to every slot.
    pub fn weighed_outputs(&self) -> Recycled<Lanes> {
        self.weighed_from(self.equations, &self.output_weights())
    }

    /// Sums over the terms behind a number of terms, inputs, rows and derivatives.
    fn weighed_from(&self, [terms, inputs, rows, values]: [usize; 4], weights: &[Lanes]) -> Recycled<Lanes> {
        let mut sums = Recycled::of([0.0; OUTPUTS], self.slots.total + 1);
        let (mut inputs, mut rows, mut values) = (&self.inputs[inputs..], &self.rows[rows..], &self.values[values..]);
        for &[own_inputs, own_rows] in &self.sizes[terms..] {
            let (own, targets, by);
            (own, inputs) = inputs.split_at(own_inputs.into());
            (targets, rows) = rows.split_at(own_rows.into());
            (by, values) = values.split_at(own.len() * targets.len());
            let mut of_rows = [[0.0; OUTPUTS]; RESULTS];
            targets.iter().zip(&mut of_rows).for_each(|(row, lanes)| *lanes = weights[*row as usize]);
            match targets.len() {
                0 => {}
                1 => scatter::<1>(&mut sums, own, by, &of_rows),
                2 => scatter::<2>(&mut sums, own, by, &of_rows),
                3 => scatter::<3>(&mut sums, own, by, &of_rows),
                4 => scatter::<4>(&mut sums, own, by, &of_rows),
                // no term has more: see the pass that records them
                _ => scatter::<RESULTS>(&mut sums, own, by, &of_rows),
            }
        }
        sums
    }

    /// Derivatives with respect to the displacement thickness of every layer, from those with respect to every slot.
    pub fn by_layers(&self, moves: &Moves, sums: &[Lanes]) -> Vec<Lanes> {
        let mut layers = vec![[0.0; OUTPUTS]; moves.layers.len()];
        let nodes = sums[self.slots.nodes.clone()].chunks_exact(2).zip(&moves.nodes);
        for (own, node) in nodes {
            if let Some((layer, factor)) = node.by_layer {
                add(&mut layers[layer], factor, &along(node, own));
            }
        }
        layers
    }

    /// Derivatives with respect to the unknowns, from those with respect to every slot.
    pub fn by_unknowns(&self, moves: &Moves, sums: &[Lanes]) -> Recycled<Lanes> {
        let slots = &self.slots;
        let mut by: Recycled<Lanes> = Recycled::with_capacity(slots.unknowns());
        by.extend(sums[..slots.unknowns()].iter().copied());
        let mut places = [[0.0; OUTPUTS]; 3];
        let mut layers = vec![[0.0; OUTPUTS]; moves.layers.len()];
        let nodes = sums[slots.nodes.clone()].chunks_exact(2).zip(&moves.nodes);
        for (number, (own, node)) in nodes.enumerate() {
            let along = along(node, own);
            for (c, own) in own.iter().enumerate() {
                places.iter_mut().zip(node.by_places[c]).for_each(|(place, slope)| add(place, slope, own));
            }
            if let Some(index) = node.displacement {
                add(&mut by[slots.starts[number / slots.lines] + index], 1.0, &along);
            }
            if let Some((layer, factor)) = node.by_layer {
                add(&mut layers[layer], factor, &along);
            }
        }
        for (own, layer) in layers.iter().zip(&moves.layers) {
            let first = slots.starts[layer.station] + layer.first;
            DISPLACING.into_iter().zip(layer.by).for_each(|(k, slope)| add(&mut by[first + k], slope, own));
        }
        for side in Side::BOTH.map(Side::index) {
            let points = moves.wall.points[side].iter().flatten();
            let numbers = points.zip(&sums[slots.points[side].clone()]);
            for (number, own) in numbers.chain(moves.wall.arcs[side].iter().zip(&sums[slots.arcs[side].clone()])) {
                places.iter_mut().zip(number.eps).for_each(|(place, slope)| add(place, slope, own));
            }
        }
        for (g, place) in PLACES.into_iter().zip(&places) {
            add(&mut by[slots.globals + g], 1.0, place);
        }
        by
    }
}

/// Adds the derivatives of the `N` results of a term with respect to its inputs, weighed, to the sums of the inputs.
#[inline(always)]
fn scatter<const N: usize>(sums: &mut [Lanes], inputs: &[u32], by: &[f64], weights: &[Lanes; RESULTS]) {
    let by: [&[f64]; N] = std::array::from_fn(|row| &by[row * inputs.len()..][..inputs.len()]);
    for (k, slot) in inputs.iter().enumerate() {
        let sum = &mut sums[*slot as usize];
        let mut lanes = *sum;
        for (by, weights) in by.iter().zip(weights) {
            add(&mut lanes, by[k], weights);
        }
        *sum = lanes;
    }
}

/// Derivatives with respect to the displacement of a node, from those with respect to the coordinates of the node.
fn along(node: &NodeMoves, own: &[Lanes]) -> Lanes {
    let mut along = [0.0; OUTPUTS];
    own.iter().zip(node.direction).for_each(|(own, direction)| add(&mut along, direction, own));
    along
}

/// The pass that keeps the derivatives of all terms.
pub(super) struct Recording<'a> {
    numbers: Numbers<'a, f64>,
    flow: &'a Flow<f64>,
    local: Local,
}

impl Pass for Recording<'_> {
    #[inline]
    fn term<const N: usize, const M: usize>(
        &mut self,
        kernel: &impl Kernel<N, M>,
        inputs: [Input; N],
        targets: [Target; M],
    ) {
        const { assert!(M <= RESULTS) };
        let x = std::array::from_fn(|k| self.numbers.read(inputs[k]));
        let results = kernel.evaluate::<Tangent<N>, f64>(Tangent::variables(x), self.flow);
        let local = &mut self.local;
        local.inputs.extend(inputs.map(|input| local.slots.of(input) as u32));
        let mut count = 0;
        for (result, target) in results.iter().zip(targets) {
            if let Some((row, factor)) = target {
                local.rows.push(local.slots.of_row(row) as u32);
                local.values.extend(result.eps.iter().map(|by| by * factor));
                count += 1;
            }
        }
        local.sizes.push([N as u8, count]);
    }
}
