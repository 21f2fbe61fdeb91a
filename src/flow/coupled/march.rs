//! A start of the Newton iteration by marching the boundary-layer equations downstream.
//!
//! Direct mode takes the inviscid speeds; where the layer would separate in them the shape parameter is prescribed
//! instead and the speed follows (inverse mode; Drela & Giles 1987). The result satisfies all boundary-layer
//! equations; only the speeds in separated regions disagree with the panels, and that is what Newton mends.

use super::chain::{Layer, wake_span};
use super::duals::{Dual2, Dual3, Dual4};
use super::system::System;
use super::transition::TURBULENT_REST;
use super::unknowns::{Side, Unknowns};
use crate::differentiate::Tangent;
use crate::flow::boundary_layer::interval::{self, Span};
use crate::flow::boundary_layer::station::{Derived, Regime, State, transition_state};
use nalgebra::{SMatrix, SVector};

/// Hk above which the march prescribes Hk.
const LAMINAR_LIMIT: f64 = 3.8;
const TURBULENT_LIMIT: f64 = 2.5;
const WAKE_LIMIT: f64 = 4.0;
/// Fractions of a side between which the speed is extrapolated to the trailing edge.
const EDGE: [f64; 2] = [0.88, 0.94];
/// Newton iterations at one station.
const ITERATIONS: usize = 25;
/// Residual and step from which one more step of Newton's method is enough.
const CLOSE: f64 = 1e-4;

/// What is prescribed at a station.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Speed,
    Shape,
}

/// The equations of one station as functions of what is free there: θ, then Hk or the speed, then the stress where it
/// belongs to the equations.
type Equations<'a, const N: usize> = dyn Fn(&Derived<Tangent<N>>) -> [Tangent<N>; N] + 'a;

/// A station with its free unknowns as variables.
fn variables<const N: usize>(state: &State<f64>, mode: Mode) -> State<Tangent<N>> {
    let mut result = state.map(Tangent::<N>::from_re);
    let free = match mode {
        Mode::Speed => &mut result.log_shape,
        Mode::Shape => &mut result.log_speed,
    };
    *free = free.derivative(1);
    result.log_theta = result.log_theta.derivative(0);
    if N > 2 {
        result.third = result.third.derivative(2);
    }
    result
}

/// Solves the equations of one station from `guess`; `None` where Newton's method does not get there.
fn solve_station<const N: usize>(
    layer: &Layer,
    regime: Regime,
    guess: State<f64>,
    mode: Mode,
    equations: &Equations<N>,
) -> Option<State<f64>> {
    let gas = layer.gas.map(Tangent::<N>::from_re);
    let mut state = guess;
    for _ in 0..ITERATIONS {
        let residuals = equations(&Derived::new(variables(&state, mode), regime, &gas));
        let worst = residuals.iter().fold(0.0, |w: f64, r| if r.re.is_nan() { f64::NAN } else { w.max(r.re.abs()) });
        if worst.is_nan() {
            return None;
        }
        let step = newton_step(&residuals)?;
        let third = if N > 2 { step[2] } else { 0.0 };
        let largest = step[0].abs().max(step[1].abs()).max(0.1 * third.abs());
        let factor = (0.5 / largest).min(1.0);
        state.log_theta += factor * step[0];
        state.third += factor * third;
        match mode {
            Mode::Speed => state.log_shape += factor * step[1],
            Mode::Shape => state.log_speed += factor * step[1],
        }
        // convergence is quadratic: what this step leaves is of no account
        if worst < CLOSE && largest < CLOSE {
            return Some(state);
        }
        if !state.log_theta.is_finite() || state.log_theta.abs() > 30.0 || state.log_shape > 4.5 {
            return None;
        }
    }
    None
}

/// Newton's step; `None` where the equations are singular.
fn newton_step<const N: usize>(residuals: &[Tangent<N>; N]) -> Option<[f64; N]> {
    let jacobian = SMatrix::<f64, N, N>::from_fn(|i, j| residuals[i].eps[j]);
    let right = SVector::<f64, N>::from_fn(|i, _| -residuals[i].re);
    jacobian.try_inverse().map(|inverse| (inverse * right).data.0[0])
}

