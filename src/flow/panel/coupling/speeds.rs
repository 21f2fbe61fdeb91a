//! Edge speeds at the stations: values, and derivatives with respect to the mass defects and to the global unknowns.

use super::projection;
use super::response::{FlowResponse, SectionResponse, within_wall_reach};
use super::subpanel::LocalSpeeds;
use crate::flow::layer::{ByGlobal, GLOBALS, Layout, Numbering, STAGNATION, Side, TRANSITION, Unknowns};
use crate::flow::linear::{add_scaled, dot};
use crate::flow::memory::{give_back, large};
use crate::flow::surface::spline::{Weights, combine};
use crate::scalar::Scalar;
use nalgebra::DMatrix;
use num_dual::DualNum;
use std::ops::Range;

/// A number of the value pass (`f64`) or of the linearisation (with global derivatives).
pub(crate) trait Global: Scalar {
    /// The independent variable of global direction `k`.
    fn global(value: f64, k: usize) -> Self;

    /// The weighted sum of a list of numbers.
    fn weighted_sum(numbers: &[Self], weights: &[f64]) -> Self;

    /// Sub-panel speeds at all inner points, before division by the arc-length rate; see [`LocalSpeeds`]. `visit(p,
    /// range, influences)` is called for every such point with the speeds at point `p` per slope of the mass defect in
    /// the intervals of the range.
    fn local_speeds(t: &[Self], mass: &[f64], visit: impl FnMut(usize, Range<usize>, &[f64])) -> Vec<Self>;
}

impl Global for f64 {
    fn global(value: f64, _: usize) -> Self {
        value
    }

    fn weighted_sum(numbers: &[Self], weights: &[f64]) -> Self {
        dot(numbers, weights)
    }

    fn local_speeds(t: &[Self], mass: &[f64], mut visit: impl FnMut(usize, Range<usize>, &[f64])) -> Vec<Self> {
        let slopes: Vec<f64> = t.windows(2).zip(mass.windows(2)).map(|(t, m)| (m[1] - m[0]) / (t[1] - t[0])).collect();
        let mut locals = LocalSpeeds::new(t, &slopes);
        let mut speeds = vec![0.0; t.len()];
        for p in 1..t.len() - 1 {
            let (speed, range, influences) = locals.value(t[p], p);
            speeds[p] = speed;
            visit(p, range, influences);
        }
        speeds
    }
}

impl Global for ByGlobal {
    fn global(value: f64, k: usize) -> Self {
        Self::from_re(value).derivative(k)
    }

    fn weighted_sum(numbers: &[Self], weights: &[f64]) -> Self {
        let mut sum = Self::from_re(0.0);
        for (x, w) in numbers.iter().zip(weights) {
            sum += *x * *w;
        }
        sum
    }

    fn local_speeds(t: &[Self], mass: &[f64], mut visit: impl FnMut(usize, Range<usize>, &[f64])) -> Vec<Self> {
        let places: Vec<f64> = t.iter().map(|t| t.re).collect();
        let middles: Vec<Self> = t.windows(2).map(|t| (t[0] + t[1]) * 0.5).collect();
        let slopes: Vec<Self> =
            t.windows(2).zip(mass.windows(2)).map(|(t, m)| (t[1] - t[0]).recip() * (m[1] - m[0])).collect();
        let slope_values: Vec<f64> = slopes.iter().map(|s| s.re).collect();
        let by_global = |numbers: &[Self]| -> [_; GLOBALS] {
            std::array::from_fn(|g| numbers.iter().map(|v| v.eps[g]).collect::<Vec<f64>>())
        };
        let (middles, slopes) = (by_global(&middles), by_global(&slopes));
        let mut locals = LocalSpeeds::new(&places, &slope_values);
        let mut speeds = vec![Self::from_re(0.0); t.len()];
        for p in 1..t.len() - 1 {
            let local = locals.at(places[p], p);
            let eps = std::array::from_fn(|g| {
                dot(local.influences, &slopes[g][local.range.clone()])
                    + dot(local.by_middle, &middles[g][local.range.clone()])
                    + local.by_place * t[p].eps[g]
            });
            speeds[p] = Self { re: local.speed, eps };
            visit(p, local.range, local.influences);
        }
        speeds
    }
}

