//! Sections from lists of points: files of Selig, Lednicer and others.

mod columns;
mod curve;
mod deviation;
mod elements;
mod encoding;
mod line;
mod listing;
mod number;
mod orientation;
mod outline;
mod planning;
mod point;
mod repair;
mod rounding;
mod strays;
mod wobbles;

pub use curve::Deviation;
pub use repair::Repair;

use super::measures::{farthest_parameter, outline_crossing};
use super::{CoordinateError, Section, SectionError, TrailingEdge};
use crate::plane::{distance, dot, middle};
use crate::scalar::Scalar;
use crate::spline::BSplineCurve;
use curve::{Fit, Plan, extent, lines, real};
use listing::Listing;
use outline::{Outline, assemble};
use planning::plan;
use point::Point;
use repair::record;
use std::io::Read;
use std::path::Path;
use strays::gaps;

/// Points of a section in Selig order, read from a file or given, with a record of what was mended.
///
/// *Selig*: an optional title, then the outline, a point `x y` per line, from the trailing edge round the nose and
/// back. *Lednicer*: title, a line with the numbers of upper and lower points, then both surfaces from nose to tail.
/// Also read: surfaces in either order or direction, two surfaces without a header, one count per surface, files of
/// OpenVSP (`.af`), AeroDyn and OpenFAST, MSES and ISES (with its domain, and `999. 999.` between elements), tables of
/// three columns one of which is constant or counts the points, or which are x and the ordinates of both sides, commas,
/// semicolons or tabs, decimal commas, quotation marks, comments (`#`, `!`, `%`), blank lines, any end of line, Fortran
/// exponents, UTF-8, UTF-16 or Windows text, remarks at the end.
///
/// Points are kept as they stand, in their own unit, place and angle ([`chord`](Self::chord) tells); see
/// [`normalized`](Self::normalized). Only a section with its nose to the right is mirrored left to right (what is above
/// stays above) or, where its direction and camber tell that it was turned by 180 degrees, turned back; and one that
/// stands upright and runs clockwise has x and y exchanged. Everything of this kind is
/// recorded in [`repairs`](Self::repairs), and what cannot be mended without guessing is refused with the line.
///
/// ```
/// use aeroform::section::{Coordinates, Repair};
/// let file = b"diamond\n1 0\n0.5 -0.06\n0 0\n0.5 0.06\n1 0\n";
/// let coordinates = Coordinates::parse(file).unwrap();
/// assert_eq!(coordinates.name(), "diamond");
/// assert!(coordinates.repairs().contains(&Repair::Reversed));
/// let section = coordinates.section().unwrap();
/// // the corners are rounded a little
/// assert!((section.area() - 0.06).abs() < 1e-3 * 0.06);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinates<S = f64> {
    name: String,
    points: Vec<[S; 2]>,
    /// Lines of the points.
    lines: Vec<usize>,
    trailing_edge: TrailingEdge,
    /// Repairs of reading, and then those of the curve.
    repairs: Vec<Repair>,
    /// Number of repairs of reading.
    read: usize,
    /// Unit of the last digit of the points, zero where it is not known.
    step: f64,
    plan: Box<Result<Plan, SectionError>>,
}

/// Distance of the curve from the polygon, as a share of the extent, that is reported.
const REPORTED: f64 = 0.005;

impl Coordinates {
    /// Reads a coordinate file; a file without a title is called by its name.
    ///
    /// # Errors
    /// A file that cannot be read or holds no section, or several elements.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SectionError> {
        Self::read_element(path, None)
    }

    /// Reads one element of a coordinate file that may hold several, counted from one.
    ///
    /// # Errors
    /// As [`read`](Self::read), and an element that is not there.
    pub fn read_element(path: impl AsRef<Path>, element: Option<usize>) -> Result<Self, SectionError> {
        let path = path.as_ref();
        let failed = |error: std::io::Error| SectionError::Read { path: path.into(), kind: error.kind() };
        let file = std::fs::File::open(path).map_err(failed)?;
        let mut bytes = Vec::new();
        // one byte more than is allowed is enough to know
        file.take(encoding::LARGEST_FILE as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
        let mut coordinates =
            Self::parse_element(&bytes, element).map_err(|error| SectionError::File { path: path.into(), error })?;
        if coordinates.name.is_empty() {
            coordinates.name = path.file_stem().map(|stem| stem.to_string_lossy().into()).unwrap_or_default();
        }
        Ok(coordinates)
    }

    /// The section in the bytes of a coordinate file.
    ///
    /// # Errors
    /// Bytes that hold no section, or several elements; the error says what is wrong, and in which line.
    pub fn parse(bytes: &[u8]) -> Result<Self, CoordinateError> {
        Self::parse_element(bytes, None)
    }

    /// The section in the bytes of a coordinate file that may hold several elements, counted from one.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), and an element that is not there.
    pub fn parse_element(bytes: &[u8], element: Option<usize>) -> Result<Self, CoordinateError> {
        let listing = listing::parse(bytes, element)?;
        let given: Vec<[f64; 2]> = listing.points.iter().map(|p| p.xy).collect();
        Self::mended(listing, &given)
    }
}

