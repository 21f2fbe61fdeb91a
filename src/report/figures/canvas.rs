//! The SVG that figures are made of: lines, dots and texts on a canvas, headings, plots in a frame.

use super::axis::PlotAxis;
use super::{Color, Stroke};
use maud::html;

const INK: Color = Color(40, 40, 40);
const GRID: Color = Color(226, 226, 226);
const FRAME: Stroke = Stroke { color: Color(150, 150, 150), width: 1.0, dashed: false };
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

/// A picture in pixels, whose elements are written one below the other.
pub(super) struct Canvas {
    width: f64,
    elements: String,
}

/// Draws a picture of `width` × `height` pixels and returns the SVG text.
pub(super) fn render(width: f64, height: f64, draw: impl FnOnce(&mut Canvas)) -> String {
    let mut canvas = Canvas { width, elements: String::new() };
    draw(&mut canvas);
    let (width, height) = (width.round(), height.round());
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n{}</svg>\n",
        canvas.elements
    )
}

/// A coordinate in hundredths of a pixel, the finest that is seen.
fn pixels(value: f64) -> String {
    let rounded = (100.0 * value.clamp(-1e6, 1e6)).round() / 100.0;
    (rounded + 0.0).to_string()
}

impl Canvas {
    fn add(&mut self, element: maud::Markup) {
        self.elements.push_str(&element.0);
        self.elements.push('\n');
    }

    /// An open polyline; fewer than two points draw nothing.
    pub(super) fn line(&mut self, points: &[[f64; 2]], stroke: Stroke) {
        if points.len() < 2 {
            return;
        }
        let path: Vec<String> = points.iter().map(|p| format!("{},{}", pixels(p[0]), pixels(p[1]))).collect();
        let dashes = stroke.dashed.then_some("9 5");
        self.add(html! {
            polyline fill="none" stroke=(stroke.color.hex()) stroke-width=(stroke.width) stroke-dasharray=[dashes]
                stroke-linejoin="round" points=(path.join(" ")) {}
        });
    }

    /// Straight pieces of a line as one element; no pieces draw nothing.
    pub(super) fn segments(&mut self, pieces: &[[[f64; 2]; 2]], stroke: Stroke) {
        if pieces.is_empty() {
            return;
        }
        let piece = |[a, b]: &[[f64; 2]; 2]| {
            let [x0, y0, x1, y1] = [a[0], a[1], b[0], b[1]].map(pixels);
            format!("M{x0},{y0}L{x1},{y1}")
        };
        let path: String = pieces.iter().map(piece).collect();
        self.add(html! {
            path fill="none" stroke=(stroke.color.hex()) stroke-width=(stroke.width) stroke-linecap="round" d=(path) {}
        });
    }

    /// A filled dot with a thin white rim, so that dots on lines stay apart.
    pub(super) fn dot(&mut self, point: [f64; 2], radius: f64, color: Color) {
        let [x, y] = point.map(pixels);
        self.add(html! { circle cx=(x) cy=(y) r=(radius) fill=(color.hex()) stroke="#ffffff" stroke-width="0.6" {} });
    }

    /// A small triangle at the edge of a frame that points to something beyond it: above it for a `side` of 1, below it
    /// for −1.
    fn pointer(&mut self, at: [f64; 2], side: f64, color: Color) {
        let corners = [[-3.5, 7.0], [0.0, 1.0], [3.5, 7.0]].map(|[x, y]| {
            let (x, y) = (pixels(at[0] + x), pixels(at[1] + side * y));
            format!("{x},{y}")
        });
        self.add(html! { polygon fill=(color.hex()) points=(corners.join(" ")) {} });
    }

    pub(super) fn text(&mut self, point: [f64; 2], text: &str, size: f64, anchor: Anchor) {
        let [x, y] = point.map(pixels);
        let (place, turn) = match anchor {
            Anchor::Centre => ("middle", None),
            Anchor::Left => ("start", None),
            Anchor::Right => ("end", None),
            Anchor::Upright => ("middle", Some(format!("rotate(-90 {x} {y})"))),
        };
        self.add(html! {
            text x=(x) y=(y) dy="0.36em" font-size=(size) fill=(INK.hex()) text-anchor=(place) transform=[turn] { (text) }
        });
    }

