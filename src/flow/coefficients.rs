//! The coefficients of a section that every flow solver computes, and their derivatives.
//!
//! [`Coefficients`] is the one place that knows which coefficients there are, and their order.

use serde::{Serialize, Serializer};

/// Number of coefficients.
pub(crate) const COEFFICIENTS: usize = 6;

/// One value per coefficient: the coefficients of a flow (`f64`), their [derivatives](Gradients), names, tolerances, …
///
/// Forces are divided by the section's own chord and the dynamic pressure of the onset flow, the moment by the square of
/// that chord and that pressure.
///
/// ```
/// use aeroform::flow::Coefficients;
/// let drag_counts = Coefficients { cl: 0.4, cd: 0.0085, ..Coefficients::default() }.map(|c: f64| 1e4 * c);
/// assert_eq!(drag_counts.cd, 85.0);
/// let names: Vec<&str> = drag_counts.named().map(|(name, _)| name).collect();
/// assert_eq!(names, ["cl", "cd", "cm", "cp_min", "transition_upper", "transition_lower"]);
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Coefficients<T = f64> {
    /// Lift coefficient: force across the onset flow.
    pub cl: T,
    /// Drag coefficient: force along the onset flow.
    pub cd: T,
    /// Moment coefficient about the quarter chord, nose-up positive.
    pub cm: T,
    /// Lowest pressure coefficient on the surface. The suction peaks of both sides are joined by a smooth maximum of the
    /// speed: where they tie, the value lies below the lower one by up to 0.004 times the speed there.
    pub cp_min: T,
    /// Transition on the upper and on the lower side, as x along the chord line in chords, from the nose.
    pub transition: [T; 2],
}

impl<T> Coefficients<T> {
    /// Names in case files and in JSON, in the order of [`to_array`](Self::to_array).
    pub const NAMES: [&'static str; COEFFICIENTS] =
        ["cl", "cd", "cm", "cp_min", "transition_upper", "transition_lower"];

    /// Builds a set from its values in the order of [`NAMES`](Self::NAMES).
    pub fn from_array([cl, cd, cm, cp_min, upper, lower]: [T; COEFFICIENTS]) -> Self {
        Self { cl, cd, cm, cp_min, transition: [upper, lower] }
    }

    /// The values in the order of [`NAMES`](Self::NAMES).
    pub fn to_array(self) -> [T; COEFFICIENTS] {
        let Self { cl, cd, cm, cp_min, transition: [upper, lower] } = self;
        [cl, cd, cm, cp_min, upper, lower]
    }

    /// References to the values.
    pub fn as_ref(&self) -> Coefficients<&T> {
        let Self { cl, cd, cm, cp_min, transition } = self;
        Coefficients { cl, cd, cm, cp_min, transition: transition.each_ref() }
    }

    /// Mutable references to the values.
    pub fn as_mut(&mut self) -> Coefficients<&mut T> {
        let Self { cl, cd, cm, cp_min, transition } = self;
        Coefficients { cl, cd, cm, cp_min, transition: transition.each_mut() }
    }

    /// Applies `f` to every value.
    pub fn map<U>(self, f: impl FnMut(T) -> U) -> Coefficients<U> {
        Coefficients::from_array(self.to_array().map(f))
    }

    /// Pairs every value with the corresponding value of another set.
    pub fn zip<U>(self, other: Coefficients<U>) -> Coefficients<(T, U)> {
        let ([u, l], [other_u, other_l]) = (self.transition, other.transition);
        Coefficients {
            cl: (self.cl, other.cl),
            cd: (self.cd, other.cd),
            cm: (self.cm, other.cm),
            cp_min: (self.cp_min, other.cp_min),
            transition: [(u, other_u), (l, other_l)],
        }
    }

    /// References to the values in the order of [`NAMES`](Self::NAMES).
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.as_ref().to_array().into_iter()
    }

    /// Mutable references to the values in the order of [`NAMES`](Self::NAMES).
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.as_mut().to_array().into_iter()
    }

    /// References to the values with their names, in the order of [`NAMES`](Self::NAMES).
    pub fn named(&self) -> impl Iterator<Item = (&'static str, &T)> {
        Self::NAMES.into_iter().zip(self.iter())
    }
}

/// Coefficients serialise as a map from [names](Coefficients::NAMES) to values.
impl<T: Serialize> Serialize for Coefficients<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.named())
    }
}

/// Derivatives of one quantity of a flow with respect to all inputs of the flow.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Derivatives {
    /// Derivatives with respect to x and y of every node, per unit of the nodes: one pair per node, in the order in
    /// which the nodes were given.
    pub nodes: Vec<[f64; 2]>,
    /// Derivative with respect to the angle of attack, per radian.
    pub alpha: f64,
    /// Derivative with respect to the Mach number.
    pub mach: f64,
    /// Derivative with respect to the Reynolds number.
    pub reynolds: f64,
}

/// Derivatives of all coefficients. The angle of attack is held unless the function that returns them says otherwise.
pub type Gradients = Coefficients<Derivatives>;

impl Derivatives {
    /// These derivatives multiplied by `factor`.
    fn scaled(&self, factor: f64) -> Self {
        Self {
            nodes: self.nodes.iter().map(|node| node.map(|d| factor * d)).collect(),
            alpha: factor * self.alpha,
            mach: factor * self.mach,
            reynolds: factor * self.reynolds,
        }
    }

    /// The sum of these derivatives and `factor` times others.
    pub(super) fn plus(mut self, factor: f64, other: &Self) -> Self {
        for (own, other) in self.nodes.iter_mut().zip(&other.nodes) {
            *own = [own[0] + factor * other[0], own[1] + factor * other[1]];
        }
        self.alpha += factor * other.alpha;
        self.mach += factor * other.mach;
        self.reynolds += factor * other.reynolds;
        self
    }
}

impl Derivatives {
    /// These derivatives at fixed angle of attack as derivatives at fixed lift coefficient, given those of the lift.
    pub(super) fn at_fixed_lift(self, lift: &Self) -> Self {
        let slope = -self.alpha / lift.alpha;
        Self { alpha: 0.0, ..self.plus(slope, lift) }
    }
}

impl Gradients {
    /// Turns derivatives at fixed angle of attack into derivatives at fixed lift coefficient, where the angle follows.
    ///
    /// The derivatives of `cl` vanish. The entries `alpha` are zero, because the angle is no longer an input.
    pub fn at_fixed_lift(&self) -> Self {
        self.as_ref().map(|own| own.clone().at_fixed_lift(&self.cl))
    }

    /// Derivatives of the angle of attack (radians) at fixed lift coefficient. The entry `alpha` is zero.
    pub fn alpha_at_fixed_lift(&self) -> Derivatives {
        Derivatives { alpha: 0.0, ..self.cl.scaled(-1.0 / self.cl.alpha) }
    }
}
