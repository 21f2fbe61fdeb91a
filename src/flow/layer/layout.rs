//! The places of the boundary-layer stations: fixed fractions of the way from stagnation to transition and from there
//! to the trailing edge.

use crate::flow::memory::Memo;
use crate::scalar::Scalar;
use std::sync::Arc;

/// Numbers of stations and their fractions; fixed during a solution.
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    /// Fractions of the way from the stagnation point to transition; the last is 1.
    pub laminar: Arc<Vec<f64>>,
    /// Fractions of the way from transition to the trailing edge; the last is 1.
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
        // parameter falls within some fifty momentum thicknesses (at a thin nose a thousandth of the side), and over the
        // last part of the side, where it rises towards separation
        Self {
            laminar: LAMINAR.get(laminar, || graded(laminar, |x| 1.0 / (0.04 + x) + 0.6 / (1.02 - x) + 1.0)),
            turbulent: TURBULENT.get(turbulent, || graded(turbulent, |x| 1.0 / (0.0025 + x) + 2.0 / (1.03 - x))),
            wake,
        }
    }

    /// Number of stations on one side.
    pub fn side(&self) -> usize {
        self.laminar.len() + self.turbulent.len()
    }

    /// Number of stations on both sides and in the wake.
    pub fn stations(&self) -> usize {
        2 * self.side() + self.wake
    }

    /// Arc lengths of the stations of one side from the stagnation point, for a transition point and a side length.
    pub fn abscissas<S: Scalar>(&self, transition: S, length: S) -> Vec<S> {
        let laminar = self.laminar.iter().map(|f| transition * *f);
        let turbulent = self.turbulent.iter().map(|h| transition + (length - transition) * *h);
        laminar.chain(turbulent).collect()
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
        let x = layout.abscissas(0.3f64, 1.1);
        assert_eq!((x.len(), x[29], x[49]), (50, 0.3, 1.1));
    }
}
