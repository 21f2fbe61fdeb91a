//! Puts a state back onto the boundary-layer equations.
//!
//! Newton's method is at its best where the boundary-layer equations hold and only the speeds and transition disagree
//! with them. A march downstream restores that after a step. What is held at a station is the combination of speed and
//! shape parameter whose least change leads back to the equations, a mixture of direct and inverse mode that stays
//! regular through separation.

use super::chain::{Layer, wake_span};
use super::duals::{Dual4, gradient};
use super::march::first_equations;
use super::system::System;
use super::transport::Profiles;
use super::unknowns::{Side, Unknowns};
use crate::flow::boundary_layer::interval::{self, Span};
use crate::flow::boundary_layer::station::{Derived, Regime, State, transition_state};
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

/// Newton iterations at one station.
const ITERATIONS: usize = 20;
/// Squared weight of ln u against ln(Hk − 1) in the distance that is made least.
const SPEED_WEIGHT: f64 = 200.0;

type Equations<'a> = dyn Fn(&Derived<Dual4>) -> [Dual4; 3] + 'a;

/// Solution of the equations of one station; `None` where Newton's method does not get there.
fn solve_station(
    layer: &Layer,
    regime: Regime,
    guess: State<f64>,
    target: &State<f64>,
    equations: &Equations,
) -> Option<State<f64>> {
    let gas = layer.gas.map(Dual4::from);
    let mut state = guess;
    let mut weights: Option<[f64; 2]> = None;
    for _ in 0..ITERATIONS {
        let derived = Derived::new(state.seed::<4>(0), regime, &gas);
        let residuals = equations(&derived);
        let rows = residuals.map(|r| gradient(&r));
        let worst = residuals.iter().fold(0.0, |w: f64, r| if r.re.is_nan() { f64::NAN } else { w.max(r.re.abs()) });
        if worst.is_nan() {
            return None;
        }
        let [by_shape, by_speed] = match weights {
            Some(weights) => weights,
            None => *weights.insert(distance_gradient(&rows)?),
        };
        let away = by_shape * (state.log_shape - target.log_shape) + by_speed * (state.log_speed - target.log_speed);
        let by = [0.0, by_shape, 0.0, by_speed];
        if worst < 1e-8 && away.abs() < 1e-8 {
            return Some(state);
        }
        let mut jacobian = Matrix4::zeros();
        for (i, row) in rows.iter().enumerate() {
            for (j, value) in row.iter().enumerate() {
                jacobian[(i, j)] = *value;
            }
        }
        for j in 0..4 {
            jacobian[(3, j)] = by[j];
        }
        let [a, b, c] = residuals.map(|r| -r.re);
        let step = jacobian.lu().solve(&Vector4::new(a, b, c, -away))?;
        let largest = step[0].abs().max(step[1].abs()).max(0.1 * step[2].abs()).max(2.0 * step[3].abs());
        let factor = (0.5 / largest).min(1.0);
        state.log_theta += factor * step[0];
        state.log_shape += factor * step[1];
        state.third += factor * step[2];
        state.log_speed += factor * step[3];
        if !state.log_theta.is_finite() || state.log_theta.abs() > 30.0 || state.log_shape > 4.0 {
            return None;
        }
    }
    None
}

/// Coefficients of the condition that the state is the nearest one: the direction along the solutions of the equations
/// in (ln(Hk − 1), ln u), weighted.
fn distance_gradient(rows: &[[f64; 4]; 3]) -> Option<[f64; 2]> {
    // solutions move along the null vector: fix ln(Hk − 1) to move by one
    let others = Matrix3::from_fn(|i, j| rows[i][[0, 2, 3][j]]);
    let right = Vector3::from_fn(|i, _| -rows[i][1]);
    let (shape, speed) = match others.lu().solve(&right).filter(|v| v[2].is_finite()) {
        Some(rest) => (1.0, rest[2]),
        None => (0.0, 1.0),
    };
    let [a, b] = [shape, SPEED_WEIGHT * speed];
    let norm = a.hypot(b);
    (norm.is_finite() && norm > 0.0).then_some([a / norm, b / norm])
}

/// A march under way.
struct March<'a, 'b> {
    layer: &'a Layer<'b>,
    unknowns: Unknowns,
}

impl March<'_, '_> {
    /// Solves station `k`; where that fails it keeps its speed and shape parameter.
    fn advance(&mut self, k: usize, equations: &Equations) {
        let regime = self.layer.numbering.regime(k);
        let here = self.unknowns.stations[k];
        let found = solve_station(self.layer, regime, here, &here, equations).or_else(|| {
            let before = *self.unknowns.stations.get(k.wrapping_sub(1))?;
            solve_station(self.layer, regime, before, &here, equations)
        });
        if let Some(state) = found {
            self.unknowns.stations[k] = state;
        }
    }

