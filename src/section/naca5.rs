//! NACA five-digit sections, standard and reflexed.

use super::naca::{along_chord, check_range, is_digits, thickened};
use super::stations::analytic_section;
use super::{Section, SectionError, TrailingEdge};
use crate::differentiate::{SingularJacobian, lift_root};
use crate::scalar::Scalar;
use crate::spline::isolated;
use num_dual::{Dual, Dual64, first_derivative};

/// Camber positions beyond: the cubic part of the line would not end within the chord.
const REARMOST: f64 = 0.3;

/// A NACA five-digit section (Jacobs and Pinkerton, NACA reports 537 and 610; constants as in Abbott and von Doenhoff).
///
/// The camber line is a cubic from the nose to `m`, followed by a straight line (standard) or another cubic that makes
/// the quarter-chord moment vanish (reflexed). The designation gives design lift coefficient (first digit times 0.15),
/// camber position (second digit over 20, in chords) and thickness. At those values the printed constants `m`, `k1`,
/// `k2/k1` are reproduced exactly; away from them they follow thin-airfoil theory, of which they are rounded results.
#[derive(Debug, Clone, PartialEq)]
pub struct Naca5 {
    name: String,
    thickness: f64,
    design_lift: f64,
    camber_position: f64,
    reflexed: bool,
    printed: Printed,
    pub(super) trailing_edge: TrailingEdge,
    pub(super) control_points: usize,
}

/// Constants of a camber line for a design lift coefficient of 0.3.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Printed {
    m: f64,
    k1: f64,
    /// k2/k1, zero for the standard line.
    ratio: f64,
}

const STANDARD: [Printed; 5] = [
    Printed { m: 0.0580, k1: 361.4, ratio: 0.0 },
    Printed { m: 0.1260, k1: 51.64, ratio: 0.0 },
    Printed { m: 0.2025, k1: 15.957, ratio: 0.0 },
    Printed { m: 0.2900, k1: 6.643, ratio: 0.0 },
    Printed { m: 0.3910, k1: 3.230, ratio: 0.0 },
];
/// Camber positions 0.10 to 0.25.
#[allow(clippy::approx_constant)] // 0.3180 is printed, not 1/π
const REFLEXED: [Printed; 4] = [
    Printed { m: 0.1300, k1: 51.990, ratio: 0.000764 },
    Printed { m: 0.2170, k1: 15.793, ratio: 0.00677 },
    Printed { m: 0.3180, k1: 6.520, ratio: 0.0303 },
    Printed { m: 0.4410, k1: 3.191, ratio: 0.1355 },
];
/// Design lift coefficient the constants are printed for.
const PRINTED_LIFT: f64 = 0.3;

impl Naca5 {
    /// A section from its five digits.
    ///
    /// # Errors
    /// Anything but five digits with a first digit that is not 0, a second from 1 to 5 (2 to 5 reflexed), a third of
    /// 0 or 1 and a thickness that is not 0.
    pub fn new(text: &str, trailing_edge: TrailingEdge) -> Result<Self, SectionError> {
        let refused = || SectionError::UnknownDesignation { designation: text.into() };
        if !is_digits(text) {
            return Err(refused());
        }
        let &[lift, position, reflex, tens, units] = text.as_bytes() else { return Err(refused()) };
        let digit = |byte: u8| f64::from(byte - b'0');
        let index = usize::from(position - b'0');
        let (printed, reflexed) = match reflex {
            b'0' => (index.checked_sub(1).and_then(|i| STANDARD.get(i)), false),
            b'1' => (index.checked_sub(2).and_then(|i| REFLEXED.get(i)), true),
            _ => (None, false),
        };
        let thickness = digit(tens) / 10.0 + digit(units) / 100.0;
        match printed {
            Some(&printed) if lift > b'0' && thickness > 0.0 => Ok(Self {
                name: format!("NACA {text}"),
                thickness,
                design_lift: 0.15 * digit(lift),
                camber_position: digit(position) / 20.0,
                reflexed,
                printed,
                trailing_edge,
                control_points: super::stations::DEFAULT_CONTROL_POINTS,
            }),
            _ => Err(refused()),
        }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }

