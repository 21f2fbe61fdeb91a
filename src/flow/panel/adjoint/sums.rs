//! Derivatives of sums over panels and points, collected panel by panel.
//!
//! A kernel sees a point in the frame of a panel: two coordinates and the length of the panel. The derivatives with
//! respect to those three numbers come from dual numbers of width three. From them the derivatives with respect to the
//! ends of the panel need only sums over the points, which are turned into the outer frame once per panel.

use super::reverse::{Collected, Lanes};
use crate::flow::coefficients::{COEFFICIENTS, Coefficients};
use crate::flow::duals::{Dual3, Dual4};
use crate::flow::linear::dot;
use crate::flow::panel::kernel::Place;
use crate::flow::panel::polar::Straight;
use num_dual::DualNum;
use pulp::{NullaryFnOnce, Simd, WithSimd};
use std::ops::Range;

/// The coordinates of a point in the frame of a panel and the length of the panel, as three independent variables.
#[inline(always)]
pub(super) fn variables(panel: &Straight, point: [f64; 2]) -> ([Dual3; 2], Dual3) {
    let [x, z] = panel.local(point);
    let at = [Dual3::from_re(x).derivative(0), Dual3::from_re(z).derivative(1)];
    (at, Dual3::from_re(panel.length).derivative(2))
}

/// Points that see a panel, with one weight per coefficient and point.
pub(super) struct Points {
    /// Coordinate x of every point, in chords.
    pub x: Vec<f64>,
    /// Coordinate y of every point, in chords.
    pub y: Vec<f64>,
    /// Weights of every point, one number per coefficient.
    pub weights: Vec<Lanes>,
    /// The weights coefficient by coefficient, filled up with zeros to whole steps of points and whole groups of
    /// coefficients.
    by_coefficient: [Vec<f64>; PADDED],
}

impl Points {
    pub fn new(points: &[[f64; 2]], weight: impl Fn(usize) -> Lanes) -> Self {
        let weights: Vec<Lanes> = (0..points.len()).map(weight).collect();
        let padded = |o: usize| {
            let mut list = vec![0.0; points.len().next_multiple_of(STEP)];
            if o < COEFFICIENTS {
                list.iter_mut().zip(&weights).for_each(|(own, weights)| *own = weights[o]);
            }
            list
        };
        Self {
            x: points.iter().map(|p| p[0]).collect(),
            y: points.iter().map(|p| p[1]).collect(),
            by_coefficient: std::array::from_fn(padded),
            weights,
        }
    }

    pub fn at(&self, i: usize) -> [f64; 2] {
        [self.x[i], self.y[i]]
    }

    /// The weighted sum over the points of the number at position `number` of the only quantity.
    pub fn sum<const N: usize>(&self, slopes: &Slopes<N>, number: usize) -> Lanes {
        Lanes::from_fn(|o, _| slopes.weighted(number, &self.by_coefficient[o]))
    }

    /// Adds the weighted derivatives with respect to the points to those with respect to the nodes; the points are the
    /// nodes of the section.
    pub fn add_weighted(&self, by_point: &Vectors, collected: &mut Collected) {
        for (o, nodes) in collected.nodes.iter_mut().enumerate() {
            for (i, (node, weights)) in nodes.iter_mut().zip(&self.weights).enumerate() {
                let [x, y] = by_point.at(i);
                node[0] += weights[o] * x;
                node[1] += weights[o] * y;
            }
        }
    }
}

/// Number of points whose numbers stand together, kind after kind, so that vectors can be made of them.
const BLOCK: usize = 192;
/// Number of points that the sums take at a time, the last of them with weights of zero: a multiple of the length of
/// any vector.
const STEP: usize = 8;

const _: () = assert!(BLOCK.is_multiple_of(STEP), "sums would leave numbers out");

/// The numbers of one quantity at the points of a block.
#[derive(Clone, Copy)]
struct SlopeBlock<const N: usize> {
    /// The numbers, kind after kind, one per point.
    numbers: [[f64; BLOCK]; N],
    /// Coefficients of the two components of the unit vector along the panel, one per point.
    turn: [[f64; BLOCK]; 2],
}

