//! Decides how the curve goes through the points: which sides are kept straight, whether rounded points are smoothed,
//! and whether the curve is drawn towards the polygon.

use super::curve::{CORNER, Fit, Plan, extent, turn};
use super::deviation::{deviation, off_polygon};
use super::rounding::{rounding_fit, signed_turn};
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
/// Areas of curve and polygon differ by at most this share of the polygon's, where sides were kept straight: a little
/// below one per cent, so that integrals over the curve stay within that.
const EXCESS: f64 = 0.009;
/// Areas of a smooth curve and of the polygon through few points may differ by this share of the polygon's; more is
/// reported.
const MOST_EXCESS: f64 = 0.03;
/// A straight run beside a corner is at least this share of the extent long.
const RUN: f64 = 0.15;
/// Turns below this (radians) are those of a straight run.
const QUIET: f64 = 0.05;
/// Rounds in which sides are straightened; each may show further ones.
const ROUNDS: usize = 12;

/// The plan for these points, the digits of which end at `step` (zero where this is not known).
pub(super) fn plan(points: &[[f64; 2]], fit: Fit, step: f64) -> Result<Plan, SectionError> {
    let outline = Shape::of(points);
    let mut straight = outline.sides_at_corners();
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
        return smoothed(points, step)?.ok_or(CoordinateError::CurveCrossing { x, y }.into());
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

/// The plan of a curve that smooths points whose rounding alone makes a curve through them cross itself.
fn smoothed(points: &[[f64; 2]], step: f64) -> Result<Option<Plan>, SectionError> {
    let mut plan = Plan::with(points, &vec![false; points.len() - 1], Fit::Interpolate)?;
    plan.smoothing = rounding_fit(&plan, points, step);
    let curve = plan.curve(points)?;
    plan.deviation = deviation(&plan, points, &curve);
    Ok(Some(plan).filter(|plan| plan.smoothing.is_some() && outline_crossing(&curve).is_none()))
}

/// Decides how far the curve is drawn towards the polygon.
///
/// Where an outline has sides that are drawn by their ends only, its polygon is what is known of its area, and the
/// smooth curve along the other sides may enclose far more. Between that curve and the polygon itself there is a family
/// of curves, linear in one share and with it in the area. The plan takes the smoothest of them whose area differs from
/// that of the polygon by no more than the accuracy that is promised for such outlines ([`EXCESS`]); the share follows
/// from that bound and is not fitted to any file. The area the smooth curve would have had is told with the repair.
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
    // a smooth curve is truer to a round outline than its polygon
    if plan.straight.is_empty() || plan.excess.abs() <= EXCESS || !plan.excess.is_finite() {
        return Ok(());
    }
    let straight = excess(&Plan { drawn: Some(0.0), ..plan.clone() })?;
    let wanted = EXCESS.copysign(plan.excess);
    // the area is linear in the data
    plan.drawn = Some(((wanted - straight) / (plan.excess - straight)).clamp(0.0, 1.0));
    Ok(())
}

impl Plan {
    /// Whether an undrawn curve encloses clearly more or less than the polygon.
    pub(super) fn leaves_area(&self) -> bool {
        self.drawn.is_none() && self.excess.abs() > MOST_EXCESS
    }
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

    /// Sides at corners between straight runs; a square end has two corners beside each other.
    fn sides_at_corners(&self) -> Vec<bool> {
        let last = self.points.len() - 1;
        let mut straight = vec![false; last];
        for i in (1..last).filter(|&i| turn(self.points, i) > CORNER) {
            if self.runs_straight(i, false) && self.runs_straight(i, true) {
                (straight[i - 1], straight[i]) = (true, true);
            }
        }
        straight
    }

    /// Whether a corner stands at the end of a straight run, or the one beside it does that turns in the same sense.
    fn runs_straight(&self, corner: usize, forward: bool) -> bool {
        let last = self.points.len() - 1;
        let next = |i: usize| if forward { Some(i + 1).filter(|&i| i <= last) } else { i.checked_sub(1) };
        let signed = |i: usize| signed_turn(self.points, i);
        let Some(beside) = next(corner) else { return false };
        let is_square = 0 < beside && beside < last && signed(beside) * signed(corner).signum() > CORNER;
        let start = if is_square { beside } else { corner };
        let (mut length, mut at) = (0.0, start);
        while let Some(i) = next(at) {
            length += distance(self.points[at], self.points[i]);
            if length >= RUN * self.extent {
                return true;
            }
            if i == 0 || i == last || signed(i).abs() > QUIET {
                return false;
            }
            at = i;
        }
        false
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
