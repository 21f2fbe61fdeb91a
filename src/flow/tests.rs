//! The whole solver: reference values, derivatives, smoothness, limits.

use super::testcases::naca_symmetric;
use super::*;
use crate::differentiate::{StepRange, finite_difference};
use std::convert::Infallible;

const TIGHT: Settings =
    Settings { laminar_stations: 40, turbulent_stations: 40, tolerance: 1e-11, iterations: 40, retry: true };

fn blunt() -> Vec<[f64; 2]> {
    naca_symmetric(0.12, 0.00252, 161)
}

fn at(degrees: f64) -> Condition {
    Condition::new(Incidence::Alpha(degrees.to_radians()), 5e6)
}

/// XFOIL 6.99, 160 panels, NACA 0012 blunt, Re 5e6, n 9: incidence, Mach number, trip, cl, cd, cm, transition.
type Row = (f64, f64, Option<f64>, [f64; 5]);
const XFOIL: [Row; 6] = [
    (0.0, 0.0, None, [0.0, 0.0050757, 0.0, 0.437143, 0.437143]),
    (4.0, 0.0, None, [0.447659, 0.0059898, 0.000177, 0.113256, 0.792097]),
    (6.0, 0.0, None, [0.666807, 0.0069404, 0.001400, 0.0460, 0.9279]),
    (4.0, 0.0, Some(0.05), [0.456937, 0.0084944, -0.001099, 0.05, 0.05]),
    (8.0, 0.0, Some(0.05), [0.901482, 0.0101919, -0.0006, 0.0241, 0.05]),
    (4.0, 0.2, None, [0.4587699, 0.0060760, 0.0006183, 0.108, 0.788]),
];

#[test]
fn agrees_with_xfoil() {
    let section = PanelledSection::new(&blunt(), TrailingEdge::Blunt).unwrap();
    for (degrees, mach, trip, [cl, cd, cm, upper, lower]) in XFOIL {
        let condition = Condition { mach, trips: [trip; 2], ..at(degrees) };
        let s = section.analyze(&condition, &Settings::default(), None).unwrap();
        assert_eq!(s.status, Status::Converged, "{degrees} {mach} {trip:?}");
        assert!((s.coefficients.cl - cl).abs() <= 0.005 + 0.007 * cl, "cl {} for {cl}", s.coefficients.cl);
        assert!((s.coefficients.cd / cd - 1.0).abs() < 0.02, "cd {} for {cd}", s.coefficients.cd);
        assert!((s.coefficients.cm - cm).abs() < 0.001, "cm {} for {cm}", s.coefficients.cm);
        for (own, theirs) in s.coefficients.transition.iter().zip([upper, lower]) {
            assert!((own - theirs).abs() < 0.005, "transition {own} for {theirs}");
        }
        assert!((s.cd_friction + s.cd_pressure - s.coefficients.cd).abs() < 1e-15);
    }
}

/// Everything that has derivatives.
fn coefficients(s: &Solution) -> [f64; COEFFICIENTS] {
    s.coefficients.to_array()
}

/// Compares the adjoint with extrapolated differences along one path of inputs, for all coefficients.
fn check(name: &str, exact: [f64; COEFFICIENTS], step: f64, tolerance: f64, at: impl Fn(f64) -> Solution) {
    for k in 0..COEFFICIENTS {
        let f = |x: f64| Ok::<_, Infallible>(coefficients(&at(x))[k]);
        let estimate = finite_difference(f, 0.0, StepRange { first: step, levels: 4 }).unwrap();
        let scale = exact[k].abs();
        assert!(
            (estimate.value - exact[k]).abs() <= tolerance * scale + 3.0 * estimate.error,
            "{name}, coefficient {k}: exact {} against {estimate:?}",
            exact[k]
        );
        // behind a trip transition hardly moves
        let least = if k < 4 { 1e-9 } else { 1e-7 };
        assert!(estimate.error < 1e-4 * scale + least, "{name}, coefficient {k}: {estimate:?} says nothing");
    }
}

