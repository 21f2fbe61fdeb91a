//! Angles of attack as design variables, from case files.

use super::*;
use crate::design::check_gradients;
use crate::flow::Incidence;
use crate::optimize::Termination;

fn parse(text: &str) -> Result<Case, CaseError> {
    Case::parse("test.toml", text, Path::new(""))
}

fn run(case: &Case) -> CaseOutcome {
    case.run(&mut |_| ControlFlow::Continue(())).unwrap()
}

/// A NACA 2412 in a small box, with further tables.
fn boxed(tables: &str) -> String {
    boxed_with("axis = \"y\"", tables)
}

/// The section with the control points free that a selection names.
fn boxed_with(selection: &str, tables: &str) -> String {
    format!(
        r#"name = "x"
[section]
naca = "2412"
trailing_edge = "sharp"
[box]
x = [-0.05, 1.05]
y = [-0.12, 0.14]
control_points = [5, 3]
degree = [3, 2]
[variables]
free = [{{ {selection} }}]
pin = ["nose", "tail"]
bounds = {{ y = [-0.05, 0.05] }}
{tables}"#
    )
}

const SURROUNDINGS: &str = "reynolds = 3e6\nmach = 0.2\ntrip = 0.1\npanels = 80\n";

#[test]
fn derivatives_in_angles_agree_with_dual_numbers_and_differences() {
    let text = boxed(&format!(
        "parameters = [\"thickness\"]\n[pressure_target]\npoint = \"slow\"\nupper = [[0.0, 0.9], [0.02, -0.6], [0.3, -0.7], [1.0, 0.2]]\n\
         [[flow]]\nname = \"dash\"\nalpha = 0.5\n{SURROUNDINGS}\
         [[flow]]\nname = \"slow\"\nweight = 2.0\nalpha = {{ start = 3.0, lower = -2.0, upper = 9.0, scale = 0.5 }}\n{SURROUNDINGS}\
         [[flow]]\nname = \"cruise\"\nalpha = {{ start = [1.0, 2.0] }}\n{SURROUNDINGS}\
         [objective]\nminimize = {{ cp_error = 1.0, cd = 1.0 }}\n\
         [constraints]\ncl = {{ min = 0.1 }}\n\"mean(alpha)\" = {{ max = 5.0 }}\n\"cm at slow\" = {{ min = -0.1, weight = 10.0 }}\narea = {{ min = 0.01 }}\n"
    ));
    let mut case = parse(&text).unwrap();
    let variables = case.problem.geometry().variables();
    let names: Vec<&str> = variables.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names[0], "thickness");
    assert_eq!(names[names.len() - 3..], ["alpha_at(slow)", "alpha_at(cruise-1)", "alpha_at(cruise-2)"]);
    let angle = &variables[names.len() - 3];
    assert!((angle.start - 3.0).abs() < 1e-12 && (angle.scale, angle.step) == (0.5, 1.0));
    assert_eq!((angle.bounds.lower, angle.bounds.upper), (-2.0, 9.0));
    let start = case.problem.start_values();
    let values: Vec<f64> = start
        .iter()
        .zip(case.problem.steps())
        .enumerate()
        .map(|(k, (x, s))| x + 0.05 * s * (2.1 * k as f64).sin())
        .collect();
    let checks = check_gradients(&mut case.problem, &values).unwrap();
    for check in &checks {
        assert!(check.agrees(), "{check:?}");
    }
    let of = |quantity: &str, variable: &str| {
        checks.iter().find(|c| c.quantity == quantity && c.variable == variable).unwrap().exact
    };
    // about 2π per radian, at the own operating point only
    let slope = of("cl_at(slow)", "alpha_at(slow)");
    assert!((0.1..0.13).contains(&slope), "{slope}");
    assert_eq!(of("cl_at(dash)", "alpha_at(slow)"), 0.0);
    assert_eq!(of("area", "alpha_at(cruise-2)"), 0.0);
    assert!((of("alpha", "alpha_at(slow)") - 0.5).abs() < 1e-14);
    // the shape of the variables carries the angles, and the points take them from there
    let shape = case.problem.shape(&values).unwrap();
    let points = case.problem.operating_points();
    let Incidence::Alpha(alpha) = points[1].condition_at(&shape).incidence else { panic!("no angle") };
    assert!((alpha.to_degrees() - values[values.len() - 3]).abs() < 1e-12);
    assert_eq!(points[0].condition_at(&shape), points[0].condition);
}

