//! Forces from the surface pressure.

use crate::scalar::Scalar;

/// Kármán-Tsien compressibility corrections at one free-stream Mach number (Drela, XFOIL, 1989, section 2).
#[derive(Debug, Clone, Copy)]
pub(crate) struct KarmanTsien<S> {
    beta: S,
    lambda: S,
}

impl<S: Scalar> KarmanTsien<S> {
    pub fn new(mach: S) -> Self {
        let beta = (-(mach * mach) + 1.0).sqrt();
        let lambda = (mach / (beta + 1.0)).powi(2);
        Self { beta, lambda }
    }

    /// The same corrections in another scalar.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T) -> KarmanTsien<T> {
        KarmanTsien { beta: f(self.beta), lambda: f(self.lambda) }
    }

    /// Pressure coefficient from the incompressible speed.
    pub fn pressure(&self, speed: S) -> S {
        let cp = -(speed * speed) + 1.0;
        cp / (self.beta + self.lambda * (self.beta + 1.0) * cp * 0.5)
    }

    /// Incompressible speed from the pressure coefficient, the inverse of [`pressure`](Self::pressure).
    pub fn incompressible_speed(&self, pressure: S) -> S {
        let cp = pressure * self.beta / (-(pressure * self.lambda * (self.beta + 1.0) * 0.5) + 1.0);
        (-cp + 1.0).sqrt()
    }

    /// Compressible speed from the incompressible one, both in units of the onset speed.
    pub fn speed(&self, speed: S) -> S {
        speed * (-self.lambda + 1.0) / (-(self.lambda * speed * speed) + 1.0)
    }
}

/// Lift and moment coefficients of one panel with linear pressure: `cp` at the two ends.
///
/// Moment about a quarter of the chord, nose-up positive; `wind` is the cosine and sine of the angle of attack.
pub(crate) fn panel_loads<S: Scalar>(panel: [[S; 2]; 2], cp: [S; 2], wind: [S; 2]) -> [S; 2] {
    let [a, b] = panel;
    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
    let (mean, half) = ((cp[0] + cp[1]) * 0.5, (cp[1] - cp[0]) * 0.5);
    // nodes run counter-clockwise: the force per unit pressure on the panel is (−dy, dx)
    let lift = mean * (dx * wind[0] + dy * wind[1]);
    let (mx, my) = ((a[0] + b[0]) * 0.5 - 0.25, (a[1] + b[1]) * 0.5);
    let square = (dx * dx + dy * dy) / 6.0;
    let moment = -(mean * (mx * dx + my * dy) + half * square);
    [lift, moment]
}
