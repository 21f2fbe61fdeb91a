//! Steps with a Jacobian that is kept: cheap ones near the solution.
//!
//! A full Newton step linearises, eliminates and factorises; near the solution the last factors still do. Broyden's
//! rank-one corrections (Broyden 1965; in the form of Kelley, "Iterative Methods for Linear and Nonlinear Equations",
//! 1995, chapter 7) learn from every step how the Jacobian has changed, so that the residuals fall ever faster. Only
//! residuals are evaluated, in `f64`.

use super::residuals::layer_residuals;
use super::speeds::{EdgeSpeeds, Positions};
use super::system::{Change, Reduced, Residuals, System, signed};
use super::unknowns::{Numbering, Side, Unknowns};

/// A step is worth following if it leaves at most this share of the residuals.
const CONTRACTION: f64 = 0.2;
/// Most steps with one Jacobian.
const STEPS: usize = 8;

/// Residuals of all equations at some unknowns.
pub(crate) struct Evaluated {
    blocks: Vec<[f64; 3]>,
    speed: Vec<f64>,
    transition: [f64; 2],
    stagnation: f64,
}

impl Evaluated {
    pub fn new(system: &System, unknowns: &Unknowns) -> Self {
        let layer = system.layer();
        let numbering = layer.numbering;
        let positions = Positions::<f64>::new(system.layout, system.section, unknowns);
        let (blocks, mass) = layer_residuals(&layer, unknowns, &positions.abscissas, &system.gas, layer.gap);
        let (points, wake) = signed(&mass, &numbering);
        let speeds = EdgeSpeeds::new(system.section, system.flow, &positions, &points, &wake);
        let speed = system.speed_residuals(unknowns, &speeds);
        let transition = Side::BOTH.map(|side| system.transition(unknowns, side).re);
        Self { blocks, speed, transition, stagnation: speeds.points[numbering.side] }
    }

    fn all(&self) -> impl Iterator<Item = f64> + '_ {
        let ends = self.transition.into_iter().chain([self.stagnation]);
        self.blocks.as_flattened().iter().chain(&self.speed).copied().chain(ends)
    }

    pub fn norm(&self) -> f64 {
        self.all().map(|r| r * r).sum::<f64>().sqrt()
    }

    pub fn largest(&self) -> f64 {
        // NaN must not be lost in a maximum
        self.all().fold(0.0, |worst: f64, r| if r.is_nan() { f64::NAN } else { worst.max(r.abs()) })
    }

    pub fn residuals(&self) -> Residuals<'_> {
        let Self { blocks, speed, transition, stagnation } = self;
        Residuals { blocks, speed, transition: *transition, stagnation: *stagnation }
    }
}

fn shifted(unknowns: &Unknowns, change: &Change) -> Unknowns {
    let mut next = unknowns.clone();
    for (state, [theta, shape, third, speed]) in next.stations.iter_mut().zip(&change.stations) {
        state.log_theta += theta;
        state.log_shape += shape;
        state.third += third;
        state.log_speed += speed;
    }
    next.stagnation += change.globals[0];
    for (x, step) in next.transition.iter_mut().zip(&change.globals[1..]) {
        *x += step;
    }
    next
}

/// Whether stagnation and transition stand where stations can be laid.
fn sensible(system: &System, unknowns: &Unknowns) -> bool {
    let lengths = [unknowns.stagnation, system.section.map.total - unknowns.stagnation];
    let inside = |at: f64, length: f64| at > 1e-3 * length && at < (1.0 - 1e-5) * length;
    lengths[0] > 0.0 && lengths[1] > 0.0 && (0..2).all(|k| inside(unknowns.transition[k], lengths[k]))
}

/// Follows the step `first` of `reduced` from `unknowns`, where the norm of the residuals was `norm`, as long as every
/// step leaves less than [`CONTRACTION`] of them. `None` where not even the first does.
///
/// Where the residuals came below `tolerance`, one more step is taken without a look at its result.
pub(crate) fn follow(
    system: &System,
    reduced: &Reduced,
    unknowns: &Unknowns,
    first: &Change,
    norm: f64,
    tolerance: f64,
) -> Option<Unknowns> {
    let mut steps = vec![first.clone()];
    let mut squares = vec![first.dot(first)];
    let mut reached: Option<Unknowns> = None;
    let mut before = norm;
    for _ in 0..STEPS {
        let last = steps.len() - 1;
        let candidate = shifted(reached.as_ref().unwrap_or(unknowns), &steps[last]);
        if !sensible(system, &candidate) {
            break;
        }
        let evaluated = Evaluated::new(system, &candidate);
        let now = evaluated.norm();
        if !(now <= CONTRACTION * before) {
            break;
        }
        let mut next = reduced.solve(&evaluated.residuals());
        for k in 0..last {
            let factor = steps[k].dot(&next) / squares[k];
            next.add(&steps[k + 1], factor);
        }
        let along = steps[last].dot(&next) / squares[last];
        next.stretch(1.0 / (1.0 - along));
        if !next.is_finite() {
            break;
        }
        let largest = evaluated.largest();
        // what the next step will leave, by the contraction so far and ten times that
        if largest <= tolerance || 10.0 * largest * (now / before) <= tolerance {
            return Some(shifted(&candidate, &next));
        }
        before = now;
        reached = Some(candidate);
        squares.push(next.dot(&next));
        steps.push(next);
    }
    reached
}

impl System<'_> {
    /// Edge-speed residual of every station.
    pub(super) fn speed_residuals<S: super::speeds::Global>(
        &self,
        unknowns: &Unknowns,
        speeds: &EdgeSpeeds<S>,
    ) -> Vec<f64> {
        let numbering = Numbering::new(self.layout);
        (0..numbering.stations())
            .map(|k| {
                let speed = unknowns.stations[k].log_speed.exp();
                match numbering.on_side(k) {
                    Some((side, j)) => speed - side.sign() * speeds.points[numbering.point(side, j)].re(),
                    None => speed - speeds.wake[k - numbering.wake_start()].re(),
                }
            })
            .collect()
    }
}
