//! Reverse sweep through the surface coordinate, down to the lengths of the panels: positions of the stations, splines,
//! projection, sub-panel speeds and trips.

use super::reverse::{Collected, Lanes, Reverse, lanes};
use crate::flow::coefficients::{COEFFICIENTS, Coefficients};
use crate::flow::duals::{Dual2, Dual3, Dual4, gradient};
use crate::flow::layer::equations::BY_TRIP;
use crate::flow::layer::{Side, TOTAL};
use crate::flow::linear::add_scaled;
use crate::flow::panel::coupling::projection;
use crate::flow::panel::coupling::subpanel::{LocalSpeed, LocalSpeeds};
use crate::flow::panel::coupling::system::signed;
use crate::flow::panel::solved::{Direct, Solved};
use crate::flow::surface::spline::{combine, combine_real};
use num_dual::DualNum;

/// Sensitivities to the node index of every point along the surface, and to the arc-length rate there.
struct AtPoints {
    /// Sensitivities to the node index, one entry per point.
    index: Vec<Lanes>,
    /// Sensitivities to the arc length per node index, one entry per point.
    rate: Vec<Lanes>,
}

/// Adds the derivatives that act through the surface coordinate.
pub(super) fn add_surface(
    solved: &Solved,
    reverse: &Reverse,
    direct: &Coefficients<Direct>,
    collected: &mut Collected,
) {
    let section = reverse.section;
    let t: Vec<f64> = reverse.at.positions.index.iter().map(|t| t.re).collect();
    let rates: Vec<f64> = t.iter().map(|&t| section.map.rate(t)).collect();
    let mut points = at_points(reverse, &t, &rates);
    for (o, direct) in direct.iter().enumerate() {
        for &(point, slope) in &direct.index {
            points.index[point][o] += slope;
        }
    }
    let mut by_arc = vec![Lanes::zeros(); section.len() + 2];
    for p in 1..t.len() - 1 {
        // the rate depends on the index too
        let turning = gradient(&section.map.rate(Dual2::from_re(t[p]).derivative(0)))[0];
        let (first, slopes) = section.map.spline.slope_weights(t[p]);
        let rate = points.rate[p];
        points.index[p] += rate * turning;
        for q in 0..4 {
            by_arc[first + q] += rate * slopes[q];
        }
    }
    add_places(solved, reverse, &t, &points.index, &mut by_arc);
    for side in Side::BOTH {
        add_trip(solved, reverse, side, &mut by_arc, collected);
    }
    let mut by_length = section.map.spline.coefficients_transposed(&by_arc);
    by_length[section.len() - 1] += transition_total(reverse);
    add_lengths(reverse, &by_length, collected);
}

/// Adds how the places of the points follow the arc length of the nodes. The stagnation point and the laminar stations
/// stand at given arc lengths, the turbulent stations at given fractions of the indices behind transition.
fn add_places(solved: &Solved, reverse: &Reverse, t: &[f64], by_index: &[Lanes], by_arc: &mut [Lanes]) {
    let (map, numbering) = (&reverse.section.map, &reverse.at.numbering);
    // at a given arc length the index falls where the arc length at the index grows
    let mut held = |t: f64, by_index: Lanes| {
        let (first, w) = map.spline.weights(t);
        let rate: f64 = map.rate(t);
        for q in 0..4 {
            by_arc[first + q] -= by_index * (w[q] / rate);
        }
    };
    held(t[numbering.side], by_index[numbering.side]);
    let abscissas = by_abscissas(reverse);
    let mut turbulent: Vec<(f64, Lanes)> = Vec::new();
    for side in Side::BOTH {
        for j in 0..numbering.laminar {
            let p = numbering.point(side, j);
            held(t[p], by_index[p]);
        }
        let mut start = Lanes::zeros();
        for (i, h) in solved.system.layer.layout.turbulent.iter().enumerate() {
            let j = numbering.laminar + i;
            let p = numbering.point(side, j);
            // distance from the stagnation point per arc length from the first node
            let by_arc_length = abscissas[numbering.station(side, j)] * -side.sign();
            let by_place = by_arc_length * map.rate::<f64>(t[p]);
            start += (by_index[p] + by_place) * (1.0 - h);
            turbulent.push((t[p], by_arc_length));
        }
        held(t[numbering.point(side, numbering.laminar - 1)], start);
    }
    for (t, by_arc_length) in turbulent {
        let (first, w) = map.spline.weights(t);
        for q in 0..4 {
            by_arc[first + q] += by_arc_length * w[q];
        }
    }
}

