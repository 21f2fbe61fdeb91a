//! The coefficients of a solution: how each follows from the solved state, and which quantities it depends on directly.

use super::compressibility::{KarmanTsien, PanelEdge, panel_loads};
use super::coupling::reduced::Reduced;
use super::coupling::response::SectionResponse;
use super::coupling::system::{Evaluated, System};
use super::outline::TrailingEdge;
use super::solved::{Direct, Solved, output_gradient, through_defects};
use crate::flow::coefficients::Coefficients;
use crate::flow::duals::{Dual2, Dual3, Dual8, gradient};
use crate::flow::layer::{Derived, EdgeLaw, Numbering, Regime, Side, State};
use crate::flow::linear::dot;
use crate::flow::search::Equations;
use crate::flow::surface::spline::{IndexSpline, combine_real};
use crate::scalar::Scalar;
use nalgebra::DMatrix;
use num_dual::DualNum;
use std::f64::consts::FRAC_PI_2;

/// The coefficients that follow from the speed along the surface alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SurfaceValues {
    /// Lift coefficient.
    pub cl: f64,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: f64,
    /// Lowest pressure coefficient on the surface, smooth where the suction peaks of both sides tie.
    pub cp_min: f64,
}

/// The coefficients of a solution.
///
/// `strengths` are the vortex strengths at the nodes, and `nodes` the nodes in the frame of the section.
pub(super) fn values(
    (system, mach): (&System, f64),
    state: &Evaluated,
    strengths: &[f64],
    nodes: &[[f64; 2]],
) -> Coefficients {
    let section = system.section;
    let SurfaceValues { cl, cm, cp_min } = surface_values(section, strengths, system.flow.alpha, mach);
    let cd = drag(&state.derived[state.derived.len() - 1]);
    let spline = &section.map.spline;
    let c = abscissas(spline, nodes);
    let transition =
        Side::BOTH.map(|side| spline.value(&c, state.positions.index[last_laminar(&state.numbering, side)]));
    Coefficients { cl, cd, cm, cp_min, transition }
}

/// The direct dependence of every coefficient of a solution.
pub(super) fn direct(solved: &Solved) -> Coefficients<Direct> {
    let numbering = solved.at.numbering;
    let mut all = Coefficients::<()>::default().map(|()| Direct::none(solved.nodes.len(), numbering.stations()));
    let Coefficients { cl, cd, cm, cp_min, transition: transitions } = &mut all;
    add_loads(solved, [cl, cm]);
    add_lowest_pressure(solved, cp_min);
    add_drag(solved, cd);
    for (side, direct) in Side::BOTH.into_iter().zip(transitions) {
        add_transition(solved, side, direct);
    }
    all
}

/// Derivative of the lift coefficient with respect to the angle of attack (per radian), with the wake held where it is.
pub(super) fn lift_slope(solved: &Solved, reduced: &Reduced) -> f64 {
    let system = &solved.system;
    let mut cl = Direct::none(solved.nodes.len(), solved.at.numbering.stations());
    add_loads(solved, [&mut cl, &mut Direct::none(solved.nodes.len(), 0)]);
    let strengths = DMatrix::from_row_slice(1, cl.strengths.len(), &cl.strengths);
    let (by_nodes, by_wake) = through_defects(system, &strengths);
    let by_unknowns = output_gradient(solved, &cl, by_nodes.as_slice(), by_wake.as_slice());
    let turning = system.flow.onset(system.section, system.flow.alpha + FRAC_PI_2);
    cl.alpha + dot(&cl.strengths, &turning.inviscid) + by_unknowns.dot(&system.by_angle(solved.at, reduced))
}

/// Number of panels that carry pressure: the closing panel of a blunt edge is one of them.
fn panel_count(section: &SectionResponse) -> usize {
    match section.panels.outline.trailing_edge {
        TrailingEdge::Blunt => section.len(),
        TrailingEdge::Sharp => section.len() - 1,
    }
}

