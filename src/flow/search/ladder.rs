//! Ways to a converged flow where the direct one fails, those that pay most first: other numbers of stations, and
//! branches of solutions that start from easier conditions.

use super::branch::{Parameter, follow};
use super::budget::Budget;
use super::family::{Effort, End, Equations, Family};
use super::held::{Start, by_held_transition};
use super::neighbour::{Neighbour, temporary_trips};
use super::newton;
use crate::flow::Attempt;
use crate::flow::layer::transport::resample;
use crate::flow::layer::{Layout, Unknowns};

/// Work that is left for other ways after a flow on other stations did not lead to one on the requested stations, in
/// Newton iterations on those.
const LITTLE_HOPE: f64 = 250.0;
/// Extra work granted when everything else has failed, in Newton iterations on the requested stations.
const LAST_HOPE: f64 = 60.0;
/// Largest number of iterations of an attempt with a march after each step.
const PROJECTED: usize = 18;
/// Largest number of iterations of a direct attempt.
const DIRECT: usize = 25;
/// Iterations without progress after which an attempt is given up. The number is smaller than elsewhere, because there
/// are other ways.
const PATIENCE: usize = 5;
/// Share of a step below which Newton's method is given up at the start of a branch.
const SHORTEST: f64 = 0.1;
/// Largest residual of solutions that serve only as a start.
pub(super) const TOLERANCE: f64 = 1e-5;
/// Share of the requested stations on which branches are followed first. Where the flow found on them does not lead to
/// the one on the requested stations, the branch is followed on those.
const FEW: f64 = 0.6;
/// The ways that are tried, in their order. Those that succeed often for their work come first: of 106 random flows about
/// measured sections, most of them close to stall, that neither Newton's method nor [held transition](super::held) found, a
/// branch from a lower angle of attack found 68, and all other ways together thirteen.
const RUNGS: [Rung; 20] = [
    Rung::Place { turned: -2.0, tripped: false, few: true },
    Rung::Place { turned: -4.0, tripped: false, few: true },
    Rung::Stations { share: 0.6, marched: false },
    Rung::Stations { share: 0.8, marched: false },
    Rung::Place { turned: 2.0, tripped: false, few: true },
    Rung::Place { turned: 0.0, tripped: true, few: true },
    Rung::Place { turned: -4.0, tripped: true, few: true },
    Rung::Place { turned: 4.0, tripped: false, few: true },
    Rung::Place { turned: -8.0, tripped: true, few: true },
    Rung::Place { turned: -2.0, tripped: false, few: false },
    Rung::Place { turned: -4.0, tripped: false, few: false },
    Rung::Place { turned: 0.0, tripped: true, few: false },
    Rung::Place { turned: -4.0, tripped: true, few: false },
    Rung::Stations { share: 0.45, marched: false },
    Rung::Stations { share: 0.6, marched: true },
    Rung::Stations { share: 1.25, marched: false },
    Rung::Place { turned: -8.0, tripped: true, few: false },
    Rung::Place { turned: 2.0, tripped: false, few: false },
    Rung::Place { turned: -8.0, tripped: false, few: true },
    Rung::Place { turned: 4.0, tripped: false, few: false },
];
/// Laminar stations of the layouts that are tried as a last hope, over the requested number.
const SPARE_LAYOUTS: [f64; 4] = [0.9, 0.7, 1.1, 0.35];
/// Distance of the temporary trips from the stagnation point at the start of a branch, over the lengths of the sides.
const EARLY_TRIP: f64 = 0.06;

/// One way to the requested flow.
#[derive(Debug, Clone, Copy)]
enum Rung {
    /// Another number of laminar stations, `share` of the requested one, with or without a march after each step.
    Stations { share: f64, marched: bool },
    /// A branch of solutions from an angle of attack that differs by `turned` degrees (positive values lead to lift of
    /// larger magnitude), with trips close to the nose where `tripped`: first the angle changes back, then the trips move
    /// downstream. The stations are the requested ones or, where `few`, [fewer](FEW).
    Place { turned: f64, tripped: bool, few: bool },
}

/// Result of a search: the solution and the layout of the stations it stands on.
pub(crate) type Found<V> = (End<V>, Layout);

