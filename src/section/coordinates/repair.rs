//! [`Repair`]: everything about the reading of coordinates that a user must know.

/// A change that was made to the points of a file, or an assumption or a warning about them; one per kind, with a
/// count.
///
/// Line numbers count from one and name the first place; where the points came from memory, they are numbers of points
/// from one. Lengths are in the unit of the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Repair {
    /// Lines of text after the first point were passed over.
    #[error("{} of text passed over, the first in line {line}", lines(*.count))]
    RemarkIgnored {
        /// Number of lines.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// Points of a camber line or of a chord, in a block with such a heading, were passed over.
    #[error("{} of a camber or chord line passed over, the first in line {line}", points(*.count))]
    MeanLineIgnored {
        /// Number of points.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// Dashes of printed text (Unicode) were read as minus signs.
    #[error("dashes read as minus signs in {}, the first is line {line}", lines(*.count))]
    DashesRead {
        /// Number of lines.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// Commas were read as decimal points.
    #[error("decimal commas read in {}, the first is line {line}", lines(*.count))]
    DecimalCommasRead {
        /// Number of lines.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// Numbers with nothing between them were told apart by their signs or decimals.
    #[error("touching columns told apart in {}, the first is line {line}", lines(*.count))]
    ColumnsSeparated {
        /// Number of lines.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// A first or last column that counts the points was left out.
    #[error("column {column} counts the points, left out")]
    IndexDropped {
        /// Number of the column, from one.
        column: usize,
    },
    /// A table of x and the ordinates of both sides was read as two surfaces.
    #[error("columns {}, {} and {} read as x and the ordinates of the upper and the lower side", columns[0], columns[1], columns[2])]
    SidesInColumns {
        /// Numbers of the columns of x, upper and lower side, from one.
        columns: [usize; 3],
    },
    /// A column in which every number is the same was left out: the section lies in a plane.
    #[error("column {column} is {value} throughout, left out")]
    PlaneFound {
        /// Number of the column, from one.
        column: usize,
        /// The number in it.
        value: f64,
    },
    /// One of several elements was taken.
    #[error("element {element} of {count} taken, which begins in line {line}")]
    ElementTaken {
        /// Number of the element, from one.
        element: usize,
        /// Number of elements in the file.
        count: usize,
        /// Line of its first point.
        line: usize,
    },
    /// Points at the place of the one before them were dropped.
    #[error("{} repeating the one before dropped, the first in line {line}", points(*.count))]
    DuplicateDropped {
        /// Number of points.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// Points before or behind the outline were dropped: the others make a closed outline without them.
    #[error("{} away from the outline dropped (a point of reference?), the first in line {line}", points(*.count))]
    StrayDropped {
        /// Number of points.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// Points that stand far off the smooth line of all their neighbours were dropped.
    #[error("{} off the line of the neighbours (by {distance:.2e} or more) dropped, the first in line {line}", points(*.count))]
    SpikeDropped {
        /// Number of points.
        count: usize,
        /// Line of the first.
        line: usize,
        /// Smallest of the distances from the line of the neighbours.
        distance: f64,
    },
    /// Points stand off the line of their neighbours, too little to be dropped.
    #[error(
        "{} perhaps wrong: off the line of the neighbours (by up to {distance:.2e}), kept, the first in line {line}",
        points(*.count)
    )]
    SpikeSuspected {
        /// Number of points.
        count: usize,
        /// Line of the first.
        line: usize,
        /// Largest of the distances from the line of the neighbours.
        distance: f64,
    },
    /// The outline steps sideways: a run of points beside such a place may be shifted.
    #[error(
        "the outline steps sideways in {} (by up to {distance:.2e}), the first at line {line}: a run of points may be \
         shifted, kept",
        plural(*.count, "place", "places")
    )]
    StepSuspected {
        /// Number of such places.
        count: usize,
        /// Line of the point behind the first.
        line: usize,
        /// Largest of the steps.
        distance: f64,
    },
    /// Neighbouring points far more apart than those around them.
    #[error("{} in the outline, the first behind line {line}, the longest {distance:.2e}: points may be missing", plural(*.count, "gap", "gaps"))]
    GapSuspected {
        /// Number of gaps.
        count: usize,
        /// Line of the point before the first.
        line: usize,
        /// Length of the longest.
        distance: f64,
    },
    /// The nose lay to the right; the section was mirrored left to right, so that what is above stays above.
    #[error("the nose lay to the right; mirrored left to right (x changed its sign), above stays above")]
    Mirrored,
    /// The nose lay to the right, and the section ran as one that was turned by 180 degrees; it was turned back.
    #[error(
        "the nose lay to the right, and mirrored the section would run over its lower surface first and be cambered \
         downwards: turned by 180 degrees (x and y changed their signs)"
    )]
    TurnedBack,
    /// The section stands upright and was left so.
    #[error(
        "the section stands turned by {:.0} degrees; if it should not, x and y may have been exchanged",
        turn.to_degrees()
    )]
    Upright {
        /// Angle from the x axis to the direction from the nose to the tail, in radians, counter-clockwise positive.
        turn: f64,
    },
    /// The first number of each line was the ordinate; x and y were exchanged.
    #[error("the section stood upright and ran clockwise; x and y exchanged")]
    AxesExchanged,
    /// The outline ran clockwise and was reversed.
    #[error("the outline ran over the lower surface first, reversed")]
    Reversed,
    /// The outline began elsewhere and was made to begin at the trailing edge.
    #[error("the outline did not begin at the trailing edge; it now begins at line {line}")]
    Rotated {
        /// Line of the point that is first now.
        line: usize,
    },
    /// Points on the base of a blunt trailing edge were dropped; the base is no part of the curve.
    #[error("{} on the base of the trailing edge dropped, the first in line {line}", points(*.count))]
    BasePointDropped {
        /// Number of points.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// Points that were out of order were sorted along the outline.
    #[error("{} out of order sorted along the outline, the first in line {line}", points(*.count))]
    Sorted {
        /// Number of points that changed their place.
        count: usize,
        /// Line of the first.
        line: usize,
    },
    /// One surface ended short of the trailing edge and was closed to the end of the other one.
    #[error("one surface ended {distance:.2e} short of the trailing edge, closed")]
    TrailingEdgeCompleted {
        /// Distance that was bridged, in the unit of the file.
        distance: f64,
    },
    /// A trailing-edge gap too small to be meant was closed at its middle.
    #[error("trailing-edge gap of {gap:.2e} closed")]
    TrailingEdgeClosed {
        /// Height of the gap, in the unit of the file.
        gap: f64,
    },
    /// The curve was kept straight where a smooth one would leave the points, and turns sharply at corners.
    #[error(
        "the curve is kept straight along {} where a smooth one would leave the polygon, with {}, from line {line} on; \
         points may be missing there",
        plural(*.sides, "side", "sides"), plural(*.corners, "corner", "corners")
    )]
    KeptStraight {
        /// Number of sides drawn by their ends only.
        sides: usize,
        /// Number of corners of the curve.
        corners: usize,
        /// Line of the point before the first such side, or at the first corner.
        line: usize,
    },
    /// The smooth curve beside straight sides encloses more or less than the polygon; it was drawn towards the polygon.
    #[error(
        "a smooth curve through the points would enclose {:+.1} % more than the polygon does: drawn towards its sides; \
         give more points", 100.0 * excess
    )]
    DrawnToPolygon {
        /// Area of the smooth curve over that of the polygon, less one.
        excess: f64,
    },
    /// The points are so few that the area within the smooth curve through them differs from that of the polygon.
    #[error(
        "the points are few: the smooth curve through them encloses {:+.1} % more than the polygon does; give more points",
        100.0 * excess
    )]
    FewPoints {
        /// Area of the curve over that of the polygon, less one.
        excess: f64,
    },
    /// The points are rounded more coarsely than they are spaced, and the curve smooths them.
    #[error(
        "the points are rounded to {step:.0e}, more coarsely than they are spaced: smoothed, the curve leaves them by \
         {distance:.2e} at most (line {line})"
    )]
    Smoothed {
        /// Unit of the last digit of the file.
        step: f64,
        /// Largest distance of a point from the curve.
        distance: f64,
        /// Line of that point.
        line: usize,
    },
    /// The curve was fitted to the points with fewer control points, as was asked for.
    #[error(
        "fitted with {control_points} control points, the curve leaves the points by {distance:.2e} at most (line {line})"
    )]
    Fitted {
        /// Number of control points of the curve.
        control_points: usize,
        /// Largest distance of a point from the curve.
        distance: f64,
        /// Line of that point.
        line: usize,
    },
    /// The curve leaves the polygon through the points by more than smooth and well-spaced points would let it.
    #[error(
        "the curve leaves the straight lines between the points by {distance:.2e} behind line {line}; points may be \
         missing there"
    )]
    LeavesPolygon {
        /// Largest distance of the curve from the polygon.
        distance: f64,
        /// Line of the point before that place.
        line: usize,
    },
    /// The points were turned, moved and scaled to the chord, as was asked for.
    #[error(
        "normalized: moved by ({:.9}, {:.9}), turned by {:.6} degrees, scaled by {scale:.9}",
        shift[0], shift[1], turn.to_degrees()
    )]
    Normalized {
        /// The first step: what was added to every point.
        shift: [f64; 2],
        /// The second step: angle about the origin in radians, counter-clockwise positive.
        turn: f64,
        /// The last step: factor of all lengths.
        scale: f64,
    },
}

