//! Thickness and camber: at a station, and their largest values.

use super::ChordFrame;
use super::sampling::dense_parameters;
use crate::differentiate::{Tangent, lift_root, lift_roots};
use crate::scalar::Scalar;
use crate::section::{MeasureProblem, Section, SectionError};
use crate::spline::{BSplineCurve, isolated};
use nalgebra::{Matrix2, Vector2};

/// Below this camber, in chords, a section has no place of largest camber.
const NO_CAMBER: f64 = 1e-12;
/// Below this camber, in chords, the largest camber has no derivative: which station is largest is a matter of
/// round-off.
const KINK: f64 = 1e-9;
/// Difference, in chords, below which two extremes tie.
const TIE: f64 = 1e-12;
/// Shortfall of a sample, in chords, below the largest one with which an extreme near it may still be the largest.
const SAMPLING: f64 = 1e-3;
/// Most samples from which extremes are sought. A plateau has many, all of them equal.
const MOST_STARTS: usize = 12;

/// Thickness is the difference of the surfaces, camber their mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Thickness,
    Camber,
}

impl Kind {
    fn combine<S: Scalar>(self, upper: S, lower: S) -> S {
        match self {
            Self::Thickness => upper - lower,
            Self::Camber => (upper + lower) * 0.5,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Thickness => "thickness",
            Self::Camber => "camber",
        }
    }

    /// The error of a derivative at a kink.
    fn tied(self) -> SectionError {
        let instead = match self {
            Self::Thickness => "\"thickness at 0.3\"",
            Self::Camber => "\"camber at 0.4\"",
        };
        SectionError::NoMeasure { measure: self.name(), reason: MeasureProblem::Tied { instead } }
    }
}

/// Refuses a station outside of the open interval (0, 1).
pub(super) fn check_station(measure: &'static str, station: f64) -> Result<(), SectionError> {
    if 0.0 < station && station < 1.0 {
        Ok(())
    } else {
        Err(SectionError::NoMeasure { measure, reason: MeasureProblem::StationOutOfRange { station } })
    }
}

impl<S: Scalar> Section<S> {
    /// Thickness (upper minus lower ordinate) at a station of the chord axis, in chords between 0 and 1.
    ///
    /// Where a surface passes the station more than once, the passage nearest to the nose along the curve counts.
    ///
    /// # Errors
    /// A station outside of (0, 1), or one that a surface does not reach.
    pub fn thickness_at(&self, station: f64) -> Result<S, SectionError> {
        self.at_station(Kind::Thickness, station)
    }

    /// Camber (mean of upper and lower ordinate) at a station of the chord axis, in chords between 0 and 1.
    ///
    /// # Errors
    /// As [`thickness_at`](Self::thickness_at).
    pub fn camber_at(&self, station: f64) -> Result<S, SectionError> {
        self.at_station(Kind::Camber, station)
    }

    /// Station (in chords) and value of the largest thickness.
    ///
    /// Where two maxima tie, to 1e-12 chords, the station jumps and the value has a kink.
    ///
    /// # Errors
    /// No isolated maximum between nose and trailing edge; [`MeasureProblem::Tied`] where derivatives are wanted and
    /// two maxima tie.
    pub fn maximum_thickness(&self) -> Result<[S; 2], SectionError> {
        self.extreme(Kind::Thickness)
    }

    /// Station (in chords) and value of the camber of largest magnitude.
    ///
    /// Where two extremes tie, to 1e-12 chords, the station jumps and the value has a kink.
    ///
    /// # Errors
    /// No isolated extreme, in particular a symmetric section; see [`camber`](Self::camber). [`MeasureProblem::Tied`]
    /// where derivatives are wanted and two extremes tie or the camber is below 1e-9 chords everywhere.
    pub fn maximum_camber(&self) -> Result<[S; 2], SectionError> {
        self.extreme(Kind::Camber)
    }