/// Abscissas of the stations with their derivatives in the global directions.
#[derive(Debug, Clone)]
pub(crate) struct Positions<S = ByGlobal> {
    /// Arc lengths of the stations from the stagnation point, per side and station, in chords.
    pub abscissas: [Vec<S>; 2],
    /// Node index of every point along the surface.
    pub index: Vec<S>,
}

impl Positions {
    /// The positions without derivatives.
    pub fn values(&self) -> Positions<f64> {
        let values = |numbers: &[ByGlobal]| numbers.iter().map(|v| v.re).collect();
        Positions { abscissas: self.abscissas.each_ref().map(|side| values(side)), index: values(&self.index) }
    }
}

impl<S: Global> Positions<S> {
    /// The speeds for signed mass defects `mass` at the points (0 at the stagnation point) and `wake_mass` in the wake.
    pub fn new(layout: &Layout, section: &SectionResponse, unknowns: &Unknowns) -> Self {
        let stagnation = S::global(unknowns.stagnation, STAGNATION);
        let numbering = Numbering::new(layout);
        let map = &section.map;
        let mut index = vec![map.index(stagnation); numbering.points()];
        let abscissas = Side::BOTH.map(|side| {
            let transition = S::global(unknowns.transition[side.index()], TRANSITION[side.index()]);
            let mut abscissas: Vec<S> = layout.laminar.iter().map(|f| transition * *f).collect();
            for (j, x) in abscissas.iter().enumerate() {
                index[numbering.point(side, j)] = map.index(side.place(stagnation, *x));
            }
            for (j, [t, x]) in layout.turbulent_places(map, side, [stagnation, transition]).enumerate() {
                index[numbering.point(side, numbering.laminar + j)] = t;
                abscissas.push(x);
            }
            abscissas
        });
        Self { abscissas, index }
    }
}

/// Vortex strength at the points along the surface, and speed along the wake, in units of the onset speed.
#[derive(Debug, Clone)]
pub(crate) struct EdgeSpeeds<S = ByGlobal> {
    /// Strength at the points.
    pub points: Vec<S>,
    /// Speed at the nodes of the wake.
    pub wake: Vec<S>,
    /// Mass defect at the nodes as projected, before smoothing.
    pub node_mass: Vec<S>,
    /// The map from the mass defects at the points to those at the nodes.
    pub projection: Projection,
    /// Spline coefficients of the strength of the panels, and of the wall response.
    pub fields: Fields<S>,
}

impl<S: Global> EdgeSpeeds<S> {
    /// The speeds and their derivatives.
    pub fn new(
        section: &SectionResponse,
        flow: &FlowResponse,
        positions: &Positions<S>,
        mass: &[f64],
        wake_mass: &[f64],
    ) -> Self {
        Self::visit(section, flow, positions, mass, wake_mass, |_, _, _| ())
    }

    /// Computes the speeds like [`new`](Self::new), and calls `local(p, range, influences)` with the sub-panel speeds at
    /// point `p` per slope of the mass defect in the intervals of the range.
    pub fn visit(
        section: &SectionResponse,
        flow: &FlowResponse,
        positions: &Positions<S>,
        mass: &[f64],
        wake_mass: &[f64],
        local: impl FnMut(usize, Range<usize>, &[f64]),
    ) -> Self {
        let t = &positions.index;
        let (projection, node_mass) = Projection::new(t, mass, section.len());
        let fields = Fields::new(section, flow, &node_mass, wake_mass);
        let local = S::local_speeds(t, mass, local);
        let last = t.len() - 1;
        let points = (0..=last)
            .map(|p| {
                let weights = section.map.spline.weights(t[p]);
                let strength = combine(&weights, &fields.strength);
                if p == 0 || p == last {
                    return strength;
                }
                let speed = local[p] - combine(&weights, &fields.wall);
                strength + speed * per_rate(section, t[p])
            })
            .collect();
        let wake = wake_speeds(flow, &node_mass, wake_mass);
        Self { points, wake, node_mass, projection, fields }
    }
}

