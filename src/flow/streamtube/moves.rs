//! Derivatives of the nodes, wall points and arc lengths with respect to the unknowns.

use super::background::WallStations;
use super::gas::Flow;
use super::geometry::{Background, displacement_thickness, gaps, moved, movement};
use super::numbering::{Grid, LAYER, SPEED, STAGNATION, TRANSITION, Unknowns};
use super::section_curve::SectionCurve;
use crate::differentiate::Tangent;
use crate::flow::layer::{EdgeLaw, Side};

/// Derivatives with respect to the arc length of the stagnation point and to that of transition on one side.
pub(super) type ByPlaces = Tangent<3>;
type ByState = Tangent<LAYER>;

/// Global unknowns in the order of the directions of [`ByPlaces`].
pub(super) const PLACES: [usize; 3] = [STAGNATION, TRANSITION[0], TRANSITION[1]];
/// Unknowns of a station of the layer that displace.
pub(super) const DISPLACING: [usize; 3] = [0, 1, SPEED];

/// How a node moves with the unknowns of its station and the global ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeMoves {
    /// Index of the displacement of the line among the unknowns of the station, where the line has one.
    pub displacement: Option<usize>,
    /// Direction of displacement.
    pub direction: [f64; 2],
    /// Number of the layer that displaces the node, and the factor of its thickness.
    pub by_layer: Option<(usize, f64)>,
    /// Derivatives of each coordinate with respect to the global unknowns of [`PLACES`].
    pub by_places: [[f64; 3]; 2],
}

/// How the displacement thickness of a layer changes.
#[derive(Debug, Clone, Copy)]
pub(super) struct LayerMoves {
    pub station: usize,
    /// Index of the first unknown of the layer among those of the station.
    pub first: usize,
    /// Derivatives of the displacement thickness with respect to the unknowns of [`DISPLACING`].
    pub by: [f64; 3],
}

/// Derivatives of all places with respect to the unknowns.
#[derive(Debug, Clone)]
pub(super) struct Moves {
    pub nodes: Vec<NodeMoves>,
    pub layers: Vec<LayerMoves>,
    /// Wall points and arc lengths of both sides as functions of the places.
    pub wall: WallStations<ByPlaces>,
}

/// The background grid with derivatives with respect to the places.
pub(super) fn lifted_background(
    grid: &Grid,
    curve: &SectionCurve<ByPlaces>,
    unknowns: &Unknowns,
) -> Background<ByPlaces> {
    let unit = |k: usize| ByPlaces::from_re(unknowns.globals[PLACES[k]]).derivative(k);
    Background::new(grid, curve, unit(0), [unit(1), unit(2)])
}

impl Moves {
    pub fn new(grid: &Grid, background: Background<ByPlaces>, unknowns: &Unknowns, flow: &Flow<f64>) -> Self {
        let law = flow.stream.map(ByState::from_re);
        let gaps = gaps(grid, &background.wall);
        let mut layers = Vec::with_capacity(2 * grid.count());
        let mut nodes = Vec::with_capacity(grid.count() * grid.lines());
        for station in 0..grid.count() {
            let thickness = Side::BOTH.map(|side| {
                let sheet = grid.carrier(station, side)?;
                let state = unknowns.layer(grid, station, sheet);
                let seeded = std::array::from_fn(|k| ByState::from_re(state[k]).derivative(k));
                let thickness = displacement_thickness(seeded, &law);
                let first = grid.layer(station, sheet, 0).index;
                layers.push(LayerMoves { station, first, by: DISPLACING.map(|k| thickness.eps[k]) });
                Some((layers.len() - 1, thickness.re))
            });
            for line in 0..grid.lines() {
                let movement = movement(grid, station, line);
                let (side, _) = grid.side_of(line);
                let mut displacement = ByPlaces::from_re(0.0);
                let place = movement.free.then(|| grid.displacement(station, line));
                if let Some(place) = place {
                    displacement += unknowns.at(place);
                }
                let layer = thickness[side.index()];
                if let Some((_, thickness)) = layer {
                    displacement += thickness * movement.by_layer;
                }
                if movement.by_gap != 0.0 {
                    displacement += gaps[station - grid.stations.edge()] * movement.by_gap;
                }
                let node = background.node(station, line);
                nodes.push(NodeMoves {
                    displacement: place.map(|place| place.index),
                    direction: node.direction.map(|c| c.re),
                    by_layer: layer.map(|(number, _)| (number, movement.by_layer)),
                    by_places: moved(node, displacement).map(|c| c.eps),
                });
            }
        }
        Self { nodes, layers, wall: background.wall }
    }
}
