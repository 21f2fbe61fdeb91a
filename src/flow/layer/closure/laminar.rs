//! Closure relations of a laminar layer, fitted to the Falkner-Skan profiles (Drela & Giles 1987, equations 13 to 17;
//! constants of XFOIL).

use crate::scalar::Scalar;

/// Kinetic-energy shape parameter H* of a laminar layer at zero Mach number.
pub(crate) fn energy_shape<S: Scalar>(hk: S) -> S {
    let a = hk - 4.35;
    let attached = (a * a * 0.0111 - a * a * a * 0.0278) / (hk + 1.0) - (a * hk).powi(2) * 0.0002;
    let separated = a * a * 0.015 / hk;
    // logistic weight of the separated branch; both branches and their slopes vanish at a = 0
    let weight = ((a / 0.06).saturating_tanh() + 1.0) * 0.5;
    attached + (separated - attached) * weight + 1.528
}

/// Skin-friction coefficient of a laminar layer, on the dynamic pressure at the edge.
pub(crate) fn friction<S: Scalar>(hk: S, re_theta: S) -> S {
    let below = (-hk + 5.5).positive_part(0.02);
    let above = (hk - 5.5).positive_part(0.02);
    let attached = below * below * below / (hk + 1.0) * 0.0727;
    let separated = (above / (above + 1.0)).powi(2) * 0.015;
    (attached + separated - 0.07) / re_theta
}

/// Dissipation 2 CD / H* of a laminar layer, with the dissipation coefficient CD.
pub(crate) fn dissipation<S: Scalar>(hk: S, re_theta: S) -> S {
    let below = (-hk + 4.0).positive_part(0.02);
    let above = (hk - 4.0).positive_part(0.02).powi(2);
    let root = below.sqrt();
    (below.powi(5) * root * 0.00205 + 0.207 - above * 0.0016 / (above * 0.02 + 1.0)) / re_theta
}

/// Dissipation 2 CD / H* of one half of a laminar wake, with the dissipation coefficient CD.
pub(crate) fn wake_dissipation<S: Scalar>(hk: S, hstar: S, re_theta: S) -> S {
    let defect = -hk.recip() + 1.0;
    defect * defect / (hk * hstar * re_theta) * 2.2
}

#[cfg(test)]
mod tests {
    use super::super::testing::{check_gradient, relation};
    use super::*;

    /// Falkner-Skan profiles: H, H*, Re cf/2, Re 2CD/H* (solutions of f''' + f f'' + β(1 − f'²) = 0 to 1e-9).
    const FALKNER_SKAN: [[f64; 4]; 8] = [
        [2.21623, 1.62575, 0.360339, 0.256394],
        [2.29694, 1.61173, 0.324939, 0.245379],
        [2.48089, 1.58533, 0.255629, 0.227548],
        [2.59110, 1.57258, 0.220524, 0.220524],
        [2.80111, 1.55328, 0.164438, 0.212216],
        [3.02094, 1.53863, 0.117957, 0.208058],
        [3.29673, 1.52630, 0.073028, 0.206266],
        [4.0291, 1.5151, 0.0, 0.2064],
    ];

    #[test]
    fn falkner_skan_profiles_are_met_within_the_accuracy_of_the_fits() {
        for [h, hstar, friction_half, dissipation_rate] in FALKNER_SKAN {
            assert!((energy_shape(h) / hstar - 1.0).abs() < 0.01, "H* at {h}");
            assert!((friction(h, 1.0) / 2.0 - friction_half).abs() < 0.018, "cf at {h}");
            assert!((dissipation(h, 1.0) / dissipation_rate - 1.0).abs() < 0.02, "dissipation at {h}");
        }
    }

    #[test]
    fn tabulated_values_of_the_published_branches() {
        // 0.0727 · 2.909³/3.591 − 0.07 at Hk = 2.591, and the branch beyond separation at 8
        assert!((friction(2.591f64, 1.0) - 0.428370).abs() < 2e-5);
        assert!((friction(8.0, 1.0) - (0.015 * (1.0 - 1.0 / 3.5f64).powi(2) - 0.07)).abs() < 1e-6);
        assert!((energy_shape(6.0) - (0.015 * 1.65f64.powi(2) / 6.0 + 1.528)).abs() < 1e-12);
        assert!((dissipation(6.0f64, 1.0) - (0.207 - 0.0064 / 1.08)).abs() < 1e-5);
        assert!((energy_shape(2.5911f64) - 1.5755).abs() < 1e-4);
    }

    #[test]
    fn derivatives_are_exact() {
        for hk in [1.3, 2.591, 4.0, 4.35, 5.5, 9.0] {
            for re in [30.0, 800.0] {
                check_gradient(&relation!(|h, re| energy_shape(h) * re), hk, re);
                check_gradient(&relation!(|h, re| friction(h, re)), hk, re);
                check_gradient(&relation!(|h, re| dissipation(h, re)), hk, re);
                check_gradient(&relation!(|h, re| wake_dissipation(h, h * 0.2 + 1.3, re)), hk, re);
            }
        }
    }
}
