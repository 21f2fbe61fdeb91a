//! Newton's method for a flow, alone or on the way from one flow to another.
//!
//! On the way the fraction that is gone is damped together with the unknowns: the right-hand side of Newton's step holds
//! what the equations change with the rest of the way. That derivative is taken with one dual direction. The first steps
//! from a solution have the factors of this solution, and the last ones those of the step before.

use super::band::Band;
use super::chords::{Chords, ROUND_OFF};
use super::gas::Parameters;
use super::geometry::Geometry;
use super::kept::{self, Base};
use super::limits::{Factor, Limits, inside, limit};
use super::numbering::Unknowns;
use super::system::{Linearised, Problem};
use crate::differentiate::Tangent;
use std::sync::Arc;

type Direction = Tangent<1>;

/// Largest change of the Mach number of the onset flow in one step.
const MACH_STEP: f64 = 0.08;

/// Ratio to which the residual falls, or share of the way that is gone on, in steps of which something comes.
const PROGRESS: (f64, f64) = (0.8, 1e-3);

/// Residual below which one that grows does not mean that the iteration goes astray.
const SMALL: f64 = 0.05;

/// The last step at which an iteration came nearer to its end.
struct Progress {
    step: usize,
    gone: f64,
    residual: f64,
    /// The state there.
    state: Option<Unknowns>,
}

impl Progress {
    /// Whether nothing has come of more steps than are borne with, or worse than that.
    fn is_over(&mut self, step: usize, gone: f64, residual: f64, unknowns: &Unknowns, limits: &Limits) -> bool {
        let (fall, advance) = PROGRESS;
        if gone > self.gone + advance || residual < fall * self.residual {
            *self = Self { step, gone, residual, state: Some(unknowns.clone()) };
        }
        step - self.step > limits.patience || residual > limits.growth * self.residual.max(SMALL)
    }

    /// The end of an iteration that failed after some steps. The unknowns are left where it came nearer to its end for the
    /// last time: further steps have led away from a flow, and say nothing of it.
    fn failed(self, steps: usize, unknowns: &mut Unknowns) -> Ended {
        let Some(state) = self.state else { return Ended::failed(steps, f64::NAN) };
        *unknowns = state;
        Ended::failed(steps, self.residual)
    }

    /// The largest factor of the next step.
    fn largest_factor(&self, step: usize) -> f64 {
        CIRCLE.iter().fold(1.0, |factor, after| if step - self.step >= *after { 0.5 * factor } else { factor })
    }
}

/// Numbers of steps after which steps are halved while nothing comes of them: close to a shock they can go round in a
/// circle, which shorter ones leave.
const CIRCLE: [usize; 2] = [6, 12];
/// Factor by which a step is cut back where the equations have no value behind it, and the shortest one that is tried.
const SHORTER: (f64, f64) = (0.4, 1e-3);

/// A step that was taken, so that a shorter one can be taken instead.
struct Taken {
    before: Unknowns,
    change: Unknowns,
    factor: f64,
    /// How far the way was gone before, and whether the step advanced on it.
    gone: f64,
    advance: bool,
}

impl Taken {
    /// Shortens the step, and the way that it went; `false` where it is short already.
    fn shorten(&mut self, way: &mut Way, unknowns: &mut Unknowns) -> bool {
        let (shorter, shortest) = SHORTER;
        self.factor *= shorter;
        way.gone = self.gone;
        *unknowns = self.before.stepped(&self.change, self.factor);
        if self.advance {
            way.advance(self.factor);
        }
        self.factor > shortest
    }
}

/// The end of an iteration.
#[derive(Debug, Clone)]
pub(super) struct Ended {
    pub converged: bool,
    /// Number of steps. Those at the end with factors that are kept do not count.
    pub steps: usize,
    pub residual: f64,
    /// Where the factors of the last steps were made, if the iteration has converged.
    pub base: Option<Arc<Base>>,
}

impl Ended {
    fn converged(steps: usize, residual: f64, base: Arc<Base>) -> Self {
        Self { converged: true, steps, residual, base: Some(base) }
    }

    fn failed(steps: usize, residual: f64) -> Self {
        Self { converged: false, steps, residual, base: None }
    }
}

/// Where a way begins: parameters and nodes of the flow that is left.
#[derive(Debug, Clone, Copy)]
pub(super) struct From<'a> {
    pub parameters: Parameters,
    pub nodes: Option<&'a [[f64; 2]]>,
}

/// The way to a flow.
struct Way<'a> {
    to: &'a Problem,
    from: Option<From<'a>>,
    gone: f64,
}

fn between(a: f64, b: f64, share: f64) -> f64 {
    if share == 1.0 { b } else { a + share * (b - a) }
}

