use super::*;
use crate::differentiate::{self, Function};
use crate::section::SectionDefinition;
use approx::assert_relative_eq;
use std::convert::Infallible;

fn curve(name: &str) -> BSplineCurve<f64> {
    SectionDefinition::parse(name).unwrap().section().unwrap().curve().clone()
}

fn closest(target: &str, start: &str) -> (ShapeError, BSplineCurve<f64>) {
    let (target, start) = (curve(target), curve(start));
    (ShapeError::new(ShapeNorm::Closest, &target, &start).unwrap(), start)
}

/// The points of a curve moved smoothly by a few variables, nonlinearly.
fn moved<S: Scalar>(points: &[[f64; 2]], v: &[S]) -> Vec<[S; 2]> {
    let one = |&[x, y]: &[f64; 2]| {
        let bend = v[1] * (v[0] * 3.0 + x * 2.0).sin();
        [v[0] * x * x + v[2] * y + x, bend + v[3] * (7.0 * x).cos() * 0.2 + (v[2] + 1.0) * y]
    };
    points.iter().map(one).collect()
}

struct OfVariables<'a>(&'a ShapeError, &'a [[f64; 2]]);
impl Function for OfVariables<'_> {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, v: &[S]) -> Result<S, Infallible> {
        Ok(self.0.value(&moved(self.1, v)))
    }
}

const AT: [f64; 4] = [0.004, 0.006, -0.02, 0.003];

#[test]
fn the_error_does_not_depend_on_parameters() {
    // one curve on two sets of knots; the equal parameters of the second are far off
    let (error, _) = closest("naca4412", "naca4412");
    let dense = SectionDefinition::parse("naca4412").unwrap().with_control_points(301).unwrap();
    let dense = dense.section().unwrap().curve().clone();
    let against_dense = ShapeError::new(ShapeNorm::Closest, &dense, &curve("naca4412")).unwrap();
    let value = against_dense.value(curve("naca4412").control_points());
    assert!(value.sqrt() < 2e-5, "{value:e}");
    assert!(error.value(curve("naca4412").control_points()).sqrt() < 1e-9);
}

#[test]
fn a_shift_is_its_normal_component() {
    // 1e-5 upwards: the mean of the squared cosine of the slope, by the arc-length norm of the flattened normals
    let (error, start) = closest("naca0012", "naca0012");
    let d = 1e-5;
    let up: Vec<[f64; 2]> = start.control_points().iter().map(|p| [p[0], p[1] + d]).collect();
    let rule = crate::spline::GaussRule::new(8);
    let (mut mean, mut total) = (0.0, 0.0);
    for (_, a, b) in start.knots().spans() {
        for (u, weight) in rule.on(a, b) {
            let [x, y] = start.tangent_at(u);
            mean += weight * x * x / x.hypot(y);
            total += weight * x.hypot(y);
        }
    }
    assert_relative_eq!(error.value(&up), d * d * mean / total, max_relative = 1e-3);
    let TargetDistance { root_mean_square: mean, largest } = error.distances(&up).unwrap();
    assert_relative_eq!(mean, error.value::<f64>(&up).sqrt(), max_relative = 1e-12);
    assert!(largest <= d * (1.0 + 1e-9) && largest > 0.999 * d);
}

#[test]
fn derivatives_are_those_of_duals_and_of_differences() {
    for (target, start) in
        [("naca4412", "naca0012"), ("naca2410:sharp", "naca0014:sharp"), ("naca0012", "naca0012:sharp")]
    {
        let (error, start) = closest(target, start);
        let points = start.control_points();
        let function = OfVariables(&error, points);
        let (value, gradient, hessian) = differentiate::hessian(&function, &AT).unwrap();
        let here = moved(points, &AT);
        // local duals carried back through the motion
        let mut slope = vec![[0.0; 2]; points.len()];
        assert_relative_eq!(error.value_and_gradient(&here, 1.0, &mut slope), value, max_relative = 1e-13);
        let (_, motion) = differentiate::jacobian(&Motion(points), &AT).unwrap();
        let back = motion.tr_mul(&nalgebra::DVector::from_column_slice(slope.as_flattened()));
        for k in 0..4 {
            assert_relative_eq!(back[k], gradient[k], max_relative = 1e-10);
            let along = |t: f64| {
                let mut at = AT;
                at[k] = t;
                function.evaluate(&at)
            };
            let range = differentiate::StepRange::for_scale(1e-2);
            let estimate = differentiate::finite_difference(along, AT[k], range).unwrap();
            assert!((estimate.value - gradient[k]).abs() <= 10.0 * estimate.error + 1e-8 * gradient[k].abs());
        }
        // second derivatives of the points by the control points, plus the curvature of the motion
        let of_points = error.hessian_at(&here).unwrap();
        let curved = Bent(points, &slope);
        let (_, _, bend) = differentiate::hessian(&curved, &AT).unwrap();
        let total = motion.tr_mul(&(&of_points * &motion)) + bend;
        assert_relative_eq!(total, hessian, max_relative = 1e-7, epsilon = 1e-7 * hessian.amax());
    }
}

