//! The boundary-layer equations of all stations with their local Jacobians.
//!
//! Every block depends on two stations and two abscissas and is differentiated by dual numbers as wide as that.

use super::duals::{Dual2, Dual4, Dual8, Dual10, dual, gradient, widen};
use super::speeds::Positions;
use super::unknowns::{Numbering, Side, Unknowns};
use crate::differentiate::Tangent;
use crate::flow::boundary_layer::gas::Gas;
use crate::flow::boundary_layer::interval::{self, Span};
use crate::flow::boundary_layer::station::{Derived, Regime, transition_state};
use crate::flow::memory::{Recycled, kept};
use crate::scalar::Scalar;

/// Derivatives of the three equations of a station with respect to the four unknowns of one station.
pub(crate) type Coupling = [[f64; 4]; 3];

/// The three equations that belong to one station.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    pub residual: [f64; 3],
    pub own: Coupling,
    /// Stations upstream: none (first of a side), one, or two (start of the wake).
    pub upstream: [Option<(usize, Coupling)>; 2],
    /// With respect to stagnation, both transitions, total arc length.
    pub globals: Coupling,
}

kept!(Block);
kept!(Derived<Dual4>);

/// What is constant in the boundary-layer equations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Layer<'a> {
    pub numbering: Numbering,
    pub gas: Gas<f64>,
    /// Dead-air gap at the wake nodes.
    pub gap: &'a [f64],
    /// Distances of the wake nodes behind the edge.
    pub distances: &'a [f64],
}

/// Abscissa of the trailing edge in the wake: only ratios of abscissas enter, and they belong to the dissipation.
pub(crate) const WAKE_ORIGIN: f64 = 1.0;

/// Values and derivatives in the first eight directions.
fn split<const N: usize>(values: [Tangent<N>; 3]) -> ([f64; 3], Coupling, Coupling) {
    let (mut upstream, mut own) = ([[0.0; 4]; 3], [[0.0; 4]; 3]);
    for (i, value) in values.iter().enumerate() {
        upstream[i].copy_from_slice(&value.eps[..4]);
        own[i].copy_from_slice(&value.eps[4..8]);
    }
    (values.map(|v| v.re), upstream, own)
}

/// The closure at every station, with derivatives with respect to its own unknowns.
pub(crate) fn derive_all(layer: &Layer, unknowns: &Unknowns) -> Recycled<Derived<Dual4>> {
    let gas = layer.gas.map(Dual4::from);
    let derive = |(k, state): (usize, &crate::flow::boundary_layer::station::State<f64>)| {
        Derived::new(state.seed::<4>(0), layer.numbering.regime(k), &gas)
    };
    unknowns.stations.iter().enumerate().map(derive).collect()
}

/// All blocks, in the order of the stations.
pub(crate) fn blocks(
    layer: &Layer,
    unknowns: &Unknowns,
    derived: &[Derived<Dual4>],
    positions: &Positions,
) -> Recycled<Block> {
    let numbering = &layer.numbering;
    let mut result = Recycled::with_capacity(numbering.stations());
    for side in Side::BOTH {
        let x = &positions.abscissas[side.index()];
        result.push(first_block(&derived[numbering.station(side, 0)], x[0]));
        for j in 1..numbering.side {
            let k = numbering.station(side, j);
            result.push(surface_block(layer, unknowns, derived, k, j, [x[j - 1], x[j]]));
        }
    }
    result.push(wake_start(layer, derived));
    for j in 1..numbering.wake {
        result.push(wake_block(layer, derived, j));
    }
    result
}

/// Similarity at the first station of a side; amplification starts at zero.
fn first_block(derived: &Derived<Dual4>, x: Dual4) -> Block {
    let [a, b] = interval::similarity(derived, Dual4::from(x.re));
    let n = derived.state.third;
    let plain = derived.map(|v| Dual2::from(v.re));
    let [c, d] = interval::similarity(&plain, Dual2::from(x.re).derivative(0));
    let along = gradient(&x);
    let global = |v: Dual2| along.map(|g| gradient(&v)[0] * g);
    Block {
        residual: [a.re, b.re, n.re],
        own: [gradient(&a), gradient(&b), gradient(&n)],
        upstream: [None, None],
        globals: [global(c), global(d), [0.0; 4]],
    }
}

