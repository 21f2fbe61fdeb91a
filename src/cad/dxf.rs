//! DXF of AutoCAD 2000 (`AC1015`): a `SPLINE` and, for a gap, a `LINE`.

use super::drawing::{CadError, Drawing, Options, check_name, is_plain};
use super::unit::LengthUnit;
use crate::spline::BSplineCurve;
use std::fmt::Display;

/// A DXF file of the curve, in metres unless told otherwise; a gap between its ends is closed by a `LINE`.
///
/// Both entities are on the layer `section`; the name is a comment at the head of the file.
///
/// # Errors
/// A curve not in two or three dimensions, a name that is not printable ASCII.
pub fn dxf<const D: usize>(curve: &BSplineCurve<f64, D>, name: &str) -> Result<String, CadError> {
    dxf_with(curve, &Options::named(name))
}

/// [`dxf`] with options.
///
/// # Errors
/// As [`dxf`].
pub fn dxf_with<const D: usize>(curve: &BSplineCurve<f64, D>, options: &Options) -> Result<String, CadError> {
    check_name(options.name, is_plain)?;
    options.without_face("DXF")?;
    let drawing = Drawing::new(curve, options)?;
    let mut file = Groups::default();
    file.put(999, options.name);
    header(&mut file, &drawing, options.unit);
    file.section("CLASSES", |_| {});
    file.section("TABLES", tables);
    file.section("BLOCKS", blocks);
    file.section("ENTITIES", |file| {
        spline(file, &drawing);
        if let Some([from, to]) = &drawing.closing {
            file.entity("LINE", "AcDbLine");
            file.point(10, from);
            file.point(11, to);
        }
    });
    file.section("OBJECTS", objects);
    file.put(0, "EOF");
    Ok(file.text)
}

// Handles of what others point to; entities and tables take the numbers after them.
const MODEL_SPACE: &str = "1F";
const PAPER_SPACE: &str = "1B";
const ROOT: &str = "C";
const GROUPS: &str = "D";
const LAYER: &str = "section";
/// First handle that is given out in sequence.
const FIRST_FREE: usize = 0x30;
/// Larger than every handle in the file.
const HANDLE_SEED: &str = "FF";

