//! The start of a flow from nothing: a ladder from slow flow without layers to the flow that is sought.
//!
//! The stagnation point and the circulation come from a panel solution. The flow is started slow and without boundary
//! layer, the layers are put in by closed formulas, then the Mach number is raised with strong dissipation, the dissipation
//! is taken back, and at last free transition is let go.

use super::equations::Held;
use super::gas::Parameters;
use super::geometry::CARRY;
use super::geometry::displacement_thickness;
use super::kernel::{Kernel, Row};
use super::limits::Limits;
use super::newton::{Ended, From, solve};
use super::numbering::{ALPHA, CIRCULATION, Grid, LAYER, SPEED, STAGNATION, Sheet, TRANSITION, Unknowns};
use super::outputs::{LIFT, WallPressure, wall_loads};
use super::refine::straight;
use super::settings::StreamtubeSettings;
use super::system::{Numbers, Problem};
use super::tubes::{cell, cell_inputs};
use crate::flow::layer::{EdgeLaw, FreeStream, Regime, Side, State, transition_state};
use crate::flow::solution::StationFlow;

/// Smallest and largest Mach number of the slow flow. Slower flow is led to the Mach number that is sought from there: its
/// static pressure is so large against the dynamic one that steps from a first guess leave tubes without a total pressure.
const SLOW: [f64; 2] = [0.25, 0.4];
/// Strength and threshold of the strong dissipation.
const STRONG: (f64, f64) = (2.0, 0.90);
/// Largest local Mach number of the first guess.
const CAP: f64 = 0.9;
/// Residual at which a stage that is only passed through ends.
const PASSED: f64 = 1e-2;
/// Residual of the slow flow above which faster flow is not tried.
const HOPELESS: f64 = 0.5;
/// Number of steps of which nothing comes until another way to a lift is tried.
const LIFT_PATIENCE: usize = 12;
/// Share of the way to a lift in one step, and the residual above which it is not gone on, where larger steps lead astray:
/// a layer that is about to separate behind the nose does not survive a large change of the angle.
const SLOWLY: (f64, f64) = (0.15, 0.05);
/// Residual at which the last stage but one ends.
pub(super) const NEARLY: f64 = 1e-4;

/// The first guess of the outer flow.
#[derive(Debug, Clone)]
pub(super) struct Guess {
    /// Arc length of the stagnation point from the first node.
    pub stagnation: f64,
    /// Circulation, clockwise.
    pub circulation: f64,
    /// Angle of attack against the chord line.
    pub alpha: f64,
    /// Arc lengths from the stagnation point to transition.
    pub transition: [f64; 2],
    /// Whether small speeds may change by more than a quarter of themselves.
    pub relaxed: bool,
    /// Whether a lift that is sought is held from the slow flow on, and not put in at the end. Close to an angle at which
    /// the flow jumps from one branch to another, there may be no flow at the angle that is guessed.
    pub lift_first: bool,
    /// Largest number of steps of which nothing comes.
    pub patience: usize,
    /// Layers of a slow flow on both sides, from the stagnation point on.
    pub layers: Option<[Vec<StationFlow>; 2]>,
}

