//! All equations of a flow as terms: which kernel reads which inputs and adds to which equation.

use super::cell::{EdgeSpeed, Exit, Inlet};
use super::far_field::{Mismatch, OuterPressure, Slope};
use super::kernel::{Identity, Input, Less, LessHeldAngle, MinusHeldLift, Pass, Row, Target};
use super::layer_kernels::{FirstStation, LayerInterval, TransitionPoint, WakeDisplacement, WakeStart};
use super::numbering::{
    ALPHA, CIRCULATION, DOUBLETS, GLOBALS, Grid, LAYER, Place, SOURCE, SPEED, STAGNATION, Sheet, TRANSITION,
};
use super::outputs::{LIFT, wall_loads};
use super::tubes::{cell, cell_inputs, face_inputs, node};
use crate::flow::layer::{Regime, Side};

/// The quantity that is held while the flow is solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Held {
    Angle,
    Lift,
}

/// The equations of a flow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Equations<'a> {
    pub grid: &'a Grid,
    pub held: Held,
    /// Which sides have a trip.
    pub tripped: [bool; 2],
    pub critical: f64,
    /// Arc lengths to transition that are kept where there is no layer, or where transition stands still.
    pub fixed_transition: Option<[f64; 2]>,
}

/// The far-field strengths and the angle of attack as inputs.
const FAR: [Input; 5] = [
    Input::Global(CIRCULATION),
    Input::Global(DOUBLETS[0]),
    Input::Global(DOUBLETS[1]),
    Input::Global(SOURCE),
    Input::Global(ALPHA),
];

fn to(place: Place, factor: f64) -> Target {
    Some((Row::Station(place), factor))
}

