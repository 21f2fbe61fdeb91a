//! Where stations and lines stand.
//!
//! All of these numbers but the distances ahead of the nose are constants of a grid. Those distances begin with the
//! first step on the wall, so that cells on both sides of the nose match.

use crate::differentiate::{Tangent, lift_root};
use crate::scalar::Scalar;

/// Number of stations and lines of a grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    /// Cells on each side of the section.
    pub wall: usize,
    /// Cells ahead of the nose.
    pub ahead: usize,
    /// Cells behind the trailing edge.
    pub behind: usize,
    /// Tubes on each side of the dividing line.
    pub tubes: usize,
    /// Largest stream function of the domain, which is its half height far away, in chords.
    pub reach: f64,
}

impl Size {
    /// Length of the domain ahead of the nose and behind the trailing edge, in chords.
    fn length(&self) -> f64 {
        LENGTH * self.reach
    }
}

/// Length of the domain ahead of the nose and behind the trailing edge over its half height.
const LENGTH: f64 = 0.8;
/// Stream function of the first tube. It must be thin against the nose radius.
const FIRST_TUBE: f64 = 0.003;

/// Density of wall stations at a fraction of the length of a side.
///
/// Cells at the trailing edge may not be short against the layers there: with a third of the spacing lift changes by 0.15 %
/// at most, but thick sections, whose layers nearly separate at the edge, are not found.
fn density(x: f64) -> f64 {
    1.0 / (0.02 + x) + 0.05 / (1.03 - x) + 6.0
}

/// Places of stations and lines; fixed while a shape is changed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Stations {
    /// Fractions of the length of a side at which the wall stations stand, from the nose (0) to the edge (1).
    pub fractions: Vec<f64>,
    /// Number of cells ahead of the nose.
    pub ahead: usize,
    /// Length of the domain ahead of the nose, in chords.
    pub length: f64,
    /// Distances behind the trailing edge in chords, from the edge (0) on.
    pub behind: Vec<f64>,
    /// Stream function of the lines, from the dividing line (0) on.
    pub heights: Vec<f64>,
    /// Number of the wall station at which each side turns turbulent.
    pub turning: [usize; 2],
}

impl Stations {
    /// Stations for a size and the fractions of the length of each side at which it turns turbulent.
    pub fn new(size: Size, turning: [f64; 2]) -> Self {
        let fractions = graded(size.wall, density);
        let last = fractions[size.wall] - fractions[size.wall - 1];
        let nearest = |at: f64| {
            let away = |k: usize| (fractions[k] - at).abs();
            (3..size.wall - 1).fold(3, |best, k| if away(k) < away(best) { k } else { best })
        };
        let turning = turning.map(nearest);
        Self {
            fractions,
            ahead: size.ahead,
            length: size.length(),
            behind: geometric(last, size.length(), size.behind),
            heights: geometric(FIRST_TUBE, size.reach, size.tubes),
            turning,
        }
    }

    /// Distances ahead of the nose in the plane of the parabola, from the nose (0) on, for the first step on the wall in
    /// that plane.
    pub fn ahead<S: Scalar>(&self, first: S) -> Vec<S> {
        geometric(first, (2.0 * self.length).sqrt(), self.ahead)
    }

    /// Number of stations.
    pub fn count(&self) -> usize {
        self.edge() + self.behind.len()
    }

    /// Mean load of the cell at the trailing edge over that of the cell ahead, for a load that falls evenly to nothing at
    /// the edge. Cells reach from the middle of an interval to that of the next; behind the edge there is no load.
    ///
    /// Layers make the load fall so. Without layers it falls as the square root of the distance, which would give about
    /// twice as much.
    pub fn last_load(&self) -> f64 {
        let n = self.fractions.len() - 1;
        let (last, before) = (self.fractions[n] - self.fractions[n - 1], self.fractions[n - 1] - self.fractions[n - 2]);
        last * last / ((last + self.behind[1]) * (3.0 * last + before))
    }

    /// The station at the nose.
    pub fn nose(&self) -> usize {
        self.ahead
    }

    /// The station at the trailing edge.
    pub fn edge(&self) -> usize {
        self.nose() + self.fractions.len() - 1
    }
}

/// Places 0 … `length` whose steps grow by a constant factor from `first` on.
fn geometric<S: Scalar>(first: S, length: f64, count: usize) -> Vec<S> {
    fn sum<S: Scalar>(ratio: S, first: S, count: usize) -> S {
        (0..count).fold((S::from(0.0), first), |(sum, step), _| (sum + step, step * ratio)).0
    }
    let (mut low, mut high) = (0.2, 6.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if sum(middle, first.re(), count) > length { high = middle } else { low = middle }
    }
    let root = 0.5 * (low + high);
    let slope = || sum(Tangent::<1>::from_re(root).derivative(0), Tangent::from_re(first.re()), count).eps[0];
    let ratio = lift_root(root, slope, |r: S| sum(r, first, count) - length).unwrap_or(S::from(f64::NAN));
    let mut places = vec![S::from(0.0)];
    let (mut place, mut step) = (S::from(0.0), first);
    for _ in 0..count {
        place += step;
        step *= ratio;
        places.push(place);
    }
    places
}

/// Points 0 … 1 that divide the integral of `density` into `count` equal parts.
fn graded(count: usize, density: impl Fn(f64) -> f64) -> Vec<f64> {
    const FINE: usize = 20_000;
    let mut integral = vec![0.0];
    for i in 0..FINE {
        integral.push(integral[i] + density((i as f64 + 0.5) / FINE as f64));
    }
    let total = integral[FINE];
    let mut cell = 0;
    let mut points = vec![0.0];
    for j in 1..count {
        let target = total * j as f64 / count as f64;
        while integral[cell + 1] < target {
            cell += 1;
        }
        let share = (target - integral[cell]) / (integral[cell + 1] - integral[cell]);
        points.push((cell as f64 + share) / FINE as f64);
    }
    points.push(1.0);
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_rise_and_end_where_they_should() {
        let size = Size { wall: 40, ahead: 10, behind: 12, tubes: 8, reach: 2.5 };
        let stations = Stations::new(size, [0.1, 0.2]);
        let ahead = stations.ahead(0.01);
        for (places, end) in
            [(&stations.fractions, 1.0), (&ahead, 2.0), (&stations.behind, 2.0), (&stations.heights, 2.5)]
        {
            assert!(places[0] == 0.0 && places.windows(2).all(|w| w[0] < w[1]));
            assert!((places[places.len() - 1] - end).abs() < 1e-9);
        }
        assert_eq!((stations.nose(), stations.edge(), stations.count()), (10, 50, 63));
        let lifted = stations.ahead(Tangent::<1>::from_re(0.01).derivative(0));
        let [far, near] = [0.01 + 1e-6, 0.01 - 1e-6].map(|first| stations.ahead(first));
        for k in 0..=10 {
            assert!(((far[k] - near[k]) / 2e-6 - lifted[k].eps[0]).abs() < 1e-6 * lifted[5].eps[0], "{k}");
        }
        // an eighth where all intervals are equal
        assert!((stations.last_load() - 0.125).abs() < 0.002, "{}", stations.last_load());
        let at = |side: usize| stations.fractions[stations.turning[side]];
        assert!((at(0) - 0.1).abs() < 0.02 && (at(1) - 0.2).abs() < 0.03);
    }
}
