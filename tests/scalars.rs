//! Every public geometric routine with every kind of number: values and derivatives do not depend on the kind.
//!
//! Each routine stands once in [`routines!`] as a function of a few inputs over any scalar. It runs with `f64`,
//! `Dual64`, `DualSVec64`, `Dual2_64`, `HyperDual64`, `Dual3_64` and `HyperHyperDual64`; values must agree, and first,
//! second and third derivatives along a direction. Finite differences of the `f64` run check the first derivatives,
//! differences of the first derivatives the second ones.
//!
//! Not in the list, because no number in them carries derivatives:
//! * knots, degrees, counts and parameters of construction (`KnotVector` but for its basis functions, `averaged_knots`,
//!   `GaussRule::new`, `Section::parameters`): plain numbers by design, so that splines are linear in control points;
//! * text and files (`SectionDefinition::parse`, `Coordinates::parse` and `read`, `Section::selig`, `Measure::parse`);
//! * answers of yes or no and counts (`Section::self_intersection`, `Section::curvature_reversals`,
//!   `BoxPenalty::report`);
//! * routines that return derivatives themselves (`value_and_gradient`, `indicator_and_gradient`, `add_hessian`,
//!   `add_distortion`, `ShapeError::hessian`), which their own tests compare with dual numbers.

use aeroform::design::{ShapeError, ShapeNorm};
use aeroform::differentiate::{StepRange, finite_difference_jacobian};
use aeroform::ffd::{BoxEvaluator, FfdBox, FoldPenalty, LinearMap, Placement, penalty_of_indicator};
use aeroform::scalar::Scalar;
use aeroform::section::{Coordinates, Kulfan, Measure, Section, SectionDefinition, TrailingEdge, fit_kulfan};
use aeroform::spline::*;
use nalgebra::{Point2, Vector2};
use num_dual::{Derivative, Dual2_64, Dual3_64, Dual64, DualSVec64, HyperDual64, HyperHyperDual64};

/// A geometric routine of a few inputs, written once for every scalar.
trait Routine {
    /// Where it is run.
    fn at() -> Vec<f64>;
    /// Whether knots or parameters that follow the real parts of the inputs spoil differences of values.
    const DIFFERENCES: bool;
    fn run<S: Scalar>(x: &[S]) -> Vec<S>;
}

/// A number seeded along a direction; vector duals carry a second one too.
trait Seeded: Scalar {
    fn seeded(re: f64, along: [f64; 2]) -> Self;
    /// First, second and third derivative along the direction, and the first along the second direction.
    fn derivatives(&self) -> [Option<f64>; 4];
}

macro_rules! seeded {
    ($($type:ty: |$re:ident, $d:ident, $e:ident| $seed:expr, |$x:ident| $parts:expr;)*) => {
        $(impl Seeded for $type {
            fn seeded($re: f64, [$d, $e]: [f64; 2]) -> Self {
                $seed
            }
            fn derivatives(&self) -> [Option<f64>; 4] {
                let $x = self;
                $parts
            }
        })*
    };
}
seeded! {
    f64: |re, _d, _e| re, |_x| [None; 4];
    Dual64: |re, d, _e| Self::new(re, d), |x| [Some(x.eps), None, None, None];
    DualSVec64<2>: |re, d, e| Self::new(re, Derivative::some(Vector2::new(d, e))),
        |x| [x.eps.0.map(|eps| eps[0]), None, None, x.eps.0.map(|eps| eps[1])];
    Dual2_64: |re, d, _e| Self::new(re, d, 0.0), |x| [Some(x.v1), Some(x.v2), None, None];
    HyperDual64: |re, d, _e| Self::new(re, d, d, 0.0), |x| [Some(x.eps1), Some(x.eps1eps2), None, None];
    Dual3_64: |re, d, _e| Self::new(re, d, 0.0, 0.0), |x| [Some(x.v1), Some(x.v2), Some(x.v3), None];
    HyperHyperDual64: |re, d, _e| Self::new(re, d, d, d, 0.0, 0.0, 0.0, 0.0),
        |x| [Some(x.eps1), Some(x.eps1eps2), Some(x.eps1eps2eps3), None];
}

