//! The parts of the surface coordinate against forward sweeps of the kernels.

use super::super::reverse::{Collected, Lanes, Reverse, lanes};
use super::super::testing::{Sums, at_solutions};
use super::{AtPoints, add_lengths, add_local, add_projection, add_splines, add_surface, add_trip, entries};
use crate::flow::layer::equations::BY_TRIP;
use crate::flow::layer::{Derived, EdgeLaw, Side, testing};
use crate::flow::panel::coupling::projection;
use crate::flow::panel::coupling::subpanel::Wall;
use crate::flow::panel::coupling::system::signed;
use crate::flow::panel::outline::arc_lengths;
use crate::flow::panel::solved::Solved;
use crate::flow::panel::testing::{Direction, Forward, assert_same, moving_along, wave};
use crate::flow::surface::spline::{combine, combine_real, invert};
use num_dual::DualNum;

/// Node indices of the points along the surface, and arc lengths per index there.
fn places(reverse: &Reverse) -> [Vec<f64>; 2] {
    let t: Vec<f64> = reverse.at.positions.index.iter().map(|t| t.re).collect();
    let rates = t.iter().map(|&t| reverse.section.map.rate(t)).collect();
    [t, rates]
}

/// Points that move along the surface without any order; both ends stay.
fn moving_places(k: usize, t: &[f64]) -> Vec<Forward> {
    let mut moved = moving_along(k, t);
    (moved[0], moved[t.len() - 1]) = (Forward::from(t[0]), Forward::from(t[t.len() - 1]));
    moved
}

fn mass(reverse: &Reverse) -> Vec<f64> {
    let mass: Vec<f64> = reverse.at.mass.clone();
    signed(&mass, &reverse.at.numbering).0
}

/// Visits the places with several movements of them.
fn with_places(check: impl Fn(&Reverse, [&[f64]; 2], [&[Forward]; 2])) {
    at_solutions(|_, reverse, _| {
        let [t, rates] = places(reverse);
        for k in 0..3 {
            check(reverse, [&t, &rates], [&moving_places(k, &t), &moving_along(k + 3, &rates)]);
        }
    });
}

fn collected_by(part: impl FnOnce(&mut AtPoints), points: usize) -> AtPoints {
    let empty = || vec![Lanes::zeros(); points];
    let mut result = AtPoints { index: empty(), rate: empty() };
    part(&mut result);
    result
}

/// Numbers that a part collected at the inner points, times their movement.
fn contracted(at: &AtPoints, index: &[Forward], rate: &[Forward]) -> Sums {
    let mut sums = Sums::zero();
    for p in 1..index.len() - 1 {
        sums.add(&at.index[p], index[p].v1);
        sums.add(&at.rate[p], rate[p].v1);
    }
    sums
}

/// Interpolated strength less the wall response at panel resolution, at the inner points.
fn interpolated(reverse: &Reverse, index: &[Forward], rate: &[Forward]) -> Vec<Forward> {
    let fields = &reverse.at.speeds.fields;
    let [strength, wall] = [&fields.strength, &fields.wall].map(|c| c.iter().map(|c| c.re).collect::<Vec<f64>>());
    let value = |p: usize| {
        let weights = reverse.section.map.spline.weights(index[p]);
        combine_real(&weights, &strength) - combine_real(&weights, &wall) / rate[p]
    };
    (1..index.len() - 1).map(value).collect()
}

#[test]
fn splines_add_the_change_of_the_interpolated_speeds() {
    with_places(|reverse, [t, rates], [index, rate]| {
        let weights = entries(&reverse.point_weights);
        let at = collected_by(|result| add_splines(reverse, &weights, t, rates, result), t.len());
        let forward = interpolated(reverse, index, rate);
        contracted(&at, index, rate).assert_are("splines", &forward, |i| weights[i + 1]);
    });
}

/// Sub-panel speeds at the inner points for defects that do not change.
fn local(mass: &[f64], index: &[Forward], rate: &[Forward]) -> Vec<Forward> {
    let wall = Wall::new(index);
    let slopes: Vec<Forward> =
        (1..index.len()).map(|k| (index[k] - index[k - 1]).recip() * (mass[k] - mass[k - 1])).collect();
    let speed = |p: usize| {
        let mut sum = Forward::from(0.0);
        wall.influences(index[p], p, |k, influence| sum += influence * slopes[k]);
        sum / rate[p]
    };
    (1..index.len() - 1).map(speed).collect()
}

#[test]
fn sub_panel_speeds_add_their_change() {
    with_places(|reverse, [t, rates], [index, rate]| {
        let (weights, mass) = (entries(&reverse.point_weights), mass(reverse));
        let at = collected_by(|result| add_local(&weights, t, rates, &mass, result), t.len());
        let forward = local(&mass, index, rate);
        contracted(&at, index, rate).assert_are("sub-panel speeds", &forward, |i| weights[i + 1]);
    });
}

