//! The files of a run: results, figures and the page that shows them.

use super::design_files::named;
use super::failure::Failure;
use super::figures::{self, Sweep};
use super::html::{HtmlTable, Page};
use super::output::{fixed, pretty, settled};
use super::overview::{Derivatives, Overview, minimises_drag};
use crate::cad;
use crate::case::{Case, CaseOutcome};
use crate::design::{DerivativeCheck, DesignProblem, FlowTiming, OperatingPoint, Shape};
use crate::differentiate::{StepRange, finite_difference_jacobian};
use crate::flow::{Condition, FlowSection, Incidence, Solution, SolverChoice};
use crate::optimize::{History, Outcome};
use crate::report::engineering;
use crate::report::figures::Stroke;
use crate::report::json::{BoundsReport, DragParts, DragReport, RunReport};
use crate::section::{Measure, SeligFormat};
use std::time::{Duration, Instant};

/// The results of a run, ready to be written.
pub(super) struct RunResults {
    /// The content of `result.json`.
    pub report: RunReport,
    /// The part of the results that the terminal and the page show first.
    pub overview: Overview,
    derivatives: Derivatives,
    timing: FlowTiming,
}

impl RunResults {
    /// Evaluates the start and checks the gradients at the end.
    pub fn new(case: &mut Case, end: &CaseOutcome, timing: FlowTiming) -> Self {
        let report = RunReport::new(case, end);
        let derivatives = directional_derivatives(&mut case.problem, &end.variables);
        let overview = Overview::new(case, &report, &derivatives);
        Self { report, overview, derivatives, timing }
    }

    /// Names and contents of the files that hold the numbers of a run.
    pub fn numbers(
        &self,
        end: &CaseOutcome,
        case: &Case,
        history: &History,
    ) -> Result<Vec<(&'static str, String)>, Failure> {
        let wrong = |e: &dyn std::fmt::Display| Failure::Computation(format!("{}: {e}", case.name));
        Ok(vec![
            ("result.json", pretty(&self.report)?),
            ("final.dat", named(case, &end.shape.section).selig_with(&SeligFormat::default())),
            ("history.csv", history.to_csv().map_err(|e| wrong(&e))?),
        ])
    }

    /// Names and contents of the files that show what the numbers of a run say; `command` runs the case again.
    pub fn figures(
        &self,
        case: &Case,
        end: &CaseOutcome,
        history: &History,
        command: String,
    ) -> Result<Vec<(&'static str, String)>, Failure> {
        let name = &case.name;
        let wrong = |e: &dyn std::fmt::Display| Failure::Computation(format!("{name}: {e}"));
        let (problem, shape) = (&case.problem, &end.shape);
        let initial = problem.shape(&problem.start_values()).map_err(|e| wrong(&e))?;
        let start_figure = figures::design(problem, &initial, &format!("{name}: start"));
        let end_figure = figures::design(problem, shape, &format!("{name}: {}", end.outcome.status));
        // without a single objective there is nothing to draw
        let any = history.rows().iter().any(|row| row.objective.is_finite());
        let convergence =
            any.then(|| figures::convergence(history, &self.overview.objective, minimises_drag(case), name));
        let pressures = pressures(problem, &initial, shape);
        let section = named(case, &end.shape.section);
        let chord = Measure::Chord.evaluate(&section).map_err(|e| wrong(&e))?;
        let options = cad::Options { unit: cad::LengthUnit::likely_for(chord), ..cad::Options::named(section.name()) };
        let mut files = vec![
            ("initial.svg", start_figure.clone()),
            ("final.svg", end_figure.clone()),
            ("final.step", cad::step_with(section.curve(), &options).map_err(|e| wrong(&e))?),
        ];
        files.extend(convergence.clone().map(|svg| ("convergence.svg", svg)));
        files.extend(pressures.first().map(|(_, svg)| ("pressure.svg", svg.clone())));
        let fields = if end.outcome.evaluation.is_some() { mach_fields(problem, shape) } else { Vec::new() };
        files.extend(fields.first().map(|(_, svg)| ("mach.svg", svg.clone())));
        let mut shown = vec![("Start".to_string(), start_figure)];
        if end.outcome.evaluation.is_some() {
            shown.push(("End".to_string(), end_figure));
        }
        shown.extend(pressures);
        shown.extend(fields);
        let after = end.outcome.evaluation.is_some().then_some(shape);
        if let Some((heading, svg)) = polars(problem, &initial, after) {
            files.push(("polars.svg", svg.clone()));
            shown.push((heading, svg));
        }
        shown.extend(convergence.map(|svg| ("Convergence".to_string(), svg)));
        let page = Page {
            result: &self.report,
            overview: &self.overview,
            command,
            description: &case.description,
            figures: shown,
            tables: vec![
                drag_table(&self.report.drag),
                gradient_table(&self.derivatives),
                timing_table(self.timing, &end.outcome),
            ],
            case: &case.text,
            bounds: problem.geometry().variables().iter().map(|v| BoundsReport::from(v.bounds)).collect(),
        };
        files.push(("report.html", page.render()));
        Ok(files)
    }
}

