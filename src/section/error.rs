//! Reasons why a section is not built, read or measured.

use crate::spline::SplineError;
use std::path::PathBuf;

/// Why a section was not built, read or measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SectionError {
    /// The text names no section.
    #[error(
        "'{text}' is no section: use naca2412, naca0012:sharp, naca23012, kulfan:upper=…/lower=…, \
         or the path of a coordinate file"
    )]
    UnknownShape {
        /// Text that was given.
        text: String,
    },
    /// A NACA designation outside of the four- and five-digit series.
    #[error(
        "'{designation}' is no NACA four-digit (2412) or five-digit (23012, 23112; camber position 1 to 5, \
         reflexed 2 to 5) section"
    )]
    UnknownDesignation {
        /// Designation that was given.
        designation: String,
    },
    /// A key of a Kulfan description that is not known, or one that is missing or stands twice.
    #[error("Kulfan section: key '{key}' is {problem}; keys are upper, lower (both needed), gap, class")]
    KulfanKey {
        /// Name of the key.
        key: String,
        /// The mistake in the key.
        problem: KeyProblem,
    },
    /// Text that should be a number.
    #[error("'{text}' is not a finite number")]
    NotANumber {
        /// Text that was read.
        text: String,
    },
    /// A wrong number of build parameters.
    #[error("the section has {expected} parameters, {found} were given")]
    ParameterCount {
        /// Number of parameters that the definition lists.
        expected: usize,
        /// Number of parameters given.
        found: usize,
    },
    /// A build parameter outside of the range in which the shape exists.
    #[error("{name} is {value:?}, it must lie between {lower:?} and {upper:?}")]
    ParameterOutOfRange {
        /// Name of the parameter.
        name: &'static str,
        /// Value of the parameter.
        value: f64,
        /// Bound that the value must exceed.
        lower: f64,
        /// Bound that the value must stay below.
        upper: f64,
    },
    /// A number of control points that the definition cannot be built with.
    #[error(
        "{found} control points: an analytic section needs an odd number from {least} to {most}, so that the nose is a data point"
    )]
    ControlPointCount {
        /// Number of control points that was asked for.
        found: usize,
        /// Smallest number of control points.
        least: usize,
        /// Largest number of control points.
        most: usize,
    },
    /// A number of control points that coordinates cannot be fitted with.
    #[error("{found} control points, between {least} and the number of points, {most}, are possible")]
    FitControlPoints {
        /// Number of control points that was asked for.
        found: usize,
        /// Smallest number of control points.
        least: usize,
        /// Largest number of control points.
        most: usize,
    },
    /// An option for coordinates, given with another section.
    #[error("{option} is an option for coordinate files only")]
    NotCoordinates {
        /// Name of the option.
        option: &'static str,
    },
    /// A sharp trailing edge whose two end control points differ.
    #[error("the trailing edge is sharp, but the curve ends {gap:.3e} from where it starts")]
    OpenTrailingEdge {
        /// Distance of the first and the last control point.
        gap: f64,
    },
    /// The nose parameter does not lie inside the domain of the curve.
    #[error("nose parameter {parameter} is not inside the domain of the curve")]
    NoseParameter {
        /// Nose parameter that was given.
        parameter: f64,
    },
    /// A coordinate file that could not be read.
    #[error("cannot read {}: {kind}", path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Kind of failure that the operating system reports.
        kind: std::io::ErrorKind,
    },
    /// A coordinate file that was read but makes no section.
    #[error("{}: {error}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// The mistake in the contents of the file.
        error: CoordinateError,
    },
    /// Coordinates that make no section.
    #[error(transparent)]
    Coordinates(#[from] CoordinateError),
    /// The spline of the section could not be built.
    #[error(transparent)]
    Spline(#[from] SplineError),
    /// A measure that this section does not have.
    #[error("the section has no {measure}: {reason}")]
    NoMeasure {
        /// Name of the measure.
        measure: &'static str,
        /// Reason why the section has no such measure.
        reason: MeasureProblem,
    },
    /// Text that names no measure.
    #[error("'{text}' is no measure of a section; there are {}", super::Measure::NAMES.join(", "))]
    UnknownMeasure {
        /// Text that was read.
        text: String,
    },
}

/// A mistake in a key of a Kulfan description.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum KeyProblem {
    /// The key is not one of the known keys.
    #[error("unknown")]
    Unknown,
    /// The key is needed, but not there.
    #[error("missing")]
    Missing,
    /// The key is given more than once.
    #[error("given twice")]
    Twice,
    /// The key stands without a value or with a wrong number of values.
    #[error("without the numbers it needs")]
    Empty,
}

