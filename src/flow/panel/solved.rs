//! A solution in the form in which coefficients and derivatives need it, and the quantities that a coefficient depends
//! on.

use super::coupling::response::smooth_columns;
use super::coupling::system::{Linearised, Stream, System};
use crate::flow::layer::{Change, GLOBAL_UNKNOWNS, Unknowns};
use crate::flow::linear::product;
use nalgebra::DMatrix;

/// The state of a solution.
pub(super) struct Solved<'a> {
    pub system: System<'a>,
    pub unknowns: &'a Unknowns,
    /// The coupled system linearised at the unknowns.
    pub at: &'a Linearised,
    /// Vortex strengths at the nodes, in units of the onset speed.
    pub strengths: &'a [f64],
    pub stream: Stream,
    /// Nodes on the surface in the frame of the section, in chords.
    pub nodes: &'a [[f64; 2]],
}

/// Derivatives of a coefficient with respect to everything that its formula contains, each with the rest held. The
/// strengths at the nodes count as variables.
#[derive(Debug, Clone)]
pub(super) struct Direct {
    /// Derivatives with respect to the vortex strengths at the nodes.
    pub strengths: Vec<f64>,
    /// Derivatives with respect to the nodes of the panels.
    pub panels: Vec<[f64; 2]>,
    /// Derivatives with respect to the nodes in the frame of the section, by themselves.
    pub given: Vec<[f64; 2]>,
    /// Numbers of points along the surface, with the derivatives with respect to the node indices of these points.
    pub index: Vec<(usize, f64)>,
    /// Derivatives with respect to the unknowns of the coupled system.
    pub unknowns: Change,
    /// Derivative with respect to the angle of attack, per radian.
    pub alpha: f64,
    /// Derivative with respect to the Mach number.
    pub mach: f64,
    /// Derivative with respect to the Reynolds number.
    pub reynolds: f64,
}

impl Direct {
    /// No dependence at all, for numbers of nodes and stations.
    pub fn none(nodes: usize, stations: usize) -> Self {
        Self {
            strengths: vec![0.0; nodes],
            panels: vec![[0.0; 2]; nodes],
            given: vec![[0.0; 2]; nodes],
            index: Vec::new(),
            unknowns: Change::zeros(stations),
            alpha: 0.0,
            mach: 0.0,
            reynolds: 0.0,
        }
    }
}

/// Turns sensitivities to the strengths at the nodes, one row per output, into sensitivities to the unsmoothed mass
/// defects at the nodes and to the mass defects of the wake.
pub(super) fn through_defects(system: &System, strengths: &DMatrix<f64>) -> (DMatrix<f64>, DMatrix<f64>) {
    let by_nodes = smooth_columns(&product(strengths, &system.section.nodes));
    (by_nodes, product(strengths, &system.flow.nodes_by_wake))
}

/// Derivatives of an output with respect to the unknowns: directly, by way of the node indices of points, and by way of
/// the mass defects at the nodes and in the wake.
pub(super) fn output_gradient(solved: &Solved, direct: &Direct, by_nodes: &[f64], by_wake: &[f64]) -> Change {
    let at = solved.at;
    let numbering = at.numbering;
    let mut result = direct.unknowns.clone();
    let mut globals = [0.0; GLOBAL_UNKNOWNS];
    for &(point, slope) in &direct.index {
        let index = &at.positions.index[point];
        (0..GLOBAL_UNKNOWNS).for_each(|g| globals[g] += slope * index.eps[g]);
    }
    let through_mass = by_nodes.iter().chain(by_wake).any(|weight| *weight != 0.0);
    for (weight, mass) in by_nodes.iter().zip(&at.speeds.node_mass) {
        (0..GLOBAL_UNKNOWNS).for_each(|g| globals[g] += weight * mass.eps[g]);
    }
    result.add(&Change::new(Vec::new(), globals), 1.0);
    if !through_mass {
        return result;
    }
    let mut by_points = vec![0.0; numbering.points()];
    at.speeds.projection.transpose_apply(by_nodes, &mut by_points);
    for (k, state) in result.stations.iter_mut().enumerate() {
        let by_mass = match numbering.on_side(k) {
            Some((side, j)) => side.sign() * by_points[numbering.point(side, j)],
            None => by_wake[k - numbering.wake_start()],
        };
        *state = state.step(&at.log_mass[k], by_mass * at.mass[k]);
    }
    result
}
