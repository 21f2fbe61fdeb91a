//! The momentum of a tube about a station, between the middles of two neighbouring intervals.
//!
//! Mass flow and total enthalpy of a tube are exact. The unknown speeds stand in the middle of an interval and give the
//! pressures there. The component of momentum across a tube gives the pressures on the two lines; equal pressures on
//! both sides of a line are the equation of the line. The component along the tube is blended with the conservation of
//! total pressure, which holds where there is no dissipation, so that subsonic flow has no losses at all and a shock
//! satisfies the laws of Rankine and Hugoniot.
//!
//! Source: Giles & Drela, "Two-dimensional transonic aerodynamic design method", AIAA Journal 25 (1987), with the speed
//! in place of the density as unknown.

use super::gas::{Flow, GAMMA};
use super::kernel::Kernel;
use crate::flow::layer::Side;
use crate::plane::{cross, dot, middle, minus};
use crate::scalar::{Over, Scalar};

/// Sum of the dissipation at both ends of a cell above which the momentum along the tube takes over from the total
/// pressure.
const BLEND: f64 = 0.005;
/// Pressure per relative difference between the area at the station and the mean area, over density times the square of
/// the speed. It sees the saw tooth of a line that areas in the middle of intervals cannot see.
const SMOOTHING: f64 = 0.1;
/// Additional pressure per relative difference of the areas at the dividing line, where the speed vanishes and the
/// pressure does not feel the area.
const STAGNANT_SMOOTHING: f64 = 0.5;
/// Stream function over which that fades.
const FADING: f64 = 0.3;

// Arrays are written out here and below: a closure over duals of sixteen directions is called, not inlined.
#[inline(always)]
fn unit<S: Scalar>(v: [S; 2]) -> [S; 2] {
    let r = dot(v, v).sqrt().recip();
    [v[0] * r, v[1] * r]
}

/// A tube between two stations, in the middle of the interval.
pub(super) struct Face<S> {
    lower: [S; 2],
    upper: [S; 2],
    direction: [S; 2],
    across: [S; 2],
    /// Area across the mean direction of both lines.
    pub area: S,
}

impl<S: Scalar> Face<S> {
    /// The tube between the upstream and downstream node of its lower and of its upper line.
    #[inline(always)]
    pub fn new(low: [[S; 2]; 2], high: [[S; 2]; 2]) -> Self {
        let (lower, upper) = (minus(low[1], low[0]), minus(high[1], high[0]));
        let direction = unit([lower[0] + upper[0], lower[1] + upper[1]]);
        let between = |c: usize| (high[1][c] + high[0][c] - low[1][c] - low[0][c]) * 0.5;
        let across = [between(0), between(1)];
        let area = cross(direction, across);
        Self { lower, upper, direction, across, area }
    }
}

/// Pressures and residuals of a cell.
pub(super) struct Momentum<S> {
    /// Pressure on the upper line.
    pub above: S,
    /// Pressure on the lower line.
    pub below: S,
    /// Residual of the equation along the tube.
    pub along: S,
    /// Logarithm of the speed on the upper line.
    pub log_speed_above: S,
    /// Logarithm of the speed on the lower line.
    pub log_speed_below: S,
    /// Density times the square of the speed.
    pub impulse: S,
}

/// One tube about a station.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    mass: f64,
    smoothing: f64,
}

/// Softened dissipation of an interval from the square of the Mach numbers there and upstream.
#[inline(always)]
fn dissipation<S: Over<P>, P: Scalar>(here: S, upstream: S, flow: &Flow<P>) -> S {
    let mach2 = (here + upstream) * 0.5;
    ((-mach2.recip() + 1.0) / flow.margin).softplus() * flow.upwinding
}

/// The speed that the momentum along the tube carries, from the speed of an interval and those of the two upstream of it.
#[inline(always)]
fn upwinded<S: Over<P>, P: Scalar>([q, before, last]: [S; 3], mu: S, flow: &Flow<P>) -> S {
    q - mu * (q - before) + mu * (before - last) * flow.order
}

impl Cell {
    /// A tube with a mass flow, at a stream function counted from the dividing line.
    pub fn new(mass: f64, height: f64) -> Self {
        Self { mass, smoothing: STAGNANT_SMOOTHING * (-height / FADING).exp() }
    }

