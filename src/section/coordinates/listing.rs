//! From the bytes of a coordinate file to numbered points.

use super::columns::{self, Layout, Row};
use super::elements::elements;
use super::encoding::decode;
use super::line::{Line, classify, heads_columns, heads_mean_line, heads_surface, labelled_count, symmetry_flag};
use super::number::{Field, Oddity, Style, decimal_comma_vote, plain};
use super::point::Point;
use super::repair::{Repair, record};
use crate::plane::distance;
use crate::section::CoordinateError;

/// The contents of a file: points in the order of the file, and where it was divided.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Listing {
    pub title: Option<String>,
    pub points: Vec<Point>,
    /// Positions in `points` before which a blank line or a heading stands.
    pub breaks: Vec<usize>,
    /// Numbers of points of the first and the second surface, where a header announces them.
    pub surfaces: Option<[usize; 2]>,
    /// Everything that was unusual in reading.
    pub repairs: Vec<Repair>,
    /// Unit of the last digit; zero where it is not known.
    pub step: f64,
}

/// Coordinates beyond are refused: their products would lose all meaning.
const LARGEST: f64 = 1e9;
/// More points than any section needs; the checks take time that grows with the square.
pub(super) const MOST: usize = 10_000;

/// Whether a coordinate is finite and of sensible size.
pub(super) fn usable(coordinate: f64) -> bool {
    coordinate.abs() <= LARGEST
}

/// Reads a file; of several elements the one with the given number, from one.
pub(super) fn parse(bytes: &[u8], element: Option<usize>) -> Result<Listing, CoordinateError> {
    let text = decode(bytes)?;
    let lines: Vec<&str> = lines(&text).collect();
    let scan = Scan::of(&lines)?;
    let mut table = Table::of(scan, &lines)?;
    table.take_header(&lines)?;
    table.check()?;
    table.listing(element)
}

/// Lines of a text; ends of lines are those of Unix, DOS or old Macintosh.
fn lines(text: &str) -> impl Iterator<Item = &str> {
    let macintosh = !text.contains('\n');
    text.split(move |c| c == '\n' || (macintosh && c == '\r'))
}

/// How the numbers of a file are written.
fn style(lines: &[&str]) -> Style {
    let decimal_comma = lines.iter().map(|line| decimal_comma_vote(&plain(line).0)).sum::<i32>() > 0;
    let style = Style { decimal_comma, decimals: None };
    let mut decimals = None;
    let mut uniform = true;
    for line in lines {
        let Line::Numbers(fields, Oddity { touching: false, .. }) = classify(line, style) else { continue };
        for field in fields.iter().filter(|field| !field.whole) {
            uniform &= field.exponent == 0 && *decimals.get_or_insert(field.decimals) == field.decimals;
        }
    }
    Style { decimals: decimals.filter(|_| uniform).and_then(|d| usize::try_from(d).ok()), ..style }
}

/// Lines of numbers, and what stands between them.
#[derive(Debug, Default)]
struct Scan {
    title: Option<String>,
    rows: Vec<Row>,
    /// Positions in `rows` before which a blank line or a heading stands.
    breaks: Vec<usize>,
    /// Counts with a label before the first row: line and number.
    counts: Vec<(usize, usize)>,
    /// Whether the block of the line in the middle or of the chord is being passed over.
    within_mean_line: bool,
    repairs: Vec<Repair>,
}

