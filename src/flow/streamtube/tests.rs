//! Flows through the public door and with the parts of the solver: known values, consistency, exact derivatives.

use super::equations::Held;
use super::gas::Parameters;
use super::grading::Stations;
use super::limits::{Limits, PATIENCE};
use super::newton::{From, solve};
use super::numbering::{GLOBALS, Grid, Place, Unknowns};
use super::outputs::{FRICTION_DRAG, LIFT, MOMENT, OUTPUTS, Peak, VISCOUS_DRAG, WAVE_DRAG, outputs};
use super::record::StreamtubeRecord;
use super::section_curve::SectionCurve;
use super::settings::StreamtubeSettings;
use super::solver::StreamtubeSolver;
use super::start::{Guess, climb};
use super::system::{Evaluation, Problem};
use crate::differentiate::Tangent;
use crate::flow::layer::Side;
use crate::flow::testcases::naca_symmetric;
use crate::flow::{Condition, FlowSolver, Incidence, PanelledSection, Solution, Status, TrailingEdge};
use std::any::Any;
use std::sync::OnceLock;

/// A grid that is coarse enough for tests.
const COARSE: StreamtubeSettings =
    StreamtubeSettings { cells: 60, tubes: 14, reach: 5.0, tolerance: 1e-10, iterations: 60, retry: true };

fn solver() -> StreamtubeSolver {
    StreamtubeSolver { settings: COARSE }
}

/// A section of NACA's symmetric family with camber added to it.
fn cambered(thickness: f64, gap: f64, camber: f64) -> Vec<[f64; 2]> {
    let bend = |[x, y]: [f64; 2]| [x, y + 4.0 * camber * x * (1.0 - x)];
    naca_symmetric(thickness, gap, 161).into_iter().map(bend).collect()
}

fn analyze(nodes: &[[f64; 2]], edge: TrailingEdge, condition: &Condition, warm: Option<&Solution>) -> Solution {
    solver().section(nodes, edge).unwrap().analyze(condition, warm).unwrap()
}

fn tripped(mach: f64, incidence: Incidence) -> Condition {
    Condition { mach, trips: [Some(0.1); 2], ..Condition::new(incidence, 5e6) }
}

/// A lifting flow with a shock.
fn shock() -> &'static (Vec<[f64; 2]>, Solution) {
    static FLOW: OnceLock<(Vec<[f64; 2]>, Solution)> = OnceLock::new();
    FLOW.get_or_init(|| {
        let nodes = cambered(0.12, 0.0, 0.01);
        let solution = analyze(&nodes, TrailingEdge::Sharp, &tripped(0.75, Incidence::Alpha(0.025)), None);
        assert!(solution.is_reliable(), "{}", solution.status);
        (nodes, solution)
    })
}

fn record(solution: &Solution) -> &StreamtubeRecord {
    let record: &dyn Any = &*solution.record;
    record.downcast_ref().unwrap()
}

fn peaks(record: &StreamtubeRecord) -> [Peak; 2] {
    *record.peaks()
}

/// Reach of the domain in which other programs computed the values that flows without boundary layer are compared with.
const PROGRAMS: f64 = 2.5;

/// Flow without boundary layer at an angle of attack in radians.
fn inviscid(nodes: &[[f64; 2]], mach: f64, alpha: f64, reach: f64) -> [f64; OUTPUTS] {
    let panels = PanelledSection::new(nodes, TrailingEdge::Sharp).unwrap();
    let curve = SectionCurve::new(&panels.nodes.inside).unwrap();
    let nose = curve.arc_length(curve.nose());
    let transition = Side::BOTH.map(|side| 0.1 * side.length(nose, curve.total()));
    let parameters = Parameters { mach, reynolds: 1e6, incidence: alpha, strength: 1.0, threshold: 0.98, order: 1.0 };
    let size = StreamtubeSettings { reach, ..StreamtubeSettings::default() }.size();
    let problem = Problem {
        grid: Grid { stations: Stations::new(size, [0.1; 2]), viscous: false },
        nodes: panels.nodes.inside.clone(),
        trips: [None; 2],
        critical: 9.0,
        held: Held::Angle,
        fixed_transition: Some(transition),
        parameters,
    };
    let guess = Guess {
        stagnation: nose,
        circulation: 0.0,
        alpha,
        transition,
        relaxed: true,
        lift_first: false,
        patience: PATIENCE,
        layers: None,
    };
    let settings = StreamtubeSettings { tolerance: 1e-11, ..StreamtubeSettings::default() };
    let (mut unknowns, ended) = climb(&problem, &guess, &settings);
    assert!(ended.converged, "{ended:?}");
    let limits = Limits::new(10, settings.tolerance);
    assert!(solve(&problem, None, &mut unknowns, &limits).converged);
    StreamtubeRecord::new(problem, unknowns, panels.nodes.clone()).outputs
}

