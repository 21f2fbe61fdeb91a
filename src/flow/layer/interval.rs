//! Residuals of the boundary-layer equations over one interval between two stations.
//!
//! The equations are the momentum and kinetic-energy integral equations in logarithmic differences, the lag equation
//! for the shear stress, and the envelope amplification (Drela & Giles 1987, equations 1 to 8; Drela, XFOIL, 1989,
//! section 3).
//!
//! XFOIL takes means of both ends. Here integrals over an interval are by Simpson's rule, with the logarithms of θ and
//! Hk − 1 straight in between. Towards separation these quantities grow exponentially, and the mean of the ends is too
//! large by a twelfth of the square of the logarithmic change. With forty turbulent stations the error of the drag of
//! eight sections close to separation (NACA 4621 to 6620) was 0.1 to 0.6 %, and 0.7 to 1.9 % with means.

use super::closure::turbulent::{LAG, LOCUS_B, WAKE_DISSIPATION_LENGTH, equilibrium_gradient, friction};
use super::closure::{amplification, laminar, turbulent};
use super::edge::EdgeLaw;
use super::station::{Derived, Regime, State};
use crate::scalar::Scalar;

/// Abscissas of the two ends of an interval and, in the wake, the dead-air gap behind a blunt edge there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span<S> {
    /// Arc lengths of the ends from the stagnation point, in chords.
    pub x: [S; 2],
    /// Gaps of the wake at the ends, in chords; zero on walls.
    pub gap: [S; 2],
}

impl<S: Scalar> Span<S> {
    /// An interval on a wall, where there is no gap.
    pub fn on_wall(x: [S; 2]) -> Self {
        Self { x, gap: [S::from(0.0); 2] }
    }
}

/// Integral over an interval of unit length by Simpson's rule, from the values at the start, in the middle and at the
/// end.
fn simpson<S: Scalar>(start: S, middle: S, end: S) -> S {
    (start + middle * 4.0 + end) * (1.0 / 6.0)
}

/// Value in the middle of an interval of a positive quantity whose logarithm is straight over the interval.
fn middle<S: Scalar>(start: S, end: S) -> S {
    (start * end).sqrt()
}

/// Weight of the downstream end in the upwinded averages: 1/2 where Hk changes slowly, 1 where it jumps.
pub(super) fn upwind_weight<S: Scalar>(a: &Derived<S>, b: &Derived<S>, regime: Regime) -> S {
    let constant = if regime == Regime::Wake { 1.0 } else { 5.0 };
    let change = b.state.log_shape - a.state.log_shape;
    -(-(change * change * constant / (b.hk * b.hk))).exp() * 0.5 + 1.0
}

/// Residuals of the momentum and kinetic-energy equations between the stations `a` (upstream) and `b`; `upwind` is their
/// [weight](upwind_weight).
pub(super) fn momentum_and_energy<S: Scalar>(
    a: &Derived<S>,
    b: &Derived<S>,
    span: &Span<S>,
    regime: Regime,
    upwind: S,
) -> [S; 2] {
    let [x1, x2] = span.x;
    let mean = |p: S, q: S| (p + q) * 0.5;
    let mach2 = mean(a.mach2, b.mach2);
    let shape = simpson(a.shape, middle(a.shape - 1.0, b.shape - 1.0) + 1.0, b.shape);
    let wake_gap = match regime {
        Regime::Wake => mean(span.gap[0] / a.theta, span.gap[1] / b.theta),
        _ => S::from(0.0),
    };
    let (speed_ratio, x_ratio) = (b.log_speed - a.log_speed, (x2 / x1).ln());
    let (r1, r2) = (x1 / a.theta, x2 / b.theta);
    let r = middle(r1, r2);
    let halfway = middle_friction(middle(a.hk - 1.0, b.hk - 1.0) + 1.0, middle(a.re_theta, b.re_theta), mach2, regime);
    let friction_mean = simpson(a.friction * r1, halfway * r, b.friction * r2);
    let momentum = b.state.log_theta - a.state.log_theta + (shape + wake_gap - mach2 + 2.0) * speed_ratio
        - x_ratio * friction_mean * 0.5;

    let excess = |d: &Derived<S>| d.friction * 0.5 - d.dissipation;
    let (work1, work2) = (excess(a) * r1, excess(b) * r2);
    let work = simpson(work1, mean(excess(a), excess(b)) * r, work2) + (work2 - work1) * (upwind - 0.5);
    let density = mean(a.density_shape, b.density_shape) / mean(a.energy_shape, b.energy_shape);
    let energy = (b.energy_shape / a.energy_shape).ln()
        + (density * 2.0 + 1.0 - shape - wake_gap) * speed_ratio
        + x_ratio * work;
    [momentum, energy]
}

