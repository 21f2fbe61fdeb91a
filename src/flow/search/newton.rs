//! Newton's method with limited steps.

use super::chord::{Followed, Kept};
use super::family::{Effort, End, Equations, Residuals};
use crate::flow::layer::transport::Profiles;
use crate::flow::layer::{Change, Side, Unknowns};

/// A residual below this that no longer falls is round-off: the flow is converged.
const ROUND_OFF: f64 = 1e-8;

/// Factor by which a step may raise the norm of the residuals.
const GROWTH: f64 = 2.0;
/// Norm of the residuals below which a step may raise it at will.
const SMALL: f64 = 1.0;
/// Length over that of a step which the next step may have. Steps that move transition across a sharp feature are
/// followed by a longer one now and then, and are the way all the same: of nine hundred random flows about real
/// sections this saves a ninth to a quarter of the work, and finds as many as a factor of one.
const LONGER: f64 = 1.5;
/// Number of lengths that are tried for one step.
const SHORTER: usize = 4;
/// Norm of the residuals below which Newton's method needs no help.
const NEAR: f64 = 1e-2;

impl<E: Equations> Kept<'_, E> {
    /// Shortens a step until the next step, by the current Jacobian, is not much longer than this one (natural
    /// monotonicity; Deuflhard, "Newton Methods for Nonlinear Problems", 2004, section 3.3, in a lenient form), and the
    /// residuals have not grown much.
    ///
    /// Each length is tried twice when the stations move: with the layer staying where it is, and with the layer moving
    /// along. The first suits long moves of transition, the second suits features that are sharp and close to
    /// transition.
    fn limited(&self, profiles: &Profiles, unknowns: &Unknowns, change: &Change, mut factor: f64) -> (Unknowns, f64) {
        let layer = self.system.layer();
        let allowed = LONGER * layer.size(unknowns, change);
        let bound = (GROWTH * self.norm).max(SMALL);
        let good = |next: &Unknowns| {
            let state = self.system.evaluate(next);
            let there = self.system.residuals_of(&state);
            there.norm() <= bound && layer.size(unknowns, &self.system.solve(self.at, self.factors, there)) <= allowed
        };
        for _ in 0..SHORTER {
            let moving = layer.moved(unknowns, change, factor);
            let staying = layer.staying(profiles, moving.clone());
            if good(&staying) {
                return (staying, factor);
            }
            if good(&moving) {
                return (moving, factor);
            }
            factor *= 0.3;
        }
        (layer.moved(unknowns, change, factor), factor)
    }
}

/// Iterates from `start` until the largest residual is below the tolerance, or the effort is spent.
pub(crate) fn solve<E: Equations>(system: &E, start: Unknowns, effort: Effort) -> End<E::Evaluated> {
    let Effort { tolerance, iterations: limit, patience, reach, shortest } = effort;
    // a residual that falls no further, but is small, is round-off
    let round_off = ROUND_OFF.min(100.0 * tolerance);
    let layer = system.layer();
    let mut unknowns = start;
    let mut at = system.linearise(&unknowns);
    let mut best = (f64::INFINITY, 0);
    for iteration in 0..=limit {
        let residuals = system.residuals_at(&at);
        let (residual, norm) = (residuals.largest(), residuals.norm());
        if residual <= tolerance {
            return End { unknowns, state: system.state_at(&at), residual, iterations: iteration, converged: true };
        }
        let stopped = |unknowns, at, converged| {
            let state = system.state_at(at);
            End { unknowns, state, residual, iterations: iteration, converged }
        };
        if iteration == limit || !residual.is_finite() {
            return stopped(unknowns, &at, residual <= round_off);
        }
        let Some(factors) = system.factorise(&at) else { return stopped(unknowns, &at, false) };
        let change = system.solve(&at, &factors, residuals);
        let far = |side: Side| {
            change.transition[side.index()].abs() > reach * unknowns.side_length(side, layer.surface.total)
        };
        if !change.is_finite() || (iteration == 0 && Side::BOTH.into_iter().any(far)) {
            return stopped(unknowns, &at, false);
        }
        if norm < 0.9 * best.0 {
            best = (norm, iteration);
        }
        if iteration > best.1 + patience || (norm < ROUND_OFF && norm > 0.5 * best.0 && iteration > best.1) {
            return stopped(unknowns, &at, residual <= round_off);
        }
        let profiles = layer.profiles(&unknowns);
        let factor = layer.admissible_factor(&profiles, &unknowns, &change);
        let kept = Kept { system, at: &at, factors: &factors, norm };
        let quick = if factor == 1.0 { kept.follow(&unknowns, &change, tolerance) } else { None };
        unknowns = match quick {
            Some(Followed { unknowns, arrived: true }) => {
                let state = system.evaluate(&unknowns);
                let residual = system.residuals_of(&state).largest();
                if residual <= tolerance {
                    return End { unknowns, state, residual, iterations: iteration + 1, converged: true };
                }
                unknowns
            }
            Some(Followed { unknowns, .. }) => unknowns,
            None => {
                let (next, factor) = kept.limited(&profiles, &unknowns, &change, factor);
                if factor < shortest {
                    return stopped(unknowns, &at, false);
                }
                next
            }
        };
        at = system.linearise(&unknowns);
    }
    let residual = system.residuals_at(&at).largest();
    End { unknowns, state: system.state_at(&at), residual, iterations: limit, converged: false }
}

/// Iterates like [`solve`], but puts every state back onto the boundary-layer equations while the speeds are far from
/// converged.
pub(crate) fn solve_projected<E: Equations>(
    system: &E,
    start: Unknowns,
    tolerance: f64,
    limit: usize,
) -> End<E::Evaluated> {
    let layer = system.layer();
    let mut unknowns = start;
    let mut at = system.linearise(&unknowns);
    for iteration in 0..limit {
        let residuals = system.residuals_at(&at);
        let (residual, norm) = (residuals.largest(), residuals.norm());
        if norm < NEAR {
            let mut end = solve(system, unknowns.clone(), Effort::new(tolerance, 15));
            if end.converged {
                end.iterations += iteration;
                return end;
            }
        }
        let step = if residual.is_finite() && norm <= 1e3 {
            system.factorise(&at).map(|factors| system.solve(&at, &factors, residuals)).filter(Change::is_finite)
        } else {
            None
        };
        let Some(change) = step else {
            return End { unknowns, state: system.state_at(&at), residual, iterations: iteration, converged: false };
        };
        let profiles = layer.profiles(&unknowns);
        let factor = layer.admissible_factor(&profiles, &unknowns, &change);
        unknowns = layer.project(&layer.staying(&profiles, layer.moved(&unknowns, &change, factor)));
        at = system.linearise(&unknowns);
    }
    let residual = system.residuals_at(&at).largest();
    End { unknowns, state: system.state_at(&at), residual, iterations: limit, converged: false }
}
