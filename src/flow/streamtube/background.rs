//! The background grid: nodes and directions of displacement as an explicit smooth function of the shape, the
//! stagnation point and transition.
//!
//! Wall stations stand on the section at fixed fractions of the way from the stagnation point to the trailing edge; the
//! fractions shift a little so that one station stands exactly at transition. The lines are those of the flow past the
//! parabola with the nose radius, whose dividing line hits the wall at the stagnation point. With ζ(z) = √(2 (z − f))
//! and the focus f of the parabola, they are Z(w) = (√(2w) + ζ₀)²/2 for w = φ + iψ. Lines across the flow start at the
//! wall stations, and spread away from the nose so that they do not crowd at the stagnation point.

use super::grading::Stations;
use super::section_curve::SectionCurve;
use crate::flow::layer::Side;
use crate::plane::{dot, minus};
use crate::scalar::Scalar;

/// Stream function over which the lines across the flow spread, per unit of the spread.
const SPREAD: f64 = 4.0;

fn plus<S: Scalar>(a: [S; 2], b: [S; 2]) -> [S; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

/// The root of twice a complex number, on the branch that belongs to a side of the parabola.
///
/// To the right of the focus the side decides, and not the sign of the imaginary part: behind a low nose the lower surface
/// can rise above the focus, and stays the lower one. To the left both branches are one.
fn root<S: Scalar>([a, b]: [S; 2], side: Side) -> [S; 2] {
    let r = (a * a + b * b).sqrt();
    if a.re() > 0.0 {
        let x = (r + a).sqrt() * side.sign();
        [x, b / x]
    } else {
        let y = (r - a).sqrt();
        [b / y, y]
    }
}

/// Half the square of a complex number.
fn half_square<S: Scalar>([x, y]: [S; 2]) -> [S; 2] {
    [(x * x - y * y) * 0.5, x * y]
}

/// The unit vector along (slope + i) ζ/ζ', the line across the flow.
fn direction<S: Scalar>(z: [S; 2], w: [S; 2], slope: S) -> [S; 2] {
    let r = dot(w, w);
    let (a, b) = (dot(z, w) / r, (z[1] * w[0] - z[0] * w[1]) / r);
    let v = [slope * a - b, a + slope * b];
    let length = dot(v, v).sqrt();
    v.map(|c| c / length)
}

/// Everything that the grid takes from the section.
#[derive(Debug, Clone)]
pub(super) struct WallStations<S> {
    /// Points of the wall stations of both sides, from the stagnation point on.
    pub points: [Vec<[S; 2]>; 2],
    /// Outward normals there.
    pub normals: [Vec<[S; 2]>; 2],
    /// Sides of the nose on which they lie.
    pub beside: [Vec<Side>; 2],
    /// Arc lengths from the stagnation point.
    pub arcs: [Vec<S>; 2],
    /// Focus of the parabola.
    pub focus: [S; 2],
    /// The stagnation point in the plane of the parabola.
    pub origin: [S; 2],
    /// Distances ahead of the nose in the plane of the parabola, from the nose on.
    pub ahead: Vec<S>,
    /// Arc length of the surface.
    pub total: S,
}

/// Weight of the shift of a fraction, for a side that turns turbulent at the fraction `turning`.
///
/// The weight is largest near the nose, so that the shift leaves the edge alone, and no larger than a few times that at
/// `turning`: a side that turns close to the edge would otherwise have all its other stations moved past each other.
fn shift_weight(fraction: f64, turning: f64) -> f64 {
    fraction * (1.0 - fraction).powf((turning.recip() - 1.0).clamp(1.0, 3.0))
}

/// Fractions of the length of a side at which its stations stand, shifted so that one stands at `transition`.
fn shifted<S: Scalar>(stations: &Stations, side: Side, transition: S) -> Vec<S> {
    let turning = stations.fractions[stations.turning[side.index()]];
    let shift = (transition - turning) / shift_weight(turning, turning);
    stations.fractions.iter().map(|&f| shift * shift_weight(f, turning) + f).collect()
}

impl<S: Scalar> WallStations<S> {
    /// The wall stations for the arc lengths of the stagnation point from the first node and of transition on both sides
    /// from there.
    pub fn new(stations: &Stations, curve: &SectionCurve<S>, stagnation: S, transition: [S; 2]) -> Self {
        let focus = curve.focus();
        let nose = curve.index(stagnation);
        let count = stations.fractions.len();
        let pairs = || [0, 1].map(|_| Vec::with_capacity(count));
        let mut wall = Self {
            points: pairs(),
            normals: pairs(),
            beside: [0, 1].map(|_| Vec::with_capacity(count)),
            arcs: [0, 1].map(|_| Vec::with_capacity(count)),
            focus,
            origin: root(minus(curve.point(nose), focus), curve.side_of_nose(nose.re())),
            ahead: vec![],
            total: curve.total(),
        };
        for side in Side::BOTH {
            let k = side.index();
            let length = side.length(stagnation, curve.total());
            let places = shifted(stations, side, transition[k] / length);
            for (&fraction, place) in stations.fractions.iter().zip(places) {
                let arc = place * length;
                let at_edge = fraction == 1.0;
                let index =
                    if at_edge { S::from(curve.edge_index(side)) } else { curve.index(side.place(stagnation, arc)) };
                let point = curve.point(index);
                // the curve may start flat over the index at the edge, so that it has no direction there
                let [dx, dy] = match wall.points[k].last() {
                    Some(&before) if at_edge => minus(before, point).map(|c| c * side.sign()),
                    _ => curve.tangent(index),
                };
                let length = (dx * dx + dy * dy).sqrt();
                wall.points[k].push(point);
                wall.beside[k].push(curve.side_of_nose(index.re()));
                wall.normals[k].push([dy / length, -dx / length]);
                wall.arcs[k].push(arc);
            }
        }
        // the first step of the upper side
        let first = root(minus(wall.points[0][1], focus), wall.beside[0][1])[0] - wall.origin[0];
        wall.ahead = stations.ahead(first);
        wall
    }

    /// The middle of the trailing edge.
    fn edge(&self) -> [S; 2] {
        let [a, b] = [0, 1].map(|side| self.points[side][self.points[side].len() - 1]);
        [(a[0] + b[0]) * 0.5, (a[1] + b[1]) * 0.5]
    }

    /// Height of the trailing edge.
    pub fn edge_height(&self) -> S {
        let [a, b] = [0, 1].map(|side| self.points[side][self.points[side].len() - 1]);
        let gap = minus(a, b);
        let square = dot(gap, gap);
        // the edge of a sharp section is one point, and stays one
        if square.re() == 0.0 { S::from(0.0) } else { square.sqrt() }
    }

    /// The numbers that a column of the grid depends on.
    pub fn column_inputs(&self, stations: &Stations, station: usize, side: Side) -> ColumnInputs<S> {
        let (nose, edge, k) = (stations.nose(), stations.edge(), side.index());
        let number = station.clamp(nose, edge) - nose;
        let wall = self.points[k][number];
        let base = if station > edge { self.edge() } else { wall };
        let ahead = self.ahead[nose.saturating_sub(station)];
        let (normal, beside) = (self.normals[k][number], self.beside[k][number]);
        ColumnInputs { wall, normal, beside, base, focus: self.focus, origin: self.origin, ahead }
    }
}

/// The numbers that the nodes of one side at a station depend on.
#[derive(Debug, Clone, Copy)]
pub(super) struct ColumnInputs<S> {
    /// The wall point of the station: the nose ahead of it, the edge of the side behind it.
    pub wall: [S; 2],
    /// Outward normal there.
    pub normal: [S; 2],
    /// Side of the nose on which it lies.
    pub beside: Side,
    /// The wall point, and behind the edge the middle of the edge.
    pub base: [S; 2],
    pub focus: [S; 2],
    pub origin: [S; 2],
    /// Distance ahead of the nose in the plane of the parabola; zero from the nose on.
    pub ahead: S,
}

/// Number of numbers that a column depends on.
pub(super) const COLUMN_INPUTS: usize = 11;

impl<S: Scalar> ColumnInputs<S> {
    /// The numbers that can be differentiated by, in the order of the fields.
    pub fn numbers(&self) -> [S; COLUMN_INPUTS] {
        let all = [self.wall, self.normal, self.base, self.focus, self.origin];
        std::array::from_fn(|k| if k < 10 { all[k / 2][k % 2] } else { self.ahead })
    }

    /// These inputs with other numbers.
    pub fn with_numbers<T: Scalar>(&self, x: [T; COLUMN_INPUTS]) -> ColumnInputs<T> {
        let pair = |k: usize| [x[2 * k], x[2 * k + 1]];
        let [wall, normal, base, focus, origin] = [0, 1, 2, 3, 4].map(pair);
        ColumnInputs { wall, normal, beside: self.beside, base, focus, origin, ahead: x[10] }
    }
}

/// A node without displacement and the direction of its displacement.
#[derive(Debug, Clone, Copy)]
pub(super) struct BackgroundNode<S> {
    pub place: [S; 2],
    pub direction: [S; 2],
}

/// Abscissa φ and its slope of the line across the flow with parameter `tau`, at a height.
fn spread<S: Scalar>(tau: S, height: f64) -> (S, S) {
    let inverse = 1.0 / (1.0 + SPREAD * height);
    let (e, slope) = (SPREAD * height * inverse, SPREAD * inverse * inverse);
    let t2 = tau * tau;
    let square = t2 * t2 + e * e;
    let fourth = square.sqrt().sqrt();
    (tau * fourth * 0.5, tau * (0.25 * e * slope) * fourth / square)
}

/// The nodes of one side at a station, from the dividing line outward. On the wall the first direction is the outward
/// normal.
pub(super) fn column<S: Scalar>(
    stations: &Stations,
    station: usize,
    side: Side,
    inputs: &ColumnInputs<S>,
) -> Vec<BackgroundNode<S>> {
    let (nose, edge) = (stations.nose(), stations.edge());
    let (zero, one) = (S::from(0.0), S::from(1.0));
    let sign = side.sign();
    let behind = if station > edge { stations.behind[station - edge] } else { 0.0 };
    let (tau, start, mut base) = if station < nose {
        let eta = inputs.ahead;
        (-eta, [zero, eta], inputs.base)
    } else if station == nose {
        (zero, [zero, zero], inputs.base)
    } else {
        let zeta = root(minus(inputs.wall, inputs.focus), inputs.beside);
        let tau = (zeta[0] - inputs.origin[0]) * sign;
        let start = if behind > 0.0 { (tau * tau + 2.0 * behind).sqrt() * sign } else { tau * sign };
        (tau, [start, zero], [inputs.base[0] + behind, inputs.base[1]])
    };
    let dividing = half_square(plus(start, inputs.origin));
    let first = if station < nose {
        base = plus(base, minus(dividing, half_square(inputs.origin)));
        direction(plus(start, inputs.origin), start, zero)
    } else if station <= edge {
        inputs.normal
    } else {
        [zero, one]
    };
    let mut nodes = vec![BackgroundNode { place: base, direction: first }];
    for &height in &stations.heights[1..] {
        let (phi, slope) = spread(tau, height);
        let w = root([phi + behind, S::from(height * sign)], side);
        let z = plus(w, inputs.origin);
        nodes.push(BackgroundNode {
            place: plus(base, minus(half_square(z), dividing)),
            direction: direction(z, w, slope * sign),
        });
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::super::grading::Size;
    use super::*;

    #[test]
    fn the_lower_surface_may_rise_above_the_focus() {
        let below: [f64; 2] = root([0.1, -1e-6], Side::Lower);
        let above: [f64; 2] = root([0.1, 1e-6], Side::Lower);
        assert!((below[0] - above[0]).abs() < 1e-9 && (below[1] + above[1]).abs() < 1e-12, "{below:?} {above:?}");
        for point in [[0.1f64, 0.05], [0.1, -0.05]] {
            for side in Side::BOTH {
                let [x, y] = half_square(root(point, side));
                assert!((x - point[0]).abs() < 1e-15 && (y - point[1]).abs() < 1e-15);
            }
        }
        // left of the focus the sides are one
        assert_eq!(root([-0.1, 0.05], Side::Upper), root([-0.1, 0.05], Side::Lower));
    }

    #[test]
    fn stations_stay_in_order_wherever_a_side_turns_turbulent() {
        let size = Size { wall: 60, ahead: 16, behind: 17, tubes: 14, reach: 5.0 };
        for k in 1..=97 {
            let transition = 0.01 * f64::from(k);
            let stations = Stations::new(size, [transition, 0.1]);
            let places = shifted(&stations, Side::Upper, transition);
            assert!((places[stations.turning[0]] - transition).abs() < 1e-12);
            assert!(places.windows(2).all(|w| w[1] - w[0] > 1e-3), "{transition}: {places:?}");
        }
    }
}
