//! Closure relations of a turbulent layer (Swafford's profiles; Drela & Giles 1987, equations 18 to 28; constants of
//! XFOIL 6.99).

use super::{laminar, larger, smaller};
use crate::scalar::Scalar;

/// Slope A of the G-beta locus of equilibrium layers.
pub(crate) const LOCUS_A: f64 = 6.7;
/// Width B of the G-beta locus of equilibrium layers.
pub(crate) const LOCUS_B: f64 = 0.75;
/// Wall term C of the G-beta locus of equilibrium layers.
const LOCUS_C: f64 = 18.0;
/// Constant of the lag equation of the shear stress.
pub(crate) const LAG: f64 = 5.6;
/// Ratio of the dissipation length at a wall to that in the wake.
pub(crate) const WAKE_DISSIPATION_LENGTH: f64 = 0.9;

/// Kind of turbulent flow: a layer on a wall or the wake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Turbulent layer on a wall.
    Wall,
    /// The wake, both halves together.
    Wake,
}

/// Kinetic-energy shape parameter H* of a turbulent layer at zero Mach number.
pub(crate) fn energy_shape<S: Scalar>(hk: S, re_theta: S) -> S {
    let ho = larger(re_theta, S::from(400.0), 20.0).recip() * 400.0 + 3.0;
    let re = larger(re_theta, S::from(200.0), 10.0);
    let base = re.recip() * 4.0 + 1.5;
    let below = (ho - hk).positive_part(0.02) / (ho - 1.0);
    let attached = (-base + 2.0) * below * below * 1.5 / (hk + 0.5);
    let above = (hk - ho).positive_part(0.02);
    let log = re.ln();
    let separated = above * above * (log * 0.007 / (above + log.recip() * 4.0).powi(2) + hk.recip() * 0.015);
    attached + separated + base
}

/// Skin-friction coefficient of a turbulent layer on the dynamic pressure at the edge, not below the laminar one.
pub(crate) fn friction<S: Scalar>(hk: S, re_theta: S, mach2: S) -> S {
    not_laminar(wall_friction(hk, re_theta, mach2), hk, re_theta)
}

/// A [turbulent friction](wall_friction), raised to the laminar one where that is larger.
pub(crate) fn not_laminar<S: Scalar>(wall_friction: S, hk: S, re_theta: S) -> S {
    larger(wall_friction, laminar::friction(hk, re_theta), 2e-5)
}

/// Skin-friction coefficient of a turbulent layer on the dynamic pressure at the edge, however small: the dissipation
/// at the wall takes this one (Drela, XFOIL 6.99).
pub(crate) fn wall_friction<S: Scalar>(hk: S, re_theta: S, mach2: S) -> S {
    let fc = (mach2 * 0.2 + 1.0).sqrt();
    let log = larger((re_theta / fc).ln(), S::from(3.0), 0.05);
    let exponent = -(hk * 1.33);
    let power = (log / std::f64::consts::LN_10).ln() * (-(hk * 0.31) - 1.74);
    let wall = (exponent + power).exp() * 0.3;
    let defect = (((-hk / 0.875) + 4.0).saturating_tanh() - 1.0) * 1.1e-4;
    (wall + defect) / fc
}

/// Equivalent slip speed Us of the wall layer, over the speed at the edge. `h` is the shape parameter H.
pub(crate) fn slip_speed<S: Scalar>(hk: S, h: S, hstar: S, kind: Kind) -> S {
    let us = hstar * 0.5 * (-((hk - 1.0) / (h * LOCUS_B)) + 1.0);
    match kind {
        Kind::Wall => smaller(us, S::from(0.96), 0.01),
        Kind::Wake => smaller(us, S::from(0.995), 0.002),
    }
}

/// The term Hk − 1 − C/Re of the G-beta locus, kept positive. In the wake there is no wall term C/Re.
pub(crate) fn locus_shape<S: Scalar>(hk: S, re_theta: S, kind: Kind) -> S {
    let wall = match kind {
        Kind::Wall => re_theta.recip() * LOCUS_C,
        Kind::Wake => S::from(0.0),
    };
    larger(hk - 1.0 - wall, S::from(0.01), 0.01)
}

/// Square root of the shear-stress coefficient of an equilibrium layer.
pub(crate) fn equilibrium_stress_root<S: Scalar>(hk: S, h: S, hstar: S, us: S, re_theta: S, kind: Kind) -> S {
    let constant = 0.5 / (LOCUS_A * LOCUS_A * LOCUS_B);
    let hkc = locus_shape(hk, re_theta, kind);
    (hstar * (hk - 1.0) * hkc * hkc * constant / ((-us + 1.0) * h * hk * hk)).sqrt()
}

/// Logarithmic speed gradient u'/u, per length, at which a layer of the given state is in equilibrium.
pub(crate) fn equilibrium_gradient<S: Scalar>(hk: S, re_theta: S, friction: S, displacement: S, kind: Kind) -> S {
    let a = match kind {
        Kind::Wall => LOCUS_A,
        Kind::Wake => LOCUS_A * WAKE_DISSIPATION_LENGTH,
    };
    let ratio = locus_shape(hk, re_theta, kind) / (hk * a);
    (friction * 0.5 - ratio * ratio) / (displacement * LOCUS_B)
}