/// An interval on the surface that ends at station `k`, number `j` of its side.
fn surface_block(
    layer: &Layer,
    unknowns: &Unknowns,
    derived: &[Derived<Dual4>],
    k: usize,
    j: usize,
    x: [Dual4; 2],
) -> Block {
    let regime = layer.numbering.regime(k);
    let before = if j == layer.numbering.laminar {
        // the laminar end state, seen by the turbulent equations
        let gas = layer.gas.map(Dual4::from);
        Derived::new(transition_state(unknowns.stations[k - 1].seed::<4>(0), &gas), Regime::Turbulent, &gas)
    } else {
        derived[k - 1]
    };
    let wide = (before.map(|v| widen::<10>(v, 0)), derived[k].map(|v| widen::<10>(v, 4)));
    let moving = [0, 1].map(|e| Dual10::from_re(x[e].re).derivative(8 + e));
    let span = Span { x: moving, gap: [Dual10::from_re(0.0); 2] };
    let [a, b] = interval::momentum_and_energy(&wide.0, &wide.1, &span, regime);
    let third = if regime == Regime::Laminar {
        let (from, to) = (&unknowns.stations[k - 1], &unknowns.stations[k]);
        let (growth, slopes) = interval::growth_slopes(from, to, &layer.gas);
        let step = x[1].re - x[0].re;
        let [[a, b, _, c], [d, e, _, f]] = slopes.map(|end| end.map(|slope| -slope * step));
        let value = to.third - from.third - growth * step;
        dual(value, [a, b, -1.0, c, d, e, 1.0, f, growth, -growth])
    } else {
        interval::lag(&wide.0, &wide.1, &span, regime)
    };
    let (residual, upstream, own) = split([a, b, third]);
    let mut globals = [[0.0; 4]; 3];
    for (row, value) in globals.iter_mut().zip([a, b, third]) {
        for g in 0..4 {
            row[g] = value.eps[8] * x[0].eps[g] + value.eps[9] * x[1].eps[g];
        }
    }
    Block { residual, own, upstream: [Some((k - 1, upstream)), None], globals }
}

fn wake_start(layer: &Layer, derived: &[Derived<Dual4>]) -> Block {
    let numbering = &layer.numbering;
    let [upper, lower] = Side::BOTH.map(|side| numbering.station(side, numbering.side - 1));
    let k = numbering.wake_start();
    // three stations: two passes of two
    let plain = |d: &Derived<Dual4>| d.map(|v| Dual8::from(v.re));
    let first = interval::wake_start(
        &derived[upper].map(|v| widen::<8>(v, 0)),
        &plain(&derived[lower]),
        &derived[k].map(|v| widen::<8>(v, 4)),
    );
    let second =
        interval::wake_start(&plain(&derived[upper]), &derived[lower].map(|v| widen::<8>(v, 0)), &plain(&derived[k]));
    let (residual, by_upper, own) = split(first);
    let (_, by_lower, _) = split(second);
    Block { residual, own, upstream: [Some((upper, by_upper)), Some((lower, by_lower))], globals: [[0.0; 4]; 3] }
}

fn wake_block(layer: &Layer, derived: &[Derived<Dual4>], j: usize) -> Block {
    let k = layer.numbering.wake_start() + j;
    let (a, b) = (derived[k - 1].map(|v| widen::<8>(v, 0)), derived[k].map(|v| widen::<8>(v, 4)));
    let span = wake_span::<Dual8>(layer, j);
    let [momentum, energy] = interval::momentum_and_energy(&a, &b, &span, Regime::Wake);
    let (residual, upstream, own) = split([momentum, energy, interval::lag(&a, &b, &span, Regime::Wake)]);
    Block { residual, own, upstream: [Some((k - 1, upstream)), None], globals: [[0.0; 4]; 3] }
}

/// Abscissas and gaps of the wake interval that ends at node `j`.
pub(crate) fn wake_span<S: Scalar>(layer: &Layer, j: usize) -> Span<S> {
    Span {
        x: [j - 1, j].map(|i| S::from(WAKE_ORIGIN + layer.distances[i])),
        gap: [j - 1, j].map(|i| S::from(layer.gap[i])),
    }
}
