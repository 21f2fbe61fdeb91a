//! Sections from lists of points: Selig and Lednicer files.

mod parse;
mod repair;

pub use repair::Repair;

use super::measures::{farthest_parameter, outline_crossing};
use super::stations::with_ends;
use super::{CoordinateError, Section, SectionError, TrailingEdge};
use crate::plane::{distance, middle};
use crate::scalar::Scalar;
use crate::spline::{EndCondition, KnotVector, chord_length_parameters, fit, fit_to_tolerance, interpolate};
use parse::{Listing, Point};
use repair::{Outline, assemble};
use std::path::Path;

/// Points of a section in Selig order, read from a file or given, with a record of what was mended.
///
/// *Selig*: an optional title, then the outline, a point `x y` per line, from the trailing edge round the nose and back.
/// *Lednicer*: title, a line with the numbers of upper and lower points, then both surfaces from nose to tail. Also
/// read: surfaces in either order or direction, two surfaces without a header, commas, semicolons or tabs, comments
/// (`#`, `!`, `%`), blank lines, any end of line, Fortran exponents, the domain line of MSES, remarks at the end.
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
pub struct Coordinates<S = f64> {
    name: String,
    points: Vec<[S; 2]>,
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
    /// Bytes that hold no section; the error says what is wrong, and in which line.
    pub fn parse(bytes: &[u8]) -> Result<Self, CoordinateError> {
        Self::from_listing(parse::parse(bytes)?)
    }

    fn from_listing(listing: Listing) -> Result<Self, CoordinateError> {
        let given: Vec<[f64; 2]> = listing.points.iter().map(|p| p.xy).collect();
        Self::mended(listing, &given)
    }
}

impl<S: Scalar> Coordinates<S> {
    /// The section with the given outline (arrays, or `nalgebra` points or vectors, of any scalar); mended as a file
    /// would be.
    ///
    /// # Errors
    /// As [`parse`](Coordinates::parse), with lines counted from zero points.
    pub fn from_points(name: &str, points: &[impl Into<[S; 2]> + Copy]) -> Result<Self, CoordinateError> {
        let given: Vec<[S; 2]> = points.iter().map(|&p| p.into()).collect();
        if let Some(value) = given.iter().flatten().map(|c| c.re()).find(|c| !parse::usable(*c)) {
            return Err(CoordinateError::Value { line: 0, value });
        }
        if given.len() > parse::MOST {
            return Err(CoordinateError::TooManyPoints { found: given.len(), most: parse::MOST });
        }
        let points = given.iter().map(|p| Point { xy: p.map(|c| c.re()), line: 0, source: 0 }).collect();
        Self::mended(Listing { title: Some(name.into()), points, ..Listing::default() }, &given)
    }

    /// Mends a listing by its real parts; its points in the order of the file are `given`.
    fn mended(mut listing: Listing, given: &[[S; 2]]) -> Result<Self, CoordinateError> {
        let name = listing.title.take().unwrap_or_default();
        for (source, point) in listing.points.iter_mut().enumerate() {
            point.source = source;
        }
        let Outline { points, trailing_edge, repairs } = assemble(listing)?;
        // a closed trailing edge lies at a mean of two points, everything else where it was given
        let derivatives = |source: usize| given[source].map(|c| c - c.re());
        let n = points.len();
        let points = (0..n).map(|i| {
            let own = derivatives(points[i].source);
            let own = if trailing_edge == TrailingEdge::Sharp && (i == 0 || i + 1 == n) {
                middle(derivatives(points[0].source), derivatives(points[n - 1].source))
            } else {
                own
            };
            [0, 1].map(|d| own[d] + points[i].xy[d])
        });
        Ok(Self { name, points: points.collect(), trailing_edge, repairs, fit: Fit::Interpolate })
    }

    /// Name of the section: the title of its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The points from the upper to the lower trailing edge; a sharp trailing edge stands at both ends.
    pub fn points(&self) -> &[[S; 2]] {
        &self.points
    }

