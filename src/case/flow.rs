//! `[flow]` tables: operating points and panels.

use super::document::Document;
use super::error::CaseError;
use super::schema::{CaseTable, FlowTable, Trip};
use crate::design::{FlowAnalysis, OperatingPoint};
use crate::flow::{Condition, FlowError, FlowSolver, Incidence, SolverChoice, panel_parameters};
use crate::section::Section;

/// Panels where nothing is said.
const PANELS: usize = 160;
/// Largest residual of the flow equations; constraints on the flow are met to 1e-10.
const TOLERANCE: f64 = 1e-12;
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
    let panels = panel_count(document, tables)?;
    let choice = solver_choice(document, tables)?;
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
        points.push(OperatingPoint { name, weight, condition: condition(document, table)? });
    }
    if points.iter().all(|p| p.weight == 0.0) {
        return Err(document.error(&["flow", "weight"], "all weights are zero"));
    }
    let conditions: Vec<Condition> = points.iter().map(|point| point.condition).collect();
    let nodes: Vec<[f64; 2]> =
        panel_parameters(section, panels + 1).into_iter().map(|u| section.curve().point_at(u)).collect();
    let settled = choice
        .settle(&nodes, section.trailing_edge(), &conditions)
        .map_err(|error| document.error(&["flow"], error.to_string()))?;
    let solver = settled.solver(TOLERANCE);
    for (table, condition) in tables.iter().zip(&conditions) {
        check(document, table, condition, &*solver)?;
    }
    Ok(Some(FlowAnalysis::new(section, points, panels, solver)))
}

/// The number of panels, which all operating points share.
fn panel_count(document: &Document, tables: &[FlowTable]) -> Result<usize, CaseError> {
    let mut panels = tables.iter().filter_map(|t| t.panels);
    let chosen = panels.next().unwrap_or(PANELS);
    if panels.any(|other| other != chosen) {
        return Err(document.error(&["flow", "panels"], "all operating points share the panels; say it once"));
    }
    if !PANEL_RANGE.contains(&chosen) {
        let (least, most) = (PANEL_RANGE.start(), PANEL_RANGE.end());
        return Err(document.error(&["flow", "panels"], format!("{chosen} panels; from {least} to {most}")));
    }
    Ok(chosen)
}

/// The flow solver, which all operating points share.
fn solver_choice(document: &Document, tables: &[FlowTable]) -> Result<SolverChoice, CaseError> {
    let mut names = tables.iter().filter_map(|t| t.solver.as_deref());
    let Some(chosen) = names.next() else { return Ok(SolverChoice::default()) };
    if names.any(|other| other != chosen) {
        return Err(document.error(&["flow", "solver"], "all operating points share the solver; say it once"));
    }
    chosen.parse().map_err(|message: String| document.error(&["flow", "solver"], message))
}

fn condition(document: &Document, table: &FlowTable) -> Result<Condition, CaseError> {
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
    Ok(condition)
}

/// Checks an operating point against the ranges of the solver.
fn check(
    document: &Document,
    table: &FlowTable,
    condition: &Condition,
    solver: &dyn FlowSolver,
) -> Result<(), CaseError> {
    solver.check(condition).map_err(|error| {
        let key = match &error {
            FlowError::Condition { name, .. } if name.starts_with("Mach") => "mach",
            FlowError::Condition { name, .. } if name.starts_with("Reynolds") => "reynolds",
            FlowError::Condition { name, .. } if name.starts_with("critical") => "ncrit",
            FlowError::Condition { name, .. } if name.starts_with("trip") => "trip",
            _ if table.alpha.is_some() => "alpha",
            _ => "cl",
        };
        document.error(&["flow", key], error.to_string())
    })
}
