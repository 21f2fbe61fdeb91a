//! Drawing in fractions of a pixel: headings, plots in a frame.

use super::axis::PlotAxis;
use super::{FigureError, Stroke};
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color as _, FontTransform, IntoFont, RGBColor, ShapeStyle, WHITE};

/// The backend rounds to whole pixels, so pixels are made this much smaller than they look.
const FINENESS: f64 = 10.0;
/// The backend divides font sizes by this.
const FONT_CORRECTION: f64 = 1.24;

const INK: RGBColor = RGBColor(40, 40, 40);
const GRID: RGBColor = RGBColor(226, 226, 226);
pub(super) const TITLE_SIZE: f64 = 17.0;
pub(super) const LABEL_SIZE: f64 = 14.0;
pub(super) const TICK_SIZE: f64 = 12.5;
const LEGEND_SIZE: f64 = 13.0;
const LEGEND_ROW: f64 = 21.0;
const SAMPLE: f64 = 30.0;

/// How a text stands to its point.
#[derive(Clone, Copy)]
pub(super) enum Anchor {
    Centre,
    Left,
    Right,
    /// Centred, read upwards.
    Upright,
}

/// A rectangle in pixels, y downwards.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlotFrame {
    pub(super) left: f64,
    pub(super) right: f64,
    pub(super) top: f64,
    pub(super) bottom: f64,
}

/// A drawing in pixels of ordinary size.
pub(super) struct Canvas<'a, 'b>(&'b DrawingArea<SVGBackend<'a>, Shift>);

/// Draws a picture of `width` × `height` pixels and returns the SVG text.
pub(super) fn render(
    width: f64,
    height: f64,
    draw: impl FnOnce(&Canvas<'_, '_>) -> Result<(), FigureError>,
) -> Result<String, FigureError> {
    let fine = |v: f64| (v * FINENESS).round() as u32;
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, (fine(width), fine(height))).into_drawing_area();
        area.fill(&WHITE).map_err(FigureError::drawing)?;
        draw(&Canvas(&area))?;
        area.present().map_err(FigureError::drawing)?;
    }
    // the viewBox stays as fine as it was drawn
    let drawn = format!("width=\"{}\" height=\"{}\"", fine(width), fine(height));
    Ok(text.replacen(&drawn, &format!("width=\"{}\" height=\"{}\"", width.round(), height.round()), 1))
}

fn fine(point: [f64; 2]) -> (i32, i32) {
    // a cast saturates, so no point can overflow
    ((point[0] * FINENESS).round() as i32, (point[1] * FINENESS).round() as i32)
}

impl Canvas<'_, '_> {
    /// An open polyline.
    pub(super) fn line(&self, points: &[[f64; 2]], stroke: Stroke) -> Result<(), FigureError> {
        let width = (stroke.width * FINENESS).round().max(1.0) as u32;
        let style = ShapeStyle { color: stroke.color.rgb().to_rgba(), filled: false, stroke_width: width };
        let pieces = if stroke.dashed { dashes(points, 9.0, 5.0) } else { vec![points.to_vec()] };
        for piece in pieces.iter().filter(|piece| piece.len() > 1) {
            let path: Vec<_> = piece.iter().copied().map(fine).collect();
            self.0.draw(&PathElement::new(path, style)).map_err(FigureError::drawing)?;
        }
        Ok(())
    }

    /// A filled dot with a thin white rim, so that dots on lines stay apart.
    pub(super) fn dot(&self, point: [f64; 2], radius: f64, color: RGBColor) -> Result<(), FigureError> {
        let disc = |radius: f64, color: RGBColor| Circle::new(fine(point), radius * FINENESS, color.filled());
        self.0.draw(&disc(radius + 0.6, WHITE)).map_err(FigureError::drawing)?;
        self.0.draw(&disc(radius, color)).map_err(FigureError::drawing)
    }

