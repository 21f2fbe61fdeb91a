//! The `[pressure_target]` table: pressures from a file, from the case itself, or of another section.

use super::document::Document;
use super::error::CaseError;
use super::flow::{check, conditions, panel_solver};
use super::pressure_table::{on_the_chord, read};
use super::schema::{Alpha, CaseTable, FlowTable, PressureTargetTable};
use crate::design::{FlowAnalysis, OperatingPoint, PlacesOnChord, PressureSide, PressureTarget};
use crate::flow::{Condition, FlowSolver, panel_parameters};
use crate::optimize::limited::read_limited;
use crate::section::Section;
use std::path::Path;

/// Largest file that is read, in bytes.
const MOST_BYTES: u64 = 16 << 20;
const TABLE: &str = "pressure_target";

/// Sets the wanted pressures of a case, if it has any. `definition` builds the section of the table.
pub(super) fn set_pressure_target(
    document: &Document,
    table: &CaseTable,
    folder: &Path,
    section: &Section<f64>,
    flow: &mut Option<FlowAnalysis>,
    target_section: Option<Section<f64>>,
) -> Result<(), CaseError> {
    let Some(wanted) = &table.pressure_target else { return Ok(()) };
    let Some(flow) = flow else {
        return Err(document.error(&[TABLE], "wanted pressures need a [flow] table with the operating point"));
    };
    if flow.solver() != panel_solver().name() {
        let message = format!("pressures are matched with the panel solver, and the case uses {}", flow.solver());
        return Err(document.error(&[TABLE], message));
    }
    let point = point(document, wanted, flow.points())?;
    let sides = match (&wanted.file, target_section, wanted.upper.is_some() || wanted.lower.is_some()) {
        (Some(file), None, false) => from_file(document, &folder.join(file), file)?.map(Some),
        (None, Some(other), false) => {
            let condition = condition(document, wanted, &flow.points()[point])?;
            of_section(document, &other, &condition)?.map(Some)
        }
        (None, None, true) => [wanted.upper.clone(), wanted.lower.clone()],
        _ => {
            let message = "give exactly one of `file`, `section`, and points in `upper`, `lower` or both";
            return Err(document.error(&[TABLE], message));
        }
    };
    if wanted.flow.is_some() && wanted.section.is_none() {
        return Err(document.error(&[TABLE, "flow"], "`flow` is the operating point of `section`, which is not given"));
    }
    let mut prepared = [None, None];
    for ((side, points), key) in prepared.iter_mut().zip(sides).zip(["upper", "lower"]) {
        if let Some(points) = points {
            let prepare = PressureSide::new(&points);
            *side = Some(prepare.map_err(|e| document.error(&[TABLE, key], format!("{key} side: {e}")))?);
        }
    }
    let target = PressureTarget { sides: prepared, point };
    flow.set_pressure_target(target, section).map_err(|e| document.error(&[TABLE], e.to_string()))
}

/// The operating point whose pressures are compared.
fn point(document: &Document, wanted: &PressureTargetTable, points: &[OperatingPoint]) -> Result<usize, CaseError> {
    let Some(name) = &wanted.point else {
        if points.len() > 1 {
            let names: Vec<&str> = points.iter().map(|p| p.name.as_str()).collect();
            let message = format!("say with `point` which operating point is meant: {}", names.join(", "));
            return Err(document.error(&[TABLE], message));
        }
        return Ok(0);
    };
    points.iter().position(|p| p.name == *name).ok_or_else(|| {
        let names: Vec<&str> = points.iter().map(|p| p.name.as_str()).collect();
        let message = format!("there is no operating point {name:?}; there are: {}", names.join(", "));
        document.error(&[TABLE, "point"], message)
    })
}

fn from_file(document: &Document, path: &Path, name: &str) -> Result<[Vec<[f64; 2]>; 2], CaseError> {
    let wrong = |message: String| document.error(&[TABLE, "file"], message);
    let bytes =
        read_limited(path, MOST_BYTES).map_err(|e| wrong(format!("{}: cannot be read: {e}", path.display())))?;
    let text = String::from_utf8(bytes).map_err(|e| wrong(format!("{name} is not text (UTF-8): {e}")))?;
    read(&text).map_err(|error| {
        let line = error.line.map(|line| format!(":{line}")).unwrap_or_default();
        wrong(format!("{name}{line}: {}", error.message))
    })
}

/// The operating point of the other section: that of the case, unless the table has one.
fn condition(
    document: &Document,
    wanted: &PressureTargetTable,
    point: &OperatingPoint,
) -> Result<Condition, CaseError> {
    let Some(table) = &wanted.flow else { return Ok(point.condition) };
    let path = [TABLE, "flow"];
    let FlowTable { name, weight, panels, stations, solver, .. } = table;
    if name.is_some() || weight.is_some() || panels.is_some() || stations.is_some() || solver.is_some() {
        return Err(document.error(&path, "`name`, `weight`, `panels`, `stations` and `solver` have no meaning here"));
    }
    if matches!(table.alpha, Some(Alpha::Free(_))) {
        return Err(document.error(&[TABLE, "flow", "alpha"], "the wanted pressures have a prescribed angle or lift"));
    }
    match conditions(document, table, &path)?[..] {
        [condition] => {
            check(document, &condition, &panel_solver(), &path)?;
            Ok(condition)
        }
        _ => Err(document.error(&path, "one operating point, without lists of values")),
    }
}

/// The pressures of another section.
fn of_section(
    document: &Document,
    section: &Section<f64>,
    condition: &Condition,
) -> Result<[Vec<[f64; 2]>; 2], CaseError> {
    let wrong = |message: String| document.error(&[TABLE, "section"], message);
    let parameters = panel_parameters(section, super::flow::PANELS + 1);
    let nodes: Vec<[f64; 2]> = parameters.iter().map(|&u| section.curve().point_at(u)).collect();
    let prepared = panel_solver().section(&nodes, section.trailing_edge()).map_err(|e| wrong(e.to_string()))?;
    let solution = prepared.analyze(condition, None).map_err(|e| wrong(e.to_string()))?;
    if !solution.is_reliable() {
        return Err(wrong(format!("the flow about this section is {}; it has no pressures to match", solution.status)));
    }
    let cp = &solution.distributions().cp;
    let (nose, line) = PlacesOnChord::new(&nodes);
    let at = |k: usize| [line.place(nodes[k]), cp[k]];
    Ok([(0..=nose).rev().map(at).collect(), (nose..nodes.len()).map(at).collect()].map(on_the_chord))
}
