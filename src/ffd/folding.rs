//! Fold indicator and fold penalty of a control net (paper, Section V.A, equations 1 to 4).
//!
//! Every control point spans simplices with its neighbours: in the plane four triangles at an interior point, two at
//! an edge, one at a corner. An indicator compares the smallest with the others; the penalty switches on as it
//! falls to zero. In space the same formulas hold with volumes of tetrahedra.

use super::simplices::{Measures, Star, simplex_measure, stars};
use super::{FfdBox, FfdError};
use crate::scalar::{Over, Scalar};
use nalgebra::DMatrix;
use num_dual::{Dual2SVec64, DualSVec64};
use smallvec::SmallVec;

/// Settings of the fold penalty.
///
/// ```
/// use aeroform::ffd::{FfdBox, FoldPenalty, Placement};
/// let lattice = FfdBox::rectangular([[0.0, 1.0], [0.0, 1.0]], [3, 3], [1, 1], Placement::Even).unwrap();
/// let penalty = FoldPenalty::default().on(&lattice).unwrap();
/// let mut points = lattice.control_points().to_vec();
/// assert!(penalty.value(&points) < 1e-6);
/// points[4] = [1.2, 0.5]; // the interior point leaves its neighbours
/// assert!(penalty.value(&points) > 1.0 && penalty.report(&points).folded);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldPenalty {
    /// α of the smooth minimum (equation 4), in units of one over area; the paper's value is 1000.
    pub sharpness: f64,
    /// ε of the edge indicator (equation 1); the paper's value is 1e-11.
    pub epsilon: f64,
    /// Divide every area by its value in the undeformed box before the smooth minimum, so that the penalty does not
    /// depend on the size of the box. Not in the paper: there α multiplies areas as they are.
    pub normalised: bool,
}

impl Default for FoldPenalty {
    fn default() -> Self {
        Self { sharpness: 1000.0, epsilon: 1e-11, normalised: false }
    }
}

impl FoldPenalty {
    /// The penalty for deformations of an undeformed box.
    ///
    /// # Errors
    /// Settings that are not positive and finite.
    pub fn on<S: Scalar, const D: usize>(self, lattice: &FfdBox<S, D>) -> Result<BoxPenalty<S, D>, FfdError> {
        for (name, value) in [("alpha", self.sharpness), ("epsilon", self.epsilon)] {
            if !(value.is_finite() && value > 0.0) {
                return Err(FfdError::Setting { name, value });
            }
        }
        let stars = stars(&lattice.counts());
        let initial = stars.iter().map(|s| s.measures(lattice.control_points())).collect();
        Ok(BoxPenalty { settings: self, stars, initial })
    }
}

/// Whether, and where, a deformed net is folded or close to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoldReport {
    /// The smallest indicator m of equation (1), with the smooth minimum of equation (4).
    pub smallest_indicator: f64,
    /// Position in the list of the control point that has it.
    pub control_point: usize,
    /// Whether some simplex is turned over (measure not positive): exact, without the smooth minimum.
    pub folded: bool,
}

/// The fold penalty of one box, which may be of any scalar.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxPenalty<S = f64, const D: usize = 2> {
    settings: FoldPenalty,
    stars: Vec<Star<D>>,
    initial: Vec<Measures<S>>,
}

/// Equation (3): η(m) = erfc(10 m) (1/4 − m/2).
pub fn penalty_of_indicator<S: Scalar>(indicator: S) -> S {
    (indicator * 10.0).erfc() * (indicator * -0.5 + 0.25)
}

impl<S: Scalar, const D: usize> BoxPenalty<S, D> {
    /// The settings that the penalty was made with.
    pub fn settings(&self) -> FoldPenalty {
        self.settings
    }

