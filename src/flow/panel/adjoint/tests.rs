//! The multipliers in the places where the reverse sweep needs them, and what is left of it besides panels, wake and
//! surface, against forward sweeps.

use super::reverse::{Collected, lanes};
use super::testing::{Sums, at_solutions};
use crate::flow::coefficients::COEFFICIENTS;
use crate::flow::layer::Derived;
use crate::flow::panel::compressibility::PanelEdge;
use crate::flow::panel::coupling::response::smooth;
use crate::flow::panel::coupling::speeds::{EdgeSpeeds, Positions, node_strengths};
use crate::flow::panel::coupling::system::{mass_defect, signed};
use crate::flow::panel::solved::Solved;
use crate::flow::panel::testing::{Direction, Forward, assert_same, moving, wave};
use crate::flow::surface::spline::combine_real;
use nalgebra::{DMatrix, DVector};

#[test]
fn the_gas_adds_the_change_of_the_equations_and_of_the_defects() {
    at_solutions(|solved, reverse, _| {
        let (layer, outline) = (&solved.system.layer, &reverse.section.panels.outline);
        let mut collected = Collected::nothing(outline.len());
        collected.add_gas(solved, reverse);
        for direction in Direction::several(outline) {
            let law = PanelEdge::new(
                moving(solved.stream.mach, direction.mach),
                moving(solved.stream.reynolds, direction.reynolds),
            );
            let derived: Vec<Derived<Forward>> = layer.derive(solved.unknowns, |state| state.map(Forward::from), &law);
            let gap: Vec<Forward> = layer.gap.iter().map(|gap| Forward::from(*gap)).collect();
            let abscissas = solved.at.positions.abscissas.each_ref().map(|side| side.iter().map(|x| x.re).collect());
            let residuals = layer.residuals(&derived, &abscissas, &law, &gap);
            let first = layer.numbering().wake_start();
            let mass = derived.iter().enumerate().map(|(k, d)| mass_defect(d, k.checked_sub(first).map(|k| gap[k])));
            let forward: Vec<Forward> = residuals.as_flattened().iter().copied().chain(mass).collect();
            let multipliers = reverse.multipliers.chain.as_flattened();
            let sums = Sums::zero().over(&collected, &direction);
            sums.assert_are("gas", &forward, |i| match i.checked_sub(multipliers.len()) {
                None => -multipliers[i],
                Some(k) => lanes(&reverse.mass, |mass| mass[k]),
            });
        }
    });
}

/// Numbers without any order.
fn list(k: usize, count: usize) -> Vec<f64> {
    (0..count).map(|i| wave(k, i)).collect()
}

/// Scalar product, with the sum of the magnitudes of its terms.
fn product(a: &[f64], b: &[f64]) -> [f64; 2] {
    assert_eq!(a.len(), b.len());
    let terms = a.iter().zip(b).map(|(a, b)| a * b);
    terms.fold([0.0; 2], |[sum, scale], term| [sum + term, scale + term.abs()])
}

/// Adds scalar products.
fn total(products: &[[f64; 2]]) -> [f64; 2] {
    products.iter().fold([0.0; 2], |[sum, scale], product| [sum + product[0], scale + product[1]])
}

#[test]
fn strengths_act_on_the_outputs_and_on_the_speeds_of_the_edge_equations() {
    at_solutions(|_, reverse, direct| {
        let (section, flow) = (reverse.section, reverse.flow);
        let change = list(1, section.len());
        let coefficients = section.map.spline.coefficients(&change);
        let along = reverse.at.positions.index.iter();
        let points: Vec<f64> = along.map(|t| combine_real(&section.map.spline.weights(t.re), &coefficients)).collect();
        let wake = &flow.wake_by_strength * DVector::from_column_slice(&change);
        for o in 0..COEFFICIENTS {
            let [own, found, at_points, at_wake] = [
                &direct.as_ref().to_array()[o].strengths,
                reverse.strengths.as_ref().to_array()[o],
                reverse.point_weights.as_ref().to_array()[o],
                reverse.wake_weights.as_ref().to_array()[o],
            ];
            let [expected, scale] =
                total(&[product(own, &change), product(at_points, &points), product(at_wake, wake.as_slice())]);
            assert_same("strengths", product(found, &change)[0], expected, scale);
        }
    });
}

