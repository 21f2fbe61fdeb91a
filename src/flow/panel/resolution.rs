//! Estimate of the error that the number of panels leaves in the coefficients.

use crate::flow::coefficients::{Coefficients, Gradients};
use crate::plane::{distance, minus};

/// Estimated errors of the coefficients that come from the panels; `nodes` are the nodes of the section and `gradients`
/// the derivatives with respect to them.
///
/// The errors of panels act like a move of the surface by κ h²/12, with the curvature κ and the length h of the panels. A
/// polygon inscribed in the surface is too thin by as much on average, and strengths that are linear along a panel answer
/// to a wave of the surface too strongly, by the factor 1 + (k h)²/12 with the wave number k. The estimate is the exact
/// directional derivative of each coefficient along that move of all nodes.
pub(super) fn panel_error(nodes: &[[f64; 2]], gradients: &Gradients) -> Coefficients {
    let moves: Vec<[f64; 2]> = nodes.windows(3).map(|w| bulge([w[0], w[1], w[2]])).collect();
    // the ends stay
    let along = |by: &[[f64; 2]]| moves.iter().zip(&by[1..]).map(|(m, by)| m[0] * by[0] + m[1] * by[1]).sum::<f64>();
    gradients.as_ref().map(|derivatives| along(&derivatives.nodes).abs())
}

/// κ h²/12 inwards at the middle one of three nodes, with the curvature κ and the product h² of the two panel lengths.
fn bulge([a, b, c]: [[f64; 2]; 3]) -> [f64; 2] {
    let (before, behind) = (minus(b, a), minus(c, b));
    let (h1, h2) = (distance(a, b), distance(b, c));
    [0, 1].map(|k| (behind[k] * h1 - before[k] * h2) / (6.0 * (h1 + h2)))
}

#[cfg(test)]
mod tests {
    use crate::flow::{Condition, Incidence, PanelledSection, Settings, Solution, panel_parameters};
    use crate::section::SectionDefinition;

    /// The flow with some panels and some quarters of the default number of stations.
    fn flow(panels: usize, quarters: usize, condition: &Condition) -> Solution {
        let section = SectionDefinition::parse("naca4412").unwrap().section().unwrap();
        let nodes: Vec<[f64; 2]> =
            panel_parameters(&section, panels + 1).into_iter().map(|u| section.curve().point_at(u)).collect();
        let panels = PanelledSection::new(&nodes, section.trailing_edge()).unwrap();
        let Settings { laminar_stations, turbulent_stations, .. } = Settings::default();
        let [laminar_stations, turbulent_stations] = [laminar_stations, turbulent_stations].map(|n| quarters * n / 4);
        let settings = Settings { laminar_stations, turbulent_stations, ..Settings::default() };
        panels.analyze(condition, &settings, None).unwrap()
    }

    fn solution(panels: usize, incidence: Incidence) -> Solution {
        flow(panels, 4, &Condition::new(incidence, 3e6))
    }

    #[test]
    fn the_estimate_falls_with_the_square_of_the_panels() {
        for incidence in [Incidence::Alpha(0.05), Incidence::Lift(0.8)] {
            let [coarse, fine] = [80, 160].map(|n| solution(n, incidence).discretisation_error().unwrap().panels);
            let ratio = coarse.cd / fine.cd;
            assert!((2.5..6.5).contains(&ratio), "{ratio}");
            assert!(matches!(incidence, Incidence::Alpha(_)) || fine.cl < 1e-12, "held lift has no error: {}", fine.cl);
        }
    }

    #[test]
    fn the_estimate_of_stations_is_what_twice_as_many_change() {
        let tripped = |incidence| Condition { trips: [Some(0.1); 2], ..Condition::new(incidence, 3e6) };
        // the last one has a long laminar bubble
        for condition in [
            tripped(Incidence::Alpha(0.05)),
            tripped(Incidence::Lift(0.8)),
            Condition::new(Incidence::Alpha(0.05), 3e6),
            Condition::new(Incidence::Alpha(0.1), 2e5),
        ] {
            let [coarse, fine] = [2, 4].map(|quarters| flow(160, quarters, &condition));
            let estimate = coarse.discretisation_error().unwrap().stations;
            let change = coarse.coefficients.zip(fine.coefficients).map(|(a, b): (f64, f64)| (b - a).abs());
            for (name, estimate, change) in
                [("cl", estimate.cl, change.cl), ("cd", estimate.cd, change.cd), ("cm", estimate.cm, change.cm)]
            {
                let held = name == "cl" && matches!(condition.incidence, Incidence::Lift(_));
                let agree = if held { estimate < 1e-12 } else { (0.7..1.4).contains(&(estimate / change)) };
                assert!(agree, "{name}: {estimate} for {change}, {condition:?}");
            }
        }
    }

    #[test]
    fn a_smooth_section_is_resolved_and_few_panels_are_not_enough() {
        assert_eq!(solution(160, Incidence::Alpha(0.05)).is_resolved(), Some(true));
        assert_eq!(solution(44, Incidence::Alpha(0.05)).is_resolved(), Some(false));
    }
}