struct Motion<'a>(&'a [[f64; 2]]);
impl differentiate::VectorFunction for Motion<'_> {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, v: &[S]) -> Result<Vec<S>, Infallible> {
        Ok(moved(self.0, v).into_flattened())
    }
}

/// The motion weighted by a constant slope.
struct Bent<'a>(&'a [[f64; 2]], &'a [[f64; 2]]);
impl Function for Bent<'_> {
    type Error = Infallible;
    fn evaluate<S: Scalar>(&self, v: &[S]) -> Result<S, Infallible> {
        let points = moved(self.0, v);
        Ok(points.iter().zip(self.1).map(|(p, s)| p[0] * s[0] + p[1] * s[1]).sum())
    }
}

#[test]
fn near_a_match_the_gauss_newton_matrix_is_the_hessian() {
    let (error, start) = closest("naca2412", "naca2412");
    let points = start.control_points();
    let (exact, model) = (error.hessian_at(points).unwrap(), error.gauss_newton_at(points).unwrap());
    assert_relative_eq!(exact, model, epsilon = 1e-6 * exact.amax());
    // at equal parameters the residuals are linear
    let equal = ShapeError::new(ShapeNorm::ArcLength, &curve("naca4412"), &start).unwrap();
    let unit: Vec<Vec<[f64; 2]>> = (0..2 * points.len())
        .map(|k| {
            let mut tangent = vec![[0.0; 2]; points.len()];
            tangent[k / 2][k % 2] = 1.0;
            tangent
        })
        .collect();
    let exact = equal.hessian(&unit).unwrap();
    assert_relative_eq!(exact, equal.gauss_newton_at(points).unwrap(), epsilon = 1e-12 * exact.amax());
    let root = ShapeError::new(ShapeNorm::RootMeanSquare, &curve("naca4412"), &start).unwrap();
    assert!(root.gauss_newton_at(points).is_none() && root.distances(points).is_none());
}

#[test]
fn closest_points_jump_neither_at_the_nose_nor_at_the_tail() {
    // turned about the tail and moved along, the nose passes that of the target; the tail becomes the nearest of the
    // other side
    let (error, start) = closest("naca4409:sharp", "naca0012:sharp");
    let at = |t: f64| -> Vec<[f64; 2]> {
        let (s, c) = (0.05 * t).sin_cos();
        let turn = |p: &[f64; 2]| [1.0 + c * (p[0] - 1.0) - s * p[1] + 0.02 * t, s * (p[0] - 1.0) + c * p[1]];
        start.control_points().iter().map(turn).collect()
    };
    let step = 1e-3;
    let values: Vec<f64> = (-1000..=1000).map(|k| error.value(&at(k as f64 * step))).collect();
    let root = |v: f64| v.sqrt();
    for pair in values.windows(2) {
        // no point moves by more than this
        assert!((root(pair[1]) - root(pair[0])).abs() < 1.1 * (0.05 + 0.02) * step, "{pair:?}");
    }
}

#[test]
fn the_upper_side_of_a_thin_tail_is_compared_with_the_upper_side() {
    // a plate of a thousandth against one bent up by far more than its thickness
    let (error, start) = closest("naca0001:sharp", "naca0001:sharp");
    let bent: Vec<[f64; 2]> = start.control_points().iter().map(|p| [p[0], p[1] + 0.05 * p[0] * p[0]]).collect();
    let mut slope = vec![[0.0; 2]; bent.len()];
    error.value_and_gradient(&bent, 1.0, &mut slope);
    // every point of the rear half of both sides is pulled down
    for (point, slope) in bent.iter().zip(&slope).filter(|(p, _)| p[0] > 0.5) {
        assert!(slope[1] > 0.0, "{point:?} {slope:?}");
    }
}