/// Dissipation 2 CD / H* of a turbulent layer on a wall, not below the laminar one.
///
/// `friction` is the [turbulent friction alone](wall_friction), and `stress_root` is the square root of the shear-stress
/// coefficient.
pub(crate) fn wall_dissipation<S: Scalar>(hk: S, hstar: S, us: S, friction: S, stress_root: S, re_theta: S) -> S {
    let log = larger(re_theta.ln(), S::from(1.0), 0.1);
    // (Hk − 1)/(Hmin − 1) with Hmin = 1 + 2.1/ln Re
    let inner = (((hk - 1.0) * log / 2.1).saturating_tanh() + 1.0) * 0.5;
    let wall = friction * us / hstar * inner;
    larger(wall + outer_dissipation(hstar, us, stress_root, re_theta), laminar::dissipation(hk, re_theta), 1e-5)
}

/// Dissipation 2 CD / H* of both halves of the wake together. `stress_root` is the square root of the shear-stress
/// coefficient.
pub(crate) fn wake_dissipation<S: Scalar>(hk: S, hstar: S, us: S, stress_root: S, re_theta: S) -> S {
    let outer = outer_dissipation(hstar, us, stress_root, re_theta);
    larger(outer, laminar::wake_dissipation(hk, hstar, re_theta), 1e-6) * 2.0
}

/// Part of the dissipation 2 CD / H* in the outer layer: turbulent and laminar shear stress against the slip speed.
fn outer_dissipation<S: Scalar>(hstar: S, us: S, stress_root: S, re_theta: S) -> S {
    let defect = -us + 0.995;
    (stress_root * stress_root * defect + defect * defect / re_theta * 0.15) * 2.0 / hstar
}

/// Square root of the shear-stress coefficient just behind transition, over its equilibrium value (XFOIL 6.99).
pub(crate) fn initial_stress_ratio<S: Scalar>(hk: S) -> S {
    (-(hk - 1.0).recip() * 3.3).exp() * 1.8
}

#[cfg(test)]
mod tests {
    use super::super::testing::{check_gradient, relation};
    use super::*;

    #[test]
    fn published_formulas_away_from_their_clips() {
        // by hand from the published relations at Hk 1.4, Re 3000 and Hk 3.5, Re 1000, M 0
        let base = 1.5 + 4.0 / 3000.0;
        let ho: f64 = 3.0 + 400.0 / 3000.0;
        let expected = (2.0 - base) * ((ho - 1.4) / (ho - 1.0)).powi(2) * 1.5 / 1.9 + base;
        assert!((energy_shape(1.4, 3000.0) - expected).abs() < 2e-5);
        let (a, l) = (3.5 - 3.4, 1000f64.ln());
        let expected = a * a * (0.007 * l / (a + 4.0 / l).powi(2) + 0.015 / 3.5) + 1.504;
        assert!((energy_shape(3.5, 1000.0) - expected).abs() < 2e-5);
        let expected = 0.3 * (-1.33f64 * 1.4).exp() * 3000f64.log10().powf(-1.74 - 0.31 * 1.4)
            + 1.1e-4 * ((4.0 - 1.4f64 / 0.875).tanh() - 1.0);
        assert!((friction(1.4, 3000.0, 0.0) / expected - 1.0).abs() < 1e-4);
    }

    #[test]
    fn the_flat_plate_has_its_friction() {
        // Kármán-Schoenherr: 1/cf = 17.08 log² Re_θ + 25.11 log Re_θ + 6.012
        let re_theta = 2000.0f64;
        let log = re_theta.log10();
        let expected = 1.0 / (17.08 * log * log + 25.11 * log + 6.012);
        let cf = friction(1.42, re_theta, 0.0);
        assert!((cf / expected - 1.0).abs() < 0.1, "{cf} {expected}");
        let us = slip_speed(1.42, 1.42, energy_shape(1.42, re_theta), Kind::Wall);
        let eq = equilibrium_stress_root(1.42, 1.42, energy_shape(1.42, re_theta), us, re_theta, Kind::Wall);
        // the equilibrium stress of a flat plate is close to the wall stress, cf/2
        assert!((eq * eq / (0.5 * cf) - 1.0).abs() < 0.35, "{} {}", eq * eq, 0.5 * cf);
    }

    #[test]
    fn equilibrium_on_a_flat_plate_has_almost_no_gradient() {
        let (re, hk) = (3000.0f64, 1.42);
        let gradient = equilibrium_gradient(hk, re, friction(hk, re, 0.0), 1.0, Kind::Wall);
        assert!(gradient.abs() < 1e-3, "{gradient}");
    }

    #[test]
    fn derivatives_are_exact() {
        for hk in [1.05, 1.4, 2.2, 3.2, 6.0] {
            for re in [150.0, 420.0, 5000.0] {
                check_gradient(&relation!(|h, re| energy_shape(h, re)), hk, re);
                check_gradient(&relation!(|h, re| friction(h, re, S::from(0.3))), hk, re);
                for kind in [Kind::Wall, Kind::Wake] {
                    struct Slip(Kind);
                    impl super::super::testing::Relation for Slip {
                        fn at<S: Scalar>(&self, h: S, re: S) -> S {
                            let hstar = energy_shape(h, re);
                            let us = slip_speed(h, h, hstar, self.0);
                            let eq = equilibrium_stress_root(h, h, hstar, us, re, self.0);
                            let cf = wall_friction(h, re, S::from(0.0));
                            let gradient = equilibrium_gradient(h, re, cf, h * 0.01, self.0);
                            let wall = wall_dissipation(h, hstar, us, cf, eq, re);
                            let wake = wake_dissipation(h, hstar, us, eq, re);
                            eq + gradient + wall * 100.0 + wake * 30.0
                        }
                    }
                    check_gradient(&Slip(kind), hk, re);
                }
                check_gradient(&relation!(|h, re| initial_stress_ratio(h) * re), hk, re);
            }
        }
    }
}
