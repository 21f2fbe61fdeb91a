//! Derivatives of the nodes, wall points and arc lengths with respect to the unknowns.

use super::background::{BackgroundNode, WallStations};
use super::gas::Flow;
use super::geometry::{Background, displacement_thickness, gaps, moved, movement};
use super::numbering::{Grid, LAYER, SPEED, STAGNATION, TRANSITION, Unknowns};
use super::section_curve::SectionCurve;
use crate::differentiate::Tangent;
use crate::flow::layer::{EdgeLaw, Side};

/// Derivatives with respect to the arc length of the stagnation point and to that of transition on one side.
pub(super) type ByPlaces = Tangent<3>;
/// Derivatives with respect to displacement, momentum thickness, shape and speed of the layer, and the places.
type ByMoves = Tangent<7>;
type ByState = Tangent<LAYER>;

/// Global unknowns in the order of the directions of [`ByPlaces`].
pub(super) const PLACES: [usize; 3] = [STAGNATION, TRANSITION[0], TRANSITION[1]];
/// Unknowns of a station of the layer that displace.
const DISPLACING: [usize; 3] = [0, 1, SPEED];

/// How a node moves with the unknowns of its station and the global ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodeMoves {
    /// Number of unknowns of the station that move the node.
    pub count: usize,
    /// Indices of these unknowns in the station.
    pub index: [usize; 4],
    /// Derivatives of the two coordinates.
    pub by: [[f64; 2]; 4],
    /// Derivatives of each coordinate with respect to the global unknowns of [`PLACES`].
    pub by_places: [[f64; 3]; 2],
}

/// Derivatives of all places with respect to the unknowns.
#[derive(Debug, Clone)]
pub(super) struct Moves {
    pub nodes: Vec<NodeMoves>,
    /// Wall points and arc lengths of both sides as functions of the places.
    pub wall: WallStations<ByPlaces>,
}

fn widen<const N: usize, const W: usize>(x: Tangent<N>, offset: usize) -> Tangent<W> {
    let mut wide = Tangent::from_re(x.re);
    wide.eps[offset..offset + N].copy_from_slice(&x.eps);
    wide
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
        let mut nodes = Vec::with_capacity(grid.count() * grid.lines());
        for station in 0..grid.count() {
            let thickness = Side::BOTH.map(|side| {
                let sheet = grid.carrier(station, side)?;
                let state = unknowns.layer(grid, station, sheet);
                let seeded = std::array::from_fn(|k| ByState::from_re(state[k]).derivative(k));
                Some(displacement_thickness(seeded, &law))
            });
            for line in 0..grid.lines() {
                let movement = movement(grid, station, line);
                let (side, _) = grid.side_of(line);
                let mut moves = NodeMoves { count: 0, index: [0; 4], by: [[0.0; 2]; 4], by_places: [[0.0; 3]; 2] };
                let mut displacement = ByMoves::from_re(0.0);
                // directions of the unknowns of the station, in the order in which they are met
                let mut directions = [0; 4];
                let mut add = |index: usize, direction: usize| {
                    moves.index[moves.count] = index;
                    directions[moves.count] = direction;
                    moves.count += 1;
                };
                if movement.free {
                    let place = grid.displacement(station, line);
                    displacement += ByMoves::from_re(unknowns.at(place)).derivative(0);
                    add(place.index, 0);
                }
                if let (Some(thickness), Some(sheet)) = (thickness[side.index()], movement.sheet) {
                    let mut wide = ByMoves::from_re(thickness.re);
                    for (direction, k) in DISPLACING.into_iter().enumerate() {
                        wide.eps[1 + direction] = thickness.eps[k];
                        add(grid.layer(station, sheet, k).index, 1 + direction);
                    }
                    displacement += wide * movement.by_layer;
                }
                if movement.by_gap != 0.0 {
                    displacement += widen::<3, 7>(gaps[station - grid.stations.edge()], 4) * movement.by_gap;
                }
                let node = background.node(station, line);
                let place = |v: [ByPlaces; 2]| v.map(|c| widen::<3, 7>(c, 4));
                let node = BackgroundNode { place: place(node.place), direction: place(node.direction) };
                let [x, y] = moved(&node, displacement);
                for k in 0..moves.count {
                    moves.by[k] = [x.eps[directions[k]], y.eps[directions[k]]];
                }
                moves.by_places = [x, y].map(|c| [c.eps[4], c.eps[5], c.eps[6]]);
                nodes.push(moves);
            }
        }
        Self { nodes, wall: background.wall }
    }
}
