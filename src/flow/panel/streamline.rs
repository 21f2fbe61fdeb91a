//! The path of the wake: the streamline that leaves the trailing edge of the flow without boundary layer.
//!
//! A closed form gives a first guess, and every panel of the wake then takes the direction of the flow without boundary
//! layer at its middle on that guess. The path is thus an explicit function of the shape and the incidence, with exact
//! derivatives. It matters behind cambered tails, where the closed form turns far too slowly: the lift of an S1223
//! would be 3 % too small.

use super::edge::closing_velocity;
use super::inviscid::PanelSystem;
use super::kernel::Place;
use super::outline::{TrailingEdge, TrailingEdgeFrame};
use super::polar::{Polar, Straight};
use crate::scalar::Scalar;
use nalgebra::{DMatrix, DVectorView};

/// The path of the wake of one section at one incidence. The direction of the first panel is that of the trailing edge.
/// P is the number of the panels behind it.
#[derive(Debug, Clone)]
pub(crate) struct Streamline {
    /// Places at which the directions of the panels from number 1 on are taken.
    pub places: Vec<[f64; 2]>,
    /// Velocity without boundary layer at the places, in units of the onset speed.
    pub velocity: Vec<[f64; 2]>,
    /// Velocity along x and y at the places per vortex strength at the nodes of the section, P × N each.
    pub by_strength: [DMatrix<f64>; 2],
    /// Distances and directions from the nodes of the section to the places.
    pub from_surface: Polar,
    /// Nodes of the wake, in chords.
    pub nodes: Vec<[f64; 2]>,
}

/// Places at which the directions of the wake panels from number 1 on are taken: their middles on a first guess.
///
/// The slope of the guess, ξ chords behind the edge, is that of the streamline behind a thin section: to the leaving
/// angle it adds the turn to the chord line (the x axis) with 2 (√(ξ² + ξ) − ξ), and that from the chord line to the onset
/// flow `wind` with √(ξ/(1 + ξ)) (flat plate, exact to first order in the angles).
pub(crate) fn places<S: Scalar>(edge: &TrailingEdgeFrame<S>, wind: [S; 2], distances: &[f64]) -> Vec<[S; 2]> {
    let angle = |v: [S; 2]| v[1].angle(v[0]);
    let (leaving, far) = (angle(edge.bisector), angle(wind));
    let mut node = edge.middle;
    let mut middles = Vec::with_capacity(distances.len() - 1);
    for pair in distances.windows(2) {
        let (at, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
        let turned = 2.0 * ((at * at + at).sqrt() - at);
        let (sin, cos) = (leaving * (1.0 - turned) + far * (at / (1.0 + at)).sqrt()).sin_cos();
        middles.push([node[0] + cos * half, node[1] + sin * half]);
        node = [node[0] + cos * (2.0 * half), node[1] + sin * (2.0 * half)];
    }
    middles.split_off(1)
}

/// Unit vector along a velocity.
pub(crate) fn direction<S: Scalar>([x, y]: [S; 2]) -> [S; 2] {
    let speed = (x * x + y * y).sqrt();
    [x / speed, y / speed]
}

/// Nodes of the wake that starts along the bisector of the edge and whose panels from number 1 on follow `velocity`.
pub(crate) fn nodes<S: Scalar>(edge: &TrailingEdgeFrame<S>, velocity: &[[S; 2]], distances: &[f64]) -> Vec<[S; 2]> {
    let directions = std::iter::once(edge.bisector).chain(velocity.iter().map(|v| direction(*v)));
    let mut node = edge.middle;
    let mut result = vec![node];
    for (pair, direction) in distances.windows(2).zip(directions) {
        let step = pair[1] - pair[0];
        node = [0, 1].map(|c| node[c] + direction[c] * step);
        result.push(node);
    }
    result
}

impl Streamline {
    /// The path for the strengths at the nodes without boundary layer at the incidence `alpha` in radians.
    pub fn new(panels: &PanelSystem, strengths: &[f64], alpha: f64, distances: &[f64]) -> Self {
        let frame = panels.outline.edge_frame();
        let wind = [alpha.cos(), alpha.sin()];
        let places = places(&frame, wind, distances);
        let from_surface = Polar::new(&places, &panels.outline.nodes);
        let by_strength = velocity_by_strength(panels, &places, &from_surface);
        let strengths = DVectorView::from_slice(strengths, strengths.len());
        let [x, y] = by_strength.each_ref().map(|along| along * strengths);
        let velocity: Vec<[f64; 2]> = x.iter().zip(&y).map(|(x, y)| [wind[0] + x, wind[1] + y]).collect();
        let nodes = nodes(&frame, &velocity, distances);
        Self { places, velocity, by_strength, from_surface, nodes }
    }
}

/// Velocity along x and y at points per vortex strength at the nodes of the section.
fn velocity_by_strength(panels: &PanelSystem, points: &[[f64; 2]], polar: &Polar) -> [DMatrix<f64>; 2] {
    let outline = &panels.outline;
    let n = outline.len();
    let mut result = [0, 1].map(|_| DMatrix::zeros(points.len(), n));
    for j in 0..n - 1 {
        let panel = Straight::new(outline.panel(j));
        for (k, point) in points.iter().enumerate() {
            let seen = polar.seen_of_surface(k, [j, j + 1], &panel);
            let v = seen.sight(panel.local(*point), panel.length, Place::Elsewhere).velocity();
            for end in 0..2 {
                let v = panel.outer(v.vortex(end));
                for c in 0..2 {
                    result[c][(k, j + end)] += v[c];
                }
            }
        }
    }
    if outline.trailing_edge == TrailingEdge::Blunt {
        for (k, point) in points.iter().enumerate() {
            let v = closing_velocity(outline, *point);
            for c in 0..2 {
                result[c][(k, 0)] += 0.5 * v[c];
                result[c][(k, n - 1)] -= 0.5 * v[c];
            }
        }
    }
    result
}
