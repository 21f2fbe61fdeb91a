//! The search with flows of the panel solver.

use super::branch::{Branch, Parameter, follow};
use super::budget::Budget;
use super::ladder::{Ladder, start_of_branch};
use super::neighbour::Neighbour;
use super::{Effort, newton};
use crate::flow::layer::{Layout, Unknowns};
use crate::flow::panel::testing::{PanelFamily, with_family};

/// A flow at an angle of attack, on a layout of few stations.
fn with_flow<R>(work: impl FnOnce(&PanelFamily) -> R) -> R {
    with_family(0.05, |wake| Layout::new(40, 30, wake), work)
}

fn farthest(a: &Unknowns, b: &Unknowns) -> f64 {
    let states = a.stations.iter().zip(&b.stations);
    let of_states = states.flat_map(|(a, b)| [a.log_theta - b.log_theta, a.log_speed - b.log_speed]);
    let of_transition = [0, 1].map(|side| a.transition[side] - b.transition[side]);
    of_states.chain(of_transition).fold(0.0, |m: f64, d| m.max(d.abs()))
}

#[test]
fn what_the_last_hope_finds_is_kept() {
    with_flow(|family| {
        let mut budget = Budget::new(family.layout, Vec::new(), 1.0);
        // the budget spent, nothing but the last hope is left
        budget.spend(2.0 * super::budget::WORK, family.layout);
        let (found, attempts) = Ladder { family, outer: family.flow, budget, spare: None }.climb();
        let (end, layout) = found.unwrap();
        assert!(end.converged && end.residual <= family.settings.tolerance);
        assert_eq!(layout.laminar.len(), 40);
        assert_eq!(attempts.last().unwrap().what, "from 36 laminar stations");
    });
}

#[test]
fn branches_lead_to_the_solution_wanted() {
    with_flow(|family| {
        let layout = family.layout;
        let mut budget = Budget::new(layout, Vec::new(), 1.0);
        let wanted = start_of_branch(family, &mut budget, layout, Neighbour::default(), "start").unwrap();
        let places = [
            (Parameter::Angle, Neighbour { turned: -2.0, ..Neighbour::default() }),
            (Parameter::Angle, Neighbour { turned: 2.0, ..Neighbour::default() }),
            (Parameter::Trips, Neighbour { trips: 0.05, ..Neighbour::default() }),
        ];
        for (parameter, place) in places {
            let from = start_of_branch(family, &mut budget, layout, place, "start").unwrap();
            assert!(farthest(&from, &wanted) > 0.01);
            let found = follow(family, &mut budget, layout, "way", from, (parameter, place)).unwrap();
            assert!(farthest(&found, &wanted) < 1e-3, "{parameter:?}: {}", farthest(&found, &wanted));
        }
    });
}

#[test]
fn tangents_are_those_of_the_solutions() {
    with_flow(|family| {
        let layout = family.layout;
        for (parameter, value) in [(Parameter::Angle, -0.5), (Parameter::Trips, -2.5)] {
            let place = parameter.at(value, &Neighbour::default());
            let branch = Branch::new(family, layout, parameter, place);
            let solve = |at: &Branch<PanelFamily>, from: &Unknowns| {
                let end = newton::solve(&at.equations(), from.clone(), Effort::new(1e-11, 30));
                assert!(end.converged);
                end
            };
            let middle = solve(&branch, &branch.equations().march());
            let tangent = branch.jacobian(&middle.unknowns).unwrap().by_value;
            let step = 1e-4;
            let [low, high] = [-step, step].map(|by| {
                let mut aside = Branch::new(family, layout, parameter, place);
                aside.set(value + by);
                solve(&aside, &middle.unknowns).unknowns
            });
            let close = |difference: f64, exact: f64| (difference - exact).abs() < 1e-4 * (1.0 + exact.abs());
            for (k, exact) in tangent.stations.iter().enumerate() {
                let difference = (high.stations[k].log_theta - low.stations[k].log_theta) / (2.0 * step);
                assert!(close(difference, exact.log_theta), "{k}: {difference} {exact:?}");
            }
            for side in 0..2 {
                let difference = (high.transition[side] - low.transition[side]) / (2.0 * step);
                assert!(close(difference, tangent.transition[side]), "{difference} {}", tangent.transition[side]);
            }
        }
    });
}