    /// Equation (1) for one control point from the measures of its simplices.
    ///
    /// Interior points: singular where the sum of the areas (the area enclosed by the four neighbours) vanishes.
    /// Edge points: |A| has a kink at A = 0, as printed; the normalised variant rounds it off within 1e-3 of the
    /// undeformed area.
    fn indicator<T: Over<S>>(&self, index: usize, measures: &[T]) -> T {
        let initial = &self.initial[index];
        let FoldPenalty { sharpness, epsilon, normalised } = self.settings;
        let area = |i: usize| if normalised { measures[i] / initial[i] } else { measures[i] };
        let n = measures.len();
        if n == 1 {
            return measures[0] / initial[0];
        }
        // nested pairwise
        let mut level: SmallVec<[T; 4]> = (0..n).map(area).collect();
        while level.len() > 1 {
            level = level.chunks(2).map(|pair| pair[0].smooth_minimum(pair[1], sharpness)).collect();
        }
        let sum: T = match n == 1 << D {
            true => (0..n).map(area).sum(),
            false if normalised => (0..n).map(|i| (area(i).squared() + 1e-6).sqrt() + epsilon).sum(),
            false => (0..n).map(|i| num_traits::Signed::abs(&area(i)) + initial[i] * epsilon).sum(),
        };
        level[0] * n as f64 / sum
    }

    /// The penalty: the sum of η(m) over all control points.
    ///
    /// `net` holds the deformed control points, as many as the box has.
    pub fn value<T: Over<S>>(&self, net: &[[T; D]]) -> T {
        let terms = self.stars.iter().enumerate();
        terms.map(|(index, star)| penalty_of_indicator(self.indicator(index, &star.measures(net)))).sum()
    }

    /// Equation (1) for the control point at a position in the list, which must be below the number of control points.
    ///
    /// As long as every indicator of a net is positive the net has not folded.
    pub fn indicator_at<T: Over<S>>(&self, index: usize, net: &[[T; D]]) -> T {
        self.indicator(index, &self.stars[index].measures(net))
    }
}

impl<const D: usize> BoxPenalty<f64, D> {
    /// Smallest indicator and whether the net is folded.
    pub fn report(&self, net: &[[f64; D]]) -> FoldReport {
        let mut report = FoldReport { smallest_indicator: f64::INFINITY, control_point: 0, folded: false };
        for (index, star) in self.stars.iter().enumerate() {
            let measures = star.measures(net);
            report.folded |= measures.iter().any(|a| !(*a > 0.0));
            let indicator = self.indicator(index, &measures);
            if !(indicator >= report.smallest_indicator) {
                report.smallest_indicator = indicator;
                report.control_point = index;
            }
        }
        report
    }

    /// Value; adds `factor` times its derivative with respect to every control point to `gradient`.
    ///
    /// Local duals in two stages: the indicator in its (up to 2^D) measures, each measure in its D + 1 points; the cost
    /// is a small multiple of the value's whatever the size of the box.
    pub fn value_and_gradient(&self, net: &[[f64; D]], factor: f64, gradient: &mut [[f64; D]]) -> f64 {
        // 2^D measures, and D (D + 1) coordinates of a simplex: at most 8 in the plane, 12 in space
        match D {
            2 => self.accumulate::<4, 8>(net, factor, gradient),
            _ => self.accumulate::<8, 16>(net, factor, gradient),
        }
    }

    fn accumulate<const M: usize, const C: usize>(
        &self,
        net: &[[f64; D]],
        scale: f64,
        gradient: &mut [[f64; D]],
    ) -> f64 {
        let eta = |indicator: DualSVec64<M>| penalty_of_indicator(indicator);
        (0..self.stars.len()).map(|index| self.accumulate_star::<M, C>(index, net, scale, gradient, eta)).sum()
    }

