//! Compressibility of the panel flow by the formula of Kármán and Tsien, and forces from the surface pressure.

use crate::flow::layer::{Edge, EdgeLaw, FreeStream};
use crate::scalar::Scalar;

/// Kármán-Tsien compressibility corrections at one free-stream Mach number (Drela, XFOIL, 1989, section 2).
#[derive(Debug, Clone, Copy)]
pub(crate) struct KarmanTsien<S> {
    /// Prandtl-Glauert factor β = √(1 − M²), with the Mach number M of the onset flow.
    beta: S,
    /// Constant λ = M²/(1 + β)² of the correction of the speed.
    lambda: S,
}

impl<S: Scalar> KarmanTsien<S> {
    /// The corrections at a Mach number of the onset flow, below 1.
    pub fn new(mach: S) -> Self {
        let beta = (-(mach * mach) + 1.0).sqrt();
        let lambda = (mach / (beta + 1.0)).powi(2);
        Self { beta, lambda }
    }

    /// These corrections with their constants converted by `f`.
    pub fn map<T: Scalar>(&self, f: impl Fn(S) -> T) -> KarmanTsien<T> {
        KarmanTsien { beta: f(self.beta), lambda: f(self.lambda) }
    }

    /// Pressure coefficient from the incompressible speed in units of the onset speed.
    pub fn pressure(&self, speed: S) -> S {
        let cp = -(speed * speed) + 1.0;
        cp / (self.beta + self.lambda * (self.beta + 1.0) * cp * 0.5)
    }

    /// Compressible speed from the incompressible one, both in units of the onset speed.
    pub fn speed(&self, speed: S) -> S {
        speed * (-self.lambda + 1.0) / (-(self.lambda * speed * speed) + 1.0)
    }
}

/// The law by which the incompressible speed of the panels becomes the state at the edge of the boundary layer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PanelEdge<S> {
    stream: FreeStream<S>,
    correction: KarmanTsien<S>,
}

impl<S: Scalar> PanelEdge<S> {
    /// The law for a Mach number and a Reynolds number of the chord.
    pub fn new(mach: S, reynolds: S) -> Self {
        Self { stream: FreeStream::new(mach, reynolds), correction: KarmanTsien::new(mach) }
    }
}

impl<S: Scalar> EdgeLaw for PanelEdge<S> {
    type Number = S;
    type In<T: Scalar> = PanelEdge<T>;

    fn edge(&self, incompressible: S) -> Edge<S> {
        self.stream.edge(self.correction.speed(incompressible))
    }

    fn map<T: Scalar>(&self, f: impl Fn(S) -> T) -> PanelEdge<T> {
        PanelEdge { stream: self.stream.map(&f), correction: self.correction.map(f) }
    }
}

/// Lift and moment coefficients of one panel with linear pressure. `cp` are the pressure coefficients at the two ends.
///
/// The moment is about a quarter of the chord, nose-up positive. `wind` is the cosine and sine of the angle of attack.
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
