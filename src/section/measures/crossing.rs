//! Does the outline cross itself?
//!
//! The curve is cut into Bézier pieces, and pairs of pieces are halved until their hulls part or both are straight to
//! round-off, so that no loop is too small or too flat to be seen. Pieces that share an end are told apart by
//! directions: legs of control polygons that all lie within a half plane cannot return to where they came from.

use crate::plane::{between, bounds, cross, dot, length, middle, minus};
use crate::section::Section;
use crate::spline::{BSplineCurve, halve};

/// A crossing of the outline with itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Smaller of the two parameters of the crossing.
    pub first: f64,
    /// Larger of the two parameters of the crossing.
    pub second: f64,
    /// Where the two branches meet.
    pub point: [f64; 2],
}

impl Section<f64> {
    /// A crossing (or touching) of the closed outline with itself, `None` where there is none. The common end point of
    /// a sharp trailing edge is no crossing. A point on the base of a blunt trailing edge has the last parameter.
    ///
    /// Loops and gaps down to about 1e-9 of the size of the section are told apart.
    pub fn self_intersection(&self) -> Option<Crossing> {
        outline_crossing(self.curve())
    }
}

/// A Bézier piece on a parameter interval.
#[derive(Debug, Clone)]
struct Piece {
    start: f64,
    end: f64,
    points: Vec<[f64; 2]>,
    /// How often it has been halved.
    depth: u32,
}

/// Halvings of a piece; beyond, it is a point even where round-off keeps its ends apart.
const DEPTH: u32 = 60;

/// How small a part of the size is not looked into any more.
const RESOLUTION: f64 = 1e-10;

/// A crossing of a curve and the straight line that closes it, if it is not closed.
pub(in crate::section) fn outline_crossing(curve: &BSplineCurve<f64>) -> Option<Crossing> {
    let control = curve.control_points();
    let (first, last) = (control[0], control[control.len() - 1]);
    let end = curve.domain().1;
    let base = (first != last).then(|| Piece { start: end, end, points: vec![last, first], depth: 0 });
    search(curve, base)
}

fn search(curve: &BSplineCurve<f64>, base: Option<Piece>) -> Option<Crossing> {
    let mut pieces: Vec<Piece> =
        curve.pieces().map(|(start, end, points)| Piece { start, end, points, depth: 0 }).collect();
    // so that no two pieces share both ends
    while pieces.len() < 4 {
        pieces = pieces.iter().flat_map(|piece| <[Piece; 2]>::from(piece.halves())).collect();
    }
    let control = curve.control_points();
    let closed = base.is_some() || control.first() == control.last();
    pieces.extend(base);
    let frame = Frame::of(control);
    pieces.iter_mut().flat_map(|piece| &mut piece.points).for_each(|point| *point = frame.own(*point));
    let search = Search { tolerance: RESOLUTION * frame.size, closed };
    let found = search.within(&pieces)?;
    Some(Crossing { point: frame.common(found.point), ..found })
}

/// Coordinates in which the curve is about as large as one and near the origin, so that no product overflows.
struct Frame {
    origin: [f64; 2],
    /// A power of two, so that nothing is rounded.
    unit: f64,
    /// Size of the curve in this frame.
    size: f64,
}

impl Frame {
    fn of(points: &[[f64; 2]]) -> Self {
        let sides = bounds(points.iter().copied());
        // halved before they are subtracted, for the same reason
        let half = sides.iter().fold(0.0f64, |half, side| half.max(0.5 * side[1] - 0.5 * side[0]));
        let unit = if half > 0.0 { half.log2().ceil().exp2().max(1e-300) } else { 1.0 };
        let far = |side: &[f64; 2]| side[0].abs().max(side[1].abs()) > 16.0 * half;
        let origin = sides.map(|side| if far(&side) { side[0] } else { 0.0 });
        Self { origin, unit, size: half / unit * 2.0 }
    }

    fn own(&self, point: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|d| (0.5 * point[d] - 0.5 * self.origin[d]) / (0.5 * self.unit))
    }

    fn common(&self, point: [f64; 2]) -> [f64; 2] {
        std::array::from_fn(|d| point[d] * self.unit + self.origin[d])
    }
}

struct Search {
    tolerance: f64,
    closed: bool,
}

