//! [`SectionDefinition`]: what a section is built from, and its build parameters.

use super::naca::is_digits;
use super::stations::check_control_points;
use super::{Coordinates, KeyProblem, Kulfan, Naca4, Naca5, Repair, Section, SectionError, TrailingEdge};
use crate::scalar::Scalar;
use std::path::Path;
use std::str::FromStr;

/// How a section is made. The build parameters it lists can be design variables: [`build`](Self::build) is exact in
/// them for any [`Scalar`].
///
/// ```
/// use aeroform::section::SectionDefinition;
/// use num_dual::Dual64;
/// let definition = SectionDefinition::parse("naca0012:sharp").unwrap();
/// let [(name, thickness), ..] = &definition.parameters()[..] else { panic!() };
/// assert_eq!((name.as_str(), *thickness), ("thickness", 0.12));
/// // how the area grows with the thickness: the camber parameters stay constants
/// let section = definition.build(&[Dual64::new(0.12, 1.0), 0.0.into(), 0.4.into()]).unwrap();
/// assert!((section.area().eps - 0.6809).abs() < 1e-3);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum SectionDefinition {
    /// NACA four-digit; parameters `thickness`, `camber`, `camber_position` in chords.
    Naca4(Naca4),
    /// NACA five-digit; parameters `thickness`, `design_lift`, `camber_position`.
    Naca5(Naca5),
    /// Class-shape transformation; parameters `upper_0` …, `lower_0` …, and `trailing_edge_gap` if there is a gap.
    Kulfan(Kulfan),
    /// Points of a file; no parameters.
    Coordinates(Coordinates),
}

impl SectionDefinition {
    /// Reads `naca2412`, `naca0012:sharp`, `naca23012:blunt`, `kulfan:upper=0.1,0.2/lower=-0.1,-0.2` (also
    /// `/gap=0.002`, `/class=0.5,1.0`) or the path of a coordinate file.
    ///
    /// NACA sections are blunt unless told otherwise, as printed in the reports.
    ///
    /// # Errors
    /// A text that names no section, or a file that cannot be read or holds none.
    pub fn parse(text: &str) -> Result<Self, SectionError> {
        Self::parse_element(text, None)
    }

    /// Reads what [`parse`](Self::parse) reads, and of a coordinate file that holds several elements the one with the
    /// given number, counted from one.
    ///
    /// # Errors
    /// As [`parse`](Self::parse); an element that the file does not have, or one of a section that is no file.
    pub fn parse_element(text: &str, element: Option<usize>) -> Result<Self, SectionError> {
        match (Self::parse_built(text)?, element) {
            (Some(_), Some(_)) => Err(SectionError::NotCoordinates { option: "element" }),
            (Some(definition), None) => Ok(definition),
            (None, element) => Coordinates::read_element(Path::new(text.trim()), element).map(Self::Coordinates),
        }
    }

    /// The section of a text that is not the path of a file.
    fn parse_built(text: &str) -> Result<Option<Self>, SectionError> {
        let text = text.trim();
        let lower = text.to_ascii_lowercase();
        if let Some(rest) = lower.strip_prefix("kulfan:") {
            return parse_kulfan(rest).map(|kulfan| Some(Self::Kulfan(kulfan)));
        }
        if let Some(rest) = lower.strip_prefix("naca") {
            let (digits, trailing_edge) = match rest.split_once(':') {
                Some((digits, "sharp")) => (digits, TrailingEdge::Sharp),
                Some((digits, "blunt")) => (digits, TrailingEdge::Blunt),
                _ => (rest, TrailingEdge::Blunt),
            };
            let digits = digits.trim_start_matches([' ', '-', '_']);
            if !digits.is_empty() && is_digits(digits) {
                return Self::naca(digits, trailing_edge).map(Some);
            }
        }
        let path = Path::new(text);
        if text.is_empty() || (!path.exists() && path.extension().is_none() && path.components().count() < 2) {
            return Err(SectionError::UnknownShape { text: text.into() });
        }
        Ok(None)
    }

    /// A NACA section from its four or five digits.
    ///
    /// # Errors
    /// A designation that is none.
    pub fn naca(digits: &str, trailing_edge: TrailingEdge) -> Result<Self, SectionError> {
        if digits.len() == 5 {
            Naca5::new(digits, trailing_edge).map(Self::Naca5)
        } else {
            Naca4::new(digits, trailing_edge).map(Self::Naca4)
        }
    }

    /// This definition, built with another number of control points.
    ///
    /// Analytic sections take an odd number (101 unless told), so that the nose is a data point; coordinates are then
    /// fitted by least squares instead of interpolated.
    ///
    /// # Errors
    /// An even or too small number.
    pub fn with_control_points(mut self, control_points: usize) -> Result<Self, SectionError> {
        match &mut self {
            Self::Coordinates(c) => return c.clone().with_control_points(control_points).map(Self::Coordinates),
            Self::Naca4(naca) => naca.control_points = control_points,
            Self::Naca5(naca) => naca.control_points = control_points,
            Self::Kulfan(kulfan) => kulfan.control_points = control_points,
        }
        check_control_points(control_points)?;
        Ok(self)
    }

