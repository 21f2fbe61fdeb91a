//! Parameters on the curve of a section at which panel nodes stand.

use crate::plane::distance;
use crate::section::Section;
use crate::spline::BSplineCurve;
use num_dual::Dual2_64;

/// Number of samples of a section between which the node density is integrated.
const SAMPLES: usize = 2001;
/// Arc length, in perimeters, over which curvature is averaged; coordinates that were measured have ragged curvature.
const SMOOTHING: f64 = 0.01;
/// Averaging length at the nose, in nose radii, and its growth per arc length from the nose. A wider average would hide
/// the nose of a thin section.
const NOSE_SMOOTHING: [f64; 2] = [0.5, 0.25];
/// Smallest averaging length at the nose, in perimeters. It keeps a section with a sharp nose from drawing all nodes
/// there.
const LEAST_SMOOTHING: f64 = 5e-4;

/// Curve parameters (0 to 1) of `nodes` panel nodes, from the trailing edge over the upper surface and back along the
/// lower one.
///
/// The nodes stand at equal steps of the integral of a density over arc length. The density grows with the smoothed
/// curvature and towards the trailing edge. The term linear in the curvature gives every turn of the surface a fixed
/// number of panels: 20 to 26 of 160 to the nose (up to 45 degrees on both sides of its tip), whatever its radius. Thin sections need that, because their suction
/// peak is as narrow as the nose. Choose the parameters once, from the undeformed section, and keep them while it
/// deforms: nodes at fixed parameters move smoothly with the shape.
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
    let curve = section.curve();
    let parameters = section.parameters(SAMPLES);
    let samples = samples(curve, &parameters);
    let mut arc = vec![0.0];
    for ends in samples.windows(2) {
        arc.push(arc[arc.len() - 1] + distance(ends[0].point, ends[1].point));
    }
    let total = arc[arc.len() - 1];
    let nose = Nose::new(section, &parameters, &samples, &arc);
    let curvature = smoothed_curvature(&samples, &arc, &nose);
    let density = |k: usize| {
        let edge = arc[k].min(total - arc[k]);
        let bend = curvature[k] * total / 2.0;
        1.0 + 0.2 * bend.sqrt() + 0.25 * bend + 4.0 * (-edge / (0.02 * total)).exp()
    };
    let mut sum = vec![0.0];
    for k in 1..SAMPLES {
        sum.push(sum[k - 1] + 0.5 * (density(k) + density(k - 1)) * (arc[k] - arc[k - 1]));
    }
    let whole = sum[SAMPLES - 1];
    let last = nodes.saturating_sub(1).max(1);
    (0..nodes)
        .map(|i| {
            if i == last {
                return parameters[SAMPLES - 1];
            }
            let wanted = whole * i as f64 / last as f64;
            let k = sum.partition_point(|s| *s <= wanted).clamp(1, SAMPLES - 1);
            let t = (wanted - sum[k - 1]) / (sum[k] - sum[k - 1]);
            parameters[k - 1] + t * (parameters[k] - parameters[k - 1])
        })
        .collect()
}

/// A place on the curve at which the density is computed.
struct Sample {
    point: [f64; 2],
    /// Derivative of the point with respect to the parameter.
    heading: [f64; 2],
    /// Magnitude of the curvature, in one over chords.
    curvature: f64,
}

impl Sample {
    /// The sample from the coordinates with their first two derivatives.
    fn new([x, y]: [Dual2_64; 2]) -> Self {
        let speed = x.v1.hypot(y.v1).max(f64::MIN_POSITIVE);
        let curvature = (x.v1 * y.v2 - y.v1 * x.v2).abs() / speed.powi(3);
        Self { point: [x.re, y.re], heading: [x.v1, y.v1], curvature }
    }
}

/// Samples at ascending parameters. Many stand in each span of the curve, so that the Taylor series of the span, which is
/// exact, is quicker than the basis functions at every one.
fn samples(curve: &BSplineCurve<f64, 2>, parameters: &[f64]) -> Vec<Sample> {
    let (mut span, mut start, mut series) = (usize::MAX, 0.0, Vec::new());
    let sample = |&u: &f64| {
        let own = curve.knots().span(u);
        if own != span {
            (span, start) = (own, u);
            series = curve.derivatives(u, curve.degree());
        }
        let step = Dual2_64::new(u - start, 1.0, 0.0);
        let coordinate = |axis: usize| {
            let horner = |sum: Dual2_64, (k, term): (usize, &[f64; 2])| sum * step / (k + 1) as f64 + term[axis];
            series.iter().enumerate().rev().fold(Dual2_64::from(0.0), horner)
        };
        Sample::new([coordinate(0), coordinate(1)])
    };
    parameters.iter().map(sample).collect()
}

