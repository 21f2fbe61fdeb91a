//! The state of a solution that the streamtube solver keeps, and what is read off it.

use super::adjoint::derivatives;
use super::gas::Flow;
use super::geometry::Geometry;
use super::kept::Base;
use super::kernel::Kernel;
use super::numbering::{ALPHA, SPEED, STAGNATION, Sheet, Unknowns};
use super::outputs::{
    FRICTION_DRAG, LIFT, LOWEST_PRESSURE, MOMENT, OUTPUTS, Peak, TRANSITION_X, VISCOUS_DRAG, WAVE_DRAG, WallPressure,
    lowest, outputs,
};
use super::system::{Numbers, Problem};
use super::tubes::{cell, cell_inputs};
use crate::flow::coefficients::{Coefficients, Derivatives, Gradients};
use crate::flow::field::{FieldBlock, FlowField};
use crate::flow::layer::{Derived, EdgeLaw, Regime, Side, State};
use crate::flow::panel::{LAMINAR_REVERSED, Nodes, TURBULENT_REVERSED};
use crate::flow::solution::{Distributions, Record, StationFlow};
use std::sync::{Arc, OnceLock};

/// A solution of the streamtube solver, or the last state of one that was not found.
#[derive(Debug)]
pub(super) struct StreamtubeRecord {
    pub problem: Problem,
    pub unknowns: Unknowns,
    pub nodes: Nodes,
    /// Outputs; NaN where the state has none.
    pub outputs: [f64; OUTPUTS],
    /// Lowest pressures of both sides.
    peaks: [Peak; 2],
    geometry: Option<Geometry<f64>>,
    flow: Flow<f64>,
    /// Where the factors of the last steps to the solution were made.
    pub base: Option<Arc<Base>>,
    derivatives: OnceLock<Option<[Derivatives; OUTPUTS]>>,
}

/// Pressure coefficients and logarithms of the speed on the wall of both sides, from the nose on.
fn wall_flow(problem: &Problem, numbers: &Numbers<f64>, flow: &Flow<f64>) -> [Vec<[f64; 2]>; 2] {
    let grid = &problem.grid;
    Side::BOTH.map(|side| {
        let tube = grid.inner_tube(side);
        let kernel = WallPressure { cell: cell(grid, tube), side };
        let at = |station: usize| {
            let inputs = cell_inputs(grid, station, tube).map(|input| numbers.read(input));
            kernel.evaluate::<f64, f64>(inputs, flow)
        };
        (grid.stations.nose()..=grid.stations.edge()).map(at).collect()
    })
}

impl StreamtubeRecord {
    pub fn new(problem: Problem, unknowns: Unknowns, nodes: Nodes) -> Self {
        let flow = problem.flow();
        let geometry = problem.geometry(&unknowns);
        let none = Peak { first: 0, weights: [0.0; 3], value: f64::NAN };
        let peaks = geometry.as_ref().map_or([none; 2], |geometry| {
            let wall = wall_flow(&problem, &Numbers { geometry, unknowns: &unknowns }, &flow);
            wall.map(|side| Peak::of(&side.iter().map(|v| v[0]).collect::<Vec<_>>()))
        });
        let of = |geometry: &Geometry<f64>| {
            problem.residuals_at(geometry, &flow, &unknowns, |pass| outputs(&problem.grid, &peaks, pass)).outputs
        };
        let mut outputs = geometry.as_ref().map_or([f64::NAN; OUTPUTS], of);
        outputs[LOWEST_PRESSURE] = lowest([peaks[0].value, peaks[1].value]).0;
        Self { problem, unknowns, nodes, outputs, peaks, geometry, flow, base: None, derivatives: OnceLock::new() }
    }

    /// Lowest pressures of both sides.
    #[cfg(test)]
    pub fn peaks(&self) -> &[Peak; 2] {
        &self.peaks
    }

    pub fn alpha(&self) -> f64 {
        self.unknowns.globals[ALPHA]
    }

    pub fn coefficients(&self) -> Coefficients {
        let of = |k: usize| self.outputs[k];
        Coefficients {
            cl: of(LIFT),
            cd: of(WAVE_DRAG) + of(VISCOUS_DRAG),
            cm: of(MOMENT),
            cp_min: of(LOWEST_PRESSURE),
            transition: TRANSITION_X.map(of),
        }
    }

    pub fn wave_drag(&self) -> f64 {
        self.outputs[WAVE_DRAG]
    }

    pub fn friction_drag(&self) -> f64 {
        self.outputs[FRICTION_DRAG]
    }

    /// Coordinate x of the stagnation point, in chords.
    pub fn stagnation(&self) -> f64 {
        self.geometry.as_ref().map_or(f64::NAN, |g| g.wall.points[0][0][0])
    }

    /// State of a station of the layer.
    fn derived(&self, station: usize, sheet: Sheet) -> (Regime, Derived<f64>) {
        let grid = &self.problem.grid;
        let x = self.unknowns.layer(grid, station, sheet);
        let regime = grid.regime(station, sheet);
        (regime, Derived::new(State::from_fn(|k| x[k]), regime, &self.flow.stream))
    }

