//! Finding the parameters of a point in a box: bracketed Newton per point.
//!
//! Each cell of the box is one polynomial patch. Newton's method runs on the polynomial of a cell, which continues
//! smoothly beyond it, so that it cannot hop between cells (as it does on linear boxes). Cells, and after a failure
//! parts of cells, are discarded when the point lies outside of the bounding box of their Bézier control points; what
//! is left is halved until Newton converges inside its bracket, or until the work is out of all proportion.
//!
//! All of this runs in coordinates of its own, in which the box is about as large as one and near the origin, whatever
//! its size and place: nothing overflows, and a margin means as much along the short side of a box as along the long
//! one.

use super::{BoxEvaluator, FfdBox, FfdError};
use crate::spline::{blossom, for_each_index, halve};
use nalgebra::{SMatrix, SVector};
use std::iter::repeat_n;

/// Newton steps tried from one starting point.
const STEPS: usize = 16;
/// Halvings of a cell before giving up; 2⁻⁵⁰ of a cell is round-off.
const DEPTH: usize = 50;
/// Parts of cells looked at before giving up. A point needs some hundreds where the box is nearly singular; without
/// this bound a box that is singular along a line would be halved without end.
const PARTS: usize = 20_000;
/// Residual, relative to the size of the box along each axis, at which a point counts as inside.
const TOLERANCE: f64 = 1e-14;
/// Round-off of the coordinates of points and box, relative to the largest of them.
const ROUND_OFF: f64 = 4.0 * f64::EPSILON;
/// How far beyond its cell, in cells, Newton may end: a point on a boundary may fall on either side.
const MARGIN: f64 = 1e-9;

/// A knot span that is not empty: index, start and end.
type Span = (usize, f64, f64);

/// A box prepared for finding the parameters of points.
pub(super) struct Inversion<const D: usize> {
    /// The box in coordinates of its own.
    lattice: FfdBox<f64, D>,
    evaluator: BoxEvaluator<f64, D>,
    cells: Vec<Patch<D>>,
    origin: [f64; D],
    /// Powers of two, so that nothing is rounded.
    unit: [f64; D],
    /// Residual along each axis at which a point counts as inside.
    margin: [f64; D],
}

/// The outcome of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Found<const D: usize> {
    /// The parameters of the point, to round-off.
    Inside([f64; D]),
    /// The point is not in the box.
    Outside,
    /// The search has been given up.
    Lost,
}

/// A cell, or part of one, by its Bézier control points.
#[derive(Clone)]
struct Patch<const D: usize> {
    cell: [usize; D],
    /// Bracket in local coordinates of the cell.
    low: [f64; D],
    high: [f64; D],
    /// Bézier control points, first direction fastest.
    net: Vec<[f64; D]>,
    bounds: ([f64; D], [f64; D]),
}

impl<const D: usize> Inversion<D> {
    /// Divides the box into the patches in which points are searched, once for all points.
    ///
    /// # Errors
    /// The errors of evaluating the box; a box that has been built gives none.
    pub fn new(lattice: &FfdBox<f64, D>) -> Result<Self, FfdError> {
        let (low, high) = bounds(lattice.control_points());
        let size: [f64; D] = std::array::from_fn(|d| high[d] - low[d]);
        let reach: [f64; D] = std::array::from_fn(|d| low[d].abs().max(high[d].abs()));
        let unit = size.map(|size| size.log2().floor().exp2());
        // a box about the origin stays where it is, so that nothing is rounded there
        let origin: [f64; D] = std::array::from_fn(|d| if reach[d] > 8.0 * size[d] { low[d] } else { 0.0 });
        let margin = std::array::from_fn(|d| (TOLERANCE * size[d] + ROUND_OFF * reach[d]) / unit[d]);
        let own = |p: &[f64; D]| std::array::from_fn(|d| (p[d] - origin[d]) / unit[d]);
        let lattice: FfdBox<f64, D> =
            lattice.with_control_points(lattice.control_points().iter().map(own).collect::<Vec<[f64; D]>>())?;
        let evaluator = BoxEvaluator::new(&lattice);
        let spans: [Vec<Span>; D] = std::array::from_fn(|k| lattice.spline().axes()[k].spans().collect());
        let counts: [usize; D] = std::array::from_fn(|k| spans[k].len());
        let cells = (0..counts.iter().product())
            .map(|index| {
                let cell = FfdBox::<f64, D>::unravel(counts, index);
                let net = bezier_net(&lattice, std::array::from_fn(|k| spans[k][cell[k]]));
                Patch::new(cell, net, [-0.5; D], [0.5; D])
            })
            .collect();
        Ok(Self { lattice, evaluator, cells, origin, unit, margin })
    }