    /// These coordinates with a curve that passes the points within `tolerance`; see
    /// [`Coordinates::with_fit_tolerance`].
    ///
    /// # Errors
    /// A tolerance that is not a positive number, or a section that is not made of coordinates.
    pub fn with_fit_tolerance(self, tolerance: f64) -> Result<Self, SectionError> {
        match self {
            Self::Coordinates(coordinates) => coordinates.with_fit_tolerance(tolerance).map(Self::Coordinates),
            _ => Err(SectionError::NotCoordinates { option: "fit tolerance" }),
        }
    }

    /// This definition with coordinates moved, turned and scaled to the chord; see [`Coordinates::normalized`].
    ///
    /// Every other section has its nose at the origin and its trailing edge at (1, 0) by construction, and stays as it
    /// is.
    ///
    /// # Errors
    /// Coordinates that make no section.
    pub fn normalized(self) -> Result<Self, SectionError> {
        match self {
            Self::Coordinates(coordinates) => coordinates.normalized().map(Self::Coordinates),
            other => Ok(other),
        }
    }

    /// Name of the section, such as "NACA 2412" or the title of its file.
    pub fn name(&self) -> &str {
        match self {
            Self::Naca4(naca) => naca.name(),
            Self::Naca5(naca) => naca.name(),
            Self::Kulfan(_) => "Kulfan",
            Self::Coordinates(coordinates) => coordinates.name(),
        }
    }

    /// Whether the section will have a sharp trailing edge.
    pub fn trailing_edge(&self) -> TrailingEdge {
        match self {
            Self::Naca4(naca) => naca.trailing_edge,
            Self::Naca5(naca) => naca.trailing_edge,
            Self::Kulfan(kulfan) => kulfan.trailing_edge(),
            Self::Coordinates(coordinates) => coordinates.trailing_edge(),
        }
    }

    /// Everything that a user must know of the reading of a file, one entry per kind; empty for every other section.
    pub fn repairs(&self) -> &[Repair] {
        match self {
            Self::Coordinates(coordinates) => coordinates.repairs(),
            _ => &[],
        }
    }

    /// Names and values of the build parameters.
    pub fn parameters(&self) -> Vec<(String, f64)> {
        match self {
            Self::Naca4(naca) => naca.parameters(),
            Self::Naca5(naca) => naca.parameters(),
            Self::Kulfan(kulfan) => kulfan.parameters(),
            Self::Coordinates(_) => vec![],
        }
    }

    /// The section at other values of the build parameters, in the order of [`parameters`](Self::parameters).
    ///
    /// Knots, nose parameter and kind of trailing edge are those of the definition, whatever the values.
    ///
    /// # Errors
    /// A wrong number of parameters, or values at which there is no section.
    pub fn build<S: Scalar>(&self, parameters: &[S]) -> Result<Section<S>, SectionError> {
        match self {
            Self::Naca4(naca) => naca.build(parameters),
            Self::Naca5(naca) => naca.build(parameters),
            Self::Kulfan(kulfan) => kulfan.build_listed(parameters),
            Self::Coordinates(coordinates) if parameters.is_empty() => {
                let section = coordinates.section()?;
                let points = section.curve().control_points().iter().map(|p| p.map(S::from)).collect();
                section.with_control_points(points)
            }
            Self::Coordinates(_) => Err(SectionError::ParameterCount { expected: 0, found: parameters.len() }),
        }
    }

    /// The section at the parameters of the definition.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn section(&self) -> Result<Section<f64>, SectionError> {
        let values: Vec<f64> = self.parameters().into_iter().map(|(_, value)| value).collect();
        self.build(&values)
    }
}

impl FromStr for SectionDefinition {
    type Err = SectionError;
    fn from_str(text: &str) -> Result<Self, SectionError> {
        Self::parse(text)
    }
}

/// The part behind `kulfan:`.
fn parse_kulfan(text: &str) -> Result<Kulfan, SectionError> {
    const KEYS: [&str; 4] = ["upper", "lower", "gap", "class"];
    let mut values: [Option<Vec<f64>>; 4] = [const { None }; 4];
    for part in text.split('/') {
        let (key, numbers) = part.split_once('=').unwrap_or((part, ""));
        let key = key.trim();
        let complain = |problem| SectionError::KulfanKey { key: key.into(), problem };
        let index = KEYS.iter().position(|k| *k == key).ok_or(complain(KeyProblem::Unknown))?;
        if values[index].is_some() {
            return Err(complain(KeyProblem::Twice));
        }
        let numbers: Vec<f64> = numbers.split(',').map(parse_number).collect::<Result<_, _>>()?;
        if (index == 2 && numbers.len() != 1) || (index == 3 && numbers.len() != 2) {
            return Err(complain(KeyProblem::Empty));
        }
        values[index] = Some(numbers);
    }
    let [upper, lower, gap, class] = values;
    let needed = |values: Option<Vec<f64>>, key: &str| {
        values.ok_or(SectionError::KulfanKey { key: key.into(), problem: KeyProblem::Missing })
    };
    let mut kulfan = Kulfan::new(needed(upper, "upper")?, needed(lower, "lower")?)?;
    if let Some(&[gap]) = gap.as_deref() {
        kulfan = kulfan.with_gap(gap)?;
    }
    if let Some(&[nose, tail]) = class.as_deref() {
        kulfan = kulfan.with_class([nose, tail])?;
    }
    Ok(kulfan)
}