    /// A function of one indicator; adds `scale` times its derivative to `gradient`.
    fn accumulate_star<const M: usize, const C: usize>(
        &self,
        index: usize,
        net: &[[f64; D]],
        scale: f64,
        gradient: &mut [[f64; D]],
        of: impl Fn(DualSVec64<M>) -> DualSVec64<M>,
    ) -> f64 {
        let star = &self.stars[index];
        let measures: SmallVec<[DualSVec64<M>; 4]> =
            star.measures(net).iter().enumerate().map(|(i, &a)| DualSVec64::<M>::from_re(a).derivative(i)).collect();
        let value = of(self.indicator(index, &measures));
        let Some(by_measure) = value.eps.0 else { return value.re };
        for (i, (neighbours, sign)) in star.simplices.iter().enumerate() {
            let factor = scale * by_measure[i] * sign;
            // far from a fold the penalty and its slope underflow
            if factor == 0.0 {
                continue;
            }
            let seed = |position: usize, slot: usize| -> [DualSVec64<C>; D] {
                let point = net[star.points[position]];
                std::array::from_fn(|d| DualSVec64::from_re(point[d]).derivative(slot * D + d))
            };
            let measure = simplex_measure(seed(0, 0), std::array::from_fn(|k| seed(neighbours[k], k + 1)));
            let Some(by_coordinate) = measure.eps.0 else { continue };
            for slot in 0..=D {
                let position = if slot == 0 { 0 } else { neighbours[slot - 1] };
                for d in 0..D {
                    gradient[star.points[position]][d] += factor * by_coordinate[slot * D + d];
                }
            }
        }
        value.re
    }

    /// The indicator of [`indicator_at`](Self::indicator_at); adds `factor` times its derivative with respect to every
    /// control point to `gradient`.
    pub fn indicator_and_gradient(
        &self,
        index: usize,
        net: &[[f64; D]],
        factor: f64,
        gradient: &mut [[f64; D]],
    ) -> f64 {
        match D {
            2 => self.accumulate_star::<4, 8>(index, net, factor, gradient, |m| m),
            _ => self.accumulate_star::<8, 16>(index, net, factor, gradient, |m| m),
        }
    }
}

impl BoxPenalty<f64> {
    /// Adds Σ ∇A ∇Aᵀ / A₀² over all triangles to `metric` (rows as in [`add_hessian`](Self::add_hessian)): the squared
    /// relative change of the areas, a measure of how far a movement of the net distorts it.
    pub fn add_distortion(&self, net: &[[f64; 2]], metric: &mut DMatrix<f64>) {
        for (star, initial) in self.stars.iter().zip(&self.initial) {
            for ((neighbours, sign), initial) in star.simplices.iter().zip(initial) {
                let (area, rows) = star.second_order_area(net, *neighbours, *sign);
                let Some(slope) = area.v1.0 else { continue };
                for (a, b) in (0..6).flat_map(|a| (0..6).map(move |b| (a, b))) {
                    metric[(rows[a], rows[b])] += slope[a] * slope[b] / (initial * initial);
                }
            }
        }
    }

    /// Adds the Hessian with respect to the control points to `hessian`; component `d` of point `i` is row `2 i + d`.
    ///
    /// Second-order local duals in the same two stages as the gradient: indicator in areas, areas in coordinates.
    pub fn add_hessian(&self, net: &[[f64; 2]], hessian: &mut DMatrix<f64>) {
        for (index, star) in self.stars.iter().enumerate() {
            let areas: SmallVec<[_; 4]> = star
                .simplices
                .iter()
                .map(|(neighbours, sign)| star.second_order_area(net, *neighbours, *sign))
                .collect();
            let seeded: SmallVec<[Dual2SVec64<4>; 4]> =
                areas.iter().enumerate().map(|(i, (area, _))| Dual2SVec64::from_re(area.re).derivative(i)).collect();
            let eta = penalty_of_indicator(self.indicator(index, &seeded));
            let (Some(first), Some(second)) = (eta.v1.0, eta.v2.0) else { continue };
            for (i, (area_i, rows)) in areas.iter().enumerate() {
                let (Some(slope_i), Some(bend_i)) = (area_i.v1.0, area_i.v2.0) else { continue };
                for (a, b) in (0..6).flat_map(|a| (0..6).map(move |b| (a, b))) {
                    hessian[(rows[a], rows[b])] += first[i] * bend_i[(a, b)];
                }
                for (j, (area_j, columns)) in areas.iter().enumerate() {
                    let Some(slope_j) = area_j.v1.0 else { continue };
                    for (a, b) in (0..6).flat_map(|a| (0..6).map(move |b| (a, b))) {
                        hessian[(rows[a], columns[b])] += second[(i, j)] * slope_i[a] * slope_j[b];
                    }
                }
            }
        }
    }
}

#[cfg(test)]
#[path = "folding_tests.rs"]
mod tests;
