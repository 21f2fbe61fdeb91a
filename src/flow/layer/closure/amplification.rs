//! Growth rate of the amplification factor by the envelope e^N method (Drela & Giles 1987, equations 29 to 32;
//! constants of XFOIL 6.99).

use super::larger;
use crate::scalar::Scalar;

/// Half width of the onset of growth, in decades of the momentum-thickness Reynolds number.
///
/// The published value is 0.08, with a cubic ramp. The stations slide over the onset while the shape changes, and a
/// ramp that is crossed between two stations makes drag depend on where they stand. The ramp is symmetric about the
/// critical Reynolds number, so that the width hardly moves transition: on 595 random points with free transition by
/// 7e-5 chords in the median and 5e-3 at most, and drag by 0.01 and 0.4 %.
const ONSET: f64 = 0.24;

/// Least value of the factor of the envelope slope that depends on 1/(Hk − 1), and width of the smooth passage to it.
/// It raises the growth by 0.5 % at Hk = 20, where the fit ends, and by 2.5 % at 30.
const LEAST_GROWTH: f64 = 0.01;

/// First part of the logarithm (base 10) of the momentum-thickness Reynolds number at which growth sets in; `log_shape`
/// is ln(Hk − 1).
fn basic_reynolds_log<S: Scalar>(log_shape: S) -> S {
    (log_shape * -0.43).exp() * 2.492
}

/// Second part of the logarithm of the Reynolds number at which growth sets in, behind [`basic_reynolds_log`]; it is
/// positive, and counts in accelerated layers. `h` is 1/(Hk − 1).
fn further_reynolds_log<S: Scalar>(h: S) -> S {
    ((h * 14.0 - 9.24).saturating_tanh() + 1.0) * 0.7
}

/// Growth of the amplification factor n per length, multiplied by the momentum thickness, beyond the onset; `h` is
/// 1/(Hk − 1).
pub(crate) fn envelope_slope<S: Scalar>(h: S) -> S {
    let per_reynolds = h.recip() * 0.028 - (-(h * 3.87 - 2.52).powi(2)).exp() * 0.0345;
    // beyond Hk = 52 the fit falls below zero, where layers would damp what they amplify
    let reynolds_growth = ((h * 3.0 - 5.5) * h + 2.7) * h - 0.05;
    per_reynolds * larger(reynolds_growth, S::from(LEAST_GROWTH), LEAST_GROWTH)
}

/// Growth rate dn/ds of the amplification factor, per unit of the length in which the momentum thickness θ is given,
/// from the natural logarithms ln(Hk − 1), ln θ and ln Re_θ.
pub(crate) fn growth_rate<S: Scalar>(log_shape: S, log_theta: S, reynolds_log: S) -> S {
    let beyond_basic = reynolds_log * std::f64::consts::LOG10_E - basic_reynolds_log(log_shape);
    // most stations far ahead of the onset need no more than this
    if beyond_basic.re() <= -ONSET {
        return S::from(0.0);
    }
    let h = (-log_shape).exp();
    let r = beyond_basic - further_reynolds_log(h);
    if r.re() <= -ONSET {
        return S::from(0.0);
    }
    let rate = envelope_slope(h) * (-log_theta).exp();
    if r.re() >= ONSET {
        return rate;
    }
    // quintic ramp: value, slope and curvature are continuous
    let t = (r + ONSET) / (2.0 * ONSET);
    rate * t * t * t * ((t * 6.0 - 15.0) * t + 10.0)
}

#[cfg(test)]
mod tests {
    use super::super::testing::{check_gradient, relation};
    use super::*;

    /// Logarithm (base 10) of the momentum-thickness Reynolds number at which growth sets in.
    fn critical_reynolds_log(hk: f64) -> f64 {
        basic_reynolds_log((hk - 1.0).ln()) + further_reynolds_log(1.0 / (hk - 1.0))
    }

    fn slope_at<S: Scalar>(hk: S) -> S {
        envelope_slope((hk - 1.0).recip())
    }

    fn rate_at<S: Scalar>(hk: S, theta: S, re_theta: S) -> S {
        growth_rate((hk - 1.0).ln(), theta.ln(), re_theta.ln())
    }

    #[test]
    fn the_blasius_layer_becomes_unstable_where_it_should() {
        // values of the formulas themselves at H = 2.5911
        assert!((10f64.powf(critical_reynolds_log(2.5911)) / 282.6 - 1.0).abs() < 2e-3);
        let h: f64 = 1.0 / 1.5911;
        let per_reynolds =
            slope_at(2.5911) / (-0.05 + 2.7 * h - 5.5 * h * h + 3.0 * h.powi(3) + 0.1 * (-20.0 * h).exp());
        assert!((per_reynolds / 0.01031 - 1.0).abs() < 2e-3, "{per_reynolds}");
        assert_eq!(rate_at(2.5911, 1e-3, 160.0), 0.0);
        assert!((rate_at(2.5911f64, 1e-3, 500.0) / (slope_at(2.5911) / 1e-3) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn the_ramp_is_symmetric_about_the_critical_reynolds_number() {
        let critical = 10f64.powf(critical_reynolds_log(2.5911));
        let full = slope_at(2.5911f64);
        for ratio in [1.05, 1.2, 1.5, 1.7] {
            let sum = rate_at(2.5911, 1.0, critical * ratio) + rate_at(2.5911, 1.0, critical / ratio);
            assert!((sum / full - 1.0).abs() < 1e-12, "{ratio}: {sum}");
        }
    }

    #[test]
    fn derivatives_are_exact_before_on_and_behind_the_ramp() {
        for (hk, re) in [(2.5911, 150.0), (2.5911, 200.0), (2.5911, 400.0), (2.5911, 500.0), (3.5, 120.0), (6.0, 90.0)]
        {
            check_gradient(&relation!(|h, re| rate_at(h, S::from(0.7), re)), hk, re);
        }
    }
}