#[test]
fn a_free_angle_with_its_lift_held_ends_at_the_design_of_fixed_lift() {
    let rest = "[objective]\nminimize = { cd = 1.0 }\n[optimizer]\ntolerance = 1e-8\n[constraints]\nthickness = { min = 0.11 }\n\"thickness_at(0.8)\" = { min = 0.04 }\ncm = { min = -0.05 }\n";
    let boxed = |tables: &str| boxed_with("columns = [1, 2, 3], axis = \"y\"", tables);
    let fixed = parse(&boxed(&format!("[flow]\ncl = 0.5\n{SURROUNDINGS}{rest}"))).unwrap();
    let free = format!("[flow]\nalpha = {{ start = 1.0 }}\n{SURROUNDINGS}{rest}cl = {{ equal = 0.5 }}\n");
    let free = parse(&boxed(&free)).unwrap();
    let (a, b) = (run(&fixed), run(&free));
    for end in [&a, &b] {
        assert_eq!(end.outcome.status, Termination::Converged, "{}", end.outcome.message);
    }
    assert_eq!(b.variables.len(), a.variables.len() + 1);
    let drag = |end: &CaseOutcome| end.outcome.evaluation.as_ref().unwrap().objective;
    assert!((drag(&a) / drag(&b) - 1.0).abs() < 1e-7, "{} {}", drag(&a), drag(&b));
    for (k, (x, y)) in a.variables.iter().zip(&b.variables).enumerate() {
        assert!((x - y).abs() < 5e-4, "{k}: {x} {y}");
    }
    let flows = fixed.problem.flows(&a.shape).unwrap();
    let alpha = flows.solutions[0].as_ref().unwrap().alpha.to_degrees();
    assert!((alpha - b.variables[a.variables.len()]).abs() < 3e-3, "{alpha} {:?}", b.variables.last());
    // the count does not suffer from the further variable
    assert!(b.outcome.evaluations <= a.outcome.evaluations + 10, "{} {}", a.outcome.evaluations, b.outcome.evaluations);
}

#[test]
fn the_angle_of_best_glide_of_a_section_that_is_not_changed_is_found() {
    let text = "name = \"x\"\n[section]\nnaca = \"2412\"\n[flow]\nalpha = { start = 1.0, lower = -2.0, upper = 12.0 }\nreynolds = 3e6\ntrip = 0.1\npanels = 100\n[objective]\nmaximize = { \"cl/cd\" = 1.0 }\n";
    let case = parse(text).unwrap();
    let end = run(&case);
    assert_eq!(end.outcome.status, Termination::Converged, "{}", end.outcome.message);
    let [alpha] = end.variables[..] else { panic!("{:?}", end.variables) };
    let glide = |alpha: f64| -case.evaluate(&[alpha]).unwrap().objective;
    let best = glide(alpha);
    assert!(best > 60.0 && [-0.1, 0.1].iter().all(|d| glide(alpha + d) < best), "{alpha} {best}");
}

#[test]
fn faulty_free_angles_are_refused_with_their_line() {
    for (flow, words) in [
        ("alpha = { lower = 0.0 }", "missing key `start`"),
        ("alpha = { start = 1.0, uper = 2.0 }", "did you mean `upper`?"),
        ("alpha = { start = 3.0, upper = 2.0 }", "alpha"),
        ("alpha = { start = 1.0, lower = nan }", "alpha"),
        ("alpha = { start = 1.0, scale = 0.0 }", "scale"),
        ("alpha = { start = 400.0 }", "angle of attack"),
        ("alpha = { start = [] }", "a number, or a list"),
        ("alpha = true", "an angle in degrees, a list of them, or a table"),
        ("alpha = [1.0, \"two\"]", "a number, or a list"),
        ("alpha = { start = 1.0 }\ncl = 0.4", "either `alpha` (degrees) or `cl`"),
    ] {
        let text = boxed(&format!("[flow]\n{flow}\n{SURROUNDINGS}[objective]\nminimize = {{ cd = 1.0 }}\n"));
        let error = parse(&text).unwrap_err();
        assert!(error.line.is_some_and(|line| [14, 15].contains(&line)), "{flow}: {error}");
        assert!(error.to_string().contains(words), "{flow}: {error}");
    }
    let text = boxed(&format!(
        "[pressure_target]\nsection = {{ naca = \"0012\" }}\nflow = {{ alpha = {{ start = 1.0 }}, reynolds = 1e6 }}\n[flow]\nalpha = 1.0\n{SURROUNDINGS}[objective]\nminimize = {{ cp_error = 1.0 }}\n"
    ));
    let error = parse(&text).unwrap_err();
    assert!(error.line == Some(16) && error.message.contains("prescribed"), "{error}");
}