impl Way<'_> {
    /// The flow that is sought now.
    fn problem(&self) -> Problem {
        let mut problem = self.to.clone();
        let Some(from) = &self.from else { return problem };
        let numbers = from.parameters.numbers();
        let target = self.to.parameters.numbers();
        problem.parameters =
            Parameters::from_numbers(std::array::from_fn(|k| between(numbers[k], target[k], self.gone)));
        if let Some(nodes) = from.nodes {
            for (node, old) in problem.nodes.iter_mut().zip(nodes) {
                *node = [0, 1].map(|c| between(old[c], node[c], self.gone));
            }
        }
        problem
    }

    /// The factor of a step before the unknowns limit it; a step that advances on the way may not advance too far.
    fn factor(&self, advances: bool, limits: &Limits) -> Factor {
        let mut factor = Factor::full();
        if advances {
            let rest = 1.0 - self.gone;
            let mach = self.problem().parameters.mach;
            factor.limit((self.to.parameters.mach - mach).abs(), MACH_STEP);
            factor.limit(rest, limits.stride);
        }
        factor
    }

    /// Goes on by a share of what is left.
    fn advance(&mut self, share: f64) {
        self.gone = if share == 1.0 { 1.0 } else { self.gone + share * (1.0 - self.gone) };
        if self.gone > 0.9999 {
            self.gone = 1.0;
        }
    }

    /// Derivative of the residuals with respect to the fraction that is gone.
    fn direction(&self, problem: &Problem, unknowns: &Unknowns) -> Option<super::system::Residuals<Direction>> {
        let from = self.from.as_ref()?;
        let along = |at: f64, from: f64, to: f64| {
            let mut number = Direction::from_re(at);
            number.eps[0] = to - from;
            number
        };
        let (old, now, new) = (from.parameters.numbers(), problem.parameters.numbers(), self.to.parameters.numbers());
        let parameters = Parameters::from_numbers(std::array::from_fn(|k| along(now[k], old[k], new[k])));
        let nodes: Vec<[Direction; 2]> = (0..problem.nodes.len())
            .map(|i| {
                let old = from.nodes.map_or(self.to.nodes[i], |nodes| nodes[i]);
                [0, 1].map(|c| along(problem.nodes[i][c], old[c], self.to.nodes[i][c]))
            })
            .collect();
        problem.residuals_in(&nodes, &parameters, unknowns, |pass| problem.equations().pass(pass))
    }
}

/// Solves a flow from given unknowns, which hold the last state afterwards. `from` is the flow to leave, if the way is to
/// be gone step by step.
pub(super) fn solve(to: &Problem, from: Option<From>, unknowns: &mut Unknowns, limits: &Limits) -> Ended {
    go(Way { to, gone: if from.is_some() { 0.0 } else { 1.0 }, from }, unknowns, limits)
}

/// Solves a flow from the solution of a neighbouring one, whose unknowns hold the last state afterwards. The first step goes
/// along the tangent, with the factors of the last steps to the solution, which were made at `base`.
pub(super) fn solve_near(
    to: &Problem,
    solved: &Problem,
    base: &Arc<Base>,
    unknowns: &mut Unknowns,
    limits: &Limits,
) -> Ended {
    let from = From { parameters: solved.parameters, nodes: Some(&solved.nodes) };
    let mut way = Way { to, gone: 0.0, from: Some(from) };
    let departed = depart(&mut way, base, unknowns, limits);
    if let Some(at) = departed.as_ref().filter(|_| way.gone == 1.0)
        && let Some(residual) = Chords::of_neighbour(to, at, limits).finish(unknowns, &mut None)
    {
        return Ended::converged(1, residual, Arc::clone(base));
    }
    let mut ended = go(way, unknowns, limits);
    ended.steps += usize::from(departed.is_some());
    ended
}

