//! Lines of equal value in a region about a section.

use super::axis::{PlotAxis, nice_step};
use super::canvas::{Legend, LegendSample, Plot, PlotFrame, heading_height, left_margin, render};
use super::{SectionCurve, Stroke};

/// Lines of equal value in a region about a section, drawn to scale.
///
/// ```
/// use aeroform::report::figures::{ContourFigure, ContourLevel, ContourPatch, Stroke, contour_figure};
/// let points: Vec<Vec<[f64; 2]>> = (0..3).map(|i| (0..3).map(|j| [f64::from(i), f64::from(j)]).collect()).collect();
/// let values = (0..3).map(|i| vec![f64::from(i); 3]).collect();
/// let figure = ContourFigure {
///     title: "a slope".into(),
///     patches: vec![ContourPatch { points, values }],
///     levels: vec![ContourLevel { value: 0.5, label: "half".into(), stroke: Stroke::palette(0) }],
///     window: [[0.0, 2.0], [0.0, 2.0]],
///     ..ContourFigure::default()
/// };
/// assert!(contour_figure(&figure).contains("half"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContourFigure {
    /// Title above the plot.
    pub title: String,
    /// The values. Patches may touch each other.
    pub patches: Vec<ContourPatch>,
    /// The levels that are drawn; later ones are drawn over earlier ones.
    pub levels: Vec<ContourLevel>,
    /// Sections, drawn over the lines.
    pub curves: Vec<SectionCurve>,
    /// Dots with a name, drawn over all.
    pub marks: Vec<SectionCurve>,
    /// Ends of the horizontal and the vertical axis in chords.
    pub window: [[f64; 2]; 2],
}

/// Values at points in columns and rows.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ContourPatch {
    /// The points in chords, column by column; all columns are of one length.
    pub points: Vec<Vec<[f64; 2]>>,
    /// A value for each point.
    pub values: Vec<Vec<f64>>,
}

/// One level of a [`ContourFigure`].
#[derive(Debug, Clone, PartialEq)]
pub struct ContourLevel {
    /// Value along the line.
    pub value: f64,
    /// Name in the legend; an empty name leaves the level out of the legend.
    pub label: String,
    /// Colour, width and dashes of the line.
    pub stroke: Stroke,
}

const WIDTH: f64 = 900.0;
const RIGHT: f64 = 24.0;
const BOTTOM: f64 = 52.0;

/// The figure as SVG text.
pub fn contour_figure(figure: &ContourFigure) -> String {
    let [across, up] = figure.window;
    let ticks = 10.0;
    let mut x = PlotAxis::between(across[0], across[1], false, "x/c", ticks);
    let mut y = PlotAxis::between(up[0], up[1], false, "y/c", ticks);
    // one step for both axes: the grid is made of squares
    let step = nice_step((x.high - x.low).max(0.5 * (y.high - y.low)), ticks);
    (x.step, y.step) = (step, step);
    let left = left_margin(&y).max(left_margin(&x));
    let width = WIDTH - left - RIGHT;
    let height = width * (y.high - y.low) / (x.high - x.low);
    let legend = Legend::new(entries(figure), width);
    let top = heading_height(&figure.title, &legend);
    let frame = PlotFrame { left, right: WIDTH - RIGHT, top, bottom: top + height };
    let plot = Plot { frame, x: &x, y: &y, inverted: false };
    render(WIDTH, top + height + BOTTOM, |canvas| {
        plot.axes(canvas);
        canvas.heading(&figure.title, &legend, frame, 0.0);
        for level in &figure.levels {
            let lines = figure.patches.iter().flat_map(|patch| patch.line(level.value));
            let inside =
                |p: &[f64; 2]| (frame.left..=frame.right).contains(&p[0]) && (frame.top..=frame.bottom).contains(&p[1]);
            let pixels = lines.filter_map(|[a, b]| Some([plot.pixel(a)?, plot.pixel(b)?]));
            let seen: Vec<_> = pixels.filter(|segment| segment.iter().all(inside)).collect();
            canvas.segments(&seen, level.stroke);
        }
        figure.curves.iter().for_each(|curve| plot.curve(canvas, &curve.points, curve.stroke));
        figure.marks.iter().for_each(|mark| plot.dots(canvas, &mark.points, 4.5, mark.stroke.color));
    })
}

