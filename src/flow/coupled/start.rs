//! A closed-form start of the Newton iteration: Thwaites and a power law along the inviscid speeds.

use super::layout::Layout;
use super::response::{FlowResponse, SectionResponse};
use super::speeds::value_at;
use super::surface::invert;
use super::system::System;
use super::unknowns::{Numbering, Side, Unknowns};
use crate::flow::boundary_layer::closure::amplification::growth_rate;
use crate::flow::boundary_layer::gas::Gas;
use crate::flow::boundary_layer::station::{State, transition_state};

/// Largest Hk of the laminar start.
const SHAPE_CAP: f64 = 3.4;
/// Hk the turbulent start relaxes to.
const TURBULENT_SHAPE: f64 = 1.5;
/// Points of the quadrature along a side.
const FINE: usize = 240;

/// Inviscid stagnation point: node index where the strength changes sign.
pub(crate) fn stagnation_index(section: &SectionResponse, strengths: &[f64], spline: &[f64]) -> f64 {
    // the sign change nearest to the node of greatest distance from the trailing edge
    let nodes = &section.panels.outline.nodes;
    let edge = section.edge_frame().middle;
    let reach = |i: usize| (nodes[i][0] - edge[0]).hypot(nodes[i][1] - edge[1]);
    let changes = (1..nodes.len()).filter(|&i| strengths[i - 1] > 0.0 && strengths[i] <= 0.0);
    let at = changes.max_by(|&a, &b| reach(a).total_cmp(&reach(b))).unwrap_or(nodes.len() / 2);
    invert(&section.map.spline, spline, 0.0, at as f64 - 1.0, at as f64, -1.0)
}

/// Laminar layer along one side on a fine grid.
struct Laminar {
    x: Vec<f64>,
    speed: Vec<f64>,
    theta: Vec<f64>,
    shape: Vec<f64>,
    n: Vec<f64>,
    /// First grid point behind laminar separation.
    separation: usize,
}

fn thwaites(speed_at: impl Fn(f64) -> f64, length: f64, gas: &Gas<f64>) -> Laminar {
    let x: Vec<f64> = (0..FINE).map(|i| length * ((i + 1) as f64 / FINE as f64).powi(2)).collect();
    let speed: Vec<f64> = x.iter().map(|&x| speed_at(x)).collect();
    let (mut theta, mut shape, mut n) = (Vec::new(), Vec::new(), Vec::new());
    // u ~ x up to the first point
    let mut integral = speed[0].powi(5) * x[0] / 6.0;
    let mut separation = FINE;
    for i in 0..FINE {
        let reynolds = gas.edge(speed[i]).reynolds / speed[i];
        if i > 0 {
            integral += 0.5 * (speed[i].powi(5) + speed[i - 1].powi(5)) * (x[i] - x[i - 1]);
        }
        let square = 0.45 * integral / (speed[i].powi(6) * reynolds);
        let (a, b) = (i.saturating_sub(1), (i + 1).min(FINE - 1));
        let slope = if i == 0 { speed[0] / x[0] } else { (speed[b] - speed[a]) / (x[b] - x[a]) };
        let lambda = square * slope * reynolds;
        if lambda < -0.085 && separation == FINE {
            separation = i;
        }
        let l = lambda.clamp(-0.085, 0.12);
        let h = if l > 0.0 { 2.61 - 3.75 * l + 5.24 * l * l } else { 2.088 + 0.0731 / (l + 0.14) };
        // θ does not fall where the speed does: Thwaites' square root misbehaves behind separation only
        theta.push(square.sqrt());
        shape.push(if i >= separation { SHAPE_CAP } else { h.min(SHAPE_CAP) });
        let rate = growth_rate(shape[i], theta[i], reynolds * speed[i] * theta[i]);
        let before = if i == 0 { 0.0 } else { n[i - 1] + rate * (x[i] - x[i - 1]) };
        n.push(before);
    }
    Laminar { x, speed, theta, shape, n, separation }
}

/// Linear interpolation of `values` over `x`, constant beyond the ends.
fn interpolate(x: &[f64], values: &[f64], at: f64) -> f64 {
    let i = x.partition_point(|&v| v < at);
    if i == 0 {
        return values[0];
    }
    if i == x.len() {
        return values[x.len() - 1];
    }
    let w = (at - x[i - 1]) / (x[i] - x[i - 1]);
    values[i - 1] + w * (values[i] - values[i - 1])
}

impl Laminar {
    fn transition(&self, n_critical: f64, limit: f64, length: f64) -> f64 {
        let amplified = self.n.partition_point(|&n| n < n_critical);
        let free = if amplified < FINE { self.x[amplified] } else { length };
        let separated = if self.separation < FINE { self.x[self.separation] + 0.03 * length } else { length };
        free.min(separated).min(limit).clamp(0.004 * length, 0.995 * length)
    }
}