    /// The momentum of the tube. `low` and `high` are the nodes of both lines at the station upstream, the station and
    /// the one downstream, `q` the speeds in the four intervals up to the one behind the station.
    #[inline(always)]
    pub fn momentum<S: Over<P>, P: Scalar>(
        &self,
        low: [[S; 2]; 3],
        high: [[S; 2]; 3],
        q: [S; 4],
        flow: &Flow<P>,
    ) -> Momentum<S> {
        let first = Face::new([low[0], low[1]], [high[0], high[1]]);
        let second = Face::new([low[1], low[2]], [high[1], high[2]]);
        let (q1, q2) = (q[2], q[3]);
        let (rho1, rho2) = ((q1 * first.area).recip() * self.mass, (q2 * second.area).recip() * self.mass);
        let (p1, p2) = (flow.pressure(rho1, q1), flow.pressure(rho2, q2));
        let along = unit([first.direction[0] + second.direction[0], first.direction[1] + second.direction[1]]);
        let below = dot(middle(first.lower, second.lower), along);
        let above = dot(middle(first.upper, second.upper), along);
        let area = (first.area + second.area) * 0.5;
        let impulse = (rho1 * q1 * q1 + rho2 * q2 * q2) * 0.5;
        let difference = (cross(along, minus(high[1], low[1])) - area) / area;
        let mean = (p1 + p2) * 0.5;
        let level = mean + (impulse * SMOOTHING + self.smoothing) * difference;
        let turning = (q2 * cross(along, second.direction) - q1 * cross(along, first.direction)) * self.mass;
        let ends = p2 * dot(second.across, along) - p1 * dot(first.across, along);
        let jump = (level * (below - above) + ends - turning) / ((below + above) * 0.5);
        let (pressure_above, pressure_below) = (level + jump * 0.5, level - jump * 0.5);
        let log_speed = (q1 * q2).ln() * 0.5;
        Momentum {
            above: pressure_above,
            below: pressure_below,
            along: self.along(q, [p1, p2], area, flow),
            // Bernoulli's equation, linearised from the middle of the tube, has no roots of negative numbers
            log_speed_above: log_speed - (pressure_above - mean) / impulse,
            log_speed_below: log_speed - (pressure_below - mean) / impulse,
            impulse,
        }
    }

    /// Residual of the equation along the tube.
    #[inline(always)]
    fn along<S: Over<P>, P: Scalar>(&self, q: [S; 4], [p1, p2]: [S; 2], area: S, flow: &Flow<P>) -> S {
        let mach2 = [flow.mach2(q[1]), flow.mach2(q[2]), flow.mach2(q[3])];
        let (mu1, mu2) = (dissipation(mach2[1], mach2[0], flow), dissipation(mach2[2], mach2[1], flow));
        let (u1, u2) = (upwinded([q[2], q[1], q[0]], mu1, flow), upwinded([q[3], q[2], q[1]], mu2, flow));
        let momentum = p2 - p1 + (u2 - u1) / area * self.mass;
        let losses = flow.log_total_pressure(p2, u2) - flow.log_total_pressure(p1, u1);
        let sum = mu1 + mu2;
        let share = sum * sum / (sum * sum + BLEND * BLEND);
        share * momentum + (-share + 1.0) * ((p1 + p2) * 0.5) * losses
    }
}

/// Nodes and speeds from the inputs of a [`Cell`]: the nodes of the lower line from upstream on, those of the upper line,
/// four speeds.
#[inline(always)]
pub(super) fn unpack<S: Scalar>(x: &[S]) -> ([[S; 2]; 3], [[S; 2]; 3], [S; 4]) {
    let node = |k: usize| [x[2 * k], x[2 * k + 1]];
    ([node(0), node(1), node(2)], [node(3), node(4), node(5)], [x[12], x[13], x[14], x[15]])
}

/// Number of inputs of a cell.
pub(super) const INPUTS: usize = 16;

impl Kernel<INPUTS, 5> for Cell {
    #[inline(always)]
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; INPUTS], flow: &Flow<P>) -> [S; 5] {
        let (low, high, q) = unpack(&x);
        let m = self.momentum(low, high, q, flow);
        [m.above, m.below, m.along, m.log_speed_above, m.log_speed_below]
    }
}

/// The speed of a layer at the trailing edge, under the mean pressure of both sides. Inputs: those of a [`Cell`] and the
/// logarithm of the speed. Results: what this side adds to its own equation, and to that of the other side.
///
/// The mean pressures of the cells on both sides differ by the load ahead of the edge, but the layers end at the edge, where
/// there is none. Under the pressures of the cells the upper layer would be too thin at the edge and the lower one too
/// thick, and lift too high.
pub(super) struct EdgeSpeed {
    pub cell: Cell,
    pub side: Side,
}

impl Kernel<17, 2> for EdgeSpeed {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 17], flow: &Flow<P>) -> [S; 2] {
        let (low, high, q) = unpack(&x);
        let m = self.cell.momentum(low, high, q, flow);
        let (pressure, log_speed) = match self.side {
            Side::Upper => (m.below, m.log_speed_below),
            Side::Lower => (m.above, m.log_speed_above),
        };
        let half = pressure * 0.5;
        [m.impulse * (x[INPUTS] - log_speed) - half, half]
    }
}