#[test]
fn subsonic_flow_without_layer_has_no_drag() {
    let nodes = naca_symmetric(0.12, 0.0, 161);
    let reach = StreamtubeSettings::default().reach;
    assert!(inviscid(&nodes, 0.71, 0.0, reach)[WAVE_DRAG].abs() < 1e-9);
    // the highest Mach number is 0.987: the dissipation has begun, whatever the domain
    assert!(inviscid(&nodes, 0.72, 0.0, reach)[WAVE_DRAG].abs() < 1e-8);
    assert!(inviscid(&nodes, 0.5, 1.25f64.to_radians(), reach)[WAVE_DRAG].abs() < 1e-12);
}

#[test]
fn subsonic_flow_without_layer_has_the_known_pressures() {
    let nodes = naca_symmetric(0.12, 0.0, 161);
    // MSES: -0.6677, CFL3D: -0.6687
    let fast = inviscid(&nodes, 0.72, 0.0, PROGRAMS);
    assert!((fast[super::outputs::LOWEST_PRESSURE] + 0.668).abs() < 0.003, "{fast:?}");
    // MSES: 0.17856 and -0.0018
    let lifting = inviscid(&nodes, 0.5, 1.25f64.to_radians(), PROGRAMS);
    assert!((lifting[LIFT] - 0.1783).abs() < 0.0006 && (lifting[MOMENT] + 0.0019).abs() < 2e-4, "{lifting:?}");
}

#[test]
fn shocks_without_layer_have_the_known_drag() {
    let found = inviscid(&naca_symmetric(0.12, 0.0, 161), 0.8, 1.25f64.to_radians(), PROGRAMS);
    // MSES: 0.3469 and 0.0221; other Euler solvers 0.333 to 0.355 and 0.0214 to 0.0230
    assert!((found[LIFT] - 0.350).abs() < 0.007 && (found[WAVE_DRAG] - 0.0223).abs() < 4e-4, "{found:?}");
}

#[test]
fn the_thick_section_of_the_paper() {
    let nodes = naca_symmetric(0.24, 0.0, 161);
    let section = StreamtubeSolver::default().section(&nodes, TrailingEdge::Sharp).unwrap();
    let solution = section.analyze(&tripped(0.7, Incidence::Alpha(0.0)), None).unwrap();
    assert!(solution.is_reliable() && solution.solver == "streamtube", "{}", solution.status);
    let c = &solution.coefficients;
    // MSES: 0.03208, of which 0.0126 in the shock, and -1.582
    assert!((0.0313..0.0326).contains(&c.cd), "{}", c.cd);
    assert!((0.0124..0.0131).contains(&solution.cd_wave), "{}", solution.cd_wave);
    assert!((-1.59..-1.56).contains(&c.cp_min) && c.cl.abs() < 1e-9, "{c:?}");
    assert!((c.transition[0] - 0.1).abs() < 1e-5);
    assert!((solution.cd_pressure + solution.cd_friction - c.cd).abs() < 1e-15);
}

