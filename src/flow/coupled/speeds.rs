//! Edge speeds at the stations: value, derivatives with respect to the mass defects and to the global unknowns.

use super::duals::{Dual4, dual, gradient};
use super::layout::Layout;
use super::projection;
use super::response::{FlowResponse, SectionResponse};
use super::subpanel;
use super::surface::{Weights, combine_real};
use super::unknowns::{Numbering, Side, Unknowns};
use crate::flow::linear::product;
use nalgebra::DMatrix;

/// Directions of the global derivatives: stagnation arc length, transition of both sides, total arc length.
pub(crate) const STAGNATION: usize = 0;
/// Total arc length of the surface, the last global direction; constant in a solution, an input of its derivatives.
pub(crate) const TOTAL: usize = 3;

/// Abscissas of the stations with their derivatives in the global directions.
#[derive(Debug, Clone)]
pub(crate) struct Positions {
    /// Arc length from the stagnation point, per side and station.
    pub abscissas: [Vec<Dual4>; 2],
    /// Node index of every point along the surface.
    pub index: Vec<Dual4>,
}

impl Positions {
    pub fn new(layout: &Layout, section: &SectionResponse, unknowns: &Unknowns) -> Self {
        let unit = |value: f64, k: usize| Dual4::from_re(value).derivative(k);
        let stagnation = unit(unknowns.stagnation, STAGNATION);
        let total = unit(section.map.total, TOTAL);
        let lengths = [stagnation, total - stagnation];
        let abscissas = [0, 1].map(|k| layout.abscissas(unit(unknowns.transition[k], 1 + k), lengths[k]));
        let numbering = Numbering::new(layout);
        let mut index = vec![section.map.index(stagnation); numbering.points()];
        for side in Side::BOTH {
            for (j, x) in abscissas[side.index()].iter().enumerate() {
                index[numbering.point(side, j)] = section.map.index(stagnation - *x * side.sign());
            }
        }
        // the last stations stand exactly on the edge
        let last = (section.len() - 1) as f64;
        index[0] = Dual4::from(0.0);
        let end = numbering.points() - 1;
        index[end] = Dual4::from(last);
        Self { abscissas, index }
    }
}

/// Vortex strength at the points along the surface, and speed along the wake.
#[derive(Debug, Clone)]
pub(crate) struct EdgeSpeeds {
    /// At the points, with global derivatives.
    pub points: Vec<Dual4>,
    /// Derivatives with respect to the signed defects at the points and the defects of the wake, one column a point.
    pub points_by_mass: DMatrix<f64>,
    pub wake: Vec<Dual4>,
    /// The same of the speeds along the wake, one column a node of the wake.
    pub wake_by_mass: DMatrix<f64>,
    /// Defect at the nodes with global derivatives, as projected (not smoothed).
    pub node_mass: Vec<Dual4>,
    pub projection: Projection,
    /// Spline coefficients of the strength of the panels, and of the wall response.
    pub fields: Fields,
}

impl EdgeSpeeds {
    /// `mass` are the signed defects at the points (0 at the stagnation point), `wake_mass` those of the wake.
    pub fn new(
        section: &SectionResponse,
        flow: &FlowResponse,
        positions: &Positions,
        mass: &[f64],
        wake_mass: &[f64],
    ) -> Self {
        let t = &positions.index;
        let projection = Projection::new(t, section.len());
        let node_mass = projection.apply(mass, section.len());
        let fields = Fields::new(section, flow, &node_mass, wake_mass);
        let (count, wakes) = (t.len(), wake_mass.len());
        let mut points = vec![Dual4::from(0.0); count];
        // one column a point, so that a row of the response is contiguous
        let mut by_mass = DMatrix::zeros(count + wakes, count);
        let mut by_nodes = vec![0.0; section.len()];
        for p in 0..count {
            let weights = section.map.spline.weights(t[p]);
            let inner = p > 0 && p + 1 < count;
            let per_rate = if inner { per_rate(section, t[p]) } else { Dual4::from(0.0) };
            points[p] = weighted(&weights, &fields.strength) - weighted(&weights, &fields.wall) * per_rate;
            gather(&mut by_nodes, &weights, section, per_rate.re);
            let mut column = by_mass.column_mut(p);
            let column = column.as_mut_slice();
            projection.transpose_apply(&by_nodes, column);
            if inner {
                points[p] += local(t, p, mass, per_rate, column);
            }
            let (first, w) = &weights;
            for k in 0..wakes {
                column[count + k] = (0..4).map(|q| w[q].re * flow.spline_by_wake[(k, first + q)]).sum();
            }
        }
        let (wake, wake_by_mass) = wake_speeds(flow, &projection, &node_mass, wake_mass, count);
        Self { points, points_by_mass: by_mass, wake, wake_by_mass, node_mass, projection, fields }
    }
}

/// Node index per arc length, the factor of all sub-panel speeds.
///
/// The correction holds at every point up to the edge. It must not fade towards it: a turbulent zone that is squeezed
/// there stands within a fraction of a panel, and without interaction at its own scale the layer in it is ill-posed.
/// The edge itself has none; its speed is that of both sides and of the wake.
pub(crate) fn per_rate<S: crate::scalar::Scalar>(section: &SectionResponse, t: S) -> S {
    section.map.rate(t).recip()
}

/// Sub-panel speed at point `p`; adds its derivatives to `column`.
fn local(t: &[Dual4], p: usize, mass: &[f64], per_rate: Dual4, column: &mut [f64]) -> Dual4 {
    let mut speed = Dual4::from(0.0);
    subpanel::influences(t, p, |k, influence| {
        let per_step = influence * per_rate / (t[k + 1] - t[k]);
        speed += per_step * (mass[k + 1] - mass[k]);
        column[k + 1] += per_step.re;
        column[k] -= per_step.re;
    });
    speed
}

