use super::*;
use crate::differentiate::{Function, StepRange, finite_difference, gradient, hessian};
use crate::ffd::Placement;
use approx::assert_relative_eq;

fn lattice(counts: [usize; 2]) -> FfdBox<f64> {
    FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], counts, [1, 1], Placement::Even).unwrap()
}

/// A net moved by a fixed pseudo-random field of the given size.
fn shaken(lattice: &FfdBox<f64>, size: f64) -> Vec<[f64; 2]> {
    let moved = lattice.control_points().iter().enumerate();
    moved.map(|(i, p)| [p[0] + 4.0 * size * (12.9 * i as f64).sin(), p[1] + size * (78.2 * i as f64).cos()]).collect()
}

struct Total<'a>(&'a BoxPenalty);
impl Function for Total<'_> {
    type Error = std::convert::Infallible;
    fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<S, Self::Error> {
        let net: Vec<[S; 2]> = x.chunks(2).map(|p| [p[0], p[1]]).collect();
        Ok(self.0.value(&net))
    }
}

#[test]
fn indicator_is_one_for_equal_triangles_up_to_the_smooth_minimum() {
    // 4 × 4 net: triangles of 0.02; smooth minimum below the minimum by ln 4 / α (interior), ln 2 / α (edge)
    let lattice = lattice([4, 4]);
    let penalty = FoldPenalty::default().on(&lattice).unwrap();
    let report = penalty.report(lattice.control_points());
    assert!(!report.folded);
    assert_relative_eq!(report.smallest_indicator, 1.0 - 4f64.ln() / 1000.0 / 0.02, max_relative = 1e-12);
    let normalised = FoldPenalty { normalised: true, ..Default::default() }.on(&lattice).unwrap();
    let report = normalised.report(lattice.control_points());
    assert_relative_eq!(report.smallest_indicator, 1.0 - 4f64.ln() / 1000.0, max_relative = 1e-5);
}

#[test]
fn printed_equations_hold_term_by_term() {
    // equations (1) to (4) written out for one interior and one edge point of a 3 × 3 net
    let lattice = lattice([3, 3]);
    let net = shaken(&lattice, 0.02);
    let penalty = FoldPenalty::default().on(&lattice).unwrap();
    let area = |a: usize, b: usize, c: usize| {
        let (p, q, r) = (net[a], net[b], net[c]);
        0.5 * ((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))
    };
    let smooth = |a: f64, b: f64| {
        if a < b {
            a - (1.0 + (-1000.0 * (b - a)).exp()).ln() / 1000.0
        } else {
            b - (1.0 + (-1000.0 * (a - b)).exp()).ln() / 1000.0
        }
    };
    // interior point 4: east-north, north-west, west-south, south-east
    let interior = [area(4, 5, 7), area(4, 7, 3), area(4, 3, 1), area(4, 1, 5)];
    let m =
        4.0 * smooth(smooth(interior[0], interior[1]), smooth(interior[2], interior[3])) / interior.iter().sum::<f64>();
    assert_relative_eq!(penalty.indicator(4, &penalty.stars[4].measures(&net)), m, max_relative = 1e-12);
    // edge point 1 (bottom middle): east-north, north-west; undeformed triangles 0.6 × 0.15 / 2
    let edge = [area(1, 2, 4), area(1, 4, 0)];
    let m = 2.0 * smooth(edge[0], edge[1]) / (edge[0].abs() + edge[1].abs() + 1e-11 * 0.09);
    assert_relative_eq!(penalty.indicator(1, &penalty.stars[1].measures(&net)), m, max_relative = 1e-12);
    // corner point 8: west-south
    assert_relative_eq!(
        penalty.indicator(8, &penalty.stars[8].measures(&net)),
        area(8, 7, 5) / 0.045,
        max_relative = 1e-12
    );
    assert_relative_eq!(penalty_of_indicator(0.0), 0.25, max_relative = 1e-15);
    assert_relative_eq!(penalty_of_indicator(-1.0), 1.5, max_relative = 1e-12);
    assert!(penalty_of_indicator(0.5) < 1e-11);
}

