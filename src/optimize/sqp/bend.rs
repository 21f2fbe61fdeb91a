//! Steps bent onto the constraints that are known without an evaluation.
//!
//! Gradients of constraints lead a long step astray where constraints are curved, as those are that keep a box from
//! folding. A constraint that costs next to nothing ([`Problem::known_constraints`]) is followed to the end of the step
//! before anything is evaluated there, and where it would spoil the step, the step is bent back onto it by the shortest
//! way. The prediction stays that of the straight step: the model of the Lagrangian has the curvature of the constraints
//! in it, and with that counts what it costs to follow them.

use super::proposal::Proposal;
use super::quadratic::ElasticProgram;
use super::rows::beyond;
use super::state::SqpRun;
use crate::design::Problem;
use nalgebra::{DMatrix, DVector};

/// Ways back to the constraints at most.
const TURNS: usize = 8;
/// Sum of the shortfalls, beyond those of the straight step, that is close enough.
const CLOSE: f64 = 1e-6;
/// Loss of the merit function to the curvature of known constraints, over the gain that the step promises, above which
/// it is bent. Bending steps with a smaller loss costs evaluations: early in a run the way past the constraints is the
/// shorter one.
const SPOILT: f64 = 2.0;
/// Price of a shortfall on the way back, over the squared length of one natural step.
const PRICE: f64 = 1e3;

/// The rows where a step ends: the known ones as they are there, the others as their gradients tell.
struct Foreseen {
    x: Vec<f64>,
    values: Vec<f64>,
    matrix: DMatrix<f64>,
    /// Largest shortfall of a known row, in its own unit.
    farthest: f64,
}

impl Foreseen {
    fn at(problem: &mut dyn Problem, run: &SqpRun, straight: &[f64], step: &DVector<f64>) -> Option<Self> {
        let x = run.frame.moved(&run.point.x, step);
        let known = problem.known_constraints(&x)?;
        let mut foreseen = Self { x, values: straight.to_vec(), matrix: run.row_matrix(), farthest: 0.0 };
        for (i, row) in run.rows.iter().enumerate() {
            if let Some((value, gradient)) = &known[row.side.constraint] {
                foreseen.values[i] = row.side.of(*value) - row.margin;
                foreseen.farthest = foreseen.farthest.max(beyond(row, *value));
                foreseen.matrix.set_row(i, &(run.frame.gradient(gradient) * row.side.factor).transpose());
            }
        }
        Some(foreseen)
    }

    /// Whether the run would refuse the step for the known constraints alone.
    fn spoils(&self, run: &SqpRun, proposal: &Proposal) -> bool {
        let loss = run.charged(&self.values) - run.charged(&proposal.linear);
        self.farthest > run.reach || loss > SPOILT * proposal.predicted
    }

    /// Shortfall of every row beyond the shortfall that the straight step leaves it with.
    fn lacking(&self, straight: &[f64]) -> Vec<f64> {
        straight.iter().zip(&self.values).map(|(straight, v)| straight.min(0.0) - v).collect()
    }

    /// The shortest way, in the metric, to where the rows lack nothing as their gradients tell.
    fn way_back(&self, run: &SqpRun, needed: &[f64]) -> Option<DVector<f64>> {
        let (lower, upper) = run.frame.room(&self.x, run.radius);
        let program = ElasticProgram {
            gradient: &vec![0.0; lower.len()],
            hessian: &run.metric,
            rows: &self.matrix,
            needed,
            penalties: &vec![PRICE; needed.len()],
            lower: &lower,
            upper: &upper,
        };
        Some(program.solve()?.d)
    }
}

