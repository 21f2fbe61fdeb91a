//! Newton's method on the coupled system, with step limits.

use super::chord;
use super::system::{Change, Linearised, Reduced, System};
use super::unknowns::{Side, Unknowns};
use crate::flow::boundary_layer::station::Regime;

/// How an iteration ended.
#[derive(Debug, Clone)]
pub(crate) struct Converged {
    pub unknowns: Unknowns,
    pub linearised: Linearised,
    pub residual: f64,
    pub iterations: usize,
    pub converged: bool,
}

/// Iterations without progress after which an attempt is given up.
const PATIENCE: usize = 12;

/// A residual below this that no longer falls is round-off: the flow is converged.
const ROUND_OFF: f64 = 1e-8;

/// Largest changes of one step.
const LOG_THETA: f64 = 0.4;
const LOG_SHAPE: f64 = 0.4;
const AMPLIFICATION: f64 = 6.0;
const LOG_STRESS: f64 = 1.0;
const LOG_SPEED: f64 = 0.25;

/// The largest factor of `change` that keeps every unknown within the limits of one step.
fn admissible(system: &System, at: &Linearised, unknowns: &Unknowns, change: &Change) -> f64 {
    let mut factor: f64 = 1.0;
    let mut limit = |step: f64, bound: f64| {
        if step.abs() > bound * factor.recip() {
            factor = factor.min(bound / step.abs());
        }
    };
    for (k, [theta, shape, third, speed]) in change.stations.iter().enumerate() {
        limit(*theta, LOG_THETA);
        limit(*shape, LOG_SHAPE);
        limit(*third, if at.numbering.regime(k) == Regime::Laminar { AMPLIFICATION } else { LOG_STRESS });
        limit(*speed, LOG_SPEED);
    }
    limit(change.globals[0], 0.02);
    for side in Side::BOTH {
        let step = change.globals[1 + side.index()];
        let length = length(system, unknowns, side);
        let x = unknowns.transition[side.index()];
        let room = if step < 0.0 { 0.3 * x } else { 0.5 * (length - x) + 1e-3 * length };
        limit(step, room.min(0.1 * length));
    }
    factor
}

fn length(system: &System, unknowns: &Unknowns, side: Side) -> f64 {
    match side {
        Side::Upper => unknowns.stagnation,
        Side::Lower => system.section.map.total - unknowns.stagnation,
    }
}

fn moved(system: &System, unknowns: &Unknowns, change: &Change, factor: f64) -> Unknowns {
    let mut next = unknowns.clone();
    for (state, [theta, shape, third, speed]) in next.stations.iter_mut().zip(&change.stations) {
        state.log_theta += factor * theta;
        state.log_shape = (state.log_shape + factor * shape).min(4.0);
        state.third += factor * third;
        state.log_speed += factor * speed;
    }
    let total = system.section.map.total;
    next.stagnation = (next.stagnation + factor * change.globals[0]).clamp(0.02 * total, 0.98 * total);
    for side in Side::BOTH {
        let length = length(system, &next, side);
        let x = &mut next.transition[side.index()];
        *x = (*x + factor * change.globals[1 + side.index()]).clamp(1e-3 * length, (1.0 - 1e-5) * length);
    }
    next
}

/// Iterates from `start` until the largest residual is below `tolerance`.
pub(crate) fn solve(system: &System, start: Unknowns, tolerance: f64, limit: usize) -> Converged {
    let mut unknowns = start;
    let mut at = system.linearise(&unknowns);
    let mut residual = at.residual();
    let mut best = (f64::INFINITY, 0);
    for iteration in 0..=limit {
        if residual <= tolerance {
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged: true };
        }
        if iteration == limit || !residual.is_finite() {
            let converged = residual <= ROUND_OFF.min(100.0 * tolerance);
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged };
        }
        let reduced = Reduced::new(&at);
        let Some(change) = reduced.as_ref().map(Reduced::step).filter(Change::is_finite) else {
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged: false };
        };
        let norm = at.norm();
        if norm < 0.9 * best.0 {
            best = (norm, iteration);
        }
        if iteration > best.1 + PATIENCE || (norm < ROUND_OFF && norm > 0.5 * best.0 && iteration > best.1) {
            let converged = residual <= ROUND_OFF.min(100.0 * tolerance);
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged };
        }
        let mut factor = admissible(system, &at, &unknowns, &change);
        let kept = reduced.filter(|_| factor == 1.0);
        if let Some(next) = kept.and_then(|r| chord::follow(system, &r, &unknowns, &change, norm, tolerance)) {
            at = system.linearise(&next);
            (unknowns, residual) = (next, at.residual());
            continue;
        }
        let mut halvings = 0;
        loop {
            let candidate = moved(system, &unknowns, &change, factor);
            let next = system.linearise(&candidate);
            let grown = next.norm();
            if halvings == 8 || grown <= 1.3 * norm {
                (unknowns, at) = (candidate, next);
                break;
            }
            factor *= 0.5;
            halvings += 1;
        }
        residual = at.residual();
    }
    Converged { unknowns, linearised: at, residual, iterations: limit, converged: false }
}