/// Handle of a table entry (none: the next free one), its name, and further groups.
type TableEntry<'a> = (Option<&'a str>, &'a str, &'a [(u16, &'a str)]);

/// Group codes and values, a line each.
struct Groups {
    text: String,
    next: usize,
}

impl Default for Groups {
    fn default() -> Self {
        Self { text: String::new(), next: FIRST_FREE }
    }
}

impl Groups {
    fn put(&mut self, code: u16, value: impl Display) {
        self.text += &format!("{code:>3}\n{value}\n");
    }

    /// A number in the shortest form that reads back to the same `f64`, with a decimal point.
    fn number(&mut self, code: u16, value: f64) {
        self.put(code, format!("{value:?}"));
    }

    fn point(&mut self, code: u16, point: &[f64; 3]) {
        for (i, c) in point.iter().enumerate() {
            self.number(code + 10 * i as u16, *c);
        }
    }

    /// A handle not used before.
    fn handle(&mut self) -> String {
        self.next += 1;
        format!("{:X}", self.next)
    }

    fn section(&mut self, name: &str, content: impl FnOnce(&mut Self)) {
        self.put(0, "SECTION");
        self.put(2, name);
        content(self);
        self.put(0, "ENDSEC");
    }

    /// Starts an entity of model space.
    fn entity(&mut self, kind: &str, class: &str) {
        let handle = self.handle();
        self.put(0, kind);
        self.put(5, handle);
        self.put(330, MODEL_SPACE);
        self.put(100, "AcDbEntity");
        self.put(8, LAYER);
        self.put(100, class);
    }

    /// A symbol table.
    fn table(&mut self, name: &str, class: &str, entries: &[TableEntry]) {
        let owner = self.handle();
        self.put(0, "TABLE");
        self.put(2, name);
        self.put(5, &owner);
        self.put(330, 0);
        self.put(100, "AcDbSymbolTable");
        self.put(70, entries.len());
        if name == "DIMSTYLE" {
            self.put(100, "AcDbDimStyleTable");
        }
        for (handle, entry, groups) in entries {
            let handle = handle.map_or_else(|| self.handle(), str::to_string);
            self.put(0, name);
            // the code of a handle is 5 everywhere but here
            self.put(if name == "DIMSTYLE" { 105 } else { 5 }, handle);
            self.put(330, &owner);
            self.put(100, "AcDbSymbolTableRecord");
            self.put(100, class);
            self.put(2, entry);
            for (code, value) in *groups {
                self.put(*code, value);
            }
        }
        self.put(0, "ENDTAB");
    }
}

fn header(file: &mut Groups, drawing: &Drawing, unit: LengthUnit) {
    let extreme = |pick: fn(f64, f64) -> f64| -> [f64; 3] {
        std::array::from_fn(|d| drawing.points.iter().map(|p| p[d]).fold(drawing.points[0][d], pick))
    };
    file.section("HEADER", |file| {
        file.put(9, "$ACADVER");
        file.put(1, "AC1015");
        file.put(9, "$DWGCODEPAGE");
        file.put(3, "ANSI_1252");
        file.put(9, "$INSBASE");
        file.point(10, &[0.0; 3]);
        file.put(9, "$EXTMIN");
        file.point(10, &extreme(f64::min));
        file.put(9, "$EXTMAX");
        file.point(10, &extreme(f64::max));
        file.put(9, "$HANDSEED");
        file.put(5, HANDLE_SEED);
        file.put(9, "$INSUNITS");
        let (insertion, measurement) = unit.dxf();
        file.put(70, insertion);
        file.put(9, "$MEASUREMENT");
        file.put(70, measurement);
    });
}

/// The nine tables that readers of the format expect, with the least that each must hold.
fn tables(file: &mut Groups) {
    let view: &[(u16, &str)] = &[
        (70, "0"),
        (10, "0.0"),
        (20, "0.0"),
        (11, "1.0"),
        (21, "1.0"),
        (12, "0.5"),
        (22, "0.0"),
        (16, "0.0"),
        (26, "0.0"),
        (36, "1.0"),
        (17, "0.0"),
        (27, "0.0"),
        (37, "0.0"),
        (40, "1.0"),
        (41, "1.5"),
        (42, "50.0"),
    ];
    let line: &[(u16, &str)] = &[(70, "0"), (3, ""), (72, "65"), (73, "0"), (40, "0.0")];
    let layer: &[(u16, &str)] = &[(70, "0"), (62, "7"), (6, "CONTINUOUS")];
    let style: &[(u16, &str)] =
        &[(70, "0"), (40, "0.0"), (41, "1.0"), (50, "0.0"), (71, "0"), (42, "2.5"), (3, "txt"), (4, "")];
    file.table("VPORT", "AcDbViewportTableRecord", &[(None, "*ACTIVE", view)]);
    file.table(
        "LTYPE",
        "AcDbLinetypeTableRecord",
        &[(None, "BYBLOCK", line), (None, "BYLAYER", line), (None, "CONTINUOUS", line)],
    );
    file.table("LAYER", "AcDbLayerTableRecord", &[(None, "0", layer), (None, LAYER, layer)]);
    file.table("STYLE", "AcDbTextStyleTableRecord", &[(None, "STANDARD", style)]);
    file.table("VIEW", "AcDbViewTableRecord", &[]);
    file.table("UCS", "AcDbUCSTableRecord", &[]);
    file.table("APPID", "AcDbRegAppTableRecord", &[(None, "ACAD", &[(70, "0")])]);
    file.table("DIMSTYLE", "AcDbDimStyleTableRecord", &[(None, "STANDARD", &[(70, "0")])]);
    file.table(
        "BLOCK_RECORD",
        "AcDbBlockTableRecord",
        &[(Some(MODEL_SPACE), "*Model_Space", &[]), (Some(PAPER_SPACE), "*Paper_Space", &[])],
    );
}

fn blocks(file: &mut Groups) {
    for (owner, name) in [(MODEL_SPACE, "*Model_Space"), (PAPER_SPACE, "*Paper_Space")] {
        for (kind, class) in [("BLOCK", "AcDbBlockBegin"), ("ENDBLK", "AcDbBlockEnd")] {
            let handle = file.handle();
            file.put(0, kind);
            file.put(5, handle);
            file.put(330, owner);
            file.put(100, "AcDbEntity");
            if owner == PAPER_SPACE {
                file.put(67, 1);
            }
            file.put(8, 0);
            file.put(100, class);
            if kind == "BLOCK" {
                file.put(2, name);
                file.put(70, 0);
                file.point(10, &[0.0; 3]);
                file.put(3, name);
                file.put(1, "");
            }
        }
    }
}

fn spline(file: &mut Groups, drawing: &Drawing) {
    file.entity("SPLINE", "AcDbSpline");
    if drawing.planar {
        file.point(210, &[0.0, 0.0, 1.0]);
    }
    file.put(70, usize::from(drawing.closed) + 8 * usize::from(drawing.planar));
    file.put(71, drawing.degree);
    file.put(72, drawing.knots.len());
    file.put(73, drawing.points.len());
    file.put(74, 0);
    file.number(42, drawing.resolution);
    file.number(43, drawing.resolution);
    for &knot in drawing.knots {
        file.number(40, knot);
    }
    for point in &drawing.points {
        file.point(10, point);
    }
}

/// The root dictionary, with the dictionary of groups that it must hold.
fn objects(file: &mut Groups) {
    for (handle, owner, entry) in [(ROOT, "0", Some(("ACAD_GROUP", GROUPS))), (GROUPS, ROOT, None)] {
        file.put(0, "DICTIONARY");
        file.put(5, handle);
        file.put(330, owner);
        file.put(100, "AcDbDictionary");
        file.put(281, 1);
        if let Some((name, handle)) = entry {
            file.put(3, name);
            file.put(350, handle);
        }
    }
}
