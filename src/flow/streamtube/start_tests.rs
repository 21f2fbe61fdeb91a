//! Starts: flows on two grids, free transition, sections whose layers nearly separate at the edge or that have a high base,
//! slow flow, and sections without a start.

use super::numbering::Unknowns;
use super::record::StreamtubeRecord;
use super::refine::carried_over;
use super::solver::StreamtubeSolver;
use crate::flow::condition::{Condition, Incidence};
use crate::flow::solution::Solution;
use crate::flow::solver::FlowSolver;
use crate::flow::{StreamtubeSettings, TrailingEdge, panel_parameters};
use crate::section::SectionDefinition;
use std::any::Any;

const SMALL: StreamtubeSettings =
    StreamtubeSettings { cells: 60, tubes: 14, reach: 5.0, tolerance: 1e-10, iterations: 60, retry: true };

/// Nodes and edge of a section by its name.
fn section(name: &str) -> (Vec<[f64; 2]>, TrailingEdge) {
    let section = SectionDefinition::parse(name).unwrap().section().unwrap();
    let nodes = panel_parameters(&section, 161).into_iter().map(|u| section.curve().point_at(u)).collect();
    (nodes, section.trailing_edge())
}

fn solved(nodes: &[[f64; 2]], edge: TrailingEdge, condition: &Condition, settings: StreamtubeSettings) -> Solution {
    StreamtubeSolver { settings }.section(nodes, edge).unwrap().analyze(condition, None).unwrap()
}

fn record(solution: &Solution) -> &StreamtubeRecord {
    let record: &dyn Any = &*solution.record;
    record.downcast_ref().unwrap()
}

#[test]
fn a_flow_carried_over_to_its_own_grid_is_itself() {
    let (nodes, edge) = section("naca2412:sharp");
    let condition = Condition { mach: 0.72, trips: [Some(0.1); 2], ..Condition::new(Incidence::Alpha(0.02), 5e6) };
    let solution = solved(&nodes, edge, &condition, SMALL);
    assert!(solution.is_reliable(), "{}", solution.status);
    let record = record(&solution);
    let (problem, unknowns) = (&record.problem, &record.unknowns);
    let same = carried_over(problem, unknowns, problem, unknowns.globals).unwrap();
    let difference = |a: &Unknowns, b: &Unknowns| {
        let pairs = a.stations.iter().flatten().zip(b.stations.iter().flatten());
        pairs.fold(0.0f64, |worst, (x, y)| worst.max((x - y).abs()))
    };
    assert!(difference(&same, unknowns) < 1e-11);
}

#[test]
fn thick_cambered_sections_are_found_on_the_usual_grid() {
    let condition =
        Condition { mach: 0.6, trips: [Some(0.1); 2], ..Condition::new(Incidence::Alpha(2f64.to_radians()), 5e6) };
    for name in ["naca4421:sharp", "naca4421"] {
        let (nodes, edge) = section(name);
        let solution = solved(&nodes, edge, &condition, StreamtubeSettings::default());
        assert!(solution.is_reliable(), "{name}: {}", solution.status);
        let c = solution.coefficients;
        assert!((0.58..0.68).contains(&c.cl) && (0.0138..0.0152).contains(&c.cd), "{c:?}");
    }
}

#[test]
fn free_transition_is_found_where_amplification_is_critical() {
    let (nodes, edge) = section("naca2412:sharp");
    let condition = Condition { mach: 0.72, ..Condition::new(Incidence::Lift(0.5), 6e6) };
    let solution = solved(&nodes, edge, &condition, SMALL);
    assert!(solution.is_reliable() && solution.residual < 1e-9, "{}", solution.status);
    let distributions = solution.distributions();
    for (side, x) in [&distributions.upper, &distributions.lower].into_iter().zip(solution.coefficients.transition) {
        let last = side.iter().rfind(|s| s.shear_stress == 0.0).unwrap();
        assert!((last.x - x).abs() < 1e-9 && (0.01..0.95).contains(&x), "{} {x}", last.x);
        assert!((last.amplification - condition.n_critical).abs() < 1e-3, "{}", last.amplification);
    }
}