/// Sensitivities, by way of the equations of the layer, to the distances of the stations from the stagnation point.
fn by_abscissas(reverse: &Reverse) -> Vec<Lanes> {
    let numbering = &reverse.at.numbering;
    let mut result = vec![Lanes::zeros(); numbering.wake_start()];
    for k in 0..numbering.wake_start() {
        let first = k == 0 || k == numbering.side;
        for (by, m) in reverse.at.blocks[k].abscissas.iter().zip(&reverse.multipliers.chain[k]) {
            result[k] -= m * by[1];
            if !first {
                result[k - 1] -= m * by[0];
            }
        }
    }
    result
}

/// Sensitivity to the total arc length through transition.
fn transition_total(reverse: &Reverse) -> Lanes {
    let mut total = Lanes::zeros();
    for side in Side::BOTH {
        let g = gradient(&reverse.at.transition[side.index()]);
        total -= reverse.multipliers.transition[side.index()] * g[TOTAL];
    }
    total
}

/// Adds the effect of the trip of a side: a trip at a given x moves along the arc with the shape.
fn add_trip(solved: &Solved, reverse: &Reverse, side: Side, by_arc: &mut [Lanes], collected: &mut Collected) {
    let Some(arc) = solved.system.layer.trips[side.index()] else { return };
    let section = reverse.section;
    let spline = &section.map.spline;
    let t = section.map.index(arc);
    let x: Vec<f64> = section.panels.outline.nodes.iter().map(|p| p[0]).collect();
    let slope: f64 = combine(&spline.slope_weights(t), &spline.coefficients(&x));
    let by_nodes = spline.values_transposed(t, -section.map.rate::<f64>(t) / slope);
    let (first, w) = spline.weights(t);
    let by_trip = gradient(&reverse.at.transition[side.index()])[BY_TRIP];
    let weights = reverse.multipliers.transition[side.index()] * -by_trip;
    for q in 0..4 {
        by_arc[first + q] += weights * w[q];
    }
    for (nodes, weight) in collected.nodes.iter_mut().zip(&weights) {
        for (node, by_node) in nodes.iter_mut().zip(&by_nodes) {
            node[0] += weight * by_node;
        }
    }
}

/// Turns sensitivities to the arc lengths of the nodes into derivatives with respect to the nodes.
fn add_lengths(reverse: &Reverse, by_arc_length: &[Lanes], collected: &mut Collected) {
    let outline = &reverse.section.panels.outline;
    let mut sums = Lanes::zeros();
    for j in (0..outline.len() - 1).rev() {
        let [a, b] = outline.panel(j);
        let unit = |v: f64, k: usize| Dual4::from_re(v).derivative(k);
        let (dx, dy) = (unit(b[0], 2) - unit(a[0], 0), unit(b[1], 3) - unit(a[1], 1));
        let g = gradient(&num_dual::DualNum::sqrt(&(dx * dx + dy * dy)));
        // a longer panel moves all nodes behind it
        sums += by_arc_length[j + 1];
        for (nodes, sum) in collected.nodes.iter_mut().zip(&sums) {
            for c in 0..2 {
                nodes[j][c] += sum * g[c];
                nodes[j + 1][c] += sum * g[2 + c];
            }
        }
    }
}

/// The numbers of all coefficients together, entry by entry.
fn entries(each: &Coefficients<Vec<f64>>) -> Vec<Lanes> {
    (0..each.cl.len()).map(|i| lanes(each, |list| list[i])).collect()
}

/// Sensitivities at all points, whose node indices are `t` and whose arc-length rates are `rates`.
fn at_points(reverse: &Reverse, t: &[f64], rates: &[f64]) -> AtPoints {
    let empty = || vec![Lanes::zeros(); t.len()];
    let mut result = AtPoints { index: empty(), rate: empty() };
    let (mass, _) = signed(&reverse.at.mass, &reverse.at.numbering);
    let weights = entries(&reverse.point_weights);
    add_splines(reverse, &weights, t, rates, &mut result);
    add_local(&weights, t, rates, &mass, &mut result);
    add_projection(reverse, t, &mass, &mut result);
    result
}