fn entries(figure: &ContourFigure) -> Vec<(LegendSample, String)> {
    let levels = figure.levels.iter().map(|level| (LegendSample::Line(level.stroke), level.label.clone()));
    let curves = figure.curves.iter().map(|curve| (LegendSample::Line(curve.stroke), curve.label.clone()));
    let marks = figure.marks.iter().map(|mark| (LegendSample::Dot(mark.stroke.color), mark.label.clone()));
    levels.chain(curves).chain(marks).collect()
}

impl ContourPatch {
    /// The pieces of the line along which the values, straight along the sides of triangles, are equal to `value`. A
    /// triangle with a value that is not finite has none.
    fn line(&self, value: f64) -> Vec<[[f64; 2]; 2]> {
        let mut pieces = Vec::new();
        for (points, values) in self.points.windows(2).zip(self.values.windows(2)) {
            for j in 1..points[0].len().min(points[1].len()) {
                let corner = |i: usize, k: usize| (points[i][k], values[i][k] - value);
                let square = [corner(0, j - 1), corner(1, j - 1), corner(1, j), corner(0, j)];
                pieces.extend(crossing([square[0], square[1], square[2]]));
                pieces.extend(crossing([square[0], square[2], square[3]]));
            }
        }
        pieces
    }
}

/// The piece of a triangle along which a linear function, given at the corners, is zero.
fn crossing(corners: [([f64; 2], f64); 3]) -> Option<[[f64; 2]; 2]> {
    let side = |a: usize, b: usize| {
        let ((p, u), (q, v)) = (corners[a], corners[b]);
        let share = u / (u - v);
        ((u < 0.0) != (v < 0.0)).then(|| [0, 1].map(|c| p[c] + share * (q[c] - p[c])))
    };
    if !corners.iter().all(|(_, v)| v.is_finite()) {
        return None;
    }
    let mut ends = [side(0, 1), side(1, 2), side(2, 0)].into_iter().flatten();
    Some([ends.next()?, ends.next()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::figures::Color;

    /// Distances from a point, on a grid.
    fn distances() -> ContourPatch {
        let column = |i: i32| (0..=40).map(|j| [0.1 * f64::from(i), 0.1 * f64::from(j)]).collect::<Vec<_>>();
        let points: Vec<Vec<[f64; 2]>> = (0..=40).map(column).collect();
        let values = points.iter().map(|c| c.iter().map(|p| (p[0] - 2.0).hypot(p[1] - 2.0)).collect()).collect();
        ContourPatch { points, values }
    }

    #[test]
    fn lines_of_equal_distance_are_circles() {
        let pieces = distances().line(1.3);
        let mut length = 0.0;
        for [a, b] in &pieces {
            assert!([a, b].iter().all(|p| ((p[0] - 2.0).hypot(p[1] - 2.0) - 1.3).abs() < 2e-3));
            length += (a[0] - b[0]).hypot(a[1] - b[1]);
        }
        assert!((length / (std::f64::consts::TAU * 1.3) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn values_that_are_missing_leave_a_gap() {
        let mut patch = distances();
        let whole = patch.line(1.3).len();
        patch.values[33][20] = f64::NAN;
        let rest = patch.line(1.3).len();
        assert!(rest < whole && rest + 8 > whole);
    }

    #[test]
    fn lines_stay_inside_of_the_window() {
        let stroke = Stroke { color: Color(1, 2, 3), width: 1.0, dashed: false };
        let figure = ContourFigure {
            patches: vec![distances()],
            levels: vec![ContourLevel { value: 1.0, label: "one".into(), stroke }],
            window: [[2.0, 4.0], [0.0, 4.0]],
            ..ContourFigure::default()
        };
        let svg = contour_figure(&figure);
        let path = svg.split("<path").nth(1).unwrap();
        let numbers = path.split('"').find(|text| text.starts_with('M')).unwrap();
        let across = |text: &str| text.split(',').next().unwrap().parse::<f64>().unwrap();
        let least = numbers.split(['M', 'L']).skip(1).map(across).fold(f64::INFINITY, f64::min);
        // the left half of the circle is beyond the frame, whose left edge is at the margin of the labels
        assert!(least > 40.0 && least < 140.0, "{least}");
        assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"));
    }
}
