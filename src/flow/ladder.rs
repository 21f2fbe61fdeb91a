//! Ways to a converged flow where the direct one fails, cheapest first: other numbers of stations, then branches of
//! solutions from conditions that are easier.

use super::analysis::Case;
use super::arclength::Parameter;
use super::continuation::Place;
use super::coupled::layout::Layout;
use super::coupled::newton::{self, Converged};
use super::coupled::response::FlowResponse;
use super::coupled::system::System;
use super::coupled::transport::resample;
use super::coupled::unknowns::Unknowns;
use super::panel::outline::Outline;
use super::panel::polar::Straight;
use super::solution::Attempt;

/// Work after which the search ends, in Newton iterations with all stations, and that of the last hope behind it.
const BUDGET: f64 = 1150.0;
const LAST_HOPE: f64 = 100.0;
/// Iterations of one attempt.
const PROJECTED: usize = 18;
pub(super) const DIRECT: usize = 25;
/// Iterations without progress after which an attempt is given up: fewer than elsewhere, there are others.
pub(super) const PATIENCE: usize = 5;
/// Residual of the solutions that are only a start.
pub(super) const TOLERANCE: f64 = 1e-5;
/// Laminar stations of the coarser and finer layouts tried, over those wanted.
const LAYOUTS: [f64; 2] = [0.6, 0.8];
const MORE_LAYOUTS: [f64; 2] = [0.45, 1.25];
/// The same, as a last hope.
const SPARE_LAYOUTS: [f64; 4] = [0.9, 0.7, 1.1, 0.35];
/// Stations of the layouts on which branches are followed, over those wanted.
const BRANCH_LAYOUTS: [f64; 2] = [0.6, 1.0];
/// Angles of attack from which branches are followed, in degrees from the one wanted, positive to higher lift by
/// magnitude.
const NEAR: [f64; 2] = [-2.0, -4.0];
const FAR: [f64; 3] = [-8.0, 2.0, 4.0];
const ANGLES_WITH_TRIPS: [f64; 2] = [-4.0, -8.0];
/// Temporary trips from which to start, over the lengths of the sides.
const EARLY_TRIP: f64 = 0.02;

/// The search for one operating point.
pub(super) struct Ladder<'a> {
    pub(super) case: &'a Case<'a>,
    pub(super) flow: &'a FlowResponse,
    pub(super) stagnation: f64,
    /// Sign of the lift without a layer.
    lift: f64,
    attempts: Vec<Attempt>,
    work: f64,
    limit: f64,
    /// A solution with other numbers of stations from which none with those wanted was reached.
    spare: Option<(Layout, Unknowns)>,
}

/// What a search found: the solution and the layout of its stations.
pub(super) type Found = (Converged, Layout);

impl<'a> Ladder<'a> {
    /// For a flow of which `attempts` have been made.
    pub fn new(case: &'a Case<'a>, flow: &'a FlowResponse, attempts: Vec<Attempt>) -> Self {
        let stagnation = case.system(flow, &case.condition, &case.layout).start().stagnation;
        let lift = circulation(&case.section.response.panels.outline, &flow.inviscid).signum();
        Self { case, flow, stagnation, lift, attempts, work: 0.0, limit: BUDGET, spare: None }
    }

    /// Tries everything; `None` where nothing converged. With it what was tried.
    pub fn climb(mut self) -> (Option<Found>, Vec<Attempt>) {
        let found = self
            .other_layouts(&LAYOUTS)
            .or_else(|| self.by_angles(&NEAR))
            .or_else(|| self.other_layouts(&MORE_LAYOUTS))
            .or_else(|| self.by_trips())
            .or_else(|| self.by_angles_with_trips())
            .or_else(|| self.by_angles(&FAR));
        let found = match found {
            Some(end) => Some((end, self.case.layout.clone())),
            None => self.with_other_stations(),
        };
        (found, self.attempts)
    }

    /// A last hope with more layouts; then the flow with other numbers of stations than those wanted, where that is all
    /// there is.
    fn with_other_stations(&mut self) -> Option<Found> {
        if self.spare.is_none() {
            self.limit = self.work + LAST_HOPE;
            if let Some(end) = self.other_layouts(&SPARE_LAYOUTS) {
                return Some((end, self.case.layout.clone()));
            }
        }
        let (layout, start) = self.spare.take()?;
        let case = self.case;
        let system = case.system(self.flow, &case.condition, &layout);
        let end = newton::solve(&system, start, case.settings.tolerance, DIRECT);
        self.note(&format!("{} laminar stations for good", layout.laminar.len()), &end);
        end.converged.then_some((end, layout))
    }

    pub(super) fn work(&self) -> f64 {
        self.work
    }

    pub(super) fn exhausted(&self) -> bool {
        self.work > self.limit
    }

    pub(super) fn note(&mut self, what: &str, end: &Converged) {
        self.attempts.push(Attempt::of(what, end));
        self.work += (end.iterations + 1) as f64 * self.effort(end.unknowns.stations.len());
    }

    /// Work of an iteration with so many stations, over that with those wanted.
    fn effort(&self, stations: usize) -> f64 {
        let Layout { wake, .. } = self.case.layout;
        (stations as f64 / (2 * self.case.layout.side() + wake) as f64).powi(2)
    }

    /// The two quick ways: directly, and with a march after each step.
    fn quick(&mut self, system: &System, start: Unknowns, tolerance: f64, what: &str) -> Option<Converged> {
        let end = newton::solve_patiently(system, start.clone(), tolerance, DIRECT, PATIENCE);
        self.note(what, &end);
        if end.converged {
            return Some(end);
        }
        let end = newton::solve_projected(system, start, tolerance, PROJECTED);
        self.note(&format!("{what}, a march after each step"), &end);
        end.converged.then_some(end)
    }

