//! A start of the Newton iteration, made by marching the boundary-layer equations downstream.
//!
//! Direct mode takes the inviscid speeds. Where the layer would separate in them the shape parameter is prescribed
//! instead and the speed follows (inverse mode; Drela & Giles 1987). The result satisfies all boundary-layer equations.
//! Only the speeds in separated regions disagree with the outer flow, and Newton's method removes that disagreement.

use super::edge::EdgeLaw;
use super::equations::{Interval, Layer, first};
use super::interval::{Merged, Span, growth};
use super::side::Side;
use super::station::{Derived, Regime, State, transition_state};
use super::transition;
use super::unknowns::Unknowns;
use crate::differentiate::Tangent;
use crate::flow::duals::{Dual2, Dual3};
use nalgebra::{SMatrix, SVector};

/// Hk above which the march prescribes Hk in a laminar layer.
const LAMINAR_LIMIT: f64 = 3.8;
/// Hk above which the march prescribes Hk in a turbulent layer.
const TURBULENT_LIMIT: f64 = 2.5;
/// Hk above which the march prescribes Hk in the wake.
const WAKE_LIMIT: f64 = 4.0;
/// Fractions of a side from which the speed is extrapolated to the trailing edge.
const EDGE: [f64; 2] = [0.88, 0.94];
/// Largest number of Newton iterations at one station.
const ITERATIONS: usize = 25;
/// Residual and step below which one more step of Newton's method is enough.
const CLOSE: f64 = 1e-4;

/// The outer flow without a layer, which drives a march. Speeds are in units of the onset speed.
pub(crate) struct OuterSpeeds<'a> {
    /// Arc length of the stagnation point from the first node, in chords.
    pub stagnation: f64,
    /// The outer flow's unknown speed on a side, as a function of the distance from the stagnation point.
    pub surface: &'a dyn Fn(Side, f64) -> f64,
    /// The outer flow's unknown speed at the stations of the wake.
    pub wake: &'a [f64],
}

/// The quantity that is prescribed at a station: the speed (direct mode) or the shape parameter (inverse mode).
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    Speed,
    Shape,
}

/// The equations of one station as functions of the free unknowns: θ, then Hk or the speed, then the shear stress where
/// it belongs to the equations.
type Equations<'a, const N: usize> = dyn Fn(&Derived<Tangent<N>>) -> [Tangent<N>; N] + 'a;

/// A state with the free unknowns as independent variables.
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

