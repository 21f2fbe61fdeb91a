//! `aeroform section`: builds a section, measures it and exports it.

use super::{Failure, print, print_json};
use crate::cad;
use crate::report::OutputDirectory;
use crate::section::{Measure, Section, SectionDefinition, SectionError};
use serde_json::{Value, json};
use std::path::Path;

/// Arguments of `aeroform section`.
#[derive(Debug, clap::Args)]
pub(super) struct SectionArguments {
    /// naca2412, naca0012:sharp, kulfan:upper=0.2,0.2/lower=-0.1,-0.1, or the path of a coordinate file
    shape: String,
    /// Write the section to a file; the ending chooses the format: .dat (Selig), .svg, .step, .igs, .dxf or .csv
    #[arg(long, value_name = "FILE")]
    out: Option<String>,
    /// Number of control points (default 101; coordinates are interpolated unless told)
    #[arg(long, value_name = "N")]
    control_points: Option<usize>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What is printed, in this order: measure, text after the number.
const MEASURES: [(Measure, &str); 10] = [
    (Measure::Area, "chord²"),
    (Measure::Thickness, "chord"),
    (Measure::ThicknessX, "chord"),
    (Measure::Camber, "chord"),
    (Measure::CamberX, "chord"),
    (Measure::NoseRadius, "chord"),
    (Measure::TrailingEdgeAngle, "degrees"),
    (Measure::TrailingEdgeGap, "chord"),
    (Measure::Perimeter, "chord"),
    (Measure::Chord, "unit of the coordinates"),
];

pub(super) fn run(arguments: &SectionArguments) -> Result<(), Failure> {
    // errors of files name the file themselves
    let bad = |error: SectionError| {
        let message = error.to_string();
        let named = message.contains(&arguments.shape);
        Failure::Input(if named { message } else { format!("{}: {message}", arguments.shape) })
    };
    let mut definition = SectionDefinition::parse(&arguments.shape).map_err(bad)?;
    if let Some(count) = arguments.control_points {
        definition = definition.with_control_points(count).map_err(bad)?;
    }
    let section = definition.section().map_err(bad)?;
    if let SectionDefinition::Coordinates(coordinates) = &definition {
        for repair in coordinates.repairs() {
            eprintln!("aeroform: {}: repaired: {repair}", arguments.shape);
        }
    }
    let values: Vec<f64> = MEASURES.iter().map(|(measure, _)| value(measure, &section)).collect();
    if let Some(path) = &arguments.out {
        let text = export(&section, Path::new(path))?;
        write_file(Path::new(path), text)?;
    }
    if arguments.json {
        print_json(&as_json(&definition, &section, &values))
    } else {
        print(&as_text(&section, &values))
    }
}

/// A measure in the units of the command line; NaN where the section has none (a symmetric one no place of camber).
fn value(measure: &Measure, section: &Section<f64>) -> f64 {
    let value = measure.evaluate(section).unwrap_or(f64::NAN);
    if *measure == Measure::TrailingEdgeAngle { value.to_degrees() } else { value }
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

fn as_text(section: &Section<f64>, values: &[f64]) -> String {
    let mut text = format!("{}, {} control points\n", section.name(), section.curve().control_points().len());
    for ((measure, unit), value) in MEASURES.iter().zip(values) {
        let number = if value.is_finite() { format!("{value:.9}") } else { "none".into() };
        text.push_str(&format!("  {:20} {number:>14} {unit}\n", measure.name()));
    }
    text
}

fn as_json(definition: &SectionDefinition, section: &Section<f64>, values: &[f64]) -> Value {
    let mut result = serde_json::Map::new();
    result.insert("name".into(), json!(section.name()));
    for ((measure, _), value) in MEASURES.iter().zip(values) {
        result.insert(measure.name(), json!(value));
    }
    let curve = section.curve();
    result.insert("centroid".into(), json!(section.centroid().ok()));
    result.insert("control_points".into(), json!(curve.control_points().len()));
    result.insert("trailing_edge".into(), json!(format!("{:?}", section.trailing_edge()).to_lowercase()));
    result.insert("parameters".into(), definition.parameters().into_iter().map(|(n, v)| (n, json!(v))).collect());
    result.insert("self_intersecting".into(), json!(section.self_intersection().is_some()));
    let curve_json = json!({
        "degree": curve.degree(), "knots": curve.knots().as_slice(), "control_points": curve.control_points(),
    });
    result.insert("curve".into(), curve_json);
    Value::Object(result)
}
