//! The boundary-layer equations for any scalar: what the blocks of the Jacobian linearise, in one sweep.

use super::chain::{Layer, WAKE_ORIGIN};
use super::unknowns::{Side, Unknowns};
use crate::flow::boundary_layer::gas::Gas;
use crate::flow::boundary_layer::interval::{self, Span};
use crate::flow::boundary_layer::station::{Derived, Regime, transition_state};
use crate::scalar::Scalar;

/// Residuals and mass defects of all stations for fixed unknowns, as functions of the gas and the dead air.
pub(crate) fn layer_residuals<S: Scalar>(
    layer: &Layer,
    unknowns: &Unknowns,
    abscissas: &[Vec<f64>; 2],
    gas: &Gas<S>,
    gap: &[S],
) -> (Vec<[S; 3]>, Vec<S>) {
    let numbering = &layer.numbering;
    let states: Vec<_> = unknowns.stations.iter().map(|s| s.map(S::from)).collect();
    let derived: Vec<_> = states.iter().enumerate().map(|(k, s)| Derived::new(*s, numbering.regime(k), gas)).collect();
    let mut residuals = Vec::with_capacity(states.len());
    for side in Side::BOTH {
        let x = &abscissas[side.index()];
        for j in 0..numbering.side {
            let k = numbering.station(side, j);
            let regime = numbering.regime(k);
            if j == 0 {
                let [a, b] = interval::similarity(&derived[k], S::from(x[0]));
                residuals.push([a, b, states[k].third]);
                continue;
            }
            let before = if j == numbering.laminar {
                Derived::new(transition_state(states[k - 1], gas), Regime::Turbulent, gas)
            } else {
                derived[k - 1]
            };
            let span = Span { x: [x[j - 1], x[j]].map(S::from), gap: [S::from(0.0); 2] };
            let [a, b] = interval::momentum_and_energy(&before, &derived[k], &span, regime);
            let third = if regime == Regime::Laminar {
                let growth = interval::growth(&states[k - 1], &states[k], gas);
                states[k].third - states[k - 1].third - growth * (x[j] - x[j - 1])
            } else {
                interval::lag(&before, &derived[k], &span, regime)
            };
            residuals.push([a, b, third]);
        }
    }
    let ends = Side::BOTH.map(|side| numbering.station(side, numbering.side - 1));
    let first = numbering.wake_start();
    residuals.push(interval::wake_start(&derived[ends[0]], &derived[ends[1]], &derived[first]));
    for j in 1..numbering.wake {
        let k = first + j;
        let x = [j - 1, j].map(|i| S::from(WAKE_ORIGIN + layer.distances[i]));
        let span = Span { x, gap: [gap[j - 1], gap[j]] };
        let [a, b] = interval::momentum_and_energy(&derived[k - 1], &derived[k], &span, Regime::Wake);
        residuals.push([a, b, interval::lag(&derived[k - 1], &derived[k], &span, Regime::Wake)]);
    }
    let masses = derived
        .iter()
        .enumerate()
        .map(|(k, d)| if k < first { d.mass } else { d.mass + states[k].log_speed.exp() * gap[k - first] })
        .collect();
    (residuals, masses)
}
