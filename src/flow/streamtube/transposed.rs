//! The transposed system: multipliers of all equations for rows that depend on all unknowns.
//!
//! Factors with pivots inside the blocks of the stations lose digits in large regions of supersonic flow, where a station
//! says more about the next one than about itself. What they lose lies in few directions, and the solution is refined by the
//! method of generalised minimal residuals, with the factors as preconditioner and the equations themselves to multiply
//! with.

use super::band::{Band, supersonic};
use super::block::Block;
use super::numbering::GLOBALS;
use super::rows::{padded, subtract_row, subtract_transposed};
use crate::flow::linear::{Factors, product, subtract_product};
use nalgebra::DMatrix;

/// Residual of refined multipliers, over that of none.
const TOLERANCE: f64 = 1e-9;
/// Largest number of products of a refinement.
const PRODUCTS: usize = 16;

/// Lists of `width` numbers for every equation, or every unknown, of the stations and of the globals in a last part.
type Lists = Vec<Vec<f64>>;

/// Multipliers of the equations of all stations and of the global ones; a column for every further row.
#[derive(Debug, Clone)]
pub(super) struct Multipliers {
    pub stations: Vec<DMatrix<f64>>,
    pub globals: DMatrix<f64>,
}

/// A factorised system, transposed.
struct Transposed<'a> {
    band: &'a Band,
    /// The global unknown that stands alone in its equation.
    held: usize,
    /// Length of the lists.
    width: usize,
    /// Solutions of the stations for the derivatives of the global equations.
    by_globals: Vec<DMatrix<f64>>,
    schur: Factors,
}

/// Multipliers of all equations for every further row: the solutions of the transposed system whose right-hand sides are
/// the derivatives of these rows, after factorisation with the [equations kept](Band::keep_equations). The global unknown
/// `held` stands alone in its equation, whatever the equation was before. The result is `None` where the system is singular.
pub(super) fn multipliers(band: &Band, held: usize) -> Option<Multipliers> {
    let further = band.corner.nrows() - GLOBALS;
    let width = padded(further);
    let system = Transposed::new(band, held, width)?;
    let mut right: Lists = Vec::with_capacity(band.below.len() + 1);
    for rows in band
        .below
        .iter()
        .map(|below| below.columns(GLOBALS, further).into_owned())
        .chain([band.corner.rows(GLOBALS, further).transpose()])
    {
        right.push(listed(&rows, width));
    }
    let lists = system.refined(&right);
    let mut matrices: Vec<DMatrix<f64>> = lists
        .iter()
        .map(|list| DMatrix::from_row_slice(list.len() / width, width, list).columns(0, further).into_owned())
        .collect();
    let globals = matrices.pop()?;
    Some(Multipliers { stations: matrices, globals })
}

/// The rows of a matrix as lists, filled up.
fn listed(rows: &DMatrix<f64>, width: usize) -> Vec<f64> {
    let mut lists = vec![0.0; rows.nrows() * width];
    for (k, column) in rows.column_iter().enumerate() {
        lists.chunks_mut(width).zip(column.iter()).for_each(|(list, value)| list[k] = *value);
    }
    lists
}

impl<'a> Transposed<'a> {
    fn new(band: &'a Band, held: usize, width: usize) -> Option<Self> {
        let rows = |below: &DMatrix<f64>| {
            let mut rows = below.columns(0, GLOBALS).into_owned();
            rows.column_mut(held).fill(0.0);
            listed(&rows, padded(GLOBALS))
        };
        let mut lists: Lists = band.below.iter().map(rows).collect();
        solve_stations(band, &mut lists, padded(GLOBALS));
        let matrix = |list: &Vec<f64>| DMatrix::from_row_slice(list.len() / GLOBALS, GLOBALS, list);
        let by_globals: Vec<DMatrix<f64>> = lists.iter().map(matrix).collect();
        let mut schur = band.corner.rows(0, GLOBALS).transpose();
        schur.column_mut(held).fill(0.0);
        schur[(held, held)] = 1.0;
        for (block, solution) in band.blocks.iter().zip(&by_globals) {
            subtract_product(&mut schur, 0, &border(block), solution);
        }
        Some(Self { band, held, width, by_globals, schur: Factors::new(&schur)? })
    }

    /// The solution by the factors alone.
    fn solve(&self, right: &Lists) -> Lists {
        let width = self.width;
        let mut lists = right.clone();
        let Some(last) = lists.pop() else { return lists };
        solve_stations(self.band, &mut lists, width);
        let mut globals = DMatrix::from_row_slice(GLOBALS, width, &last);
        let rows = |list: &[f64]| DMatrix::from_row_slice(list.len() / width, width, list);
        for (block, solution) in self.band.blocks.iter().zip(&lists) {
            subtract_product(&mut globals, 0, &border(block), &rows(solution));
        }
        self.schur.solve(&mut globals);
        for (list, by_globals) in lists.iter_mut().zip(&self.by_globals) {
            let change = product(by_globals, &globals).transpose();
            list.iter_mut().zip(change.as_slice()).for_each(|(value, change)| *value -= change);
        }
        lists.push(globals.transpose().as_slice().to_vec());
        lists
    }