/// Response of the value at a point to the defects at the nodes: panels, less the wall at panel resolution.
pub(crate) fn gather(row: &mut [f64], weights: &Weights<Dual4>, section: &SectionResponse, per_rate: f64) {
    let (first, w) = weights;
    row.fill(0.0);
    for q in 0..4 {
        let (panel, wall) = (section.spline.column(first + q), section.wall.column(first + q));
        let (a, b) = (w[q].re, -w[q].re * per_rate);
        for ((r, p), l) in row.iter_mut().zip(panel.iter()).zip(wall.iter()) {
            *r += a * p + b * l;
        }
    }
}

fn weighted(weights: &Weights<Dual4>, coefficients: &[Dual4]) -> Dual4 {
    super::surface::combine(weights, coefficients)
}

/// Spline coefficients of the strength and of the wall response, with global derivatives.
#[derive(Debug, Clone)]
pub(crate) struct Fields {
    pub strength: Vec<Dual4>,
    pub wall: Vec<Dual4>,
}

impl Fields {
    fn new(section: &SectionResponse, flow: &FlowResponse, node_mass: &[Dual4], wake_mass: &[f64]) -> Self {
        let n = node_mass.len();
        let mut parts = DMatrix::zeros(5, n);
        for (i, m) in node_mass.iter().enumerate() {
            parts[(0, i)] = m.re;
            for (k, d) in gradient(m).into_iter().enumerate() {
                parts[(k + 1, i)] = d;
            }
        }
        let collect =
            |m: DMatrix<f64>| -> Vec<Dual4> { m.column_iter().map(|c| dual(c[0], [c[1], c[2], c[3], c[4]])).collect() };
        let mut strength = collect(product(&parts, &section.spline));
        let wall = collect(product(&parts, &section.wall));
        for (c, value) in strength.iter_mut().enumerate() {
            let wake: f64 = wake_mass.iter().enumerate().map(|(k, m)| flow.spline_by_wake[(k, c)] * m).sum();
            *value += flow.inviscid_spline[c] + wake;
        }
        Self { strength, wall }
    }
}

/// The sparse map from the defects at the points to those at the nodes.
#[derive(Debug, Clone)]
pub(crate) struct Projection {
    /// Per point: nodes and weights.
    pub columns: Vec<Vec<(usize, Dual4)>>,
}

impl Projection {
    fn new(t: &[Dual4], nodes: usize) -> Self {
        let column = |p: usize| {
            let mut column = Vec::with_capacity(6);
            projection::overlaps(t, p, nodes, |i, weight| column.push((i, weight)));
            column
        };
        Self { columns: (0..t.len()).map(column).collect() }
    }

    fn apply(&self, mass: &[f64], nodes: usize) -> Vec<Dual4> {
        let mut result = vec![Dual4::from(0.0); nodes];
        for (column, m) in self.columns.iter().zip(mass) {
            for (i, weight) in column {
                result[*i] += *weight * *m;
            }
        }
        result
    }

    pub fn transpose_apply(&self, by_nodes: &[f64], by_points: &mut [f64]) {
        for (column, value) in self.columns.iter().zip(by_points) {
            *value = column.iter().map(|(i, weight)| weight.re * by_nodes[*i]).sum();
        }
    }
}

fn wake_speeds(
    flow: &FlowResponse,
    projection: &Projection,
    node_mass: &[Dual4],
    wake_mass: &[f64],
    count: usize,
) -> (Vec<Dual4>, DMatrix<f64>) {
    let wakes = wake_mass.len();
    let mut by_mass = DMatrix::zeros(count + wakes, wakes);
    let mut speeds = Vec::with_capacity(wakes);
    for k in 0..wakes {
        let by_nodes = flow.wake_by_nodes.column(k);
        let mut column = by_mass.column_mut(k);
        let column = column.as_mut_slice();
        projection.transpose_apply(by_nodes.as_slice(), &mut column[..count]);
        let mut speed = Dual4::from(flow.wake_inviscid[k]);
        for (m, r) in node_mass.iter().zip(by_nodes.iter()) {
            speed += *m * *r;
        }
        for (l, m) in wake_mass.iter().enumerate() {
            let r = flow.wake_by_wake[(k, l)];
            column[count + l] = r;
            speed += r * m;
        }
        speeds.push(speed);
    }
    (speeds, by_mass)
}

/// Pressure-relevant strengths at the nodes of the section.
pub(crate) fn node_strengths(
    section: &SectionResponse,
    flow: &FlowResponse,
    node_mass: &[f64],
    wake_mass: &[f64],
) -> Vec<f64> {
    let mut smoothed = node_mass.to_vec();
    super::response::smooth(&mut smoothed);
    let n = smoothed.len();
    (0..n)
        .map(|i| {
            let surface: f64 = (0..n).map(|j| section.nodes[(i, j)] * smoothed[j]).sum();
            let wake: f64 = wake_mass.iter().enumerate().map(|(k, m)| flow.nodes_by_wake[(i, k)] * m).sum();
            flow.inviscid[i] + surface + wake
        })
        .collect()
}

/// Value of a function over the node index given by its spline coefficients.
pub(crate) fn value_at(section: &SectionResponse, coefficients: &[f64], t: f64) -> f64 {
    combine_real(&section.map.spline.weights(t), coefficients)
}
