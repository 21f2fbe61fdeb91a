//! The nodes of a flow: the background grid, displaced by the unknowns of the lines and by the boundary layer.

use super::background::{BackgroundNode, WallStations, column};
use super::numbering::{Grid, Unknowns};
use super::section_curve::SectionCurve;
use crate::flow::layer::{Derived, EdgeLaw, Regime, Side, State};
use crate::scalar::Scalar;

/// Stream function over which the displacement of the wall fades away from the lines.
pub(super) const CARRY: f64 = 0.5;
/// Length of the dead air behind a blunt edge, in heights of the edge.
const DEAD_AIR: f64 = 2.5;

/// The section that a flow is about, and its trips, in any kind of number.
#[derive(Debug, Clone)]
pub(super) struct Shape<S> {
    pub curve: SectionCurve<S>,
    /// Arc lengths of the trips of both sides from the first node, where there are trips.
    pub trips: [Option<S>; 2],
}

impl<S: Scalar> Shape<S> {
    /// The shape through nodes in the frame of the chord line, with trips at places x; `None` where the nodes are too
    /// uneven.
    pub fn new(nodes: &[[S; 2]], trips: [Option<f64>; 2]) -> Option<Self> {
        let curve = SectionCurve::new(nodes)?;
        // a trip at the edge is none
        let trip = |side: Side| {
            let x = trips[side.index()].filter(|x| *x < 1.0)?;
            Some(curve.arc_length(curve.index_at_x(side, x)))
        };
        let trips = Side::BOTH.map(trip);
        Some(Self { curve, trips })
    }
}

/// The background grid of a flow.
#[derive(Debug, Clone)]
pub(super) struct Background<S> {
    pub wall: WallStations<S>,
    /// Nodes of every line and station, line by line in every station.
    nodes: Vec<BackgroundNode<S>>,
    lines: usize,
}

impl<S: Scalar> Background<S> {
    pub fn new(grid: &Grid, curve: &SectionCurve<S>, stagnation: S, transition: [S; 2]) -> Self {
        let stations = &grid.stations;
        let wall = WallStations::new(stations, curve, stagnation, transition);
        let mut nodes = Vec::with_capacity(grid.count() * grid.lines());
        for station in 0..grid.count() {
            let [upper, mut lower] =
                Side::BOTH.map(|side| column(stations, station, side, &wall.column_inputs(stations, station, side)));
            lower.reverse();
            nodes.extend(lower);
            nodes.extend(upper);
        }
        Self { wall, nodes, lines: grid.lines() }
    }

    pub fn node(&self, station: usize, line: usize) -> &BackgroundNode<S> {
        &self.nodes[station * self.lines + line]
    }
}

/// Displacement thickness of a state of the layer.
pub(super) fn displacement_thickness<S: Scalar>(state: [S; 4], law: &impl EdgeLaw<Number = S>) -> S {
    // it does not depend on the regime
    Derived::new(State::from_fn(|k| state[k]), Regime::Laminar, law).displacement
}

/// Height of the dead air at a distance behind an edge of the given height. The dead air is at least `least` long, as lines
/// cannot close it within a cell.
fn dead_air<S: Scalar>(height: S, distance: f64, least: f64) -> S {
    let length = height * DEAD_AIR + least;
    if height.re() <= 0.0 || distance >= length.re() {
        return S::from(0.0);
    }
    let z = -length.recip() * distance + 1.0;
    height * (-z * 2.0 + 3.0) * z * z
}

/// Heights of the dead air at the stations of the wake, from the trailing edge on.
pub(super) fn gaps<S: Scalar>(grid: &Grid, wall: &WallStations<S>) -> Vec<S> {
    let height = wall.edge_height();
    let behind = &grid.stations.behind;
    behind.iter().map(|&distance| dead_air(height, distance, behind[1])).collect()
}

/// How a node is moved: by the displacement of the line, and by the layer and the dead air with these factors.
#[derive(Debug, Clone, Copy)]
pub(super) struct Movement {
    /// Whether the line has a displacement of its own.
    pub free: bool,
    /// Factor of the displacement thickness of that sheet.
    pub by_layer: f64,
    /// Factor of the dead air.
    pub by_gap: f64,
}

/// How the node of a line at a station is moved.
pub(super) fn movement(grid: &Grid, station: usize, line: usize) -> Movement {
    let (side, height) = grid.side_of(line);
    let (on_wall, behind) = (grid.on_wall(station), station > grid.stations.edge());
    // half of the wake on each side; the normal of the wall points outward, all other directions upward
    let share = if behind { 0.5 } else { 1.0 };
    let sign = if on_wall && height == 0 { 1.0 } else { side.sign() };
    let fading = (-grid.stations.heights[height] / CARRY).exp();
    // all lines carry the dead air, which may be higher than the inner tubes: those would turn over otherwise
    Movement {
        free: !(on_wall && height == 0),
        by_layer: share * sign * fading,
        by_gap: if behind { 0.5 * sign * fading } else { 0.0 },
    }
}

/// Place of a node after displacements along its direction.
pub(super) fn moved<S: Scalar>(node: &BackgroundNode<S>, displacement: S) -> [S; 2] {
    [0, 1].map(|c| node.place[c] + node.direction[c] * displacement)
}

/// All that the kernels read off the geometry, in one kind of number.
#[derive(Debug, Clone)]
pub(super) struct Geometry<S> {
    nodes: Vec<[S; 2]>,
    lines: usize,
    pub wall: WallStations<S>,
    pub gaps: Vec<S>,
    pub trips: [S; 2],
}

impl<S: Scalar> Geometry<S> {
    pub fn new<U: Copy>(
        grid: &Grid,
        shape: &Shape<S>,
        background: Background<S>,
        unknowns: &Unknowns<U>,
        law: &impl EdgeLaw<Number = S>,
    ) -> Self
    where
        S: From<U>,
    {
        let gaps = gaps(grid, &background.wall);
        let mut nodes = Vec::with_capacity(grid.count() * grid.lines());
        for station in 0..grid.count() {
            let thickness = |side: Side| match grid.carrier(station, side) {
                Some(sheet) => displacement_thickness(unknowns.layer(grid, station, sheet).map(S::from), law),
                None => S::from(0.0),
            };
            let thickness = Side::BOTH.map(thickness);
            for line in 0..grid.lines() {
                let movement = movement(grid, station, line);
                let (side, _) = grid.side_of(line);
                let mut displacement = thickness[side.index()] * movement.by_layer;
                if movement.free {
                    displacement += S::from(unknowns.at(grid.displacement(station, line)));
                }
                if movement.by_gap != 0.0 {
                    displacement += gaps[station - grid.stations.edge()] * movement.by_gap;
                }
                nodes.push(moved(background.node(station, line), displacement));
            }
        }
        // a side without a trip has none that is read
        let trips = shape.trips.map(|trip| trip.unwrap_or(S::from(0.0)));
        Self { nodes, lines: grid.lines(), wall: background.wall, gaps, trips }
    }

    #[inline(always)]
    pub fn node(&self, station: usize, line: usize) -> [S; 2] {
        self.nodes[station * self.lines + line]
    }

    pub fn index(&self, station: usize, line: usize) -> usize {
        station * self.lines + line
    }
}
