//! One station of the layer: the unknowns and everything that follows from them alone.

use super::closure::turbulent::{self, Kind};
use super::closure::{laminar, shape};
use super::edge::EdgeLaw;
use crate::differentiate::Tangent;
use crate::scalar::Scalar;

/// Number of unknowns of a station.
pub(crate) const UNKNOWNS: usize = 4;
/// A number with derivatives with respect to the unknowns of one station.
pub(crate) type ByStation = Tangent<UNKNOWNS>;

/// One number per unknown of a station: the unknowns themselves, a change of them, or the derivatives of a quantity
/// with respect to them. Logarithms keep every thickness, stress and speed positive and Hk above 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State<S = f64> {
    /// Logarithm of the momentum thickness θ in chords.
    pub log_theta: S,
    /// Logarithm of Hk − 1, with the kinematic shape parameter Hk.
    pub log_shape: S,
    /// The unknown of the third equation: the [amplification factor](Self::amplification) of a laminar station, the
    /// [logarithm of the stress](Self::log_stress) of a turbulent station and of the wake.
    pub third: S,
    /// Logarithm of the outer flow's unknown speed (see [`EdgeLaw`]) in units of the onset speed.
    pub log_speed: S,
}

impl<S: Copy> State<S> {
    /// One number per unknown, as a function of the position of the unknown.
    #[inline(always)]
    pub fn from_fn(mut f: impl FnMut(usize) -> S) -> Self {
        Self { log_theta: f(0), log_shape: f(1), third: f(2), log_speed: f(3) }
    }

    /// The numbers in the order of [`from_fn`](Self::from_fn).
    #[inline(always)]
    pub fn numbers(&self) -> [S; UNKNOWNS] {
        [self.log_theta, self.log_shape, self.third, self.log_speed]
    }

    #[inline(always)]
    pub fn map<T: Copy>(&self, f: impl Fn(S) -> T) -> State<T> {
        let numbers = self.numbers();
        State::from_fn(|i| f(numbers[i]))
    }

    #[inline(always)]
    pub fn zip<T: Copy, U: Copy>(&self, other: &State<T>, f: impl Fn(S, T) -> U) -> State<U> {
        let (own, others) = (self.numbers(), other.numbers());
        State::from_fn(|i| f(own[i], others[i]))
    }

    /// The third unknown of a laminar station: the amplification factor n.
    pub fn amplification(&self) -> S {
        self.third
    }

    /// The third unknown of a turbulent station and of the wake: the logarithm of the root of the shear-stress
    /// coefficient Cτ.
    pub fn log_stress(&self) -> S {
        self.third
    }
}

impl<S: Scalar> State<S> {
    /// Momentum thickness θ, in chords.
    pub fn theta(&self) -> S {
        self.log_theta.exp()
    }

    /// Kinematic shape parameter Hk.
    pub fn kinematic_shape(&self) -> S {
        self.log_shape.exp() + 1.0
    }

    /// The outer flow's unknown speed, in units of the onset speed.
    pub fn speed(&self) -> S {
        self.log_speed.exp()
    }
}

impl State {
    /// The unknowns as independent variables, the first of them in direction `first` of the dual numbers.
    pub fn seed<const N: usize>(&self, first: usize) -> State<Tangent<N>> {
        let numbers = self.numbers();
        State::from_fn(|i| Tangent::from_re(numbers[i]).derivative(first + i))
    }

    /// The derivatives of a dual number with respect to the unknowns, which stand in the directions from `first` on.
    pub fn derivatives<const N: usize>(of: &Tangent<N>, first: usize) -> Self {
        Self::from_fn(|i| of.eps[first + i])
    }

    /// The derivatives of a dual number that carries those with respect to the unknowns alone.
    pub fn gradient(of: &ByStation) -> Self {
        Self::derivatives(of, 0)
    }

    pub fn zeros() -> Self {
        Self::from_fn(|_| 0.0)
    }

    /// The state after `factor` times a change.
    #[inline(always)]
    pub fn step(&self, change: &Self, factor: f64) -> Self {
        self.zip(change, |own, change| own + factor * change)
    }

    pub fn dot(&self, other: &Self) -> f64 {
        self.zip(other, |a, b| a * b).numbers().iter().sum()
    }

    pub fn is_finite(&self) -> bool {
        self.numbers().iter().all(|v| v.is_finite())
    }
}

/// Kind of flow at a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Regime {
    Laminar,
    Turbulent,
    Wake,
}

