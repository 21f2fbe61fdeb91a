//! How far a curve is from the points and from the polygon through them.

use super::curve::{Deviation, Plan};
use super::strays::from_segment;
use crate::plane::distance;
use crate::spline::BSplineCurve;

/// Samples between two data.
const SAMPLES: usize = 4;

pub(super) fn deviation(plan: &Plan, points: &[[f64; 2]], curve: &BSplineCurve<f64>) -> Deviation {
    let mut result = Deviation::default();
    for (&u, &(index, share)) in plan.parameters.iter().zip(&plan.places) {
        let off = if share == 0.0 { distance(curve.point_at(u), points[index]) } else { 0.0 };
        if off > result.points {
            (result.points, result.points_at) = (off, index);
        }
    }
    for (index, off) in off_polygon(plan, points, curve).into_iter().enumerate() {
        if off > result.polygon {
            (result.polygon, result.polygon_at) = (off, index);
        }
    }
    result
}

/// For every side of the polygon the largest distance of the curve along it from the polygon nearby.
pub(super) fn off_polygon(plan: &Plan, points: &[[f64; 2]], curve: &BSplineCurve<f64>) -> Vec<f64> {
    let last = points.len() - 1;
    let mut off = vec![0.0f64; last];
    let intervals = plan.parameters.windows(2).zip(&plan.places);
    for (t, &(side, _)) in intervals {
        for k in 1..=SAMPLES {
            let point = curve.point_at(t[0] + (t[1] - t[0]) * k as f64 / (SAMPLES + 1) as f64);
            let near = side.saturating_sub(1)..(side + 2).min(last);
            let nearest = near.map(|i| from_segment(point, points[i], points[i + 1])).fold(f64::INFINITY, f64::min);
            off[side] = off[side].max(nearest);
        }
    }
    off
}
