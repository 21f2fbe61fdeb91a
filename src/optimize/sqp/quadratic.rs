//! Convex quadratic programs with elastic constraints, by a primal-dual interior-point method.

use nalgebra::{Cholesky, DMatrix, DVector};

/// `minimise gᵀd + ½ dᵀBd + Σ penalty · shortfall`, with `d` between bounds.
///
/// The shortfall of a row is how much `row · d` stays below what it needs; so the program always has a solution, and
/// where the penalties are large enough it is that of the program with hard constraints.
pub(super) struct ElasticProgram<'a> {
    /// g (length n).
    pub gradient: &'a [f64],
    /// B (n × n), symmetric positive definite.
    pub hessian: &'a DMatrix<f64>,
    /// One row per constraint.
    pub rows: &'a DMatrix<f64>,
    /// The least value that each row needs.
    pub needed: &'a [f64],
    /// Price of the shortfall of each row, positive.
    pub penalties: &'a [f64],
    /// Bounds of `d`; finite, every lower one below its upper one.
    pub lower: &'a [f64],
    pub upper: &'a [f64],
}

/// The solution of a [`ElasticProgram`].
pub(super) struct ProgramSolution {
    pub d: DVector<f64>,
    /// Multiplier of each row, between zero and its penalty.
    pub multipliers: Vec<f64>,
}

/// Iterations at most; it takes 15 to 30.
const ITERATIONS: usize = 80;
/// Complementarity, relative to the scale of the objective, at which it ends.
const ACCURACY: f64 = 1e-13;
/// Complementarity up to which a solution is of use.
const USEFUL: f64 = 1e-7;
/// Distance by which the interior-point method may miss a row that holds.
const LARGEST_POLISH: f64 = 1e-6;
/// How close to its limits a step may go.
const TO_THE_EDGE: f64 = 0.995;

/// A nonnegative quantity with its nonnegative multiplier.
#[derive(Clone)]
struct Pair {
    value: DVector<f64>,
    dual: DVector<f64>,
}

impl Pair {
    fn gap(&self) -> f64 {
        self.value.dot(&self.dual)
    }

    /// Longest step (at most 1) that keeps both nonnegative.
    fn room(&self, value: &DVector<f64>, dual: &DVector<f64>) -> f64 {
        let of = |at: &DVector<f64>, by: &DVector<f64>| {
            at.iter().zip(by).filter(|(_, b)| **b < 0.0).map(|(a, b)| -TO_THE_EDGE * a / b).fold(1.0, f64::min)
        };
        of(&self.value, value).min(of(&self.dual, dual))
    }

    fn walk(&mut self, length: f64, value: &DVector<f64>, dual: &DVector<f64>) {
        self.value.axpy(length, value, 1.0);
        self.dual.axpy(length, dual, 1.0);
    }
}

