//! The first guess of a flow: stagnation point and circulation of a flow without layers, and where transition is expected.

use super::limits::PATIENCE;
use super::section_curve::SectionCurve;
use super::start::Guess;
use crate::flow::PanelledSection;
use crate::flow::condition::{Condition, Incidence};
use crate::flow::layer::Side;
use crate::flow::solution::Solution;

/// Fraction of a side at which a free layer is taken to turn turbulent where nothing better is known.
pub(super) const USUAL_TRANSITION: f64 = 0.35;
/// Difference between the fraction of a side and the place x of a point behind a usual nose.
const NOSE: f64 = 0.02;
/// Thwaites' parameter at which a laminar layer separates.
const SEPARATING: f64 = -0.09;
/// Largest distance, as fraction of the side, between transition and the station at which it was expected.
pub(super) const SHIFT: f64 = 0.35;

/// Fractions of the sides at which the layers turn turbulent at trips with places x. They depend on the trips alone, so
/// that the stations do not hop while a shape is changed: the way round a usual nose is added to the place of the trip.
pub(super) fn turning_of_trips(trips: [Option<f64>; 2]) -> [Option<f64>; 2] {
    trips.map(|trip| trip.filter(|x| *x < 1.0).map(|x| x + NOSE * (1.0 - x) * (1.0 - (-x / NOSE).exp())))
}

/// A section whose flow is to be guessed.
pub(super) struct Guessing<'a> {
    panels: &'a PanelledSection,
    curve: &'a SectionCurve<f64>,
}

impl<'a> Guessing<'a> {
    pub fn new(panels: &'a PanelledSection, curve: &'a SectionCurve<f64>) -> Self {
        Self { panels, curve }
    }

    /// Speeds of slow flow without layers at the nodes, along the surface from the first node on.
    fn speeds(&self, alpha: f64) -> Vec<f64> {
        self.panels.response.panels.strengths(alpha)
    }

    /// Arc length of the nose from the first node.
    fn nose(&self) -> f64 {
        self.curve.arc_length(self.curve.nose())
    }

    /// Lift coefficient of slow flow without layers at an angle of attack against the chord line.
    fn lift(&self, alpha: f64) -> f64 {
        self.panels.inviscid(self.panels.nodes.frame.alpha(alpha), 0.0).map_or(0.0, |flow| flow.cl)
    }

    /// Angle of attack against the chord line: the one that is asked for, or by the rule of Prandtl and Glauert that of
    /// the lift.
    pub fn alpha(&self, condition: &Condition) -> f64 {
        match condition.incidence {
            Incidence::Alpha(alpha) => self.panels.nodes.frame.incidence(alpha),
            Incidence::Lift(wanted) => {
                let slow = wanted * (1.0 - condition.mach * condition.mach).sqrt();
                let zero = self.lift(0.0);
                ((slow - zero) / (self.lift(0.1) - zero) * 0.1).clamp(-0.2, 0.2)
            }
        }
    }

    /// The outer flow, from the panel flow or from a stagnation point at the nose with stricter limits of the steps.
    pub fn outer(&self, condition: &Condition, panel: bool) -> Guess {
        let alpha = self.alpha(condition);
        let (stagnation, circulation) = match panel {
            true => (self.stagnation(&self.speeds(alpha)), 0.5 * self.lift(alpha)),
            false => (self.nose(), 0.0),
        };
        let transition = [0.0; 2];
        Guess {
            stagnation,
            circulation,
            alpha,
            transition,
            relaxed: panel,
            lift_first: false,
            patience: PATIENCE,
            layers: None,
        }
    }

    /// Fractions of the sides at which transition is expected: at the trips, or where the slower flow has it without
    /// them or far ahead of them. Without a slower flow that is where a laminar layer would separate, at the latest.
    pub fn turning(&self, condition: &Condition, slow: Option<&Solution>, alpha: f64) -> [f64; 2] {
        let trips = turning_of_trips(condition.trips);
        let found = match slow {
            Some(slow) => slow.coefficients.transition,
            None => self.separation(alpha).map(|place| place.min(USUAL_TRANSITION)),
        };
        std::array::from_fn(|k| match (trips[k], condition.trips[k]) {
            (Some(turning), Some(x)) if found[k] > (1.0 - SHIFT) * x => turning,
            _ => found[k].clamp(0.01, 0.97),
        })
    }

    /// Fractions of the sides at which laminar layers would separate in the panel flow without layers, by the method of
    /// Thwaites.
    fn separation(&self, alpha: f64) -> [f64; 2] {
        let speeds = self.speeds(alpha);
        let places: Vec<f64> = (0..speeds.len()).map(|k| self.curve.arc_length(k as f64)).collect();
        let stagnation = self.stagnation(&speeds);
        Side::BOTH.map(|side| {
            // from the stagnation point on: distance and speed
            let mut way: Vec<[f64; 2]> = places
                .iter()
                .zip(&speeds)
                .map(|(&place, &speed)| [side.distance(stagnation, place), speed.abs()])
                .filter(|[s, _]| *s > 0.0)
                .collect();
            way.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let length = side.length(stagnation, self.curve.total());
            let (mut integral, mut last) = (0.0, [0.0f64; 2]);
            for [s, u] in way {
                integral += 0.5 * (u.powi(5) + last[1].powi(5)) * (s - last[0]);
                let slope = (u - last[1]) / (s - last[0]);
                if 0.45 * integral * slope / u.powi(6) < SEPARATING {
                    return last[0] / length;
                }
                last = [s, u];
            }
            1.0
        })
    }

    /// Arc length of the stagnation point from the first node for the speeds at the nodes.
    fn stagnation(&self, speeds: &[f64]) -> f64 {
        let nose = self.nose();
        let crossing = (1..speeds.len()).filter(|&k| speeds[k - 1] > 0.0 && speeds[k] <= 0.0);
        let places = crossing.map(|k| {
            let share = speeds[k - 1] / (speeds[k - 1] - speeds[k]);
            self.curve.arc_length((k - 1) as f64 + share)
        });
        places.min_by(|a, b| (a - nose).abs().total_cmp(&(b - nose).abs())).unwrap_or(nose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::TrailingEdge;
    use crate::flow::testcases::naca_symmetric;

    #[test]
    fn laminar_layers_separate_early_behind_a_suction_peak_and_late_without() {
        let nodes = naca_symmetric(0.12, 0.0, 161);
        let panels = PanelledSection::new(&nodes, TrailingEdge::Sharp).unwrap();
        let curve = SectionCurve::new(&panels.nodes.inside).unwrap();
        let guessing = Guessing::new(&panels, &curve);
        let [upper, lower] = guessing.separation(0.0);
        // the speed falls slowly behind the thickest place
        assert!((0.5..0.75).contains(&upper) && (upper - lower).abs() < 1e-6, "{upper} {lower}");
        let [upper, lower] = guessing.separation(0.1);
        assert!(upper < 0.1 && lower > 0.75, "{upper} {lower}");
        let free = Condition::new(Incidence::Alpha(0.1), 1e6);
        let [upper, lower] = guessing.turning(&free, None, 0.1);
        assert!(upper < 0.1 && lower == USUAL_TRANSITION, "{upper} {lower}");
    }
}
