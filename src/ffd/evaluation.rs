//! Fast evaluation of a box at many parameters.

use super::FfdBox;
use crate::scalar::Scalar;
use crate::spline::{KnotVector, TensorSpline};
use num_dual::Dual64;

/// A box prepared for evaluation at many parameters: one polynomial per cell and direction.
///
/// Basis functions are tabulated per span as polynomials about the middle of the span (`s` from −1/2 to 1/2), where
/// their coefficients are small, so that values are good to round-off; nothing is divided and nothing allocated.
///
/// ```
/// use aeroform::ffd::{BoxEvaluator, FfdBox, Placement};
/// let lattice = FfdBox::rectangular([[0.0, 1.0], [0.0, 1.0]], [5, 5], [3, 3], Placement::Greville).unwrap();
/// let evaluator = BoxEvaluator::new(&lattice);
/// let mut points = [[0.0_f64; 2]; 2];
/// evaluator.evaluate_many(&[[0.25, 0.5], [1.0, 0.0]], &mut points);
/// assert!((points[0][0] - 0.25).abs() < 1e-15 && (points[1][0] - 1.0).abs() < 1e-15);
/// ```
#[derive(Debug, Clone)]
pub struct BoxEvaluator<S = f64, const D: usize = 2> {
    spline: TensorSpline<S, D, D>,
    axes: [AxisTable; D],
    /// Basis functions per direction, padded to one width for all directions; zero where no kernel is compiled for it.
    width: usize,
    /// For each cell `width^D` control points, first direction fastest; the padding is zero.
    blocks: Vec<[S; D]>,
}

/// The spans of one direction and their basis functions.
#[derive(Debug, Clone)]
struct AxisTable {
    /// Inner knots at which a new span starts.
    breaks: Vec<f64>,
    /// Middle and reciprocal length of each span.
    spans: Vec<(f64, f64)>,
    /// For each span, for each power (highest first), `width` coefficients.
    coefficients: Vec<f64>,
}

impl AxisTable {
    fn new(knots: &KnotVector, width: usize) -> Self {
        let p = knots.degree();
        let mut table = Self { breaks: Vec::new(), spans: Vec::new(), coefficients: Vec::new() };
        for (count, (index, start, end)) in knots.spans().enumerate() {
            if count > 0 {
                table.breaks.push(start);
            }
            let (middle, length) = (0.5 * (start + end), end - start);
            table.spans.push((middle, 1.0 / length));
            // Taylor coefficients about the middle: derivative · lengthᵏ / k!
            let rows = knots.basis_derivatives(index, middle, p);
            for power in (0..width).rev() {
                let factor: f64 = (1..=power).map(|k| length / k as f64).product();
                for j in 0..width {
                    table.coefficients.push(if power <= p && j <= p { rows[power][j] * factor } else { 0.0 });
                }
            }
        }
        table
    }

    /// Span of a parameter; the end spans continue outside of [0, 1].
    #[inline]
    fn span(&self, u: f64) -> usize {
        self.breaks.iter().map(|&b| usize::from(b <= u)).sum()
    }

    /// Basis functions of a span at local coordinate `s`.
    #[inline]
    fn values<S: Scalar, const N: usize>(&self, span: usize, s: S) -> [S; N] {
        let rows = &self.coefficients[span * N * N..(span + 1) * N * N];
        let mut value = [S::from(0.0); N];
        for row in rows.chunks_exact(N) {
            for j in 0..N {
                value[j] = value[j] * s + row[j];
            }
        }
        value
    }

    /// Basis functions and their derivatives with respect to `s`.
    #[inline]
    fn values_and_slopes<const N: usize>(&self, span: usize, s: f64) -> [[f64; N]; 2] {
        let both = self.values::<Dual64, N>(span, Dual64::new(s, 1.0));
        [both.map(|v| v.re), both.map(|v| v.eps)]
    }
}

impl<S: Scalar, const D: usize> BoxEvaluator<S, D> {
    /// Prepares a box, deformed or not.
    pub fn new(lattice: &FfdBox<S, D>) -> Self {
        let spline = lattice.spline().clone();
        let order = lattice.degrees().into_iter().fold(0, |order, p| order.max(p + 1));
        // no kernel is compiled for wider ones
        let width = [2, 3, 4, 5, 6, 8].into_iter().find(|&n| n >= order).unwrap_or_default();
        let axes = std::array::from_fn(|k| AxisTable::new(&spline.axes()[k], width));
        let mut result = Self { spline, axes, width, blocks: Vec::new() };
        if width > 0 {
            result.fill_blocks();
        }
        result
    }

