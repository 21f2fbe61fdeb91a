//! The linearised system against differences, and elimination against the full system.

use super::layout::Layout;
use super::response::{FlowResponse, SectionResponse};
use super::system::{Change, Reduced, System};
use super::unknowns::Unknowns;
use crate::flow::TrailingEdge;
use crate::flow::boundary_layer::gas::Gas;
use crate::flow::panel::outline::Outline;
use crate::flow::testcases::naca_symmetric;

fn shifted(unknowns: &Unknowns, change: &Change, factor: f64) -> Unknowns {
    let mut next = unknowns.clone();
    for (state, [theta, shape, third, speed]) in next.stations.iter_mut().zip(&change.stations) {
        state.log_theta += factor * theta;
        state.log_shape += factor * shape;
        state.third += factor * third;
        state.log_speed += factor * speed;
    }
    next.stagnation += factor * change.globals[0];
    next.transition = [0, 1].map(|k| next.transition[k] + factor * change.globals[1 + k]);
    next
}

fn residuals(system: &System, unknowns: &Unknowns) -> Vec<f64> {
    let at = system.linearise(unknowns);
    let chain = at.blocks.iter().flat_map(|b| b.residual);
    let transition = at.transition.iter().map(|t| t.re);
    chain
        .chain(at.speed_residual.iter().copied())
        .chain(transition)
        .chain([at.speeds.points[at.numbering.side].re])
        .collect()
}

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
        let gas = Gas::new(mach, 2e6);
        let system = System { section: &section, flow: &flow, layout: &layout, gas, n_critical: 9.0, trips };
        let start = system.start();
        let step = Reduced::new(&system.linearise(&start)).unwrap().step();
        let (h, here) = (1e-6, residuals(&system, &start));
        let (above, below) =
            (residuals(&system, &shifted(&start, &step, h)), residuals(&system, &shifted(&start, &step, -h)));
        for (i, r) in here.iter().enumerate() {
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
    let system = System {
        section: &section,
        flow: &flow,
        layout: &layout,
        gas: Gas::new(0.0, 3e6),
        n_critical: 9.0,
        trips: [None, None],
    };
    let marched = system.linearise(&system.march(&system.start()));
    let worst = marched.blocks.iter().flat_map(|b| b.residual).fold(0.0, |w: f64, r| w.max(r.abs()));
    assert!(worst < 1e-6, "{worst}");
}