fn check_gradients(nodes: &[[f64; 2]], kind: TrailingEdge, condition: Condition, tolerance: f64) {
    let solution = analyze(nodes, kind, &condition, &TIGHT, None).unwrap();
    let gradients = solution.gradients().unwrap();
    let all = gradients.as_ref().to_array();
    let run = |c: Condition| analyze(nodes, kind, &c, &TIGHT, Some(&solution)).unwrap();
    let Incidence::Alpha(alpha) = condition.incidence else { panic!("fixed incidence") };
    check("alpha", all.map(|d| d.alpha), 2e-4, tolerance, |x| {
        run(Condition { incidence: Incidence::Alpha(alpha + x), ..condition })
    });
    check("mach", all.map(|d| d.mach), 1e-3, tolerance, |x| run(Condition { mach: condition.mach + x, ..condition }));
    check("ln reynolds", all.map(|d| d.reynolds * condition.reynolds), 1e-2, tolerance, |x| {
        run(Condition { reynolds: condition.reynolds * (1.0 + x), ..condition })
    });
    // a bump that leaves the edge as it is, one that moves nose and edge, one that opens a blunt edge
    let n = nodes.len() as f64 - 1.0;
    let shapes: [&dyn Fn(f64) -> [f64; 2]; 3] = [
        &|t| [0.0, (std::f64::consts::PI * t).sin() * (5.0 * t).sin()],
        &|t| [0.1 * (std::f64::consts::TAU * t).cos(), 0.05 + (std::f64::consts::TAU * t).cos()],
        &|t| [0.0, (std::f64::consts::PI * t).cos()],
    ];
    let shapes = if kind == TrailingEdge::Blunt { &shapes[..] } else { &shapes[..2] };
    for (k, shape) in shapes.iter().enumerate() {
        let direction: Vec<[f64; 2]> = (0..nodes.len()).map(|i| shape(i as f64 / n)).collect();
        let exact = all.map(|d| d.nodes.iter().zip(&direction).map(|(g, d)| g[0] * d[0] + g[1] * d[1]).sum::<f64>());
        check(&format!("shape {k}"), exact, 2e-5, tolerance, |x| {
            let mut moved: Vec<[f64; 2]> =
                nodes.iter().zip(&direction).map(|(p, d)| [p[0] + x * d[0], p[1] + x * d[1]]).collect();
            if kind == TrailingEdge::Sharp {
                moved[nodes.len() - 1] = moved[0];
            }
            analyze(&moved, kind, &condition, &TIGHT, Some(&solution)).unwrap()
        });
    }
}

#[test]
fn gradients_are_exact_with_trips() {
    check_gradients(
        &blunt(),
        TrailingEdge::Blunt,
        Condition { mach: 0.2, trips: [Some(0.05), Some(0.1)], ..at(3.0) },
        1e-6,
    );
}

#[test]
fn gradients_are_exact_with_free_transition() {
    check_gradients(&blunt(), TrailingEdge::Blunt, Condition { mach: 0.3, ..at(4.0) }, 1e-5);
}

#[test]
fn gradients_are_exact_at_a_sharp_edge() {
    let nodes = naca_symmetric(0.12, 0.0, 161);
    check_gradients(&nodes, TrailingEdge::Sharp, Condition { mach: 0.2, ..at(2.0) }, 1e-5);
}

#[test]
fn gradients_are_exact_where_a_side_is_laminar_up_to_a_thin_edge() {
    let nodes = naca_symmetric(0.12, 5e-4, 161);
    check_gradients(&nodes, TrailingEdge::Blunt, Condition { mach: 0.1, reynolds: 1e6, ..at(6.0) }, 1e-5);
}

#[test]
fn lift_is_continuous_as_the_edge_closes() {
    // from panels of 4e-4 to 3e-3 at the edge
    for (n, trip) in [(161, Some(0.05)), (161, None), (61, Some(0.05))] {
        let lift = |gap: f64| {
            let kind = if gap > 0.0 { TrailingEdge::Blunt } else { TrailingEdge::Sharp };
            let condition = Condition { mach: 0.2, trips: [trip; 2], ..at(4.0) };
            let s = analyze(&naca_symmetric(0.12, gap, n), kind, &condition, &Settings::default(), None).unwrap();
            assert!(s.is_reliable(), "{gap} {trip:?}: {}", s.status);
            s.coefficients.cl
        };
        // the lift falls with the gap; below a thousandth it goes on as from there
        let (wide, thin) = (lift(2.5e-3), lift(1e-3));
        for gap in [3e-4, 2e-4, 1e-4, 3e-5, 1e-6, 0.0] {
            let trend = thin + (gap - 1e-3) * (wide - thin) / 1.5e-3;
            let cl = lift(gap);
            assert!((cl / trend - 1.0).abs() < 0.01, "{n} {trip:?} {gap}: {cl}, trend {trend}");
        }
    }
}

