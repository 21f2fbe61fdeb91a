//! The transposed system: multipliers of all equations for rows that depend on all unknowns.
//!
//! Elimination leaves in every block what the multipliers of its equations are for given multipliers upstream. What the
//! multipliers leave of the transposed equations is checked; where round-off has taken too much they are corrected, and where
//! that does not help there are none.

use super::band::Band;
use super::block::Block;
use super::dense::PUT_OFF;
use super::numbering::GLOBALS;
use super::rows::{Combination, Entry, Multiples, padded, subtract_row};
use crate::flow::linear::Factors;
use nalgebra::DMatrix;

/// Largest residual of multipliers, over that of none.
const TOLERANCE: f64 = 1e-9;
/// Largest number of corrections.
const CORRECTIONS: usize = 2;

/// Lists of `width` numbers for every equation of every block, those along the tubes last, and for the global equations.
type Lists = Vec<Vec<f64>>;

/// Multipliers of the equations of all stations and of the global ones; a column for every further row.
#[derive(Debug, Clone)]
pub(super) struct Multipliers {
    pub stations: Vec<DMatrix<f64>>,
    pub globals: DMatrix<f64>,
}

/// The coefficients of all unknowns before elimination has overwritten them.
struct Kept {
    rows: Vec<Vec<f64>>,
    lower: Vec<Vec<f64>>,
}

/// Multipliers of all equations for every further row: the solutions of the transposed system whose right-hand sides are
/// the derivatives of these rows. The system is factorised. The global unknown `held` stands alone in its equation, whatever
/// the equation was before. The result is `None` where the system is singular, or so nearly that the multipliers do not fulfil
/// their equations.
pub(super) fn multipliers(band: &mut Band, held: usize) -> Option<Multipliers> {
    let kept = Kept {
        rows: band.blocks.iter().map(|block| block.rows.clone()).collect(),
        lower: band.blocks.iter().map(|block| block.lower.clone()).collect(),
    };
    if !band.factorise_all() {
        return None;
    }
    let width = padded(band.corner.ncols() - GLOBALS);
    let mut solution = solved(band, held, width)?;
    let (mut residual, norms) = {
        let right = right_hand_sides(band, &kept, width);
        let norms = squares(&right, width);
        (right, norms)
    };
    subtract_product(band, &kept, held, &solution, &mut residual, width);
    for _ in 0..CORRECTIONS {
        if is_small(&residual, &norms, width) {
            break;
        }
        restore(band, &kept, &residual, width);
        if !band.factorise_all() {
            return None;
        }
        let change = solved(band, held, width)?;
        subtract_product(band, &kept, held, &change, &mut residual, width);
        for (own, change) in solution.iter_mut().flatten().zip(change.iter().flatten()) {
            *own += change;
        }
    }
    if !is_small(&residual, &norms, width) {
        return None;
    }
    Some(by_station(band, &solution, width))
}

/// Sums of squares of all lists.
fn squares(lists: &Lists, width: usize) -> Vec<f64> {
    let mut sums = vec![0.0; width];
    for list in lists.iter().flat_map(|lists| lists.chunks(width)) {
        sums.iter_mut().zip(list).for_each(|(sum, value)| *sum += value * value);
    }
    sums
}

fn is_small(residual: &Lists, norms: &[f64], width: usize) -> bool {
    // written so that NaN is not
    squares(residual, width).iter().zip(norms).all(|(own, norm)| *own <= TOLERANCE * TOLERANCE * norm)
}

/// The derivatives of the further rows: a list for every unknown.
fn right_hand_sides(band: &Band, kept: &Kept, width: usize) -> Lists {
    let further = band.corner.ncols() - GLOBALS;
    let of_block = |(block, rows): (&Block, &Vec<f64>)| {
        let layout = block.layout;
        let mut list = vec![0.0; layout.size() * width];
        for (list, row) in list.chunks_mut(width).zip(rows.chunks(layout.stride())) {
            list[..further].copy_from_slice(&row[layout.border() + GLOBALS..][..further]);
        }
        list
    };
    let mut lists: Lists = band.blocks.iter().zip(&kept.rows).map(of_block).collect();
    let mut globals = vec![0.0; GLOBALS * width];
    for (g, list) in globals.chunks_mut(width).enumerate() {
        (0..further).for_each(|k| list[k] = band.corner[(g, GLOBALS + k)]);
    }
    lists.push(globals);
    lists
}

/// Brings the coefficients back, with other derivatives of the further rows.
fn restore(band: &mut Band, kept: &Kept, right: &Lists, width: usize) {
    let further = band.corner.ncols() - GLOBALS;
    for (i, block) in band.blocks.iter_mut().enumerate() {
        let layout = block.layout;
        block.rows.copy_from_slice(&kept.rows[i]);
        block.lower.copy_from_slice(&kept.lower[i]);
        for (row, list) in block.rows.chunks_mut(layout.stride()).zip(right[i].chunks(width)) {
            row[layout.border() + GLOBALS..][..further].copy_from_slice(&list[..further]);
        }
    }
    for (g, list) in right[band.blocks.len()].chunks(width).enumerate() {
        (0..further).for_each(|k| band.corner[(g, GLOBALS + k)] = list[k]);
    }
}

