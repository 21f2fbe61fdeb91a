//! The layer by itself, about a flat plate: no panels are needed.

use super::testing;
use super::{
    Derived, EdgeLaw, FreeStream, GLOBALS, Layer, Layout, OuterSpeeds, STAGNATION, Side, State, TOTAL, TRANSITION,
    Unknowns,
};
use crate::flow::layer::ByGlobal;
use crate::flow::surface::SurfaceMap;
use num_dual::Dual64;

/// Length of the plate, which both sides of the layer grow along from the leading edge to the trailing edge.
const LENGTH: f64 = 1.0;
/// Distance over which the speed rises at the leading edge: the layer starts at a stagnation point.
const NOSE: f64 = 0.005;
const REYNOLDS: f64 = 1e7;

/// Speed of the outer flow at a distance from the leading edge.
fn outer_speed(x: f64) -> f64 {
    x / x.hypot(NOSE)
}

/// Distances of the stations of the wake from the edge, and a gap that closes along them.
fn wake() -> (Vec<f64>, Vec<f64>) {
    let distances: Vec<f64> = (0..8).map(|k| 0.03 * f64::from(k * k)).collect();
    let gap = distances.iter().map(|d| 2e-3 / (1.0 + 40.0 * d)).collect();
    (distances, gap)
}

/// The layer of a plate in a stream of constant speed behind the nose, and its state by a march.
fn on_a_plate(mach: f64, gap: bool, check: impl Fn(&Layer<FreeStream<f64>>, &Unknowns)) {
    let (distances, closing) = wake();
    let gap = if gap { closing } else { vec![0.0; distances.len()] };
    let layout = Layout::new(120, 40, distances.len());
    let arc: Vec<f64> = (0..161).map(|i| 2.0 * LENGTH * f64::from(i) / 160.0).collect();
    let surface = SurfaceMap::new(&arc).unwrap();
    let layer = Layer {
        layout: &layout,
        law: FreeStream::new(mach, REYNOLDS),
        gap: &gap,
        distances: &distances,
        surface: &surface,
        n_critical: 9.0,
        trips: [None, Some(LENGTH + 0.2)],
    };
    let outer = OuterSpeeds { stagnation: LENGTH, surface: &|_, x| outer_speed(x), wake: &vec![1.0; distances.len()] };
    check(&layer, &layer.march(&outer));
}

fn derived(layer: &Layer<FreeStream<f64>>, unknowns: &Unknowns) -> Vec<Derived<f64>> {
    layer.derive(unknowns, |state| *state, &layer.law)
}

fn abscissas(layer: &Layer<FreeStream<f64>>, unknowns: &Unknowns) -> [Vec<f64>; 2] {
    Side::BOTH.map(|side| unknowns.abscissas(layer.layout, side, layer.surface))
}

#[test]
fn a_march_in_a_stream_that_is_no_panel_flow_satisfies_all_equations() {
    for mach in [0.0, 0.5] {
        on_a_plate(mach, false, |layer, unknowns| {
            let (derived, x) = (derived(layer, unknowns), abscissas(layer, unknowns));
            let residuals = layer.residuals(&derived, &x, &layer.law, layer.gap);
            for (k, residual) in residuals.as_flattened().iter().enumerate() {
                assert!(residual.abs() < 1e-6, "Mach {mach}, equation {k}: {residual}");
            }
            // the unknown is the compressible speed itself; the first turbulent stations, whose shape parameters are still
            // those of a laminar layer, find speeds of their own
            let numbering = layer.numbering();
            let at = |j: usize| &derived[numbering.station(Side::Upper, j)];
            let driven = |j: &usize| (*j < numbering.laminar || at(*j).hk < 2.49) && x[0][*j] < 0.9;
            assert!((0..numbering.side).filter(driven).count() > numbering.side - 20);
            for j in (0..numbering.side).filter(driven) {
                let speed = at(j).speed;
                assert!((speed - outer_speed(x[0][j])).abs() < 1e-14, "Mach {mach}, {j}: {speed}");
            }
        });
    }
}

