//! Newton's method for a flow, alone or on the way from one flow to another.
//!
//! On the way the fraction that is gone is damped together with the unknowns: the right-hand side of Newton's step holds
//! what the equations change with the rest of the way. That derivative is taken with one dual direction.

use super::band::Band;
use super::gas::Parameters;
use super::numbering::{ALPHA, LAYER, SPEED, STAGNATION, Sheet, TRANSITION, Unknowns};
use super::outputs::OUTPUTS;
use super::system::{Linearised, Problem};
use crate::differentiate::Tangent;
use crate::flow::layer::Regime;

type Direction = Tangent<1>;

/// Limits of the iteration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Largest number of steps.
    pub steps: usize,
    /// Residual at which the iteration ends.
    pub tolerance: f64,
    /// Largest share of the way in one step.
    pub stride: f64,
    /// Residual above which the way is not gone on.
    pub hold: f64,
    /// Whether small speeds may change by more than a quarter of themselves.
    pub relaxed: bool,
}

/// Largest change of the Mach number of the onset flow in one step.
const MACH_STEP: f64 = 0.08;
/// Largest change of the angle of attack in one step.
const ANGLE_STEP: f64 = 0.02;
/// Largest change of the place of the stagnation point in one step.
const STAGNATION_STEP: f64 = 0.01;
/// Largest change of the place of transition in one step.
const TRANSITION_STEP: f64 = 0.02;
/// Largest relative change of a speed in one step.
const SPEED_CHANGE: f64 = 0.25;
/// Speed below which the relaxed limit counts against this speed.
const SLOW: f64 = 0.5;
/// Largest relative fall of a speed in one step.
const SPEED_FALL: f64 = 0.6;
/// Largest changes of the unknowns of the layer in one step, with the amplification factor last.
const LAYER_CHANGES: [f64; 5] = [0.5, 0.5, 1.0, 0.8, 8.0];
/// Smallest and largest ratio of the areas of the tubes after and before a step.
const AREA_CHANGES: [f64; 2] = [0.6, 1.6];
/// Square of the largest local Mach number.
const LARGEST_MACH2: f64 = 6.0;
/// Factor by which a step is cut back while areas change too much, and the number of times.
const CUT: (f64, usize) = (0.6, 14);
/// Largest change of any unknown, and largest residual after it, of a flow that is converged to round-off.
const ROUND_OFF: f64 = 1e-9;

/// Number of steps within which the residual falls to the second number of itself, or the way goes on by the third, in an
/// iteration that leads anywhere.
const PATIENCE: (usize, f64, f64) = (20, 0.8, 1e-3);

/// The last step at which an iteration came nearer to its end.
struct Progress {
    step: usize,
    gone: f64,
    residual: f64,
}

impl Progress {
    /// Whether nothing has come of many steps.
    fn is_over(&mut self, step: usize, gone: f64, residual: f64) -> bool {
        let (steps, fall, advance) = PATIENCE;
        if gone > self.gone + advance || residual < fall * self.residual {
            *self = Self { step, gone, residual };
        }
        step - self.step > steps
    }
}

