//! Axes: the values they show, and round ticks for them. This module depends on nothing else in the crate.

/// One axis: what it shows, and how values become pixels.
#[derive(Debug, Clone)]
pub(super) struct PlotAxis {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) logarithmic: bool,
    pub(super) label: String,
    /// Distance of labelled ticks: in values, or in decades.
    pub(super) step: f64,
}

impl PlotAxis {
    /// An axis for `values` (those that it can show), with about `ticks` labelled ticks.
    pub(super) fn around(values: impl Iterator<Item = f64>, logarithmic: bool, label: &str, ticks: f64) -> Self {
        let scaled = values.filter(|v| v.is_finite() && (!logarithmic || *v > 0.0));
        let scaled = scaled.map(|v| if logarithmic { v.log10() } else { v });
        let (mut low, mut high) = scaled.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        // halves, because the span of very large values overflows
        let span = 2.0 * (0.5 * high - 0.5 * low);
        let least = 1e-9 * low.abs().max(high.abs()).max(1e-9);
        let pad = match span > least {
            true => 0.04 * span,
            false if logarithmic => (0.05 * low.abs()).max(0.3),
            // what is zero throughout has no scale of its own
            false if low == 0.0 => 1.0,
            false => (0.05 * low.abs()).max(1e-9),
        };
        (low, high) = ((low - pad).max(-1e300), (high + pad).min(1e300));
        let mut axis = Self { low, high, logarithmic, label: label.to_owned(), step: 1.0 };
        axis.step = if logarithmic { decade_step(high - low, ticks) } else { nice_step(high - low, ticks) };
        axis
    }

    /// Share of the axis at `value`; `None` where the axis cannot show it.
    pub(super) fn share(&self, value: f64) -> Option<f64> {
        let scaled = if self.logarithmic { value.log10() } else { value };
        let share = (scaled - self.low) / (self.high - self.low);
        share.is_finite().then_some(share)
    }

    /// An axis from `low` to `high`, neither of them logarithms.
    pub(super) fn between(low: f64, high: f64, logarithmic: bool, label: &str, ticks: f64) -> Self {
        let scaled = |v: f64| if logarithmic { v.log10() } else { v };
        let (low, high) = (scaled(low), scaled(high));
        if !(low.is_finite() && high.is_finite() && low < high) {
            return Self::around(std::iter::empty(), logarithmic, label, ticks);
        }
        let step = if logarithmic { decade_step(high - low, ticks) } else { nice_step(high - low, ticks) };
        Self { low, high, logarithmic, label: label.to_owned(), step }
    }

    /// Labelled ticks: share of the axis and label.
    pub(super) fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic && self.high - self.low < FEW_DECADES {
            return self.ticks_of_a_short_axis();
        }
        let first = (self.low / self.step - 1e-9).ceil();
        let count = ((self.high / self.step + 1e-9).floor() - first).clamp(-1.0, 99.0) as i32;
        let value = |k: i32| (first + f64::from(k)) * self.step;
        // as many digits as tell the ticks apart
        let decimals = (-self.step.log10().floor()).clamp(0.0, 12.0) as usize;
        let plain = self.high.abs().max(self.low.abs()) < 1e5 && self.step >= 1e-5;
        let label = |v: f64| match (self.logarithmic, plain) {
            (true, _) => power_of_ten(v),
            (false, true) => format!("{:.decimals$}", v + 0.0).replace('-', "\u{2212}"),
            (false, false) if v == 0.0 => "0".to_owned(),
            (false, false) => {
                // as many digits as the step has behind the first of the value, without the noise of first × step
                let digits = (v.abs().log10().floor() - self.step.log10().floor()).clamp(0.0, 12.0) as usize;
                format!("{v:.digits$e}").replace('-', "\u{2212}")
            }
        };
        let share = |v: f64| (v - self.low) / (self.high - self.low);
        (0..=count)
            .map(value)
            .map(|v| if v.abs() < 1e-9 * self.step { 0.0 } else { v })
            .map(|v| (share(v), label(v)))
            .collect()
    }

    /// Ticks of a logarithmic axis of few decades, of which no more than one or two powers of ten could be labelled:
    /// 1, 2 and 5 times each.
    fn ticks_of_a_short_axis(&self) -> Vec<(f64, String)> {
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let exponents = decades.flat_map(|d| [1.0_f64, 2.0, 5.0].map(|m| (f64::from(d), m)));
        let tick = |(d, m): (f64, f64)| ((d + m.log10() - self.low) / (self.high - self.low), d, m);
        let inside = exponents.map(tick).filter(|(share, ..)| (-1e-9..=1.0 + 1e-9).contains(share));
        let label = |d: f64, m: f64| match m {
            1.0 => power_of_ten(d),
            _ => format!("{m:.0}·{}", power_of_ten(d)),
        };
        inside.map(|(share, d, m)| (share, label(d, m))).collect()
    }

    /// Ticks between the labelled ones of a short logarithmic axis.
    pub(super) fn minor(&self) -> Vec<f64> {
        if !self.logarithmic || self.step > 1.0 || self.high - self.low > 5.0 {
            return Vec::new();
        }
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let values = decades.flat_map(|d| (2..10).map(move |m| f64::from(d) + f64::from(m).log10()));
        values.map(|v| (v - self.low) / (self.high - self.low)).filter(|s| (0.0..=1.0).contains(s)).collect()
    }
}