#[test]
fn lift_hardly_depends_on_the_cells_at_the_trailing_edge() {
    // a section that carries much of its load behind the middle
    let aft = |[x, y]: [f64; 2]| [x, y + 0.1 * x * x * x * (1.0 - x)];
    let nodes: Vec<[f64; 2]> = naca_symmetric(0.12, 0.0, 161).into_iter().map(aft).collect();
    let condition = tripped(0.3, Incidence::Alpha(0.02));
    let lift = |settings: StreamtubeSettings| {
        let section = StreamtubeSolver { settings }.section(&nodes, TrailingEdge::Sharp).unwrap();
        let solution = section.analyze(&condition, None).unwrap();
        assert!(solution.is_reliable(), "{}", solution.status);
        solution.coefficients.cl
    };
    let (coarse, fine) = (lift(COARSE), lift(StreamtubeSettings::default()));
    assert!((coarse / fine - 1.0).abs() < 0.004, "{coarse} {fine}");
}

#[test]
fn the_result_does_not_depend_on_the_start() {
    let (nodes, cold) = shock();
    let thick = cambered(0.14, 0.0, 0.01);
    let condition = tripped(0.74, Incidence::Alpha(0.02));
    let start = analyze(&thick, TrailingEdge::Sharp, &condition, None);
    let warm = analyze(nodes, TrailingEdge::Sharp, &cold.condition, Some(&start));
    assert!(warm.is_reliable() && warm.attempts.is_empty(), "{} {:?}", warm.status, warm.attempts);
    let (a, b) = (&warm.coefficients, &cold.coefficients);
    assert!((a.cd - b.cd).abs() < 1e-9 && (a.cl - b.cl).abs() < 1e-8, "{a:?} {b:?}");
}

#[test]
fn the_lift_is_held() {
    let (nodes, at_angle) = shock();
    let lift = at_angle.coefficients.cl;
    let found = analyze(nodes, TrailingEdge::Sharp, &tripped(0.75, Incidence::Lift(lift)), None);
    assert!(found.is_reliable(), "{}", found.status);
    assert!((found.coefficients.cl - lift).abs() < 1e-8, "{} {lift}", found.coefficients.cl);
    assert!((found.alpha - 0.025).abs() < 1e-7 && (found.coefficients.cd - at_angle.coefficients.cd).abs() < 1e-8);
    // the lift stays, whatever moves
    let held = found.held_gradients().unwrap();
    assert!(held.coefficients.cl.mach.abs() < 1e-9 && held.coefficients.cl.nodes[30][1].abs() < 1e-9);
}

#[test]
fn any_place_size_and_angle_give_one_flow() {
    let (nodes, own) = shock();
    let (sin, cos) = 0.1f64.sin_cos();
    let moved: Vec<[f64; 2]> =
        nodes.iter().map(|[x, y]| [3.0 + 20.0 * (cos * x + sin * y), -5.0 + 20.0 * (cos * y - sin * x)]).collect();
    let condition = tripped(0.75, Incidence::Alpha(0.025 - 0.1));
    let found = analyze(&moved, TrailingEdge::Sharp, &condition, None);
    for (a, b) in found.coefficients.iter().zip(own.coefficients.iter()) {
        assert!((a - b).abs() < 1e-8, "{:?} {:?}", found.coefficients, own.coefficients);
    }
}

#[test]
fn distributions_show_the_shock() {
    let (nodes, solution) = shock();
    let d = solution.distributions();
    assert_eq!((d.cp.len(), d.nodes.len(), d.cp_inviscid.len()), (nodes.len(), nodes.len(), 0));
    let fastest = d.upper.iter().map(|s| s.mach).fold(0.0, f64::max);
    assert!((1.1..1.5).contains(&fastest) && d.lower.iter().all(|s| s.mach < 1.0), "{fastest}");
    let foremost = (0..nodes.len()).min_by(|&a, &b| nodes[a][0].total_cmp(&nodes[b][0])).unwrap();
    // close to air at rest near the nose, close to the onset flow at the edge
    assert!(d.cp[foremost] > 0.3 && d.cp[0].abs() < 0.4, "{} {}", d.cp[foremost], d.cp[0]);
    for side in [&d.upper, &d.lower, &d.wake] {
        assert!(side.windows(2).all(|w| w[0].s < w[1].s && w[1].momentum_thickness > 0.0));
        assert!(side.iter().all(|s| s.cp.is_finite() && s.skin_friction.is_finite()));
    }
}

