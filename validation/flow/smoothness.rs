//! Drag along smooth shape modes: scatter about a polynomial, and its slope against the exact gradient.

use super::common::{PANELS, cores, in_parallel, nodes, section};
use crate::Failure;
use crate::random::Random;
use crate::sheet::Sheet;
use aeroform::flow::{Condition, FlowError, Incidence, Settings, Solution, analyze};
use aeroform::report::{Align, Table};
use std::fmt::Write;
use std::path::Path;

const SECTIONS: [&str; 7] = [
    "naca0012",
    "naca2412",
    "naca4412",
    "naca0018",
    "naca23012",
    "naca0012:sharp",
    "kulfan:upper=0.17,0.16,0.14,0.15/lower=-0.14,-0.09,-0.05,-0.03",
];
/// Amplitude of the modes in chords.
const REACH: f64 = 2e-3;
/// Steps from the middle to either end.
const STEPS: usize = 20;
const DEGREE: usize = 5;
/// Shown beside it, to tell a function that bends more than a quintic from one that jumps.
const HIGH_DEGREE: usize = 11;

/// A Hicks-Henne bump on each surface: sin(π x^m)^t, m such that the top is at `centre`.
#[derive(Clone, Copy)]
struct Bump {
    centre: f64,
    power: f64,
    height: f64,
}

impl Bump {
    fn random(random: &mut Random) -> Self {
        Self { centre: random.between(0.1, 0.9), power: random.between(2.5, 5.0), height: random.between(-1.0, 1.0) }
    }

    fn at(&self, x: f64) -> f64 {
        let exponent = 0.5f64.ln() / self.centre.ln();
        let angle = std::f64::consts::PI * x.clamp(0.0, 1.0).powf(exponent);
        self.height * angle.sin().max(0.0).powf(self.power)
    }
}

/// A line through the space of shapes.
struct Scan {
    section: &'static str,
    degrees: f64,
    reynolds: f64,
    mach: f64,
    trip: Option<f64>,
    upper: Bump,
    lower: Bump,
}

/// The drag found along a line.
struct Found {
    /// Amplitude over reach, drag, transition on both sides, in order of the amplitude.
    points: Vec<[f64; 4]>,
    /// Points that did not converge.
    lost: usize,
    rms: f64,
    high_rms: f64,
    drag: f64,
    slope: f64,
    high_slope: f64,
    exact: f64,
    /// Largest difference of drag between cold and warm starts at the two ends.
    cold: f64,
}

impl Found {
    /// Estimate of the largest jump of drag between neighbours, and where.
    fn jump(&self) -> (f64, f64) {
        let mut largest = (0.0, 0.0);
        for window in self.points.windows(5) {
            let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|k| window[k][1]);
            // a point lost between
            if window[4][0] - window[0][0] > 4.5 / STEPS as f64 {
                continue;
            }
            // fourth differences take a step of one to three
            let jump = (a - 4.0 * b + 6.0 * c - 4.0 * d + e).abs() / 3.0;
            if jump > largest.0 {
                largest = (jump, REACH * window[2][0]);
            }
        }
        largest
    }

    /// Scatter of the difference of drag to that of another resolution: what the grid adds to the flow's own bending.
    fn grid_rms(&self, finer: &Self) -> f64 {
        let differences: Vec<[f64; 4]> = self
            .points
            .iter()
            .filter_map(|p| finer.points.iter().find(|q| q[0] == p[0]).map(|q| [p[0], p[1] - q[1], 0.0, 0.0]))
            .collect();
        polynomial(&differences, DEGREE).0
    }

    fn slope_error(&self) -> f64 {
        self.error_of(self.slope)
    }

    fn high_slope_error(&self) -> f64 {
        self.error_of(self.high_slope)
    }

    fn error_of(&self, slope: f64) -> f64 {
        // a slope near zero is judged by a change of drag of one in a thousand over the reach
        (slope - self.exact).abs() / self.exact.abs().max(1e-3 * self.drag / REACH)
    }
}

impl Scan {
    fn random(random: &mut Random, tripped: bool) -> Self {
        let mut scan = Self {
            section: SECTIONS[random.whole(0, SECTIONS.len() - 1)],
            degrees: random.between(0.0, 6.0),
            reynolds: 1e6 * 6f64.powf(random.between(0.0, 1.0)),
            mach: if random.chance(0.5) { 0.0 } else { random.between(0.1, 0.3) },
            trip: tripped.then(|| random.between(0.03, 0.1)),
            upper: Bump::random(random),
            lower: Bump::random(random),
        };
        // one of the two reaches the full amplitude
        let largest = scan.upper.height.abs().max(scan.lower.height.abs());
        scan.upper.height /= largest;
        scan.lower.height /= largest;
        scan
    }