/// The section of this name on nodes of the solver's own choice.
fn section_of(name: &str) -> PanelledSection {
    let section = crate::section::SectionDefinition::parse(name).unwrap().section().unwrap();
    let nodes: Vec<_> = panel_parameters(&section, 161).iter().map(|&u| section.curve().point_at(u)).collect();
    PanelledSection::new(&nodes, section.trailing_edge()).unwrap()
}

#[test]
fn a_sharp_edge_agrees_with_an_euler_solver() {
    // MSES, NACA 0012 closed, 4 degrees, M 0.2, Re 5e6: lift and moment. (XFOIL 6.99 has a lift of 0.4197, free.)
    for (trip, cl, cm) in [(None, 0.43528, 0.00458), (Some(0.05), 0.45310, 0.00145)] {
        let condition = Condition { mach: 0.2, trips: [trip; 2], ..at(4.0) };
        let s = section_of("naca0012:sharp").analyze(&condition, &Settings::default(), None).unwrap();
        assert!((s.coefficients.cl / cl - 1.0).abs() < 0.015, "{trip:?}: {} for {cl}", s.coefficients.cl);
        assert!((s.coefficients.cm - cm).abs() < 5e-4, "{trip:?}: {} for {cm}", s.coefficients.cm);
    }
}

#[test]
fn a_side_that_is_laminar_up_to_the_edge_agrees_with_xfoil() {
    // XFOIL 6.99, 200 panels, M 0, Re 5e6, n 9: lift, drag, moment
    let rows = [
        ("naca0012", 8.0, [0.883436, 0.0082785, 0.002958]),
        ("naca4412", 6.0, [1.138155, 0.0077803, -0.101170]),
        ("naca4412", 8.0, [1.332808, 0.0103014, -0.096823]),
    ];
    for (name, degrees, [cl, cd, cm]) in rows {
        let s = section_of(name).analyze(&at(degrees), &Settings::default(), None).unwrap();
        assert!(
            s.is_reliable() && s.coefficients.transition[1] > 0.98,
            "{name} {degrees}: {} {:?}",
            s.status,
            s.coefficients.transition
        );
        assert!((s.coefficients.cl / cl - 1.0).abs() < 0.004, "{name} {degrees}: cl {} for {cl}", s.coefficients.cl);
        assert!((s.coefficients.cd / cd - 1.0).abs() < 0.015, "{name} {degrees}: cd {} for {cd}", s.coefficients.cd);
        assert!((s.coefficients.cm - cm).abs() < 6e-4, "{name} {degrees}: cm {} for {cm}", s.coefficients.cm);
    }
}

#[test]
fn fixed_lift_finds_its_incidence() {
    let section = PanelledSection::new(&blunt(), TrailingEdge::Blunt).unwrap();
    let condition = Condition { incidence: Incidence::Lift(0.4), ..at(0.0) };
    let s = section.analyze(&condition, &TIGHT, None).unwrap();
    assert!(s.is_reliable() && (s.coefficients.cl - 0.4).abs() < 1e-9, "{} {:?}", s.coefficients.cl, s.status);
    let held = s.gradients().unwrap().at_fixed_lift();
    assert!(held.cl.nodes.iter().flatten().all(|g| g.abs() < 1e-9));
    // drag at fixed lift against a second solution at another Reynolds number
    let h = 1e3;
    let at = |x: f64| {
        section.analyze(&Condition { reynolds: 5e6 + x, ..condition }, &TIGHT, Some(&s)).unwrap().coefficients.cd
    };
    let difference = (at(h) - at(-h)) / (2.0 * h);
    assert!((difference / held.cd.reynolds - 1.0).abs() < 1e-4, "{difference} {}", held.cd.reynolds);
}

#[test]
fn warm_and_cold_starts_agree() {
    let section = PanelledSection::new(&blunt(), TrailingEdge::Blunt).unwrap();
    let cold = section.analyze(&at(3.0), &TIGHT, None).unwrap();
    let other = section.analyze(&at(2.0), &TIGHT, None).unwrap();
    let warm = section.analyze(&at(3.0), &TIGHT, Some(&other)).unwrap();
    for (a, b) in coefficients(&cold).iter().zip(coefficients(&warm)) {
        assert!((a - b).abs() < 1e-10, "{a} {b}");
    }
}

