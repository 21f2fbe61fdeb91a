//! Points and boxes for the benches.

use aeroform::ffd::{FfdBox, Placement};

/// `n` pairs in the unit square by the additive recurrence of the plastic number (Roberts 2018): even, but in no order
/// that a cache or branch predictor could learn.
pub fn scattered(n: usize) -> Vec<[f64; 2]> {
    let steps = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    (1..=n).map(|i| steps.map(|step| (i as f64 * step).fract())).collect()
}

/// A bicubic box of 5 × 5 control points around a section of unit chord.
pub fn bicubic() -> FfdBox<f64> {
    FfdBox::rectangular([[-0.1, 1.1], [-0.15, 0.15]], [5, 5], [3, 3], Placement::Even).expect("a box")
}

/// The [bicubic] box, deformed.
pub fn deformed() -> FfdBox<f64> {
    let flat = bicubic();
    let moved = flat.control_points().iter().enumerate();
    let net = moved.map(|(i, p)| [p[0] + 0.03 * (i as f64).sin(), p[1] + 0.01 * (2.0 * i as f64).cos()]).collect();
    flat.with_control_points(net).expect("as many points")
}

/// `n` points of the undeformed box.
pub fn inside(n: usize) -> Vec<[f64; 2]> {
    let lattice = bicubic();
    scattered(n).into_iter().map(|u| lattice.evaluate(u)).collect()
}