    /// The camber of largest magnitude, with its sign.
    ///
    /// A section with less than 1e-12 chords of camber everywhere has no place of largest camber; the value is then
    /// that at half the chord. There the largest camber has a kink: it grows whichever way a camber line bends, and at
    /// another station for every bend. So it has no derivative, and none is made up; [`camber_at`](Self::camber_at) is
    /// smooth.
    ///
    /// # Errors
    /// No isolated extreme of a camber that is not zero; [`MeasureProblem::Tied`] where derivatives are wanted and two
    /// extremes tie or the camber is below 1e-9 chords everywhere.
    pub fn camber(&self) -> Result<S, SectionError> {
        let real = self.real();
        let frame = real.chord_frame()?;
        let samples = Samples::new(real.curve(), &frame, real.nose_parameter());
        match samples.best(real.curve(), &frame, Kind::Camber) {
            Some((_, value)) if value.abs() > NO_CAMBER * frame.chord => Ok(self.maximum_camber()?[1]),
            _ if S::NDERIV > 0 => Err(Kind::Camber.tied()),
            _ => self.camber_at(0.5),
        }
    }

    fn at_station(&self, kind: Kind, station: f64) -> Result<S, SectionError> {
        check_station(kind.name(), station)?;
        let frame = self.chord_frame()?;
        let real = self.curve().real();
        let samples = Samples::new(&real, &frame.real(), self.nose_parameter());
        let mut ordinates = [S::from(0.0); 2];
        for (ordinate, (surface, name)) in
            ordinates.iter_mut().zip([(&samples.upper, "upper"), (&samples.lower, "lower")])
        {
            let missing = SectionError::NoMeasure {
                measure: kind.name(),
                reason: MeasureProblem::NoStation { surface: name, station },
            };
            let (u, slope) = solve_station(&real, &frame.real(), surface, station).ok_or(missing.clone())?;
            let off = |u: S| frame.coordinates(self.curve().evaluate(u))[0] - frame.chord * station;
            let u = lift_root(u, || slope, off).map_err(|_| missing)?;
            *ordinate = frame.coordinates(self.curve().evaluate(u))[1];
        }
        Ok(kind.combine(ordinates[0], ordinates[1]))
    }

    fn extreme(&self, kind: Kind) -> Result<[S; 2], SectionError> {
        let missing = SectionError::NoMeasure { measure: kind.name(), reason: MeasureProblem::NoExtreme };
        let frame = self.chord_frame()?;
        let real_frame = frame.real();
        let real = self.curve().real();
        let samples = Samples::new(&real, &real_frame, self.nose_parameter());
        let mut extremes = samples.extremes(&real, &real_frame, kind);
        // the first of equal ones, from the nose
        extremes.sort_by(|a, b| b.value.abs().total_cmp(&a.value.abs()));
        let best = extremes.first().ok_or(missing.clone())?;
        let (size, chord) = (best.value.abs(), real_frame.chord);
        if kind == Kind::Camber && size <= NO_CAMBER * chord {
            return Err(if S::NDERIV > 0 { kind.tied() } else { missing });
        }
        let other = |e: &Extreme| (e.u[0] - best.u[0]).abs() > 1e-6 && size - e.value.abs() <= TIE * chord;
        if S::NDERIV > 0 && (extremes.iter().any(other) || kind == Kind::Camber && size <= KINK * chord) {
            return Err(kind.tied());
        }
        let (u, jacobian) = (best.u, best.jacobian);
        let at = |u: S| frame.on(self.curve().point_and_tangent(u));
        let lifted = lift_roots(u, || jacobian, |[upper, lower]| stationarity(at(upper), at(lower), kind));
        let lifted = lifted.map_err(|_| missing)?;
        let (upper, lower) = (at(lifted[0]).0, at(lifted[1]).0);
        Ok([upper[0] / frame.chord, kind.combine(upper[1], lower[1])])
    }
}

/// An extreme of thickness or camber.
struct Extreme {
    /// Parameters on the upper and the lower surface.
    u: [f64; 2],
    value: f64,
    /// Jacobian of [`stationarity`], by columns.
    jacobian: [[f64; 2]; 2],
}

/// Both surfaces at a dense set of parameters, nose first: `(u, station, ordinate)` in the chord frame.
struct Samples {
    upper: Vec<[f64; 3]>,
    lower: Vec<[f64; 3]>,
}

impl Samples {
    fn new(curve: &BSplineCurve<f64>, frame: &ChordFrame<f64>, nose: f64) -> Self {
        let sample = |u: f64| {
            let [x, y] = frame.coordinates(curve.point_at(u));
            [u, x, y]
        };
        let parameters = dense_parameters(curve);
        let mut upper = vec![sample(nose)];
        let mut lower = upper.clone();
        upper.extend(parameters.iter().rev().filter(|&&u| u < nose).map(|&u| sample(u)));
        lower.extend(parameters.iter().filter(|&&u| u > nose).map(|&u| sample(u)));
        Self { upper, lower }
    }

