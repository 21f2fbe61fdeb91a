//! The elimination of block-banded systems against dense factors, with the multipliers of the transposed system.

use super::band::{Band, Columns};
use super::grading::{Size, Stations};
use super::local::Slots;
use super::numbering::{GLOBALS, Grid, Place};
use super::outputs::OUTPUTS;
use nalgebra::{DMatrix, DVector};

#[test]
fn small_systems_are_solved_as_dense_ones() {
    let size = Size { wall: 8, ahead: 3, behind: 3, tubes: 3, reach: 2.5 };
    let grid = Grid { stations: Stations::new(size, [0.3; 2]), viscous: true };
    let further = 2;
    let mut band = Band::new(&grid);
    let starts: Vec<usize> = (0..=grid.count()).map(|i| (0..i).map(|k| grid.unknowns(k)).sum()).collect();
    let stations = starts[grid.count()];
    let n = stations + GLOBALS;
    let mut dense = DMatrix::zeros(n + further, n);
    let mut seed = 0.3f64;
    let mut random = || {
        seed = (seed * 91.17 + 0.713).sin() * 4711.3;
        seed -= seed.floor();
        seed - 0.5
    };
    for i in 0..grid.count() {
        for r in 0..grid.unknowns(i) {
            let row = Place { station: i, index: r };
            let own = starts[i] + r;
            for j in i.saturating_sub(3)..(i + 2).min(grid.count()) {
                for c in 0..grid.unknowns(j) {
                    let is_speed = r >= grid.speeds_start(i);
                    let same_tube = r - grid.speeds_start(i).min(r) == c - grid.speeds_start(j).min(c);
                    let speed = c >= grid.speeds_start(j);
                    let allowed = match i + 1 - j.min(i + 1) {
                        0 => !speed,
                        // the equation along a tube knows of its own speeds alone
                        1 | 2 => !is_speed || !speed || same_tube,
                        // what is farther upstream is known by the speed of the same tube
                        _ => is_speed && speed && same_tube,
                    };
                    if allowed {
                        let value = random() + if own == starts[j] + c { 6.0 } else { 0.0 };
                        band.add(row, Place { station: j, index: c }, value);
                        dense[(own, starts[j] + c)] = value;
                    }
                }
            }
            for g in 0..GLOBALS {
                let value = random();
                band.add_global(row, g, value);
                dense[(own, stations + g)] = value;
            }
            for g in 0..GLOBALS + further {
                let value = random();
                if g < GLOBALS {
                    band.global(g).add(row, value);
                }
                dense[(stations + g, own)] = value;
            }
        }
    }
    for g in 0..GLOBALS + further {
        for c in 0..GLOBALS {
            let value = random() + if g == c { 6.0 } else { 0.0 };
            if g < GLOBALS {
                band.global(g).add_global(c, value);
            }
            dense[(stations + g, stations + c)] = value;
        }
    }
    let square = dense.rows(0, n).into_owned();
    let right = DVector::from_fn(n, |_, _| random());
    assert!(band.factorise());
    let globals = right.rows(stations, GLOBALS).into_owned();
    let residuals: Vec<Vec<f64>> =
        (0..grid.count()).map(|i| right.rows(starts[i], grid.unknowns(i)).iter().copied().collect()).collect();
    let step = band.step(&residuals, globals.as_slice()).unwrap();
    let wanted = -square.clone().lu().solve(&right).unwrap();
    let found: Vec<f64> = step.stations.iter().flatten().chain(&step.globals).copied().collect();
    assert!(found.iter().zip(wanted.iter()).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?} {wanted}");
    // the equation of one of the global unknowns is another one for the multipliers
    let held = 5;
    let mut square = square;
    square.row_mut(stations + held).fill(0.0);
    square[(stations + held, stations + held)] = 1.0;
    // lists in the order of the unknowns; those of other outputs are zeros
    let rows: Vec<[f64; OUTPUTS]> =
        (0..n).map(|k| std::array::from_fn(|o| if o < further { dense[(n + o, k)] } else { 0.0 })).collect();
    let slots = Slots::new(&grid);
    let mut multipliers = vec![[0.0; OUTPUTS]; slots.unknowns()];
    band.multipliers(&rows, held, &slots, &mut multipliers).unwrap();
    for o in 0..further {
        let wanted = square.transpose().lu().solve(&dense.row(n + o).transpose()).unwrap();
        assert!(multipliers.iter().zip(wanted.iter()).all(|(a, b)| (a[o] - b).abs() < 1e-9), "{o}");
    }
}