/// Root mean square of what is left of `values` over −1 … 1 after the best polynomial, by orthogonalisation.
fn scatter(values: &[f64], degree: usize) -> f64 {
    let n = values.len();
    let x: Vec<f64> = (0..n).map(|i| 2.0 * i as f64 / (n - 1) as f64 - 1.0).collect();
    let mut rest = values.to_vec();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for power in 0..=degree {
        let mut v: Vec<f64> = x.iter().map(|x| x.powi(power as i32)).collect();
        for _ in 0..2 {
            for b in &basis {
                let dot: f64 = v.iter().zip(b).map(|(v, b)| v * b).sum();
                v.iter_mut().zip(b).for_each(|(v, b)| *v -= dot * b);
            }
        }
        let norm = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.iter_mut().for_each(|v| *v /= norm);
        let dot: f64 = rest.iter().zip(&v).map(|(r, v)| r * v).sum();
        rest.iter_mut().zip(&v).for_each(|(r, v)| *r -= dot * v);
        basis.push(v);
    }
    (rest.iter().map(|r| r * r).sum::<f64>() / n as f64).sqrt()
}

#[test]
fn tripped_drag_is_a_smooth_function_of_the_shape() {
    let base = blunt();
    let bump = |p: &[f64; 2]| (std::f64::consts::PI * p[0].powf(0.5757)).sin().powi(3);
    let condition = Condition { reynolds: 1e6, trips: [Some(0.05); 2], ..at(2.0) };
    let mut last: Option<Solution> = None;
    let drag: Vec<f64> = (-10..=10)
        .map(|i| {
            let height = 2e-4 * f64::from(i);
            let moved = |(k, p): (usize, &[f64; 2])| if k < 80 { [p[0], p[1] + height * bump(p)] } else { *p };
            let nodes: Vec<[f64; 2]> = base.iter().enumerate().map(moved).collect();
            let s = analyze(&nodes, TrailingEdge::Blunt, &condition, &TIGHT, last.as_ref()).unwrap();
            let cd = s.coefficients.cd;
            last = Some(s);
            cd
        })
        .collect();
    let rms = scatter(&drag, 5);
    assert!(rms < 1e-9, "{rms}");
}

#[test]
fn what_is_beyond_the_model_says_so() {
    // thick section at high speed: supersonic at the edge
    let thick = naca_symmetric(0.24, 0.005, 161);
    let condition = Condition { mach: 0.7, trips: [Some(0.1); 2], ..at(0.0) };
    let s = analyze(&thick, TrailingEdge::Blunt, &condition, &Settings::default(), None).unwrap();
    assert!(!s.is_reliable(), "{:?}", s.status);
    // one iteration is not enough at a large angle
    let hasty = Settings { iterations: 1, retry: false, ..Settings::default() };
    let s = analyze(&blunt(), TrailingEdge::Blunt, &at(10.0), &hasty, None).unwrap();
    assert!(matches!(s.status, Status::NotConverged { residual, .. } if residual > 1e-6));
    assert!(s.gradients().is_none());
}

/// Nodes turned by an angle in radians, scaled and moved.
fn placed(nodes: &[[f64; 2]], turn: f64, scale: f64, [x, y]: [f64; 2]) -> Vec<[f64; 2]> {
    let (sin, cos) = turn.sin_cos();
    nodes.iter().map(|[a, b]| [x + scale * (cos * a - sin * b), y + scale * (sin * a + cos * b)]).collect()
}

#[test]
fn coefficients_do_not_depend_on_place_size_and_angle() {
    let nodes: Vec<_> = blunt().into_iter().map(|[x, y]| [x, y + 0.12 * x * (1.0 - x)]).collect();
    let trips = Condition { mach: 0.3, trips: [Some(0.3), Some(0.2)], ..at(3.0) };
    let lift = Condition { incidence: Incidence::Lift(0.5), ..trips };
    let solve = |nodes: &[[f64; 2]], condition: &Condition| {
        analyze(nodes, TrailingEdge::Blunt, condition, &Settings::default(), None).unwrap()
    };
    for (turn, scale, shift) in [(0.0, 1000.0, [0.0; 2]), (0.0, 1.0, [-0.4, 0.0]), (-0.3, 0.02, [5.0, -2.0])] {
        let moved = placed(&nodes, turn, scale, shift);
        let turned = Condition { incidence: Incidence::Alpha(3f64.to_radians() + turn), ..trips };
        for (own, wanted) in
            [(solve(&moved, &turned), solve(&nodes, &trips)), (solve(&moved, &lift), solve(&nodes, &lift))]
        {
            assert!(own.is_reliable() && wanted.is_reliable());
            for ((name, a), (_, b)) in own.coefficients.named().zip(wanted.coefficients.named()) {
                assert!((a - b).abs() < 1e-8, "{name}: {a} {b}");
            }
            assert!((own.alpha - turn - wanted.alpha).abs() < 1e-9);
            assert!((own.stagnation - wanted.stagnation).abs() < 1e-8);
        }
    }
}