impl Repair {
    /// Takes another repair into this one if both are of one kind that is counted.
    fn absorb(&mut self, other: &Self) -> bool {
        match (self, other) {
            (Self::RemarkIgnored { count, .. }, Self::RemarkIgnored { count: more, .. })
            | (Self::MeanLineIgnored { count, .. }, Self::MeanLineIgnored { count: more, .. })
            | (Self::DashesRead { count, .. }, Self::DashesRead { count: more, .. })
            | (Self::DecimalCommasRead { count, .. }, Self::DecimalCommasRead { count: more, .. })
            | (Self::ColumnsSeparated { count, .. }, Self::ColumnsSeparated { count: more, .. })
            | (Self::DuplicateDropped { count, .. }, Self::DuplicateDropped { count: more, .. })
            | (Self::StrayDropped { count, .. }, Self::StrayDropped { count: more, .. })
            | (Self::BasePointDropped { count, .. }, Self::BasePointDropped { count: more, .. })
            | (Self::Sorted { count, .. }, Self::Sorted { count: more, .. }) => *count += more,
            (Self::SpikeDropped { count, distance, .. }, Self::SpikeDropped { count: more, distance: another, .. }) => {
                (*count, *distance) = (*count + more, distance.min(*another))
            }
            (
                Self::SpikeSuspected { count, distance, .. },
                Self::SpikeSuspected { count: more, distance: another, .. },
            ) => (*count, *distance) = (*count + more, distance.max(*another)),
            (
                Self::StepSuspected { count, distance, .. },
                Self::StepSuspected { count: more, distance: another, .. },
            ) => (*count, *distance) = (*count + more, distance.max(*another)),
            (Self::GapSuspected { count, distance, .. }, Self::GapSuspected { count: more, distance: another, .. }) => {
                (*count, *distance) = (*count + more, distance.max(*another))
            }
            _ => return false,
        }
        true
    }
}

/// Adds a repair to a list that has one entry per kind.
pub(super) fn record(repairs: &mut Vec<Repair>, repair: Repair) {
    if !repairs.iter_mut().any(|earlier| earlier.absorb(&repair)) {
        repairs.push(repair);
    }
}

fn plural(count: usize, one: &str, many: &str) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {many}") }
}

fn lines(count: usize) -> String {
    plural(count, "line", "lines")
}

fn points(count: usize) -> String {
    plural(count, "point", "points")
}
