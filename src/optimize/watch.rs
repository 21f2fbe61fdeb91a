//! The progress of a run under constraints, and when there is none left.

use super::kkt::Iterate;
use super::ledger::Ledger;

/// Why a run ends at a point.
pub(super) enum Ending {
    Optimal,
    OutOfIterations,
    Stalled,
}

/// Progress of a run: the points so far that no other beats in both violation and objective.
///
/// A design that lowers the objective while it gives up a little of a constraint is on its way as much as one that
/// meets the constraints better.
pub(super) struct Watch {
    /// Largest violation that counts as none.
    feasibility: f64,
    /// Iterations without progress after which the run has stalled.
    patience: usize,
    /// Violation and objective of points that no other beats in both.
    frontier: Vec<(f64, f64)>,
    /// Least violation so far, and the least residual at a point that had no more.
    least: (f64, f64),
    /// Iteration of the last gain.
    gained_at: usize,
}

impl Watch {
    pub fn new(feasibility: f64, patience: usize) -> Self {
        let least = (f64::INFINITY, f64::INFINITY);
        Self { feasibility, patience, frontier: Vec::new(), least, gained_at: 0 }
    }

    /// Forgets all points, at the beginning of an iteration.
    pub fn begin_again(&mut self, iteration: usize) {
        *self = Self { gained_at: iteration, ..Self::new(self.feasibility, self.patience) };
    }

    /// Iteration of the last gain.
    pub fn gained_at(&self) -> usize {
        self.gained_at
    }

    /// Whether a point gains on all before it, by more than round-off.
    fn gains(&mut self, violation: f64, objective: f64, residual: f64) -> bool {
        let beaten = |&(v, f): &(f64, f64)| violation >= 0.99 * v && objective >= f - 1e-9 * f.abs();
        let advances = !self.frontier.iter().any(beaten);
        if advances {
            self.frontier.retain(|&(v, f)| violation > v || objective > f);
            self.frontier.push((violation, objective));
        }
        let flatter = violation <= self.least.0 && residual < 0.9 * self.least.1;
        if violation <= self.least.0 {
            self.least = (violation, self.least.1.min(residual));
        }
        advances || flatter
    }

    /// Whether the run ends at `point`, where a KKT residual of `optimality` is wanted.
    pub fn judge(&mut self, ledger: &Ledger<'_>, point: &Iterate, optimality: f64) -> Option<Ending> {
        let residual = point.optimality.residual;
        let excess = if point.violation <= self.feasibility { 0.0 } else { point.violation };
        if excess == 0.0 && residual <= optimality {
            return Some(Ending::Optimal);
        }
        if self.gains(excess, point.evaluation.objective, residual) {
            self.gained_at = ledger.iteration;
        }
        if ledger.out_of_iterations() {
            return Some(Ending::OutOfIterations);
        }
        (ledger.iteration >= self.gained_at + self.patience).then_some(Ending::Stalled)
    }
}

#[cfg(test)]
mod tests {
    use super::Watch;

    #[test]
    fn a_point_gains_that_none_before_beats_in_both() {
        let mut watch = Watch::new(1e-9, 10);
        assert!(watch.gains(1.0, 5.0, 1.0));
        // lower at the price of a constraint, and nearer to it at the price of the objective
        assert!(watch.gains(2.0, 4.0, 1.0) && watch.gains(0.5, 6.0, 1.0));
        assert!(!watch.gains(2.0, 4.5, 1.0) && !watch.gains(0.5, 6.0, 1.0));
        // a flatter point counts where the constraints are met as well as ever
        assert!(watch.gains(0.5, 6.0, 0.5) && !watch.gains(1.0, 5.0, 0.1));
        // one that beats all
        assert!(watch.gains(0.0, 1.0, 1.0));
        assert!(!watch.gains(0.0, 1.0 - 1e-12, 1.0));
    }
}