impl System<'_> {
    /// Closed-form start.
    pub fn start(&self) -> Unknowns {
        let numbering = Numbering::new(self.layout);
        let stagnation_t = stagnation_index(self.section, &self.flow.inviscid, &self.flow.inviscid_spline);
        let stagnation = value_at(self.section, &self.section.map.arc, stagnation_t);
        let mut stations = Vec::with_capacity(numbering.stations());
        let mut transition = [0.0; 2];
        for side in Side::BOTH {
            let length = if side == Side::Upper { stagnation } else { self.section.map.total - stagnation };
            let speed = side_speed(self.section, self.flow, side, stagnation);
            let limit = self.trips[side.index()].map_or(length, |s| side.sign() * (stagnation - s));
            let laminar = thwaites(speed, length, &self.gas);
            let at = laminar.transition(self.n_critical, limit, length);
            transition[side.index()] = at;
            stations.extend(self.start_side(&laminar, at, length, self.layout));
        }
        let wake = self.start_wake(&stations, &numbering);
        stations.extend(wake);
        Unknowns { stations, stagnation, transition }
    }

    fn start_side(&self, laminar: &Laminar, transition: f64, length: f64, layout: &Layout) -> Vec<State<f64>> {
        let x = layout.abscissas(transition, length);
        let mut result: Vec<State<f64>> = Vec::with_capacity(x.len());
        for &x in &x[..layout.laminar.len()] {
            // u and θ² are linear up to the first point of the grid
            let ratio = (x / laminar.x[0]).min(1.0);
            result.push(State {
                log_theta: interpolate(&laminar.x, &laminar.theta, x).ln(),
                log_shape: (interpolate(&laminar.x, &laminar.shape, x) - 1.0).ln(),
                third: interpolate(&laminar.x, &laminar.n, x).min(self.n_critical),
                log_speed: (interpolate(&laminar.x, &laminar.speed, x) * ratio).ln(),
            });
        }
        let end = result[layout.laminar.len() - 1];
        let behind = transition_state(end, &self.gas);
        let (theta0, shape0) = (end.theta(), end.kinematic_shape());
        // Spence: θ Re_θ^(1/5) u⁴ grows by 0.0106 ∫ u⁴ dx
        let (mut before, mut fourth) = (transition, end.log_speed.exp().powi(4));
        let reynolds = |u: f64| self.gas.edge(u).reynolds;
        let mut moment = theta0.powf(1.2) * reynolds(end.log_speed.exp()).powf(0.2) * fourth;
        for &x in &x[layout.laminar.len()..] {
            let u = interpolate(&laminar.x, &laminar.speed, x);
            let next = u.powi(4);
            moment += 0.0106 * 0.5 * (fourth + next) * (x - before);
            (before, fourth) = (x, next);
            let theta = (moment / (next * reynolds(u).powf(0.2))).powf(1.0 / 1.2);
            let fading = (-(x - transition) / (60.0 * theta0)).exp();
            let shape = TURBULENT_SHAPE + (shape0 - TURBULENT_SHAPE) * fading;
            let state = State { log_theta: theta.ln(), log_shape: (shape - 1.0).ln(), third: 0.0, log_speed: u.ln() };
            let level = transition_state(state, &self.gas).third.max(-3.5);
            result.push(State { third: level + (behind.third - level) * fading, ..state });
        }
        result
    }

    fn start_wake(&self, sides: &[State<f64>], numbering: &Numbering) -> Vec<State<f64>> {
        let [upper, lower] = Side::BOTH.map(|side| sides[numbering.station(side, numbering.side - 1)]);
        let (a, b) = (upper.theta(), lower.theta());
        let theta0 = a + b;
        let shape0 = (a * upper.kinematic_shape() + b * lower.kinematic_shape()) / theta0;
        let stress = ((a * upper.third.exp() + b * lower.third.exp()) / theta0).ln();
        let speed0 = 0.5 * (upper.log_speed.exp() + lower.log_speed.exp());
        (0..numbering.wake)
            .map(|k| {
                let d = self.section.wake_distances[k];
                let u = if k == 0 { speed0 } else { self.flow.wake_inviscid[k].max(0.3) };
                let shape = 1.05 + (shape0 - 1.05) * (-d / (40.0 * theta0)).exp();
                State {
                    log_theta: (theta0 * (speed0 / u).powf(2.5)).ln(),
                    log_shape: (shape - 1.0).ln(),
                    third: stress,
                    log_speed: u.ln(),
                }
            })
            .collect()
    }
}

/// Inviscid speed on one side over the arc length from the stagnation point.
fn side_speed<'a>(
    section: &'a SectionResponse,
    flow: &'a FlowResponse,
    side: Side,
    stagnation: f64,
) -> impl Fn(f64) -> f64 + 'a {
    move |x| {
        let t = section.map.index(stagnation - side.sign() * x);
        (side.sign() * value_at(section, &flow.inviscid_spline, t)).max(0.02)
    }
}