/// Derivatives of the speeds with respect to the mass defects. The rows belong to the signed mass defects at the
/// points, followed by the mass defects of the wake.
#[derive(Debug, Clone)]
pub(crate) struct SpeedsByMass {
    /// Derivatives of the strengths at the points, one column per point.
    pub points: DMatrix<f64>,
    /// Derivatives of the speeds along the wake, one column per node of the wake.
    pub wake: DMatrix<f64>,
}

impl Drop for SpeedsByMass {
    fn drop(&mut self) {
        give_back(&mut self.points);
    }
}

/// Number of points whose responses are projected together.
const LANES: usize = 8;

impl SpeedsByMass {
    /// Speeds and their derivatives.
    pub fn new(
        section: &SectionResponse,
        flow: &FlowResponse,
        positions: &Positions,
        mass: &[f64],
        wake_mass: &[f64],
    ) -> (EdgeSpeeds, Self) {
        let t = &positions.index;
        let (count, wakes) = (t.len(), wake_mass.len());
        let rates: Vec<f64> =
            (0..count).map(|p| if p > 0 && p + 1 < count { per_rate(section, t[p].re) } else { 0.0 }).collect();
        let mut locals = Locals::new(t);
        let speeds = EdgeSpeeds::visit(section, flow, positions, mass, wake_mass, |p, range, influences| {
            locals.push(p, range, influences);
        });
        let mut points = large(count + wakes, count);
        let mut projector = Projector::new(&speeds.projection, section.len());
        let mut by_nodes = vec![0.0; section.len()];
        for first in (0..count).step_by(LANES) {
            let lanes = LANES.min(count - first);
            for lane in 0..lanes {
                let weights = section.map.spline.weights(t[first + lane].re);
                gather(&mut by_nodes, &weights, section, rates[first + lane]);
                projector.set(lane, &by_nodes);
                let mut column = points.column_mut(first + lane);
                let (cell, w) = weights;
                let by_wake = flow.spline_by_wake.as_slice();
                let [a, b, c, d] = std::array::from_fn(|q| &by_wake[(cell + q) * wakes..][..wakes]);
                for (k, value) in column.as_mut_slice()[count..].iter_mut().enumerate() {
                    *value = w[0] * a[k] + w[1] * b[k] + w[2] * c[k] + w[3] * d[k];
                }
            }
            projector.write(&mut points, first, lanes);
            for p in first..first + lanes {
                locals.add(p, rates[p], points.column_mut(p).as_mut_slice());
            }
        }
        let mut wake = DMatrix::zeros(count + wakes, wakes);
        for first in (0..wakes).step_by(LANES) {
            let lanes = LANES.min(wakes - first);
            for k in first..first + lanes {
                projector.set(k - first, flow.wake_by_nodes.column(k).as_slice());
                let mut column = wake.column_mut(k);
                for (l, value) in column.as_mut_slice()[count..].iter_mut().enumerate() {
                    *value = flow.wake_by_wake[(k, l)];
                }
            }
            projector.write(&mut wake, first, lanes);
        }
        (speeds, Self { points, wake })
    }
}

/// Sub-panel speeds at the points per slope of the mass defect in the intervals around each point.
struct Locals {
    /// Inverse lengths of all intervals.
    per_length: Vec<f64>,
    /// Speeds per slope, point after point.
    influences: Vec<f64>,
    /// Intervals of every point, and where the speeds of the point begin.
    places: Vec<(Range<usize>, usize)>,
}

impl Locals {
    fn new(t: &[ByGlobal]) -> Self {
        let per_length = t.windows(2).map(|t| (t[1].re - t[0].re).recip()).collect();
        Self { per_length, influences: Vec::with_capacity(32 * t.len()), places: vec![(0..0, 0); t.len()] }
    }

