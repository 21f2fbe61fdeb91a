//! Local residuals and the passes over them.
//!
//! Every equation of the solver is a sum of terms. A term is a [`Kernel`], a function of a handful of numbers written
//! once over every scalar, with the [`Input`]s it reads and the [`Row`]s its results are added to. What is done with a
//! term is up to a [`Pass`]: evaluate it, differentiate it by its inputs and scatter that into the Jacobian, or keep
//! its derivatives for the adjoint.

use super::gas::Flow;
use super::numbering::Place;
use crate::flow::layer::Side;
use crate::scalar::{Over, Scalar};

/// A number that a kernel reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Input {
    /// Coordinate `axis` of the node of a line at a station.
    Node { station: usize, line: usize, axis: usize },
    /// An unknown of a station.
    Unknown(Place),
    /// A global unknown.
    Global(usize),
    /// Coordinate `axis` of wall point `point` of a side, without displacement.
    Wall { side: Side, point: usize, axis: usize },
    /// Arc length from the stagnation point to wall point `point` of a side.
    Arc { side: Side, point: usize },
    /// Dead-air gap of the wake at its station `number`.
    Gap(usize),
    /// Arc length of the trip of a side from the first node.
    Trip(Side),
    /// Arc length of the whole surface.
    Total,
}

/// The equation or output to which a result is added.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Row {
    /// An equation of a station.
    Station(Place),
    /// The equation of a global unknown.
    Global(usize),
    /// An output.
    Output(usize),
}

/// A row with the factor of the result that is added to it; nothing where the result is not wanted.
pub(super) type Target = Option<(Row, f64)>;

/// A function of `N` numbers with `M` results, written once for every scalar. `P` is the scalar of the parameters of
/// the flow.
pub(super) trait Kernel<const N: usize, const M: usize> {
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; N], flow: &Flow<P>) -> [S; M];
}

/// An operation on every term.
pub(super) trait Pass {
    fn term<const N: usize, const M: usize>(
        &mut self,
        kernel: &impl Kernel<N, M>,
        inputs: [Input; N],
        targets: [Target; M],
    );
}

/// The input itself.
pub(super) struct Identity;

impl Kernel<1, 1> for Identity {
    #[inline(always)]
    fn evaluate<S: Over<P>, P: Scalar>(&self, x: [S; 1], _: &Flow<P>) -> [S; 1] {
        x
    }
}

/// The input less a constant.
pub(super) struct Less(pub f64);

impl Kernel<1, 1> for Less {
    fn evaluate<S: Over<P>, P: Scalar>(&self, [x]: [S; 1], _: &Flow<P>) -> [S; 1] {
        [x - self.0]
    }
}

/// The input less the incidence that is held.
pub(super) struct LessHeldAngle;

impl Kernel<1, 1> for LessHeldAngle {
    fn evaluate<S: Over<P>, P: Scalar>(&self, [x]: [S; 1], flow: &Flow<P>) -> [S; 1] {
        [x - flow.incidence]
    }
}

/// The lift coefficient that is held, with the sign that the residual of lift has.
pub(super) struct MinusHeldLift;

impl Kernel<0, 1> for MinusHeldLift {
    fn evaluate<S: Over<P>, P: Scalar>(&self, []: [S; 0], flow: &Flow<P>) -> [S; 1] {
        [S::from(0.0) - flow.incidence]
    }
}