/// One station of the march: direct, or with prescribed Hk where that separates or fails.
fn advance<const N: usize>(
    layer: &Layer,
    regime: Regime,
    before: &State<f64>,
    log_speed: f64,
    step: f64,
    equations: &Equations<N>,
) -> State<f64> {
    let limit = match regime {
        Regime::Laminar => LAMINAR_LIMIT,
        Regime::Turbulent => TURBULENT_LIMIT,
        Regime::Wake => WAKE_LIMIT,
    };
    let guess = State { log_speed, ..*before };
    let direct = solve_station(layer, regime, guess, Mode::Speed, equations);
    if let Some(state) = direct.filter(|s| s.kinematic_shape() < limit) {
        return state;
    }
    let (theta, hk) = (before.theta(), before.kinematic_shape());
    let target = match regime {
        Regime::Laminar => (hk + 0.03 * step / theta).clamp(limit, 6.0),
        Regime::Turbulent => (hk - 0.15 * step / theta).max(limit),
        Regime::Wake => 1.0 + (hk - 1.0) / (1.0 + 0.03 * step / theta),
    };
    // the wall can lie on both sides of the limit: come no faster than the layer can follow
    let target = target.min(hk * (1.0 + 0.3 * step / theta).min(1.3)).max(1.02);
    let guess = State { log_shape: (target - 1.0).ln(), log_speed: before.log_speed, ..*before };
    solve_station(layer, regime, guess, Mode::Shape, equations).unwrap_or(State { log_speed, ..guess })
}

/// The equations of the first station of a side.
pub(super) fn first_equations(x: f64) -> impl Fn(&Derived<Dual4>) -> [Dual4; 3] {
    move |d| {
        let [a, b] = interval::similarity(d, Dual4::from(x));
        [a, b, d.state.third]
    }
}