#[test]
fn gradients_are_exact_in_any_frame() {
    let bent: Vec<_> = blunt().into_iter().map(|[x, y]| [x, y + 0.12 * x * (1.0 - x)]).collect();
    let nodes = placed(&bent, -0.2, 50.0, [7.0, 3.0]);
    let condition = Condition { trips: [Some(0.3), Some(0.2)], ..at(3.0 - 0.2f64.to_degrees()) };
    let solve = |nodes: &[[f64; 2]]| analyze(nodes, TrailingEdge::Blunt, &condition, &TIGHT, None).unwrap();
    let gradients = solve(&nodes).gradients().unwrap();
    // moves that change the chord line, and the shape within it
    let moves: [fn([f64; 2]) -> [f64; 2]; 3] =
        [|[x, y]| [0.3 * y, 0.2 * x], |[x, _]| [0.0, (0.07 * x).sin()], |[_, y]| [(0.1 * y).cos(), 0.0]];
    for (m, by) in moves.into_iter().enumerate() {
        let exact = gradients
            .iter()
            .map(|g| g.nodes.iter().zip(&nodes).map(|(g, &node)| g[0] * by(node)[0] + g[1] * by(node)[1]).sum::<f64>());
        let exact: Vec<f64> = exact.collect();
        let moved = |t: f64| {
            let nodes: Vec<_> = nodes.iter().map(|&n| [n[0] + t * by(n)[0], n[1] + t * by(n)[1]]).collect();
            solve(&nodes)
        };
        check(&format!("move {m}"), exact.try_into().unwrap(), 2e-3, 1e-6, moved);
    }
}

#[test]
fn a_lift_out_of_reach_is_named_with_the_largest_one() {
    let section = PanelledSection::new(&blunt(), TrailingEdge::Blunt).unwrap();
    let solve = |lift: f64| {
        let condition = Condition { incidence: Incidence::Lift(lift), reynolds: 1e6, ..at(0.0) };
        section.analyze(&condition, &Settings::default(), None).unwrap()
    };
    for sign in [1.0, -1.0] {
        let s = solve(sign * 2.5);
        let Status::LiftOutOfReach { wanted, largest, alpha, ended: None } = s.status else { panic!("{}", s.status) };
        assert_eq!((wanted, s.coefficients.cl, s.alpha), (sign * 2.5, largest, alpha));
        assert!((1.2..1.6).contains(&(sign * largest)), "{largest}");
        assert!(s.gradients().is_none() && !s.is_reliable() && !s.is_solved());
        // close below the largest lift there is a solution
        let near = solve(0.98 * largest);
        assert!(near.is_reliable(), "{}", near.status);
    }
    // where the model ends before the lift falls, that is the reason
    let condition = Condition { incidence: Incidence::Lift(1.2), mach: 0.5, reynolds: 1e6, ..at(0.0) };
    let s = section.analyze(&condition, &Settings::default(), None).unwrap();
    assert!(s.status.to_string().contains("is not reached") && s.status.to_string().contains("supersonic"));
}

#[test]
fn laminar_separation_counts_as_separation() {
    // 90 % of the upper side reversed before transition
    let condition = Condition { reynolds: 1e4, ..at(8.0) };
    let s = analyze(&blunt(), TrailingEdge::Blunt, &condition, &Settings::default(), None).unwrap();
    assert!(!s.is_reliable(), "{}", s.status);
    if let Status::Separated { extent } = s.status {
        assert!(extent > 0.5 && s.is_solved() && s.gradients().is_some());
    }
    // a short bubble is within the model
    let condition = Condition { reynolds: 2e5, ..at(4.0) };
    let s = analyze(&blunt(), TrailingEdge::Blunt, &condition, &Settings::default(), None).unwrap();
    assert!(s.is_reliable(), "{}", s.status);
}

