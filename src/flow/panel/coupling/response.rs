//! Linear response of the speeds on the surface and in the wake to the mass defect.
//!
//! Everything here is constant during the Newton iteration: the part of the airfoil belongs to the section, the part of
//! the wake also to the incidence. N is the number of nodes of the section, W that of the wake.

use super::subpanel;
use crate::flow::FlowError;
use crate::flow::linear::{add_scaled, product};
use crate::flow::memory::Memo;
use crate::flow::panel::inviscid::{PanelSystem, share_edge_rows};
use crate::flow::panel::kernel::{Place, velocity_influence};
use crate::flow::panel::outline::{Outline, TrailingEdge, TrailingEdgeFrame, arc_lengths};
use crate::flow::panel::polar::{Polar, Straight};
use crate::flow::panel::streamline::Streamline;
use crate::flow::panel::wake;
use crate::flow::surface::SurfaceMap;
use crate::flow::surface::spline::invert;
use crate::plane::distance;
use nalgebra::{DMatrix, SVector};
use std::sync::Arc;

/// One section: panels, surface coordinate and response to the mass defect along the section.
#[derive(Debug, Clone)]
pub(crate) struct SectionResponse {
    /// Factorised panel equations.
    pub panels: PanelSystem,
    /// Map between node index and arc length.
    pub map: SurfaceMap,
    /// Strengths at the nodes per unsmoothed mass defect at the nodes, N × N.
    pub nodes: DMatrix<f64>,
    /// Spline coefficients of the strengths per unsmoothed mass defect that is then smoothed, transposed: N × (N + 2).
    pub spline: DMatrix<f64>,
    /// Spline coefficients of the flat-wall response over the node index, transposed: N × (N + 2). The response is to
    /// be divided by the arc-length rate.
    pub wall: Arc<DMatrix<f64>>,
    /// Distances of the wake nodes from the trailing edge, in chords.
    pub wake_distances: Vec<f64>,
}

impl SectionResponse {
    /// Factorises the panel equations of a section. Panels are laid through the nodes themselves: nodes moved outwards by
    /// κ h²/12, with the surface in the middle of the panels, halve the error of the lift of smooth sections, but make the
    /// waves of measured sections count more than they do.
    pub fn new(outline: &Outline) -> Result<Self, FlowError> {
        let outline = outline.clone();
        let arc = arc_lengths(&outline.nodes);
        let map = SurfaceMap::new(&arc).ok_or(FlowError::UnevenNodes)?;
        let n = outline.len();
        let panels = PanelSystem::new(outline)?;
        let mut rows = DMatrix::zeros(n + 1, n);
        for j in 0..n - 1 {
            let length = arc[j + 1] - arc[j];
            for i in 0..n {
                let influence = panels.source[(i, j)] / length;
                rows[(i, j + 1)] += influence;
                rows[(i, j)] -= influence;
            }
        }
        share_edge_rows(&mut rows, n);
        rows.row_mut(n - 1).fill(0.0);
        for (j, influence) in panels.edge.by_source.iter().enumerate() {
            let influence = influence / (arc[j + 1] - arc[j]);
            rows[(n - 1, j + 1)] += influence;
            rows[(n - 1, j)] -= influence;
        }
        panels.factors.solve(&mut rows);
        let nodes = rows.remove_row(n);
        let spline = smoothed_spline_rows(&map, &nodes);
        let wall = WALL.get(n, || smoothed_spline_rows(&map, &wall_response(n)));
        let wake_distances = wake::distances(n - 1);
        Ok(Self { panels, map, nodes, spline, wall, wake_distances })
    }

    pub fn len(&self) -> usize {
        self.panels.outline.len()
    }

    pub fn edge_frame(&self) -> TrailingEdgeFrame<f64> {
        self.panels.outline.edge_frame()
    }
}

/// Number of smoothing passes over the mass defects at the nodes. The [wall](subpanel) response gives back what they
/// take away. The panels then see only waves that they resolve well, so that the position of a transition point between
/// two nodes hardly matters: two passes leave a third of the ripple of one, and more gain little.
const PASSES: usize = 2;

