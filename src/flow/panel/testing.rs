//! Flows that the tests of other modules need.

use super::coupling::response::{FlowResponse, SectionResponse};
use super::coupling::system::Stream;
use super::outline::{Outline, TrailingEdge};
pub(crate) use super::section::PanelFamily;
use crate::flow::condition::Settings;
use crate::flow::layer::Layout;
use crate::flow::testcases::naca_symmetric;

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
