//! Figures as SVG text.
//!
//! * [`section_figure`]: sections in their box, with equal axes;
//! * [`line_figure`]: any curves over two axes, [`grid_figure`]: several of them side by side: pressures, polars;
//! * [`contour_figure`]: lines of equal value in the region about a section;
//! * [`convergence_figure`]: the objective, and where there are constraints their violation, iteration by iteration.
//!
//! One small layer writes the SVG elements; the library `maud` escapes every text that is put into them.
//!
//! Legends stand above the plot, so they never cover a curve. Numbers that are not finite, or not positive on a
//! logarithmic axis, leave gaps.

mod axis;
mod canvas;
mod contour;
mod convergence;
mod line;
mod section;

pub use contour::{ContourFigure, ContourLevel, ContourPatch, contour_figure};
pub use convergence::{ConvergenceFigure, ConvergencePoint, convergence_figure};
pub use line::{Annotation, LineFigure, Series, grid_figure, line_figure};
pub use section::{SectionCurve, SectionFigure, section_figure};

/// Red, green and blue, 0 to 255.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Color(pub u8, pub u8, pub u8);

impl Color {
    fn hex(self) -> String {
        format!("#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// How a line is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stroke {
    /// Colour of the line.
    pub color: Color,
    /// Width of the line in pixels.
    pub width: f64,
    /// Whether the line is dashed.
    pub dashed: bool,
}

impl Stroke {
    /// The section a figure is about: solid and dark.
    pub const SECTION: Self = Self { color: Color(24, 24, 28), width: 2.2, dashed: false };
    /// A section that the figure compares with: dashed.
    pub const TARGET: Self = Self { color: Color(200, 60, 30), width: 1.8, dashed: true };
    /// The section before a change: thin and grey.
    pub const INITIAL: Self = Self { color: Color(140, 140, 140), width: 1.4, dashed: false };
    /// Numbers that are not to be relied on.
    pub const DOUBTFUL: Self = Self { color: Color(170, 170, 170), width: 1.2, dashed: true };
    /// The lines of a box.
    pub const BOX: Self = Self { color: Color(40, 90, 220), width: 1.0, dashed: false };

    /// A solid line in the `index`th of a cycle of colours that stay apart also for colour-blind readers
    /// (Okabe & Ito 2008).
    pub fn palette(index: usize) -> Self {
        const COLORS: [Color; 6] = [
            Color(0, 114, 178),
            Color(213, 94, 0),
            Color(0, 158, 115),
            Color(204, 121, 167),
            Color(86, 180, 233),
            Color(230, 159, 0),
        ];
        Self { color: COLORS[index % COLORS.len()], width: 1.8, dashed: false }
    }

    /// This stroke, dashed.
    pub fn dashed(self) -> Self {
        Self { dashed: true, ..self }
    }
}
