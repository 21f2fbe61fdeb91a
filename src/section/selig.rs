//! Coordinate files in Selig's format, written.

use super::Section;
use crate::scalar::Scalar;
use std::fmt::Write;

/// How a coordinate file is written: see [`Section::selig_with`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SeligFormat {
    /// Number of points; `None` takes two for each knot span, or six where the numbers have ten decimals or more, so
    /// that all knots are among them. A file with these points interpolates so closely to the curve it came from that
    /// the lift coefficients of flows about both agree to 1e-6, or to 1e-4 with seven decimals.
    pub points: Option<usize>,
    /// How numbers are rounded.
    pub digits: Digits,
}

/// How the numbers of a coordinate file are rounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Digits {
    /// Seven decimals, and more where the section is much smaller than 1, so that seven digits of its length are kept.
    #[default]
    Usual,
    /// So many decimals.
    Decimals(usize),
    /// The shortest form that reads back to the same bits.
    Full,
}

impl SeligFormat {
    /// Decimals of the usual form.
    const USUAL: usize = 7;
    /// Decimals from which rounding does not roughen denser points.
    const MANY: usize = 10;

    /// Points for each knot span unless told otherwise.
    fn points_per_span(&self) -> usize {
        match self.digits {
            Digits::Full => 6,
            Digits::Decimals(decimals) if decimals >= Self::MANY => 6,
            _ => 2,
        }
    }
}

impl<S: Scalar> Section<S> {
    /// A coordinate file in Selig's format: the name, then a line `x y` for each knot of the curve, which for an
    /// interpolated section are its data points.
    ///
    /// Numbers are the shortest that read back to the same bits. [`selig_with`](Self::selig_with) writes other points
    /// and fewer digits.
    pub fn selig(&self) -> String {
        let knots = self.curve().knots().spans().count() + 1;
        self.selig_with(&SeligFormat { points: Some(knots), digits: Digits::Full })
    }

    /// A coordinate file in Selig's format with a chosen number of points and digits: the name, then a line `x y` for
    /// each of the [points](Section::points).
    ///
    /// ```
    /// use aeroform::section::{Digits, SectionDefinition, SeligFormat};
    /// let section = SectionDefinition::parse("naca0012:sharp").unwrap().section().unwrap();
    /// let format = SeligFormat { points: Some(5), digits: Digits::Decimals(4) };
    /// let text = section.selig_with(&format);
    /// assert!(text.starts_with("NACA 0012\n1.0000 0.0000\n") && text.lines().count() == 6);
    /// ```
    pub fn selig_with(&self, format: &SeligFormat) -> String {
        let spans = self.curve().knots().spans().count();
        let points = self.points(format.points.unwrap_or(format.points_per_span() * spans + 1));
        let points: Vec<[f64; 2]> = points.iter().map(|p| [p[0].re(), p[1].re()]).collect();
        let decimals = match format.digits {
            Digits::Usual => Some(usual_decimals(&points)),
            Digits::Decimals(decimals) => Some(decimals),
            Digits::Full => None,
        };
        let mut text = format!("{}\n", self.name());
        for [x, y] in points {
            // writing to a string cannot fail
            let _ = match decimals {
                Some(decimals) => writeln!(text, "{} {}", rounded(x, decimals), rounded(y, decimals)),
                None => writeln!(text, "{x} {y}"),
            };
        }
        text
    }
}

/// Seven decimals, or as many more as keep seven digits of the length of a small section.
fn usual_decimals(points: &[[f64; 2]]) -> usize {
    let ends = points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[0]), h.max(p[0])));
    let power = (ends.1 - ends.0).log10().round();
    // written so that a length that is no number counts as 1
    let more = if power < 0.0 { (-power).min(300.0) as usize } else { 0 };
    SeligFormat::USUAL + more
}

/// A number with so many decimals, without the sign of a zero.
fn rounded(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(magnitude) if magnitude.chars().all(|c| c == '0' || c == '.') => magnitude.to_string(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section::SectionDefinition;

    #[test]
    fn points_and_digits_are_those_asked_for() {
        let section = SectionDefinition::parse("naca2412").unwrap().section().unwrap();
        let spans = section.curve().knots().spans().count();
        let usual = section.selig_with(&SeligFormat::default());
        assert_eq!(usual.lines().count(), 2 + 2 * spans);
        let numbers: Vec<&str> = usual.lines().skip(1).flat_map(str::split_whitespace).collect();
        assert!(numbers.iter().all(|n| n.split_once('.').unwrap().1.len() == 7), "{usual}");
        let few = section.selig_with(&SeligFormat { points: Some(33), digits: Digits::Full });
        let points = section.points(33);
        for (line, point) in few.lines().skip(1).zip(&points) {
            let read: Vec<f64> = line.split_whitespace().map(|n| n.parse().unwrap()).collect();
            assert_eq!(read, point);
        }
        assert_eq!(few.lines().count(), 34);
    }

    #[test]
    fn small_sections_keep_their_digits_and_zeros_have_no_sign() {
        let section = SectionDefinition::parse("naca2412").unwrap().section().unwrap();
        let points = section.curve().control_points().iter().map(|p| p.map(|c| 1e-3 * c)).collect();
        let small = section.with_control_points::<f64>(points).unwrap();
        let line = small.selig_with(&SeligFormat::default()).lines().nth(1).unwrap().to_string();
        let read: Vec<f64> = line.split_whitespace().map(|n| n.parse().unwrap()).collect();
        let first = section.points(1)[0];
        assert!((0..2).all(|d| (1e3 * read[d] - first[d]).abs() < 1e-7), "{line} for {first:?}");
        assert_eq!([rounded(-1e-12, 7), rounded(-0.25, 1)], ["0.0000000", "-0.2"]);
    }
}
