//! `aeroform section`: builds a section, measures it and exports it.

use super::failure::Failure;
use super::output::{print, print_json};
use super::shape_arguments::ShapeArguments;
use crate::cad;
use crate::report::OutputDirectory;
use crate::report::json::SectionReport;
use crate::section::Section;
use std::path::Path;

/// Arguments of `aeroform section`.
#[derive(Debug, clap::Args)]
pub(super) struct SectionArguments {
    #[command(flatten)]
    shape: ShapeArguments,
    /// Write the section to a file; the ending chooses the format: .dat (Selig), .svg, .step, .igs, .dxf or .csv
    #[arg(long, value_name = "FILE")]
    out: Option<String>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &SectionArguments) -> Result<(), Failure> {
    let definition = arguments.shape.definition()?;
    let section = definition.section().map_err(|error| arguments.shape.failure(&error))?;
    if let Some(path) = &arguments.out {
        let text = export(&section, Path::new(path))?;
        write_file(Path::new(path), text)?;
    }
    let report = SectionReport::new(&definition, &section);
    if arguments.json { print_json(&report) } else { print(&as_text(&report)) }
}

fn export(section: &Section<f64>, path: &Path) -> Result<String, Failure> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let by_cad = |text: Result<String, cad::CadError>| text.map_err(|e| Failure::Computation(e.to_string()));
    match ending.as_str() {
        "dat" => Ok(section.selig()),
        "csv" => {
            let rows = section.points(401).into_iter().map(|[x, y]| format!("{x},{y}\n"));
            Ok(std::iter::once("x,y\n".to_string()).chain(rows).collect())
        }
        "svg" => super::figures::section(section).map_err(|e| Failure::Computation(e.to_string())),
        "step" | "stp" => by_cad(cad::step(section.curve(), section.name())),
        "igs" | "iges" => by_cad(cad::iges(section.curve(), section.name())),
        "dxf" => by_cad(cad::dxf(section.curve(), section.name())),
        _ => Err(Failure::Input(format!(
            "{}: unknown format; the ending must be .dat, .svg, .step, .igs, .dxf or .csv",
            path.display()
        ))),
    }
}

/// Writes one file, whole or not at all.
fn write_file(path: &Path, text: String) -> Result<(), Failure> {
    let Some(name) = path.file_name().and_then(|n| n.to_str()) else {
        return Err(Failure::Input(format!("{}: not a file name", path.display())));
    };
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let directory = OutputDirectory::prepare(folder).map_err(|e| Failure::Input(e.to_string()))?;
    directory.write_all([(name, text)]).map_err(|e| Failure::Computation(e.to_string()))
}

fn as_text(report: &SectionReport) -> String {
    let mut text = format!("{}, {} control points\n", report.name, report.control_points);
    for ((name, value), (_, unit)) in report.measures.iter().zip(SectionReport::MEASURES) {
        let number = value.map_or("none".into(), |v| format!("{v:.9}"));
        text.push_str(&format!("  {name:20} {number:>14} {unit}\n"));
    }
    text
}