#[test]
fn a_plate_has_the_layer_of_blasius_up_to_transition() {
    on_a_plate(0.0, false, |layer, unknowns| {
        let (derived, x) = (derived(layer, unknowns), abscissas(layer, unknowns));
        let [free, tripped] = unknowns.transition.map(|x| REYNOLDS * x);
        // where quiet wind tunnels have it
        assert!((2.8e6..5e6).contains(&free), "{free:e}");
        assert!((tripped / (0.2 * REYNOLDS) - 1.0).abs() < 1e-9, "{tripped:e}");
        let numbering = layer.numbering();
        let last = &derived[numbering.last_laminar(Side::Upper)];
        assert!((last.state.amplification() - 9.0).abs() < 0.1, "{}", last.state.amplification());
        for j in (0..numbering.laminar).filter(|j| x[0][*j] > 0.15) {
            let station = &derived[numbering.station(Side::Upper, j)];
            // by Thwaites the nose shifts the origin by 8/3 of its length
            let theta = 0.66412 * ((x[0][j] - NOSE * 8.0 / 3.0) / REYNOLDS).sqrt();
            assert!((station.theta / theta - 1.0).abs() < 0.02, "{j}: {} for {theta}", station.theta);
            // friction and dissipation of the closure are equal at 2.568
            assert!((station.hk / 2.5911 - 1.0).abs() < 0.012, "{j}: {}", station.hk);
        }
    });
}

#[test]
fn behind_transition_a_plate_has_the_friction_of_turbulent_layers() {
    on_a_plate(0.0, false, |layer, unknowns| {
        let (derived, x) = (derived(layer, unknowns), abscissas(layer, unknowns));
        let numbering = layer.numbering();
        for side in Side::BOTH {
            let at = |j: usize| &derived[numbering.station(side, j)];
            let growth = |j: usize| {
                let x = &x[side.index()];
                2.0 * (at(j).theta - at(j - 1).theta) / (x[j] - x[j - 1])
            };
            let j = numbering.side - 1;
            // Kármán and Schoenherr: local friction for the Reynolds number of the momentum thickness
            let log = at(j).re_theta.log10();
            let friction = 1.0 / (17.08 * log * log + 25.11 * log + 6.012);
            assert!((at(j).friction / friction - 1.0).abs() < 0.05, "{side:?}: {} for {friction}", at(j).friction);
            assert!((growth(j) / at(j).friction - 1.0).abs() < 0.02, "{side:?}: {}", growth(j));
            assert!((1.25..1.45).contains(&at(j).hk), "{side:?}: {}", at(j).hk);
        }
    });
}

/// A state off the equations everywhere.
fn disturbed(unknowns: &Unknowns) -> Unknowns {
    let mut result = unknowns.clone();
    for (k, state) in result.stations.iter_mut().enumerate() {
        *state = state.map(|v| v + 0.04 * (1.7 * k as f64).sin());
    }
    result
}

/// Entry `i` of a direction without any order in the space of the unknowns.
fn rate(i: usize) -> f64 {
    (0.4 + 2.3 * i as f64).sin()
}

