//! Reverse sweep through the panel equations: every panel and every node, once for all outputs.

use super::reverse::{Collected, Lanes, Reverse, Strengths, by_columns, lanes};
use super::sums::{Points, Quantity, Slopes, Vectors, panel_sums, scatter_ends};
use crate::flow::coefficients::Coefficients;
use crate::flow::duals::{Dual3, Dual4, Dual8, gradient};
use crate::flow::panel::coupling::response::{SectionResponse, edge_place};
use crate::flow::panel::kernel::Place;
use crate::flow::panel::outline::{TrailingEdge, TrailingEdgeFrame};
use crate::flow::panel::polar::{Pairs, Straight};
use num_dual::DualNum;
use std::ops::Range;

/// Negative multipliers of the panel equations.
pub(super) struct PanelWeights {
    /// Negative multipliers of the stream function at the nodes.
    pub stream: Coefficients<Vec<f64>>,
    /// Negative multipliers of the mean velocity through the cut at the trailing edge.
    pub edge: Lanes,
}

/// The multipliers for outputs with the given sensitivities to the strengths at the nodes.
pub(super) fn panel_weights(section: &SectionResponse, by_strength: &Coefficients<Vec<f64>>) -> PanelWeights {
    let n = section.len();
    let mut columns = by_columns(by_strength).resize_vertically(n + 1, 0.0);
    section.panels.factors.solve_transposed(&mut columns);
    let stream = |o: usize| {
        let mut weights: Vec<f64> = (0..n).map(|i| -columns[(i, o)]).collect();
        // the first equation is the mean of both edge nodes
        weights[0] *= 0.5;
        weights[n - 1] = weights[0];
        weights
    };
    PanelWeights {
        stream: Coefficients::from_array(std::array::from_fn(stream)),
        edge: Lanes::from_fn(|o, _| -columns[(n - 1, o)]),
    }
}

/// A panel relative to a point, with the positions of its ends as variables.
pub(super) fn seen_from(point: [f64; 2], panel: [[f64; 2]; 2]) -> [[Dual4; 2]; 2] {
    [0, 1].map(|end| [0, 1].map(|c| Dual4::from_re(panel[end][c] - point[c]).derivative(2 * end + c)))
}

pub(super) const ORIGIN: [f64; 2] = [0.0; 2];

pub(super) fn origin() -> [Dual4; 2] {
    ORIGIN.map(Dual4::from_re)
}

/// Stream functions of a panel of the surface for two pairs of sheets on it, which share the kernels.
struct SurfaceStream<'a> {
    pairs: Pairs<'a>,
    panel: Straight,
    sheets: [PanelSheets; 2],
}

/// The sheets on one panel.
#[derive(Debug, Clone, Copy)]
struct PanelSheets {
    /// Vortex strengths at the two ends.
    strengths: [f64; 2],
    /// Rise of the smoothed mass defect over the panel.
    jump: f64,
}

impl PanelSheets {
    fn new(sheets: &Strengths, j: usize) -> Self {
        let Strengths { nodes, smoothed, .. } = sheets;
        Self { strengths: [nodes[j], nodes[j + 1]], jump: smoothed[j + 1] - smoothed[j] }
    }
}

impl Quantity<3, 2> for SurfaceStream<'_> {
    #[inline(always)]
    fn of(&self, points: Range<usize>) -> Self {
        Self { pairs: self.pairs.of(points), ..*self }
    }

    #[inline(always)]
    fn at(&self, i: usize, at: [Dual3; 2], length: Dual3, place: Place) -> [[f64; 3]; 2] {
        let influence = self.pairs.of_surface(i, &self.panel).sight(at, length, place).stream();
        let [a, b] = influence.vortex;
        let source = influence.source * length.recip();
        self.sheets.map(|own| (a * own.strengths[0] + b * own.strengths[1] - source * own.jump).eps)
    }
}

/// Stream function of a half panel of the wake.
struct WakeStream<'a> {
    pairs: Pairs<'a>,
    panel: Straight,
    /// Source strengths at the two ends.
    strengths: [f64; 2],
}

