//! The door: the streamtube solver as a [`FlowSolver`].

use super::equations::Held;
use super::gas::Parameters;
use super::grading::{Size, Stations};
use super::newton::Ended;
use super::numbering::{ALPHA, Grid, STAGNATION, Unknowns};
use super::outputs::{OUTPUTS, Peak, outputs};
use super::section_curve::SectionCurve;
use super::start::{Guess, climb};
use super::system::Problem;
use crate::flow::condition::{Condition, Incidence};
use crate::flow::layer::Side;
use crate::flow::{FlowError, PanelledSection, TrailingEdge};

/// What a flow came out as, for development.
pub fn probe(nodes: &[[f64; 2]], edge: TrailingEdge, condition: &Condition, size: [usize; 4], viscous: bool) -> Result<(), FlowError> {
    let size = Size { wall: size[0], ahead: size[1], behind: size[2], tubes: size[3] };
    let panels = PanelledSection::new(nodes, edge)?;
    let Incidence::Alpha(alpha) = condition.incidence else { return Ok(()) };
    let begin = std::time::Instant::now();
    let flow = panels.inviscid(alpha, 0.0)?;
    let curve = SectionCurve::new(&flow.nodes).ok_or(FlowError::UnevenNodes)?;
    let k = (1..flow.speed.len()).find(|&k| flow.speed[k - 1] > 0.0 && flow.speed[k] <= 0.0).unwrap_or(flow.speed.len() / 2);
    let share = flow.speed[k - 1] / (flow.speed[k - 1] - flow.speed[k]);
    let stagnation = curve.arc_length((k - 1) as f64 + share);
    let trips = condition.trips.map(|t| t.unwrap_or(0.3));
    let mut transition = [0.0; 2];
    let mut turning = [0.0; 2];
    for side in Side::BOTH {
        let s = curve.arc_length(curve.index_at_x(side, trips[side.index()]));
        transition[side.index()] = side.distance(stagnation, s);
        turning[side.index()] = transition[side.index()] / side.length(stagnation, curve.total());
    }
    let zeta = |s: f64| {
        let f = curve.focus();
        let p = curve.point(curve.index(s));
        let (a, b) = (p[0] - f[0], p[1] - f[1]);
        let r = a.hypot(b);
        if a > 0.0 { (r + a).sqrt() * b.signum() } else { b / (r - a).sqrt() }
    };
    let first = |fraction: f64| (zeta(Side::Upper.place(stagnation, fraction * stagnation)) - zeta(stagnation)).abs();
    let stations = Stations::new(size, first, curve.total() - stagnation, turning);
    let problem = Problem {
        grid: Grid { stations, viscous },
        nodes: flow.nodes.clone(),
        trips: condition.trips,
        critical: condition.n_critical,
        held: Held::Angle,
        fixed_transition: (!viscous).then_some(transition),
        parameters: Parameters { mach: condition.mach, reynolds: condition.reynolds, incidence: alpha, strength: 1.0, threshold: 0.98, order: 1.0 },
    };
    let guess = Guess { stagnation, circulation: 0.5 * flow.cl, alpha, transition, relaxed: true };
    let mut attempts = vec![];
    let (unknowns, ended) = climb(&problem, &guess, &mut attempts);
    let Ended { converged, steps, residual } = ended;
    println!("{attempts:?}");
    let out = values(&problem, &unknowns);
    println!("ok {converged} steps {steps} R {residual:.1e} t {:.2} a {:.5} s {:.5} CL {:.5} Cm {:.5} CD {:.6} CDw {:.6} CDv {:.6} CDf {:.6} CDwall {:.6} Cpmin {:.4} xT {:.4} {:.4}",
        begin.elapsed().as_secs_f64(), unknowns.globals[ALPHA], unknowns.globals[STAGNATION], out[0], out[1], out[3] + out[4], out[3], out[4], out[5], out[2], out[6], out[7], out[8]);
    if std::env::var_os("GRAD").is_some() { check(&problem, &unknowns); }
    Ok(())
}

fn check(problem: &Problem, unknowns: &Unknowns) {
    use super::newton::{From, Limits, solve};
    let cp = super::start::wall_pressures(problem, unknowns).unwrap();
    let peaks = cp.map(|cp| Peak::of(&cp));
    let t = std::time::Instant::now();
    let d = super::adjoint::derivatives(problem, unknowns, &peaks).unwrap();
    println!("adjoint {:.3} s", t.elapsed().as_secs_f64());
    let t = std::time::Instant::now();
    let mut a = problem.linearise(unknowns, |_| {}).unwrap();
    println!("linearise {:.3} s", t.elapsed().as_secs_f64());
    let t = std::time::Instant::now();
    a.band.factorise();
    println!("factorise {:.3} s", t.elapsed().as_secs_f64());
    // a smooth direction of the nodes, alpha, mach, reynolds
    let n = problem.nodes.len() as f64 - 1.0;
    let dir = |i: usize| { let t = std::f64::consts::PI * i as f64 / n; [0.1 * (5.0 * t).sin() * (t).sin().powi(2), (t).sin().powi(2) * (3.0 * t + 0.4).cos()] };
    for kind in 0..4 {
        for h in [1e-5, 1e-6] {
            let at = |h: f64| {
                let mut to = problem.clone();
                match kind { 0 => for (i, p) in to.nodes.iter_mut().enumerate() { let d = dir(i); p[0] += h * d[0]; p[1] += h * d[1]; }, 1 => to.parameters.incidence += h, 2 => to.parameters.mach += h, _ => to.parameters.reynolds *= 1.0 + h }
                let mut u = unknowns.clone();
                let e = solve(&to, Some(From { parameters: problem.parameters, nodes: Some(&problem.nodes) }), &mut u, &Limits { steps: 20, tolerance: 2e-12, stride: 1.0, hold: 0.5, relaxed: true });
                if !e.converged { println!("  diff not converged {e:?}"); }
                values(&to, &u)
            };
            let (p, m) = (at(h), at(-h));
            for o in [0, 1, 2, 3, 4, 5, 6, 7, 8] {
                let fd = (p[o] - m[o]) / (2.0 * h);
                let ex = match kind { 0 => d[o].nodes.iter().enumerate().map(|(i, g)| { let d = dir(i); g[0] * d[0] + g[1] * d[1] }).sum::<f64>(), 1 => d[o].alpha, 2 => d[o].mach, _ => d[o].reynolds * problem.parameters.reynolds };
                println!("  kind {kind} h {h:.0e} out {o} exact {ex:.9} fd {fd:.9} rel {:.1e}", (fd - ex) / ex);
            }
        }
    }
}

fn values(problem: &Problem, unknowns: &Unknowns) -> [f64; OUTPUTS] {
    let cp = super::start::wall_pressures(problem, unknowns).unwrap_or_default();
    let peaks = cp.map(|cp| Peak::of(&cp));
    let mut r = problem
        .residuals_in(&problem.nodes, &problem.parameters, unknowns, |pass| outputs(&problem.grid, &peaks, pass))
        .map_or([f64::NAN; OUTPUTS], |r| r.outputs);
    r[6] = super::outputs::lowest([peaks[0].value, peaks[1].value]).0;
    r
}
