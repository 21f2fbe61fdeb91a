//! Newton's method on the coupled system, with step limits.

use super::chord::{self, Evaluated};
use super::duals::gradient;
use super::system::{Change, Linearised, Reduced, System};
use super::transport::Profiles;
use super::unknowns::{Numbering, Side, Unknowns};
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

/// Growth of the norm of the residuals that a step may bring, and the norm below which it may grow at will.
const GROWTH: f64 = 1.3;
const SMALL: f64 = 0.3;
/// Lengths of one step tried.
const SHORTER: usize = 4;

/// Largest logarithm of Hk - 1: far beyond any layer, and short of an overflow.
const LARGEST_LOG_SHAPE: f64 = 8.0;

/// Changes by which the unknowns are measured, and how many of these a step may take at most: a longer one is tried before
/// it is taken, so that this need only keep it within what the closure is made for.
const FREEDOM: f64 = 3.0;
const LOG_THETA: f64 = 0.4;
const LOG_SHAPE: f64 = 0.4;
const AMPLIFICATION: f64 = 6.0;
const LOG_STRESS: f64 = 1.0;
const LOG_SPEED: f64 = 0.25;

/// The largest factor of `change` that keeps every unknown within the limits of one step.
fn admissible(system: &System, at: &Linearised, profiles: &Profiles, unknowns: &Unknowns, change: &Change) -> f64 {
    let mut factor: f64 = 1.0;
    let mut limit = |step: f64, bound: f64| {
        if step.abs() > bound * factor.recip() {
            factor = factor.min(bound / step.abs());
        }
    };
    for (k, change_here) in change.stations.iter().enumerate() {
        let [theta, shape, third, speed] = match at.numbering.on_side(k) {
            // laminar states move with the stations through the layer, turbulent ones with the stations
            Some((side, j)) if j < at.numbering.laminar => {
                let x = &at.positions.abscissas[side.index()][j];
                let log_step = (0..3).map(|g| gradient(x)[g] * change.globals[g]).sum::<f64>() / x.re;
                profiles.material(k, change_here, log_step)
            }
            _ => *change_here,
        };
        limit(theta, FREEDOM * LOG_THETA);
        limit(shape, FREEDOM * LOG_SHAPE);
        limit(third, FREEDOM * if at.numbering.regime(k) == Regime::Laminar { AMPLIFICATION } else { LOG_STRESS });
        limit(speed, FREEDOM * LOG_SPEED);
    }
    limit(change.globals[0], 0.02);
    for side in Side::BOTH {
        limit(change.globals[1 + side.index()], room(system, unknowns, side, change));
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
        state.log_shape = (state.log_shape + factor * shape).min(LARGEST_LOG_SHAPE);
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

/// Length of a change, every unknown measured by a usual change of one step.
fn size(system: &System, at: &Linearised, unknowns: &Unknowns, change: &Change) -> f64 {
    let mut sum = 0.0;
    for (k, [theta, shape, third, speed]) in change.stations.iter().enumerate() {
        let third = third / if at.numbering.regime(k) == Regime::Laminar { AMPLIFICATION } else { LOG_STRESS };
        sum += (theta / LOG_THETA).powi(2) + (shape / LOG_SHAPE).powi(2) + third * third + (speed / LOG_SPEED).powi(2);
    }
    let count = 4.0 * change.stations.len() as f64;
    let mut globals = (change.globals[0] / 0.02).powi(2);
    for side in Side::BOTH {
        globals += (change.globals[1 + side.index()] / room(system, unknowns, side, change)).powi(2);
    }
    (sum / count + globals).sqrt()
}

/// The unknowns after a step, the layer staying where it is when the stations move.
pub(crate) fn carried(system: &System, unknowns: &Unknowns, change: &Change, factor: f64) -> Unknowns {
    let total = system.section.map.total;
    let profiles = Profiles::new(system.layout, unknowns, total);
    profiles.carried(system.layout, &moved(system, unknowns, change, factor), total)
}

/// The largest factor of `change` within the limits of one step.
pub(crate) fn admissible_factor(system: &System, at: &Linearised, unknowns: &Unknowns, change: &Change) -> f64 {
    let profiles = Profiles::new(system.layout, unknowns, system.section.map.total);
    admissible(system, at, &profiles, unknowns, change)
}

/// A scalar product of changes, every unknown measured by a usual change of one step.
pub(crate) struct Metric {
    numbering: Numbering,
    transition: [f64; 2],
}

impl Metric {
    pub fn new(system: &System, unknowns: &Unknowns) -> Self {
        Self { numbering: Numbering::new(system.layout), transition: unknowns.transition.map(|x| 0.3 * x) }
    }

    pub fn dot(&self, a: &Change, b: &Change) -> f64 {
        let mut sum = 0.0;
        for (k, (a, b)) in a.stations.iter().zip(&b.stations).enumerate() {
            let third = if self.numbering.regime(k) == Regime::Laminar { AMPLIFICATION } else { LOG_STRESS };
            for (i, scale) in [LOG_THETA, LOG_SHAPE, third, LOG_SPEED].into_iter().enumerate() {
                sum += a[i] * b[i] / (scale * scale);
            }
        }
        let mut globals = a.globals[0] * b.globals[0] / (0.02 * 0.02);
        for side in 0..2 {
            globals += a.globals[1 + side] * b.globals[1 + side] / self.transition[side].powi(2);
        }
        sum / (4 * a.stations.len()) as f64 + globals
    }
}

/// The step shortened until what it leaves to do, by the same Jacobian, is no more than there was (natural monotonicity;
/// Deuflhard, "Newton Methods for Nonlinear Problems", 2004, section 3.3), and the residuals have not grown much.
///
/// Each length is tried with the layer staying where it is when the stations move, and with the layer moving along:
/// the one suits long moves of transition, the other what is sharp and close to it.
fn limited(
    system: &System,
    reduced: &Reduced,
    at: &Linearised,
    profiles: &Profiles,
    unknowns: &Unknowns,
    change: &Change,
    mut factor: f64,
) -> Unknowns {
    let wanted = size(system, at, unknowns, change);
    let bound = (GROWTH * at.norm()).max(SMALL);
    let good = |next: &Unknowns| {
        let there = Evaluated::new(system, next);
        there.norm() <= bound && size(system, at, unknowns, &reduced.solve(&there.residuals())) <= wanted
    };
    for _ in 0..SHORTER {
        let moving = moved(system, unknowns, change, factor);
        let staying = profiles.carried(system.layout, &moving, system.section.map.total);
        if good(&staying) {
            return staying;
        }
        if good(&moving) {
            return moving;
        }
        factor *= 0.3;
    }
    moved(system, unknowns, change, factor)
}

/// Iterates from `start` until the largest residual is below `tolerance`.
pub(crate) fn solve(system: &System, start: Unknowns, tolerance: f64, limit: usize) -> Converged {
    solve_within(system, start, tolerance, limit, PATIENCE, f64::INFINITY)
}

/// The same; gives up after `patience` iterations without progress.
pub(crate) fn solve_patiently(
    system: &System,
    start: Unknowns,
    tolerance: f64,
    limit: usize,
    patience: usize,
) -> Converged {
    solve_within(system, start, tolerance, limit, patience, f64::INFINITY)
}

/// The same from a solution nearby; gives up at once where transition would move farther than `reach` in the first
/// step, in lengths of its side.
pub(crate) fn solve_nearby(system: &System, start: Unknowns, tolerance: f64, limit: usize, reach: f64) -> Converged {
    solve_within(system, start, tolerance, limit, PATIENCE, reach)
}

fn solve_within(
    system: &System,
    start: Unknowns,
    tolerance: f64,
    limit: usize,
    patience: usize,
    reach: f64,
) -> Converged {
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
        let Some(reduced) = Reduced::new(&at) else {
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged: false };
        };
        let change = reduced.step();
        if !change.is_finite() {
            drop(reduced);
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged: false };
        }
        let far = |side: Side| change.globals[1 + side.index()].abs() > reach * length(system, &unknowns, side);
        if iteration == 0 && Side::BOTH.into_iter().any(far) {
            return Converged { unknowns, linearised: at, residual, iterations: 0, converged: false };
        }
        let norm = at.norm();
        if norm < 0.9 * best.0 {
            best = (norm, iteration);
        }
        if iteration > best.1 + patience || (norm < ROUND_OFF && norm > 0.5 * best.0 && iteration > best.1) {
            let converged = residual <= ROUND_OFF.min(100.0 * tolerance);
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged };
        }
        let profiles = Profiles::new(system.layout, &unknowns, system.section.map.total);
        let factor = admissible(system, &at, &profiles, &unknowns, &change);
        let next =
            if factor == 1.0 { chord::follow(system, &reduced, &unknowns, &change, norm, tolerance) } else { None };
        if let Some(next) = next {
            at = system.linearise(&next);
            (unknowns, residual) = (next, at.residual());
            continue;
        }
        unknowns = limited(system, &reduced, &at, &profiles, &unknowns, &change, factor);
        at = system.linearise(&unknowns);
        residual = at.residual();
    }
    Converged { unknowns, linearised: at, residual, iterations: limit, converged: false }
}

