//! Lift without boundary layer: exact sections, and other panel codes.

use super::common::panelled;
use super::reference::Reference;
use crate::Failure;
use crate::sheet::Sheet;
use aeroform::flow::{PanelledSection, TrailingEdge};
use aeroform::report::{Align, Table};
use nalgebra::Complex;
use std::f64::consts::PI;

/// A circle about `centre` through 1, mapped by Kármán and Trefftz (edge angle `edge`, zero for Joukowski).
struct Mapped {
    name: &'static str,
    centre: Complex<f64>,
    edge: f64,
}

impl Mapped {
    fn radius(&self) -> f64 {
        (Complex::new(1.0, 0.0) - self.centre).norm()
    }

    fn map(&self, w: Complex<f64>) -> Complex<f64> {
        let k = 2.0 - self.edge / PI;
        // 1 + 1/w and 1 - 1/w; powers on the principal branch, the circle encloses the cut from -1 to 1
        let (plus, minus) = ((1.0 + 1.0 / w).powf(k), (1.0 - 1.0 / w).powf(k));
        k * (plus + minus) / (plus - minus)
    }

    /// Point of the section at an angle of the circle, from the trailing edge over the upper surface.
    fn point(&self, turn: f64) -> Complex<f64> {
        let start = (Complex::new(1.0, 0.0) - self.centre).arg();
        self.map(self.centre + Complex::from_polar(self.radius(), start + turn))
    }

    /// Foremost x.
    fn nose(&self) -> f64 {
        -self.largest(|z| -z.re)
    }

    /// Largest distance from the trailing edge, over the chord along x: the solver's coefficients are on it.
    fn own_chord(&self) -> f64 {
        let tail = self.point(0.0);
        self.largest(|z| (z - tail).norm()) / self.chord()
    }

    /// Largest value of a function along the section, by golden section about the largest of many points.
    fn largest(&self, of: impl Fn(Complex<f64>) -> f64) -> f64 {
        let value = |t: f64| of(self.point(t));
        let step = 2.0 * PI / 1000.0;
        let best = (1..1000).fold(1, |b, k| if value(step * k as f64) > value(step * b as f64) { k } else { b });
        let (mut low, mut high) = (step * (best as f64 - 1.0), step * (best as f64 + 1.0));
        let ratio = 0.5 * (5f64.sqrt() - 1.0);
        for _ in 0..80 {
            let (a, b) = (high - ratio * (high - low), low + ratio * (high - low));
            if value(a) > value(b) { high = b } else { low = a }
        }
        value(0.5 * (low + high))
    }

    /// Chord along x.
    fn chord(&self) -> f64 {
        2.0 - self.edge / PI - self.nose()
    }

    /// Nodes on unit chord at equal steps of the circle's angle.
    fn nodes(&self, panels: usize) -> Vec<[f64; 2]> {
        let (nose, chord) = (self.nose(), self.chord());
        let node = |i: usize| {
            if i.is_multiple_of(panels) {
                return [1.0, 0.0];
            }
            let z = self.point(2.0 * PI * i as f64 / panels as f64);
            [(z.re - nose) / chord, z.im / chord]
        };
        (0..=panels).map(node).collect()
    }

    /// Lift coefficient on the chord along x at an angle of attack by the theorem of Kutta and Joukowski.
    fn lift(&self, alpha: f64) -> f64 {
        let radius = self.radius();
        8.0 * PI * radius / self.chord() * (alpha + (self.centre.im / radius).asin()).sin()
    }
}

const COUNTS: [usize; 4] = [50, 100, 200, 400];
const DEGREES: f64 = 4.0;

pub fn sheets() -> Result<Vec<Sheet>, Failure> {
    Ok(vec![exact()?, codes()?])
}