/// The multipliers by the factors, with the derivatives of the further rows that were factorised.
fn solved(band: &Band, held: usize, width: usize) -> Option<Lists> {
    let further = band.corner.ncols() - GLOBALS;
    let mut schur = band.closing.columns(0, GLOBALS).into_owned();
    schur.column_mut(held).fill(0.0);
    schur[(held, held)] = 1.0;
    let mut globals = band.closing.columns(GLOBALS, further).into_owned();
    Factors::new(&schur)?.solve(&mut globals);
    let mut of_globals = vec![0.0; GLOBALS * width];
    for (g, list) in of_globals.chunks_mut(width).enumerate() {
        (0..further).for_each(|k| list[k] = globals[(g, k)]);
    }
    let mut felt = of_globals.clone();
    felt[held * width..][..width].fill(0.0);
    let mut lists: Lists = Vec::with_capacity(band.blocks.len() + 1);
    for block in &band.blocks {
        let layout = block.layout;
        let (stride, border) = (layout.stride(), layout.border());
        let mut own = vec![0.0; layout.size() * width];
        for (list, row) in own.chunks_mut(width).zip(block.rows.chunks(stride)) {
            list[..further].copy_from_slice(&row[border + GLOBALS..][..further]);
        }
        subtract(&mut own, (&block.rows[border..], stride, GLOBALS), &felt, width);
        if let Some(before) = lists.last() {
            subtract(&mut own, (&block.rows[layout.next()..], stride, layout.ahead + PUT_OFF), before, width);
        }
        lists.push(own);
    }
    lists.push(of_globals);
    Some(lists)
}

/// Subtracts combinations of lists from other lists, with the first numbers of rows as factors.
fn subtract(lists: &mut [f64], (rows, stride, count): (&[f64], usize, usize), source: &[f64], width: usize) {
    let product = Combination {
        rows: lists,
        stride: width,
        factors: Multiples::Apart(rows, stride, count),
        columns: 0..width,
        source,
        source_stride: width,
        source_from: 0,
    };
    product.subtract();
}

/// Subtracts what multipliers make of the equations from lists for all unknowns.
fn subtract_product(band: &Band, kept: &Kept, held: usize, lists: &Lists, from: &mut Lists, width: usize) {
    let count = band.blocks.len();
    let globals = &lists[count];
    let mut felt = globals.clone();
    felt[held * width..][..width].fill(0.0);
    for (i, block) in band.blocks.iter().enumerate() {
        let layout = block.layout;
        let (stride, rows) = (layout.stride(), &kept.rows[i]);
        let own = &lists[i];
        subtract(&mut from[i], (rows, stride, layout.kept), own, width);
        if i > 0 {
            subtract(&mut from[i], (&rows[layout.next()..], stride, layout.ahead), &lists[i - 1], width);
        }
        subtract(&mut from[i], (&rows[layout.border()..], stride, GLOBALS), &felt, width);
        let (others, tubes) = own.split_at(layout.tube(0) * width);
        subtract_of_tubes(band, i, tubes, from, width);
        let lower = (layout.lower_stride(), layout.kept);
        if i > 0 {
            let upstream = &mut from[i - 1][..layout.ahead * width];
            subtract(upstream, (&kept.lower[i], lower.0, lower.1), others, width);
        }
        let first = &kept.lower[i][layout.globals() * lower.0..];
        subtract(&mut from[count], (first, lower.0, lower.1), others, width);
        subtract(&mut from[count], (&block.by_globals, layout.tubes, layout.tubes), tubes, width);
    }
    for g in 0..GLOBALS {
        let multipliers = &globals[g * width..][..width];
        for c in 0..GLOBALS {
            let alone = f64::from(u8::from(c == g));
            let factor = if g == held { alone } else { band.corner[(c, g)] };
            subtract_row(&mut from[count][c * width..][..width], factor, multipliers);
        }
    }
}

/// Subtracts what the multipliers of the equations along the tubes of a block make of them.
fn subtract_of_tubes(band: &Band, i: usize, tubes: &[f64], from: &mut Lists, width: usize) {
    let block = &band.blocks[i];
    let multipliers = |tube: usize| &tubes[tube * width..][..width];
    let few = |entries: &[Entry], to: &mut [f64]| {
        for entry in entries {
            let row = &mut to[entry.row as usize * width..][..width];
            subtract_row(row, entry.value, multipliers(entry.column as usize));
        }
    };
    few(&block.by_tube, &mut from[i]);
    for (k, entries) in block.upstream.iter().enumerate().take(i) {
        few(entries, &mut from[i - 1 - k]);
    }
    for (k, factors) in [&block.diagonal].into_iter().chain(&block.speeds).enumerate().take(i) {
        let first = band.blocks[i - k].layout.tube(0) * width;
        for (tube, row) in from[i - k][first..].chunks_mut(width).enumerate() {
            subtract_row(row, factors[tube], multipliers(tube));
        }
    }
}

/// The multipliers in the order of the equations of the stations.
fn by_station(band: &Band, lists: &Lists, width: usize) -> Multipliers {
    let further = band.corner.ncols() - GLOBALS;
    let matrix =
        |list: &[f64]| DMatrix::from_row_slice(list.len() / width, width, list).columns(0, further).into_owned();
    let count = band.blocks.len();
    let station = |i: usize| {
        let mut own = lists[i][..band.kept[i] * width].to_vec();
        if i + 1 < count {
            own.extend_from_slice(&lists[i + 1][band.blocks[i + 1].layout.tube(0) * width..]);
        }
        matrix(&own)
    };
    Multipliers { stations: (0..count).map(station).collect(), globals: matrix(&lists[count]) }
}