#[test]
fn defects_at_the_nodes_act_on_the_outputs_and_on_the_speeds_of_the_edge_equations() {
    at_solutions(|_, reverse, direct| {
        let (section, flow) = (reverse.section, reverse.flow);
        let change = list(3, section.len());
        let columns = |matrix: &DMatrix<f64>| -> Vec<f64> {
            matrix.column_iter().map(|column| product(column.as_slice(), &change)[0]).collect()
        };
        let mut smoothed = change.clone();
        smooth(&mut smoothed);
        let strengths = &section.nodes * DVector::from_vec(smoothed);
        let (strength, wall) = (section.map.spline.coefficients(strengths.as_slice()), columns(&section.wall));
        let wake = columns(&flow.wake_by_nodes);
        let last = reverse.at.positions.index.len() - 1;
        let speed = |(p, t): (usize, f64)| {
            let weights = section.map.spline.weights(t);
            let panels: f64 = combine_real(&weights, &strength);
            if p == 0 || p == last { panels } else { panels - combine_real(&weights, &wall) / section.map.rate(t) }
        };
        let points: Vec<f64> = reverse.at.positions.index.iter().map(|t| t.re).enumerate().map(speed).collect();
        for o in 0..COEFFICIENTS {
            let [own, found, at_points, at_wake] = [
                &direct.as_ref().to_array()[o].strengths,
                reverse.node_mass.as_ref().to_array()[o],
                reverse.point_weights.as_ref().to_array()[o],
                reverse.wake_weights.as_ref().to_array()[o],
            ];
            let strengths = product(own, strengths.as_slice());
            let [expected, scale] = total(&[strengths, product(at_points, &points), product(at_wake, &wake)]);
            assert_same("defects at the nodes", product(found, &change)[0], expected, scale);
        }
    });
}

/// Changes of the speeds along surface and wake and of the strengths at the nodes with the defects of all stations, which
/// change by `change`. All are straight functions of the defects.
fn by_defects(solved: &Solved, change: &[f64]) -> [Vec<f64>; 3] {
    let (section, flow, numbering) = (solved.system.section, solved.system.flow, &solved.at.numbering);
    let positions = Positions::<f64>::new(solved.system.layer.layout, section, solved.unknowns);
    let [none, changed] = [0.0, 1.0].map(|factor| {
        let mass: Vec<f64> = change.iter().map(|change| factor * change).collect();
        let (points, wake) = signed(&mass, numbering);
        let speeds = EdgeSpeeds::new(section, flow, &positions, &points, &wake);
        let strengths = node_strengths(section, flow, &speeds.node_mass, &wake);
        [speeds.points, speeds.wake, strengths]
    });
    std::array::from_fn(|q| changed[q].iter().zip(&none[q]).map(|(changed, none)| changed - none).collect())
}

#[test]
fn defects_of_stations_act_on_the_outputs_through_the_strengths_and_on_the_speeds_of_the_edge_equations() {
    at_solutions(|solved, reverse, direct| {
        let (stations, first) = (reverse.at.numbering.stations(), reverse.at.numbering.wake_start());
        for range in [0..first, first..stations] {
            let mut change = list(2, stations);
            (0..stations).filter(|k| !range.contains(k)).for_each(|k| change[k] = 0.0);
            let [points, wake, strengths] = by_defects(solved, &change);
            for o in 0..COEFFICIENTS {
                let [own, found, at_points, at_wake] = [
                    &direct.as_ref().to_array()[o].strengths,
                    reverse.mass.as_ref().to_array()[o],
                    reverse.point_weights.as_ref().to_array()[o],
                    reverse.wake_weights.as_ref().to_array()[o],
                ];
                let strengths = product(own, &strengths);
                let [expected, scale] = total(&[strengths, product(at_points, &points), product(at_wake, &wake)]);
                assert_same("defects", product(found, &change)[0], expected, scale);
            }
        }
    });
}
