//! STEP: ISO 10303-21 exchange structure, application protocol 214 (`AUTOMOTIVE_DESIGN`).

use super::drawing::{CadError, Drawing, Options, RESOLUTION, check_name, real};
use crate::spline::BSplineCurve;
use std::fmt::Write;

/// A STEP file of the curve, in metres; a gap between its ends is closed by a straight segment.
///
/// One product, whose shape is a geometrically bounded wireframe: a curve set of a `B_SPLINE_CURVE_WITH_KNOTS` and,
/// where there is a gap, a `POLYLINE` of two points.
///
/// # Errors
/// A curve not in two or three dimensions, control characters in the name.
pub fn step<const D: usize>(curve: &BSplineCurve<f64, D>, name: &str) -> Result<String, CadError> {
    step_with(curve, &Options::named(name))
}

/// [`step`] with options.
///
/// # Errors
/// As [`step`].
pub fn step_with<const D: usize>(curve: &BSplineCurve<f64, D>, options: &Options) -> Result<String, CadError> {
    check_name(options.name, |c| !c.is_control())?;
    let drawing = Drawing::new(curve, options)?;
    let name = text(options.name);
    let mut data = Entities::default();
    let set = curve_set(&mut data, &drawing, &name);
    let context = units(&mut data);
    product(&mut data, &name, set, context);
    let stamp = &options.time_stamp;
    let [hour, minute, second] = stamp.time;
    Ok(format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('section curve, unit metre'),'2;1');\n\
         FILE_NAME({name},'{:04}-{:02}-{:02}T{hour:02}:{minute:02}:{second:02}',(''),(''),'aeroform {}','aeroform','');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
        stamp.year,
        stamp.month,
        stamp.day,
        env!("CARGO_PKG_VERSION"),
        data.lines
    ))
}

/// Entity instances in the order in which they are numbered.
#[derive(Default)]
struct Entities {
    lines: String,
    count: usize,
}

impl Entities {
    /// Adds an instance; gives its reference, `#n`.
    fn add(&mut self, entity: impl AsRef<str>) -> String {
        self.count += 1;
        // writing to a String cannot fail
        let _ = writeln!(self.lines, "#{}={};", self.count, entity.as_ref());
        format!("#{}", self.count)
    }

    fn point(&mut self, p: &[f64; 3]) -> String {
        self.add(format!("CARTESIAN_POINT('',({}))", p.map(|c| real(c, 'E')).join(",")))
    }
}

fn curve_set(data: &mut Entities, drawing: &Drawing, name: &str) -> String {
    let points: Vec<String> = drawing.points.iter().map(|p| data.point(p)).collect();
    let mut distinct = drawing.knots.to_vec();
    distinct.dedup();
    let times: Vec<String> =
        distinct.iter().map(|k| drawing.knots.iter().filter(|&t| t == k).count().to_string()).collect();
    let knots: Vec<String> = distinct.iter().map(|&k| real(k, 'E')).collect();
    let spline = data.add(format!(
        "B_SPLINE_CURVE_WITH_KNOTS({name},{},({}),.UNSPECIFIED.,{},.U.,({}),({}),.UNSPECIFIED.)",
        drawing.degree,
        points.join(","),
        if drawing.closed { ".T." } else { ".F." },
        times.join(","),
        knots.join(",")
    ));
    let mut curves = vec![spline];
    if let Some(ends) = &drawing.closing {
        let ends = ends.each_ref().map(|p| data.point(p)).join(",");
        curves.push(data.add(format!("POLYLINE('closing segment',({ends}))")));
    }
    data.add(format!("GEOMETRIC_CURVE_SET({name},({}))", curves.join(",")))
}

/// The geometric context: three dimensions, metres, radians, steradians, and the resolution.
fn units(data: &mut Entities) -> String {
    let length = data.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT($,.METRE.))");
    let angle = data.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    let solid = data.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    let resolution = data.add(format!(
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{length},'distance_accuracy_value','')",
        real(RESOLUTION, 'E')
    ));
    data.add(format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({resolution}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))REPRESENTATION_CONTEXT('',''))"
    ))
}

/// The product structure around the shape.
fn product(data: &mut Entities, name: &str, set: String, context: String) {
    let origin = data.point(&[0.0; 3]);
    let up = data.add("DIRECTION('',(0.,0.,1.))");
    let along = data.add("DIRECTION('',(1.,0.,0.))");
    let placement = data.add(format!("AXIS2_PLACEMENT_3D('',{origin},{up},{along})"));
    let shape =
        data.add(format!("GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION({name},({placement},{set}),{context})"));
    let application = data.add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')");
    data.add(format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,{application})"
    ));
    let market = data.add(format!("PRODUCT_CONTEXT('',{application},'mechanical')"));
    let product = data.add(format!("PRODUCT({name},{name},'',({market}))"));
    data.add(format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part','',({product}))"));
    let formation = data.add(format!("PRODUCT_DEFINITION_FORMATION('','',{product})"));
    let stage = data.add(format!("PRODUCT_DEFINITION_CONTEXT('part definition',{application},'design')"));
    let definition = data.add(format!("PRODUCT_DEFINITION('design','',{formation},{stage})"));
    let definition_shape = data.add(format!("PRODUCT_DEFINITION_SHAPE('','',{definition})"));
    data.add(format!("SHAPE_DEFINITION_REPRESENTATION({definition_shape},{shape})"));
}

/// A string literal: apostrophe and backslash doubled, characters beyond ASCII as hexadecimal (ISO 10303-21, 6.4.3).
fn text(name: &str) -> String {
    let mut result = String::from("'");
    for c in name.chars() {
        match c {
            '\'' => result.push_str("''"),
            '\\' => result.push_str("\\\\"),
            c if c.is_ascii() => result.push(c),
            c if (c as u32) < 0x10000 => {
                let _ = write!(result, "\\X2\\{:04X}\\X0\\", c as u32);
            }
            c => {
                let _ = write!(result, "\\X4\\{:08X}\\X0\\", c as u32);
            }
        }
    }
    result + "'"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strings_are_escaped() {
        assert_eq!(text("it's a\\b"), "'it''s a\\\\b'");
        assert_eq!(text("é😀"), "'\\X2\\00E9\\X0\\\\X4\\0001F600\\X0\\'");
    }
}
