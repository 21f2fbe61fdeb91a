//! The choice between the flow solvers.

use super::condition::{Condition, Incidence, Settings};
use super::panel::{PanelSolver, PanelledSection};
use super::solution::Solution;
use super::solver::{FlowSection, FlowSolver};
use super::streamtube::{StreamtubeSettings, StreamtubeSolver};
use super::{FlowError, TrailingEdge};
use std::fmt;
use std::str::FromStr;
use std::sync::Arc;

/// Distance that the Mach number of the onset flow keeps from the critical one, at which the flow becomes sonic
/// somewhere, for the panel solver to be chosen.
const MARGIN: f64 = 0.05;

/// Which flow solver is to be used, by name.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SolverChoice {
    /// The [`PanelSolver`].
    #[default]
    Panel,
    /// The [`StreamtubeSolver`].
    Streamtube,
    /// The panel solver where the flow without boundary layer stays below the critical Mach number by a margin of 0.05,
    /// otherwise the streamtube solver.
    Auto,
}

impl SolverChoice {
    /// All names, in the order of the variants.
    pub const NAMES: [&'static str; 3] = ["panel", "streamtube", "auto"];

    /// The name of the choice.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The solver of this choice, with the tolerance of `settings` and, where it has panels, with everything else they say.
    /// For [`Auto`](Self::Auto) it is one that chooses anew at every operating point.
    pub fn solver(self, settings: Settings) -> Arc<dyn FlowSolver> {
        let both = Automatic::new(settings);
        match self {
            Self::Panel => Arc::new(both.panel),
            Self::Streamtube => Arc::new(both.streamtube),
            Self::Auto => Arc::new(both),
        }
    }

    /// The choice for a section at all of some operating points: this one, or for [`Auto`](Self::Auto) the one solver that
    /// suits all of them. `nodes` are as for [`FlowSolver::section`].
    ///
    /// # Errors
    /// [`FlowError`] for nodes that make no section.
    pub fn settle(
        self,
        nodes: &[[f64; 2]],
        trailing_edge: TrailingEdge,
        conditions: &[Condition],
    ) -> Result<Self, FlowError> {
        if self != Self::Auto {
            return Ok(self);
        }
        let panels = PanelledSection::new(nodes, trailing_edge)?;
        let fast = conditions.iter().any(|condition| needs_streamtubes(&panels, condition));
        Ok(if fast { Self::Streamtube } else { Self::Panel })
    }
}

impl fmt::Display for SolverChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for SolverChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let all = [Self::Panel, Self::Streamtube, Self::Auto];
        let known = all.into_iter().find(|choice| choice.name() == text);
        known.ok_or_else(|| format!("there is no flow solver {text:?}; choose one of {}", Self::NAMES.join(", ")))
    }
}

/// Whether the flow without boundary layer comes so close to the speed of sound that shocks are to be expected.
fn needs_streamtubes(panels: &PanelledSection, condition: &Condition) -> bool {
    // the streamtube solver does not take slower flow
    if condition.mach < 0.1 {
        return false;
    }
    let alpha = match condition.incidence {
        Incidence::Alpha(alpha) => alpha,
        Incidence::Lift(lift) => {
            let lift_at = |alpha: f64| panels.inviscid(alpha, condition.mach).map_or(f64::NAN, |flow| flow.cl);
            let zero = lift_at(0.0);
            0.1 * (lift - zero) / (lift_at(0.1) - zero)
        }
    };
    let critical = panels.inviscid(alpha, condition.mach).ok().and_then(|flow| flow.critical_mach);
    critical.is_some_and(|critical| condition.mach > critical - MARGIN)
}

/// Both solvers; every operating point takes the one that suits it.
#[derive(Debug, Clone, Copy)]
struct Automatic {
    panel: PanelSolver,
    streamtube: StreamtubeSolver,
}

impl Automatic {
    fn new(settings: Settings) -> Self {
        let tolerance = settings.tolerance.max(1e-11);
        let streamtube = StreamtubeSettings { tolerance, ..StreamtubeSettings::default() };
        Self { panel: PanelSolver { settings }, streamtube: StreamtubeSolver { settings: streamtube } }
    }
}

impl FlowSolver for Automatic {
    fn name(&self) -> &'static str {
        SolverChoice::Auto.name()
    }

    fn check(&self, condition: &Condition) -> Result<(), FlowError> {
        // flow that is slow enough for the panel solver alone is not checked by the other
        self.panel.check(condition)
    }

    fn section(&self, nodes: &[[f64; 2]], trailing_edge: TrailingEdge) -> Result<Box<dyn FlowSection>, FlowError> {
        Ok(Box::new(AutomaticSection {
            panels: PanelledSection::new(nodes, trailing_edge)?,
            panel: self.panel,
            streamtube: self.streamtube.section(nodes, trailing_edge)?,
        }))
    }
}

/// A section prepared for both solvers.
#[derive(Debug)]
struct AutomaticSection {
    panels: PanelledSection,
    panel: PanelSolver,
    streamtube: Box<dyn FlowSection>,
}

impl FlowSection for AutomaticSection {
    fn analyze(&self, condition: &Condition, warm: Option<&Solution>) -> Result<Solution, FlowError> {
        if needs_streamtubes(&self.panels, condition) {
            self.streamtube.analyze(condition, warm)
        } else {
            self.panels.analyze(condition, &self.panel.settings, warm)
        }
    }

    fn analyze_trial(&self, condition: &Condition, near: &Solution) -> Result<Solution, FlowError> {
        if needs_streamtubes(&self.panels, condition) {
            self.streamtube.analyze_trial(condition, near)
        } else {
            self.panels.analyze(condition, &self.panel.settings, Some(near))
        }
    }

    fn analyze_next(&self, condition: &Condition, last: Option<&Solution>) -> Result<Solution, FlowError> {
        if needs_streamtubes(&self.panels, condition) {
            self.streamtube.analyze_next(condition, last)
        } else {
            self.panels.analyze(condition, &self.panel.settings, last)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::testcases::naca_symmetric;

    #[test]
    fn the_critical_mach_number_decides() {
        let nodes = naca_symmetric(0.12, 0.0, 121);
        let at = |mach: f64| Condition { mach, ..Condition::new(Incidence::Alpha(0.0), 1e6) };
        let settled = |machs: &[f64]| {
            let conditions: Vec<Condition> = machs.iter().map(|&m| at(m)).collect();
            SolverChoice::Auto.settle(&nodes, TrailingEdge::Sharp, &conditions).unwrap()
        };
        // the critical Mach number of the section is 0.72
        assert_eq!(settled(&[0.3, 0.6]), SolverChoice::Panel);
        assert_eq!(settled(&[0.3, 0.75]), SolverChoice::Streamtube);
        assert_eq!(settled(&[0.7]), SolverChoice::Streamtube);
        assert_eq!(SolverChoice::Panel.settle(&nodes, TrailingEdge::Sharp, &[at(0.75)]).unwrap(), SolverChoice::Panel);
    }

    #[test]
    fn names_are_read_and_written() {
        for name in SolverChoice::NAMES {
            assert_eq!(name.parse::<SolverChoice>().unwrap().to_string(), name);
        }
        assert!("euler".parse::<SolverChoice>().unwrap_err().contains("panel, streamtube, auto"));
    }
}