#[test]
fn near_a_match_the_gauss_newton_matrix_has_the_angles_as_well() {
    // pressures of the start itself: the residuals vanish, and the Hessian is the matrix
    let surroundings = SURROUNDINGS.replace("panels = 80", "panels = 160");
    let text = boxed_with(
        "columns = [1, 3], axis = \"y\"",
        &format!(
            "[pressure_target]\npoint = \"b\"\nsection = {{ naca = \"2412\", trailing_edge = \"sharp\" }}\nflow = {{ alpha = 2.0, {} }}\n\
             [[flow]]\nname = \"a\"\nalpha = {{ start = 1.0 }}\n{surroundings}\
             [[flow]]\nname = \"b\"\nalpha = {{ start = 2.0, scale = 0.5 }}\n{surroundings}\
             [objective]\nminimize = {{ cp_error = 1.0 }}\n\
             [constraints]\n\"alpha_at(a)\" = {{ max = 0.5, weight = 0.01 }}\n",
            surroundings.replace("panels = 160\n", "").trim_end().replace('\n', ", ")
        ),
    );
    let mut problem = parse(&text.replace("2412", "0012")).unwrap().problem;
    let x = problem.description().start.clone();
    let n = x.len();
    assert_eq!(problem.description().variable_names[n - 2..], ["alpha_at(a)", "alpha_at(b)"]);
    // the soft limit of half a degree, 0.01 · 0.5², is all that is left
    let start = problem.evaluate(&x).unwrap().objective;
    assert!((start - 0.0025).abs() < 1e-7, "{start}");
    let matrix = problem.gauss_newton(&x).unwrap().unwrap();
    let steps = vec![crate::differentiate::StepRange::for_scale(0.02); n];
    let mut gradient = |x: &[f64]| problem.evaluate(x).map(|e| e.gradient);
    let differences = crate::differentiate::finite_difference_jacobian(&mut gradient, &x, &steps).unwrap();
    for row in 0..n {
        for column in 0..n {
            let (model, found) = (matrix[(row, column)], differences[(row, column)].value);
            let size = (matrix[(row, row)] * matrix[(column, column)]).sqrt();
            assert!((model - found).abs() < 2e-3 * size + 1e-6 * matrix.amax(), "{row} {column}: {model} {found}");
        }
    }
    // the pressures at b depend on its own angle, and through it on nothing of a
    assert!(matrix[(n - 1, n - 1)] > 1e-6 && matrix[(0, n - 1)] != 0.0);
    assert_eq!((matrix[(n - 2, n - 2)], matrix[(n - 2, n - 1)]), (0.02, 0.0));
}

#[test]
fn flows_that_start_close_by_are_those_that_start_from_nothing() {
    let tables = format!("[flow]\nalpha = 2.0\n{SURROUNDINGS}[objective]\nminimize = {{ cd = 1.0 }}\n");
    let problem = parse(&boxed(&tables)).unwrap().problem;
    let start = problem.start_values();
    let moved: Vec<f64> = start.iter().enumerate().map(|(k, v)| v + 1e-3 * (k as f64).cos()).collect();
    let near = problem.near(&start).unwrap();
    let (expected, found) = (problem.quantities_at(&moved).unwrap(), near.quantities_at(&moved).unwrap());
    assert!(expected.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-9), "{expected:?} {found:?}");
    assert!(expected != problem.quantities_at(&start).unwrap());
}
