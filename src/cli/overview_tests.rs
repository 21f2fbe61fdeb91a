//! Tests of the overview of a run.

use super::*;
use crate::report::json::Named;
use std::ops::ControlFlow;

#[test]
fn quantities_have_the_units_of_people() {
    assert_eq!(shown("cd", Some(0.0075213098)), "75.21 counts");
    assert_eq!(shown("cd_at(cruise)", Some(0.01)), "100 counts");
    assert_eq!(shown("cl/cd", Some(101.5)), "101.5");
    assert_eq!(shown("alpha", Some(2.0)), "2°");
    assert_eq!(shown("area", None), "none");
    assert_eq!(shown("cl", Some(-7.353688e-14)), "-7.4e-14");
    assert_eq!(change("cd", Some(0.01), Some(0.0075)), "-25 %");
    assert_eq!(change("cd", Some(0.0), Some(0.0075)), "+75 counts");
    assert_eq!(change("cl", Some(0.5), Some(-0.1)), "-0.6");
    assert_eq!(change("shape_error", Some(0.0076), Some(3.8e-7)), "÷ 20000");
    assert_eq!(change("cl", None, Some(-0.1)), "");
    assert_eq!(bound("area", Some(0.5), Some(0.5)), "= 0.5");
    assert_eq!(bound("cd", None, Some(0.01)), "≤ 100 counts");
    assert_eq!(bound("cm", Some(-0.1), Some(0.1)), "-0.1 … 0.1");
}

fn constraint(value: f64, lower: f64, multiplier: f64) -> ConstraintReport {
    let violation = Some((lower - value).max(0.0));
    ConstraintReport { value: Some(value), lower: Some(lower), upper: None, violation, multiplier: Some(multiplier) }
}

#[test]
fn a_run_says_what_holds_it_and_families_are_one_line() {
    let case = Case::open("l2-match-area").unwrap();
    let end = case.run(&mut |_| ControlFlow::Continue(())).unwrap();
    let mut result = RunReport::new(&case, &end);
    let fold = |k: usize| format!("fold_indicator[{k},0]");
    let mut names: Vec<String> = (0..4).map(fold).collect();
    names.push("area".into());
    let values = [0.9, 0.4, 0.4, 0.7, 0.1].map(Some);
    result.values = Named::new(names.clone(), values);
    result.initial = Named::new(names.clone(), [1.0, 1.0, 1.0, 0.95, 0.2].map(Some));
    let mut constraints = [0.9, 0.4, 0.4, 0.7].map(|v| constraint(v, 0.4, if v == 0.4 { 1e-6 } else { 0.0 })).to_vec();
    constraints.push(constraint(0.1, 0.1, 0.025));
    result.constraints = Named::new(names.clone(), constraints.clone());
    result.active_bounds = Named::new(
        ["dy[0,1]", "dx[2,1]"],
        [
            ActiveBoundReport { side: Side::Upper, bound: 0.1, multiplier: -2e-3 },
            ActiveBoundReport { side: Side::Lower, bound: -0.05, multiplier: 0.0 },
        ],
    );
    let overview = Overview::new(&case, &result, &Derivatives::default());
    let folded = overview.rows.iter().find(|row| row.name.starts_with("fold_indicator")).unwrap();
    assert_eq!(folded.name, "fold_indicator, smallest of 4");
    assert_eq!((folded.start.as_str(), folded.end.as_str()), ("0.95 at [3,0]", "0.4 at [1,0]"));
    assert_eq!((folded.bound.as_str(), folded.role.as_str()), ("≥ 0.4", "holds in 2 places"));
    assert_eq!(overview.rows.iter().filter(|row| row.name.contains("fold_indicator")).count(), 1);
    assert_eq!(
        overview.holds,
        [
            "area ≥ 0.1 (+1 % of it: objective +2.5e-5)",
            "fold_indicator ≥ 0.4 in 2 places",
            "bounds of 2 of 32 variables: dy[0,1] ≤ 0.1, dx[2,1] ≥ -0.05 without need",
        ]
    );
    // what has no value is not called met
    let mut unknown = result.clone();
    unknown.constraints.0[0].1 = ConstraintReport { value: None, violation: None, ..constraints[0] };
    unknown.kkt_residual = f64::NAN;
    let texts: Vec<String> =
        Overview::new(&case, &unknown, &Derivatives::default()).checks.into_iter().map(|c| c.text).collect();
    assert!(texts.contains(&"the constraints could not be evaluated".to_string()), "{texts:?}");
    assert!(texts.iter().all(|text| !text.contains("KKT")), "{texts:?}");
    // a violated member is told in red
    constraints[3] = constraint(0.3, 0.4, 0.0);
    result.constraints = Named::new(names, constraints);
    result.self_intersecting = true;
    let overview = Overview::new(&case, &result, &Derivatives::default());
    let folded = overview.rows.iter().find(|row| row.name.starts_with("fold_indicator")).unwrap();
    assert_eq!((folded.role.as_str(), folded.tone), ("violated in one place", Tone::Bad));
    let bad: Vec<&str> = overview.checks.iter().filter(|c| c.tone == Tone::Bad).map(|c| c.text.as_str()).collect();
    assert_eq!(bad, ["one constraint is violated", "the section crosses itself"]);
}

#[test]
fn changes_are_per_cent_only_where_that_says_something() {
    let of = |start: f64, end: f64| change("cm", Some(start), Some(end));
    assert_eq!(of(0.2, 0.1), "-50 %");
    assert_eq!(of(0.5, 1e-4), "÷ 5000");
    // the difference where both are negative or the signs differ, nothing for round-off
    assert_eq!(of(-0.05, -0.1), "-0.05");
    assert_eq!(of(-0.05, 0.1), "+0.15");
    assert_eq!(of(0.078, 0.078 * (1.0 - 1e-15)), "0");
    assert_eq!(change("cd", Some(0.01), None), "");
}