    pub(super) fn text(&self, point: [f64; 2], text: &str, size: f64, anchor: Anchor) -> Result<(), FigureError> {
        let font = ("sans-serif", size * FINENESS * FONT_CORRECTION).into_font();
        let (horizontal, turn) = match anchor {
            Anchor::Centre => (HPos::Center, FontTransform::None),
            Anchor::Left => (HPos::Left, FontTransform::None),
            Anchor::Right => (HPos::Right, FontTransform::None),
            Anchor::Upright => (HPos::Center, FontTransform::Rotate270),
        };
        let style = font.transform(turn).color(&INK).pos(Pos::new(horizontal, VPos::Center));
        self.0.draw(&Text::new(text.to_owned(), fine(point), style)).map_err(FigureError::drawing)
    }

    /// Title and legend above a frame, starting at `top`.
    pub(super) fn heading(&self, title: &str, legend: &Legend, frame: PlotFrame, top: f64) -> Result<(), FigureError> {
        let middle = 0.5 * (frame.left + frame.right);
        if !title.is_empty() {
            let width = f64::from(self.0.dim_in_pixel().0) / FINENESS;
            let size = title_size(title, 2.0 * middle.min(width - middle));
            self.text([middle, top + 18.0], title, size, Anchor::Centre)?;
        }
        for (row, y) in legend.rows.iter().zip(0..) {
            let y = top + title_height(title) + LEGEND_ROW * (f64::from(y) + 0.5);
            let width: f64 = row.iter().map(Entry::width).sum();
            let mut x = middle - 0.5 * width;
            for entry in row {
                let (left, right) = ([x, y], [x + SAMPLE, y]);
                match entry.sample {
                    LegendSample::Line(stroke) => self.line(&[left, right], stroke)?,
                    LegendSample::Dot(color) => self.dot([x + 0.5 * SAMPLE, y], 3.5, color)?,
                    LegendSample::Dotted(stroke) => {
                        self.line(&[left, right], stroke)?;
                        self.dot([x + 0.5 * SAMPLE, y], 3.0, stroke.color.rgb())?;
                    }
                }
                self.text([x + SAMPLE + 7.0, y], &entry.label, LEGEND_SIZE, Anchor::Left)?;
                x += entry.width();
            }
        }
        Ok(())
    }
}

/// Height of title and legend together.
pub(super) fn heading_height(title: &str, legend: &Legend) -> f64 {
    title_height(title) + LEGEND_ROW * legend.rows.len() as f64 + 9.0
}

/// The usual size of a title, or a smaller one with which it fits into `room`.
fn title_size(title: &str, room: f64) -> f64 {
    TITLE_SIZE.min(TITLE_SIZE * (room - 20.0) / text_width(title, TITLE_SIZE))
}

fn title_height(title: &str) -> f64 {
    if title.is_empty() { 5.0 } else { 34.0 }
}

/// Estimated width of a text in pixels; the viewer chooses the font, so this is on the generous side.
pub(super) fn text_width(text: &str, size: f64) -> f64 {
    let width = |c: char| match c {
        'f' | 'i' | 'j' | 'l' | 'r' | 't' | 'I' | ' ' | '.' | ',' | ':' | ';' | '|' | '\'' | '(' | ')' | '/' => 0.4,
        'm' | 'w' | 'M' | 'W' | '=' | '+' | '\u{2212}' => 0.92,
        c if c.is_uppercase() => 0.7,
        _ => 0.63,
    };
    text.chars().map(width).sum::<f64>() * size
}

/// The sign before a label in a legend.
#[derive(Clone, Copy)]
pub(super) enum LegendSample {
    Line(Stroke),
    Dot(RGBColor),
    Dotted(Stroke),
}

struct Entry {
    sample: LegendSample,
    label: String,
}

impl Entry {
    fn width(&self) -> f64 {
        SAMPLE + 7.0 + text_width(&self.label, LEGEND_SIZE) + 16.0
    }
}

/// Rows of samples with labels, above the plot so that they cover nothing.
pub(super) struct Legend {
    rows: Vec<Vec<Entry>>,
}