/// Pressure before and after, a heading and a figure for each operating point that has a flow at either end.
fn pressures(problem: &DesignProblem, initial: &Shape, shape: &Shape) -> Vec<(String, String)> {
    let (Some(before), Some(after)) = (problem.flows(initial), problem.flows(shape)) else { return Vec::new() };
    let mut figures = Vec::new();
    for (k, point) in problem.operating_points().iter().enumerate() {
        let name = if point.name.is_empty() { "Pressure".into() } else { format!("Pressure at {}", point.name) };
        let (start, end) = (before.solutions[k].as_ref().ok(), after.solutions[k].as_ref().ok());
        if start.is_some() || end.is_some() {
            let title = figures::condition_text(&point.condition_at(shape));
            figures.push((name, figures::pressure_change(start, end, &title)));
        }
    }
    figures
}

/// Mach numbers about a shape, a heading and a figure for each operating point whose solver knows the field.
fn mach_fields(problem: &DesignProblem, shape: &Shape) -> Vec<(String, String)> {
    let Some(flows) = problem.flows(shape) else { return Vec::new() };
    let figure = |(solution, point): (&Solution, &OperatingPoint)| {
        let place = if point.name.is_empty() { String::new() } else { format!(" at {}", point.name) };
        let svg = figures::mach_field(solution, &format!("end: {}", figures::condition_text(&point.condition)))?;
        Some((format!("Mach number{place}"), svg))
    };
    let points = flows.solutions.iter().zip(problem.operating_points());
    points.filter_map(|(solution, point)| figure((solution.as_ref().ok()?, point))).collect()
}

/// Time for the sweep of one section; the sweep is cut where it takes longer.
const SWEEP_TIME: Duration = Duration::from_millis(1500);
/// Angles of a sweep beside the angle of the design, in degrees: first towards one end, then towards the other.
const SWEEP: [i32; 2] = [8, -6];

/// Polars of the sections at start and end (where there is one), at the operating point of largest weight.
fn polars(problem: &DesignProblem, initial: &Shape, shape: Option<&Shape>) -> Option<(String, String)> {
    let points = problem.operating_points();
    let (index, point) = points.iter().enumerate().max_by(|a, b| a.1.weight.total_cmp(&b.1.weight))?;
    let centre = |shape: &Shape| -> f64 {
        let own = problem.flows(shape).and_then(|flows| flows.solutions.into_iter().nth(index)?.ok());
        match point.condition.incidence {
            Incidence::Alpha(alpha) => own.map_or(alpha, |s| s.alpha),
            Incidence::Lift(_) => own.map_or(0.0, |s| s.alpha),
        }
    };
    let sweep = |shape: &Shape| {
        let section = problem.prepared_flow(shape)?.ok()?;
        Some(sweep(&*section, &point.condition, centre(shape)))
    };
    let (before, after) = (sweep(initial).unwrap_or_default(), shape.and_then(sweep).unwrap_or_default());
    let mut sweeps = vec![
        Sweep { name: "start", points: &before, stroke: Stroke::INITIAL },
        Sweep { name: "end", points: &after, stroke: Stroke::SECTION },
    ];
    sweeps.retain(|sweep| !sweep.points.is_empty());
    let place = if point.name.is_empty() { String::new() } else { format!(" at the conditions of {}", point.name) };
    let svg = figures::polars(&sweeps, &figures::surroundings_text(&point.condition));
    let both = if shape.is_some() { "Polars of start and end" } else { "Polars of the start" };
    (!before.is_empty() || !after.is_empty()).then(|| (format!("{both}{place}"), svg))
}

/// Flows at whole degrees beside `centre`, outwards from it for as long as the flow can be described and time allows;
/// in order of the angle.
fn sweep(section: &dyn FlowSection, condition: &Condition, centre: f64) -> Vec<Solution> {
    let begin = Instant::now();
    let solve = |degrees: i32, warm: Option<&Solution>| {
        let incidence = Incidence::Alpha(centre + f64::from(degrees).to_radians());
        section.analyze(&Condition { incidence, ..*condition }, warm).ok()
    };
    let mut points: Vec<Solution> = solve(0, None).into_iter().collect();
    for end in SWEEP {
        let mut last = points.iter().find(|s| s.is_reliable()).cloned();
        for step in 1..=end.abs() {
            if begin.elapsed() > SWEEP_TIME {
                break;
            }
            let Some(solution) = solve(step * end.signum(), last.as_ref()) else { break };
            let holds = solution.is_reliable();
            points.push(solution.clone());
            if !holds {
                break;
            }
            last = Some(solution);
        }
    }
    points.sort_by(|a, b| a.alpha.total_cmp(&b.alpha));
    points
}

