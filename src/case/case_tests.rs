use super::*;
use crate::design::{Bounds, Problem, check_gradients};
use crate::optimize::Termination;

fn case(text: &str) -> Result<Case, CaseError> {
    Case::parse("test.toml", text, Path::new(""))
}

const L2: &str = include_str!("../../validation/cases/l2-match.toml");

#[test]
fn builtin_cases_are_named_as_their_files_and_can_be_built() {
    for builtin in builtin_cases() {
        let case = Case::open(builtin.name).unwrap();
        assert_eq!(case.name, builtin.name);
        assert!(!case.description.is_empty());
    }
}

#[test]
fn gradients_of_every_builtin_case_agree_three_ways() {
    // the larger flow cases are checked by the validation
    let of_practice = [
        "multipoint",
        "best-angle",
        "best-glide",
        "high-lift",
        "laminar-two-reynolds",
        "rae2822-drag",
        "supercritical-multipoint",
    ];
    let large = |name: &str| name.starts_with("kulfan") || name.starts_with("naca0024") || of_practice.contains(&name);
    let small = |name: &str| name != "l2-direct" && (!large(name) || name == "naca0024-cubic-m02");
    for builtin in builtin_cases().iter().filter(|c| small(c.name)) {
        let mut case = Case::open(builtin.name).unwrap();
        let mut values = case.problem.start_values();
        for (k, (value, step)) in values.iter_mut().zip(case.problem.steps()).enumerate() {
            *value += 0.05 * step * (3.1 * k as f64).sin();
        }
        for check in check_gradients(&mut case.problem, &values).unwrap() {
            assert!(check.agrees(), "{}: {check:?}", builtin.name);
        }
    }
}

#[test]
fn hessians_agree_with_differenced_gradients() {
    for name in ["l2-match", "l2-mixed", "mirrored"] {
        let mut problem = Case::open(name).unwrap().problem;
        let x: Vec<f64> =
            problem.description().start.iter().enumerate().map(|(k, x)| x + 0.05 * (2.3 * k as f64).sin()).collect();
        let exact = problem.hessian(&x).unwrap().unwrap();
        let steps = vec![crate::differentiate::StepRange::for_scale(1.0); x.len()];
        let check =
            crate::differentiate::finite_difference_jacobian(|x| problem.evaluate(x).map(|e| e.gradient), &x, &steps)
                .unwrap();
        for row in 0..x.len() {
            for column in 0..x.len() {
                let (a, e) = (exact[(row, column)], check[(row, column)]);
                let allowed = 3.0 * e.error + 1e-8 * exact.amax();
                assert!((a - e.value).abs() <= allowed, "{name} {row} {column}: {a} {e:?}");
            }
        }
    }
}

#[test]
fn the_objective_alone_is_the_objective_of_the_evaluation() {
    for name in ["l2-match", "l2-mixed", "skewed-pinned"] {
        let mut problem = Case::open(name).unwrap().problem;
        let x: Vec<f64> = problem.description().start.iter().map(|x| x + 0.01).collect();
        let evaluation = problem.evaluate(&x).unwrap();
        let alone = problem.objective(&x).unwrap();
        assert!((alone - evaluation.objective).abs() <= 1e-14 * alone.abs());
    }
}

#[test]
fn pinned_points_stay_and_a_sharp_edge_stays_closed() {
    for name in ["mirrored", "skewed-pinned"] {
        let problem = Case::open(name).unwrap().problem;
        let start = problem.start_values();
        let moved: Vec<f64> = start
            .iter()
            .zip(problem.steps())
            .enumerate()
            .map(|(k, (v, step))| if v == &0.0 { v + 0.3 * step * (1.7 * k as f64).cos() } else { *v })
            .collect();
        let (before, after) = (problem.shape(&start).unwrap().section, problem.shape(&moved).unwrap().section);
        let [a, b] = after.trailing_edge_points();
        assert_eq!(a, b);
        for (p, q) in [(before.nose(), after.nose()), (before.trailing_edge_points()[0], a)] {
            assert!((p[0] - q[0]).abs() < 1e-15 && (p[1] - q[1]).abs() < 1e-15, "{name}: {p:?} {q:?}");
        }
        let far: f64 = before.points(50).iter().zip(after.points(50)).map(|(p, q)| (p[1] - q[1]).abs()).sum();
        assert!(far > 0.01, "nothing moved");
    }
}

#[test]
fn a_mirrored_case_stays_symmetric() {
    let problem = Case::open("mirrored").unwrap().problem;
    let values: Vec<f64> = problem.steps().iter().enumerate().map(|(k, s)| 0.3 * s * (k as f64).sin()).collect();
    let section = problem.shape(&values).unwrap().section;
    let points = section.curve().control_points();
    for (p, q) in points.iter().zip(points.iter().rev()) {
        assert!((p[0] - q[0]).abs() < 1e-15 && (p[1] + q[1]).abs() < 1e-15);
    }
}

