//! Angles of attack as design variables, through the command.

mod common;

use common::{aeroform, folder, json, text};
use std::fs;

/// A section that is not changed, at two operating points of which one has a free angle.
const CASE: &str = r#"
name = "angle"
[section]
naca = "2412"
[[flow]]
name = "fixed"
weight = 1e-6
alpha = 1.0
reynolds = 3e6
trip = 0.1
panels = 80
[[flow]]
name = "glide"
alpha = { start = 1.0, lower = -2.0, upper = 12.0 }
reynolds = 3e6
trip = 0.1
[objective]
maximize = { "cl/cd at glide" = 1.0 }
[report]
values = ["alpha", "cl"]
[optimizer]
method = "lbfgs"
"#;

#[test]
fn a_free_angle_is_a_variable_in_every_file_of_a_run() {
    let folder = folder();
    let (case, out) = (folder.path().join("case.toml"), folder.path().join("out"));
    fs::write(&case, CASE).unwrap();
    let run = aeroform(&["run", "case.toml", "--out", "out", "--json"], folder.path());
    assert!(run.status.success(), "{}", text(&run.stderr));
    let result = json(&run);
    let best = result["variables"]["alpha_at(glide)"].as_f64().unwrap();
    assert!(best > 8.0 && best < 10.0, "{best}");
    assert!((result["values"]["alpha_at(glide)"].as_f64().unwrap() - best).abs() < 1e-12);
    assert!((result["values"]["alpha_at(fixed)"].as_f64().unwrap() - 1.0).abs() < 1e-12);
    let overview = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(overview.contains("glide: α free") && overview.contains("fixed: α 1°"));

    // drag in parts at every point, at start and end
    let points = result["drag"].as_array().unwrap();
    assert_eq!(points.iter().map(|p| p["point"].as_str().unwrap()).collect::<Vec<_>>(), ["fixed", "glide"]);
    for drag in points.iter().flat_map(|p| [&p["initial"], &p["end"]]) {
        let [cd, friction, pressure, wave] =
            ["cd", "cd_friction", "cd_pressure", "cd_wave"].map(|k| drag[k].as_f64().unwrap());
        assert!((friction + pressure - cd).abs() < 1e-12 && friction > 2e-3 && wave == 0.0, "{drag}");
    }
    let glide = result["values"]["cl_at(glide)"].as_f64().unwrap() / points[1]["end"]["cd"].as_f64().unwrap();
    assert!((glide.abs() / result["objective"].as_f64().unwrap().abs() - 1.0).abs() < 1e-9, "{glide}");
    assert!(overview.contains("shocks, within the pressure"));

    // a run that is cut short and resumed is the run that was not
    let cut = aeroform(&["run", "case.toml", "--out", "cut", "--json", "--max-evaluations", "3"], folder.path());
    assert_eq!(cut.status.code(), Some(1), "{}", text(&cut.stderr));
    let resumed = ["run", "case.toml", "--out", "cut", "--json", "--resume", "--max-evaluations", "1000"];
    let resumed = json(&aeroform(&resumed, folder.path()));
    assert_eq!(resumed["variables"], result["variables"]);

    // evaluations and exports at that angle, and at another
    let at = |alpha: f64| {
        fs::write(folder.path().join("at.json"), format!("{{\"alpha_at(glide)\": {alpha}}}")).unwrap();
        json(&aeroform(&["evaluate", "case.toml", "--at", "at.json", "--gradients", "--json"], folder.path()))
    };
    assert_eq!(at(best)["objective"], result["objective"]);
    let slope = |e: &serde_json::Value, of: &str| e["gradients"][of]["alpha_at(glide)"].as_f64().unwrap();
    let [low, high] = [1.0, 1.01].map(at);
    let lift = |e: &serde_json::Value| e["values"]["cl_at(glide)"].as_f64().unwrap();
    assert!(((lift(&high) - lift(&low)) / 0.01 - slope(&low, "cl_at(glide)")).abs() < 1e-3);
    assert_eq!(slope(&low, "cl_at(fixed)"), 0.0);
    assert!(slope(&at(best), "cl/cd_at(glide)").abs() < 1e-2);
    let export = aeroform(&["evaluate", "case.toml", "--at", "at.json", "--export", "files"], folder.path());
    assert!(export.status.success(), "{}", text(&export.stderr));
    let figure = fs::read_to_string(folder.path().join("files/pressure_glide.svg")).unwrap();
    assert!(figure.contains(&format!("α {best:.3}").trim_end_matches('0').to_string()), "{best}");
}

#[test]
fn a_free_angle_out_of_its_bounds_is_refused() {
    let folder = folder();
    fs::write(folder.path().join("case.toml"), CASE).unwrap();
    fs::write(folder.path().join("at.json"), "{\"alpha_at(glide)\": 13.0}").unwrap();
    let output = aeroform(&["evaluate", "case.toml", "--at", "at.json"], folder.path());
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("alpha_at(glide)"), "{}", text(&output.stderr));
}