impl Legend {
    /// Breaks the entries into rows of at most `width` pixels. Entries without a label are left out.
    pub(super) fn new(entries: impl IntoIterator<Item = (LegendSample, String)>, width: f64) -> Self {
        let mut rows: Vec<Vec<Entry>> = Vec::new();
        let mut used = f64::INFINITY;
        for (sample, label) in entries.into_iter().filter(|(_, label)| !label.is_empty()) {
            let entry = Entry { sample, label };
            used += entry.width();
            match rows.last_mut() {
                Some(row) if used <= width => row.push(entry),
                _ => {
                    used = entry.width();
                    rows.push(vec![entry]);
                }
            }
        }
        Self { rows }
    }
}

/// Cuts a polyline into dashes of `on` pixels with gaps of `off` pixels.
fn dashes(points: &[[f64; 2]], on: f64, off: f64) -> Vec<Vec<[f64; 2]>> {
    let mut pieces = Vec::new();
    let Some(&first) = points.first() else { return pieces };
    let (mut dash, mut drawing, mut left) = (vec![first], true, on);
    for ends in points.windows(2) {
        let [a, b] = [ends[0], ends[1]];
        let length = (b[0] - a[0]).hypot(b[1] - a[1]);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let share = done / length;
            let point = [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
            if drawing {
                dash.push(point);
                pieces.push(std::mem::take(&mut dash));
                left = off;
            } else {
                dash = vec![point];
                left = on;
            }
            drawing = !drawing;
        }
        left -= length - done;
        if drawing {
            dash.push(b);
        }
    }
    pieces.push(dash);
    pieces
}

/// Two axes in a frame.
pub(super) struct Plot<'p> {
    pub(super) frame: PlotFrame,
    pub(super) x: &'p PlotAxis,
    pub(super) y: &'p PlotAxis,
    /// Whether y grows downwards.
    pub(super) inverted: bool,
}

impl Plot<'_> {
    /// The pixel of a point; `None` where the axes cannot show it.
    pub(super) fn pixel(&self, point: [f64; 2]) -> Option<[f64; 2]> {
        let (sx, sy) = (self.x.share(point[0])?, self.y.share(point[1])?);
        let PlotFrame { left, right, top, bottom } = self.frame;
        let sy = if self.inverted { 1.0 - sy } else { sy };
        Some([left + sx * (right - left), bottom + sy * (top - bottom)])
    }

    /// Grid, frame, ticks and labels.
    pub(super) fn axes(&self, canvas: &Canvas<'_, '_>) -> Result<(), FigureError> {
        let PlotFrame { left, right, top, bottom } = self.frame;
        let horizontal = |share: f64| left + share * (right - left);
        let vertical = |share: f64| bottom + (if self.inverted { 1.0 - share } else { share }) * (top - bottom);
        let thin = |width: f64| Stroke { color: super::Color(GRID.0, GRID.1, GRID.2), width, dashed: false };
        for share in self.x.minor() {
            canvas.line(&[[horizontal(share), bottom], [horizontal(share), top]], thin(0.5))?;
        }
        for share in self.y.minor() {
            canvas.line(&[[left, vertical(share)], [right, vertical(share)]], thin(0.5))?;
        }
        let mut widest: f64 = 0.0;
        for (share, label) in self.x.ticks() {
            let x = horizontal(share);
            canvas.line(&[[x, bottom], [x, top]], thin(1.0))?;
            canvas.text([x, bottom + 13.0], &label, TICK_SIZE, Anchor::Centre)?;
        }
        for (share, label) in self.y.ticks() {
            let y = vertical(share);
            canvas.line(&[[left, y], [right, y]], thin(1.0))?;
            canvas.text([left - 7.0, y], &label, TICK_SIZE, Anchor::Right)?;
            widest = widest.max(text_width(&label, TICK_SIZE));
        }
        let corners = [[left, top], [right, top], [right, bottom], [left, bottom], [left, top]];
        canvas.line(&corners, Stroke { color: super::Color(150, 150, 150), width: 1.0, dashed: false })?;
        canvas.text([0.5 * (left + right), bottom + 36.0], &self.x.label, LABEL_SIZE, Anchor::Centre)?;
        let margin = left - widest - 24.0;
        canvas.text([margin.max(10.0), 0.5 * (top + bottom)], &self.y.label, LABEL_SIZE, Anchor::Upright)
    }

    /// A curve; where a point cannot be shown there is a gap.
    pub(super) fn curve(
        &self,
        canvas: &Canvas<'_, '_>,
        points: &[[f64; 2]],
        stroke: Stroke,
    ) -> Result<(), FigureError> {
        let pixels: Vec<_> = points.iter().map(|&p| self.pixel(p)).collect();
        for run in pixels.split(Option::is_none) {
            let run: Vec<_> = run.iter().flatten().copied().collect();
            canvas.line(&run, stroke)?;
        }
        Ok(())
    }

    /// A dot at each point that can be shown.
    pub(super) fn dots(
        &self,
        canvas: &Canvas<'_, '_>,
        points: &[[f64; 2]],
        radius: f64,
        color: RGBColor,
    ) -> Result<(), FigureError> {
        points.iter().filter_map(|&p| self.pixel(p)).try_for_each(|p| canvas.dot(p, radius, color))
    }
}