/// Values of a run, and each kind of derivative that the numbers carry.
fn run<R: Routine, S: Seeded>(x: &[f64], along: [&[f64]; 2]) -> (Vec<f64>, [Option<Vec<f64>>; 4]) {
    let seeded: Vec<S> = (0..x.len()).map(|i| S::seeded(x[i], [along[0][i], along[1][i]])).collect();
    let result = R::run(&seeded);
    let part = |k: usize| result.iter().map(|y| y.derivatives()[k]).collect();
    (result.iter().map(|y| y.re()).collect(), [part(0), part(1), part(2), part(3)])
}

/// Largest difference of two lists over the largest number in the second.
fn off(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(f64::MIN_POSITIVE, |m, e| m.max(e.abs()));
    // a difference that is not finite is the largest of all
    let worse = |m: f64, (f, e): (&f64, &f64)| if (f - e).abs() <= m { m } else { (f - e).abs() };
    found.iter().zip(expected).fold(0.0, worse) / largest
}

/// Largest differences between numbers of different kinds, over the largest of them: round-off, which derivatives of
/// higher order amplify.
const ROUND_OFF: [f64; 4] = [1e-12, 1e-11, 1e-9, 1e-12];

fn check<R: Routine>(name: &str) {
    let x = R::at();
    let along: Vec<f64> = (0..x.len()).map(|i| 1.0 + 0.3 * i as f64).collect();
    let other: Vec<f64> = (0..x.len()).map(|i| 0.7 - 0.4 * i as f64).collect();
    let directions = [&along[..], &other[..]];
    let (values, _) = run::<R, f64>(&x, directions);
    let (_, [first, second, third, _]) = run::<R, Dual3_64>(&x, directions);
    let (_, [by_other, ..]) = run::<R, Dual64>(&x, [&other, &along]);
    let expected = [first, second, third, by_other].map(|part| part.expect("a part that these numbers carry"));
    for (order, part) in expected.iter().enumerate() {
        assert!(part.iter().all(|d| d.is_finite()), "{name}: derivative {order}: {part:?}");
    }
    assert!(expected[0].iter().any(|d| d.abs() > 1e-8), "{name} does not depend on its inputs");
    macro_rules! compare {
        ($($type:ty),*) => {
            $({
                let (found, parts) = run::<R, $type>(&x, directions);
                let kind = stringify!($type);
                assert!(off(&found, &values) <= 1e-14, "{name}, {kind}: {found:?} {values:?}");
                for (order, (part, expected)) in parts.iter().zip(&expected).enumerate() {
                    let Some(part) = part else { continue };
                    let off = off(part, expected);
                    assert!(off <= ROUND_OFF[order], "{name}, {kind}, derivative {order} is off by {off:e}");
                }
            })*
        };
    }
    compare!(Dual64, DualSVec64<2>, Dual2_64, HyperDual64, Dual3_64, HyperHyperDual64);
    if R::DIFFERENCES {
        let moved = |t: f64| -> Vec<f64> { x.iter().zip(&along).map(|(x, d)| x + t * d).collect() };
        let values = |t: &[f64]| Ok::<_, std::convert::Infallible>(run::<R, f64>(&moved(t[0]), directions).0);
        let slopes = |t: &[f64]| {
            let (_, [first, ..]) = run::<R, Dual64>(&moved(t[0]), directions);
            Ok::<_, std::convert::Infallible>(first.unwrap_or_default())
        };
        let steps = [StepRange { first: 1e-3, levels: 8 }];
        let differences = [
            finite_difference_jacobian(values, &[0.0], &steps).unwrap(),
            finite_difference_jacobian(slopes, &[0.0], &steps).unwrap(),
        ];
        for (order, (exact, differences)) in expected.iter().zip(&differences).enumerate() {
            let scale = exact.iter().fold(0.0, |m: f64, d| m.max(d.abs()));
            for (exact, estimate) in exact.iter().zip(differences.iter()) {
                let most = 1e-7 * scale + 10.0 * estimate.error;
                assert!((exact - estimate.value).abs() <= most, "{name}, order {}: {exact} {estimate:?}", order + 1);
                assert!(estimate.error <= 1e-5 * scale + 1e-9, "{name}, order {}: {estimate:?}", order + 1);
            }
        }
    }
}

