//! STEP: ISO 10303-21 exchange structure, application protocol 214 (`AUTOMOTIVE_DESIGN`).

use super::drawing::{CadError, Drawing, Options, check_name, real};
use super::unit::LengthUnit;
use crate::spline::BSplineCurve;
use std::fmt::Write;

/// A STEP file of the curve, in metres unless told otherwise; a gap between its ends is closed by a straight segment.
///
/// One product, whose shape is a geometrically bounded wireframe: a curve set of a `B_SPLINE_CURVE_WITH_KNOTS` and,
/// where there is a gap, a `POLYLINE` of two points. With [`Options::face`] the shape is a surface model instead: one
/// `ADVANCED_FACE` on a `PLANE`, bounded by the curve and, where there is a gap, by a `LINE`.
///
/// # Errors
/// A curve not in two or three dimensions, control characters in the name; with a face also a curve out of the plane
/// z = 0, or a gap that is left open.
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
    let shape =
        if options.face { surface_model(&mut data, &drawing, &name)? } else { curve_set(&mut data, &drawing, &name) };
    let context = units(&mut data, &drawing, options.unit);
    product(&mut data, &name, shape, context);
    let stamp = &options.time_stamp;
    let [hour, minute, second] = stamp.time;
    Ok(format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION(('section {}, unit {}'),'2;1');\n\
         FILE_NAME({name},'{:04}-{:02}-{:02}T{hour:02}:{minute:02}:{second:02}',(''),(''),'aeroform {}','aeroform','');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
        if options.face { "face" } else { "curve" },
        options.unit.name(),
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

    fn direction(&mut self, d: [f64; 3]) -> String {
        self.add(format!("DIRECTION('',({}))", d.map(|c| real(c, 'E')).join(",")))
    }

    /// Axes at a point, the third and the first given.
    fn axes(&mut self, origin: &[f64; 3], up: [f64; 3]) -> String {
        let (origin, up, along) = (self.point(origin), self.direction(up), self.direction([1.0, 0.0, 0.0]));
        self.add(format!("AXIS2_PLACEMENT_3D('',{origin},{up},{along})"))
    }
}

/// A shape and the kind of representation that holds it.
struct Model {
    item: String,
    representation: &'static str,
}

fn spline(data: &mut Entities, drawing: &Drawing, name: &str) -> String {
    let points: Vec<String> = drawing.points.iter().map(|p| data.point(p)).collect();
    let mut distinct = drawing.knots.to_vec();
    distinct.dedup();
    let times: Vec<String> =
        distinct.iter().map(|k| drawing.knots.iter().filter(|&t| t == k).count().to_string()).collect();
    let knots: Vec<String> = distinct.iter().map(|&k| real(k, 'E')).collect();
    data.add(format!(
        "B_SPLINE_CURVE_WITH_KNOTS({name},{},({}),.UNSPECIFIED.,{},.U.,({}),({}),.UNSPECIFIED.)",
        drawing.degree,
        points.join(","),
        if drawing.closed { ".T." } else { ".F." },
        times.join(","),
        knots.join(",")
    ))
}

fn curve_set(data: &mut Entities, drawing: &Drawing, name: &str) -> Model {
    let mut curves = vec![spline(data, drawing, name)];
    if let Some(ends) = &drawing.closing {
        let ends = ends.each_ref().map(|p| data.point(p)).join(",");
        curves.push(data.add(format!("POLYLINE('closing segment',({ends}))")));
    }
    let item = data.add(format!("GEOMETRIC_CURVE_SET({name},({}))", curves.join(",")));
    Model { item, representation: "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION" }
}

