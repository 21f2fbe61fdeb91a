//! The path of the wake against a forward sweep through the flow without boundary layer.

use super::super::reverse::{Collected, Lanes, Reverse, Strengths};
use super::super::testing::{Sums, add_panels_of, at_solutions, edge_frame, stream, velocity};
use super::add_path;
use crate::flow::coefficients::Coefficients;
use crate::flow::panel::edge::Cut;
use crate::flow::panel::inviscid::share_edge_rows;
use crate::flow::panel::streamline;
use crate::flow::panel::testing::{Direction, Forward, moving, wave};
use nalgebra::DMatrix;
use num_dual::DualNum;

/// Strengths of the flow without boundary layer at moving nodes: the panel equations, changed for the strengths held, tell
/// how these must follow.
fn strengths(reverse: &Reverse, nodes: &[[Forward; 2]], alpha: Forward) -> Vec<Forward> {
    let (panels, n) = (&reverse.section.panels, nodes.len());
    let sheets = Strengths::inviscid(reverse.flow);
    let cut = Cut::new([nodes[0], nodes[1]], [nodes[n - 2], nodes[n - 1]]);
    let at = |point: [Forward; 2]| velocity((&sheets, &panels.outline), nodes, &[], alpha, (point, None));
    let through: Forward = cut.points.iter().map(|(point, weight)| cut.through(at(*point)) * *weight).sum();
    assert!(through.re.abs() < 1e-12, "{through}");
    let mut rates = DMatrix::zeros(n + 1, 1);
    for (rate, stream) in rates.iter_mut().zip(stream(&sheets, &panels.outline, nodes, alpha)) {
        *rate = -stream.v1;
    }
    share_edge_rows(&mut rates, n);
    rates[n - 1] = -through.v1;
    panels.factors.solve(&mut rates);
    sheets.nodes.iter().zip(&rates).map(|(strength, rate)| moving(*strength, *rate)).collect()
}

/// Nodes of the wake for moving nodes of the section.
pub(in super::super) fn path(reverse: &Reverse, nodes: &[[Forward; 2]], alpha: Forward) -> Vec<[Forward; 2]> {
    let (outline, distances) = (&reverse.section.panels.outline, &reverse.section.wake_distances);
    let sheets = Strengths::inviscid(reverse.flow);
    let strengths = strengths(reverse, nodes, alpha);
    let frame = edge_frame(nodes);
    let places = streamline::places(&frame, [alpha.cos(), alpha.sin()], distances);
    let along = places.iter().enumerate().map(|(k, place)| {
        let held = velocity((&sheets, outline), nodes, &[], alpha, (*place, None));
        [0, 1].map(|c| {
            let by_strength = reverse.flow.path.by_strength[c].row(k);
            let change: Forward = by_strength
                .iter()
                .zip(&strengths)
                .map(|(influence, strength)| (*strength - strength.re) * *influence)
                .sum();
            held[c] + change
        })
    });
    streamline::nodes(&frame, &along.collect::<Vec<_>>(), distances)
}

#[test]
fn the_path_adds_how_the_wake_follows_the_edge_the_incidence_and_the_flow() {
    at_solutions(|_, reverse, _| {
        let outline = &reverse.section.panels.outline;
        for direction in Direction::several(outline) {
            let weight = |k: usize, o: usize| [wave(o, 2 * k), wave(o, 2 * k + 1)];
            let count = reverse.section.wake_distances.len();
            let by_nodes =
                Coefficients::from_array(std::array::from_fn(|o| (0..count).map(|k| weight(k, o)).collect()));
            let mut collected = Collected::nothing(outline.len());
            let panels = add_path(reverse, &by_nodes, &mut collected);
            add_panels_of(panels, reverse, &mut collected);
            let alpha = moving(reverse.flow.alpha, direction.alpha);
            let forward = path(reverse, &direction.moved(&outline.nodes), alpha);
            for (node, own) in forward.iter().zip(&reverse.flow.path.nodes) {
                assert!((node[0].re - own[0]).abs() + (node[1].re - own[1]).abs() < 1e-12);
            }
            let weights = |i: usize| Lanes::from_fn(|o, _| weight(i / 2, o)[i % 2]);
            Sums::zero().over(&collected, &direction).assert_are("path", forward.as_flattened(), weights);
        }
    });
}
