//! Exact derivatives of the outputs of a solved flow, by the adjoint of its equations.
//!
//! The multipliers of the equations weigh the local derivatives of every term with respect to what it reads off the
//! geometry. These sums pass back through the nodes to the columns of the background grid, whose derivatives are local
//! again, and from there to the wall stations. The wall stations depend on all nodes of the section through the spline;
//! they are differentiated forward, some nodes at a time. The cost does not depend on the number of outputs or design
//! variables.

use super::background::{COLUMN_INPUTS, WallStations, column};
use super::equations::Held;
use super::gas::{Flow, Parameters};
use super::geometry::{Geometry, displacement_thickness, gaps, movement};
use super::kept::{self, Base};
use super::kernel::{Input, Kernel, Pass, Target};
use super::local::{Lanes, Local, Recording, Slots, Terms, add};
use super::moves::Moves;
use super::numbering::{ALPHA, Grid, STAGNATION, TRANSITION, Unknowns};
use super::outputs::{OUTPUTS, Peak, outputs};
use super::system::{Linearised, Numbers, Problem};
use super::transposed::{Adjoint, adjoint};
use crate::differentiate::Tangent;
use crate::flow::coefficients::Derivatives;
use crate::flow::layer::Side;
use std::ops::Range;
use std::sync::Arc;

/// Derivatives with respect to what a column of the grid depends on.
type ByColumn = Tangent<COLUMN_INPUTS>;
/// Coordinates of nodes that are differentiated at a time.
const CHUNK: usize = 32;
type ByNodes = Tangent<CHUNK>;
/// Derivatives with respect to Mach and Reynolds number.
type ByStream = Tangent<2>;

/// Derivatives of the outputs with respect to what the terms read off the geometry.
#[derive(Debug, Clone)]
struct Sensitivities {
    nodes: Vec<[Lanes; 2]>,
    points: [Vec<[Lanes; 2]>; 2],
    normals: [Vec<[Lanes; 2]>; 2],
    arcs: [Vec<Lanes>; 2],
    gaps: Vec<Lanes>,
    ahead: Vec<Lanes>,
    trips: [Lanes; 2],
    total: Lanes,
    focus: [Lanes; 2],
    origin: [Lanes; 2],
}

impl Sensitivities {
    /// The sensitivities to what the terms read; there are none to other numbers.
    fn new(grid: &Grid, slots: &Slots, sums: &[Lanes]) -> Self {
        let zero = [0.0; OUTPUTS];
        let pairs = |range: &Range<usize>| sums[range.clone()].chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect();
        let list = |range: &Range<usize>| sums[range.clone()].to_vec();
        Self {
            nodes: pairs(&slots.nodes),
            points: slots.points.each_ref().map(pairs),
            normals: slots.points.each_ref().map(|points| vec![[zero; 2]; points.len() / 2]),
            arcs: slots.arcs.each_ref().map(list),
            gaps: list(&slots.gaps),
            ahead: vec![zero; grid.stations.ahead + 1],
            trips: [sums[slots.trips.start], sums[slots.trips.start + 1]],
            total: sums[slots.total],
            focus: [zero; 2],
            origin: [zero; 2],
        }
    }
}

/// Derivatives of all outputs at fixed angle of attack, with respect to the nodes in the frame of the chord line, the
/// angle, and the Mach and Reynolds number. `geometry` is that of the flow, and `base` is where the last factors on the way
/// to the flow were made. The result is `None` where the equations are singular.
pub(super) fn derivatives(
    solved: &Problem,
    unknowns: &Unknowns,
    geometry: &Geometry<f64>,
    base: Option<&Arc<Base>>,
    peaks: &[Peak; 2],
) -> Option<[Derivatives; OUTPUTS]> {
    let mut problem = solved.clone();
    problem.held = Held::Angle;
    problem.parameters.incidence = unknowns.globals[ALPHA];
    let (flow, moves) = (problem.flow(), problem.moves(unknowns)?);
    let numbers = || Numbers { geometry, unknowns };
    let terms = Terms {
        equations: |pass: &mut Recording| problem.equations().pass(pass),
        outputs: |pass: &mut Recording| outputs(&problem.grid, peaks, pass),
    };
    let local = Local::of(&problem.grid, numbers(), &flow, terms);
    // where the lift was held, the angle is from here on
    let of = |at: Arc<Linearised>| adjoint(&at.band, &local, &moves, ALPHA);
    let close = base.and_then(kept::factorised).and_then(of);
    let exact =
        || kept::factorised(&Arc::new(Base { problem: solved.clone(), unknowns: unknowns.clone() })).and_then(of);
    let found = close.or_else(exact)?;
    let sensitivities = Sensitivities::new(&problem.grid, &local.slots, &found.sums);
    let nodes = by_nodes(&problem, unknowns, geometry, sensitivities)?;
    let stream = by_stream(&problem, numbers(), &moves, peaks, &local, &found);
    let mut nodes = nodes.into_iter();
    let derivatives: [Derivatives; OUTPUTS] = std::array::from_fn(|o| Derivatives {
        nodes: nodes.next().unwrap_or_default(),
        // the residual of the angle is the angle less the one that is held
        alpha: -found.weights[local.slots.globals()][ALPHA][o],
        mach: stream[0][o],
        reynolds: stream[1][o],
    });
    let finite =
        |d: &Derivatives| d.alpha.is_finite() && d.mach.is_finite() && d.nodes.iter().flatten().all(|v| v.is_finite());
    derivatives.iter().all(finite).then_some(derivatives)
}

