//! Sparse constant linear maps between lists of points or numbers.

use crate::scalar::Scalar;

/// A sparse matrix by rows whose entries may carry derivatives.
///
/// Row `r` maps the inputs to output `r`. The same map serves every coordinate of a list of points.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearMap<S = f64> {
    starts: Vec<usize>,
    columns: Vec<usize>,
    weights: Vec<S>,
    inputs: usize,
}

impl<S: Scalar> LinearMap<S> {
    /// A map with the given number of inputs and no outputs yet.
    pub fn new(inputs: usize) -> Self {
        Self { starts: vec![0], columns: Vec::new(), weights: Vec::new(), inputs }
    }

    /// Adds an entry to the row that is being written. `column` must be less than [`inputs`](Self::inputs).
    pub fn push(&mut self, column: usize, weight: S) {
        debug_assert!(column < self.inputs);
        self.columns.push(column);
        self.weights.push(weight);
    }

    /// Ends the row that is being written.
    pub fn end_row(&mut self) {
        self.starts.push(self.columns.len());
    }

    /// Number of inputs, the columns of the matrix.
    pub fn inputs(&self) -> usize {
        self.inputs
    }

    /// Number of outputs, the rows of the matrix.
    pub fn outputs(&self) -> usize {
        self.starts.len() - 1
    }

    /// The entries of a row: `(column, weight)`.
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, S)> + '_ {
        let range = self.starts[row]..self.starts[row + 1];
        self.columns[range.clone()].iter().copied().zip(self.weights[range].iter().copied())
    }

    /// `outputs[r] += Σ weight · inputs[column]` for points of `D` coordinates.
    pub fn add_to<const D: usize>(&self, inputs: &[[S; D]], outputs: &mut [[S; D]]) {
        for (row, output) in outputs.iter_mut().enumerate() {
            for (column, weight) in self.row(row) {
                for d in 0..D {
                    output[d] += inputs[column][d] * weight;
                }
            }
        }
    }

    /// The transposed map, whose inputs are the outputs of this one; entries of each row stand in ascending order.
    pub fn transposed(&self) -> Self {
        let mut starts = vec![0; self.inputs + 1];
        for &column in &self.columns {
            starts[column + 1] += 1;
        }
        for column in 0..self.inputs {
            starts[column + 1] += starts[column];
        }
        let mut next = starts.clone();
        let (mut columns, mut weights) = (vec![0; self.columns.len()], self.weights.clone());
        for row in 0..self.outputs() {
            for (column, weight) in self.row(row) {
                (columns[next[column]], weights[next[column]]) = (row, weight);
                next[column] += 1;
            }
        }
        Self { starts, columns, weights, inputs: self.outputs() }
    }

    /// The transposed map applied: `inputs[column] += Σ weight · outputs[r]`, which carries gradients back.
    pub fn add_transposed_to<const D: usize>(&self, outputs: &[[S; D]], inputs: &mut [[S; D]]) {
        for (row, output) in outputs.iter().enumerate() {
            for (column, weight) in self.row(row) {
                for d in 0..D {
                    inputs[column][d] += output[d] * weight;
                }
            }
        }
    }
}

impl LinearMap<f64> {
    /// This constant map over another scalar.
    pub fn lifted<S: Scalar>(&self) -> LinearMap<S> {
        LinearMap {
            starts: self.starts.clone(),
            columns: self.columns.clone(),
            weights: self.weights.iter().map(|&w| S::from(w)).collect(),
            inputs: self.inputs,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transposed_is_the_adjoint() {
        let mut map = LinearMap::new(3);
        for row in [vec![(0, 1.0), (2, -2.0)], vec![], vec![(1, 0.5)], vec![(2, 4.0), (0, 3.0)]] {
            for (column, weight) in row {
                map.push(column, weight);
            }
            map.end_row();
        }
        let x = [[1.0, -1.0], [2.0, 0.5], [3.0, 0.25]];
        let y = [[0.1, 0.7], [5.0, 5.0], [-0.3, 0.2], [0.4, -0.9]];
        let (mut ax, mut aty) = ([[0.0; 2]; 4], [[0.0; 2]; 3]);
        map.add_to(&x, &mut ax);
        map.add_transposed_to(&y, &mut aty);
        assert_eq!(ax[0], [-5.0, -1.5]);
        let dot = |a: &[[f64; 2]], b: &[[f64; 2]]| {
            a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum::<f64>()
        };
        assert!((dot(&ax, &y) - dot(&x, &aty)).abs() < 1e-15);
        // the transposed map does by rows what the map does by columns
        let mut again = [[0.0; 2]; 3];
        map.transposed().add_to(&y, &mut again);
        assert_eq!(again, aty);
        assert_eq!(map.transposed().transposed().row(0).collect::<Vec<_>>(), [(0, 1.0), (2, -2.0)]);
        assert_eq!((map.transposed().inputs(), map.transposed().outputs()), (4, 3));
    }
}
