//! Derivatives of sums over panels and points, collected panel by panel.
//!
//! A kernel sees a point in the frame of a panel: two coordinates and the length. With its derivatives to those three
//! (dual numbers of width three) the derivatives to the ends of the panel need only sums over the points, which are
//! turned into the outer frame once a panel.

use super::{Collected, Each, OUTPUTS};
use crate::flow::coupled::duals::{Dual3, Dual4, gradient};
use crate::flow::panel::kernel::Place;
use crate::flow::panel::polar::Straight;
use num_dual::DualNum;
use pulp::{NullaryFnOnce, Simd, WithSimd};

/// The variables of a panel seen from a point.
#[inline(always)]
pub(super) fn variables(panel: &Straight, point: [f64; 2]) -> ([Dual3; 2], Dual3) {
    let [x, z] = panel.local(point);
    let at = [Dual3::from_re(x).derivative(0), Dual3::from_re(z).derivative(1)];
    (at, Dual3::from_re(panel.length).derivative(2))
}

/// One entry an output.
type Lanes = [f64; OUTPUTS];

/// Points that see a panel, with their weights.
pub(super) struct Points {
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub weights: Vec<Lanes>,
    /// The same, output by output.
    by_output: Each<Vec<f64>>,
}

impl Points {
    pub fn new(points: &[[f64; 2]], weight: impl Fn(usize, usize) -> f64) -> Self {
        Self {
            x: points.iter().map(|p| p[0]).collect(),
            y: points.iter().map(|p| p[1]).collect(),
            weights: (0..points.len()).map(|i| std::array::from_fn(|output| weight(output, i))).collect(),
            by_output: std::array::from_fn(|output| (0..points.len()).map(|i| weight(output, i)).collect()),
        }
    }

    pub fn at(&self, i: usize) -> [f64; 2] {
        [self.x[i], self.y[i]]
    }

    /// Adds to the derivatives with respect to the points, nodes of the section, what they see.
    pub fn add_weighted(&self, by_point: &[[f64; 2]], collected: &mut Collected) {
        for output in 0..OUTPUTS {
            for ((node, weights), [x, y]) in collected.nodes[output].iter_mut().zip(&self.weights).zip(by_point) {
                node[0] += weights[output] * x;
                node[1] += weights[output] * y;
            }
        }
    }
}

/// What one panel does at all points; the first three numbers are the derivatives of a quantity with respect to the
/// coordinates of the point in the frame of the panel and to the length of the panel.
pub(super) struct Slopes<const N: usize>(pub Vec<[f64; N]>);

impl<const N: usize> Slopes<N> {
    pub fn zeros(points: usize) -> Self {
        Self(vec![[0.0; N]; points])
    }

    /// Evaluates a quantity at all points: at those of `special` where `place` says they are, elsewhere at all others.
    pub fn fill(
        &mut self,
        points: &Points,
        panel: &Straight,
        quantity: &impl Quantity<N>,
        special: impl IntoIterator<Item = usize>,
        place: impl Fn(usize) -> Place,
    ) {
        fill_vectorised(&mut self.0, points, panel, quantity);
        for i in special {
            let (at, length) = variables(panel, points.at(i));
            self.0[i] = quantity.at(i, at, length, place(i));
        }
    }

    /// Adds the slopes in the outer frame to those of every point.
    pub fn add_outer(&self, panel: &Straight, by_point: &mut [[f64; 2]]) {
        for (sum, slopes) in by_point.iter_mut().zip(&self.0) {
            let [x, y] = panel.outer([slopes[0], slopes[1]]);
            sum[0] += x;
            sum[1] += y;
        }
    }
}

/// What a panel does at a point.
pub(super) trait Quantity<const N: usize> {
    /// The same for the first `points` points only: lets a loop up to there run without checks of the index.
    fn first(&self, points: usize) -> Self;

    /// At point `i`, which has the coordinates `at` in the frame of the panel.
    fn at(&self, i: usize, at: [Dual3; 2], length: Dual3, place: Place) -> [f64; N];
}

/// The loop of [`Slopes::fill`], compiled for the vectors the processor has.
struct Fill<'a, const N: usize, Q> {
    slopes: &'a mut [[f64; N]],
    points: &'a Points,
    panel: &'a Straight,
    quantity: &'a Q,
}

impl<const N: usize, Q: Quantity<N>> NullaryFnOnce for Fill<'_, N, Q> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        fill(self.slopes, self.points, self.panel, self.quantity);
    }
}

/// Never inlined, so that the compiler knows that what it writes to is nothing it reads.
#[inline(never)]
fn fill_vectorised<const N: usize, Q: Quantity<N>>(
    slopes: &mut [[f64; N]],
    points: &Points,
    panel: &Straight,
    quantity: &Q,
) {
    pulp::Arch::new().dispatch(Fill { slopes, points, panel, quantity });
}

#[inline(always)]
fn fill<const N: usize, Q: Quantity<N>>(slopes: &mut [[f64; N]], points: &Points, panel: &Straight, quantity: &Q) {
    let n = slopes.len();
    let (x, y, quantity) = (&points.x[..n], &points.y[..n], quantity.first(n));
    for i in 0..n {
        let (at, length) = variables(panel, [x[i], y[i]]);
        slopes[i] = quantity.at(i, at, length, Place::Elsewhere);
    }
}

