//! Curves over two axes.

use super::axis::PlotAxis;
use super::canvas::{
    Anchor, Canvas, LABEL_SIZE, Legend, LegendSample, Plot, PlotFrame, TICK_SIZE, heading_height, left_margin, render,
    text_width,
};
use super::{Color, FigureError, Stroke};

/// Curves over two axes: pressures, polars, anything.
///
/// ```
/// use aeroform::report::figures::{LineFigure, Series, Stroke, line_figure};
/// let figure = LineFigure {
///     x_label: "x/c".into(),
///     y_label: "pressure coefficient".into(),
///     series: vec![Series {
///         label: "upper".into(),
///         points: vec![[0.0, 1.0], [0.1, -1.2], [1.0, 0.2]],
///         stroke: Stroke::palette(0),
///         dots: false,
///     }],
///     inverted_y: true,
///     ..LineFigure::default()
/// };
/// assert!(line_figure(&figure).unwrap().contains("pressure coefficient"));
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LineFigure {
    /// Title above the plot.
    pub title: String,
    /// Name of the horizontal axis.
    pub x_label: String,
    /// Name of the vertical axis.
    pub y_label: String,
    /// The curves; later ones are drawn over earlier ones.
    pub series: Vec<Series>,
    /// Whether the vertical axis grows downwards, as is usual for pressure coefficients.
    pub inverted_y: bool,
    /// Whether the vertical axis is logarithmic.
    pub log_y: bool,
    /// Vertical lines with a name.
    pub annotations: Vec<Annotation>,
}

/// A curve in a [`LineFigure`].
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; an empty name leaves the curve out of the legend.
    pub label: String,
    /// Points of the curve.
    pub points: Vec<[f64; 2]>,
    /// Colour, width and dashes of the line; a width of 0 draws none.
    pub stroke: Stroke,
    /// Whether each point has a dot.
    pub dots: bool,
}

/// A vertical line at `x`, with a name written along it.
#[derive(Debug, Clone, PartialEq)]
pub struct Annotation {
    /// Position on the horizontal axis.
    pub x: f64,
    /// Text along the line.
    pub label: String,
}

const WIDTH: f64 = 820.0;
const HEIGHT: f64 = 460.0;
const RIGHT: f64 = 24.0;
pub(super) const BOTTOM: f64 = 52.0;
const NAME_ROW: f64 = 17.0;
const ANNOTATION: Stroke = Stroke { color: Color(110, 110, 110), width: 1.0, dashed: true };

/// The figure as SVG text.
///
/// # Errors
/// The backend fails.
pub fn line_figure(figure: &LineFigure) -> Result<String, FigureError> {
    figure.to_svg()
}

impl LineFigure {
    fn to_svg(&self) -> Result<String, FigureError> {
        stack(&[(self, HEIGHT)])
    }

    fn points(&self) -> impl Iterator<Item = &[f64; 2]> {
        self.series.iter().flat_map(|s| &s.points)
    }

    fn x_axis(&self) -> PlotAxis {
        let values = self.points().map(|p| p[0]).chain(self.annotations.iter().map(|a| a.x));
        PlotAxis::around(values, false, &self.x_label, 9.0)
    }

    fn y_axis(&self, height: f64) -> PlotAxis {
        PlotAxis::around(self.points().map(|p| p[1]), self.log_y, &self.y_label, (height / 45.0).clamp(2.0, 10.0))
    }

    fn legend(&self, width: f64) -> Legend {
        let entries = self.series.iter().map(|s| {
            let sample = match (s.dots, s.stroke.width > 0.0) {
                (true, true) => LegendSample::Dotted(s.stroke),
                (true, false) => LegendSample::Dot(s.stroke.color.rgb()),
                (false, _) => LegendSample::Line(s.stroke),
            };
            (sample, s.label.clone())
        });
        Legend::new(entries, width)
    }

    /// The row above the plot in which the name of each annotation finds room, 0 the lowest.
    fn annotation_rows(&self, x: &PlotAxis, width: f64) -> Vec<usize> {
        // where the names in each row are: from, to
        let mut rows: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut place = |annotation: &Annotation| {
            let length = text_width(&annotation.label, TICK_SIZE) + 10.0;
            let middle = x.share(annotation.x).unwrap_or(0.0) * width;
            let from = (middle - 0.5 * length).min(width - length).max(0.0);
            let taken = |row: &Vec<(f64, f64)>| row.iter().any(|&(a, b)| from <= b && from + length >= a);
            // above every name it would run into, so that its line crosses none either
            let row = rows.iter().rposition(taken).map_or(0, |r| r + 1);
            if row == rows.len() {
                rows.push(Vec::new());
            }
            rows[row].push((from, from + length));
            row
        };
        self.annotations.iter().map(&mut place).collect()
    }

    /// Height of the rows of names.
    fn annotation_height(&self, x: &PlotAxis, width: f64) -> f64 {
        self.annotation_rows(x, width).iter().map(|row| NAME_ROW * (row + 1) as f64).fold(0.0, f64::max)
    }