    /// Solves with other numbers of stations and takes that as a start.
    fn other_layouts(&mut self, shares: &[f64]) -> Option<Converged> {
        shares.iter().find_map(|share| {
            if self.exhausted() {
                return None;
            }
            let wanted = &self.case.layout;
            let laminar = ((wanted.laminar.len() as f64 * share) as usize).max(15);
            let layout = Layout::new(laminar, wanted.turbulent.len(), wanted.wake);
            let case = self.case;
            let system = case.system(self.flow, &case.condition, &layout);
            let what = format!("{laminar} laminar stations");
            let end = self.quick(&system, system.march(&system.start()), TOLERANCE, &what)?;
            self.land(&layout, &end.unknowns, &what)
        })
    }

    /// From a solution on another layout to the one wanted.
    fn land(&mut self, layout: &Layout, from: &Unknowns, what: &str) -> Option<Converged> {
        let case = self.case;
        let start = resample(layout, &case.layout, from, case.section.response.map.total);
        let system = case.system(self.flow, &case.condition, &case.layout);
        let end = self.quick(&system, start, case.settings.tolerance, &format!("from {what}"));
        if end.is_none() && self.spare.as_ref().is_none_or(|(l, _)| l.laminar.len() < layout.laminar.len()) {
            self.spare = Some((layout.clone(), from.clone()));
        }
        end
    }

    fn fewer(&self, share: f64) -> Layout {
        let Layout { laminar, turbulent, wake } = &self.case.layout;
        let fewer = |stations: &[f64]| ((stations.len() as f64 * share).round() as usize).max(12);
        Layout::new(fewer(laminar), fewer(turbulent), *wake)
    }

    /// Solves at a neighbouring angle of attack and follows the branch from there.
    fn by_angles(&mut self, angles: &[f64]) -> Option<Converged> {
        angles.iter().find_map(|by| {
            let turned = by * self.lift;
            let what = format!("{turned:+} degrees");
            self.by_place(&what, Place { turned, ..Place::default() }, &[Parameter::Angle])
        })
    }

    /// Solves with trips close to the nose and follows the branch along which they move downstream.
    fn by_trips(&mut self) -> Option<Converged> {
        let what = format!("trips at {EARLY_TRIP} of the sides");
        self.by_place(&what, Place { trips: EARLY_TRIP, ..Place::default() }, &[Parameter::Trips])
    }

    /// The same from a neighbouring angle of attack: first the angle changes, then the trips move.
    fn by_angles_with_trips(&mut self) -> Option<Converged> {
        ANGLES_WITH_TRIPS.into_iter().find_map(|by| {
            let turned = by * self.lift;
            let what = format!("trips at {EARLY_TRIP} of the sides, {turned:+} degrees");
            let place = Place { turned, trips: EARLY_TRIP };
            self.by_place(&what, place, &[Parameter::Angle, Parameter::Trips])
        })
    }

    /// Solves at a place that is easier than the one wanted and follows branches along one parameter after the other.
    fn by_place(&mut self, what: &str, place: Place, parameters: &[Parameter]) -> Option<Converged> {
        BRANCH_LAYOUTS.into_iter().find_map(|share| {
            if self.exhausted() {
                return None;
            }
            let layout = self.fewer(share);
            let mut place = place;
            let mut at = self.start_of_branch(&layout, place, what)?;
            for &parameter in parameters {
                at = self.follow_branch(&layout, what, at, (parameter, place))?;
                place = parameter.at(0.0, &place);
            }
            self.land(&layout, &at, what)
        })
    }

    /// Work of so many iterations that make no attempt of their own.
    pub(super) fn spend(&mut self, iterations: f64, layout: &Layout) {
        self.work += iterations * self.effort(2 * layout.side() + layout.wake);
    }
}

/// Circulation of the strengths at the nodes; that of positive lift is positive.
fn circulation(outline: &Outline, strengths: &[f64]) -> f64 {
    let mean = |j: usize| 0.5 * (strengths[j] + strengths[j + 1]);
    (0..outline.len() - 1).map(|j| mean(j) * Straight::new(outline.panel(j)).length).sum()
}

#[cfg(test)]
mod tests {
    use super::super::analysis::PanelledSection;
    use super::super::condition::{Condition, Incidence, Settings};
    use super::super::panel::outline::TrailingEdge;
    use super::super::testcases::naca_symmetric;
    use super::*;

    #[test]
    fn what_the_last_hope_finds_is_kept() {
        let section = PanelledSection::new(&naca_symmetric(0.12, 0.0025, 121), TrailingEdge::Blunt).unwrap();
        let condition = Condition::new(Incidence::Alpha(0.05), 1e6);
        let layout = Layout::new(40, 30, section.response.wake_distances.len());
        let case = Case { section: &section, condition, settings: Settings::default(), layout };
        let flow = FlowResponse::new(&section.response, 0.05);
        // the budget spent, nothing but the last hope is left
        let ladder = Ladder { work: 2.0 * BUDGET, ..Ladder::new(&case, &flow, Vec::new()) };
        let (found, attempts) = ladder.climb();
        let (end, layout) = found.unwrap();
        assert!(end.converged && end.residual <= case.settings.tolerance);
        assert_eq!(layout.laminar.len(), 40);
        assert_eq!(attempts.last().unwrap().what, "from 36 laminar stations");
    }
}
