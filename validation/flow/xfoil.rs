//! Blunt sections against XFOIL, and against our own solution with twice the resolution.

use super::common::{PANELS, bubbles, cores, in_parallel, panelled};
use super::reference::{Reference, Row};
use crate::Failure;
use crate::sheet::Sheet;
use aeroform::flow::{Condition, Incidence, Settings, Solution};
use aeroform::report::{Align, Table};

/// A point of the table of XFOIL.
struct Point {
    name: String,
    section: String,
    condition: Condition,
    /// One of the points at Re 5e6, which are of one run of XFOIL; the others were collected elsewhere.
    main: bool,
    /// CL, CD; CM and transition where they are known.
    lift: f64,
    drag: f64,
    moment: Option<f64>,
    transition: [Option<f64>; 2],
}

impl Point {
    fn new(row: Row) -> Result<Option<Self>, Failure> {
        let (Some(lift), Some(drag)) = (row.number("CL")?, row.number("CD")?) else { return Ok(None) };
        let section = row.text("case")?.to_owned();
        let [degrees, reynolds, mach] = [row.required("alpha")?, row.required("Re")?, row.required("Mach")?];
        let trips = row.trips()?;
        let condition = Condition { mach, trips, ..Condition::new(Incidence::Alpha(degrees.to_radians()), reynolds) };
        let name = format!("{section} {degrees:>4} M {mach:<4} Re {reynolds:.0e} {:>4}", row.text("xtrip")?);
        let transition = [row.number("xtr_top")?, row.number("xtr_bot")?];
        let main = reynolds == 5e6;
        Ok(Some(Self { name, section, condition, main, lift, drag, moment: row.number("CM")?, transition }))
    }

    fn solve(&self, factor: usize) -> Result<Solution, String> {
        let default = Settings::default();
        let settings = Settings {
            laminar_stations: factor * default.laminar_stations,
            turbulent_stations: factor * default.turbulent_stations,
            ..default
        };
        let panels = panelled(&self.section, factor * PANELS).map_err(|e| e.to_string())?;
        panels.analyze(&self.condition, &settings, None).map_err(|e| e.to_string())
    }
}

fn points() -> Result<Vec<Point>, Failure> {
    let reference = Reference::new(include_str!("../reference/flow/xfoil_blunt.csv"));
    let points: Result<Vec<Option<Point>>, Failure> = reference.rows().map(Point::new).collect();
    Ok(points?.into_iter().flatten().collect())
}

/// Differences of one point and where they are beyond the bars.
struct Compared {
    lift: f64,
    drag: f64,
    moment: Option<f64>,
    transition: [Option<f64>; 2],
    bubble: [bool; 2],
    beyond: Vec<&'static str>,
}

/// Counts of one set of points, worst differences of drag and moment.
#[derive(Clone, Copy, Default)]
struct Tally {
    all: usize,
    converged: usize,
    within: usize,
    worst: [f64; 2],
}

fn compare(point: &Point, s: &Solution) -> Compared {
    let lift = s.coefficients.cl - point.lift;
    let drag = s.coefficients.cd / point.drag - 1.0;
    let moment = point.moment.map(|m| s.coefficients.cm - m);
    let bubble = bubbles(s);
    let transition = [0, 1].map(|k| point.transition[k].map(|x| s.coefficients.transition[k] - x));
    let mut beyond = Vec::new();
    // written so that NaN is beyond
    if !(lift.abs() <= 0.005 + 0.007 * point.lift.abs()) {
        beyond.push("CL");
    }
    if !(drag.abs() <= 0.025) {
        beyond.push("CD");
    }
    if moment.is_some_and(|m| !(m.abs() <= 0.002)) {
        beyond.push("CM");
    }
    for (k, name) in ["xtr upper", "xtr lower"].into_iter().enumerate() {
        let bar = if bubble[k] { 0.03 } else { 0.01 };
        if transition[k].is_some_and(|d| !(d.abs() <= bar)) {
            beyond.push(name);
        }
    }
    Compared { lift, drag, moment, transition, bubble, beyond }
}

pub fn sheets(quick: bool) -> Result<Vec<Sheet>, Failure> {
    let mut points = points()?;
    if quick {
        points = points.into_iter().step_by(9).collect();
    }
    let solutions = in_parallel(cores(), &points, |point| point.solve(1));
    let solutions = solutions.into_iter().collect::<Result<Vec<_>, String>>()?;
    if quick {
        return Ok(vec![against_xfoil(&points, &solutions)]);
    }
    let fine = in_parallel(cores(), &points, |point| point.solve(2));
    let fine = fine.into_iter().collect::<Result<Vec<_>, String>>()?;
    Ok(vec![against_xfoil(&points, &solutions), resolution(&points, &solutions, &fine)])
}

fn optional(value: Option<f64>, digits: usize) -> String {
    value.map_or(String::new(), |v| format!("{v:+.digits$}"))
}