    /// Title and legend above a frame, starting at `top`.
    pub(super) fn heading(&mut self, title: &str, legend: &Legend, frame: PlotFrame, top: f64) {
        let middle = 0.5 * (frame.left + frame.right);
        if !title.is_empty() {
            let size = title_size(title, 2.0 * middle.min(self.width - middle));
            self.text([middle, top + 18.0], title, size, Anchor::Centre);
        }
        for (row, y) in legend.rows.iter().zip(0..) {
            let y = top + title_height(title) + LEGEND_ROW * (f64::from(y) + 0.5);
            let width: f64 = row.iter().map(Entry::width).sum();
            let mut x = middle - 0.5 * width;
            for entry in row {
                let (left, right) = ([x, y], [x + SAMPLE, y]);
                match entry.sample {
                    LegendSample::Line(stroke) => self.line(&[left, right], stroke),
                    LegendSample::Dot(color) => self.dot([x + 0.5 * SAMPLE, y], 3.5, color),
                    LegendSample::Dotted(stroke) => {
                        self.line(&[left, right], stroke);
                        self.dot([x + 0.5 * SAMPLE, y], 3.0, stroke.color);
                    }
                }
                self.text([x + SAMPLE + 7.0, y], &entry.label, LEGEND_SIZE, Anchor::Left);
                x += entry.width();
            }
        }
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
    Dot(Color),
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
    pub(super) fn axes(&self, canvas: &mut Canvas) {
        let PlotFrame { left, right, top, bottom } = self.frame;
        let horizontal = |share: f64| left + share * (right - left);
        let vertical = |share: f64| bottom + (if self.inverted { 1.0 - share } else { share }) * (top - bottom);
        let thin = |width: f64| Stroke { color: GRID, width, dashed: false };
        for share in self.x.minor() {
            canvas.line(&[[horizontal(share), bottom], [horizontal(share), top]], thin(0.5));
        }
        for share in self.y.minor() {
            canvas.line(&[[left, vertical(share)], [right, vertical(share)]], thin(0.5));
        }
        let mut widest: f64 = 0.0;
        for (share, label) in self.x.ticks() {
            let x = horizontal(share);
            canvas.line(&[[x, bottom], [x, top]], thin(1.0));
            canvas.text([x, bottom + 13.0], &label, TICK_SIZE, Anchor::Centre);
        }
        for (share, label) in self.y.ticks() {
            let y = vertical(share);
            canvas.line(&[[left, y], [right, y]], thin(1.0));
            canvas.text([left - 7.0, y], &label, TICK_SIZE, Anchor::Right);
            widest = widest.max(text_width(&label, TICK_SIZE));
        }
        canvas.line(&[[left, top], [right, top], [right, bottom], [left, bottom], [left, top]], FRAME);
        canvas.text([0.5 * (left + right), bottom + 36.0], &self.x.label, LABEL_SIZE, Anchor::Centre);
        canvas.text([left - widest - 24.0, 0.5 * (top + bottom)], &self.y.label, LABEL_SIZE, Anchor::Upright);
    }

    /// A curve; where a point cannot be shown there is a gap, and beyond the frame the curve follows its edge.
    pub(super) fn curve(&self, canvas: &mut Canvas, points: &[[f64; 2]], stroke: Stroke) {
        let inside = |[x, y]: [f64; 2]| [x, y.clamp(self.frame.top, self.frame.bottom)];
        let pixels: Vec<_> = points.iter().map(|&p| self.pixel(p).map(inside)).collect();
        for run in pixels.split(Option::is_none) {
            let run: Vec<_> = run.iter().flatten().copied().collect();
            canvas.line(&run, stroke);
        }
    }

    /// A dot at each point that can be shown; a triangle at the edge for one that lies above or below the frame.
    pub(super) fn dots(&self, canvas: &mut Canvas, points: &[[f64; 2]], radius: f64, color: Color) {
        for [x, y] in points.iter().filter_map(|&p| self.pixel(p)) {
            if y < self.frame.top - 1.0 {
                canvas.pointer([x, self.frame.top], 1.0, color);
            } else if y > self.frame.bottom + 1.0 {
                canvas.pointer([x, self.frame.bottom], -1.0, color);
            } else {
                canvas.dot([x, y], radius, color);
            }
        }
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

    #[test]
    fn long_titles_are_smaller() {
        assert_eq!(title_size("short", 500.0), TITLE_SIZE);
        let long = "a title that is longer than the picture is wide, by much, at the usual size";
        let size = title_size(long, 500.0);
        assert!(size < TITLE_SIZE && text_width(long, size) < 500.0);
    }

    /// The polylines of a colour.
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
        let lines = svg.lines().filter(|line| line.starts_with("<text"));
        lines.map(|line| line.split_once('>').unwrap().1.strip_suffix("</text>").unwrap().to_owned()).collect()
    }

    #[test]
    fn elements_stand_in_one_document() {
        let stroke = Stroke::palette(0).dashed();
        let svg = render(90.0, 47.06, |canvas| {
            canvas.line(&[[0.0, 0.0], [1.0 / 3.0, f64::MAX]], stroke);
            canvas.line(&[[0.0, 0.0]], stroke);
            canvas.text([1.0, 2.0], "a < b", 12.0, Anchor::Upright);
        });
        assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"90\" height=\"47\""), "{svg}");
        assert_eq!(polylines(&svg, "#0072b2"), [[[0.0, 0.0], [0.33, 1e6]]]);
        assert!(svg.contains("stroke-dasharray=\"9 5\"") && svg.contains("rotate(-90 1 2)"), "{svg}");
        assert_eq!(texts(&svg), ["a &lt; b"]);
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