/// 1, 2 or 5 times a power of ten, such that about `ticks` of them make `span`.
pub(super) fn nice_step(span: f64, ticks: f64) -> f64 {
    let raw = (span / ticks).max(1e-300);
    let power = 10.0_f64.powf(raw.log10().floor());
    let mantissa = raw / power;
    power
        * if mantissa < 1.5 {
            1.0
        } else if mantissa < 3.5 {
            2.0
        } else if mantissa < 7.5 {
            5.0
        } else {
            10.0
        }
}

/// Whole decades between labelled ticks of a logarithmic axis.
fn decade_step(span: f64, ticks: f64) -> f64 {
    if span > ticks { nice_step(span, ticks).max(1.0).round() } else { 1.0 }
}

/// Decades below which a logarithmic axis labels more than powers of ten.
const FEW_DECADES: f64 = 2.2;

fn power_of_ten(exponent: f64) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised = format!("{exponent:.0}");
    let raised = raised.chars().map(|c| c.to_digit(10).map_or('⁻', |d| digits[d as usize]));
    format!("10{}", raised.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let labels = |axis: &PlotAxis| axis.ticks().into_iter().map(|t| t.1).collect::<Vec<_>>();
        let axis = PlotAxis::around([0.0, 1.0].into_iter(), false, "x", 6.0);
        assert_eq!(labels(&axis), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        let axis = PlotAxis::around([-1.5, 0.5].into_iter(), false, "x", 4.0);
        assert_eq!(labels(&axis), ["\u{2212}1.5", "\u{2212}1.0", "\u{2212}0.5", "0.0", "0.5"]);
        let axis = PlotAxis::around([4e-7, 1e-2].into_iter(), true, "f", 6.0);
        assert_eq!(labels(&axis), ["10⁻⁶", "10⁻⁵", "10⁻⁴", "10⁻³", "10⁻²"]);
        let axis = PlotAxis::around([4e-3, 3e-2].into_iter(), true, "f", 6.0);
        assert_eq!(labels(&axis), ["5·10⁻³", "10⁻²", "2·10⁻²"]);
        let axis = PlotAxis::between(0.0, 4.0, false, "x", 4.0);
        assert_eq!(labels(&axis), ["0", "1", "2", "3", "4"]);
        let axis = PlotAxis::around([0.0, 3e6].into_iter(), false, "Re", 3.0);
        assert_eq!(labels(&axis), ["0", "1e6", "2e6", "3e6"]);
        let axis = PlotAxis::around([-1.04e-14, 2.6e-15].into_iter(), false, "small", 6.0);
        assert_eq!(labels(&axis)[..2], ["\u{2212}1.0e\u{2212}14", "\u{2212}8e\u{2212}15"]);
        let axis = PlotAxis::around([0.0; 3].into_iter(), false, "zero", 4.0);
        assert_eq!(labels(&axis), ["\u{2212}1.0", "\u{2212}0.5", "0.0", "0.5", "1.0"]);
        for values in [[0.0, 0.0], [5.0, 5.0], [-1e300, 1e300], [1e-300, 2e-300], [f64::NAN, f64::INFINITY]] {
            for logarithmic in [false, true] {
                let axis = PlotAxis::around(values.into_iter(), logarithmic, "", 5.0);
                assert!(axis.low < axis.high && (axis.high - axis.low).is_finite(), "{axis:?}");
                let ticks = axis.ticks();
                assert!(ticks.len() < 40, "{axis:?}");
                assert!(ticks.iter().all(|t| (-1e-6..=1.0 + 1e-6).contains(&t.0)), "{ticks:?}");
            }
        }
    }
}