/// Replaces one line of the L² case; the error must name the line of the replacement and say the words.
fn complaint(from: &str, to: &str, line: usize, words: &[&str]) {
    assert!(L2.contains(from), "{from}");
    let error = case(&L2.replacen(from, to, 1)).err().unwrap_or_else(|| panic!("{to} was accepted"));
    assert_eq!(error.line, Some(line), "{error}");
    for word in words {
        assert!(error.to_string().contains(word), "{error} lacks {word}");
    }
}

#[test]
fn what_is_said_of_one_variable_holds_beside_what_is_said_of_its_axis() {
    let bounds =
        "free = \"all\"\nbounds = { \"dx[1,1]\" = [0, 0], x = [-0.1, 0.1], y = [-0.2, 0.2], \"dy[2,0]\" = [0, 0.05] }";
    let case = case(&L2.replacen("free = \"all\"", bounds, 1)).unwrap();
    let description = case.problem.description();
    let of = |name: &str| {
        let place = description.variable_names.iter().position(|n| n == name).unwrap();
        let Bounds { lower, upper } = description.variable_bounds[place];
        [lower, upper]
    };
    assert_eq!(of("dx[1,1]"), [0.0, 0.0]);
    assert_eq!(of("dy[2,0]")[0], 0.0);
    // the description counts in scaled variables
    let scale = 0.2 / of("dy[1,1]")[1];
    assert!((of("dy[2,0]")[1] * scale - 0.05).abs() < 1e-15);
    let [lower, upper] = of("dx[0,0]");
    assert!(lower == -upper && upper > 0.0);
}

#[test]
fn mistakes_are_named_with_line_and_key() {
    complaint("degree = [3, 3]", "degre = [3, 3]", 18, &["degre", "did you mean `degree`"]);
    complaint("degree = [3, 3]", "degree = [4, 3]", 18, &["box.degree", "5 control points"]);
    complaint("degree = [3, 3]", "degree = [3, 0]", 18, &["box.degree", "at least 1"]);
    complaint("degree = [3, 3]", "degree = [3, -1]", 18, &["box.degree"]);
    complaint("x = [-0.1, 1.1]", "x = [0.1, 1.1]", 14, &["box", "outside"]);
    complaint("x = [-0.1, 1.1]", "x = [1.1, -0.1]", 15, &["box.x", "increase"]);
    complaint("x = [-0.1, 1.1]", "x = [-0.1, nan]", 15, &["box.x", "finite"]);
    complaint("naca = \"0012\"", "naca = \"00x2\"", 5, &["section.naca"]);
    complaint("naca = \"0012\"", "naca = 12", 5, &["section.naca", "string"]);
    complaint("naca = \"0012\"", "file = \"nowhere.dat\"", 5, &["section.file", "nowhere.dat"]);
    complaint("control_points = 101", "control_points = 3", 7, &["section.control_points"]);
    complaint("control_points = [4, 4]", "control_points = [4, -4]", 17, &["box.control_points"]);
    complaint("control_points = [4, 4]", "control_points = [40000, 40000]", 17, &["at most 10000"]);
    complaint("free = \"all\"", "free = \"most\"", 22, &["variables.free", "most"]);
    complaint("free = \"all\"", "free = [{ columns = 7 }]", 21, &["variables", "column 7"]);
    complaint("free = \"all\"", "free = \"none\"", 21, &["variables", "no design variables"]);
    complaint("free = \"all\"", "free = \"all\"\nparameters = [\"thicknes\"]", 23, &["parameters", "thickness"]);
    complaint("free = \"all\"", "free = \"all\"\nbounds = { \"dx[0,9]\" = [0, 1] }", 23, &["dx[0,9]", "did you mean"]);
    complaint("free = \"all\"", "free = \"all\"\nbounds = { y = [0.1, 0.2] }", 23, &["bounds", "order"]);
    complaint("free = \"all\"", "free = \"all\"\npin = [1.5]", 23, &["variables.pin", "1.5"]);
    complaint("free = \"all\"", "free = \"all\"\npin = [\"nos\"]", 23, &["nos"]);
    complaint("free = \"all\"", "free = \"all\"\ntied = [{ control_points = [[0, 0]], axis = \"x\" }]", 23, &["tied"]);
    complaint("[objective]", "[fold_penalty]\nalpha = 0.0\n[objective]", 25, &["fold_penalty.alpha", "positive"]);
    complaint("shape_error = 1.0,", "shape_eror = 1.0,", 25, &["shape_eror"]);
    complaint("method = \"lbfgs\"", "method = \"bfgs\"", 28, &["optimizer.method", "lbfgs"]);
    complaint("max_evaluations = 1000", "max_evaluations = 0", 29, &["at least 1"]);
    complaint("max_evaluations = 1000", "tolerance = -1.0", 29, &["positive"]);
    complaint("name = \"l2-match\"", "name = \"../x\"", 1, &["name"]);
}