impl ElasticProgram<'_> {
    /// The minimum, or `None` where the numbers are not finite or the Hessian not positive definite.
    pub fn solve(&self) -> Option<ProgramSolution> {
        let (n, m) = (self.gradient.len(), self.needed.len());
        // in units in which the largest slope is one, or the highest price a thousand
        let highest = self.penalties.iter().fold(0.0, |p: f64, v| p.max(*v));
        let steepest = self.gradient.iter().fold(1e-3 * highest, |s: f64, g| s.max(g.abs()));
        let scale = if steepest > 0.0 { 1.0 / steepest } else { 1.0 };
        let g = DVector::from_column_slice(self.gradient) * scale;
        let hessian = self.hessian * scale;
        let price = DVector::from_column_slice(self.penalties) * scale;
        let needed = DVector::from_column_slice(self.needed);
        let (lower, upper) = (DVector::from_column_slice(self.lower), DVector::from_column_slice(self.upper));

        let mut d = DVector::from_fn(n, |i, _| {
            0.0f64.clamp(lower[i] + 0.1 * (upper[i] - lower[i]), upper[i] - 0.1 * (upper[i] - lower[i]))
        });
        let excess = self.rows * &d - &needed;
        // what a row has beyond its need, and its shortfall
        let mut surplus = Pair { value: excess.map(|e| e.max(0.0) + 0.1), dual: &price * 0.5 };
        let mut shortfall = Pair { value: excess.map(|e| (-e).max(0.0) + 0.1), dual: &price * 0.5 };
        let mut above = Pair { value: &d - &lower, dual: DVector::from_element(n, 0.1) };
        let mut below = Pair { value: &upper - &d, dual: DVector::from_element(n, 0.1) };
        let mut last_gap = f64::INFINITY;
        let pairs = (2 * (n + m)) as f64;

        for _ in 0..ITERATIONS {
            let gap = (surplus.gap() + shortfall.gap() + above.gap() + below.gap()) / pairs;
            let residual = &hessian * &d + &g - self.rows.transpose() * &surplus.dual - &above.dual + &below.dual;
            let unmet = &needed + &surplus.value - self.rows * &d - &shortfall.value;
            last_gap = gap;
            if gap <= ACCURACY && residual.amax() <= 1e-12 && unmet.iter().all(|u| u.abs() <= 1e-12) {
                break;
            }
            // pivot of every row and of every bound
            let pivot =
                DVector::from_fn(m, |i, _| shortfall.value[i] / shortfall.dual[i] + surplus.value[i] / surplus.dual[i]);
            let mut matrix = hessian.clone();
            for i in 0..n {
                matrix[(i, i)] += above.dual[i] / above.value[i] + below.dual[i] / below.value[i];
            }
            let weighted = DMatrix::from_fn(m, n, |i, j| self.rows[(i, j)] / pivot[i]);
            matrix.gemm_tr(1.0, &weighted, self.rows, 1.0);
            // round-off ends it where nothing else does
            let Some(factors) = Cholesky::new(matrix) else { break };
            let direction = |aim: f64, second: Option<&InteriorStep>| -> InteriorStep {
                // products of the predictor's steps, for the corrector
                let cross = |of: fn(&InteriorStep) -> (&DVector<f64>, &DVector<f64>), i: usize| {
                    second.map_or(0.0, |s| of(s).0[i] * of(s).1[i])
                };
                let want = |pair: &Pair, i: usize, cross: f64| aim - cross - pair.value[i] * pair.dual[i];
                let by_surplus =
                    DVector::from_fn(m, |i, _| want(&surplus, i, cross(|s| (&s.surplus, &s.multiplier), i)));
                let by_shortfall =
                    DVector::from_fn(m, |i, _| want(&shortfall, i, -cross(|s| (&s.shortfall, &s.multiplier), i)));
                let by_above = DVector::from_fn(n, |i, _| want(&above, i, cross(|s| (&s.d, &s.above), i)));
                let by_below = DVector::from_fn(n, |i, _| want(&below, i, -cross(|s| (&s.d, &s.below), i)));
                let row_side = DVector::from_fn(m, |i, _| {
                    unmet[i] - by_shortfall[i] / shortfall.dual[i] + by_surplus[i] / surplus.dual[i]
                });
                let mut side = -&residual;
                side += self.rows.transpose() * row_side.component_div(&pivot);
                for i in 0..n {
                    side[i] += by_above[i] / above.value[i] - by_below[i] / below.value[i];
                }
                let step = factors.solve(&side);
                let multiplier = (row_side - self.rows * &step).component_div(&pivot);
                InteriorStep {
                    surplus: DVector::from_fn(m, |i, _| {
                        (by_surplus[i] - surplus.value[i] * multiplier[i]) / surplus.dual[i]
                    }),
                    shortfall: DVector::from_fn(m, |i, _| {
                        (by_shortfall[i] + shortfall.value[i] * multiplier[i]) / shortfall.dual[i]
                    }),
                    above: DVector::from_fn(n, |i, _| (by_above[i] - above.dual[i] * step[i]) / above.value[i]),
                    below: DVector::from_fn(n, |i, _| (by_below[i] + below.dual[i] * step[i]) / below.value[i]),
                    d: step,
                    multiplier,
                }
            };
            let room = |s: &InteriorStep| {
                surplus
                    .room(&s.surplus, &s.multiplier)
                    .min(shortfall.room(&s.shortfall, &-&s.multiplier))
                    .min(above.room(&s.d, &s.above))
                    .min(below.room(&-&s.d, &s.below))
            };
            let predictor = direction(0.0, None);
            let reach = room(&predictor);
            let centring = (1.0 - reach).powi(3).clamp(1e-4, 0.5);
            let step = direction(centring * gap, Some(&predictor));
            let length = room(&step);
            let finite = [&step.d, &step.multiplier, &step.surplus, &step.shortfall, &step.above, &step.below];
            if !(length > 0.0 && finite.iter().all(|part| part.iter().all(|v| v.is_finite()))) {
                break;
            }
            d.axpy(length, &step.d, 1.0);
            surplus.walk(length, &step.surplus, &step.multiplier);
            shortfall.walk(length, &step.shortfall, &-&step.multiplier);
            above.walk(length, &step.d, &step.above);
            below.walk(length, &-&step.d, &step.below);
        }
        let exact = self.on_active_set(&d, &surplus, &shortfall);
        let polished = exact.is_some();
        match exact {
            Some(exact) => d = exact,
            None => self.polish(&mut d, &surplus, &shortfall),
        }
        for i in 0..n {
            d[i] = d[i].clamp(lower[i], upper[i]);
        }
        let multipliers = surplus.dual.iter().map(|z| z / scale).collect();
        ((polished || last_gap <= USEFUL) && d.iter().all(|v| v.is_finite()))
            .then_some(ProgramSolution { d, multipliers })
    }
}

