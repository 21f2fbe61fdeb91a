//! Limits of the steps of Newton's method.

use super::geometry::Geometry;
use super::numbering::{ALPHA, LAYER, SPEED, STAGNATION, Sheet, TRANSITION, Unknowns};
use super::system::Problem;
use crate::flow::layer::Regime;

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
    /// Largest number of steps of which nothing comes.
    pub patience: usize,
    /// Ratio of the residual to the lowest one above which the iteration is given up; small residuals may grow.
    pub growth: f64,
    /// Whether small speeds may change by more than a quarter of themselves.
    pub relaxed: bool,
}

impl Limits {
    /// The usual limits: the whole way at once, relaxed speeds, and patience with a residual that grows.
    pub fn new(steps: usize, tolerance: f64) -> Self {
        Self { steps, tolerance, stride: 1.0, hold: 0.5, patience: PATIENCE, growth: f64::INFINITY, relaxed: true }
    }
}

/// Number of steps of which nothing comes until an iteration is given up that nothing better can take the place of.
pub(super) const PATIENCE: usize = 20;
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

/// The factor of a step, cut down by limits one after the other.
pub(super) struct Factor(pub f64);

impl Factor {
    /// The factor of a whole step.
    pub fn full() -> Self {
        Self(1.0)
    }

    pub fn is_full(&self) -> bool {
        self.0 == 1.0
    }

    pub fn limit(&mut self, change: f64, largest: f64) {
        if change * self.0 > largest {
            self.0 = largest / change;
        }
    }
}

/// Cuts the factor so that no unknown changes too much.
pub(super) fn limit(problem: &Problem, unknowns: &Unknowns, change: &Unknowns, relaxed: bool, factor: &mut Factor) {
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
                // amplification does nothing to a flow whose transition is kept
                if k == 2 && laminar && problem.fixed_transition.is_some() {
                    continue;
                }
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

/// The unknowns after the step, cut back until every tube keeps a reasonable area and temperature, and their geometry.
pub(super) fn inside(
    problem: &Problem,
    unknowns: &Unknowns,
    change: &Unknowns,
    areas: &[f64],
    factor: &mut Factor,
) -> Option<(Unknowns, Geometry<f64>)> {
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
            ratios.iter().zip(areas).all(|(new, old)| new / old > least && new / old < most).then_some(geometry)
        };
        if warm && let Some(geometry) = fits() {
            return Some((next, geometry));
        }
        factor.0 *= CUT.0;
    }
    None
}
