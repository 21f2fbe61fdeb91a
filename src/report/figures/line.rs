//! Curves over two axes.

use super::axis::PlotAxis;
use super::canvas::{
    Anchor, Canvas, LABEL_SIZE, Legend, LegendSample, Plot, PlotFrame, TICK_SIZE, heading_height, left_margin, render,
    text_width,
};
use super::{Color, Stroke};

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
/// assert!(line_figure(&figure).contains("pressure coefficient"));
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
    /// Horizontal lines with a name; the axis is not stretched for them.
    pub levels: Vec<Annotation>,
    /// Ends of the vertical axis, where it is not to hold all points; dots beyond it are shown as triangles at its
    /// edge.
    pub y_range: Option<[f64; 2]>,
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

/// A line across a plot, with a name.
#[derive(Debug, Clone, PartialEq)]
pub struct Annotation {
    /// Position on the axis that the line crosses.
    pub at: f64,
    /// Text at the line.
    pub label: String,
}

const WIDTH: f64 = 820.0;
const HEIGHT: f64 = 460.0;
const RIGHT: f64 = 24.0;
/// Room below a plot for the labels of its axis.
const BOTTOM: f64 = 52.0;
const NAME_ROW: f64 = 17.0;
/// Size of each plot among several.
const CELL: [f64; 2] = [430.0, 250.0];
const ANNOTATION: Stroke = Stroke { color: Color(110, 110, 110), width: 1.0, dashed: true };

/// The figure as SVG text.
pub fn line_figure(figure: &LineFigure) -> String {
    stack(&[(figure, HEIGHT)])
}

/// Several figures as one SVG text, row by row with so many columns, under one title and one legend.
///
/// The titles of the single figures are not shown; entries of the legend that have equal names are shown once.
///
/// ```
/// use aeroform::report::figures::{LineFigure, grid_figure};
/// let one = |name: &str| LineFigure { y_label: name.into(), ..LineFigure::default() };
/// let svg = grid_figure("a polar", 2, &[one("CL"), one("CD"), one("Cm")]);
/// assert!(svg.contains("a polar") && svg.contains("Cm"));
/// ```
pub fn grid_figure(title: &str, columns: usize, figures: &[LineFigure]) -> String {
    let cells: Vec<(&LineFigure, f64)> = figures.iter().map(|f| (f, CELL[1])).collect();
    grid(title, columns, CELL[0], &cells)
}

/// Figures one below the other, each with the height of its plot, under the title of the first.
pub(super) fn stack(figures: &[(&LineFigure, f64)]) -> String {
    grid(figures.first().map_or("", |(f, _)| f.title.as_str()), 1, WIDTH, figures)
}

impl LineFigure {
    fn points(&self) -> impl Iterator<Item = &[f64; 2]> {
        self.series.iter().flat_map(|s| &s.points)
    }

    fn x_axis(&self, width: f64) -> PlotAxis {
        let values = self.points().map(|p| p[0]).chain(self.annotations.iter().map(|a| a.at));
        PlotAxis::around(values, false, &self.x_label, (width / 85.0).clamp(3.0, 9.0))
    }

    fn y_axis(&self, height: f64) -> PlotAxis {
        let ticks = (height / 45.0).clamp(2.0, 10.0);
        match self.y_range {
            Some([low, high]) => PlotAxis::between(low, high, self.log_y, &self.y_label, ticks),
            None => PlotAxis::around(self.points().map(|p| p[1]), self.log_y, &self.y_label, ticks),
        }
    }

    fn legend_entries(&self) -> impl Iterator<Item = (LegendSample, String)> {
        self.series.iter().map(|s| {
            let sample = match (s.dots, s.stroke.width > 0.0) {
                (true, true) => LegendSample::Dotted(s.stroke),
                (true, false) => LegendSample::Dot(s.stroke.color),
                (false, _) => LegendSample::Line(s.stroke),
            };
            (sample, s.label.clone())
        })
    }