/// Skin-friction coefficient in the middle of an interval.
fn middle_friction<S: Scalar>(hk: S, re_theta: S, mach2: S, regime: Regime) -> S {
    match regime {
        Regime::Laminar => laminar::friction(hk, re_theta),
        Regime::Turbulent => friction(hk, re_theta, mach2),
        Regime::Wake => S::from(0.0),
    }
}

/// Residual of the lag equation of the shear stress between the stations `a` (upstream) and `b`, divided by 2 δ; `upwind`
/// is their [weight](upwind_weight).
pub(super) fn lag<S: Scalar>(a: &Derived<S>, b: &Derived<S>, span: &Span<S>, regime: Regime, upwind: S) -> S {
    let mean = |p: S, q: S| (p + q) * 0.5;
    let upwinded = |p: S, q: S| p + (q - p) * upwind;
    let step = span.x[1] - span.x[0];
    let (kind, length) = match regime {
        Regime::Wake => (turbulent::Kind::Wake, WAKE_DISSIPATION_LENGTH),
        _ => (turbulent::Kind::Wall, 1.0),
    };
    let gradient = equilibrium_gradient(
        upwinded(a.hk, b.hk),
        mean(a.re_theta, b.re_theta),
        upwinded(a.friction, b.friction),
        mean(a.displacement, b.displacement),
        kind,
    );
    let relaxation = (mean(a.slip, b.slip) + 1.0).recip() * (LAG / LOCUS_B);
    let excess = upwinded(a.equilibrium_stress, b.equilibrium_stress) - upwinded(a.stress, b.stress) * length;
    let (d1, d2) = (a.thickness.recip(), b.thickness.recip());
    relaxation * excess * step * simpson(d1, middle(d1, d2), d2) * 0.5 - (b.state.log_stress() - a.state.log_stress())
        + gradient * step
        - (b.log_speed - a.log_speed)
}

/// Nodes and weights of the four-point Gauss rule on (0, 1).
const GAUSS: [[f64; 2]; 4] = [
    [0.069_431_844_202_973_71, 0.173_927_422_568_726_93],
    [0.330_009_478_207_571_87, 0.326_072_577_431_273_07],
    [0.669_990_521_792_428_1, 0.326_072_577_431_273_07],
    [0.930_568_155_797_026_3, 0.173_927_422_568_726_93],
];

/// Mean growth rate of the amplification factor per chord between two stations, by Gauss quadrature along straight ln
/// θ, ln(Hk − 1) and ln u.
///
/// The onset of growth travels through the intervals as the shape changes; quadrature inside the interval keeps the
/// solution from depending on where it stands. The amplification equation is n_b − n_a − (x_b − x_a) · growth = 0.
pub(super) fn growth<S: Scalar>(a: &State<S>, b: &State<S>, law: &impl EdgeLaw<Number = S>) -> S {
    let mut growth = S::from(0.0);
    for [at, weight] in GAUSS {
        // the state on the straight line between both; the rate does not depend on the third unknown
        let state = a.zip(b, |p, q| p + (q - p) * at);
        growth += growth_rate(&state, law) * weight;
    }
    growth
}

/// Local growth rate of the amplification factor, per chord.
fn growth_rate<S: Scalar>(state: &State<S>, law: &impl EdgeLaw<Number = S>) -> S {
    let reynolds_log = law.edge(state.speed()).reynolds.ln() + state.log_theta;
    amplification::growth_rate(state.log_shape, state.log_theta, reynolds_log)
}

/// Residuals of the momentum and kinetic-energy equations of the first station, where u is proportional to x and the
/// layer is similar.
pub(super) fn similarity<S: Scalar>(first: &Derived<S>, x: S) -> [S; 2] {
    let r = x / first.theta;
    let momentum = first.shape - first.mach2 + 2.0 - first.friction * r * 0.5;
    let energy = first.density_shape / first.energy_shape * 2.0 + 1.0 - first.shape
        + (first.friction * 0.5 - first.dissipation) * r;
    [momentum, energy]
}

/// The two layers at the trailing edge merged into one at the start of the wake.
pub(crate) struct Merged<S> {
    /// Sum of the momentum thicknesses, in chords.
    pub theta: S,
    /// Sum of the displacement thicknesses, in chords.
    pub displacement: S,
    /// Mean of the roots of the shear-stress coefficients, weighted with the momentum thicknesses.
    pub stress: S,
}