fn parse_number(text: &str) -> Result<f64, SectionError> {
    let text = text.trim();
    text.parse::<f64>()
        .ok()
        .filter(|value| value.is_finite())
        .ok_or_else(|| SectionError::NotANumber { text: text.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_read() {
        let names = |text: &str| -> Vec<String> {
            SectionDefinition::parse(text).unwrap().parameters().into_iter().map(|p| p.0).collect()
        };
        assert_eq!(names("naca2412"), ["thickness", "camber", "camber_position"]);
        assert_eq!(names("NACA 23012:sharp"), ["thickness", "design_lift", "camber_position"]);
        assert_eq!(names("kulfan:upper=0.1,0.2/lower=-0.1"), ["upper_0", "upper_1", "lower_0"]);
        assert_eq!(
            names("kulfan: upper = 0.1 / lower = -0.1 / gap = 0.01 / class=0.5,1.0"),
            ["upper_0", "lower_0", "trailing_edge_gap"]
        );
        for (text, kind) in [
            ("naca0012", TrailingEdge::Blunt),
            ("naca0012:blunt", TrailingEdge::Blunt),
            ("naca-0012:sharp", TrailingEdge::Sharp),
            ("kulfan:upper=0.1/lower=-0.1", TrailingEdge::Sharp),
            ("kulfan:upper=0.1/lower=-0.1/gap=0.001", TrailingEdge::Blunt),
        ] {
            let definition = SectionDefinition::parse(text).unwrap();
            assert_eq!(definition.trailing_edge(), kind);
            let section = definition.section().unwrap();
            let [a, b] = section.trailing_edge_points().map(|p| p.map(f64::to_bits));
            assert_eq!(a == b, kind == TrailingEdge::Sharp, "{text}");
            assert_eq!(section.name(), definition.name());
        }
    }

    #[test]
    fn mistakes_are_named() {
        use SectionError as E;
        let error = |text: &str| SectionDefinition::parse(text).unwrap_err();
        assert_eq!(error("ncaa0012"), E::UnknownShape { text: "ncaa0012".into() });
        assert_eq!(error(""), E::UnknownShape { text: String::new() });
        assert_eq!(error("naca0012:shrap"), E::UnknownShape { text: "naca0012:shrap".into() });
        assert_eq!(error("naca00120012"), E::UnknownDesignation { designation: "00120012".into() });
        assert_eq!(error("naca26012"), E::UnknownDesignation { designation: "26012".into() });
        let key = |key: &str, problem| E::KulfanKey { key: key.into(), problem };
        assert_eq!(error("kulfan:upper=0.1"), key("lower", KeyProblem::Missing));
        assert_eq!(error("kulfan:upper=0.1/upper=0.2"), key("upper", KeyProblem::Twice));
        assert_eq!(error("kulfan:top=0.1"), key("top", KeyProblem::Unknown));
        assert_eq!(error("kulfan:upper=1/lower=1/class=1"), key("class", KeyProblem::Empty));
        assert_eq!(error("kulfan:upper=0.1,x/lower=0"), E::NotANumber { text: "x".into() });
        assert_eq!(error("kulfan:upper=0.1,nan/lower=0"), E::NotANumber { text: "nan".into() });
        assert!(matches!(error("no/such/file.dat"), E::Read { kind: std::io::ErrorKind::NotFound, .. }));
        assert!(matches!(error("."), E::UnknownShape { .. } | E::Read { .. }));
    }

    #[test]
    fn the_number_of_control_points_is_chosen() {
        for text in ["naca2412", "naca23012", "kulfan:upper=0.1/lower=-0.1"] {
            let definition = SectionDefinition::parse(text).unwrap();
            for n in [11, 51, 201] {
                let section = definition.clone().with_control_points(n).unwrap().section().unwrap();
                assert_eq!(section.curve().control_points().len(), n);
                assert!(section.nose().iter().all(|c| c.abs() < 1e-16));
            }
            for found in [0, 4, 9, 100] {
                let error = definition.clone().with_control_points(found).unwrap_err();
                assert_eq!(error, SectionError::ControlPointCount { found, least: 11, most: 20_001 });
            }
        }
    }
}
