//! A section as a file: coordinates, a figure, or a curve for CAD.

use super::failure::Failure;
use super::message::note;
use super::table_csv::csv;
use crate::cad::{self, LengthUnit, Options};
use crate::report::engineering;
use crate::section::{Digits, Measure, Section, SeligFormat};
use std::path::Path;

/// How a file is written.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct ExportArguments {
    /// Number of points of a .dat or .csv file [default: 2 for each knot span of the curve, 401 for .csv]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    points: Option<usize>,
    /// Decimals of a .dat file, or full for the shortest numbers that read back to the same bits [default: 7]
    #[arg(long, value_name = "D", value_parser = digits)]
    digits: Option<Digits>,
    /// Unit of the coordinates: m, cm, mm, in or ft; .step, .igs and .dxf files declare it [default: m for chords up to
    /// 10, mm for longer ones]
    #[arg(long, value_name = "UNIT", value_parser = unit)]
    pub unit: Option<LengthUnit>,
    /// Chord of the section in a .step, .igs or .dxf file, in that unit [default: that of the coordinates]
    #[arg(long, value_name = "LENGTH", value_parser = length, allow_negative_numbers = true)]
    chord: Option<f64>,
    /// Write the planar face inside of the outline into a .step file, instead of the outline alone
    #[arg(long)]
    face: bool,
}

fn digits(text: &str) -> Result<Digits, String> {
    match (text, text.parse::<usize>()) {
        ("full", _) | (_, Ok(17)) => Ok(Digits::Full),
        (_, Ok(decimals @ 1..=16)) => Ok(Digits::Decimals(decimals)),
        _ => Err("a number of decimals from 1 to 16 is wanted, or full".into()),
    }
}

fn unit(text: &str) -> Result<LengthUnit, String> {
    let known = || LengthUnit::symbols().collect::<Vec<_>>().join(", ");
    LengthUnit::from_symbol(text).ok_or_else(|| format!("the units are {}", known()))
}

fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value.is_finite() => Ok(value),
        _ => Err("a positive length is wanted".into()),
    }
}

/// Endings of file names.
type Endings = &'static [&'static str];

impl ExportArguments {
    /// Every option, whether it is given, and the files it serves.
    fn given(&self) -> [(&'static str, bool, Endings); 5] {
        const COORDINATES: Endings = &["dat", "csv"];
        const CAD: Endings = &["step", "stp", "igs", "iges", "dxf"];
        [
            ("--points", self.points.is_some(), COORDINATES),
            ("--digits", self.digits.is_some(), &["dat"]),
            ("--unit", self.unit.is_some(), CAD),
            ("--chord", self.chord.is_some(), CAD),
            ("--face", self.face, &["step", "stp"]),
        ]
    }

    /// Whether nothing is given that asks for a file; the unit alone also serves the text.
    pub fn is_empty(&self) -> bool {
        self.given().iter().all(|(name, given, _)| !given || *name == "--unit")
    }

    /// The first option that is given and asks for a file.
    pub fn first(&self) -> &'static str {
        self.given().iter().find(|(name, given, _)| *given && *name != "--unit").map_or("--out", |(name, ..)| name)
    }

    fn check(&self, path: &Path, ending: &str) -> Result<(), Failure> {
        match self.given().iter().find(|(_, given, endings)| *given && !endings.contains(&ending)) {
            None => Ok(()),
            Some((name, _, endings)) => {
                let endings: Vec<String> = endings.iter().map(|e| format!(".{e}")).collect();
                Err(Failure::Input(format!("{}: {name} is for files {}", path.display(), endings.join(", "))))
            }
        }
    }
}

/// Points of a CSV file unless told otherwise.
const CSV_POINTS: usize = 401;
/// Fewest and most points of a file.
const POINTS: std::ops::RangeInclusive<usize> = 3..=1_000_000;

/// The text of a file, in the format of its ending.
pub(super) fn export(section: &Section<f64>, path: &Path, arguments: &ExportArguments) -> Result<String, Failure> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    if let Some(count) = arguments.points.filter(|count| !POINTS.contains(count)) {
        return Err(Failure::Input(format!(
            "--points {count}: from {} to {} are possible",
            POINTS.start(),
            POINTS.end()
        )));
    }
    arguments.check(path, &ending)?;
    match ending.as_str() {
        "dat" => {
            let digits = arguments.digits.unwrap_or_default();
            Ok(section.selig_with(&SeligFormat { points: arguments.points, digits }))
        }
        "csv" => {
            let points = section.points(arguments.points.unwrap_or(CSV_POINTS));
            csv(&["x", "y"], points.into_iter().map(|p| p.map(|c| c.to_string())))
        }
        "svg" => Ok(super::figures::section(section)),
        "step" | "stp" | "igs" | "iges" | "dxf" => for_cad(section, path, &ending, arguments),
        _ => Err(Failure::Input(format!(
            "{}: unknown format; the ending must be .dat, .csv, .svg, .step, .igs or .dxf",
            path.display()
        ))),
    }
}

fn for_cad(section: &Section<f64>, path: &Path, ending: &str, arguments: &ExportArguments) -> Result<String, Failure> {
    let failed = |e: &dyn std::fmt::Display| Failure::Computation(format!("{}: {e}", path.display()));
    let own = Measure::Chord.evaluate(section).map_err(|e| failed(&e))?;
    let chord = arguments.chord.unwrap_or(own);
    let unit = arguments.unit.unwrap_or(LengthUnit::likely_for(chord));
    if arguments.unit.is_none() {
        let length = engineering(chord, 6);
        note(format_args!(
            "{}: written with a chord of {length} {}; --unit chooses another",
            path.display(),
            unit.symbol()
        ));
    }
    if arguments.face && section.self_intersection().is_some() {
        return Err(Failure::Input(format!("{}: the section crosses itself, so that it has no face", path.display())));
    }
    let scale = chord / own;
    let scaled;
    let section = if arguments.chord.is_some() {
        let points: Vec<[f64; 2]> = section.curve().control_points().iter().map(|p| p.map(|c| scale * c)).collect();
        scaled = section.with_control_points::<f64>(points).map_err(|e| failed(&e))?;
        &scaled
    } else {
        section
    };
    let options = Options { unit, face: arguments.face, ..Options::named(section.name()) };
    let curve = section.curve();
    let text = match ending {
        "step" | "stp" => cad::step_with(curve, &options),
        "dxf" => cad::dxf_with(curve, &options),
        _ => cad::iges_with(curve, &options),
    };
    text.map_err(|e| failed(&e))
}
