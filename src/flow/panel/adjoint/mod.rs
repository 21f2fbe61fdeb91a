//! Exact derivatives of a converged solution by the adjoint method.
//!
//! For an output J with multipliers λ (from the transposed coupled system, whose factors are at hand) the derivative
//! with respect to any input p is ∂J/∂p − λ·∂R/∂p, with the residuals R. The vortex strengths are carried as explicit
//! variables with the multipliers of the panel equations, so that every term is local: a panel and a point, an
//! interval, a spline coefficient. All local derivatives come from dual numbers of the kernels themselves, and all
//! coefficients share one sweep.

mod edge;
mod influence;
mod path;
mod reverse;
mod sums;
mod surface;
mod velocity;
mod wake;

#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

use super::coupling::reduced::Reduced;
use super::outputs::{direct, pressure_direct};
use super::solved::{Direct, Solved};
use crate::flow::coefficients::{COEFFICIENTS, Coefficients, Derivatives, Gradients};
use reverse::{Collected, Reverse};

/// Derivatives of all coefficients with respect to all inputs, at fixed angle of attack.
pub(super) fn gradients(solved: &Solved, reduced: &Reduced) -> Gradients {
    gradients_of(&direct(solved), solved, reduced)
}

/// Derivatives of weighted sums of the pressure coefficients at the nodes with respect to all inputs, at fixed angle of
/// attack: one for each list of weights, which has one weight per node.
///
/// As many sums as there are coefficients share a sweep.
pub(super) fn pressure_gradients(weights: &[Vec<f64>], solved: &Solved, reduced: &Reduced) -> Vec<Derivatives> {
    let sweep = |chunk: &[Vec<f64>]| {
        let mut chunk = chunk.iter();
        let outputs = Coefficients::<()>::default().map(|()| pressure_direct(chunk.next(), solved));
        gradients_of(&outputs, solved, reduced).to_array()
    };
    weights.chunks(COEFFICIENTS).flat_map(|chunk| sweep(chunk).into_iter().take(chunk.len())).collect()
}

/// Derivatives of any outputs with the given direct dependence.
fn gradients_of(direct: &Coefficients<Direct>, solved: &Solved, reduced: &Reduced) -> Gradients {
    let reverse = Reverse::new(solved, reduced, direct);
    let mut collected = Collected::new(direct);
    collected.add_gas(solved, &reverse);
    let weights = influence::panel_weights(reverse.section, &reverse.strengths);
    let (inviscid, inviscid_weights) = wake::add_wake(solved, &reverse, &weights, &mut collected);
    let parts = [(&reverse.at_solution, &weights), (&inviscid, &inviscid_weights)];
    influence::add_panels(&reverse, parts, &mut collected);
    surface::add_surface(solved, &reverse, direct, &mut collected);
    let mut gradients = collected.finish();
    for (gradient, direct) in gradients.iter_mut().zip(direct.iter()) {
        for (node, given) in gradient.nodes.iter_mut().zip(&direct.given) {
            *node = [node[0] + given[0], node[1] + given[1]];
        }
    }
    gradients
}
