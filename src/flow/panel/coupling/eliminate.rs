//! Elimination of the boundary-layer states: marching the blocks downstream leaves the mass defects and the globals as
//! unknowns.

use super::system::Linearised;
use crate::flow::duals::gradient;
use crate::flow::layer::blocks::{Block, Coupling};
use crate::flow::layer::equations::BY_AMPLIFICATION;
use crate::flow::layer::{GLOBAL_UNKNOWNS, Side, State};
use crate::flow::linear::Linear;
use crate::flow::memory::{Recycled, kept, large};
use nalgebra::{DMatrix, Matrix3};

/// The states of a station: ln θ, the third unknown, ln u.
type Triple = [f64; 3];
/// Rows of a 3 × 3 matrix.
type Square = [[f64; 3]; 3];

/// The states of a station as a linear function of the states upstream, the logarithms of the mass defects, the globals
/// and the residuals of the station.
#[derive(Debug, Clone)]
struct Response {
    /// Number of each station upstream, with the response to the states and to the mass defect there.
    upstream: [Option<(usize, Square, Triple)>; 2],
    /// Response to the mass defect of the station itself.
    own: Triple,
    /// Response to the globals.
    globals: Square,
    /// Response to the residuals: minus the inverse of the station's own block.
    residual: Square,
}

kept!(Response);

/// The links of all stations.
#[derive(Debug, Clone)]
pub(super) struct Elimination {
    links: Recycled<Response>,
    /// The outer flow's unknown speed at every station.
    pub speed: Vec<f64>,
}

/// A coupling in the variables of the elimination: the states, and the logarithm of the mass defect.
fn turn(coupling: &Coupling, log_mass: &State) -> (Square, Triple) {
    let defect = coupling.map(|row| row.log_shape / log_mass.log_shape);
    let mut states = [[0.0; 3]; 3];
    for (i, row) in coupling.iter().enumerate() {
        let log_theta = row.log_theta - defect[i] * log_mass.log_theta;
        states[i] = [log_theta, row.third, row.log_speed - defect[i] * log_mass.log_speed];
    }
    (states, defect)
}

