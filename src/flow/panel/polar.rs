//! Distances and directions between points and the ends of panels, each pair computed once.
//!
//! Two neighbouring panels share a node, and a node and a point share one distance. The logarithms and angles of all
//! panels at all points are therefore those of the pairs of nodes and points. Kernels take their values from here and
//! their derivatives from the algebra around them.

use super::kernel::{Place, Sight};
use crate::flow::elementary::polar_coordinates;
use crate::scalar::Scalar;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::ops::Range;

/// Logarithms of the distances, and directions in radians, from vertices (columns) to points (rows).
#[derive(Debug, Clone)]
pub(crate) struct Polar {
    /// Number of points, the length of a column.
    points: usize,
    /// Logarithms of the distances, vertex after vertex.
    log: Vec<f64>,
    /// Directions in radians from −π to π, vertex after vertex.
    angle: Vec<f64>,
}

/// An angle as the equal direction between `low` and `low` + 2π. The code has no branches, because it stands in loops
/// over many points.
#[inline(always)]
fn wrapped(angle: f64, low: f64) -> f64 {
    let up = if angle <= low { TAU } else { 0.0 };
    let down = if angle > low + TAU { TAU } else { 0.0 };
    angle + (up - down)
}

/// The opposite direction.
fn back(angle: f64) -> f64 {
    if angle > 0.0 { angle - PI } else { angle + PI }
}

/// Memory for the vectors from one vertex to all points.
struct Column {
    dx: Vec<f64>,
    dy: Vec<f64>,
}

impl Column {
    fn new(points: &[[f64; 2]]) -> Self {
        Self { dx: vec![0.0; points.len()], dy: vec![0.0; points.len()] }
    }

    /// Computes the logarithms of the distances and the directions. Where vertex and point coincide, the place of the
    /// point on the panel says so and neither number is used.
    fn set(&mut self, vertex: [f64; 2], points: &[[f64; 2]], log: &mut [f64], angle: &mut [f64]) {
        let (dx, dy) = (&mut self.dx[..points.len()], &mut self.dy[..points.len()]);
        for ((dx, dy), point) in dx.iter_mut().zip(&mut *dy).zip(points) {
            (*dx, *dy) = (point[0] - vertex[0], point[1] - vertex[1]);
        }
        polar_coordinates(dx, dy, log, angle);
    }
}

impl Polar {
    /// All pairs of `points` and `vertices`.
    pub fn new(points: &[[f64; 2]], vertices: &[[f64; 2]]) -> Self {
        let mut polar = Self::zeros(points.len(), vertices.len());
        let mut pairs = Column::new(points);
        for (j, vertex) in vertices.iter().enumerate() {
            let column = j * polar.points..(j + 1) * polar.points;
            pairs.set(*vertex, points, &mut polar.log[column.clone()], &mut polar.angle[column]);
        }
        polar
    }

    /// All pairs of points of one list.
    pub fn among(points: &[[f64; 2]]) -> Self {
        let n = points.len();
        let mut polar = Self::zeros(n, n);
        let mut pairs = Column::new(points);
        for (j, vertex) in points.iter().enumerate() {
            let below = j * n + j + 1..(j + 1) * n;
            let (log, angle) = (&mut polar.log[below.clone()], &mut polar.angle[below]);
            pairs.set(*vertex, &points[j + 1..], log, angle);
            for i in j + 1..n {
                let (l, a) = (polar.log[j * n + i], polar.angle[j * n + i]);
                (polar.log[i * n + j], polar.angle[i * n + j]) = (l, back(a));
            }
        }
        polar
    }

    fn zeros(points: usize, vertices: usize) -> Self {
        Self { points, log: vec![0.0; points * vertices], angle: vec![0.0; points * vertices] }
    }