/// Numbers that a panel's sums consist of.
const SUMS: usize = 5;

/// Sums over the points, panel after panel.
pub(super) struct Table {
    /// What stands in the sums of the panel under way, point by point.
    terms: [Vec<f64>; SUMS],
    panels: Vec<PanelSums>,
}

impl Table {
    pub fn new(points: usize) -> Self {
        Self { terms: std::array::from_fn(|_| vec![0.0; points]), panels: Vec::new() }
    }

    /// Adds the next panel: its slopes, and coefficients of the unit vector along it, point by point, beyond those that
    /// follow from the slopes.
    pub fn enter<const N: usize>(
        &mut self,
        panel: &Straight,
        points: &Points,
        slopes: &Slopes<N>,
        beyond: impl Fn(usize) -> [f64; 2],
    ) {
        let n = slopes.0.len();
        let [along, across, turn_x, turn_y, stretch] = self.terms.each_mut().map(|terms| &mut terms[..n]);
        for (i, slopes) in slopes.0.iter().enumerate() {
            (along[i], across[i], stretch[i]) = (slopes[0], slopes[1], slopes[2]);
            let [x, y] = turned(panel, points.at(i), slopes[0], slopes[1]);
            let [more_x, more_y] = beyond(i);
            (turn_x[i], turn_y[i]) = (x + more_x, y + more_y);
        }
        let terms = self.terms.each_ref().map(Vec::as_slice);
        let weights = points.by_output.each_ref().map(Vec::as_slice);
        let [along, across, x, y, stretch] = pulp::Arch::new().dispatch(Weighted { terms, weights });
        self.panels.push(PanelSums { shift: [along, across], turn: [x, y], stretch });
    }

    /// The sums of all panels.
    pub fn sums(self) -> Vec<PanelSums> {
        self.panels
    }
}

/// Sums of terms times weights, for every kind of term and every output; a product of two narrow matrices, for which
/// blocks are too wide.
struct Weighted<'a> {
    terms: [&'a [f64]; SUMS],
    weights: [&'a [f64]; OUTPUTS],
}

impl WithSimd for Weighted<'_> {
    type Output = [Lanes; SUMS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut sums = [[0.0; OUTPUTS]; SUMS];
        let terms = self.terms.map(S::as_simd_f64s);
        for (output, weights) in self.weights.into_iter().enumerate() {
            let (weights, rest) = S::as_simd_f64s(weights);
            let vectors = terms.map(|(vectors, _)| &vectors[..weights.len()]);
            let mut many = [simd.splat_f64s(0.0); SUMS];
            for (i, weight) in weights.iter().enumerate() {
                for k in 0..SUMS {
                    many[k] = simd.mul_add_e_f64s(vectors[k][i], *weight, many[k]);
                }
            }
            for k in 0..SUMS {
                let few: f64 = terms[k].1.iter().zip(rest).map(|(term, weight)| term * weight).sum();
                sums[k][output] = simd.reduce_sum_f64s(many[k]) + few;
            }
        }
        sums
    }
}

/// Coefficients of the unit vector along the panel in the coordinates of a point, times the slopes with respect to those.
#[inline(always)]
fn turned(panel: &Straight, point: [f64; 2], by_x: f64, by_z: f64) -> [f64; 2] {
    let (px, py) = (point[0] - panel.start[0], point[1] - panel.start[1]);
    [by_x * px + by_z * py, by_x * py - by_z * px]
}

/// Sums over points of what depends on one panel, all outputs.
#[derive(Debug, Clone, Default)]
pub(super) struct PanelSums {
    /// Derivatives with respect to the coordinates of the points.
    shift: [Lanes; 2],
    /// Coefficients of the unit vector along the panel.
    turn: [Lanes; 2],
    /// Coefficients of the length.
    stretch: Lanes,
}

impl PanelSums {
    /// Adds the derivatives with respect to both ends of the panel, which are `ends` and have the numbers `at` among the
    /// points of `targets`.
    pub fn scatter(&self, ends: [[f64; 2]; 2], at: [usize; 2], targets: &mut Each<Vec<[f64; 2]>>) {
        let unit = |end: usize, c: usize| Dual4::from_re(ends[end][c]).derivative(2 * end + c);
        let (dx, dy) = (unit(1, 0) - unit(0, 0), unit(1, 1) - unit(0, 1));
        let length = (dx * dx + dy * dy).sqrt();
        let [tx, ty] = [dx / length, dy / length];
        for (output, targets) in targets.iter_mut().enumerate() {
            let value = tx * self.turn[0][output] + ty * self.turn[1][output] + length * self.stretch[output];
            let mut g = gradient(&value);
            // a shift of the start is one of all points the other way
            let [along, across] = [self.shift[0][output], self.shift[1][output]];
            g[0] -= along * tx.re - across * ty.re;
            g[1] -= along * ty.re + across * tx.re;
            for c in 0..2 {
                targets[at[0]][c] += g[c];
                targets[at[1]][c] += g[2 + c];
            }
        }
    }
}

/// Adds the derivatives with respect to the ends of consecutive panels.
pub(super) fn scatter_ends(sums: &[PanelSums], ends: &[[f64; 2]], targets: &mut Each<Vec<[f64; 2]>>) {
    for (j, sums) in sums.iter().enumerate() {
        sums.scatter([ends[j], ends[j + 1]], [j, j + 1], targets);
    }
}