    /// The row above the plot in which the name of each annotation finds room, 0 the lowest.
    fn annotation_rows(&self, x: &PlotAxis, width: f64) -> Vec<usize> {
        // where the names in each row are: from, to
        let mut rows: Vec<Vec<(f64, f64)>> = Vec::new();
        let mut place = |annotation: &Annotation| {
            let length = text_width(&annotation.label, TICK_SIZE) + 10.0;
            let middle = x.share(annotation.at).unwrap_or(0.0) * width;
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

    fn draw(&self, canvas: &mut Canvas, plot: &Plot<'_>) {
        plot.axes(canvas);
        let PlotFrame { left, right, top, bottom } = plot.frame;
        for (annotation, row) in self.annotations.iter().zip(self.annotation_rows(plot.x, right - left)) {
            let Some(share) = plot.x.share(annotation.at) else { continue };
            let x = left + share * (right - left);
            let y = top - 9.0 - NAME_ROW * row as f64;
            canvas.line(&[[x, bottom], [x, y + 8.0]], ANNOTATION);
            let half = 0.5 * text_width(&annotation.label, TICK_SIZE);
            canvas.text([x.min(right - half).max(left + half), y], &annotation.label, TICK_SIZE, Anchor::Centre);
        }
        for level in &self.levels {
            let inside = plot.y.share(level.at).filter(|share| (0.0..=1.0).contains(share));
            let Some([_, y]) = inside.and(plot.pixel([0.0, level.at])) else { continue };
            canvas.line(&[[left, y], [right, y]], ANNOTATION);
            canvas.text([right - 6.0, y - 9.0], &level.label, TICK_SIZE, Anchor::Right);
        }
        for series in &self.series {
            if series.stroke.width > 0.0 {
                plot.curve(canvas, &series.points, series.stroke);
            }
            if series.dots {
                plot.dots(canvas, &series.points, 2.6, series.stroke.color);
            }
        }
    }
}

/// The entries of all figures, each name once, in rows of at most `width` pixels.
fn shared_legend(figures: &[(&LineFigure, f64)], width: f64) -> Legend {
    let mut entries: Vec<(LegendSample, String)> = Vec::new();
    for entry in figures.iter().flat_map(|(f, _)| f.legend_entries()) {
        if !entries.iter().any(|(_, label)| *label == entry.1) {
            entries.push(entry);
        }
    }
    Legend::new(entries, width)
}

/// Figures in rows of `columns`, each with the height of its plot in a cell of a given width.
fn grid(title: &str, columns: usize, cell: f64, figures: &[(&LineFigure, f64)]) -> String {
    let columns = columns.clamp(1, figures.len().max(1));
    let axes: Vec<(PlotAxis, PlotAxis)> =
        figures.iter().map(|(f, height)| (f.x_axis(cell), f.y_axis(*height))).collect();
    // plots of a column stand below each other
    let column_margin = |column: usize| {
        axes.iter().skip(column).step_by(columns).map(|(_, y)| left_margin(y)).fold(LABEL_SIZE, f64::max)
    };
    let margins: Vec<f64> = (0..columns).map(column_margin).collect();
    let plot_width = |k: usize| cell - margins[k % columns] - RIGHT;
    let width = cell * columns as f64;
    let legend = shared_legend(figures, width - margins[0] - RIGHT);
    let heights: Vec<(f64, f64)> = (0..figures.len())
        .step_by(columns)
        .map(|first| {
            let row = first..(first + columns).min(figures.len());
            let names = row.clone().map(|k| figures[k].0.annotation_height(&axes[k].0, plot_width(k)));
            (names.fold(0.0, f64::max), row.map(|k| figures[k].1).fold(0.0, f64::max))
        })
        .collect();
    let head = heading_height(title, &legend);
    let height = head + heights.iter().map(|(names, plot)| names + plot + BOTTOM).sum::<f64>();
    render(width, height, |canvas| {
        let whole = PlotFrame { left: margins[0], right: width - RIGHT, top: head, bottom: height };
        canvas.heading(title, &legend, whole, 0.0);
        let mut top = head;
        for (row, (names, plot_height)) in heights.iter().enumerate() {
            top += names;
            for k in row * columns..((row + 1) * columns).min(figures.len()) {
                let (figure, (x, y)) = (figures[k].0, &axes[k]);
                let left = cell * (k % columns) as f64 + margins[k % columns];
                let frame = PlotFrame { left, right: left + plot_width(k), top, bottom: top + figures[k].1 };
                figure.draw(canvas, &Plot { frame, x, y, inverted: figure.inverted_y });
            }
            top += plot_height + BOTTOM;
        }
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
        let upright = polylines(&line_figure(&figure(points.clone())), "#010203");
        let inverted = line_figure(&LineFigure { inverted_y: true, ..figure(points) });
        let inverted = polylines(&inverted, "#010203");
        assert!(upright[0][0][1] > upright[0][1][1] && inverted[0][0][1] < inverted[0][1][1]);
        assert_eq!(upright[0][0][0], inverted[0][0][0]);
    }

    #[test]
    fn numbers_that_cannot_be_shown_leave_gaps() {
        let points = vec![[0.0, 1e-3], [1.0, 1e-2], [2.0, 0.0], [3.0, 1e-1], [4.0, 1.0], [5.0, f64::NAN], [6.0, 1.0]];
        let svg = line_figure(&LineFigure { log_y: true, ..figure(points) });
        let drawn = polylines(&svg, "#010203");
        assert_eq!(drawn.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        // a decade is a decade
        let rise = |line: &[[f64; 2]]| line[0][1] - line[1][1];
        assert!((rise(&drawn[0]) - rise(&drawn[1])).abs() <= 1.0);
        assert!(texts(&svg).contains(&"10⁻²".to_owned()));
        for points in [vec![], vec![[f64::NAN; 2]], vec![[1.0, -1.0]], vec![[f64::MAX, f64::MIN], [f64::MIN, f64::MAX]]]
        {
            for log_y in [false, true] {
                let svg = line_figure(&LineFigure { log_y, ..figure(points.clone()) });
                assert!(svg.ends_with("</svg>\n") && !svg.contains("NaN"));
            }
        }
    }

    #[test]
    fn names_of_annotations_do_not_overlap() {
        let mut figure = figure(vec![[0.0, 0.0], [1.0, 1.0]]);
        let name = |x: f64| Annotation { at: x, label: "transition".into() };
        figure.annotations = [0.5, 0.52, 0.9, 0.48, 1.0, f64::NAN].map(name).into();
        let axis = figure.x_axis(WIDTH);
        assert_eq!(figure.annotation_rows(&axis, 700.0), [0, 1, 0, 2, 1, 0]);
        let svg = line_figure(&figure);
        assert_eq!(texts(&svg).iter().filter(|t| *t == "transition").count(), 5);
    }

    #[test]
    fn figures_of_a_grid_stand_side_by_side_under_one_legend() {
        let one = |y: &str| {
            let mut figure = figure(vec![[0.0, 0.0], [1.0, 1.0]]);
            figure.series[0].label = "section".into();
            LineFigure { y_label: y.into(), ..figure }
        };
        let svg = grid_figure("both", 2, &[one("CL"), one("CD"), one("Cm")]);
        assert_eq!(texts(&svg).iter().filter(|t| *t == "section").count(), 1);
        let lines: Vec<_> = polylines(&svg, "#010203").into_iter().filter(|line| line[0][1] != line[1][1]).collect();
        assert_eq!(lines.len(), 3);
        assert!(lines[1][0][0] > lines[0][1][0] && (lines[1][0][1] - lines[0][0][1]).abs() < 1e-9);
        assert!(lines[2][1][1] > lines[0][0][1] && (lines[2][0][0] - lines[0][0][0]).abs() < 1e-9);
    }

    #[test]
    fn points_beyond_a_given_range_are_pointed_to_and_levels_stay_inside() {
        let mut figure = figure(vec![[0.0, 0.5], [1.0, 9.0], [2.0, -9.0]]);
        figure.series[0].dots = true;
        figure.y_range = Some([0.0, 1.0]);
        figure.levels = [0.25, 4.0].map(|at| Annotation { at, label: format!("level {at}") }).into();
        let svg = line_figure(&figure);
        assert_eq!(svg.matches("<polygon").count(), 2);
        // the curve stays in the frame
        let line = &polylines(&svg, "#010203")[0];
        assert!(line[1][1] > 0.0 && (line[2][1] - line[1][1] - HEIGHT).abs() < 0.1, "{line:?}");
        assert_eq!(texts(&svg).iter().filter(|t| t.starts_with("level")).collect::<Vec<_>>(), ["level 0.25"]);
    }
}