/// The pass that weighs the derivatives of all terms with respect to Mach and Reynolds number, for constant inputs.
struct Weighing<'a> {
    numbers: Numbers<'a, f64>,
    flow: &'a Flow<ByStream>,
    slots: &'a Slots,
    weights: &'a [Lanes],
    sums: [Lanes; 2],
}

impl Pass for Weighing<'_> {
    #[inline]
    fn term<const N: usize, const M: usize>(
        &mut self,
        kernel: &impl Kernel<N, M>,
        inputs: [Input; N],
        targets: [Target; M],
    ) {
        let x = inputs.map(|input| ByStream::from_re(self.numbers.read(input)));
        let results = kernel.evaluate::<ByStream, ByStream>(x, self.flow);
        for (result, target) in results.iter().zip(targets) {
            let Some((row, factor)) = target else { continue };
            let lanes = &self.weights[self.slots.of_row(row)];
            for (sum, slope) in self.sums.iter_mut().zip(result.eps) {
                add(sum, factor * slope, lanes);
            }
        }
    }
}

/// Derivatives with respect to Mach and Reynolds number, of the terms and of the layers that displace what they read.
fn by_stream(
    problem: &Problem,
    numbers: Numbers<f64>,
    moves: &Moves,
    peaks: &[Peak; 2],
    local: &Local,
    Adjoint { weights, sums }: &Adjoint,
) -> [Lanes; 2] {
    let parameters = problem.parameters.map(ByStream::from_re);
    let parameters: Parameters<ByStream> =
        Parameters { mach: parameters.mach.derivative(0), reynolds: parameters.reynolds.derivative(1), ..parameters };
    let (flow, unknowns) = (Flow::new(&parameters), numbers.unknowns);
    let mut pass = Weighing { numbers, flow: &flow, slots: &local.slots, weights, sums: [[0.0; OUTPUTS]; 2] };
    problem.equations().pass(&mut pass);
    outputs(&problem.grid, peaks, &mut pass);
    let mut by = pass.sums;
    for (layer, lanes) in moves.layers.iter().zip(&local.by_layers(moves, sums)) {
        let state = &unknowns.stations[layer.station][layer.first..];
        let thickness = displacement_thickness(std::array::from_fn(|k| ByStream::from_re(state[k])), &flow.stream);
        by.iter_mut().zip(thickness.eps).for_each(|(sum, slope)| add(sum, slope, lanes));
    }
    by
}

/// Derivatives with respect to the nodes of the section, one list per output.
fn by_nodes(
    problem: &Problem,
    unknowns: &Unknowns,
    geometry: &Geometry<f64>,
    mut sums: Sensitivities,
) -> Option<Vec<Vec<[f64; 2]>>> {
    for station in 0..problem.grid.count() {
        for side in Side::BOTH {
            back_through_column(problem, unknowns, &geometry.wall, &geometry.gaps, (station, side), &mut sums);
        }
    }
    through_wall(problem, unknowns, &sums)
}

