//! `[flow]` tables: operating points and panels.

use super::document::Document;
use super::error::CaseError;
use super::schema::{CaseTable, FlowTable, Trip};
use crate::design::{FlowAnalysis, OperatingPoint};
use crate::flow::{Condition, FlowError, FlowSolver, Incidence, PanelSolver, Settings};
use crate::section::Section;
use std::sync::Arc;

/// Panels where nothing is said.
const PANELS: usize = 160;
/// Fewest and most panels; the panel equations are dense.
const PANEL_RANGE: std::ops::RangeInclusive<usize> = 40..=1000;

/// The flow analysis a case asks for, on panels of the undeformed `section`.
pub(super) fn flow_analysis(
    document: &Document,
    table: &CaseTable,
    section: &Section<f64>,
) -> Result<Option<FlowAnalysis>, CaseError> {
    let Some(tables) = &table.flow else { return Ok(None) };
    let tables = &tables.0;
    if tables.is_empty() {
        return Err(document.error(&["flow"], "no operating point"));
    }
    // constraints on the flow are met to 1e-10
    let solver = PanelSolver { settings: Settings { tolerance: 1e-12, ..Settings::default() } };
    let several = tables.len() > 1;
    let mut points: Vec<OperatingPoint> = Vec::new();
    for (index, table) in tables.iter().enumerate() {
        let name = match &table.name {
            Some(name) => name.clone(),
            None if several => (index + 1).to_string(),
            None => String::new(),
        };
        let sound = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if !name.chars().all(sound) {
            return Err(document.error(&["flow", "name"], "a name is made of letters, digits, '-', '_' and '.'"));
        }
        if points.iter().any(|p| p.name == name) {
            return Err(document.error(&["flow", "name"], format!("two operating points are called {name:?}")));
        }
        let weight = table.weight.unwrap_or(1.0);
        if !(weight >= 0.0 && weight.is_finite()) {
            return Err(document.error(&["flow", "weight"], format!("weight {weight} must not be negative")));
        }
        points.push(OperatingPoint { name, weight, condition: condition(document, table, &solver)? });
    }
    if points.iter().all(|p| p.weight == 0.0) {
        return Err(document.error(&["flow", "weight"], "all weights are zero"));
    }
    let mut panels = tables.iter().filter_map(|t| t.panels);
    let chosen = panels.next().unwrap_or(PANELS);
    if panels.any(|other| other != chosen) {
        return Err(document.error(&["flow", "panels"], "all operating points share the panels; say it once"));
    }
    if !PANEL_RANGE.contains(&chosen) {
        let (least, most) = (PANEL_RANGE.start(), PANEL_RANGE.end());
        return Err(document.error(&["flow", "panels"], format!("{chosen} panels; from {least} to {most}")));
    }
    Ok(Some(FlowAnalysis::new(section, points, chosen, Arc::new(solver))))
}

fn condition(document: &Document, table: &FlowTable, solver: &dyn FlowSolver) -> Result<Condition, CaseError> {
    let incidence = match (table.alpha, table.cl) {
        (Some(degrees), None) => Incidence::Alpha(degrees.to_radians()),
        (None, Some(lift)) => Incidence::Lift(lift),
        _ => return Err(document.error(&["flow"], "give either `alpha` (degrees) or `cl`")),
    };
    let Some(reynolds) = table.reynolds else {
        return Err(document.error(&["flow"], "missing key `reynolds`"));
    };
    let mut condition = Condition::new(incidence, reynolds);
    condition.mach = table.mach.unwrap_or(0.0);
    condition.n_critical = table.ncrit.unwrap_or(condition.n_critical);
    if let Some(Trip(trips)) = table.trip {
        condition.trips = trips.map(Some);
    }
    solver.check(&condition).map_err(|error| {
        let key = match &error {
            FlowError::Condition { name, .. } if name.starts_with("Mach") => "mach",
            FlowError::Condition { name, .. } if name.starts_with("Reynolds") => "reynolds",
            FlowError::Condition { name, .. } if name.starts_with("critical") => "ncrit",
            FlowError::Condition { name, .. } if name.starts_with("trip") => "trip",
            _ if table.alpha.is_some() => "alpha",
            _ => "cl",
        };
        document.error(&["flow", key], error.to_string())
    })?;
    Ok(condition)
}
