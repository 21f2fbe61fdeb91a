//! Class-shape transformation (Kulfan) sections and their fit to a given section.

use super::naca::check_range;
use super::stations::{Surface, analytic_section};
use super::{MeasureProblem, Section, SectionError, TrailingEdge};
use crate::differentiate::lift;
use crate::scalar::Scalar;
use nalgebra::{DMatrix, DVector, Dyn, QR};

/// Magnitude that coefficients stay below; those of sections are about 0.2.
const MOST_COEFFICIENT: f64 = 1e3;

/// A Kulfan section (B. M. Kulfan, "Universal Parametric Geometry Representation Method", J. Aircraft 45(1), 2008):
///
/// `y = x^N1 (1 − x)^N2 Σ A_r C(n, r) x^r (1 − x)^(n−r) ± x gap / 2`, each surface with its own coefficients `A`.
///
/// ```
/// use aeroform::section::{Kulfan, SectionDefinition};
/// let kulfan = Kulfan::new(vec![0.2, 0.25, 0.2], vec![-0.2, -0.15, -0.1]).unwrap();
/// let section = SectionDefinition::Kulfan(kulfan).section().unwrap();
/// assert!(section.area() > 0.08);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Kulfan<S = f64> {
    upper: Vec<S>,
    lower: Vec<S>,
    gap: S,
    class: [f64; 2],
    pub(super) control_points: usize,
}

/// A Kulfan section fitted to another section, and how well it fits.
#[derive(Debug, Clone, PartialEq)]
pub struct KulfanFit<S = f64> {
    /// The fitted section, in the chord frame of the original.
    pub kulfan: Kulfan<S>,
    /// Root mean square of the ordinate differences, in chords; its derivatives are not finite where it is zero.
    pub rms: S,
    /// Magnitude of the largest ordinate difference, in chords.
    pub maximum: S,
}

impl<S: Scalar> Kulfan<S> {
    /// A sharp section of round nose and pointed tail (class 0.5, 1) from the coefficients of its surfaces, nose first.
    ///
    /// # Errors
    /// A surface without coefficients, or a coefficient that does not lie between −1000 and 1000.
    pub fn new(upper: Vec<S>, lower: Vec<S>) -> Result<Self, SectionError> {
        for (name, coefficients) in [("upper", &upper), ("lower", &lower)] {
            if coefficients.is_empty() {
                return Err(SectionError::KulfanKey { key: name.into(), problem: super::KeyProblem::Empty });
            }
            for &value in coefficients {
                check_range(name, value, -MOST_COEFFICIENT, MOST_COEFFICIENT)?;
            }
        }
        let control_points = super::stations::DEFAULT_CONTROL_POINTS;
        Ok(Self { upper, lower, gap: S::from(0.0), class: [0.5, 1.0], control_points })
    }

    /// This section with another trailing-edge gap (in chords); a gap of zero makes the trailing edge sharp.
    ///
    /// # Errors
    /// A gap outside of (−1, 1).
    pub fn with_gap(mut self, gap: S) -> Result<Self, SectionError> {
        check_range("trailing_edge_gap", gap, -1.0, 1.0)?;
        self.gap = gap;
        Ok(self)
    }

    /// This section with other class exponents `[N1, N2]` of nose and tail.
    ///
    /// # Errors
    /// Exponents outside of (0, 10).
    pub fn with_class(mut self, class: [f64; 2]) -> Result<Self, SectionError> {
        check_range("class", class[0], 0.0, 10.0)?;
        check_range("class", class[1], 0.0, 10.0)?;
        self.class = class;
        Ok(self)
    }

    /// Coefficients of the upper surface, nose first.
    pub fn upper(&self) -> &[S] {
        &self.upper
    }

    /// Coefficients of the lower surface, nose first.
    pub fn lower(&self) -> &[S] {
        &self.lower
    }

    /// Height of the trailing-edge gap, in chords.
    pub fn gap(&self) -> S {
        self.gap
    }

    /// Class exponents `[N1, N2]` of nose and tail.
    pub fn class(&self) -> [f64; 2] {
        self.class
    }

    /// Sharp exactly when the gap is zero.
    pub fn trailing_edge(&self) -> TrailingEdge {
        if self.gap.re() == 0.0 { TrailingEdge::Sharp } else { TrailingEdge::Blunt }
    }

    /// The section at these coefficients, with the default number of control points unless another was asked for.
    ///
    /// # Errors
    /// Coefficients at which there is no section.
    pub fn section(&self) -> Result<Section<S>, SectionError> {
        self.build(&self.upper, &self.lower, self.gap)
    }