impl Search {
    /// A crossing within a chain of pieces.
    fn within(&self, pieces: &[Piece]) -> Option<Crossing> {
        let mut found = None;
        for (i, a) in pieces.iter().enumerate() {
            found = found.or_else(|| self.alone(a));
            if let Some(b) = pieces.get(i + 1) {
                found = found.or_else(|| self.neighbours(a, b));
            }
        }
        // sorted by abscissa, only pieces that overlap in it are compared
        let mut order: Vec<(usize, [[f64; 2]; 2])> =
            pieces.iter().enumerate().map(|(i, piece)| (i, piece.bounds())).collect();
        order.sort_by(|a, b| a.1[0][0].total_cmp(&b.1[0][0]));
        for (k, &(i, [x, _])) in order.iter().enumerate() {
            for &(j, [other, _]) in &order[k + 1..] {
                if found.is_some() || other[0] > x[1] {
                    break;
                }
                let (a, b) = (&pieces[i.min(j)], &pieces[i.max(j)]);
                let ends = self.closed && i.min(j) == 0 && i.max(j) + 1 == pieces.len();
                found = match i.abs_diff(j) {
                    // looked at above
                    0 | 1 => None,
                    _ if ends => self.tail(a, b),
                    _ => self.apart(a, b),
                };
            }
        }
        found
    }

    /// Whether a piece is too small to be looked into.
    fn is_point(&self, piece: &Piece) -> bool {
        piece.size() < self.tolerance || piece.depth >= DEPTH
    }

    /// A loop of one piece.
    fn alone(&self, piece: &Piece) -> Option<Crossing> {
        if within_half_plane(legs(&piece.points)) || self.is_point(piece) {
            return None;
        }
        let (a, b) = piece.halves();
        self.alone(&a).or_else(|| self.alone(&b)).or_else(|| self.neighbours(&a, &b))
    }

    /// A crossing of two pieces, the second of which starts where the first ends.
    fn neighbours(&self, a: &Piece, b: &Piece) -> Option<Crossing> {
        if within_half_plane(legs(&a.points).chain(legs(&b.points))) || (self.is_point(a) && self.is_point(b)) {
            return None;
        }
        let ((a1, a2), (b1, b2)) = (a.halves(), b.halves());
        self.apart(&a1, b).or_else(|| self.apart(&a2, &b2)).or_else(|| self.neighbours(&a2, &b1))
    }

    /// A crossing of the first and the last piece of a closed curve other than their common end.
    fn tail(&self, first: &Piece, last: &Piece) -> Option<Crossing> {
        let origin = first.points[0];
        let from = |p: &[f64; 2]| minus(*p, origin);
        let upper: Vec<_> = first.points[1..].iter().map(from).collect();
        let lower: Vec<_> = last.points[..last.points.len() - 1].iter().map(from).collect();
        let turns = || upper.iter().flat_map(|u| lower.iter().map(|l| cross(*u, *l)));
        let acute = within_half_plane(upper.iter().chain(&lower).copied());
        // two cones with their tips at the trailing edge that do not overlap
        if (acute && (turns().all(|t| t > 0.0) || turns().all(|t| t < 0.0)))
            || (self.is_point(first) && self.is_point(last))
        {
            return None;
        }
        let ((near, far), (far_last, near_last)) = (first.halves(), last.halves());
        self.apart(&far, last).or_else(|| self.apart(&near, &far_last)).or_else(|| self.tail(&near, &near_last))
    }

    /// A crossing of two pieces that share no end.
    fn apart(&self, a: &Piece, b: &Piece) -> Option<Crossing> {
        if separated(&a.points, &b.points) {
            return None;
        }
        let (sa, sb) = (a.size(), b.size());
        if self.is_point(a) && self.is_point(b) {
            return Some(meeting(a, b, [0.5, 0.5]));
        }
        // straight to round-off: the chords decide
        if a.is_straight() && b.is_straight() {
            return chords_cross(a, b).map(|at| meeting(a, b, at));
        }
        if b.depth >= DEPTH || (sa >= sb && a.depth < DEPTH) {
            let (a1, a2) = a.halves();
            self.apart(&a1, b).or_else(|| self.apart(&a2, b))
        } else {
            let (b1, b2) = b.halves();
            self.apart(a, &b1).or_else(|| self.apart(a, &b2))
        }
    }
}

impl Piece {
    fn bounds(&self) -> [[f64; 2]; 2] {
        bounds(self.points.iter().copied())
    }

    /// Largest side of the bounding box.
    fn size(&self) -> f64 {
        let [x, y] = self.bounds();
        (x[1] - x[0]).max(y[1] - y[0])
    }

