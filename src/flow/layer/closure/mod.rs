//! Closure relations of the two-equation integral boundary layer with lag, one small function each.
//!
//! Sources: Drela & Giles, AIAA J. 25(10) 1347 (1987); Drela, XFOIL, LNAE 54 (1989); constants as in XFOIL 6.99. Each
//! relation is written once, generic over [`Scalar`](crate::scalar::Scalar), and depends on `scalar` only. Throughout,
//! `hk` is the kinematic shape parameter Hk, `re_theta` the Reynolds number of the momentum thickness, `hstar` the
//! kinetic-energy shape parameter H*, `us` the slip speed Us and `mach2` the square of the Mach number at the edge.
//!
//! The published relations have kinks and jumps (clips, branches). Here every one of them is rounded off within the
//! accuracy of the relation itself; the width is in the units of the clipped quantity:
//!
//! | relation | published | here |
//! |---|---|---|
//! | laminar H* at Hk 4.35 | two branches, C1 | blended over 0.03 |
//! | laminar cf at 5.5, dissipation at 4 | two branches | positive parts, 0.02 |
//! | turbulent H* at Hk = Ho | two branches, C1 | positive parts, 0.02 |
//! | max(Re, 400), max(Re, 200) in H* | clips | rounded, 20 and 10 |
//! | turbulent cf: max(ln Re, 3), max(laminar) | clips | rounded, 0.05 and 2e-5 |
//! | turbulent cf: min(1.33 Hk, 20) | clip | left out: both sides vanish |
//! | dissipation: max(laminar) | clip | rounded, 1e-5 (wake 1e-6) |
//! | slip speed Us: above 0.95 set to 0.98 (wake 0.99995) | jump | at most 0.96 (0.995), rounded 0.01 (0.002) |
//! | Hk − 1 − 18/Re, at least 0.01 | clip | rounded, 0.01 |
//! | thickness δ, at most 12 θ | clip | rounded, 0.1 θ |
//! | onset of amplification | cubic ramp over ±0.08 decades, C1 | quintic ramp over ±0.24, C2 |

pub(crate) mod amplification;
pub(crate) mod laminar;
pub(crate) mod shape;
pub(crate) mod turbulent;

use crate::scalar::Scalar;

/// Smooth maximum of `a` and `b`: larger than the exact one by `width²/(4 |a − b|)` away from equality and by `width/2`
/// at it.
pub(crate) fn larger<S: Scalar>(a: S, b: S, width: f64) -> S {
    b + (a - b).positive_part(width)
}

/// Smooth minimum of `a` and `b`, the mirror image of [`larger`].
pub(crate) fn smaller<S: Scalar>(a: S, b: S, width: f64) -> S {
    b - (b - a).positive_part(width)
}

#[cfg(test)]
pub(crate) mod testing {
    use crate::differentiate::{StepRange, finite_difference};
    use crate::scalar::Scalar;
    use num_dual::{Dual64, DualSVec64};
    use std::convert::Infallible;

    /// A relation of two variables, written for every scalar.
    pub trait Relation {
        fn at<S: Scalar>(&self, hk: S, re_theta: S) -> S;
    }

    /// Both partial derivatives by two kinds of dual numbers and by extrapolated differences.
    pub fn check_gradient(relation: &impl Relation, hk: f64, re_theta: f64) {
        let wide = relation
            .at(DualSVec64::<2>::from(hk).derivative(0), DualSVec64::<2>::from(re_theta).derivative(1))
            .eps
            .unwrap_generic(nalgebra::Const::<2>, nalgebra::U1);
        let single = [
            relation.at(Dual64::new(hk, 1.0), Dual64::from(re_theta)).eps,
            relation.at(Dual64::from(hk), Dual64::new(re_theta, 1.0)).eps,
        ];
        let differences = [
            finite_difference(
                |v| Ok::<_, Infallible>(relation.at(v, re_theta)),
                hk,
                StepRange { first: 0.003, levels: 9 },
            ),
            finite_difference(|v| Ok::<_, Infallible>(relation.at(hk, v)), re_theta, StepRange::for_scale(re_theta)),
        ];
        for k in 0..2 {
            assert!((wide[k] - single[k]).abs() <= 1e-13 * single[k].abs().max(1e-300), "{wide:?} {single:?}");
            let estimate = differences[k].unwrap();
            assert!(
                (estimate.value - single[k]).abs() <= 3.0 * estimate.error + 1e-12 * single[k].abs(),
                "hk {hk} re {re_theta} variable {k}: exact {} against {estimate:?}",
                single[k]
            );
        }
    }

    /// Declares a [`Relation`] from an expression.
    macro_rules! relation {
        (|$hk:ident, $re:ident| $e:expr) => {{
            struct Here;
            impl $crate::flow::layer::closure::testing::Relation for Here {
                fn at<S: $crate::scalar::Scalar>(&self, $hk: S, $re: S) -> S {
                    let _ = $re;
                    $e
                }
            }
            Here
        }};
    }
    pub(crate) use relation;
}