    fn fill_blocks(&mut self) {
        let counts = self.spline.counts();
        let starts: [Vec<usize>; D] = std::array::from_fn(|k| {
            let knots = &self.spline.axes()[k];
            knots.spans().map(|(index, ..)| index - knots.degree()).collect()
        });
        let cells: [usize; D] = std::array::from_fn(|k| starts[k].len());
        for cell in 0..cells.iter().product() {
            let cell = FfdBox::<S, D>::unravel(cells, cell);
            for slot in 0..self.width.pow(D as u32) {
                let local = FfdBox::<S, D>::unravel([self.width; D], slot);
                let inside = (0..D).all(|k| local[k] <= self.spline.axes()[k].degree());
                let index = (0..D).rev().fold(0, |sum, k| sum * counts[k] + starts[k][cell[k]] + local[k]);
                self.blocks.push(if inside { self.spline.control_points()[index] } else { [S::from(0.0); D] });
            }
        }
    }

    /// The point of the box at parameters `u`.
    pub fn evaluate(&self, u: [S; D]) -> [S; D] {
        let mut point = [[S::from(0.0); D]];
        self.evaluate_many(&[u], &mut point);
        point[0]
    }

    /// The points of the box at many parameters; the shorter of the two slices ends it.
    pub fn evaluate_many(&self, parameters: &[[S; D]], points: &mut [[S; D]]) {
        match self.width {
            2 => self.sweep::<2>(parameters, points),
            3 => self.sweep::<3>(parameters, points),
            4 => self.sweep::<4>(parameters, points),
            5 => self.sweep::<5>(parameters, points),
            6 => self.sweep::<6>(parameters, points),
            8 => self.sweep::<8>(parameters, points),
            _ => parameters.iter().zip(points).for_each(|(u, point)| *point = self.spline.evaluate(*u)),
        }
    }

    fn sweep<const N: usize>(&self, parameters: &[[S; D]], points: &mut [[S; D]]) {
        for (u, point) in parameters.iter().zip(points) {
            let cell: [usize; D] = std::array::from_fn(|k| self.axes[k].span(u[k].re()));
            let weights: [[S; N]; D] = std::array::from_fn(|k| {
                let (middle, inverse_length) = self.axes[k].spans[cell[k]];
                self.axes[k].values::<S, N>(cell[k], (u[k] - middle) * inverse_length)
            });
            *point = contract(self.block::<N>(cell), &weights);
        }
    }

    #[inline]
    fn block<const N: usize>(&self, cell: [usize; D]) -> &[[S; D]] {
        let index = (0..D).rev().fold(0, |sum, k| sum * self.axes[k].spans.len() + cell[k]);
        let size = N.pow(D as u32);
        &self.blocks[index * size..(index + 1) * size]
    }
}

impl<const D: usize> BoxEvaluator<f64, D> {
    /// Parameters of local coordinates `s` in a cell.
    pub(super) fn parameters(&self, cell: [usize; D], s: [f64; D]) -> [f64; D] {
        std::array::from_fn(|k| {
            let (middle, inverse_length) = self.axes[k].spans[cell[k]];
            middle + s[k] / inverse_length
        })
    }

    /// Point and derivatives with respect to the local coordinates `s` (`jacobian[k]` along direction k) of the
    /// polynomial of one cell, which continues beyond the cell.
    pub(super) fn cell_point_and_jacobian(&self, cell: [usize; D], s: [f64; D]) -> ([f64; D], [[f64; D]; D]) {
        match self.width {
            2 => self.local::<2>(cell, s),
            3 => self.local::<3>(cell, s),
            4 => self.local::<4>(cell, s),
            5 => self.local::<5>(cell, s),
            6 => self.local::<6>(cell, s),
            8 => self.local::<8>(cell, s),
            _ => self.local_by_spline(cell, s),
        }
    }