    /// The pairs with points and vertices exchanged, and only every `step`th vertex.
    pub fn reversed(&self, step: usize) -> Self {
        let vertices = (self.log.len() / self.points).div_ceil(step);
        let at = |i: usize, k: usize| k * step * self.points + i;
        let pairs = (0..self.points).flat_map(|i| (0..vertices).map(move |k| at(i, k)));
        let (log, angle) = pairs.map(|q| (self.log[q], back(self.angle[q]))).unzip();
        Self { points: vertices, log, angle }
    }

    /// These points followed by the points of `other` from number `from` on. Both must have equal vertices.
    pub fn followed_by(&self, other: &Self, from: usize) -> Self {
        let vertices = self.log.len() / self.points;
        let column = |polar: &Self, j: usize, from: usize| j * polar.points + from..(j + 1) * polar.points;
        let points = self.points + other.points - from;
        let joined = |own: &[f64], others: &[f64]| {
            let mut all = Vec::with_capacity(points * vertices);
            for j in 0..vertices {
                all.extend_from_slice(&own[column(self, j, 0)]);
                all.extend_from_slice(&others[column(other, j, from)]);
            }
            all
        };
        Self { points, log: joined(&self.log, &other.log), angle: joined(&self.angle, &other.angle) }
    }

    /// The pairs of two vertices with all points.
    #[inline(always)]
    pub fn pairs_of(&self, ends: [usize; 2]) -> Pairs<'_> {
        let column = |vertex: usize| vertex * self.points..(vertex + 1) * self.points;
        Pairs { logs: ends.map(|v| &self.log[column(v)]), angles: ends.map(|v| &self.angle[column(v)]) }
    }

    /// A surface panel between two vertices seen from a point, for the stream function: the cut leaves the panel along
    /// its right-hand normal.
    #[inline(always)]
    pub fn seen_of_surface(&self, point: usize, ends: [usize; 2], panel: &Straight) -> Seen {
        self.pairs_of(ends).of_surface(point, panel)
    }
}

/// A panel between two vertices as all points see it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pairs<'a> {
    logs: [&'a [f64]; 2],
    angles: [&'a [f64]; 2],
}

impl Pairs<'_> {
    /// The pairs of a range of points only, so that loops over these run without checks of the index.
    #[inline(always)]
    pub fn of(self, points: Range<usize>) -> Self {
        Self { logs: self.logs.map(|v| &v[points.clone()]), angles: self.angles.map(|v| &v[points.clone()]) }
    }

    #[inline(always)]
    fn seen(&self, point: usize, direction: f64, low: f64) -> Seen {
        let [a, b] = self.angles;
        Seen {
            logs: [self.logs[0][point], self.logs[1][point]],
            angles: [wrapped(a[point] - direction, low), wrapped(b[point] - direction, low)],
        }
    }

    /// A surface panel seen from a point, for the stream function: the cut leaves the panel along its right-hand normal.
    #[inline(always)]
    pub fn of_surface(&self, point: usize, panel: &Straight) -> Seen {
        self.seen(point, panel.angle, -FRAC_PI_2)
    }

    /// A wake panel seen from a point, for the stream function: the cut leaves the panel straight ahead.
    #[inline(always)]
    pub fn of_wake(&self, point: usize, panel: &Straight) -> Seen {
        let Seen { logs, angles: [a, b] } = self.seen(point, panel.angle, 0.0);
        Seen { logs, angles: [a - PI, b - PI] }
    }

    /// A surface panel as point number `number` sees it, which stands at `point` and has this `place` on the panel.
    #[inline(always)]
    pub fn surface_sight(&self, number: usize, point: [f64; 2], panel: &Straight, place: Place) -> Sight<f64> {
        self.of_surface(number, panel).sight(panel.local(point), panel.length, place)
    }

    /// A wake panel as point number `number` sees it, which stands at `point` and has this `place` on the panel.
    #[inline(always)]
    pub fn wake_sight(&self, number: usize, point: [f64; 2], panel: &Straight, place: Place) -> Sight<f64> {
        self.of_wake(number, panel).sight(panel.local(point), panel.length, place)
    }
}

