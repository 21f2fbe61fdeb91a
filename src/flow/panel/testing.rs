//! Flows and directions that the tests of several modules need.

use super::coupling::response::{FlowResponse, SectionResponse};
use super::coupling::system::Stream;
pub(crate) use super::family::PanelFamily;
use super::outline::{Outline, TrailingEdge};
use super::record::PanelRecord;
use crate::flow::condition::{Condition, Incidence, Settings};
use crate::flow::layer::Layout;
use crate::flow::solution::Solution;
use crate::flow::testcases::naca_symmetric;
use crate::flow::{PanelledSection, panel_parameters};
use crate::section::SectionDefinition;
use num_dual::Dual2_64;
use std::any::Any;
use std::sync::LazyLock;

/// The flow about a blunt NACA 0012 at an angle of attack (radians), Re 1e6, free transition; `layout` from the number of
/// stations of the wake.
pub(crate) fn with_family<R>(
    alpha: f64,
    layout: impl FnOnce(usize) -> Layout,
    work: impl FnOnce(&PanelFamily) -> R,
) -> R {
    let outline = Outline::new(&naca_symmetric(0.12, 0.0025, 121), TrailingEdge::Blunt).unwrap();
    let section = SectionResponse::new(&outline).unwrap();
    let layout = layout(section.wake_distances.len());
    let flow = FlowResponse::new(&section, alpha);
    let stream = Stream { mach: 0.0, reynolds: 1e6, n_critical: 9.0, trips: [None; 2] };
    work(&PanelFamily { section: &section, flow: &flow, layout: &layout, stream, settings: Settings::default() })
}

/// A cambered section with a blunt edge, tripped on the lower side, where transition on the upper one is free; and one with
/// a sharp edge, tripped on the upper side, where the lower one is laminar up to the edge.
static SOLUTIONS: LazyLock<[Solution; 2]> =
    LazyLock::new(|| [cambered("naca4412", [None, Some(0.4)]), cambered("naca4412:sharp", [Some(0.15), None])]);

fn cambered(name: &str, trips: [Option<f64>; 2]) -> Solution {
    let section = SectionDefinition::parse(name).unwrap().section().unwrap();
    let nodes: Vec<_> = panel_parameters(&section, 61).iter().map(|&u| section.curve().point_at(u)).collect();
    let settings = Settings { laminar_stations: 24, turbulent_stations: 20, tolerance: 1e-11, ..Settings::default() };
    let condition = Condition { mach: 0.3, trips, ..Condition::new(Incidence::Alpha(0.05), 1e6) };
    let solution = PanelledSection::new(&nodes, section.trailing_edge()).unwrap();
    let solution = solution.analyze(&condition, &settings, None).unwrap();
    assert!(solution.is_reliable(), "{}", solution.status);
    solution
}

/// The converged flows about cambered sections with few nodes, the blunt edge first.
pub(super) fn cambered_flows() -> [&'static PanelRecord; 2] {
    SOLUTIONS.each_ref().map(|solution| {
        let record: &dyn Any = &*solution.record;
        record.downcast_ref().unwrap()
    })
}

/// The number of the forward sweeps, of another kind than those of the product.
pub(super) type Forward = Dual2_64;

/// A number that changes at a rate.
pub(super) fn moving(value: f64, rate: f64) -> Forward {
    Forward::new(value, rate, 0.0)
}

/// Entry `i` of list `k` of numbers of order one without any order.
pub(super) fn wave(k: usize, i: usize) -> f64 {
    (0.7 + 1.9 * k as f64 + (2.3 + 0.61 * k as f64) * i as f64).sin()
}

/// Numbers that change along list `k`.
pub(super) fn moving_along(k: usize, values: &[f64]) -> Vec<Forward> {
    values.iter().enumerate().map(|(i, value)| moving(*value, wave(k, i))).collect()
}

/// One direction in the space of all inputs of a flow.
pub(super) struct Direction {
    pub nodes: Vec<[f64; 2]>,
    pub alpha: f64,
    pub mach: f64,
    pub reynolds: f64,
}

impl Direction {
    /// Direction `k` for the nodes of an outline; the two nodes of a sharp edge stay one point.
    pub fn new(k: usize, outline: &Outline) -> Self {
        let mut nodes: Vec<[f64; 2]> = (0..outline.len()).map(|i| [wave(2 * k, i), wave(2 * k + 1, i)]).collect();
        if outline.trailing_edge == TrailingEdge::Sharp {
            nodes[outline.len() - 1] = nodes[0];
        }
        Self { nodes, alpha: wave(k, 100), mach: wave(k, 101), reynolds: 1e6 * wave(k, 102) }
    }

    /// Several of them.
    pub fn several(outline: &Outline) -> [Self; 3] {
        [0, 1, 2].map(|k| Self::new(k, outline))
    }

    /// Nodes that move in this direction.
    pub fn moved(&self, nodes: &[[f64; 2]]) -> Vec<[Forward; 2]> {
        nodes.iter().zip(&self.nodes).map(|(node, rate)| [0, 1].map(|c| moving(node[c], rate[c]))).collect()
    }
}

/// Asserts that two sums agree to round-off, `scale` being the sum of the magnitudes of their terms.
#[track_caller]
pub(super) fn assert_same(what: &str, found: f64, expected: f64, scale: f64) {
    assert!(scale > 0.0, "{what}: there is nothing to compare");
    assert!((found - expected).abs() <= 1e-11 * scale, "{what}: {found:e} for {expected:e}, terms of {scale:e}");
}