/// Solves the equations of one station from `guess`; `None` where Newton's method does not converge.
fn solve_station<const N: usize>(
    law: &impl EdgeLaw<Number = f64>,
    regime: Regime,
    guess: State<f64>,
    mode: Mode,
    equations: &Equations<N>,
) -> Option<State<f64>> {
    let law = law.map(Tangent::<N>::from_re);
    let mut state = guess;
    for _ in 0..ITERATIONS {
        let residuals = equations(&Derived::new(variables(&state, mode), regime, &law));
        let worst = residuals.iter().fold(0.0, |w: f64, r| if r.re.is_nan() { f64::NAN } else { w.max(r.re.abs()) });
        if worst.is_nan() {
            return None;
        }
        let step = newton_step(&residuals)?;
        let third = if N > 2 { step[2] } else { 0.0 };
        let largest = step[0].abs().max(step[1].abs()).max(0.1 * third.abs());
        let factor = (0.5 / largest).min(1.0);
        let (log_shape, log_speed) = match mode {
            Mode::Speed => (step[1], 0.0),
            Mode::Shape => (0.0, step[1]),
        };
        state = state.step(&State { log_theta: step[0], log_shape, third, log_speed }, factor);
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

/// Newton's step for the free unknowns; `None` where the equations are singular.
fn newton_step<const N: usize>(residuals: &[Tangent<N>; N]) -> Option<[f64; N]> {
    let jacobian = SMatrix::<f64, N, N>::from_fn(|i, j| residuals[i].eps[j]);
    let right = SVector::<f64, N>::from_fn(|i, _| -residuals[i].re);
    jacobian.try_inverse().map(|inverse| (inverse * right).data.0[0])
}

/// One station of the march: in direct mode, or with prescribed Hk where the layer separates or direct mode fails.
/// `step` is the distance from the station before it.
fn advance<const N: usize>(
    law: &impl EdgeLaw<Number = f64>,
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
    let direct = solve_station(law, regime, guess, Mode::Speed, equations);
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
    solve_station(law, regime, guess, Mode::Shape, equations).unwrap_or(State { log_speed, ..guess })
}

impl OuterSpeeds<'_> {
    /// Logarithm of the speed that drives a march at a distance `x` from the stagnation point: the outer speed, without
    /// the fall to the stagnation point at the trailing edge, which the layer fills.
    fn log_speed(&self, side: Side, x: f64, length: f64) -> f64 {
        let at = |x: f64| (self.surface)(side, x).max(0.5 * x.min(0.1)).ln();
        let [a, b] = [EDGE[0] * length, EDGE[1] * length];
        if x <= b {
            return at(x);
        }
        let [from, to] = [at(a), at(b)];
        to + (to - from) * (x - b) / (b - a)
    }
}

/// A side under way, with the distances `x` of the stations from the stagnation point for one transition point.
struct MarchedSide<'a, 'b, L> {
    layer: &'a Layer<'a, L>,
    outer: &'a OuterSpeeds<'b>,
    side: Side,
    /// Length of the side, in chords.
    length: f64,
    /// Distances of the stations from the stagnation point, in chords.
    x: Vec<f64>,
}

impl<L: EdgeLaw<Number = f64>> Layer<'_, L> {
    /// Start of the Newton iteration, made by marching.
    pub fn march(&self, outer: &OuterSpeeds) -> Unknowns {
        let numbering = self.numbering();
        let mut unknowns = Unknowns::zeros(numbering.stations());
        unknowns.stagnation = outer.stagnation;
        for side in Side::BOTH {
            let length = unknowns.side_length(side, self.surface.total);
            let along = |transition: f64| MarchedSide {
                layer: self,
                outer,
                side,
                length,
                x: self.layout.abscissas(self.surface, side, [outer.stagnation, transition]),
            };
            let latest = transition::latest(self.trip_distance(side, outer.stagnation), length);
            let transition = transition::of_march(along(latest).critical(latest), latest, length);
            unknowns.transition[side.index()] = transition;
            let from = numbering.station(side, 0);
            unknowns.stations[from..from + numbering.side].copy_from_slice(&along(transition).states());
        }
        self.march_wake(outer, &mut unknowns);
        unknowns
    }

    fn march_wake(&self, outer: &OuterSpeeds, unknowns: &mut Unknowns) {
        let numbering = self.numbering();
        let first = numbering.wake_start();
        let [a, b] = numbering.ends().map(|end| Derived::new(unknowns.stations[end], Regime::Turbulent, &self.law));
        let merged = Merged::new(&a, &b);
        let hk = ((a.hk * a.theta + b.hk * b.theta) / merged.theta).min(8.0);
        let mut before = State {
            log_theta: merged.theta.ln(),
            log_shape: (hk - 1.0).ln(),
            third: merged.stress.ln(),
            log_speed: (0.5 * (a.state.speed() + b.state.speed())).ln(),
        };
        unknowns.stations[first] = before;
        let wide = self.law.map(Dual3::from_re);
        for number in 1..numbering.wake {
            let log_speed = outer.wake[number].max(0.3).ln();
            let start = Derived::new(before, Regime::Wake, &self.law).map(Dual3::from);
            let interval = Interval { from: &start, span: self.wake_interval_span(number), regime: Regime::Wake };
            let step = self.distances[number] - self.distances[number - 1];
            let equations = |d: &Derived<Dual3>| interval.residual(d, &wide);
            before = advance(&self.law, Regime::Wake, &before, log_speed, step, &equations);
            unknowns.stations[first + number] = before;
        }
    }
}

