//! The keys of every JSON output of the command, exactly and in order: scripts rely on them.

mod common;

use common::{aeroform, folder, json};
use serde_json::Value;

fn keys(value: &Value) -> Vec<&str> {
    value.as_object().unwrap_or_else(|| panic!("not an object: {value}")).keys().map(String::as_str).collect()
}

/// Output of a command that succeeds.
fn of(arguments: &[&str]) -> Value {
    let folder = folder();
    let output = aeroform(arguments, folder.path());
    assert!(output.status.success(), "{arguments:?}: {}", common::text(&output.stderr));
    json(&output)
}

const POINT: [&str; 24] = [
    "converged",
    "beyond_model",
    "status",
    "residual",
    "iterations",
    "attempts",
    "alpha",
    "mach",
    "reynolds",
    "cl",
    "cd",
    "cm",
    "cp_min",
    "transition_upper",
    "transition_lower",
    "cd_pressure",
    "cd_friction",
    "resolved",
    "panel_error",
    "station_error",
    "cd_wave",
    "solver",
    "repairs",
    "seconds",
];

#[test]
fn run() {
    let result = of(&["run", "l2-match-area", "--json"]);
    assert_eq!(
        keys(&result),
        [
            "case",
            "optimizer",
            "status",
            "message",
            "evaluations",
            "failed_evaluations",
            "iterations",
            "seconds",
            "objective",
            "values",
            "without_value",
            "constraints",
            "kkt_residual",
            "variables",
            "initial_objective",
            "initial",
            "initial_variables",
            "active_bounds",
            "flow_solver",
            "drag",
            "repairs",
            "min_fold_indicator",
            "folded",
            "self_intersecting",
            "target_distance",
            "identifiers",
        ]
    );
    assert_eq!(keys(&result["initial"]), keys(&result["values"]));
    assert_eq!(keys(&result["initial_variables"]), keys(&result["variables"]));
    assert_eq!(keys(&result["identifiers"])[..2], ["shape_error", "area"]);
    assert_eq!(result["identifiers"]["dx[1,2]"], "dx_1_2");
    assert_eq!(keys(&result["values"])[..2], ["shape_error", "area"]);
    assert!(keys(&result["constraints"]).contains(&"area"));
    assert_eq!(keys(&result["constraints"]["area"]), ["value", "lower", "upper", "violation", "multiplier"]);
    assert!(result["constraints"]["area"]["lower"].is_null() && result["constraints"]["area"]["upper"].is_f64());
    assert!(keys(&result["variables"]).iter().all(|name| name.starts_with("dx[") || name.starts_with("dy[")));
}

#[test]
fn evaluate() {
    let all = [
        "variables",
        "objective",
        "values",
        "without_value",
        "gradients",
        "min_fold_indicator",
        "folded",
        "self_intersecting",
        "repairs",
        "start",
        "bounds",
        "scales",
        "weights",
        "constraints",
        "identifiers",
    ];
    let result = of(&["evaluate", "l2-mixed", "--gradients", "--json"]);
    assert_eq!(keys(&result), all);
    assert_eq!(keys(&result["values"]), ["fold_penalty", "shape_error", "area", "thickness"]);
    assert_eq!(keys(&result["gradients"]), keys(&result["values"]));
    assert_eq!(keys(&result["gradients"]["shape_error"]), keys(&result["variables"]));
    for key in ["start", "bounds", "scales"] {
        assert_eq!(keys(&result[key]), keys(&result["variables"]), "{key}");
    }
    assert_eq!(keys(&result["bounds"]["thickness"]), ["lower", "upper"]);
    assert_eq!(keys(&result["weights"]), keys(&result["values"]));
    let result = of(&["evaluate", "l2-direct", "--json"]);
    assert_eq!(keys(&result), all.into_iter().filter(|key| *key != "gradients").collect::<Vec<_>>());
    assert!(result["min_fold_indicator"].is_null() && result["folded"].is_null());
}

