//! One station of the layer: unknowns and everything that follows from them alone.

use super::closure::turbulent::{self, Kind};
use super::closure::{laminar, shape};
use super::gas::Gas;
use crate::scalar::Scalar;

/// Unknowns of a station. Logarithms keep every thickness, stress and speed positive and Hk above 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct State<S> {
    /// ln θ, θ in chords.
    pub log_theta: S,
    /// ln(Hk − 1).
    pub log_shape: S,
    /// Amplification factor n (laminar) or ln of the root of the shear-stress coefficient (turbulent, wake).
    pub third: S,
    /// ln of the incompressible edge speed in units of the onset speed.
    pub log_speed: S,
}

impl<S: Scalar> State<S> {
    pub fn map<T>(&self, f: impl Fn(S) -> T) -> State<T> {
        State {
            log_theta: f(self.log_theta),
            log_shape: f(self.log_shape),
            third: f(self.third),
            log_speed: f(self.log_speed),
        }
    }

    pub fn theta(&self) -> S {
        self.log_theta.exp()
    }

    pub fn kinematic_shape(&self) -> S {
        self.log_shape.exp() + 1.0
    }
}

impl State<f64> {
    /// The four unknowns as independent variables, the first of them in direction `first` of the dual numbers.
    pub fn seed<const N: usize>(&self, first: usize) -> State<crate::differentiate::Tangent<N>> {
        let at = |value: f64, k: usize| crate::differentiate::Tangent::<N>::from(value).derivative(first + k);
        State {
            log_theta: at(self.log_theta, 0),
            log_shape: at(self.log_shape, 1),
            third: at(self.third, 2),
            log_speed: at(self.log_speed, 3),
        }
    }
}

/// Kind of flow at a station.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Regime {
    Laminar,
    Turbulent,
    Wake,
}

/// What the interval equations need of a station.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Derived<S> {
    pub state: State<S>,
    pub theta: S,
    pub hk: S,
    /// H = δ*/θ, without the gap of the wake.
    pub shape: S,
    pub displacement: S,
    /// ln of the compressible edge speed.
    pub log_speed: S,
    pub mach2: S,
    pub re_theta: S,
    pub energy_shape: S,
    pub density_shape: S,
    pub friction: S,
    /// 2 CD / H*.
    pub dissipation: S,
    pub slip: S,
    /// Root of the shear-stress coefficient.
    pub stress: S,
    /// The same in equilibrium.
    pub equilibrium_stress: S,
    pub thickness: S,
    /// Incompressible speed times displacement thickness.
    pub mass: S,
}

impl<S: Scalar> Derived<S> {
    /// Evaluates the closure at a station.
    pub fn new(state: State<S>, regime: Regime, gas: &Gas<S>) -> Self {
        let speed = state.log_speed.exp();
        let edge = gas.edge(speed);
        let theta = state.theta();
        let hk = state.kinematic_shape();
        let h = shape::shape_parameter(hk, edge.mach2);
        let displacement = theta * h;
        let zero = S::from(0.0);
        let mut result = Self {
            state,
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
            mass: speed * displacement,
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
        self.stress = self.state.third.exp();
        self.slip = turbulent::slip_speed(hk, h, hstar, kind);
        self.equilibrium_stress = turbulent::equilibrium_stress_root(hk, h, hstar, self.slip, re, kind);
        self.thickness = shape::thickness(hk, self.theta, self.displacement);
        self.dissipation = match kind {
            Kind::Wall => {
                self.friction = turbulent::friction(hk, re, self.mach2);
                turbulent::wall_dissipation(hk, hstar, self.slip, self.friction, self.stress, re)
            }
            Kind::Wake => turbulent::wake_dissipation(hk, hstar, self.slip, self.stress, re),
        };
    }

    /// The same station in another scalar.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T + Copy) -> Derived<T> {
        Derived {
            state: self.state.map(f),
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
            mass: f(self.mass),
        }
    }
}

/// The turbulent state just behind transition, from the last laminar one: θ, Hk and the speed go on, the shear
/// stress starts at a fraction of its equilibrium (XFOIL 6.99).
pub(crate) fn transition_state<S: Scalar>(laminar: State<S>, gas: &Gas<S>) -> State<S> {
    let mut state = laminar;
    // any stress will do: the equilibrium does not depend on it
    state.third = S::from(-3.0);
    let derived = Derived::new(state, Regime::Turbulent, gas);
    state.third = (derived.equilibrium_stress * turbulent::initial_stress_ratio(derived.hk)).ln();
    state
}
