//! Runs that lose nothing and mix nothing up: what the command does when files change, disks are full, readers go away
//! and threads cannot be had.

mod common;

use common::{aeroform, folder, json, refused, text};
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

/// A short run that matches a section file with another.
const CASE: &str = r#"
name = "match"
[section]
file = "start.dat"
[target]
file = "target.dat"
[box]
x = [-0.1, 1.1]
y = [-0.15, 0.15]
control_points = [4, 4]
degree = [3, 3]
[variables]
free = "all"
[objective]
minimize = { shape_error = 1.0, fold_penalty = 1.0 }
[optimizer]
method = "lbfgs"
max_evaluations = 40
"#;

/// The case with both of its section files.
fn prepared() -> tempfile::TempDir {
    let folder = folder();
    fs::write(folder.path().join("case.toml"), CASE).unwrap();
    for (file, shape) in [("start.dat", "naca0012:sharp"), ("target.dat", "naca2412:sharp")] {
        assert!(aeroform(&["section", shape, "--out", file], folder.path()).status.success());
    }
    folder
}

fn objective(folder: &Path, arguments: &[&str]) -> f64 {
    let output = aeroform(arguments, folder);
    assert_ne!(output.status.code(), Some(2), "{}", text(&output.stderr));
    json(&output)["objective"].as_f64().unwrap()
}

#[test]
fn a_checkpoint_of_other_files_or_another_method_is_refused() {
    let folder = prepared();
    let run = ["run", "case.toml", "--json"];
    let resume = ["run", "case.toml", "--json", "--resume"];
    let first = objective(folder.path(), &run);
    assert_eq!(objective(folder.path(), &resume).to_bits(), first.to_bits());
    for (file, shape, words) in [
        ("target.dat", "naca4412:sharp", "the target file target.dat has another content"),
        ("start.dat", "naca0011:sharp", "the section file start.dat has another content"),
    ] {
        let before = fs::read(folder.path().join(file)).unwrap();
        assert!(aeroform(&["section", shape, "--out", file], folder.path()).status.success());
        refused(&aeroform(&resume, folder.path()), &["belongs to another run", words]);
        fs::write(folder.path().join(file), before).unwrap();
    }
    refused(
        &aeroform(&["run", "case.toml", "--resume", "--method", "newton"], folder.path()),
        &["the method was lbfgs, is newton"],
    );
    fs::write(folder.path().join("case.toml"), CASE.replace("0.15]", "0.16]")).unwrap();
    refused(&aeroform(&resume, folder.path()), &["the table [box] of the case has another content"]);
    fs::write(folder.path().join("case.toml"), CASE).unwrap();
    // one of another version
    let path = folder.path().join("out/match/checkpoint.json");
    let stored = fs::read_to_string(&path).unwrap();
    let version = concat!("aeroform ", env!("CARGO_PKG_VERSION"));
    assert!(stored.contains(version));
    fs::write(&path, stored.replace(version, "aeroform 0.0.1")).unwrap();
    refused(&aeroform(&resume, folder.path()), &["the program was aeroform 0.0.1"]);
    fs::write(&path, stored).unwrap();
    assert_eq!(objective(folder.path(), &resume).to_bits(), first.to_bits());
}

#[test]
fn one_file_that_cannot_be_written_loses_no_other() {
    for blocked in ["checkpoint.json", "result.json", "final.svg", "report.html"] {
        let folder = folder();
        let out = folder.path().join("out");
        fs::create_dir_all(out.join(blocked)).unwrap();
        let output = aeroform(&["run", "l2-match-newton", "--out", "out", "--json"], folder.path());
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.contains(blocked) && message.contains("not all results could be written"), "{message}");
        assert_eq!(json(&output)["status"], "converged");
        let all = [
            "checkpoint.json",
            "convergence.svg",
            "final.dat",
            "final.step",
            "final.svg",
            "history.csv",
            "initial.svg",
            "report.html",
            "result.json",
        ];
        for file in all {
            assert_eq!(out.join(file).is_file(), file != blocked, "{file} beside {blocked}");
        }
        let left = fs::read_dir(&out)
            .unwrap()
            .filter(|e| e.as_ref().unwrap().file_name().to_str().unwrap().starts_with(".aeroform-"));
        assert_eq!(left.count(), 0);
    }
}

