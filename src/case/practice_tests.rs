//! Matches, wanted pressures and objectives of practice, from case files.

use super::*;
use crate::design::{Problem, check_gradients};
use crate::flow::Incidence;
use crate::optimize::Termination;

fn parse(text: &str, folder: &Path) -> Result<Case, CaseError> {
    Case::parse("test.toml", text, folder)
}

fn case(text: &str) -> Case {
    parse(text, Path::new("")).unwrap()
}

fn run(case: &Case) -> CaseOutcome {
    case.run(&mut |_| ControlFlow::Continue(())).unwrap()
}

/// A NACA 0012 in a small box, with further tables.
fn boxed(tables: &str) -> String {
    format!(
        r#"name = "x"
[section]
naca = "0012"
trailing_edge = "sharp"
[box]
x = [-0.05, 1.05]
y = [-0.12, 0.14]
control_points = [5, 3]
degree = [3, 2]
[variables]
free = [{{ axis = "y" }}]
pin = ["nose", "tail"]
bounds = {{ y = [-0.08, 0.08] }}
{tables}"#
    )
}

const FLOW: &str = "[flow]\nalpha = 2.0\nreynolds = 3e6\nmach = 0.2\ntrip = 0.1\npanels = 80\n";

/// Coordinates of a cambered section at stations of our own.
fn coordinates() -> String {
    let section = crate::section::SectionDefinition::parse("naca3411").unwrap().section().unwrap();
    let mut text = "measured\n".to_string();
    for k in 0..=60 {
        let t = k as f64 / 60.0;
        // denser in front and behind, and not where the section has its knots
        let u = t + 0.03 * (2.0 * std::f64::consts::PI * t).sin();
        let [x, y]: [f64; 2] = section.curve().point_at(u);
        text += &format!("{x:.6} {y:.6}\n");
    }
    text
}

#[test]
fn measured_targets_are_matched_by_closest_points_and_gauss_newton() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("measured.dat"), coordinates()).unwrap();
    let text = boxed("[target]\nfile = \"measured.dat\"\n[objective]\nminimize = { shape_error = 1.0 }\n");
    let case = parse(&text, folder.path()).unwrap();
    assert_eq!(case.method.name(), "gauss-newton");
    let end = run(&case);
    assert_eq!(end.outcome.status, Termination::Converged, "{}", end.outcome.message);
    assert!(end.outcome.evaluations <= 20, "{}", end.outcome.evaluations);
    let distance = case.problem.target_distance(&end.shape).unwrap();
    let error = end.outcome.evaluation.unwrap().values[0];
    assert!(
        (distance.root_mean_square - error.sqrt()).abs() < 1e-12 && distance.root_mean_square < 4e-4,
        "{distance:?}"
    );
    // at equal parameters the same box ends far from there
    let text = text.replace("[objective]", "[shape_error]\nnorm = \"arc length\"\n[objective]");
    let case = parse(&text, folder.path()).unwrap();
    let equal = case.problem.target_distance(&run(&case).shape).unwrap();
    assert!(equal.root_mean_square > 2.0 * distance.root_mean_square, "{equal:?}");
}

#[test]
fn the_method_follows_the_problem() {
    let of = |tables: &str| case(&boxed(tables)).method.name();
    let target = "[target]\nnaca = \"2412\"\ntrailing_edge = \"sharp\"\n";
    let with = |rest: &str| of(&format!("{target}{rest}"));
    assert_eq!(with("[objective]\nminimize = { shape_error = 1.0, fold_penalty = 1.0 }\n"), "gauss-newton");
    assert_eq!(with("[objective]\nminimize = { shape_error = 1.0, area = 1.0 }\n"), "lbfgs");
    assert_eq!(with("[objective]\nminimize = { shape_error = -1.0 }\n"), "lbfgs");
    let norm = "[shape_error]\nnorm = \"root mean square\"\n[objective]\nminimize = { shape_error = 1.0 }\n";
    assert_eq!(with(norm), "lbfgs");
    let limits = |limit: &str| {
        with(&format!("[objective]\nminimize = {{ shape_error = 1.0 }}\n[constraints]\narea = {limit}\n"))
    };
    assert_eq!(limits("{ min = 0.08 }"), "sqp");
    assert_eq!(limits("{ min = 0.08, weight = 10.0 }"), "gauss-newton");
}

