//! The flow solver against exact solutions, other codes, measurements, finite differences and a database of sections.

pub mod common;
mod database;
mod experiment;
mod gradients;
mod inviscid;
mod plate;
mod reference;
mod sections;
mod sharp;
mod smoothness;
mod xfoil;

pub use database::Database;

use crate::sheet::Sheet;
use clap::ValueEnum;
use std::path::PathBuf;
use std::time::Instant;

/// The tables of the topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Exact lift of mapped circles; other panel codes
    Inviscid,
    /// Blunt sections against XFOIL, and twice the resolution
    Xfoil,
    /// Real sections, flaps and low Reynolds numbers against XFOIL; an E387 and an S1223 in a wind tunnel
    Sections,
    /// Sharp edges against MSES, and closing gaps
    Sharp,
    /// Measurements of a NACA 0012
    Experiment,
    /// Flat-plate laws
    Plate,
    /// Exact derivatives against finite differences
    Gradients,
    /// Drag along smooth shape modes
    Smoothness,
    /// Convergence over a directory of coordinate files
    Database,
}

/// Arguments of the topic.
#[derive(Debug, Clone, clap::Args)]
pub struct FlowArguments {
    /// Only these tables of the topic flow
    #[arg(long, value_delimiter = ',', value_name = "TABLE")]
    only: Vec<Part>,
    /// Write every point of the smoothness lines of the topic flow into this file
    #[arg(long, value_name = "FILE")]
    scans: Option<PathBuf>,
    #[command(flatten)]
    database: Database,
}

impl FlowArguments {
    /// The tables asked for; the database where there is one.
    fn parts(&self) -> Vec<Part> {
        if self.database.is_given() {
            return vec![Part::Database];
        }
        let all = Part::value_variants().iter().copied().filter(|part| *part != Part::Database);
        if self.only.is_empty() { all.collect() } else { self.only.clone() }
    }
}

pub fn sheets(arguments: &FlowArguments, quick: bool) -> Vec<Sheet> {
    let mut sheets = Vec::new();
    for part in arguments.parts() {
        let start = Instant::now();
        let result = match part {
            Part::Inviscid => inviscid::sheets(),
            Part::Xfoil => xfoil::sheets(quick),
            Part::Sections => sections::sheets(quick),
            Part::Sharp => sharp::sheets(quick),
            Part::Experiment => experiment::sheets(),
            Part::Plate => plate::sheets(),
            Part::Gradients => gradients::sheets(quick),
            Part::Smoothness => smoothness::sheets(quick, arguments.scans.as_deref()),
            Part::Database => database::sheets(&arguments.database),
        };
        // what is wrong with one table should not hide the others
        sheets.extend(result.unwrap_or_else(|error| {
            let mut sheet = Sheet::new(&format!("{part:?}"), &format!("Could not be carried through: {error}"));
            sheet.statement("carried through", true, false);
            vec![sheet]
        }));
        eprintln!("validate: flow, {part:?} took {:.1} s", start.elapsed().as_secs_f64());
    }
    sheets
}
