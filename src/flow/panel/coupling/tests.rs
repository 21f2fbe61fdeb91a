//! The linearised system against differences, elimination against the full system, and transposes against what they
//! transpose.

use super::projection;
use super::reduced::Reduced;
use super::response::{FlowResponse, SectionResponse, smooth, smooth_columns, within_wall_reach};
use super::system::{Stream, System};
use crate::flow::TrailingEdge;
use crate::flow::layer::{Change, Layout, State, Unknowns};
use crate::flow::panel::outline::Outline;
use crate::flow::panel::testing::{assert_same, cambered_flows, wave};
use crate::flow::search::Residuals;
use crate::flow::surface::spline::{IndexSpline, combine_real};
use crate::flow::testcases::naca_symmetric;

/// Along the Newton step the residuals fall at the rate of their own size: that holds for every equation only if
/// Jacobian, elimination and back substitution are all exact.
#[test]
fn the_newton_step_removes_every_residual_to_first_order() {
    for (gap, kind, mach) in [(0.00252, TrailingEdge::Blunt, 0.3), (0.0, TrailingEdge::Sharp, 0.0)] {
        let outline = Outline::new(&naca_symmetric(0.12, gap, 101), kind).unwrap();
        let section = SectionResponse::new(&outline).unwrap();
        let layout = Layout::new(24, 20, section.wake_distances.len());
        let flow = FlowResponse::new(&section, 0.05);
        let trips = [None, Some(0.6 * section.map.total)];
        let stream = Stream { mach, reynolds: 2e6, n_critical: 9.0, trips };
        let system = System::new(&section, &flow, &layout, stream);
        // off the equations everywhere
        let mut start = system.march();
        for (k, state) in start.stations.iter_mut().enumerate() {
            let wave = 0.05 * (1.7 * k as f64).sin();
            *state = state.map(|v| v + wave);
        }
        start.transition = start.transition.map(|x| 0.97 * x);
        let at = system.linearise(&start);
        let step = Reduced::new(&at).unwrap().solve(&at, &at.residuals);
        let h = 1e-6;
        let moved = |factor: f64| -> Vec<f64> {
            let mut next: Unknowns = start.clone();
            next.add(&step, factor);
            system.evaluate(&next).residuals.all().collect()
        };
        let (above, below) = (moved(h), moved(-h));
        assert!(at.residuals.largest() > 0.01);
        for (i, r) in at.residuals.all().enumerate() {
            let slope = (above[i] - below[i]) / (2.0 * h);
            assert!((slope + r).abs() < 1e-6, "equation {i}: {slope} for {}", -r);
        }
    }
}

#[test]
fn the_march_satisfies_the_boundary_layer_equations() {
    let outline = Outline::new(&naca_symmetric(0.12, 0.00252, 101), TrailingEdge::Blunt).unwrap();
    let section = SectionResponse::new(&outline).unwrap();
    let layout = Layout::new(40, 30, section.wake_distances.len());
    let flow = FlowResponse::new(&section, 0.03);
    let stream = Stream { mach: 0.0, reynolds: 3e6, n_critical: 9.0, trips: [None, None] };
    let system = System::new(&section, &flow, &layout, stream);
    let worst =
        system.evaluate(&system.march()).residuals.blocks.as_flattened().iter().fold(0.0, |w: f64, r| w.max(r.abs()));
    assert!(worst < 1e-6, "{worst}");
}

/// Numbers without any order.
fn list(k: usize, count: usize) -> Vec<f64> {
    (0..count).map(|i| wave(k, i)).collect()
}

/// Asserts that two scalar products are equal to round-off.
#[track_caller]
fn assert_equal_products(what: &str, [a, b]: [&[f64]; 2], [c, d]: [&[f64]; 2]) {
    let terms = |a: &[f64], b: &[f64]| -> Vec<f64> {
        assert_eq!(a.len(), b.len());
        a.iter().zip(b).map(|(a, b)| a * b).collect()
    };
    let (left, right) = (terms(a, b), terms(c, d));
    let scale = left.iter().map(|term| term.abs()).sum();
    assert_same(what, left.iter().sum(), right.iter().sum(), scale);
}