    /// Parameters on the two surfaces and value at every upper sample that has a point of the lower surface below it.
    fn values(&self, curve: &BSplineCurve<f64>, frame: &ChordFrame<f64>, kind: Kind) -> Vec<([f64; 2], f64)> {
        let mut values = Vec::with_capacity(self.upper.len());
        let mut segment = 0;
        for &[u, x, y] in &self.upper[1..] {
            // both surfaces advance from the nose, as a rule monotonically
            while segment + 2 < self.lower.len() && self.lower[segment + 1][1] < x {
                segment += 1;
            }
            let Some((opposite, ordinate)) = self.opposite(curve, frame, segment, u, x) else { continue };
            values.push(([u, opposite], kind.combine(y, ordinate)));
        }
        values
    }

    /// The sample of largest magnitude.
    fn best(&self, curve: &BSplineCurve<f64>, frame: &ChordFrame<f64>, kind: Kind) -> Option<([f64; 2], f64)> {
        let larger = |a: ([f64; 2], f64), b: ([f64; 2], f64)| if b.1.abs() > a.1.abs() { b } else { a };
        self.values(curve, frame, kind).into_iter().reduce(larger)
    }

    /// The extremes that may be the largest in magnitude, found to round-off from the samples that stand out.
    fn extremes(&self, curve: &BSplineCurve<f64>, frame: &ChordFrame<f64>, kind: Kind) -> Vec<Extreme> {
        let values = self.values(curve, frame, kind);
        let size = |k: usize| values[k].1.abs();
        let largest = (0..values.len()).map(size).fold(0.0, f64::max);
        let stands_out = |k: &usize| {
            let falls_before = *k == 0 || size(*k) > size(k - 1);
            let falls_after = k + 1 == values.len() || size(*k) >= size(k + 1);
            falls_before && falls_after && size(*k) >= largest - SAMPLING * frame.chord
        };
        let mut starts: Vec<usize> = (0..values.len()).filter(stands_out).collect();
        starts.sort_by(|a, b| size(*b).total_cmp(&size(*a)));
        let mut found = Vec::new();
        for k in starts.into_iter().take(MOST_STARTS) {
            let (start, value) = values[k];
            let solve = |start| solve_extreme(curve, frame, kind, start, value);
            let narrowed = || self.narrowed(curve, frame, kind, start).and_then(solve);
            found.extend(solve(start).or_else(narrowed));
        }
        found
    }

    /// Parameter and ordinate of the lower point below the upper one at `u`, if it lies in the given segment.
    fn opposite(
        &self,
        curve: &BSplineCurve<f64>,
        frame: &ChordFrame<f64>,
        segment: usize,
        u: f64,
        x: f64,
    ) -> Option<(f64, f64)> {
        let &[a, b] = self.lower.get(segment..segment + 2)? else { return None };
        let share = (x - a[1]) / (b[1] - a[1]);
        if !(0.0..=1.0).contains(&share) {
            return None;
        }
        same_station(curve, frame, [u, a[0], b[0]], share, x)
    }

    /// A sampled extreme, narrowed down by bisection between the upper samples beside it.
    fn narrowed(
        &self,
        curve: &BSplineCurve<f64>,
        frame: &ChordFrame<f64>,
        kind: Kind,
        start: [f64; 2],
    ) -> Option<[f64; 2]> {
        let at = |u: f64| frame.on(curve.point_and_tangent(u));
        // lower parameter and the sign of the slope of thickness or camber
        let rise = |u: f64| {
            let upper = at(u);
            let x = upper.0[0];
            let segment = self.lower.windows(2).position(|w| w[0][1] <= x && x <= w[1][1])?;
            let opposite = self.opposite(curve, frame, segment, u, x)?.0;
            Some((opposite, stationarity(upper, at(opposite), kind)[1] > 0.0))
        };
        let index = self.upper.iter().position(|sample| sample[0] == start[0])?;
        let (mut low, mut high) = (self.upper.get(index.checked_sub(1)?)?[0], self.upper.get(index + 1)?[0]);
        let sign = rise(low)?.1;
        if rise(high)?.1 == sign {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if rise(middle)?.1 == sign { low = middle } else { high = middle }
        }
        let middle = 0.5 * (low + high);
        Some([middle, rise(middle)?.0])
    }
}

