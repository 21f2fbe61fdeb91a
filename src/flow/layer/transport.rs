//! States as functions of the place, for the moves of the stations.
//!
//! The stations stand at fixed fractions between stagnation point, transition and trailing edge, so that a step of
//! those moves all stations. Newton's step carries the states along to first order. This module adds the rest, so that
//! a long step of transition moves the stations through the layer in place of moving the layer.

use super::layout::Layout;
use super::side::Side;
use super::station::State;
use super::unknowns::{Numbering, Unknowns};
use crate::flow::surface::SurfaceMap;

/// The states of both sides as functions of the logarithm of the distance from the stagnation point: cubic Hermite
/// pieces, one function for the laminar layer and one for the turbulent one.
#[derive(Debug, Clone)]
pub(crate) struct Profiles {
    numbering: Numbering,
    /// Arc lengths from the stagnation point to transition on the upper and lower side, in chords.
    transition: [f64; 2],
    /// Logarithms of the distances of the stations from the stagnation point, per side.
    log_x: [Vec<f64>; 2],
    /// States of the stations of both sides.
    values: Vec<State>,
    /// Derivatives of the states with respect to the logarithm of the distance.
    slopes: Vec<State>,
}

/// The state of a layer at a distance from the stagnation point whose logarithm differs by `away` from that of a station.
/// `state` is the state of that station, `slope` its derivative with respect to the logarithm of the distance.
///
/// At the stagnation point θ, the shape and the ratio of speed to distance are regular functions of the distance.
fn similar(state: &State, slope: &State, away: f64) -> State {
    let regular = State { log_speed: slope.log_speed - 1.0, ..*slope };
    let state = state.step(&regular, away.exp_m1());
    State { log_speed: state.log_speed + away, ..state }
}

/// Derivative of the state at the first station with respect to the logarithm of the distance, such that [`similar`] gives
/// the state of the second station; `away` is the difference of the logarithms of their distances.
fn similar_slope(first: &State, second: &State, away: f64) -> State {
    let change = second.step(first, -1.0);
    let regular = State { log_speed: change.log_speed - away, ..change }.map(|v| v / away.exp_m1());
    State { log_speed: regular.log_speed + 1.0, ..regular }
}

/// Logarithms of the distances of the stations from the stagnation point, per side.
fn logs(layout: &Layout, unknowns: &Unknowns, surface: &SurfaceMap) -> [Vec<f64>; 2] {
    Side::BOTH.map(|side| unknowns.abscissas(layout, side, surface).into_iter().map(f64::ln).collect())
}

impl Profiles {
    pub fn new(layout: &Layout, unknowns: &Unknowns, surface: &SurfaceMap) -> Self {
        let numbering = Numbering::new(layout);
        let log_x = logs(layout, unknowns, surface);
        let values = unknowns.stations[..numbering.wake_start()].to_vec();
        let mut slopes = vec![State::zeros(); values.len()];
        for side in Side::BOTH {
            let x = &log_x[side.index()];
            for range in [0..numbering.laminar, numbering.laminar..numbering.side] {
                for j in range.clone() {
                    let at = |j: usize| values[numbering.station(side, j)];
                    let slope = |a: usize, b: usize| at(b).zip(&at(a), |q, p| (q - p) / (x[b] - x[a]));
                    slopes[numbering.station(side, j)] = if j == 0 {
                        similar_slope(&at(0), &at(1), x[1] - x[0])
                    } else if j == range.start {
                        slope(j, j + 1)
                    } else if j + 1 == range.end {
                        slope(j - 1, j)
                    } else {
                        let (left, right) = (slope(j - 1, j), slope(j, j + 1));
                        let w = (x[j] - x[j - 1]) / (x[j + 1] - x[j - 1]);
                        left.zip(&right, |left, right| left + (right - left) * w)
                    };
                }
            }
        }
        Self { numbering, transition: unknowns.transition, log_x, values, slopes }
    }

    /// The change of the state at a fixed place, to first order, when the state of station `k` takes a change and the
    /// station moves by `log_step` in the logarithm of the distance.
    pub fn material(&self, k: usize, change: &State, log_step: f64) -> State {
        change.step(&self.slopes[k], -log_step)
    }

    /// The state at a distance from the stagnation point, given by the logarithm, in the laminar or the turbulent
    /// layer. Towards the stagnation point the state goes on as in a similar layer. Beyond the other ends of a layer it goes
    /// on in a straight line, but not far.
    fn find(&self, side: Side, laminar: bool, log_x: f64) -> State {
        let n = &self.numbering;
        let range = if laminar { 0..n.laminar } else { n.laminar..n.side };
        let x = &self.log_x[side.index()];
        if log_x <= x[range.start] || log_x >= x[range.end - 1] {
            let low = log_x <= x[range.start];
            let (end, inner) = if low { (range.start, range.start + 1) } else { (range.end - 1, range.end - 2) };
            let (k, away) = (n.station(side, end), log_x - x[end]);
            if low && laminar {
                return similar(&self.values[k], &self.slopes[k], away);
            }
            let width = (x[inner] - x[end]).abs();
            return self.values[k].step(&self.slopes[k], width * (away / width).tanh());
        }
        let b = range.start + x[range.clone()].partition_point(|v| *v < log_x).max(1);
        let a = b - 1;
        let h = x[b] - x[a];
        let (t, s) = ((log_x - x[a]) / h, (x[b] - log_x) / h);
        let (ka, kb) = (n.station(side, a), n.station(side, b));
        let values =
            self.values[ka].zip(&self.values[kb], |a, b| a * s * s * (1.0 + 2.0 * t) + b * t * t * (3.0 - 2.0 * t));
        values.step(&self.slopes[ka].zip(&self.slopes[kb], |a, b| a * s - b * t), h * t * s)
    }