#[test]
fn a_missing_table_or_broken_toml_is_an_error() {
    assert!(case("name = \"a\"").unwrap_err().to_string().contains("section"));
    assert!(case("name = ").unwrap_err().line.is_some());
    let none = L2.split("[target]").next().unwrap().to_string() + "[objective]\nminimize = { shape_error = 1.0 }\n";
    assert!(case(&none).unwrap_err().to_string().contains("[target]"));
    assert!(Case::open("no-such-case").unwrap_err().to_string().contains("neither a file nor a built-in case"));
    assert!(Case::open("l2-macth").unwrap_err().to_string().contains("did you mean l2-match"));
}

#[test]
fn limits_relative_to_the_start() {
    let problem = Case::open("skewed-pinned").unwrap().problem;
    let values = problem.quantities_at(&problem.start_values()).unwrap();
    let area = problem.quantities().iter().position(|q| q.name() == "area").unwrap();
    assert!((problem.description().constraint_bounds[0].lower - 0.5 * values[area]).abs() < 1e-15);
}

#[test]
fn a_case_runs_as_its_file_says() {
    let short = L2.replace("max_evaluations = 1000", "max_evaluations = 20\nmemory = 7\ntolerance = 1e-3");
    let mut case = case(&short).unwrap();
    assert!(matches!(&case.method, Method::Lbfgs(m) if m.memory == 7 && m.objective_tolerance == 1e-3));
    let mut seen = 0;
    let end = case
        .run(&mut |_| {
            seen += 1;
            ControlFlow::Continue(())
        })
        .unwrap();
    assert_eq!((end.outcome.evaluations, seen), (20, 20));
    // the outcome is that of its design
    let evaluation = case.evaluate_with_gradients(&end.variables).unwrap();
    let reported = end.outcome.evaluation.unwrap();
    assert!((evaluation.objective - reported.objective).abs() <= 1e-12 * reported.objective);
    assert_eq!(evaluation.fold, end.fold);
    assert_eq!(evaluation.gradients.unwrap().len(), evaluation.values.len());
    // another method takes the settings of the file
    let before = case.identity();
    case.use_method("newton").unwrap();
    assert!(matches!(&case.method, Method::Newton(m) if m.objective_tolerance == 1e-3 && m.limits.evaluations == 20));
    assert_ne!(case.identity(), before);
    assert!(
        case.use_method("simplex").unwrap_err().to_string().contains("known: lbfgs, newton, gauss-newton, slsqp, sqp")
    );
    let mut constrained = Case::open("skewed-pinned").unwrap();
    constrained.use_method("lbfgs").unwrap();
    let error = constrained.run(&mut |_| ControlFlow::Continue(())).unwrap_err();
    assert!(matches!(error, RunError::Optimize(OptimizeError::ConstraintsNotSupported { .. })), "{error}");
}

#[test]
fn design_vectors_go_by_name() {
    let case = Case::open("l2-match").unwrap();
    let vector = case.design_vector([("dy[1,1]", 0.01)]).unwrap();
    assert_eq!(vector.iter().filter(|v| **v != 0.0).count(), 1);
    let error = case.design_vector([("dy[1,11]", 0.01)]).unwrap_err();
    assert!(matches!(error, DesignError::NoVariable { suggestion: Some(_), .. }), "{error}");
}

#[test]
fn without_a_box_nothing_is_said_of_folding() {
    let text = L2.split("[box]").next().unwrap().to_string() + "[direct]\n[variables]\nfree = \"all\"\n[objective]\n";
    for (objective, more, key) in [
        ("{ fold_penalty = 1.0 }", "", "objective.minimize.fold_penalty"),
        ("{ shape_error = 1.0 }", "[constraints]\nfold_penalty = { max = 0.1 }\n", "constraints.fold_penalty"),
        ("{ shape_error = 1.0 }", "[constraints]\nfold_indicator = { min = 0.1 }\n", "constraints.fold_indicator"),
        ("{ shape_error = 1.0 }", "[report]\nvalues = [\"fold_penalty\"]\n", "report.values"),
    ] {
        let error = case(&format!("{text}minimize = {objective}\n{more}")).unwrap_err();
        assert_eq!(error.key, key, "{error}");
        assert!(error.to_string().contains("there is no [box]"), "{error}");
    }
}

