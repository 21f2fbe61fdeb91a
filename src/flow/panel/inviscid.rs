//! The inviscid problem: linear vortex panels that make the inside of the section a streamline.

use super::edge::EdgeEquation;
use super::kernel::{Place, stream_influence};
use super::outline::{Outline, TrailingEdge};
use super::polar::{Polar, Straight};
use crate::flow::FlowError;
use crate::flow::linear::{Factors, add_scaled};
use crate::plane::distance;
use nalgebra::DMatrix;

/// Factorised panel equations of one section, which give the vortex strengths at the nodes for any onset flow.
///
/// The unknowns are the clockwise strengths at the N nodes and the stream function inside. The equations are the stream
/// function at the nodes and the Kutta condition (Drela, XFOIL, 1989, section 2). The two nodes at the trailing edge
/// share row 0, the mean of their equations; row N − 1 is the [equation of the edge](super::edge).
#[derive(Debug, Clone)]
pub(crate) struct PanelSystem {
    /// Nodes through which the panels are laid.
    pub outline: Outline,
    /// Factors of the matrix of the panel equations, of order N + 1.
    pub factors: Factors,
    /// Solutions at an angle of attack of zero (first column) and of 90 degrees (second column): the strengths at the
    /// nodes and, in the last row, the stream function inside.
    pub unit: DMatrix<f64>,
    /// Stream function at the nodes per constant source strength of each panel, N × (N − 1).
    pub source: DMatrix<f64>,
    /// The equation of the trailing edge.
    pub edge: EdgeEquation,
    /// Distances and directions between the nodes.
    pub polar: Polar,
}

impl PanelSystem {
    /// Sets up and factorises the panel equations.
    ///
    /// # Errors
    /// [`FlowError::SingularPanels`] where they have no unique solution.
    pub fn new(outline: Outline) -> Result<Self, FlowError> {
        let n = outline.len();
        let mut matrix = DMatrix::zeros(n + 1, n + 1);
        let mut source = DMatrix::zeros(n, n - 1);
        let polar = Polar::among(&outline.nodes);
        let mut seen = PanelColumns::new(n);
        for j in 0..n - 1 {
            seen.fill(&outline, &polar, j);
            for (end, influence) in seen.vortex.iter().enumerate() {
                add_scaled(&mut matrix.column_mut(j + end).as_mut_slice()[..n], 1.0, influence);
            }
            source.column_mut(j).copy_from_slice(&seen.source);
        }
        matrix.column_mut(n).rows_mut(0, n).fill(-1.0);
        if outline.trailing_edge == TrailingEdge::Blunt {
            for i in 0..n {
                let closing = closing_influence(&outline, i);
                matrix[(i, 0)] += 0.5 * closing;
                matrix[(i, n - 1)] -= 0.5 * closing;
            }
        }
        share_edge_rows(&mut matrix, n);
        let edge = EdgeEquation::new(&outline);
        edge.write(&mut matrix, n - 1);
        // Kutta condition
        matrix[(n, 0)] = 1.0;
        matrix[(n, n - 1)] = 1.0;
        let factors = Factors::new(&matrix).ok_or(FlowError::SingularPanels)?;
        let mut unit = DMatrix::zeros(n + 1, 2);
        for (i, node) in outline.nodes.iter().enumerate() {
            unit[(i, 0)] = -node[1];
            unit[(i, 1)] = node[0];
        }
        share_edge_rows(&mut unit, n);
        for c in 0..2 {
            unit[(n - 1, c)] = -edge.cut.direction[c];
        }
        factors.solve(&mut unit);
        Ok(Self { outline, factors, unit, source, edge, polar })
    }

    /// Vortex strengths at the nodes, equal to the speed along the surface (positive clockwise, in units of the
    /// onset speed), at angle of attack `alpha` in radians.
    pub fn strengths(&self, alpha: f64) -> Vec<f64> {
        let (sin, cos) = alpha.sin_cos();
        (0..self.outline.len()).map(|i| self.unit[(i, 0)] * cos + self.unit[(i, 1)] * sin).collect()
    }
}

/// Stream function of one panel at all nodes.
struct PanelColumns {
    /// Per vortex strength at the start and at the end.
    vortex: [Vec<f64>; 2],
    /// Per constant source strength.
    source: Vec<f64>,
}

impl PanelColumns {
    fn new(nodes: usize) -> Self {
        let room = || vec![0.0; nodes];
        Self { vortex: [room(), room()], source: room() }
    }

    /// Computes the stream function of panel `j`. All nodes are taken as standing off the panel first, so that the
    /// compiler can use vectors; then those at the ends are set right.
    fn fill(&mut self, outline: &Outline, polar: &Polar, j: usize) {
        let n = outline.len();
        let panel = Straight::new(outline.panel(j));
        let pairs = polar.pairs_of([j, j + 1]).of(0..n);
        let nodes = &outline.nodes[..n];
        let ([start, end], source) = (self.vortex.each_mut().map(|v| &mut v[..n]), &mut self.source[..n]);
        for i in 0..n {
            let influence = pairs.surface_sight(i, nodes[i], &panel, Place::Elsewhere).stream();
            [start[i], end[i]] = influence.vortex;
            source[i] = influence.source;
        }
        // the other ends of a sharp edge, too, stand on the first and the last panel
        for i in [0, j, j + 1, n - 1] {
            let influence = pairs.surface_sight(i, nodes[i], &panel, outline.place(i, j)).stream();
            [start[i], end[i]] = influence.vortex;
            source[i] = influence.source;
        }
    }
}

/// Stream function of the closing panel at node `i`, per unit edge speed at the trailing edge.
pub(crate) fn closing_influence(outline: &Outline, i: usize) -> f64 {
    let n = outline.len();
    let nodes = &outline.nodes;
    let frame = outline.edge_frame();
    let panel = outline.panel(n - 1);
    let influence = stream_influence(panel, nodes[i], outline.place(i, n - 1));
    let length = distance(panel[0], panel[1]);
    ((influence.vortex[0] + influence.vortex[1]) * frame.vortex + influence.source * frame.source) / length
}

/// Makes the first row the mean of the equations of the first and the last node, so that neither side is preferred.
pub(crate) fn share_edge_rows(rows: &mut DMatrix<f64>, n: usize) {
    for j in 0..rows.ncols() {
        rows[(0, j)] = 0.5 * (rows[(0, j)] + rows[(n - 1, j)]);
    }
}