/// Magnitude of the curvature at every sample, in one over chords, averaged over neighbouring samples.
fn smoothed_curvature(samples: &[Sample], arc: &[f64], nose: &Nose) -> Vec<f64> {
    let total = arc[arc.len() - 1];
    let [share, growth] = NOSE_SMOOTHING;
    let at_nose = (share * nose.radius).max(LEAST_SMOOTHING * total);
    let (mut low, mut high) = (0, 0);
    // averages are by arc length, because the samples need not be even
    let last = arc.len() - 1;
    let lengths: Vec<f64> = (0..=last).map(|j| arc[(j + 1).min(last)] - arc[j.saturating_sub(1)]).collect();
    let bends: Vec<f64> = lengths.iter().zip(samples).map(|(length, sample)| length * sample.curvature).collect();
    let [lengths, bends] = [lengths, bends].map(|values| Sums::new(arc, &values));
    (0..=last)
        .map(|k| {
            let reach = (at_nose + growth * (arc[k] - nose.arc).abs()).min(SMOOTHING * total);
            while arc[k] - arc[low] > reach {
                low += 1;
            }
            while high + 1 < arc.len() && arc[high + 1] - arc[k] <= reach {
                high += 1;
            }
            let [norm, sum] = [&lengths, &bends].map(|sums| sums.under_hat([low, k, high], arc[k], reach));
            // round-off must not make a straight line bend backwards
            (sum / norm).max(0.0)
        })
        .collect()
}

/// Sums of a list of values along the arc, from which averages follow without a loop over neighbours.
struct Sums {
    /// Sum of the values up to each sample, from zero on.
    values: Vec<f64>,
    /// Sum of the values times their arc lengths.
    moments: Vec<f64>,
}

impl Sums {
    fn new(arc: &[f64], values: &[f64]) -> Self {
        let sums = |terms: &mut dyn Iterator<Item = f64>| {
            let mut sum = 0.0;
            let after = terms.map(|term| {
                sum += term;
                sum
            });
            std::iter::once(0.0).chain(after).collect()
        };
        Self {
            values: sums(&mut values.iter().copied()),
            moments: sums(&mut values.iter().zip(arc).map(|(value, arc)| value * arc)),
        }
    }

    /// Sum over the samples `low` to `high` with weights that fall from 1 at sample `k`, at the arc length `middle`, to 0
    /// at a distance of `reach`.
    fn under_hat(&self, [low, k, high]: [usize; 3], middle: f64, reach: f64) -> f64 {
        let over = |sums: &[f64], from: usize, to: usize| sums[to] - sums[from];
        let distance = |from: usize, to: usize| over(&self.moments, from, to) - middle * over(&self.values, from, to);
        over(&self.values, low, high + 1) - (distance(k, high + 1) - distance(low, k)) / reach
    }
}

/// Place and radius of the nose. Both are interpolated between samples, so that panels move smoothly with them.
struct Nose {
    /// Arc length from the first sample.
    arc: f64,
    /// Length over angle of the part that turns by less than 45 degrees to either side.
    radius: f64,
}

impl Nose {
    fn new(section: &Section<f64>, parameters: &[f64], samples: &[Sample], arc: &[f64]) -> Self {
        let curve = section.curve();
        // where the leading edge is not defined, the parameter at which the surfaces meet
        let u = section.leading_edge_parameter().unwrap_or(section.nose_parameter());
        let [x, y] = curve.derivatives(u, 1)[1];
        // positive where the heading is within 45 degrees of that at the nose
        let near = |k: usize| {
            let [p, q] = samples[k].heading;
            let size = (x.hypot(y) * p.hypot(q)).max(f64::MIN_POSITIVE);
            (x * p + y * q - (x * q - y * p).abs()) / size
        };
        let behind = parameters.partition_point(|&p| p < u).clamp(1, parameters.len() - 1);
        let place = arc[behind - 1] + distance(samples[behind - 1].point, curve.point_at(u));
        let end = |samples: &mut dyn Iterator<Item = usize>| {
            let mut last = (place, 1.0);
            for k in samples {
                let here = near(k);
                if here <= 0.0 {
                    return last.0 + (arc[k] - last.0) * last.1 / (last.1 - here);
                }
                last = (arc[k], here);
            }
            last.0
        };
        let ends = [end(&mut (0..behind).rev()), end(&mut (behind..parameters.len()))];
        Self { arc: place, radius: (ends[1] - ends[0]) / std::f64::consts::FRAC_PI_2 }
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
            let lengths: Vec<f64> = nodes.windows(2).map(|w| distance(w[0], w[1])).collect();
            assert!(lengths.windows(2).all(|w| (w[0] / w[1]).ln().abs() < 0.6), "{name}");
            let foremost = (0..161).fold(0, |best, k| if nodes[k][0] < nodes[best][0] { k } else { best });
            let nose = lengths[foremost - 1];
            let longest = lengths.iter().fold(0.0, |m: f64, l| m.max(*l));
            assert!((60..100).contains(&foremost) && nose < 0.4 * longest, "{name}: {foremost} {nose} {longest}");
            // four-digit nose radius; fine enough for the suction peak of a thin section
            let thickness = if name.contains("06") { 0.06 } else { 0.12 };
            assert!(nose < 0.25 * 1.1019 * thickness * thickness, "{name}: {nose}");
            assert!(lengths[0] < 0.005 && lengths[159] < 0.005, "{name}: {} {}", lengths[0], lengths[159]);
        }
    }
}
