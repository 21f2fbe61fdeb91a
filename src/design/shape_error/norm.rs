//! The ways to compare a shape with its target.

/// How a shape is compared with its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ShapeNorm {
    /// ∮ |C(u) − T(u)|² ds, s the arc length of the target; in chord³.
    #[default]
    ArcLength,
    /// ∫ |C(u) − T(u)|² du; in chord².
    Parameter,
    /// Σ |cᵢ − tᵢ|² over the control points (equal knots only); in chord².
    ControlPoints,
    /// sqrt(∮ |C(u) − T(u)|² ds / perimeter of the target); in chords. Its slope is undefined at a perfect match.
    RootMeanSquare,
    /// Mean over both curves of the squared distance to the closest point of the other curve; in chord². Parameters
    /// play no part.
    ///
    /// Half of the mean is taken over the shape, half over the target. Points of the upper side are compared with the
    /// upper side, extended around the nose by a twentieth of the chord, and those of the lower side likewise; beyond
    /// an end at the trailing edge the end is the closest point, and a blunt trailing edge itself is no part of either
    /// curve. The mean is a continuous function of the shape. It has derivatives except where two points of a side are
    /// equally near, as inside of a nose farther from the surface than its radius.
    Closest,
}

impl ShapeNorm {
    /// All norms with their names.
    pub const NAMES: [(&'static str, Self); 5] = [
        ("arc length", Self::ArcLength),
        ("parameter", Self::Parameter),
        ("control points", Self::ControlPoints),
        ("root mean square", Self::RootMeanSquare),
        ("closest", Self::Closest),
    ];
}