    pub(super) fn parameters(&self) -> Vec<(String, f64)> {
        vec![
            ("thickness".into(), self.thickness),
            ("design_lift".into(), self.design_lift),
            ("camber_position".into(), self.camber_position),
        ]
    }

    pub(super) fn build<S: Scalar>(&self, parameters: &[S]) -> Result<Section<S>, SectionError> {
        let &[thickness, lift, position] = parameters else {
            return Err(SectionError::ParameterCount { expected: 3, found: parameters.len() });
        };
        check_range("thickness", thickness, 0.0, 1.0)?;
        check_range("design_lift", lift, -3.0, 3.0)?;
        check_range("camber_position", position, 0.0, REARMOST)?;
        let line = self.camber_line(lift, position)?;
        analytic_section(self.control_points, 0.5, self.trailing_edge, &self.name, |x, surface| {
            thickened(line.at(x), thickness, x, surface, self.trailing_edge)
        })
    }

    /// The camber line at a design lift and camber position: theory, shifted to the printed constants.
    fn camber_line<S: Scalar>(&self, lift: S, position: S) -> Result<CamberLine<S>, SectionError> {
        let theory = |position: S| {
            theory(self.reflexed, position).map_err(|SingularJacobian| {
                let (name, value) = ("camber_position", position.re());
                SectionError::ParameterOutOfRange { name, value, lower: 0.0, upper: REARMOST }
            })
        };
        let (nominal, moved) = (theory(S::from(self.camber_position))?, theory(position)?);
        let mut line = CamberLine {
            m: moved.m - nominal.m + self.printed.m,
            ratio: moved.ratio - nominal.ratio + self.printed.ratio,
            k1: S::from(1.0),
        };
        let printed = CamberLine { m: self.printed.m, ratio: self.printed.ratio, k1: 1.0 };
        let correction = self.printed.k1 * printed.lift_coefficient() / PRINTED_LIFT;
        line.k1 = lift * correction / line.lift_coefficient();
        Ok(line)
    }
}

/// A five-digit camber line; the standard one has a ratio of zero.
#[derive(Debug, Clone, Copy)]
struct CamberLine<S> {
    m: S,
    k1: S,
    /// k2/k1.
    ratio: S,
}

impl<S: Scalar> CamberLine<S> {
    /// Ordinate at `x`.
    fn ordinate(&self, x: S) -> S {
        let from_m = -self.m + x;
        let cubic = if x < self.m { S::from(1.0) } else { self.ratio };
        let rest = self.ratio * (-self.m + 1.0).powi(3) + self.m.powi(3);
        (cubic * from_m.powi(3) - rest * x + self.m.powi(3)) * (self.k1 / 6.0)
    }

    /// Ordinate and slope.
    fn at(&self, x: f64) -> Dual<S> {
        let (station, constant) = along_chord(x);
        let line = CamberLine { m: constant(self.m), k1: constant(self.k1), ratio: constant(self.ratio) };
        let Dual { re, eps } = line.ordinate(station);
        // zero at the trailing edge, but for round-off
        Dual { re: if x == 1.0 { S::from(0.0) } else { re }, eps }
    }

    /// Design lift coefficient `2 ∫ y' cos θ dθ` of thin-airfoil theory, θ from 0 to π with `x = (1 − cos θ)/2`.
    fn lift_coefficient(&self) -> S {
        self.slope_integral([0.0, 2.0, 0.0])
    }

    /// `∫ y' (cos θ − cos 2θ) dθ`, proportional to the quarter-chord moment of thin-airfoil theory.
    fn moment(&self) -> S {
        self.slope_integral([1.0, 1.0, -2.0])
    }

