//! Sections and conditions that several tests share.

/// Symmetric NACA four-digit section with a trailing-edge gap, cosine spacing; `n` odd.
pub(crate) fn naca_symmetric(thickness: f64, gap: f64, n: usize) -> Vec<[f64; 2]> {
    let half = (n - 1) / 2;
    let open = 0.0042 * thickness / 0.2;
    let y = |x: f64| {
        let polynomial = 0.2969 * x.sqrt() - 0.1260 * x - 0.3516 * x * x + 0.2843 * x.powi(3) - 0.1015 * x.powi(4);
        thickness / 0.2 * polynomial + 0.5 * (gap - open) * x
    };
    let node = |i: usize| {
        let x = 0.5 * (1.0 + (std::f64::consts::PI * i as f64 / half as f64).cos());
        let side = if i <= half { 1.0 } else { -1.0 };
        // round-off must not open a closed edge
        [x, if x == 1.0 { 0.5 * side * gap } else { side * y(x) }]
    };
    (0..n).map(node).collect()
}