/// Lift, moment and lowest pressure coefficient for vortex strengths at the nodes, at an angle of attack in radians.
pub(super) fn surface_values(section: &SectionResponse, strengths: &[f64], alpha: f64, mach: f64) -> SurfaceValues {
    let correction = KarmanTsien::new(mach);
    let wind = [alpha.cos(), alpha.sin()];
    let (mut cl, mut cm) = (0.0, 0.0);
    for j in 0..panel_count(section) {
        let next = (j + 1) % section.len();
        let cp = [strengths[j], strengths[next]].map(|q| correction.pressure(q));
        let [lift, moment] = panel_loads(section.panels.outline.panel(j), cp, wind);
        cl += lift;
        cm += moment;
    }
    let peaks = suction_peaks(section, strengths).map(|(_, speed)| speed);
    SurfaceValues { cl, cm, cp_min: lowest_pressure(&correction, peaks) }
}

/// Adds the direct dependence of lift (first) and moment (second).
fn add_loads(solved: &Solved, mut loads: [&mut Direct; 2]) {
    let (section, strengths) = (solved.system.section, solved.strengths);
    let unit = |v: f64, k: usize| Dual8::from_re(v).derivative(k);
    let (sin, cos) = unit(solved.system.flow.alpha, 6).sin_cos();
    let correction = KarmanTsien::new(unit(solved.stream.mach, 7));
    for j in 0..panel_count(section) {
        let next = (j + 1) % section.len();
        let [a, b] = section.panels.outline.panel(j);
        let panel = [[unit(a[0], 0), unit(a[1], 1)], [unit(b[0], 2), unit(b[1], 3)]];
        let cp = [unit(strengths[j], 4), unit(strengths[next], 5)].map(|q| correction.pressure(q));
        for (load, direct) in panel_loads(panel, cp, [cos, sin]).iter().zip(&mut loads) {
            let g = gradient(load);
            for (end, node) in [j, next].into_iter().enumerate() {
                direct.panels[node][0] += g[2 * end];
                direct.panels[node][1] += g[2 * end + 1];
                direct.strengths[node] += g[4 + end];
            }
            direct.alpha += g[6];
            direct.mach += g[7];
        }
    }
}

/// Sharpness of the smooth maximum of the two suction peaks, per onset speed. Peaks that tie count as 0.002 faster than
/// they are; peaks that differ by 0.02 in speed are apart to 1e-6.
const PEAK_SHARPNESS: f64 = 400.0;

/// The highest speed on each side of the stagnation point: the node index where the spline of the speed has its largest
/// magnitude, and the speed there, positive on the upper side and negative on the lower.
pub(super) fn suction_peaks(section: &SectionResponse, strengths: &[f64]) -> [(f64, f64); 2] {
    let spline = &section.map.spline;
    let c = spline.coefficients(strengths);
    let last = strengths.len() - 1;
    [1.0, -1.0].map(|sign| {
        let speed = |i: usize| sign * strengths[i];
        let node = (1..=last).fold(0, |best, i| if speed(i) >= speed(best) { i } else { best });
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
    })
}

/// The lowest pressure coefficient from the speeds at the suction peaks of both sides.
///
/// The two are joined by a smooth maximum, so that the result has derivatives where they tie, as on a symmetric section
/// at zero lift.
fn lowest_pressure<S: Scalar>(correction: &KarmanTsien<S>, [upper, lower]: [S; 2]) -> S {
    correction.pressure(upper.smooth_maximum(-lower, PEAK_SHARPNESS))
}

/// Highest local Mach number on the surface for a Mach number of the onset flow.
pub(super) fn highest_mach(section: &SectionResponse, strengths: &[f64], mach: f64) -> f64 {
    let [upper, lower] = suction_peaks(section, strengths).map(|(_, speed)| speed.abs());
    // the Reynolds number has no part in this
    let edge = PanelEdge::new(mach, 1.0).edge(upper.max(lower));
    // beyond the speed at which the formula of Kármán and Tsien, or the temperature, ends
    if edge.speed > 0.0 && edge.mach2 >= 0.0 { edge.mach2.sqrt() } else { f64::INFINITY }
}