/// `name(inputs) [differences] { body over the scalar S that gives a list of S }`: a routine and its test.
macro_rules! routines {
    ($($name:ident<$s:ident>($x:ident = $at:expr) $(without $what:ident)? $body:block)*) => {
        $(
            mod $name {
                use super::*;
                pub(super) struct This;
                impl Routine for This {
                    const DIFFERENCES: bool = routines!(@ $($what)?);
                    fn at() -> Vec<f64> {
                        $at.to_vec()
                    }
                    fn run<$s: Scalar>($x: &[$s]) -> Vec<$s> $body
                }
            }
            #[test]
            fn $name() {
                check::<$name::This>(stringify!($name));
            }
        )*
    };
    (@) => { true };
    (@ differences) => { false };
}

/// A cubic curve with eight control points that depend on the inputs, also nonlinearly.
fn curve<S: Scalar>(x: &[S]) -> BSplineCurve<S> {
    let points = (0..8).map(|i| {
        let t = i as f64;
        [x[0] * (0.3 * t).sin() + t * 0.25, x[1] * x[1] * (0.9 * t).cos() - x[0] * x[1] * 0.1 + (0.8 * t).sin()]
    });
    BSplineCurve::new(KnotVector::clamped_uniform(3, 8).unwrap(), points.collect::<Vec<_>>()).unwrap()
}

/// A surface in space, of degrees 2 and 3.
fn surface<S: Scalar>(x: &[S]) -> BSplineSurface<S> {
    let axes = [(2, 4), (3, 5)].map(|(p, n)| KnotVector::clamped_uniform(p, n).unwrap());
    let points = (0..20).map(|i| {
        let t = i as f64;
        [x[0] * t.sin() + t, x[0] * x[1] * t.cos(), (x[1] + t).sin()]
    });
    TensorSpline::new(axes, points.collect::<Vec<_>>()).unwrap()
}

/// A box whose corners depend on the inputs.
fn lattice<S: Scalar>(x: &[S]) -> FfdBox<S> {
    let corners = [
        [x[0] - 0.3, -x[1] - 0.2],
        [x[0] * x[1] + 1.1, x[1] * 0.1 - 0.2],
        [-x[0] - 0.1, x[1] + 0.1],
        [x[1] + 1.1, x[0] + 0.1],
    ];
    FfdBox::from_corners(&corners, [5, 4], [3, 2], Placement::Even).unwrap()
}

/// A cambered section whose thickness, camber and camber position are the inputs.
fn section<S: Scalar>(x: &[S]) -> Section<S> {
    SectionDefinition::parse("naca4412").unwrap().build(x).unwrap()
}

/// A blunt outline in Selig order.
fn outline<S: Scalar>(x: &[S]) -> Vec<[S; 2]> {
    let side = |i: i32| {
        let t = f64::from(i) / 12.0;
        let height = if i > 0 { x[0] } else { -x[1] * x[1] };
        [x[1] * x[0] * t * (1.0 - t) + t * t, height * (t.abs() * (1.05 - t * t)) + x[0] * (t * 0.1)]
    };
    (-12..=12).rev().map(side).collect()
}

fn flat<S: Scalar, const D: usize>(points: &[[S; D]]) -> Vec<S> {
    points.iter().flatten().copied().collect()
}

fn nets<S: Scalar>(box_of: &FfdBox<S>, x: &[S]) -> Vec<[S; 2]> {
    let moved = box_of.control_points().iter().enumerate();
    moved.map(|(i, p)| [p[0] + x[1] * 0.2 * (i as f64).sin(), p[1] + x[0] * x[1] * (i as f64).cos()]).collect()
}