    fn push(&mut self, p: usize, range: Range<usize>, influences: &[f64]) {
        self.places[p] = (range, self.influences.len());
        self.influences.extend_from_slice(influences);
    }

    /// Adds the speeds at point `p` per mass defect at the points to `column`; `rate` turns them into strengths.
    fn add(&self, p: usize, rate: f64, column: &mut [f64]) {
        let (range, start) = &self.places[p];
        let influences = &self.influences[*start..*start + range.len()];
        for (k, (influence, per_length)) in range.clone().zip(influences.iter().zip(&self.per_length[range.clone()])) {
            let step = influence * rate * per_length;
            column[k] -= step;
            column[k + 1] += step;
        }
    }
}

/// Projects several rows over the nodes at a time to rows over the points.
struct Projector<'a> {
    projection: &'a Projection,
    nodes: Vec<[f64; LANES]>,
}

impl<'a> Projector<'a> {
    fn new(projection: &'a Projection, nodes: usize) -> Self {
        Self { projection, nodes: vec![[0.0; LANES]; nodes] }
    }

    fn set(&mut self, lane: usize, by_nodes: &[f64]) {
        for (node, value) in self.nodes.iter_mut().zip(by_nodes) {
            node[lane] = *value;
        }
    }

    /// Writes the projected rows to `lanes` columns of `result`, from column `first` on.
    fn write(&self, result: &mut DMatrix<f64>, first: usize, lanes: usize) {
        let rows = result.nrows();
        let target = &mut result.as_mut_slice()[first * rows..(first + lanes) * rows];
        for c in 0..self.projection.points() {
            let mut sum = [0.0; LANES];
            for (node, weight) in self.projection.column(c) {
                let node = &self.nodes[*node];
                for lane in 0..LANES {
                    sum[lane] += weight * node[lane];
                }
            }
            for lane in 0..lanes {
                target[lane * rows + c] = sum[lane];
            }
        }
    }
}

/// Node index per arc length at the node index `t`, the factor of all sub-panel speeds.
///
/// The correction holds at every point up to the edge. It must not fade towards it: a turbulent zone that is squeezed
/// there stands within a fraction of a panel, and without interaction at its own scale the layer in it is ill-posed.
/// The edge itself has no correction; the speed there is that of both sides and of the wake.
pub(crate) fn per_rate<S: Scalar>(section: &SectionResponse, t: S) -> S {
    section.map.rate(t).recip()
}

/// Response of the strength at a point to the mass defects at the nodes: that of the panels, less that of the wall at
/// panel resolution.
pub(crate) fn gather(row: &mut [f64], weights: &Weights<f64>, section: &SectionResponse, per_rate: f64) {
    let (first, w) = weights;
    let n = section.len();
    let panel = section.spline.as_slice();
    let [a, b, c, d] = [0, 1, 2, 3].map(|q| &panel[(first + q) * n..][..n]);
    let row = &mut row[..n];
    for i in 0..n {
        row[i] = w[0] * a[i] + w[1] * b[i] + w[2] * c[i] + w[3] * d[i];
    }
    let v = w.map(|w| -w * per_rate);
    let near = within_wall_reach(*first, first + 3, n);
    let wall = section.wall.as_slice();
    let [a, b, c, d] = [0, 1, 2, 3].map(|q| &wall[(first + q) * n..][near.clone()]);
    let row = &mut row[near];
    for i in 0..row.len() {
        row[i] += v[0] * a[i] + v[1] * b[i] + v[2] * c[i] + v[3] * d[i];
    }
}

/// Spline coefficients of the strength and of the wall response.
#[derive(Debug, Clone)]
pub(crate) struct Fields<S = ByGlobal> {
    /// Coefficients of the vortex strength of the panels.
    pub strength: Vec<S>,
    /// Coefficients of the flat-wall response, to be divided by the arc-length rate.
    pub wall: Vec<S>,
}