/// All quantities of a station that the interval equations need. Lengths are in chords, speeds in units of the onset
/// speed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Derived<S> {
    /// Unknowns of the station.
    pub state: State<S>,
    /// The outer flow's unknown speed.
    pub speed: S,
    /// Momentum thickness θ.
    pub theta: S,
    /// Kinematic shape parameter Hk.
    pub hk: S,
    /// Shape parameter H = δ*/θ, without the gap of the wake.
    pub shape: S,
    /// Displacement thickness δ*, without the gap of the wake.
    pub displacement: S,
    /// Logarithm of the compressible speed at the edge.
    pub log_speed: S,
    /// Square of the Mach number at the edge.
    pub mach2: S,
    /// Reynolds number of the momentum thickness, with density, speed and viscosity at the edge.
    pub re_theta: S,
    /// Kinetic-energy shape parameter H*.
    pub energy_shape: S,
    /// Density shape parameter H**.
    pub density_shape: S,
    /// Skin-friction coefficient on the dynamic pressure at the edge; zero in the wake.
    pub friction: S,
    /// Dissipation 2 CD / H*, with the dissipation coefficient CD.
    pub dissipation: S,
    /// Equivalent slip speed Us over the speed at the edge; zero where laminar.
    pub slip: S,
    /// Root of the shear-stress coefficient Cτ; zero where laminar.
    pub stress: S,
    /// Root of the shear-stress coefficient of an equilibrium layer; zero where laminar.
    pub equilibrium_stress: S,
    /// Thickness δ of the layer; zero where laminar.
    pub thickness: S,
}

impl<S: Scalar> Derived<S> {
    /// Evaluates the closure at a station.
    pub fn new(state: State<S>, regime: Regime, law: &impl EdgeLaw<Number = S>) -> Self {
        let speed = state.speed();
        let edge = law.edge(speed);
        let theta = state.theta();
        let hk = state.kinematic_shape();
        let h = shape::shape_parameter(hk, edge.mach2);
        let displacement = theta * h;
        let zero = S::from(0.0);
        let mut result = Self {
            state,
            speed,
            theta,
            hk,
            shape: h,
            displacement,
            log_speed: edge.speed.ln(),
            mach2: edge.mach2,
            re_theta: edge.reynolds * theta,
            energy_shape: zero,
            density_shape: shape::density_shape(hk, edge.mach2),
            friction: zero,
            dissipation: zero,
            slip: zero,
            stress: zero,
            equilibrium_stress: zero,
            thickness: zero,
        };
        match regime {
            Regime::Laminar => result.close_laminar(),
            Regime::Turbulent => result.close_turbulent(Kind::Wall),
            Regime::Wake => result.close_turbulent(Kind::Wake),
        }
        result
    }

    fn close_laminar(&mut self) {
        self.energy_shape = shape::compressible_energy_shape(laminar::energy_shape(self.hk), self.mach2);
        self.friction = laminar::friction(self.hk, self.re_theta);
        self.dissipation = laminar::dissipation(self.hk, self.re_theta);
    }

    fn close_turbulent(&mut self, kind: Kind) {
        let (hk, h, re) = (self.hk, self.shape, self.re_theta);
        let hstar = shape::compressible_energy_shape(turbulent::energy_shape(hk, re), self.mach2);
        self.energy_shape = hstar;
        self.stress = self.state.log_stress().exp();
        self.slip = turbulent::slip_speed(hk, h, hstar, kind);
        self.equilibrium_stress = turbulent::equilibrium_stress_root(hk, h, hstar, self.slip, re, kind);
        self.thickness = shape::thickness(hk, self.theta, self.displacement);
        self.dissipation = match kind {
            Kind::Wall => {
                let wall_friction = turbulent::wall_friction(hk, re, self.mach2);
                self.friction = turbulent::not_laminar(wall_friction, hk, re);
                turbulent::wall_dissipation(hk, hstar, self.slip, wall_friction, self.stress, re)
            }
            Kind::Wake => turbulent::wake_dissipation(hk, hstar, self.slip, self.stress, re),
        };
    }

    /// This station with all numbers converted by `f`.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T + Copy) -> Derived<T> {
        Derived {
            state: self.state.map(f),
            speed: f(self.speed),
            theta: f(self.theta),
            hk: f(self.hk),
            shape: f(self.shape),
            displacement: f(self.displacement),
            log_speed: f(self.log_speed),
            mach2: f(self.mach2),
            re_theta: f(self.re_theta),
            energy_shape: f(self.energy_shape),
            density_shape: f(self.density_shape),
            friction: f(self.friction),
            dissipation: f(self.dissipation),
            slip: f(self.slip),
            stress: f(self.stress),
            equilibrium_stress: f(self.equilibrium_stress),
            thickness: f(self.thickness),
        }
    }
}

/// The turbulent state just behind transition, from the last laminar one: θ, Hk and the speed stay, the shear stress
/// starts at a fraction of the equilibrium value (XFOIL 6.99).
pub(crate) fn transition_state<S: Scalar>(laminar: State<S>, law: &impl EdgeLaw<Number = S>) -> State<S> {
    let mut state = laminar;
    // any stress will do: the equilibrium does not depend on it
    state.third = S::from(-3.0);
    let derived = Derived::new(state, Regime::Turbulent, law);
    state.third = (derived.equilibrium_stress * turbulent::initial_stress_ratio(derived.hk)).ln();
    state
}