#[test]
fn pressures_of_another_section_give_its_shape() {
    let tables = format!(
        "[pressure_target]\nsection = {{ naca = \"1412\", trailing_edge = \"sharp\" }}\n[target]\nnaca = \"1412\"\ntrailing_edge = \"sharp\"\n{FLOW}[objective]\nminimize = {{ cp_error = 1.0 }}\n"
    );
    let case = case(&boxed(&tables));
    assert_eq!(case.method.name(), "gauss-newton");
    let end = run(&case);
    assert_eq!(end.outcome.status, Termination::Converged, "{}", end.outcome.message);
    assert!(end.outcome.evaluations <= 15, "{}", end.outcome.message);
    let start = case.problem.shape(&case.problem.start_values()).unwrap();
    let [before, after] =
        [&start, &end.shape].map(|shape| case.problem.target_distance(shape).unwrap().root_mean_square);
    assert!(before > 5e-3 && after < 0.2 * before, "{before:e} {after:e}");
}

#[test]
fn derivatives_of_pressures_and_soft_limits_agree_with_differences() {
    let table = "[pressure_target]\nupper = [[0.0, 0.9], [0.02, -0.6], [0.3, -0.7], [1.0, 0.2]]\nlower = [[0.0, 0.9], [0.1, -0.2], [0.9, 0.1]]\n";
    for flow in [FLOW.to_string(), FLOW.replace("alpha = 2.0", "cl = 0.3")] {
        let text = boxed(&format!(
            "{table}{flow}[objective]\nminimize = {{ cp_error = 1.0 }}\nmaximize = {{ \"cl^1.5/cd\" = 0.001, \"cl/cd\" = 0.001 }}\n[constraints]\ncm = {{ min = 0.02, weight = 100.0 }}\nthickness = {{ max = 0.11, weight = 5.0 }}\narea = {{ min = 0.01, weight = 5.0 }}\n"
        ));
        let mut case = case(&text);
        let values: Vec<f64> = (0..case.problem.start_values().len()).map(|k| 0.004 * (2.1 * k as f64).sin()).collect();
        let checks = check_gradients(&mut case.problem, &values).unwrap();
        for name in ["cp_error", "cl^1.5/cd", "cl/cd", "soft(cm)", "soft(thickness)", "soft(area)", "cm"] {
            assert!(checks.iter().any(|c| c.quantity == name), "{name}");
        }
        for check in checks {
            assert!(check.agrees(), "{check:?}");
        }
        // the objective is the sum of its terms, and its gradient that of the evaluation
        let evaluation = case.evaluate_with_gradients(&values).unwrap();
        let weights = case.problem.objective_weights();
        let terms = evaluation.values.iter().zip(weights).filter(|(_, w)| **w != 0.0);
        let sum: f64 = terms.map(|(v, w)| v.as_ref().unwrap() * w).sum();
        assert!((sum - evaluation.objective).abs() < 1e-12 * sum.abs());
        let scaled: Vec<f64> =
            case.problem.geometry().variables().iter().zip(&values).map(|(v, x)| x / v.scale).collect();
        let whole = case.problem.evaluate(&scaled).unwrap();
        assert!((whole.objective - evaluation.objective).abs() < 1e-12 * sum.abs());
        for (k, variable) in case.problem.geometry().variables().iter().enumerate() {
            let gradients = evaluation.gradients.as_ref().unwrap();
            let terms = gradients.iter().zip(case.problem.objective_weights()).filter(|(_, w)| **w != 0.0);
            let slope: f64 = terms.map(|(g, w)| g.as_ref().unwrap()[k] * w * variable.scale).sum();
            assert!((slope - whole.gradient[k]).abs() < 1e-9 * (1.0 + slope.abs()), "{slope} {}", whole.gradient[k]);
        }
    }
}