impl Scan {
    fn of(lines: &[&str]) -> Result<Self, CoordinateError> {
        let style = style(lines);
        let mut scan = Self::default();
        for (number, line) in (1..).zip(lines) {
            match classify(line, style) {
                Line::Comment => {}
                Line::Blank => scan.divide(),
                Line::Numbers(fields, _) if scan.is_missing_title(&fields) => scan.title = Some(line.trim().into()),
                Line::Numbers(..) if scan.within_mean_line => {
                    record(&mut scan.repairs, Repair::MeanLineIgnored { count: 1, line: number });
                }
                Line::Numbers(fields, oddity) => {
                    scan.note(number, oddity);
                    scan.rows.push(Row { line: number, fields });
                    if scan.rows.len() > 2 * MOST {
                        return Err(CoordinateError::TooManyPoints { found: scan.rows.len(), most: MOST });
                    }
                }
                Line::Words if scan.rows.len() + usize::from(scan.within_mean_line) > 0 && heads_columns(line) => {
                    scan.divide();
                }
                Line::Words if heads_mean_line(line) => {
                    scan.divide();
                    scan.within_mean_line = true;
                }
                Line::Words if heads_surface(line) && (scan.within_mean_line || scan.rows.is_empty()) => {
                    scan.within_mean_line = false;
                }
                Line::Words if scan.rows.is_empty() => scan.head(number, line),
                Line::Words => {
                    scan.divide();
                    record(&mut scan.repairs, Repair::RemarkIgnored { count: 1, line: number });
                }
                Line::Damaged(_) if scan.rows.is_empty() && !is_like_a_point(line) => scan.head(number, line),
                Line::Damaged(text) => return Err(CoordinateError::NotANumber { line: number, text }),
            }
        }
        if scan.rows.is_empty() { Err(CoordinateError::Empty) } else { Ok(scan) }
    }

    /// Whether the first line is a word that could be a number ("Infinity").
    fn is_missing_title(&self, fields: &[Field]) -> bool {
        self.rows.is_empty() && self.title.is_none() && fields.iter().all(|field| !field.value.is_finite())
    }

    /// Takes a line of words before the first point.
    fn head(&mut self, number: usize, line: &str) {
        // OpenVSP names the format in the first line and the section in the second
        let general = self.title.as_ref().is_some_and(|title| title.to_lowercase().ends_with("airfoil file"));
        if let Some(count) = labelled_count(line) {
            self.counts.push((number, count));
        } else if symmetry_flag(line).is_none() && !heads_columns(line) && (self.title.is_none() || general) {
            self.title = Some(title(line));
        }
    }

    fn divide(&mut self) {
        let at = self.rows.len();
        if at > 0 && self.breaks.last() != Some(&at) {
            self.breaks.push(at);
        }
    }

    fn note(&mut self, line: usize, oddity: Oddity) {
        let repairs = &mut self.repairs;
        if oddity.dash {
            record(repairs, Repair::DashesRead { count: 1, line });
        }
        if oddity.comma {
            record(repairs, Repair::DecimalCommasRead { count: 1, line });
        }
        if oddity.touching {
            record(repairs, Repair::ColumnsSeparated { count: 1, line });
        }
    }
}

/// A title without quotation marks, and without the word that Tecplot or a table puts before it.
fn title(line: &str) -> String {
    let line = line.trim();
    let tecplot = line.split_once('=').filter(|(word, _)| word.trim().eq_ignore_ascii_case("title"));
    let table = line.split_once(',').filter(|(word, _)| word.trim().eq_ignore_ascii_case("name"));
    tecplot.or(table).map_or(line, |(_, title)| title).trim().trim_matches('"').trim().into()
}

/// Whether a damaged line before the first point may have been a point: two or three parts with digits, one with a
/// decimal point.
fn is_like_a_point(line: &str) -> bool {
    let separates = |c: char| c.is_whitespace() || c == ',' || c == ';';
    let parts: Vec<&str> = line.split(separates).filter(|part| !part.is_empty()).collect();
    let no_word = |part: &&str| part.contains(|c: char| c.is_ascii_digit()) || !part.contains(char::is_alphabetic);
    (1..=3).contains(&parts.len()) && parts.iter().all(no_word) && parts.iter().any(|part| part.contains('.'))
}