/// Adds the direct dependence of the lowest pressure. To first order the places of the peaks do not matter.
fn add_lowest_pressure(solved: &Solved, direct: &mut Direct) {
    let spline = &solved.system.section.map.spline;
    let peaks = suction_peaks(solved.system.section, solved.strengths);
    let unit = |v: f64, k: usize| Dual3::from_re(v).derivative(k);
    let speeds = [unit(peaks[0].1, 0), unit(peaks[1].1, 1)];
    let by = gradient(&lowest_pressure(&KarmanTsien::new(unit(solved.stream.mach, 2)), speeds));
    for ((at, _), by_speed) in peaks.into_iter().zip(by) {
        for (sum, own) in direct.strengths.iter_mut().zip(spline.values_transposed(at, by_speed)) {
            *sum += own;
        }
    }
    direct.mach = by[2];
}

/// The direct dependence of a weighted sum of the pressure coefficients at the nodes, and none without weights.
pub(super) fn pressure_direct(weights: Option<&Vec<f64>>, solved: &Solved) -> Direct {
    let mut direct = Direct::none(solved.nodes.len(), solved.at.numbering.stations());
    let mach = Dual2::from_re(solved.stream.mach).derivative(1);
    let correction = KarmanTsien::new(mach);
    for (node, (weight, speed)) in weights.into_iter().flatten().zip(solved.strengths).enumerate() {
        let [by_speed, by_mach] = gradient(&correction.pressure(Dual2::from_re(*speed).derivative(0)));
        direct.strengths[node] = weight * by_speed;
        direct.mach += weight * by_mach;
    }
    direct
}

/// Drag coefficient from the last station of the wake, 2 θ u^((5 + H)/2) (Squire & Young).
fn drag<S: Scalar>(end: &Derived<S>) -> S {
    (end.state.log_theta + end.log_speed * (end.shape + 5.0) * 0.5).exp() * 2.0
}

/// Adds the direct dependence of drag: on the last station, and on the Mach and Reynolds number by which the state at
/// the edge follows from it.
fn add_drag(solved: &Solved, direct: &mut Direct) {
    let last = solved.at.derived.len() - 1;
    direct.unknowns.stations[last] = State::gradient(&drag(&solved.at.derived[last]));
    let [mach, reynolds] =
        [Dual2::from_re(solved.stream.mach).derivative(0), Dual2::from_re(solved.stream.reynolds).derivative(1)];
    let end = solved.unknowns.stations[last].map(Dual2::from_re);
    [direct.mach, direct.reynolds] = gradient(&drag(&Derived::new(end, Regime::Wake, &PanelEdge::new(mach, reynolds))));
}

/// Number of the last laminar point of a side along the surface, where transition is.
fn last_laminar(numbering: &Numbering, side: Side) -> usize {
    numbering.point(side, numbering.laminar - 1)
}

/// Spline coefficients of the abscissas of nodes over the node index.
fn abscissas(spline: &IndexSpline, nodes: &[[f64; 2]]) -> Vec<f64> {
    spline.coefficients(&nodes.iter().map(|p| p[0]).collect::<Vec<_>>())
}

/// Adds the direct dependence of the abscissa of transition on a side.
fn add_transition(solved: &Solved, side: Side, direct: &mut Direct) {
    let point = last_laminar(&solved.at.numbering, side);
    let t = solved.at.positions.index[point].re;
    let spline = &solved.system.section.map.spline;
    let slope = combine_real(&spline.slope_weights(t), &abscissas(spline, solved.nodes));
    direct.index.push((point, slope));
    for (given, by_x) in direct.given.iter_mut().zip(spline.values_transposed(t, 1.0)) {
        given[0] = by_x;
    }
}

#[cfg(test)]
mod tests;
