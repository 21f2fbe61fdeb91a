//! Multipliers of all equations, with which they add up to the derivatives of the outputs.
//!
//! The exact derivatives are kept term by term. Factors of a system close to the exact one, those of the last step of
//! Newton's method, are corrected with them: every correction lowers what the multipliers leave of their equations as far as
//! all corrections of all outputs together can. What the factors miss is about the same for all outputs, such as the move of
//! a shock, so that the corrections of one serve the others.

use super::band::Band;
use super::local::{Lanes, Local, Slots, add};
use super::moves::Moves;
use super::numbering::GLOBALS;
use super::outputs::OUTPUTS;
use super::rows::{Combination, LIST, Multiples, Products};
use super::strips::{Source, Strip, put_strips};
use crate::flow::linear::{Factors, add_scaled};
use crate::flow::memory::Recycled;
use nalgebra::DMatrix;

// lists of one number for every output are as wide as the products of matrices take them
const _: () = assert!(OUTPUTS == LIST);

/// Residual of multipliers that is aimed at, and the largest one, over that of none. It leaves derivatives off by no more than
/// such a share of their size, which is as good as the flow to which they belong.
const TOLERANCE: [f64; 2] = [5e-10, 1e-9];
/// Largest number of further corrections that are expected to be enough; new factors cost as much.
const EXPECTED: f64 = 5.0;
/// Number of corrections before that is judged.
const TRIED: usize = 3;
/// Number of times that the residual is evaluated anew and corrected further, where the corrections have lost digits, and the
/// largest one with which that is tried. Corrections that are nearly those before keep few digits of the right angle.
const RENEWALS: (usize, f64) = (2, 1e-6);
/// Square of the sine of the angle to other corrections below which one adds nothing to them.
const NEW: f64 = 1e-10;

/// Multipliers of all equations, and the derivatives of the outputs with respect to all that the terms read, at the
/// multipliers.
pub(super) struct Adjoint {
    /// Weights of all equations, their negative multipliers, and behind them those of the outputs.
    pub weights: Recycled<Lanes>,
    pub sums: Recycled<Lanes>,
}

/// A table with a number for every two lanes.
type Table = [Lanes; OUTPUTS];

/// A correction of the weights for every lane, and what they change of the residuals.
struct Corrections {
    changes: Recycled<Lanes>,
    effects: Recycled<Lanes>,
}

