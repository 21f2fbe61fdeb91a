//! `aeroform section`: builds a section, measures it and exports it.

use super::export::{ExportArguments, export};
use super::failure::Failure;
use super::output::{print, print_json};
use super::shape_arguments::ShapeArguments;
use crate::report::json::{Dimension, SectionReport};
use crate::report::{OutputDirectory, engineering};
use std::path::Path;

/// Arguments of `aeroform section`.
#[derive(Debug, clap::Args)]
pub(super) struct SectionArguments {
    #[command(flatten)]
    shape: ShapeArguments,
    /// Write the section to a file; the ending chooses the format: .dat (Selig), .csv, .svg, .step, .igs or .dxf
    #[arg(long, value_name = "FILE")]
    out: Option<String>,
    #[command(flatten)]
    export: ExportArguments,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

pub(super) fn run(arguments: &SectionArguments) -> Result<(), Failure> {
    let definition = arguments.shape.definition()?;
    let section = definition.section().map_err(|error| arguments.shape.failure(&error))?;
    if let Some(path) = &arguments.out {
        let text = export(&section, Path::new(path), &arguments.export)?;
        write_file(Path::new(path), text)?;
    } else if !arguments.export.is_empty() {
        return Err(Failure::Input(format!(
            "{} says how a file is written; name it by --out",
            arguments.export.first()
        )));
    }
    let unit = arguments.export.unit.map(|unit| unit.symbol());
    let report = SectionReport::new(&definition, &section, unit);
    if arguments.json { print_json(&report) } else { print(&as_text(&report)) }
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

/// Digits of a measure in text.
const DIGITS: usize = 7;

fn as_text(report: &SectionReport) -> String {
    let in_chords = report.length_unit == "chord";
    let mut text = format!("{}, {} control points", report.name, report.control_points);
    if !in_chords {
        text += &format!("; lengths in the {}", long_name(&report.length_unit));
    }
    text.push('\n');
    let chord = report.measures.get("chord").copied().flatten().filter(|c| *c > 0.0);
    for ((name, value), (_, dimension)) in report.measures.iter().zip(SectionReport::MEASURES) {
        let Some(value) = *value else {
            text += &format!("  {name:20} {:>14}\n", "none");
            continue;
        };
        let of_chord = |power: i32| match chord.filter(|_| !in_chords && name != "chord") {
            Some(chord) => format!("  ({} of the chord{})", engineering(value / chord.powi(power), 5), square(power)),
            None => String::new(),
        };
        let unit = match dimension {
            Dimension::Length if in_chords => "chord".into(),
            Dimension::Area if in_chords => "chord²".into(),
            Dimension::Length => format!("{}{}", short_name(&report.length_unit), of_chord(1)),
            Dimension::Area => format!("{}²{}", short_name(&report.length_unit), of_chord(2)),
            Dimension::Share => "of the chord".into(),
            Dimension::Angle => "degrees".into(),
        };
        text += &format!("  {name:20} {:>14} {unit}\n", engineering(value, DIGITS));
    }
    if report.self_intersecting {
        text += "  the section crosses itself\n";
    }
    text
}

fn square(power: i32) -> &'static str {
    if power == 2 { "²" } else { "" }
}

/// The unit of a file as the head line names it.
fn long_name(unit: &str) -> String {
    if unit == "unit of the file" { unit.into() } else { format!("unit of the file, {unit}") }
}

/// The unit of a file behind a number.
fn short_name(unit: &str) -> &str {
    if unit == "unit of the file" { "units" } else { unit }
}
