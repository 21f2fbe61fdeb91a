//! The inviscid solver against exact sections.

use crate::flow::{PanelledSection, TrailingEdge};
use num_complex::Complex64;
use std::f64::consts::{PI, TAU};

/// A Kármán-Trefftz section: image of the circle about `mu` through 1; `k` = 2 − (trailing-edge angle)/π, 2 for
/// Joukowski's cusp.
struct Exact {
    mu: Complex64,
    k: f64,
}

impl Exact {
    fn new(x: f64, y: f64, k: f64) -> Self {
        Self { mu: Complex64::new(x, y), k }
    }

    fn map(&self, w: Complex64) -> Complex64 {
        let (plus, minus) = ((1.0 + 1.0 / w).powf(self.k), (1.0 - 1.0 / w).powf(self.k));
        self.k * (plus + minus) / (plus - minus)
    }

    fn radius_and_angle(&self) -> (f64, f64) {
        (Complex64::new(1.0, 0.0) - self.mu).to_polar()
    }

    fn at(&self, angle: f64) -> Complex64 {
        let (radius, start) = self.radius_and_angle();
        self.map(self.mu + Complex64::from_polar(radius, start + angle))
    }

    /// Nodes in the unit of the map, and the chord: the largest distance from the trailing edge.
    fn nodes(&self, n: usize) -> (Vec<[f64; 2]>, f64) {
        let tail = Complex64::new(self.k, 0.0);
        let far = |i: i32| (self.at(PI * (0.9 + 0.2 * f64::from(i) / 20_000.0)) - tail).norm();
        let chord = (0..=20_000).map(far).fold(0.0, f64::max);
        let node = |i: usize| {
            let edge = i == 0 || i + 1 == n;
            let z = if edge { tail } else { self.at(TAU * i as f64 / (n - 1) as f64) };
            [z.re, z.im]
        };
        ((0..n).map(node).collect(), chord)
    }

    fn lift(&self, alpha: f64, chord: f64) -> f64 {
        let (radius, _) = self.radius_and_angle();
        8.0 * PI * radius / chord * (alpha + (self.mu.im / radius).asin()).sin()
    }

    /// Relative error of the lift with `n` nodes.
    fn error(&self, n: usize) -> f64 {
        let alpha = 4f64.to_radians();
        let (nodes, chord) = self.nodes(n);
        let section = PanelledSection::new(&nodes, TrailingEdge::Sharp).unwrap();
        (section.inviscid(alpha, 0.0).unwrap().cl / self.lift(alpha, chord) - 1.0).abs()
    }
}

#[test]
fn lift_of_joukowski_sections() {
    // lift coefficients of the closed formula: tabulated at 4 degrees on the chord 4.0333333333
    let exact = Exact::new(-0.1, 0.0, 2.0);
    assert!((exact.lift(4f64.to_radians(), exact.nodes(101).1) - 0.478_137_655_5).abs() < 1e-8);
    for (x, y, k) in [(-0.1, 0.0, 2.0), (-0.1, 0.1, 2.0), (-0.08, 0.08, 2.0), (-0.08, 0.08, 1.95), (-0.1, 0.05, 1.85)] {
        let exact = Exact::new(x, y, k);
        let (coarse, fine) = (exact.error(101), exact.error(201));
        assert!(fine < 2e-4, "mu {x} {y}, k {k}: {fine:.2e} with 200 panels");
        let order = (coarse / fine).log2();
        assert!(order > 1.9 || fine < 2e-5, "mu {x} {y}, k {k}: order {order}");
    }
}

#[test]
fn pressure_of_a_joukowski_section() {
    let exact = Exact::new(-0.1, 0.05, 2.0);
    let (alpha, n) = (0.05f64, 201);
    let (nodes, _) = exact.nodes(n);
    let solution = PanelledSection::new(&nodes, TrailingEdge::Sharp).unwrap().inviscid(alpha, 0.0).unwrap();
    let (radius, start) = exact.radius_and_angle();
    for i in 10..n - 10 {
        let angle = start + TAU * i as f64 / (n - 1) as f64;
        let w = exact.mu + Complex64::from_polar(radius, angle);
        // speed on the circle, over |dz/dw| of z = w + 1/w
        let speed = 2.0 * ((angle - alpha).sin() - (start - alpha).sin()) / (1.0 - 1.0 / (w * w)).norm();
        assert!((solution.speed[i] - speed).abs() < 0.01, "node {i}: {} for {speed}", solution.speed[i]);
    }
}

#[test]
fn the_blunt_naca_0012() {
    // XFOIL 6.99 with 300 panels: lift 0.483027 at 4 degrees, 1.202438 at 10; moment −0.005612
    let nodes = crate::flow::testcases::naca_symmetric(0.12, 0.00252, 301);
    let section = PanelledSection::new(&nodes, TrailingEdge::Blunt).unwrap();
    let at = |degrees: f64| section.inviscid(degrees.to_radians(), 0.0).unwrap();
    assert!((at(4.0).cl / 0.483027 - 1.0).abs() < 1e-3);
    assert!((at(10.0).cl / 1.202438 - 1.0).abs() < 1e-3);
    assert!((at(4.0).cm + 0.005612).abs() < 1e-4);
    assert!(at(0.0).cl.abs() < 1e-12 && at(0.0).cm.abs() < 1e-12);
}

#[test]
fn lift_is_continuous_as_the_edge_closes() {
    let lift = |gap: f64| {
        let (gap, kind) = if gap > 0.0 { (gap, TrailingEdge::Blunt) } else { (0.0, TrailingEdge::Sharp) };
        let nodes = crate::flow::testcases::naca_symmetric(0.24, gap, 161);
        PanelledSection::new(&nodes, kind).unwrap().inviscid(0.07, 0.0).unwrap().cl
    };
    let sharp = lift(0.0);
    for gap in [1e-3, 1e-4, 1e-6] {
        assert!((lift(gap) / sharp - 1.0).abs() < 1.2 * gap + 1e-5, "{gap}: {} {sharp}", lift(gap));
    }
}

#[test]
fn compressibility_follows_karman_and_tsien() {
    let correction = super::compressibility::KarmanTsien::new(0.5f64);
    // Cp/(β + M² Cp / (2 (1 + β))) at Cp = −1, β = sqrt(0.75)
    let beta = 0.75f64.sqrt();
    assert!((correction.pressure(2f64.sqrt()) + 1.0 / (beta - 0.25 / (1.0 + beta) / 2.0)).abs() < 1e-12);
    assert_eq!(correction.speed(1.0), 1.0);
}