#[test]
fn the_next_point_of_a_sweep_is_that_from_nothing() {
    let (nodes, edge) = section("naca2412:sharp");
    let condition = |lift: f64| Condition { mach: 0.7, ..Condition::new(Incidence::Lift(lift), 6e6) };
    let section = StreamtubeSolver { settings: SMALL }.section(&nodes, edge).unwrap();
    let alone = section.analyze(&condition(0.5), None).unwrap();
    let before = section.analyze(&condition(0.3), None).unwrap();
    let next = section.analyze_next(&condition(0.5), Some(&before)).unwrap();
    assert!(alone.is_reliable() && next.is_reliable(), "{} {}", alone.status, next.status);
    // transition has moved over several stations
    let turning = [&alone, &before, &next].map(|solution| record(solution).problem.grid.stations.turning);
    assert!(turning[0] != turning[1] && turning[0] == turning[2], "{turning:?}");
    let [a, b] = [&alone, &next].map(|solution| solution.coefficients);
    assert!((a.cd / b.cd - 1.0).abs() < 1e-8 && (a.cm / b.cm - 1.0).abs() < 1e-8, "{a:?} {b:?}");
}

#[test]
fn a_trial_is_the_flow_from_the_neighbour_or_is_given_up_sooner() {
    let (nodes, edge) = section("naca0012:sharp");
    let condition =
        |lift: f64, mach: f64| Condition { mach, trips: [Some(0.1); 2], ..Condition::new(Incidence::Lift(lift), 6e6) };
    let section = StreamtubeSolver { settings: SMALL }.section(&nodes, edge).unwrap();
    let near = section.analyze(&condition(0.2, 0.7), None).unwrap();
    let both = |condition: Condition| {
        [section.analyze_trial(&condition, &near).unwrap(), section.analyze(&condition, Some(&near)).unwrap()]
    };
    let [trial, alone] = both(condition(0.22, 0.7));
    assert!(trial.is_reliable(), "{}", trial.status);
    assert_eq!(trial.coefficients, alone.coefficients);
    // far beyond buffet
    let [trial, alone] = both(condition(1.2, 0.85));
    assert!(!trial.is_solved() && !alone.is_solved(), "{} {}", trial.status, alone.status);
    assert!(trial.attempts.len() < alone.attempts.len(), "{:?} {:?}", trial.attempts, alone.attempts);
}

/// A section with the thickness added evenly to a base of some height at the trailing edge.
fn blunt(name: &str, height: f64) -> Vec<[f64; 2]> {
    let (mut nodes, _) = section(name);
    let half = nodes.len() / 2;
    for (i, [x, y]) in nodes.iter_mut().enumerate() {
        *y += if i < half { 0.5 } else { -0.5 } * height * *x;
    }
    nodes
}

#[test]
fn flow_about_a_section_with_a_high_base_is_found() {
    // the dead air is several times as high as the inner tubes are wide
    let nodes = blunt("naca2412:sharp", 0.02);
    let condition = Condition { mach: 0.6, trips: [Some(0.1); 2], ..Condition::new(Incidence::Alpha(0.0), 5e6) };
    let solution = solved(&nodes, TrailingEdge::Blunt, &condition, SMALL);
    assert!(solution.is_reliable() && solution.attempts.is_empty(), "{} {:?}", solution.status, solution.attempts);
    let record = record(&solution);
    // the grid alone, without displacements
    let mut problem = record.problem.clone();
    problem.grid.viscous = false;
    let unknowns = Unknowns { globals: record.unknowns.globals, ..Unknowns::zeros(&problem.grid) };
    let geometry = problem.geometry(&unknowns).unwrap();
    assert!(problem.areas(&geometry).iter().all(|area| *area > 0.0));
}

#[test]
fn slow_flow_at_incidence_is_found() {
    let (nodes, edge) = section("naca0012:sharp");
    let alpha = 4f64.to_radians();
    let slow = Condition { mach: 0.1, trips: [Some(0.1); 2], ..Condition::new(Incidence::Alpha(alpha), 5e6) };
    let faster = Condition { mach: 0.25, ..slow };
    let [a, b] = [slow, faster].map(|condition| solved(&nodes, edge, &condition, SMALL));
    assert!(a.is_reliable() && b.is_reliable(), "{} {}", a.status, b.status);
    // by the rule of Prandtl and Glauert
    let ratio = ((1.0 - 0.1f64.powi(2)) / (1.0 - 0.25f64.powi(2))).sqrt();
    assert!(
        (b.coefficients.cl / a.coefficients.cl / ratio - 1.0).abs() < 0.01,
        "{:?}",
        (a.coefficients, b.coefficients)
    );
}

#[test]
fn a_grid_that_turns_over_is_named() {
    let nodes = blunt("naca0012:sharp", 0.4);
    let condition = Condition { mach: 0.6, trips: [Some(0.1); 2], ..Condition::new(Incidence::Alpha(0.05), 5e6) };
    let settings = StreamtubeSettings { retry: false, ..SMALL };
    let solution = solved(&nodes, TrailingEdge::Blunt, &condition, settings);
    assert_eq!(solution.status.name(), "no start", "{}", solution.status);
    assert!(solution.coefficients.cl.is_nan() && solution.gradients().is_none());
}
