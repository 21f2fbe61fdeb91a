//! IGES 5.3: fixed lines of 80 columns, rational B-spline curve (entity 126) and line (entity 110).

use super::drawing::{CadError, Drawing, Options, check_name, is_plain, real};
use crate::spline::BSplineCurve;

/// An IGES file of the curve, in metres unless told otherwise; a gap between its ends is closed by a straight segment
/// (entity 110).
///
/// # Errors
/// A curve not in two or three dimensions, a name that is not printable ASCII.
pub fn iges<const D: usize>(curve: &BSplineCurve<f64, D>, name: &str) -> Result<String, CadError> {
    iges_with(curve, &Options::named(name))
}

/// [`iges`] with options.
///
/// # Errors
/// As [`iges`].
pub fn iges_with<const D: usize>(curve: &BSplineCurve<f64, D>, options: &Options) -> Result<String, CadError> {
    check_name(options.name, is_plain)?;
    options.without_face("IGES")?;
    let drawing = Drawing::new(curve, options)?;
    let mut file = File::default();
    // a name longer than a line of the start section goes on in the next
    let title: Vec<char> =
        format!("aeroform section curve, unit {}: {}", options.unit.name(), options.name).chars().collect();
    for line in title.chunks(72) {
        file.start.push(line.iter().collect());
    }
    file.global = wrap(&global(&drawing, options), 72);
    file.entity(126, 0, "SPLINE", &spline(&drawing));
    if let Some([from, to]) = drawing.closing {
        let numbers: Vec<String> = from.iter().chain(&to).map(|&c| real(c, 'D')).collect();
        file.entity(110, 0, "CLOSING", &numbers);
    }
    Ok(file.to_text())
}

/// The four sections that carry data, without sequence numbers.
#[derive(Default)]
struct File {
    start: Vec<String>,
    global: Vec<String>,
    directory: Vec<String>,
    parameters: Vec<String>,
}

impl File {
    /// Adds the directory entry and the parameter data of one entity.
    fn entity(&mut self, kind: usize, form: usize, label: &str, parameters: &[String]) {
        let entry = self.directory.len() + 1;
        let first = self.parameters.len() + 1;
        let fields: Vec<String> = std::iter::once(kind.to_string()).chain(parameters.iter().cloned()).collect();
        let lines = wrap(&fields, 64);
        // status 00000000: visible, independent, geometry; everything else default
        self.directory.push(format!("{kind:>8}{first:>8}{:>8}{:>8}{:>8}{:>8}{:>8}{:>8}00000000", 0, 0, 0, 0, 0, 0));
        self.directory.push(format!(
            "{kind:>8}{:>8}{:>8}{:>8}{form:>8}{:>8}{:>8}{label:>8}{:>8}",
            0,
            0,
            lines.len(),
            "",
            "",
            0
        ));
        self.parameters.extend(lines.into_iter().map(|line| format!("{line:<64} {entry:>7}")));
    }

    fn to_text(&self) -> String {
        let sections = [('S', &self.start), ('G', &self.global), ('D', &self.directory), ('P', &self.parameters)];
        let mut text = String::new();
        let mut counts = String::new();
        for (letter, lines) in sections {
            for (i, line) in lines.iter().enumerate() {
                text += &format!("{line:<72}{letter}{:>7}\n", i + 1);
            }
            counts += &format!("{letter}{:>7}", lines.len());
        }
        text + &format!("{counts:<72}T{:>7}\n", 1)
    }
}

/// A Hollerith string; an empty one is a field left out.
fn hollerith(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("{}H{text}", text.len()) }
}

/// The 26 fields of the global section.
fn global(drawing: &Drawing, options: &Options) -> Vec<String> {
    let stamp = &options.time_stamp;
    let [hour, minute, second] = stamp.time;
    let time =
        hollerith(&format!("{:04}{:02}{:02}.{hour:02}{minute:02}{second:02}", stamp.year, stamp.month, stamp.day));
    let largest = drawing.points.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs()));
    let (unit, unit_name) = options.unit.iges();
    let program = hollerith(concat!("aeroform ", env!("CARGO_PKG_VERSION")));
    let name = hollerith(options.name);
    [
        // delimiters; names of sender and file; system and preprocessor
        "1H,".into(),
        "1H;".into(),
        name.clone(),
        name.clone(),
        program.clone(),
        program,
        // bits of integers; decimal powers and digits of single and double precision
        "32".into(),
        "38".into(),
        "6".into(),
        "308".into(),
        "15".into(),
        // name at the receiver, model scale, unit
        name,
        "1.".into(),
        unit.to_string(),
        hollerith(unit_name),
        // line weights, then time, resolution and largest coordinate
        "1".into(),
        "0.".into(),
        time.clone(),
        real(drawing.resolution, 'D'),
        real(largest, 'D'),
        // author and organisation unknown; IGES 5.3, no drafting standard
        String::new(),
        String::new(),
        "11".into(),
        "0".into(),
        time,
    ]
    .to_vec()
}

/// Parameters of entity 126 after the entity number (IGES 5.3, section 4.23).
fn spline(drawing: &Drawing) -> Vec<String> {
    let flag = |yes: bool| usize::from(yes).to_string();
    let count = drawing.points.len();
    let mut fields = vec![
        (count - 1).to_string(),
        drawing.degree.to_string(),
        flag(drawing.planar),
        flag(drawing.closed),
        // polynomial, not periodic
        flag(true),
        flag(false),
    ];
    fields.extend(drawing.knots.iter().map(|&k| real(k, 'D')));
    fields.extend(std::iter::repeat_n("1.".to_string(), count));
    fields.extend(drawing.points.iter().flatten().map(|&c| real(c, 'D')));
    fields.extend([drawing.domain.0, drawing.domain.1].map(|u| real(u, 'D')));
    let normal = if drawing.planar { [0.0, 0.0, 1.0] } else { [0.0; 3] };
    fields.extend(normal.map(|c| real(c, 'D')));
    fields
}

/// Joins fields by commas, ends them by a semicolon and breaks lines between fields; only a string too long for a line
/// is broken itself.
fn wrap(fields: &[String], width: usize) -> Vec<String> {
    let mut lines = vec![];
    let mut line = String::new();
    for (i, field) in fields.iter().enumerate() {
        let mut rest = format!("{field}{}", if i + 1 == fields.len() { ';' } else { ',' });
        if line.len() + rest.len() > width && !line.is_empty() {
            lines.push(std::mem::take(&mut line));
        }
        while rest.len() > width {
            let tail = rest.split_off(width);
            lines.push(std::mem::replace(&mut rest, tail));
        }
        line += &rest;
    }
    lines.push(line);
    lines
}