    /// Subtracts the product of the transposed equations and lists from other lists.
    fn subtract_product(&self, lists: &Lists, from: &mut Lists) {
        let width = self.width;
        let Some((globals, stations)) = lists.split_last() else { return };
        let Some((own_globals, own)) = from.split_last_mut() else { return };
        for (i, (block, list)) in self.band.blocks.iter().zip(stations).enumerate() {
            subtract_equations(block, i, list, own, width);
            for (row, multipliers) in list.chunks(width).enumerate() {
                for g in 0..GLOBALS {
                    let factor = block.by_globals[row * GLOBALS + g];
                    if factor != 0.0 {
                        subtract_row(&mut own_globals[g * width..][..width], factor, multipliers);
                    }
                }
            }
            for g in (0..GLOBALS).filter(|g| *g != self.held) {
                let multipliers = &globals[g * width..][..width];
                for (row, factor) in own[i].chunks_mut(width).zip(self.band.below[i].column(g).iter()) {
                    if *factor != 0.0 {
                        subtract_row(row, *factor, multipliers);
                    }
                }
            }
        }
        for g in 0..GLOBALS {
            let multipliers = &globals[g * width..][..width];
            for c in 0..GLOBALS {
                let alone = f64::from(u8::from(c == g));
                let factor = if g == self.held { alone } else { self.band.corner[(g, c)] };
                subtract_row(&mut own_globals[c * width..][..width], factor, multipliers);
            }
        }
    }

    /// Sums over all rows of products of numbers of two lists, column by column.
    fn dots(&self, a: &Lists, b: &Lists) -> Vec<f64> {
        let mut sums = vec![0.0; self.width];
        for (a, b) in a.iter().zip(b) {
            for (a, b) in a.chunks(self.width).zip(b.chunks(self.width)) {
                for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
                    *sum += a * b;
                }
            }
        }
        sums
    }

    /// Adds factors times lists, column by column.
    fn add(&self, to: &mut Lists, factors: &[f64], lists: &Lists) {
        for (to, list) in to.iter_mut().zip(lists) {
            for (to, list) in to.chunks_mut(self.width).zip(list.chunks(self.width)) {
                for ((to, value), factor) in to.iter_mut().zip(list).zip(factors) {
                    *to += factor * value;
                }
            }
        }
    }

    /// The solution by the factors, refined until its residual is small or nothing more is gained.
    fn refined(&self, right: &Lists) -> Lists {
        let root = |squares: Vec<f64>| squares.into_iter().map(f64::sqrt).collect::<Vec<f64>>();
        let wanted: Vec<f64> = root(self.dots(right, right)).into_iter().map(|norm| TOLERANCE * norm).collect();
        let mut solution = self.solve(right);
        let mut residual = right.clone();
        self.subtract_product(&solution, &mut residual);
        let norms = root(self.dots(&residual, &residual));
        let reached = |norms: &[f64]| norms.iter().zip(&wanted).all(|(norm, wanted)| norm <= wanted);
        if reached(&norms) {
            return solution;
        }
        let unit = |norms: &[f64]| norms.iter().map(|n| if *n > 0.0 { n.recip() } else { 0.0 }).collect::<Vec<f64>>();
        let zeros = || -> Lists { residual.iter().map(|list| vec![0.0; list.len()]).collect() };
        let mut first = zeros();
        self.add(&mut first, &unit(&norms), &residual);
        let (mut basis, mut directions) = (vec![first], Vec::new());
        let mut hessenberg = vec![DMatrix::<f64>::zeros(PRODUCTS + 1, PRODUCTS); self.width];
        let mut weights = Vec::new();
        for k in 0..PRODUCTS {
            let direction = self.solve(&basis[k]);
            // the negative product
            let mut image = zeros();
            self.subtract_product(&direction, &mut image);
            directions.push(direction);
            for (j, other) in basis.iter().enumerate() {
                let dots = self.dots(&image, other);
                hessenberg.iter_mut().zip(&dots).for_each(|(h, dot)| h[(j, k)] = -dot);
                self.add(&mut image, &dots.iter().map(|dot| -dot).collect::<Vec<f64>>(), other);
            }
            let lengths = root(self.dots(&image, &image));
            hessenberg.iter_mut().zip(&lengths).for_each(|(h, length)| h[(k + 1, k)] = -length);
            let (left, found) = least(&hessenberg, &norms, k + 1);
            weights = found;
            if reached(&left) || k + 1 == PRODUCTS {
                break;
            }
            let mut next = zeros();
            self.add(&mut next, &unit(&lengths), &image);
            basis.push(next);
        }
        for (direction, weights) in directions.iter().zip(&weights) {
            self.add(&mut solution, weights, direction);
        }
        solution
    }
}