impl<L: EdgeLaw<Number = f64>> MarchedSide<'_, '_, L> {
    /// States of all stations of the side.
    fn states(&self) -> Vec<State> {
        let mut states = self.laminar(f64::INFINITY);
        self.turbulent(&mut states);
        states
    }

    /// States of the laminar stations, up to the first whose amplification reaches `most`.
    fn laminar(&self, most: f64) -> Vec<State> {
        let (law, x) = (&self.layer.law, &self.x);
        let mut states: Vec<State> = Vec::with_capacity(x.len());
        for j in 0..self.layer.layout.laminar.len() {
            let log_speed = self.outer.log_speed(self.side, x[j], self.length);
            if j == 0 {
                states.push(self.first(log_speed));
                continue;
            }
            let before = states[j - 1];
            let start = Derived::new(before, Regime::Laminar, law).map(Dual2::from);
            let span = Span::on_wall([x[j - 1], x[j]].map(Dual2::from));
            let interval = Interval { from: &start, span, regime: Regime::Laminar };
            let equations = |d: &Derived<Dual2>| interval.momentum_and_energy(d);
            let mut state = advance(law, Regime::Laminar, &before, log_speed, x[j] - x[j - 1], &equations);
            // the amplification follows from the layer and does not act on it
            state.third = before.amplification() + growth(&before, &state, law) * (x[j] - x[j - 1]);
            states.push(state);
            if state.amplification() >= most {
                break;
            }
        }
        states
    }

    /// State of the first station, where the layer is similar.
    fn first(&self, log_speed: f64) -> State {
        let (law, x) = (&self.layer.law, self.x[0]);
        let guess = State {
            log_theta: 0.5 * (0.075 * x / law.edge(log_speed.exp()).reynolds).ln(),
            log_shape: 1.22f64.ln(),
            third: 0.0,
            log_speed,
        };
        let equations = |d: &Derived<Dual2>| {
            let [momentum, energy, _] = first(d, Dual2::from(x));
            [momentum, energy]
        };
        solve_station(law, Regime::Laminar, guess, Mode::Speed, &equations).unwrap_or(guess)
    }

    /// Distance from the stagnation point at which the amplification of the laminar layer becomes critical, at most
    /// `latest`.
    fn critical(&self, latest: f64) -> f64 {
        let critical = self.layer.n_critical;
        let states = self.laminar(critical);
        let Some(j) = states.iter().position(|s| s.amplification() >= critical) else { return latest };
        if j == 0 {
            return self.x[0];
        }
        let (a, b) = (states[j - 1].amplification(), states[j].amplification());
        self.x[j - 1] + (self.x[j] - self.x[j - 1]) * ((critical - a) / (b - a)).clamp(0.0, 1.0)
    }

    /// Adds the states of the turbulent stations.
    fn turbulent(&self, states: &mut Vec<State>) {
        let (law, x) = (&self.layer.law, &self.x);
        let laminar = states.len();
        let wide = law.map(Dual3::from_re);
        for j in laminar..x.len() {
            let log_speed = self.outer.log_speed(self.side, x[j], self.length);
            let before = if j == laminar { transition_state(states[j - 1], law) } else { states[j - 1] };
            let start = Derived::new(before, Regime::Turbulent, law).map(Dual3::from);
            let span = Span::on_wall([x[j - 1], x[j]].map(Dual3::from));
            let interval = Interval { from: &start, span, regime: Regime::Turbulent };
            let equations = |d: &Derived<Dual3>| interval.residual(d, &wide);
            states.push(advance(law, Regime::Turbulent, &before, log_speed, x[j] - x[j - 1], &equations));
        }
    }
}