impl<S: Scalar> Merged<S> {
    /// Merges the last stations of the upper and the lower side.
    pub fn new(upper: &Derived<S>, lower: &Derived<S>) -> Self {
        let theta = upper.theta + lower.theta;
        Self {
            theta,
            displacement: upper.displacement + lower.displacement,
            stress: (upper.stress * upper.theta + lower.stress * lower.theta) / theta,
        }
    }

    /// Residuals of the first station of the wake: momentum thickness, displacement thickness and shear stress.
    pub(crate) fn residual(&self, wake: &Derived<S>) -> [S; 3] {
        [
            wake.state.log_theta - self.theta.ln(),
            (wake.displacement / self.displacement).ln(),
            wake.state.log_stress() - self.stress.ln(),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::super::edge::FreeStream;
    use super::*;

    fn station(x: f64, thickness: f64, hk: f64, third: f64, regime: Regime, stream: &FreeStream<f64>) -> Derived<f64> {
        let theta = thickness * x.sqrt();
        Derived::new(State { log_theta: theta.ln(), log_shape: (hk - 1.0).ln(), third, log_speed: 0.0 }, regime, stream)
    }

    #[test]
    fn the_blasius_layer_satisfies_the_equations_within_the_closure() {
        let stream = FreeStream::new(0.0, 1e6);
        let at = |x: f64| station(x, 0.66412e-3, 2.5911, 0.0, Regime::Laminar, &stream);
        let span = Span { x: [0.5, 0.6], gap: [0.0; 2] };
        let [momentum, energy] = momentum_and_energy(&at(0.5), &at(0.6), &span, Regime::Laminar, 0.5);
        // the friction of the closure is 3 % below the exact one, its dissipation 1 % off
        assert!(momentum.abs() < 0.04 * 0.5 * 1.2f64.ln(), "{momentum}");
        assert!(energy.abs() < 0.04 * 0.5 * 1.2f64.ln(), "{energy}");
    }

    #[test]
    fn what_grows_exponentially_is_integrated_well() {
        // over a logarithmic change of 0.6, where the mean of the ends is 3 % too large
        let (start, growth) = (0.4, 0.6f64);
        let end = start * growth.exp();
        let integral = (end - start) / growth;
        assert!((simpson(start, middle(start, end), end) / integral - 1.0).abs() < 1e-4);
        assert!((0.5 * (start + end) / integral - 1.0) > 0.02);
    }

    #[test]
    fn amplification_of_the_blasius_layer() {
        // n per Re_θ of the envelope at H 2.5911 is 0.01031 by the formulas
        let stream = FreeStream::new(0.0, 1e6);
        let state = |x: f64| station(x, 0.66412e-3, 2.5911, 0.0, Regime::Laminar, &stream).state;
        let growth = growth(&state(0.7), &state(0.72), &stream) * 0.02;
        let reynolds = |x: f64| 1e6 * 0.66412e-3 * f64::sqrt(x);
        assert!((growth / (0.01031 * (reynolds(0.72) - reynolds(0.7))) - 1.0).abs() < 0.01, "{growth}");
        assert_eq!(super::growth(&state(0.01), &state(0.02), &stream), 0.0);
    }

    #[test]
    fn the_first_station_is_a_stagnation_layer() {
        // with the exact H and θ of Hiemenz' flow (β = 1) both equations hold within the accuracy of the closure
        let stream = FreeStream::new(0.0, 1e6);
        let x: f64 = 0.01;
        let theta = (0.085465 * x / 1e6).sqrt();
        let state = State { log_theta: theta.ln(), log_shape: 1.21623f64.ln(), third: 0.0, log_speed: 0.0 };
        let [momentum, energy] = similarity(&Derived::new(state, Regime::Laminar, &stream), x);
        // (terms of size 4 and 1.2)
        assert!(momentum.abs() < 0.1 && energy.abs() < 0.07, "{momentum} {energy}");
    }

    #[test]
    fn the_lag_vanishes_in_equilibrium_without_gradient() {
        let stream = FreeStream::new(0.0, 3e6);
        let at = |x: f64| {
            let guess = station(x, 2e-3, 1.4, -3.0, Regime::Turbulent, &stream);
            station(x, 2e-3, 1.4, guess.equilibrium_stress.ln(), Regime::Turbulent, &stream)
        };
        let span = Span { x: [0.5, 0.501], gap: [0.0; 2] };
        let residual = lag(&at(0.5), &at(0.501), &span, Regime::Turbulent, 0.5);
        assert!(residual.abs() < 1e-3, "{residual}");
    }
}
