//! Arguments that `analyze` and `polar` share: section, panels, condition.

use super::failure::Failure;
use super::shape_arguments::ShapeArguments;
use crate::flow::{
    Condition, FlowSection, Incidence, PanelledSection, STATIONS_PER_SIDE, Settings, SolverChoice, panel_parameters,
};
use crate::report::json::repairs;

/// Section and condition on the command line.
#[derive(Debug, Clone, clap::Args)]
pub(super) struct FlowArguments {
    #[command(flatten)]
    pub shape: ShapeArguments,
    /// Reynolds number of the chord
    #[arg(long, default_value_t = 1e6, allow_negative_numbers = true)]
    pub reynolds: f64,
    /// Critical amplification factor of free transition
    #[arg(long, default_value_t = 9.0, allow_negative_numbers = true)]
    pub ncrit: f64,
    /// Trip strips, x/c on the upper and lower side (one number serves both)
    #[arg(long, value_name = "XU[,XL]", value_delimiter = ',', num_args = 1, allow_negative_numbers = true)]
    pub trip: Option<Vec<f64>>,
    /// Number of panels, and of the nodes between them
    #[arg(long, default_value_t = 160, allow_negative_numbers = true)]
    pub panels: usize,
    /// Number of boundary-layer stations on each side (panel solver)
    #[arg(long, default_value_t = Settings::default().stations_per_side(), allow_negative_numbers = true)]
    pub stations: usize,
    /// Flow solver: panel (without shocks), streamtube (M 0.1 to 0.9, with shocks), or auto (by the critical Mach number)
    #[arg(long, default_value_t = SolverChoice::Panel, value_parser = clap::value_parser!(SolverChoice))]
    pub solver: SolverChoice,
}

/// Most panels; the panel equations are dense.
const MOST_PANELS: usize = 2000;

impl FlowArguments {
    /// The operating point at a Mach number, and an angle of attack in degrees or a lift coefficient.
    pub fn condition(&self, mach: f64, alpha: Option<f64>, lift: Option<f64>) -> Result<Condition, Failure> {
        let trips = match self.trip.as_deref() {
            None => [None, None],
            Some(&[both]) => [Some(both), Some(both)],
            Some(&[upper, lower]) => [Some(upper), Some(lower)],
            Some(_) => return Err(Failure::Input("--trip takes one number or two".into())),
        };
        let incidence = match lift {
            Some(lift) => Incidence::Lift(lift),
            None => Incidence::Alpha(alpha.unwrap_or(0.0).to_radians()),
        };
        let point = Condition::new(incidence, self.reynolds);
        Ok(Condition { mach, n_critical: self.ncrit, trips, ..point })
    }
}

/// A section ready for the flow solver, in the frame and unit of its coordinates.
pub(super) struct Panelled {
    /// The panel nodes.
    pub nodes: Vec<[f64; 2]>,
    /// The factorised panels, for the flow without boundary layer.
    pub panels: PanelledSection,
    /// The section prepared for the solver that was chosen.
    pub flow: Box<dyn FlowSection>,
    /// A sentence for everything that was mended in its file.
    pub repairs: Vec<String>,
}

/// The nodes and the factorised panels of the section, in the frame and unit of its coordinates.
pub(super) fn panelled(arguments: &FlowArguments) -> Result<Panelled, Failure> {
    let bad = |e: &dyn std::fmt::Display| arguments.shape.failure(e);
    if arguments.panels > MOST_PANELS {
        return Err(Failure::Input(format!("--panels {}: at most {MOST_PANELS}", arguments.panels)));
    }
    if !STATIONS_PER_SIDE.contains(&arguments.stations) {
        let (least, most) = STATIONS_PER_SIDE.into_inner();
        return Err(Failure::Input(format!("--stations {}: from {least} to {most}", arguments.stations)));
    }
    let definition = arguments.shape.definition()?;
    let repairs = repairs(&definition);
    let section = definition.section().map_err(|e| bad(&e))?;
    let parameters = panel_parameters(&section, arguments.panels + 1);
    let nodes: Vec<[f64; 2]> = parameters.iter().map(|&u| section.curve().point_at(u)).collect();
    let panels = PanelledSection::new(&nodes, section.trailing_edge()).map_err(|e| bad(&e))?;
    let solver = arguments.solver.solver(Settings::default().with_stations(arguments.stations));
    let flow = solver.section(&nodes, section.trailing_edge()).map_err(|e| bad(&e))?;
    Ok(Panelled { nodes, panels, flow, repairs })
}
