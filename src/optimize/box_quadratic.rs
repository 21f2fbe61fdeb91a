//! The lowest point of a convex quadratic in a box.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Slope, relative to the largest at the start, that counts as none.
const FLAT: f64 = 1e-13;

/// The minimum of `gᵀp + ½ pᵀAp` over `lower ≤ p ≤ upper`, sought from `start`; `None` where A is not positive
/// definite to round-off.
///
/// Each pass minimises over the variables that no bound holds, and projects that point onto the box where the quadratic
/// falls by it; else it goes as far as the first bound on the way (Bertsekas, SIAM J. Control Optim. 20, 1982, with the
/// steps of a primal active-set method as a safeguard). Bounds that are reached are met exactly.
pub(super) fn minimum_in_box(
    matrix: &DMatrix<f64>,
    gradient: &DVector<f64>,
    lower: &[f64],
    upper: &[f64],
    start: &DVector<f64>,
) -> Option<DVector<f64>> {
    let n = gradient.len();
    let mut at = DVector::from_fn(n, |k, _| start[k].clamp(lower[k], upper[k]));
    let mut slope = gradient + matrix * &at;
    let flat = FLAT * gradient.amax().max(slope.amax());
    // variables that a degenerate step has met a bound of
    let mut blocked = vec![false; n];
    for _ in 0..10 * n + 50 {
        let held = |k: usize| (at[k] <= lower[k] && slope[k] >= 0.0) || (at[k] >= upper[k] && slope[k] <= 0.0);
        let free: Vec<usize> = (0..n).filter(|&k| !blocked[k] && !held(k)).collect();
        if free.iter().all(|&k| slope[k].abs() <= flat) {
            if blocked.iter().any(|b| *b) {
                blocked.fill(false);
                if (0..n).all(|k| held(k) || slope[k].abs() <= flat || free.contains(&k)) {
                    break;
                }
            } else {
                break;
            }
        }
        let step = newton_step(matrix, &slope, &free)?;
        let projected = projected(&at, &free, &step, lower, upper);
        let fall = fall(matrix, &slope, &(&projected - &at));
        let (share, bound) = room(&at, &free, &step, lower, upper);
        if fall > 0.0 && (share >= 1.0 || fall >= 0.5 * share * -dot_free(&slope, &free, &step)) {
            at = projected;
            blocked.fill(false);
        } else {
            for (&k, s) in free.iter().zip(&step) {
                at[k] += share * s;
            }
            match bound {
                Some((k, value)) => {
                    at[k] = value;
                    if share == 0.0 {
                        blocked[k] = true;
                    } else {
                        blocked.fill(false);
                    }
                }
                None => blocked.fill(false),
            }
        }
        slope = gradient + matrix * &at;
    }
    Some(at)
}

/// The step to the minimum over the free variables.
fn newton_step(matrix: &DMatrix<f64>, slope: &DVector<f64>, free: &[usize]) -> Option<Vec<f64>> {
    let part = DMatrix::from_fn(free.len(), free.len(), |i, j| matrix[(free[i], free[j])]);
    let right = DVector::from_fn(free.len(), |i, _| -slope[free[i]]);
    Some(Cholesky::new(part)?.solve(&right).as_slice().to_vec())
}

fn dot_free(slope: &DVector<f64>, free: &[usize], step: &[f64]) -> f64 {
    free.iter().zip(step).map(|(&k, s)| slope[k] * s).sum()
}

/// The end of a step, moved into the box.
fn projected(at: &DVector<f64>, free: &[usize], step: &[f64], lower: &[f64], upper: &[f64]) -> DVector<f64> {
    let mut end = at.clone();
    for (&k, s) in free.iter().zip(step) {
        end[k] = (at[k] + s).clamp(lower[k], upper[k]);
    }
    end
}

/// By how much the quadratic falls along a step from a point with the given slope.
fn fall(matrix: &DMatrix<f64>, slope: &DVector<f64>, step: &DVector<f64>) -> f64 {
    -slope.dot(step) - 0.5 * step.dot(&(matrix * step))
}

/// The share of a step up to the first bound, at most 1, and that bound: variable and value.
fn room(at: &DVector<f64>, free: &[usize], step: &[f64], lower: &[f64], upper: &[f64]) -> (f64, Option<(usize, f64)>) {
    let mut least = (1.0, None);
    for (&k, &s) in free.iter().zip(step) {
        let bound = if s > 0.0 { upper[k] } else { lower[k] };
        let share = (bound - at[k]) / s;
        if s != 0.0 && share < least.0 {
            least = (share.max(0.0), Some((k, bound)));
        }
    }
    least
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_first_order_conditions_hold(
            entries in proptest::collection::vec(-1.0f64..1.0, 64),
            g in proptest::collection::vec(-3.0f64..3.0, 8),
            width in proptest::collection::vec(0.0f64..2.0, 16),
        ) {
            let root = DMatrix::from_vec(8, 8, entries);
            let matrix = root.tr_mul(&root) + DMatrix::identity(8, 8) * 1e-3;
            let gradient = DVector::from_vec(g);
            let lower: Vec<f64> = width[..8].iter().map(|w| -w).collect();
            let mut upper = width[8..].to_vec();
            upper[3] = f64::INFINITY;
            upper[5] = 0.0;
            let p = minimum_in_box(&matrix, &gradient, &lower, &upper, &DVector::from_element(8, 0.3)).unwrap();
            let slope = &gradient + &matrix * &p;
            for k in 0..8 {
                prop_assert!(lower[k] <= p[k] && p[k] <= upper[k]);
                let small = 1e-10 * gradient.amax().max(1.0);
                let held = (p[k] == lower[k] && slope[k] >= -small) || (p[k] == upper[k] && slope[k] <= small);
                prop_assert!(held || slope[k].abs() <= small, "{k}: {} {}", p[k], slope[k]);
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_is_refused() {
        let matrix = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, -1.0]);
        let gradient = DVector::from_vec(vec![1.0, 1.0]);
        assert!(minimum_in_box(&matrix, &gradient, &[-1.0; 2], &[1.0; 2], &DVector::zeros(2)).is_none());
    }
}