    /// Looks for the parameters of a point.
    pub fn solve(&self, point: [f64; D]) -> Found<D> {
        let point = std::array::from_fn(|d| (point[d] - self.origin[d]) / self.unit[d]);
        let degrees = self.lattice.degrees();
        let mut waiting = Vec::new();
        for patch in self.cells.iter().filter(|p| p.may_contain(point, self.margin)) {
            match self.newton(patch, point) {
                Some(u) => return Found::Inside(u),
                None => waiting.push((patch.clone(), 0)),
            }
        }
        let mut parts = 0;
        while let Some((patch, depth)) = waiting.pop() {
            if depth >= DEPTH {
                continue;
            }
            for half in patch.halves(degrees) {
                if half.may_contain(point, self.margin) {
                    if let Some(u) = self.newton(&half, point) {
                        return Found::Inside(u);
                    }
                    waiting.push((half, depth + 1));
                }
            }
            parts += 1;
            if parts > PARTS {
                return Found::Lost;
            }
        }
        Found::Outside
    }

    /// Newton on the polynomial of the patch's cell, from the middle of the bracket.
    fn newton(&self, patch: &Patch<D>, point: [f64; D]) -> Option<[f64; D]> {
        let mut s: [f64; D] = std::array::from_fn(|k| 0.5 * (patch.low[k] + patch.high[k]));
        let reach: [f64; D] = std::array::from_fn(|k| 0.5 * (patch.high[k] - patch.low[k]));
        let mut last_step = f64::INFINITY;
        for _ in 0..STEPS {
            let (value, jacobian) = self.evaluator.cell_point_and_jacobian(patch.cell, s);
            let step = newton_step(jacobian, std::array::from_fn(|d| value[d] - point[d]))?;
            let mut size = 0.0f64;
            for k in 0..D {
                s[k] -= step[k];
                size = size.max(step[k].abs());
                // the bracket: no further than half a patch beyond it
                s[k] = s[k].clamp(patch.low[k] - reach[k], patch.high[k] + reach[k]);
            }
            // quadratic convergence: a step this small means the next is round-off
            if size < 1e-9 || (size < 1e-6 && size >= last_step) {
                return self.accept(patch, point, s);
            }
            last_step = size;
        }
        None
    }

    /// Checks the bracket, puts the parameters into [0, 1] and polishes them on the B-spline itself.
    fn accept(&self, patch: &Patch<D>, point: [f64; D], s: [f64; D]) -> Option<[f64; D]> {
        if s.iter().any(|s| s.abs() > 0.5 + MARGIN) {
            return None;
        }
        let mut best = self.evaluator.parameters(patch.cell, s).map(|u| u.clamp(0.0, 1.0));
        let mut smallest = f64::INFINITY;
        let mut u = best;
        for _ in 0..4 {
            let (value, jacobian) = self.lattice.spline().point_and_jacobian(u);
            let residual: [f64; D] = std::array::from_fn(|d| value[d] - point[d]);
            let size = (0..D).fold(0.0, |m: f64, d| m.max(residual[d].abs() / self.margin[d]));
            // written so that NaN ends it
            if !(size < smallest) {
                break;
            }
            (best, smallest) = (u, size);
            let Some(step) = newton_step(jacobian, residual) else { break };
            u = std::array::from_fn(|k| (u[k] - step[k]).clamp(0.0, 1.0));
        }
        (smallest <= 1.0).then_some(best)
    }
}

