//! The equation of the trailing edge: no flow out of the section through a cut just ahead of the edge.
//!
//! The first and the last node of a sharp edge are one point and give one stream-function equation. Those of a thin
//! blunt edge give two almost equal equations, whose difference, the flow through the gap, is lost to round-off as the
//! gap closes. The difference over the gap is the mean velocity across it. It is taken here by quadrature over the gap
//! moved a little upstream along the bisector. That equation is well scaled for every gap. For a sharp edge it says
//! that the air at a point between the two sides is at rest (Drela, XFOIL, 1989, section 2, there for sharp edges).
//!
//! An extrapolation of the strength to the edge cannot take its place. It makes no statement about the sources, so that
//! the boundary layers see an edge that answers the wrong way: the coupled equations become singular for certain ratios
//! of gap and panel length.

use super::kernel::{Place, velocity_influence};
use super::outline::{Outline, TrailingEdge, TrailingEdgeFrame};
use super::polar::{Polar, Straight};
use crate::plane::distance;
use crate::scalar::Scalar;
use nalgebra::DMatrix;

/// Distance of the cut from the edge, in lengths of the last panels (their harmonic mean, so that the cut stays
/// inside).
///
/// Lift changes by 0.3 % between 0.02 and 0.5, inviscid lift by 1e-5. Beyond about one length the strength at the edge
/// itself is no longer determined. At 0.05 the lift is that of the two stream-function equations of a blunt edge.
const DEPTH: f64 = 0.05;
/// Nodes, over the half gap, and weights of the three-point Gauss rule on each half of the gap. The halves are separate
/// because the velocity peaks in line with the wake as well as at the corners.
const GAUSS: [[f64; 2]; 6] = [
    [-0.887_298_334_620_741_7, 5.0 / 36.0],
    [-0.5, 8.0 / 36.0],
    [-0.112_701_665_379_258_3, 5.0 / 36.0],
    [0.112_701_665_379_258_3, 5.0 / 36.0],
    [0.5, 8.0 / 36.0],
    [0.887_298_334_620_741_7, 5.0 / 36.0],
];

/// Points across the section just ahead of its edge, and the direction through the cut.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cut<S> {
    /// Points with their weights in the mean.
    pub points: [([S; 2], f64); 6],
    /// Unit vector along the bisector, downstream.
    pub direction: [S; 2],
}

impl<S: Scalar> Cut<S> {
    /// The cut from the first two nodes and the last two, in the order of the section.
    pub fn new(first: [[S; 2]; 2], last: [[S; 2]; 2]) -> Self {
        let frame = TrailingEdgeFrame::new(first, last);
        let length = |[a, b]: [[S; 2]; 2]| ((b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2)).sqrt();
        let (upper, lower) = (length(first), length(last));
        let depth = upper * lower / (upper + lower) * (2.0 * DEPTH);
        let gap = [0, 1].map(|c| first[0][c] - last[1][c]);
        let at = |across: f64| [0, 1].map(|c| frame.middle[c] - frame.bisector[c] * depth + gap[c] * (0.5 * across));
        Self { points: GAUSS.map(|[across, weight]| (at(across), weight)), direction: frame.bisector }
    }

    /// Component of a velocity through the cut.
    pub fn through(&self, velocity: [S; 2]) -> S {
        velocity[0] * self.direction[0] + velocity[1] * self.direction[1]
    }
}

impl Cut<f64> {
    /// Distances and directions from the vertices of panels to the points of the cut.
    fn polar(&self, vertices: &[[f64; 2]]) -> Polar {
        Polar::new(&self.points.map(|p| p.0), vertices)
    }

    /// Mean velocity through the cut per vortex strength (first row) and per source strength (second row) at the two
    /// ends of panel `j`.
    fn through_of_panel(&self, polar: &Polar, j: usize, panel: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
        let panel = Straight::new(panel);
        let mut sums = [[0.0; 2]; 2];
        for (p, (point, weight)) in self.points.into_iter().enumerate() {
            let seen = polar.seen_of_surface(p, [j, j + 1], &panel);
            let v = seen.sight(panel.local(point), panel.length, Place::Elsewhere).velocity();
            for end in 0..2 {
                sums[0][end] += weight * self.through(panel.outer(v.vortex(end)));
                sums[1][end] += weight * self.through(panel.outer(v.source(end)));
            }
        }
        sums
    }
}

/// The equation of the edge of one section: the mean velocity through the cut, as a linear function of the strengths.
#[derive(Debug, Clone)]
pub(crate) struct EdgeEquation {
    /// Points of the cut and the direction through it.
    pub cut: Cut<f64>,
    /// Mean velocity per vortex strength at each node.
    pub by_strength: Vec<f64>,
    /// Mean velocity per constant source strength of each panel.
    pub by_source: Vec<f64>,
    /// Distances and directions from the nodes to the points of the cut.
    pub polar: Polar,
}