impl Quantity<3> for WakeStream<'_> {
    #[inline(always)]
    fn of(&self, points: Range<usize>) -> Self {
        Self { pairs: self.pairs.of(points), ..*self }
    }

    #[inline(always)]
    fn at(&self, i: usize, at: [Dual3; 2], length: Dual3, place: Place) -> [[f64; 3]; 1] {
        let [a, b] = self.pairs.of_wake(i, &self.panel).sight(at, length, place).wake_stream();
        [(a * self.strengths[0] + b * self.strengths[1]).eps]
    }
}

/// Adds the derivatives of the panel equations with respect to the nodes and the angle of attack, for two pairs of
/// sheets on the section, each with its multipliers: those of the solution, and those of the flow without boundary layer
/// that carries the wake.
pub(super) fn add_panels(reverse: &Reverse, parts: [(&Strengths, &PanelWeights); 2], collected: &mut Collected) {
    let outline = &reverse.section.panels.outline;
    let n = outline.len();
    let points =
        parts.map(|(_, weights)| Points::new(&outline.nodes, |i| lanes(&weights.stream, |weights| weights[i])));
    for ((_, weights), points) in parts.iter().zip(&points) {
        add_onset(reverse, weights, points, collected);
    }
    let mut slopes = Slopes::<3, 2>::zeros(n);
    let mut by_point = [(); 2].map(|()| Vectors::new([0.0; 2], n));
    let mut sums = [(); 2].map(|()| Vec::with_capacity(n));
    for j in 0..n - 1 {
        let panel = Straight::new(outline.panel(j));
        let pairs = reverse.section.panels.polar.pairs_of([j, j + 1]);
        let stream = SurfaceStream { pairs, panel, sheets: parts.map(|(sheets, _)| PanelSheets::new(sheets, j)) };
        // the other ends of a sharp edge, too, stand on the first and the last panel
        slopes.fill(&points[0], &panel, &stream, [0, j, j + 1, n - 1], |i| outline.place(i, j));
        for m in 0..2 {
            sums[m].push(panel_sums(&points[m], &slopes, m));
            slopes.add_outer(m, &panel, &mut by_point[m]);
        }
    }
    for (m, (sheets, _)) in parts.into_iter().enumerate() {
        scatter_ends(&sums[m], &outline.nodes, &mut collected.nodes);
        if outline.trailing_edge == TrailingEdge::Blunt {
            let speed = 0.5 * (sheets.nodes[0] - sheets.nodes[n - 1]);
            add_closing(reverse, speed, &points[m], &mut by_point[m], collected);
        }
        points[m].add_weighted(&by_point[m], collected);
    }
}

/// Adds the stream function of the onset flow at the nodes, y cos α − x sin α.
fn add_onset(reverse: &Reverse, weights: &PanelWeights, points: &Points, collected: &mut Collected) {
    let (sin, cos) = reverse.flow.alpha.sin_cos();
    for (nodes, weights) in collected.nodes.iter_mut().zip(weights.stream.iter()) {
        for (node, w) in nodes.iter_mut().zip(weights) {
            node[0] -= w * sin;
            node[1] += w * cos;
        }
    }
    for (point, weights) in reverse.section.panels.outline.nodes.iter().zip(&points.weights) {
        collected.alpha -= weights * (point[1] * sin + point[0] * cos);
    }
}

/// Vortex and source strength of the closing panel per unit edge speed, with derivatives with respect to the first two
/// nodes and the last two.
pub(super) fn closing_strengths(reverse: &Reverse) -> [Dual8; 2] {
    let nodes = &reverse.section.panels.outline.nodes;
    let frame = edge_frame_dual(nodes);
    let n = nodes.len();
    let unit = |v: f64, k: usize| Dual8::from_re(v).derivative(k);
    let dx = unit(nodes[0][0], 0) - unit(nodes[n - 1][0], 6);
    let dy = unit(nodes[0][1], 1) - unit(nodes[n - 1][1], 7);
    let length = num_dual::DualNum::sqrt(&(dx * dx + dy * dy));
    [frame.vortex / length, frame.source / length]
}

/// The frame of the trailing edge as a function of the nodes 0, 1, N − 2 and N − 1, with two directions per node.
pub(super) fn edge_frame_dual(nodes: &[[f64; 2]]) -> TrailingEdgeFrame<Dual8> {
    let n = nodes.len();
    let at = |i: usize, k: usize| [0, 1].map(|c| Dual8::from_re(nodes[i][c]).derivative(2 * k + c));
    TrailingEdgeFrame::new([at(0, 0), at(1, 1)], [at(n - 2, 2), at(n - 1, 3)])
}