/// Rows of one width, the coordinates, and the counts around them.
#[derive(Debug)]
struct Table {
    title: Option<String>,
    points: Vec<Point>,
    breaks: Vec<usize>,
    separators: Vec<usize>,
    /// Counts before the first point: line and number.
    leading: Vec<(usize, usize)>,
    /// Counts between points: position in `points`, line and number.
    inner: Vec<(usize, usize, usize)>,
    /// Counts that a label explains.
    labelled: Vec<(usize, usize)>,
    /// Whether the first row, and no other one, is written in whole numbers.
    whole_first: bool,
    /// Line and numbers of the domain of a flow solver.
    domain: Option<(usize, [f64; 4])>,
    surfaces: Option<[usize; 2]>,
    repairs: Vec<Repair>,
    step: f64,
}

impl Table {
    fn of(scan: Scan, lines: &[&str]) -> Result<Self, CoordinateError> {
        let Scan { title, rows, breaks, counts: labelled, mut repairs, .. } = scan;
        let width = columns::usual_width(&rows);
        let data: Vec<Row> = rows.iter().filter(|row| row.fields.len() == width).cloned().collect();
        let (layout, found) = columns::layout(&data, width)?;
        repairs.extend(found);
        let picked = match layout {
            Layout::Points(xy) => xy,
            Layout::Sides([x, upper, _]) => [x, upper],
        };
        let step = step(&data, picked);
        let whole = |row: &Row| row.fields.iter().all(|field| field.whole);
        let whole_first = data.iter().position(whole) == Some(0) && !data.iter().skip(1).any(whole);
        let mut table = Self {
            title,
            points: Vec::with_capacity(data.len()),
            breaks: Vec::new(),
            separators: Vec::new(),
            leading: Vec::new(),
            inner: Vec::new(),
            labelled,
            whole_first,
            domain: None,
            surfaces: None,
            repairs,
            step,
        };
        for (index, row) in rows.iter().enumerate() {
            if breaks.contains(&index) {
                table.divide();
            }
            let Row { line, fields } = row;
            if fields.len() == width {
                table.add(*line, picked.map(|c| fields[c].value))?;
            } else {
                table.add_odd(*line, fields, lines)?;
            }
        }
        if let Layout::Sides([x, _, lower]) = layout {
            table.add_lower_side(&data, [x, lower])?;
        }
        Ok(table)
    }

    fn divide(&mut self) {
        if !self.points.is_empty() && self.breaks.last() != Some(&self.points.len()) {
            self.breaks.push(self.points.len());
        }
    }

    /// Takes the second side of a table whose rows are points of both; the first has been taken.
    fn add_lower_side(&mut self, rows: &[Row], picked: [usize; 2]) -> Result<(), CoordinateError> {
        let upper = self.points.len();
        // a count is one of rows
        self.leading.retain(|(_, count)| *count != upper);
        self.labelled.retain(|(_, count)| *count != upper);
        self.breaks = vec![upper];
        for Row { line, fields } in rows {
            self.add(*line, picked.map(|c| fields[c].value))?;
        }
        self.surfaces = Some([upper, self.points.len() - upper]);
        Ok(())
    }

    fn add(&mut self, line: usize, xy: [f64; 2]) -> Result<(), CoordinateError> {
        if xy[0] == xy[1] && [99.0, 999.0, 9999.0, 99999.0, 999.9, 999.99].contains(&xy[0]) {
            self.separators.push(self.points.len());
            return Ok(());
        }
        self.points.push(Point { xy, line, source: 0 });
        if self.points.len() > MOST {
            return Err(CoordinateError::TooManyPoints { found: self.points.len(), most: MOST });
        }
        Ok(())
    }