    /// Everything that was mended, in the order in which it was done.
    pub fn repairs(&self) -> &[Repair] {
        &self.repairs
    }

    /// Sharp where the outline is closed.
    pub fn trailing_edge(&self) -> TrailingEdge {
        self.trailing_edge
    }

    /// Largest distance of a point from the middle of the trailing edge, in the unit of the file.
    pub fn chord(&self) -> S {
        let tail = self.tail();
        let farther = |most: S, point: &[S; 2]| {
            let distance = distance(*point, tail);
            if distance > most { distance } else { most }
        };
        self.points.iter().fold(S::from(0.0), farther)
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

    /// These points with a curve that passes them within `tolerance` (in the unit of the file) with as few knots as
    /// needed, instead of through them. This smooths rounded coordinates.
    ///
    /// # Errors
    /// A tolerance that is not a positive number.
    pub fn with_fit_tolerance(self, tolerance: f64) -> Result<Self, SectionError> {
        super::naca::check_range("fit tolerance", tolerance, 0.0, f64::INFINITY)?;
        Ok(Self { fit: Fit::Tolerance(tolerance), ..self })
    }

    /// These points with a least-squares curve of so many control points instead of an interpolating one.
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
    /// Parameters and knots follow from the real parts of the points and are plain numbers, so that the control points
    /// are linear in the points.
    ///
    /// # Errors
    /// A curve that crosses itself between the points, a fit that is not possible.
    pub fn section(&self) -> Result<Section<S>, SectionError> {
        let real: Vec<[f64; 2]> = self.points.iter().map(|p| p.map(|c| c.re())).collect();
        let parameters: Vec<f64> = chord_length_parameters(&real)?;
        let mut curve = match self.fit {
            Fit::Interpolate => interpolate(&parameters, &self.points, EndCondition::Natural)?,
            Fit::Tolerance(tolerance) => fit_to_tolerance(&parameters, &self.points, 3, tolerance)?,
            Fit::ControlPoints(n) => fit(&parameters, &self.points, even_knots(&parameters, n)?)?,
        };
        if let [first, .., last] = self.points[..] {
            curve = with_ends(&curve, first, last)?;
        }
        let real = curve.real();
        if let Some(crossing) = outline_crossing(&real) {
            let [x, y] = crossing.point;
            return Err(CoordinateError::CurveCrossing { x, y }.into());
        }
        let nose = farthest_parameter(&real, self.tail().map(|c| c.re()))?;
        let section = Section::new(curve, self.trailing_edge, nose, self.name.as_str())?;
        let area = section.area().re();
        if area > 0.0 { Ok(section) } else { Err(CoordinateError::NoArea { chord: self.chord().re(), area }.into()) }
    }

    /// Middle of the trailing edge; there are points, or nothing was assembled.
    fn tail(&self) -> [S; 2] {
        middle(self.points[0], self.points[self.points.len() - 1])
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::SectionDefinition;

    fn naca() -> Vec<[f64; 2]> {
        SectionDefinition::parse("naca4412").unwrap().section().unwrap().points(99)
    }

    fn file(points: impl IntoIterator<Item = [f64; 2]>) -> String {
        points.into_iter().map(|[x, y]| format!("{x} {y}\n")).collect()
    }

    fn parse(text: &str) -> Result<Coordinates, CoordinateError> {
        Coordinates::parse(text.as_bytes())
    }

    #[test]
    fn selig_files_come_back_to_the_bit() {
        for text in ["naca4412", "naca0012:sharp", "naca23112", "kulfan:upper=0.1,0.3/lower=-0.2,0.1"] {
            let section = SectionDefinition::parse(text).unwrap().section().unwrap();
            let read = parse(&section.selig()).unwrap();
            assert_eq!(read.points(), section.points(99));
            assert_eq!((read.name(), read.trailing_edge()), (section.name(), section.trailing_edge()));
            assert_eq!(read.repairs(), []);
            // and again through the curve of the file
            let again = read.section().unwrap();
            for (a, b) in again.points(99).iter().zip(read.points()) {
                assert!((a[0] - b[0]).abs() < 1e-15 && (a[1] - b[1]).abs() < 1e-15);
            }
            assert!((again.area() / section.area() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn every_arrangement_gives_the_same_outline() {
        let points = naca();
        let (upper, lower) = (&points[..50], &points[49..]);
        let to_nose = |p: &[[f64; 2]]| p.to_vec();
        let reversed = |p: &[[f64; 2]]| p.iter().rev().copied().collect::<Vec<_>>();
        let header = "50. 50.\n\n";
        let arrangements = [
            file(points.clone()),
            file(reversed(&points)),
            // Lednicer, either surface first, from nose to tail or back
            format!("title\n{header}{}\n{}", file(reversed(upper)), file(to_nose(lower))),
            format!("title\n{header}{}\n{}", file(to_nose(lower)), file(reversed(upper))),
            format!("title\n{header}{}\n{}", file(to_nose(upper)), file(reversed(lower))),
            // the same without a header, divided by a blank line, by a heading, or not at all
            format!("{}\n{}", file(reversed(upper)), file(to_nose(lower))),
            format!("{}lower surface\n{}", file(reversed(upper)), file(to_nose(lower))),
            format!("{}{}", file(to_nose(lower)), file(reversed(upper))),
            // from the nose round the tail
            format!("{}{}", file(to_nose(lower)), file(to_nose(&upper[..49]))),
            format!("{}{}", file(reversed(upper)), file(reversed(&lower[1..]))),
        ];
        for text in arrangements {
            let read = parse(&format!("title\n{text}")).unwrap();
            assert_eq!(read.points(), points, "{:?}", read.repairs());
        }
    }

    #[test]
    fn repairs_are_recorded() {
        let points = naca();
        let sharp = SectionDefinition::parse("naca4412:sharp").unwrap().section().unwrap().points(99);
        // a duplicate
        let mut text: Vec<_> = points.clone();
        text.insert(10, points[9]);
        let read = parse(&file(text)).unwrap();
        assert_eq!(read.repairs(), [Repair::DuplicateDropped { line: 11 }]);
        assert_eq!(read.points(), points);
        // two points exchanged
        let mut text = points.clone();
        text.swap(20, 21);
        let read = parse(&file(text)).unwrap();
        assert_eq!((read.repairs(), read.points()), (&[Repair::Sorted { count: 2 }][..], &points[..]));
        // the base drawn, with a point in its middle at both ends or as a closing line
        let mut text = points.clone();
        let middle = [0.5 * (points[0][0] + points[98][0]), 0.5 * (points[0][1] + points[98][1])];
        text.insert(0, middle);
        text.push(middle);
        let read = parse(&file(text)).unwrap();
        assert_eq!(read.repairs(), [Repair::BasePointDropped { line: 1 }, Repair::BasePointDropped { line: 101 }]);
        assert_eq!(read.points(), points);
        let mut text = points.clone();
        text.push(points[0]);
        assert_eq!(parse(&file(text)).unwrap().points(), points);
        // the sharp trailing edge named once only, or with rounding
        let read = parse(&file(sharp[..98].to_vec())).unwrap();
        assert_eq!(read.trailing_edge(), TrailingEdge::Blunt, "a step of 0.001 may be meant");
        let coarse: Vec<_> = sharp.iter().step_by(2).copied().collect();
        let read = parse(&file(coarse[..coarse.len() - 1].to_vec())).unwrap();
        assert!(matches!(read.repairs(), [Repair::TrailingEdgeCompleted { .. }]), "{:?}", read.repairs());
        assert_eq!((read.points(), read.trailing_edge()), (&coarse[..], TrailingEdge::Sharp));
        let mut text = sharp.clone();
        text[98][1] = 1e-8;
        let read = parse(&file(text)).unwrap();
        assert_eq!(read.repairs(), [Repair::TrailingEdgeClosed { gap: 1e-8 }]);
        assert_eq!(read.points()[0], read.points()[98]);
        // remarks
        let read =
            parse(&format!("title\n{}\nby hand, 12 May 2001\n28/12/2005 1.0 2.0\n", file(points.clone()))).unwrap();
        assert_eq!(read.repairs(), [Repair::RemarkIgnored { line: 102 }, Repair::RemarkIgnored { line: 103 }]);
    }

    #[test]
    fn what_is_no_section_is_refused() {
        use CoordinateError as E;
        let points = naca();
        assert!(matches!(parse("t\n0.5 0.5\n"), Err(E::TooFewPoints { found: 1, needed: 4 })));
        assert!(matches!(parse("t\n1 0\n0 0\n1 0\n"), Err(E::TooFewPoints { .. })));
        assert!(matches!(parse(&"0.5 0.5\n".repeat(50)), Err(E::TooFewPoints { found: 1, .. })));
        assert!(matches!(parse("1 0\n0.5 0\n0.2 0\n0 0\n0.5 0\n1 0\n"), Err(E::NoArea { .. })));
        // a figure of eight
        let eight = points.iter().map(|p| [p[0], p[1] * (p[0] - 0.4)]);
        assert!(matches!(parse(&file(eight)), Err(E::SelfCrossing { .. })));
        // cut off
        assert!(matches!(parse(&file(points[..80].to_vec())), Err(E::Unfinished { line: 80, .. })));
        // thrown together
        let shuffled = (0..99).map(|i| points[(i * 37) % 99]);
        assert!(parse(&file(shuffled)).is_err());
        let tiny = points.iter().map(|p| p.map(|c| c * 1e-12));
        assert!(matches!(parse(&file(tiny)), Err(E::NoArea { .. })));
        assert!(matches!(Coordinates::from_points("", &[[0.0, f64::NAN]]), Err(E::Value { line: 0, .. })));
        assert!(Coordinates::from_points("", &points).is_ok());
    }

    #[test]
    fn any_unit_and_place_will_do() {
        let points = naca();
        let moved: Vec<[f64; 2]> = points.iter().map(|p| [300.0 * p[0] - 40.0, 300.0 * p[1] + 7.0]).collect();
        let read = parse(&file(moved.clone())).unwrap();
        assert_eq!((read.points(), read.repairs()), (&moved[..], &[][..]));
        assert!((read.chord() - 300.0).abs() < 0.1);
        let section = read.normalized().unwrap().section().unwrap();
        let frame = section.chord_frame().unwrap();
        assert!(frame.origin.iter().all(|c| c.abs() < 1e-12) && (frame.chord - 1.0).abs() < 1e-12);
        assert!(section.trailing_edge_middle()[1].abs() < 1e-12);
        assert!((section.area() - read.section().unwrap().area() / 9e4).abs() < 1e-4);
    }

    #[test]
    fn fits_smooth_rounded_points() {
        let rounded = naca().into_iter().map(|p| p.map(|c| (c * 1e3).round() / 1e3));
        let read = parse(&file(rounded)).unwrap();
        let rough = read.section().unwrap();
        let smooth = read.clone().with_fit_tolerance(7e-4).unwrap().section().unwrap();
        assert!(smooth.curve().control_points().len() < rough.curve().control_points().len());
        let bends = |s: &Section| s.curvature_reversals(0.05).iter().sum::<usize>();
        assert!(bends(&smooth) < bends(&rough), "{} {}", bends(&smooth), bends(&rough));
        for p in read.points() {
            assert!(smooth.curve().closest_point(*p).unwrap().distance() < 7.1e-4);
        }
        let few = SectionDefinition::Coordinates(read.clone()).with_control_points(31).unwrap().section().unwrap();
        assert_eq!(few.curve().control_points().len(), 31);
        for n in [3, 100] {
            let error = read.clone().with_control_points(n).unwrap_err();
            assert_eq!(error, SectionError::FitControlPoints { found: n, least: 7, most: read.points().len() });
        }
        assert!(read.with_fit_tolerance(-1.0).is_err());
    }
}