/// Total pressure of a tube at the inlet against that of the onset flow.
pub(super) struct Inlet {
    pub mass: f64,
}

/// Face and speed from the nodes of the lower and the upper line of a tube at two stations, and the speed.
#[inline(always)]
fn face_and_speed<S: Scalar>(x: [S; 9]) -> (Face<S>, S) {
    let node = |k: usize| [x[2 * k], x[2 * k + 1]];
    (Face::new([node(0), node(1)], [node(2), node(3)]), x[8])
}

impl Kernel<9, 1> for Inlet {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 9], flow: &Flow<P>) -> [S; 1] {
        let (face, q) = face_and_speed(x);
        let density = (q * face.area).recip() * self.mass;
        [(flow.pressure(density, q) / flow.static_pressure).ln() - density.ln() * GAMMA]
    }
}

/// A tube at the exit, expanded to the pressure of the onset flow: its displacement, and its share of the wave drag
/// coefficient.
pub(super) struct Exit {
    pub mass: f64,
}

impl Kernel<9, 2> for Exit {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 9], flow: &Flow<P>) -> [S; 2] {
        let (face, q) = face_and_speed(x);
        let (speed, volume) = flow.expanded(q, face.area, self.mass);
        [(volume - 1.0) * self.mass, (-speed + 1.0) * (2.0 * self.mass)]
    }
}

#[cfg(test)]
mod tests {
    use super::super::gas::Parameters;
    use super::*;

    fn flow(mach: f64) -> Flow<f64> {
        Flow::new(&Parameters { mach, reynolds: 1e6, incidence: 0.0, strength: 1.0, threshold: 0.98, order: 1.0 })
    }

    fn nodes(heights: [f64; 3]) -> ([[f64; 2]; 3], [[f64; 2]; 3]) {
        let x = [0.0, 0.1, 0.2];
        ([0, 1, 2].map(|k| [x[k], 0.0]), [0, 1, 2].map(|k| [x[k], heights[k]]))
    }

    #[test]
    fn the_onset_flow_has_no_residual() {
        let flow = flow(0.8);
        let (low, high) = nodes([0.05; 3]);
        let m = Cell::new(0.05, 1.0).momentum(low, high, [1.0; 4], &flow);
        assert!((m.above - flow.static_pressure).abs() < 1e-13 && (m.below - flow.static_pressure).abs() < 1e-13);
        assert!(m.along.abs() < 1e-13 && m.log_speed_above.abs() < 1e-13);
    }

    #[test]
    fn a_normal_shock_satisfies_rankine_and_hugoniot() {
        // speeds on both sides of a normal shock in a straight tube: q1 q2 = a*², the square of the critical speed
        let flow = flow(0.8);
        let critical2 = 2.0 * flow.total_enthalpy * (GAMMA - 1.0) / (GAMMA + 1.0);
        let ahead = 1.3 * critical2.sqrt();
        let behind = critical2 / ahead;
        let (low, high) = nodes([0.05; 3]);
        let cell = Cell::new(0.05, 1.0);
        // momentum alone; the upwinding vanishes where the speed does not change
        let p = [ahead, behind].map(|q| flow.pressure(0.05 / (q * 0.05), q));
        let exact: f64 = p[1] - p[0] + (behind - ahead);
        assert!(exact.abs() < 1e-13, "{exact}");
        let found = cell.momentum(low, high, [ahead, ahead, ahead, behind], &flow).along;
        // what is left is the upwinding of the speed behind the shock, where the mean Mach number is supersonic
        let smeared = cell.momentum(low, high, [behind; 4], &flow).along;
        assert!(smeared.abs() < 1e-13 && found.is_finite());
    }

    #[test]
    fn subsonic_flow_keeps_the_total_pressure() {
        let flow = flow(0.5);
        let (low, high) = nodes([0.05, 0.049, 0.048]);
        let areas = [0, 1].map(|k| Face::new([low[k], low[k + 1]], [high[k], high[k + 1]]).area);
        let q = areas.map(|area| flow.subsonic_speed(0.05 / area, 0.9));
        let along = Cell::new(0.05, 1.0).momentum(low, high, [q[0], q[0], q[0], q[1]], &flow).along;
        assert!(along.abs() < 1e-9, "{along}");
        let wrong = Cell::new(0.05, 1.0).momentum(low, high, [q[0], q[0], q[0], q[1] * 1.01], &flow).along;
        assert!(wrong.abs() > 1e-4, "{wrong}");
    }
}