#[test]
fn two_runs_do_not_share_a_directory_and_killed_ones_leave_nothing_in_the_way() {
    let folder = folder();
    let out = folder.path().join("out");
    fs::create_dir(&out).unwrap();
    fs::write(out.join(".aeroform-aB3dE6"), "half a file").unwrap();
    fs::write(out.join(".aeroform-mine"), "not one of ours").unwrap();
    let lock = fs::File::create(out.join(".aeroform.lock")).unwrap();
    lock.lock().unwrap();
    let run = ["run", "l2-match-newton", "--out", "out"];
    refused(&aeroform(&run, folder.path()), &["another run is writing to out"]);
    assert!(out.join(".aeroform-aB3dE6").exists());
    drop(lock);
    assert!(aeroform(&run, folder.path()).status.success());
    assert!(!out.join(".aeroform-aB3dE6").exists() && out.join(".aeroform-mine").exists());
    assert!(aeroform(&run, folder.path()).status.success());
}

#[test]
fn names_that_are_no_folder_of_their_own_are_refused_with_their_line() {
    let folder = folder();
    for name in [".", "..", "...", ".hidden", "-rf", "con", "NUL.case", "com1", "lpt9.x", "a.", "", "a/b", "a b"] {
        fs::write(folder.path().join("case.toml"), CASE.replace("\"match\"", &format!("{name:?}"))).unwrap();
        refused(&aeroform(&["run", "case.toml"], folder.path()), &["case.toml:2: name:"]);
        assert!(!folder.path().join("out").exists());
    }
    let long = "x".repeat(101);
    fs::write(folder.path().join("case.toml"), CASE.replace("match", &long)).unwrap();
    refused(&aeroform(&["run", "case.toml"], folder.path()), &["case.toml:2: name:", "at most 100"]);
}

