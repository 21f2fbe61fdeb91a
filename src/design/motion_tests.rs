use super::*;

fn all_free() -> MotionRules {
    MotionRules { free: vec![Selection::default()], ..Default::default() }
}

fn columns(columns: &[i64], axis: Option<Axis>) -> Selection {
    Selection { columns: Some(columns.to_vec()), rows: None, axis }
}

/// Displacement of the net for given variables.
fn displace(motion: &BoxMotion, pins: &LinearMap, q: &[f64]) -> Vec<f64> {
    let map = motion.map(pins);
    let inputs: Vec<[f64; 1]> = q.iter().map(|v| [*v]).collect();
    let mut outputs = vec![[0.0]; map.outputs()];
    map.add_to(&inputs, &mut outputs);
    outputs.into_iter().flatten().collect()
}

/// One pinned point with the given weights.
fn pin(weights: &[(usize, f64)], inputs: usize) -> LinearMap {
    let mut map = LinearMap::new(inputs);
    weights.iter().for_each(|(column, weight)| map.push(*column, *weight));
    map.end_row();
    map
}

#[test]
fn everything_free_is_two_variables_a_control_point() {
    let motion = BoxMotion::new([4, 4], &all_free(), &LinearMap::new(16)).unwrap();
    assert_eq!(motion.variables.len(), 32);
    assert_eq!(motion.names()[..3], ["dx[0,0]", "dy[0,0]", "dx[1,0]"]);
    assert_eq!(motion.names()[31], "dy[3,3]");
    let q: Vec<f64> = (0..32).map(f64::from).collect();
    assert_eq!(displace(&motion, &LinearMap::new(16), &q), q);
}

#[test]
fn the_papers_counts_of_variables() {
    // Kulfan cases: first and last column move in y only, their centres not at all
    let outer = columns(&[0, -1], None);
    let centres = Selection { rows: Some(vec![2]), ..outer.clone() };
    for (counts, expected) in [([5, 5], 38), ([7, 5], 58)] {
        let rules = MotionRules {
            fixed: vec![Selection { axis: Some(Axis::X), ..outer.clone() }, centres.clone()],
            ..all_free()
        };
        let motion = BoxMotion::new(counts, &rules, &LinearMap::new(counts[0] * counts[1])).unwrap();
        assert_eq!(motion.variables.len(), expected);
    }
    // symmetric case: y of the upper two rows, mirrored
    let rules = MotionRules {
        free: vec![Selection { axis: Some(Axis::Y), ..Default::default() }],
        mirror: true,
        ..Default::default()
    };
    let motion = BoxMotion::new([5, 5], &rules, &LinearMap::new(25)).unwrap();
    assert_eq!(motion.variables.len(), 10);
    assert_eq!(motion.names()[0], "dy[0,4]");
    let moved = displace(&motion, &LinearMap::new(25), &[1.0; 10]);
    assert_eq!((moved[1], moved[49], moved[2 * 10 + 1]), (-1.0, 1.0, 0.0));
}

#[test]
fn mirrored_x_moves_with_and_the_middle_row_stays_on_the_line() {
    let rules = MotionRules { mirror: true, ..all_free() };
    let motion = BoxMotion::new([2, 3], &rules, &LinearMap::new(6)).unwrap();
    // two columns: x and y of the upper row, x of the middle row
    assert_eq!(motion.variables.len(), 6);
    let even = BoxMotion::new([2, 4], &rules, &LinearMap::new(8)).unwrap();
    assert_eq!(even.variables.len(), 8);
}

#[test]
fn pinned_points_hold_still_and_cost_one_variable_an_axis() {
    let weights = [(1, 0.2), (4, 0.5), (5, 0.3)];
    let pins = pin(&weights, 9);
    let motion = BoxMotion::new([3, 3], &all_free(), &pins).unwrap();
    assert_eq!(motion.variables.len(), 16);
    assert!(!motion.names().contains(&"dx[1,1]".to_string()));
    let q: Vec<f64> = (0..16).map(|i| (i as f64).sin()).collect();
    let moved = displace(&motion, &pins, &q);
    for axis in 0..2 {
        let shift: f64 = weights.iter().map(|(p, w)| w * moved[2 * p + axis]).sum();
        assert!(shift.abs() < 1e-16, "{shift}");
    }
}

#[test]
fn a_fixed_control_point_that_holds_the_pin_keeps_the_variables() {
    let rules = MotionRules {
        fixed: vec![Selection { columns: Some(vec![1]), rows: Some(vec![1]), axis: None }],
        ..all_free()
    };
    let pins = pin(&[(1, 0.2), (4, 0.5), (5, 0.3)], 9);
    let motion = BoxMotion::new([3, 3], &rules, &pins).unwrap();
    assert_eq!(motion.variables.len(), 16);
}

#[test]
fn a_pin_on_the_mirror_line_needs_nothing_across_it() {
    let rules = MotionRules { mirror: true, ..all_free() };
    // symmetric weights about the middle row of a 1-column strip of a 3 × 3 net
    let pins = pin(&[(1, 0.25), (4, 0.5), (7, 0.25)], 9);
    let motion = BoxMotion::new([3, 3], &rules, &pins).unwrap();
    // 3 columns × (x, y of the upper row, x of the middle row) = 9, less one for x of the pin
    assert_eq!(motion.variables.len(), 8);
}

#[test]
fn ties_move_in_proportion() {
    let tie = Tie { control_points: vec![[0, 0], [1, 0], [2, 0]], axis: Axis::Y, coefficients: vec![1.0, 2.0, -0.5] };
    let rules = MotionRules { ties: vec![tie], free: vec![columns(&[0], Some(Axis::Y))], ..Default::default() };
    let motion = BoxMotion::new([3, 2], &rules, &LinearMap::new(6)).unwrap();
    assert_eq!(motion.names(), ["dy[0,0]", "dy[0,1]"]);
    let moved = displace(&motion, &LinearMap::new(6), &[3.0, 0.0]);
    assert_eq!((moved[1], moved[3], moved[5]), (3.0, 6.0, -1.5));
}

#[test]
fn contradictions_are_refused() {
    let tie = |points: Vec<[usize; 2]>, coefficients: Vec<f64>| {
        let tie = Tie { control_points: points, axis: Axis::Y, coefficients };
        let rules = MotionRules { ties: vec![tie], mirror: true, ..all_free() };
        BoxMotion::new([3, 3], &rules, &LinearMap::new(9)).map(|m| m.variables.len())
    };
    // a point cannot move with its own mirror image
    assert!(matches!(tie(vec![[0, 2], [0, 0]], vec![1.0, 1.0]), Err(DesignError::Tie { .. })));
    assert!(tie(vec![[0, 2], [0, 0]], vec![1.0, -1.0]).is_ok());
    assert!(matches!(tie(vec![[0, 1], [0, 0]], vec![1.0, 1.0]), Err(DesignError::Tie { .. })));
    assert!(matches!(tie(vec![[3, 1]], vec![1.0]), Err(DesignError::NoControlPoint { .. })));
    assert!(matches!(tie(vec![[1, 2]], vec![0.0]), Err(DesignError::TieCoefficient { .. })));
    let rules = MotionRules { fixed: vec![columns(&[3], None)], ..all_free() };
    assert!(matches!(BoxMotion::new([3, 3], &rules, &LinearMap::new(9)), Err(DesignError::NoControlPoint { .. })));
}
