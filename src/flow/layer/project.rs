//! Puts a state back onto the boundary-layer equations.
//!
//! Newton's method is at its best where the boundary-layer equations hold and only the speeds and transition disagree
//! with them. A march downstream restores that after a step. Each station keeps the combination of speed and shape
//! parameter whose least change leads back to the equations. That is a mixture of direct and inverse mode, which stays
//! regular through separation.

use super::closure::shape;
use super::edge::EdgeLaw;
use super::equations::{EQUATIONS, Interval, Layer, first};
use super::interval::{Merged, Span};
use super::side::Side;
use super::station::{ByStation, Derived, Regime, State, transition_state};
use super::transport::Profiles;
use super::unknowns::Unknowns;
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

/// Largest number of Newton iterations at one station.
const ITERATIONS: usize = 20;
/// Squared weight of ln u against ln(Hk − 1) in the distance that is minimised.
const SPEED_WEIGHT: f64 = 200.0;

/// The equations of one station as functions of that station.
type Equations<'a> = dyn Fn(&Derived<ByStation>) -> [ByStation; EQUATIONS] + 'a;

/// Solves the equations of one station from `guess` for the state nearest to `target`. The result is `None` where
/// Newton's method does not converge.
fn solve_station(
    law: &impl EdgeLaw<Number = f64>,
    regime: Regime,
    guess: State,
    target: &State,
    equations: &Equations,
) -> Option<State> {
    let law = law.map(ByStation::from_re);
    let mut state = guess;
    let mut weights: Option<[f64; 2]> = None;
    for _ in 0..ITERATIONS {
        let residuals = equations(&Derived::new(state.seed(0), regime, &law));
        let rows = residuals.each_ref().map(State::gradient);
        let worst = residuals.iter().fold(0.0, |w: f64, r| if r.re.is_nan() { f64::NAN } else { w.max(r.re.abs()) });
        if worst.is_nan() {
            return None;
        }
        let [by_shape, by_speed] = match weights {
            Some(weights) => weights,
            None => *weights.insert(distance_gradient(&rows)?),
        };
        // the fourth equation: no farther from the target than the others ask for
        let by = State { log_shape: by_shape, log_speed: by_speed, ..State::zeros() };
        let away = by.dot(&state.step(target, -1.0));
        if worst < 1e-8 && away.abs() < 1e-8 {
            return Some(state);
        }
        let rows = [rows[0], rows[1], rows[2], by].map(|row| row.numbers());
        let [a, b, c] = residuals.map(|r| -r.re);
        let step = Matrix4::from_fn(|i, j| rows[i][j]).lu().solve(&Vector4::new(a, b, c, -away))?;
        let change = State::from_fn(|i| step[i]);
        let sizes = [change.log_theta, change.log_shape, 0.1 * change.third, 2.0 * change.log_speed];
        let largest = sizes.iter().fold(0.0, |largest: f64, size| largest.max(size.abs()));
        state = state.step(&change, (0.5 / largest).min(1.0));
        if !state.log_theta.is_finite() || state.log_theta.abs() > 30.0 || state.log_shape > 4.0 {
            return None;
        }
    }
    None
}

/// Coefficients of ln(Hk − 1) and ln u in the condition that a state is the nearest one: the weighted direction along
/// which the solutions of the equations run.
fn distance_gradient(rows: &[State; EQUATIONS]) -> Option<[f64; 2]> {
    // solutions move along the null vector: fix ln(Hk − 1) to move by one
    let others = rows.map(|row| [row.log_theta, row.third, row.log_speed]);
    let right = Vector3::from_fn(|i, _| -rows[i].log_shape);
    let (shape, speed) = match Matrix3::from_fn(|i, j| others[i][j]).lu().solve(&right) {
        Some(rest) if rest[2].is_finite() => (1.0, rest[2]),
        _ => (0.0, 1.0),
    };
    let [a, b] = [shape, SPEED_WEIGHT * speed];
    let norm = a.hypot(b);
    (norm.is_finite() && norm > 0.0).then_some([a / norm, b / norm])
}

/// A march under way, with the unknowns it has changed so far.
struct March<'a, 'b, L> {
    layer: &'a Layer<'b, L>,
    unknowns: Unknowns,
}