const AT: [f64; 2] = [0.21, 0.17];
const NACA: [f64; 3] = [0.12, 0.04, 0.42];

routines! {
    basis_functions<S>(x = [0.37]) {
        let knots = KnotVector::clamped_uniform(3, 7).unwrap();
        let span = knots.span(x[0].re());
        let mut all = knots.basis(span, x[0]).to_vec();
        all.extend(knots.basis_derivatives(span, x[0], 2).into_iter().flatten());
        for_each_weight(&[knots.clone(), knots], [x[0], x[0] * x[0]], |_, weight| all.push(weight));
        all
    }
    quadrature<S>(x = AT) {
        let rule = GaussRule::new(9);
        vec![rule.integrate(0.0, 1.0, |t| (x[0] * t).exp()), rule.integrate_between(x[0], x[1] + 1.0, |t| (t * x[1]).sin())]
    }
    curve_evaluation<S>(x = [0.21, 0.17, 0.43]) {
        let c = curve(x);
        let mut all = c.derivatives(x[2], 3);
        let (point, tangent) = c.point_and_tangent(x[2]);
        all.extend([c.evaluate(x[2]), c.point_at(0.6), c.tangent_at(0.6), point, tangent]);
        all.extend([c.evaluate(x[2] + 1.0), curve(&AT).with_control_points(c.control_points().to_vec()).unwrap().point_at(0.3)]);
        flat(&all)
    }
    curve_operations<S>(x = AT) {
        let c = curve(x);
        let (left, right) = c.split(0.37).unwrap();
        let mut all = vec![];
        for c in [c.insert_knot(0.41, 2).unwrap(), c.refine(&[0.1, 0.7]).unwrap(), left, right, c.reversed().unwrap(),
            c.elevate_degree(2).unwrap()].into_iter().chain(c.to_bezier().unwrap()) {
            all.extend(flat(c.control_points()));
        }
        all
    }
    curve_extent<S>(x = AT) {
        let (loose, tight) = (curve(x).bounding_box(), curve(x).tight_bounding_box().unwrap());
        flat(&[loose.lower, loose.upper, tight.lower, tight.upper])
    }
    curve_closest_point<S>(x = [0.21, 0.17, 0.9]) {
        let found = curve(x).closest_point([x[2], x[2] * x[0] - 0.3]).unwrap();
        vec![found.parameter, found.point[0], found.point[1], found.squared_distance, found.distance()]
    }
    curve_parameters<S>(x = AT) {
        vec![curve(x).parameter_at_coordinate(0, x[0] * x[1] + 0.8, 0.0, 1.0).unwrap()]
    }
    curve_directions<S>(x = [0.21, 0.17, 0.43]) {
        vec![curve(x).curvature(x[2]).unwrap(), curve(x).tangent_angle(x[2]).unwrap()]
    }
    curve_length<S>(x = [0.21, 0.17, 0.43]) {
        let c = curve(x);
        let table = c.arc_lengths().unwrap();
        vec![table.total(), table.at(x[2]).unwrap(), table.parameter(x[2] + x[0]).unwrap(),
            c.arc_length(x[2], x[1]).unwrap(), c.parameter_at_arc_length(x[1] * x[2] + 0.9).unwrap()]
    }
    surface_evaluation<S>(x = [0.21, 0.17]) {
        let s = surface(x);
        let (point, jacobian) = s.point_and_jacobian([x[0], x[1]]);
        let moved = surface(&AT).with_control_points(s.control_points().to_vec()).unwrap();
        flat(&[point, jacobian[0], jacobian[1], s.evaluate([x[1], x[0]]), s.point_at([0.3, 0.8]), moved.point_at([0.4, 0.6])])
    }
    surface_operations<S>(x = AT) {
        let s = surface(x);
        let all = [s.insert_knot(0, 0.3, 1).unwrap(), s.refine(1, &[0.2, 0.9]).unwrap(), s.elevate_degree(1, 1).unwrap()];
        all.iter().flat_map(|s| flat(s.control_points())).collect()
    }
    volume_evaluation<S>(x = AT) {
        let axes = [(1, 2), (2, 3), (1, 3)].map(|(p, n)| KnotVector::clamped_uniform(p, n).unwrap());
        let points = (0..18).map(|i| [x[0] * i as f64, x[1].powi(2) + i as f64, x[0] * x[1] * (i as f64).sin()]);
        let v = BSplineVolume::<S>::new(axes, points.collect::<Vec<_>>()).unwrap();
        flat(&[v.evaluate([x[0], x[1], x[0]])])
    }
    analytic_curves<S>(x = [0.21, 0.17, 1.3]) {
        let curves = [line_segment([x[0], x[1]], [x[2], x[0] * x[1]]).unwrap(),
            circular_arc([x[0], x[1]], x[2] * x[2], 0.2, 2.0, 1e-6).unwrap().curve,
            elliptic_arc([x[0], x[1]], [x[2], x[0]], x[1], -0.3, 1.0, 1e-6).unwrap().curve,
            ellipse([x[1], x[0]], [x[2], x[0]], x[1], 1e-6).unwrap().curve];
        curves.iter().flat_map(|c| flat(c.control_points())).collect()
    }
    interpolation<S>(x = AT) {
        let points = outline(x);
        let t: Vec<f64> = (0..points.len()).map(|i| i as f64).collect();
        let (start, end) = ([x[0], x[1]], [x[0] * x[1], x[0]]);
        let free = Interpolation::at_knots(&t, averaged_knots(4, &t).unwrap()).unwrap();
        let curves = [interpolate(&t, &points, EndCondition::Natural).unwrap(),
            interpolate(&t, &points, EndCondition::NotAKnot).unwrap(),
            interpolate(&t, &points, EndCondition::Clamped { start, end }).unwrap(),
            Interpolation::natural(&t).unwrap().curve(&points).unwrap(),
            Interpolation::not_a_knot(&t).unwrap().curve(&points).unwrap(),
            Interpolation::clamped(&t).unwrap().curve_with_tangents(&points, start, end).unwrap(),
            free.curve(&points).unwrap()];
        curves.iter().flat_map(|c| flat(c.control_points())).collect()
    }
    interpolation_parameters<S>(x = AT) {
        let points = outline(x);
        let mut all = chord_length_parameters(&points).unwrap();
        all.extend(centripetal_parameters(&points).unwrap());
        all
    }
    least_squares<S>(x = AT) {
        let points = outline(x);
        let last = (points.len() - 1) as f64;
        let t: Vec<f64> = (0..points.len()).map(|i| i as f64 / last).collect();
        let knots = KnotVector::clamped_uniform(3, 8).unwrap();
        let curves = [LeastSquares::new(&t, knots.clone()).unwrap().curve(&points).unwrap(), fit(&t, &points, knots).unwrap(),
            fit_to_tolerance(&t, &points, 3, 1e-2).unwrap()];
        curves.iter().flat_map(|c| flat(c.control_points())).collect()
    }
    naca_four_digits<S>(x = NACA) {
        flat(section(x).curve().control_points())
    }
    naca_five_digits<S>(x = [0.12, 0.3, 0.15]) {
        let built = ["naca23012:sharp", "naca23112"].map(|name| SectionDefinition::parse(name).unwrap().build(x).unwrap());
        built.iter().flat_map(|s| flat(s.curve().control_points())).collect()
    }
    kulfan_sections<S>(x = [0.21, 0.17, 0.004]) {
        let definition = SectionDefinition::parse("kulfan:upper=0.2,0.2/lower=-0.1,-0.2/gap=0.004").unwrap();
        let built = definition.build(&[x[0], x[1], -x[1] * x[0] - 0.1, -x[0], x[2]]).unwrap();
        flat(built.curve().control_points())
    }
    // the parameter of the nose follows the real parts of the coefficients and is held
    kulfan_sections_of_their_own<S>(x = [0.21, 0.17, 0.004]) without differences {
        let own = Kulfan::new(vec![x[0], x[1] * x[1]], vec![-x[1]]).unwrap().with_gap(x[2] * x[2]).unwrap();
        flat(own.with_class([0.6, 0.9]).unwrap().section().unwrap().curve().control_points())
    }
    kulfan_fits<S>(x = NACA) {
        let fit = fit_kulfan(&section(x), 4, 3).unwrap();
        let mut all = [fit.kulfan.upper(), fit.kulfan.lower()].concat();
        all.extend([fit.kulfan.gap(), fit.rms, fit.maximum]);
        all
    }
    // knots and parameters follow the real parts of the points and are held
    coordinate_sections<S>(x = AT) without differences {
        let coordinates = Coordinates::from_points("outline", &outline(x)).unwrap();
        let smooth = coordinates.clone().with_fit_tolerance(1e-2).unwrap();
        let fitted = coordinates.clone().with_control_points(12).unwrap();
        let mut all = vec![coordinates.chord()];
        for c in [&coordinates, &smooth, &fitted, &coordinates.normalized().unwrap()] {
            all.extend(flat(c.points()));
            all.extend(flat(c.section().unwrap().curve().control_points()));
        }
        all
    }
    coordinate_points<S>(x = AT) {
        // listed the wrong way round, with a trailing edge that is closed in the middle
        let mut points = outline(x);
        let last = points.len() - 1;
        points[0] = [x[0] * x[1] + 1.0, x[0]];
        points[last] = [x[0] * x[1] + 1.0, x[0]];
        points.reverse();
        let coordinates = Coordinates::from_points("outline", &points).unwrap();
        assert_eq!(coordinates.trailing_edge(), TrailingEdge::Sharp);
        flat(coordinates.points())
    }
    section_points<S>(x = NACA) {
        let s = section(x);
        let whole = Section::new(s.curve().clone(), TrailingEdge::Blunt, 0.5, "again").unwrap();
        let moved = section(&NACA).with_control_points(s.curve().control_points().to_vec()).unwrap();
        let mut all = flat(&whole.points(37));
        all.extend(flat(&moved.trailing_edge_points()));
        all.extend(s.nose());
        all
    }
    section_measures<S>(x = NACA) {
        Measure::NAMES.iter().map(|name| Measure::parse(name).unwrap().evaluate(&section(x)).unwrap()).collect()
    }
    section_places<S>(x = NACA) {
        let s = section(x);
        let (frame, moments) = (s.chord_frame().unwrap(), s.second_moments().unwrap());
        let mut all = flat(&[frame.origin, frame.axis, frame.coordinates([x[0], x[1]]), frame.components([x[2], x[0]])]);
        all.extend(flat(&[s.trailing_edge_middle(), s.centroid().unwrap(), s.leading_edge().unwrap()]));
        all.extend(flat(&[s.maximum_thickness().unwrap(), s.maximum_camber().unwrap()]));
        all.extend([frame.chord, moments.xx, moments.yy, moments.xy, s.leading_edge_parameter().unwrap(), s.area()]);
        all.extend([s.perimeter().unwrap(), s.thickness_at(0.3).unwrap(), s.camber_at(0.6).unwrap(), s.camber().unwrap()]);
        all.extend([s.nose_radius().unwrap(), s.concavity().unwrap()]);
        all.extend([s.trailing_edge_gap().unwrap(), s.trailing_edge_angle().unwrap()]);
        all
    }
    boxes<S>(x = AT) {
        let ranges = [[-x[0], x[1] + 1.0], [-x[0] * x[1], x[0] + x[1]]];
        let even = FfdBox::rectangular(ranges, [4, 3], [3, 2], Placement::Even).unwrap();
        let greville = FfdBox::rectangular(ranges, [5, 4], [2, 3], Placement::Greville).unwrap();
        let points = lattice(x).control_points().to_vec();
        let free = FfdBox::from_control_points(points.clone(), [5, 4], [3, 2]).unwrap();
        let moved = free.with_control_points(points.iter().map(|p| [p[1], p[0] * p[1]]).collect()).unwrap();
        [even, greville, lattice(x), free, moved].iter()
            .flat_map(|b| [flat(b.control_points()), b.evaluate([x[0], x[1] * 2.0]).to_vec()].concat()).collect()
    }
    box_evaluation<S>(x = AT) {
        let evaluator = BoxEvaluator::new(&lattice(x));
        let mut points = [[S::from(0.0); 2]; 2];
        evaluator.evaluate_many(&[[x[0], x[1]], [x[1] * 3.0, x[0] * x[1]]], &mut points);
        flat(&[points[0], points[1], evaluator.evaluate([x[0] * 2.0, x[1]])])
    }
    embedding<S>(x = AT) {
        let points = [[x[0], x[1] * x[0]], [x[1] * 4.0, x[0] * -0.1], [x[0] * x[1] + 0.5, S::from(0.01)]];
        let lattice = lattice(x);
        let embedded = lattice.embed(&points).unwrap();
        let displacements: Vec<[S; 2]> = (0..20).map(|i| [x[1] * (i as f64).sin(), x[0] * x[0] * (i as f64).cos()]).collect();
        let mut all = flat(embedded.parameters());
        all.extend(flat(&embedded.deform(&points, &displacements).unwrap()));
        let mut back = vec![[S::from(0.0); 2]; 20];
        embedded.map().add_transposed_to(&points, &mut back);
        all.extend(flat(&back));
        all
    }
    linear_maps<S>(x = AT) {
        let mut map = LinearMap::new(2);
        for (column, weight) in [(0, 2.0), (1, -0.5)] {
            map.push(column, weight);
        }
        map.end_row();
        let mut out = [[x[0]]];
        map.lifted().add_to(&[[x[0] * x[1]], [x[1]]], &mut out);
        flat(&out)
    }
    fold_penalty<S>(x = AT) {
        let mut all = vec![penalty_of_indicator(x[0])];
        for normalised in [false, true] {
            let settings = FoldPenalty { sharpness: 30.0, normalised, ..Default::default() };
            let penalty = settings.on(&lattice(x)).unwrap();
            let net = nets(&lattice(x), x);
            all.extend([penalty.value(&net), penalty.indicator_at(7, &net), penalty.indicator_at(2, &net)]);
            // a constant box takes nets of every scalar
            all.push(settings.on(&lattice(&AT)).unwrap().value(&net));
        }
        all
    }
    shape_error<S>(x = AT) {
        let norms = ShapeNorm::NAMES.map(|(_, norm)| norm);
        let target = curve(&[x[0] * 1.1, x[1] + 0.2]);
        let constant = curve(&[0.3, 0.1]);
        let shape = curve(x);
        norms.iter().flat_map(|&norm| {
            let against = ShapeError::new(norm, &target, &shape).unwrap();
            let fixed = ShapeError::new(norm, &constant, &constant).unwrap();
            [against.value(shape.control_points()), fixed.value(shape.control_points())]
        }).collect()
    }
}

/// Points of `nalgebra` go where arrays go.
#[test]
fn points_of_nalgebra_are_points() {
    let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let arrays = FfdBox::<f64, 2>::from_corners(&corners, [4, 4], [3, 3], Placement::Even).unwrap();
    let points = corners.map(|[x, y]| Point2::new(x, y));
    let boxed = FfdBox::<f64, 2>::from_corners(&points, [4, 4], [3, 3], Placement::Even).unwrap();
    assert_eq!(arrays, boxed);
    let vectors: Vec<Vector2<f64>> = arrays.control_points().iter().map(|&p| p.into()).collect();
    assert_eq!(arrays.with_control_points(vectors).unwrap(), arrays);
    assert_eq!(arrays.embed(&[Point2::new(0.3, 0.4)]).unwrap(), arrays.embed(&[[0.3, 0.4]]).unwrap());
    let outline = outline(&AT);
    let points: Vec<Point2<f64>> = outline.iter().map(|&p| p.into()).collect();
    assert_eq!(Coordinates::from_points("a", &points), Coordinates::from_points("a", &outline));
    assert_eq!(chord_length_parameters::<f64, 2>(&points), chord_length_parameters::<f64, 2>(&outline));
}