#[test]
fn conditions_out_of_range_are_refused() {
    let nodes = naca_symmetric(0.12, 0.0, 161);
    let section = solver().section(&nodes, TrailingEdge::Sharp).unwrap();
    let message = |condition: Condition| section.analyze(&condition, None).unwrap_err().to_string();
    assert!(message(tripped(0.05, Incidence::Alpha(0.0))).contains("Mach number is 0.05"));
    assert!(message(tripped(0.95, Incidence::Alpha(0.0))).contains("from 0.1 to 0.9"));
    assert!(message(tripped(0.7, Incidence::Alpha(0.3))).contains("from -15 to 15"));
    let few = StreamtubeSolver { settings: StreamtubeSettings { cells: 5, ..COARSE } };
    let section = few.section(&nodes, TrailingEdge::Sharp).unwrap();
    assert!(section.analyze(&tripped(0.7, Incidence::Alpha(0.0)), None).unwrap_err().to_string().contains("cells"));
}

#[test]
fn a_flow_that_is_not_found_says_so() {
    let nodes = naca_symmetric(0.12, 0.0, 161);
    let quick = StreamtubeSolver { settings: StreamtubeSettings { iterations: 4, retry: false, ..COARSE } };
    let section = quick.section(&nodes, TrailingEdge::Sharp).unwrap();
    let solution = section.analyze(&tripped(0.8, Incidence::Alpha(0.12)), None).unwrap();
    assert!(!solution.is_solved() && solution.gradients().is_none());
    assert!(matches!(solution.status, Status::NotConverged { .. } | Status::OutsideModel { converged: false, .. }));
    assert!(solution.status.to_string().contains("residual"), "{}", solution.status);
}

/// A smooth change of the nodes of a section, which cambers it so that no derivative nearly vanishes.
fn smooth(i: usize) -> [f64; 2] {
    let t = std::f64::consts::PI * i as f64 / 160.0;
    let sine = t.sin().powi(2);
    [0.1 * (5.0 * t).sin() * sine, sine * (2.0 * t + 0.4).cos()]
}

type T = Tangent<1>;

fn lifted(re: f64, slope: f64) -> T {
    T { re, eps: [slope] }
}

/// Unknowns in dual numbers that change in a direction.
fn changing(at: &Unknowns, by: &Unknowns) -> Unknowns<T> {
    let pairs = at.stations.iter().zip(&by.stations);
    Unknowns {
        stations: pairs.map(|(at, by)| at.iter().zip(by).map(|(at, by)| lifted(*at, *by)).collect()).collect(),
        globals: std::array::from_fn(|g| lifted(at.globals[g], by.globals[g])),
    }
}

#[test]
fn the_jacobian_is_that_of_the_residuals() {
    let (_, solution) = shock();
    let record = record(solution);
    let (problem, at) = (&record.problem, &record.unknowns);
    // a direction with all unknowns in it, away from the solution
    let mut number = 1.0f64;
    let mut random = || {
        number = (number * 78.233 + 0.4371).sin() * 43_758.545;
        number -= number.floor();
        number - 0.5
    };
    let mut direction = Unknowns::zeros(&problem.grid);
    direction.stations.iter_mut().flatten().for_each(|v| *v = 1e-2 * random());
    direction.globals.iter_mut().for_each(|v| *v = 1e-3 * random());
    let at = at.stepped(&direction, 0.01);
    let linearised = problem.linearise(&at).unwrap();
    let parameters = problem.parameters.map(T::from_re);
    let nodes: Vec<[T; 2]> = problem.nodes.iter().map(|p| p.map(T::from_re)).collect();
    let terms = |pass: &mut Evaluation<T, T>| problem.equations().pass(pass);
    let found = problem.residuals_in(&nodes, &parameters, &changing(&at, &direction), terms).unwrap();
    let agree = |exact: f64, found: f64| (exact - found).abs() < 1e-9 * (1.0 + exact.abs());
    for station in 0..problem.grid.count() {
        for index in 0..problem.grid.unknowns(station) {
            let exact = linearised.band.times(Place { station, index }, &direction);
            let found = found.stations[station][index].eps[0];
            assert!(agree(exact, found), "{station} {index}: {exact} {found}");
        }
    }
    for g in 0..GLOBALS {
        let (exact, found) = (linearised.band.times_global(g, &direction), found.globals[g].eps[0]);
        assert!(agree(exact, found), "global {g}: {exact} {found}");
    }
}