/// Why a section has no value of a measure.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum MeasureProblem {
    /// The chord has no length.
    #[error("its chord has no length")]
    NoChord,
    /// The enclosed area is not positive.
    #[error("its enclosed area is {area:.3e}, not positive")]
    NoArea {
        /// Signed area, in square units of the section.
        area: f64,
    },
    /// A surface does not reach the station.
    #[error("no point of the {surface} surface stands at {station} of the chord")]
    NoStation {
        /// Name of the surface: "upper" or "lower".
        surface: &'static str,
        /// Station along the chord, in chords.
        station: f64,
    },
    /// A station outside of the open interval (0, 1).
    #[error("station {station} does not lie between 0 and 1")]
    StationOutOfRange {
        /// Station along the chord, in chords.
        station: f64,
    },
    /// The quantity has no isolated extreme inside the chord.
    #[error("it has no isolated extreme")]
    NoExtreme,
    /// Two extremes tie, or the quantity vanishes everywhere, so that it has a kink and no derivative.
    #[error(
        "it has no derivative where two extremes tie or all of it vanishes; use its value at a station, as in {instead}"
    )]
    Tied {
        /// Measure that is smooth and can take its place.
        instead: &'static str,
    },
    /// The tangent or curvature vanishes where it is needed.
    #[error("the curve has no direction or curvature there")]
    Singular,
}