/// Every derivative at the end along one fixed direction of all variables, exact and by differences.
fn directional_derivatives(problem: &mut DesignProblem, values: &[f64]) -> Derivatives {
    let steps = problem.steps();
    let direction: Vec<f64> =
        steps.iter().enumerate().map(|(k, step)| step * (12.9898 * (k + 1) as f64).sin()).collect();
    let (Ok(exact), Ok(near)) = (problem.gradients(values), problem.near(values)) else {
        return Derivatives::default();
    };
    let at = |t: &[f64]| {
        let moved: Vec<f64> = values.iter().zip(&direction).map(|(v, d)| v + t[0] * d).collect();
        near.quantities_at(&moved)
    };
    // drag scatters a little as a shock crosses cells, which only a small step does not see
    let shocks = problem.flow_solver() == Some(SolverChoice::Streamtube.name());
    let range = [StepRange { first: if shocks { 4e-4 } else { 4e-3 }, levels: 4 }];
    let Ok(differences) = finite_difference_jacobian(at, &[0.0], &range) else { return Derivatives::default() };
    let names = problem.quantities().iter().map(crate::design::Quantity::name).enumerate();
    let checks = names.filter(|(_, name)| !name.contains('[')).filter_map(|(q, quantity)| {
        let (_, gradient) = exact[q].as_ref()?;
        let along = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum::<f64>();
        let difference = &differences[(q, 0)];
        Some(DerivativeCheck {
            quantity,
            variable: "one direction of all".into(),
            exact: along,
            forward: along,
            difference: difference.value,
            difference_error: difference.error,
            scale: gradient.iter().zip(&steps).map(|(g, s)| (g * s).powi(2)).sum::<f64>().sqrt(),
        })
    });
    Derivatives { checks: checks.collect() }
}

/// Drag and its parts in counts, from start to end.
fn drag_table(points: &[DragReport]) -> HtmlTable {
    type Part = (&'static str, fn(&DragParts) -> f64);
    let parts: [Part; 4] = [
        ("drag", |d| d.cd),
        ("of it friction", |d| d.cd_friction),
        ("of it pressure", |d| d.cd_pressure),
        ("shocks, within the pressure", |d| d.cd_wave),
    ];
    let counts = |part: &Part, d: &Option<DragParts>| {
        d.as_ref().map_or_else(|| "none".to_string(), |d| fixed(1e4 * settled(part.1(d)), 2))
    };
    let rows = points.iter().flat_map(|d| {
        let row =
            |part: &Part| vec![d.point.clone(), part.0.to_string(), counts(part, &d.initial), counts(part, &d.end)];
        parts.iter().map(row).collect::<Vec<_>>()
    });
    let columns = vec!["operating point", "", "start, counts", "end, counts"];
    HtmlTable { heading: "Drag", columns, rows: rows.collect() }
}

fn gradient_table(derivatives: &Derivatives) -> HtmlTable {
    let row = |check: &DerivativeCheck| {
        vec![
            check.quantity.clone(),
            engineering(check.exact, 10),
            engineering(check.difference, 10),
            format!("{:.1e}", check.difference - check.exact),
            format!("{:.1e}", check.difference_error),
            if check.agrees() { "agrees".into() } else { "disagrees".into() },
        ]
    };
    HtmlTable {
        heading: "Gradient check along one direction of all variables (aeroform gradients has all)",
        columns: vec!["quantity", "exact", "finite difference", "deviation", "its own estimate", ""],
        rows: derivatives.checks.iter().map(row).collect(),
    }
}

fn timing_table(timing: FlowTiming, outcome: &Outcome) -> HtmlTable {
    let row = |name: &str, count: String, seconds: f64| {
        let share = if outcome.seconds > 0.0 { 100.0 * seconds / outcome.seconds } else { 0.0 };
        vec![name.to_string(), count, format!("{seconds:.3}"), format!("{share:.0} %")]
    };
    let rows = vec![
        row("flow solutions", timing.solutions.to_string(), timing.solution_seconds),
        row("their gradients", timing.gradients.to_string(), timing.gradient_seconds),
        row("whole run (wall clock)", outcome.evaluations.to_string(), outcome.seconds),
    ];
    let columns = vec!["what", "number", "seconds (over all threads)", "share of the run"];
    HtmlTable { heading: "Timing", columns, rows }
}