#[test]
fn the_adjoint_agrees_with_the_forward_route() {
    let (nodes, solution) = shock();
    let record = record(solution);
    let (problem, unknowns) = (&record.problem, &record.unknowns);
    let (peaks, geometry) = (peaks(record), problem.geometry(unknowns).unwrap());
    let adjoint = super::adjoint::derivatives(problem, unknowns, &geometry, record.base.as_ref(), &peaks).unwrap();
    // forward, in dual numbers all the way: the change of the unknowns with the nodes, then that of the outputs
    let moving: Vec<[T; 2]> =
        (0..nodes.len()).map(|i| [0, 1].map(|c| lifted(problem.nodes[i][c], smooth(i)[c]))).collect();
    let parameters = problem.parameters.map(T::from_re);
    let along = |change: &Unknowns| {
        let terms = |pass: &mut Evaluation<T, T>| {
            problem.equations().pass(pass);
            outputs(&problem.grid, &peaks, pass);
        };
        problem.residuals_in(&moving, &parameters, &changing(unknowns, change), terms).unwrap()
    };
    let mut at = problem.linearise(unknowns).unwrap();
    assert!(at.band.factorise());
    let mut change = Unknowns::zeros(&problem.grid);
    // what the first solution leaves of the equations by round-off is taken out by the second
    for _ in 0..2 {
        let left = along(&change);
        let right: Vec<Vec<f64>> = left.stations.iter().map(|all| all.iter().map(|v| v.eps[0]).collect()).collect();
        change = change.stepped(&at.band.step(&right, &left.globals.map(|v| v.eps[0])).unwrap(), 1.0);
    }
    let found = along(&change).outputs;
    for o in [LIFT, MOMENT, WAVE_DRAG, VISCOUS_DRAG, FRICTION_DRAG] {
        let forward = found[o].eps[0];
        let reverse: f64 =
            adjoint[o].nodes.iter().enumerate().map(|(i, by)| by[0] * smooth(i)[0] + by[1] * smooth(i)[1]).sum();
        assert!((forward / reverse - 1.0).abs() < 1e-10, "output {o}: {forward} {reverse}");
    }
}

#[test]
fn factors_of_the_last_step_lead_to_the_derivatives_at_the_solution() {
    let (nodes, solution) = shock();
    let moved: Vec<[f64; 2]> =
        nodes.iter().enumerate().map(|(i, p)| [0, 1].map(|c| p[c] + 2e-3 * smooth(i)[c])).collect();
    let near = analyze(&moved, TrailingEdge::Sharp, &solution.condition, Some(solution));
    assert!(near.is_reliable(), "{}", near.status);
    let record = record(&near);
    // the last steps had factors that were made elsewhere
    assert!(record.base.as_ref().is_some_and(|base| base.unknowns != record.unknowns));
    let (problem, unknowns) = (&record.problem, &record.unknowns);
    let geometry = problem.geometry(unknowns).unwrap();
    let [close, exact] = [record.base.as_ref(), None]
        .map(|base| super::adjoint::derivatives(problem, unknowns, &geometry, base, record.peaks()).unwrap());
    for o in [LIFT, MOMENT, WAVE_DRAG, VISCOUS_DRAG, FRICTION_DRAG] {
        let along = |by: &[[f64; 2]]| -> f64 {
            by.iter().enumerate().map(|(i, by)| by[0] * smooth(i)[0] + by[1] * smooth(i)[1]).sum()
        };
        let (a, b) = (along(&close[o].nodes), along(&exact[o].nodes));
        assert!((a / b - 1.0).abs() < 1e-7, "output {o}: {a} {b}");
        assert!((close[o].mach / exact[o].mach - 1.0).abs() < 1e-7, "output {o}");
    }
}

/// Derivatives by central differences over two steps, extrapolated.
fn extrapolated(step: f64, at: impl Fn(f64) -> [f64; 4]) -> [f64; 4] {
    let central = |h: f64| -> [f64; 4] {
        let (plus, minus) = (at(h), at(-h));
        std::array::from_fn(|k| (plus[k] - minus[k]) / (2.0 * h))
    };
    let (near, far) = (central(step), central(2.0 * step));
    std::array::from_fn(|k| (4.0 * near[k] - far[k]) / 3.0)
}