/// Smooths by passes of (1/4, 1/2, 1/4) over the nodes. The two nodes at each end keep their values.
pub(crate) fn smooth<T: Copy + std::ops::Add<Output = T> + std::ops::Mul<f64, Output = T>>(values: &mut [T]) {
    for _ in 0..PASSES {
        let mut before = values[1];
        for i in 2..values.len() - 2 {
            let here = values[i];
            values[i] = (before + values[i + 1]) * 0.25 + here * 0.5;
            before = here;
        }
    }
}

/// The response to a mass defect that is smoothed first: the transposed passes on every row.
pub(crate) fn smooth_columns(response: &DMatrix<f64>) -> DMatrix<f64> {
    let mut rows = response.transpose();
    smooth_transposed(&mut rows);
    rows.transpose()
}

/// The transposed passes of [`smooth`] on every column.
fn smooth_transposed(responses: &mut DMatrix<f64>) {
    let n = responses.nrows();
    let mut before = vec![0.0; n];
    for column in responses.as_mut_slice().chunks_exact_mut(n) {
        for _ in 0..PASSES {
            before.copy_from_slice(column);
            // only inner values are spread
            before[1] = 0.0;
            before[n - 2] = 0.0;
            for (inner, near) in column[2..n - 2].iter_mut().zip(before[1..n - 1].windows(3)) {
                *inner = near[1] * 0.5 + (near[0] + near[2]) * 0.25;
            }
            column[1] += before[2] * 0.25;
            column[n - 2] += before[n - 3] * 0.25;
        }
    }
}

/// Number of columns whose spline coefficients are computed together.
const LANES: usize = 8;

/// Spline coefficients of every column, transposed.
fn spline_rows(map: &SurfaceMap, values: &DMatrix<f64>) -> DMatrix<f64> {
    let (n, count) = values.shape();
    let mut result = DMatrix::zeros(count, n + 2);
    let mut together = vec![SVector::<f64, LANES>::zeros(); n];
    for (first, group) in values.as_slice().chunks(LANES * n).enumerate() {
        for (lane, column) in group.chunks_exact(n).enumerate() {
            together.iter_mut().zip(column).for_each(|(lanes, value)| lanes[lane] = *value);
        }
        let own = first * LANES..(first * LANES + LANES).min(count);
        let coefficients = map.spline.coefficients(&together);
        for (target, lanes) in result.as_mut_slice().chunks_exact_mut(count).zip(&coefficients) {
            target[own.clone()].copy_from_slice(&lanes.as_slice()[..own.len()]);
        }
    }
    result
}

/// Spline coefficients of the strengths or of the wall response to a mass defect that is smoothed first, transposed.
fn smoothed_spline_rows(map: &SurfaceMap, response: &DMatrix<f64>) -> DMatrix<f64> {
    let mut rows = spline_rows(map, response);
    smooth_transposed(&mut rows);
    rows
}

/// Nodes on either side of a spline coefficient of the flat-wall response beyond which the coefficient does not feel
/// them: the range of the kernel, the smoothing, and 32 nodes over which a spline forgets (a share of 0.27 per node).
const WALL_REACH: usize = subpanel::REACH as usize + PASSES + 32;

/// The nodes that are felt by the spline coefficients `first` to `last` of the flat-wall response, of `nodes` in all.
pub(crate) fn within_wall_reach(first: usize, last: usize, nodes: usize) -> std::ops::Range<usize> {
    // coefficient k belongs to node k − 1
    first.saturating_sub(WALL_REACH + 1).min(nodes)..(last + WALL_REACH).min(nodes)
}

/// The flat-wall response over the node index, which depends on the number of nodes alone.
static WALL: Memo<DMatrix<f64>> = Memo::new();