    /// Length of reversed flow over the length of the side, for the side where that is larger.
    pub fn reversed_extent(&self) -> f64 {
        Side::BOTH.map(|side| self.reversed(side)).into_iter().fold(0.0, f64::max)
    }

    fn reversed(&self, side: Side) -> f64 {
        let (grid, Some(geometry)) = (&self.problem.grid, &self.geometry) else { return 0.0 };
        if !grid.viscous {
            return 0.0;
        }
        let (nose, arcs) = (grid.stations.nose(), &geometry.wall.arcs[side.index()]);
        let reversed = |k: &usize| {
            let (regime, derived) = self.derived(nose + k, Sheet::Wall(side));
            derived.hk > if regime == Regime::Laminar { LAMINAR_REVERSED } else { TURBULENT_REVERSED }
        };
        let length: f64 = (2..arcs.len()).filter(reversed).map(|k| arcs[k] - arcs[k - 1]).sum();
        length / arcs[arcs.len() - 1]
    }

    /// Coordinate x of the first place, in chords, at which a tube has no area because the grid turns over there.
    pub fn turned(&self) -> Option<f64> {
        let geometry = self.geometry.as_ref()?;
        let grid = &self.problem.grid;
        // written so that NaN is none
        let number = self.problem.areas(geometry).iter().position(|area| !(*area > 0.0))?;
        let line = grid.lower_line(number % grid.tubes());
        Some(geometry.node(number / grid.tubes(), line)[0])
    }

    /// The highest Mach number at the edge of the layers, with its x in chords.
    pub fn highest_mach(&self) -> (f64, f64) {
        let Some(geometry) = &self.geometry else { return (f64::NAN, f64::NAN) };
        let wall = self.wall(geometry);
        let mut highest = (0.0, 0.0);
        for (points, flow) in geometry.wall.points.iter().zip(&wall) {
            for (point, values) in points.iter().zip(flow) {
                let mach = self.flow.mach2::<f64>(values[1].exp()).max(0.0).sqrt();
                if mach > highest.0 {
                    highest = (mach, point[0]);
                }
            }
        }
        highest
    }

    fn wall(&self, geometry: &Geometry<f64>) -> [Vec<[f64; 2]>; 2] {
        wall_flow(&self.problem, &Numbers { geometry, unknowns: &self.unknowns }, &self.flow)
    }

    fn station(&self, station: usize, sheet: Sheet, s: f64, [x, y]: [f64; 2], cp: f64) -> StationFlow {
        let (regime, d) = self.derived(station, sheet);
        let laminar = regime == Regime::Laminar;
        StationFlow {
            s,
            x,
            y,
            edge_velocity: self.flow.stream.edge(d.speed).speed,
            mach: d.mach2.sqrt(),
            cp,
            momentum_thickness: d.theta,
            displacement_thickness: d.displacement,
            shape_parameter: d.hk,
            skin_friction: d.friction,
            amplification: if laminar { d.state.amplification() } else { 0.0 },
            shear_stress: if laminar { 0.0 } else { d.stress * d.stress },
        }
    }

    fn side_flow(&self, side: Side, geometry: &Geometry<f64>, wall: &[[f64; 2]]) -> Vec<StationFlow> {
        let (nose, k) = (self.problem.grid.stations.nose(), side.index());
        let (points, arcs) = (&geometry.wall.points[k], &geometry.wall.arcs[k]);
        let station = |n: usize| self.station(nose + n, Sheet::Wall(side), arcs[n], points[n], wall[n][0]);
        (1..points.len()).map(station).collect()
    }

    fn wake_flow(&self, geometry: &Geometry<f64>) -> Vec<StationFlow> {
        let grid = &self.problem.grid;
        let edge = grid.stations.edge();
        let station = |i: usize| {
            let [a, b] = Side::BOTH.map(|side| geometry.node(i, grid.line(side, 0)));
            let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
            let speed = self.unknowns.at(grid.layer(i, Sheet::Wake, SPEED)).exp();
            // without losses ahead of the wake; behind a shock the pressure is lower than this
            let cp = self.flow.coefficient(self.flow.isentropic_pressure::<f64>(speed));
            self.station(i, Sheet::Wake, grid.stations.behind[i - edge], middle, cp)
        };
        (edge..grid.count()).map(station).collect()
    }

    /// Pressure coefficients at the nodes of the section, straight between the wall stations over the arc length.
    fn at_nodes(&self, geometry: &Geometry<f64>, wall: &[Vec<[f64; 2]>; 2]) -> Vec<f64> {
        let stagnation = self.unknowns.globals[STAGNATION];
        let mut place = 0.0;
        let mut before: Option<[f64; 2]> = None;
        let at = |node: &[f64; 2]| {
            place += before.map_or(0.0, |b| crate::plane::distance(b, *node));
            before = Some(*node);
            let side = if place < stagnation { Side::Upper } else { Side::Lower };
            let (arcs, flow) = (&geometry.wall.arcs[side.index()], &wall[side.index()]);
            let s = side.distance(stagnation, place);
            let k = arcs.partition_point(|a| *a < s).clamp(1, arcs.len() - 1);
            let share = ((s - arcs[k - 1]) / (arcs[k] - arcs[k - 1])).clamp(0.0, 1.0);
            flow[k - 1][0] + share * (flow[k][0] - flow[k - 1][0])
        };
        self.problem.nodes.iter().map(at).collect()
    }

