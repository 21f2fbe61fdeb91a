//! The files of one design of a case: its section as coordinates and for CAD, and figures.

use super::failure::Failure;
use super::figures;
use crate::cad;
use crate::case::Case;
use crate::report::json::identifier;
use crate::section::{Measure, Section, SeligFormat};

/// Names and contents of the files of the design with these variables, one value per variable in the unit of each.
/// Flows that have no solution leave no figure.
pub(super) fn design_files(case: &Case, variables: &[f64]) -> Result<Vec<(String, String)>, Failure> {
    let failed = |e: &dyn std::fmt::Display| Failure::Computation(format!("{}: {e}", case.name));
    let problem = &case.problem;
    let shape = problem.shape(variables).map_err(|e| failed(&e))?;
    let section = named(case, &shape.section);
    let chord = Measure::Chord.evaluate(&section).map_err(|e| failed(&e))?;
    let options = cad::Options { unit: cad::LengthUnit::likely_for(chord), ..cad::Options::named(section.name()) };
    let mut files = vec![
        ("section.dat".to_string(), section.selig_with(&SeligFormat::default())),
        ("section.step".into(), cad::step_with(section.curve(), &options).map_err(|e| failed(&e))?),
        ("section.igs".into(), cad::iges_with(section.curve(), &options).map_err(|e| failed(&e))?),
        ("section.dxf".into(), cad::dxf_with(section.curve(), &options).map_err(|e| failed(&e))?),
        ("section.svg".into(), figures::design(problem, &shape, &case.name)),
    ];
    let flows = problem.flows(&shape).map(|flows| flows.solutions).unwrap_or_default();
    for (point, solution) in problem.operating_points().iter().zip(&flows) {
        let Some(solution) = solution.as_ref().ok().filter(|solution| solution.is_solved()) else { continue };
        let place = if point.name.is_empty() { String::new() } else { format!("_{}", identifier(&point.name)) };
        let title = format!("{}: {}", case.name, figures::condition_text(&point.condition_at(&shape)));
        files.push((format!("pressure{place}.svg"), figures::pressure(solution, &title)));
        files.push((format!("boundary_layer{place}.svg"), figures::boundary_layer(solution, &title)));
        files.extend(figures::mach_field(solution, &title).map(|svg| (format!("mach{place}.svg"), svg)));
    }
    Ok(files)
}

/// A section of a case under a name that tells where it comes from.
pub(super) fn named(case: &Case, section: &Section<f64>) -> Section<f64> {
    section.clone().with_name(format!("{} (aeroform {})", section.name(), case.name))
}
