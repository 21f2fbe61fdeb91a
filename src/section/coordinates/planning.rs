//! Decides how the curve goes through the points: which sides are kept straight, whether rounded points are smoothed, and
//! whether the curve is drawn towards the polygon.

use super::curve::{Fit, Plan, extent, turn};
use super::deviation::{deviation, off_polygon};
use super::rounding::rounding_fit;
use crate::plane::{cross, distance, minus};
use crate::section::measures::outline_crossing;
use crate::section::{CoordinateError, Section, SectionError, TrailingEdge};
use crate::spline::BSplineCurve;

/// Sides that turn by more at an end are no part of a smooth curve that is sampled well.
const SHARP: f64 = 0.8;
/// Sides so many times longer than a neighbour are drawn by their ends only, if the curve leaves them.
const UNEVEN: f64 = 3.0;
/// Area between side and curve as a share of the enclosed area that is more than a smooth curve has.
const BULGE: f64 = 0.01;
/// Distances below this share of the extent are no matter.
const SMALL: f64 = 1e-3;
/// Areas of curve and polygon may differ by this share of the polygon's, where sides were kept straight.
const EXCESS: f64 = 0.01;
/// And by this share elsewhere: few points on a round outline let them differ so.
const MOST_EXCESS: f64 = 0.03;
/// Rounds in which sides are straightened; each may show further ones.
const ROUNDS: usize = 12;

/// The plan for these points, the digits of which end at `step` (zero where this is not known).
pub(super) fn plan(points: &[[f64; 2]], fit: Fit, step: f64) -> Result<Plan, SectionError> {
    let outline = Shape::of(points);
    let mut straight = vec![false; points.len() - 1];
    let mut crossing = None;
    for _ in 0..ROUNDS {
        let plan = Plan::with(points, &straight, Fit::Interpolate)?;
        let curve = plan.curve(points)?;
        let mut found: Vec<usize> = outline.bulging_sides(&plan, &curve);
        crossing = if found.is_empty() { outline_crossing(&curve) } else { None };
        if let Some(at) = &crossing {
            found.extend([at.first, at.second].map(|u| plan.side_at(u)));
        }
        found.retain(|&side| !straight[side]);
        if found.is_empty() {
            break;
        }
        found.iter().for_each(|&side| straight[side] = true);
    }
    if let Some(crossing) = crossing.filter(|_| fit == Fit::Interpolate) {
        let [x, y] = crossing.point;
        return Err(CoordinateError::CurveCrossing { x, y }.into());
    }
    let mut plan = Plan::with(points, &straight, fit)?;
    if fit == Fit::Interpolate && plan.corners.is_empty() {
        plan.smoothing = rounding_fit(&plan, points, step);
    }
    draw_to_polygon(&mut plan, points, outline.area)?;
    let curve = plan.curve(points)?;
    plan.deviation = deviation(&plan, points, &curve);
    Ok(plan)
}

/// Decides whether the curve is drawn towards the polygon, so that the areas agree.
fn draw_to_polygon(plan: &mut Plan, points: &[[f64; 2]], polygon: f64) -> Result<(), SectionError> {
    if plan.fit != Fit::Interpolate || plan.smoothing.is_some() {
        return Ok(());
    }
    let excess = |plan: &Plan| {
        // the nose parameter has no part in the area
        let section = Section::new(plan.curve(points)?, TrailingEdge::Blunt, 0.5, "")?;
        Ok::<_, SectionError>(section.area() / polygon - 1.0)
    };
    plan.excess = excess(plan)?;
    let most = if plan.straight.is_empty() { MOST_EXCESS } else { EXCESS };
    // written so that NaN fails
    if plan.excess.abs() <= most || !plan.excess.is_finite() {
        return Ok(());
    }
    let straight = excess(&Plan { drawn: Some(0.0), ..plan.clone() })?;
    let wanted = 0.9 * EXCESS.copysign(plan.excess);
    // the area is linear in the data
    plan.drawn = Some(((wanted - straight) / (plan.excess - straight)).clamp(0.0, 1.0));
    Ok(())
}

/// The polygon through the points.
struct Shape<'a> {
    points: &'a [[f64; 2]],
    extent: f64,
    area: f64,
}

impl<'a> Shape<'a> {
    fn of(points: &'a [[f64; 2]]) -> Self {
        let area: f64 = points.windows(2).map(|w| 0.5 * cross(minus(w[0], points[0]), minus(w[1], points[0]))).sum();
        Self { points, extent: extent(points), area: area.abs() }
    }

    /// Sides that the curve leaves by more than a smooth curve through well-spaced points would.
    fn bulging_sides(&self, plan: &Plan, curve: &BSplineCurve<f64>) -> Vec<usize> {
        let off = off_polygon(plan, self.points, curve);
        let length = |i: usize| distance(self.points[i], self.points[i + 1]);
        let last = self.points.len() - 2;
        (0..=last)
            .filter(|&i| {
                let own = length(i);
                let bulge = 2.0 / 3.0 * off[i] * own;
                let significant = off[i] > SMALL * self.extent && bulge > BULGE * self.area;
                let uneven = |j: usize| own > UNEVEN * length(j) || plan.straight.contains(&j);
                let sharp = |i: usize| turn(self.points, i) > SHARP;
                significant && ((i > 0 && (uneven(i - 1) || sharp(i))) || (i < last && (uneven(i + 1) || sharp(i + 1))))
            })
            .collect()
    }
}
