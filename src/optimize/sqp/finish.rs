//! The shortest way onto the constraints, at the end of a run.

use super::rows::Row;
use super::state::SqpRun;
use crate::design::Problem;
use crate::optimize::constraint_row::ConstraintRow;
use crate::optimize::kkt::Iterate;
use crate::optimize::ledger::Ledger;
use nalgebra::{DMatrix, DVector};

/// Steps onto the constraints at most where a run ends without convergence.
const STEPS: usize = 5;

/// The shortest step onto the constraints; whether it led there.
pub(super) fn restore(ledger: &mut Ledger<'_>, run: &mut SqpRun) -> bool {
    let n = run.frame.size();
    if n == 0 {
        return false;
    }
    run.rows.iter_mut().for_each(|row| row.margin = 0.0);
    let (matrix, values) = (run.row_matrix(), run.values(&run.point.evaluation));
    let step = run.solve_for(&matrix, &values, 1.0, &DVector::zeros(n), &DMatrix::identity(n, n));
    let Some(step) = step else { return false };
    let x = run.frame.moved(&run.point.x, &step.d);
    let Ok(evaluation) = ledger.evaluate(&x) else { return false };
    let next = Iterate::new(ledger, &x, evaluation);
    let nearer = next.violation < 0.5 * run.point.violation || next.violation <= 1e-12;
    if nearer {
        run.point = next;
    }
    nearer
}

/// The point that a run without convergence hands out: where it stands brought onto the constraints, unless an earlier
/// one is better.
pub(super) fn retreat(ledger: &mut Ledger<'_>, run: &mut SqpRun, feasibility: f64) -> Iterate {
    for _ in 0..STEPS {
        if run.point.violation <= feasibility || !restore(ledger, run) {
            break;
        }
    }
    ledger.handed_out(&run.point)
}

/// The shortest step that brings the constraints that hold onto their bounds, if the point stays optimal there.
pub(super) fn settle(ledger: &mut Ledger<'_>, run: &mut SqpRun, optimality: f64, feasibility: f64) {
    let before = (run.point.clone(), run.rows.clone());
    let both = |row: &Row| {
        let side = row.side;
        let holds = run.point.optimality.multipliers[side.constraint] * side.factor > 0.0;
        let other = Row { side: ConstraintRow { factor: -side.factor, ..side }, ..row.clone() };
        std::iter::once(row.clone()).chain(holds.then_some(other))
    };
    run.rows = run.rows.iter().flat_map(both).collect();
    let settled = restore(ledger, run)
        && run.point.violation <= feasibility
        && run.point.optimality.residual <= optimality * ledger.unit(&run.point.evaluation);
    run.rows = before.1;
    if !settled {
        run.point = before.0;
    }
    ledger.settle_on(&run.point.x, &run.point.evaluation);
}
