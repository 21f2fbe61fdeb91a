//! Sections from lists of points: Selig and Lednicer files.

mod parse;
mod repair;

pub use repair::Repair;

use super::measures::{curve_crossing, farthest_parameter};
use super::stations::with_ends;
use super::{CoordinateError, Section, SectionError, TrailingEdge};
use crate::spline::{EndCondition, KnotVector, chord_length_parameters, fit, fit_to_tolerance, interpolate};
use parse::{Listing, Point};
use repair::{Outline, assemble};
use std::path::Path;

/// Points of a section in Selig order, read from a file or given, with a record of what was mended.
///
/// *Selig*: an optional title, then the outline, a point `x y` per line, from the trailing edge round the nose and back.
/// *Lednicer*: title, a line with the numbers of upper and lower points, then both surfaces from nose to tail. Also
/// read: surfaces in either order or direction, two surfaces without a header, commas, semicolons or tabs, comments
/// (`#`, `!`, `%`), blank lines, any end of line, Fortran exponents, remarks at the end.
///
/// Points are kept as they stand, in their own unit and place ([`chord`](Self::chord) tells); see
/// [`normalized`](Self::normalized). Every repair is recorded in [`repairs`](Self::repairs), and what cannot be mended
/// without guessing is refused with the line.
///
/// ```
/// use aeroform::section::{Coordinates, Repair};
/// let file = b"diamond\n1 0\n0.5 -0.06\n0 0\n0.5 0.06\n1 0\n";
/// let coordinates = Coordinates::parse(file).unwrap();
/// assert_eq!(coordinates.name(), "diamond");
/// assert_eq!(coordinates.repairs(), [Repair::Reversed]);
/// let section = coordinates.section().unwrap();
/// assert!((section.curve().evaluate(section.nose_parameter())[0]).abs() < 0.01);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinates {
    name: String,
    points: Vec<[f64; 2]>,
    trailing_edge: TrailingEdge,
    repairs: Vec<Repair>,
    fit: Fit,
}

/// How the curve follows the points.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fit {
    Interpolate,
    Tolerance(f64),
    ControlPoints(usize),
}