/// Flat-wall speed at the nodes per mass defect at the nodes, over the node index, N × N.
fn wall_response(n: usize) -> DMatrix<f64> {
    let t: Vec<f64> = (0..n).map(|i| i as f64).collect();
    let mut result = DMatrix::zeros(n, n);
    let wall = subpanel::Wall::new(&t);
    for i in 0..n {
        wall.influences(t[i], i, |k, influence| {
            result[(i, k + 1)] += influence;
            result[(i, k)] -= influence;
        });
    }
    result
}

/// One section at one incidence: onset flow and wake.
#[derive(Debug, Clone)]
pub(crate) struct FlowResponse {
    /// Angle of attack in radians.
    pub alpha: f64,
    /// Strengths at the nodes without boundary layer.
    pub inviscid: Vec<f64>,
    /// Spline coefficients of the strengths without boundary layer.
    pub inviscid_spline: Vec<f64>,
    /// Path of the wake.
    pub path: Streamline,
    /// Unit vectors along the wake at its nodes.
    pub wake_tangents: Vec<[f64; 2]>,
    /// Dead-air gap at the nodes of the wake, in chords.
    pub gap: Vec<f64>,
    /// Strengths at the nodes per mass defect of the wake, N × W.
    pub nodes_by_wake: DMatrix<f64>,
    /// Spline coefficients of the strengths per mass defect of the wake, transposed: W × (N + 2).
    pub spline_by_wake: DMatrix<f64>,
    /// Speed along the wake without boundary layer.
    pub wake_inviscid: Vec<f64>,
    /// Speed along the wake per smoothed mass defect at the nodes, transposed: N × W.
    pub wake_by_nodes: DMatrix<f64>,
    /// Speed along the wake per mass defect of the wake, W × W.
    pub wake_by_wake: DMatrix<f64>,
    /// Speed along the wake per strength at the nodes, W × N, kept for the adjoint.
    pub wake_by_strength: DMatrix<f64>,
    /// Distances and directions from the ends of the half panels of the wake to the nodes of the section.
    pub polar: Polar,
    /// Distances and directions from the nodes of the section to the points of the cut at the trailing edge and, behind
    /// these, to the nodes of the wake from number 1 on.
    pub from_surface: Polar,
    /// Distances and directions from the ends of the half panels of the wake to the points of
    /// [`from_surface`](Self::from_surface).
    pub from_wake: Polar,
}

/// Ends of the linear source panels of the wake: nodes and middles in turn.
pub(crate) fn wake_points(nodes: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut points = vec![nodes[0]];
    for pair in nodes.windows(2) {
        points.push([0.5 * (pair[0][0] + pair[1][0]), 0.5 * (pair[0][1] + pair[1][1])]);
        points.push(pair[1]);
    }
    points
}

/// Unit tangents at the nodes of the wake: along the chord of the two neighbours.
pub(crate) fn wake_tangents<S: crate::scalar::Scalar>(nodes: &[[S; 2]]) -> Vec<[S; 2]> {
    let last = nodes.len() - 1;
    (0..=last)
        .map(|k| {
            let (a, b) = (nodes[k.saturating_sub(1)], nodes[(k + 1).min(last)]);
            let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
            let d = (dx * dx + dy * dy).sqrt();
            [dx / d, dy / d]
        })
        .collect()
}

/// Place of a wake node (index `k`) on the half panel `h` of the wake.
pub(crate) fn wake_place(k: usize, h: usize) -> Place {
    if 2 * k == h {
        Place::Start
    } else if 2 * k == h + 1 {
        Place::End
    } else {
        Place::Elsewhere
    }
}

/// Place of a surface node on the half panel `h` of the wake: only a sharp edge is its start.
pub(crate) fn edge_place(outline: &Outline, i: usize, h: usize) -> Place {
    let at_edge = i == 0 || i + 1 == outline.len();
    if at_edge && h == 0 && outline.trailing_edge == TrailingEdge::Sharp { Place::Start } else { Place::Elsewhere }
}

