//! How much the residuals of the layer change where every interval between stations is halved.

use super::edge::EdgeLaw;
use super::equations::{EQUATIONS, Interval, Layer, turned};
use super::interval::Span;
use super::side::Side;
use super::station::{Derived, Regime, State};
use super::unknowns::Unknowns;

/// Stations in a row within one regime.
struct Run {
    regime: Regime,
    /// Number of the residual of the interval that ends at the second station of the run.
    first: usize,
    states: Vec<State>,
    /// Logarithms of the abscissas of the stations.
    log_x: Vec<f64>,
    /// Dead-air gaps at the stations; zero on walls.
    gap: Vec<f64>,
}

impl Run {
    /// A run along a wall.
    fn on_wall(regime: Regime, first: usize, states: Vec<State>, x: &[f64]) -> Self {
        let gap = vec![0.0; states.len()];
        Self { regime, first, states, log_x: x.iter().map(|x| x.ln()).collect(), gap }
    }

    /// Residuals of the interval from station `j − 1` to station `j` in two halves, less those of the whole.
    fn excess<L: EdgeLaw<Number = f64>>(&self, j: usize, law: &L) -> [f64; EQUATIONS] {
        let weights = halfway(j, self.states.len());
        let mean = |value: &dyn Fn(usize) -> f64| weights.iter().map(|&(i, w)| w * value(i)).sum::<f64>();
        let state = State::from_fn(|k| mean(&|i| self.states[i].numbers()[k]));
        let ends = [j - 1, j].map(|i| (self.states[i], self.log_x[i].exp(), self.gap[i]));
        let middle = (state, mean(&|i| self.log_x[i]).exp(), mean(&|i| self.gap[i]));
        let residual = |from: (State, f64, f64), to: (State, f64, f64)| {
            let [a, b] = [from, to].map(|(state, ..)| Derived::new(state, self.regime, law));
            let span = Span { x: [from.1, to.1], gap: [from.2, to.2] };
            Interval { from: &a, span, regime: self.regime }.residual(&b, law)
        };
        let [front, back, whole] = [residual(ends[0], middle), residual(middle, ends[1]), residual(ends[0], ends[1])];
        std::array::from_fn(|k| front[k] + back[k] - whole[k])
    }
}

/// Stations with weights that interpolate halfway between the stations `j − 1` and `j` of `count`, by a cubic over the
/// numbers of the stations where there are as many, and straight otherwise.
fn halfway(j: usize, count: usize) -> Vec<(usize, f64)> {
    if count < 4 {
        return vec![(j - 1, 0.5), (j, 0.5)];
    }
    let (start, weights) = match j {
        1 => (0, [5.0, 15.0, -5.0, 1.0]),
        _ if j == count - 1 => (count - 4, [1.0, -5.0, 15.0, 5.0]),
        _ => (j - 2, [-1.0, 9.0, 9.0, -1.0]),
    };
    weights.iter().enumerate().map(|(i, w)| (start + i, w / 16.0)).collect()
}

impl<L: EdgeLaw<Number = f64>> Layer<'_, L> {
    /// Change of the residuals of all stations where every interval is cut in two, with a station in between that is
    /// interpolated from its neighbours of one regime. `abscissas` are the distances of the stations from the stagnation
    /// point on both sides.
    pub fn halved(&self, unknowns: &Unknowns, abscissas: &[Vec<f64>; 2]) -> Vec<[f64; EQUATIONS]> {
        let mut change = vec![[0.0; EQUATIONS]; unknowns.stations.len()];
        for run in self.runs(unknowns, abscissas) {
            for j in 1..run.states.len() {
                change[run.first + j - 1] = run.excess(j, &self.law);
            }
        }
        change
    }

    fn runs(&self, unknowns: &Unknowns, abscissas: &[Vec<f64>; 2]) -> Vec<Run> {
        let numbering = self.numbering();
        let mut runs = Vec::with_capacity(5);
        for side in Side::BOTH {
            let x = &abscissas[side.index()];
            let at = |j: usize| numbering.station(side, j);
            let laminar = numbering.laminar;
            runs.push(Run::on_wall(
                Regime::Laminar,
                at(1),
                unknowns.stations[at(0)..at(laminar)].to_vec(),
                &x[..laminar],
            ));
            let mut states = vec![turned(unknowns.stations[at(laminar - 1)], &self.law).state];
            states.extend_from_slice(&unknowns.stations[at(laminar)..at(numbering.side)]);
            runs.push(Run::on_wall(Regime::Turbulent, at(laminar), states, &x[laminar - 1..]));
        }
        let start = numbering.wake_start();
        runs.push(Run {
            regime: Regime::Wake,
            first: start + 1,
            states: unknowns.stations[start..].to_vec(),
            log_x: (0..numbering.wake).map(|i| self.wake_abscissa(i).ln()).collect(),
            gap: self.gap.to_vec(),
        });
        runs
    }
}
