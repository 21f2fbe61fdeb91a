//! `[flow]` tables: operating points and panels.

use super::document::Document;
use super::error::CaseError;
use super::schema::{CaseTable, FlowTable, OneOrMore};
use crate::design::{FlowAnalysis, OperatingPoint};
use crate::flow::{Condition, FlowError, FlowSolver, Incidence, PanelSolver, Settings};
use crate::section::Section;
use std::sync::Arc;

/// Most operating points of a case; each is a flow in every evaluation.
const MOST_POINTS: usize = 200;
/// Panels where nothing is said.
pub(super) const PANELS: usize = 160;
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
        let weight = table.weight.unwrap_or(1.0);
        if !(weight >= 0.0 && weight.is_finite()) {
            return Err(document.error(&["flow", "weight"], format!("weight {weight} must not be negative")));
        }
        let conditions = conditions(document, table, &["flow"])?;
        if points.len() + conditions.len() > MOST_POINTS {
            return Err(document.error(&["flow"], format!("more than {MOST_POINTS} operating points")));
        }
        let share = weight / conditions.len() as f64;
        for (k, condition) in conditions.iter().enumerate() {
            let name = match (conditions.len(), name.as_str()) {
                (1, name) => name.to_string(),
                (_, "") => (k + 1).to_string(),
                (_, name) => format!("{name}-{}", k + 1),
            };
            if points.iter().any(|p| p.name == name) {
                return Err(document.error(&["flow", "name"], format!("two operating points are called {name:?}")));
            }
            points.push(OperatingPoint { name, weight: share, condition: *condition });
        }
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
    Ok(Some(FlowAnalysis::new(section, points, chosen, Arc::new(solver()))))
}

/// The solver of all cases: constraints on the flow are met to 1e-10.
pub(super) fn solver() -> PanelSolver {
    PanelSolver { settings: Settings { tolerance: 1e-12, ..Settings::default() } }
}

/// The operating points of a table at `path`: one for each combination of the values in its lists.
pub(super) fn conditions(document: &Document, table: &FlowTable, path: &[&str]) -> Result<Vec<Condition>, CaseError> {
    let list = |values: &Option<OneOrMore>| values.as_ref().map(|values| values.0.clone());
    let incidences: Vec<Incidence> = match (list(&table.alpha), list(&table.cl)) {
        (Some(degrees), None) => degrees.into_iter().map(|a| Incidence::Alpha(a.to_radians())).collect(),
        (None, Some(lifts)) => lifts.into_iter().map(Incidence::Lift).collect(),
        _ => return Err(document.error(path, "give either `alpha` (degrees) or `cl`")),
    };
    let Some(reynolds) = list(&table.reynolds) else {
        return Err(document.error(path, "missing key `reynolds`"));
    };
    let machs = list(&table.mach).unwrap_or(vec![0.0]);
    let ncrits: Vec<Option<f64>> = list(&table.ncrit).map_or(vec![None], |list| list.into_iter().map(Some).collect());
    let trips = table.trip.as_ref().map_or(vec![None], |trips| trips.0.iter().copied().map(Some).collect());
    let mut all = Vec::new();
    for &incidence in &incidences {
        for &reynolds in &reynolds {
            for &mach in &machs {
                for &ncrit in &ncrits {
                    for &trip in &trips {
                        let mut condition = Condition::new(incidence, reynolds);
                        condition.mach = mach;
                        condition.n_critical = ncrit.unwrap_or(condition.n_critical);
                        condition.trips = trip.map_or(condition.trips, |trip: [f64; 2]| trip.map(Some));
                        check(document, &condition, table.alpha.is_some(), path)?;
                        all.push(condition);
                        if all.len() > MOST_POINTS {
                            let message = format!("more than {MOST_POINTS} combinations of values");
                            return Err(document.error(path, message));
                        }
                    }
                }
            }
        }
    }
    Ok(all)
}

fn check(document: &Document, condition: &Condition, at_angle: bool, path: &[&str]) -> Result<(), CaseError> {
    solver().check(condition).map_err(|error| {
        let key = match &error {
            FlowError::Condition { name, .. } if name.starts_with("Mach") => "mach",
            FlowError::Condition { name, .. } if name.starts_with("Reynolds") => "reynolds",
            FlowError::Condition { name, .. } if name.starts_with("critical") => "ncrit",
            FlowError::Condition { name, .. } if name.starts_with("trip") => "trip",
            _ if at_angle => "alpha",
            _ => "cl",
        };
        let path: Vec<&str> = path.iter().copied().chain([key]).collect();
        document.error(&path, error.to_string())
    })
}
