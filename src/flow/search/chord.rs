//! Cheap steps near the solution with a Jacobian that is kept.
//!
//! A full Newton step linearises, eliminates and factorises; near the solution the last factors still suffice.
//! Broyden's rank-one corrections (Broyden 1965; in the form of Kelley, "Iterative Methods for Linear and Nonlinear
//! Equations", 1995, chapter 7) learn from every step how the Jacobian has changed, so that the residuals fall ever
//! faster. Only residuals are evaluated, in `f64`.

use super::family::{Equations, Residuals};
use crate::flow::layer::{Change, Side, Unknowns, is_inside};

/// Largest share of the residuals that a step may leave to be worth following.
const CONTRACTION: f64 = 0.5;
/// Largest number of steps with one Jacobian.
const STEPS: usize = 16;

/// The unknowns after a whole step.
fn shifted(unknowns: &Unknowns, change: &Change) -> Unknowns {
    let mut next = unknowns.clone();
    next.add(change, 1.0);
    next
}

/// Whether stagnation and transition stand at places where stations can be laid.
fn sensible(system: &impl Equations, unknowns: &Unknowns) -> bool {
    Side::BOTH.into_iter().all(|side| {
        let length = unknowns.side_length(side, system.layer().surface.total);
        length > 0.0 && is_inside(unknowns.transition[side.index()], length)
    })
}

/// Where steps with one Jacobian led.
pub(super) struct Followed {
    pub unknowns: Unknowns,
    /// Whether the residuals should be below the tolerance there.
    pub arrived: bool,
}

/// A factorised Jacobian with the norm of the residuals at the unknowns where it was taken.
pub(super) struct Kept<'a, E: Equations> {
    pub system: &'a E,
    /// The equations linearised where the Jacobian was taken.
    pub at: &'a E::At,
    pub factors: &'a E::Factors,
    /// Euclidean norm of the residuals there.
    pub norm: f64,
}

impl<E: Equations> Kept<'_, E> {
    /// Follows the step `first` from `unknowns`, where the Jacobian was taken, as long as every step leaves less than
    /// [`CONTRACTION`] of the residuals. The result is `None` where not even the first step does.
    ///
    /// Where the residuals came below `tolerance`, one more step is taken without a check of the result.
    pub fn follow(&self, unknowns: &Unknowns, first: &Change, tolerance: f64) -> Option<Followed> {
        let mut steps = vec![first.clone()];
        let mut squares = vec![first.dot(first)];
        let mut reached: Option<Unknowns> = None;
        let mut before = self.norm;
        for _ in 0..STEPS {
            let last = steps.len() - 1;
            let candidate = shifted(reached.as_ref().unwrap_or(unknowns), &steps[last]);
            if !sensible(self.system, &candidate) {
                break;
            }
            let state = self.system.evaluate(&candidate);
            let residuals = self.system.residuals_of(&state);
            let now = residuals.norm();
            if !(now <= CONTRACTION * before) {
                break;
            }
            let mut next = self.system.solve(self.at, self.factors, residuals);
            for k in 0..last {
                let factor = steps[k].dot(&next) / squares[k];
                next.add(&steps[k + 1], factor);
            }
            let along = steps[last].dot(&next) / squares[last];
            next.stretch(1.0 / (1.0 - along));
            if !next.is_finite() {
                break;
            }
            let largest = residuals.largest();
            // what the next step will leave, by the contraction so far and ten times that
            if largest <= tolerance || 10.0 * largest * (now / before) <= tolerance {
                return Some(Followed { unknowns: shifted(&candidate, &next), arrived: true });
            }
            before = now;
            reached = Some(candidate);
            squares.push(next.dot(&next));
            steps.push(next);
        }
        reached.map(|unknowns| Followed { unknowns, arrived: false })
    }
}