    fn direction(&self, nodes: &[[f64; 2]]) -> Vec<f64> {
        let nose = (0..nodes.len()).fold(0, |best, k| if nodes[k][0] < nodes[best][0] { k } else { best });
        let bump = |(k, p): (usize, &[f64; 2])| if k < nose { self.upper.at(p[0]) } else { self.lower.at(p[0]) };
        nodes.iter().enumerate().map(bump).collect()
    }

    /// `None` where the section itself does not converge. `finer` multiplies the panels and stations.
    fn run(&self, finer: usize) -> Result<Option<Found>, String> {
        let section = section(self.section).map_err(|e| e.to_string())?;
        let usual = Settings::default();
        let settings = Settings {
            laminar_stations: finer * usual.laminar_stations,
            turbulent_stations: finer * usual.turbulent_stations,
            ..usual
        };
        let base = nodes(&section, finer * PANELS);
        let direction = self.direction(&base);
        let kind = section.trailing_edge();
        let incidence = Incidence::Alpha(self.degrees.to_radians());
        let condition =
            Condition { mach: self.mach, trips: [self.trip; 2], ..Condition::new(incidence, self.reynolds) };
        let at = |amplitude: f64, warm: Option<&Solution>| -> Result<Solution, FlowError> {
            let moved: Vec<[f64; 2]> = base.iter().zip(&direction).map(|(p, d)| [p[0], p[1] + amplitude * d]).collect();
            analyze(&moved, kind, &condition, &settings, warm)
        };
        let middle = at(0.0, None).map_err(|e| e.to_string())?;
        let Some(gradients) = middle.gradients().filter(|_| middle.is_reliable()) else { return Ok(None) };
        let exact = gradients.cd.nodes.iter().zip(&direction).map(|(g, d)| g[1] * d).sum();
        let mut cold = 0.0f64;
        let record =
            |x: f64, s: &Solution| [x, s.coefficients.cd, s.coefficients.transition[0], s.coefficients.transition[1]];
        let (mut points, mut lost) = (vec![record(0.0, &middle)], 0);
        for sign in [-1.0, 1.0] {
            let mut last = middle.clone();
            for k in 1..=STEPS {
                let x = sign * k as f64 / STEPS as f64;
                let solution = at(REACH * x, Some(&last)).map_err(|e| e.to_string())?;
                if solution.is_reliable() {
                    points.push(record(x, &solution));
                    last = solution;
                } else {
                    lost += 1;
                }
                if k == STEPS && last.is_reliable() {
                    let fresh = at(REACH * x, None).map_err(|e| e.to_string())?;
                    // one of the two ways may not converge: that is counted elsewhere
                    if let (true, Some(end)) = (fresh.is_reliable(), points.iter().find(|p| p[0] == x)) {
                        cold = cold.max((fresh.coefficients.cd - end[1]).abs());
                    }
                }
            }
        }
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (rms, slope) = polynomial(&points, DEGREE);
        let (high_rms, high_slope) = polynomial(&points, HIGH_DEGREE);
        let (slope, high_slope) = (slope / REACH, high_slope / REACH);
        Ok(Some(Found { points, lost, rms, high_rms, drag: middle.coefficients.cd, slope, high_slope, exact, cold }))
    }

    fn describe(&self) -> String {
        let name = self.section.split('=').next().unwrap_or(self.section).trim_end_matches(":upper");
        let trip = self.trip.map_or("free".into(), |x| format!("{x:.3}"));
        format!("{name}, alpha {:.2}, Re {:.2e}, M {:.2}, trip {trip}", self.degrees, self.reynolds, self.mach)
    }
}

