//! Sections with equal axes.

use super::axis::{PlotAxis, nice_step};
use super::canvas::{Legend, LegendSample, Plot, PlotFrame, heading_height, left_margin, render};
use super::{Color, Stroke};

/// A section, what it is compared with, and its box, drawn to scale (as the paper's figures 14 and 15).
///
/// ```
/// use aeroform::report::figures::{SectionCurve, SectionFigure, Stroke, section_figure};
/// let circle = (0..=100).map(|i| f64::from(i) * 0.0628318).map(|t| [0.5 + 0.5 * t.cos(), 0.5 * t.sin()]).collect();
/// let figure = SectionFigure {
///     title: "A circle in its box".into(),
///     curves: vec![SectionCurve { label: "circle".into(), points: circle, stroke: Stroke::SECTION }],
///     lattice: vec![vec![[0.0, -0.6], [1.0, -0.6], [1.0, 0.6], [0.0, 0.6], [0.0, -0.6]]],
///     control_points: vec![[0.0, -0.6], [1.0, -0.6], [1.0, 0.6], [0.0, 0.6]],
/// };
/// assert!(section_figure(&figure).starts_with("<svg"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SectionFigure {
    /// Title above the plot.
    pub title: String,
    /// The sections; later ones are drawn over earlier ones.
    pub curves: Vec<SectionCurve>,
    /// Lines of the box, each a polyline in chords.
    pub lattice: Vec<Vec<[f64; 2]>>,
    /// Control points of the box in chords.
    pub control_points: Vec<[f64; 2]>,
}

/// A section in a [`SectionFigure`].
#[derive(Debug, Clone, PartialEq)]
pub struct SectionCurve {
    /// Name in the legend; an empty name leaves the section out of the legend.
    pub label: String,
    /// Points in chords. The polyline is drawn as it is, so take enough of them.
    pub points: Vec<[f64; 2]>,
    /// Colour, width and dashes of the line.
    pub stroke: Stroke,
}

const BLACK: Color = Color(0, 0, 0);
const WIDTH: f64 = 900.0;
const RIGHT: f64 = 24.0;
const BOTTOM: f64 = 52.0;

/// The figure as SVG text.
pub fn section_figure(figure: &SectionFigure) -> String {
    figure.to_svg()
}

impl SectionFigure {
    fn to_svg(&self) -> String {
        let points = || {
            let curves = self.curves.iter().flat_map(|c| &c.points);
            curves.chain(self.lattice.iter().flatten()).chain(&self.control_points)
        };
        let mut x = PlotAxis::around(points().map(|p| p[0]), false, "x/c", 8.0);
        let mut y = PlotAxis::around(points().map(|p| p[1]), false, "y/c", 8.0);
        // one step for both axes: the grid is made of squares
        x.step = nice_step((x.high - x.low).max(0.5 * (y.high - y.low)), 8.0);
        y.step = x.step;
        let left = left_margin(&y).max(left_margin(&x));
        let width = WIDTH - left - RIGHT;
        let height = (width * (y.high - y.low) / (x.high - x.low)).clamp(190.0, 700.0);
        equalise(&mut x, &mut y, width / height);
        let legend = Legend::new(self.legend(), width);
        let top = heading_height(&self.title, &legend);
        let frame = PlotFrame { left, right: WIDTH - RIGHT, top, bottom: top + height };
        let plot = Plot { frame, x: &x, y: &y, inverted: false };
        render(WIDTH, top + height + BOTTOM, |canvas| {
            plot.axes(canvas);
            canvas.heading(&self.title, &legend, frame, 0.0);
            self.lattice.iter().for_each(|line| plot.curve(canvas, line, Stroke::BOX));
            self.curves.iter().for_each(|curve| plot.curve(canvas, &curve.points, curve.stroke));
            plot.dots(canvas, &self.control_points, 3.5, BLACK);
        })
    }

