//! The layers of a very thin section beside the laws of the flat plate.

use super::common::{PANELS, nodes, section};
use crate::Failure;
use crate::sheet::Sheet;
use aeroform::flow::{Condition, Incidence, PanelledSection, Settings, StationFlow};
use aeroform::report::{Align, Table};

/// Thickness of the section in chords: thin enough for a nearly even edge speed.
const THICKNESS: f64 = 0.01;
const STATIONS: [f64; 5] = [0.2, 0.35, 0.5, 0.65, 0.8];

/// The upper layer of a symmetric section of NACA shape at no incidence.
fn layer(condition: &Condition) -> Result<Vec<StationFlow>, Failure> {
    let section = section("naca0012:sharp")?;
    let nodes: Vec<[f64; 2]> = nodes(&section, PANELS).iter().map(|p| [p[0], p[1] * THICKNESS / 0.12]).collect();
    let solution =
        PanelledSection::new(&nodes, section.trailing_edge())?.analyze(condition, &Settings::default(), None)?;
    if !solution.is_reliable() {
        return Err(format!("the thin section: {}", solution.status).into());
    }
    Ok(solution.distributions().upper)
}

/// The flow at x, linear between stations.
fn at(layer: &[StationFlow], x: f64, of: fn(&StationFlow) -> f64) -> f64 {
    let k = layer.partition_point(|station| station.x < x).clamp(1, layer.len() - 1);
    let (a, b) = (&layer[k - 1], &layer[k]);
    let t = (x - a.x) / (b.x - a.x);
    of(a) + t * (of(b) - of(a))
}

pub fn sheets() -> Result<Vec<Sheet>, Failure> {
    Ok(vec![laminar()?, turbulent()?])
}

fn laminar() -> Result<Sheet, Failure> {
    let reynolds = 5e5;
    let condition = Condition { trips: [Some(0.9); 2], ..Condition::new(Incidence::Alpha(0.0), reynolds) };
    let layer = layer(&condition)?;
    let text = format!(
        "Upper side of a section {THICKNESS} chords thick, no incidence, Re {reynolds:.0e}, laminar to 0.9, against Blasius: theta = 0.66412 x /\n\
         sqrt(Re x), cf = 0.66412 / sqrt(Re x), H 2.5911. Two numbers differ by construction: the closure has H 2.5911 at\n\
         Re_theta cf/2 = 0.2142, where Blasius has 0.2205 (3 % in cf), and the edge speed is even only to {THICKNESS}. The wedge flows\n\
         of Falkner and Skan need an edge speed that is given; the public solver has none, so unit tests cover them."
    );
    let mut sheet = Sheet::new("Laminar flat plate", &text);
    let mut figures = Table::new(
        ["x", "edge speed", "theta", "Blasius", "ratio", "cf", "Blasius", "ratio", "H"].map(|n| (n, Align::Right)),
    );
    for x in STATIONS {
        let theta = at(&layer, x, |s| s.momentum_thickness);
        let friction = at(&layer, x, |s| s.skin_friction);
        let shape = at(&layer, x, |s| s.shape_parameter);
        let root = (reynolds * x).sqrt();
        let [exact, law] = [0.664_12 * x / root, 0.664_12 / root];
        figures.row([
            x.to_string(),
            format!("{:.4}", at(&layer, x, |s| s.edge_velocity)),
            format!("{theta:.6e}"),
            format!("{exact:.6e}"),
            format!("{:.4}", theta / exact),
            format!("{friction:.6e}"),
            format!("{law:.6e}"),
            format!("{:.4}", friction / law),
            format!("{shape:.4}"),
        ]);
        sheet.relative(&format!("momentum thickness at {x}"), exact, theta, 0.03);
        sheet.relative(&format!("skin friction at {x}"), law, friction, 0.06);
        sheet.value(&format!("shape parameter at {x}"), 2.5911, shape, 0.05);
    }
    sheet.set_figures(figures);
    Ok(sheet)
}

fn turbulent() -> Result<Sheet, Failure> {
    let reynolds = 1e7;
    let condition = Condition { trips: [Some(0.02); 2], ..Condition::new(Incidence::Alpha(0.0), reynolds) };
    let layer = layer(&condition)?;
    let text = format!(
        "The same section at Re {reynolds:.0e}, tripped at 0.02. Skin friction against the local law of Coles and Fernholz, cf =\n\
         2 / (ln Re_theta / 0.384 + 4.127)^2 (Nagib, Chauhan, Monkewitz 2007), at the momentum thickness found, which needs no\n\
         origin of the turbulent layer. Beside it the law of Karman and Schoenherr, 1 / (17.08 lg^2 Re_theta + 25.11 lg Re_theta\n\
         + 6.012), which newer measurements find some per cent high; and cf = 0.0592 Re_x^(-1/5) from the nose."
    );
    let mut sheet = Sheet::new("Turbulent flat plate", &text);
    let head = [
        "x",
        "edge speed",
        "Re_theta",
        "H",
        "cf",
        "Coles-Fernholz",
        "ratio",
        "Karman-Schoenherr",
        "ratio",
        "1/5 power",
    ];
    let mut figures = Table::new(head.map(|n| (n, Align::Right)));
    for x in STATIONS {
        let speed = at(&layer, x, |s| s.edge_velocity);
        let theta = reynolds * speed * at(&layer, x, |s| s.momentum_thickness);
        let friction = at(&layer, x, |s| s.skin_friction);
        let shape = at(&layer, x, |s| s.shape_parameter);
        let lg = theta.log10();
        let law = 2.0 / (theta.ln() / 0.384 + 4.127).powi(2);
        let older = 1.0 / (17.08 * lg * lg + 25.11 * lg + 6.012);
        figures.row([
            x.to_string(),
            format!("{speed:.4}"),
            format!("{theta:.1}"),
            format!("{shape:.4}"),
            format!("{friction:.6}"),
            format!("{law:.6}"),
            format!("{:.4}", friction / law),
            format!("{older:.6}"),
            format!("{:.4}", friction / older),
            format!("{:.6}", 0.0592 * (reynolds * x).powf(-0.2)),
        ]);
        sheet.relative(&format!("skin friction at {x}, Re_theta {theta:.0}"), law, friction, 0.03);
    }
    sheet.set_figures(figures);
    Ok(sheet)
}
