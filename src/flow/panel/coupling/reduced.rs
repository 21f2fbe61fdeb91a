//! A linearised system, reduced to about one unknown per station and factorised: Newton steps, tangents, adjoints.

use super::eliminate::Elimination;
use super::response::{Onset, SectionResponse};
use super::system::{Evaluated, Linearised, Residuals, System};
use crate::flow::layer::equations::{BY_AMPLIFICATION, BY_TRIP};
use crate::flow::layer::{Change, EQUATIONS, GLOBAL_UNKNOWNS, Layer, Side, State, Unknowns};
use crate::flow::linear::Factors;
use crate::flow::panel::compressibility::PanelEdge;
use crate::flow::search::Equations;
use nalgebra::{DMatrix, SVector};
use std::f64::consts::FRAC_PI_2;

/// A linearised system, eliminated and factorised.
#[derive(Debug, Clone)]
pub(crate) struct Reduced {
    elimination: Elimination,
    /// Factors of the transpose of the dense matrix.
    factors: Factors,
}

impl Reduced {
    /// Eliminates and factorises; `None` where a block or the dense system is singular or not finite.
    pub fn new(at: &Linearised) -> Option<Self> {
        let elimination = Elimination::new(at)?;
        let factors = Factors::of(elimination.dense_transposed(at))?;
        Some(Self { elimination, factors })
    }

    /// Minus the inverse Jacobian times the change of the residuals when the onset flow changes by `factor` times
    /// `onset`.
    pub fn by_onset(&self, at: &Linearised, section: &SectionResponse, onset: &Onset, factor: f64) -> Change {
        let n = &at.numbering;
        let strength = |p: usize| section.map.spline.value(&onset.inviscid_spline, at.positions.index[p].re);
        let speed: Vec<f64> = (0..n.stations())
            .map(|k| match n.on_side(k) {
                Some((side, j)) => -factor * side.sign() * strength(n.point(side, j)),
                None => -factor * onset.wake_inviscid[k - n.wake_start()],
            })
            .collect();
        self.solve(at, &Residuals { speed, stagnation: factor * strength(n.side), ..Residuals::zeros(n.stations()) })
    }

    /// Minus the inverse Jacobian times the derivative of the residuals with respect to a parameter that moves the
    /// trips; `rates` are the changes of their arc lengths per change of the parameter.
    pub fn by_trips(&self, at: &Linearised, rates: [f64; 2]) -> Change {
        let slope = |side: Side| at.transition[side.index()].eps[BY_TRIP];
        let transition = Side::BOTH.map(|side| slope(side) * rates[side.index()]);
        self.solve(at, &Residuals { transition, ..Residuals::zeros(at.numbering.stations()) })
    }

    /// Minus the inverse Jacobian times residuals.
    pub fn solve(&self, system: &Linearised, residuals: &Residuals) -> Change {
        let n = system.numbering.stations();
        let still = self.elimination.march(&residuals.blocks, &[], [0.0; GLOBAL_UNKNOWNS]);
        let mut dense = vec![0.0; n + GLOBAL_UNKNOWNS];
        for k in 0..n {
            dense[k] = -residuals.speed[k] - self.elimination.speed[k] * still[k][2];
        }
        for side in Side::BOTH {
            let slope = system.transition[side.index()].eps[BY_AMPLIFICATION];
            dense[n + side.index()] =
                -residuals.transition[side.index()] - slope * still[system.numbering.last_laminar(side)][1];
        }
        dense[n + 2] = -residuals.stagnation;
        let dense = self.factors.solve_transposed_vector(dense);
        let globals = [dense[n], dense[n + 1], dense[n + 2]];
        let states = self.elimination.march(&residuals.blocks, &dense[..n], globals);
        let stations = states
            .iter()
            .enumerate()
            .map(|(k, &[log_theta, third, log_speed])| {
                let by = &system.log_mass[k];
                let log_shape = (dense[k] - by.log_theta * log_theta - by.log_speed * log_speed) / by.log_shape;
                State { log_theta, log_shape, third, log_speed }
            })
            .collect();
        Change::new(stations, globals)
    }
}

/// Multipliers λ of all equations, one number per output.
#[derive(Debug, Clone)]
pub(crate) struct Multipliers<const N: usize> {
    /// Multipliers of the boundary-layer equations, station by station.
    pub chain: Vec<[SVector<f64, N>; EQUATIONS]>,
    /// Multipliers of the edge-speed equations, station by station.
    pub speed: Vec<SVector<f64, N>>,
    /// Multipliers of the transition equations of the upper and lower side.
    pub transition: [SVector<f64, N>; 2],
    /// Multipliers of the stagnation equation.
    pub stagnation: SVector<f64, N>,
}

