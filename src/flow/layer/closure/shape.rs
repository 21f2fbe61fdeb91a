//! Shape parameters and the thickness that laminar and turbulent layers share.

use super::smaller;
use crate::scalar::Scalar;

/// Shape parameter H = δ*/θ from the kinematic shape parameter (Whitfield; Drela & Giles 1987, equation 9 solved for
/// H).
pub(crate) fn shape_parameter<S: Scalar>(hk: S, mach2: S) -> S {
    hk * (mach2 * 0.113 + 1.0) + mach2 * 0.29
}

/// Kinematic shape parameter from H = δ*/θ: the inverse of [`shape_parameter`].
pub(crate) fn kinematic_shape<S: Scalar>(h: S, mach2: S) -> S {
    (h - mach2 * 0.29) / (mach2 * 0.113 + 1.0)
}

/// Density shape parameter H** (Drela & Giles 1987, equation 12).
pub(crate) fn density_shape<S: Scalar>(hk: S, mach2: S) -> S {
    // Hk comes down to 1 in the wake, so that the pole at 0.8 stays out of reach
    mach2 * ((hk - 0.8).recip() * 0.064 + 0.251)
}

/// Thickness δ of the layer (Drela & Giles 1987, equation 23), at most 12 θ, in the unit of `theta` and `displacement`.
pub(crate) fn thickness<S: Scalar>(hk: S, theta: S, displacement: S) -> S {
    let ratio = (hk - 1.0).recip() * 1.72 + 3.15 + displacement / theta;
    theta * smaller(ratio, S::from(12.0), 0.1)
}

/// Kinetic-energy shape parameter H* at a Mach number, by Whitfield's correction of the incompressible value.
pub(crate) fn compressible_energy_shape<S: Scalar>(hstar: S, mach2: S) -> S {
    (hstar + mach2 * 0.028) / (mach2 * 0.014 + 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shape_parameter_inverts_whitfield() {
        let (hk, m2) = (1.7f64, 0.36);
        let h = shape_parameter(hk, m2);
        assert!((kinematic_shape(h, m2) - hk).abs() < 1e-15);
        assert_eq!(shape_parameter(hk, 0.0), hk);
        assert_eq!(density_shape(hk, 0.0), 0.0);
    }

    #[test]
    fn thickness_is_capped() {
        // 3.15 + 1.72/(H−1) + H at H = 1.4
        assert!((thickness(1.4f64, 1e-3, 1.4e-3) / 1e-3 - 8.85).abs() < 1e-3);
        let capped = thickness(12.0f64, 1e-3, 12e-3) / 1e-3;
        assert!((capped - 12.0).abs() < 1e-2, "{capped}");
    }
}