#[test]
fn near_a_match_the_gauss_newton_matrix_of_pressures_is_the_hessian() {
    // pressures of the start itself: the residuals vanish, and the Hessian is the matrix
    let tables = format!(
        "[pressure_target]\nsection = {{ naca = \"0012\", trailing_edge = \"sharp\" }}\n{FLOW}[objective]\nminimize = {{ cp_error = 1.0 }}\n"
    );
    let mut problem = case(&boxed(&tables.replace("panels = 80", "panels = 160"))).problem;
    let x = problem.description().start.clone();
    assert!(problem.evaluate(&x).unwrap().objective < 1e-12);
    let matrix = problem.gauss_newton(&x).unwrap().unwrap();
    let steps = vec![crate::differentiate::StepRange::for_scale(0.02); x.len()];
    let gradient = |x: &[f64]| problem.evaluate(x).map(|e| e.gradient);
    let mut gradient = gradient;
    let differences = crate::differentiate::finite_difference_jacobian(&mut gradient, &x, &steps).unwrap();
    for row in 0..x.len() {
        for column in 0..x.len() {
            let (model, found) = (matrix[(row, column)], differences[(row, column)].value);
            assert!((model - found).abs() < 1e-3 * matrix.amax(), "{row} {column}: {model} {found}");
        }
    }
}

#[test]
fn the_stations_of_the_layer_are_those_of_the_case() {
    let drag = |stations: &str| {
        let mut case =
            parse(&boxed(&format!("{FLOW}{stations}[objective]\nminimize = {{ cd = 1.0 }}\n")), Path::new(""))?;
        let start = case.problem.description().start.clone();
        Ok::<f64, CaseError>(case.problem.evaluate(&start).unwrap().objective)
    };
    let [usual, said, more] = ["", "stations = 128\n", "stations = 256\n"].map(|text| drag(text).unwrap());
    assert_eq!(usual, said);
    assert!(usual != more && (more / usual - 1.0).abs() < 0.01, "{usual} {more}");
    let error = drag("stations = 20\n").unwrap_err().to_string();
    assert!(error.contains("flow.stations") && error.contains("from 32 to 1000"), "{error}");
}

#[test]
fn soft_limits_give_way_by_their_weight() {
    let end = |weight: f64| {
        let text = boxed(&format!(
            "[target]\nnaca = \"0012\"\ntrailing_edge = \"sharp\"\n[objective]\nminimize = {{ shape_error = 1.0 }}\n[constraints]\narea = {{ min = 0.09, weight = {weight} }}\n"
        ));
        let case = case(&text);
        let end = run(&case);
        assert_eq!(end.outcome.status, Termination::Converged, "{}", end.outcome.message);
        case.evaluate(&end.variables).unwrap().values[2].clone().unwrap()
    };
    let areas = [0.01, 1.0, 100.0].map(end);
    assert!(0.0817 < areas[0] && areas[0] < areas[1] && areas[1] < areas[2] && areas[2] < 0.09, "{areas:?}");
    assert!(0.09 - areas[2] < 1e-4, "{areas:?}");
}

#[test]
fn lists_of_values_are_operating_points() {
    let text = boxed(
        "[[flow]]\nname = \"cruise\"\nweight = 3.0\ncl = 0.4\nreynolds = [2e6, 4e6]\nncrit = [7.0, 9.0, 11.0]\n[[flow]]\nalpha = 1.0\nreynolds = 1e6\ntrip = [[0.1, 0.2], [1.0, 1.0]]\n[objective]\nminimize = { cd = 1.0 }\n[constraints]\n\"mean(cl)\" = { min = 0.1 }\ncm = { min = -0.2 }\n",
    );
    let case = case(&text);
    let points = case.problem.operating_points();
    let names: Vec<&str> = points.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["cruise-1", "cruise-2", "cruise-3", "cruise-4", "cruise-5", "cruise-6", "2-1", "2-2"]);
    assert!(
        points[..6].iter().all(|p| (p.weight - 0.125).abs() < 1e-15 && p.condition.incidence == Incidence::Lift(0.4))
    );
    assert!(points[6..].iter().all(|p| (p.weight - 0.125).abs() < 1e-15));
    assert_eq!((points[4].condition.reynolds, points[4].condition.n_critical), (4e6, 9.0));
    assert_eq!(points[6].condition.trips, [Some(0.1), Some(0.2)]);
    let constraints = &case.problem.description().constraint_names;
    assert_eq!((constraints.len(), constraints.iter().filter(|n| *n == "cl").count()), (9, 1));
    for (name, key) in [
        ("ncrit = [9.0, -1.0]", "flow.ncrit"),
        ("ncrit = []", "flow.ncrit"),
        ("trip = [[0.1], [0.2, 0.3, 0.4]]", "flow.trip"),
    ] {
        let text =
            boxed(&format!("[flow]\ncl = 0.4\nreynolds = 2e6\n{name}\n[objective]\nminimize = {{ cd = 1.0 }}\n"));
        let error = parse(&text, Path::new("")).unwrap_err();
        assert!(error.key == key && error.line == Some(17), "{error}");
    }
}

