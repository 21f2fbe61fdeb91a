//! The direct dependences of the coefficients against forward sweeps.

use super::{direct, drag, lowest_pressure, panel_count, suction_peaks};
use crate::flow::coefficients::{COEFFICIENTS, Coefficients};
use crate::flow::layer::{Derived, Regime, Side, State};
use crate::flow::panel::compressibility::{KarmanTsien, PanelEdge, panel_loads};
use crate::flow::panel::outputs::Direct;
use crate::flow::panel::solved::Solved;
use crate::flow::panel::testing::{Direction, Forward, assert_same, cambered_flows, moving, moving_along, wave};
use crate::flow::surface::spline::combine;
use num_dual::DualNum;

/// Everything that moves a coefficient: the inputs, the strengths at the nodes, the last station and the places of all points.
struct Motion<'a> {
    solved: &'a Solved<'a>,
    inputs: Direction,
    k: usize,
}

impl Motion<'_> {
    fn mach(&self) -> Forward {
        moving(self.solved.stream.mach, self.inputs.mach)
    }

    fn strengths(&self) -> Vec<Forward> {
        moving_along(self.k, self.solved.strengths)
    }

    fn state_rate(&self) -> State {
        State::from_fn(|i| wave(self.k + 1, i))
    }

    fn loads(&self) -> [Forward; 2] {
        let section = self.solved.system.section;
        let nodes = self.inputs.moved(&section.panels.outline.nodes);
        let alpha = moving(self.solved.system.flow.alpha, self.inputs.alpha);
        let correction = KarmanTsien::new(self.mach());
        let cp: Vec<Forward> = self.strengths().iter().map(|speed| correction.pressure(*speed)).collect();
        let mut sums = [Forward::from(0.0); 2];
        for j in 0..panel_count(section) {
            let next = (j + 1) % nodes.len();
            let loads = panel_loads([nodes[j], nodes[next]], [cp[j], cp[next]], [alpha.cos(), alpha.sin()]);
            sums = [sums[0] + loads[0], sums[1] + loads[1]];
        }
        sums
    }

    /// The pressure where the speed is highest, with the places of both suction peaks moving too.
    fn lowest_pressure(&self) -> Forward {
        let spline = &self.solved.system.section.map.spline;
        let c = spline.coefficients(&self.strengths());
        let peaks = suction_peaks(self.solved.system.section, self.solved.strengths);
        let speeds = [0, 1].map(|side| combine(&spline.weights(moving(peaks[side].0, wave(self.k, 200 + side))), &c));
        lowest_pressure(&KarmanTsien::new(self.mach()), speeds)
    }

    fn drag(&self) -> Forward {
        let reynolds = moving(self.solved.stream.reynolds, self.inputs.reynolds);
        let end = self.solved.unknowns.stations[self.solved.at.derived.len() - 1];
        let state = end.zip(&self.state_rate(), moving);
        drag(&Derived::new(state, Regime::Wake, &PanelEdge::new(self.mach(), reynolds)))
    }

    fn transition(&self, side: Side) -> Forward {
        let numbering = self.solved.at.numbering;
        let point = numbering.point(side, numbering.laminar - 1);
        let spline = &self.solved.system.section.map.spline;
        let x: Vec<Forward> = self.inputs.moved(self.solved.nodes).iter().map(|node| node[0]).collect();
        let index = moving(self.solved.at.positions.index[point].re, wave(self.k, point));
        combine(&spline.weights(index), &spline.coefficients(&x))
    }

    fn coefficients(&self) -> [Forward; COEFFICIENTS] {
        let [cl, cm] = self.loads();
        let [upper, lower] = Side::BOTH.map(|side| self.transition(side));
        [cl, self.drag(), cm, self.lowest_pressure(), upper, lower]
    }

    /// Direct derivatives times the rates, and the sum of the magnitudes of these terms.
    fn contracted(&self, direct: &Direct) -> [f64; 2] {
        let inputs = &self.inputs;
        let mut terms = vec![direct.alpha * inputs.alpha, direct.mach * inputs.mach, direct.reynolds * inputs.reynolds];
        for by_nodes in [&direct.panels, &direct.given] {
            let pairs = by_nodes.as_flattened().iter().zip(inputs.nodes.as_flattened());
            terms.extend(pairs.map(|(by, rate)| by * rate));
        }
        terms.extend(direct.strengths.iter().zip(self.strengths()).map(|(by, strength)| by * strength.v1));
        terms.extend(direct.index.iter().map(|(point, slope)| slope * wave(self.k, *point)));
        let last = direct.unknowns.stations.len() - 1;
        terms.extend(direct.unknowns.stations[last].zip(&self.state_rate(), |by, rate| by * rate).numbers());
        assert!(direct.unknowns.stations[..last].iter().all(|state| *state == State::zeros()));
        assert_eq!(direct.unknowns.globals(), [0.0; 3]);
        [terms.iter().sum(), terms.iter().map(|term| term.abs()).sum()]
    }
}

#[test]
fn direct_derivatives_are_those_of_the_formulas_of_all_coefficients() {
    for record in cambered_flows() {
        let solved = record.solved();
        let direct = direct(&solved);
        let outline = &solved.system.section.panels.outline;
        for k in 0..3 {
            let motion = Motion { solved: &solved, inputs: Direction::new(k, outline), k };
            let values =
                super::values((&solved.system, solved.stream.mach), &solved.at.state(), solved.strengths, solved.nodes)
                    .to_array();
            for (o, (direct, forward)) in direct.iter().zip(motion.coefficients()).enumerate() {
                let name = Coefficients::<()>::NAMES[o];
                assert!((forward.re - values[o]).abs() < 1e-13, "{name}: {} for {}", forward.re, values[o]);
                let [sum, scale] = motion.contracted(direct);
                assert_same(name, sum, forward.v1, scale);
            }
        }
    }
}
