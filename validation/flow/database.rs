//! Convergence from a cold start over a directory of coordinate files.

use super::common::{PANELS, cores, in_parallel, panelled};
use crate::Failure;
use crate::random::Random;
use crate::sheet::Sheet;
use aeroform::flow::{Condition, Incidence, PanelledSection, Settings, Status};
use aeroform::report::{Align, Table};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Share of points that should converge, files that are no section counted in: at a Reynolds number of a million, and
/// at others.
const SHARE: f64 = 0.99;
const SHARE_ELSEWHERE: f64 = 0.98;
/// Points listed among the worst.
const LISTED: usize = 25;

/// Arguments of the run over a database.
#[derive(Debug, Clone, clap::Args)]
pub struct Database {
    /// Instead of the tables of the topic flow: convergence over every .dat file of this directory
    #[arg(long, value_name = "DIR")]
    database: Option<PathBuf>,
    /// With --database: only so many of the files, drawn at random
    #[arg(long, value_name = "N", requires = "database")]
    sample: Option<usize>,
    /// With --sample: seed of the drawing
    #[arg(long, default_value_t = 1, requires = "sample")]
    seed: u64,
    /// With --database: angles of attack in degrees
    #[arg(long, value_delimiter = ',', default_value = "0,4,8", allow_hyphen_values = true, requires = "database")]
    alphas: Vec<f64>,
    /// With --database: Reynolds numbers
    #[arg(long, value_delimiter = ',', default_value = "1e6", requires = "database")]
    reynolds: Vec<f64>,
    /// With --database: trips on both sides, x in chords
    #[arg(long, value_name = "X", requires = "database")]
    trip: Option<f64>,
    /// With --database: number of panels
    #[arg(long, default_value_t = PANELS, requires = "database")]
    panels: usize,
    /// With --database: threads [default: all cores]
    #[arg(long, value_name = "N", requires = "database")]
    jobs: Option<usize>,
    /// With --database: where the points are listed
    #[arg(long, value_name = "FILE", default_value = "flow-database.csv", requires = "database")]
    csv: PathBuf,
}

/// One point of one section.
#[derive(Clone)]
struct Point {
    section: String,
    alpha: f64,
    reynolds: f64,
    /// One word: a status of the solver, or what came before it.
    status: &'static str,
    detail: String,
    coefficients: Option<[f64; 5]>,
    residual: f64,
    iterations: usize,
    /// Number of attempts before the one that counts, and the iterations they took.
    attempts: (usize, usize),
    milliseconds: f64,
}

impl Database {
    /// Whether there is a database to go through.
    pub fn is_given(&self) -> bool {
        self.database.is_some()
    }

    fn files(&self, directory: &Path) -> Result<Vec<PathBuf>, Failure> {
        let named = |e: std::io::Error| format!("{}: {e}", directory.display());
        let mut files = Vec::new();
        for entry in std::fs::read_dir(directory).map_err(named)? {
            let path = entry.map_err(named)?.path();
            if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("dat")) {
                files.push(path);
            }
        }
        files.sort();
        if files.is_empty() {
            return Err(format!("{}: no .dat files", directory.display()).into());
        }
        if let Some(sample) = self.sample {
            let mut random = Random::new(self.seed);
            let wanted = sample.min(files.len());
            for k in 0..wanted {
                let other = random.whole(k, files.len() - 1);
                files.swap(k, other);
            }
            files.truncate(wanted);
            files.sort();
        }
        Ok(files)
    }

    /// All points of one file, each from a cold start.
    fn points(&self, path: &Path) -> Vec<Point> {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let _witness = Witness(&name);
        let panels = panelled(&path.to_string_lossy(), self.panels);
        let mut points = Vec::new();
        for &reynolds in &self.reynolds {
            for &alpha in &self.alphas {
                let empty = Point {
                    section: name.clone(),
                    alpha,
                    reynolds,
                    status: "no-section",
                    detail: String::new(),
                    coefficients: None,
                    residual: f64::NAN,
                    iterations: 0,
                    attempts: (0, 0),
                    milliseconds: 0.0,
                };
                points.push(match &panels {
                    Ok(panels) => self.point(panels, empty),
                    Err(error) => Point { detail: error.to_string(), ..empty },
                });
            }
        }
        points
    }

    fn point(&self, panels: &PanelledSection, empty: Point) -> Point {
        let incidence = Incidence::Alpha(empty.alpha.to_radians());
        let condition = Condition { trips: [self.trip; 2], ..Condition::new(incidence, empty.reynolds) };
        let begin = Instant::now();
        let result = panels.analyze(&condition, &Settings::default(), None);
        let milliseconds = 1e3 * begin.elapsed().as_secs_f64();
        let s = match result {
            Ok(solution) => solution,
            Err(error) => return Point { status: "refused", detail: error.to_string(), milliseconds, ..empty },
        };
        let status = match s.status {
            Status::Converged => "converged",
            Status::NotConverged { .. } | Status::OutsideModel { converged: false, .. } => "not-converged",
            Status::LiftOutOfReach { .. } => "out-of-reach",
            Status::Separated { .. } => "separated",
            Status::Unresolved { .. } => "unresolved",
            Status::OutsideModel { .. } => "supersonic",
        };
        let detail = s.attempts.iter().map(|a| format!("{}: {} ({:.1e})", a.what, a.iterations, a.residual));
        Point {
            status,
            detail: detail.collect::<Vec<_>>().join("; "),
            coefficients: (s.is_reliable() || status == "separated").then_some([
                s.coefficients.cl,
                s.coefficients.cd,
                s.coefficients.cm,
                s.coefficients.transition[0],
                s.coefficients.transition[1],
            ]),
            residual: s.residual,
            iterations: s.iterations,
            attempts: (s.attempts.len(), s.attempts.iter().map(|a| a.iterations).sum()),
            milliseconds,
            ..empty
        }
    }
}