/// The values at all points of `M` quantities that one panel contributes to. The first three numbers per point and
/// quantity are the derivatives of the quantity with respect to the coordinates of the point in the frame of the panel
/// and to the length of the panel.
pub(super) struct Slopes<const N: usize, const M: usize = 1>(Vec<[SlopeBlock<N>; M]>);

impl<const N: usize, const M: usize> Slopes<N, M> {
    pub fn zeros(points: usize) -> Self {
        let block = SlopeBlock { numbers: [[0.0; BLOCK]; N], turn: [[0.0; BLOCK]; 2] };
        Self(vec![[block; M]; points.div_ceil(BLOCK)])
    }

    /// Evaluates the quantities at all points. Points listed in `special` take the place on the panel that `place` gives;
    /// all others lie elsewhere.
    pub fn fill(
        &mut self,
        points: &Points,
        panel: &Straight,
        quantity: &impl Quantity<N, M>,
        special: impl IntoIterator<Item = usize>,
        place: impl Fn(usize) -> Place,
    ) {
        for (block, first) in self.0.iter_mut().zip((0..).step_by(BLOCK)) {
            let range = first..points.x.len().min(first + BLOCK);
            fill_vectorised(block, [&points.x[range.clone()], &points.y[range.clone()]], panel, &quantity.of(range));
        }
        for (i, place) in special.into_iter().map(|i| (i, place(i))).filter(|(_, place)| *place != Place::Elsewhere) {
            set(&mut self.0[i / BLOCK], i % BLOCK, seen(panel, points.at(i), quantity, i, place));
        }
    }

    /// Adds the slopes of quantity `m`, turned into the outer frame, to the derivatives with respect to every point.
    pub fn add_outer(&self, m: usize, panel: &Straight, by_point: &mut Vectors) {
        self.add_vectors(m, [0, 1], panel, by_point);
    }

    /// Adds the vectors whose coordinates in the frame of the panel are the numbers of quantity `m` at the positions
    /// `along` and `across`.
    pub fn add_vectors(&self, m: usize, [along, across]: [usize; 2], panel: &Straight, sums: &mut Vectors) {
        let [x, y] = &mut sums.0;
        for ((block, x), y) in self.0.iter().zip(x.chunks_mut(BLOCK)).zip(y.chunks_mut(BLOCK)) {
            add_outer(panel, &block[m].numbers[along], &block[m].numbers[across], x, y);
        }
    }
}

impl<const N: usize> Slopes<N> {
    /// The weighted sum over the points of the number at position `k` of the only quantity.
    fn weighted(&self, k: usize, weights: &[f64]) -> f64 {
        self.0
            .iter()
            .zip(weights.chunks(BLOCK))
            .map(|([block], weights)| dot(&block.numbers[k][..weights.len()], weights))
            .sum()
    }
}

impl<const N: usize> SlopeBlock<N> {
    /// The first three numbers of every point: the slopes.
    #[inline(always)]
    fn slopes(&self) -> [&[f64; BLOCK]; 3] {
        std::array::from_fn(|k| &self.numbers[k])
    }
}

/// Writes the numbers of all quantities at point `i` of a block.
#[inline(always)]
fn set<const N: usize, const M: usize>(
    block: &mut [SlopeBlock<N>; M],
    i: usize,
    (numbers, turn): ([[f64; N]; M], [[f64; 2]; M]),
) {
    for m in 0..M {
        for k in 0..N {
            block[m].numbers[k][i] = numbers[m][k];
        }
        for c in 0..2 {
            block[m].turn[c][i] = turn[m][c];
        }
    }
}

/// Adds vectors given in the frame of a panel to sums in the outer frame.
fn add_outer(panel: &Straight, along: &[f64], across: &[f64], sum_x: &mut [f64], sum_y: &mut [f64]) {
    for (((sum_x, sum_y), along), across) in sum_x.iter_mut().zip(sum_y).zip(along).zip(across) {
        let [x, y] = panel.outer([*along, *across]);
        *sum_x += x;
        *sum_y += y;
    }
}

/// One vector per point, the two coordinates in separate lists.
pub(super) struct Vectors([Vec<f64>; 2]);

impl Vectors {
    pub fn new([x, y]: [f64; 2], points: usize) -> Self {
        Self([vec![x; points], vec![y; points]])
    }