impl System<'_> {
    /// Start by marching, from the closed-form start.
    pub fn march(&self, closed_form: &Unknowns) -> Unknowns {
        let layer = self.layer();
        let numbering = layer.numbering;
        let mut unknowns = closed_form.clone();
        for side in Side::BOTH {
            let at = side.index();
            let length = match side {
                Side::Upper => unknowns.stagnation,
                Side::Lower => self.section.map.total - unknowns.stagnation,
            };
            let limit = self.trips[at].map_or(length, |s| side.sign() * (unknowns.stagnation - s));
            let limit = limit.clamp(0.004 * length, (1.0 - TURBULENT_REST) * length);
            let found = self.amplified(&layer, side, (limit, length), unknowns.stagnation);
            unknowns.transition[at] = found.clamp(0.003 * length, limit);
            let transition = unknowns.transition[at];
            let mut states = self.march_laminar(&layer, side, (transition, length), unknowns.stagnation, f64::INFINITY);
            self.march_turbulent(&layer, side, transition, length, unknowns.stagnation, &mut states);
            let from = numbering.station(side, 0);
            unknowns.stations[from..from + numbering.side].copy_from_slice(&states);
        }
        self.march_wake(&layer, &mut unknowns);
        unknowns
    }

    /// Speed the march is driven by, as logarithm: the inviscid one, without its fall to the stagnation point at the
    /// trailing edge, which the layer fills.
    fn log_speed(&self, side: Side, stagnation: f64, x: f64) -> f64 {
        let length = match side {
            Side::Upper => stagnation,
            Side::Lower => self.section.map.total - stagnation,
        };
        let [a, b] = [EDGE[0] * length, EDGE[1] * length];
        if x <= b {
            return self.inviscid_log_speed(side, stagnation, x);
        }
        let [from, to] = [a, b].map(|x| self.inviscid_log_speed(side, stagnation, x));
        to + (to - from) * (x - b) / (b - a)
    }

    fn inviscid_log_speed(&self, side: Side, stagnation: f64, x: f64) -> f64 {
        let t = self.section.map.index(stagnation - side.sign() * x);
        let speed = side.sign() * super::speeds::value_at(self.section, &self.flow.inviscid_spline, t);
        speed.max(0.5 * x.min(0.1)).ln()
    }

    /// Laminar stations of a side, up to the first whose amplification reaches `most`.
    fn march_laminar(
        &self,
        layer: &Layer,
        side: Side,
        (transition, length): (f64, f64),
        s0: f64,
        most: f64,
    ) -> Vec<State<f64>> {
        let x = self.layout.abscissas(transition, length);
        let gas = layer.gas;
        let mut states: Vec<State<f64>> = Vec::with_capacity(x.len());
        for j in 0..layer.numbering.laminar {
            let log_speed = self.log_speed(side, s0, x[j]);
            if j == 0 {
                let reynolds = gas.edge(log_speed.exp()).reynolds;
                let guess = State {
                    log_theta: 0.5 * (0.075 * x[0] / reynolds).ln(),
                    log_shape: 1.22f64.ln(),
                    third: 0.0,
                    log_speed,
                };
                let equations = |d: &Derived<Dual2>| interval::similarity(d, Dual2::from(x[0]));
                states.push(solve_station(layer, Regime::Laminar, guess, Mode::Speed, &equations).unwrap_or(guess));
                continue;
            }
            let before = states[j - 1];
            let start = Derived::new(before, Regime::Laminar, &gas).map(Dual2::from);
            let span = Span { x: [x[j - 1], x[j]].map(Dual2::from), gap: [Dual2::from(0.0); 2] };
            let equations = |d: &Derived<Dual2>| interval::momentum_and_energy(&start, d, &span, Regime::Laminar);
            let mut state = advance(layer, Regime::Laminar, &before, log_speed, x[j] - x[j - 1], &equations);
            // the amplification follows from the layer and does not act on it
            state.third = before.third + interval::growth(&before, &state, &gas) * (x[j] - x[j - 1]);
            states.push(state);
            if state.third >= most {
                break;
            }
        }
        states
    }

    /// Where the amplification of a laminar march reaches its critical value, `limit` at the latest.
    fn amplified(&self, layer: &Layer, side: Side, (limit, length): (f64, f64), s0: f64) -> f64 {
        let states = self.march_laminar(layer, side, (limit, length), s0, self.n_critical);
        let x = self.layout.abscissas(limit, length);
        let Some(j) = states.iter().position(|s| s.third >= self.n_critical) else { return limit };
        if j == 0 {
            return x[0];
        }
        let (a, b) = (states[j - 1].third, states[j].third);
        x[j - 1] + (x[j] - x[j - 1]) * ((self.n_critical - a) / (b - a)).clamp(0.0, 1.0)
    }

    fn march_turbulent(
        &self,
        layer: &Layer,
        side: Side,
        transition: f64,
        length: f64,
        s0: f64,
        states: &mut Vec<State<f64>>,
    ) {
        let x = self.layout.abscissas(transition, length);
        for j in layer.numbering.laminar..layer.numbering.side {
            let log_speed = self.log_speed(side, s0, x[j]);
            let mut before = states[j - 1];
            if j == layer.numbering.laminar {
                before = transition_state(before, &layer.gas);
            }
            let start = Derived::new(before, Regime::Turbulent, &layer.gas).map(Dual3::from);
            let span = Span { x: [x[j - 1], x[j]].map(Dual3::from), gap: [Dual3::from(0.0); 2] };
            let equations = |d: &Derived<Dual3>| {
                let [a, b] = interval::momentum_and_energy(&start, d, &span, Regime::Turbulent);
                [a, b, interval::lag(&start, d, &span, Regime::Turbulent)]
            };
            states.push(advance(layer, Regime::Turbulent, &before, log_speed, x[j] - x[j - 1], &equations));
        }
    }

    fn march_wake(&self, layer: &Layer, unknowns: &mut Unknowns) {
        let numbering = layer.numbering;
        let first = numbering.wake_start();
        let [a, b] = Side::BOTH.map(|side| {
            Derived::new(unknowns.stations[numbering.station(side, numbering.side - 1)], Regime::Turbulent, &layer.gas)
        });
        let theta = a.theta + b.theta;
        let hk = ((a.hk * a.theta + b.hk * b.theta) / theta).min(8.0);
        let stress = (a.stress * a.theta + b.stress * b.theta) / theta;
        let mut before = State {
            log_theta: theta.ln(),
            log_shape: (hk - 1.0).ln(),
            third: stress.ln(),
            log_speed: (0.5 * (a.state.log_speed.exp() + b.state.log_speed.exp())).ln(),
        };
        unknowns.stations[first] = before;
        for j in 1..numbering.wake {
            let log_speed = self.flow.wake_inviscid[j].max(0.3).ln();
            let start = Derived::new(before, Regime::Wake, &layer.gas).map(Dual3::from);
            let span = wake_span::<Dual3>(layer, j);
            let step = layer.distances[j] - layer.distances[j - 1];
            let equations = |d: &Derived<Dual3>| {
                let [a, b] = interval::momentum_and_energy(&start, d, &span, Regime::Wake);
                [a, b, interval::lag(&start, d, &span, Regime::Wake)]
            };
            before = advance(layer, Regime::Wake, &before, log_speed, step, &equations);
            unknowns.stations[first + j] = before;
        }
    }
}
