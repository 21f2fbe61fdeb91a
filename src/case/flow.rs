//! `[flow]` tables: operating points and panels.

use super::document::Document;
use super::error::CaseError;
use super::schema::{Alpha, CaseTable, FlowTable, FlowTables, FreeAlpha, OneOrMore};
use crate::design::{Bounds, DesignError, FlowAnalysis, OperatingPoint, Variable, VariableKind};
use crate::flow::{
    Condition, FlowError, FlowSolver, Incidence, PanelSolver, STATIONS_PER_SIDE, Settings, SolverChoice,
    panel_parameters,
};
use crate::section::Section;
use std::ops::RangeInclusive;

/// Most operating points of a case; each is a flow in every evaluation.
const MOST_POINTS: usize = 200;
/// Panels where nothing is said.
pub(super) const PANELS: usize = 160;
/// Largest residual of the flow equations; constraints on the flow are met to 1e-10.
const TOLERANCE: f64 = 1e-12;
/// Natural change of an angle of attack in degrees: about a tenth of lift coefficient.
const ANGLE_STEP: f64 = 1.0;
/// Fewest and most panels; the panel equations are dense.
const PANEL_RANGE: RangeInclusive<usize> = 40..=1000;

/// The operating points of a case, and the angles of attack among them that are design variables.
#[derive(Debug, Clone, Default)]
pub(super) struct OperatingPoints {
    pub points: Vec<OperatingPoint>,
    pub angles: Vec<Variable>,
}

/// The operating points of all `[flow]` tables; none where there is no such table.
pub(super) fn operating_points(document: &Document, table: &CaseTable) -> Result<OperatingPoints, CaseError> {
    let Some(FlowTables(tables)) = &table.flow else { return Ok(OperatingPoints::default()) };
    if tables.is_empty() {
        return Err(document.error(&["flow"], "no operating point"));
    }
    let several = tables.len() > 1;
    let mut points: Vec<OperatingPoint> = Vec::new();
    let mut free: Vec<(usize, &FreeAlpha)> = Vec::new();
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
            let mut angle = None;
            if let Some(Alpha::Free(table)) = &table.alpha {
                angle = Some(free.len());
                free.push((points.len(), table));
            }
            points.push(OperatingPoint { name, weight: share, condition: *condition, angle });
        }
    }
    if points.iter().all(|p| p.weight == 0.0) {
        return Err(document.error(&["flow", "weight"], "all weights are zero"));
    }
    let angles = free.iter().map(|(place, table)| angle_variable(document, &points, *place, table));
    Ok(OperatingPoints { angles: angles.collect::<Result<_, _>>()?, points })
}

/// The angle of attack of the operating point at `place` as a design variable.
fn angle_variable(
    document: &Document,
    points: &[OperatingPoint],
    place: usize,
    table: &FreeAlpha,
) -> Result<Variable, CaseError> {
    let point = &points[place];
    let Incidence::Alpha(start) = point.condition.incidence else {
        return Err(document.error(&["flow", "alpha"], "an angle is free where the lift is not prescribed"));
    };
    let start = start.to_degrees();
    let name = if points.len() > 1 { format!("alpha_at({})", point.name) } else { "alpha".into() };
    let [lower, upper] = [table.lower.unwrap_or(f64::NEG_INFINITY), table.upper.unwrap_or(f64::INFINITY)];
    // written so that NaN fails
    if !(lower <= start && start <= upper) {
        let error = DesignError::Bounds { name, lower, start, upper };
        return Err(document.error(&["flow", "alpha"], error.to_string()));
    }
    let scale = table.scale.unwrap_or(ANGLE_STEP);
    if !(scale.is_finite() && scale > 0.0) {
        return Err(document.error(&["flow", "alpha"], DesignError::Scale { name, scale }.to_string()));
    }
    let bounds = Bounds { lower, upper };
    Ok(Variable { name, start, scale, bounds, step: ANGLE_STEP, kind: VariableKind::Angle })
}