impl Reduced {
    /// Solves the transposed system: multipliers λ with Jᵀ λ = output gradient, for every output.
    pub fn adjoint<const N: usize>(&self, system: &Linearised, outputs: [&Change; N]) -> Multipliers<N> {
        let (states, dense) = self.eliminate(system, outputs);
        let mut columns = DMatrix::from_fn(dense.len(), N, |k, output| dense[k][output]);
        self.factors.solve(&mut columns);
        let dense: Vec<SVector<f64, N>> =
            (0..columns.nrows()).map(|k| SVector::from_fn(|output, _| columns[(k, output)])).collect();
        self.complete(system, states, &dense)
    }

    /// Eliminates the states from the outputs: the sensitivities of the outputs to the states once the dense unknowns
    /// are split off, and the right-hand sides of the dense system.
    fn eliminate<const N: usize>(
        &self,
        system: &Linearised,
        outputs: [&Change; N],
    ) -> (Vec<[SVector<f64, N>; 3]>, Vec<SVector<f64, N>>) {
        let n = system.numbering.stations();
        let lanes = |of: &dyn Fn(&Change) -> f64| SVector::<f64, N>::from_fn(|output, _| of(outputs[output]));
        let (mut states, mut dense) = (Vec::with_capacity(n), Vec::with_capacity(n + GLOBAL_UNKNOWNS));
        for k in 0..n {
            let by = &system.log_mass[k];
            let share = lanes(&|output| output.stations[k].log_shape) / by.log_shape;
            states.push([
                lanes(&|output| output.stations[k].log_theta) - share * by.log_theta,
                lanes(&|output| output.stations[k].third),
                lanes(&|output| output.stations[k].log_speed) - share * by.log_speed,
            ]);
            dense.push(share);
        }
        dense.extend((0..GLOBAL_UNKNOWNS).map(|g| lanes(&|output| output.globals()[g])));
        self.elimination.march_back(&mut states.clone(), &mut dense);
        (states, dense)
    }

    /// Computes the multipliers of all equations from those of the dense equations.
    fn complete<const N: usize>(
        &self,
        system: &Linearised,
        mut states: Vec<[SVector<f64, N>; 3]>,
        dense: &[SVector<f64, N>],
    ) -> Multipliers<N> {
        let n = system.numbering.stations();
        for k in 0..n {
            states[k][2] -= dense[k] * self.elimination.speed[k];
        }
        for side in Side::BOTH {
            let slope = system.transition[side.index()].eps[BY_AMPLIFICATION];
            states[system.numbering.last_laminar(side)][1] -= dense[n + side.index()] * slope;
        }
        Multipliers {
            chain: self.elimination.multipliers(states),
            speed: dense[..n].to_vec(),
            transition: [dense[n], dense[n + 1]],
            stagnation: dense[n + 2],
        }
    }
}

impl Equations for System<'_> {
    type Law = PanelEdge<f64>;
    type Residuals = Residuals;
    type Evaluated = Evaluated;
    type At = Linearised;
    type Factors = Reduced;

    fn layer(&self) -> &Layer<'_, PanelEdge<f64>> {
        &self.layer
    }

    fn march(&self) -> Unknowns {
        self.march()
    }

    fn evaluate(&self, unknowns: &Unknowns) -> Evaluated {
        self.evaluate(unknowns)
    }

    fn residuals_of<'b>(&self, state: &'b Evaluated) -> &'b Residuals {
        &state.residuals
    }

    fn linearise(&self, unknowns: &Unknowns) -> Linearised {
        self.linearise(unknowns)
    }

    fn state_at(&self, at: &Linearised) -> Evaluated {
        at.state()
    }

    fn residuals_at<'b>(&self, at: &'b Linearised) -> &'b Residuals {
        &at.residuals
    }

    fn factorise(&self, at: &Linearised) -> Option<Reduced> {
        Reduced::new(at)
    }

    fn solve(&self, at: &Linearised, factors: &Reduced, residuals: &Residuals) -> Change {
        factors.solve(at, residuals)
    }

    fn by_angle(&self, at: &Linearised, factors: &Reduced) -> Change {
        // the system is linear in the onset flow, whose derivative with respect to the angle is that flow a quarter turn on
        let quarter_turn = self.flow.onset(self.section, self.flow.alpha + FRAC_PI_2);
        factors.by_onset(at, self.section, &quarter_turn, 1.0)
    }

    fn by_trips(&self, at: &Linearised, factors: &Reduced, rates: [f64; 2]) -> Change {
        factors.by_trips(at, rates)
    }
}