#[test]
fn flow_without_a_layer_is_checked_too() {
    let section = PanelledSection::new(&blunt(), TrailingEdge::Blunt).unwrap();
    for (alpha, mach) in [(0.0, 0.99), (0.0, 2.0), (0.0, f64::NAN), (0.0, -0.1), (f64::NAN, 0.2), (1.0, 0.2)] {
        assert!(matches!(section.inviscid(alpha, mach), Err(FlowError::Condition { .. })), "{alpha} {mach}");
    }
    let s = section.inviscid(0.0, 0.5).unwrap();
    assert_eq!(s.status, Status::Converged);
    // the critical Mach number of the NACA 0012 without lift is about 0.72
    let critical = s.critical_mach.unwrap();
    assert!((0.70..0.75).contains(&critical), "{critical}");
    assert_eq!(section.inviscid(0.0, critical - 1e-6).unwrap().status, Status::Converged);
    assert!(section.inviscid(0.0, critical + 1e-6).unwrap().status.is_beyond_model());
    // a flow that was not found for shocks says so
    let condition = Condition { mach: 0.9, ..at(2.0) };
    let s = section.analyze(&condition, &Settings::default(), None).unwrap();
    assert_eq!(s.status.name(), "supersonic", "{}", s.status);
}

#[test]
fn the_lowest_pressure_has_derivatives_where_peaks_tie() {
    let condition = Condition { trips: [Some(0.1); 2], ..at(0.0) };
    let solve = |alpha: f64| {
        let condition = Condition { incidence: Incidence::Alpha(alpha), ..condition };
        analyze(&blunt(), TrailingEdge::Blunt, &condition, &TIGHT, None).unwrap()
    };
    let s = solve(0.0);
    // either peak alone would give a slope of several per radian
    assert!(s.gradients().unwrap().cp_min.alpha.abs() < 1e-8);
    let lowest = s.distributions().cp.into_iter().fold(0.0, f64::min);
    assert!(s.coefficients.cp_min < lowest && s.coefficients.cp_min > lowest - 0.006, "{lowest}");
    let exact = solve(2e-3).gradients().unwrap().map(|g| g.alpha);
    check("two peaks", exact.to_array(), 5e-4, 1e-5, |t| solve(2e-3 + t));
}

#[test]
fn distributions_belong_together() {
    let s = analyze(&blunt(), TrailingEdge::Blunt, &at(2.0), &Settings::default(), None).unwrap();
    let d = s.distributions();
    assert_eq!((d.cp.len(), d.cp_inviscid.len()), (161, 161));
    assert!(d.cp.iter().all(|&cp| cp >= s.coefficients.cp_min - 1e-12));
    for side in [&d.upper, &d.lower] {
        assert!(side.windows(2).all(|w| w[0].s < w[1].s && w[0].momentum_thickness > 0.0));
        let last = side[side.len() - 1];
        assert!((last.x - 1.0).abs() < 1e-9);
        let end = side.iter().rev().find(|s| s.amplification > 0.0).unwrap();
        assert!((end.amplification - 9.0).abs() < 1e-2, "{end:?}");
    }
    assert!(d.wake[d.wake.len() - 1].shape_parameter < 1.2);
}

#[test]
fn a_solution_takes_nodes_with_derivatives() {
    use num_dual::{Dual2_64, Dual64, DualSVec64};
    let nodes = blunt();
    let condition = Condition { incidence: Incidence::Lift(0.3), trips: [Some(0.1); 2], ..at(0.0) };
    let s = analyze(&nodes, TrailingEdge::Blunt, &condition, &TIGHT, None).unwrap();
    let bump = |x: f64| (3.0 * x).sin();
    let moved = |eps: f64| nodes.iter().map(|p| [p[0], p[1] + eps * bump(p[0])]).collect::<Vec<_>>();
    let single: Vec<[Dual64; 2]> = nodes.iter().map(|p| [p[0].into(), Dual64::new(p[1], bump(p[0]))]).collect();
    let wide: Vec<nalgebra::Point2<DualSVec64<2>>> = nodes
        .iter()
        .map(|p| {
            let y = DualSVec64::from(p[1]) + DualSVec64::<2>::from(0.0).derivative(1) * bump(p[0]);
            nalgebra::Point2::new(p[0].into(), y)
        })
        .collect();
    let (single, wide) = (s.lift(&single).unwrap(), s.lift(&wide).unwrap());
    let h = 1e-5;
    let [low, high] = [-h, h]
        .map(|eps| analyze(&moved(eps), TrailingEdge::Blunt, &condition, &TIGHT, Some(&s)).unwrap().coefficients);
    let difference = (high.cd - low.cd) / (2.0 * h);
    assert!((difference / single.cd.eps - 1.0).abs() < 1e-4, "{difference} {}", single.cd.eps);
    for (single, wide) in single.iter().zip(wide.iter()) {
        let by = wide.eps.unwrap_generic(nalgebra::Const::<2>, nalgebra::U1);
        assert_eq!((single.re, by[0]), (wide.re, 0.0));
        assert!((single.eps - by[1]).abs() <= 1e-12 * single.eps.abs());
    }
    assert_eq!(s.lift::<f64, _>(&nodes).unwrap(), s.coefficients);
    assert_eq!(s.lift::<f64, _>(&moved(1e-6)), Err(FlowError::OtherNodes));
    let second: Vec<[Dual2_64; 2]> = nodes.iter().map(|p| p.map(Dual2_64::from)).collect();
    assert_eq!(s.lift(&second), Err(FlowError::FirstOrderOnly));
}

