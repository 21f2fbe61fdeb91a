//! Ways to a converged flow where the direct one fails, cheapest first: other numbers of stations, then branches of
//! solutions that start from easier conditions.

use super::branch::{Parameter, follow};
use super::budget::Budget;
use super::family::{Effort, End, Equations, Family};
use super::neighbour::{Neighbour, temporary_trips};
use super::newton;
use crate::flow::Attempt;
use crate::flow::layer::transport::resample;
use crate::flow::layer::{Layout, Unknowns};

/// Extra work granted when everything else has failed, in Newton iterations on the requested stations.
const LAST_HOPE: f64 = 100.0;
/// Largest number of iterations of an attempt with a march after each step.
const PROJECTED: usize = 18;
/// Largest number of iterations of a direct attempt.
const DIRECT: usize = 25;
/// Iterations without progress after which an attempt is given up. The number is smaller than elsewhere, because there
/// are other ways.
const PATIENCE: usize = 5;
/// Largest residual of solutions that serve only as a start.
pub(super) const TOLERANCE: f64 = 1e-5;
/// Laminar stations of the layouts that are tried first, over the requested number.
const LAYOUTS: [f64; 2] = [0.6, 0.8];
/// Laminar stations of the layouts that are tried next, over the requested number.
const MORE_LAYOUTS: [f64; 2] = [0.45, 1.25];
/// Laminar stations of the layouts that are tried as a last hope, over the requested number.
const SPARE_LAYOUTS: [f64; 4] = [0.9, 0.7, 1.1, 0.35];
/// Stations of the layouts on which branches are followed, over the requested number.
const BRANCH_LAYOUTS: [f64; 2] = [0.6, 1.0];
/// Angles of attack from which branches are followed first, in degrees from the requested one. Positive values lead to
/// lift of larger magnitude.
const NEAR: [f64; 2] = [-2.0, -4.0];
/// Angles of attack from which branches are followed last, with the units and the sign of [`NEAR`].
const FAR: [f64; 3] = [-8.0, 2.0, 4.0];
/// Angles of attack from which branches are followed with temporary trips, with the units and the sign of [`NEAR`].
const ANGLES_WITH_TRIPS: [f64; 2] = [-4.0, -8.0];
/// Distance of the temporary trips from the stagnation point at the start of a branch, over the lengths of the sides.
const EARLY_TRIP: f64 = 0.02;

/// Result of a search: the solution and the layout of the stations it stands on.
pub(crate) type Found<A> = (End<A>, Layout);

/// Tries everything for a flow after `attempts` have failed; `outer` is the outer flow at the requested angle.
///
/// The result is `None` where nothing converged. The list of all attempts comes with it.
pub(crate) fn climb<F: Family>(
    family: &F,
    outer: &F::Outer,
    attempts: Vec<Attempt>,
) -> (Option<Found<F::At>>, Vec<Attempt>) {
    Ladder { family, outer, budget: Budget::new(family.layout(), attempts, family.hope()), spare: None }.climb()
}

/// The search for one flow.
pub(super) struct Ladder<'a, F: Family> {
    pub family: &'a F,
    pub outer: &'a F::Outer,
    pub budget: Budget,
    /// A solution on another number of stations from which the requested number was not reached.
    pub spare: Option<(Layout, Unknowns)>,
}

