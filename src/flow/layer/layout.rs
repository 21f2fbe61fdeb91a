//! The places of the boundary-layer stations: fixed fractions of the way from stagnation to transition and from there
//! to the trailing edge.
//!
//! The way of the laminar stations is measured in arc length, so that they stretch with the layer. That of the turbulent
//! ones is measured in nodes of the surface: stations crowd where the nodes do, at hinges and kinks and towards the
//! trailing edge, because what the panels resolve there the layer must see.

use super::side::Side;
use crate::flow::memory::Memo;
use crate::flow::surface::SurfaceMap;
use crate::scalar::Scalar;
use std::sync::Arc;

/// Numbers of stations and their fractions; fixed during a solution.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// Fractions of the arc length from the stagnation point to transition; the last is 1.
    pub laminar: Arc<Vec<f64>>,
    /// Fractions of the node indices from transition to the trailing edge; the last is 1.
    pub turbulent: Arc<Vec<f64>>,
    /// Number of stations of the wake, which are the nodes of the wake.
    pub wake: usize,
}

/// Points x in (0, 1] that divide the integral of `density` into `count` equal parts.
fn graded(count: usize, density: impl Fn(f64) -> f64) -> Vec<f64> {
    const FINE: usize = 4000;
    let mut integral = vec![0.0];
    for i in 0..FINE {
        integral.push(integral[i] + density((i as f64 + 0.5) / FINE as f64));
    }
    let total = integral[FINE];
    let mut cell = 0;
    let mut points = Vec::with_capacity(count);
    for j in 1..count {
        let target = total * j as f64 / count as f64;
        while integral[cell + 1] < target {
            cell += 1;
        }
        points.push((cell as f64 + (target - integral[cell]) / (integral[cell + 1] - integral[cell])) / FINE as f64);
    }
    points.push(1.0);
    points
}

static LAMINAR: Memo<Vec<f64>> = Memo::new();
static TURBULENT: Memo<Vec<f64>> = Memo::new();

impl Layout {
    /// A layout with numbers of laminar and turbulent stations per side, and of stations in the wake.
    pub fn new(laminar: usize, turbulent: usize, wake: usize) -> Self {
        // laminar stations are dense at both ends: laminar separation ahead of transition, and a side that is laminar up
        // to the edge, need stations as close as the panels. Turbulent ones crowd behind transition, where the shape
        // parameter falls within some fifty momentum thicknesses (at a thin nose a thousandth of the side), and a little at
        // the edge, where the nodes alone crowd enough for the panels but not for a shape parameter near separation
        Self {
            laminar: LAMINAR.get(laminar, || graded(laminar, |x| 1.0 / (0.04 + x) + 0.6 / (1.02 - x) + 1.0)),
            turbulent: TURBULENT.get(turbulent, || graded(turbulent, |x| 1.0 / (0.004 + x) + 0.5 / (1.03 - x) + 10.0)),
            wake,
        }
    }

    /// The layout with a station more in every interval of both sides.
    pub fn doubled(&self) -> Self {
        Self::new(2 * self.laminar.len(), 2 * self.turbulent.len(), self.wake)
    }

    /// Number of stations on one side.
    pub fn side(&self) -> usize {
        self.laminar.len() + self.turbulent.len()
    }

    /// Number of stations on both sides and in the wake.
    pub fn stations(&self) -> usize {
        2 * self.side() + self.wake
    }

    /// Node index of every turbulent station of a side and arc length from the stagnation point, for the arc length of
    /// that point and the distance from there to transition.
    pub fn turbulent_places<S: Scalar>(
        &self,
        surface: &SurfaceMap,
        side: Side,
        [stagnation, transition]: [S; 2],
    ) -> impl Iterator<Item = [S; 2]> {
        let start = surface.index(side.place(stagnation, transition));
        let edge = match side {
            Side::Upper => 0.0,
            Side::Lower => surface.last(),
        };
        // written so that the last one stands on the edge exactly
        let indices = self.turbulent.iter().map(move |h| start * (1.0 - *h) + edge * *h);
        indices.map(move |t| [t, side.distance(stagnation, surface.arc_length(t))])
    }

    /// Arc lengths of the stations of a side from the stagnation point, for the arc length of that point and the distance
    /// from there to transition.
    pub fn abscissas<S: Scalar>(&self, surface: &SurfaceMap, side: Side, globals: [S; 2]) -> Vec<S> {
        let laminar = self.laminar.iter().map(|f| globals[1] * *f);
        laminar.chain(self.turbulent_places(surface, side, globals).map(|[_, x]| x)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_rise_to_one() {
        let layout = Layout::new(30, 20, 5);
        for f in [&*layout.laminar, &*layout.turbulent] {
            assert!(f[0] > 0.0 && f.windows(2).all(|w| w[0] < w[1]));
            assert_eq!(f[f.len() - 1], 1.0);
        }
        let arc: Vec<f64> = (0..41).map(|i| 0.05 * f64::from(i)).collect();
        let surface = SurfaceMap::new(&arc).unwrap();
        for (side, length) in [(Side::Upper, 0.9), (Side::Lower, 1.1)] {
            let x = layout.abscissas(&surface, side, [0.9f64, 0.3]);
            assert_eq!((x.len(), x[29]), (50, 0.3));
            assert!((x[49] - length).abs() < 1e-14 && x.windows(2).all(|w| w[0] < w[1]), "{x:?}");
        }
    }

    #[test]
    fn every_other_station_of_a_doubled_layout_is_one_of_the_layout() {
        let layout = Layout::new(30, 20, 5);
        let doubled = layout.doubled();
        for (one, two) in [(&layout.laminar, &doubled.laminar), (&layout.turbulent, &doubled.turbulent)] {
            let odd: Vec<f64> = two.iter().copied().skip(1).step_by(2).collect();
            assert!(one.len() == odd.len() && one.iter().zip(odd).all(|(a, b)| (a - b).abs() < 1e-14));
        }
    }

    #[test]
    fn turbulent_stations_crowd_where_the_nodes_do() {
        // nodes ten times as close about the arc length 1.6
        let density = |s: f64| 1.0 + 9.0 * (-((s - 1.6) / 0.03).powi(2)).exp();
        let mut arc = vec![0.0];
        while arc[arc.len() - 1] < 2.0 {
            let s = arc[arc.len() - 1];
            arc.push(s + 0.02 / density(s));
        }
        let surface = SurfaceMap::new(&arc).unwrap();
        let x = Layout::new(30, 40, 5).abscissas(&surface, Side::Lower, [1.0f64, 0.1]);
        let closest = |at: f64| x.windows(2).filter(|w| w[0] < at && w[1] >= at).map(|w| w[1] - w[0]).sum::<f64>();
        assert!(closest(0.6) < 0.2 * closest(0.4), "{} {}", closest(0.6), closest(0.4));
    }
}