/// The flow analysis that a case asks for, on panels of the undeformed `section`; none without operating points.
pub(super) fn flow_analysis(
    document: &Document,
    table: &CaseTable,
    section: &Section<f64>,
    points: &[OperatingPoint],
) -> Result<Option<FlowAnalysis>, CaseError> {
    let Some(FlowTables(tables)) = &table.flow else { return Ok(None) };
    let panels = shared_count(document, tables.iter().map(|t| t.panels), ("panels", PANELS, PANEL_RANGE))?;
    let settings = panel_solver().settings;
    let usual = ("stations", settings.stations_per_side(), STATIONS_PER_SIDE);
    let stations = shared_count(document, tables.iter().map(|t| t.stations), usual)?;
    let choice = solver_choice(document, tables)?;
    let conditions: Vec<Condition> = points.iter().map(|point| point.condition).collect();
    let nodes: Vec<[f64; 2]> =
        panel_parameters(section, panels + 1).into_iter().map(|u| section.curve().point_at(u)).collect();
    let settled = choice
        .settle(&nodes, section.trailing_edge(), &conditions)
        .map_err(|error| document.error(&["flow"], error.to_string()))?;
    let solver = settled.solver(settings.with_stations(stations));
    for condition in &conditions {
        check(document, condition, &*solver, &["flow"])?;
    }
    Ok(Some(FlowAnalysis::new(section, points.to_vec(), panels, solver)))
}

/// A number that all operating points share: that of the tables which say one, or the usual one. The last argument is the
/// key, the usual number, and the range.
fn shared_count(
    document: &Document,
    said: impl Iterator<Item = Option<usize>>,
    (key, usual, range): (&str, usize, RangeInclusive<usize>),
) -> Result<usize, CaseError> {
    let wrong = |message: String| document.error(&["flow", key], message);
    let mut said = said.flatten();
    let chosen = said.next().unwrap_or(usual);
    if said.any(|other| other != chosen) {
        return Err(wrong(format!("all operating points share the {key}; say it once")));
    }
    if !range.contains(&chosen) {
        return Err(wrong(format!("{chosen} {key}; from {} to {}", range.start(), range.end())));
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

/// The panel solver of pressures that are a target.
pub(super) fn panel_solver() -> PanelSolver {
    PanelSolver { settings: Settings { tolerance: TOLERANCE, ..Settings::default() } }
}

/// The operating points of a table at `path`: one for each combination of the values in its lists.
pub(super) fn conditions(document: &Document, table: &FlowTable, path: &[&str]) -> Result<Vec<Condition>, CaseError> {
    let list = |values: &Option<OneOrMore>| values.as_ref().map(|values| values.0.clone());
    let angles = table.alpha.as_ref().map(|alpha| match alpha {
        Alpha::Prescribed(degrees) | Alpha::Free(FreeAlpha { start: degrees, .. }) => degrees.0.clone(),
    });
    let incidences: Vec<Incidence> = match (angles, list(&table.cl)) {
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

/// Checks an operating point of the table at `path` against the ranges of the solver.
pub(super) fn check(
    document: &Document,
    condition: &Condition,
    solver: &dyn FlowSolver,
    path: &[&str],
) -> Result<(), CaseError> {
    solver.check(condition).map_err(|error| {
        let key = match &error {
            FlowError::Condition { name, .. } if name.starts_with("Mach") => "mach",
            FlowError::Condition { name, .. } if name.starts_with("Reynolds") => "reynolds",
            FlowError::Condition { name, .. } if name.starts_with("critical") => "ncrit",
            FlowError::Condition { name, .. } if name.starts_with("trip") => "trip",
            _ if matches!(condition.incidence, Incidence::Alpha(_)) => "alpha",
            _ => "cl",
        };
        let path: Vec<&str> = path.iter().copied().chain([key]).collect();
        document.error(&path, error.to_string())
    })
}