impl<S: Global> Fields<S> {
    fn new(section: &SectionResponse, flow: &FlowResponse, node_mass: &[S], wake_mass: &[f64]) -> Self {
        let n = section.len();
        let columns = section.spline.as_slice().chunks_exact(n);
        let mut strength: Vec<S> = columns.map(|column| S::weighted_sum(node_mass, column)).collect();
        let wall = |(k, column): (usize, &[f64])| {
            let near = within_wall_reach(k, k, n);
            S::weighted_sum(&node_mass[near.clone()], &column[near])
        };
        let wall = section.wall.as_slice().chunks_exact(n).enumerate().map(wall).collect();
        let by_wake = flow.spline_by_wake.as_slice().chunks_exact(wake_mass.len());
        for ((value, own), column) in strength.iter_mut().zip(&flow.inviscid_spline).zip(by_wake) {
            *value += own + dot(column, wake_mass);
        }
        Self { strength, wall }
    }
}

/// The sparse map from the mass defects at the points to those at the nodes.
#[derive(Debug, Clone)]
pub(crate) struct Projection {
    /// Nodes and weights, point after point.
    entries: Vec<(usize, f64)>,
    /// Where the entries of each point end.
    ends: Vec<usize>,
}

impl Projection {
    /// The map for points at the node indices `t`, and the projected mass defects.
    fn new<S: Scalar>(t: &[S], mass: &[f64], nodes: usize) -> (Self, Vec<S>) {
        let mut node_mass = vec![S::from(0.0); nodes];
        let mut entries = Vec::with_capacity(6 * t.len());
        let mut ends = Vec::with_capacity(t.len());
        for (p, mass) in mass.iter().enumerate() {
            projection::overlaps(t, p, nodes, |i, weight| {
                node_mass[i] += weight * *mass;
                entries.push((i, weight.re()));
            });
            ends.push(entries.len());
        }
        (Self { entries, ends }, node_mass)
    }

    fn points(&self) -> usize {
        self.ends.len()
    }

    /// Nodes that feel point `p`, and their weights.
    fn column(&self, p: usize) -> &[(usize, f64)] {
        let start = if p == 0 { 0 } else { self.ends[p - 1] };
        &self.entries[start..self.ends[p]]
    }

    /// Turns sensitivities to the mass defects at the nodes into sensitivities to those at the points.
    pub fn transpose_apply(&self, by_nodes: &[f64], by_points: &mut [f64]) {
        for (p, value) in by_points.iter_mut().enumerate().take(self.points()) {
            *value = self.column(p).iter().map(|(i, weight)| weight * by_nodes[*i]).sum();
        }
    }
}

/// Speeds at the nodes of the wake, for the mass defects at the nodes of the section and of the wake.
fn wake_speeds<S: Global>(flow: &FlowResponse, node_mass: &[S], wake_mass: &[f64]) -> Vec<S> {
    (0..wake_mass.len())
        .map(|k| {
            let mut speed = S::weighted_sum(node_mass, flow.wake_by_nodes.column(k).as_slice()) + flow.wake_inviscid[k];
            for (l, m) in wake_mass.iter().enumerate() {
                speed += flow.wake_by_wake[(k, l)] * m;
            }
            speed
        })
        .collect()
}

/// Vortex strengths at the nodes of the section, from which the pressure follows.
pub(crate) fn node_strengths(
    section: &SectionResponse,
    flow: &FlowResponse,
    node_mass: &[f64],
    wake_mass: &[f64],
) -> Vec<f64> {
    let mut smoothed = node_mass.to_vec();
    super::response::smooth(&mut smoothed);
    let mut strengths = flow.inviscid.clone();
    let surface = section.nodes.column_iter().zip(&smoothed);
    for (column, mass) in surface.chain(flow.nodes_by_wake.column_iter().zip(wake_mass)) {
        add_scaled(&mut strengths, *mass, column.as_slice());
    }
    strengths
}