/// Goes a way to its end.
fn go(mut way: Way, unknowns: &mut Unknowns, limits: &Limits) -> Ended {
    let mut spare: Option<Band> = None;
    let mut progress = Progress { step: 0, gone: way.gone, residual: f64::INFINITY, state: None };
    let mut taken: Option<Taken> = None;
    // that of the unknowns, where it is known
    let mut geometry: Option<Geometry<f64>> = None;
    for steps in 0..limits.steps {
        let problem = way.problem();
        let band = spare.take().map_or_else(|| kept::zeros(&problem.grid), Band::cleared);
        let Some(mut at) = problem.linearise_in(band, unknowns, geometry.take()) else {
            return progress.failed(steps, unknowns);
        };
        let residual = at.residuals.largest();
        // written so that NaN is one
        if !residual.is_finite() {
            spare = Some(at.band);
            if taken.as_mut().is_some_and(|step| step.shorten(&mut way, unknowns)) {
                continue;
            }
            return progress.failed(steps, unknowns);
        }
        if residual < limits.tolerance && way.gone == 1.0 {
            let base = Arc::new(Base { problem: problem.clone(), unknowns: unknowns.clone() });
            kept::keep(&base, at);
            return Ended::converged(steps, residual, base);
        }
        if progress.is_over(steps, way.gone, residual, unknowns, limits) {
            return progress.failed(steps, unknowns);
        }
        let advance = way.gone < 1.0 && residual < limits.hold;
        if advance {
            add_direction(&way, &problem, unknowns, &mut at);
        }
        let mut factor = way.factor(advance, limits);
        factor.limit(1.0, progress.largest_factor(steps));
        let Some((change, (next, of_next))) = step(&problem, unknowns, &mut at, limits.relaxed, &mut factor) else {
            return progress.failed(steps, unknowns);
        };
        let before = std::mem::replace(unknowns, next);
        let (factor, gone) = (factor.0, way.gone);
        if advance {
            way.advance(factor);
        } else {
            geometry = Some(of_next);
        }
        if way.gone == 1.0 && factor == 1.0 && !advance {
            let tiny = change.largest() < ROUND_OFF && residual < 1e-6;
            let chords = Chords::after(&problem, &at, limits, change.clone(), residual);
            // what Newton's steps do not change any more is converged to round-off
            let end = match tiny {
                true => Some(largest_residual(&problem, unknowns)),
                false => chords.finish(unknowns, &mut geometry),
            };
            if let Some(end) = end {
                let base = Arc::new(Base { problem, unknowns: before });
                kept::keep_factors(&base, Arc::new(at));
                let ended = Ended::converged(steps + 1, end, base);
                return Ended { converged: !tiny || end <= ROUND_OFF, ..ended };
            }
        }
        taken = Some(Taken { before, change, factor, gone, advance });
        spare = Some(at.band);
    }
    if progress.step + 1 == limits.steps {
        // the last step may have come nearer still
        return Ended::failed(limits.steps, progress.residual);
    }
    progress.failed(limits.steps, unknowns)
}

/// A step of Newton's method within its limits, and the unknowns behind it with their geometry; the system is left factorised.
fn step(
    problem: &Problem,
    unknowns: &Unknowns,
    at: &mut Linearised,
    relaxed: bool,
    factor: &mut Factor,
) -> Option<(Unknowns, (Unknowns, Geometry<f64>))> {
    let Linearised { band, residuals, areas } = at;
    let change = band.factorised_step(&residuals.stations, &residuals.globals)?;
    if !change.largest().is_finite() {
        return None;
    }
    limit(problem, unknowns, &change, relaxed, factor);
    let next = inside(problem, unknowns, &change, areas, factor)?;
    Some((change, next))
}

fn largest_residual(problem: &Problem, unknowns: &Unknowns) -> f64 {
    problem.residuals(unknowns, &mut None).map_or(f64::NAN, |r| r.largest())
}

/// Takes a solution towards that of a neighbouring flow by the tangent, with the factors made at `base`. The result is these
/// factors, or `None` where there is no tangent; the solution is where it was then.
fn depart(way: &mut Way, base: &Arc<Base>, unknowns: &mut Unknowns, limits: &Limits) -> Option<Arc<Linearised>> {
    let at = kept::factorised(base)?;
    let problem = way.problem();
    let direction = way.direction(&problem, unknowns)?;
    let slopes: Vec<Vec<f64>> = direction.stations.iter().map(|s| s.iter().map(|v| v.eps[0]).collect()).collect();
    let change = at.band.step(&slopes, &direction.globals.map(|v| v.eps[0]))?;
    let mut factor = way.factor(true, limits);
    limit(&problem, unknowns, &change, limits.relaxed, &mut factor);
    (*unknowns, _) = inside(&problem, unknowns, &change, &at.areas, &mut factor)?;
    way.advance(factor.0);
    Some(at)
}

/// Adds what the equations change on the rest of the way to the right-hand side.
fn add_direction(way: &Way, problem: &Problem, unknowns: &Unknowns, at: &mut Linearised) {
    let Some(direction) = way.direction(problem, unknowns) else { return };
    let rest = 1.0 - way.gone;
    let along = |value: f64, direction: &Direction| value + rest * direction.eps[0];
    for (values, direction) in at.residuals.stations.iter_mut().zip(&direction.stations) {
        values.iter_mut().zip(direction).for_each(|(value, d)| *value = along(*value, d));
    }
    for (value, d) in at.residuals.globals.iter_mut().zip(&direction.globals) {
        *value = along(*value, d);
    }
}