/// Defects at the nodes for defects at the points that do not change.
fn projected(mass: &[f64], nodes: usize, index: &[Forward]) -> Vec<Forward> {
    let mut result = vec![Forward::from(0.0); nodes];
    for (p, mass) in mass.iter().enumerate() {
        projection::overlaps(index, p, nodes, |i, weight| result[i] += weight * *mass);
    }
    result
}

#[test]
fn the_projection_adds_the_change_of_the_defects_at_the_nodes() {
    with_places(|reverse, [t, _], [index, rate]| {
        let (nodes, mass) = (reverse.section.len(), mass(reverse));
        let at = collected_by(|result| add_projection(reverse, t, &mass, result), t.len());
        let forward = projected(&mass, nodes, index);
        let weight = |i: usize| lanes(&reverse.node_mass, |list| list[i]);
        contracted(&at, index, rate).assert_are("projection", &forward, weight);
    });
}

#[test]
fn lengths_add_how_all_nodes_behind_a_panel_move_along_the_arc() {
    at_solutions(|_, reverse, _| {
        let outline = &reverse.section.panels.outline;
        let weights: Vec<Lanes> = (0..outline.len()).map(|i| Lanes::from_fn(|o, _| wave(o, i))).collect();
        let mut collected = Collected::nothing(outline.len());
        add_lengths(reverse, &weights, &mut collected);
        for direction in Direction::several(outline) {
            let forward = arc_lengths(&direction.moved(&outline.nodes));
            Sums::zero().over(&collected, &direction).assert_are("lengths", &forward, |i| weights[i]);
        }
    });
}

/// Spline coefficients of the arc length of moving nodes.
fn moving_arc(reverse: &Reverse, nodes: &[[Forward; 2]]) -> Vec<Forward> {
    reverse.section.map.spline.coefficients(&arc_lengths(nodes))
}

/// Where a spline with moving coefficients keeps the value it has at `t`: one Newton step.
fn followed(reverse: &Reverse, t: f64, coefficients: &[Forward], value: Forward) -> Forward {
    let spline = &reverse.section.map.spline;
    let [at, slope] = [spline.weights(t), spline.slope_weights(t)].map(|(first, w)| {
        let w: [Forward; 4] = w.map(Forward::from);
        combine(&(first, w), coefficients)
    });
    // to first order, which is all that is asked for
    let step = (value - at) / slope;
    assert!(step.re.abs() < 1e-11, "{}", step.re);
    step - step.re + t
}

/// Arc length of the trip of a side, which keeps its x.
fn moving_trip(solved: &Solved, reverse: &Reverse, side: Side, nodes: &[[Forward; 2]]) -> Option<Forward> {
    let map = &reverse.section.map;
    let arc = solved.system.layer.trips[side.index()]?;
    let t = invert(&map.spline, &map.arc, arc, 0.0, (reverse.section.len() - 1) as f64, 1.0);
    let x: Vec<Forward> = nodes.iter().map(|node| node[0]).collect();
    let x = map.spline.coefficients(&x);
    let still: Vec<f64> = x.iter().map(|x| x.re).collect();
    let t = followed(reverse, t, &x, Forward::from(combine_real(&map.spline.weights(t), &still)));
    Some(combine(&map.spline.weights(t), &moving_arc(reverse, nodes)))
}

#[test]
fn a_trip_adds_how_it_moves_along_the_arc() {
    at_solutions(|solved, reverse, _| {
        let outline = &reverse.section.panels.outline;
        let mut by_arc = vec![Lanes::zeros(); outline.len() + 2];
        let mut collected = Collected::nothing(outline.len());
        for side in Side::BOTH {
            add_trip(solved, reverse, side, &mut by_arc, &mut collected);
        }
        for direction in Direction::several(outline) {
            let nodes = direction.moved(&outline.nodes);
            let (side, trip) = Side::BOTH
                .into_iter()
                .find_map(|side| Some((side, moving_trip(solved, reverse, side, &nodes)?)))
                .unwrap();
            let weight =
                reverse.multipliers.transition[side.index()] * -reverse.at.transition[side.index()].eps[BY_TRIP];
            let mut sums = Sums::zero().over(&collected, &direction);
            for (by_arc, arc) in by_arc.iter().zip(moving_arc(reverse, &nodes)) {
                sums.add(by_arc, arc.v1);
            }
            sums.assert_are("trip", &[trip], |_| weight);
        }
    });
}