    /// The section at other coefficients, with the knots, nose parameter and kind of trailing edge of this one.
    pub(super) fn build<T: Scalar>(&self, upper: &[T], lower: &[T], gap: T) -> Result<Section<T>, SectionError> {
        analytic_section(self.control_points, self.nose_share(), self.trailing_edge(), "Kulfan", |x, surface| {
            let (coefficients, half_gap) = match surface {
                Surface::Upper => (upper, gap * 0.5),
                Surface::Lower => (lower, -gap * 0.5),
            };
            let mut ordinate = half_gap * x;
            for (r, coefficient) in coefficients.iter().enumerate() {
                ordinate += *coefficient * basis(self.class, coefficients.len() - 1, r, x);
            }
            [T::from(x), ordinate]
        })
    }

    /// The share of the parameter that the upper surface takes: in proportion to the leading coefficients, so that
    /// the spline passes the nose at one speed (`dy/du` is continuous there). Even where that would be lopsided.
    fn nose_share(&self) -> f64 {
        let (up, down) = (self.upper[0].re(), -self.lower[0].re());
        let share = up / (up + down);
        if up > 0.0 && down > 0.0 && (0.2..=0.8).contains(&share) { share } else { 0.5 }
    }
}

impl Kulfan {
    pub(super) fn parameters(&self) -> Vec<(String, f64)> {
        let named = |side: &'static str, values: &[f64]| {
            values.iter().enumerate().map(|(i, &v)| (format!("{side}_{i}"), v)).collect::<Vec<_>>()
        };
        let mut all = named("upper", &self.upper);
        all.extend(named("lower", &self.lower));
        if self.trailing_edge() == TrailingEdge::Blunt {
            all.push(("trailing_edge_gap".into(), self.gap));
        }
        all
    }

    /// The section at build parameters as [`parameters`](Self::parameters) lists them.
    pub(super) fn build_listed<S: Scalar>(&self, parameters: &[S]) -> Result<Section<S>, SectionError> {
        let split = parameters.split_at_checked(self.upper.len()).and_then(|(upper, rest)| {
            let (lower, gap) = rest.split_at_checked(self.lower.len())?;
            Some((upper, lower, gap))
        });
        match (split, self.trailing_edge()) {
            (Some((upper, lower, [])), TrailingEdge::Sharp) => self.build(upper, lower, S::from(0.0)),
            (Some((upper, lower, &[gap])), TrailingEdge::Blunt) => self.build(upper, lower, gap),
            _ => Err(SectionError::ParameterCount { expected: self.parameters().len(), found: parameters.len() }),
        }
    }
}

/// Class function times Bernstein polynomial `r` of degree `n`, at a station in [0, 1].
fn basis<S: Scalar>(class: [f64; 2], n: usize, r: usize, x: S) -> S {
    let mut binomial = 1.0;
    for k in 0..r {
        binomial *= (n - k) as f64 / (k + 1) as f64;
    }
    let rest = -x + 1.0;
    let powers = x.powi(r as i32) * rest.powi((n - r) as i32);
    x.real_power(class[0]) * rest.real_power(class[1]) * binomial * powers
}

/// Points a surface is compared at.
const SAMPLES: usize = 200;

/// The Kulfan section (class 0.5, 1) with the given numbers of coefficients that fits a section best: least squares of
/// the ordinates in the section's chord frame, at cosine-spaced points of each surface.
///
/// The gap is that of the section, and the fit carries the derivatives of the section.
///
/// # Errors
/// A section without a chord, no coefficients, or more coefficients than the points determine.
pub fn fit_kulfan<S: Scalar>(section: &Section<S>, upper: usize, lower: usize) -> Result<KulfanFit<S>, SectionError> {
    let class = [0.5, 1.0];
    let frame = section.chord_frame()?;
    let gap = match section.trailing_edge() {
        TrailingEdge::Sharp => S::from(0.0),
        TrailingEdge::Blunt => section.trailing_edge_gap()? / frame.chord,
    };
    let (first, last) = section.curve().domain();
    let mut coefficients = [vec![], vec![]];
    let mut residuals: Vec<S> = vec![];
    for (side, (n, end, sign)) in [(upper, first, 1.0), (lower, last, -1.0)].into_iter().enumerate() {
        let key = ["upper", "lower"][side];
        if n == 0 {
            return Err(SectionError::KulfanKey { key: key.into(), problem: super::KeyProblem::Empty });
        }
        let mut points = vec![];
        for u in surface_parameters(section, end) {
            let [x, y] = frame.coordinates(section.curve().point_at(u)).map(|c| c / frame.chord);
            // the class function exists on the chord only
            if x > 0.0 && x < 1.0 {
                points.push((x, y - gap * x * (0.5 * sign)));
            }
        }
        let matrix = DMatrix::from_fn(points.len(), n, |i, r| basis(class, n - 1, r, points[i].0));
        let right = DVector::from_iterator(points.len(), points.iter().map(|p| p.1));
        let solution = solve_least_squares(&matrix, &right)
            .ok_or(SectionError::NoMeasure { measure: "Kulfan fit", reason: MeasureProblem::Singular })?;
        residuals.extend(&(&matrix * DVector::from_column_slice(&solution) - right));
        coefficients[side] = solution;
    }
    let [upper, lower] = coefficients;
    let kulfan = Kulfan::new(upper, lower)?.with_gap(gap)?;
    // a fit that is determined has residuals
    let squares: S = residuals.iter().map(|r| r.squared()).sum();
    let maximum = residuals.iter().fold(residuals[0], |most, r| if r.re().abs() > most.re().abs() { *r } else { most });
    let rms = (squares / residuals.len() as f64).sqrt();
    Ok(KulfanFit { kulfan, rms, maximum: num_traits::Signed::abs(&maximum) })
}