/// Solves `problem` from nothing; the unknowns hold the last state. Transition is kept where the guess has it, at trips
/// too: a layer that would turn turbulent ahead of its trip in one of the flows on the way would drag its stations along.
pub(super) fn climb(problem: &Problem, guess: &Guess, settings: &StreamtubeSettings) -> (Unknowns, Ended) {
    let limits = |steps: usize, tolerance: f64| Limits {
        patience: guess.patience,
        relaxed: guess.relaxed,
        ..Limits::new(steps, tolerance)
    };
    let lifted = problem.held == Held::Lift;
    let mut target = problem.parameters;
    if lifted {
        target.incidence = guess.alpha;
    }
    let lifted_flow = Problem { fixed_transition: Some(guess.transition), ..problem.clone() };
    let angled_flow = Problem { held: Held::Angle, parameters: target, ..lifted_flow.clone() };
    let stages = |of: &Problem| {
        let target = of.parameters;
        let strong = Parameters { strength: STRONG.0, threshold: STRONG.1, order: 0.0, ..target };
        [Parameters { mach: target.mach.clamp(SLOW[0], SLOW[1]), ..strong }, strong]
    };
    let mut problem = &angled_flow;
    let [mut slow, mut strong] = stages(problem);
    let mut total = 0;
    let mut counted = |ended: Ended| {
        total += ended.steps;
        Ended { steps: total, ..ended }
    };

    let mut inviscid = Problem { parameters: slow, ..problem.clone() };
    inviscid.grid.viscous = false;
    let mut unknowns = first_guess(&inviscid, guess);
    counted(solve(&inviscid, None, &mut unknowns, &limits(3, 1e-4)));

    let stage = Problem { parameters: slow, ..problem.clone() };
    if problem.grid.viscous {
        unknowns = with_layers(&inviscid, &unknowns, &stage, guess.layers.as_ref());
        speeds_from_areas(&stage, &mut unknowns);
    }
    let ended = counted(solve(&stage, None, &mut unknowns, &limits(30, PASSED)));
    // written so that NaN ends it
    if !(ended.residual < HOPELESS) {
        return (unknowns, ended);
    }
    let at_once = lifted && guess.lift_first;
    if at_once {
        let reached = lift(&stage, &unknowns);
        problem = &lifted_flow;
        [slow, strong] = stages(problem);
        let stage = Problem { parameters: slow, ..problem.clone() };
        let from = From { parameters: Parameters { incidence: reached, ..slow }, nodes: None };
        let ended = counted(solve(&stage, Some(from), &mut unknowns, &limits(30, PASSED)));
        if !(ended.residual < HOPELESS) {
            return (unknowns, ended);
        }
    }
    let stage = Problem { parameters: strong, ..problem.clone() };
    let from = (target.mach != slow.mach).then_some(From { parameters: slow, nodes: None });
    let ended = counted(solve(&stage, from, &mut unknowns, &limits(40, PASSED)));
    if !ended.converged {
        return (unknowns, ended);
    }
    let end = limits(settings.iterations, NEARLY);
    let late = lifted && !at_once;
    let last = Limits { stride: 0.34, hold: 0.1, ..end };
    let mut ended = counted(solve(problem, Some(From { parameters: strong, nodes: None }), &mut unknowns, &last));
    if late && ended.converged {
        let reached = lift(problem, &unknowns);
        let from = From { parameters: Parameters { incidence: reached, ..lifted_flow.parameters }, nodes: None };
        let way = Limits { patience: LIFT_PATIENCE.min(guess.patience), ..end };
        let before = unknowns.clone();
        ended = counted(solve(&lifted_flow, Some(from), &mut unknowns, &way));
        if !ended.converged {
            unknowns = before;
            let (stride, hold) = SLOWLY;
            ended = counted(solve(&lifted_flow, Some(from), &mut unknowns, &Limits { stride, hold, ..way }));
        }
    }
    (unknowns, ended)
}

/// Lift coefficient of a flow.
fn lift(problem: &Problem, unknowns: &Unknowns) -> f64 {
    let target = |load: usize| (load == LIFT).then_some((Row::Output(LIFT), 1.0));
    let found = problem.residuals_in(&problem.nodes, &problem.parameters, unknowns, |pass| {
        wall_loads(&problem.grid, pass, target);
    });
    found.map_or(f64::NAN, |residuals| residuals.outputs[LIFT])
}

/// The first guess: the background grid, and speeds from the areas of its tubes.
fn first_guess(problem: &Problem, guess: &Guess) -> Unknowns {
    let mut unknowns = Unknowns::zeros(&problem.grid);
    unknowns.globals[STAGNATION] = guess.stagnation;
    unknowns.globals[CIRCULATION] = guess.circulation;
    unknowns.globals[ALPHA] = guess.alpha;
    for (g, transition) in TRANSITION.into_iter().zip(guess.transition) {
        unknowns.globals[g] = transition;
    }
    speeds_from_areas(problem, &mut unknowns);
    unknowns
}

/// Sets all speeds to the subsonic ones of the areas of the tubes.
fn speeds_from_areas(problem: &Problem, unknowns: &mut Unknowns) {
    let (grid, flow) = (&problem.grid, problem.flow());
    let Some(geometry) = problem.geometry(unknowns) else { return };
    let areas = problem.areas(&geometry);
    for station in 0..grid.count() - 1 {
        for tube in 0..grid.tubes() {
            let area = areas[station * grid.tubes() + tube];
            unknowns.set(grid.speed(station, tube), flow.subsonic_speed(grid.mass(tube) / area, CAP));
        }
    }
}

/// Speeds on the dividing line: both sides of the wall from the nose on, and the wake from the edge on.
fn edge_speeds(problem: &Problem, unknowns: &Unknowns) -> Option<[Vec<f64>; 3]> {
    let (grid, flow) = (&problem.grid, problem.flow());
    let geometry = problem.geometry(unknowns)?;
    let numbers = Numbers { geometry: &geometry, unknowns };
    let speed = |station: usize, side: Side| {
        let tube = grid.inner_tube(side);
        let kernel = WallPressure { cell: cell(grid, tube), side };
        let inputs = cell_inputs(grid, station, tube).map(|input| numbers.read(input));
        kernel.evaluate::<f64, f64>(inputs, &flow)[1].exp()
    };
    let (nose, edge) = (grid.stations.nose(), grid.stations.edge());
    let wall = |side: Side| (nose..=edge).map(|i| speed(i, side)).collect::<Vec<_>>();
    let [upper, lower] = [wall(Side::Upper), wall(Side::Lower)];
    let wake = (edge..grid.count() - 1)
        .map(|i| (0.5 * (speed(i, Side::Upper).ln() + speed(i, Side::Lower).ln())).exp())
        .collect();
    Some([upper, lower, wake])
}