impl<F: Family> Ladder<'_, F> {
    pub fn climb(mut self) -> (Option<Found<F::At>>, Vec<Attempt>) {
        let found = self
            .other_layouts(&LAYOUTS)
            .or_else(|| self.by_angles(&NEAR))
            .or_else(|| self.other_layouts(&MORE_LAYOUTS))
            .or_else(|| self.by_trips())
            .or_else(|| self.by_angles_with_trips())
            .or_else(|| self.by_angles(&FAR));
        let found = match found {
            Some(end) => Some((end, self.family.layout().clone())),
            None => self.with_other_stations(),
        };
        (found, self.budget.attempts)
    }

    /// Tries more layouts as a last hope, and then settles for the flow on another number of stations where there is
    /// one.
    fn with_other_stations(&mut self) -> Option<Found<F::At>> {
        let family = self.family;
        if self.spare.is_none() {
            self.budget.grant(LAST_HOPE * family.hope());
            if let Some(end) = self.other_layouts(&SPARE_LAYOUTS) {
                return Some((end, family.layout().clone()));
            }
        }
        let (layout, start) = self.spare.take()?;
        let end = {
            let system = family.equations(self.outer, &layout, family.trips());
            newton::solve(&system, start, Effort::new(family.tolerance(), DIRECT))
        };
        self.budget.note(&format!("{} laminar stations for good", layout.laminar.len()), &end);
        end.converged.then_some((end, layout))
    }

    /// Tries the two quick ways: Newton's method alone, and with a march after each step.
    fn quick(&mut self, system: &F::Equations<'_>, start: Unknowns, tolerance: f64, what: &str) -> Option<End<F::At>> {
        let effort = Effort { patience: PATIENCE, ..Effort::new(tolerance, DIRECT) };
        let end = newton::solve(system, start.clone(), effort);
        self.budget.note(what, &end);
        if end.converged {
            return Some(end);
        }
        let end = newton::solve_projected(system, start, tolerance, PROJECTED);
        self.budget.note(&format!("{what}, a march after each step"), &end);
        end.converged.then_some(end)
    }

    /// Solves on other numbers of stations and takes the solution as a start on the requested one.
    fn other_layouts(&mut self, shares: &[f64]) -> Option<End<F::At>> {
        let family = self.family;
        shares.iter().find_map(|share| {
            if self.budget.exhausted() {
                return None;
            }
            let wanted = family.layout();
            let laminar = ((wanted.laminar.len() as f64 * share) as usize).max(15);
            let layout = Layout::new(laminar, wanted.turbulent.len(), wanted.wake);
            let what = format!("{laminar} laminar stations");
            let unknowns = {
                let system = family.equations(self.outer, &layout, family.trips());
                self.quick(&system, system.march(), TOLERANCE, &what)?.unknowns
            };
            self.land(&layout, &unknowns, &what)
        })
    }

    /// Moves from a solution on another layout to one on the requested layout.
    fn land(&mut self, layout: &Layout, from: &Unknowns, what: &str) -> Option<End<F::At>> {
        let family = self.family;
        let system = family.equations(self.outer, family.layout(), family.trips());
        let start = resample(layout, family.layout(), from, family.surface());
        let end = self.quick(&system, start, family.tolerance(), &format!("from {what}"));
        if end.is_none() && self.spare.as_ref().is_none_or(|(l, _)| l.laminar.len() < layout.laminar.len()) {
            self.spare = Some((layout.clone(), from.clone()));
        }
        end
    }

    fn fewer(&self, share: f64) -> Layout {
        let Layout { laminar, turbulent, wake } = self.family.layout();
        let fewer = |stations: &[f64]| ((stations.len() as f64 * share).round() as usize).max(12);
        Layout::new(fewer(laminar), fewer(turbulent), *wake)
    }

    /// Solves at a neighbouring angle of attack and follows the branch from there.
    fn by_angles(&mut self, angles: &[f64]) -> Option<End<F::At>> {
        angles.iter().find_map(|by| {
            let turned = by * self.family.lift_sign();
            let what = format!("{turned:+} degrees");
            self.by_place(&what, Neighbour { turned, ..Neighbour::default() }, &[Parameter::Angle])
        })
    }

    /// Solves with trips close to the nose and follows the branch along which they move downstream.
    fn by_trips(&mut self) -> Option<End<F::At>> {
        let what = format!("trips at {EARLY_TRIP} of the sides");
        self.by_place(&what, Neighbour { trips: EARLY_TRIP, ..Neighbour::default() }, &[Parameter::Trips])
    }

    /// Solves with trips close to the nose at a neighbouring angle of attack. First the angle changes back, then the
    /// trips move downstream.
    fn by_angles_with_trips(&mut self) -> Option<End<F::At>> {
        ANGLES_WITH_TRIPS.into_iter().find_map(|by| {
            let turned = by * self.family.lift_sign();
            let what = format!("trips at {EARLY_TRIP} of the sides, {turned:+} degrees");
            let place = Neighbour { turned, trips: EARLY_TRIP };
            self.by_place(&what, place, &[Parameter::Angle, Parameter::Trips])
        })
    }

    /// Solves at a place that is easier than the requested one and follows branches along one parameter after the
    /// other.
    fn by_place(&mut self, what: &str, place: Neighbour, parameters: &[Parameter]) -> Option<End<F::At>> {
        BRANCH_LAYOUTS.into_iter().find_map(|share| {
            if self.budget.exhausted() {
                return None;
            }
            let layout = self.fewer(share);
            let mut place = place;
            let mut at = start_of_branch(self.family, &mut self.budget, &layout, place, what)?;
            for &parameter in parameters {
                at = follow(self.family, &mut self.budget, &layout, what, at, (parameter, place))?;
                place = parameter.at(0.0, &place);
            }
            self.land(&layout, &at, what)
        })
    }
}

/// A solution at a place, found by the direct way.
pub(super) fn start_of_branch<F: Family>(
    family: &F,
    budget: &mut Budget,
    layout: &Layout,
    place: Neighbour,
    what: &str,
) -> Option<Unknowns> {
    let outer = family.turned(place.turned.to_radians());
    let system = family.equations(&outer, layout, temporary_trips(family, place.trips));
    let effort = Effort { patience: PATIENCE, ..Effort::new(TOLERANCE, DIRECT) };
    let end = newton::solve(&system, system.march(), effort);
    budget.note(what, &end);
    end.converged.then_some(end.unknowns)
}