#[test]
fn clones_solve_their_flows_side_by_side() {
    let problem = Case::open("naca0024-cubic-m02").unwrap().problem;
    let start = problem.description().start.clone();
    let expected = problem.clone().evaluate(&start).unwrap();
    let (mut first, mut second) = (problem.clone(), problem.clone());
    first.evaluate(&start).unwrap();
    assert_eq!((first.flow_timing().solutions, second.flow_timing().solutions), (1, 0));
    assert_eq!(second.evaluate(&start).unwrap(), expected);
    assert_eq!((first.flow_timing().solutions, second.flow_timing().solutions), (1, 1));
    // a clone knows the latest flows of the original, and nothing of later ones
    let mut third = second.clone();
    assert_eq!(third.evaluate(&start).unwrap(), expected);
    assert_eq!(third.flow_timing().solutions, 1);
}

/// The case of the paper for a symmetric section, whose camber has no place and no derivative.
fn symmetric(objective: &str, more: &str) -> String {
    format!(
        "name = \"still\"\n[section]\nnaca = \"0012\"\n[box]\nx = [-0.1, 1.1]\ny = [-0.15, 0.15]\n\
         control_points = [4, 4]\ndegree = [3, 3]\n[variables]\nfree = \"all\"\n[objective]\nminimize = {objective}\n{more}"
    )
}

#[test]
fn a_value_that_is_only_reported_may_be_missing() {
    let reported = "[report]\nvalues = [\"camber\", \"camber_x\", \"thickness\"]\n";
    let mut case = case(&symmetric("{ area = 1.0 }", reported)).unwrap();
    let start = case.problem.start_values();
    let plain = case.evaluate(&start).unwrap();
    // area of NACA 0012, and its thickness
    assert!((plain.objective - 0.0822).abs() < 1e-4, "{}", plain.objective);
    assert!(matches!(&plain.values[2], Err(error) if error.to_string().contains("no camber")), "{:?}", plain.values);
    assert!((plain.values[3].clone().unwrap() - 0.12).abs() < 1e-4);
    let sloped = case.evaluate_with_gradients(&start).unwrap();
    assert_eq!((sloped.objective, &sloped.values[2]), (plain.objective, &plain.values[2]));
    let gradients = sloped.gradients.unwrap();
    assert!(gradients[0].is_some() && gradients[2].is_none() && gradients[3].is_some());
    // an optimiser gets the derivatives that it gets without the report
    let x = case.problem.description().start.clone();
    let with = case.problem.evaluate(&x).unwrap();
    let without = self::case(&symmetric("{ area = 1.0 }", "")).unwrap().problem.evaluate(&x).unwrap();
    assert_eq!((with.objective, &with.gradient), (without.objective, &without.gradient));
    assert!(with.values[2].is_nan() && with.values[0] == with.objective);
    assert_eq!(case.problem.objective(&x).unwrap(), with.objective);
}

#[test]
fn a_start_without_a_value_is_refused_at_its_key() {
    let line = |text: &str, start: &str| text.lines().position(|line| line.starts_with(start)).map(|k| k + 1);
    for (text, key, start) in [
        (symmetric("{ area = 1.0, camber_x = 0.5 }", ""), "objective.minimize.camber_x", "minimize"),
        (
            symmetric("{ area = 1.0 }", "[constraints]\nthickness = { min = 0.1 }\ncamber_x = { max = 0.4 }\n"),
            "constraints.camber_x",
            "camber_x",
        ),
    ] {
        let error = case(&text).unwrap_err();
        assert_eq!((error.key.as_str(), error.line), (key, line(&text, start)), "{error}");
        assert!(error.to_string().contains("camber_x at the start"), "{error}");
    }
    let error = case(&symmetric("{ area = 1.0 }", "").replace("[-0.15, 0.15]", "[-0.05, 0.15]")).unwrap_err();
    assert!(error.key == "box" && error.line.is_some(), "{error}");
}

#[test]
fn a_variable_of_equal_bounds_starts_and_stays_there() {
    let bounds = "bounds = { y = [-0.05, 0.05], \"dy[1,1]\" = [0.004, 0.004] }\n";
    let text = symmetric("{ shape_error = 1.0 }", "[target]\nnaca = \"2412\"\n")
        .replace("[objective]", &format!("{bounds}[objective]"));
    let fixed = case(&text).unwrap();
    let place = fixed.problem.description().variable_names.iter().position(|name| name == "dy[1,1]").unwrap();
    assert_eq!(fixed.problem.start_values()[place], 0.004);
    let end = fixed.run(&mut |_| ControlFlow::Continue(())).unwrap();
    assert_eq!(end.outcome.status, Termination::Converged, "{}", end.outcome.message);
    assert_eq!(end.variables[place], 0.004);
    // a start that is said must agree
    let error = case(&text.replace(bounds, &format!("{bounds}start = {{ \"dy[1,1]\" = 0.0 }}\n"))).unwrap_err();
    assert!(error.to_string().contains("lower bound 0.004, start 0, upper bound 0.004"), "{error}");
}