/// Logarithms of the distances of a point from the two ends of a panel, and the directions of the point from these ends
/// in the frame of the panel.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    logs: [f64; 2],
    angles: [f64; 2],
}

/// A straight panel: start, unit vector along it, length, and direction in radians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Straight {
    /// Start of the panel.
    pub start: [f64; 2],
    /// Unit vector along the panel.
    pub tangent: [f64; 2],
    /// Length of the panel.
    pub length: f64,
    /// Direction of the panel in radians.
    angle: f64,
}

impl Straight {
    pub fn new([a, b]: [[f64; 2]; 2]) -> Self {
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let length = (dx * dx + dy * dy).sqrt();
        Self { start: a, tangent: [dx / length, dy / length], length, angle: dy.atan2(dx) }
    }

    /// Coordinates of a point in the frame of the panel: along it and to its left.
    #[inline(always)]
    pub fn local(&self, point: [f64; 2]) -> [f64; 2] {
        let (x, y) = (point[0] - self.start[0], point[1] - self.start[1]);
        let [tx, ty] = self.tangent;
        [x * tx + y * ty, y * tx - x * ty]
    }

    /// A vector given in the frame of the panel, in the outer frame.
    #[inline(always)]
    pub fn outer(&self, [along, across]: [f64; 2]) -> [f64; 2] {
        let [tx, ty] = self.tangent;
        [along * tx - across * ty, along * ty + across * tx]
    }
}

/// The logarithm ½ ln(x² + z²) from its known value, with first derivatives.
#[inline(always)]
fn known_log<S: Scalar>(x: S, z: S, value: f64) -> S {
    if S::NDERIV == 0 {
        return S::from(value);
    }
    let (a, b) = (x.re(), z.re());
    let scale = (a * a + b * b).recip();
    (x - a) * (a * scale) + (z - b) * (b * scale) + value
}

/// The direction of (x, z) from its known value, with first derivatives.
#[inline(always)]
fn known_angle<S: Scalar>(x: S, z: S, value: f64) -> S {
    if S::NDERIV == 0 {
        return S::from(value);
    }
    let (a, b) = (x.re(), z.re());
    let scale = (a * a + b * b).recip();
    (z - b) * (a * scale) - (x - a) * (b * scale) + value
}

