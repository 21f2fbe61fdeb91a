//! Everything that the command hands out: summaries, events, failures as JSON, repairs, units and exported files.

mod common;

use common::{aeroform, folder, json, refused, text};
use std::fs;

#[test]
fn a_failure_is_a_json_object_too() {
    let folder = folder();
    // the flow about the start is supersonic, which the panel solver does not take
    let case = fs::read_to_string("validation/cases/naca0024-cubic.toml").unwrap();
    fs::write(folder.path().join("fast.toml"), case.replace("\"streamtube\"", "\"panel\"")).unwrap();
    let output = aeroform(&["evaluate", "fast.toml", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
    let reason = json(&output)["failed"].as_str().unwrap().to_string();
    assert!(text(&output.stderr).contains(&reason), "{reason}");
    for arguments in [
        &["evaluate", "nowhere.toml", "--json"][..],
        &["run", "nowhere.toml", "--json"],
        &["gradients", "nowhere.toml", "--json"],
        &["section", "nowhere.dat", "--json"],
        &["analyze", "nowhere.dat", "--alpha", "2", "--json"],
        &["polar", "nowhere.dat", "--alpha", "2", "--json"],
    ] {
        let output = aeroform(arguments, folder.path());
        assert_eq!(output.status.code(), Some(2));
        assert!(json(&output)["failed"].as_str().unwrap().contains("nowhere"), "{arguments:?}");
    }
    // the object of a result stays the only one
    let output = aeroform(&["polar", "naca0012", "--alpha", "0:2:2", "--mach", "0.9", "--json"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(json(&output)["points"].as_array().unwrap().len(), 2);
}

#[test]
fn an_outside_optimiser_gets_bounds_scales_and_weights() {
    let folder = folder();
    let result = json(&aeroform(&["evaluate", "multipoint", "--json"], folder.path()));
    assert_eq!(result["bounds"]["dy[1,1]"], serde_json::json!({"lower": -0.08, "upper": 0.08}));
    assert_eq!(result["start"]["dy[1,1]"], 0.0);
    assert!(result["scales"]["dy[1,1]"].as_f64().unwrap() > 0.0);
    assert_eq!(result["weights"]["cd"], 1.0);
    assert_eq!(result["weights"]["area"], 0.0);
    assert_eq!(result["constraints"]["cm_at(cruise)"]["lower"], -0.06);
    assert_eq!(result["constraints"]["cm_at(cruise)"]["value"], result["values"]["cm_at(cruise)"]);
    assert_eq!(result["identifiers"]["cm_at(cruise)"], "cm_at_cruise");
    // bounds that refer to the start are numbers
    let result = json(&aeroform(&["evaluate", "kulfan-5x5", "--json"], folder.path()));
    let area = result["values"]["area"].as_f64().unwrap();
    assert_eq!(result["constraints"]["area"]["lower"].as_f64().unwrap(), 0.5 * area);
}

#[test]
fn progress_is_a_line_an_iteration_and_events_are_lines_of_json() {
    let folder = folder();
    let case = text(&aeroform(&["cases", "l2-match-area"], folder.path()).stdout);
    fs::write(folder.path().join("case.toml"), case).unwrap();
    let output = aeroform(&["run", "case.toml", "--events", "events.jsonl"], folder.path());
    assert!(output.status.success(), "{}", text(&output.stderr));
    let lines = text(&output.stderr);
    let iterations = lines.lines().filter(|line| line.starts_with("iteration ")).count();
    let events = fs::read_to_string(folder.path().join("events.jsonl")).unwrap();
    let events: Vec<serde_json::Value> = events.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let end = events.last().unwrap();
    let result = fs::read_to_string(folder.path().join("out/l2-match-area/result.json")).unwrap();
    let result: serde_json::Value = serde_json::from_str(&result).unwrap();
    assert_eq!((&end["event"], &end["status"]), (&"end".into(), &result["status"]));
    let evaluations = end["evaluations"].as_u64().unwrap() as usize;
    assert_eq!(events.len(), evaluations + 1);
    assert!(events[..evaluations].iter().all(|event| event["event"] == "evaluation" && event["objective"].is_f64()));
    assert!(iterations > 2 && iterations <= end["iterations"].as_u64().unwrap() as usize + 1, "{lines}");
    // to standard error nothing but events, and silence where it is asked for
    let output = aeroform(&["run", "case.toml", "--events", "-"], folder.path());
    assert!(text(&output.stderr).lines().all(|line| serde_json::from_str::<serde_json::Value>(line).is_ok()));
    let output = aeroform(&["run", "case.toml", "--quiet"], folder.path());
    assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
}

#[test]
fn the_summary_shows_start_and_end_and_names_bounds_of_variables() {
    let folder = folder();
    let case = text(&aeroform(&["cases", "naca0024-linear-m02"], folder.path()).stdout);
    fs::write(folder.path().join("case.toml"), case).unwrap();
    let output = aeroform(&["run", "case.toml", "--quiet", "--out", "out"], folder.path());
    let summary = text(&output.stdout);
    assert!(summary.contains(" counts → ") && summary.contains("start") && summary.contains("bound"), "{summary}");
    let result: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("out/result.json")).unwrap()).unwrap();
    let active = result["active_bounds"].as_object().unwrap();
    let bounds = json(&aeroform(&["evaluate", "case.toml", "--json"], folder.path()))["bounds"].clone();
    for (name, value) in result["variables"].as_object().unwrap() {
        let value = value.as_f64().unwrap();
        let at = |side: &str| bounds[name][side].as_f64().is_some_and(|b| (value - b).abs() < 1e-9);
        match active.get(name) {
            Some(bound) => {
                let side = bound["side"].as_str().unwrap();
                let multiplier = bound["multiplier"].as_f64().unwrap();
                assert!(if side == "lower" { multiplier >= 0.0 } else { multiplier <= 0.0 }, "{name} {bound}");
            }
            None => assert!(!at("lower") && !at("upper"), "{name} stands at a bound"),
        }
    }
    if !active.is_empty() {
        assert!(summary.contains(&format!("bounds of {} of ", active.len())), "{summary}");
    }
    let header = csv::Reader::from_path(folder.path().join("out/history.csv")).unwrap().headers().unwrap().clone();
    let distinct: std::collections::HashSet<&str> = header.iter().collect();
    assert_eq!(distinct.len(), header.len(), "{header:?}");
    assert!(!summary.contains("fold_indicator[0,0]"), "{summary}");
}

#[test]
fn repairs_are_in_every_output() {
    let folder = folder();
    // a NACA 0012 with one point doubled
    let section = "naca0012:sharp";
    aeroform(&["section", section, "--out", "plain.dat"], folder.path());
    let plain = fs::read_to_string(folder.path().join("plain.dat")).unwrap();
    let mut lines: Vec<&str> = plain.lines().collect();
    lines.insert(21, lines[20]);
    fs::write(folder.path().join("doubled.dat"), lines.join("\n")).unwrap();
    let case = text(&aeroform(&["cases", "l2-match"], folder.path()).stdout)
        .replacen("naca = \"0012\"\ntrailing_edge = \"sharp\"\ncontrol_points = 101", "file = \"doubled.dat\"", 1)
        .replacen("naca = \"8416\"\ntrailing_edge = \"sharp\"\ncontrol_points = 101", "file = \"plain.dat\"", 1)
        .replacen("max_evaluations = 1000", "max_evaluations = 3", 1);
    fs::write(folder.path().join("case.toml"), case).unwrap();
    for arguments in [
        &["section", "doubled.dat", "--json"][..],
        &["analyze", "doubled.dat", "--alpha", "2", "--json"],
        &["analyze", "doubled.dat", "--alpha", "2", "--inviscid", "--json"],
        &["polar", "doubled.dat", "--alpha", "2", "--json"],
        &["evaluate", "case.toml", "--json"],
        &["gradients", "case.toml", "--json"],
        &["run", "case.toml", "--json", "--out", "out"],
    ] {
        let output = aeroform(arguments, folder.path());
        let result = json(&output);
        let repairs = result["repairs"].as_array().unwrap_or_else(|| panic!("{arguments:?}: {result}"));
        assert!(!repairs.is_empty() && repairs.iter().all(|r| r.is_string()), "{arguments:?}: {repairs:?}");
        assert!(text(&output.stderr).contains("repeating"), "{arguments:?}: {}", text(&output.stderr));
        let quiet: Vec<&str> = arguments.iter().copied().chain(["--quiet"]).collect();
        assert!(!text(&aeroform(&quiet, folder.path()).stderr).contains("repeating"), "{arguments:?}");
    }
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("Repairs of the input"));
}

#[test]
fn lengths_have_the_unit_of_the_file() {
    let folder = folder();
    aeroform(&["section", "naca0012", "--out", "chord.dat", "--digits", "full"], folder.path());
    let chord = fs::read_to_string(folder.path().join("chord.dat")).unwrap();
    let scaled = |line: &str| {
        let numbers = line.split_whitespace().map(|n| format!("{}", 1000.0 * n.parse::<f64>().unwrap()));
        numbers.collect::<Vec<_>>().join(" ")
    };
    let mut lines = chord.lines();
    let title = lines.next().unwrap();
    let millimetres: Vec<String> = std::iter::once(title.to_string()).chain(lines.map(scaled)).collect();
    fs::write(folder.path().join("mm.dat"), millimetres.join("\n")).unwrap();
    let words = text(&aeroform(&["section", "mm.dat"], folder.path()).stdout);
    assert!(!words.lines().any(|line| line.ends_with(" chord") && !line.ends_with("of the chord")), "{words}");
    assert!(words.contains("unit of the file") && words.contains("of the chord"), "{words}");
    let words = text(&aeroform(&["section", "mm.dat", "--unit", "mm"], folder.path()).stdout);
    assert!(words.contains(" mm  (0.12"), "{words}");
    let unit = |arguments: &[&str]| json(&aeroform(arguments, folder.path()))["length_unit"].clone();
    assert_eq!(unit(&["section", "naca0012", "--json"]), "chord");
    assert_eq!(unit(&["section", "mm.dat", "--json"]), "unit of the file");
    assert_eq!(unit(&["section", "mm.dat", "--unit", "mm", "--json"]), "mm");
    // sizes in files: the rightmost point of the outline
    let export = |shape: &str, options: &[&str]| {
        let arguments: Vec<&str> = ["section", shape, "--out", "x.step"].iter().chain(options).copied().collect();
        let output = aeroform(&arguments, folder.path());
        assert!(output.status.success(), "{}", text(&output.stderr));
        let step = fs::read_to_string(folder.path().join("x.step")).unwrap();
        let points = step.lines().filter_map(|line| line.split_once("CARTESIAN_POINT('',(")?.1.split(',').next());
        let right = points.map(|x| x.replace('E', "e").parse::<f64>().unwrap()).fold(0.0, f64::max);
        (right, step.contains(".MILLI."), text(&output.stderr))
    };
    let near = |value: f64, wanted: f64| assert!((value - wanted).abs() < 1e-6 * wanted, "{value} for {wanted}");
    let (right, milli, _) = export("naca0012", &["--unit", "mm", "--chord", "250"]);
    near(right, 250.0);
    assert!(milli);
    let (right, milli, _) = export("mm.dat", &["--unit", "mm"]);
    near(right, 1000.0);
    assert!(milli);
    // without a unit it is guessed, and said
    let (right, milli, message) = export("mm.dat", &[]);
    near(right, 1000.0);
    assert!(milli && message.contains("1000 mm"), "{message}");
    let (right, milli, message) = export("naca0012", &[]);
    near(right, 1.0);
    assert!(!milli && message.contains("1 m;"), "{message}");
    for (options, words) in [
        (&["--out", "x.dat", "--unit", "mm"][..], "--unit"),
        (&["--out", "x.dxf", "--face"], "--face"),
        (&["--out", "x.step", "--points", "50"], "--points"),
        (&["--face"], "--out"),
        (&["--out", "x.step", "--chord", "-1"], "positive"),
        (&["--out", "x.step", "--unit", "furlong"], "mm"),
        (&["--out", "x.dat", "--digits", "0"], "full"),
        (&["--out", "x.dat", "--points", "1"], "--points"),
    ] {
        let arguments: Vec<&str> = ["section", "naca0012"].iter().chain(options).copied().collect();
        refused(&aeroform(&arguments, folder.path()), &[words]);
    }
}

#[test]
fn coordinate_files_have_seven_decimals_and_the_points_asked_for() {
    let folder = folder();
    let written = |options: &[&str]| {
        let arguments: Vec<&str> = ["section", "naca4412", "--out", "x.dat"].iter().chain(options).copied().collect();
        assert!(aeroform(&arguments, folder.path()).status.success());
        fs::read_to_string(folder.path().join("x.dat")).unwrap()
    };
    let decimals = |file: &str| -> Vec<usize> {
        file.lines()
            .skip(1)
            .flat_map(str::split_whitespace)
            .map(|n| n.split_once('.').map_or(0, |n| n.1.len()))
            .collect()
    };
    let usual = written(&[]);
    assert_eq!(usual.lines().count(), 198);
    assert!(decimals(&usual).iter().all(|d| *d == 7));
    let coarse = written(&["--points", "61", "--digits", "5"]);
    assert_eq!(coarse.lines().count(), 62);
    assert!(decimals(&coarse).iter().all(|d| *d == 5));
    let full = written(&["--digits", "full"]);
    assert!(decimals(&full).iter().any(|d| *d > 14));
    assert_eq!(full, written(&["--digits", "17"]));
}

#[test]
fn usage_errors_are_json_where_it_is_asked_for() {
    let folder = folder();
    for arguments in [
        &["analyze", "naca0012", "--alpah", "4", "--json"][..],
        &["analyze", "naca0012", "--json"],
        &["run", "l2-match", "--max-evaluations", "many", "--json"],
        &["fly", "--json"],
    ] {
        let output = aeroform(arguments, folder.path());
        assert_eq!(output.status.code(), Some(2));
        let failed = json(&output)["failed"].as_str().unwrap().to_string();
        assert!(!failed.is_empty() && !failed.contains('\n') && !failed.starts_with("error"), "{failed}");
        assert!(text(&output.stderr).contains("error:"));
    }
    let quiet = aeroform(&["analyze", "naca0012"], folder.path());
    assert!(quiet.status.code() == Some(2) && quiet.stdout.is_empty());
}

#[test]
fn numbers_are_those_asked_for_and_zero_is_zero() {
    let folder = folder();
    for alpha in ["4", "-3.7", "0.1", "7.3"] {
        let angle: f64 = alpha.parse().unwrap();
        for more in [&[][..], &["--inviscid"]] {
            let arguments: Vec<&str> =
                ["analyze", "naca2412", "--alpha", alpha, "--json"].iter().chain(more).copied().collect();
            assert_eq!(json(&aeroform(&arguments, folder.path()))["alpha"].as_f64(), Some(angle));
        }
        let polar = json(&aeroform(&["polar", "naca2412", "--alpha", alpha, "--json"], folder.path()));
        assert_eq!(polar["points"][0]["alpha"].as_f64(), Some(angle));
    }
    let table = text(&aeroform(&["polar", "naca0012", "--alpha", "0"], folder.path()).stdout);
    let cells: Vec<&str> = table.lines().nth(1).unwrap().split_whitespace().collect();
    // alpha, lift, moment, glide ratio
    assert_eq!([cells[0], cells[1], cells[4], cells[5]], ["0.000", "0.00000", "0.00000", "0"], "{table}");
    for (option, words) in
        [("--reynolds", "Reynolds number is -1"), ("--ncrit", "amplification factor is -1"), ("--mach", "-1")]
    {
        refused(&aeroform(&["analyze", "naca0012", "--alpha", "1", option, "-1"], folder.path()), &[words]);
    }
}

#[test]
fn messages_name_what_a_user_knows() {
    let folder = folder();
    let case = "name = \"ring wing\"\n[section]\nnaca = \"0012\"\n[objective]\nminimize = { area = 1.0 }\n";
    fs::write(folder.path().join("case.toml"), case).unwrap();
    refused(&aeroform(&["run", "case.toml"], folder.path()), &["case.toml:1: name:", "\"ring wing\""]);
    // no name of a temporary file
    if std::path::Path::new("/proc").is_dir() {
        let output = aeroform(&["run", "l2-match", "--out", "/proc"], folder.path());
        refused(&output, &["cannot write to the output directory /proc"]);
        assert!(!text(&output.stderr).contains(".aeroform-"), "{}", text(&output.stderr));
    }
    // one advice, not two
    fs::create_dir(folder.path().join("cut")).unwrap();
    fs::write(folder.path().join("cut/checkpoint.json"), "{\"aeroform_checkpoint\":2,").unwrap();
    let output = aeroform(&["run", "l2-match", "--out", "cut", "--resume"], folder.path());
    refused(&output, &["is cut off"]);
    assert_eq!(text(&output.stderr).matches("start anew").count(), 1);
    // options of every subcommand stand apart
    let help = text(&aeroform(&["analyze", "--help"], folder.path()).stdout);
    let place = |words: &str| help.find(words).unwrap_or_else(|| panic!("{words}: {help}"));
    assert!(place("Options:") < place("--json") && place("--json") < place("Messages:"));
    assert!(place("Messages:") < place("--quiet") && place("--quiet") < place("--verbose"));
}

#[test]
fn a_run_that_fails_at_its_start_shows_what_is_known() {
    let folder = folder();
    let case = "name = \"steep\"\n[section]\nnaca = \"0012\"\n[box]\nx = [-0.1, 1.1]\ny = [-0.15, 0.15]\n\
                control_points = [4, 4]\ndegree = [3, 3]\n[variables]\nfree = \"all\"\n[flow]\ncl = 2.5\nreynolds = 1e6\n\
                [objective]\nminimize = { cd = 1.0, area = 0.1 }\n[constraints]\nthickness = { min = 0.1 }\n";
    fs::write(folder.path().join("case.toml"), case).unwrap();
    let output = aeroform(&["run", "case.toml", "--json", "--out", "out", "--events", "events"], folder.path());
    assert_eq!(output.status.code(), Some(1));
    let result = json(&output);
    let reason = result["without_value"]["cd"].as_str().unwrap();
    assert!(reason.contains("beyond the largest lift") && result["message"].as_str().unwrap().contains(reason));
    assert!(result["values"]["cd"].is_null() && result["objective"].is_null());
    assert!((result["values"]["thickness"].as_f64().unwrap() - 0.12).abs() < 1e-3);
    assert!((result["constraints"]["thickness"]["value"].as_f64().unwrap() - 0.12).abs() < 1e-3);
    let page = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(page.contains("<p class=\"bad\">") && page.contains("Polars of the start"), "{page}");
    assert!(!page.contains("<h2>Convergence</h2>") && !page.contains("<h2>End</h2>") && !page.contains("none → none"));
    assert!(!folder.path().join("out/convergence.svg").exists());
    let events = fs::read_to_string(folder.path().join("events")).unwrap();
    assert!(events.lines().next().unwrap().contains("\"kind\":\"failed\""), "{events}");
}

#[test]
fn polars_of_a_run_show_moment_glide_ratio_and_transition() {
    let folder = folder();
    let run = ["run", "naca0024-linear-m02", "--max-evaluations", "3", "--out", "out"];
    aeroform(&run, folder.path());
    let figure = fs::read_to_string(folder.path().join("out/polars.svg")).unwrap();
    for label in ["CD, counts", "Cm (c/4)", "CL/CD", "transition x/c, upper side", "transition x/c, lower side"] {
        assert!(figure.contains(&format!(">{label}<")), "{label}");
    }
    for label in ["start", "end"] {
        assert!(figure.contains(&format!(">{label}<")), "{label}");
    }
    let events = ["run", "l2-match", "--max-evaluations", "2", "--events", "events"];
    aeroform(&events, folder.path());
    let lines = fs::read_to_string(folder.path().join("events")).unwrap();
    let kinds: Vec<serde_json::Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!((kinds[0]["kind"].as_str(), kinds[1]["kind"].as_str()), (Some("start"), Some("trial")));
}