/// Least-squares polynomial of the drag of `points` over −1 … 1 by orthogonalisation: what is left (root mean square),
/// slope at 0.
fn polynomial(points: &[[f64; 4]], degree: usize) -> (f64, f64) {
    let mut rest: Vec<f64> = points.iter().map(|p| p[1]).collect();
    let mut slope = 0.0;
    // values at the points, value and slope at 0 of orthonormal polynomials
    let mut basis: Vec<(Vec<f64>, [f64; 2])> = Vec::new();
    for power in 0..=degree {
        // from the one before times x, so that high powers stay apart
        let (mut v, mut at_zero) = match basis.last() {
            None => (vec![1.0; points.len()], [1.0, 0.0]),
            Some((last, [value, _])) => (last.iter().zip(points).map(|(b, p)| b * p[0]).collect(), [0.0, *value]),
        };
        for _ in 0..2 {
            for (b, own) in &basis {
                let dot: f64 = v.iter().zip(b).map(|(v, b)| v * b).sum();
                v.iter_mut().zip(b).for_each(|(v, b)| *v -= dot * b);
                at_zero = [at_zero[0] - dot * own[0], at_zero[1] - dot * own[1]];
            }
        }
        let norm = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        // fewer points than powers
        if !(norm > 1e-12) || power >= points.len() {
            break;
        }
        v.iter_mut().for_each(|v| *v /= norm);
        at_zero = at_zero.map(|a| a / norm);
        let dot: f64 = rest.iter().zip(&v).map(|(r, v)| r * v).sum();
        rest.iter_mut().zip(&v).for_each(|(r, v)| *r -= dot * v);
        slope += dot * at_zero[1];
        basis.push((v, at_zero));
    }
    ((rest.iter().map(|r| r * r).sum::<f64>() / rest.len() as f64).sqrt(), slope)
}

/// The tables; every point of every line is written to the file `scans`.
pub fn sheets(quick: bool, scans: Option<&Path>) -> Result<Vec<Sheet>, Failure> {
    let mut listing = String::from("scan,amplitude,cd,transition_upper,transition_lower\n");
    let count = if quick { 1 } else { 30 };
    let tripped = Set { title: "tripped", seed: 71, count, tripped: true, scatter: 1e-9, slope: 1e-3, binding: true };
    let free =
        Set { title: "free transition", seed: 72, count, tripped: false, scatter: 5e-9, slope: 1e-2, binding: true };
    let more = Set { title: "free transition, more lines", seed: 73, count: 60, binding: false, ..free };
    let mut sheets = vec![sheet(&tripped, &mut listing)?, sheet(&free, &mut listing)?];
    if !quick {
        sheets.push(sheet(&more, &mut listing)?);
    }
    if let Some(path) = scans {
        std::fs::write(path, listing).map_err(|e| format!("{}: {e}", path.display()))?;
    }
    Ok(sheets)
}

/// Lines drawn together, and what they are held to.
struct Set {
    title: &'static str,
    seed: u64,
    count: usize,
    tripped: bool,
    scatter: f64,
    slope: f64,
    /// Whether the slopes have to hold with free transition, or are only shown.
    binding: bool,
}