    /// `∫ y' (w0 + w1 cos θ + w2 cos² θ) dθ` over the chord, in closed form: the slope `y'` of
    /// [`ordinate`](Self::ordinate) is a polynomial in `cos θ` on either side of `m`. Its coefficients are checked
    /// against the slopes of [`at`](Self::at).
    fn slope_integral(&self, weight: [f64; 3]) -> S {
        let rest = self.ratio * (-self.m + 1.0).powi(3) + self.m.powi(3);
        // x − m = (c − cos θ)/2 with c = 1 − 2m
        let c = -self.m * 2.0 + 1.0;
        let bound = c.acos();
        let part = |cubic: S, from: S, to: S| {
            let square = cubic * 0.75;
            let slope = [square * c * c - rest, -square * c * 2.0, square];
            let (high, low) = (cosine_integrals(to), cosine_integrals(from));
            let mut sum = S::from(0.0);
            for (i, s) in slope.iter().enumerate() {
                for (j, w) in weight.iter().enumerate() {
                    sum += *s * (high[i + j] - low[i + j]) * *w;
                }
            }
            sum
        };
        let (start, end) = (S::from(0.0), S::from(std::f64::consts::PI));
        (part(S::from(1.0), start, bound) + part(self.ratio, bound, end)) * self.k1 / 6.0
    }
}

/// `∫ cos^k` from 0 to an angle, k from 0 to 4.
fn cosine_integrals<S: Scalar>(angle: S) -> [S; 5] {
    let (sin, cos) = angle.sin_cos();
    let second = (angle + sin * cos) * 0.5;
    [angle, sin, second, sin - sin.powi(3) / 3.0, (cos.powi(3) * sin + second * 3.0) * 0.25]
}

/// The camber line of unit `k1` with its summit at `position`, from theory.
fn theory<S: Scalar>(reflexed: bool, position: S) -> Result<CamberLine<S>, SingularJacobian> {
    if reflexed {
        return reflexed_line(position);
    }
    // summit where 3 (x − m)² = m³: position = m (1 − √(m/3))
    fn summit<T: Scalar>(m: T) -> T {
        m * (-(m / 3.0).sqrt() + 1.0)
    }
    let p = position.re();
    let at = |m: f64| first_derivative(|m: Dual64| summit(m) - p, m);
    let m = isolated(p, 1.0, true, at);
    let m = lift_root(m, || at(m).1, |m: S| summit(m) - position)?;
    Ok(CamberLine { m, k1: S::from(1.0), ratio: S::from(0.0) })
}