impl ElasticProgram<'_> {
    /// The minimum with the rows and bounds that hold taken for equalities, to round-off; `None` where that is not the
    /// point the interior-point method came to.
    fn on_active_set(&self, near: &DVector<f64>, surplus: &Pair, shortfall: &Pair) -> Option<DVector<f64>> {
        let n = near.len();
        let short = |i: usize| shortfall.value[i] > shortfall.dual[i];
        if (0..self.needed.len()).any(short) {
            return None;
        }
        let opposite = |i: usize| i > 0 && self.rows.row(i) == -self.rows.row(i - 1);
        let held = |i: usize| surplus.value[i] < surplus.dual[i];
        // the two sides of an equality are one
        let held: Vec<usize> = (0..self.needed.len()).filter(|&i| held(i) && !(opposite(i) && held(i - 1))).collect();
        let at_bound = |j: usize| {
            let room = 1e-7 * (self.upper[j] - self.lower[j]);
            let ends = [self.lower[j], self.upper[j]];
            ends.into_iter().find(|end| (near[j] - end).abs() <= room)
        };
        let fixed: Vec<(usize, f64)> = (0..n).filter_map(|j| at_bound(j).map(|end| (j, end))).collect();
        let size = n + held.len() + fixed.len();
        let (mut matrix, mut side) = (DMatrix::zeros(size, size), DVector::zeros(size));
        matrix.view_mut((0, 0), (n, n)).copy_from(self.hessian);
        for j in 0..n {
            side[j] = -self.gradient[j];
        }
        // equations of a size with the curvature, for the pivots
        let unit = self.hessian.diagonal().amax();
        let mut equation = |k: usize, row: &[(usize, f64)], value: f64| {
            for &(j, a) in row {
                matrix[(n + k, j)] = unit * a;
                matrix[(j, n + k)] = unit * a;
            }
            side[n + k] = unit * value;
        };
        for (k, &i) in held.iter().enumerate() {
            let row: Vec<(usize, f64)> = (0..n).map(|j| (j, self.rows[(i, j)])).collect();
            equation(k, &row, self.needed[i]);
        }
        for (k, &(j, end)) in fixed.iter().enumerate() {
            equation(held.len() + k, &[(j, 1.0)], end);
        }
        let solution = matrix.full_piv_lu().solve(&side)?;
        let d = solution.rows(0, n).into_owned();
        let reach = 1e-3 * near.amax() + LARGEST_POLISH;
        let inside = (0..n).all(|j| d[j] >= self.lower[j] - 1e-12 && d[j] <= self.upper[j] + 1e-12);
        let met = (self.rows * &d).iter().zip(self.needed).all(|(a, b)| a - b >= -1e-12);
        (inside && met && (&d - near).amax() <= reach).then_some(d)
    }

    /// Brings the rows that hold onto what they need, by the shortest way of the variables that are off their bounds:
    /// the interior-point method leaves them a little beside it.
    fn polish(&self, d: &mut DVector<f64>, surplus: &Pair, shortfall: &Pair) {
        let holds = |i: usize| surplus.value[i] < surplus.dual[i] && shortfall.value[i] < shortfall.dual[i];
        let held: Vec<usize> = (0..self.needed.len()).filter(|&i| holds(i)).collect();
        let free = |j: usize| {
            let room = 1e-6 * (self.upper[j] - self.lower[j]);
            d[j] - self.lower[j] > room && self.upper[j] - d[j] > room
        };
        let free: Vec<usize> = (0..d.len()).filter(|&j| free(j)).collect();
        if held.is_empty() || free.is_empty() {
            return;
        }
        let ends = self.rows * &*d;
        let missing = DVector::from_fn(held.len(), |k, _| self.needed[held[k]] - ends[held[k]]);
        if missing.amax() > LARGEST_POLISH {
            return;
        }
        let matrix = DMatrix::from_fn(held.len(), free.len(), |k, j| self.rows[(held[k], free[j])]);
        let svd = matrix.svd(true, true);
        let threshold = 1e-9 * svd.singular_values.max();
        if let Ok(correction) = svd.solve(&missing, threshold)
            && correction.amax() <= 1e3 * LARGEST_POLISH
        {
            free.iter().zip(correction.iter()).for_each(|(&j, c)| d[j] += c);
        }
    }
}