impl Seen {
    /// Everything that the kernels need, for coordinates in the frame of the panel and a length that may carry first
    /// derivatives.
    #[inline(always)]
    pub fn sight<S: Scalar>(&self, [x, z]: [S; 2], length: S, place: Place) -> Sight<S> {
        debug_assert!(S::NDERIV <= 1, "the known values carry first derivatives only");
        let zero = S::from(0.0);
        match place {
            Place::Start => Sight {
                x: zero,
                z: zero,
                length,
                ln1: zero,
                ln2: known_log(length, zero, self.logs[1]),
                seen: zero,
                angle1: zero,
                angle2: S::from(self.angles[1]),
            },
            Place::End => Sight {
                x: length,
                z: zero,
                length,
                ln1: known_log(length, zero, self.logs[0]),
                ln2: zero,
                seen: zero,
                angle1: S::from(self.angles[0]),
                angle2: zero,
            },
            Place::Elsewhere => {
                let w = x - length;
                let angle1 = known_angle(x, z, self.angles[0]);
                let angle2 = known_angle(w, z, self.angles[1]);
                let turn = angle2.re() - angle1.re();
                Sight {
                    x,
                    z,
                    length,
                    ln1: known_log(x, z, self.logs[0]),
                    ln2: known_log(w, z, self.logs[1]),
                    seen: angle2 - angle1 + (wrapped(turn, -PI) - turn),
                    angle1,
                    angle2,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kernel::{stream_influence, velocity_influence, wake_source_stream};
    use super::*;
    use crate::differentiate::Tangent;

    fn places() -> Vec<([[f64; 2]; 2], [f64; 2], Place)> {
        let panel = [[0.3, 0.1], [0.5, -0.05]];
        let outside = [[1.0, 0.4], [-0.7, 0.2], [0.35, -0.6], [0.45, 0.5], [0.2, -0.4], [3.0, -2.0]];
        let mut all: Vec<_> = outside.into_iter().map(|p| (panel, p, Place::Elsewhere)).collect();
        all.push((panel, panel[0], Place::Start));
        all.push((panel, panel[1], Place::End));
        all.extend(all.clone().into_iter().map(|(p, q, place)| {
            let back = |v: [f64; 2]| [-v[0], -v[1]];
            (p.map(back), back(q), place)
        }));
        all
    }

    #[test]
    fn shared_values_give_the_same_kernels() {
        for (panel, point, place) in places() {
            let straight = Straight::new(panel);
            let polar = Polar::new(&[point], &panel);
            let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-14, "{panel:?} {point:?}: {a} {b}");
            let surface = polar.seen_of_surface(0, [0, 1], &straight);
            let sight = surface.sight(straight.local(point), straight.length, place);
            let (own, other) = (sight.stream(), stream_influence(panel, point, place));
            close(own.vortex[0], other.vortex[0]);
            close(own.vortex[1], other.vortex[1]);
            close(own.source, other.source);
            let velocity = sight.velocity();
            let other = velocity_influence(panel, point, place);
            for end in 0..2 {
                let (source, vortex) = (straight.outer(velocity.source(end)), straight.outer(velocity.vortex(end)));
                for c in 0..2 {
                    close(source[c], other.source[end][c]);
                    close(vortex[c], other.vortex[end][c]);
                }
            }
            if place == Place::End {
                continue; // on the cut of the wake's panels; no node of a section stands there
            }
            let wake =
                polar.pairs_of([0, 1]).of_wake(0, &straight).sight(straight.local(point), straight.length, place);
            let (own, other) = (wake.wake_stream(), wake_source_stream(panel, point, place));
            close(own[0], other[0]);
            close(own[1], other[1]);
        }
    }

    #[test]
    fn derivatives_are_those_of_the_kernels() {
        for (panel, point, place) in places().into_iter().filter(|p| p.2 == Place::Elsewhere) {
            let straight = Straight::new(panel);
            let [x, z] = straight.local(point);
            let variable = |v: f64, k: usize| Tangent::<3>::from_re(v).derivative(k);
            let (at, length) = ([variable(x, 0), variable(z, 1)], variable(straight.length, 2));
            let zero = Tangent::from_re(0.0);
            let other = stream_influence([[zero; 2], [length, zero]], at, place);
            let seen = Polar::new(&[point], &panel).seen_of_surface(0, [0, 1], &straight);
            let own = seen.sight(at, length, place).stream();
            for (a, b) in [(own.source, other.source), (own.vortex[0], other.vortex[0])] {
                assert!((0..3).all(|k| (a.eps[k] - b.eps[k]).abs() < 1e-13), "{a} {b}");
            }
        }
    }

    #[test]
    fn points_can_be_joined() {
        let (points, vertices) = ([[0.0, 0.0], [1.0, 0.2], [0.5, -0.3], [2.0, 1.0]], [[0.1, 0.3], [0.7, -0.4]]);
        let first = Polar::new(&points[..2], &vertices);
        let joined = first.followed_by(&Polar::new(&points[1..], &vertices), 1);
        let whole = Polar::new(&points, &vertices);
        assert_eq!((joined.points, joined.log, joined.angle), (whole.points, whole.log, whole.angle));
    }

    #[test]
    fn pairs_are_symmetric() {
        let points = [[0.0, 0.0], [1.0, 0.2], [0.5, -0.3]];
        let (half, whole) = (Polar::among(&points), Polar::new(&points, &points));
        let back = whole.reversed(1);
        for q in (0..9).filter(|q| q % 4 != 0) {
            for other in [&half, &back] {
                assert!((other.log[q] - whole.log[q]).abs() < 1e-15);
                assert!((other.angle[q] - whole.angle[q]).abs() < 1e-15);
            }
        }
    }
}
