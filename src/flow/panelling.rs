//! Where the panel nodes of a section sit.

use crate::section::Section;

/// Samples of a section between which the node density is integrated.
const SAMPLES: usize = 4001;
/// Turning of the surface over one panel, over the longest panel: a nose of radius r gets panels of length 11 r times
/// that of the longest.
const TURNING: f64 = 12.0;
/// Length of the panels at the trailing edge, over that of the longest.
const EDGE: f64 = 0.2;
/// Largest growth of the panel length per arc length.
const GROWTH: f64 = 0.15;

/// Curve parameters of `nodes` panel nodes, from the trailing edge over the upper surface and back.
///
/// Panels are as long as the turning of the surface allows (short at the nose, whatever its radius), short at the
/// trailing edge, and grow slowly in between; all in proportion, so that more panels resolve everything better. Choose
/// them once, from the undeformed section, and keep them while it deforms: nodes at fixed parameters move smoothly with
/// the shape.
///
/// ```
/// use aeroform::flow::panel_parameters;
/// use aeroform::section::SectionDefinition;
/// let section = SectionDefinition::parse("naca0012").unwrap().section().unwrap();
/// let parameters = panel_parameters(&section, 161);
/// let nodes: Vec<[f64; 2]> = parameters.iter().map(|&u| section.curve().point_at(u)).collect();
/// assert_eq!(nodes[0], section.trailing_edge_points()[0]);
/// assert!(nodes[80][0] < 1e-3); // the nose
/// ```
pub fn panel_parameters(section: &Section<f64>, nodes: usize) -> Vec<f64> {
    let outline = Sampled::new(section);
    let panels = nodes.saturating_sub(1).max(1);
    // the longest panel that gives the number wanted
    let (mut short, mut long) = (outline.total() / (4.0 * panels as f64), outline.total());
    for _ in 0..40 {
        let middle = 0.5 * (short + long);
        let count = outline.counts(&outline.lengths(middle));
        if count[SAMPLES - 1] > panels as f64 { short = middle } else { long = middle }
    }
    let counts = outline.counts(&outline.lengths(0.5 * (short + long)));
    let whole = counts[SAMPLES - 1];
    let parameters = &outline.parameters;
    (0..nodes)
        .map(|i| {
            if i == panels {
                return parameters[SAMPLES - 1];
            }
            let wanted = whole * i as f64 / panels as f64;
            let k = counts.partition_point(|s| *s <= wanted).clamp(1, SAMPLES - 1);
            let t = (wanted - counts[k - 1]) / (counts[k] - counts[k - 1]);
            parameters[k - 1] + t * (parameters[k] - parameters[k - 1])
        })
        .collect()
}

/// A section on a fine grid.
struct Sampled {
    parameters: Vec<f64>,
    arc: Vec<f64>,
    /// Direction of the surface, continuous.
    direction: Vec<f64>,
}

impl Sampled {
    fn new(section: &Section<f64>) -> Self {
        let curve = section.curve();
        let parameters = section.parameters(SAMPLES);
        let (mut arc, mut direction): (Vec<f64>, Vec<f64>) = (vec![0.0], vec![]);
        let points: Vec<[f64; 2]> = parameters.iter().map(|&u| curve.point_at(u)).collect();
        for ends in points.windows(2) {
            let [dx, dy] = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
            arc.push(arc[arc.len() - 1] + dx.hypot(dy));
            let angle = dy.atan2(dx);
            let turns = direction.last().map_or(0.0, |last| ((last - angle) / std::f64::consts::TAU).round());
            direction.push(angle + turns * std::f64::consts::TAU);
        }
        direction.push(direction[direction.len() - 1]);
        Self { parameters, arc, direction }
    }

    fn total(&self) -> f64 {
        self.arc[SAMPLES - 1]
    }

    /// Panel length wanted at every sample, for a longest panel.
    fn lengths(&self, longest: f64) -> Vec<f64> {
        let total = self.total();
        let allowed = TURNING * longest;
        let mut lengths: Vec<f64> = (0..SAMPLES)
            .map(|k| {
                let edge = self.arc[k].min(total - self.arc[k]);
                self.turning_length(k, allowed, longest).min(EDGE * longest + GROWTH * edge)
            })
            .collect();
        // no faster growth than allowed, in both directions
        for k in 1..SAMPLES {
            lengths[k] = lengths[k].min(lengths[k - 1] + GROWTH * (self.arc[k] - self.arc[k - 1]));
        }
        for k in (0..SAMPLES - 1).rev() {
            lengths[k] = lengths[k].min(lengths[k + 1] + GROWTH * (self.arc[k + 1] - self.arc[k]));
        }
        lengths
    }

    /// Length about sample `k` within which the surface turns by `allowed`, net: waviness of measured points turns back.
    fn turning_length(&self, k: usize, allowed: f64, longest: f64) -> f64 {
        let (mut low, mut high) = (k, k);
        loop {
            let length = self.arc[high] - self.arc[low];
            let turning = (self.direction[high] - self.direction[low]).abs();
            if turning >= allowed {
                return length * allowed / turning;
            }
            if length >= longest || (low == 0 && high == SAMPLES - 1) {
                return longest;
            }
            (low, high) = (low.saturating_sub(1), (high + 1).min(SAMPLES - 1));
        }
    }

    /// Number of panels up to every sample.
    fn counts(&self, lengths: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0];
        for k in 1..SAMPLES {
            let density = 0.5 * (lengths[k].recip() + lengths[k - 1].recip());
            sum.push(sum[k - 1] + density * (self.arc[k] - self.arc[k - 1]));
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::SectionDefinition;

    #[test]
    fn nodes_are_ordered_even_and_dense_at_the_nose() {
        for name in ["naca0012", "naca0006:sharp", "naca4412", "naca23012"] {
            let section = SectionDefinition::parse(name).unwrap().section().unwrap();
            let parameters = panel_parameters(&section, 161);
            assert!(parameters.windows(2).all(|w| w[0] < w[1]));
            let nodes: Vec<[f64; 2]> = parameters.iter().map(|&u| section.curve().point_at(u)).collect();
            let lengths: Vec<f64> = nodes.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).collect();
            assert!(lengths.windows(2).all(|w| (w[0] / w[1]).ln().abs() < 0.6), "{name}");
            let foremost = (0..161).fold(0, |best, k| if nodes[k][0] < nodes[best][0] { k } else { best });
            let nose = lengths[foremost - 1];
            let longest = lengths.iter().fold(0.0, |m: f64, l| m.max(*l));
            assert!((60..100).contains(&foremost) && nose < 0.4 * longest, "{name}: {foremost} {nose} {longest}");
            assert!(lengths[0] < 0.005 && lengths[159] < 0.005, "{name}: {} {}", lengths[0], lengths[159]);
        }
    }
}