#[test]
fn gradients_agree_three_ways() {
    for counts in [[2, 2], [4, 4], [5, 3]] {
        let lattice = lattice(counts);
        for normalised in [false, true] {
            for size in [0.01, 0.03, 0.06] {
                let penalty = FoldPenalty { normalised, ..Default::default() }.on(&lattice).unwrap();
                let net = shaken(&lattice, size);
                let x: Vec<f64> = net.iter().flatten().copied().collect();
                let mut local = vec![[0.0; 2]; net.len()];
                let value = penalty.value_and_gradient(&net, 1.0, &mut local);
                let (value2, wide) = gradient(&Total(&penalty), &x).unwrap();
                assert_relative_eq!(value, value2, max_relative = 1e-13);
                let scale = wide.iter().fold(1e-12, |m: f64, g| m.max(g.abs()));
                for (a, b) in local.iter().flatten().zip(&wide) {
                    assert!((a - b).abs() <= 1e-12 * scale, "{a} {b}");
                }
                for k in 0..x.len() {
                    let at = |v: f64| {
                        let mut y = x.clone();
                        y[k] = v;
                        Total(&penalty).evaluate(&y)
                    };
                    let check = finite_difference(at, x[k], StepRange::for_scale(0.05)).unwrap();
                    assert!((wide[k] - check.value).abs() <= 4.0 * check.error + 1e-9 * scale, "{} {check:?}", wide[k]);
                }
            }
        }
    }
}

#[test]
fn hessians_agree_two_ways() {
    let lattice = lattice([4, 3]);
    let penalty = FoldPenalty::default().on(&lattice).unwrap();
    let net = shaken(&lattice, 0.04);
    let x: Vec<f64> = net.iter().flatten().copied().collect();
    let (_, _, wide) = hessian(&Total(&penalty), &x).unwrap();
    let mut local = DMatrix::zeros(x.len(), x.len());
    penalty.add_hessian(&net, &mut local);
    assert!((&wide - &local).amax() <= 1e-11 * wide.amax(), "{}", (&wide - &local).amax() / wide.amax());
}

#[test]
fn a_control_point_beyond_its_neighbours_is_a_fold() {
    let lattice = lattice([4, 4]);
    let penalty = FoldPenalty::default().on(&lattice).unwrap();
    let mut net = lattice.control_points().to_vec();
    net[5][0] += 0.5; // past its right neighbour, as in the paper's Fig. 6
    let report = penalty.report(&net);
    assert!(report.folded && report.smallest_indicator < 0.0);
    assert!(penalty.value(&net) > 0.5);
}

#[test]
fn extreme_nets_neither_overflow_nor_give_nan() {
    let lattice = lattice([4, 4]);
    for normalised in [false, true] {
        let penalty = FoldPenalty { normalised, ..Default::default() }.on(&lattice).unwrap();
        for size in [1.0, 1e3, 1e6] {
            let net = shaken(&lattice, size);
            let mut slope = vec![[0.0; 2]; 16];
            assert!(penalty.value_and_gradient(&net, 1.0, &mut slope).is_finite());
            assert!(slope.iter().flatten().all(|g| g.is_finite()));
        }
    }
}

#[test]
fn a_volume_uses_tetrahedra() {
    let ranges = [[0.0, 1.0], [0.0, 2.0], [0.0, 3.0]];
    let cube = FfdBox::rectangular(ranges, [3, 3, 3], [1, 1, 1], Placement::Even).unwrap();
    let penalty = FoldPenalty { normalised: true, ..Default::default() }.on(&cube).unwrap();
    let mut net = cube.control_points().to_vec();
    assert!(!penalty.report(&net).folded);
    assert!(penalty.value(&net) < 1e-30);
    net[13][2] += 2.0;
    assert!(penalty.report(&net).folded);
    let mut slope = vec![[0.0; 3]; 27];
    penalty.value_and_gradient(&net, 1.0, &mut slope);
    assert!(slope[13][2] > 0.0);
}

#[test]
fn settings_out_of_range_are_refused() {
    for (name, settings) in [
        ("alpha", FoldPenalty { sharpness: 0.0, ..Default::default() }),
        ("epsilon", FoldPenalty { epsilon: f64::NAN, ..Default::default() }),
    ] {
        assert!(matches!(settings.on(&lattice([3, 3])), Err(FfdError::Setting { name: n, .. }) if n == name));
    }
}