/// Width left of a frame for the labels of its y axis.
pub(super) fn left_margin(y: &PlotAxis) -> f64 {
    let widest = y.ticks().iter().map(|(_, label)| text_width(label, TICK_SIZE)).fold(0.0, f64::max);
    widest + 42.0
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn long_titles_are_smaller() {
        assert_eq!(title_size("short", 500.0), TITLE_SIZE);
        let long = "a title that is longer than the picture is wide, by much, at the usual size";
        let size = title_size(long, 500.0);
        assert!(size < TITLE_SIZE && text_width(long, size) < 500.0);
    }

    /// The polylines of a colour, in the fine pixels of the file.
    pub(in super::super) fn polylines(svg: &str, color: &str) -> Vec<Vec<[f64; 2]>> {
        let lines = svg.lines().filter(|l| l.starts_with("<polyline") && l.contains(&format!("stroke=\"{color}\"")));
        let points = |line: &str| {
            let list = line.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
            let point = |pair: &str| {
                let (x, y) = pair.split_once(',').unwrap();
                [x.parse().unwrap(), y.parse().unwrap()]
            };
            list.split_whitespace().map(point).collect()
        };
        lines.map(points).collect()
    }

    /// All texts.
    pub(in super::super) fn texts(svg: &str) -> Vec<String> {
        let mut lines = svg.lines();
        let mut found = Vec::new();
        while let Some(line) = lines.next() {
            if line.starts_with("<text") {
                found.extend(lines.next().map(str::to_owned));
            }
        }
        found
    }

    #[test]
    fn files_are_finer_than_they_look() {
        let svg = render(90.0, 47.06, |_| Ok(())).unwrap();
        assert!(svg.starts_with("<svg width=\"90\" height=\"47\" viewBox=\"0 0 900 471\""), "{svg}");
    }

    #[test]
    fn dashes_cover_their_share() {
        let points: Vec<[f64; 2]> = (0..=100).map(|i| [f64::from(i), 0.0]).collect();
        let pieces = dashes(&points, 9.0, 5.0);
        let length = |piece: &Vec<[f64; 2]>| piece[piece.len() - 1][0] - piece[0][0];
        assert_eq!(pieces.len(), 8);
        for (k, piece) in pieces[..7].iter().enumerate() {
            assert_relative_eq!(piece[0][0], 14.0 * k as f64, epsilon = 1e-9);
            assert_relative_eq!(length(piece), 9.0, epsilon = 1e-9);
        }
        assert!(dashes(&[], 9.0, 5.0).is_empty());
    }

    #[test]
    fn legends_break_into_rows() {
        let stroke = Stroke::palette(0);
        let entries = |n: usize| (0..n).map(move |i| (LegendSample::Line(stroke), format!("number {i}")));
        assert!(Legend::new(entries(0), 100.0).rows.is_empty());
        let legend = Legend::new(entries(10), 400.0);
        assert!(legend.rows.len() > 1);
        for row in &legend.rows {
            assert!(row.iter().map(Entry::width).sum::<f64>() <= 400.0);
        }
        assert_eq!(Legend::new(entries(3), 1.0).rows.len(), 3);
    }
}
