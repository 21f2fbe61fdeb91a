//! Numbers as people read them.

/// A number in a few significant digits, without an exponent where it has a usual size; sentences, tables and figures
/// use it, files for programs have all digits.
///
/// ```
/// use aeroform::report::engineering;
/// let texts = [0.0075213098, 2.1734, -0.25, 1e-7 / 3.0, 5e6, 0.0, f64::NAN].map(|v| engineering(v, 3));
/// assert_eq!(texts, ["0.00752", "2.17", "-0.25", "3.33e-8", "5e6", "0", "none"]);
/// ```
pub fn engineering(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "none".into();
    }
    let exponential = format!("{value:.*e}", digits.max(1) - 1);
    let (mantissa, power) = exponential.split_once('e').unwrap_or((&exponential, "0"));
    let power: i32 = power.parse().unwrap_or(0);
    if value == 0.0 {
        "0".into()
    } else if (-4..=5).contains(&power) {
        let decimals = (digits as i32 - 1 - power).max(0) as usize;
        without_zeros(&format!("{value:.decimals$}")).into()
    } else {
        format!("{}e{power}", without_zeros(mantissa))
    }
}

/// A decimal number without the zeros at its end.
fn without_zeros(number: &str) -> &str {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number }
}

#[cfg(test)]
mod tests {
    use super::engineering;

    #[test]
    fn rounding_carries_over_and_large_numbers_stay_whole() {
        let text = |value: f64| engineering(value, 4);
        assert_eq!([0.99996, 9999.96, 123456.7, 0.00012344].map(text), ["1", "10000", "123457", "0.0001234"]);
        assert_eq!([-1.5e-9, 1e300, f64::INFINITY, -0.0].map(text), ["-1.5e-9", "1e300", "none", "0"]);
    }
}
