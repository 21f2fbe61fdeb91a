//! The command as a user runs it.

mod common;

use common::{aeroform, folder, json, refused, text};
use std::fs;
use std::path::PathBuf;

fn files(path: PathBuf) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(path).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn the_main_job_beats_the_paper_and_writes_its_files() {
    let folder = folder();
    let output = aeroform(&["run", "l2-match", "--json"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let result = json(&output);
    assert_eq!(result["status"], "converged");
    assert!(result["objective"].as_f64().unwrap() <= 3.65e-7);
    assert!(result["min_fold_indicator"].as_f64().unwrap() > 0.0 && result["folded"] == false);
    assert_eq!(result["variables"].as_object().unwrap().len(), 32);
    let out = folder.path().join("out/l2-match");
    assert_eq!(
        files(out.clone()),
        [
            ".aeroform.lock",
            "checkpoint.json",
            "convergence.svg",
            "final.dat",
            "final.step",
            "final.svg",
            "history.csv",
            "initial.svg",
            "report.html",
            "result.json"
        ]
    );
    let written: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(out.join("result.json")).unwrap()).unwrap();
    assert_eq!(written, result);
    // passes the paper's final objective within the paper's evaluations
    let history = fs::read_to_string(out.join("history.csv")).unwrap();
    let passed =
        history.lines().skip(1).position(|row| row.split(',').nth(2).unwrap().parse::<f64>().unwrap() <= 4.0e-7);
    assert!(passed.unwrap() < 244, "{passed:?}");
    // the result is a design vector that evaluates to the result
    let back = aeroform(&["evaluate", "l2-match", "--at", "out/l2-match/result.json", "--json"], folder.path());
    let (a, b) = (json(&back)["objective"].as_f64().unwrap(), result["objective"].as_f64().unwrap());
    assert!((a - b).abs() <= 1e-12 * b);
    // every quantity has its start and its end
    assert!(result["initial_objective"].as_f64().unwrap() > 1e-3);
    let start = json(&aeroform(&["evaluate", "l2-match", "--json"], folder.path()));
    assert_eq!(result["initial"], start["values"]);
    assert_eq!(result["initial_variables"], start["variables"]);
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    for words in ["From start to end", "What holds it there", "the box has not folded", "agree with finite differences"]
    {
        assert!(page.contains(words), "{words}");
    }
    // what was written can be read as a section again
    let section = aeroform(&["section", "out/l2-match/final.dat", "--json"], folder.path());
    assert!(json(&section)["camber"].as_f64().unwrap() > 0.07);
}

#[test]
fn the_second_order_method_needs_few_evaluations() {
    let folder = folder();
    for (case, objective, most) in [
        ("l2-match", 3.65e-7, 40),
        ("l2-5x5-cubic", 1e-7, 80),
        ("l2-5x5-quadratic", 1e-7, 80),
        ("l2-6x6-cubic", 1e-7, 80),
    ] {
        let out = format!("newton-{case}");
        let output = aeroform(&["run", case, "--method", "newton", "--out", &out, "--json"], folder.path());
        let result = json(&output);
        assert!(result["objective"].as_f64().unwrap() <= objective && result["folded"] == false, "{result}");
        let history = fs::read_to_string(folder.path().join(out).join("history.csv")).unwrap();
        let mut objectives =
            history.lines().skip(1).map(|row| row.split(',').nth(2).unwrap().parse().unwrap_or(f64::NAN));
        assert!(objectives.position(|f: f64| f <= objective).unwrap() < most, "{case}");
    }
}

#[test]
fn a_resumed_run_ends_at_the_same_bits() {
    let folder = folder();
    let whole = json(&aeroform(&["run", "l2-match", "--out", "whole", "--json"], folder.path()));
    // a run that was stopped: the checkpoint holds the first evaluations only
    let path = folder.path().join("whole/checkpoint.json");
    let mut checkpoint: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    checkpoint["records"].as_array_mut().unwrap().truncate(57);
    fs::create_dir(folder.path().join("part")).unwrap();
    fs::write(folder.path().join("part/checkpoint.json"), checkpoint.to_string()).unwrap();
    let resumed = json(&aeroform(&["run", "l2-match", "--out", "part", "--resume", "--json"], folder.path()));
    assert_eq!(resumed["variables"], whole["variables"]);
    assert_eq!(resumed["evaluations"], whole["evaluations"]);
    // another case must not go on from it
    refused(&aeroform(&["run", "l2-5x5-cubic", "--out", "part", "--resume"], folder.path()), &["another run"]);
    fs::write(folder.path().join("part/checkpoint.json"), "{\"aeroform_ch").unwrap();
    refused(&aeroform(&["run", "l2-match", "--out", "part", "--resume"], folder.path()), &["checkpoint.json"]);
}

#[test]
fn a_drag_case_converges_resumes_at_the_same_bits_and_reports() {
    let folder = folder();
    let whole = json(&aeroform(&["run", "naca0024-cubic-m02", "--out", "whole", "--json"], folder.path()));
    assert_eq!(whole["status"], "converged", "{}", whole["message"]);
    assert!(whole["kkt_residual"].as_f64().unwrap() <= 1e-6);
    let area = &whole["constraints"]["area"];
    assert!((area["value"].as_f64().unwrap() - area["lower"].as_f64().unwrap()).abs() <= 1e-10);
    // symmetric to the last bits
    let dat = fs::read_to_string(folder.path().join("whole/final.dat")).unwrap();
    let points: Vec<[f64; 2]> = dat
        .lines()
        .filter_map(|line| {
            let mut numbers = line.split_whitespace().map(str::parse);
            Some([numbers.next()?.ok()?, numbers.next()?.ok()?])
        })
        .collect();
    assert!(points.len() > 50);
    for (upper, lower) in points.iter().zip(points.iter().rev()) {
        assert!((upper[1] + lower[1]).abs() <= 1e-14, "{upper:?} {lower:?}");
    }
    let report = fs::read_to_string(folder.path().join("whole/report.html")).unwrap();
    for part in ["converged", "<svg", "Pressure", "Gradient check", "Timing", "trailing_edge_angle", "aeroform run"] {
        assert!(report.contains(part), "{part}");
    }
    assert!(!report.contains("<script") && !report.contains("href"));
    // stopped near the start, half-way and towards the end
    let path = folder.path().join("whole/checkpoint.json");
    let checkpoint: serde_json::Value = serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap();
    for kept in [3, 11, 18] {
        let mut part = checkpoint.clone();
        part["records"].as_array_mut().unwrap().truncate(kept);
        let name = format!("part{kept}");
        fs::create_dir(folder.path().join(&name)).unwrap();
        fs::write(folder.path().join(&name).join("checkpoint.json"), part.to_string()).unwrap();
        let resumed =
            json(&aeroform(&["run", "naca0024-cubic-m02", "--out", &name, "--resume", "--json"], folder.path()));
        assert_eq!(resumed["variables"], whole["variables"], "resumed after {kept}");
        assert_eq!(resumed["evaluations"], whole["evaluations"]);
    }
}

#[test]
fn a_supersonic_start_ends_at_once_and_says_so() {
    let folder = folder();
    // by the panel solver, which knows no shocks
    let case = fs::read_to_string("validation/cases/naca0024-cubic.toml").unwrap();
    fs::write(folder.path().join("fast.toml"), case.replace("\"streamtube\"", "\"panel\"")).unwrap();
    let output = aeroform(&["run", "fast.toml", "--out", "fast"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("supersonic"), "{}", text(&output.stderr));
    assert!(folder.path().join("fast/report.html").exists());
    // what has no value at the start is null, the rest is there
    let result = fs::read_to_string(folder.path().join("fast/result.json")).unwrap();
    let result: serde_json::Value = serde_json::from_str(&result).unwrap();
    assert!(result["initial"]["cd"].is_null() && result["initial_objective"].is_null());
    assert!(result["initial"]["area"].as_f64().unwrap() > 0.1);
}

#[test]
fn the_flow_solver_is_chosen_by_name_or_by_the_critical_mach_number() {
    let folder = folder();
    let case = fs::read_to_string("validation/cases/naca0024-cubic.toml").unwrap();
    let evaluate = |name: &str, text: String| {
        fs::write(folder.path().join(name), text).unwrap();
        aeroform(&["evaluate", name, "--json"], folder.path())
    };
    let drag = |output: &std::process::Output| common::json(output)["values"]["cd"].as_f64().unwrap();
    let automatic = drag(&evaluate("auto.toml", case.replace("\"streamtube\"", "\"auto\"")));
    assert!((0.0313..0.0326).contains(&automatic), "{automatic}");
    // slow flow is left to the panel solver
    let slow = case.replace("mach = 0.7", "mach = 0.2");
    let slow_automatic = drag(&evaluate("slow.toml", slow.replace("\"streamtube\"", "\"auto\"")));
    let slow_panel = drag(&evaluate("panel.toml", slow.replace("\"streamtube\"", "\"panel\"")));
    assert_eq!(slow_automatic, slow_panel);
    let unknown = evaluate("unknown.toml", case.replace("\"streamtube\"", "\"euler\""));
    refused(&unknown, &["unknown.toml", "solver", "euler", "panel, streamtube, auto"]);
    let fast = evaluate("fast.toml", case.replace("mach = 0.7", "mach = 0.93"));
    refused(&fast, &["fast.toml", "mach", "0.93", "from 0.1 to 0.9"]);
}

#[test]
fn flow_tables_are_checked() {
    let folder = folder();
    let good = include_str!("../validation/cases/multipoint.toml");
    for (from, to, words) in [
        ("cl = 0.6", "cl = 0.6\nalpha = 1.0", &["flow", "either"][..]),
        ("mach = 0.1\n", "mach = 1.5\n", &["mach", "1.5"]),
        ("name = \"dash\"", "name = \"slow\"", &["two operating points"]),
        ("\"cm_at(cruise)\"", "\"cm_at(crush)\"", &["crush", "cruise"]),
        ("reynolds = 3e6", "reynods = 3e6", &["reynods", "did you mean"]),
        ("weight = 0.5", "weight = -0.5", &["weight"]),
    ] {
        assert!(good.contains(from), "{from}");
        fs::write(folder.path().join("case.toml"), good.replacen(from, to, 1)).unwrap();
        refused(&aeroform(&["run", "case.toml"], folder.path()), words);
    }
    let none = include_str!("../validation/cases/l2-match.toml").replace("fold_penalty = 1.0", "cd = 1.0");
    fs::write(folder.path().join("case.toml"), none).unwrap();
    refused(&aeroform(&["run", "case.toml"], folder.path()), &["[flow]"]);
}

#[test]
fn a_quantity_is_constrained_once_whatever_it_is_called() {
    let folder = folder();
    let good = include_str!("../validation/cases/multipoint.toml");
    let last = "fold_indicator = { min = 0.4 }\n";
    let line = 2 + good[..good.find(last).unwrap()].lines().count();
    for (again, quantity, earlier) in [
        ("\"cm at cruise\"", "cm_at(cruise)", "cm_at(cruise)"),
        ("\"cm_at( cruise )\"", "cm_at(cruise)", "cm_at(cruise)"),
        ("cm", "cm_at(cruise)", "cm_at(cruise)"),
        ("\"thickness at 0.70\"", "thickness_at(0.7)", "thickness_at(0.7)"),
    ] {
        let text = good.replacen(last, &format!("{last}{again} = {{ max = 1.0 }}\n"), 1);
        fs::write(folder.path().join("case.toml"), &text).unwrap();
        let place = format!("case.toml:{line}: constraints.");
        for command in ["run", "evaluate"] {
            let output = aeroform(&[command, "case.toml"], folder.path());
            refused(&output, &[&place, &format!("{quantity} is constrained by {earlier:?} already")]);
        }
    }
}

#[test]
fn every_constraint_is_in_the_result_under_one_spelling() {
    let folder = folder();
    let case = text(&aeroform(&["cases", "multipoint"], folder.path()).stdout)
        .replacen("[constraints]\n", "[constraints]\n\"cd at cruise\" = { max = 1.0 }\ncl = { max = 9.0 }\n", 1)
        .replacen("[optimizer]\n", "[optimizer]\nmax_evaluations = 1\n", 1);
    fs::write(folder.path().join("case.toml"), case).unwrap();
    let result = json(&aeroform(&["run", "case.toml", "--json"], folder.path()));
    let constraints = result["constraints"].as_object().unwrap();
    for name in ["cd_at(cruise)", "cl_at(slow)", "cl_at(cruise)", "cl_at(dash)"] {
        assert!(constraints.contains_key(name) && result["values"].get(name).is_some(), "{name}: {result}");
    }
    assert!(constraints.keys().all(|name| !name.contains(" at ")), "{result}");
    let history = fs::read_to_string(folder.path().join("out/multipoint/history.csv")).unwrap();
    assert!(history.lines().next().unwrap().contains(",cd_at(cruise),"));
}

#[test]
fn gradients_agree_on_built_in_cases() {
    let folder = folder();
    for case in ["l2-match", "l2-mixed", "mirrored", "skewed-pinned"] {
        let output = aeroform(&["gradients", case, "--json"], folder.path());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let result = json(&output);
        assert!(result["worst_route_error"].as_f64().unwrap() <= 1e-12, "{case}");
    }
    let table = aeroform(&["gradients", "mirrored"], folder.path());
    assert!(text(&table.stdout).contains("shape_error") && text(&table.stdout).contains("agree"));
}

#[test]
fn evaluate_takes_a_design_vector() {
    let folder = folder();
    fs::write(folder.path().join("at.json"), "{\"dy[1,1]\": 0.01}").unwrap();
    let output = aeroform(&["evaluate", "l2-match", "--at", "at.json", "--gradients", "--json"], folder.path());
    let result = json(&output);
    assert_eq!(result["variables"]["dy[1,1]"], 0.01);
    assert_eq!(result["variables"]["dx[1,1]"], 0.0);
    assert_eq!(result["gradients"]["shape_error"].as_object().unwrap().len(), 32);
    fs::write(folder.path().join("at.json"), "{\"dy[1,9]\": 0.01}").unwrap();
    refused(&aeroform(&["evaluate", "l2-match", "--at", "at.json"], folder.path()), &["dy[1,9]", "at.json"]);
    fs::write(folder.path().join("at.json"), "{\"dy[1,1]\": \"high\"}").unwrap();
    refused(&aeroform(&["evaluate", "l2-match", "--at", "at.json"], folder.path()), &["dy[1,1]", "finite"]);
    fs::write(folder.path().join("at.json"), "[1, 2").unwrap();
    refused(&aeroform(&["evaluate", "l2-match", "--at", "at.json"], folder.path()), &["at.json:1"]);
}

#[test]
fn sections_are_measured_and_exported() {
    let folder = folder();
    let result = json(&aeroform(&["section", "naca0012:sharp", "--json"], folder.path()));
    let number = |key: &str| result[key].as_f64().unwrap();
    assert!((number("area") - 0.68088 * 0.12).abs() < 1e-4);
    assert!((number("thickness") - 0.12).abs() < 1e-4);
    assert!((number("thickness_x") - 0.3).abs() < 2e-3);
    assert_eq!(number("trailing_edge_gap"), 0.0);
    assert!(result["camber_x"].is_null());
    assert_eq!(result["control_points"], 101);
    for ending in ["dat", "svg", "step", "igs", "dxf", "csv"] {
        let name = format!("exports/section.{ending}");
        let output = aeroform(&["section", "naca2412", "--out", &name], folder.path());
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(fs::metadata(folder.path().join(name)).unwrap().len() > 1000);
    }
    assert_eq!(files(folder.path().join("exports")).len(), 6);
    let kulfan = aeroform(&["section", "kulfan:upper=0.2,0.2/lower=-0.1,-0.1"], folder.path());
    assert!(kulfan.status.success());
    refused(&aeroform(&["section", "naca2412", "--out", "section.stl"], folder.path()), &[".stl", ".step"]);
    refused(&aeroform(&["section", "naca24"], folder.path()), &["naca24"]);
    refused(&aeroform(&["section", "nowhere.dat"], folder.path()), &["nowhere.dat"]);
}

#[test]
fn broken_coordinate_files_are_refused_with_their_line() {
    let folder = folder();
    let cases: [(&str, &[u8], &str); 6] = [
        ("empty", b"", "no coordinates"),
        ("nan", b"name\n1 0\n0.5 nan\n0 0\n0.5 -0.1\n1 0\n", "3"),
        ("one", b"name\n1 0\n", "point"),
        ("binary", &[0x7f, 0x45, 0x4c, 0x46, 0, 1, 2, 255, 254, 0, 0, 9], ""),
        ("truncated", b"name\n1 0\n0.5 0.1\n0.2\n", "4"),
        ("words", b"name\n1 0\n0.5 abc\n", "3"),
    ];
    for (name, bytes, words) in cases {
        fs::write(folder.path().join(name), bytes).unwrap();
        let output = aeroform(&["section", name, "--out", "x.dat"], folder.path());
        refused(&output, &[name, words]);
        assert!(!folder.path().join("x.dat").exists());
    }
}

#[test]
fn mistakes_in_a_case_are_refused_before_anything_is_written() {
    let folder = folder();
    let good = text(&aeroform(&["cases", "l2-match"], folder.path()).stdout);
    for (from, to, words) in [
        ("degree =", "degre =", ["case.toml:18", "degree"]),
        ("degree = [3, 3]", "degree = [4, 4]", ["case.toml:18", "control points"]),
        ("x = [-0.1, 1.1]", "x = [0.0, 0.9]", ["case.toml", "outside"]),
        ("x = [-0.1, 1.1]", "x = \"wide\"", ["case.toml:15", "box.x"]),
        ("control_points = [4, 4]", "control_points = [-4, 4]", ["case.toml:17", "box.control_points"]),
        ("[objective]", "[fold_penalty]\nalpha = 0\n[objective]", ["case.toml:25", "alpha"]),
        ("naca = \"0012\"", "file = \"gone.dat\"", ["case.toml:5", "gone.dat"]),
    ] {
        assert!(good.contains(from));
        fs::write(folder.path().join("case.toml"), good.replacen(from, to, 1)).unwrap();
        for command in ["run", "evaluate", "gradients"] {
            refused(&aeroform(&[command, "case.toml"], folder.path()), &words);
        }
        assert_eq!(files(folder.path().to_path_buf()), ["case.toml"]);
    }
    fs::write(folder.path().join("case.toml"), [0xff, 0xfe, 0x00]).unwrap();
    refused(&aeroform(&["run", "case.toml"], folder.path()), &["case.toml", "UTF-8"]);
    refused(&aeroform(&["run", "l2-mach"], folder.path()), &["did you mean l2-match"]);
    refused(&aeroform(&["run", "skewed-pinned", "--method", "lbfgs"], folder.path()), &["constraints", "slsqp"]);
    refused(&aeroform(&["run", "l2-match", "--method", "simplex"], folder.path()), &["lbfgs"]);
}

#[test]
fn an_unwritable_directory_fails_before_the_run() {
    let folder = folder();
    // a file stands where the directory should be
    fs::write(folder.path().join("taken"), "").unwrap();
    refused(&aeroform(&["run", "l2-match", "--out", "taken"], folder.path()), &["taken"]);
    refused(&aeroform(&["run", "l2-match", "--out", "taken/below"], folder.path()), &["taken"]);
}

#[test]
fn a_run_stopped_by_its_limit_says_so_and_keeps_its_best() {
    let folder = folder();
    let good = text(&aeroform(&["cases", "l2-match"], folder.path()).stdout);
    fs::write(folder.path().join("short.toml"), good.replace("max_evaluations = 1000", "max_evaluations = 20"))
        .unwrap();
    let output = aeroform(&["run", "short.toml", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    let result = json(&output);
    assert_eq!(result["status"], "evaluation limit");
    assert!(result["objective"].as_f64().unwrap() < 1e-3);
    assert!(text(&output.stderr).contains("limit"));
}

#[test]
fn cases_are_listed() {
    let folder = folder();
    let list = text(&aeroform(&["cases"], folder.path()).stdout);
    assert!(list.contains("l2-match") && list.contains("32 variables"));
    let result = json(&aeroform(&["cases", "--json"], folder.path()));
    assert!(result["cases"].as_array().unwrap().len() >= 10);
}