/// Adds a gradient with respect to the four edge nodes, times the weight of every coefficient.
pub(super) fn scatter_edge(g: [f64; 8], weights: &Lanes, nodes: &mut Coefficients<Vec<[f64; 2]>>) {
    for (nodes, weight) in nodes.iter_mut().zip(weights) {
        let n = nodes.len();
        for (k, i) in [0, 1, n - 2, n - 1].into_iter().enumerate() {
            for c in 0..2 {
                nodes[i][c] += weight * g[2 * k + c];
            }
        }
    }
}

/// Stream function of the closing panel of a blunt edge. The last two numbers are the parts per vortex and per source
/// strength.
struct ClosingStream<'a> {
    pairs: Pairs<'a>,
    panel: Straight,
    /// Vortex strength, equal at both ends.
    vortex: f64,
    /// Source strength, equal at both ends.
    source: f64,
}

impl Quantity<5> for ClosingStream<'_> {
    #[inline(always)]
    fn of(&self, points: Range<usize>) -> Self {
        Self { pairs: self.pairs.of(points), ..*self }
    }

    #[inline(always)]
    fn at(&self, i: usize, at: [Dual3; 2], length: Dual3, place: Place) -> [[f64; 5]; 1] {
        let influence = self.pairs.of_surface(i, &self.panel).sight(at, length, place).stream();
        let by_vortex = influence.vortex[0] + influence.vortex[1];
        let [x, z, stretch] = (by_vortex * self.vortex + influence.source * self.source).eps;
        [[x, z, stretch, by_vortex.re, influence.source.re]]
    }
}

/// Adds the closing panel for a given speed at the edge, and adds to `by_point` the derivatives with respect to the
/// points that see it.
fn add_closing(reverse: &Reverse, speed: f64, points: &Points, by_point: &mut Vectors, collected: &mut Collected) {
    let outline = &reverse.section.panels.outline;
    let n = outline.len();
    let [vortex, source] = closing_strengths(reverse);
    let panel = Straight::new(outline.panel(n - 1));
    let pairs = reverse.section.panels.polar.pairs_of([n - 1, 0]);
    let stream = ClosingStream { pairs, panel, vortex: vortex.re * speed, source: source.re * speed };
    let mut slopes = Slopes::zeros(n);
    slopes.fill(points, &panel, &stream, [0, n - 1], |i| outline.place(i, n - 1));
    panel_sums(points, &slopes, 0).scatter(outline.panel(n - 1), [n - 1, 0], &mut collected.nodes);
    slopes.add_outer(0, &panel, by_point);
    let [by_vortex, by_source] = [3, 4].map(|number| points.sum(&slopes, number) * speed);
    scatter_edge(gradient(&vortex), &by_vortex, &mut collected.nodes);
    scatter_edge(gradient(&source), &by_source, &mut collected.nodes);
}

/// Adds the wake sources in the stream function at the nodes: derivatives with respect to the nodes and to the ends of
/// the half panels of the wake.
pub(super) fn add_wake_stream(
    reverse: &Reverse,
    weights: &PanelWeights,
    points: &[[f64; 2]],
    by_points: &mut Coefficients<Vec<[f64; 2]>>,
    collected: &mut Collected,
) {
    let outline = &reverse.section.panels.outline;
    let strengths = &reverse.at_solution.wake;
    let n = outline.len();
    let nodes = Points::new(&outline.nodes, |i| lanes(&weights.stream, |weights| weights[i]));
    let mut slopes = Slopes::zeros(n);
    let mut by_node = Vectors::new([0.0; 2], n);
    let mut sums = Vec::with_capacity(n);
    for h in 0..points.len() - 1 {
        let panel = Straight::new([points[h], points[h + 1]]);
        let pairs = reverse.flow.polar.pairs_of([h, h + 1]);
        let stream = WakeStream { pairs, panel, strengths: [strengths[h], strengths[h + 1]] };
        slopes.fill(&nodes, &panel, &stream, [0, n - 1], |i| edge_place(outline, i, h));
        sums.push(panel_sums(&nodes, &slopes, 0));
        slopes.add_outer(0, &panel, &mut by_node);
    }
    scatter_ends(&sums, points, by_points);
    nodes.add_weighted(&by_node, collected);
}

#[cfg(test)]
mod tests;
