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
    for name in ["result.json", "pressure.svg", "section.svg", "boundary_layer.csv"] {
        assert!(std::fs::metadata(folder.path().join("point").join(name)).unwrap().len() > 300, "{name}");
    }
}

#[test]
fn flow_beyond_the_model_has_a_status_and_no_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let arguments =
        ["analyze", "naca0024", "--alpha", "0", "--mach", "0.7", "--reynolds", "5e6", "--trip", "0.1", "--json"];
    let output = aeroform(&arguments, folder.path());
    assert_eq!(output.status.code(), Some(1));
    let result = json(&output);
    assert!(result["cd"].is_null() && result["converged"] == false);
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
        &["analyze", "naca0012"],
        &["polar", "naca0012", "--alpha", "0:4:-1"],
        &["polar", "naca0012", "--alpha", "a:b:c"],
    ] {
        let output = aeroform(arguments, folder.path());
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(!String::from_utf8_lossy(&output.stderr).contains("panicked"));
    }
}