impl<const D: usize> Patch<D> {
    fn new(cell: [usize; D], net: Vec<[f64; D]>, low: [f64; D], high: [f64; D]) -> Self {
        let bounds = bounds(&net);
        Self { cell, low, high, net, bounds }
    }

    /// Convex hull property: a point outside of the bounding box of the net is not in the patch.
    fn may_contain(&self, point: [f64; D], margin: [f64; D]) -> bool {
        (0..D).all(|d| self.bounds.0[d] - margin[d] <= point[d] && point[d] <= self.bounds.1[d] + margin[d])
    }

    /// The patch cut in two across its longest side in parameters (de Casteljau).
    fn halves(&self, degrees: [usize; D]) -> [Self; 2] {
        let axis = (0..D).fold(
            0,
            |best, k| {
                if self.high[k] - self.low[k] > self.high[best] - self.low[best] { k } else { best }
            },
        );
        let orders = degrees.map(|p| p + 1);
        let stride: usize = orders[..axis].iter().product();
        let (mut left, mut right) = (self.net.clone(), self.net.clone());
        for start in (0..self.net.len()).filter(|i| (i / stride).is_multiple_of(orders[axis])) {
            let mut line: Vec<[f64; D]> = (0..orders[axis]).map(|j| self.net[start + j * stride]).collect();
            let rest = halve(&mut line, |a, b| std::array::from_fn(|d| 0.5 * (a[d] + b[d])));
            for j in 0..orders[axis] {
                (left[start + j * stride], right[start + j * stride]) = (line[j], rest[j]);
            }
        }
        let middle = 0.5 * (self.low[axis] + self.high[axis]);
        let (mut high, mut low) = (self.high, self.low);
        high[axis] = middle;
        low[axis] = middle;
        [Self::new(self.cell, left, self.low, high), Self::new(self.cell, right, low, self.high)]
    }
}

fn bounds<const D: usize>(points: &[[f64; D]]) -> ([f64; D], [f64; D]) {
    let mut low = [f64::INFINITY; D];
    let mut high = [f64::NEG_INFINITY; D];
    for point in points {
        for d in 0..D {
            low[d] = low[d].min(point[d]);
            high[d] = high[d].max(point[d]);
        }
    }
    (low, high)
}

/// The step of Newton's method, where there is one.
fn newton_step<const D: usize>(jacobian: [[f64; D]; D], residual: [f64; D]) -> Option<[f64; D]> {
    let step = SMatrix::<f64, D, D>::from(jacobian).try_inverse()? * SVector::from(residual);
    step.iter().all(|v| v.is_finite()).then_some(step.into())
}