/// The reflexed line: summit at `position` and no quarter-chord moment.
fn reflexed_line<S: Scalar>(position: S) -> Result<CamberLine<S>, SingularJacobian> {
    fn with<T: Scalar>(m: T, position: T) -> CamberLine<T> {
        let ratio = ((position - m).squared() * 3.0 - m.powi(3)) / (-m + 1.0).powi(3);
        CamberLine { m, k1: T::from(1.0), ratio }
    }
    let p = position.re();
    let moment = |m: f64| first_derivative(|m: Dual64| with(m, Dual64::from(p)).moment(), m);
    let m = isolated(p, 0.9, moment(p).0 < 0.0, moment);
    let m = lift_root(m, || moment(m).1, |m: S| with(m, position).moment())?;
    Ok(with(m, position))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::{StepRange, VectorFunction, finite_difference_jacobian, jacobian};

    const ALL: [&str; 9] = ["21012", "22012", "23012", "24012", "25012", "22112", "23112", "24112", "25115"];

    #[test]
    fn theory_rounds_to_the_printed_constants() {
        for digits in ALL {
            let naca = Naca5::new(digits, TrailingEdge::Blunt).unwrap();
            let line = theory(naca.reflexed, naca.camber_position).unwrap();
            assert!((line.m - naca.printed.m).abs() < 2e-3, "{digits}: m {} {}", line.m, naca.printed.m);
            assert!((line.ratio - naca.printed.ratio).abs() < 6e-3, "{digits}: {} {:?}", line.ratio, naca.printed);
            let k1 = PRINTED_LIFT / line.lift_coefficient();
            // 361.4 of the 210 line is the farthest off: 3.1 %
            assert!((k1 / naca.printed.k1 - 1.0).abs() < 0.035, "{digits}: {k1} {}", naca.printed.k1);
            // at the nominal values the printed ones are used
            let line = naca.camber_line(naca.design_lift, naca.camber_position).unwrap();
            assert!((line.m - naca.printed.m).abs() < 1e-15 && (line.ratio - naca.printed.ratio).abs() < 1e-15);
            assert!((line.k1 / naca.printed.k1 - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn camber_lines_are_smooth_and_closed() {
        for digits in ALL {
            let naca = Naca5::new(digits, TrailingEdge::Sharp).unwrap();
            let line = naca.camber_line(naca.design_lift, naca.camber_position).unwrap();
            let m = line.m;
            let (below, above) = (line.at(m - 1e-12), line.at(m + 1e-12));
            assert!((below.re - above.re).abs() < 1e-11 && (below.eps - above.eps).abs() < 1e-10);
            assert!(line.at(0.0).re.abs() < 1e-15 && line.at(1.0 - 1e-12).re.abs() < 1e-11);
            // the summit lies where the designation puts it
            let (p, at) = (naca.camber_position, line.at(naca.camber_position));
            assert!(at.re > line.at(p - 0.02).re && at.re > line.at(p + 0.02).re, "{digits}");
            let section = naca.build(&[naca.thickness, naca.design_lift, p]).unwrap();
            assert_eq!(section.trailing_edge_points(), [[1.0, 0.0]; 2]);
        }
    }

    #[test]
    fn naca_23012_is_the_printed_camber_line() {
        let naca = Naca5::new("23012", TrailingEdge::Blunt).unwrap();
        let line = naca.camber_line(0.3, 0.15).unwrap();
        let (k, m) = (15.957 / 6.0, 0.2025f64);
        for x in [0.0125, 0.05, 0.1, 0.2] {
            let printed = k * (x * x * x - 3.0 * m * x * x + m * m * (3.0 - m) * x);
            assert!((line.at(x).re - printed).abs() < 1e-15);
        }
        for x in [0.3, 0.6, 0.95] {
            assert!((line.at(x).re - k * m.powi(3) * (1.0 - x)).abs() < 1e-15);
        }
        // maximum camber 1.8 % at 15 % of the chord
        assert!((line.at(0.15).re - 0.01838).abs() < 1e-5);
    }

    #[test]
    fn closed_integrals_agree_with_the_midpoint_rule() {
        let line = CamberLine { m: 0.217, k1: 15.793, ratio: 0.00677 };
        let n = 200_000;
        let (mut lift, mut moment) = (0.0, 0.0);
        for i in 0..n {
            let angle = std::f64::consts::PI * (i as f64 + 0.5) / n as f64;
            let slope = line.at(0.5 * (1.0 - angle.cos())).eps * std::f64::consts::PI / n as f64;
            lift += 2.0 * slope * angle.cos();
            moment += slope * (angle.cos() - (2.0 * angle).cos());
        }
        assert!((line.lift_coefficient() - lift).abs() < 1e-9 && (line.moment() - moment).abs() < 1e-9);
    }

    #[test]
    fn the_shape_is_differentiated_in_its_parameters() {
        struct Shape(Naca5);
        impl VectorFunction for Shape {
            type Error = SectionError;
            fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SectionError> {
                Ok(self.0.build(x)?.curve().control_points().iter().flatten().copied().collect())
            }
        }
        for digits in ["23012", "23112"] {
            let shape = Shape(Naca5::new(digits, TrailingEdge::Sharp).unwrap());
            let x: Vec<f64> = shape.0.parameters().iter().map(|p| p.1).collect();
            let (_, exact) = jacobian(&shape, &x).unwrap();
            // small steps: a station that passes the joint of the two parts ends the expansion
            let steps = [StepRange { first: 2e-4, levels: 7 }; 3];
            let checked = finite_difference_jacobian(|x| shape.evaluate(x), &x, &steps).unwrap();
            for (a, b) in exact.iter().zip(checked.iter()) {
                assert!((a - b.value).abs() <= b.error + 1e-11, "{digits}: {a} {b:?}");
            }
        }
    }

    #[test]
    fn bad_designations_are_refused() {
        for digits in ["", "2301", "230123", "26012", "20012", "21112", "23212", "03012", "23000", "2301x"] {
            assert!(Naca5::new(digits, TrailingEdge::Blunt).is_err(), "{digits}");
        }
    }
}