#[test]
fn a_sweep_keeps_the_points_it_has() {
    let folder = folder();
    let arguments = ["polar", "naca0012", "--alpha=-60:60:30", "--jobs", "2001", "--json", "--out", "out"];
    let output = aeroform(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let points = json(&output)["points"].as_array().unwrap().clone();
    assert_eq!(points.len(), 5);
    assert!(points[2]["cl"].as_f64().unwrap().abs() < 1e-6 && points[2]["converged"] == true);
    for k in [0, 4] {
        assert!(points[k]["cl"].is_null() && points[k]["converged"] == false);
        assert!(points[k]["status"].as_str().unwrap().contains("chord line (degrees) is"));
    }
    let table = fs::read_to_string(folder.path().join("out/polar.csv")).unwrap();
    assert_eq!(table.lines().count(), 6);
    assert!(table.lines().nth(1).unwrap().starts_with("-60,,"), "{table}");
    // where there is no point at all the input is at fault
    let output = aeroform(&["polar", "naca0012", "--alpha", "50:60:5"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("naca0012: angle between the onset flow and the chord line"));
}

#[test]
fn a_design_vector_comes_by_standard_input_too() {
    let folder = folder();
    let feed = |content: &str| {
        let mut child = Command::new(env!("CARGO_BIN_EXE_aeroform"))
            .args(["evaluate", "l2-match", "--at", "-", "--json"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::io::Write::write_all(&mut child.stdin.take().unwrap(), content.as_bytes()).unwrap();
        child.wait_with_output().unwrap()
    };
    let output = feed(r#"{"dy[1,1]": -0.07}"#);
    assert_eq!(json(&output)["variables"]["dy[1,1]"], -0.07);
    fs::write(folder.path().join("at.json"), r#"{"dy[1,1]": -0.07}"#).unwrap();
    let by_file = aeroform(&["evaluate", "l2-match", "--at", "at.json", "--json"], folder.path());
    assert_eq!(by_file.stdout, output.stdout);
    refused(&feed(r#"{"dy[1,1]": 1, "dy[1,1]": 2}"#), &["standard input", "given twice"]);
    refused(&feed(r#"{"dy[1,12]": 1}"#), &["standard input", "did you mean"]);
}

/// The result of a shell for a line in which `aeroform` is the command.
#[cfg(unix)]
fn shell(line: &str, folder: &Path) -> std::process::Output {
    let line = line.replace("aeroform", env!("CARGO_BIN_EXE_aeroform"));
    Command::new("bash").args(["-c", &line]).current_dir(folder).output().unwrap()
}

#[test]
#[cfg(target_os = "linux")]
fn output_that_nobody_takes_changes_no_exit_status() {
    let folder = folder();
    for (line, expected) in [
        // standard error full or closed
        ("aeroform evaluate nothing 2>/dev/full", 2),
        ("aeroform evaluate nothing 2>&-", 2),
        ("aeroform --nothing 2>/dev/full", 2),
        ("aeroform section naca0012 2>&- >/dev/null", 0),
        ("aeroform polar naca0012 --alpha 0:60:30 2>/dev/full >/dev/null", 1),
        // a reader of standard output or standard error that has gone
        ("aeroform polar naca0012 --alpha 0:60:30 2>/dev/null | true; exit ${PIPESTATUS[0]}", 1),
        ("aeroform section naca0012 --json | true; exit ${PIPESTATUS[0]}", 0),
        ("aeroform evaluate nothing 2> >(true)", 2),
        ("aeroform --help | true; exit ${PIPESTATUS[0]}", 0),
        // a full disk behind standard output is a failure of its own
        ("aeroform section naca0012 >/dev/full 2>/dev/null", 1),
        ("aeroform --help >/dev/full 2>/dev/null", 1),
    ] {
        let output = shell(line, folder.path());
        assert_eq!(output.status.code(), Some(expected), "{line}: {}", text(&output.stderr));
        assert!(!text(&output.stderr).contains("panicked"), "{line}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn ten_thousand_control_points_take_little_memory() {
    let folder = folder();
    let case = CASE
        .replace("file = \"start.dat\"", "naca = \"0012\"\ntrailing_edge = \"sharp\"")
        .replace("file = \"target.dat\"", "naca = \"2412\"\ntrailing_edge = \"sharp\"")
        .replace("[4, 4]", "[100, 100]")
        .replace("minimize = { shape_error = 1.0, fold_penalty = 1.0 }", "minimize = { area = 1.0 }");
    fs::write(folder.path().join("case.toml"), case).unwrap();
    // address space, in KiB: more than the memory that is really used
    let output = shell("ulimit -v 300000; aeroform evaluate case.toml --gradients --json", folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let result = json(&output);
    let gradient = result["gradients"]["area"].as_object().unwrap();
    assert_eq!(gradient.len(), 20_000);
    // a box that moves up as a whole keeps the area, one that is stretched along y changes it in proportion
    let along = |f: &dyn Fn(usize, usize) -> f64| -> f64 {
        (0..100)
            .flat_map(|i| (0..100).map(move |j| (i, j)))
            .map(|(i, j)| f(i, j) * gradient[&format!("dy[{i},{j}]")].as_f64().unwrap())
            .sum()
    };
    assert!(along(&|_, _| 1.0).abs() < 1e-12);
    let stretched = along(&|_, j| -0.15 + 0.3 * j as f64 / 99.0);
    // evenly placed control points are not at the Greville abscissae, so the stretch is exact only nearly
    assert!((stretched / result["values"]["area"].as_f64().unwrap() - 1.0).abs() < 1e-2, "{stretched}");
}

#[test]
fn endless_and_oversized_files_are_refused() {
    let folder = folder();
    fs::File::create(folder.path().join("large.toml")).unwrap().set_len(1 << 30).unwrap();
    refused(&aeroform(&["evaluate", "large.toml"], folder.path()), &["large.toml", "larger than"]);
    refused(&aeroform(&["evaluate", "l2-match", "--at", "large.toml"], folder.path()), &["large.toml", "larger than"]);
    fs::write(folder.path().join("case.toml"), CASE.replace("start.dat", "large.toml")).unwrap();
    refused(&aeroform(&["evaluate", "case.toml"], folder.path()), &["section.file", "larger than"]);
}

#[test]
fn boxes_of_every_size_and_place_end_in_an_answer() {
    let folder = folder();
    let start = CASE
        .replace("file = \"start.dat\"", "naca = \"0012\"\ntrailing_edge = \"sharp\"")
        .replace("file = \"target.dat\"", "naca = \"2412\"\ntrailing_edge = \"sharp\"");
    for (x, y, words) in [
        ("[-0.1, 1e12]", "[-0.15, 0.15]", None),
        ("[-1e12, 1e12]", "[-1e12, 1e12]", None),
        ("[-0.1, 1e308]", "[-0.15, 0.15]", Some("case.toml:10: box.x:")),
        ("[-1.7e308, 1.7e308]", "[-0.15, 0.15]", Some("case.toml:10: box.x:")),
        ("[-0.1, 1e12]", "[-0.15, 0.05]", Some("outside of the box")),
        ("[-1e300, 1.1]", "[-1e300, 1e300]", Some("box.x:")),
    ] {
        let case = start.replace("[-0.1, 1.1]", x).replace("[-0.15, 0.15]", y);
        fs::write(folder.path().join("case.toml"), case).unwrap();
        let output = aeroform(&["evaluate", "case.toml", "--json"], folder.path());
        match words {
            Some(words) => refused(&output, &[words]),
            None => assert!(output.status.success(), "{x} {y}: {}", text(&output.stderr)),
        }
    }
}

#[test]
fn the_camber_of_a_symmetric_section_is_no_objective() {
    let folder = folder();
    let start = CASE
        .replace("file = \"start.dat\"", "naca = \"0012\"\ntrailing_edge = \"sharp\"")
        .replace("file = \"target.dat\"", "naca = \"2412\"\ntrailing_edge = \"sharp\"");
    let with = |objective: &str, more: &str| {
        let case = start.replace("{ shape_error = 1.0, fold_penalty = 1.0 }", objective) + more;
        fs::write(folder.path().join("case.toml"), case).unwrap();
        aeroform(&["evaluate", "case.toml", "--json"], folder.path())
    };
    let smooth = ["camber", "no derivative", "camber at 0.4"];
    refused(&with("{ camber = -1.0 }", ""), &smooth);
    let constraint = "\n[constraints]\ncamber = { min = 0.01 }\n";
    refused(&with("{ area = 1.0 }", constraint), &["camber"]);
    // its value may be reported, and the camber at a station be asked for
    let reported = json(&with("{ \"camber at 0.4\" = -1.0 }", "\n[report]\nvalues = [\"camber\"]\n"));
    assert!(reported["values"]["camber"].as_f64().unwrap().abs() < 1e-12);
}

#[test]
fn limits_and_comments_may_change_where_a_run_is_resumed() {
    let folder = prepared();
    let run = |more: &[&str]| {
        let arguments: Vec<&str> = ["run", "case.toml", "--json"].iter().chain(more).copied().collect();
        json(&aeroform(&arguments, folder.path()))
    };
    let whole = run(&["--out", "whole"]);
    assert_eq!(whole["status"], "evaluation limit");
    let cut = run(&["--max-evaluations", "7"]);
    assert_eq!((cut["evaluations"].as_u64(), cut["status"].as_str()), (Some(7), Some("evaluation limit")));
    let message = cut["message"].as_str().unwrap();
    for words in ["limit of 7 evaluations", "KKT residual", "largest violation", "second half of the evaluations"] {
        assert!(message.contains(words), "{message}");
    }
    // comments, layout, description and limits are no values
    let other = CASE.replace("[target]", "# the wing of tomorrow\n[target]").replace("0.15, 0.15", "0.15,  0.150");
    let other = other.replace("name = \"match\"", "name = \"match\"\ndescription = \"again\"");
    fs::write(folder.path().join("case.toml"), other).unwrap();
    let resumed = run(&["--resume"]);
    assert_eq!(resumed["evaluations"], whole["evaluations"]);
    for key in ["objective", "kkt_residual", "variables", "values", "iterations"] {
        assert_eq!(resumed[key], whole[key], "{key}");
    }
    // a tolerance that is met on the way ends the run there
    let loose = run(&["--resume", "--tolerance", "1e3"]);
    assert_eq!(loose["status"], "converged");
    assert!(loose["evaluations"].as_u64() < whole["evaluations"].as_u64());
    assert_eq!(run(&["--max-iterations", "2"])["status"], "iteration limit");
    // values are not limits
    fs::write(folder.path().join("case.toml"), CASE.replace("fold_penalty = 1.0", "fold_penalty = 2.0")).unwrap();
    let output = aeroform(&["run", "case.toml", "--resume"], folder.path());
    refused(&output, &["the table [objective] of the case has another content"]);
    assert_eq!(text(&output.stderr).matches("start anew").count(), 1, "{}", text(&output.stderr));
    for (option, words) in [("--max-evaluations=0", "max_evaluations"), ("--tolerance=-1", "tolerance")] {
        refused(&aeroform(&["run", "case.toml", option, "--out", "new"], folder.path()), &[words]);
        assert!(!folder.path().join("new").exists());
    }
}

#[test]
#[cfg(unix)]
fn signals_end_a_run_with_everything_written() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    for (signal, status) in [("-INT", 130), ("-TERM", 143)] {
        let events = path("events.jsonl");
        let _ = fs::remove_file(&events);
        // this case takes minutes
        let child = Command::new(env!("CARGO_BIN_EXE_aeroform"))
            .args(["run", "kulfan-7x5", "--json", "--out", "cut", "--events", "events.jsonl"])
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let lines = || fs::read_to_string(&events).unwrap_or_default().lines().count();
        while lines() < 2 {
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let output = child.wait_with_output().unwrap();
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(status), "{message}");
        assert!(message.contains("Interrupted after") && message.contains("--resume goes on"), "{message}");
        let result = json(&output);
        assert_eq!(result["status"], "interrupted");
        for file in ["result.json", "history.csv", "final.dat", "final.step", "checkpoint.json", "report.html"] {
            assert!(path("cut").join(file).is_file(), "{file}");
        }
        // and goes on from there
        let more = (result["evaluations"].as_u64().unwrap() + 1).to_string();
        let on = ["run", "kulfan-7x5", "--json", "--out", "cut", "--resume", "--max-evaluations", &more];
        let resumed = json(&aeroform(&on, folder.path()));
        assert_eq!(resumed["evaluations"].to_string(), more);
    }
}

#[test]
fn any_design_vector_is_exported() {
    let folder = folder();
    fs::write(folder.path().join("at.json"), "\u{feff}{\"dy[1,1]\": -0.07}").unwrap();
    let evaluate = ["evaluate", "naca0024-linear-m02", "--json", "--export", "design"];
    let output = aeroform(&evaluate, folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let file = |name: &str| fs::read_to_string(folder.path().join("design").join(name)).unwrap();
    assert_eq!(serde_json::from_str::<serde_json::Value>(&file("result.json")).unwrap(), json(&output));
    assert!(file("section.step").starts_with("ISO-10303-21") && file("section.dxf").contains("SPLINE"));
    assert!(file("pressure.svg").contains("</svg>") && file("boundary_layer.svg").contains("</svg>"));
    assert!(file("section.svg").contains("</svg>") && file("section.igs").contains("126"));
    // the section that is written is the one that was evaluated
    let output = aeroform(&["evaluate", "l2-match", "--at", "at.json", "--json", "--export", "design"], folder.path());
    let error = json(&output)["values"]["shape_error"].as_f64().unwrap();
    let start = json(&aeroform(&["evaluate", "l2-match", "--json"], folder.path()));
    assert_ne!(error, start["values"]["shape_error"].as_f64().unwrap());
    let moved = json(&aeroform(&["section", "design/section.dat", "--json"], folder.path()));
    let plain = json(&aeroform(&["section", "naca0012:sharp", "--json"], folder.path()));
    assert!((moved["area"].as_f64().unwrap() - plain["area"].as_f64().unwrap()).abs() > 1e-4);
}