/// Parameter and ordinate of the point with abscissa `x` between two samples, by a few Newton steps from a share.
/// `None` where a surface stands upright, so that its ordinate is no good function of the station.
fn same_station(
    curve: &BSplineCurve<f64>,
    frame: &ChordFrame<f64>,
    [upper, low, high]: [f64; 3],
    share: f64,
    x: f64,
) -> Option<(f64, f64)> {
    let slopes_gently = |[along, across]: [f64; 2]| along.abs() > 0.01 * across.abs();
    let mut u = low + share * (high - low);
    let mut lies_flat = slopes_gently(frame.components(curve.point_and_tangent(upper).1));
    for _ in 0..4 {
        let (point, tangent) = frame.on(curve.point_and_tangent(u));
        lies_flat &= slopes_gently(tangent);
        if !lies_flat {
            return None;
        }
        u = (u - (point[0] - x) / tangent[0]).clamp(low.min(high), low.max(high));
    }
    Some((u, frame.coordinates(curve.point_at(u))[1]))
}

/// Parameter and `dx/du` at which a surface first reaches a station (in chords), counted from the nose.
fn solve_station(
    curve: &BSplineCurve<f64>,
    frame: &ChordFrame<f64>,
    surface: &[[f64; 3]],
    station: f64,
) -> Option<(f64, f64)> {
    let target = station * frame.chord;
    let at = |u: f64| {
        let (point, tangent) = frame.on(curve.point_and_tangent(u));
        (point[0] - target, tangent[0])
    };
    let pair = surface.windows(2).find(|pair| pair[0][1] <= target && pair[1][1] > target)?;
    // x rises from the first sample to the second, whichever parameter is larger
    let (from, to) = (pair[0][0], pair[1][0]);
    let u = isolated(from.min(to), from.max(to), from < to, at);
    let slope = at(u).1;
    (slope.is_finite() && slope != 0.0).then_some((u, slope))
}

/// Equal station and, for the extreme, `y_u' x_l' = ± y_l' x_u'` at a point of each surface (in the chord frame).
fn stationarity<S: Scalar>(upper: ([S; 2], [S; 2]), lower: ([S; 2], [S; 2]), kind: Kind) -> [S; 2] {
    let (rise_u, rise_l) = (upper.1[1] * lower.1[0], lower.1[1] * upper.1[0]);
    let stationary = match kind {
        Kind::Thickness => rise_u - rise_l,
        Kind::Camber => rise_u + rise_l,
    };
    [upper.0[0] - lower.0[0], stationary]
}

/// The extreme near a sample, by Newton.
fn solve_extreme(
    curve: &BSplineCurve<f64>,
    frame: &ChordFrame<f64>,
    kind: Kind,
    start: [f64; 2],
    sampled: f64,
) -> Option<Extreme> {
    let pair = frame.lifted::<Tangent<2>>();
    let at = |u: Tangent<2>| pair.on(curve.point_and_tangent(u));
    let (first, last) = curve.domain();
    let mut u = start;
    let mut previous = f64::INFINITY;
    for _ in 0..60 {
        let (upper, lower) = (at(Tangent::from_re(u[0]).derivative(0)), at(Tangent::from_re(u[1]).derivative(1)));
        let r = stationarity(upper, lower, kind);
        let jacobian = [0, 1].map(|k| r.map(|r| r.eps[k]));
        let step: [f64; 2] = (Matrix2::from(jacobian).try_inverse()? * Vector2::from(r.map(|r| r.re))).into();
        let size = step[0].abs().max(step[1].abs());
        // quadratic convergence ends where steps no longer shrink
        if size <= 1e-9 && size >= 0.5 * previous || size <= f64::EPSILON {
            let value = kind.combine(upper.0[1].re, lower.0[1].re);
            // an extreme is no smaller than what was sampled, to round-off
            let kept = value.abs() >= sampled.abs() - 1e-13 * frame.chord && value * sampled > 0.0;
            let inside = first < u[0] && u[0] < u[1] && u[1] < last;
            return (kept && inside).then_some(Extreme { u, value, jacobian });
        }
        previous = size;
        for (u, step) in u.iter_mut().zip(step) {
            // never out of the curve
            *u = (*u - step.clamp(-0.02, 0.02) * (last - first)).clamp(first, last);
        }
    }
    None
}
