//! The outputs of a flow as terms: forces, moment, drag, and what else is read off a solution.

use super::cell::unpack;
use super::cell::{Cell, Exit, Face};
use super::gas::Flow;
use super::kernel::{Identity, Input, Kernel, Pass, Row, Target};
use super::layer_kernels::Friction;
use super::numbering::{ALPHA, Grid, LAYER, Sheet};
use super::tubes::{cell, cell_inputs, face_inputs};
use crate::flow::layer::{Derived, Regime, Side, State};
use crate::scalar::{Over, Scalar};

/// Number of outputs.
pub(super) const OUTPUTS: usize = 8;
/// Output: lift coefficient from the pressure on the wall.
pub(super) const LIFT: usize = 0;
/// Output: moment coefficient about the quarter chord.
pub(super) const MOMENT: usize = 1;
/// Output: wave drag coefficient, from the tubes at the exit.
pub(super) const WAVE_DRAG: usize = 2;
/// Output: drag coefficient of the wake of the boundary layers.
pub(super) const VISCOUS_DRAG: usize = 3;
/// Output: friction drag coefficient.
pub(super) const FRICTION_DRAG: usize = 4;
/// Output: lowest pressure coefficient on the wall.
pub(super) const LOWEST_PRESSURE: usize = 5;
/// Outputs: x of transition on both sides.
pub(super) const TRANSITION_X: [usize; 2] = [6, 7];

/// Pressure on the wall as load of a wall station. Inputs: those of a cell, three neighbouring wall points (from the
/// stagnation point on), angle of attack. Results: lift and moment.
struct WallLoad {
    cell: Cell,
    side: Side,
    /// Whether this is the nose, where the pressure is that of air at rest.
    nose: bool,
}

impl Kernel<23, 2> for WallLoad {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 23], flow: &Flow<P>) -> [S; 2] {
        let pressure = if self.nose {
            flow.isentropic_pressure(S::from(0.0))
        } else {
            let (low, high, q) = unpack(&x);
            let m = self.cell.momentum(low, high, q, flow);
            match self.side {
                Side::Upper => m.below,
                Side::Lower => m.above,
            }
        };
        let cp = flow.coefficient(pressure);
        let point = |k: usize| [x[16 + 2 * k], x[17 + 2 * k]];
        let (sin, cos) = x[22].sin_cos();
        let [mut force_x, mut force_y, mut moment] = [S::from(0.0); 3];
        for k in 0..2 {
            let ([x0, y0], [x1, y1]) = (point(k), point(k + 1));
            let (dx, dy) = ((x1 - x0) * 0.5, (y1 - y0) * 0.5);
            force_x += dy;
            force_y -= dx;
            moment += ((x0 + x1) * 0.5 - 0.25) * dx + (y0 + y1) * 0.5 * dy;
        }
        // the outward normal of the upper side stands to the left of the way from the nose
        let cp = cp * self.side.sign();
        [(force_y * cos - force_x * sin) * cp, moment * cp]
    }
}

/// Adds the loads of all wall stations to the targets that `target` gives for lift and moment.
pub(super) fn wall_loads(grid: &Grid, pass: &mut impl Pass, target: impl Fn(usize) -> Target) {
    let targets = [LIFT, MOMENT].map(target);
    let nose = grid.stations.nose();
    let count = grid.stations.fractions.len();
    for side in Side::BOTH {
        for number in 0..count {
            let tube = grid.inner_tube(side);
            let cells = cell_inputs(grid, nose + number, tube);
            // a missing neighbour is the point itself
            let neighbours = [number.saturating_sub(1), number, (number + 1).min(count - 1)];
            let inputs = std::array::from_fn(|k| match k {
                0..16 => cells[k],
                16..22 => Input::Wall { side, point: neighbours[(k - 16) / 2], axis: k % 2 },
                _ => Input::Global(ALPHA),
            });
            pass.term(&WallLoad { cell: cell(grid, tube), side, nose: number == 0 }, inputs, targets);
        }
    }
}

/// Pressure coefficient on the wall. Inputs: those of a cell.
pub(super) struct WallPressure {
    pub cell: Cell,
    pub side: Side,
}

impl Kernel<16, 2> for WallPressure {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 16], flow: &Flow<P>) -> [S; 2] {
        let (low, high, q) = unpack(&x);
        let m = self.cell.momentum(low, high, q, flow);
        let (pressure, log_speed) = match self.side {
            Side::Upper => (m.below, m.log_speed_below),
            Side::Lower => (m.above, m.log_speed_above),
        };
        [flow.coefficient(pressure), log_speed]
    }
}

/// Drag coefficient of the boundary layers: twice the momentum thickness of the wake at its end, expanded to the
/// pressure of the onset flow. Inputs: the state of the wake, and nodes and speeds of the two inner tubes at the exit.
struct WakeDrag {
    masses: [f64; 2],
}