/// Names the section in whose calculation a panic happens.
struct Witness<'a>(&'a str);

impl Drop for Witness<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("validate: PANIC in section {}", self.0);
        }
    }
}

pub fn sheets(arguments: &Database) -> Result<Vec<Sheet>, Failure> {
    let Some(directory) = &arguments.database else { return Err("--database names no directory".into()) };
    let files = arguments.files(directory)?;
    // now rather than after the work
    std::fs::write(&arguments.csv, "").map_err(|e| format!("{}: {e}", arguments.csv.display()))?;
    let jobs = arguments.jobs.unwrap_or_else(cores);
    let (begin, done) = (Instant::now(), AtomicUsize::new(0));
    let points: Vec<Vec<Point>> = in_parallel(jobs, &files, |path| {
        let points = arguments.points(path);
        let count = done.fetch_add(1, Ordering::Relaxed) + 1;
        if count % 100 == 0 || count == files.len() {
            eprintln!("validate: {count} of {} sections, {:.0} s", files.len(), begin.elapsed().as_secs_f64());
        }
        points
    });
    let seconds = begin.elapsed().as_secs_f64();
    std::fs::write(&arguments.csv, csv(&points)).map_err(|e| format!("{}: {e}", arguments.csv.display()))?;
    Ok(vec![summary(arguments, &points, seconds, jobs), statuses(&points), worst(&points)])
}

fn csv(points: &[Vec<Point>]) -> String {
    let mut text = String::from(
        "section,alpha,reynolds,status,cl,cd,cm,transition_upper,transition_lower,residual,iterations,attempts,iterations_before,milliseconds,detail\n",
    );
    for p in points.iter().flatten() {
        let coefficients = p.coefficients.map_or(",,,,".into(), |c| c.map(|c| c.to_string()).join(","));
        let detail = p.detail.replace('"', "'");
        let _ = writeln!(
            text,
            "\"{}\",{},{},{},{coefficients},{:.3e},{},{},{},{:.2},\"{detail}\"",
            p.section,
            p.alpha,
            p.reynolds,
            p.status,
            p.residual,
            p.iterations,
            p.attempts.0,
            p.attempts.1,
            p.milliseconds
        );
    }
    text
}

fn percent(part: usize, whole: usize) -> String {
    format!("{:.2} %", 100.0 * part as f64 / whole.max(1) as f64)
}

