//! Lift and drag of a tripped NACA 0012 beside measurements.

use super::common::{PANELS, cores, in_parallel, panelled};
use super::reference::Reference;
use crate::Failure;
use crate::sheet::Sheet;
use aeroform::flow::{Condition, Incidence, Settings, Solution};
use aeroform::report::{Align, Table};

/// Where our layer is tripped; Ladson's grit stood at 0.05 chord.
const TRIP: f64 = 0.05;

pub fn sheets() -> Result<Vec<Sheet>, Failure> {
    let text = "NACA 0012 with its open edge, M 0.15, Re 6e6, tripped at 0.05 chord, beside the wind-tunnel results of C. L. Ladson (NASA\n\
                TM 4074, 1988; reference/flow/ladson.csv) with three sizes of grit. Information, no bar: the measurements differ among\n\
                themselves by several per cent and have lift at no incidence, grit adds drag of its own, and 17 degrees is close to stall.";
    let mut sheet = Sheet::new("Ladson's NACA 0012", text);
    let reference = Reference::new(include_str!("../reference/flow/ladson.csv"));
    let panels = panelled("naca0012", PANELS)?;
    let mut rows = Vec::new();
    for row in reference.rows() {
        let [degrees, lift, drag] = [row.required("alpha")?, row.required("CL")?, row.required("CD")?];
        rows.push((row.text("grit")?, degrees, lift, drag));
    }
    let solve = |row: &(&str, f64, f64, f64)| -> Result<Solution, String> {
        let incidence = Incidence::Alpha(row.1.to_radians());
        let condition = Condition { mach: 0.15, trips: [Some(TRIP); 2], ..Condition::new(incidence, 6e6) };
        panels.analyze(&condition, &Settings::default(), None).map_err(|e| e.to_string())
    };
    let solutions = in_parallel(cores(), &rows, solve).into_iter().collect::<Result<Vec<_>, String>>()?;
    let right = ["alpha", "CL", "measured", "difference", "CD", "measured", "difference"];
    let columns = std::iter::once(("grit", Align::Left)).chain(right.map(|name| (name, Align::Right)));
    let mut figures = Table::new(columns.chain([("", Align::Left)]));
    for ((grit, degrees, lift, drag), s) in rows.iter().zip(&solutions) {
        let difference = |ours: f64, theirs: f64| format!("{:+.1} %", 100.0 * (ours / theirs - 1.0));
        let mut cells = vec![(*grit).to_owned(), format!("{degrees:.2}")];
        if s.is_reliable() {
            let near_zero = lift.abs() < 0.1;
            cells.extend([
                format!("{:.4}", s.coefficients.cl),
                format!("{lift:.4}"),
                if near_zero {
                    format!("{:+.4}", s.coefficients.cl - lift)
                } else {
                    difference(s.coefficients.cl, *lift)
                },
                format!("{:.5}", s.coefficients.cd),
                format!("{drag:.5}"),
                difference(s.coefficients.cd, *drag),
            ]);
        } else {
            cells.extend(std::iter::repeat_n(String::new(), 6).chain([s.status.to_string()]));
        }
        figures.row(cells);
    }
    sheet.set_figures(figures);
    Ok(vec![sheet])
}
