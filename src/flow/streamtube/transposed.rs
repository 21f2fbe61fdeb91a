//! Multipliers of all equations, with which they add up to the derivatives of the outputs.
//!
//! The exact derivatives are kept term by term. Factors of a system close to the exact one, those of the last step of
//! Newton's method, are corrected with them: every correction lowers what the multipliers leave of their equations as far as
//! all corrections together can, output by output.

use super::band::Band;
use super::local::{Lanes, Local, Slots};
use super::moves::Moves;
use super::numbering::GLOBALS;
use super::outputs::OUTPUTS;
use super::rows::{Combination, Multiples, padded};
use super::strips::{Source, Strip, put_strips};
use crate::flow::linear::{Factors, add_scaled};
use nalgebra::DMatrix;

// lists of one number for every output are as wide as the products of matrices take them
const _: () = assert!(OUTPUTS == padded(OUTPUTS));

/// Residual of multipliers that is aimed at, and the largest one, over that of none.
const TOLERANCE: [f64; 2] = [1e-10, 1e-9];
/// Largest number of further corrections that are expected to be enough; new factors cost as much.
const EXPECTED: f64 = 5.0;
/// Number of corrections before that is judged.
const TRIED: usize = 3;

/// Multipliers of all equations, and the derivatives of the outputs with respect to all that the terms read, at the
/// multipliers.
pub(super) struct Adjoint {
    /// Weights of all equations: their negative multipliers.
    pub weights: Vec<Lanes>,
    pub sums: Vec<Lanes>,
}

/// A correction of the weights, and what it changes of the residuals.
struct Correction {
    change: Vec<Lanes>,
    effect: Vec<Lanes>,
}

/// The weights of all equations with which nothing is left of the derivatives of the outputs with respect to the unknowns.
/// `band` is factorised near the flow whose derivatives are `local`. The global unknown `held` stands alone in its
/// equation. The result is `None` where the weights do not become as good as they have to be.
pub(super) fn adjoint(band: &Band, local: &Local, moves: &Moves, held: usize) -> Option<Adjoint> {
    let mut weights = vec![[0.0; OUTPUTS]; local.slots.unknowns()];
    let mut sums = local.weighed(&weights, true);
    let mut residual = local.by_unknowns(moves, &sums);
    let norms = products(&residual, &residual);
    let mut corrections: Vec<Correction> = Vec::new();
    let mut left = f64::INFINITY;
    while !is_small(&residual, &norms, TOLERANCE[0]) {
        let before = std::mem::replace(&mut left, share_left(&residual, &norms));
        let further = (TOLERANCE[0] / left).ln() / (left / before).ln();
        // written so that NaN ends it
        if corrections.len() >= TRIED && !(left < before && further <= EXPECTED) {
            break;
        }
        let change = band.multipliers(&residual, held, &local.slots)?;
        let effect = local.by_unknowns(moves, &local.weighed(&change, false));
        let mut own = Correction { change, effect };
        own.orthogonalise(&corrections);
        let share = products(&residual, &own.effect).map(|s| -s);
        combine(&mut residual, share, &own.effect);
        combine(&mut weights, share, &own.change);
        corrections.push(own);
    }
    // what the corrections are believed to have left may have lost digits on the way
    sums = local.weighed(&weights, true);
    is_small(&local.by_unknowns(moves, &sums), &norms, TOLERANCE[1]).then_some(Adjoint { weights, sums })
}

/// The largest residual over that of none.
fn share_left(residual: &[Lanes], norms: &Lanes) -> f64 {
    let shares = products(residual, residual).into_iter().zip(norms).filter(|(_, norm)| **norm > 0.0);
    shares
        .map(|(left, norm)| left / norm)
        .fold(0.0f64, |worst, share| if share <= worst { worst } else { share })
        .sqrt()
}

fn is_small(residual: &[Lanes], norms: &Lanes, tolerance: f64) -> bool {
    // written so that NaN is not
    products(residual, residual).iter().zip(norms).all(|(left, norm)| *left <= tolerance * tolerance * norm)
}

impl Correction {
    /// Makes the effect one of unit length that stands upright on those of other corrections.
    fn orthogonalise(&mut self, others: &[Self]) {
        for other in others {
            let share = products(&self.effect, &other.effect).map(|s| -s);
            combine(&mut self.effect, share, &other.effect);
            combine(&mut self.change, share, &other.change);
        }
        // an output that needs no correction has none
        let scale = products(&self.effect, &self.effect).map(|s| if s == 0.0 { 0.0 } else { s.sqrt().recip() });
        for lanes in self.effect.iter_mut().chain(&mut self.change) {
            lanes.iter_mut().zip(scale).for_each(|(lane, scale)| *lane *= scale);
        }
    }
}

/// Scalar products of lists, lane by lane.
fn products(one: &[Lanes], other: &[Lanes]) -> Lanes {
    let mut sums = [0.0; OUTPUTS];
    for (one, other) in one.iter().zip(other) {
        for (sum, (a, b)) in sums.iter_mut().zip(one.iter().zip(other)) {
            *sum += a * b;
        }
    }
    sums
}

/// Adds a list times a factor for every lane.
fn combine(sums: &mut [Lanes], factors: Lanes, list: &[Lanes]) {
    for (sum, list) in sums.iter_mut().zip(list) {
        for (sum, (factor, value)) in sum.iter_mut().zip(factors.iter().zip(list)) {
            *sum += factor * value;
        }
    }
}