/// Tries everything for a flow after `attempts` have failed; `outer` is the outer flow at the requested angle.
///
/// The result is `None` where nothing converged. The list of all attempts comes with it.
pub(crate) fn climb<F: Family>(
    family: &F,
    outer: &F::Outer,
    attempts: Vec<Attempt>,
) -> (Option<Found<F::Evaluated>>, Vec<Attempt>) {
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
    pub fn climb(mut self) -> (Option<Found<F::Evaluated>>, Vec<Attempt>) {
        let found = RUNGS.into_iter().find_map(|rung| if self.budget.exhausted() { None } else { self.step(rung) });
        let found = match found {
            Some(end) => Some((end, self.family.layout().clone())),
            None => self.with_other_stations(),
        };
        (found, self.budget.attempts)
    }

    fn step(&mut self, rung: Rung) -> Option<End<F::Evaluated>> {
        match rung {
            Rung::Stations { share, marched } => self.other_stations(share, marched),
            // fewer stations lead to the flow that did not land before
            Rung::Place { few: true, .. } if self.spare.is_some() => None,
            Rung::Place { turned, tripped, few: true } => {
                let found = self.by_place(turned, tripped, FEW);
                if found.is_none() && self.spare.is_some() { self.by_place(turned, tripped, 1.0) } else { found }
            }
            Rung::Place { turned, tripped, few: false } => self.by_place(turned, tripped, 1.0),
        }
    }

    /// Tries more layouts as a last hope, and then settles for the flow on another number of stations where there is
    /// one.
    fn with_other_stations(&mut self) -> Option<Found<F::Evaluated>> {
        let family = self.family;
        if self.spare.is_none() && family.hope() >= 1.0 {
            self.budget.grant(LAST_HOPE);
            for share in SPARE_LAYOUTS {
                let found = [false, true].into_iter().find_map(|marched| self.other_stations(share, marched));
                if let Some(end) = found {
                    return Some((end, family.layout().clone()));
                }
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

    /// Tries Newton's method, alone or with a march after each step.
    fn attempt(
        &mut self,
        system: &F::Equations<'_>,
        start: Unknowns,
        tolerance: f64,
        (what, marched): (&str, bool),
    ) -> Option<End<F::Evaluated>> {
        let (end, suffix) = if marched {
            (newton::solve_projected(system, start, tolerance, PROJECTED), ", a march after each step")
        } else {
            let effort = Effort { patience: PATIENCE, ..Effort::new(tolerance, DIRECT) };
            (newton::solve(system, start, effort), "")
        };
        self.budget.note(&format!("{what}{suffix}"), &end);
        end.converged.then_some(end)
    }

    /// Solves on another number of laminar stations and takes the solution as a start on the requested one.
    fn other_stations(&mut self, share: f64, marched: bool) -> Option<End<F::Evaluated>> {
        if self.budget.exhausted() {
            return None;
        }
        let family = self.family;
        let wanted = family.layout();
        let laminar = ((wanted.laminar.len() as f64 * share) as usize).max(15);
        let layout = Layout::new(laminar, wanted.turbulent.len(), wanted.wake);
        let what = format!("{laminar} laminar stations");
        let unknowns = {
            let system = family.equations(self.outer, &layout, family.trips());
            self.attempt(&system, system.march(), TOLERANCE, (&what, marched))?.unknowns
        };
        self.land(&layout, &unknowns, &what)
    }

    /// Moves from a solution on another layout to one on the requested layout.
    fn land(&mut self, layout: &Layout, from: &Unknowns, what: &str) -> Option<End<F::Evaluated>> {
        let family = self.family;
        let system = family.equations(self.outer, family.layout(), family.trips());
        let start = resample(layout, family.layout(), from, family.surface());
        let what = format!("from {what}");
        let end = [false, true]
            .into_iter()
            .find_map(|marched| self.attempt(&system, start.clone(), family.tolerance(), (&what, marched)));
        if end.is_none() {
            if self.spare.is_none() {
                self.budget.restrict(LITTLE_HOPE);
            }
            if self.spare.as_ref().is_none_or(|(l, _)| l.laminar.len() < layout.laminar.len()) {
                self.spare = Some((layout.clone(), from.clone()));
            }
        }
        end
    }

    fn fewer(&self, share: f64) -> Layout {
        let Layout { laminar, turbulent, wake } = self.family.layout();
        let fewer = |stations: &[f64]| ((stations.len() as f64 * share).round() as usize).max(12);
        Layout::new(fewer(laminar), fewer(turbulent), *wake)
    }

    /// Solves at a place that is easier than the requested one and follows branches back, along one parameter after the
    /// other.
    fn by_place(&mut self, turned: f64, tripped: bool, share: f64) -> Option<End<F::Evaluated>> {
        let turned = turned * self.family.lift_sign();
        let mut place = Neighbour { turned, ..Neighbour::default() };
        let (mut what, mut parameters) = (Vec::new(), Vec::new());
        if tripped {
            place.trips = EARLY_TRIP;
            what.push(format!("trips at {EARLY_TRIP} of the sides"));
        }
        if turned != 0.0 {
            what.push(format!("{turned:+} degrees"));
            parameters.push(Parameter::Angle);
        }
        if tripped {
            parameters.push(Parameter::Trips);
        }
        let what = what.join(", ");
        let layout = self.fewer(share);
        let mut at = start_of_branch(self.family, &mut self.budget, &layout, place, &what)?;
        for parameter in parameters {
            at = follow(self.family, &mut self.budget, &layout, &what, at, (parameter, place))?;
            place = parameter.at(0.0, &place);
        }
        self.land(&layout, &at, &what)
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
    // temporary trips are there for what holding transition does not find
    let shortest = if place.trips < 1.0 { 0.0 } else { SHORTEST };
    let effort = Effort { patience: PATIENCE, shortest, ..Effort::new(TOLERANCE, DIRECT) };
    let marched = system.march();
    let end = newton::solve(&system, marched.clone(), effort);
    budget.note(what, &end);
    if end.converged || place.trips < 1.0 {
        return end.converged.then_some(end.unknowns);
    }
    let (held, attempt) = by_held_transition(family, &outer, layout, Start::Marched(&marched));
    budget.spend((attempt.iterations + 1) as f64, layout);
    let end = newton::solve(&system, held?, effort);
    budget.note(&format!("{what}, transition held"), &end);
    end.converged.then_some(end.unknowns)
}