impl<S: Scalar> Coordinates<S> {
    /// The section with the given outline (arrays, or `nalgebra` points or vectors, of any scalar); mended as a file
    /// would be, but not smoothed, since points in memory have no last digit.
    ///
    /// # Errors
    /// As [`parse`](Coordinates::parse), and more points than are read. Where an error or a repair names a line, it
    /// means the number of the point, counted from one.
    pub fn from_points(name: &str, points: &[impl Into<[S; 2]> + Copy]) -> Result<Self, CoordinateError> {
        let given: Vec<[S; 2]> = points.iter().map(|&p| p.into()).collect();
        for (line, point) in (1..).zip(&given) {
            if let Some(value) = point.iter().map(|c| c.re()).find(|c| !listing::usable(*c)) {
                return Err(CoordinateError::Value { line, value });
            }
        }
        if given.len() > listing::MOST {
            return Err(CoordinateError::TooManyPoints { found: given.len(), most: listing::MOST });
        }
        let points = (1..).zip(&given).map(|(line, p)| Point { xy: p.map(|c| c.re()), line, source: 0 }).collect();
        Self::mended(Listing { title: Some(name.into()), points, ..Listing::default() }, &given)
    }

    /// Mends a listing by its real parts; its points in the order of the file are `given`.
    fn mended(mut listing: Listing, given: &[[S; 2]]) -> Result<Self, CoordinateError> {
        let name = listing.title.take().unwrap_or_default();
        let step = listing.step;
        for (source, point) in listing.points.iter_mut().enumerate() {
            point.source = source;
        }
        let Outline { points, trailing_edge, repairs, map } = assemble(listing)?;
        // a closed trailing edge lies at a mean of two points, everything else where it was given
        let derivatives = |source: usize| {
            let own = given[source].map(|c| c - c.re());
            map.map(|row| dot(row.map(S::from), own))
        };
        let n = points.len();
        let lines = lines(&points);
        let points = (0..n).map(|i| {
            let own = derivatives(points[i].source);
            let own = if trailing_edge == TrailingEdge::Sharp && (i == 0 || i + 1 == n) {
                middle(derivatives(points[0].source), derivatives(points[n - 1].source))
            } else {
                own
            };
            [0, 1].map(|d| own[d] + points[i].xy[d])
        });
        let points: Vec<[S; 2]> = points.collect();
        let plan = Box::new(plan(&real(&points), Fit::Interpolate, step));
        let read = repairs.len();
        let mut coordinates = Self { name, points, lines, trailing_edge, repairs, read, step, plan };
        coordinates.report_curve();
        Ok(coordinates)
    }

    /// These points with the curve made in another way.
    fn planned(mut self, fit: Fit) -> Self {
        self.plan = Box::new(plan(&real(&self.points), fit, self.step));
        self.report_curve();
        self
    }

    /// Records what a user must know of the curve.
    fn report_curve(&mut self) {
        self.repairs.truncate(self.read);
        let points = real(&self.points);
        let extent = extent(&points);
        let Ok(plan) = &*self.plan else { return };
        for gap in gaps(&points, extent).into_iter().filter(|gap| !plan.straight.contains(gap)) {
            let (line, distance) = (self.lines.get(gap).copied().unwrap_or(0), distance(points[gap], points[gap + 1]));
            record(&mut self.repairs, Repair::GapSuspected { count: 1, line, distance });
        }
        let line = |index: usize| self.lines.get(index).copied().unwrap_or(0);
        let Deviation { points: off, points_at, polygon, polygon_at } = plan.deviation;
        let corner = plan.corners.first().map(|&at| plan.places[at].0);
        if let Some(first) = plan.straight.first().copied().into_iter().chain(corner).min() {
            let (sides, corners) = (plan.straight.len(), plan.corners.len());
            self.repairs.push(Repair::KeptStraight { sides, corners, line: line(first) });
        }
        if plan.drawn.is_some() {
            self.repairs.push(Repair::DrawnToPolygon { excess: plan.excess });
        } else if plan.leaves_area() {
            self.repairs.push(Repair::FewPoints { excess: plan.excess });
        }
        match (plan.fit, plan.smoothing) {
            (Fit::Interpolate, None) => {}
            (Fit::Interpolate, Some(_)) => {
                self.repairs.push(Repair::Smoothed { step: self.step, distance: off, line: line(points_at) });
            }
            _ => {
                let control_points = plan.control_points(&points).unwrap_or(0);
                self.repairs.push(Repair::Fitted { control_points, distance: off, line: line(points_at) });
            }
        }
        if polygon > REPORTED * extent {
            self.repairs.push(Repair::LeavesPolygon { distance: polygon, line: line(polygon_at) });
        }
    }

    /// Name of the section: the title of its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The points from the upper to the lower trailing edge; a sharp trailing edge stands at both ends.
    pub fn points(&self) -> &[[S; 2]] {
        &self.points
    }

