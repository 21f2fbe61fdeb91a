//! Vectors of the plane as pairs of numbers, over any [`Scalar`].

use crate::scalar::Scalar;

/// The vector from `b` to `a`.
#[inline(always)]
pub(crate) fn minus<S: Scalar>(a: [S; 2], b: [S; 2]) -> [S; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// The inner product.
#[inline(always)]
pub(crate) fn dot<S: Scalar>(a: [S; 2], b: [S; 2]) -> S {
    a[0] * b[0] + a[1] * b[1]
}

/// The outer product: positive where `b` points to the left of `a`.
#[inline(always)]
pub(crate) fn cross<S: Scalar>(a: [S; 2], b: [S; 2]) -> S {
    a[0] * b[1] - a[1] * b[0]
}

/// The point at a share of the way from `a` (0) to `b` (1).
#[inline(always)]
pub(crate) fn between<S: Scalar>(a: [S; 2], b: [S; 2], share: f64) -> [S; 2] {
    [0, 1].map(|d| a[d] + (b[d] - a[d]) * share)
}

/// The point midway between two others.
#[inline(always)]
pub(crate) fn middle<S: Scalar>(a: [S; 2], b: [S; 2]) -> [S; 2] {
    [(a[0] + b[0]) * 0.5, (a[1] + b[1]) * 0.5]
}

/// The length of a vector; its derivatives are not finite where the vector vanishes.
#[inline]
pub(crate) fn length<S: Scalar>(v: [S; 2]) -> S {
    if S::NDERIV == 0 {
        // the careful function is many times slower, and needed only where squares overflow or vanish
        let [x, y] = v.map(|c| c.re());
        let squared = x * x + y * y;
        let plain = (1e-280..1e280).contains(&squared);
        return S::from(if plain { squared.sqrt() } else { x.hypot(y) });
    }
    // scaled, so that squares neither overflow nor vanish
    let scale = v[0].re().abs().max(v[1].re().abs());
    if scale == 0.0 || !scale.is_finite() {
        return dot(v, v).sqrt();
    }
    let v = v.map(|c| c / scale);
    dot(v, v).sqrt() * scale
}

/// The distance of two points.
#[inline]
pub(crate) fn distance<S: Scalar>(a: [S; 2], b: [S; 2]) -> S {
    length(minus(a, b))
}

/// Extent of points in each direction: smallest and largest coordinate, infinite where there are no points.
pub(crate) fn bounds(points: impl IntoIterator<Item = [f64; 2]>) -> [[f64; 2]; 2] {
    points.into_iter().fold([[f64::INFINITY, f64::NEG_INFINITY]; 2], |[x, y], p| {
        [[x[0].min(p[0]), x[1].max(p[0])], [y[0].min(p[1]), y[1].max(p[1])]]
    })
}
