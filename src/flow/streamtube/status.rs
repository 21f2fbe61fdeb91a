//! Whether a flow is to be trusted, and why one was not found.

use super::newton::Ended;
use super::record::StreamtubeRecord;
use super::settings::StreamtubeSettings;
use crate::flow::panel::REVERSED_EXTENT;
use crate::flow::solution::Status;

/// Highest local Mach number from which on a shock is strong enough to be the likely cause of a failure.
const STRONG_SHOCK: f64 = 1.3;
/// Place of the highest Mach number ahead of which a shock stands at the leading edge, in chords.
const LEADING_EDGE: f64 = 0.1;
/// Length of reversed flow over the length of a side from which on it is the likely cause of a failure.
const SEPARATION: f64 = 0.1;

/// Residual up to which the last state of a flow that was not found says something of the flow.
const TELLING: f64 = 1.0;

/// The status of a flow whose iteration ended so, on a grid of the settings or a coarser one.
pub(super) fn of(record: &StreamtubeRecord, ended: &Ended, settings: &StreamtubeSettings) -> Status {
    let extent = record.reversed_extent();
    if ended.converged {
        let grid = &record.problem.grid;
        let found = [grid.stations.fractions.len() - 1, grid.half()];
        if found != [settings.cells, settings.tubes] {
            let ([a, b], [c, d]) = (found, [settings.cells, settings.tubes]);
            let reason = format!("solved with {a} cells a side and {b} tubes, not with the {c} and {d} asked for");
            return Status::Unresolved { reason: reason.into() };
        }
        return if extent > REVERSED_EXTENT { Status::Separated { extent } } else { Status::Converged };
    }
    let residual = ended.residual;
    let (mach, place) = record.highest_mach();
    let outside = |name: &'static str, value: f64, reason: String| Status::OutsideModel {
        name: name.into(),
        value,
        reason: reason.into(),
        converged: false,
    };
    if let Some(x) = record.turned() {
        let reason = format!("(the grid turns over at {:.0} % of the chord)", 100.0 * x);
        return outside("no start", x, reason);
    }
    if !residual.is_finite() {
        let reason = "(the equations have no value in the first guess of the flow)".into();
        return outside("no start", record.problem.parameters.mach, reason);
    }
    if residual >= TELLING {
        return Status::NotConverged { residual, reversed: 0.0 };
    }
    let last = format!("residual {residual:.1e}");
    // written so that NaN is no cause
    if mach > STRONG_SHOCK && place < LEADING_EDGE {
        let where_ = format!("local Mach number {mach:.2} at {:.0} % of the chord", 100.0 * place);
        return outside("leading-edge shock", mach, format!("({where_}; {last}): the iteration did not converge"));
    }
    if mach > STRONG_SHOCK && extent > SEPARATION {
        let percent = 100.0 * extent;
        let why =
            format!("(shock at local Mach number {mach:.2}, reversed flow over {percent:.0} % of a side; {last})");
        return outside("buffet", mach, format!("{why}: a steady flow was not found"));
    }
    Status::NotConverged { residual, reversed: extent }
}
