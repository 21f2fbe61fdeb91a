//! One operating point of a section with the exact derivatives of its coefficients.
//!
//! The derivatives by the nodes of the section, multiplied by how the nodes move, are the derivatives by any shape
//! parameter. Here that parameter is the height of a bump on the upper side. The derivatives are compared with flows
//! about sections that have really been bumped, and turned.
//!
//! `cargo run --example flow_gradients`

use aeroform::flow::{
    Coefficients, Condition, FlowSolver, Incidence, PanelSolver, Settings, TrailingEdge, panel_parameters,
};
use aeroform::section::SectionDefinition;
use std::error::Error;

/// A smooth bump on the upper side, highest at 40 % of the chord; zero on the lower side.
fn bump(node: [f64; 2], on_upper: bool) -> f64 {
    if !on_upper || node[0] <= 0.0 || node[0] >= 1.0 {
        return 0.0;
    }
    let power = 0.5f64.ln() / 0.4f64.ln();
    (std::f64::consts::PI * node[0].powf(power)).sin().powi(3)
}

fn main() -> Result<(), Box<dyn Error>> {
    let section = SectionDefinition::parse("naca2412")?.section()?;
    let parameters = panel_parameters(&section, 161);
    let nodes: Vec<[f64; 2]> = parameters.iter().map(|&u| section.curve().point_at(u)).collect();
    let nose = (0..nodes.len()).fold(0, |best, i| if nodes[i][0] < nodes[best][0] { i } else { best });
    let move_by = |height: f64| -> Vec<[f64; 2]> {
        nodes.iter().enumerate().map(|(i, n)| [n[0], n[1] + height * bump(*n, i < nose)]).collect()
    };

    let solver = PanelSolver { settings: Settings { tolerance: 1e-12, ..Settings::default() } };
    let alpha = 2f64.to_radians();
    let flow = |nodes: &[[f64; 2]], alpha: f64| -> Result<_, Box<dyn Error>> {
        let condition = Condition { mach: 0.2, ..Condition::new(Incidence::Alpha(alpha), 3e6) };
        let solution = solver.section(nodes, TrailingEdge::Blunt)?.analyze(&condition, None)?;
        if solution.is_reliable() { Ok(solution) } else { Err(solution.status.to_string().into()) }
    };

    let solution = flow(&nodes, alpha)?;
    println!(
        "NACA 2412 at 2 degrees, Mach 0.2, Reynolds 3e6: {} in {} iterations",
        solution.status, solution.iterations
    );
    for (name, value) in solution.coefficients.named() {
        println!("{name:>17} {value:10.6}");
    }

    // exact: one adjoint for all inputs at once
    let gradients = solution.gradients().ok_or("the equations are singular")?;
    let by_bump = gradients.as_ref().map(|of| {
        let moved = of.nodes.iter().enumerate().map(|(i, d)| d[1] * bump(nodes[i], i < nose));
        moved.sum::<f64>()
    });
    let by_alpha = gradients.as_ref().map(|of| of.alpha);

    // differences: two more flows for every single input
    let difference =
        |high: Coefficients, low: Coefficients, step: f64| high.zip(low).map(|(a, b)| (a - b) / (2.0 * step));
    let step = 1e-5;
    let moved = |height: f64| flow(&move_by(height), alpha).map(|s| s.coefficients);
    let turned = |angle: f64| flow(&nodes, alpha + angle).map(|s| s.coefficients);
    let bumped = difference(moved(step)?, moved(-step)?, step);
    let turned = difference(turned(step)?, turned(-step)?, step);

    println!("\n                  by the height of the bump      by the angle of attack (per radian)");
    println!("                  exact         differences      exact         differences");
    for (name, ((exact, bumped), (slope, turned))) in by_bump.zip(bumped).zip(by_alpha.zip(turned)).named() {
        println!("{name:>17} {exact:12.6}  {bumped:12.6}  {slope:14.6}  {turned:12.6}");
    }

    let (node, [_, steepest]) =
        gradients.cd.nodes.iter().enumerate().max_by(|a, b| a.1[1].abs().total_cmp(&b.1[1].abs())).ok_or("no nodes")?;
    println!(
        "\nDrag feels node {node} at x = {:.4} most: {:+.3} counts per thousandth of the chord upwards.",
        nodes[node][0],
        1e4 * 1e-3 * steepest
    );
    Ok(())
}