/// Lists of numbers for every row of every block, those along the tubes last, and for the global ones.
type Lists = Vec<Vec<f64>>;

impl Band {
    /// The multipliers with which all equations add up to given rows, which hold a list for every unknown, by the factors.
    /// The global unknown `held` stands alone in its equation, whatever the equation was before.
    pub fn multipliers(&self, rows: &[Lanes], held: usize, slots: &Slots) -> Option<Vec<Lanes>> {
        let (mut stations, mut globals) = self.by_blocks(rows, slots);
        let lower = self.solve_downstream(&mut stations);
        let first = &self.blocks[0];
        let layout = first.layout;
        add_scaled(&mut globals, 1.0, &lower[layout.globals() * OUTPUTS..][..GLOBALS * OUTPUTS]);
        let of_globals = &first.lower[layout.globals() * layout.lower_stride()..];
        let factors = Multiples::Apart(of_globals, layout.lower_stride(), layout.kept + first.taken);
        subtract(&mut globals, factors, &stations[0]);
        let mut schur = self.closing.clone();
        schur.column_mut(held).fill(0.0);
        schur[(held, held)] = 1.0;
        let mut solved = DMatrix::from_row_slice(GLOBALS, OUTPUTS, &globals);
        Factors::new(&schur)?.solve(&mut solved);
        globals.copy_from_slice(solved.transpose().as_slice());
        let mut felt = globals.clone();
        felt[held * OUTPUTS..][..OUTPUTS].fill(0.0);
        for (i, block) in self.blocks.iter().enumerate() {
            let layout = block.layout;
            let (before, own) = stations.split_at_mut(i);
            let of = |column: usize, count: usize| Multiples::Apart(&block.rows[column..], layout.stride(), count);
            subtract(&mut own[0], of(layout.border(), GLOBALS), &felt);
            if let Some(before) = before.last() {
                subtract(&mut own[0], of(layout.next(), layout.ahead + block.put_off()), before);
            }
        }
        Some(self.by_stations(&stations, &globals, slots))
    }

    /// Solves with the parts of the stations from the wake upstream. The result is what has become of the rows of unknowns
    /// that belong to no station.
    fn solve_downstream(&self, lists: &mut Lists) -> Vec<f64> {
        let (mut left, mut lower) = (Vec::new(), Vec::new());
        for (i, block) in self.blocks.iter().enumerate().rev() {
            let (upstream, done) = lists.split_at_mut(i + 1);
            let own = &mut upstream[i];
            let mut own_lower = vec![0.0; block.layout.lower_rows() * OUTPUTS];
            if let (Some(behind), Some(solved)) = (self.blocks.get(i + 1), done.first()) {
                own[block.layout.kept * OUTPUTS..][..left.len()].copy_from_slice(&left);
                let [source, known] = [solved, &lower].map(|rows| Source { rows, stride: OUTPUTS, from: 0 });
                let strip = |rows| Strip { rows, stride: OUTPUTS, columns: 0..OUTPUTS };
                put_strips(behind, block.layout, [strip(own), strip(&mut own_lower)], source, Some(known));
            }
            left = block.solve_lists(own, OUTPUTS);
            lower = own_lower;
        }
        lower
    }

    /// Lists for the rows of all blocks and for the global unknowns, from those in the order of the unknowns.
    fn by_blocks(&self, lists: &[Lanes], slots: &Slots) -> (Lists, Vec<f64>) {
        let block = |i: usize| {
            let layout = self.blocks[i].layout;
            let mut own = vec![0.0; layout.size() * OUTPUTS];
            own[..layout.kept * OUTPUTS].copy_from_slice(lists[slots.station(i)][..layout.kept].as_flattened());
            if i > 0 {
                let speeds = &lists[slots.station(i - 1)][self.kept[i - 1]..];
                own[layout.tube(0) * OUTPUTS..].copy_from_slice(speeds.as_flattened());
            }
            own
        };
        ((0..self.blocks.len()).map(block).collect(), lists[slots.globals()].as_flattened().to_vec())
    }

    /// Lists in the order of the equations of the stations.
    fn by_stations(&self, stations: &Lists, globals: &[f64], slots: &Slots) -> Vec<Lanes> {
        let mut lists = vec![[0.0; OUTPUTS]; slots.unknowns()];
        for (i, own) in stations.iter().enumerate() {
            let layout = self.blocks[i].layout;
            let kept = &mut lists[slots.station(i)][..layout.kept];
            kept.as_flattened_mut().copy_from_slice(&own[..layout.kept * OUTPUTS]);
            if i > 0 {
                let speeds = &mut lists[slots.station(i - 1)][self.kept[i - 1]..];
                speeds.as_flattened_mut().copy_from_slice(&own[layout.tube(0) * OUTPUTS..]);
            }
        }
        lists[slots.globals()].as_flattened_mut().copy_from_slice(globals);
        lists
    }
}

/// Subtracts combinations of lists from other lists.
fn subtract(rows: &mut [f64], factors: Multiples, source: &[f64]) {
    let (stride, columns) = (OUTPUTS, 0..OUTPUTS);
    Combination { rows, stride, factors, columns, source, source_stride: stride, source_from: 0 }.subtract();
}