fn against_xfoil(points: &[Point], solutions: &[Solution]) -> Sheet {
    let text = format!(
        "Sections with open trailing edges at {PANELS} panels placed as the command places them, cold starts, against XFOIL 6.99 at\n\
         160 panels (reference/flow/xfoil_blunt.csv; points at which XFOIL did not converge are left out). Differences: ours less\n\
         XFOIL's; that of drag relative. Bars: CL 0.005 + 0.7 %, CD 2.5 %, CM 0.002, transition 0.01 chord, 0.03 where our laminar\n\
         layer has separated before it (u, l: bubble on the upper, lower side)."
    );
    let mut sheet = Sheet::new("Blunt sections against XFOIL 6.99", &text);
    let right = ["CL", "XFOIL", "dCL", "CD", "XFOIL", "dCD", "CM", "dCM", "xtr upper", "d", "xtr lower", "d"];
    let columns = std::iter::once(("point", Align::Left)).chain(right.map(|name| (name, Align::Right)));
    let mut figures = Table::new(columns.chain([("bubble", Align::Left), ("beyond", Align::Left)]));
    let mut sets = [Tally::default(); 2];
    for (point, s) in points.iter().zip(solutions) {
        let c = compare(point, s);
        let set = &mut sets[usize::from(!point.main)];
        set.all += 1;
        if !s.is_reliable() {
            let cells = std::iter::repeat_n(String::new(), 13).chain([s.status.to_string()]);
            figures.row(std::iter::once(point.name.clone()).chain(cells));
            continue;
        }
        set.converged += 1;
        set.within += usize::from(c.beyond.is_empty());
        let moment = c.moment.unwrap_or(0.0);
        for (worst, value) in set.worst.iter_mut().zip([c.drag.abs(), moment.abs()]) {
            *worst = worst.max(value);
        }
        let bubble = [(c.bubble[0], "u"), (c.bubble[1], "l")].iter().filter(|b| b.0).map(|b| b.1).collect::<String>();
        figures.row([
            point.name.clone(),
            format!("{:.5}", s.coefficients.cl),
            format!("{:.5}", point.lift),
            format!("{:+.5}", c.lift),
            format!("{:.6}", s.coefficients.cd),
            format!("{:.6}", point.drag),
            format!("{:+.2} %", 100.0 * c.drag),
            format!("{:.5}", s.coefficients.cm),
            optional(c.moment, 5),
            format!("{:.4}", s.coefficients.transition[0]),
            optional(c.transition[0], 4),
            format!("{:.4}", s.coefficients.transition[1]),
            optional(c.transition[1], 4),
            bubble,
            c.beyond.join(", "),
        ]);
    }
    sheet.set_figures(figures);
    for (name, set) in ["blunt points at Re 5e6", "other blunt points"].into_iter().zip(sets) {
        let all = set.all;
        sheet.count_at_least(&format!("of {all} {name}, converged"), all, set.converged);
        sheet.count_at_least(&format!("of {all} {name}, within the bars"), share(all), set.within);
        sheet.open(&format!("{name}: worst difference of drag, relative"), 0.025, set.worst[0]);
        sheet.open(&format!("{name}: worst difference of moment"), 0.002, set.worst[1]);
    }
    sheet
}

/// The share of points that should lie within the bars: 95 %.
fn share(all: usize) -> usize {
    all * 95 / 100
}

fn resolution(points: &[Point], solutions: &[Solution], fine: &[Solution]) -> Sheet {
    let settings = Settings::default();
    let text = format!(
        "The same points with {} panels, {} laminar and {} turbulent stations a side. Differences: usual less fine.",
        2 * PANELS,
        2 * settings.laminar_stations,
        2 * settings.turbulent_stations
    );
    let mut sheet = Sheet::new("Twice the resolution", &text);
    let right = ["CL", "dCL", "CD", "dCD", "CM", "dCM", "d xtr upper", "d xtr lower"];
    let columns = std::iter::once(("point", Align::Left)).chain(right.map(|name| (name, Align::Right)));
    let mut figures = Table::new(columns.chain([("", Align::Left)]));
    let (mut within, mut compared) = (0, 0);
    let mut worst = (0.0f64, String::new());
    for ((point, s), fine) in points.iter().zip(solutions).zip(fine) {
        if !s.is_reliable() || !fine.is_reliable() {
            let which = if s.is_reliable() { "fine" } else { "usual" };
            let status = if s.is_reliable() { &fine.status } else { &s.status };
            let cells = std::iter::repeat_n(String::new(), 8).chain([format!("{which}: {status}")]);
            figures.row(std::iter::once(point.name.clone()).chain(cells));
            continue;
        }
        compared += 1;
        let drag = s.coefficients.cd / fine.coefficients.cd - 1.0;
        within += usize::from(drag.abs() <= 0.005);
        if drag.abs() > worst.0 {
            worst = (drag.abs(), point.name.clone());
        }
        figures.row([
            point.name.clone(),
            format!("{:.5}", fine.coefficients.cl),
            format!("{:+.5}", s.coefficients.cl - fine.coefficients.cl),
            format!("{:.6}", fine.coefficients.cd),
            format!("{:+.3} %", 100.0 * drag),
            format!("{:.5}", fine.coefficients.cm),
            format!("{:+.5}", s.coefficients.cm - fine.coefficients.cm),
            format!("{:+.4}", s.coefficients.transition[0] - fine.coefficients.transition[0]),
            format!("{:+.4}", s.coefficients.transition[1] - fine.coefficients.transition[1]),
            if drag.abs() <= 0.005 { String::new() } else { "CD".into() },
        ]);
    }
    sheet.set_figures(figures);
    let all = points.len();
    sheet.count_at_least(&format!("of {all} points, converged on both"), all, compared);
    sheet.count_at_least(&format!("of {compared} points, drag within 0.5 %"), share(compared), within);
    sheet.open(&format!("worst difference of drag, relative ({})", worst.1.trim()), 0.005, worst.0);
    sheet
}