/// Bends a step where the constraints that are known without an evaluation would spoil it.
pub(super) fn bend(problem: &mut dyn Problem, run: &SqpRun, proposal: &mut Proposal) {
    let mut step = proposal.step.clone();
    let mut least = f64::INFINITY;
    for turn in 0..=TURNS {
        let Some(end) = Foreseen::at(problem, run, &proposal.linear, &step) else { return };
        if turn == 0 && !end.spoils(run, proposal) {
            return;
        }
        let lacking = end.lacking(&proposal.linear);
        let sum: f64 = lacking.iter().map(|l| l.max(0.0)).sum();
        if sum < least {
            proposal.step.copy_from(&step);
            least = sum;
        }
        // onto them, or away from them
        if sum <= CLOSE || sum > 2.0 * least {
            return;
        }
        let Some(way) = end.way_back(run, &lacking) else { return };
        step += way;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::differentiate::VectorFunction;
    use crate::optimize::ledger::Ledger;
    use crate::optimize::sqp::{Sqp, begin};
    use crate::optimize::testcases::{Constrained, run};
    use crate::optimize::{Limits, Progress, Termination};
    use crate::scalar::Scalar;
    use std::convert::Infallible;
    use std::ops::ControlFlow;

    /// `−x` with two constraints: the height over the curve `y = bend x² + x⁴`, and `x + y`.
    #[derive(Clone)]
    struct Hill {
        bend: f64,
    }

    impl VectorFunction for Hill {
        type Error = Infallible;
        fn evaluate<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, Infallible> {
            let height = x[0] * x[0] * self.bend + x[0].powi(4);
            Ok(vec![-x[0] + x[1].squared() * 0.05, x[1] - height, x[0] + x[1]])
        }
    }

    fn hill(bend: f64) -> Constrained<Hill> {
        Constrained::new(Hill { bend }, &[0.0, 0.0], &[(0.0, 0.0), (-5.0, 5.0)])
    }

    /// The end of the first step before and after it is bent, and how much of it was evaluated.
    fn first_step(mut problem: Constrained<Hill>) -> (Vec<f64>, Vec<f64>, usize) {
        let mut observer = |_: &Progress<'_>| ControlFlow::Continue(());
        let mut ledger = Ledger::new(&mut problem, &mut observer, Limits::default());
        let Ok(mut run) = begin(&mut ledger, &Sqp::default()) else { panic!("no start") };
        let mut proposal = run.propose().unwrap();
        let straight = run.frame.moved(&run.point.x, &proposal.step);
        bend(&mut ledger, &run, &mut proposal);
        let bent = run.frame.moved(&run.point.x, &proposal.step);
        drop(ledger);
        (straight, bent, problem.asked.len() - 1)
    }

    #[test]
    fn a_step_that_known_constraints_spoil_ends_on_them_and_costs_nothing() {
        let off = |x: &[f64]| (x[1] - 3.0 * x[0] * x[0] - x[0].powi(4)).abs();
        let (straight, bent, evaluated) = first_step(hill(3.0).knowing(|k| k == 0));
        assert!(off(&straight) > 1.0 && off(&bent) < 1e-4, "{straight:?} {bent:?}");
        assert_eq!(evaluated, 0);
        // what takes an evaluation is left to it, as is what spoils nothing
        let (straight, bent, _) = first_step(hill(3.0).knowing(|k| k == 1));
        assert_eq!(straight, bent);
        let (straight, bent, _) = first_step(hill(0.0).knowing(|k| k == 1));
        assert_eq!(straight, bent);
    }

    #[test]
    fn constraints_that_are_known_in_advance_save_evaluations_and_lead_to_the_same_optimum() {
        let [plain, known] = [|_| false, |k| k == 0].map(|known: fn(usize) -> bool| {
            let outcome = run(&Sqp::default(), &mut hill(3.0).knowing(known));
            assert_eq!(outcome.status, Termination::Converged, "{}", outcome.message);
            outcome
        });
        assert!(known.x.iter().zip(&plain.x).all(|(a, b)| (a - b).abs() < 1e-4), "{:?} {:?}", known.x, plain.x);
        assert!(known.evaluations < plain.evaluations, "{} {}", known.evaluations, plain.evaluations);
    }
}