impl Coordinates {
    /// Reads a coordinate file; a file without a title is called by its name.
    ///
    /// # Errors
    /// A file that cannot be read or holds no section.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SectionError> {
        let path = path.as_ref();
        let bytes =
            std::fs::read(path).map_err(|error| SectionError::Read { path: path.into(), kind: error.kind() })?;
        let mut coordinates = Self::parse(&bytes).map_err(|error| SectionError::File { path: path.into(), error })?;
        if coordinates.name.is_empty() {
            coordinates.name = path.file_stem().map(|stem| stem.to_string_lossy().into()).unwrap_or_default();
        }
        Ok(coordinates)
    }

    /// The section in the bytes of a coordinate file.
    ///
    /// # Errors
    /// What is wrong, with the number of the line.
    pub fn parse(bytes: &[u8]) -> Result<Self, CoordinateError> {
        Self::from_listing(parse::parse(bytes)?)
    }

    /// The section with the given outline; mended as a file would be.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), with lines counted from zero points.
    pub fn from_points(name: &str, points: &[[f64; 2]]) -> Result<Self, CoordinateError> {
        if let Some(&value) = points.iter().flatten().find(|c| !(c.abs() <= parse::LARGEST)) {
            return Err(CoordinateError::Value { line: 0, value });
        }
        if points.len() > parse::MOST {
            return Err(CoordinateError::TooManyPoints { found: points.len(), most: parse::MOST });
        }
        let points = points.iter().map(|&xy| Point { xy, line: 0 }).collect();
        Self::from_listing(Listing { title: Some(name.into()), points, ..Listing::default() })
    }

    fn from_listing(listing: Listing) -> Result<Self, CoordinateError> {
        let name = listing.title.clone().unwrap_or_default();
        let Outline { points, trailing_edge, repairs } = assemble(listing)?;
        let points = points.iter().map(|p| p.xy).collect();
        Ok(Self { name, points, trailing_edge, repairs, fit: Fit::Interpolate })
    }

    /// Title of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The points from the upper to the lower trailing edge; a sharp trailing edge stands at both ends.
    pub fn points(&self) -> &[[f64; 2]] {
        &self.points
    }

    /// What was mended.
    pub fn repairs(&self) -> &[Repair] {
        &self.repairs
    }

    /// Sharp where the outline is closed.
    pub fn trailing_edge(&self) -> TrailingEdge {
        self.trailing_edge
    }

    /// Largest distance of a point from the middle of the trailing edge, in the unit of the file.
    pub fn chord(&self) -> f64 {
        let tail = self.tail();
        self.points.iter().map(|p| (p[0] - tail[0]).hypot(p[1] - tail[1])).fold(0.0, f64::max)
    }

    /// The points turned, moved and scaled so that the nose of the curve is the origin and the middle of the trailing
    /// edge is (1, 0).
    ///
    /// # Errors
    /// As [`section`](Self::section).
    pub fn normalized(&self) -> Result<Self, SectionError> {
        let frame = self.section()?.chord_frame()?;
        let points = self.points.iter().map(|&p| frame.coordinates(p).map(|c| c / frame.chord)).collect();
        Ok(Self { points, ..self.clone() })
    }

    /// The same points with a curve that passes them within `tolerance` (in the unit of the file) with as few knots as
    /// needed, instead of through them. This smooths rounded coordinates.
    ///
    /// # Errors
    /// A tolerance that is not a positive number.
    pub fn with_fit_tolerance(self, tolerance: f64) -> Result<Self, SectionError> {
        super::naca::check_range("fit tolerance", tolerance, 0.0, f64::INFINITY)?;
        Ok(Self { fit: Fit::Tolerance(tolerance), ..self })
    }

    /// The same points with a least-squares curve of so many control points instead of an interpolating one.
    ///
    /// # Errors
    /// Fewer than seven control points, or more than there are points.
    pub fn with_control_points(self, control_points: usize) -> Result<Self, SectionError> {
        const LEAST: usize = 7;
        if control_points < LEAST || control_points > self.points.len() {
            let most = self.points.len();
            return Err(SectionError::FitControlPoints { found: control_points, least: LEAST, most });
        }
        Ok(Self { fit: Fit::ControlPoints(control_points), ..self })
    }

    /// The section: a C2 cubic spline through the points (natural ends, chord-length parameters), or near them if a fit
    /// was asked for. Its nose parameter is that of the point farthest from the trailing edge.
    ///
    /// # Errors
    /// A curve that crosses itself between the points, a fit that is not possible.
    pub fn section(&self) -> Result<Section<f64>, SectionError> {
        let parameters = chord_length_parameters(&self.points)?;
        let mut curve = match self.fit {
            Fit::Interpolate => interpolate(&parameters, &self.points, EndCondition::Natural)?,
            Fit::Tolerance(tolerance) => fit_to_tolerance(&parameters, &self.points, 3, tolerance)?,
            Fit::ControlPoints(n) => fit(&parameters, &self.points, even_knots(&parameters, n)?)?,
        };
        if let [first, .., last] = self.points[..] {
            curve = with_ends(&curve, first, last)?;
        }
        if let Some(crossing) = curve_crossing(&curve) {
            let [x, y] = crossing.point;
            return Err(CoordinateError::CurveCrossing { x, y }.into());
        }
        let nose = farthest_parameter(&curve, self.tail())?;
        Section::new(curve, self.trailing_edge, nose, self.name.as_str())
    }

    fn tail(&self) -> [f64; 2] {
        match (self.points.first(), self.points.last()) {
            (Some(a), Some(b)) => [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])],
            _ => [0.0; 2],
        }
    }
}

/// Cubic knots that share the data evenly.
fn even_knots(parameters: &[f64], control_points: usize) -> Result<KnotVector, SectionError> {
    let spans = control_points - 3;
    let last = parameters.len() - 1;
    let inner = (1..spans).map(|i| {
        let at = i as f64 * last as f64 / spans as f64;
        let (index, rest) = (at.floor() as usize, at.fract());
        let next = parameters[(index + 1).min(last)];
        parameters[index] + (next - parameters[index]) * rest
    });
    Ok(KnotVector::clamped(3, 0.0, 1.0, inner)?)
}
