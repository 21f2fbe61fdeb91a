//! [`Section`]: the closed curve every other part of the crate works on.

use super::SectionError;
use crate::plane::distance;
use crate::scalar::Scalar;
use crate::spline::BSplineCurve;
use std::sync::Arc;

/// Whether the two surfaces meet at the trailing edge. A property of the build, never found by a tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum TrailingEdge {
    /// The first and the last control point are the same, to the bit.
    Sharp,
    /// The surfaces end apart; a straight base closes the outline.
    Blunt,
}

/// An airfoil section: one B-spline curve from the trailing edge over the upper surface to the nose and back along the
/// lower surface to the trailing edge (Selig order, counter-clockwise), parameter 0 … 1.
///
/// Lengths are in chords for sections built from a definition; files keep their own unit. Sections are linear in
/// their control points, which may carry derivatives: [`with_control_points`](Self::with_control_points) is how a
/// deformation re-enters.
///
/// ```
/// use aeroform::section::SectionDefinition;
/// let section = SectionDefinition::parse("naca2412").unwrap().section().unwrap();
/// assert_eq!(section.curve().control_points().len(), 101);
/// assert!(section.nose()[0].abs() < 1e-17);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Section<S = f64> {
    curve: BSplineCurve<S>,
    trailing_edge: TrailingEdge,
    nose: f64,
    name: Arc<str>,
}

impl<S: Scalar> Section<S> {
    /// A section from its curve; `nose` is the parameter that separates the upper from the lower surface.
    ///
    /// # Errors
    /// A nose parameter outside of the curve; a sharp trailing edge whose end control points differ.
    pub fn new(
        curve: BSplineCurve<S>,
        trailing_edge: TrailingEdge,
        nose: f64,
        name: impl Into<Arc<str>>,
    ) -> Result<Self, SectionError> {
        let (first, last) = curve.domain();
        // written so that NaN fails
        if !(first < nose && nose < last) {
            return Err(SectionError::NoseParameter { parameter: nose });
        }
        let section = Self { curve, trailing_edge, nose, name: name.into() };
        let [a, b]: [[f64; 2]; 2] = section.trailing_edge_points().map(|p| p.map(|c| c.re()));
        if trailing_edge == TrailingEdge::Sharp && a != b {
            return Err(SectionError::OpenTrailingEdge { gap: distance(a, b) });
        }
        Ok(section)
    }

    /// The curve of the outline, without the base of a blunt trailing edge.
    pub fn curve(&self) -> &BSplineCurve<S> {
        &self.curve
    }

    /// Whether the trailing edge is sharp.
    pub fn trailing_edge(&self) -> TrailingEdge {
        self.trailing_edge
    }

    /// Parameter at which the upper surface ends and the lower one begins; fixed at build.
    pub fn nose_parameter(&self) -> f64 {
        self.nose
    }

    /// Name of the section, such as "NACA 2412" or the title of its file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The point at the nose parameter. It moves with the surface; see
    /// [`leading_edge`](Self::leading_edge) for the foremost point.
    pub fn nose(&self) -> [S; 2] {
        self.curve.point_at(self.nose)
    }

    /// The upper and the lower end of the trailing edge: the first and the last control point.
    pub fn trailing_edge_points(&self) -> [[S; 2]; 2] {
        let points = self.curve.control_points();
        // a curve has at least two control points
        [points[0], points[points.len() - 1]]
    }

    /// This section under another name.
    pub fn with_name(mut self, name: impl Into<Arc<str>>) -> Self {
        self.name = name.into();
        self
    }

    /// The section with the same knots, nose parameter and trailing edge but other control points, of any scalar.
    ///
    /// # Errors
    /// A wrong number of control points, one that is not finite, or a sharp trailing edge torn open.
    pub fn with_control_points<T: Scalar>(&self, points: Vec<impl Into<[T; 2]>>) -> Result<Section<T>, SectionError> {
        Section::new(self.curve.with_control_points(points)?, self.trailing_edge, self.nose, Arc::clone(&self.name))
    }

    /// The section over `f64` whose control points are the real parts of these.
    pub fn real(&self) -> Section<f64> {
        Section {
            curve: self.curve.real(),
            trailing_edge: self.trailing_edge,
            nose: self.nose,
            name: Arc::clone(&self.name),
        }
    }

    /// `n` parameters from end to end that share every knot span evenly, so that they cluster as the knots do.
    ///
    /// With `n - 1` a multiple of the number of spans all knots are among them.
    pub fn parameters(&self, n: usize) -> Vec<f64> {
        let (first, last) = self.curve.domain();
        let mut knots = vec![first];
        knots.extend(self.curve.knots().spans().map(|(_, _, end)| end));
        let spans = knots.len() - 1;
        (0..n)
            .map(|i| {
                // the position in units of spans, split exactly into span and rest
                let scaled = i * spans;
                let steps = n.saturating_sub(1).max(1);
                let (span, rest) = (scaled / steps, scaled % steps);
                match knots.get(span + 1) {
                    Some(next) => knots[span] + (next - knots[span]) * (rest as f64 / steps as f64),
                    None => last,
                }
            })
            .collect()
    }

    /// `n` points of the curve at [`parameters`](Self::parameters), in Selig order.
    pub fn points(&self, n: usize) -> Vec<[S; 2]> {
        self.parameters(n).into_iter().map(|u| self.curve.point_at(u)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spline::KnotVector;

    fn diamond(trailing_edge: TrailingEdge, last: [f64; 2]) -> Result<Section, SectionError> {
        let knots = KnotVector::clamped_uniform(1, 5).unwrap();
        let points = vec![[1.0, 0.0], [0.5, 0.1], [0.0, 0.0], [0.5, -0.1], last];
        Section::new(BSplineCurve::new(knots, points).unwrap(), trailing_edge, 0.5, "diamond")
    }

    #[test]
    fn a_sharp_trailing_edge_must_be_closed() {
        assert!(diamond(TrailingEdge::Sharp, [1.0, 0.0]).is_ok());
        assert_eq!(
            diamond(TrailingEdge::Sharp, [1.0, -0.25]).unwrap_err(),
            SectionError::OpenTrailingEdge { gap: 0.25 }
        );
        let section = diamond(TrailingEdge::Blunt, [1.0, -0.25]).unwrap();
        assert_eq!(section.trailing_edge_points(), [[1.0, 0.0], [1.0, -0.25]]);
        assert_eq!(section.nose(), [0.0, 0.0]);
    }

    #[test]
    fn the_nose_lies_inside() {
        for parameter in [0.0, 1.0, -1.0, f64::NAN] {
            let curve = diamond(TrailingEdge::Sharp, [1.0, 0.0]).unwrap().curve().clone();
            let error = Section::new(curve, TrailingEdge::Sharp, parameter, "").unwrap_err();
            assert!(matches!(error, SectionError::NoseParameter { .. }));
        }
    }

    #[test]
    fn samples_hit_the_knots() {
        let section = diamond(TrailingEdge::Sharp, [1.0, 0.0]).unwrap();
        assert_eq!(section.parameters(5), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(section.parameters(9)[..3], [0.0, 0.125, 0.25]);
        assert_eq!(section.parameters(1), [0.0]);
        assert!(section.parameters(0).is_empty());
        assert_eq!(section.points(3), [[1.0, 0.0], [0.0, 0.0], [1.0, 0.0]]);
        assert_eq!(section.selig(), "diamond\n1 0\n0.5 0.1\n0 0\n0.5 -0.1\n1 0\n");
    }
}