/// The face inside of the outline: an open shell of one plane face.
fn surface_model(data: &mut Entities, drawing: &Drawing, name: &str) -> Result<Model, CadError> {
    if !drawing.planar || !(drawing.closed || drawing.closing.is_some()) {
        return Err(CadError::NoFace);
    }
    let [last, first] = &drawing.ends;
    let vertex = |data: &mut Entities, p: &[f64; 3]| {
        let point = data.point(p);
        data.add(format!("VERTEX_POINT('',{point})"))
    };
    let start = vertex(data, first);
    let end = if drawing.closed { start.clone() } else { vertex(data, last) };
    let curve = spline(data, drawing, name);
    let mut edges = vec![data.add(format!("EDGE_CURVE('',{start},{end},{curve},.T.)"))];
    if drawing.closing.is_some() {
        let line = line(data, last, first);
        edges.push(data.add(format!("EDGE_CURVE('closing segment',{end},{start},{line},.T.)")));
    }
    let oriented: Vec<String> =
        edges.iter().map(|edge| data.add(format!("ORIENTED_EDGE('',*,*,{edge},.T.)"))).collect();
    let ring = data.add(format!("EDGE_LOOP('',({}))", oriented.join(",")));
    let bound = data.add(format!("FACE_OUTER_BOUND('',{ring},.T.)"));
    // the inside is to the left of the edge as seen from the tip of the normal
    let axes = data.axes(&[0.0; 3], [0.0, 0.0, if twice_area(drawing) < 0.0 { -1.0 } else { 1.0 }]);
    let plane = data.add(format!("PLANE('',{axes})"));
    let face = data.add(format!("ADVANCED_FACE({name},({bound}),{plane},.T.)"));
    let shell = data.add(format!("OPEN_SHELL({name},({face}))"));
    let item = data.add(format!("SHELL_BASED_SURFACE_MODEL({name},({shell}))"));
    Ok(Model { item, representation: "MANIFOLD_SURFACE_SHAPE_REPRESENTATION" })
}

/// The line through two points, from the first to the second.
fn line(data: &mut Entities, from: &[f64; 3], to: &[f64; 3]) -> String {
    let step: [f64; 3] = std::array::from_fn(|d| to[d] - from[d]);
    let length = step.iter().map(|c| c * c).sum::<f64>().sqrt();
    let point = data.point(from);
    let direction = data.direction(step.map(|c| c / length));
    let vector = data.add(format!("VECTOR('',{direction},{})", real(length, 'E')));
    data.add(format!("LINE('',{point},{vector})"))
}

/// Twice the area inside of the control polygon, positive where it runs counter-clockwise.
fn twice_area(drawing: &Drawing) -> f64 {
    let points = &drawing.points;
    let next = |k: usize| points[(k + 1) % points.len()];
    points.iter().enumerate().map(|(k, p)| p[0] * next(k)[1] - next(k)[0] * p[1]).sum()
}

/// The unit of length: metres with a prefix, or so many millimetres.
fn length_unit(data: &mut Entities, unit: LengthUnit) -> String {
    let si = |prefix: &str| format!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({prefix},.METRE.))");
    match unit {
        LengthUnit::Metre => data.add(si("$")),
        LengthUnit::Centimetre => data.add(si(".CENTI.")),
        LengthUnit::Millimetre => data.add(si(".MILLI.")),
        LengthUnit::Inch | LengthUnit::Foot => {
            let millimetre = data.add(si(".MILLI."));
            let length = real(unit.millimetres(), 'E');
            let measure = data.add(format!("LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({length}),{millimetre})"));
            let exponents = data.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)");
            let name = unit.name().to_ascii_uppercase();
            data.add(format!("(CONVERSION_BASED_UNIT('{name}',{measure})LENGTH_UNIT()NAMED_UNIT({exponents}))"))
        }
    }
}

/// The geometric context: three dimensions, the unit of length, radians, steradians, and the resolution.
fn units(data: &mut Entities, drawing: &Drawing, unit: LengthUnit) -> String {
    let length = length_unit(data, unit);
    let angle = data.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    let solid = data.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    let resolution = data.add(format!(
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({}),{length},'distance_accuracy_value','')",
        real(drawing.resolution, 'E')
    ));
    data.add(format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({resolution}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))REPRESENTATION_CONTEXT('',''))"
    ))
}

/// The product structure around the shape.
fn product(data: &mut Entities, name: &str, model: Model, context: String) {
    let placement = data.axes(&[0.0; 3], [0.0, 0.0, 1.0]);
    let Model { item, representation } = model;
    let shape = data.add(format!("{representation}({name},({placement},{item}),{context})"));
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