/// Why coordinates make no section. Line numbers count from one; 0 where the points did not come from a file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CoordinateError {
    /// There are no data at all.
    #[error("no coordinates found; wanted lines of two numbers, x and y")]
    Empty,
    /// The file is not a text file.
    #[error("this is not a text file (byte {byte:#04x} at offset {offset})")]
    Binary {
        /// Position in the file, in bytes from its start.
        offset: usize,
        /// Byte at that position.
        byte: u8,
    },
    /// A file larger than any coordinate file.
    #[error("the file has {bytes} bytes, at most {most} are read")]
    TooLarge {
        /// Size of the file in bytes.
        bytes: u64,
        /// Largest size that is read.
        most: u64,
    },
    /// A file of another format.
    #[error("this is {format}; wanted is a text of lines with two numbers, x and y")]
    Format {
        /// Name of the format, and what to do with it.
        format: &'static str,
    },
    /// A data line with a wrong number of fields.
    #[error("line {line}: {}", columns(*.found))]
    Columns {
        /// Number of the line.
        line: usize,
        /// Number of fields in the line.
        found: usize,
    },
    /// Text between data lines, or a field that is no number.
    #[error("line {line}: '{text}' is not a number; correct the line, or mark it as a comment with #")]
    NotANumber {
        /// Number of the line.
        line: usize,
        /// The field (at most 40 characters).
        text: String,
    },
    /// NaN, an infinity, or a number beyond 1e9 in magnitude.
    #[error("line {line}: coordinate {value} is not usable (finite and within 1e9)")]
    Value {
        /// Number of the line.
        line: usize,
        /// Value of the coordinate.
        value: f64,
    },
    /// A Lednicer header that does not fit the data.
    #[error("line {line}: the header announces {announced} points, the file holds {found}")]
    Count {
        /// Number of the line of the header.
        line: usize,
        /// Number of points that the header announces.
        announced: usize,
        /// Number of points found.
        found: usize,
    },
    /// A Lednicer header that divides the points elsewhere than they are divided.
    #[error(
        "line {line}: the second surface begins here, after {} points, with {} more; the header announces {} and {}",
        found[0], found[1], announced[0], announced[1]
    )]
    Split {
        /// Line of the first point of the second surface.
        line: usize,
        /// Numbers of points that the header announces for the surfaces.
        announced: [usize; 2],
        /// Numbers of points of the surfaces.
        found: [usize; 2],
    },
    /// A file with several elements, of which none was chosen.
    #[error(
        "the file holds {} elements, which begin in lines {}; choose one with --element N (or `element = N`)",
        lines.len(), listed(lines)
    )]
    SeveralElements {
        /// Line of the first point of each element.
        lines: Vec<usize>,
    },
    /// An element that the file does not have.
    #[error("there is no element {element}; the file holds {count}")]
    NoElement {
        /// Number that was asked for.
        element: usize,
        /// Number of elements in the file.
        count: usize,
    },
    /// The points make one surface only, from end to end.
    #[error(
        "the points run from one end of the section to the other, between lines {first} and {last}: one surface only; \
         add the other one"
    )]
    OneSurface {
        /// Line of the first point.
        first: usize,
        /// Line of the last point.
        last: usize,
    },
    /// A fitted curve that has little to do with the points.
    #[error("the curve leaves the points by {} near line {line}; {}", figures(*.distance), advice(*.fitted))]
    FarFromPoints {
        /// Largest distance of the curve from the polygon through the points, in the unit of the file.
        distance: f64,
        /// Line of the point nearest to that place.
        line: usize,
        /// Whether the curve was fitted with fewer control points than it takes to meet all points.
        fitted: bool,
    },
    /// There are too few different points.
    #[error("{found} different points, at least {needed} are needed")]
    TooFewPoints {
        /// Number of different points.
        found: usize,
        /// Number of different points needed.
        needed: usize,
    },
    /// More points than anybody needs.
    #[error("{found} points, at most {most} are read")]
    TooManyPoints {
        /// Number of points found.
        found: usize,
        /// Largest number of points that is read.
        most: usize,
    },
    /// All points nearly on one line, or a chord shorter than 1e-9.
    #[error("the points enclose no area (chord {chord:.3e}, area {area:.3e})")]
    NoArea {
        /// Largest extent of the points.
        chord: f64,
        /// Area that the points enclose.
        area: f64,
    },
    /// The outline crosses itself.
    #[error("the outline crosses itself between lines {first} and {second}, near ({x:.5}, {y:.5})")]
    SelfCrossing {
        /// Line of the point before the crossing, on the first branch.
        first: usize,
        /// Line of the point before the crossing, on the second branch.
        second: usize,
        /// Abscissa of the crossing.
        x: f64,
        /// Ordinate of the crossing.
        y: f64,
    },
    /// One surface ends far before the other: points are missing.
    #[error("line {line}: the outline ends {} short of the trailing edge; points are missing", figures(*.distance))]
    Unfinished {
        /// Line of the end that falls short.
        line: usize,
        /// Distance to the other end, in the unit of the file.
        distance: f64,
    },
    /// Repairs that call for one another without end.
    #[error(
        "the outline has no recognisable trailing edge; list the points from the trailing edge round the nose and back"
    )]
    Unsettled,
    /// The outline does not cross itself, but the curve through its points does.
    #[error("the curve through the points crosses itself near ({x:.5}, {y:.5})")]
    CurveCrossing {
        /// Abscissa of the crossing.
        x: f64,
        /// Ordinate of the crossing.
        y: f64,
    },
}

/// A length in three significant digits.
fn figures(length: f64) -> String {
    // rounding may carry into another digit
    let exponent = format!("{length:.2e}").split_once('e').and_then(|(_, e)| e.parse::<i32>().ok()).unwrap_or(0);
    match usize::try_from(2 - exponent) {
        Ok(decimals) if decimals <= 5 => format!("{length:.decimals$}"),
        _ => format!("{length:.2e}"),
    }
}

fn columns(found: usize) -> String {
    match found {
        1 => "a single number, wanted two (x and y)".into(),
        3 => "3 numbers, wanted two (x and y), or x and the ordinates of the upper and the lower side at increasing x; a \
              third column is left out where it is constant or counts the points"
            .into(),
        _ => format!("{found} numbers, wanted two (x and y)"),
    }
}

fn listed(lines: &[usize]) -> String {
    lines.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
}

fn advice(fitted: bool) -> &'static str {
    if fitted { "take more control points or a smaller tolerance" } else { "correct the points there, or add some" }
}
