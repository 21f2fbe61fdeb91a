//! The paper's claim about folds: so long as the control net of the box does not fold, what is in it does not cross
//! itself (paper, Section V), and Fig. 6, a box that does fold.
//!
//! The claim is no theorem: see the counterexamples below. It is tested where it is true, for nets whose control points
//! stay within one cell of where they began; half a million random walks have not found one that is not.

use aeroform::ffd::{FfdBox, FoldPenalty, Placement};
use aeroform::section::{Section, SectionDefinition};
use proptest::prelude::*;

/// The box of the paper's shape match.
const BOUNDS: [[f64; 2]; 2] = [[-0.1, 1.1], [-0.15, 0.15]];

fn lattice(counts: [usize; 2], degree: usize, placement: Placement) -> FfdBox<f64> {
    FfdBox::rectangular(BOUNDS, counts, [degree; 2], placement).unwrap()
}

fn folded(lattice: &FfdBox<f64>, net: &[[f64; 2]]) -> bool {
    FoldPenalty::default().on(lattice).unwrap().report(net).folded
}

fn deformed(lattice: &FfdBox<f64>, shape: &str, net: &[[f64; 2]]) -> Section {
    let section = SectionDefinition::parse(shape).unwrap().section().unwrap();
    let points = section.curve().control_points();
    let moves: Vec<[f64; 2]> =
        net.iter().zip(lattice.control_points()).map(|(a, b)| [a[0] - b[0], a[1] - b[1]]).collect();
    section.with_control_points(lattice.embed(points).unwrap().deform(points, &moves).unwrap()).unwrap()
}

/// Smallest determinant of the Jacobian of the map on a grid.
fn smallest_determinant(lattice: &FfdBox<f64>, net: &[[f64; 2]]) -> f64 {
    let now = lattice.with_control_points(net.to_vec()).unwrap();
    let mut smallest = f64::INFINITY;
    for i in 0..=60 {
        for j in 0..=60 {
            let (_, d) = now.spline().point_and_jacobian([f64::from(i) / 60.0, f64::from(j) / 60.0]);
            smallest = smallest.min(d[0][0] * d[1][1] - d[0][1] * d[1][0]);
        }
    }
    smallest
}

/// Which control point is placed anew, and where around its first place, in cells.
type Moves = Vec<(prop::sample::Index, f64, f64)>;

/// Carries out moves one after the other, leaving out those that fold the net.
fn walk(lattice: &FfdBox<f64>, moves: &Moves) -> Vec<[f64; 2]> {
    let penalty = FoldPenalty::default().on(lattice).unwrap();
    let counts = lattice.counts();
    let home = lattice.control_points();
    let mut net = home.to_vec();
    for (index, dx, dy) in moves {
        let index = index.index(net.len());
        let before = net[index];
        net[index] = std::array::from_fn(|d| {
            home[index][d] + [dx, dy][d] * (BOUNDS[d][1] - BOUNDS[d][0]) / (counts[d] - 1) as f64
        });
        if penalty.report(&net).folded {
            net[index] = before;
        }
    }
    net
}

fn moves(reach: f64) -> impl Strategy<Value = Moves> {
    prop::collection::vec((any::<prop::sample::Index>(), -reach..reach, -reach..reach), 0..400)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_fold_in_the_box_means_no_self_intersection(
        degree in 1usize..=5,
        extra in (1usize..=3, 1usize..=3),
        even in any::<bool>(),
        shape in prop::sample::select(vec!["naca0006:sharp", "naca0012:sharp", "naca0024", "naca2412:sharp", "naca6409"]),
        moves in moves(1.0),
    ) {
        let placement = if even { Placement::Even } else { Placement::Greville };
        let lattice = lattice([degree + extra.0, degree + extra.1], degree, placement);
        let net = walk(&lattice, &moves);
        prop_assert!(!folded(&lattice, &net));
        prop_assert!(deformed(&lattice, shape, &net).self_intersection().is_none());
    }

    /// For linear boxes the first half of the claim is a theorem: the determinant of a bilinear cell is linear along
    /// each direction, so its smallest value is twice the area of a triangle at a corner of the cell.
    #[test]
    fn an_unfolded_linear_box_turns_over_nowhere(counts in (2usize..=6, 2usize..=6), moves in moves(6.0)) {
        let lattice = lattice([counts.0, counts.1], 1, Placement::Even);
        let net = walk(&lattice, &moves);
        prop_assert!(!folded(&lattice, &net));
        prop_assert!(smallest_determinant(&lattice, &net) > 0.0);
    }
}

#[test]
fn a_control_point_past_its_neighbours_makes_the_section_cross_itself() {
    // paper, Fig. 6: NACA 0012 in a linear 4 × 4 box
    let lattice = lattice([4, 4], 1, Placement::Even);
    let mut net = lattice.control_points().to_vec();
    assert!(deformed(&lattice, "naca0012:sharp", &net).self_intersection().is_none());
    net[5] = [0.35, 0.12];
    assert!(folded(&lattice, &net));
    assert!(deformed(&lattice, "naca0012:sharp", &net).self_intersection().is_some());
}

/// Far from where they began, nets that nowhere fold can still make a section cross itself. Both were found by random
/// search and rounded to hundredths; the paper's claim holds for neither.
#[test]
fn an_unfolded_net_is_no_guarantee_far_from_its_start() {
    // quadratic: the map turns over between control points of which no three neighbours do
    let quadratic = lattice([3, 3], 2, Placement::Even);
    let net = [
        [0.72, -0.34],
        [0.72, -0.27],
        [1.57, -0.09],
        [-1.64, -0.32],
        [-1.19, -0.22],
        [-0.55, -0.18],
        [-2.05, 0.25],
        [-0.49, 0.56],
        [-0.11, -0.07],
    ];
    assert!(!folded(&quadratic, &net));
    assert!(smallest_determinant(&quadratic, &net) < 0.0);
    assert!(deformed(&quadratic, "naca0012:sharp", &net).self_intersection().is_some());

    // linear: the map turns over nowhere, but one part of the box lies over another
    let linear = lattice([5, 2], 1, Placement::Even);
    let net = [
        [0.07, -0.21],
        [1.01, -0.62],
        [0.86, 0.29],
        [1.18, 0.46],
        [0.71, -0.05],
        [-0.36, 0.16],
        [0.44, 0.03],
        [0.30, 1.00],
        [1.44, 0.68],
        [0.24, -0.61],
    ];
    assert!(!folded(&linear, &net));
    assert!(smallest_determinant(&linear, &net) > 0.0);
    assert!(deformed(&linear, "naca0012:sharp", &net).self_intersection().is_some());
}