    pub fn at(&self, i: usize) -> [f64; 2] {
        [self.0[0][i], self.0[1][i]]
    }

    pub fn add(&mut self, i: usize, by: [f64; 2]) {
        self.0[0][i] += by[0];
        self.0[1][i] += by[1];
    }
}

/// Quantities at a point that one panel contributes to.
pub(super) trait Quantity<const N: usize, const M: usize = 1> {
    /// The quantities for a range of points only, so that a loop over these runs without checks of the index.
    fn of(&self, points: Range<usize>) -> Self;

    /// The numbers of the quantities at point `i`, which has the coordinates `at` in the frame of the panel.
    fn at(&self, i: usize, at: [Dual3; 2], length: Dual3, place: Place) -> [[f64; N]; M];

    /// Coefficients of the unit vector along the panel at point `i` for one quantity, beyond those that follow from the
    /// slopes.
    #[inline(always)]
    fn beyond(&self, _i: usize, _numbers: &[f64; N]) -> [f64; 2] {
        [0.0; 2]
    }
}

/// The numbers of the quantities at point `i`, which stands at `point`, and the coefficients of the unit vector along
/// the panel.
#[inline(always)]
fn seen<const N: usize, const M: usize>(
    panel: &Straight,
    point: [f64; 2],
    quantity: &impl Quantity<N, M>,
    i: usize,
    place: Place,
) -> ([[f64; N]; M], [[f64; 2]; M]) {
    let (at, length) = variables(panel, point);
    let numbers = quantity.at(i, at, length, place);
    let mut turn = [[0.0; 2]; M];
    for m in 0..M {
        let ([x, y], [more_x, more_y]) =
            (turned(panel, point, numbers[m][0], numbers[m][1]), quantity.beyond(i, &numbers[m]));
        turn[m] = [x + more_x, y + more_y];
    }
    (numbers, turn)
}

/// The loop of [`Slopes::fill`], compiled for the vectors the processor has.
struct Fill<'a, const N: usize, const M: usize, Q> {
    block: &'a mut [SlopeBlock<N>; M],
    points: [&'a [f64]; 2],
    panel: &'a Straight,
    quantity: &'a Q,
}

impl<const N: usize, const M: usize, Q: Quantity<N, M>> NullaryFnOnce for Fill<'_, N, M, Q> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { block, points: [x, y], panel, quantity } = self;
        let count = x.len().min(BLOCK);
        let (x, y, quantity) = (&x[..count], &y[..count], quantity.of(0..count));
        for i in 0..count {
            set(block, i, seen(panel, [x[i], y[i]], &quantity, i, Place::Elsewhere));
        }
    }
}

/// Fills a block. The function is never inlined, so that the compiler knows that it writes to nothing it reads.
#[inline(never)]
fn fill_vectorised<const N: usize, const M: usize, Q: Quantity<N, M>>(
    block: &mut [SlopeBlock<N>; M],
    points: [&[f64]; 2],
    panel: &Straight,
    quantity: &Q,
) {
    pulp::Arch::new().dispatch(Fill { block, points, panel, quantity });
}

/// Number of sums per panel: two of the shift, two of the turn, one of the stretch.
const SUMS: usize = 5;

/// The sums over the points for a panel with the given slopes of quantity `m`.
pub(super) fn panel_sums<const N: usize, const M: usize>(
    points: &Points,
    slopes: &Slopes<N, M>,
    m: usize,
) -> PanelSums {
    let sums = pulp::Arch::new().dispatch(Weighted { slopes, quantity: m, weights: &points.by_coefficient });
    let [along, across, x, y, stretch] = sums.map(|sums| Lanes::from_fn(|o, _| sums[o]));
    PanelSums { shift: [along, across], turn: [x, y], stretch }
}

/// Sums of terms times weights for every kind of term and every coefficient. This is a product of two narrow matrices,
/// for which the blocks of a matrix library are too wide.
struct Weighted<'a, const N: usize, const M: usize> {
    slopes: &'a Slopes<N, M>,
    /// The quantity whose slopes are summed.
    quantity: usize,
    /// Weights of every coefficient, filled up with zeros to whole steps.
    weights: &'a [Vec<f64>; PADDED],
}