/// As [`solve`], with every state put back onto the boundary-layer equations while the speeds are far apart.
pub(crate) fn solve_projected(system: &System, start: Unknowns, tolerance: f64, limit: usize) -> Converged {
    let mut unknowns = start;
    let mut at = system.linearise(&unknowns);
    for iteration in 0..limit {
        let residual = at.residual();
        if !residual.is_finite() || at.norm() > 1e3 {
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged: false };
        }
        if at.norm() < NEAR {
            let mut end = solve(system, unknowns.clone(), tolerance, 15);
            if end.converged {
                end.iterations += iteration;
                return end;
            }
        }
        let Some(change) = Reduced::new(&at).map(|reduced| reduced.step()).filter(Change::is_finite) else {
            return Converged { unknowns, linearised: at, residual, iterations: iteration, converged: false };
        };
        let profiles = Profiles::new(system.layout, &unknowns, system.section.map.total);
        let factor = admissible(system, &at, &profiles, &unknowns, &change);
        let moving = moved(system, &unknowns, &change, factor);
        unknowns = system.project(&profiles.carried(system.layout, &moving, system.section.map.total));
        at = system.linearise(&unknowns);
    }
    let residual = at.residual();
    Converged { unknowns, linearised: at, residual, iterations: limit, converged: false }
}

/// Norm of the residuals from which on Newton's method needs no help.
const NEAR: f64 = 1e-2;
/// Largest admissible step of the transition point of a side.
fn room(system: &System, unknowns: &Unknowns, side: Side, change: &Change) -> f64 {
    let length = length(system, unknowns, side);
    let x = unknowns.transition[side.index()];
    let room = if change.globals[1 + side.index()] < 0.0 { 0.3 * x } else { 0.5 * (length - x) + 1e-3 * length };
    room.min(0.1 * length)
}