#[test]
fn the_transposed_projection_is_that_of_the_overlaps_of_points_and_nodes() {
    for record in cambered_flows() {
        let solved = record.solved();
        let t: Vec<f64> = solved.at.positions.index.iter().map(|t| t.re).collect();
        let nodes = solved.nodes.len();
        let (points, sensitivities) = (list(0, t.len()), list(1, nodes));
        let mut projected = vec![0.0; nodes];
        for (p, value) in points.iter().enumerate() {
            projection::overlaps(&t, p, nodes, |i, weight| projected[i] += weight * value);
        }
        let mut transposed = vec![0.0; t.len()];
        solved.at.speeds.projection.transpose_apply(&sensitivities, &mut transposed);
        assert_equal_products("projection", [&projected, &sensitivities], [&points, &transposed]);
    }
}

#[test]
fn a_response_with_smoothed_columns_responds_as_to_a_smoothed_defect() {
    for n in [6, 41] {
        let (mass, response) = (list(2, n), list(3, n));
        let mut smoothed = mass.clone();
        smooth(&mut smoothed);
        assert!(smoothed != mass && smoothed[..2] == mass[..2] && smoothed[n - 2..] == mass[n - 2..]);
        let columns = smooth_columns(&nalgebra::DMatrix::from_row_slice(1, n, &response));
        assert_equal_products("smoothing", [&smoothed, &response], [&mass, columns.as_slice()]);
    }
}

#[test]
fn spline_coefficients_of_the_wall_feel_no_node_beyond_their_reach() {
    for record in cambered_flows() {
        let section = record.solved().system.section;
        let n = section.len();
        let largest = section.wall.amax();
        for (k, column) in section.wall.as_slice().chunks_exact(n).enumerate() {
            let near = within_wall_reach(k, k, n);
            let far = column.iter().enumerate().filter(|(i, _)| !near.contains(i));
            assert!(far.into_iter().all(|(_, v)| v.abs() < 1e-17 * largest), "{k}");
        }
        assert!(within_wall_reach(0, 0, n).len() < n);
    }
}

#[test]
fn derivatives_of_a_spline_value_with_respect_to_the_nodes_give_back_the_value() {
    let (spline, values) = (IndexSpline::new(15), list(4, 15));
    let coefficients = spline.coefficients(&values);
    for t in [0.0, 0.7, 6.2, 13.9, 14.0] {
        let value = combine_real(&spline.weights(t), &coefficients);
        assert_equal_products("value", [&[3.0], &[value]], [&values, &spline.values_transposed(t, 3.0)]);
    }
}

/// A step removes residuals as the multipliers of an output weigh them: both are solutions with one matrix.
#[test]
fn an_output_changes_by_a_newton_step_as_its_multipliers_say() {
    for record in cambered_flows() {
        let solved = record.solved();
        let at = solved.at;
        let reduced = Reduced::new(at).unwrap();
        let stations = at.numbering.stations();
        let state = |k: usize| State::from_fn(|i| wave(5, 4 * k + i));
        let output = Change::new((0..stations).map(state).collect(), [0.7, -0.4, 1.3]);
        let multipliers = reduced.adjoint(at, [&output]);
        // equations of every kind by themselves, and all together
        for kind in 0..5 {
            let has = |own: usize| f64::from(u8::from(kind == own || kind == 4));
            let mut residuals = at.residuals.clone();
            for (k, block) in residuals.blocks.iter_mut().enumerate() {
                *block = std::array::from_fn(|e| has(0) * wave(6, 3 * k + e));
            }
            residuals.speed = list(7, stations).iter().map(|r| has(1) * r).collect();
            residuals.transition = [0.3, -0.8].map(|r| has(2) * r);
            residuals.stagnation = has(3) * 0.6;
            let step = reduced.solve(at, &residuals);
            let chain = multipliers.chain.as_flattened().iter().chain(&multipliers.speed);
            let rest = multipliers.transition.iter().chain([&multipliers.stagnation]);
            let weights: Vec<f64> = chain.chain(rest).map(|m| -m[0]).collect();
            let all: Vec<f64> = residuals.all().collect();
            let numbers = |of: &Change| -> Vec<f64> {
                of.stations.iter().flat_map(|state| state.numbers()).chain(of.globals()).collect()
            };
            assert_equal_products("step", [&numbers(&output), &numbers(&step)], [&weights, &all]);
        }
    }
}