/// The flow with layers put in by closed formulas, from one without.
fn with_layers(inviscid: &Problem, from: &Unknowns, to: &Problem, layers: Option<&[Vec<StationFlow>; 2]>) -> Unknowns {
    let (old, grid) = (&inviscid.grid, &to.grid);
    let mut unknowns = Unknowns { globals: from.globals, ..Unknowns::zeros(grid) };
    for station in 0..grid.count() {
        let lines = grid.displacements();
        unknowns.stations[station][..lines].copy_from_slice(&from.stations[station][..lines]);
        let start = grid.speeds_start(station);
        unknowns.stations[station][start..].copy_from_slice(&from.stations[station][old.speeds_start(station)..]);
    }
    let (Some(speeds), Some(geometry)) = (edge_speeds(inviscid, from), inviscid.geometry(from)) else {
        return unknowns;
    };
    let law = to.flow().stream;
    for side in Side::BOTH {
        let k = side.index();
        let arcs = &geometry.wall.arcs[k];
        let known = layers.and_then(|layers| known_layer(grid, side, arcs, &layers[k]));
        let states = known.unwrap_or_else(|| layer_guess(grid, side, arcs, &speeds[k], law));
        for (number, state) in states.into_iter().enumerate() {
            set_layer(grid, &mut unknowns, grid.stations.nose() + 1 + number, Sheet::Wall(side), state);
        }
    }
    wake_guess(grid, &mut unknowns, &speeds[2]);
    shift_wake(grid, &mut unknowns, law);
    unknowns
}

fn set_layer(grid: &Grid, unknowns: &mut Unknowns, station: usize, sheet: Sheet, state: State) {
    for (k, value) in state.numbers().into_iter().enumerate() {
        unknowns.set(grid.layer(station, sheet, k), value);
    }
}

/// States of the stations of a side behind the nose, from those of another flow; `None` where that has too few.
fn known_layer(grid: &Grid, side: Side, x: &[f64], flow: &[StationFlow]) -> Option<Vec<State>> {
    let turning = grid.stations.turning[side.index()];
    let of = |laminar: bool| -> Vec<&StationFlow> {
        flow.iter().filter(|s| s.s > 0.0 && (s.shear_stress == 0.0) == laminar).collect()
    };
    let parts = [of(true), of(false)];
    if parts.iter().any(|part| part.len() < 2) {
        return None;
    }
    let state = |k: usize| {
        let laminar = k <= turning;
        let part = &parts[usize::from(!laminar)];
        let places: Vec<f64> = part.iter().map(|s| s.s.ln()).collect();
        let (n, share) = straight(&places, x[k].ln());
        let between = |of: &dyn Fn(&StationFlow) -> f64| of(part[n]) + share * (of(part[n + 1]) - of(part[n]));
        let ahead = if laminar { (x[k].ln() - places[0]).min(0.0) } else { 0.0 };
        State {
            log_theta: between(&|s| s.momentum_thickness.ln()),
            log_shape: between(&|s| (s.shape_parameter - 1.0).ln()),
            third: between(&|s| if laminar { s.amplification } else { 0.5 * s.shear_stress.ln() }),
            log_speed: between(&|s| s.edge_velocity.ln()) + ahead,
        }
    };
    let states: Vec<State> = (1..x.len()).map(state).collect();
    states.iter().all(|s| s.numbers().iter().all(|v| v.is_finite())).then_some(states)
}

/// The speeds with the fall to the trailing edge filled, as the layer will fill it.
fn filled(x: &[f64], speeds: &[f64]) -> Vec<f64> {
    let mut u: Vec<f64> = speeds.iter().map(|u| u.max(0.02)).collect();
    u[0] = 0.0;
    let n = x.len() - 1;
    let before = |share: f64| (0..n).rev().find(|&k| x[k] < share * x[n]).unwrap_or(1);
    let (a, b) = (before(0.90).min(n - 2).max(1), before(0.95).max(2));
    if a >= b {
        return u;
    }
    for k in b + 1..=n {
        let straight = u[b] + (u[b] - u[a]) * (x[k] - x[b]) / (x[b] - x[a]);
        u[k] = straight.max(0.5 * u[b]);
    }
    u
}

