//! Whether panels and stations are enough: the estimated errors of the coefficients, and when they count as small.

use super::coefficients::{Coefficients, Gradients};

/// Relative error of lift and drag below which either kind of elements counts as enough.
const RESOLVED: f64 = 0.0025;
/// Lift coefficient below which the error of the lift is compared with this number instead of the lift.
const SMALL_LIFT: f64 = 0.1;

/// Estimated errors of the coefficients of a solution, as absolute values. They hold whatever the condition holds: the
/// angle of attack or the lift coefficient.
///
/// The estimate of the panels is the exact first-order effect of a model of their error, right to about a factor of two where
/// layers are attached; behind laminar bubbles and on wavy sections it can say too little. That of the stations comes from
/// the equations on twice as many of them. Neither knows of another flow that more elements would find.
///
/// Of 1200 random points of a public collection of sections, lift and drag of 891 were estimated as well resolved, and
/// changed by less than 0.5 % on 871 of these (97.8 %) when panels and stations were doubled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiscretisationError {
    /// Errors that the number of panels leaves: the derivative of every coefficient along the small move of all nodes that
    /// acts like the error of the panels.
    pub panels: Coefficients,
    /// Errors that the number of stations of the boundary layer leaves: the change of every coefficient in one step of
    /// Newton's method on twice as many stations, infinite where that step leads to no flow.
    pub stations: Coefficients,
}

impl DiscretisationError {
    /// Whether each kind of error is small: below 0.25 % of the drag, and below 0.25 % of the lift or of a lift coefficient
    /// of 0.1 where the lift is smaller than that.
    pub fn is_small(&self, coefficients: &Coefficients) -> bool {
        let Coefficients { cl, cd, .. } = coefficients;
        [self.panels, self.stations]
            .iter()
            .all(|error| error.cd < RESOLVED * cd.abs() && error.cl < RESOLVED * cl.abs().max(SMALL_LIFT))
    }
}

/// Changes at fixed angle of attack as changes at fixed lift coefficient, from the derivatives at fixed angle of attack.
pub(super) fn at_fixed_lift(changes: Coefficients, gradients: &Gradients) -> Coefficients {
    let angle = -changes.cl / gradients.cl.alpha;
    changes.zip(gradients.as_ref()).map(|(change, by)| change + by.alpha * angle)
}