/// A step of all unknowns of the interior-point method.
struct InteriorStep {
    d: DVector<f64>,
    /// Step of the multipliers of the rows; the multipliers of the shortfalls move the other way.
    multiplier: DVector<f64>,
    surplus: DVector<f64>,
    shortfall: DVector<f64>,
    above: DVector<f64>,
    below: DVector<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn solve(
        hessian: &[f64],
        gradient: &[f64],
        rows: &[f64],
        needed: &[f64],
        penalty: f64,
        radius: f64,
    ) -> ProgramSolution {
        let n = gradient.len();
        ElasticProgram {
            gradient,
            hessian: &DMatrix::from_row_slice(n, n, hessian),
            rows: &DMatrix::from_row_slice(needed.len(), n, rows),
            needed,
            penalties: &vec![penalty; needed.len()],
            lower: &vec![-radius; n],
            upper: &vec![radius; n],
        }
        .solve()
        .unwrap()
    }

    #[test]
    fn constraints_bounds_and_multipliers() {
        // without anything in the way it is Newton's step
        let step = solve(&[2.0, 0.0, 0.0, 4.0], &[-2.0, -8.0], &[], &[], 1.0, 10.0);
        assert_relative_eq!(step.d.as_slice(), &[1.0, 2.0][..], epsilon = 1e-9);
        // x + y ≥ 5 in the way
        let step = solve(&[2.0, 0.0, 0.0, 4.0], &[-2.0, -8.0], &[1.0, 1.0], &[5.0], 100.0, 10.0);
        assert_relative_eq!(step.d.as_slice(), &[1.0 + 4.0 / 3.0, 2.0 + 2.0 / 3.0][..], epsilon = 1e-9);
        assert_relative_eq!(step.multipliers[0], 8.0 / 3.0, epsilon = 1e-8);
        // an equality is two rows
        let step = solve(&[1.0, 0.0, 0.0, 1.0], &[1.0, 1.0], &[1.0, 0.0, -1.0, 0.0], &[0.5, -0.5], 50.0, 10.0);
        assert_relative_eq!(step.d.as_slice(), &[0.5, -1.0][..], epsilon = 1e-9);
        assert_relative_eq!(step.multipliers[0] - step.multipliers[1], 1.5, epsilon = 1e-7);
        // a bound
        let step = solve(&[1.0, 0.0, 0.0, 1.0], &[-3.0, 0.1], &[], &[], 1.0, 1.0);
        assert_relative_eq!(step.d.as_slice(), &[1.0, -0.1][..], epsilon = 1e-9);
    }

    #[test]
    fn what_cannot_be_met_is_paid_for() {
        // x ≥ 5 within |x| ≤ 1: as far as it goes, the multiplier at its price
        let step = solve(&[1.0], &[0.0], &[1.0], &[5.0], 100.0, 1.0);
        assert_relative_eq!(step.d[0], 1.0, epsilon = 1e-9);
        assert_relative_eq!(step.multipliers[0], 100.0, epsilon = 1e-6);
        // x ≥ 1 and x ≤ -1: the cheaper side wins
        let step = solve(&[1.0], &[0.0], &[1.0, -1.0], &[1.0, 1.0], 100.0, 3.0);
        assert!(step.d[0].abs() <= 1.0 + 1e-9);
    }
}