/// Number of coefficients that are summed at a time; more would need more registers than there are.
const TOGETHER: usize = 2;
/// Number of coefficients, rounded up to whole groups.
const PADDED: usize = COEFFICIENTS.next_multiple_of(TOGETHER);

impl<const N: usize, const M: usize> WithSimd for Weighted<'_, N, M> {
    type Output = [[f64; PADDED]; SUMS];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut sums = [[0.0; PADDED]; SUMS];
        for (group, weights) in self.weights.as_chunks::<TOGETHER>().0.iter().enumerate() {
            let mut many = [[simd.splat_f64s(0.0); SUMS]; TOGETHER];
            for (block, first) in self.slopes.0.iter().zip((0..).step_by(BLOCK)) {
                let block = &block[self.quantity];
                let ([along, across, stretch], [x, y]) = (block.slopes(), &block.turn);
                let end = weights[0].len().min(first + BLOCK);
                let weights = weights.each_ref().map(|weights| S::as_simd_f64s(&weights[first..end]).0);
                let terms = [along, across, x, y, stretch].map(|term| &S::as_simd_f64s(term).0[..weights[0].len()]);
                for i in 0..weights[0].len() {
                    for k in 0..SUMS {
                        for o in 0..TOGETHER {
                            many[o][k] = simd.mul_add_e_f64s(terms[k][i], weights[o][i], many[o][k]);
                        }
                    }
                }
            }
            for k in 0..SUMS {
                for o in 0..TOGETHER {
                    sums[k][group * TOGETHER + o] = simd.reduce_sum_f64s(many[o][k]);
                }
            }
        }
        sums
    }
}

/// Coefficients of the unit vector along the panel in the coordinates of a point, times the slopes with respect to
/// these coordinates.
#[inline(always)]
fn turned(panel: &Straight, point: [f64; 2], by_x: f64, by_z: f64) -> [f64; 2] {
    let (px, py) = (point[0] - panel.start[0], point[1] - panel.start[1]);
    [by_x * px + by_z * py, by_x * py - by_z * px]
}

/// Weighted sums over the points of the derivatives with respect to one panel, for all coefficients.
#[derive(Debug, Clone, Default)]
pub(super) struct PanelSums {
    /// Derivatives with respect to a shift of all points along and across the panel.
    shift: [Lanes; 2],
    /// Coefficients of the unit vector along the panel.
    turn: [Lanes; 2],
    /// Coefficients of the length of the panel.
    stretch: Lanes,
}

impl PanelSums {
    /// Adds the derivatives with respect to both ends of the panel. The ends stand at `ends` and have the numbers `at`
    /// among the points of `targets`.
    pub fn scatter(&self, ends: [[f64; 2]; 2], at: [usize; 2], targets: &mut Coefficients<Vec<[f64; 2]>>) {
        let unit = |end: usize, c: usize| Dual4::from_re(ends[end][c]).derivative(2 * end + c);
        let (dx, dy) = (unit(1, 0) - unit(0, 0), unit(1, 1) - unit(0, 1));
        let length = (dx * dx + dy * dy).sqrt();
        let [tx, ty] = [dx / length, dy / length];
        let mut by: [Lanes; 4] =
            std::array::from_fn(|k| self.turn[0] * tx.eps[k] + self.turn[1] * ty.eps[k] + self.stretch * length.eps[k]);
        // a shift of the start is one of all points the other way
        let [along, across] = &self.shift;
        by[0] -= along * tx.re - across * ty.re;
        by[1] -= along * ty.re + across * tx.re;
        for (o, targets) in targets.iter_mut().enumerate() {
            for c in 0..2 {
                targets[at[0]][c] += by[c][o];
                targets[at[1]][c] += by[2 + c][o];
            }
        }
    }
}

/// Adds the derivatives with respect to the ends of consecutive panels.
pub(super) fn scatter_ends(sums: &[PanelSums], ends: &[[f64; 2]], targets: &mut Coefficients<Vec<[f64; 2]>>) {
    for (j, sums) in sums.iter().enumerate() {
        sums.scatter([ends[j], ends[j + 1]], [j, j + 1], targets);
    }
}
