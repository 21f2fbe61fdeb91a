//! `aeroform analyze` and `aeroform polar` as a user runs them.

mod common;

use common::{aeroform, json};

#[test]
fn a_point_has_coefficients_gradients_and_files() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "analyze",
        "naca0012",
        "--alpha",
        "4",
        "--reynolds",
        "5e6",
        "--trip",
        "0.05",
        "--gradients",
        "--json",
        "--out",
        "point",
    ];
    let output = aeroform(&arguments, folder.path());
    assert!(output.status.success());
    let result = json(&output);
    let number = |key: &str| result[key].as_f64().unwrap();
    // XFOIL 6.99 at 160 panels: CL 0.456937, CD 0.0084944
    assert!((number("cl") - 0.456937).abs() < 0.005 + 0.007 * 0.457);
    assert!((number("cd") - 0.0084944).abs() < 0.025 * 0.0085);
    assert!((number("transition_upper") - 0.05).abs() < 0.01);
    assert_eq!(result["gradients"]["cd"]["y"].as_array().unwrap().len(), result["nodes"].as_array().unwrap().len());
    for name in ["result.json", "pressure.svg", "boundary_layer.svg", "section.svg", "boundary_layer.csv"] {
        assert!(std::fs::metadata(folder.path().join("point").join(name)).unwrap().len() > 300, "{name}");
    }
}

#[test]
fn flow_beyond_the_model_has_a_status_and_flagged_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["analyze", "naca0024", "--alpha", "0", "--mach", "0.7", "--reynolds", "5e6", "--trip", "0.1", "--json"];
    let output = aeroform(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(1));
    let result = json(&output);
    assert!(result["cd"].is_f64() && result["converged"] == false && result["beyond_model"] == true);
    assert!(result["status"].as_str().unwrap().contains("supersonic"));
}

#[test]
fn a_polar_has_a_row_and_a_status_a_point() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = [
        "polar",
        "naca0012",
        "--alpha",
        "0:4:2",
        "--reynolds",
        "3e6",
        "--trip",
        "0.1",
        "--jobs",
        "2",
        "--json",
        "--out",
        "polar",
    ];
    let output = aeroform(&arguments, folder.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let result = json(&output);
    let points = result["points"].as_array().unwrap();
    assert_eq!(points.len(), 3);
    let lift: Vec<f64> = points.iter().map(|p| p["cl"].as_f64().unwrap()).collect();
    assert!(lift[0].abs() < 1e-6 && lift[1] > 0.2 && lift[2] > 0.4);
    assert_eq!(std::fs::read_to_string(folder.path().join("polar/polar.csv")).unwrap().lines().count(), 4);
    // six plots, with complete conditions and without the way to the file
    let figure = std::fs::read_to_string(folder.path().join("polar/polar.svg")).unwrap();
    for words in ["naca0012: M 0, Re 3e6, trips at x/c 0.1", "CD, counts", "Cm (c/4)", "CL/CD", "transition x/c"] {
        assert!(figure.contains(words), "{words}");
    }
    // the rows come on standard error, in their order
    let rows = String::from_utf8_lossy(&output.stderr).into_owned();
    let angles: Vec<f64> = rows.lines().filter_map(|line| line.split_whitespace().next()?.parse().ok()).collect();
    assert_eq!(angles, [0.0, 2.0, 4.0], "{rows}");
}

#[test]
fn bad_points_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["analyze", "naca0012", "--alpha", "90"][..],
        &["analyze", "naca0012", "--alpha", "nan"],
        &["analyze", "naca0012", "--alpha", "2", "--mach", "1.5"],
        &["analyze", "naca0012", "--alpha", "2", "--trip", "0.1,0.2,0.3"],
        &["analyze", "naca0012", "--alpha", "2", "--panels", "10"],
        &["analyze", "naca0012", "--alpha", "2", "--stations", "10"],
        &["analyze", "naca0012"],
        &["polar", "naca0012", "--alpha", "0:4:-1"],
        &["polar", "naca0012", "--alpha", "a:b:c"],
    ] {
        let output = aeroform(arguments, folder.path());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"));
    }
}

#[test]
fn more_stations_leave_a_smaller_error() {
    let folder = tempfile::tempdir().unwrap();
    let error = |stations: &str| {
        let arguments = ["analyze", "naca4412", "--alpha", "3", "--stations", stations, "--json"];
        json(&aeroform(&arguments, folder.path()))["station_error"]["cd"].as_f64().unwrap()
    };
    let [coarse, fine] = [error("64"), error("128")];
    assert!(coarse > 2.5 * fine && fine > 0.0, "{coarse} {fine}");
}