#[test]
fn derivatives_agree_with_differences_of_solutions() {
    let (nodes, solution) = shock();
    let gradients = solution.gradients().unwrap();
    let wave = solution.held_gradients().unwrap().cd_wave;
    let record = record(solution);
    let limits = Limits::new(20, 1e-11);
    let numbers = |problem: &Problem| -> [f64; 4] {
        let mut unknowns = record.unknowns.clone();
        let from = From { parameters: record.problem.parameters, nodes: Some(&record.problem.nodes) };
        assert!(solve(problem, Some(from), &mut unknowns, &limits).converged);
        let moved = StreamtubeRecord::new(problem.clone(), unknowns, record.nodes.clone());
        let c = moved.coefficients();
        [c.cl, c.cd, c.cm, moved.wave_drag()]
    };
    let all = [&gradients.cl, &gradients.cd, &gradients.cm, &wave];
    type Input = (&'static str, f64, fn(&mut Problem, f64));
    let inputs: [Input; 3] = [
        ("alpha", 1e-5, |p, h| p.parameters.incidence += h),
        ("mach", 1e-5, |p, h| p.parameters.mach += h),
        ("reynolds", 500.0, |p, h| p.parameters.reynolds += h),
    ];
    for (name, h, change) in inputs {
        let at = |h: f64| {
            let mut problem = record.problem.clone();
            change(&mut problem, h);
            numbers(&problem)
        };
        let differences = extrapolated(h, at);
        for (o, by) in all.iter().enumerate() {
            let exact = match name {
                "alpha" => by.alpha,
                "mach" => by.mach,
                _ => by.reynolds,
            };
            let found = differences[o];
            assert!((found / exact - 1.0).abs() < 1e-6, "{name} {o}: {found} {exact}");
        }
    }
    // the nodes as they were given, through the frame of the chord line
    let at = |h: f64| {
        let moved: Vec<[f64; 2]> =
            nodes.iter().enumerate().map(|(i, p)| [0, 1].map(|c| p[c] + h * smooth(i)[c])).collect();
        let tight = StreamtubeSolver { settings: StreamtubeSettings { tolerance: 1e-11, ..COARSE } };
        let section = tight.section(&moved, TrailingEdge::Sharp).unwrap();
        let found = section.analyze(&solution.condition, Some(solution)).unwrap();
        assert!(found.is_reliable(), "{}", found.status);
        let c = found.coefficients;
        [c.cl, c.cd, c.cm, found.cd_wave]
    };
    let differences = extrapolated(4e-6, at);
    for (o, by) in all.iter().enumerate() {
        let exact: f64 = by.nodes.iter().enumerate().map(|(i, g)| g[0] * smooth(i)[0] + g[1] * smooth(i)[1]).sum();
        let found = differences[o];
        assert!((found / exact - 1.0).abs() < 1e-6, "nodes {o}: {found} {exact}");
    }
}

#[test]
fn a_blunt_edge_is_solved_and_differentiated() {
    let nodes = cambered(0.13, 0.007, 0.015);
    let solution = analyze(&nodes, TrailingEdge::Blunt, &tripped(0.72, Incidence::Alpha(0.01)), None);
    assert!(solution.is_reliable(), "{}", solution.status);
    let exact = solution.gradients().unwrap();
    let at = |h: f64| {
        // the edge opens
        let moved: Vec<[f64; 2]> = nodes.iter().map(|p| [p[0], p[1] + h * p[0] * p[1].signum()]).collect();
        let found = analyze(&moved, TrailingEdge::Blunt, &solution.condition, Some(&solution));
        assert!(found.is_reliable(), "{}", found.status);
        found.coefficients.cd
    };
    let h = 1e-5;
    let found = (at(h) - at(-h)) / (2.0 * h);
    let by: f64 = nodes.iter().zip(&exact.cd.nodes).map(|(p, g)| g[1] * p[0] * p[1].signum()).sum();
    assert!((found / by - 1.0).abs() < 1e-5, "{found} {by}");
}