/// States of the stations of a side behind the nose: Thwaites' method for laminar layers, Spence's for turbulent ones.
fn layer_guess(grid: &Grid, side: Side, x: &[f64], speeds: &[f64], law: FreeStream<f64>) -> Vec<State> {
    let n = x.len() - 1;
    let u = filled(x, speeds);
    let turning = grid.stations.turning[side.index()];
    let mut integral = u[1].powi(5) * x[1] / 6.0;
    let (mut theta, mut hk) = (0.0f64, 2.3f64);
    let mut states: Vec<State> = Vec::with_capacity(n);
    let reynolds = |k: usize| law.edge(u[k]).reynolds / u[k];
    for k in 1..=turning {
        if k > 1 {
            integral += 0.5 * (u[k].powi(5) + u[k - 1].powi(5)) * (x[k] - x[k - 1]);
        }
        let square = 0.45 * integral / (u[k].powi(6) * reynolds(k));
        let slope = if k == 1 { u[1] / x[1] } else { (u[k + 1] - u[k - 1]) / (x[k + 1] - x[k - 1]) };
        let lambda = (square * slope * reynolds(k)).clamp(-0.085, 0.12);
        hk =
            if lambda > 0.0 { 2.61 - 3.75 * lambda + 5.24 * lambda * lambda } else { 2.088 + 0.0731 / (lambda + 0.14) };
        hk = hk.min(3.2);
        theta = square.sqrt();
        states.push(State { log_theta: theta.ln(), log_shape: (hk - 1.0).ln(), third: 0.0, log_speed: u[k].ln() });
    }
    let stress = |state: State| transition_state(state, &law).third;
    let (theta0, hk0, behind) = (theta, hk, stress(states[turning - 1]));
    let next = turning + 1;
    let mut moment = theta0.powf(1.2) * reynolds(next).powf(0.2) * u[next].powf(0.2) * u[turning].powi(4);
    for k in next..=n {
        moment += 0.0106 * 0.5 * (u[k].powi(4) + u[k - 1].powi(4)) * (x[k] - x[k - 1]);
        let theta = (moment / (u[k].powi(4) * law.edge(u[k]).reynolds.powf(0.2))).powf(1.0 / 1.2);
        let fade = (-(x[k] - x[turning]) / (60.0 * theta0)).exp();
        let shape = 1.5 + (hk0 - 1.5) * fade;
        let state = State { log_theta: theta.ln(), log_shape: (shape - 1.0).ln(), third: 0.0, log_speed: u[k].ln() };
        let level = stress(state).max(-3.5);
        states.push(State { third: level + (behind - level) * fade, ..state });
    }
    debug_assert!(grid.regime(grid.stations.nose() + turning, Sheet::Wall(side)) == Regime::Laminar);
    states
}

/// The wake behind both layers.
fn wake_guess(grid: &Grid, unknowns: &mut Unknowns, speeds: &[f64]) {
    let edge = grid.stations.edge();
    let [a, b] = Side::BOTH.map(|side| {
        let x = unknowns.layer(grid, edge, Sheet::Wall(side));
        State::from_fn(|k| x[k])
    });
    let theta = a.theta() + b.theta();
    let start = (0.5 * (a.log_speed + b.log_speed)).exp();
    let shape = (a.kinematic_shape() * a.theta() + b.kinematic_shape() * b.theta()) / theta;
    let mut last = start;
    for station in edge..grid.count() {
        let distance = grid.stations.behind[station - edge];
        let free = speeds.get(station - edge).map_or(last, |u| u.max(0.6));
        let u = start + (free - start) * (1.0 - (-distance / 0.05).exp());
        let hk = 1.05 + (shape - 1.05) * (-distance / (40.0 * theta)).exp();
        let state = State {
            log_theta: (theta * (start / u).powf(2.5)).ln(),
            log_shape: (hk - 1.0).ln(),
            third: 0.5 * (a.third + b.third),
            log_speed: u.ln(),
        };
        set_layer(grid, unknowns, station, Sheet::Wake, state);
        last = free;
    }
}

/// Moves the wake, and the lines with it, by half the difference of both displacement thicknesses at the edge.
fn shift_wake(grid: &Grid, unknowns: &mut Unknowns, law: FreeStream<f64>) {
    let edge = grid.stations.edge();
    let [upper, lower] =
        Side::BOTH.map(|side| displacement_thickness(unknowns.layer(grid, edge, Sheet::Wall(side)), &law));
    for station in edge + 1..grid.count() {
        let shift = 0.5 * (upper - lower) * (-grid.stations.behind[station - edge] / CARRY).exp();
        for line in 0..grid.lines() {
            let (side, height) = grid.side_of(line);
            // both copies of the dividing line share one displacement
            if height == 0 && side == Side::Lower {
                continue;
            }
            let place = grid.displacement(station, line);
            let fading = (-grid.stations.heights[height] / CARRY).exp();
            unknowns.set(place, unknowns.at(place) + fading * shift);
        }
    }
    debug_assert_eq!((LAYER, SPEED), (4, 3));
}