#[test]
fn faulty_targets_are_refused_with_their_key() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cp.dat"), "1 0.2\n0.5 -0.6\n0.6 1\n0 1\n1 0.1\n").unwrap();
    for (table, flow, line, words) in [
        ("file = \"cp.dat\"", FLOW, Some(15), "cp.dat:3: x turns here"),
        ("file = \"none.dat\"", FLOW, Some(15), "cannot be read"),
        ("upper = [[0.0, 1.0]]", FLOW, Some(15), "two points or more"),
        ("point = \"cruise\"\nupper = [[0.0, 1.0], [1.0, 0.0]]", FLOW, Some(15), "no operating point \"cruise\""),
        ("upper = [[0.0, 1.0], [1.0, 0.0]]\nfile = \"cp.dat\"", FLOW, Some(14), "exactly one"),
        ("upper = [[0.0, 1.0], [1.0, 0.0]]\nflow = { alpha = 1.0, reynolds = 1e6 }", FLOW, Some(16), "not given"),
        ("section = { naca = \"0012\" }\nflow = { alpha = 1.0 }", FLOW, Some(16), "reynolds"),
        (
            "section = { naca = \"0012\" }\nflow = { alpha = 40.0, reynolds = 1e6 }",
            FLOW,
            Some(15),
            "no pressures to match",
        ),
        ("upper = [[0.0, 1.0], [1.0, 0.0]]", "", Some(14), "[flow]"),
    ] {
        let text = boxed(&format!("[pressure_target]\n{table}\n{flow}[objective]\nminimize = {{ area = 1.0 }}\n"));
        let error = parse(&text, folder.path()).unwrap_err();
        assert!(error.line == line && error.to_string().contains(words), "{table}: {error}");
    }
    let text = boxed(&format!("{FLOW}[objective]\nminimize = {{ cp_error = 1.0 }}\n"));
    assert!(parse(&text, Path::new("")).unwrap_err().message.contains("[pressure_target]"));
    let text =
        boxed("[objective]\nminimize = { area = 1.0 }\n[constraints]\nthickness = { min = 0.1, weight = 0.0 }\n");
    let error = parse(&text, Path::new("")).unwrap_err();
    assert!(error.message.contains("positive") && error.line == Some(17), "{error}");
    assert!(parse(&boxed("[objective]\n"), Path::new("")).unwrap_err().message.contains("nothing to minimise"));
}

#[test]
fn a_lift_that_is_held_is_reached_or_the_flow_has_failed() {
    // transition runs along the lower side at about 1.65 degrees, where the lift does not grow with the angle
    let names = ["upper_0", "upper_1", "upper_2", "upper_3", "lower_0", "lower_1", "lower_2", "lower_3"];
    let place = [0.225_52, 0.166_62, 0.474_92, 0.194_21, -0.044_98, -0.108_79, -0.038_92, -0.090_58];
    let start: Vec<String> = names.iter().zip(place).map(|(name, value)| format!("{name} = {value}")).collect();
    let case = case(&format!(
        "name = \"x\"\n[section]\nkulfan = {{ upper = [0.2, 0.25, 0.22, 0.25], lower = [-0.16, -0.1, -0.1, -0.05] }}\n\
         [variables]\nparameters = {names:?}\nstart = {{ {} }}\n[flow]\ncl = 0.6\nreynolds = 3e6\n\
         [objective]\nminimize = {{ cd = 1.0 }}\n[report]\nvalues = [\"cl\"]\n",
        start.join(", ")
    ));
    let values = case.evaluate(&case.problem.start_values()).unwrap().values;
    match &values[1] {
        Ok(lift) => assert!((lift - 0.6).abs() < 1e-8, "{lift}"),
        Err(error) => assert!(error.to_string().contains("0.6 is not reached"), "{error}"),
    }
}