    /// Everything that a user must know of the reading: what was mended, in the order in which it was done, and then
    /// what is unusual about the curve; one entry per kind.
    pub fn repairs(&self) -> &[Repair] {
        &self.repairs
    }

    /// The kind of trailing edge: sharp where the outline is closed, blunt where its two ends lie apart.
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

    /// How far the curve of [`section`](Self::section) is from the points and from the straight lines between them, in
    /// the unit of the file.
    ///
    /// # Errors
    /// A curve that cannot be made.
    pub fn deviation(&self) -> Result<Deviation, SectionError> {
        Ok(self.plan()?.deviation)
    }

    /// The points moved, turned and scaled so that the nose of the curve is the origin and the middle of the trailing
    /// edge is (1, 0), with the transform among the [`repairs`](Self::repairs).
    ///
    /// # Errors
    /// As [`section`](Self::section).
    pub fn normalized(&self) -> Result<Self, SectionError> {
        let frame = self.section()?.chord_frame()?;
        let points: Vec<[S; 2]> = self.points.iter().map(|&p| frame.coordinates(p).map(|c| c / frame.chord)).collect();
        let (origin, [cosine, sine], scale) =
            (frame.origin.map(|c| c.re()), frame.axis.map(|c| c.re()), frame.chord.re().recip());
        let mut normalized = Self { points, step: self.step * scale, ..self.clone() };
        normalized.repairs.truncate(self.read);
        normalized.repairs.push(Repair::Normalized { shift: origin.map(|c| -c), turn: (-sine).atan2(cosine), scale });
        normalized.read = normalized.repairs.len();
        let fit = match self.plan()?.fit {
            Fit::Tolerance(tolerance) => Fit::Tolerance(tolerance * scale),
            other => other,
        };
        Ok(normalized.planned(fit))
    }

    /// These points with a curve that passes them within `tolerance` (in the unit of the file) with as few knots as
    /// needed, instead of through them. This smooths rounded coordinates.
    ///
    /// # Errors
    /// A tolerance that is not a positive number.
    pub fn with_fit_tolerance(self, tolerance: f64) -> Result<Self, SectionError> {
        super::naca::check_range("fit tolerance", tolerance, 0.0, f64::INFINITY)?;
        Ok(self.planned(Fit::Tolerance(tolerance)))
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
        Ok(self.planned(Fit::ControlPoints(control_points)))
    }

    /// The section: a C2 cubic spline through the points (natural ends, chord-length parameters), or near them if a fit
    /// was asked for or the points are rounded more coarsely than they are spaced.
    ///
    /// Sides far longer than their neighbours that such a curve would leave are kept straight, with corners (knots of
    /// multiplicity three) where the outline turns sharply at their ends. The nose parameter is that of the point
    /// farthest from the trailing edge.
    ///
    /// Parameters and knots follow from the real parts of the points and are plain numbers, so that the control points
    /// are linear in the points.
    ///
    /// # Errors
    /// A curve that crosses itself between the points, a fit that is not possible or far from the points.
    pub fn section(&self) -> Result<Section<S>, SectionError> {
        let plan = self.plan()?;
        plan.check(&real(&self.points), &self.lines)?;
        let curve = plan.curve(&self.points)?;
        let real = curve.real();
        if let Some(crossing) = outline_crossing(&real) {
            let [x, y] = crossing.point;
            return Err(CoordinateError::CurveCrossing { x, y }.into());
        }
        let nose = self.nose_parameter(plan, &real)?;
        let section = Section::new(curve, self.trailing_edge, nose, self.name.as_str())?;
        let area = section.area().re();
        if area > 0.0 { Ok(section) } else { Err(CoordinateError::NoArea { chord: self.chord().re(), area }.into()) }
    }

    /// Parameter of the point of the curve farthest from the trailing edge; at a corner there is no extreme to search.
    fn nose_parameter(&self, plan: &Plan, curve: &BSplineCurve<f64>) -> Result<f64, SectionError> {
        let tail = self.tail().map(|c| c.re());
        let from_tail = |u: f64| distance(curve.point_at(u), tail);
        let corners = plan.corners.iter().map(|&at| plan.parameters[at]);
        let corner = corners.max_by(|&a, &b| from_tail(a).total_cmp(&from_tail(b)));
        match (farthest_parameter(curve, tail), corner) {
            (Ok(smooth), Some(corner)) if from_tail(corner) >= from_tail(smooth) => Ok(corner),
            (Err(_), Some(corner)) => Ok(corner),
            (found, _) => found,
        }
    }

    fn plan(&self) -> Result<&Plan, SectionError> {
        self.plan.as_ref().as_ref().map_err(Clone::clone)
    }

    /// Middle of the trailing edge; there are points, or nothing was assembled.
    fn tail(&self) -> [S; 2] {
        middle(self.points[0], self.points[self.points.len() - 1])
    }
}

#[cfg(test)]
mod hostile_tests;
#[cfg(test)]
mod tests;