/// The end of an iteration.
#[derive(Debug, Clone)]
pub(super) struct Ended {
    pub converged: bool,
    pub steps: usize,
    pub residual: f64,
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

/// The factor of a step, cut down by limits one after the other.
struct Factor(f64);

impl Factor {
    fn limit(&mut self, change: f64, largest: f64) {
        if change * self.0 > largest {
            self.0 = largest / change;
        }
    }
}

/// Solves a flow from given unknowns, which hold the last state afterwards. `from` is the flow to leave, if the way is to
/// be gone step by step.
pub(super) fn solve(to: &Problem, from: Option<From>, unknowns: &mut Unknowns, limits: &Limits) -> Ended {
    let mut way = Way { to, gone: if from.is_some() { 0.0 } else { 1.0 }, from };
    let mut residual = f64::NAN;
    let mut spare: Option<Band> = None;
    let mut progress = Progress { step: 0, gone: way.gone, residual: f64::INFINITY };
    for steps in 0..limits.steps {
        let problem = way.problem();
        let band = spare.take().map_or_else(|| Band::new(&problem.grid, OUTPUTS), Band::cleared);
        let Some(mut at) = problem.linearise_in(band, unknowns, |_| {}) else {
            return Ended { converged: false, steps, residual };
        };
        residual = at.residuals.largest();
        // written so that NaN ends it
        if !residual.is_finite() {
            return Ended { converged: false, steps, residual };
        }
        if residual < limits.tolerance && way.gone == 1.0 {
            return Ended { converged: true, steps, residual };
        }
        if progress.is_over(steps, way.gone, residual) {
            return Ended { converged: false, steps, residual };
        }
        let advance = way.gone < 1.0 && residual < limits.hold;
        if advance {
            add_direction(&way, &problem, unknowns, &mut at);
        }
        let failed = Ended { converged: false, steps, residual };
        if !at.band.factorise() {
            return failed;
        }
        let Some(change) = at.band.step(&at.residuals.globals).filter(|c| c.largest().is_finite()) else {
            return failed;
        };
        let mut factor = Factor(1.0);
        if advance {
            let rest = 1.0 - way.gone;
            factor.limit((to.parameters.mach - problem.parameters.mach).abs(), MACH_STEP);
            factor.limit(rest, limits.stride);
        }
        limit(&problem, unknowns, &change, limits.relaxed, &mut factor);
        let Some(next) = inside(&problem, unknowns, &change, &at.areas, &mut factor) else { return failed };
        *unknowns = next;
        spare = Some(at.band);
        if advance {
            way.gone = if factor.0 == 1.0 { 1.0 } else { way.gone + factor.0 * (1.0 - way.gone) };
            if way.gone > 0.9999 {
                way.gone = 1.0;
            }
        }
        let still = way.gone == 1.0 && factor.0 == 1.0 && !advance;
        if still && change.largest() < ROUND_OFF && residual < 1e-6 {
            let end = problem.residuals(unknowns).map_or(f64::NAN, |r| r.largest());
            return Ended { converged: end <= ROUND_OFF, steps: steps + 1, residual: end };
        }
    }
    Ended { converged: false, steps: limits.steps, residual }
}

/// Adds what the equations change on the rest of the way to the right-hand side.
fn add_direction(way: &Way, problem: &Problem, unknowns: &Unknowns, at: &mut Linearised) {
    let Some(direction) = way.direction(problem, unknowns) else { return };
    let rest = 1.0 - way.gone;
    let along = |value: f64, direction: &Direction| value + rest * direction.eps[0];
    for station in 0..at.residuals.stations.len() {
        let right: Vec<f64> = at.residuals.stations[station]
            .iter()
            .zip(&direction.stations[station])
            .map(|(&v, d)| along(v, d))
            .collect();
        at.band.set_residual(station, &right);
    }
    for (value, d) in at.residuals.globals.iter_mut().zip(&direction.globals) {
        *value = along(*value, d);
    }
}

/// Cuts the factor so that no unknown changes too much.
fn limit(problem: &Problem, unknowns: &Unknowns, change: &Unknowns, relaxed: bool, factor: &mut Factor) {
    let grid = &problem.grid;
    for station in 0..grid.count() {
        for tube in 0..if station + 1 < grid.count() { grid.tubes() } else { 0 } {
            let place = grid.speed(station, tube);
            let (q, dq) = (unknowns.at(place), change.at(place));
            let scale = if relaxed { q.max(SLOW) } else { q };
            factor.limit(dq.abs() / scale, SPEED_CHANGE);
            factor.limit(-dq / q, SPEED_FALL);
        }
        for sheet in grid.sheets(station) {
            let laminar = sheet != Sheet::Wake && grid.regime(station, sheet) == Regime::Laminar;
            let changes = change.layer(grid, station, sheet);
            for k in 0..LAYER {
                let largest = if k == 2 && laminar { LAYER_CHANGES[4] } else { LAYER_CHANGES[k] };
                factor.limit(changes[k].abs(), largest);
            }
        }
    }
    factor.limit(change.globals[STAGNATION].abs(), STAGNATION_STEP);
    factor.limit(change.globals[ALPHA].abs(), ANGLE_STEP);
    for g in TRANSITION {
        factor.limit(change.globals[g].abs(), TRANSITION_STEP);
    }
    debug_assert_eq!(SPEED, 3);
}

/// The unknowns after the step, cut back until every tube keeps a reasonable area and temperature.
fn inside(
    problem: &Problem,
    unknowns: &Unknowns,
    change: &Unknowns,
    areas: &[f64],
    factor: &mut Factor,
) -> Option<Unknowns> {
    let (grid, flow) = (&problem.grid, problem.flow());
    let [least, most] = AREA_CHANGES;
    for _ in 0..CUT.1 {
        let next = unknowns.stepped(change, factor.0);
        let speeds = (0..grid.count() - 1).flat_map(|i| next.stations[i][grid.speeds_start(i)..].iter());
        let cold = |q: &f64| {
            let mach2 = flow.mach2::<f64>(*q);
            flow.enthalpy::<f64>(*q) > 0.0 && mach2 < LARGEST_MACH2
        };
        let warm = speeds.into_iter().all(cold);
        let fits = || {
            let geometry = problem.geometry(&next)?;
            let ratios = problem.areas(&geometry);
            Some(ratios.iter().zip(areas).all(|(new, old)| new / old > least && new / old < most))
        };
        if warm && fits() == Some(true) {
            return Some(next);
        }
        factor.0 *= CUT.0;
    }
    None
}