    fn side(&mut self, side: Side, x: &[f64], range: std::ops::Range<usize>) {
        let numbering = self.layer.numbering;
        let gas = self.layer.gas;
        for j in range {
            let k = numbering.station(side, j);
            let regime = numbering.regime(k);
            if j == 0 {
                let equations = first_equations(x[0]);
                self.advance(k, &equations);
                continue;
            }
            let mut before = self.unknowns.stations[k - 1];
            if j == numbering.laminar {
                before = transition_state(before, &gas);
            }
            let start = Derived::new(before, regime, &gas).map(Dual4::from);
            let span = Span { x: [x[j - 1], x[j]].map(Dual4::from), gap: [Dual4::from(0.0); 2] };
            let wide = gas.map(Dual4::from);
            let step = x[j] - x[j - 1];
            let equations = |d: &Derived<Dual4>| {
                let [a, b] = interval::momentum_and_energy(&start, d, &span, regime);
                let third = match regime {
                    Regime::Laminar => {
                        d.state.third - start.state.third - interval::growth(&start.state, &d.state, &wide) * step
                    }
                    _ => interval::lag(&start, d, &span, regime),
                };
                [a, b, third]
            };
            self.advance(k, &equations);
        }
    }

    fn wake(&mut self) {
        let numbering = self.layer.numbering;
        let first = numbering.wake_start();
        let gas = self.layer.gas;
        let ends = Side::BOTH.map(|side| self.unknowns.stations[numbering.station(side, numbering.side - 1)]);
        let [a, b] = ends.map(|end| Derived::new(end, Regime::Turbulent, &gas));
        let start = &mut self.unknowns.stations[first];
        let theta = a.theta + b.theta;
        // the sum of the displacement thicknesses, at the speed of the wake
        let edge = gas.edge(start.log_speed.exp());
        let shape = (a.displacement + b.displacement) / theta;
        let hk = (shape - 0.29 * edge.mach2) / (1.0 + 0.113 * edge.mach2);
        start.log_theta = theta.ln();
        start.log_shape = (hk - 1.0).max(0.01).ln();
        start.third = ((a.stress * a.theta + b.stress * b.theta) / theta).ln();
        for j in 1..numbering.wake {
            let start = Derived::new(self.unknowns.stations[first + j - 1], Regime::Wake, &gas).map(Dual4::from);
            let span = wake_span::<Dual4>(self.layer, j);
            let equations = |d: &Derived<Dual4>| {
                let [a, b] = interval::momentum_and_energy(&start, d, &span, Regime::Wake);
                [a, b, interval::lag(&start, d, &span, Regime::Wake)]
            };
            self.advance(first + j, &equations);
        }
    }
}

impl System<'_> {
    /// `unknowns` put back onto the boundary-layer equations, as far as that can be done station by station.
    pub fn project(&self, unknowns: &Unknowns) -> Unknowns {
        let layer = self.layer();
        let total = self.section.map.total;
        let laminar = layer.numbering.laminar;
        let mut march = March { layer: &layer, unknowns: unknowns.clone() };
        for side in Side::BOTH {
            let at = side.index();
            let abscissas = |u: &Unknowns| {
                let lengths = super::transport::lengths(u, total);
                self.layout.abscissas(u.transition[at], lengths[at])
            };
            let x = abscissas(&march.unknowns);
            march.side(side, &x, 0..laminar);
            if let Some(crossing) = self.critical(side, &march.unknowns, &x) {
                let profiles = Profiles::new(self.layout, &march.unknowns, total);
                march.unknowns.transition[at] = crossing;
                profiles.place(self.layout, &mut march.unknowns, total);
                let x = abscissas(&march.unknowns);
                march.side(side, &x, 0..laminar);
            }
            let x = abscissas(&march.unknowns);
            march.side(side, &x, laminar..layer.numbering.side);
        }
        march.wake();
        march.unknowns
    }

    /// Where the amplification of a side becomes critical ahead of its transition point.
    fn critical(&self, side: Side, unknowns: &Unknowns, x: &[f64]) -> Option<f64> {
        let numbering = super::unknowns::Numbering::new(self.layout);
        let third = |j: usize| unknowns.stations[numbering.station(side, j)].third;
        // a little more than critical is Newton's to settle
        let last = numbering.laminar - 1;
        if third(last) < self.n_critical + 1.0 {
            return None;
        }
        let j = (1..=last).find(|&j| third(j) >= self.n_critical)?;
        let w = (self.n_critical - third(j - 1)) / (third(j) - third(j - 1));
        Some((x[j - 1] + w.clamp(0.0, 1.0) * (x[j] - x[j - 1])).max(0.5 * x[last]))
    }
}