#[test]
fn blocks_are_the_derivatives_of_the_residuals_in_every_unknown_and_in_the_total_length() {
    on_a_plate(0.4, true, |layer, unknowns| {
        let unknowns = disturbed(unknowns);
        let seeds: Vec<State> = (0..unknowns.stations.len()).map(|k| State::from_fn(|i| rate(4 * k + i))).collect();
        let globals: [f64; GLOBALS] = std::array::from_fn(|g| 0.01 * rate(1000 + g));
        let values = [unknowns.stagnation, unknowns.transition[0], unknowns.transition[1], layer.surface.total];
        // forward: all unknowns move at a time
        let [stagnation, upper, lower] = std::array::from_fn(|g| Dual64::new(values[g], globals[g]));
        let moved = |layout: &Layout, side: Side| {
            layout.abscissas(layer.surface, side, [stagnation, [upper, lower][side.index()]])
        };
        let law = layer.law.map(Dual64::from);
        let numbering = layer.numbering();
        let states = unknowns.stations.iter().zip(&seeds).map(|(state, seed)| state.zip(seed, Dual64::new));
        let stations: Vec<Derived<Dual64>> =
            states.enumerate().map(|(k, state)| Derived::new(state, numbering.regime(k), &law)).collect();
        let gap: Vec<Dual64> = layer.gap.iter().map(|gap| Dual64::from(*gap)).collect();
        let x = Side::BOTH.map(|side| moved(layer.layout, side));
        let forward = testing::residuals(layer, &stations, &x, &law, &gap);
        let plain = layer.residuals(&derived(layer, &unknowns), &abscissas(layer, &unknowns), &layer.law, layer.gap);
        // blocks: every unknown by itself
        let unit = |g: usize| ByGlobal::from_re(values[g]).derivative(g);
        let seeded = Side::BOTH.map(|side| {
            layer.layout.abscissas(layer.surface, side, [unit(STAGNATION), unit(TRANSITION[side.index()])])
        });
        let blocks = layer.blocks(&layer.derive_all(&unknowns), &seeded);
        assert_eq!(blocks.len(), forward.len());
        for (k, (block, forward)) in blocks.iter().zip(&forward).enumerate() {
            for (e, forward) in forward.iter().enumerate() {
                let couplings = block.upstream.iter().flatten().map(|(up, coupling)| (*up, &coupling[e]));
                let by_states = couplings.chain([(k, &block.own[e])]);
                let by_states = by_states.flat_map(|(at, row)| row.zip(&seeds[at], |a, b| a * b).numbers());
                let terms = by_states.chain(block.globals[e].iter().zip(globals).map(|(a, b)| a * b));
                let [sum, scale] = terms.fold([0.0; 2], |[sum, scale], t| [sum + t, scale + t.abs()]);
                assert!((sum - forward.eps).abs() <= 1e-11 * scale, "station {k}, {e}: {sum} for {}", forward.eps);
                assert!((block.residual[e] - plain[k][e]).abs() < 1e-12, "station {k}, {e}");
                assert!((forward.re - plain[k][e]).abs() < 1e-12, "station {k}, {e}");
            }
        }
    });
}

#[test]
fn the_residual_of_transition_has_its_derivatives_in_all_directions() {
    on_a_plate(0.0, false, |layer, unknowns| {
        let mut unknowns = unknowns.clone();
        unknowns.transition = unknowns.transition.map(|x| 0.97 * x);
        for side in Side::BOTH {
            let last = unknowns.stations[layer.numbering().last_laminar(side)].amplification();
            let found = layer.transition(&unknowns, side);
            // direction of the result, and which number of the forward sweep moves
            let own = TRANSITION[side.index()];
            for (direction, moves) in [(own, 0), (STAGNATION, 1), (TOTAL, 2), (GLOBALS, 3), (GLOBALS + 1, 4)] {
                let number = |value: f64, k: usize| Dual64::new(value, f64::from(u8::from(k == moves)));
                let numbers = [unknowns.transition[side.index()], unknowns.stagnation, layer.surface.total, last];
                let numbers = std::array::from_fn(|k| number(numbers[k], k));
                let trip = layer.trips[side.index()].map(|arc| number(arc, 4));
                let forward = testing::transition(layer, side, numbers, trip);
                assert!((found.re - forward.re).abs() < 1e-14);
                let scale = 1e-12 * forward.eps.abs().max(1e-3);
                assert!((found.eps[direction] - forward.eps).abs() <= scale, "{side:?} {direction}: {}", forward.eps);
            }
        }
    });
}