/// Lift and moment change their signs in the mirror, the other coefficients do not; the sides change their places.
fn in_the_mirror<T: Clone>(of: &Coefficients<T>, negative: impl Fn(&T) -> T) -> Coefficients<T> {
    let [upper, lower] = of.transition.clone();
    Coefficients { cl: negative(&of.cl), cm: negative(&of.cm), transition: [lower, upper], ..of.clone() }
}

#[test]
fn a_section_in_the_mirror_has_the_flow_in_the_mirror() {
    for name in ["naca4412", "naca4412:sharp"] {
        let section = crate::section::SectionDefinition::parse(name).unwrap().section().unwrap();
        let nodes: Vec<[f64; 2]> =
            panel_parameters(&section, 81).iter().map(|&u| section.curve().point_at(u)).collect();
        let mirrored: Vec<[f64; 2]> = nodes.iter().rev().map(|[x, y]| [*x, -y]).collect();
        let run = |nodes: &[[f64; 2]], alpha: f64, trips: [Option<f64>; 2]| {
            let condition = Condition { mach: 0.2, trips, ..Condition::new(Incidence::Alpha(alpha), 2e6) };
            analyze(nodes, section.trailing_edge(), &condition, &TIGHT, None).unwrap()
        };
        let (own, other) = (run(&nodes, 0.04, [Some(0.2), None]), run(&mirrored, -0.04, [None, Some(0.2)]));
        assert!(own.is_reliable() && own.coefficients.cl > 0.5, "{name}: {:?}", own.coefficients);
        let expected = in_the_mirror(&own.coefficients, |value| -value);
        for ((what, a), b) in other.coefficients.named().zip(expected.iter()) {
            assert!((a - b).abs() < 1e-9, "{name}, {what}: {a} for {b}");
        }
        // in the mirror y and the incidence, too, change their signs
        let [own, other] = [&own, &other].map(|solution| solution.gradients().unwrap());
        let reflected = own.map(|by| Derivatives {
            nodes: by.nodes.iter().rev().map(|[x, y]| [*x, -y]).collect(),
            alpha: -by.alpha,
            ..by
        });
        let negative = |by: &Derivatives| Derivatives {
            nodes: by.nodes.iter().map(|node| node.map(|d| -d)).collect(),
            alpha: -by.alpha,
            mach: -by.mach,
            reynolds: -by.reynolds,
        };
        let expected = in_the_mirror(&reflected, negative);
        for ((what, a), b) in other.named().zip(expected.iter()) {
            // a transition that hangs at the trailing edge hardly moves, and the residual of the flow leaves 1e-13 of it
            let scale = b.nodes.as_flattened().iter().fold(1e-3, |most: f64, d| most.max(d.abs()));
            let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * scale;
            assert!(close(a.alpha, b.alpha) && close(a.mach, b.mach), "{name}, {what}: {a:?} for {b:?}");
            assert!(close(2e6 * a.reynolds, 2e6 * b.reynolds), "{name}, {what}: {} {}", a.reynolds, b.reynolds);
            for (i, (a, b)) in a.nodes.as_flattened().iter().zip(b.nodes.as_flattened()).enumerate() {
                assert!(close(*a, *b), "{name}, {what}, {i}: {a} for {b}, largest {scale}");
            }
        }
    }
}