impl FlowResponse {
    pub fn new(section: &SectionResponse, alpha: f64) -> Self {
        let outline = &section.panels.outline;
        let n = outline.len();
        let frame = section.edge_frame();
        let wind = [alpha.cos(), alpha.sin()];
        let distances = &section.wake_distances;
        let inviscid = section.panels.strengths(alpha);
        let path = Streamline::new(&section.panels, &inviscid, alpha, distances);
        let wake_nodes = &path.nodes;
        let tangents = wake_tangents(wake_nodes);
        let gap = match outline.trailing_edge {
            TrailingEdge::Sharp => vec![0.0; distances.len()],
            TrailingEdge::Blunt => wake::dead_air(&frame, distances),
        };
        let strengths = wake_strength_matrix(distances);
        let points = wake_points(wake_nodes);
        let polar = Polar::new(&outline.nodes, &points);
        let edge = &section.panels.edge;
        let (edge_by_wake, edge_from_wake) = edge.by_wake(&points);
        let nodes_by_wake = nodes_by_wake(section, &points, &polar, &edge_by_wake, &strengths);
        let from_wake = Polar::new(wake_nodes, &points);
        let from_surface = polar.reversed(2);
        let (by_strength, by_source) = surface_to_wake(outline, wake_nodes, &tangents, &from_surface);
        let mut wake_inviscid: Vec<f64> = tangents.iter().map(|t| t[0] * wind[0] + t[1] * wind[1]).collect();
        for k in 0..distances.len() {
            let onset = if k == 0 { 0.0 } else { wake_inviscid[k] };
            wake_inviscid[k] = onset + (0..n).map(|i| by_strength[(k, i)] * inviscid[i]).sum::<f64>();
        }
        let mut wake_by_nodes =
            (product(&by_strength, &section.nodes) + source_per_defect(section, &by_source)).transpose();
        smooth_transposed(&mut wake_by_nodes);
        let wake_by_wake = product(&by_strength, &nodes_by_wake)
            + product(&wake_to_wake(wake_nodes, &tangents, &points, &from_wake), &strengths);
        Self {
            alpha,
            inviscid_spline: section.map.spline.coefficients(&inviscid),
            inviscid,
            spline_by_wake: spline_rows(&section.map, &nodes_by_wake),
            nodes_by_wake,
            path,
            wake_tangents: tangents,
            gap,
            wake_inviscid,
            wake_by_nodes,
            wake_by_wake,
            wake_by_strength: by_strength,
            polar,
            from_surface: edge.polar.followed_by(&from_surface, 1),
            from_wake: edge_from_wake.followed_by(&from_wake, 1),
        }
    }
}

/// The speeds that the onset flow alone causes.
#[derive(Debug, Clone)]
pub(crate) struct Onset {
    /// Angle of attack in radians.
    pub alpha: f64,
    /// Strengths at the nodes.
    pub inviscid: Vec<f64>,
    /// Spline coefficients of the strengths at the nodes.
    pub inviscid_spline: Vec<f64>,
    /// Speed along the wake.
    pub wake_inviscid: Vec<f64>,
}

impl FlowResponse {
    /// Arc length of the stagnation point without boundary layer, in chords. The strength changes sign there; of
    /// several such places it is the one farthest from the trailing edge.
    pub fn stagnation(&self, section: &SectionResponse) -> f64 {
        let nodes = &section.panels.outline.nodes;
        let edge = section.edge_frame().middle;
        let reach = |i: usize| distance(nodes[i], edge);
        let changes = (1..nodes.len()).filter(|&i| self.inviscid[i - 1] > 0.0 && self.inviscid[i] <= 0.0);
        // without a change of sign (no such flow is known) the march starts from the middle, and Newton's method judges
        let at = changes.max_by(|&a, &b| reach(a).total_cmp(&reach(b))).unwrap_or(nodes.len() / 2) as f64;
        section
            .map
            .spline
            .value(&section.map.arc, invert(&section.map.spline, &self.inviscid_spline, 0.0, at - 1.0, at, -1.0))
    }