#[test]
fn rows_of_a_polar_come_in_order_whatever_the_jobs() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |jobs: &str| {
        let arguments = ["polar", "naca0012", "--alpha", "0:5:1", "--trip", "0.1", "--jobs", jobs, "--events", "e"];
        let output = aeroform(&arguments, folder.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let events = std::fs::read_to_string(folder.path().join("e")).unwrap();
        let angle = |line: &str| {
            let event: serde_json::Value = serde_json::from_str(line).unwrap();
            assert_eq!(event["event"], "point");
            event["alpha"].as_f64().unwrap().round()
        };
        assert_eq!(events.lines().map(angle).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let table = String::from_utf8(output.stdout).unwrap();
        let first = |line: &str| line.split_whitespace().next().unwrap().to_string();
        assert_eq!(
            table.lines().map(first).collect::<Vec<_>>()[1..],
            ["0.000", "1.000", "2.000", "3.000", "4.000", "5.000"]
        );
        table.lines().map(|line| line.split_whitespace().take(3).collect::<Vec<_>>().join(" ")).collect::<Vec<_>>()
    };
    assert_eq!(sweep("1"), sweep("3"));
}

#[test]
fn an_exported_file_has_the_lift_of_its_section() {
    let folder = tempfile::tempdir().unwrap();
    let lift = |shape: &str| {
        json(&aeroform(&["analyze", shape, "--alpha", "4", "--json"], folder.path()))["cl"].as_f64().unwrap()
    };
    for name in ["naca0012", "naca23012", "naca6608", "kulfan:upper=0.14,0.18,0.17/lower=-0.04,-0.01,-0.01"] {
        let by_name = lift(name);
        for (digits, tolerance) in [("full", 1e-6), ("7", 1e-4)] {
            aeroform(&["section", name, "--out", "n.dat", "--digits", digits], folder.path());
            let by_file = lift("n.dat");
            assert!((by_name - by_file).abs() < tolerance, "{name}, {digits}: {by_name} by name, {by_file} by file");
        }
    }
}

#[test]
fn attempts_are_told_where_they_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let text = |more: &[&str]| {
        let arguments: Vec<&str> = ["analyze", "naca0024", "--alpha", "0", "--mach", "0.7", "--reynolds", "5e6"]
            .iter()
            .chain(more)
            .copied()
            .collect();
        aeroform(&arguments, folder.path())
    };
    let attempts = json(&text(&["--json"]))["attempts"].as_array().unwrap().len();
    let lines = |more: &[&str]| String::from_utf8(text(more).stdout).unwrap().matches("  tried: ").count();
    assert_eq!(lines(&[]), 0);
    assert_eq!(lines(&["-v"]), attempts);
}

#[test]
fn transonic_flow_has_a_figure_of_its_mach_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let point = |section: &str, mach: &str, out: &str| {
        let condition = ["--alpha", "0", "--mach", mach, "--reynolds", "5e6", "--trip", "0.1"];
        let rest = ["--solver", "streamtube", "--out", out];
        let arguments = [&["analyze", section][..], &condition, &rest].concat();
        assert!(aeroform(&arguments, folder.path()).status.success());
        std::fs::read_to_string(folder.path().join(out).join("mach.svg")).unwrap()
    };
    let fast = point("naca0012:sharp", "0.8", "fast");
    // MSES has the shock at half of the chord
    let places: Vec<f64> =
        fast.split("side at x/c ").skip(1).map(|text| text.split('<').next().unwrap().parse().unwrap()).collect();
    assert_eq!(places.len(), 2, "a shock on either side");
    assert!((places[0] - 0.5).abs() < 0.03 && (places[0] - places[1]).abs() < 1e-3, "{places:?}");
    assert!(fast.contains("sonic line") && fast.contains("M 0.8"));
    // subsonic flow has no sonic line
    let slow = point("naca0012:sharp", "0.5", "slow");
    assert!(!slow.contains("sonic line") && !slow.contains("subsonic again") && slow.contains("M 0.4"));
}

#[test]
fn a_sweep_of_the_mach_number_shows_the_drag_rise() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |rest: &[&str]| {
        let common = ["polar", "naca0012:sharp", "--reynolds", "5e6", "--trip", "0.1", "--solver", "streamtube"];
        aeroform(&[&common[..], rest].concat(), folder.path())
    };
    let output = sweep(&["--alpha", "0", "--mach", "0.74:0.8:0.02", "--out", "rise", "--json"]);
    assert!(output.status.success());
    let points = json(&output)["points"].as_array().unwrap().clone();
    let all = |key: &str| points.iter().map(|p| p[key].as_f64().unwrap()).collect::<Vec<_>>();
    assert_eq!(all("mach"), [0.74, 0.76, 0.78, 0.8]);
    // MSES at M 0.76, 0.78 and 0.8: 0.008604, 0.010402, 0.015688
    for (found, known) in all("cd")[1..].iter().zip([0.008604, 0.010402, 0.015688]) {
        assert!((found / known - 1.0).abs() < 0.02, "{found} {known}");
    }
    let wave = all("cd_wave");
    assert!(wave[0].abs() < 1e-6 && (wave[3] - 0.005923).abs() < 3e-4, "{wave:?}");
    let table = std::fs::read_to_string(folder.path().join("rise/polar.csv")).unwrap();
    let machs: Vec<&str> = table.lines().map(|line| line.rsplit(',').next().unwrap()).collect();
    assert_eq!(machs, ["mach", "0.74", "0.76", "0.78", "0.8"]);
    let figure = std::fs::read_to_string(folder.path().join("rise/polar.svg")).unwrap();
    assert!(figure.contains("part of shocks (wave)") && figure.contains("Mach number"));

    // at a held lift the angle falls as the Mach number grows
    let held = sweep(&["--cl", "0.3", "--mach", "0.6:0.7:0.1", "--json"]);
    assert!(held.status.success());
    let points = json(&held)["points"].as_array().unwrap().clone();
    let of = |k: usize, key: &str| points[k][key].as_f64().unwrap();
    assert!((of(0, "cl") - 0.3).abs() < 1e-8 && (of(1, "cl") - 0.3).abs() < 1e-8);
    assert!(of(1, "alpha") < of(0, "alpha") - 0.1);

    for (wrong, why) in [
        (&["--alpha", "0:2:1", "--mach", "0.6:0.7:0.1"][..], "one of them only"),
        (&["--cl", "0.3", "--mach", "0.6"], "--mach FIRST:LAST:STEP"),
        (&["--alpha", "0", "--mach", "0.6:0.5:0.1"], "--mach 0.6:0.5:0.1"),
    ] {
        let output = sweep(wrong);
        assert_eq!(output.status.code(), Some(2));
        assert!(String::from_utf8_lossy(&output.stderr).contains(why), "{wrong:?}");
    }
}