    fn draw(&self, canvas: &Canvas<'_, '_>, plot: &Plot<'_>) -> Result<(), FigureError> {
        plot.axes(canvas)?;
        let PlotFrame { left, right, top, bottom } = plot.frame;
        for (annotation, row) in self.annotations.iter().zip(self.annotation_rows(plot.x, right - left)) {
            let Some(share) = plot.x.share(annotation.x) else { continue };
            let x = left + share * (right - left);
            let y = top - 9.0 - NAME_ROW * row as f64;
            canvas.line(&[[x, bottom], [x, y + 8.0]], ANNOTATION)?;
            let half = 0.5 * text_width(&annotation.label, TICK_SIZE);
            canvas.text([x.min(right - half).max(left + half), y], &annotation.label, TICK_SIZE, Anchor::Centre)?;
        }
        for series in &self.series {
            if series.stroke.width > 0.0 {
                plot.curve(canvas, &series.points, series.stroke)?;
            }
            if series.dots {
                plot.dots(canvas, &series.points, 2.6, series.stroke.color.rgb())?;
            }
        }
        Ok(())
    }
}

/// Figures one below the other, each with the height of its plot, over one horizontal axis.
pub(super) fn stack(figures: &[(&LineFigure, f64)]) -> Result<String, FigureError> {
    let axes: Vec<(PlotAxis, PlotAxis)> = figures.iter().map(|(f, height)| (f.x_axis(), f.y_axis(*height))).collect();
    let left = axes.iter().map(|(_, y)| left_margin(y)).fold(LABEL_SIZE, f64::max);
    let width = WIDTH - left - RIGHT;
    let legends: Vec<Legend> = figures.iter().map(|(f, _)| f.legend(width)).collect();
    let heads: Vec<f64> = figures
        .iter()
        .zip(&axes)
        .zip(&legends)
        .map(|(((f, _), (x, _)), legend)| heading_height(&f.title, legend) + f.annotation_height(x, width))
        .collect();
    let height = figures.iter().zip(&heads).map(|((_, height), head)| head + height + BOTTOM).sum();
    render(WIDTH, height, |canvas| {
        let mut top = 0.0;
        for ((((figure, height), (x, y)), legend), head) in figures.iter().zip(&axes).zip(&legends).zip(&heads) {
            let inner = top + head;
            let frame = PlotFrame { left, right: WIDTH - RIGHT, top: inner, bottom: inner + height };
            canvas.heading(&figure.title, legend, frame, top)?;
            figure.draw(canvas, &Plot { frame, x, y, inverted: figure.inverted_y })?;
            top = frame.bottom + BOTTOM;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::super::canvas::tests::{polylines, texts};
    use super::*;

    fn figure(points: Vec<[f64; 2]>) -> LineFigure {
        let stroke = Stroke { color: Color(1, 2, 3), width: 1.0, dashed: false };
        LineFigure {
            series: vec![Series { label: String::new(), points, stroke, dots: false }],
            ..LineFigure::default()
        }
    }

    #[test]
    fn the_vertical_axis_turns_over() {
        let points = vec![[0.0, 0.0], [1.0, 1.0]];
        let upright = polylines(&figure(points.clone()).to_svg().unwrap(), "#010203");
        let inverted = LineFigure { inverted_y: true, ..figure(points) }.to_svg().unwrap();
        let inverted = polylines(&inverted, "#010203");
        assert!(upright[0][0][1] > upright[0][1][1] && inverted[0][0][1] < inverted[0][1][1]);
        assert_eq!(upright[0][0][0], inverted[0][0][0]);
    }

    #[test]
    fn numbers_that_cannot_be_shown_leave_gaps() {
        let points = vec![[0.0, 1e-3], [1.0, 1e-2], [2.0, 0.0], [3.0, 1e-1], [4.0, 1.0], [5.0, f64::NAN], [6.0, 1.0]];
        let svg = LineFigure { log_y: true, ..figure(points) }.to_svg().unwrap();
        let drawn = polylines(&svg, "#010203");
        assert_eq!(drawn.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        // a decade is a decade
        let rise = |line: &[[f64; 2]]| line[0][1] - line[1][1];
        assert!((rise(&drawn[0]) - rise(&drawn[1])).abs() <= 1.0);
        assert!(texts(&svg).contains(&"10⁻²".to_owned()));
        for points in [vec![], vec![[f64::NAN; 2]], vec![[1.0, -1.0]], vec![[f64::MAX, f64::MIN], [f64::MIN, f64::MAX]]]
        {
            for log_y in [false, true] {
                let svg = LineFigure { log_y, ..figure(points.clone()) }.to_svg().unwrap();
                assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"));
            }
        }
    }

    #[test]
    fn names_of_annotations_do_not_overlap() {
        let mut figure = figure(vec![[0.0, 0.0], [1.0, 1.0]]);
        let name = |x: f64| Annotation { x, label: "transition".into() };
        figure.annotations = [0.5, 0.52, 0.9, 0.48, 1.0, f64::NAN].map(name).into();
        let axis = figure.x_axis();
        assert_eq!(figure.annotation_rows(&axis, 700.0), [0, 1, 0, 2, 1, 0]);
        let svg = figure.to_svg().unwrap();
        assert_eq!(texts(&svg).iter().filter(|t| *t == "transition").count(), 5);
    }
}