#[test]
fn an_end_beyond_the_other_is_measured_to_the_end() {
    // half of the weight is on the shape, whose tail of 0.1 sticks out by 0 … 0.1, and the target has none to match
    let (error, start) = closest("naca0001:sharp", "naca0001:sharp");
    let longer: Vec<[f64; 2]> = start.control_points().iter().map(|p| [1.1 * p[0], p[1]]).collect();
    let shorter: Vec<[f64; 2]> = start.control_points().iter().map(|p| [0.9 * p[0], p[1]]).collect();
    // ∫ of the square over the part that sticks out: 0.1³ / 3 of each side, of a length of 2 in all
    let expected = 0.5 * 2.0 * 0.1f64.powi(3) / 3.0 / 2.0;
    assert_relative_eq!(error.value(&longer), expected / 1.1, max_relative = 0.02);
    assert_relative_eq!(error.value(&shorter), expected, max_relative = 0.02);
}

#[test]
fn the_distance_from_a_line_that_turns_has_a_curvature() {
    // the height h of the line y = h over a point at x becomes (h + (2 x / L − 1) t) cos φ with tan φ = 2 t / L
    let (size, height) = (2.0, 0.5);
    let knots = crate::spline::KnotVector::clamped_uniform(1, 2).unwrap();
    let target = BSplineCurve::new(knots, vec![[0.0, 0.0], [size, 0.0]]).unwrap();
    let error = ShapeError::new(ShapeNorm::Closest, &target, &target).unwrap();
    let end = |x: f64, turn: f64| [Dual2_64::from(x), Dual2_64::new(height, turn, 0.0)];
    let mut gradient = [[0.0; 2]; 2];
    error.add_curvature(&[end(0.0, -1.0), end(size, 1.0)], 3.0, &mut gradient).unwrap();
    // 2 ∇r r″ of the half of the error that is measured from the target, times the factor
    let expected = 3.0 * -2.0 * height / (size * size);
    for slope in gradient {
        assert_relative_eq!(slope[..], [0.0, expected][..], epsilon = 1e-12);
    }
    // equal parameters leave nothing to bend
    let error = ShapeError::new(ShapeNorm::ArcLength, &target, &target).unwrap();
    assert!(error.add_curvature(&[end(0.0, -1.0), end(size, 1.0)], 1.0, &mut gradient).is_none());
}

#[test]
fn the_curvature_of_the_residuals_is_what_the_error_bends_by() {
    // f = Σ r², so that f″ = 2 Σ r′² + 2 Σ r r″ along a motion; close to the target, r is ∇r times the way from there
    let (error, start) = closest("naca4412", "naca4412");
    let points = start.control_points();
    let at: Vec<[f64; 2]> = moved(points, &AT.map(|v| 0.1 * v));
    let motion: Vec<[f64; 2]> = points.iter().map(|&[x, y]| [0.3 * y + 0.05, 0.1 * (3.0 * x).sin() - 0.05]).collect();
    let along: Vec<[Dual2_64; 2]> =
        at.iter().zip(&motion).map(|(p, v)| std::array::from_fn(|d| Dual2_64::new(p[d], v[d], 0.0))).collect();
    let second = error.value(&along).v2;
    let flat = |list: &[[f64; 2]]| nalgebra::DVector::from_column_slice(list.as_flattened());
    let straight = flat(&motion).dot(&(error.gauss_newton_at(&at).unwrap() * flat(&motion)));
    let mut bend = vec![[0.0; 2]; points.len()];
    error.add_curvature(&along, 1.0, &mut bend).unwrap();
    let found = flat(&bend).dot(&(flat(&at) - flat(points)));
    let expected = second - straight;
    assert!(expected.abs() > 1e-4 * straight, "{expected:e} {straight:e}");
    assert!((found / expected - 1.0).abs() < 0.1, "{found:e} {expected:e}");
}
