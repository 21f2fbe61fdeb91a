//! Newton's method on the coupled system, with step limits.

use super::chord;
use super::duals::gradient;
use super::project::Keep;
use super::system::{Change, Linearised, Reduced, System};
use super::transport::Profiles;
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
fn admissible(system: &System, at: &Linearised, profiles: &Profiles, unknowns: &Unknowns, change: &Change) -> f64 {
    let mut factor: f64 = 1.0;
    let mut limit = |step: f64, bound: f64| {
        if step.abs() > bound * factor.recip() {
            factor = factor.min(bound / step.abs());
        }
    };
    for (k, change_here) in change.stations.iter().enumerate() {
        let [theta, shape, third, speed] = match at.numbering.on_side(k) {
            Some((side, j)) => {
                let x = &at.positions.abscissas[side.index()][j];
                let log_step = (0..3).map(|g| gradient(x)[g] * change.globals[g]).sum::<f64>() / x.re;
                profiles.material(k, change_here, log_step)
            }
            None => *change_here,
        };
        limit(theta, LOG_THETA);
        limit(shape, LOG_SHAPE);
        limit(third, if at.numbering.regime(k) == Regime::Laminar { AMPLIFICATION } else { LOG_STRESS });
        limit(speed, LOG_SPEED);
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

fn moved(system: &System, profiles: &Profiles, unknowns: &Unknowns, change: &Change, factor: f64) -> Unknowns {
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
    profiles.carry(system.layout, &mut next, total);
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
        let profiles = Profiles::new(system.layout, &unknowns, system.section.map.total);
        let mut factor = admissible(system, &at, &profiles, &unknowns, &change);
        let kept = reduced.filter(|_| factor == 1.0);
        if let Some(next) = kept.and_then(|r| chord::follow(system, &r, &unknowns, &change, norm, tolerance)) {
            at = system.linearise(&next);
            (unknowns, residual) = (next, at.residual());
            continue;
        }
        let mut halvings = 0;
        loop {
            let candidate = moved(system, &profiles, &unknowns, &change, factor);
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

/// As [`solve`], with every state put back onto the boundary-layer equations while the speeds are far apart.
pub(crate) fn solve_projected(system: &System, start: Unknowns, keep: Keep, tolerance: f64, limit: usize) -> Converged {
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
        (unknowns, _) = match keep {
            Keep::Nearest => {
                let factor = admissible(system, &at, &profiles, &unknowns, &change);
                system.project(&moved(system, &profiles, &unknowns, &change, factor), keep, &[])
            }
            Keep::Mass => defect_step(system, &at, &profiles, &unknowns, change),
        };
        at = system.linearise(&unknowns);
    }
    let residual = at.residual();
    Converged { unknowns, linearised: at, residual, iterations: limit, converged: false }
}

/// Norm of the residuals from which on Newton's method needs no help.
const NEAR: f64 = 1e-2;
/// Largest change of the logarithm of a mass defect in one step.
const LOG_MASS: f64 = 0.5;

/// A step of the mass defects and of the global unknowns, the states following by the boundary-layer equations.
fn defect_step(
    system: &System,
    at: &Linearised,
    profiles: &Profiles,
    unknowns: &Unknowns,
    mut change: Change,
) -> (Unknowns, usize) {
    let steps: Vec<f64> = at
        .log_mass
        .iter()
        .zip(&change.stations)
        .map(|(by, step)| by.iter().zip(step).map(|(a, b)| a * b).sum())
        .collect();
    let largest = steps.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let mut factor = (LOG_MASS / largest).min(1.0);
    for side in Side::BOTH {
        factor = factor.min(room(system, unknowns, side, &change) / change.globals[1 + side.index()].abs());
    }
    // the states are but a first guess here
    let bounds = [LOG_THETA, LOG_SHAPE, 0.5 * AMPLIFICATION, LOG_SPEED];
    for station in &mut change.stations {
        for (step, bound) in station.iter_mut().zip(bounds) {
            *step = step.clamp(-bound / factor, bound / factor);
        }
    }
    let mut best = None;
    for _ in 0..5 {
        let log_mass: Vec<f64> = at.mass.iter().zip(&steps).map(|(m, step)| m.ln() + factor * step).collect();
        let (next, failures) =
            system.project(&moved(system, profiles, unknowns, &change, factor), Keep::Mass, &log_mass);
        if failures == 0 {
            return (next, 0);
        }
        best = Some((next, failures));
        factor *= 0.5;
    }
    best.unwrap_or_else(|| (unknowns.clone(), 0))
}

/// Largest admissible step of the transition point of a side.
fn room(system: &System, unknowns: &Unknowns, side: Side, change: &Change) -> f64 {
    let length = length(system, unknowns, side);
    let x = unknowns.transition[side.index()];
    let room = if change.globals[1 + side.index()] < 0.0 { 0.3 * x } else { 0.5 * (length - x) + 1e-3 * length };
    room.min(0.1 * length)
}