/// Passes the sensitivities of the nodes of one side at a station on to what the column depends on.
fn back_through_column(
    problem: &Problem,
    unknowns: &Unknowns,
    wall: &WallStations<f64>,
    gaps: &[f64],
    (station, side): (usize, Side),
    sums: &mut Sensitivities,
) {
    let grid = &problem.grid;
    let (nose, edge) = (grid.stations.nose(), grid.stations.edge());
    let law = problem.flow().stream;
    let inputs = wall.column_inputs(&grid.stations, station, side);
    let numbers = inputs.numbers();
    let seeded = std::array::from_fn(|k| ByColumn::from_re(numbers[k]).derivative(k));
    let nodes = column(&grid.stations, station, side, &inputs.with_numbers(seeded));
    let thickness = grid
        .carrier(station, side)
        .map_or(0.0, |sheet| displacement_thickness(unknowns.layer(grid, station, sheet), &law));
    let mut by = [[0.0; OUTPUTS]; COLUMN_INPUTS];
    for (height, node) in nodes.iter().enumerate() {
        let line = grid.line(side, height);
        let movement = movement(grid, station, line);
        let mut displacement = thickness * movement.by_layer;
        if movement.free {
            displacement += unknowns.at(grid.displacement(station, line));
        }
        let own = sums.nodes[station * grid.lines() + line];
        if movement.by_gap != 0.0 {
            displacement += gaps[station - edge] * movement.by_gap;
            for c in 0..2 {
                add(&mut sums.gaps[station - edge], movement.by_gap * node.direction[c].re, &own[c]);
            }
        }
        for c in 0..2 {
            for (k, by) in by.iter_mut().enumerate() {
                let slope = node.place[c].eps[k] + displacement * node.direction[c].eps[k];
                if slope != 0.0 {
                    add(by, slope, &own[c]);
                }
            }
        }
    }
    let (k, number) = (side.index(), station.clamp(nose, edge) - nose);
    add(&mut sums.ahead[nose.saturating_sub(station)], 1.0, &by[10]);
    for c in 0..2 {
        add(&mut sums.points[k][number][c], 1.0, &by[c]);
        add(&mut sums.normals[k][number][c], 1.0, &by[2 + c]);
        if station > edge {
            // the middle of the edge
            for end in &mut sums.points {
                add(&mut end[number][c], 0.5, &by[4 + c]);
            }
        } else {
            add(&mut sums.points[k][number][c], 1.0, &by[4 + c]);
        }
        add(&mut sums.focus[c], 1.0, &by[6 + c]);
        add(&mut sums.origin[c], 1.0, &by[8 + c]);
    }
}

/// Passes the sensitivities of wall stations, gaps and trips on to the nodes of the section.
fn through_wall(problem: &Problem, unknowns: &Unknowns, sums: &Sensitivities) -> Option<Vec<Vec<[f64; 2]>>> {
    let count = problem.nodes.len();
    let mut results = vec![vec![[0.0; 2]; count]; OUTPUTS];
    for start in (0..2 * count).step_by(CHUNK) {
        let seed = |i: usize, c: usize| {
            let x = ByNodes::from_re(problem.nodes[i][c]);
            let direction = 2 * i + c;
            if (start..start + CHUNK).contains(&direction) { x.derivative(direction - start) } else { x }
        };
        let nodes: Vec<_> = (0..count).map(|i| [seed(i, 0), seed(i, 1)]).collect();
        let shape = problem.shape(&nodes)?;
        let place = |g: usize| ByNodes::from_re(unknowns.globals[g]);
        let wall = WallStations::new(&problem.grid.stations, &shape.curve, place(STAGNATION), TRANSITION.map(place));
        let mut by = [[0.0; OUTPUTS]; CHUNK];
        let mut chain = |number: &ByNodes, lanes: &Lanes| {
            for (by, slope) in by.iter_mut().zip(number.eps) {
                if slope != 0.0 {
                    add(by, slope, lanes);
                }
            }
        };
        for k in 0..2 {
            for (number, lanes) in wall.arcs[k].iter().zip(&sums.arcs[k]) {
                chain(number, lanes);
            }
            for c in 0..2 {
                for (point, lanes) in wall.points[k].iter().zip(&sums.points[k]) {
                    chain(&point[c], &lanes[c]);
                }
                for (normal, lanes) in wall.normals[k].iter().zip(&sums.normals[k]) {
                    chain(&normal[c], &lanes[c]);
                }
            }
            if let Some(trip) = &shape.trips[k] {
                chain(trip, &sums.trips[k]);
            }
        }
        for c in 0..2 {
            chain(&wall.focus[c], &sums.focus[c]);
            chain(&wall.origin[c], &sums.origin[c]);
        }
        for (gap, lanes) in gaps(&problem.grid, &wall).iter().zip(&sums.gaps) {
            chain(gap, lanes);
        }
        for (distance, lanes) in wall.ahead.iter().zip(&sums.ahead) {
            chain(distance, lanes);
        }
        chain(&wall.total, &sums.total);
        for (k, by) in by.iter().enumerate().take(2 * count - start) {
            let direction = start + k;
            for (o, value) in by.iter().enumerate() {
                results[o][direction / 2][direction % 2] = *value;
            }
        }
    }
    Some(results)
}
