//! Arguments that name a section and say how its coordinates are taken.

use super::failure::Failure;
use super::message::note;
use crate::section::{SectionDefinition, SectionError};
use std::borrow::Cow;
use std::path::Path;

/// A section on the command line.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct ShapeArguments {
    /// naca2412, naca0012:sharp, kulfan:upper=0.2,0.2/lower=-0.1,-0.1, or the path of a coordinate file
    pub shape: String,
    /// Number of control points (default 101; coordinates are interpolated unless told, and fitted then)
    #[arg(long, value_name = "N", conflicts_with = "fit_tolerance", allow_negative_numbers = true)]
    pub control_points: Option<usize>,
    /// Fit coordinates to this distance, in their unit, instead of interpolating them
    #[arg(long, value_name = "T", allow_negative_numbers = true)]
    pub fit_tolerance: Option<f64>,
    /// Element of a coordinate file that holds several, counted from 1
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub element: Option<usize>,
    /// Move, turn and scale coordinates: nose at the origin, trailing edge at (1, 0)
    #[arg(long)]
    pub normalize: bool,
}

impl ShapeArguments {
    /// The definition of the section. What a user must know of the reading goes to standard error, a line per kind.
    pub fn definition(&self) -> Result<SectionDefinition, Failure> {
        let definition = self.read().map_err(|error| self.failure(&error))?;
        for repair in definition.repairs() {
            note(format_args!("{}: {repair}", self.shape));
        }
        Ok(definition)
    }

    fn read(&self) -> Result<SectionDefinition, SectionError> {
        let mut definition = SectionDefinition::parse_element(&self.shape, self.element)?;
        if let Some(tolerance) = self.fit_tolerance {
            definition = definition.with_fit_tolerance(tolerance)?;
        }
        if let Some(count) = self.control_points {
            definition = definition.with_control_points(count)?;
        }
        if self.normalize { definition.normalized() } else { Ok(definition) }
    }

    /// An error of this section; errors of files name the file themselves.
    pub fn failure(&self, error: &dyn std::fmt::Display) -> Failure {
        let message = error.to_string();
        let named = message.contains(&self.shape);
        Failure::Input(if named { message } else { format!("{}: {message}", self.shape) })
    }

    /// Name of the section in a title: as given, or the name of its file without the way there.
    pub fn name(&self) -> Cow<'_, str> {
        let path = Path::new(&self.shape);
        match path.file_name() {
            Some(name) if path.is_file() => name.to_string_lossy(),
            _ => self.shape.as_str().into(),
        }
    }
}
