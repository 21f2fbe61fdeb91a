//! Where a run was heading when it was ended.

use super::engineering::engineering;

/// Digits of objectives in sentences.
const DIGITS: usize = 5;

/// How far a point is from the first-order conditions, in a sentence.
pub(super) fn standing(residual: f64, violation: f64) -> String {
    format!(" KKT residual {residual:.1e}, largest violation {violation:.1e}.")
}

/// The designs of a run that were the best when they were found.
#[derive(Debug, Default)]
pub(super) struct Trend {
    /// Number of the evaluation, objective and largest violation of a constraint.
    best: Vec<(usize, f64, f64)>,
}

impl Trend {
    /// Notes the best design so far.
    pub fn note(&mut self, evaluation: usize, objective: f64, violation: f64) {
        self.best.push((evaluation, objective, violation));
    }

    /// A sentence on what the second half of `evaluations` gained; violations up to `feasibility` count as none.
    pub fn words(&self, evaluations: usize, feasibility: f64) -> String {
        let Some(&(at, objective, violation)) = self.best.last() else { return String::new() };
        let half = evaluations / 2;
        let Some(&(_, from, infeasible)) = self.best.iter().rev().find(|(k, ..)| *k <= half.max(1)) else {
            return String::new();
        };
        if at <= half.max(1) {
            return format!(" Nothing was gained since evaluation {at}.");
        }
        let mut gains = Vec::new();
        if infeasible > feasibility {
            let now = if violation > feasibility { format!("{violation:.1e}") } else { "none".into() };
            gains.push(format!("the largest violation went from {infeasible:.1e} to {now}"));
        }
        let [before, after] = [from, objective].map(|v| engineering(v, DIGITS));
        let change = if from == 0.0 { String::new() } else { percentage((objective - from) / from.abs()) };
        gains.push(format!("the objective from {before} to {after}{change}"));
        if gains.len() == 1 {
            gains[0] = gains[0].replace("the objective from", "the objective went from");
        }
        format!(" In the second half of the evaluations {}.", gains.join(", "))
    }
}

/// A relative change in brackets.
fn percentage(share: f64) -> String {
    let sign = if share > 0.0 { "+" } else { "" };
    format!(" ({sign}{} %)", engineering(100.0 * share, 2))
}

#[cfg(test)]
mod tests {
    use super::Trend;

    fn trend(best: &[(usize, f64, f64)]) -> Trend {
        Trend { best: best.to_vec() }
    }

    #[test]
    fn the_second_half_is_told() {
        let falling = trend(&[(1, 4.0, 0.0), (5, 2.0, 0.0), (9, 1.0, 0.0)]);
        let words = " In the second half of the evaluations the objective went from 2 to 1 (-50 %).";
        assert_eq!(falling.words(10, 1e-9), words);
        assert_eq!(trend(&[(1, 4.0, 0.0), (3, 2.0, 0.0)]).words(10, 1e-9), " Nothing was gained since evaluation 3.");
        let nearing = trend(&[(2, 1.0, 0.5), (8, 1.5, 1e-12)]);
        let words = " In the second half of the evaluations the largest violation went from 5.0e-1 to none, \
                     the objective from 1 to 1.5 (+50 %).";
        assert_eq!(nearing.words(10, 1e-9), words);
        assert_eq!(trend(&[]).words(10, 1e-9), "");
    }
}