    fn local<const N: usize>(&self, cell: [usize; D], s: [f64; D]) -> ([f64; D], [[f64; D]; D]) {
        let rows: [[[f64; N]; 2]; D] = std::array::from_fn(|k| self.axes[k].values_and_slopes::<N>(cell[k], s[k]));
        let block = self.block::<N>(cell);
        let along = |direction: usize| {
            let weights: [[f64; N]; D] = std::array::from_fn(|k| rows[k][usize::from(k == direction)]);
            contract(block, &weights)
        };
        (along(D), std::array::from_fn(along))
    }

    /// For degrees without a compiled kernel.
    fn local_by_spline(&self, cell: [usize; D], s: [f64; D]) -> ([f64; D], [[f64; D]; D]) {
        // the spline picks the span itself, so stay within the cell
        let clamped = s.map(|s| s.clamp(-0.5, 0.5 - 1e-15));
        let (mut point, mut jacobian) = self.spline.point_and_jacobian(self.parameters(cell, clamped));
        for k in 0..D {
            for d in 0..D {
                jacobian[k][d] /= self.axes[k].spans[cell[k]].1;
                point[d] += jacobian[k][d] * (s[k] - clamped[k]);
            }
        }
        (point, jacobian)
    }
}

/// Σ over the block of the control points times the product of the weights of each direction.
#[inline]
fn contract<S: Scalar, const N: usize, const D: usize>(block: &[[S; D]], weights: &[[S; N]; D]) -> [S; D] {
    let mut sum = [S::from(0.0); D];
    for (outer, row) in block.chunks_exact(N).enumerate() {
        let mut along = [S::from(0.0); D];
        for (weight, control) in weights[0].iter().zip(row) {
            for d in 0..D {
                along[d] += control[d] * *weight;
            }
        }
        let mut weight = S::from(1.0);
        let mut rest = outer;
        for row in &weights[1..] {
            weight *= row[rest % N];
            rest /= N;
        }
        for d in 0..D {
            sum[d] += along[d] * weight;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ffd::Placement;
    use proptest::prelude::*;

    fn bent(counts: [usize; 2], degrees: [usize; 2]) -> FfdBox<f64> {
        let flat = FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], counts, degrees, Placement::Even).unwrap();
        let moved = flat.control_points().iter().enumerate();
        flat.with_control_points(
            moved.map(|(i, p)| [p[0] + 0.05 * (i as f64).sin(), p[1] + 0.03 * (2.0 * i as f64).cos()]).collect(),
        )
        .unwrap()
    }

    proptest! {
        #[test]
        fn agrees_with_the_spline(p in 1usize..=9, q in 1usize..=9, extra in (0usize..5, 0usize..5), u in 0.0f64..=1.0, v in 0.0f64..=1.0) {
            let lattice = bent([p + 1 + extra.0, q + 1 + extra.1], [p, q]);
            let evaluator = BoxEvaluator::new(&lattice);
            let exact = lattice.evaluate([u, v]);
            let fast = evaluator.evaluate([u, v]);
            for d in 0..2 {
                prop_assert!((exact[d] - fast[d]).abs() < 4e-15, "{exact:?} {fast:?}");
            }
            let (_, jacobian) = lattice.spline().point_and_jacobian([u, v]);
            let cell = [evaluator.axes[0].span(u), evaluator.axes[1].span(v)];
            let s = std::array::from_fn(|k| {
                let (middle, inverse) = evaluator.axes[k].spans[cell[k]];
                ([u, v][k] - middle) * inverse
            });
            let (point, local) = evaluator.cell_point_and_jacobian(cell, s);
            let net = lattice.control_points().iter().map(|p| p.map(Dual64::from)).collect();
            let dual = BoxEvaluator::new(&lattice.with_control_points(net).unwrap());
            let along: [[Dual64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]].map(|e| dual.evaluate([Dual64::new(u, e[0]), Dual64::new(v, e[1])]));
            for d in 0..2 {
                prop_assert!((point[d] - exact[d]).abs() < 4e-15);
                for k in 0..2 {
                    let slope = local[k][d] * evaluator.axes[k].spans[cell[k]].1;
                    prop_assert!((slope - jacobian[k][d]).abs() < 1e-12 && (slope - along[k][d].eps).abs() < 1e-12);
                }
            }
        }
    }
}