    fn legend(&self) -> Vec<(LegendSample, String)> {
        let curves = self.curves.iter().map(|curve| (LegendSample::Line(curve.stroke), curve.label.clone()));
        let lattice = (!self.lattice.is_empty()).then(|| (LegendSample::Line(Stroke::BOX), "box".to_owned()));
        let dots = (!self.control_points.is_empty()).then(|| (LegendSample::Dot(BLACK), "control points".to_owned()));
        curves.chain(lattice).chain(dots).collect()
    }
}

/// Widens one of the axes so that their spans have the ratio `aspect`.
fn equalise(x: &mut PlotAxis, y: &mut PlotAxis, aspect: f64) {
    let widen = |axis: &mut PlotAxis, span: f64| {
        let extra = 0.5 * (span - (axis.high - axis.low));
        (axis.low, axis.high) = (axis.low - extra, axis.high + extra);
    };
    let (across, up) = (x.high - x.low, y.high - y.low);
    if across < aspect * up { widen(x, aspect * up) } else { widen(y, across / aspect) }
}

#[cfg(test)]
mod tests {
    use super::super::canvas::tests::{polylines, texts};
    use super::*;

    fn circle(n: usize) -> Vec<[f64; 2]> {
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        (0..=n).map(|i| [0.5 * angle(i).cos(), 0.5 * angle(i).sin()]).collect()
    }

    fn span(points: &[[f64; 2]], axis: usize) -> f64 {
        let values = || points.iter().map(|p| p[axis]);
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    }

    #[test]
    fn axes_are_equal() {
        // a flat, a tall and a balanced picture: circles stay circles
        for extra in [[3.0, 0.0], [0.0, 4.0], [0.0, 0.0]] {
            let stroke = Stroke { color: Color(1, 2, 3), width: 1.0, dashed: false };
            let figure = SectionFigure {
                curves: vec![SectionCurve { label: "circle".into(), points: circle(400), stroke }],
                lattice: vec![vec![[-0.5, -0.5], extra]],
                ..SectionFigure::default()
            };
            let svg = figure.to_svg();
            let drawn = polylines(&svg, "#010203").into_iter().max_by_key(Vec::len).unwrap();
            let (across, up) = (span(&drawn, 0), span(&drawn, 1));
            assert!((across - up).abs() <= 0.2 && across > 90.0, "{across} × {up}");
        }
    }

    #[test]
    fn curves_have_no_kinks() {
        let stroke = Stroke { color: Color(1, 2, 3), width: 1.0, dashed: false };
        let curve = SectionCurve { label: String::new(), points: circle(200), stroke };
        let svg = SectionFigure { curves: vec![curve], ..SectionFigure::default() }.to_svg();
        let drawn = polylines(&svg, "#010203").pop().unwrap();
        assert_eq!(drawn.len(), 201);
        // each corner turns by 1.8 degrees, give or take the rounding of three points by 0.007 on chords of 10
        for p in drawn.windows(3) {
            let heading = |a: [f64; 2], b: [f64; 2]| (b[1] - a[1]).atan2(b[0] - a[0]).to_degrees();
            let turn = (heading(p[1], p[2]) - heading(p[0], p[1]) + 540.0).rem_euclid(360.0) - 180.0;
            assert!((turn + 1.8).abs() < 0.2, "{turn}");
        }
    }

    #[test]
    fn everything_is_named_and_escaped() {
        let figure = SectionFigure {
            title: "a < b & \"c\"".into(),
            curves: vec![
                SectionCurve { label: "target".into(), points: circle(9), stroke: Stroke::TARGET },
                SectionCurve { label: String::new(), points: vec![[f64::NAN, 0.0]], stroke: Stroke::INITIAL },
            ],
            lattice: vec![vec![[-1.0, 0.0], [1.0, 0.0]]],
            control_points: vec![[-1.0, 0.0], [f64::INFINITY, 0.0]],
        };
        let svg = figure.to_svg();
        let texts = texts(&svg);
        for text in ["a &lt; b &amp; &quot;c&quot;", "target", "box", "control points", "x/c", "y/c"] {
            assert!(texts.iter().any(|t| t == text), "{text} in {texts:?}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert!(SectionFigure::default().to_svg().ends_with("</svg>\n"));
    }
}
