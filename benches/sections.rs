//! Panelled sections and operating points for the flow benches.

use aeroform::flow::{
    Condition, Gradients, Incidence, PanelledSection, Settings, Solution, TrailingEdge, panel_parameters,
};
use aeroform::section::SectionDefinition;
use nalgebra::DMatrix;

/// Nodes of the flow benches: 160 panels.
pub const NODES: usize = 161;

/// Nodes of a named section.
pub fn nodes(name: &str) -> Vec<[f64; 2]> {
    let section = SectionDefinition::parse(name).and_then(|d| d.section()).expect("a section of the bench");
    panel_parameters(&section, NODES).iter().map(|&u| section.curve().point_at(u)).collect()
}

/// The operating points a bench names: section, angle of attack in degrees, Reynolds number, trips.
pub const POINTS: [(&str, f64, f64, [Option<f64>; 2]); 4] = [
    ("naca0012", 2.0, 1e6, [None; 2]),
    ("naca0012", 4.0, 5e6, [Some(0.05); 2]),
    ("naca4412", 2.0, 3e6, [None; 2]),
    ("naca4412", 4.0, 5e6, [Some(0.05); 2]),
];

pub fn condition(degrees: f64, reynolds: f64, trips: [Option<f64>; 2]) -> Condition {
    Condition { trips, ..Condition::new(Incidence::Alpha(degrees.to_radians()), reynolds) }
}

/// A cold point: from nodes to coefficients.
pub fn cold(nodes: &[[f64; 2]], condition: &Condition) -> Solution {
    let section = PanelledSection::new(nodes, TrailingEdge::Blunt).expect("nodes of a section");
    section.analyze(condition, &Settings::default(), None).expect("a condition in range")
}

/// A polar of warm points.
pub fn polar(section: &PanelledSection, degrees: impl Iterator<Item = f64>, reynolds: f64) -> Vec<Solution> {
    let mut points: Vec<Solution> = Vec::new();
    for angle in degrees {
        let condition = condition(angle, reynolds, [None; 2]);
        let next = section.analyze(&condition, &Settings::default(), points.last());
        points.push(next.expect("a condition in range"));
    }
    points
}

/// Derivatives of all nodes (x and y in turn) with respect to some number of design variables: any dense matrix will
/// do.
pub struct Chain {
    /// A row a variable, a column a coordinate of a node.
    rows: DMatrix<f64>,
}

impl Chain {
    pub fn new(variables: usize) -> Self {
        let rows = DMatrix::from_fn(variables, 2 * NODES, |i, k| (0.7 * (k * variables + i) as f64).sin());
        Self { rows }
    }

    /// Gradients of the four coefficients with respect to the design variables, a column each.
    pub fn apply(&self, gradients: &Gradients) -> DMatrix<f64> {
        let by_nodes = [&gradients.cl, &gradients.cd, &gradients.cm, &gradients.cp_min].map(|d| d.nodes.as_flattened());
        &self.rows * DMatrix::from_fn(2 * NODES, by_nodes.len(), |k, output| by_nodes[output][k])
    }
}