fn summary(arguments: &Database, points: &[Vec<Point>], seconds: f64, jobs: usize) -> Sheet {
    let sections = points.iter().filter(|p| p.iter().all(|p| p.status != "no-section")).count();
    let total: usize = points.iter().map(Vec::len).sum();
    let drawn = arguments.sample.map_or(String::new(), |_| format!(" (drawn at random, seed {})", arguments.seed));
    let text = format!(
        "{} coordinate files{drawn}, of which {sections} give panels; {} panels, M 0, {}; every point from a cold start.\n\
         {total} points took {seconds:.1} s on {jobs} threads, panels included. All points are in {}.",
        points.len(),
        arguments.panels,
        arguments.trip.map_or("free transition".into(), |x| format!("trips at {x}")),
        arguments.csv.display()
    );
    let mut sheet = Sheet::new("Convergence over a database of sections", &text);
    let mut figures = Table::new([
        ("Re", Align::Right),
        ("alpha", Align::Right),
        ("points", Align::Right),
        ("converged", Align::Right),
        ("share", Align::Right),
        ("at first attempt", Align::Right),
        ("median ms", Align::Right),
        ("99 % ms", Align::Right),
        ("slowest ms", Align::Right),
        ("mean iterations", Align::Right),
    ]);
    let mut shares = Vec::new();
    for &reynolds in &arguments.reynolds {
        for &alpha in &arguments.alphas {
            let these: Vec<&Point> =
                points.iter().flatten().filter(|p| p.alpha == alpha && p.reynolds == reynolds).collect();
            let computed: Vec<&&Point> = these.iter().filter(|p| p.status != "no-section").collect();
            let converged = computed.iter().filter(|p| p.status == "converged").count();
            let first = computed.iter().filter(|p| p.status == "converged" && p.attempts.0 == 0).count();
            let mut times: Vec<f64> = computed.iter().map(|p| p.milliseconds).collect();
            times.sort_by(f64::total_cmp);
            let quantile = |q: f64| times.get(((times.len() as f64 - 1.0) * q).max(0.0) as usize).copied();
            let shown = |q: f64| format!("{:.1}", quantile(q).unwrap_or(f64::NAN));
            let iterations: usize = computed.iter().map(|p| p.iterations + p.attempts.1).sum();
            figures.row([
                format!("{reynolds:.1e}"),
                alpha.to_string(),
                computed.len().to_string(),
                converged.to_string(),
                percent(converged, computed.len()),
                percent(first, computed.len()),
                shown(0.5),
                shown(0.99),
                shown(1.0),
                format!("{:.1}", iterations as f64 / computed.len().max(1) as f64),
            ]);
        }
        let all = |p: &&Vec<Point>| p.iter().filter(|p| p.reynolds == reynolds).all(|p| p.status == "converged");
        let every = points.iter().filter(all).count();
        let cells = [format!("{reynolds:.1e}"), "all".into(), sections.to_string(), every.to_string()];
        figures.row(cells.into_iter().chain([percent(every, sections)]));
        let here: Vec<_> = points.iter().flatten().filter(|p| p.reynolds == reynolds).collect();
        let of = |wanted: &[&str]| {
            let count = here.iter().filter(|p| wanted.contains(&p.status)).count();
            count as f64 / here.len().max(1) as f64
        };
        shares.push((reynolds, of(&["converged"]), of(&["converged", "separated", "supersonic"])));
    }
    sheet.set_figures(figures);
    for (reynolds, within, share) in shares {
        let bar = if reynolds == 1e6 { SHARE } else { SHARE_ELSEWHERE };
        let what = format!(
            "share of all points that converges, Re {reynolds:.1e} ({:.2} % with those beyond the model)",
            100.0 * share
        );
        sheet.at_least(&what, bar, within);
    }
    sheet
}

fn statuses(points: &[Vec<Point>]) -> Sheet {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for p in points.iter().flatten() {
        *counts.entry(p.status).or_default() += 1;
    }
    let total: usize = counts.values().sum();
    let mut figures = Table::new([("status", Align::Left), ("points", Align::Right), ("share", Align::Right)]);
    for (status, count) in counts {
        figures.row([status.to_owned(), count.to_string(), percent(count, total)]);
    }
    let text = "How the points ended; 'no-section': a file that is no section or gives no panels; 'refused': an error\n\
                instead of a solution.";
    let mut sheet = Sheet::new("Statuses", text);
    sheet.set_figures(figures);
    sheet
}

/// Sections with most failures, and the slowest points.
fn worst(points: &[Vec<Point>]) -> Sheet {
    let mut figures = Table::new([
        ("section", Align::Left),
        ("alpha", Align::Right),
        ("Re", Align::Right),
        ("status", Align::Left),
        ("residual", Align::Right),
        ("iterations", Align::Right),
        ("before", Align::Right),
        ("ms", Align::Right),
        ("tried", Align::Left),
    ]);
    let failed = |p: &Point| p.status != "converged";
    let mut sections: Vec<&Vec<Point>> = points.iter().filter(|p| p.iter().any(failed)).collect();
    sections.sort_by_key(|p| std::cmp::Reverse(p.iter().filter(|p| failed(p)).count()));
    let mut listed: Vec<&Point> = sections.into_iter().flatten().filter(|p| failed(p)).take(LISTED).collect();
    let mut slow: Vec<&Point> = points.iter().flatten().collect();
    slow.sort_by(|a, b| b.milliseconds.total_cmp(&a.milliseconds));
    listed.extend(slow.into_iter().take(5));
    for p in listed {
        let tried: String = p.detail.chars().take(70).collect();
        figures.row([
            p.section.clone(),
            p.alpha.to_string(),
            format!("{:.1e}", p.reynolds),
            p.status.to_owned(),
            format!("{:.1e}", p.residual),
            p.iterations.to_string(),
            p.attempts.1.to_string(),
            format!("{:.1}", p.milliseconds),
            tried,
        ]);
    }
    let text = format!("The first {LISTED} points of the sections with most failures, then the five slowest points.");
    let mut sheet = Sheet::new("Worst points", &text);
    sheet.set_figures(figures);
    sheet
}