/// Bézier control points of one cell: the blossom of the B-spline at the ends of the cell, direction by direction.
fn bezier_net<const D: usize>(lattice: &FfdBox<f64, D>, spans: [Span; D]) -> Vec<[f64; D]> {
    let axes = lattice.spline().axes();
    let mut net = Vec::new();
    for_each_index(axes, std::array::from_fn(|k| spans[k].0), |index, _| {
        net.push(lattice.control_points()[index]);
    });
    let orders: [usize; D] = std::array::from_fn(|k| axes[k].degree() + 1);
    for k in 0..D {
        let stride: usize = orders[..k].iter().product();
        let (span, first, last) = spans[k];
        let rows: Vec<_> = (0..orders[k])
            .map(|ends| blossom(&axes[k], span, repeat_n(last, ends).chain(repeat_n(first, orders[k] - 1 - ends))))
            .collect();
        for start in (0..net.len()).filter(|i| (i / stride).is_multiple_of(orders[k])) {
            let line: Vec<[f64; D]> = (0..orders[k]).map(|j| net[start + j * stride]).collect();
            for (ends, weights) in rows.iter().enumerate() {
                net[start + ends * stride] =
                    std::array::from_fn(|d| line.iter().zip(weights).map(|(point, weight)| point[d] * weight).sum());
            }
        }
    }
    net
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ffd::Placement;
    use proptest::prelude::*;

    /// Undeformed boxes: rectangular, and skewed with bulged sides.
    fn any_box(p: usize, q: usize, extra: (usize, usize), placement: Placement, bend: f64) -> FfdBox<f64> {
        let (counts, degrees) = ([p + 1 + extra.0, q + 1 + extra.1], [p, q]);
        let corners = [[-0.1, -0.2], [1.1, -0.1 - bend], [-0.1 + bend, 0.2], [1.2, 0.15 + bend]];
        if bend == 0.0 {
            return FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], counts, degrees, placement).unwrap();
        }
        let straight = FfdBox::from_corners(&corners, counts, degrees, placement).unwrap();
        let bulged = straight
            .control_points()
            .iter()
            .map(|x| [x[0] + 0.2 * bend * (7.0 * x[1]).sin(), x[1] + 0.3 * bend * (5.0 * x[0]).sin()]);
        FfdBox::from_control_points(bulged.collect(), counts, degrees).unwrap()
    }

    #[test]
    fn bezier_nets_reproduce_the_cells() {
        let lattice = any_box(3, 2, (3, 2), Placement::Even, 0.2);
        let inversion = Inversion::new(&lattice).unwrap();
        for patch in &inversion.cells {
            // corners of the Bézier net are points of the box
            let at = |s: [f64; 2]| inversion.lattice.evaluate(inversion.evaluator.parameters(patch.cell, s));
            let n = patch.net.len();
            for (net, s) in [(0, [-0.5, -0.5]), (3, [0.5, -0.5]), (n - 4, [-0.5, 0.5]), (n - 1, [0.5, 0.5])] {
                let x = at(s);
                assert!((x[0] - patch.net[net][0]).abs() < 1e-14 && (x[1] - patch.net[net][1]).abs() < 1e-14);
            }
            let halves = patch.halves(lattice.degrees());
            assert_eq!(halves[0].net[3], halves[1].net[0]);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(512))]
        #[test]
        fn finds_interior_and_face_points(
            p in 1usize..=5, q in 1usize..=5, extra in (0usize..4, 0usize..4), greville: bool,
            bend in prop::sample::select(vec![0.0, 0.05, 0.15]), u in -0.1f64..=1.1, v in -0.1f64..=1.1,
        ) {
            let lattice = any_box(p, q, extra, if greville { Placement::Greville } else { Placement::Even }, bend);
            // a good share of the points on faces and corners
            let x = lattice.evaluate([u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)]);
            let inversion = Inversion::new(&lattice).unwrap();
            let Found::Inside(found) = inversion.solve(x) else { panic!("{x:?} not found") };
            let back = lattice.evaluate(found);
            prop_assert!((back[0] - x[0]).abs() <= 1e-14 && (back[1] - x[1]).abs() <= 1e-14);
        }

        #[test]
        fn outside_is_outside(p in 1usize..=5, extra in 0usize..4, angle in 0.0..std::f64::consts::TAU) {
            let lattice = any_box(p, p, (extra, extra), Placement::Even, 0.0);
            let x = [0.5 + 2.0 * angle.cos(), 2.0 * angle.sin()];
            prop_assert_eq!(Inversion::new(&lattice).unwrap().solve(x), Found::Outside);
            prop_assert_eq!(Inversion::new(&lattice).unwrap().solve([0.5, 0.15 + 1e-12]), Found::Outside);
        }
    }

    #[test]
    fn boxes_of_any_size_and_place_hold_their_faces_and_nothing_beyond() {
        let sizes = [[1e-9, 3e-9], [1.0, 1.0], [1e12, 1e12], [1e12, 0.3], [1e-6, 1e60], [1e90, 1e-40]];
        for (size, place) in sizes.into_iter().flat_map(|size| [0.0, -0.5, 1e3, -1e6, 1e9].map(|place| (size, place))) {
            // each axis at its own distance from the origin
            let range = |d: usize| [place * size[d], place * size[d] + size[d]];
            for (count, degree) in [(2, 1), (4, 3), (7, 3)] {
                let (counts, degrees) = ([count; 2], [degree; 2]);
                let lattice = FfdBox::rectangular([range(0), range(1)], counts, degrees, Placement::Even).unwrap();
                let inversion = Inversion::new(&lattice).unwrap();
                for (s, t) in [(0.0, 0.0), (0.0, 0.3), (0.7, 1.0), (1.0, 1.0), (0.2, 0.9), (1.0, 0.5)] {
                    let within = |d: usize, t: f64| {
                        let [first, last] = range(d);
                        if t == 1.0 { last } else { first + (last - first) * t }
                    };
                    let x = [within(0, s), within(1, t)];
                    let Found::Inside(u) = inversion.solve(x) else { panic!("{x:?} in {:?}", [range(0), range(1)]) };
                    let back = lattice.evaluate(u);
                    for d in 0..2 {
                        let most = 1e-14 * size[d] + 8.0 * f64::EPSILON * range(d)[0].abs().max(range(d)[1].abs());
                        assert!((back[d] - x[d]).abs() <= most, "{x:?} {back:?}");
                    }
                }
                let beyond = |d: usize| range(d)[1] + size[d] * (1e-12 + 64.0 * f64::EPSILON * place.abs());
                assert_eq!(inversion.solve([range(0)[0], beyond(1)]), Found::Outside, "{size:?} {place}");
                assert_eq!(inversion.solve([beyond(0), range(1)[0]]), Found::Outside, "{size:?} {place}");
                assert_eq!(inversion.solve([f64::NAN, range(1)[0]]), Found::Outside);
                assert_eq!(inversion.solve([f64::INFINITY, range(1)[0]]), Found::Outside);
            }
        }
    }

    #[test]
    fn a_box_that_is_flat_to_round_off_ends_the_search() {
        // rows that differ by less than a margin: every part of the box may hold the points about it
        let flat = |k: usize| [(k % 4) as f64 / 3.0, 1e-16 * (k / 4) as f64 + 0.1 * ((k % 4) as f64).sin()];
        let lattice = FfdBox::from_control_points((0..16).map(flat).collect::<Vec<_>>(), [4, 4], [3, 3]).unwrap();
        let inversion = Inversion::new(&lattice).unwrap();
        let on = lattice.evaluate([0.4, 0.5]);
        let begin = std::time::Instant::now();
        for k in -40..=40 {
            let found = inversion.solve([on[0], on[1] + 1e-16 * k as f64]);
            let far = |u: [f64; 2]| (lattice.evaluate(u)[1] - on[1] - 1e-16 * k as f64).abs() > 2e-15;
            assert!(!matches!(found, Found::Inside(u) if far(u)), "{k} {found:?}");
        }
        assert!(begin.elapsed().as_secs_f64() < 20.0);
    }

    #[test]
    fn a_volume_is_inverted_too() {
        let flat =
            FfdBox::rectangular([[0.0, 1.0], [0.0, 1.0], [0.0, 1.0]], [4, 3, 3], [3, 2, 1], Placement::Even).unwrap();
        let bent = flat
            .control_points()
            .iter()
            .map(|x| [x[0] + 0.1 * x[1] * x[2], x[1] + 0.1 * x[0] * x[0], x[2] - 0.1 * x[0]]);
        let lattice = FfdBox::from_control_points(bent.collect(), [4, 3, 3], [3, 2, 1]).unwrap();
        let inversion = Inversion::new(&lattice).unwrap();
        for u in [[0.1, 0.9, 0.3], [0.0, 0.5, 1.0], [1.0, 1.0, 1.0]] {
            let x = lattice.evaluate(u);
            let Found::Inside(found) = inversion.solve(x) else { panic!("{x:?} not found") };
            let back = lattice.evaluate(found);
            assert!((0..3).all(|d| (back[d] - x[d]).abs() < 1e-14));
        }
    }
}
