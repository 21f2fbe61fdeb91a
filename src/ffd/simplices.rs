//! The simplices that the points of a control net span with their neighbours, and the smallest of them.

use crate::scalar::Scalar;
use num_dual::Dual2SVec64;
use smallvec::SmallVec;

/// Area of the triangle (volume of the tetrahedron) at `origin` with the given neighbours, positive when they are
/// ordered as the axes are.
pub(super) fn simplex_measure<S: Scalar, const D: usize>(origin: [S; D], neighbours: [[S; D]; D]) -> S {
    let edge: [[S; D]; D] = std::array::from_fn(|k| std::array::from_fn(|d| neighbours[k][d] - origin[d]));
    const { assert!(D == 2 || D == 3, "boxes have two or three dimensions") };
    if D == 2 {
        return (edge[0][0] * edge[1][1] - edge[0][1] * edge[1][0]) * 0.5;
    }
    let minor = |a: usize, b: usize| edge[1][a] * edge[2][b] - edge[1][b] * edge[2][a];
    (edge[0][0] * minor(1, 2) + edge[0][1] * minor(2, 0) + edge[0][2] * minor(0, 1)) / 6.0
}

/// A control point with the simplices it spans with its neighbours.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Star<const D: usize> {
    /// The control point itself, then every neighbour.
    pub points: SmallVec<[usize; 7]>,
    /// For each simplex: positions in `points` of the neighbour in each direction, and the sign of its orientation.
    pub simplices: SmallVec<[([usize; D], f64); 8]>,
}

/// Up to four measures in the plane, eight in space.
pub(super) type Measures<S> = SmallVec<[S; 4]>;

impl<const D: usize> Star<D> {
    pub fn measures<S: Scalar>(&self, net: &[[S; D]]) -> Measures<S> {
        let local: SmallVec<[[S; D]; 7]> = self.points.iter().map(|&i| net[i]).collect();
        self.local_measures(&local)
    }

    fn local_measures<S: Scalar>(&self, local: &[[S; D]]) -> Measures<S> {
        self.simplices
            .iter()
            .map(|(neighbours, sign)| simplex_measure(local[0], neighbours.map(|n| local[n])) * *sign)
            .collect()
    }
}

impl Star<2> {
    /// A triangle's area to second order in its six coordinates, and the rows these have in the Hessian.
    pub fn second_order_area(
        &self,
        net: &[[f64; 2]],
        neighbours: [usize; 2],
        sign: f64,
    ) -> (Dual2SVec64<6>, [usize; 6]) {
        let corners = [0, neighbours[0], neighbours[1]].map(|position| self.points[position]);
        let seeded: [[Dual2SVec64<6>; 2]; 3] = std::array::from_fn(|slot| {
            std::array::from_fn(|d| Dual2SVec64::from_re(net[corners[slot]][d]).derivative(2 * slot + d))
        });
        let area = simplex_measure(seeded[0], [seeded[1], seeded[2]]) * sign;
        (area, std::array::from_fn(|k| 2 * corners[k / 2] + k % 2))
    }
}

/// The stars of all control points of a net.
pub(super) fn stars<const D: usize>(counts: &[usize; D]) -> Vec<Star<D>> {
    (0..counts.iter().product())
        .map(|index| {
            let mut points: SmallVec<[usize; 7]> = SmallVec::from_slice(&[index]);
            // position in `points` of the neighbour below and above in each direction
            let mut around = [[None; 2]; D];
            let mut stride = 1;
            for d in 0..D {
                let local = index / stride % counts[d];
                if local > 0 {
                    around[d][0] = Some(points.len());
                    points.push(index - stride);
                }
                if local + 1 < counts[d] {
                    around[d][1] = Some(points.len());
                    points.push(index + stride);
                }
                stride *= counts[d];
            }
            let simplices = (0..1usize << D)
                .filter_map(|choice| {
                    let mut neighbours = [0; D];
                    let mut sign = 1.0;
                    for d in 0..D {
                        let side = choice >> d & 1;
                        neighbours[d] = around[d][1 - side]?;
                        sign *= if side == 0 { 1.0 } else { -1.0 };
                    }
                    Some((neighbours, sign))
                })
                .collect();
            Star { points, simplices }
        })
        .collect()
}

/// The smallest simplex of a net: its control point and signed measure.
pub(super) fn smallest_simplex<const D: usize>(counts: &[usize; D], net: &[[f64; D]]) -> (usize, f64) {
    let mut worst = (0, f64::INFINITY);
    for (index, star) in stars(counts).iter().enumerate() {
        for measure in star.measures(net) {
            // a NaN counts as the worst
            if !(measure >= worst.1) {
                worst = (index, measure);
            }
        }
    }
    worst
}
