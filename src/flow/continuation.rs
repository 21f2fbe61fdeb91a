//! Continuation: a flow that converges, carried in steps to one that does not converge directly.

use super::analysis::Case;
use super::boundary_layer::gas::Gas;
use super::coupled::layout::Layout;
use super::coupled::newton::{self, Converged};
use super::coupled::response::FlowResponse;
use super::coupled::system::System;
use super::coupled::unknowns::Unknowns;
use super::ladder::Ladder;
use std::borrow::Cow;

/// First and smallest step of a way that is one long.
const FIRST_STEP: f64 = 0.05;
const SMALLEST_STEP: f64 = 0.008;
/// Growth of the step after a success, and its share after a failure.
const LONGER: f64 = 1.5;
const SHORTER: f64 = 0.4;
/// Shares of the rest of the way to try at once where the branch of solutions ends.
const JUMPS: [f64; 3] = [0.2, 0.5, 1.0];
/// Iterations after which a continuation is given up.
const WORK: f64 = 250.0;
/// Iterations of one step, and those without progress.
const ITERATIONS: usize = 25;
const PATIENCE: usize = 8;
/// On the way there.
const TOLERANCE: f64 = 1e-5;

/// A condition on the way to the one wanted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// Angle of attack less that wanted, in degrees.
    pub turned: f64,
    /// Temporary trips, over the lengths of the sides.
    pub trips: f64,
    /// Reynolds number over that wanted.
    pub reynolds: f64,
}

impl Default for Place {
    /// The condition wanted.
    fn default() -> Self {
        Self { turned: 0.0, trips: 1.0, reynolds: 1.0 }
    }
}

impl Ladder<'_> {
    /// Follows a path of conditions to t = 1, from a solution at t = 0 or from a search there.
    pub(super) fn travel(
        &mut self,
        layout: &Layout,
        what: &str,
        from: Option<Unknowns>,
        path: impl Fn(f64) -> Place,
    ) -> Option<Unknowns> {
        if self.exhausted() {
            return None;
        }
        let limit = self.work() + WORK * self.effort(2 * layout.side() + layout.wake);
        let mut from = match from {
            Some(from) => from,
            None => self.at(path(0.0), layout, what, None)?.unknowns,
        };
        let (mut t, mut step) = (0.0, FIRST_STEP);
        let (mut jumps, mut jumping) = (JUMPS.into_iter(), false);
        while !self.exhausted() && self.work() < limit {
            let next = f64::min(t + step, 1.0);
            let what = format!("{what}, {:.1} % of the way", 100.0 * next);
            match self.at(path(next), layout, &what, Some(&from)) {
                Some(end) if next == 1.0 => return Some(end.unknowns),
                Some(end) => {
                    step = if jumping { FIRST_STEP } else { LONGER * step };
                    (t, from, jumping) = (next, end.unknowns, false);
                }
                None if jumping || SHORTER * step < SMALLEST_STEP => {
                    jumping = true;
                    step = jumps.next()? * (1.0 - t);
                }
                None => step *= SHORTER,
            }
        }
        None
    }

    fn at(&mut self, place: Place, layout: &Layout, what: &str, from: Option<&Unknowns>) -> Option<Converged> {
        let case = self.case;
        let flow = match place.turned {
            0.0 => Cow::Borrowed(self.flow),
            turned => Cow::Owned(FlowResponse::new(&case.section.response, self.flow.alpha + turned.to_radians())),
        };
        let system = System {
            trips: temporary(case, self.stagnation, place.trips),
            gas: Gas::new(case.condition.mach, case.condition.reynolds * place.reynolds),
            ..case.system(&flow, &case.condition, layout)
        };
        let Some(from) = from else {
            return self.quick(&system, system.march(&system.start()), TOLERANCE, what);
        };
        let end = newton::solve_patiently(&system, from.clone(), TOLERANCE, ITERATIONS, PATIENCE);
        self.note(what, &end);
        end.converged.then_some(end)
    }
}

/// Arc lengths of trips a fraction of each side behind the stagnation point; the case's own where those come first.
fn temporary(case: &Case, stagnation: f64, fraction: f64) -> [Option<f64>; 2] {
    let own = case.trip_arcs();
    if fraction >= 1.0 {
        return own;
    }
    let total = case.section.response.map.total;
    let place = |own: Option<f64>, length: f64, sign: f64| match own {
        Some(own) if (own - stagnation).abs() < fraction * length => Some(own),
        _ => Some(stagnation - sign * fraction * length),
    };
    [place(own[0], stagnation, 1.0), place(own[1], total - stagnation, -1.0)]
}