fn exact() -> Result<Sheet, Failure> {
    let sections = [
        Mapped { name: "Joukowski, centre -0.1", centre: Complex::new(-0.1, 0.0), edge: 0.0 },
        Mapped { name: "Joukowski, centre -0.1 + 0.1i", centre: Complex::new(-0.1, 0.1), edge: 0.0 },
        Mapped { name: "Joukowski, centre -0.08 + 0.08i", centre: Complex::new(-0.08, 0.08), edge: 0.0 },
        Mapped {
            name: "Karman-Trefftz 10 deg, centre -0.1",
            centre: Complex::new(-0.1, 0.0),
            edge: 10f64.to_radians(),
        },
        Mapped {
            name: "Karman-Trefftz 15 deg, centre -0.08 + 0.08i",
            centre: Complex::new(-0.08, 0.08),
            edge: 15f64.to_radians(),
        },
        Mapped {
            name: "Karman-Trefftz 20 deg, centre -0.1 + 0.05i",
            centre: Complex::new(-0.1, 0.05),
            edge: 20f64.to_radians(),
        },
    ];
    let text = format!(
        "Lift from surface pressure, M 0, alpha {DEGREES}, on nodes at equal angles of the circle, against 8 pi a/c sin(alpha + asin(Im mu / a)),\n\
         the circle of radius a about mu passing through 1. Errors relative."
    );
    let mut sheet = Sheet::new("Inviscid lift of mapped circles", &text);
    let columns = COUNTS.map(|n| (format!("{n} panels"), Align::Right));
    let head = [("section".to_owned(), Align::Left), ("exact CL".to_owned(), Align::Right)];
    let orders = ["50-100", "100-200", "200-400"].map(|n| (format!("order {n}"), Align::Right));
    let mut figures = Table::new(head.into_iter().chain(columns).chain(orders));
    let mut checks = Vec::new();
    for section in &sections {
        let lift = section.lift(DEGREES.to_radians());
        let mut errors = [0.0; 4];
        for (error, panels) in errors.iter_mut().zip(COUNTS) {
            let solver = PanelledSection::new(&section.nodes(panels), TrailingEdge::Sharp)?;
            *error = solver.inviscid(DEGREES.to_radians(), 0.0)?.cl * section.own_chord() / lift - 1.0;
        }
        let orders = [0, 1, 2].map(|k: usize| (errors[k] / errors[k + 1]).abs().log2());
        let cells = [section.name.to_owned(), format!("{lift:.9}")].into_iter();
        let cells = cells.chain(errors.map(|e| format!("{e:+.2e}")));
        figures.row(cells.chain(orders.map(|o| format!("{o:.2}"))));
        checks.push((section.name, errors[2].abs(), orders[1]));
    }
    sheet.set_figures(figures);
    // closed-form chord and lift of the first sections, worked out independently
    for (section, degrees, expected) in
        [(0, 4.0, 0.478_137_655_5), (0, 5.0, 0.597_398_926_1), (1, 4.0, 1.099_671_719_2), (2, 4.0, 0.969_409_175_9)]
    {
        let Mapped { name, .. } = &sections[section];
        let ours = sections[section].lift(f64::to_radians(degrees));
        sheet.relative(&format!("formula, {name}, alpha {degrees}"), expected, ours, 1e-9);
    }
    for (name, error, order) in checks {
        sheet.at_most(&format!("{name}: relative error at 200 panels"), 2e-4, error);
        sheet.at_least(&format!("{name}: order, 100 to 200 panels"), 1.9, order);
    }
    Ok(sheet)
}

fn codes() -> Result<Sheet, Failure> {
    let text = "NACA 0012, M 0, at the panel counts of XFOIL 6.99 (reference/flow/xfoil_inviscid.csv), nodes as the command places\n\
                them; and at 320 panels against a linear-vortex method extrapolated from up to 401 nodes (CL good to 1e-5).\n\
                Bars: 0.1 % of lift and 5e-4 in moment against XFOIL, 2e-4 at 300 panels; 0.05 % against the extrapolated lift.";
    let mut sheet = Sheet::new("Inviscid NACA 0012 against other codes", text);
    let right = ["CL", "XFOIL", "difference", "CM", "XFOIL", "difference"].map(|name| (name, Align::Right));
    let mut figures = Table::new([("section", Align::Left)].into_iter().chain(right));
    let reference = Reference::new(include_str!("../reference/flow/xfoil_inviscid.csv"));
    let (mut lift, mut moment, mut fine) = (0.0f64, 0.0f64, 0.0f64);
    for row in reference.rows() {
        let [panels, degrees, cl, cm] =
            [row.required("npan")?, row.required("alpha")?, row.required("CL")?, row.required("CM")?];
        let name = if row.text("te")? == "sharp" { "naca0012:sharp" } else { "naca0012" };
        let s = panelled(name, panels as usize)?.inviscid(degrees.to_radians(), 0.0)?;
        figures.row([
            format!("{name}, {panels} panels, alpha {degrees}"),
            format!("{:.6}", s.cl),
            format!("{cl:.6}"),
            format!("{:+.6}", s.cl - cl),
            format!("{:.6}", s.cm),
            format!("{cm:.6}"),
            format!("{:+.6}", s.cm - cm),
        ]);
        if degrees > 0.0 {
            lift = lift.max((s.cl / cl - 1.0).abs());
        }
        moment = moment.max((s.cm - cm).abs());
        if panels == 300.0 {
            fine = fine.max((s.cm - cm).abs());
        }
    }
    sheet.set_figures(figures);
    sheet.at_most("worst relative difference of lift from XFOIL", 1e-3, lift);
    sheet.at_most("worst difference of moment from XFOIL", 5e-4, moment);
    sheet.at_most("worst difference of moment from XFOIL, 300 panels", 2e-4, fine);
    for (degrees, expected) in [(2.0, 0.24146), (4.0, 0.48263), (8.0, 0.96291)] {
        let s = panelled("naca0012:sharp", 320)?.inviscid(f64::to_radians(degrees), 0.0)?;
        sheet.relative(&format!("extrapolated lift, sharp, alpha {degrees}"), expected, s.cl, 5e-4);
    }
    Ok(sheet)
}