    /// Takes a row of another width than the others: a count, the domain of a flow solver, or a title of numbers.
    fn add_odd(&mut self, line: usize, fields: &[Field], lines: &[&str]) -> Result<(), CoordinateError> {
        let whole = fields.iter().all(|field| field.whole);
        match fields {
            [Field { value, whole: true, .. }] if *value >= 0.0 && *value <= 1e9 => {
                let count = *value as usize;
                if self.points.is_empty() {
                    self.leading.push((line, count));
                } else {
                    self.divide();
                    self.inner.push((self.points.len(), line, count));
                }
                Ok(())
            }
            [a, b, c, d] | [a, b, c, d, _] if self.points.is_empty() && self.domain.is_none() => {
                self.domain = Some((line, [a, b, c, d].map(|field| field.value)));
                Ok(())
            }
            _ if whole && self.points.is_empty() && self.title.is_none() => {
                self.title = lines.get(line - 1).map(|text| text.trim().into());
                Ok(())
            }
            _ => Err(CoordinateError::Columns { line, found: fields.len() }),
        }
    }

    /// Makes sense of the counts: numbers of points of the whole file or of two surfaces, or a title of digits.
    fn take_header(&mut self, lines: &[&str]) -> Result<(), CoordinateError> {
        self.take_pair(lines)?;
        let found = self.points.len();
        let announced = |counts: &[(usize, usize)]| counts.iter().map(|(_, count)| count).sum::<usize>();
        // a whole number of its own in the first line is a title unless it counts
        if let [(line, first), rest @ ..] = &self.leading[..]
            && self.title.is_none()
            && (rest.is_empty() || announced(&self.leading) != found)
            && !(*first == found && rest.is_empty())
            && self.inner.is_empty()
            && first.abs_diff(found) * 4 > found
        {
            self.title = lines.get(line - 1).map(|text| text.trim().into());
            self.leading.remove(0);
        }
        match (&self.leading[..], &self.inner[..]) {
            ([], []) => {}
            ([(line, count)], []) if *count != found => {
                return Err(CoordinateError::Count { line: *line, announced: *count, found });
            }
            ([_], []) => {}
            ([(_, upper), (line, lower)], []) => {
                if upper + lower != found {
                    return Err(CoordinateError::Count { line: *line, announced: upper + lower, found });
                }
                self.surfaces = Some([*upper, *lower]);
            }
            ([(line, upper)], [(at, second, lower)]) => {
                if upper != at {
                    return Err(CoordinateError::Count { line: *line, announced: *upper, found: *at });
                }
                if *lower != found - at {
                    return Err(CoordinateError::Count { line: *second, announced: *lower, found: found - at });
                }
                self.surfaces = Some([*upper, *lower]);
            }
            (_, [(_, line, _), ..]) => return Err(CoordinateError::Columns { line: *line, found: 1 }),
            ([_, (line, _), ..], []) => return Err(CoordinateError::Columns { line: *line, found: 1 }),
        }
        let labelled = announced(&self.labelled);
        match &self.labelled[..] {
            [(_, upper), (_, lower)] if labelled == found => self.surfaces = Some([*upper, *lower]),
            // a number that is far off counts something else
            [.., (line, _)] if labelled != found && 2 * labelled >= found && labelled <= 2 * found => {
                return Err(CoordinateError::Count { line: *line, announced: labelled, found });
            }
            _ => {}
        }
        Ok(())
    }

    /// Recognises a Lednicer header, two counts that add up to the number of points that follow, and titles of two
    /// numbers.
    fn take_pair(&mut self, lines: &[&str]) -> Result<(), CoordinateError> {
        let Some(&Point { xy: [a, b], line, .. }) = self.points.first() else { return Ok(()) };
        let is_count = |c: f64| (2.0..=MOST as f64).contains(&c) && c.fract() == 0.0;
        if !is_count(a) || !is_count(b) {
            return Ok(());
        }
        let (counts, found) = ([a as usize, b as usize], self.points.len() - 1);
        let announced = counts[0] + counts[1];
        if announced == found {
            self.remove_first();
            self.surfaces = Some(counts);
            return Ok(());
        }
        // in a Selig file of unusual units the first line would be an ordinary point of the outline
        let largest = self.points[1..].iter().flat_map(|p| p.xy).fold(0.0f64, |m, c| m.max(c.abs()));
        let end = self.points.last().map_or([a, b], |p| p.xy);
        let is_header = self.whole_first && distance([a, b], end) > 0.1 * largest;
        if a.min(b) <= 1.5 * largest && !is_header {
            return Ok(());
        }
        let text = lines.get(line - 1).map_or("", |text| text.trim());
        if self.title.is_none() && !text.contains('.') && announced.abs_diff(found) * 4 > found {
            self.title = Some(text.into());
            self.remove_first();
            return Ok(());
        }
        Err(CoordinateError::Count { line, announced, found })
    }