/// Everything that the surface coordinate carries, with the weight of each number: residuals of the layer and of
/// transition, speeds at the points, defects at the nodes, and the places that outputs are taken at.
fn on_surface(solved: &Solved, reverse: &Reverse, nodes: &[[Forward; 2]]) -> Vec<(Forward, Lanes)> {
    let (layer, at, map) = (&solved.system.layer, reverse.at, &reverse.section.map);
    let numbering = at.numbering;
    let arc = moving_arc(reverse, nodes);
    let lengths = arc_lengths(nodes);
    let total = lengths[lengths.len() - 1];
    let stagnation = Forward::from(solved.unknowns.stagnation);
    let transition = solved.unknowns.transition.map(Forward::from);
    let mut index: Vec<Forward> = at.positions.index.iter().map(|t| Forward::from(t.re)).collect();
    index[numbering.side] = followed(reverse, index[numbering.side].re, &arc, stagnation);
    let abscissas = Side::BOTH.map(|side| {
        let transition = transition[side.index()];
        let mut abscissas: Vec<Forward> = layer.layout.laminar.iter().map(|f| transition * *f).collect();
        for (j, x) in abscissas.iter().enumerate() {
            let p = numbering.point(side, j);
            index[p] = followed(reverse, index[p].re, &arc, side.place(stagnation, *x));
        }
        let start = index[numbering.point(side, numbering.laminar - 1)];
        let edge = if side == Side::Upper { 0.0 } else { map.last() };
        for (i, h) in layer.layout.turbulent.iter().enumerate() {
            let t = start + (start - edge) * -*h;
            index[numbering.point(side, numbering.laminar + i)] = t;
            abscissas.push(side.distance(stagnation, combine(&map.spline.weights(t), &arc)));
        }
        abscissas
    });
    let law = layer.law.map(Forward::from);
    let derived: Vec<Derived<Forward>> = layer.derive(solved.unknowns, |state| state.map(Forward::from), &law);
    let gap: Vec<Forward> = layer.gap.iter().map(|gap| Forward::from(*gap)).collect();
    let mut all = Vec::new();
    let residuals = testing::residuals(layer, &derived, &abscissas, &law, &gap);
    for (residual, multiplier) in residuals.as_flattened().iter().zip(reverse.multipliers.chain.as_flattened()) {
        all.push((*residual, -multiplier));
    }
    for side in Side::BOTH {
        let last = Forward::from(solved.unknowns.stations[numbering.last_laminar(side)].amplification());
        let trip = moving_trip(solved, reverse, side, nodes);
        let numbers = [transition[side.index()], stagnation, total, last];
        let residual = testing::transition(layer, side, numbers, trip);
        all.push((residual, -reverse.multipliers.transition[side.index()]));
    }
    let rate: Vec<Forward> = index.iter().map(|t| combine(&map.spline.slope_weights(*t), &arc)).collect();
    let mass = mass(reverse);
    let speeds = interpolated(reverse, &index, &rate).into_iter().zip(local(&mass, &index, &rate));
    let weights = entries(&reverse.point_weights);
    all.extend(speeds.zip(&weights[1..]).map(|((panel, local), weight)| (panel + local, *weight)));
    let node_mass = entries(&reverse.node_mass);
    all.extend(projected(&mass, nodes.len(), &index).into_iter().zip(node_mass));
    all
}

#[test]
fn the_surface_as_a_whole_follows_the_nodes() {
    at_solutions(|solved, reverse, direct| {
        let outline = &reverse.section.panels.outline;
        // what the outputs ask of the places directly is another matter
        let none = direct.as_ref().map(|direct| {
            let mut direct = direct.clone();
            direct.index.clear();
            direct
        });
        let mut collected = Collected::nothing(outline.len());
        add_surface(solved, reverse, &none, &mut collected);
        for direction in Direction::several(outline) {
            let all = on_surface(solved, reverse, &direction.moved(&outline.nodes));
            let (forward, weights): (Vec<Forward>, Vec<Lanes>) = all.into_iter().unzip();
            Sums::zero().over(&collected, &direction).assert_are("surface", &forward, |i| weights[i]);
        }
    });
}

#[test]
fn places_that_outputs_are_taken_at_follow_the_nodes() {
    at_solutions(|solved, reverse, direct| {
        let outline = &reverse.section.panels.outline;
        let none = direct.as_ref().map(|direct| {
            let mut direct = direct.clone();
            direct.index.clear();
            direct
        });
        let collect = |direct: &_| {
            let mut collected = Collected::nothing(outline.len());
            add_surface(solved, reverse, direct, &mut collected);
            collected
        };
        let (with, without) = (collect(direct), collect(&none));
        for direction in Direction::several(outline) {
            let arc = moving_arc(reverse, &direction.moved(&outline.nodes));
            for (o, side) in [(4, Side::Upper), (5, Side::Lower)] {
                let [(point, slope)] = direct.as_ref().to_array()[o].index[..] else { panic!("one place each") };
                assert_eq!(point, reverse.at.numbering.point(side, reverse.at.numbering.laminar - 1));
                // transition is an unknown, held at its distance from the stagnation point, held too
                let stagnation = Forward::from(solved.unknowns.stagnation);
                let place = side.place(stagnation, Forward::from(solved.unknowns.transition[side.index()]));
                let index = followed(reverse, reverse.at.positions.index[point].re, &arc, place);
                let rates = |of: &Collected| -> [f64; 2] {
                    let nodes = of.nodes.as_ref().to_array()[o];
                    let terms = nodes.iter().zip(&direction.nodes).map(|(by, rate)| by[0] * rate[0] + by[1] * rate[1]);
                    terms.fold([0.0; 2], |[sum, scale], term| [sum + term, scale + term.abs()])
                };
                let ([a, scale], [b, _]) = (rates(&with), rates(&without));
                assert_same("place", a - b, slope * index.v1, scale);
            }
        }
    });
}
