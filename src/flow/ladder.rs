//! Ways to a converged flow where the direct one fails, cheapest first.

use super::analysis::Case;
use super::continuation::Place;
use super::coupled::layout::Layout;
use super::coupled::newton::{self, Converged};
use super::coupled::project::Keep;
use super::coupled::response::FlowResponse;
use super::coupled::system::System;
use super::coupled::transport::resample;
use super::coupled::unknowns::Unknowns;
use super::solution::Attempt;

/// Work after which the search ends, in Newton iterations with all stations.
const BUDGET: f64 = 1200.0;
/// Iterations of one attempt.
const PROJECTED: usize = 18;
const DIRECT: usize = 25;
/// Laminar stations of the coarser and finer layouts tried, over those wanted.
const LAYOUTS: [f64; 4] = [0.6, 0.8, 0.45, 1.25];
/// Stations on the way along a continuation, over those wanted.
const FEWER: f64 = 0.6;
/// Neighbouring angles of attack tried, in degrees from the one wanted.
const NEAR: [f64; 4] = [-1.0, 1.0, -2.0, 2.0];
const FAR: [f64; 2] = [-4.0, 4.0];
const ANGLES_WITH_TRIPS: [f64; 4] = [-2.0, 2.0, -5.0, 5.0];
/// Reynolds numbers from which to start, over that wanted.
const THINNER: [f64; 2] = [3.0, 8.0];
/// Temporary trips from which to start, over the lengths of the sides.
const EARLY_TRIP: f64 = 0.02;

/// The search for one operating point.
pub(super) struct Ladder<'a> {
    pub(super) case: &'a Case<'a>,
    pub(super) flow: &'a FlowResponse,
    pub(super) stagnation: f64,
    attempts: Vec<Attempt>,
    work: f64,
}

impl<'a> Ladder<'a> {
    /// For a flow of which `attempts` have been made.
    pub fn new(case: &'a Case<'a>, flow: &'a FlowResponse, attempts: Vec<Attempt>) -> Self {
        let stagnation = case.system(flow, &case.condition, &case.layout).start().stagnation;
        Self { case, flow, stagnation, attempts, work: 0.0 }
    }

    /// Tries everything; `None` where nothing converged. With it what was tried.
    pub fn climb(mut self) -> (Option<Converged>, Vec<Attempt>) {
        let found = self
            .other_layouts()
            .or_else(|| self.neighbouring_angles(FEWER, &NEAR))
            .or_else(|| self.temporary_trips(FEWER))
            .or_else(|| self.temporary_trips(1.0))
            .or_else(|| self.higher_reynolds(FEWER))
            .or_else(|| self.angles_with_trips(FEWER))
            .or_else(|| self.neighbouring_angles(FEWER, &FAR))
            .or_else(|| self.neighbouring_angles(1.0, &NEAR));
        (found, self.attempts)
    }

    pub(super) fn exhausted(&self) -> bool {
        self.work > BUDGET
    }

    pub(super) fn work(&self) -> f64 {
        self.work
    }

    pub(super) fn note(&mut self, what: &str, end: &Converged) {
        self.attempts.push(Attempt::of(what, end));
        self.work += (end.iterations + 1) as f64 * self.effort(end.unknowns.stations.len());
    }

    /// Work of an iteration with so many stations, over that with those wanted.
    pub(super) fn effort(&self, stations: usize) -> f64 {
        let Layout { wake, .. } = self.case.layout;
        (stations as f64 / (2 * self.case.layout.side() + wake) as f64).powi(2)
    }

    /// The two quick ways: directly, and with a march after each step.
    pub(super) fn quick(&mut self, system: &System, start: Unknowns, tolerance: f64, what: &str) -> Option<Converged> {
        let end = newton::solve(system, start.clone(), tolerance, DIRECT);
        self.note(what, &end);
        if end.converged {
            return Some(end);
        }
        let end = newton::solve_projected(system, start, Keep::Nearest, tolerance, PROJECTED);
        self.note(&format!("{what}, a march after each step"), &end);
        end.converged.then_some(end)
    }

    /// Solves with other numbers of stations and takes that as a start.
    fn other_layouts(&mut self) -> Option<Converged> {
        LAYOUTS.into_iter().find_map(|share| {
            let wanted = &self.case.layout;
            let laminar = ((wanted.laminar.len() as f64 * share) as usize).max(15);
            let layout = Layout::new(laminar, wanted.turbulent.len(), wanted.wake);
            let case = self.case;
            let system = case.system(self.flow, &case.condition, &layout);
            let what = format!("{laminar} laminar stations");
            let end = self.quick(&system, system.march(&system.start()), 1e-5, &what)?;
            self.land(&layout, &end.unknowns, &what)
        })
    }

    /// From a solution on another layout to the one wanted.
    fn land(&mut self, layout: &Layout, from: &Unknowns, what: &str) -> Option<Converged> {
        let case = self.case;
        let start = resample(layout, &case.layout, from, case.section.response.map.total);
        let system = case.system(self.flow, &case.condition, &case.layout);
        self.quick(&system, start, case.settings.tolerance, &format!("from {what}"))
    }

    fn fewer(&self, share: f64) -> Layout {
        let Layout { laminar, turbulent, wake } = &self.case.layout;
        let fewer = |stations: &[f64]| ((stations.len() as f64 * share).round() as usize).max(12);
        Layout::new(fewer(laminar), fewer(turbulent), *wake)
    }

    /// Solves at a neighbouring angle of attack and goes from there in steps.
    fn neighbouring_angles(&mut self, share: f64, angles: &[f64]) -> Option<Converged> {
        let layout = self.fewer(share);
        angles.iter().find_map(|offset| {
            let what = format!("{offset:+} degrees");
            let end =
                self.travel(&layout, &what, None, |t| Place { turned: (1.0 - t) * offset, ..Place::default() })?;
            self.land(&layout, &end, &what)
        })
    }

    /// Solves with trips close to the nose and moves them downstream in steps.
    fn temporary_trips(&mut self, share: f64) -> Option<Converged> {
        let layout = self.fewer(share);
        self.trips_moved(&layout, None)
    }

    fn trips_moved(&mut self, layout: &Layout, from: Option<Unknowns>) -> Option<Converged> {
        let what = format!("trips at {EARLY_TRIP} of the sides");
        let end =
            self.travel(layout, &what, from, |t| Place { trips: EARLY_TRIP.powf(1.0 - t), ..Place::default() })?;
        self.land(layout, &end, &what)
    }

    /// The same, with the trips at a neighbouring angle of attack first.
    fn angles_with_trips(&mut self, share: f64) -> Option<Converged> {
        let layout = self.fewer(share);
        ANGLES_WITH_TRIPS.into_iter().find_map(|offset| {
            let what = format!("trips at {EARLY_TRIP} of the sides, {offset:+} degrees");
            let place = |t: f64| Place { turned: (1.0 - t) * offset, trips: EARLY_TRIP, ..Place::default() };
            let turned = self.travel(&layout, &what, None, place)?;
            self.trips_moved(&layout, Some(turned))
        })
    }

    /// Solves with a thinner layer, at a higher Reynolds number, and lets it thicken in steps.
    fn higher_reynolds(&mut self, share: f64) -> Option<Converged> {
        let layout = self.fewer(share);
        THINNER.into_iter().find_map(|thinner| {
            let what = format!("Reynolds number times {thinner}");
            let place = |t: f64| Place { reynolds: f64::powf(thinner, 1.0 - t), ..Place::default() };
            let end = self.travel(&layout, &what, None, place)?;
            self.land(&layout, &end, &what)
        })
    }
}