/// Weights of `count` directions that make the residuals of all columns smallest, direction by direction, and what is left.
fn least(hessenberg: &[DMatrix<f64>], norms: &[f64], count: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    let mut weights = vec![vec![0.0; norms.len()]; count];
    let mut left = vec![0.0; norms.len()];
    for (column, (h, norm)) in hessenberg.iter().zip(norms).enumerate().filter(|(_, (_, norm))| **norm > 0.0) {
        let h = h.view((0, 0), (count + 1, count)).into_owned();
        let mut right = nalgebra::DVector::zeros(count + 1);
        right[0] = *norm;
        let found = h.clone().svd(true, true).solve(&right, 1e-14 * h.amax());
        let found = found.unwrap_or_else(|_| nalgebra::DVector::zeros(count));
        left[column] = (&right - &h * &found).norm();
        weights.iter_mut().zip(found.iter()).for_each(|(weights, value)| weights[column] = *value);
    }
    (left, weights)
}

/// Derivatives of the equations of a block by the global unknowns: a row for each of these.
fn border(block: &Block) -> DMatrix<f64> {
    DMatrix::from_column_slice(GLOBALS, block.layout.size(), &block.by_globals)
}

/// Subtracts the product of the transposed equations of the station `i`, without the globals, and lists from the lists of
/// this station and its neighbours.
fn subtract_equations(block: &Block, i: usize, list: &[f64], own: &mut [Vec<f64>], width: usize) {
    let layout = block.layout;
    for (equations, own) in block.equations.iter().zip(&mut own[i..]) {
        for (row, multipliers) in list.chunks(width).enumerate() {
            for &(column, factor) in equations.row(row) {
                subtract_row(&mut own[column as usize * width..][..width], factor, multipliers);
            }
        }
    }
    let multipliers = |row: usize| &list[row * width..][..width];
    for entry in &block.by_speed {
        let place = (layout.kept + entry.column as usize) * width;
        subtract_row(&mut own[i][place..][..width], entry.value, multipliers(entry.row as usize));
    }
    for entry in &block.first {
        let place = entry.column as usize * width;
        subtract_row(&mut own[i - 1][place..][..width], entry.value, multipliers(entry.row as usize));
    }
    for tube in 0..layout.tubes {
        let multipliers = multipliers(layout.kept + tube);
        subtract_row(&mut own[i][(layout.kept + tube) * width..][..width], block.diagonal[tube], multipliers);
        for (k, values) in block.farther.iter().enumerate().take(i.saturating_sub(1)) {
            let far = &mut own[i - 2 - k];
            // all stations but the last have all speeds behind their other unknowns
            let place = far.len() - (layout.tubes - tube) * width;
            subtract_row(&mut far[place..][..width], values[tube], multipliers);
        }
    }
}

/// Replaces right-hand sides of the stations by the solutions with the transposed factors of these alone.
fn solve_stations(band: &Band, right: &mut [Vec<f64>], width: usize) {
    for i in 1..right.len() {
        let (before, rest) = right.split_at_mut(i);
        subtract_next(&band.blocks[i - 1], &before[i - 1], &mut rest[0], width);
    }
    for i in (0..right.len()).rev() {
        let (upstream, rest) = right.split_at_mut(i);
        band.blocks[i].solve_transposed(&mut rest[0], width);
        subtract_from_upstream(&band.blocks, i, &rest[0], upstream, width);
    }
}

/// Subtracts the transposed solutions of a block times lists from lists of the next station.
fn subtract_next(block: &Block, own: &[f64], next: &mut [f64], width: usize) {
    let range = block.layout.next()..block.layout.next() + block.layout.ahead;
    subtract_transposed(next, (&block.rows, block.layout.stride(), range), own, width);
}

/// Subtracts from the right-hand sides of the stations upstream what the multipliers of a station have to do with them.
fn subtract_from_upstream(blocks: &[Block], i: usize, own: &[f64], upstream: &mut [Vec<f64>], width: usize) {
    let block = &blocks[i];
    let Some((before, upstream)) = upstream.split_last_mut() else { return };
    for (row, multipliers) in own.chunks(width).enumerate() {
        for &(column, factor) in block.factors.first.row(row) {
            subtract_row(&mut before[column as usize * width..][..width], factor, multipliers);
        }
    }
    let tubes = supersonic(block);
    let Some((last, upstream)) = upstream.split_last_mut().filter(|_| !tubes.is_empty()) else { return };
    // what the equations have to do with all unknowns of the second station upstream
    let two = &blocks[i - 2];
    let mut by_two = vec![0.0; two.layout.size() * width];
    for tube in tubes {
        let multipliers = &own[(block.layout.kept + tube) * width..][..width];
        let [second, third] = [0, 1].map(|k| block.farther[k][tube]);
        subtract_row(&mut by_two[(two.layout.kept + tube) * width..][..width], -second, multipliers);
        let Some(far) = upstream.last_mut() else { continue };
        let three = &blocks[i - 3];
        subtract_row(&mut far[(three.layout.kept + tube) * width..][..width], third, multipliers);
        let next = &three.row(three.layout.kept + tube)[three.layout.next()..];
        for (row, factor) in by_two.chunks_mut(width).take(two.layout.kept).zip(next) {
            subtract_row(row, third * factor, multipliers);
        }
    }
    last.iter_mut().zip(&by_two).for_each(|(value, by)| *value -= by);
    by_two.iter_mut().for_each(|value| *value = -*value);
    subtract_next(two, &by_two, before, width);
}