#[test]
fn gradients() {
    let result = of(&["gradients", "mirrored", "--json"]);
    assert_eq!(
        keys(&result),
        [
            "case",
            "agrees",
            "worst_route_error",
            "worst_finite_difference_deviation",
            "repairs",
            "variables",
            "derivatives",
        ]
    );
    assert_eq!(
        keys(&result["derivatives"][0]),
        [
            "quantity",
            "variable",
            "exact",
            "forward",
            "finite_difference",
            "finite_difference_error",
            "route_error",
            "finite_difference_deviation",
            "agrees",
        ]
    );
}

#[test]
fn section() {
    let result = of(&["section", "naca2412", "--json"]);
    assert_eq!(
        keys(&result),
        [
            "name",
            "area",
            "thickness",
            "thickness_x",
            "camber",
            "camber_x",
            "nose_radius",
            "trailing_edge_angle",
            "trailing_edge_gap",
            "perimeter",
            "chord",
            "centroid",
            "length_unit",
            "repairs",
            "control_points",
            "trailing_edge",
            "parameters",
            "self_intersecting",
            "curve",
        ]
    );
    assert_eq!(keys(&result["parameters"]), ["thickness", "camber", "camber_position"]);
    assert_eq!(keys(&result["curve"]), ["degree", "knots", "control_points"]);
    assert_eq!(result["trailing_edge"], "blunt");
}

#[test]
fn analyze() {
    let result = of(&["analyze", "naca0012", "--alpha", "2", "--trip", "0.1", "--json"]);
    assert_eq!(keys(&result), POINT);
    let result = of(&["analyze", "naca0012", "--alpha", "2", "--trip", "0.1", "--gradients", "--json"]);
    assert_eq!(keys(&result), POINT.into_iter().chain(["gradients", "nodes"]).collect::<Vec<_>>());
    const COEFFICIENTS: [&str; 6] = ["cl", "cd", "cm", "cp_min", "transition_upper", "transition_lower"];
    let held = |result: &Value| result["gradients"]["held"].as_str().unwrap().to_string();
    assert_eq!(keys(&result["gradients"]), ["held"].into_iter().chain(COEFFICIENTS).collect::<Vec<_>>());
    assert_eq!(keys(&result["gradients"]["cl"]), ["alpha", "mach", "reynolds", "x", "y"]);
    assert_eq!(held(&result), "alpha");
    let result = of(&["analyze", "naca0012", "--cl", "0.2", "--trip", "0.1", "--gradients", "--json"]);
    let wanted: Vec<_> = ["held"].into_iter().chain(COEFFICIENTS).chain(["alpha"]).collect();
    assert_eq!(keys(&result["gradients"]), wanted);
    assert_eq!(held(&result), "cl");
    // the lift does not change, and drag is no function of the angle
    assert!(result["gradients"]["cl"]["y"].as_array().unwrap().iter().all(|d| d.as_f64().unwrap().abs() < 1e-9));
    assert!(result["gradients"]["cd"]["alpha"].is_null());
    let result = of(&["analyze", "naca0012", "--alpha", "2", "--inviscid", "--json"]);
    assert_eq!(
        keys(&result),
        [
            "converged",
            "beyond_model",
            "status",
            "alpha",
            "mach",
            "cl",
            "cm",
            "cp_min",
            "critical_mach",
            "repairs",
            "seconds",
        ]
    );
}

#[test]
fn polar() {
    let result = of(&["polar", "naca0012", "--alpha", "0:2:2", "--trip", "0.1", "--json"]);
    assert_eq!(keys(&result), ["section", "repairs", "points"]);
    assert_eq!(result["points"].as_array().unwrap().len(), 2);
    assert_eq!(keys(&result["points"][0]), POINT);
}

#[test]
fn cases() {
    let result = of(&["cases", "--json"]);
    assert_eq!(keys(&result), ["cases"]);
    assert_eq!(keys(&result["cases"][0]), ["name", "description", "variables"]);
}
