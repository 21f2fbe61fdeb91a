//! Derivatives of sums over panels and points, collected panel by panel.
//!
//! A kernel sees a point in the frame of a panel: two coordinates and the length. With its derivatives to those three
//! (dual numbers of width three) the derivatives to the ends of the panel need only sums over the points, which are
//! turned into the outer frame once a panel.

use super::OUTPUTS;
use crate::differentiate::Tangent;
use crate::flow::coupled::duals::{Dual4, gradient};
use crate::flow::panel::polar::Straight;
use num_dual::DualNum;

/// Derivatives with respect to the coordinates of a point in the frame of a panel and the length of the panel.
pub(super) type Dual3 = Tangent<3>;

/// The variables of a panel seen from a point.
#[inline(always)]
pub(super) fn variables(panel: &Straight, point: [f64; 2]) -> ([Dual3; 2], Dual3) {
    let [x, z] = panel.local(point);
    let at = [Dual3::from_re(x).derivative(0), Dual3::from_re(z).derivative(1)];
    (at, Dual3::from_re(panel.length).derivative(2))
}

/// One entry an output.
type Lanes = [f64; OUTPUTS];

/// Sums over points of what depends on one panel, all outputs.
#[derive(Debug, Clone, Default)]
pub(super) struct PanelSums {
    /// Derivatives with respect to the coordinates of the points.
    shift: [Lanes; 2],
    /// Coefficients of the unit vector along the panel.
    turn: [Lanes; 2],
    /// Coefficients of the length.
    stretch: Lanes,
}

#[inline(always)]
fn add(sum: &mut Lanes, factor: f64, weights: &Lanes) {
    for output in 0..OUTPUTS {
        sum[output] += factor * weights[output];
    }
}

impl PanelSums {
    /// Adds `weights` times a quantity whose derivatives with respect to the coordinates of `point` in the frame of
    /// the panel and to its length are `slopes`.
    #[inline(always)]
    pub fn add(&mut self, panel: &Straight, point: [f64; 2], slopes: [f64; 3], weights: &Lanes) {
        let [by_x, by_z, by_length] = slopes;
        let (px, py) = (point[0] - panel.start[0], point[1] - panel.start[1]);
        add(&mut self.shift[0], by_x, weights);
        add(&mut self.shift[1], by_z, weights);
        self.add_turn([by_x * px + by_z * py, by_x * py - by_z * px], weights);
        add(&mut self.stretch, by_length, weights);
    }

    /// Adds `weights` times a quantity that contains the unit vector along the panel linearly.
    #[inline(always)]
    pub fn add_turn(&mut self, coefficients: [f64; 2], weights: &Lanes) {
        add(&mut self.turn[0], coefficients[0], weights);
        add(&mut self.turn[1], coefficients[1], weights);
    }

    /// Derivatives of one output with respect to both ends of the panel.
    pub fn by_ends(&self, ends: [[f64; 2]; 2], output: usize) -> [[f64; 2]; 2] {
        let panel = Straight::new(ends);
        let unit = |end: usize, c: usize| Dual4::from_re(ends[end][c]).derivative(2 * end + c);
        let (dx, dy) = (unit(1, 0) - unit(0, 0), unit(1, 1) - unit(0, 1));
        let length = (dx * dx + dy * dy).sqrt();
        let [tx, ty] = [dx / length, dy / length];
        let value = tx * self.turn[0][output] + ty * self.turn[1][output] + length * self.stretch[output];
        let mut g = gradient(&value);
        // a shift of the start is one of all points the other way
        let shift = panel.outer([self.shift[0][output], self.shift[1][output]]);
        for c in 0..2 {
            g[c] -= shift[c];
        }
        [[g[0], g[1]], [g[2], g[3]]]
    }
}
