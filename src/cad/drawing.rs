//! A curve prepared for export, and what all formats write alike: options, errors, names and numbers.

use super::unit::LengthUnit;
use crate::spline::BSplineCurve;

/// Points closer than this, in metres, are one point to a CAD system; written into the files as their resolution.
pub const RESOLUTION: f64 = 1e-9;

/// Why a curve was not exported.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CadError {
    /// Only curves in the plane and in space can be written.
    #[error("a curve in {dimensions} dimensions cannot be exported: 2 or 3 are wanted")]
    Dimensions {
        /// Dimensions of the curve.
        dimensions: usize,
    },
    /// A face is asked for inside of a curve that does not lie in the plane z = 0, or that is left open.
    #[error("a face needs a curve in the plane z = 0 whose gap is closed")]
    NoFace,
    /// A face is asked for in a format that is written without faces.
    #[error("{format} files are written without faces; STEP has them")]
    FaceFormat {
        /// Name of the format.
        format: &'static str,
    },
    /// A name that a file format cannot hold.
    #[error("character {character:?} (number {index}) of the name cannot be exported")]
    Name {
        /// Position of the character.
        index: usize,
        /// The character that cannot be written.
        character: char,
    },
}

/// A date and time for file headers; not checked against a calendar.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeStamp {
    /// Year, four digits.
    pub year: u16,
    /// Month, 1 to 12.
    pub month: u8,
    /// Day, 1 to 31.
    pub day: u8,
    /// Hour, minute and second.
    pub time: [u8; 3],
}

impl Default for TimeStamp {
    /// The first second of 2000: a constant, so that output is reproducible.
    fn default() -> Self {
        Self { year: 2000, month: 1, day: 1, time: [0; 3] }
    }
}

/// How a curve is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options<'a> {
    /// Name of the curve in the file: printable ASCII for IGES and DXF, any text without control characters for STEP.
    pub name: &'a str,
    /// Time stamp of the header (DXF has none).
    pub time_stamp: TimeStamp,
    /// Whether a gap between the last point and the first is closed by a straight segment.
    pub close: bool,
    /// The unit of the coordinates.
    pub unit: LengthUnit,
    /// Whether the planar face inside of the outline is written, with the outline as its edge; STEP only.
    pub face: bool,
}

impl<'a> Options<'a> {
    /// Gaps closed, coordinates in metres, no face, constant time stamp.
    pub fn named(name: &'a str) -> Self {
        Self { name, time_stamp: TimeStamp::default(), close: true, unit: LengthUnit::Metre, face: false }
    }

    /// Refuses a face for a format that has none.
    pub(super) fn without_face(&self, format: &'static str) -> Result<(), CadError> {
        if self.face { Err(CadError::FaceFormat { format }) } else { Ok(()) }
    }
}

/// A curve in space, ready to be written.
pub(super) struct Drawing<'a> {
    pub degree: usize,
    pub knots: &'a [f64],
    pub domain: (f64, f64),
    pub points: Vec<[f64; 3]>,
    /// Whether the ends of the curve coincide.
    pub closed: bool,
    /// Whether all points lie in the plane z = 0.
    pub planar: bool,
    /// Ends of the curve, the last point first.
    pub ends: [[f64; 3]; 2],
    /// [`RESOLUTION`] in the unit of the coordinates.
    pub resolution: f64,
    /// The closing segment, where there is a gap to be closed.
    pub closing: Option<[[f64; 3]; 2]>,
}

impl<'a> Drawing<'a> {
    pub fn new<const D: usize>(curve: &'a BSplineCurve<f64, D>, options: &Options) -> Result<Self, CadError> {
        if D != 2 && D != 3 {
            return Err(CadError::Dimensions { dimensions: D });
        }
        let in_space = |p: &[f64; D]| {
            let mut point = [0.0; 3];
            point[..D].copy_from_slice(p);
            point
        };
        let points: Vec<[f64; 3]> = curve.control_points().iter().map(in_space).collect();
        let domain = curve.domain();
        let [start, end] = [domain.0, domain.1].map(|u| in_space(&curve.point_at(u)));
        let gap = start.iter().zip(end).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let resolution = RESOLUTION / (1e-3 * options.unit.millimetres());
        let closed = gap <= resolution;
        Ok(Self {
            degree: curve.degree(),
            knots: curve.knots().as_slice(),
            domain,
            planar: points.iter().all(|p| p[2] == 0.0),
            points,
            closed,
            ends: [end, start],
            resolution,
            closing: (options.close && !closed).then_some([end, start]),
        })
    }
}

/// Refuses names with characters for which `allowed` is false.
pub(super) fn check_name(name: &str, allowed: impl Fn(char) -> bool) -> Result<(), CadError> {
    match name.chars().enumerate().find(|(_, c)| !allowed(*c)) {
        Some((index, character)) => Err(CadError::Name { index, character }),
        None => Ok(()),
    }
}

/// Printable ASCII.
pub(super) fn is_plain(c: char) -> bool {
    c == ' ' || c.is_ascii_graphic()
}

/// A number with a decimal point, in the shortest digits that read back to the same `f64`, `exponent` before the power.
pub(super) fn real(value: f64, exponent: char) -> String {
    let magnitude = value.abs();
    if value == 0.0 || (1e-4..1e7).contains(&magnitude) {
        let text = format!("{value}");
        return if text.contains('.') { text } else { text + "." };
    }
    let text = format!("{value:e}");
    let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
    let point = if mantissa.contains('.') { "" } else { "." };
    format!("{mantissa}{point}{exponent}{power}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn reals_read_back_bit_for_bit(bits in any::<u64>(), plain in -10.0f64..10.0) {
            for value in [f64::from_bits(bits), plain] {
                prop_assume!(value.is_finite());
                let text = real(value, 'E');
                prop_assert!(text.contains('.') && text.len() <= 25, "{text}");
                prop_assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits());
            }
        }
    }

    #[test]
    fn reals_look_as_the_standards_ask() {
        assert_eq!(
            [1.0, 0.0, -0.25, 1e-5, 2.5e-300, 1e7].map(|v| real(v, 'E')),
            ["1.", "0.", "-0.25", "1.E-5", "2.5E-300", "1.E7"]
        );
        assert_eq!(real(1e-5, 'D'), "1.D-5");
    }
}