fn sheet(set: &Set, listing: &mut String) -> Result<Sheet, Failure> {
    let &Set { count, tripped, scatter, .. } = set;
    let mut random = Random::new(set.seed);
    let scans: Vec<Scan> = (0..count).map(|_| Scan::random(&mut random, tripped)).collect();
    let found = in_parallel(cores(), &scans, |scan| scan.run(1)).into_iter().collect::<Result<Vec<_>, String>>()?;
    let finer = in_parallel(cores(), &scans.iter().zip(&found).collect::<Vec<_>>(), |(scan, found)| match found {
        Some(f) if f.rms > scatter => scan.run(2),
        _ => Ok(None),
    });
    let finer = finer.into_iter().collect::<Result<Vec<_>, String>>()?;
    let text = format!(
        "{count} random lines through shape space: a Hicks-Henne bump on each surface, {} points over +-{REACH} chords, alpha 0\n\
         to 6, Re 1e6 to 6e6, M 0 to 0.3, warm starts from the neighbour, solver settings of the command. Scatter: root mean\n\
         square about the least-squares quintic (of degree {HIGH_DEGREE} beside it: what remains there is no mere bending; doubled: with\n\
         twice the panels and stations, where the usual ones scatter too much: what stays is the flow's, not the grid's; difference:\n\
         the scatter of the difference of the two drags, which the grid alone brings about). Slope: of the quintic (and of degree {HIGH_DEGREE})\n\
         in the middle, against the exact gradient; slopes below a thousandth of the drag over the reach count as that.\n\
         Jump: a third of the largest fourth difference, and its amplitude. Last column: drag from a cold start less that reached\n\
         along the line, at the ends.",
        2 * STEPS + 1
    );
    let mut sheet = Sheet::new(&format!("Smoothness of drag, {}", set.title), &text);
    let columns = [
        "lost",
        "CD",
        "rms, degree 5",
        "rms, degree 11",
        "doubled, degree 5",
        "difference, degree 5",
        "slope of fit",
        "exact",
        "slope error",
        "degree 11",
        "jump",
        "at",
        "cold - warm",
    ];
    let columns = columns.map(|name| (name, Align::Right));
    let mut figures = Table::new([("scan", Align::Left)].into_iter().chain(columns));
    for ((scan, found), finer) in scans.iter().zip(&found).zip(&finer) {
        let Some(f) = found else {
            figures.row([scan.describe() + ": not converged"]);
            continue;
        };
        figures.row([
            scan.describe(),
            f.lost.to_string(),
            format!("{:.7}", f.drag),
            format!("{:.1e}", f.rms),
            format!("{:.1e}", f.high_rms),
            finer.as_ref().map_or_else(String::new, |fine| format!("{:.1e}", fine.rms)),
            finer.as_ref().map_or_else(String::new, |fine| format!("{:.1e}", f.grid_rms(fine))),
            format!("{:.5e}", f.slope),
            format!("{:.5e}", f.exact),
            format!("{:.3} %", 100.0 * f.slope_error()),
            format!("{:.3} %", 100.0 * f.high_slope_error()),
            format!("{:.0e}", f.jump().0),
            format!("{:+.1e}", f.jump().1),
            format!("{:.0e}", f.cold),
        ]);
    }
    sheet.set_figures(figures);
    for (scan, found) in scans.iter().zip(&found) {
        for [x, drag, upper, lower] in found.iter().flat_map(|f| &f.points) {
            let _ = writeln!(listing, "\"{}\",{:.6e},{drag},{upper},{lower}", scan.describe(), REACH * x);
        }
    }
    let lines: Vec<&Found> = found.iter().flatten().collect();
    judge(&mut sheet, set, &lines);
    if !tripped {
        let of_grid = finer.iter().flatten().filter(|fine| fine.rms <= scatter).count();
        let what = "lines that scatter more, and would not if doubled";
        if set.binding {
            sheet.count_at_most(what, 0, Some(of_grid));
        } else {
            sheet.open(what, 0.0, of_grid as f64);
        }
    }
    Ok(sheet)
}

fn judge(sheet: &mut Sheet, set: &Set, lines: &[&Found]) {
    let &Set { count, scatter, slope, .. } = set;
    let worst = |of: fn(&Found) -> f64| lines.iter().map(|f| of(f)).fold(0.0, f64::max);
    let above = |of: fn(&Found) -> f64, bar: f64| lines.iter().filter(|f| !(of(f) <= bar)).count();
    sheet.count_at_most("lines whose section does not converge", 0, Some(count - lines.len()));
    sheet.count_at_most("points lost along the others", 0, Some(lines.iter().map(|f| f.lost).sum()));
    sheet.at_most("worst difference of cold and warm starts", 1e-9, worst(|f| f.cold));
    if set.tripped {
        sheet.at_most("worst scatter about the quintic", scatter, worst(|f| f.rms));
        sheet.count_at_most("lines that scatter more", 0, Some(above(|f| f.rms, scatter)));
    } else {
        // with free transition the lines bend more than a quintic can where transition moves fast
        sheet.open("worst scatter about the quintic", scatter, worst(|f| f.rms));
        sheet.open("lines that scatter more", 0.0, above(|f| f.rms, scatter) as f64);
        sheet.open("worst scatter about degree 11", scatter, worst(|f| f.high_rms));
        sheet.open("lines that scatter more about degree 11", 0.0, above(|f| f.high_rms, scatter) as f64);
    }
    if set.tripped {
        sheet.at_most("worst error of slope", slope, worst(Found::slope_error));
        sheet.count_at_most("lines with a worse slope", 0, Some(above(Found::slope_error, slope)));
        return;
    }
    if set.binding {
        // the slope of a quintic that cannot follow the drag is not the drag's
        sheet.open("worst error of slope", slope, worst(Found::slope_error));
        sheet.at_most("worst error of slope about degree 11", slope, worst(Found::high_slope_error));
        sheet.count_at_most("lines with a worse slope about degree 11", 0, Some(above(Found::high_slope_error, slope)));
    } else {
        // the slope of a polynomial that cannot follow the drag is not the drag's
        sheet.open("worst error of slope", slope, worst(Found::slope_error));
        sheet.open("lines with a worse slope", 0.0, above(Found::slope_error, slope) as f64);
        sheet.open("worst error of slope about degree 11", slope, worst(Found::high_slope_error));
        sheet.open("lines with a worse slope about degree 11", 0.0, above(Found::high_slope_error, slope) as f64);
    }
}