/// Adds the effect of the interpolated strength less the wall response at panel resolution.
fn add_splines(reverse: &Reverse, weights: &[Lanes], t: &[f64], rates: &[f64], result: &mut AtPoints) {
    let fields = &reverse.at.speeds.fields;
    let strength: Vec<f64> = fields.strength.iter().map(|c| c.re).collect();
    let wall: Vec<f64> = fields.wall.iter().map(|c| c.re).collect();
    for p in 1..t.len() - 1 {
        let at = reverse.section.map.spline.weights(Dual2::from_re(t[p]).derivative(0));
        let rate = Dual2::from_re(rates[p]).derivative(1);
        let value: Dual2 = combine_real(&at, &strength) - combine_real::<Dual2>(&at, &wall) / rate;
        let g = gradient(&value);
        result.index[p] += weights[p] * g[0];
        result.rate[p] += weights[p] * g[1];
    }
}

/// Adds the effect of the sub-panel speeds.
fn add_local(weights: &[Lanes], t: &[f64], rates: &[f64], mass: &[f64], result: &mut AtPoints) {
    let slope = |k: usize| (mass[k + 1] - mass[k]) / (t[k + 1] - t[k]);
    let slopes: Vec<f64> = (0..t.len() - 1).map(slope).collect();
    // how fast the slopes change with the places of the points below and above
    let turning = |k: usize| {
        let (a, b) = (Dual2::from_re(t[k]).derivative(0), Dual2::from_re(t[k + 1]).derivative(1));
        let [below, above] = gradient(&((b - a).recip() * (mass[k + 1] - mass[k])));
        (below, above)
    };
    let (below, above): (Vec<f64>, Vec<f64>) = (0..slopes.len()).map(turning).unzip();
    let mut locals = LocalSpeeds::new(t, &slopes);
    // sensitivities to the places of all points
    let mut by_places: [Vec<f64>; COEFFICIENTS] = std::array::from_fn(|_| vec![0.0; t.len()]);
    let mut by_place = vec![0.0; t.len()];
    for p in 1..t.len() - 1 {
        let per_rate = Dual2::from_re(rates[p]).derivative(1).recip();
        let local = locals.at(t[p], p);
        let places = local.range.start..local.range.end + 1;
        let by_place = &mut by_place[..places.len()];
        spread(&local, [&below, &above].map(|rates| &rates[local.range.clone()]), by_place);
        let scaled = weights[p] * per_rate.re;
        for (by_places, scaled) in by_places.iter_mut().zip(&scaled) {
            add_scaled(&mut by_places[places.clone()], *scaled, by_place);
        }
        result.index[p] += scaled * local.by_place;
        result.rate[p] += weights[p] * (per_rate.eps[1] * local.speed);
    }
    for (k, index) in result.index.iter_mut().enumerate() {
        *index += Lanes::from_fn(|o, _| by_places[o][k]);
    }
}

/// Derivatives of a sub-panel speed with respect to the places of the points in reach. They act by way of the middles
/// of the intervals and of the slopes there, which change at the rates `turning` with the points below and above.
fn spread(local: &LocalSpeed, turning: [&[f64]; 2], by_place: &mut [f64]) {
    let intervals = || local.by_middle.iter().zip(local.influences);
    by_place.fill(0.0);
    for (end, turning) in turning.into_iter().enumerate() {
        for ((sum, (by_middle, influence)), turning) in by_place[end..].iter_mut().zip(intervals()).zip(turning) {
            *sum += 0.5 * by_middle + influence * turning;
        }
    }
}

/// Adds the effect of the projection of the mass defects to the nodes.
fn add_projection(reverse: &Reverse, t: &[f64], mass: &[f64], result: &mut AtPoints) {
    let nodes = reverse.section.len();
    let node_mass = entries(&reverse.node_mass);
    for p in 0..t.len() {
        let from = p.saturating_sub(1);
        let to = (p + 1).min(t.len() - 1);
        let window: [Dual3; 3] = std::array::from_fn(|q| Dual3::from_re(t[(from + q).min(to)]).derivative(q));
        projection::overlaps(&window[..=to - from], p - from, nodes, |i, weight| {
            for (index, g) in result.index[from..=to].iter_mut().zip(gradient(&weight)) {
                *index += node_mass[i] * (mass[p] * g);
            }
        });
    }
}

#[cfg(test)]
mod tests;