/// The product of a matrix and a vector.
fn apply(a: &Square, x: &Triple) -> Triple {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

/// The product of a transposed matrix and a vector.
fn apply_transposed<V: Linear>(a: &Square, x: &[V; 3]) -> [V; 3] {
    std::array::from_fn(|j| x[0] * a[0][j] + x[1] * a[1][j] + x[2] * a[2][j])
}

fn add<V: Linear>(a: &mut [V; 3], b: &[V; 3]) {
    for i in 0..3 {
        a[i] = a[i] + b[i];
    }
}

fn dot<V: Linear>(a: &Triple, b: &[V; 3]) -> V {
    b[0] * a[0] + b[1] * a[1] + b[2] * a[2]
}

/// The product of two matrices.
fn times(a: &Square, b: &Square) -> Square {
    a.map(|row| apply_transposed(b, &row))
}

impl Elimination {
    /// Inverts the block of every station; `None` where a block is singular.
    pub fn new(system: &Linearised) -> Option<Self> {
        let link = |(k, block): (usize, &Block)| {
            let (own, defect) = turn(&block.own, &system.log_mass[k]);
            let inverse = Matrix3::from_fn(|i, j| own[i][j]).try_inverse()?;
            let residual: Square = std::array::from_fn(|i| std::array::from_fn(|j| -inverse[(i, j)]));
            let globals = block.globals.map(|row| std::array::from_fn(|g| row[g]));
            let upstream = block.upstream.map(|up| {
                up.map(|(station, coupling)| {
                    let (states, defect) = turn(&coupling, &system.log_mass[station]);
                    (station, times(&residual, &states), apply(&residual, &defect))
                })
            });
            Some(Response { upstream, own: apply(&residual, &defect), globals: times(&residual, &globals), residual })
        };
        let links = system.blocks.iter().enumerate().map(link).collect::<Option<_>>()?;
        let speed = system.derived.iter().map(|d| d.speed.re).collect();
        Some(Self { links, speed })
    }

    /// The states for given residuals, changes of the logarithms of the mass defects (zero where the list is empty) and
    /// globals.
    pub fn march(&self, residuals: &[Triple], defects: &[f64], globals: Triple) -> Vec<Triple> {
        let mut states: Vec<Triple> = Vec::with_capacity(self.links.len());
        let defect = |k: usize| defects.get(k).copied().unwrap_or(0.0);
        for (k, link) in self.links.iter().enumerate() {
            let mut z = apply(&link.residual, &residuals[k]);
            add(&mut z, &apply(&link.globals, &globals));
            add(&mut z, &link.own.map(|v| v * defect(k)));
            for (up, by_states, by_defect) in link.upstream.iter().flatten() {
                add(&mut z, &apply(by_states, &states[*up]));
                add(&mut z, &by_defect.map(|v| v * defect(*up)));
            }
            states.push(z);
        }
        states
    }

    /// The transpose of [`march`](Self::march) in the mass defects and the globals: adds to `dense` the contribution of
    /// the sensitivities of the states, which are overwritten.
    pub fn march_back<V: Linear>(&self, sensitivities: &mut [[V; 3]], dense: &mut [V]) {
        let n = self.links.len();
        for (k, link) in self.links.iter().enumerate().rev() {
            let w = sensitivities[k];
            dense[k] = dense[k] + dot(&link.own, &w);
            for (sum, by_global) in dense[n..].iter_mut().zip(apply_transposed(&link.globals, &w)) {
                *sum = *sum + by_global;
            }
            for (up, by_states, by_defect) in link.upstream.iter().flatten() {
                dense[*up] = dense[*up] + dot(by_defect, &w);
                add(&mut sensitivities[*up], &apply_transposed(by_states, &w));
            }
        }
    }

    /// Multipliers of the boundary-layer equations from the sensitivities of the states.
    pub fn multipliers<V: Linear>(&self, mut sensitivities: Vec<[V; 3]>) -> Vec<[V; 3]> {
        for (k, link) in self.links.iter().enumerate().rev() {
            let w = sensitivities[k];
            for (up, by_states, _) in link.upstream.iter().flatten() {
                add(&mut sensitivities[*up], &apply_transposed(by_states, &w));
            }
            sensitivities[k] = apply_transposed(&link.residual, &w).map(|v| v * -1.0);
        }
        sensitivities
    }

    /// The dense matrix that remains, transposed: one column per equation (edge speeds, transition, stagnation), one
    /// row per unknown (logarithms of the mass defects, globals).
    pub fn dense_transposed(&self, system: &Linearised) -> DMatrix<f64> {
        let numbering = &system.numbering;
        let n = numbering.stations();
        let mut matrix = large(n + GLOBAL_UNKNOWNS, n + GLOBAL_UNKNOWNS);
        // responses of the states of one station to all unknowns; at the start of the wake of both sides
        let mut response = [(); 3].map(|()| vec![0.0; n + GLOBAL_UNKNOWNS]);
        let mut globals = [[[0.0; 3]; 3]; 2];
        for (k, link) in self.links.iter().enumerate() {
            let (first, by_globals) = match numbering.on_side(k) {
                Some((side, j)) => {
                    let by_globals = &mut globals[side.index()];
                    *by_globals = match (&link.upstream[0], j) {
                        (Some((_, by_states, _)), _) => sum(&times(by_states, by_globals), &link.globals),
                        _ => link.globals,
                    };
                    (numbering.station(side, 0), *by_globals)
                }
                None => {
                    if let [Some((_, upper, _)), Some((_, lower, _))] = &link.upstream {
                        globals[0] = sum(&times(upper, &globals[0]), &times(lower, &globals[1]));
                    } else if let Some((_, by_states, _)) = &link.upstream[0] {
                        globals[0] = times(by_states, &globals[0]);
                    }
                    globals[0] = sum(&globals[0], &link.globals);
                    (0, globals[0])
                }
            };
            match &link.upstream {
                [Some((upper, by_upper, _)), Some((_, by_lower, _))] => {
                    transform(&mut response, by_upper, 0..upper + 1);
                    transform(&mut response, by_lower, upper + 1..k);
                }
                [Some((_, by_states, _)), None] => transform(&mut response, by_states, first..k),
                _ => {}
            }
            for i in 0..3 {
                for (up, _, by_defect) in link.upstream.iter().flatten() {
                    response[i][*up] += by_defect[i];
                }
                response[i][k] = link.own[i];
            }
            let mut column = matrix.column_mut(k);
            let row = column.as_mut_slice();
            let by_position = system.speed_row(k, row);
            let speed = self.speed[k];
            for (r, z) in row[first..=k].iter_mut().zip(&response[2][first..=k]) {
                *r += speed * z;
            }
            for g in 0..GLOBAL_UNKNOWNS {
                row[n + g] = by_position[g] + speed * by_globals[2][g];
            }
            for side in Side::BOTH.into_iter().filter(|side| k == numbering.last_laminar(*side)) {
                let slope = gradient(&system.transition[side.index()]);
                let mut column = matrix.column_mut(n + side.index());
                let row = column.as_mut_slice();
                row[..n].fill(0.0);
                for (r, z) in row[first..=k].iter_mut().zip(&response[1][first..=k]) {
                    *r = slope[BY_AMPLIFICATION] * z;
                }
                for g in 0..GLOBAL_UNKNOWNS {
                    row[n + g] = slope[g] + slope[BY_AMPLIFICATION] * by_globals[1][g];
                }
            }
        }
        system.stagnation_row(matrix.column_mut(n + 2).as_mut_slice());
        matrix
    }
}

fn sum(a: &Square, b: &Square) -> Square {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j]))
}

/// Multiplies the three rows from the left by `factor`, in a range of columns.
fn transform(rows: &mut [Vec<f64>; 3], factor: &Square, range: std::ops::Range<usize>) {
    let [x, y, z] = rows;
    let (x, y, z) = (&mut x[range.clone()], &mut y[range.clone()], &mut z[range]);
    let f = factor;
    for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
        let (a, b, c) = (*x, *y, *z);
        *x = f[0][0] * a + f[0][1] * b + f[0][2] * c;
        *y = f[1][0] * a + f[1][1] * b + f[1][2] * c;
        *z = f[2][0] * a + f[2][1] * b + f[2][2] * c;
    }
}