/// Parameters of one surface from the nose to `end`, spaced as the knots are.
fn surface_parameters<S: Scalar>(section: &Section<S>, end: f64) -> Vec<f64> {
    let nose = section.nose_parameter();
    let (low, high) = (nose.min(end), nose.max(end));
    section.parameters(4 * SAMPLES).into_iter().filter(|u| (low..=high).contains(u)).collect()
}

/// Least squares by QR in `f64`, lifted through the normal equations; `None` where the columns are dependent to
/// round-off.
fn solve_least_squares<S: Scalar>(matrix: &DMatrix<S>, right: &DVector<S>) -> Option<Vec<S>> {
    if matrix.nrows() < matrix.ncols() {
        return None;
    }
    let qr: QR<f64, Dyn, Dyn> = matrix.map(|a| a.re()).qr();
    let r = qr.r();
    let diagonal = r.diagonal();
    if diagonal.iter().any(|d| d.abs() <= 1e-13 * diagonal.amax()) {
        return None;
    }
    let solution = r.solve_upper_triangular(&(qr.q().transpose() * right.map(|b| b.re())))?;
    // the inverse of the Jacobian RᵀR of the normal equations
    let inverse = r.try_inverse()?;
    let inverse = &inverse * inverse.transpose();
    let mut lifted: Vec<S> = solution.iter().map(|&c| S::from(c)).collect();
    let normal = |c: &[S]| -> Vec<S> {
        let residual = matrix * DVector::from_column_slice(c) - right;
        matrix.tr_mul(&residual).as_slice().to_vec()
    };
    // the second time makes up for the squared condition number
    for _ in 0..2 {
        lift(&mut lifted, normal, |k, r| inverse[(k, r)]);
    }
    Some(lifted)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::{VectorFunction, jacobian};
    use crate::section::SectionDefinition;

    fn definition(upper: &[f64], lower: &[f64]) -> SectionDefinition {
        SectionDefinition::Kulfan(Kulfan::new(upper.to_vec(), lower.to_vec()).unwrap())
    }

    #[test]
    fn data_points_are_the_formula() {
        // kulfan1 of the ESP sample data (4 coefficients, gap 2 × 0.0012)
        let (upper, lower) = ([0.2139, 0.2884, 0.2354, 0.2870], [-0.1243, -0.0203, -0.0372, 0.0012]);
        let kulfan = Kulfan::new(upper.to_vec(), lower.to_vec()).unwrap().with_gap(0.0024).unwrap();
        let section = SectionDefinition::Kulfan(kulfan).section().unwrap();
        for (i, [x, y]) in section.points(99).into_iter().enumerate() {
            let (a, tail) = if i <= 49 { (upper, 0.0012) } else { (lower, -0.0012) };
            let (p, q) = (x.max(0.0), 1.0 - x);
            let shape = a[0] * q * q * q + 3.0 * a[1] * p * q * q + 3.0 * a[2] * p * p * q + a[3] * p * p * p;
            assert!((y - (p.sqrt() * q * shape + tail * p)).abs() < 1e-9, "{i} {x} {y}");
        }
        // area and thickness of this sample, as measured with ESP
        assert!((section.area() - 0.0823).abs() < 5e-5);
        assert!((section.maximum_thickness().unwrap()[1] - 0.1201).abs() < 1e-4);
    }

    #[test]
    fn the_curve_keeps_to_the_formula_between_the_points() {
        // surfaces of unequal nose radius, which a C2 curve can only approach
        let (up, down) = (0.3625, -0.2225);
        let section = definition(&[up; 4], &[down; 4]).section().unwrap();
        let share = section.nose_parameter();
        assert!((share - up / (up - down)).abs() < 1e-15);
        for i in 0..=2000 {
            let u = f64::from(i) / 2000.0;
            let ([x, y], [dx, dy]) = section.curve().point_and_tangent(u);
            let a = if u < share { up } else { down };
            let off = (y - a * x.max(0.0).sqrt() * (1.0 - x)) * dx / dx.hypot(dy);
            assert!(off.abs() < if x > 0.02 { 2e-6 } else { 1e-4 }, "{u} {x} {off}");
        }
        assert_eq!(section.curvature_reversals(0.01), [0, 0]);
    }

    #[test]
    fn the_shape_is_linear_in_the_coefficients() {
        struct Shape(SectionDefinition);
        impl VectorFunction for Shape {
            type Error = SectionError;
            fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, SectionError> {
                Ok(self.0.build(x)?.curve().control_points().iter().flatten().copied().collect())
            }
        }
        let kulfan = Kulfan::new(vec![0.2, 0.3], vec![-0.2, 0.1]).unwrap().with_gap(0.01).unwrap();
        let shape = Shape(SectionDefinition::Kulfan(kulfan));
        let x: Vec<f64> = shape.0.parameters().iter().map(|p| p.1).collect();
        let (values, exact) = jacobian(&shape, &x).unwrap();
        for k in 0..x.len() {
            let mut moved = x.clone();
            moved[k] += 0.5;
            for (i, value) in shape.evaluate(&moved).unwrap().iter().enumerate() {
                assert!((value - values[i] - 0.5 * exact[(i, k)]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_fit_finds_the_coefficients_again() {
        let (upper, lower) = ([0.2, 0.25, 0.2, 0.3], [-0.2, -0.1, -0.15, 0.05]);
        let kulfan = Kulfan::new(upper.to_vec(), lower.to_vec()).unwrap().with_gap(0.004).unwrap();
        let section = SectionDefinition::Kulfan(kulfan).section().unwrap();
        let fit = fit_kulfan(&section, 4, 4).unwrap();
        assert!(fit.rms < 1e-7 && fit.maximum < 1e-6, "{fit:?}");
        for (a, b) in upper.iter().chain(&lower).zip(fit.kulfan.upper().iter().chain(fit.kulfan.lower())) {
            assert!((a - b).abs() < 1e-5, "{fit:?}");
        }
        assert!((fit.kulfan.gap() - 0.004).abs() < 1e-15);
        // also of a section moved, turned and enlarged
        let moved =
            section.curve().control_points().iter().map(|p| [3.0 + 1.6 * p[0] - 1.2 * p[1], 1.2 * p[0] + 1.6 * p[1]]);
        let again = fit_kulfan(&section.with_control_points(moved.collect()).unwrap(), 4, 4).unwrap();
        for (a, b) in fit.kulfan.upper().iter().zip(again.kulfan.upper()) {
            assert!((a - b).abs() < 1e-10);
        }
    }

    #[test]
    fn more_coefficients_fit_better() {
        // NACA thickness has a term in x beside √x, which no class function holds; cambered sections also bulge
        // forward of their nose, where the class function ends
        for (text, reached) in [("naca0012:sharp", 4e-5), ("naca2412:sharp", 3e-4)] {
            let section = SectionDefinition::parse(text).unwrap().section().unwrap();
            let mut previous = f64::INFINITY;
            for n in [2, 4, 6, 8] {
                let fit = fit_kulfan(&section, n, n).unwrap();
                assert!(fit.rms < previous && fit.rms <= fit.maximum);
                previous = fit.rms;
            }
            assert!(previous < reached, "{text} {previous}");
        }
        let section = SectionDefinition::parse("naca0012").unwrap().section().unwrap();
        assert!(fit_kulfan(&section, 0, 3).is_err());
        assert!(fit_kulfan(&section, 3, 2000).is_err());
    }

    #[test]
    fn bad_coefficients_are_refused() {
        assert!(Kulfan::new(vec![], vec![0.1]).is_err());
        for bad in [f64::NAN, f64::INFINITY, 1e160, -1e3] {
            assert!(Kulfan::new(vec![bad], vec![0.1]).is_err() && Kulfan::new(vec![0.1], vec![bad]).is_err());
        }
        let kulfan = Kulfan::new(vec![0.1], vec![-0.1]).unwrap();
        assert!(kulfan.clone().with_gap(1.5).is_err());
        assert!(kulfan.clone().with_class([0.0, 1.0]).is_err());
        let expected = SectionError::ParameterCount { expected: 2, found: 3 };
        assert_eq!(SectionDefinition::Kulfan(kulfan).build(&[0.1, 0.1, 0.1]).unwrap_err(), expected);
    }
}