/// The weights of all equations with which nothing is left of the derivatives of the outputs with respect to the unknowns.
/// `band` is factorised near the flow whose derivatives are `local`. The global unknown `held` stands alone in its
/// equation. The result is `None` where the weights do not become as good as they have to be.
pub(super) fn adjoint(band: &Band, local: &Local, moves: &Moves, held: usize) -> Option<Adjoint> {
    let mut weights = local.output_weights();
    let mut residual = local.by_unknowns(moves, &local.weighed_outputs());
    let norms = products(&residual, &residual);
    let mut known: Vec<Corrections> = Vec::new();
    for _ in 0..=RENEWALS.0 {
        let mut left = f64::INFINITY;
        let mut tried = 0;
        while !is_small(&residual, &norms, TOLERANCE[0]) {
            let before = std::mem::replace(&mut left, share_left(&residual, &norms));
            let further = (TOLERANCE[0] / left).ln() / (left / before).ln();
            // written so that NaN ends it
            if tried >= TRIED && !(left < before && further <= EXPECTED) {
                break;
            }
            let mut changes = local.no_weights();
            band.multipliers(&residual, held, &local.slots, &mut changes)?;
            let effects = local.by_unknowns(moves, &local.weighed(&changes));
            let mut own = Corrections { changes, effects };
            own.orthogonalise(&known);
            own.apply(&mut residual, &mut weights);
            known.push(own);
            tried += 1;
        }
        // what the corrections are believed to have left has lost digits on the way
        let sums = local.weighed(&weights);
        residual = local.by_unknowns(moves, &sums);
        if is_small(&residual, &norms, TOLERANCE[1]) {
            return Some(Adjoint { weights, sums });
        }
        if !(share_left(&residual, &norms) < RENEWALS.1) {
            break;
        }
        known.iter().for_each(|own| own.apply(&mut residual, &mut weights));
    }
    None
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

impl Corrections {
    /// Adds the shares to the weights that leave as little as they can of the residual, which becomes what they leave.
    fn apply(&self, residual: &mut [Lanes], weights: &mut [Lanes]) {
        let shares = table(&self.effects, residual);
        subtract_shares(residual, &shares, &self.effects);
        subtract_shares(weights, &shares, &self.changes);
    }

    /// Makes the effects of unit length and upright on each other and on those of other corrections. A lane that adds nothing
    /// to the others becomes none. Lanes that are nearly parallel lose digits of the right angle, which costs no more than
    /// some of what the corrections could do.
    fn orthogonalise(&mut self, others: &[Self]) {
        for other in others {
            let shares = table(&other.effects, &self.effects);
            subtract_shares(&mut self.effects, &shares, &other.effects);
            subtract_shares(&mut self.changes, &shares, &other.changes);
        }
        let shares = upright(&table(&self.effects, &self.effects));
        replace(&mut self.effects, &shares);
        replace(&mut self.changes, &shares);
    }
}

/// The shares of lanes in others that are of unit length and upright on each other, from the products of the lanes: the
/// inverse of Cholesky's factor, with nothing in the columns of lanes that add nothing to those before.
fn upright(products: &Table) -> Table {
    let mut shares = [[0.0; OUTPUTS]; OUTPUTS];
    for lane in 0..OUTPUTS {
        // the lane less its parts along those before, which are upright already
        let mut own = [0.0; OUTPUTS];
        own[lane] = 1.0;
        for before in 0..lane {
            let along: f64 = (0..=before).map(|k| shares[k][before] * products[k][lane]).sum();
            for k in 0..=before {
                own[k] -= along * shares[k][before];
            }
        }
        let square: f64 = (0..=lane).map(|j| own[j] * (0..=lane).map(|k| products[j][k] * own[k]).sum::<f64>()).sum();
        // written so that nothing and NaN add nothing
        if square > NEW * products[lane][lane] {
            let scale = square.sqrt().recip();
            (0..=lane).for_each(|k| shares[k][lane] = scale * own[k]);
        }
    }
    shares
}

/// Scalar products of all lanes of one list with all lanes of another.
fn table(one: &[Lanes], other: &[Lanes]) -> Table {
    Products(one.as_flattened(), other.as_flattened()).sums()
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

/// Subtracts shares of all lanes of a list from every lane.
fn subtract_shares(lanes: &mut [Lanes], shares: &Table, list: &[Lanes]) {
    let factors = Multiples::Apart(list.as_flattened(), OUTPUTS, OUTPUTS);
    subtract(lanes.as_flattened_mut(), factors, shares.as_flattened());
}

/// Puts shares of all lanes in the place of every lane.
fn replace(list: &mut [Lanes], shares: &Table) {
    for item in list {
        let mut lanes = [0.0; OUTPUTS];
        item.iter().zip(shares).for_each(|(value, shares)| add(&mut lanes, *value, shares));
        *item = lanes;
    }
}

/// Lists of numbers for every row of every block, those along the tubes last, and for the global ones.
type Lists = Vec<Vec<f64>>;

impl Band {
    /// Writes the multipliers with which all equations add up to given rows, which hold a list for every unknown, by the
    /// factors. The global unknown `held` stands alone in its equation, whatever the equation was before. `None` where there
    /// are no such multipliers.
    pub fn multipliers(&self, rows: &[Lanes], held: usize, slots: &Slots, multipliers: &mut [Lanes]) -> Option<()> {
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
            let of = |column: usize, count: usize| Multiples::Apart(&block.next[column..], layout.next_stride(), count);
            subtract(&mut own[0], of(layout.border(), GLOBALS), &felt);
            if let Some(before) = before.last() {
                subtract(&mut own[0], of(0, layout.ahead + block.put_off()), before);
            }
        }
        self.by_stations(&stations, &globals, slots, multipliers);
        Some(())
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
    fn by_stations(&self, stations: &Lists, globals: &[f64], slots: &Slots, lists: &mut [Lanes]) {
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
    }
}

/// Subtracts combinations of lists from other lists.
fn subtract(rows: &mut [f64], factors: Multiples, source: &[f64]) {
    let (stride, columns) = (OUTPUTS, 0..OUTPUTS);
    Combination { rows, stride, factors, columns, source, source_stride: stride, source_from: 0 }.subtract();
}