    /// The flow on one side of the dividing streamline. Points are the middles of the cells of the grid, and of the segments
    /// of the dividing streamline.
    fn block(&self, side: Side, geometry: &Geometry<f64>, wall: &[[f64; 2]]) -> FieldBlock {
        let grid = &self.problem.grid;
        let middle =
            |corners: &[[f64; 2]]| [0, 1].map(|c| corners.iter().map(|p| p[c]).sum::<f64>() / corners.len() as f64);
        let mach = |speed: f64| self.flow.mach2::<f64>(speed).max(0.0).sqrt();
        let mut block = FieldBlock::default();
        for station in 0..grid.count() - 1 {
            let ends = |height: usize| [0, 1].map(|k| geometry.node(station + k, grid.line(side, height)));
            let tube = |height: usize| match side {
                Side::Upper => grid.half() + height,
                Side::Lower => grid.half() - 1 - height,
            };
            let speed = |height: usize| self.unknowns.at(grid.speed(station, tube(height)));
            let nose = grid.stations.nose();
            // the segment at the nose has a stagnation point, at which the logarithm of the speed says nothing
            let on_wall = station > nose && station < grid.stations.edge();
            let inner =
                if on_wall { (0.5 * (wall[station - nose][1] + wall[station + 1 - nose][1])).exp() } else { speed(0) };
            let cells = |height: usize| {
                let ([a, b], [c, d]) = (ends(height), ends(height + 1));
                middle(&[a, b, c, d])
            };
            block.points.push(std::iter::once(middle(&ends(0))).chain((0..grid.half()).map(cells)).collect());
            block.mach.push(std::iter::once(inner).chain((0..grid.half()).map(speed)).map(mach).collect());
        }
        block
    }

    /// Exact derivatives of all outputs at fixed angle of attack with respect to the nodes as they were given.
    fn derivatives(&self) -> Option<&[Derivatives; OUTPUTS]> {
        let find = || {
            let geometry = self.geometry.as_ref()?;
            let inside = derivatives(&self.problem, &self.unknowns, geometry, self.base.as_ref(), &self.peaks)?;
            let frame = self.nodes.frame.derivatives(&self.nodes.given);
            Some(inside.map(|by| frame.pull_back(by)))
        };
        self.derivatives.get_or_init(find).as_ref()
    }
}

impl Record for StreamtubeRecord {
    fn nodes(&self) -> &[[f64; 2]] {
        &self.nodes.given
    }

    fn chord(&self) -> f64 {
        self.nodes.frame.chord()
    }

    fn gradients(&self) -> Option<Gradients> {
        let all = self.derivatives()?;
        let of = |k: usize| all[k].clone();
        Some(Coefficients {
            cl: of(LIFT),
            cd: of(WAVE_DRAG).plus(1.0, &all[VISCOUS_DRAG]),
            cm: of(MOMENT),
            cp_min: of(LOWEST_PRESSURE),
            transition: TRANSITION_X.map(of),
        })
    }

    fn wave_drag_gradient(&self) -> Option<Derivatives> {
        Some(self.derivatives()?[WAVE_DRAG].clone())
    }

    fn distributions(&self) -> Distributions {
        let nodes = self.problem.nodes.clone();
        let Some(geometry) = &self.geometry else {
            let none = Vec::new;
            return Distributions {
                nodes,
                cp: none(),
                cp_inviscid: none(),
                upper: vec![],
                lower: vec![],
                wake: vec![],
            };
        };
        let mut wall = self.wall(geometry);
        // air at rest at the stagnation point
        let rest = self.flow.coefficient(self.flow.isentropic_pressure::<f64>(0.0));
        wall.iter_mut().for_each(|side| side[0][0] = rest);
        // one pressure at the trailing edge
        let last = wall[0].len() - 1;
        let edge = 0.5 * (wall[0][last][0] + wall[1][last][0]);
        wall.iter_mut().for_each(|side| side[last][0] = edge);
        let [upper, lower] = Side::BOTH.map(|side| self.side_flow(side, geometry, &wall[side.index()]));
        Distributions {
            nodes,
            cp: self.at_nodes(geometry, &wall),
            cp_inviscid: Vec::new(),
            upper,
            lower,
            wake: self.wake_flow(geometry),
        }
    }

    fn field(&self) -> Option<FlowField> {
        let geometry = self.geometry.as_ref()?;
        let wall = self.wall(geometry);
        let [upper, lower] = Side::BOTH.map(|side| self.block(side, geometry, &wall[side.index()]));
        Some(FlowField { upper, lower })
    }
}