    /// De Casteljau at one half.
    fn halves(&self) -> (Self, Self) {
        let mut left = self.points.clone();
        let right = halve(&mut left, middle);
        let at = 0.5 * (self.start + self.end);
        let depth = self.depth + 1;
        (
            Self { start: self.start, end: at, points: left, depth },
            Self { start: at, end: self.end, points: right, depth },
        )
    }

    /// Whether the control points deviate from the chord by no more than round-off of their coordinates.
    fn is_straight(&self) -> bool {
        let (first, last) = (self.points[0], self.points[self.points.len() - 1]);
        let along = minus(last, first);
        let most = 0.5 * round_off(&self.points) * length(along);
        self.points.iter().all(|&p| cross(along, minus(p, first)).abs() <= most)
    }
}

/// Legs of a control polygon that have a length.
fn legs(points: &[[f64; 2]]) -> impl Iterator<Item = [f64; 2]> + '_ {
    points.windows(2).map(|w| minus(w[1], w[0])).filter(|v| *v != [0.0; 2])
}

/// Whether all vectors make an acute angle with their sum of directions, so that a path of them never turns back.
fn within_half_plane(vectors: impl Iterator<Item = [f64; 2]>) -> bool {
    let unit: Vec<[f64; 2]> = vectors.map(|v| v.map(|c| c / length(v))).collect();
    let sum = unit.iter().fold([0.0; 2], |s, v| [s[0] + v[0], s[1] + v[1]]);
    unit.iter().all(|v| dot(*v, sum) > 1e-3 * length(sum))
}

/// Round-off of coordinates of this magnitude, several times over.
fn round_off(points: &[[f64; 2]]) -> f64 {
    4.0 * f64::EPSILON * points.iter().flatten().fold(0.0f64, |m, c| m.max(c.abs()))
}

/// Whether some line along or across an axis or the chord of either piece separates two hulls by more than round-off
/// (by which a crossing at the joint of two pieces may seem to miss both).
fn separated(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
    let chord = |p: &[[f64; 2]]| minus(p[p.len() - 1], p[0]);
    let (ca, cb) = (chord(a), chord(b));
    let slack = round_off(a).max(round_off(b));
    let axes = [[1.0, 0.0], [0.0, 1.0], [-ca[1], ca[0]], [-cb[1], cb[0]], ca, cb];
    axes.into_iter().any(|axis| {
        let range = |points: &[[f64; 2]]| {
            points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |r, p| {
                // relative to a common point, so that nothing cancels
                let t = dot(minus(*p, a[0]), axis);
                [r[0].min(t), r[1].max(t)]
            })
        };
        let (ra, rb) = (range(a), range(b));
        let slack = slack * (axis[0].abs() + axis[1].abs());
        ra[1] + slack < rb[0] || rb[1] + slack < ra[0]
    })
}

/// Where the chords of two pieces cross: the shares of each.
fn chords_cross(a: &Piece, b: &Piece) -> Option<[f64; 2]> {
    let (p, q) = (a.points[0], b.points[0]);
    let ends = |piece: &Piece| piece.points[piece.points.len() - 1];
    let (d, e, apart) = (minus(ends(a), p), minus(ends(b), q), minus(q, p));
    let determinant = cross(d, e);
    if determinant == 0.0 {
        // on one line, since the hulls were not separated
        return Some([0.5, 0.5]);
    }
    let at = [cross(apart, e) / determinant, cross(apart, d) / determinant];
    // round-off moves the crossing along a chord by as much more as the chords are nearly parallel
    let slack = round_off(&a.points).max(round_off(&b.points)) / determinant.abs();
    let reach = [e, d].map(|v| slack * length(v));
    let on_both = at.iter().zip(reach).all(|(t, reach)| -reach <= *t && *t <= 1.0 + reach);
    on_both.then_some(at.map(|t| t.clamp(0.0, 1.0)))
}

