//! NACA four-digit sections.

use super::stations::{Surface, analytic_section};
use super::{Section, SectionError, TrailingEdge};
use crate::scalar::Scalar;
use num_dual::Dual;

/// A NACA four-digit section: thickness, camber and camber position in chords.
///
/// Thickness stands normal to the camber line (Jacobs, Ward and Pinkerton, NACA report 460). The sharp form changes the
/// last coefficient of the thickness from 0.1015 to 0.1036.
#[derive(Debug, Clone, PartialEq)]
pub struct Naca4 {
    name: String,
    thickness: f64,
    camber: f64,
    camber_position: f64,
    pub(super) trailing_edge: TrailingEdge,
    pub(super) control_points: usize,
}

/// Position of a camber of zero, which the designation leaves open.
const NOMINAL_CAMBER_POSITION: f64 = 0.4;

impl Naca4 {
    /// A section from its four digits.
    ///
    /// # Errors
    /// Anything but four digits, or a thickness of zero.
    pub fn new(digits: &str, trailing_edge: TrailingEdge) -> Result<Self, SectionError> {
        let number: u32 = match digits.parse() {
            Ok(number) if digits.len() == 4 && is_digits(digits) && number % 100 > 0 => number,
            _ => return Err(SectionError::UnknownDesignation { designation: digits.into() }),
        };
        let position = number / 100 % 10;
        Ok(Self {
            name: format!("NACA {digits}"),
            thickness: f64::from(number % 100) / 100.0,
            camber: f64::from(number / 1000) / 100.0,
            camber_position: if position == 0 { NOMINAL_CAMBER_POSITION } else { f64::from(position) / 10.0 },
            trailing_edge,
            control_points: super::stations::DEFAULT_CONTROL_POINTS,
        })
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn parameters(&self) -> Vec<(String, f64)> {
        vec![
            ("thickness".into(), self.thickness),
            ("camber".into(), self.camber),
            ("camber_position".into(), self.camber_position),
        ]
    }

    pub(super) fn build<S: Scalar>(&self, parameters: &[S]) -> Result<Section<S>, SectionError> {
        let &[thickness, camber, position] = parameters else {
            return Err(SectionError::ParameterCount { expected: 3, found: parameters.len() });
        };
        check_range("thickness", thickness, 0.0, 1.0)?;
        check_range("camber", camber, -1.0, 1.0)?;
        check_range("camber_position", position, 0.0, 1.0)?;
        analytic_section(self.control_points, 0.5, self.trailing_edge, &self.name, |x, surface| {
            let (station, constant) = along_chord(x);
            let line = camber_line(constant(camber), constant(position), station);
            thickened(line, thickness, x, surface, self.trailing_edge)
        })
    }
}

/// Whether a text is made of ASCII digits only (`parse` would accept a sign).
pub(super) fn is_digits(text: &str) -> bool {
    text.bytes().all(|b| b.is_ascii_digit())
}

/// Refuses a parameter outside of an open interval.
pub(super) fn check_range<S: Scalar>(name: &'static str, value: S, lower: f64, upper: f64) -> Result<(), SectionError> {
    let value = value.re();
    if lower < value && value < upper {
        Ok(())
    } else {
        Err(SectionError::ParameterOutOfRange { name, value, lower, upper })
    }
}

/// The four-digit camber line: two parabolas with their summit at `position`.
fn camber_line<S: Scalar>(camber: S, position: S, x: S) -> S {
    if x < position {
        (position * 2.0 - x) * x * camber / position.squared()
    } else {
        // (1 - 2p) + 2px - x² with the factor that vanishes at the trailing edge drawn out
        (-position * 2.0 + 1.0 + x) * (-x + 1.0) * camber / (-position + 1.0).squared()
    }
}

/// A station along the chord that knows itself as the variable of a slope, and a number that does not depend on it.
pub(super) fn along_chord<S: Scalar>(x: f64) -> (Dual<S>, impl Fn(S) -> Dual<S>) {
    (Dual::from_re(S::from(x)).derivative(), Dual::from_re)
}

/// The point of a surface: half the four-digit thickness normal to a camber line, given with its slope, at `x`.
pub(super) fn thickened<S: Scalar>(
    Dual { re: ordinate, eps: slope }: Dual<S>,
    thickness: S,
    x: f64,
    surface: Surface,
    trailing_edge: TrailingEdge,
) -> [S; 2] {
    let shape = match trailing_edge {
        // the coefficients sum to zero, but not to the bit
        TrailingEdge::Sharp if x == 1.0 => 0.0,
        TrailingEdge::Sharp => thickness_shape(x, 0.1036),
        TrailingEdge::Blunt => thickness_shape(x, 0.1015),
    };
    let side = if surface == Surface::Upper { 5.0 } else { -5.0 };
    let half = thickness * (side * shape);
    // cos(atan s) = 1/√(1 + s²), sin(atan s) = s cos(atan s)
    let cosine = (slope.squared() + 1.0).sqrt().recip();
    [-half * slope * cosine + x, ordinate + half * cosine]
}

fn thickness_shape(x: f64, last: f64) -> f64 {
    0.2969 * x.sqrt() + x * (-0.1260 + x * (-0.3516 + x * (0.2843 - x * last)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::{StepRange, VectorFunction, finite_difference_jacobian, jacobian};

    fn section(digits: &str, trailing_edge: TrailingEdge) -> Section {
        let naca = Naca4::new(digits, trailing_edge).unwrap();
        let parameters: Vec<f64> = naca.parameters().iter().map(|p| p.1).collect();
        naca.build(&parameters).unwrap()
    }

    #[test]
    fn the_data_points_are_the_formula() {
        for trailing_edge in [TrailingEdge::Sharp, TrailingEdge::Blunt] {
            let (m, p, t) = (0.08, 0.4, 0.16);
            let a4 = if trailing_edge == TrailingEdge::Sharp { 0.1036 } else { 0.1015 };
            let points = section("8416", trailing_edge).points(99);
            for (i, point) in points.iter().enumerate() {
                // as printed, with atan, sine and cosine
                let s: f64 = (1.0 + (std::f64::consts::TAU * i as f64 / 98.0).cos()) / 2.0;
                let yt = t / 0.2
                    * (0.2969 * s.sqrt() - 0.1260 * s - 0.3516 * s.powi(2) + 0.2843 * s.powi(3) - a4 * s.powi(4));
                let (yc, slope) = if s < p {
                    (m / (p * p) * (2.0 * p * s - s * s), 2.0 * m / (p * p) * (p - s))
                } else {
                    let c = m / ((1.0 - p) * (1.0 - p));
                    (c * (1.0 - 2.0 * p + 2.0 * p * s - s * s), 2.0 * c * (p - s))
                };
                let theta = slope.atan();
                let side = if i <= 49 { 1.0 } else { -1.0 };
                let expected = [s - side * yt * theta.sin(), yc + side * yt * theta.cos()];
                for d in 0..2 {
                    assert!((point[d] - expected[d]).abs() < 5e-15, "{i}: {point:?} {expected:?}");
                }
            }
        }
    }

    #[test]
    fn ends_and_nose_are_exact() {
        for digits in ["0012", "2412", "8416", "0002", "9999"] {
            let sharp = section(digits, TrailingEdge::Sharp);
            let bits = sharp.trailing_edge_points().map(|p| p.map(f64::to_bits));
            assert_eq!(bits[0], bits[1]);
            assert_eq!(sharp.trailing_edge_points()[0], [1.0, 0.0]);
            assert!(sharp.nose().iter().all(|c| c.abs() < 1e-17), "{:?}", sharp.nose());
        }
        let blunt = section("0012", TrailingEdge::Blunt);
        let [upper, lower] = blunt.trailing_edge_points();
        assert!((upper[1] - 0.00126).abs() < 1e-15 && lower == [1.0, -upper[1]]);
    }

    #[test]
    fn symmetric_sections_are_symmetric_to_the_last_bits() {
        let points = section("0024", TrailingEdge::Sharp).curve().control_points().to_vec();
        for (a, b) in points.iter().zip(points.iter().rev()) {
            assert!((a[0] - b[0]).abs() < 1e-15 && (a[1] + b[1]).abs() < 1e-15, "{a:?} {b:?}");
        }
    }

    #[test]
    fn the_shape_is_differentiated_in_its_parameters() {
        struct Shape(Naca4);
        impl VectorFunction for Shape {
            type Error = SectionError;
            fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SectionError> {
                Ok(self.0.build(x)?.curve().control_points().iter().flatten().copied().collect())
            }
        }
        // the symmetric one too: the derivative by camber must not vanish with the camber
        for digits in ["2412", "0012"] {
            let shape = Shape(Naca4::new(digits, TrailingEdge::Sharp).unwrap());
            let x: Vec<f64> = shape.0.parameters().iter().map(|p| p.1).collect();
            let (_, exact) = jacobian(&shape, &x).unwrap();
            let steps = [StepRange { first: 1e-3, levels: 8 }; 3];
            let checked = finite_difference_jacobian(|x| shape.evaluate(x), &x, &steps).unwrap();
            for (a, b) in exact.iter().zip(checked.iter()) {
                assert!((a - b.value).abs() <= b.error + 1e-12, "{digits}: {a} {b:?}");
            }
            assert!(exact.column(1).amax() > 0.9, "{digits}");
        }
    }

    #[test]
    fn bad_designations_and_parameters_are_refused() {
        for digits in ["", "241", "24121", "24x2", "2400", "+412", "²412"] {
            assert!(Naca4::new(digits, TrailingEdge::Blunt).is_err(), "{digits}");
        }
        let naca = Naca4::new("2412", TrailingEdge::Blunt).unwrap();
        assert!(matches!(naca.build(&[0.1]), Err(SectionError::ParameterCount { expected: 3, found: 1 })));
        for bad in [[0.0, 0.1, 0.4], [f64::NAN, 0.1, 0.4], [0.1, 0.1, 0.0], [0.1, 0.1, 1.0], [0.1, 2.0, 0.5]] {
            assert!(matches!(naca.build(&bad), Err(SectionError::ParameterOutOfRange { .. })), "{bad:?}");
        }
    }
}