impl Kernel<22, 1> for WakeDrag {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 22], flow: &Flow<P>) -> [S; 1] {
        let derived = Derived::new(State::from_fn(|k| x[k]), Regime::Wake, &flow.stream_in());
        let expanded = |tube: usize| {
            let node = |k: usize| [x[4 + 8 * tube + 2 * k], x[5 + 8 * tube + 2 * k]];
            let face = Face::new([node(0), node(1)], [node(2), node(3)]);
            flow.expanded(x[20 + tube], face.area, self.masses[tube]).0
        };
        let speed = (expanded(0) + expanded(1)) * 0.5;
        // the shape parameter of a wake at rest in itself tends to that of the temperature alone
        let end = flow.mach2 * 0.403 + 1.0;
        let exponent = ((derived.shape + 2.0 - derived.mach2) + (end + 2.0 - flow.mach2)) * 0.5;
        let theta = derived.theta * ((derived.log_speed - speed.ln()) * exponent).exp();
        let density = flow.enthalpy(speed).recip() * (flow.static_pressure * 3.5);
        [theta * density * speed * speed * 2.0]
    }
}

/// Sharpness of the smooth minimum of the lowest pressures of both sides.
const SHARPNESS: f64 = 400.0;

/// The lowest pressure on a side: the wall stations about it and their weights in the parabola through them, over the
/// number of the station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Peak {
    pub first: usize,
    pub weights: [f64; 3],
    pub value: f64,
}

impl Peak {
    /// The lowest of pressure coefficients at the wall stations of a side, from the stagnation point on.
    pub fn of(cp: &[f64]) -> Self {
        let inner = 1..cp.len() - 1;
        let k = inner.fold(1, |best, k| if cp[k] < cp[best] { k } else { best });
        let [a, b, c] = [cp[k - 1], cp[k], cp[k + 1]];
        let bend = a - 2.0 * b + c;
        let u = if bend > 0.0 { (0.5 * (a - c) / bend).clamp(-1.0, 1.0) } else { 0.0 };
        let weights = [0.5 * u * (u - 1.0), 1.0 - u * u, 0.5 * u * (u + 1.0)];
        Self { first: k - 1, weights, value: weights[0] * a + weights[1] * b + weights[2] * c }
    }
}

/// Lowest pressure of both sides, and the share of each in it.
pub(super) fn lowest([upper, lower]: [f64; 2]) -> (f64, [f64; 2]) {
    type T = crate::differentiate::Tangent<2>;
    let both = T::from_re(upper).derivative(0).smooth_minimum(T::from_re(lower).derivative(1), SHARPNESS);
    (both.re, both.eps)
}

/// Goes over the terms of all outputs. `peaks` are the lowest pressures of both sides.
pub(super) fn outputs(grid: &Grid, peaks: &[Peak; 2], pass: &mut impl Pass) {
    let output = |k: usize, factor: f64| Some((Row::Output(k), factor));
    wall_loads(grid, pass, |load| output(load, 1.0));
    let last = grid.count() - 1;
    let face = |tube: usize| face_inputs(grid, last - 1, tube);
    for tube in 0..grid.tubes() {
        pass.term(&Exit { mass: grid.mass(tube) }, face(tube), [None, output(WAVE_DRAG, 1.0)]);
    }
    let (_, shares) = lowest([peaks[0].value, peaks[1].value]);
    for side in Side::BOTH {
        let k = side.index();
        let tube = grid.inner_tube(side);
        for (q, weight) in peaks[k].weights.into_iter().enumerate() {
            let inputs = cell_inputs(grid, grid.stations.nose() + peaks[k].first + q, tube);
            let target = output(LOWEST_PRESSURE, weight * shares[k]);
            pass.term(&WallPressure { cell: cell(grid, tube), side }, inputs, [target, None]);
        }
        let turning = Input::Wall { side, point: grid.stations.turning[k], axis: 0 };
        pass.term(&Identity, [turning], [output(TRANSITION_X[k], 1.0)]);
    }
    if grid.viscous {
        layer_outputs(grid, pass, face);
    }
}

fn layer_outputs(grid: &Grid, pass: &mut impl Pass, face: impl Fn(usize) -> [Input; 9]) {
    let output = |k: usize| Some((Row::Output(k), 1.0));
    let state = |station: usize, sheet: Sheet, k: usize| Input::Unknown(grid.layer(station, sheet, k));
    let tubes = Side::BOTH.map(|side| grid.inner_tube(side));
    let faces = tubes.map(face);
    let inputs = std::array::from_fn(|k| match k {
        0..4 => state(grid.count() - 1, Sheet::Wake, k),
        4..20 => faces[(k - 4) / 8][(k - 4) % 8],
        _ => faces[k - 20][8],
    });
    pass.term(&WakeDrag { masses: tubes.map(|t| grid.mass(t)) }, inputs, [output(VISCOUS_DRAG)]);
    let nose = grid.stations.nose();
    for side in Side::BOTH {
        let sheet = Sheet::Wall(side);
        for station in nose + 2..=grid.stations.edge() {
            let inputs = std::array::from_fn(|k| match k {
                0..8 => state(station - 1 + k / LAYER, sheet, k % LAYER),
                8..12 => Input::Wall { side, point: station - 1 - nose + (k - 8) / 2, axis: k % 2 },
                _ => Input::Global(ALPHA),
            });
            let regimes = [station - 1, station].map(|i| grid.regime(i, sheet));
            pass.term(&Friction { regimes }, inputs, [output(FRICTION_DRAG)]);
        }
    }
}