impl EdgeEquation {
    pub fn new(outline: &Outline) -> Self {
        let (nodes, n) = (&outline.nodes, outline.len());
        let cut = Cut::new([nodes[0], nodes[1]], [nodes[n - 2], nodes[n - 1]]);
        let polar = cut.polar(nodes);
        let (mut by_strength, mut by_source) = (vec![0.0; n], vec![0.0; n - 1]);
        for j in 0..n - 1 {
            let [vortex, source] = cut.through_of_panel(&polar, j, outline.panel(j));
            by_strength[j] += vortex[0];
            by_strength[j + 1] += vortex[1];
            by_source[j] += source[0] + source[1];
        }
        if outline.trailing_edge == TrailingEdge::Blunt {
            for (point, weight) in cut.points {
                let closing = weight * cut.through(closing_velocity(outline, point));
                by_strength[0] += 0.5 * closing;
                by_strength[n - 1] -= 0.5 * closing;
            }
        }
        Self { cut, by_strength, by_source, polar }
    }

    /// Mean velocity through the cut per strength at the ends of the linear source panels through `points`, with the
    /// distances and directions from these points to the cut.
    pub fn by_wake(&self, points: &[[f64; 2]]) -> (Vec<f64>, Polar) {
        let polar = self.cut.polar(points);
        let mut result = vec![0.0; points.len()];
        for h in 0..points.len() - 1 {
            let [_, source] = self.cut.through_of_panel(&polar, h, [points[h], points[h + 1]]);
            result[h] += source[0];
            result[h + 1] += source[1];
        }
        (result, polar)
    }

    /// Writes the equation to row `row` of the panel equations.
    pub fn write(&self, matrix: &mut DMatrix<f64>, row: usize) {
        matrix.row_mut(row).fill(0.0);
        for (j, value) in self.by_strength.iter().enumerate() {
            matrix[(row, j)] = *value;
        }
    }
}

/// Velocity of the closing panel of a blunt edge at `point`, per unit edge speed at the trailing edge.
pub(crate) fn closing_velocity(outline: &Outline, point: [f64; 2]) -> [f64; 2] {
    let n = outline.len();
    let frame = outline.edge_frame();
    let panel = outline.panel(n - 1);
    let length = distance(panel[0], panel[1]);
    let v = velocity_influence(panel, point, Place::Elsewhere);
    [0, 1].map(|c| {
        ((v.vortex[0][c] + v.vortex[1][c]) * frame.vortex + (v.source[0][c] + v.source[1][c]) * frame.source) / length
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::panel::inviscid::PanelSystem;
    use crate::flow::testcases::naca_symmetric;

    /// The mean velocity through the gap itself is the difference of the stream function at its ends over its width.
    #[test]
    fn it_is_the_difference_of_the_stream_functions_over_the_gap() {
        let outline = Outline::new(&naca_symmetric(0.12, 0.01, 161), TrailingEdge::Blunt).unwrap();
        let panels = PanelSystem::new(outline).unwrap();
        let strengths = panels.strengths(0.05);
        let nodes = &panels.outline.nodes;
        let stream = |i: usize| -> f64 {
            let panel = |j: usize| panels.outline.panel(j);
            let own: f64 = (0..160)
                .map(|j| {
                    let f =
                        crate::flow::panel::kernel::stream_influence(panel(j), nodes[i], panels.outline.place(i, j));
                    f.vortex[0] * strengths[j] + f.vortex[1] * strengths[j + 1]
                })
                .sum();
            let speed = 0.5 * (strengths[0] - strengths[160]);
            let onset = nodes[i][1] * 0.05f64.cos() - nodes[i][0] * 0.05f64.sin();
            own + onset + speed * crate::flow::panel::inviscid::closing_influence(&panels.outline, i)
        };
        // no flow through the gap, though only the mean of the two equations at its ends is in the system
        assert!(((stream(0) - stream(160)) / 0.01).abs() < 0.01, "{} {}", stream(0), stream(160));
    }

    #[test]
    fn the_cut_is_inside_the_section() {
        for (gap, n) in [(0.0, 41), (1e-4, 161), (0.02, 161)] {
            let nodes = naca_symmetric(0.12, gap, n);
            let cut = Cut::new([nodes[0], nodes[1]], [nodes[n - 2], nodes[n - 1]]);
            for (point, _) in cut.points {
                let share = (1.0 - point[0]) / (1.0 - nodes[1][0]);
                let surface = nodes[0][1] + share * (nodes[1][1] - nodes[0][1]);
                assert!(share > 0.02 && share < 0.1 && point[1].abs() < surface, "{point:?} {share} {surface}");
            }
        }
    }
}
