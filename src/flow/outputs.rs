//! Coefficients of a solution, and how they depend on the speeds at the nodes and on the end of the wake.

use super::coupled::duals::{Dual4, Dual8, gradient};
use super::coupled::response::SectionResponse;
use super::coupled::surface::combine_real;
use super::panel::forces::{KarmanTsien, panel_loads};
use super::panel::outline::TrailingEdge;
use crate::scalar::Scalar;

/// Pressure forces of the section for given vortex strengths at the nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PressureForces {
    pub lift: f64,
    pub moment: f64,
    pub lowest_pressure: f64,
    /// Node index at which the pressure is lowest.
    pub at: f64,
}

/// How the pressure forces (lift, moment, lowest pressure) change.
#[derive(Debug, Clone)]
pub(crate) struct PressureGradient {
    /// With respect to the strengths at the nodes, one row an output.
    pub strengths: [Vec<f64>; 3],
    /// With respect to the (balanced) nodes, at fixed strengths.
    pub nodes: [Vec<[f64; 2]>; 3],
    pub alpha: [f64; 3],
    pub mach: [f64; 3],
}

fn panel_count(section: &SectionResponse) -> usize {
    match section.panels.outline.trailing_edge {
        TrailingEdge::Blunt => section.len(),
        TrailingEdge::Sharp => section.len() - 1,
    }
}

pub(crate) fn pressure_forces(section: &SectionResponse, strengths: &[f64], alpha: f64, mach: f64) -> PressureForces {
    let correction = KarmanTsien::new(mach);
    let wind = [alpha.cos(), alpha.sin()];
    let (mut lift, mut moment) = (0.0, 0.0);
    for j in 0..panel_count(section) {
        let next = (j + 1) % section.len();
        let cp = [strengths[j], strengths[next]].map(|q| correction.pressure(q));
        let [l, m] = panel_loads(section.panels.outline.panel(j), cp, wind);
        lift += l;
        moment += m;
    }
    let (at, peak) = highest_speed(section, strengths);
    PressureForces { lift, moment, lowest_pressure: correction.pressure(peak), at }
}

/// Where the spline of the speed is highest, and that speed.
fn highest_speed(section: &SectionResponse, strengths: &[f64]) -> (f64, f64) {
    let spline = &section.map.spline;
    let c = spline.coefficients(strengths);
    let last = strengths.len() - 1;
    let node = (0..=last).max_by(|&a, &b| strengths[a].abs().total_cmp(&strengths[b].abs())).unwrap_or(0);
    let sign = strengths[node].signum();
    let slope = |t: f64| sign * combine_real::<f64>(&spline.slope_weights(t), &c);
    let (mut low, mut high) = (node.saturating_sub(1) as f64, (node + 1).min(last) as f64);
    let at = if slope(low) <= 0.0 {
        low
    } else if slope(high) >= 0.0 {
        high
    } else {
        // bisection to the last bit: the slope falls through zero between them
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if slope(middle) > 0.0 { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    (at, combine_real(&spline.weights(at), &c))
}

pub(crate) fn pressure_gradient(
    section: &SectionResponse,
    strengths: &[f64],
    alpha: f64,
    mach: f64,
) -> PressureGradient {
    let n = section.len();
    let mut result = PressureGradient {
        strengths: std::array::from_fn(|_| vec![0.0; n]),
        nodes: std::array::from_fn(|_| vec![[0.0; 2]; n]),
        alpha: [0.0; 3],
        mach: [0.0; 3],
    };
    let unit = |v: f64, k: usize| Dual8::from_re(v).derivative(k);
    let (sin, cos) = num_dual::DualNum::sin_cos(&unit(alpha, 6));
    let correction = KarmanTsien::new(unit(mach, 7));
    for j in 0..panel_count(section) {
        let next = (j + 1) % n;
        let [a, b] = section.panels.outline.panel(j);
        let panel = [[unit(a[0], 0), unit(a[1], 1)], [unit(b[0], 2), unit(b[1], 3)]];
        let cp = [unit(strengths[j], 4), unit(strengths[next], 5)].map(|q| correction.pressure(q));
        for (k, load) in panel_loads(panel, cp, [cos, sin]).iter().enumerate() {
            let g = gradient(load);
            for (end, node) in [j, next].into_iter().enumerate() {
                result.nodes[k][node][0] += g[2 * end];
                result.nodes[k][node][1] += g[2 * end + 1];
                result.strengths[k][node] += g[4 + end];
            }
            result.alpha[k] += g[6];
            result.mach[k] += g[7];
        }
    }
    let (at, peak) = highest_speed(section, strengths);
    let g =
        gradient(&KarmanTsien::new(Dual4::from_re(mach).derivative(1)).pressure(Dual4::from_re(peak).derivative(0)));
    // the position of the peak does not matter to first order
    let (first, weights) = section.map.spline.weights(at);
    let mut by_coefficient = vec![0.0; n + 2];
    for (q, w) in weights.iter().enumerate() {
        by_coefficient[first + q] = g[0] * w;
    }
    result.strengths[2] = section.map.spline.coefficients_transposed(&by_coefficient);
    result.mach[2] = g[1];
    result
}

/// Drag from the end of the wake (Squire & Young): 2 θ u^((5 + H)/2), all at the last station.
pub(crate) fn squire_young<S: Scalar>(log_theta: S, shape: S, log_speed: S) -> S {
    (log_theta + log_speed * (shape + 5.0) * 0.5).exp() * 2.0
}
