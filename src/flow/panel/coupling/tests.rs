//! The linearised system against differences, and elimination against the full system.

use super::reduced::Reduced;
use super::response::{FlowResponse, SectionResponse};
use super::system::{Stream, System};
use crate::flow::TrailingEdge;
use crate::flow::layer::{Layout, Unknowns};
use crate::flow::panel::outline::Outline;
use crate::flow::search::Residuals;
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
            system.residuals(&next).all().collect()
        };
        let (above, below) = (moved(h), moved(-h));
        assert!(at.residuals.largest() > 0.01);
        for (i, r) in at.residuals.all().enumerate() {
            let slope = (above[i] - below[i]) / (2.0 * h);
            assert!((slope + r).abs() < 1e-6 * (1.0 + r.abs()), "equation {i}: {slope} for {}", -r);
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
    let worst = system.residuals(&system.march()).blocks.as_flattened().iter().fold(0.0, |w: f64, r| w.max(r.abs()));
    assert!(worst < 1e-6, "{worst}");
}