impl<L: EdgeLaw<Number = f64>> March<'_, '_, L> {
    /// Solves station `k`, from the present state or else from the state `before` it. Where both fail the station stays
    /// as it is.
    fn advance(&mut self, k: usize, regime: Regime, before: Option<State>, equations: &Equations) {
        let here = self.unknowns.stations[k];
        let solve = |guess: State| solve_station(&self.layer.law, regime, guess, &here, equations);
        if let Some(state) = solve(here).or_else(|| solve(before?)) {
            self.unknowns.stations[k] = state;
        }
    }

    fn side(&mut self, side: Side, x: &[f64], range: std::ops::Range<usize>) {
        let (numbering, law) = (self.layer.numbering(), self.layer.law);
        let wide = law.map(ByStation::from_re);
        for j in range {
            let k = numbering.station(side, j);
            let regime = numbering.regime(k);
            if j == 0 {
                let before = k.checked_sub(1).map(|k| self.unknowns.stations[k]);
                self.advance(k, regime, before, &|d| first(d, ByStation::from_re(x[0])));
                continue;
            }
            let before = self.unknowns.stations[k - 1];
            let start = if j == numbering.laminar { transition_state(before, &law) } else { before };
            let start = Derived::new(start, regime, &law).map(ByStation::from_re);
            let span = Span::on_wall([x[j - 1], x[j]].map(ByStation::from_re));
            let interval = Interval { from: &start, span, regime };
            self.advance(k, regime, Some(before), &|d| interval.residual(d, &wide));
        }
    }

    fn wake(&mut self) {
        let (numbering, law) = (self.layer.numbering(), self.layer.law);
        let wide = law.map(ByStation::from_re);
        let first = numbering.wake_start();
        let [a, b] = numbering.ends().map(|end| Derived::new(self.unknowns.stations[end], Regime::Turbulent, &law));
        let merged = Merged::new(&a, &b);
        let start = &mut self.unknowns.stations[first];
        // the sum of the displacement thicknesses, at the speed of the wake
        let hk = shape::kinematic_shape(merged.displacement / merged.theta, law.edge(start.speed()).mach2);
        start.log_theta = merged.theta.ln();
        start.log_shape = (hk - 1.0).max(0.01).ln();
        start.third = merged.stress.ln();
        for number in 1..numbering.wake {
            let before = self.unknowns.stations[first + number - 1];
            let start = Derived::new(before, Regime::Wake, &law).map(ByStation::from_re);
            let span = self.layer.wake_interval_span(number);
            let interval = Interval { from: &start, span, regime: Regime::Wake };
            let equations = |d: &Derived<ByStation>| interval.residual(d, &wide);
            self.advance(first + number, Regime::Wake, Some(before), &equations);
        }
    }
}

impl<L: EdgeLaw<Number = f64>> Layer<'_, L> {
    /// The unknowns put back onto the equations of the layer, as far as that can be done station by station.
    pub fn project(&self, unknowns: &Unknowns) -> Unknowns {
        let laminar = self.layout.laminar.len();
        let mut march = March { layer: self, unknowns: unknowns.clone() };
        for side in Side::BOTH {
            let x = march.unknowns.abscissas(self.layout, side, self.surface);
            march.side(side, &x, 0..laminar);
            if let Some(crossing) = self.critical(side, &march.unknowns, &x) {
                let profiles = Profiles::new(self.layout, &march.unknowns, self.surface);
                march.unknowns.transition[side.index()] = crossing;
                profiles.place(&mut march.unknowns);
                let x = march.unknowns.abscissas(self.layout, side, self.surface);
                march.side(side, &x, 0..laminar);
            }
            let x = march.unknowns.abscissas(self.layout, side, self.surface);
            march.side(side, &x, laminar..self.layout.side());
        }
        march.wake();
        march.unknowns
    }

    /// Distance from the stagnation point at which the amplification of a side becomes critical, where that is ahead of
    /// the transition point; `x` are the distances of the stations.
    fn critical(&self, side: Side, unknowns: &Unknowns, x: &[f64]) -> Option<f64> {
        let numbering = self.numbering();
        let n = |j: usize| unknowns.stations[numbering.station(side, j)].amplification();
        // a little more than critical is Newton's to settle
        let last = numbering.laminar - 1;
        if n(last) < self.n_critical + 1.0 {
            return None;
        }
        let j = (1..=last).find(|&j| n(j) >= self.n_critical)?;
        let w = (self.n_critical - n(j - 1)) / (n(j) - n(j - 1));
        Some((x[j - 1] + w.clamp(0.0, 1.0) * (x[j] - x[j - 1])).max(0.5 * x[last]))
    }
}
