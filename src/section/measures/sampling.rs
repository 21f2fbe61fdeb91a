//! Where a curve is looked at before a measure is solved for.

use crate::spline::BSplineCurve;

/// Four parameters per knot span, ends included.
pub(super) fn dense_parameters(curve: &BSplineCurve<f64>) -> Vec<f64> {
    const SHARE: usize = 4;
    let mut parameters = vec![];
    for (_, start, end) in curve.knots().spans() {
        parameters.extend((0..SHARE).map(|i| start + (end - start) * i as f64 / SHARE as f64));
    }
    parameters.push(curve.domain().1);
    parameters
}