    /// The onset flow at another angle of attack, with the wake held where it is.
    pub fn onset(&self, section: &SectionResponse, alpha: f64) -> Onset {
        let inviscid = section.panels.strengths(alpha);
        let onset = self.wake_tangents.iter().map(|t| t[0] * alpha.cos() + t[1] * alpha.sin());
        let surface = &self.wake_by_strength * nalgebra::DVector::from_column_slice(&inviscid);
        let mut wake_inviscid: Vec<f64> = onset.zip(surface.iter()).map(|(a, b)| a + b).collect();
        // the first node of the wake takes the speed of the edge
        wake_inviscid[0] = surface[0];
        Onset { alpha, inviscid_spline: section.map.spline.coefficients(&inviscid), inviscid, wake_inviscid }
    }

    /// Replaces the onset flow by another one, with the wake held where it is.
    pub fn turn(&mut self, onset: Onset) {
        let Onset { alpha, inviscid, inviscid_spline, wake_inviscid } = onset;
        (self.alpha, self.inviscid) = (alpha, inviscid);
        (self.inviscid_spline, self.wake_inviscid) = (inviscid_spline, wake_inviscid);
    }
}

/// Source strengths at the ends of the half panels of the wake per mass defect at the nodes of the wake.
pub(crate) fn wake_strength_matrix(distances: &[f64]) -> DMatrix<f64> {
    let rows = wake::source_strengths(distances);
    let mut matrix = DMatrix::zeros(rows.len(), distances.len());
    for (j, row) in rows.iter().enumerate() {
        for &(k, weight) in row {
            matrix[(j, k)] += weight;
        }
    }
    matrix
}

fn nodes_by_wake(
    section: &SectionResponse,
    points: &[[f64; 2]],
    polar: &Polar,
    edge_by_wake: &[f64],
    strengths: &DMatrix<f64>,
) -> DMatrix<f64> {
    let outline = &section.panels.outline;
    let n = outline.len();
    let mut stream = DMatrix::zeros(n + 1, points.len());
    let mut ends = [vec![0.0; n], vec![0.0; n]];
    for h in 0..points.len() - 1 {
        let panel = Straight::new([points[h], points[h + 1]]);
        let pairs = polar.pairs_of([h, h + 1]).of(0..n);
        let nodes = &outline.nodes[..n];
        let [start, end] = ends.each_mut().map(|end| &mut end[..n]);
        for i in 0..n {
            [start[i], end[i]] = pairs.wake_sight(i, nodes[i], &panel, Place::Elsewhere).wake_stream();
        }
        for i in [0, n - 1] {
            [start[i], end[i]] = pairs.wake_sight(i, nodes[i], &panel, edge_place(outline, i, h)).wake_stream();
        }
        for (k, influence) in [&*start, &*end].into_iter().enumerate() {
            add_scaled(&mut stream.column_mut(h + k).as_mut_slice()[..n], -1.0, influence);
        }
    }
    share_edge_rows(&mut stream, n);
    stream.row_mut(n - 1).fill(0.0);
    for (h, influence) in edge_by_wake.iter().enumerate() {
        stream[(n - 1, h)] = -influence;
    }
    let mut response = product(&stream, strengths);
    section.panels.factors.solve(&mut response);
    response.remove_row(n)
}