impl Equations<'_> {
    /// Goes over all terms of all equations.
    pub fn pass(&self, pass: &mut impl Pass) {
        self.cells(pass);
        self.outer_lines(pass);
        self.ends(pass);
        self.globals(pass);
        if self.grid.viscous {
            for side in Side::BOTH {
                self.side(pass, side);
            }
            self.wake(pass);
        }
    }

    /// The row of the line with equal pressures on both sides: the line itself, or on the dividing line at the nose the
    /// stagnation point and at the edge the circulation. The lines on the wall have no such row.
    ///
    /// The cell of the edge reaches half an interval ahead of it, where the wall carries load. Its pressures therefore
    /// differ by what a load that falls evenly to nothing leaves in it, which the cell ahead tells.
    fn line_row(&self, station: usize, line: usize) -> Target {
        let (stations, (_, height)) = (&self.grid.stations, self.grid.side_of(line));
        if height > 0 || !self.grid.on_wall(station) {
            return to(self.grid.displacement(station, line), 1.0);
        }
        match station {
            _ if station == stations.nose() => Some((Row::Global(STAGNATION), 1.0)),
            _ if station == stations.edge() => Some((Row::Global(CIRCULATION), 1.0)),
            _ if station + 1 == stations.edge() => Some((Row::Global(CIRCULATION), -stations.last_load())),
            _ => None,
        }
    }

    /// The row of the speed at the edge of the layer that the dividing line gives at a station, with its factor.
    fn speed_row(&self, station: usize, side: Side) -> Target {
        let stations = &self.grid.stations;
        // both speeds at the edge have an equation of their own
        if !self.grid.viscous || station <= stations.nose() || station == stations.edge() {
            return None;
        }
        let (sheet, factor) = if station < stations.edge() { (Sheet::Wall(side), -1.0) } else { (Sheet::Wake, -0.5) };
        to(self.grid.layer(station, sheet, SPEED), factor)
    }

    fn cells(&self, pass: &mut impl Pass) {
        let grid = self.grid;
        for station in 1..grid.count() - 1 {
            for tube in 0..grid.tubes() {
                let low = grid.lower_line(tube);
                let line = |line: usize, sign: f64| self.line_row(station, line).map(|(row, f)| (row, sign * f));
                let speed = |side: Side| {
                    if grid.inner_tube(side) == tube { self.speed_row(station, side) } else { None }
                };
                let targets = [
                    line(low + 1, 1.0),
                    line(low, -1.0),
                    to(grid.speed(station, tube), 1.0),
                    speed(Side::Lower),
                    speed(Side::Upper),
                ];
                pass.term(&cell(grid, tube), cell_inputs(grid, station, tube), targets);
            }
        }
    }

    /// The outer lines carry the pressure of the far field, and the doublets fit that to them.
    fn outer_lines(&self, pass: &mut impl Pass) {
        let grid = self.grid;
        for (line, factor) in [(0, 1.0), (grid.lines() - 1, -1.0)] {
            for station in 1..grid.count() - 1 {
                let [x, y] = node(station, line);
                let [a, b, c, d, e] = FAR;
                pass.term(&OuterPressure, [x, y, a, b, c, d, e], [to(grid.displacement(station, line), factor)]);
            }
            for station in 0..grid.count() - 1 {
                let targets = DOUBLETS.map(|g| Some((Row::Global(g), 1.0)));
                pass.term(&Mismatch, self.segment(station, line), targets);
            }
        }
    }

    /// A line between two stations, with the far field.
    fn segment(&self, station: usize, line: usize) -> [Input; 9] {
        let ([x0, y0], [x1, y1]) = (node(station, line), node(station + 1, line));
        let [a, b, c, d, e] = FAR;
        [x0, y0, x1, y1, a, b, c, d, e]
    }

    /// Inlet and outlet: slopes of the far field, and the total pressure of the onset flow.
    fn ends(&self, pass: &mut impl Pass) {
        let grid = self.grid;
        let last = grid.count() - 1;
        for (station, row) in [(0, 0), (last - 1, last)] {
            for line in 0..grid.lines() {
                // the dividing line has the mean slope of its two copies
                let factor = if grid.side_of(line).1 == 0 { 0.5 } else { 1.0 };
                pass.term(&Slope, self.segment(station, line), [to(grid.displacement(row, line), factor)]);
            }
        }
        for tube in 0..grid.tubes() {
            let mass = grid.mass(tube);
            pass.term(&Inlet { mass }, face_inputs(grid, 0, tube), [to(grid.speed(0, tube), 1.0)]);
            pass.term(&Exit { mass }, face_inputs(grid, last - 1, tube), [Some((Row::Global(SOURCE), -1.0)), None]);
        }
        // displacements on the wall are none
        for station in grid.stations.nose()..=grid.stations.edge() {
            let place = grid.displacement(station, grid.half());
            pass.term(&Identity, [Input::Unknown(place)], [to(place, 1.0)]);
        }
    }

    fn globals(&self, pass: &mut impl Pass) {
        let grid = self.grid;
        pass.term(&Identity, [Input::Global(SOURCE)], [Some((Row::Global(SOURCE), 1.0))]);
        match self.held {
            Held::Angle => pass.term(&LessHeldAngle, [Input::Global(ALPHA)], [Some((Row::Global(ALPHA), 1.0))]),
            Held::Lift => {
                wall_loads(grid, pass, |load| (load == LIFT).then_some((Row::Global(ALPHA), 1.0)));
                pass.term(&MinusHeldLift, [], [Some((Row::Global(ALPHA), 1.0))]);
            }
        }
        if grid.viscous {
            let last = grid.count() - 1;
            let state = self.state(last, Sheet::Wake);
            pass.term(&WakeDisplacement, state, [Some((Row::Global(SOURCE), -1.0))]);
        }
        for side in Side::BOTH {
            self.transition(pass, side);
        }
    }

    fn transition(&self, pass: &mut impl Pass, side: Side) {
        let (k, grid) = (side.index(), self.grid);
        let row = [Some((Row::Global(TRANSITION[k]), 1.0))];
        let place = Input::Global(TRANSITION[k]);
        if let Some(fixed) = self.fixed_transition {
            return pass.term(&Less(fixed[k]), [place], row);
        }
        let station = grid.stations.nose() + grid.stations.turning[k];
        let amplification = Input::Unknown(grid.layer(station, Sheet::Wall(side), 2));
        let inputs = [place, Input::Global(STAGNATION), Input::Total, Input::Trip(side), amplification];
        let kernel = TransitionPoint { side, tripped: self.tripped[k], critical: self.critical };
        pass.term(&kernel, inputs, row);
    }

    fn state(&self, station: usize, sheet: Sheet) -> [Input; LAYER] {
        std::array::from_fn(|k| Input::Unknown(self.grid.layer(station, sheet, k)))
    }

    /// The targets of the three equations of a sheet at a station.
    fn layer_rows(&self, station: usize, sheet: Sheet) -> [Target; 3] {
        std::array::from_fn(|k| to(self.grid.layer(station, sheet, k), 1.0))
    }

    /// Adds `factor` times the logarithm of the speed at one station to the row of the speed at another.
    fn link_speed(&self, pass: &mut impl Pass, row: (usize, Sheet), own: (usize, Sheet), factor: f64) {
        let input = Input::Unknown(self.grid.layer(own.0, own.1, SPEED));
        pass.term(&Identity, [input], [to(self.grid.layer(row.0, row.1, SPEED), factor)]);
    }

    fn side(&self, pass: &mut impl Pass, side: Side) {
        let (grid, sheet) = (self.grid, Sheet::Wall(side));
        let nose = grid.stations.nose();
        let arc = |station: usize| Input::Arc { side, point: station - nose };
        self.edge_speed(pass, side);
        for station in nose + 1..=grid.stations.edge() {
            if station < grid.stations.edge() {
                self.link_speed(pass, (station, sheet), (station, sheet), 1.0);
            }
            let rows = self.layer_rows(station, sheet);
            let own = self.state(station, sheet);
            if station == nose + 1 {
                let [a, b, c, d] = own;
                pass.term(&FirstStation, [a, b, c, d, arc(station)], rows);
                continue;
            }
            let (regime, before) = (grid.regime(station, sheet), grid.regime(station - 1, sheet));
            let kernel = LayerInterval { regime, turns: regime != before, wake: [0.0; 2] };
            let ends = [arc(station - 1), arc(station)];
            pass.term(&kernel, join(self.state(station - 1, sheet), own, ends), rows);
        }
    }

    /// The speed at the trailing edge, where both layers are under one pressure.
    fn edge_speed(&self, pass: &mut impl Pass, side: Side) {
        let (grid, edge) = (self.grid, self.grid.stations.edge());
        let tube = grid.inner_tube(side);
        let speed = |side: Side| grid.layer(edge, Sheet::Wall(side), SPEED);
        let cells = cell_inputs(grid, edge, tube);
        let inputs = std::array::from_fn(|k| if k < 16 { cells[k] } else { Input::Unknown(speed(side)) });
        let targets = [to(speed(side), 1.0), to(speed(side.other()), 1.0)];
        pass.term(&EdgeSpeed { cell: cell(grid, tube), side }, inputs, targets);
    }

    fn wake(&self, pass: &mut impl Pass) {
        let (grid, sheet) = (self.grid, Sheet::Wake);
        let (edge, last) = (grid.stations.edge(), grid.count() - 1);
        let [upper, lower] = Side::BOTH.map(|side| self.state(edge, Sheet::Wall(side)));
        let own = self.state(edge, sheet);
        let inputs = std::array::from_fn(|k| [upper, lower, own][k / LAYER][k % LAYER]);
        pass.term(&WakeStart, inputs, self.layer_rows(edge, sheet));
        self.link_speed(pass, (edge, sheet), (edge, sheet), 1.0);
        for side in Side::BOTH {
            self.link_speed(pass, (edge, sheet), (edge, Sheet::Wall(side)), -0.5);
        }
        for station in edge + 1..=last {
            self.link_speed(pass, (station, sheet), (station, sheet), 1.0);
            // the exit has no cell about it
            if station == last {
                self.link_speed(pass, (station, sheet), (station - 1, sheet), -1.0);
            }
            let number = station - edge;
            let behind = &grid.stations.behind;
            let kernel = LayerInterval {
                regime: Regime::Wake,
                turns: false,
                wake: [1.0 + behind[number - 1], 1.0 + behind[number]],
            };
            let gaps = [Input::Gap(number - 1), Input::Gap(number)];
            let inputs = join(self.state(station - 1, sheet), self.state(station, sheet), gaps);
            pass.term(&kernel, inputs, self.layer_rows(station, sheet));
        }
    }
}

/// Two states and two more inputs in one list.
fn join(from: [Input; LAYER], own: [Input; LAYER], last: [Input; 2]) -> [Input; 10] {
    std::array::from_fn(|k| match k {
        0..4 => from[k],
        4..8 => own[k - 4],
        _ => last[k - 8],
    })
}

// every global unknown has its equation above
const _: () = assert!(GLOBALS == 8);