    /// Distance that the laminar stations of a side move on the way to those of `next`, in the logarithm of the
    /// distance from the stagnation point. It is one number, because they stand at fixed fractions of the way to
    /// transition.
    fn shift(&self, side: Side, next: &Unknowns) -> f64 {
        (next.transition[side.index()] / self.transition[side.index()]).ln()
    }

    /// The laminar states of a side at the places where the stations stand after a shift, with the numbers of the
    /// stations.
    fn found(&self, side: Side, shift: f64) -> impl Iterator<Item = (usize, State)> + '_ {
        let log_x = self.log_x[side.index()][..self.numbering.laminar].iter();
        let found = move |(j, x): (usize, &f64)| (self.numbering.station(side, j), self.find(side, true, x + shift));
        log_x.enumerate().map(found)
    }

    /// Puts the stations of `next`, whose transition points have moved, back into the layer. The laminar layer stays
    /// where it is, the turbulent one moves with transition.
    pub fn place(&self, next: &mut Unknowns) {
        for side in Side::BOTH {
            for (k, state) in self.found(side, self.shift(side, next)) {
                next.stations[k] = state;
            }
        }
    }

    /// Adds to `next`, whose states have made their Newton step, the part of the moves of the stations beyond first
    /// order.
    pub fn carry(&self, next: &mut Unknowns) {
        for side in Side::BOTH {
            let shift = self.shift(side, next);
            for (k, found) in self.found(side, shift) {
                // the linear part, in the change of the abscissa, is in Newton's step
                let beyond = found.step(&self.values[k], -1.0).step(&self.slopes[k], -shift.exp_m1());
                next.stations[k] = next.stations[k].step(&beyond, 1.0);
            }
        }
    }
}

/// The unknowns of a layer on the stations of another layout.
pub(crate) fn resample(from: &Layout, to: &Layout, unknowns: &Unknowns, surface: &SurfaceMap) -> Unknowns {
    let new = Numbering::new(to);
    let profiles = Profiles::new(from, unknowns, surface);
    let places = logs(to, unknowns, surface);
    let mut stations = Vec::with_capacity(new.stations());
    for side in Side::BOTH {
        for (j, log_x) in places[side.index()].iter().enumerate() {
            stations.push(profiles.find(side, j < new.laminar, *log_x));
        }
    }
    stations.extend_from_slice(&unknowns.stations[profiles.numbering.wake_start()..]);
    Unknowns { stations, ..unknowns.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A surface of length 2 with even nodes.
    fn surface() -> SurfaceMap {
        SurfaceMap::new(&(0..81).map(|i| 0.025 * f64::from(i)).collect::<Vec<_>>()).unwrap()
    }

    fn unknowns(layout: &Layout, transition: f64, field: impl Fn(f64) -> State) -> Unknowns {
        let mut stations = Vec::new();
        for side in Side::BOTH {
            for x in layout.abscissas(&surface(), side, [1.0, transition]) {
                stations.push(field(x.ln()));
            }
        }
        Unknowns { stations, stagnation: 1.0, transition: [transition; 2] }
    }

    #[test]
    fn moving_the_stations_leaves_the_layer_where_it_is() {
        let layout = Layout::new(40, 30, 0);
        let field =
            |l: f64| State { log_theta: 0.5 * l - 7.0, log_shape: 0.1 * l * l, third: (2.0 * l).sin(), log_speed: l };
        let start = unknowns(&layout, 0.4, field);
        let profiles = Profiles::new(&layout, &start, &surface());
        let mut next = start.clone();
        next.transition = [0.3; 2];
        // the linear part is in Newton's step
        let log_x = logs(&layout, &next, &surface());
        for side in Side::BOTH {
            for j in 0..layout.laminar.len() {
                let k = profiles.numbering.station(side, j);
                let moved = (log_x[side.index()][j] - profiles.log_x[side.index()][j]).exp_m1();
                next.stations[k] = next.stations[k].step(&profiles.slopes[k], moved);
            }
        }
        profiles.carry(&mut next);
        let wanted = unknowns(&layout, 0.3, field);
        // the first stations come from before the old first one; the turbulent layer moves with transition
        for j in 4..layout.laminar.len() {
            let (found, wanted) = (next.stations[j], wanted.stations[j]);
            let away = found.zip(&wanted, |a, b| (a - b).abs()).numbers();
            assert!(away.iter().all(|d| *d < 3e-3), "station {j}: {found:?} {wanted:?}");
        }
        let turbulent = layout.laminar.len()..layout.side();
        assert_eq!(next.stations[turbulent.clone()], start.stations[turbulent]);
    }
}