fn meeting(a: &Piece, b: &Piece, at: [f64; 2]) -> Crossing {
    let parameter = |piece: &Piece, t: f64| piece.start + (piece.end - piece.start) * t;
    let (u, v) = (parameter(a, at[0]), parameter(b, at[1]));
    let point = between(a.points[0], a.points[a.points.len() - 1], at[0]);
    Crossing { first: u.min(v), second: u.max(v), point }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::SectionDefinition;
    use crate::spline::KnotVector;
    use proptest::prelude::*;

    fn cubic(points: &[[f64; 2]]) -> BSplineCurve<f64> {
        BSplineCurve::new(KnotVector::clamped_uniform(3, points.len()).unwrap(), points.to_vec()).unwrap()
    }

    fn is_crossing(curve: &BSplineCurve<f64>, c: &Crossing) -> bool {
        let (a, b) = (curve.point_at(c.first), curve.point_at(c.second));
        let near = |p: [f64; 2]| (p[0] - c.point[0]).hypot(p[1] - c.point[1]) < 1e-7;
        c.first < c.second && near(a) && near(b)
    }

    #[test]
    fn sections_do_not_cross() {
        for text in [
            "naca0012:sharp",
            "naca0001:sharp",
            "naca8416:sharp",
            "naca2412",
            "naca23112",
            "kulfan:upper=0.2,0.3,0.01/lower=-0.1,0.1,0.01/class=0.5,2.0",
            "kulfan:upper=0.1/lower=-0.1/class=0.5,3.0",
        ] {
            let section = SectionDefinition::parse(text).unwrap().section().unwrap();
            assert_eq!(section.self_intersection(), None, "{text}");
            // turned and far away, too
            let moved = section
                .curve()
                .control_points()
                .iter()
                .map(|p| [30.0 - 0.6 * p[0] - 0.8 * p[1], 0.8 * p[0] - 0.6 * p[1]]);
            let moved = section.with_control_points(moved.collect()).unwrap();
            assert_eq!(moved.self_intersection(), None, "{text}");
        }
    }

    #[test]
    fn a_fish_tail_is_found() {
        // the surfaces change places before they meet
        let definition = SectionDefinition::parse("kulfan:upper=0.2,0.2,-0.01/lower=-0.2,-0.2,0.01").unwrap();
        let section = definition.section().unwrap();
        let crossing = section.self_intersection().unwrap();
        assert!(is_crossing(section.curve(), &crossing), "{crossing:?}");
        // 0.2 ((1 − x)² + 2 x (1 − x)) = 0.01 x²
        assert!((crossing.point[0] - (0.2f64 / 0.21).sqrt()).abs() < 1e-6 && crossing.point[1].abs() < 1e-12);
    }

    #[test]
    fn size_and_place_do_not_matter() {
        let fish = SectionDefinition::parse("kulfan:upper=0.2,0.2,-0.01/lower=-0.2,-0.2,0.01").unwrap();
        let sound = SectionDefinition::parse("naca2412:sharp").unwrap();
        for (definition, crosses) in [(fish, true), (sound, false)] {
            let section = definition.section().unwrap();
            for (size, place) in [(1e307, 0.0), (1e160, -2.0), (1e-200, 1.0), (1e3, 1e5), (1.0, -1e9)] {
                let moved = section.curve().control_points().iter().map(|p| p.map(|c| size * (c + place)));
                let found = section.with_control_points(moved.collect()).unwrap().self_intersection();
                assert_eq!(found.is_some(), crosses, "{size} {place}");
                if let Some(crossing) = found {
                    let at = crossing.point[0] / size - place;
                    let most = 1e-6 + 100.0 * f64::EPSILON * f64::abs(place);
                    assert!((at - (0.2f64 / 0.21).sqrt()).abs() < most, "{size} {place} {crossing:?}");
                }
            }
        }
    }

    #[test]
    fn a_base_through_the_curve_is_found() {
        // the lower surface ends in front of a bulge of the upper one
        let points = [[1.0, 0.3], [0.6, -0.1], [0.2, 0.3], [0.0, 0.0], [0.2, -0.2], [0.5, -0.2], [0.6, -0.1]];
        let knots = KnotVector::clamped_uniform(1, points.len()).unwrap();
        let wavy = |end: [f64; 2]| {
            let mut points = points.to_vec();
            points[6] = end;
            BSplineCurve::new(knots.clone(), points).unwrap()
        };
        assert_eq!(outline_crossing(&wavy([1.0, -0.3])), None);
        let crossing = outline_crossing(&wavy([0.3, -0.1])).unwrap();
        assert_eq!(crossing.second, 1.0);
        assert!(search(&wavy([0.3, -0.1]), None).is_none());
    }

    #[test]
    fn loops_of_all_sizes_are_found() {
        // x = t³ − a² t, y = t² crosses itself at t = ±a, at (0, a²)
        for a in [0.5, 1e-1, 1e-2, 1e-3, 1e-4] {
            let a2 = a * a;
            // Bézier points of the cubic on [−1, 1]
            let curve =
                cubic(&[[a2 - 1.0, 1.0], [1.0 + a2 / 3.0, -1.0 / 3.0], [-1.0 - a2 / 3.0, -1.0 / 3.0], [1.0 - a2, 1.0]]);
            let crossing = search(&curve, None).unwrap();
            assert!(crossing.point[0].abs() < 1e-9 && (crossing.point[1] - a2).abs() < 1e-9, "{a} {crossing:?}");
            assert!((crossing.first - 0.5 * (1.0 - a)).abs() < 1e-5 * (1.0 + 1e-5 / a), "{a} {crossing:?}");
        }
        // without a loop, and at the cusp between
        for a2 in [-1e-6, -1e-2, -1.0] {
            let curve =
                cubic(&[[a2 - 1.0, 1.0], [1.0 + a2 / 3.0, -1.0 / 3.0], [-1.0 - a2 / 3.0, -1.0 / 3.0], [1.0 - a2, 1.0]]);
            assert_eq!(search(&curve, None), None, "{a2}");
        }
    }

    #[test]
    fn near_tangential_branches_are_told_apart() {
        // a valley over a line: the gap (or overlap) at its middle is d
        for (d, crosses) in [(1e-3, false), (1e-7, false), (-1e-7, true), (-1e-3, true)] {
            let valley = cubic(&[[0.0, 1.0], [0.3, 0.5], [0.5, 0.25 + d], [0.7, 0.5], [1.0, 1.0]]);
            let bottom = valley.point_at(0.5)[1] - d;
            let knots = KnotVector::clamped(1, 0.0, 1.0, [0.5]).unwrap();
            let line = BSplineCurve::new(knots, vec![[1.5, bottom], [0.5, bottom], [-0.5, bottom]]).unwrap();
            // both as pieces of one search
            let piece = |c: &BSplineCurve<f64>| -> Vec<Piece> {
                c.to_bezier()
                    .unwrap()
                    .iter()
                    .map(|p| Piece {
                        start: p.domain().0,
                        end: p.domain().1,
                        points: p.control_points().to_vec(),
                        depth: 0,
                    })
                    .collect()
            };
            let search = Search { tolerance: 1e-10, closed: false };
            let found = piece(&valley).iter().any(|a| piece(&line).iter().any(|b| search.apart(a, b).is_some()));
            assert_eq!(found, crosses, "{d}");
        }
    }

    #[test]
    fn a_crossing_at_the_joint_of_two_pieces_is_found() {
        // halving meets the crossing of a symmetric curve exactly
        let curve =
            cubic(&[[0.0, 0.0], [1.0, 1.0], [2.0, 3.0], [0.0, 5.0], [-2.0, 3.0], [-1.0, 1.0], [0.0, 0.0], [1.0, -1.0]]);
        assert!(is_crossing(&curve, &search(&curve, None).unwrap()));
    }

    proptest! {
        #[test]
        fn agrees_with_a_fine_polygon(
            points in proptest::collection::vec([0.0f64..1.0, 0.0f64..1.0], 4..9),
        ) {
            let curve = cubic(&points);
            let n = 400;
            let polygon = |from: f64, to: f64| -> Vec<[f64; 2]> {
                (0..=n).map(|i| curve.point_at(from + (to - from) * f64::from(i) / f64::from(n))).collect()
            };
            let cross = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
            let edges_cross = |e: &[[f64; 2]], f: &[[f64; 2]]| {
                let (a, b, c, d) = (e[0], e[1], f[0], f[1]);
                cross(a, b, c) * cross(a, b, d) < 0.0 && cross(c, d, a) * cross(c, d, b) < 0.0
            };
            let fine = polygon(0.0, 1.0);
            let mut polygon_crosses = false;
            for (i, e) in fine.windows(2).enumerate() {
                for (j, f) in fine.windows(2).enumerate().skip(i + 2) {
                    if edges_cross(e, f) {
                        // the edges may, where the arcs just pass each other: look closer
                        let arc = |k: usize| polygon(k as f64 / f64::from(n), (k + 1) as f64 / f64::from(n));
                        let (e, f) = (arc(i), arc(j));
                        polygon_crosses |= e.windows(2).any(|e| f.windows(2).any(|f| edges_cross(e, f)));
                    }
                }
            }
            match search(&curve, None) {
                Some(crossing) => prop_assert!(is_crossing(&curve, &crossing), "{crossing:?}"),
                None => prop_assert!(!polygon_crosses),
            }
        }
    }
}