    fn remove_first(&mut self) {
        self.points.remove(0);
        let earlier = |at: &mut usize| *at = at.saturating_sub(1);
        self.breaks.iter_mut().chain(&mut self.separators).for_each(earlier);
        self.breaks.retain(|&at| at > 0);
        self.inner.iter_mut().for_each(|(at, ..)| earlier(at));
    }

    /// Numbers within reach, and within the domain of the flow solver.
    fn check(&mut self) -> Result<(), CoordinateError> {
        let found = self.points.len();
        self.breaks.retain(|&at| at < found);
        if found == 0 {
            return Err(CoordinateError::Empty);
        }
        for point in &self.points {
            if let Some(&value) = point.xy.iter().find(|c| !usable(**c)) {
                return Err(CoordinateError::Value { line: point.line, value });
            }
        }
        if let Some((line, [left, right, below, above])) = self.domain {
            let inside = |p: &Point| left < p.xy[0] && p.xy[0] < right && below < p.xy[1] && p.xy[1] < above;
            if !self.points.iter().all(inside) {
                return Err(CoordinateError::Columns { line, found: 4 });
            }
        }
        Ok(())
    }

    fn listing(self, element: Option<usize>) -> Result<Listing, CoordinateError> {
        let Self { title, points, breaks, surfaces, mut repairs, step, separators, .. } = self;
        let ranges = match surfaces {
            Some(_) => elements(&points, &[], &[]),
            None => elements(&points, &separators, &breaks),
        };
        let count = ranges.len();
        let chosen = element.unwrap_or(1);
        let Some(range) = chosen.checked_sub(1).and_then(|index| ranges.get(index)).cloned() else {
            return Err(CoordinateError::NoElement { element: chosen, count });
        };
        if count > 1 {
            if element.is_none() {
                let lines = ranges.iter().map(|range| points[range.start].line).collect();
                return Err(CoordinateError::SeveralElements { lines });
            }
            let line = points[range.start].line;
            repairs.push(Repair::ElementTaken { element: chosen, count, line });
        }
        let breaks = breaks.iter().filter(|at| range.start < **at && **at < range.end).map(|at| at - range.start);
        let breaks = breaks.collect();
        let points = points[range].to_vec();
        Ok(Listing { title, points, breaks, surfaces, repairs, step })
    }
}

/// Unit of the last digit of the finer coordinate: stations along the chord are often whole percents, and exact. Zeros
/// at the end may have been left out, so the most digits count; numbers with exponents have units of their own, of
/// which the middle one counts.
fn step(rows: &[Row], picked: [usize; 2]) -> f64 {
    let of_column = |c: usize| {
        let fields = || rows.iter().filter_map(move |row| row.fields.get(c));
        let decimals = fields().map(|field| field.decimals).max().unwrap_or(0);
        // a zero may have any exponent
        let mut exponents: Vec<i32> = fields().filter(|field| field.value != 0.0).map(|field| field.exponent).collect();
        exponents.sort_unstable();
        let exponent = exponents.get(exponents.len() / 2).copied().unwrap_or(0);
        10f64.powi(exponent.clamp(-300, 300) - decimals.clamp(0, 300))
    };
    picked.into_iter().map(of_column).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
#[path = "listing_tests.rs"]
mod tests;