/// Speed along the wake per strength at the surface nodes (W × N) and per constant source strength of the panels (W ×
/// (N − 1)). Row 0 is the trailing edge, where the speed is that of the first node.
fn surface_to_wake(
    outline: &Outline,
    wake_nodes: &[[f64; 2]],
    tangents: &[[f64; 2]],
    polar: &Polar,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let (n, w) = (outline.len(), wake_nodes.len());
    let mut strength = DMatrix::zeros(w, n);
    let mut source = DMatrix::zeros(w, n - 1);
    let frame = outline.edge_frame();
    let (wake_nodes, tangents) = (&wake_nodes[..w], &tangents[..w]);
    let along = |k: usize, v: [f64; 2]| v[0] * tangents[k][0] + v[1] * tangents[k][1];
    for (j, source) in source.as_mut_slice().chunks_exact_mut(w).enumerate() {
        let panel = Straight::new(outline.panel(j));
        let pairs = polar.pairs_of([j, j + 1]).of(0..w);
        let (start, end) = strength.as_mut_slice()[j * w..(j + 2) * w].split_at_mut(w);
        // the trailing edge at k = 0, which stands on a panel, is set right below
        for k in 0..w {
            let v = pairs.surface_sight(k, wake_nodes[k], &panel, Place::Elsewhere).velocity();
            let [a, b] = [0, 1].map(|end| along(k, panel.outer(v.vortex(end))));
            start[k] += a;
            end[k] += b;
            source[k] = [0, 1].map(|end| along(k, panel.outer(v.source(end)))).iter().sum();
        }
    }
    strength.row_mut(0).fill(0.0);
    source.row_mut(0).fill(0.0);
    strength[(0, 0)] = 1.0;
    for k in 1..w {
        let along = |v: [f64; 2]| along(k, v);
        if outline.trailing_edge == TrailingEdge::Blunt {
            let panel = outline.panel(n - 1);
            let length = distance(panel[0], panel[1]);
            let v = velocity_influence(panel, wake_nodes[k], Place::Elsewhere);
            let per_speed = ((along(v.vortex[0]) + along(v.vortex[1])) * frame.vortex
                + (along(v.source[0]) + along(v.source[1])) * frame.source)
                / length;
            strength[(k, 0)] += 0.5 * per_speed;
            strength[(k, n - 1)] -= 0.5 * per_speed;
        }
    }
    (strength, source)
}

/// Turns a response to panel sources into one to the mass defect m at the nodes, with σ = −(m_{j+1} − m_j)/length.
fn source_per_defect(section: &SectionResponse, by_source: &DMatrix<f64>) -> DMatrix<f64> {
    let arc = arc_lengths(&section.panels.outline.nodes);
    let n = arc.len();
    let mut result = DMatrix::zeros(by_source.nrows(), n);
    for j in 0..n - 1 {
        for k in 0..by_source.nrows() {
            let value = by_source[(k, j)] / (arc[j + 1] - arc[j]);
            result[(k, j)] += value;
            result[(k, j + 1)] -= value;
        }
    }
    result
}

/// Speed along the wake per source strength at the ends of the half panels of the wake.
fn wake_to_wake(wake_nodes: &[[f64; 2]], tangents: &[[f64; 2]], points: &[[f64; 2]], polar: &Polar) -> DMatrix<f64> {
    let w = wake_nodes.len();
    let (wake_nodes, tangents) = (&wake_nodes[..w], &tangents[..w]);
    let mut matrix = DMatrix::zeros(w, points.len());
    let mut ends = [vec![0.0; w], vec![0.0; w]];
    for h in 0..points.len() - 1 {
        let panel = Straight::new([points[h], points[h + 1]]);
        let pairs = polar.pairs_of([h, h + 1]).of(0..w);
        let along = |k: usize, v: [f64; 2]| v[0] * tangents[k][0] + v[1] * tangents[k][1];
        let [start, end] = ends.each_mut().map(|end| &mut end[..w]);
        for k in 0..w {
            let v = pairs.surface_sight(k, wake_nodes[k], &panel, Place::Elsewhere).velocity();
            [start[k], end[k]] = [0, 1].map(|end| along(k, panel.outer(v.source(end))));
        }
        // the node of the wake that this half panel starts or ends at
        let k = h.div_ceil(2);
        let v = pairs.surface_sight(k, wake_nodes[k], &panel, wake_place(k, h)).velocity();
        [start[k], end[k]] = [0, 1].map(|end| along(k, panel.outer(v.source(end))));
        for (end, influence) in [&*start, &*end].into_iter().enumerate() {
            add_scaled(matrix.column_mut(h + end).as_mut_slice(), 1.0, influence);
        }
    }
    // the trailing edge has the speed of the first node
    matrix.row_mut(0).fill(0.0);
    matrix
}
