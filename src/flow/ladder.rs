//! Ways to a converged flow where the direct one fails, easiest first.

use super::analysis::Case;
use super::coupled::layout::Layout;
use super::coupled::newton::{self, Converged};
use super::coupled::project::Keep;
use super::coupled::response::FlowResponse;
use super::coupled::system::System;
use super::coupled::transport::resample;
use super::coupled::unknowns::Unknowns;
use super::solution::Attempt;

/// Newton iterations after which the search ends.
const BUDGET: usize = 400;
/// Iterations of one attempt.
const PROJECTED: usize = 40;
const DIRECT: usize = 25;
/// Laminar stations of the coarser and finer layouts tried, over those wanted.
const LAYOUTS: [f64; 3] = [0.6, 1.5, 0.35];
/// Neighbouring angles of attack tried, in degrees from the one wanted.
const ANGLES: [f64; 6] = [-1.0, 1.0, -2.0, 2.0, -4.0, 4.0];
/// Smallest step of the angle of attack, in degrees.
const SMALLEST_STEP: f64 = 0.12;

/// The search for one operating point.
pub(super) struct Ladder<'a> {
    pub case: &'a Case<'a>,
    pub attempts: Vec<Attempt>,
}

impl Ladder<'_> {
    fn spent(&self) -> usize {
        self.attempts.iter().map(|a| a.iterations).sum()
    }

    fn note(&mut self, what: &str, end: &Converged) {
        self.attempts.push(Attempt::of(what, end));
    }

    /// Tries everything; `None` where nothing converged.
    pub fn climb(&mut self, flow: &FlowResponse) -> Option<Converged> {
        let system = self.case.system(flow, &self.case.condition, &self.case.layout);
        self.projected(&system, Keep::Nearest)
            .or_else(|| self.other_layouts(flow))
            .or_else(|| self.neighbouring_angles(flow))
            .or_else(|| self.late(&system))
            .or_else(|| self.projected(&system, Keep::Mass))
    }

    fn exhausted(&self) -> bool {
        self.spent() > BUDGET
    }

    fn projected(&mut self, system: &System, keep: Keep) -> Option<Converged> {
        if self.exhausted() {
            return None;
        }
        let start = system.march(&system.start());
        let end = newton::solve_projected(system, start, keep, self.case.settings.tolerance, PROJECTED);
        if end.converged {
            return Some(end);
        }
        let what = match keep {
            Keep::Mass => "march after each step, defects kept",
            Keep::Nearest => "march after each step, speeds kept",
        };
        self.note(what, &end);
        None
    }

    /// Starts laminar as far as possible and lets transition come upstream.
    fn late(&mut self, system: &System) -> Option<Converged> {
        for late in [[false, true], [true, false], [true, true]] {
            if self.exhausted() {
                break;
            }
            let start = system.march_with(&system.start(), late);
            let end = newton::solve_projected(system, start, Keep::Nearest, self.case.settings.tolerance, PROJECTED);
            if end.converged {
                return Some(end);
            }
            self.note("late transition", &end);
        }
        None
    }

    /// The two quick ways, from a march.
    fn quick(&mut self, system: &System, tolerance: f64, what: &str) -> Option<Converged> {
        let start = system.march(&system.start());
        let end = newton::solve(system, start.clone(), tolerance, DIRECT);
        if end.converged {
            return Some(end);
        }
        self.note(what, &end);
        let end = newton::solve_projected(system, start, Keep::Nearest, tolerance, PROJECTED);
        self.note(what, &end);
        end.converged.then_some(end)
    }

    /// Solves with other numbers of stations and takes that as a start.
    fn other_layouts(&mut self, flow: &FlowResponse) -> Option<Converged> {
        let settings = &self.case.settings;
        for share in LAYOUTS {
            let laminar = ((settings.laminar_stations as f64 * share) as usize).max(15);
            let layout = Layout::new(laminar, settings.turbulent_stations, self.case.layout.wake);
            let system = self.case.system(flow, &self.case.condition, &layout);
            let what = format!("{laminar} laminar stations");
            if let Some(end) = self.quick(&system, 1e-5, &what) {
                let start = resample(&layout, &self.case.layout, &end.unknowns, system.section.map.total);
                let system = self.case.system(flow, &self.case.condition, &self.case.layout);
                if let Some(end) = self.finish(&system, start, &what) {
                    return Some(end);
                }
            }
            if self.exhausted() {
                break;
            }
        }
        None
    }

    /// From a start that is close.
    fn finish(&mut self, system: &System, start: Unknowns, what: &str) -> Option<Converged> {
        let tolerance = self.case.settings.tolerance;
        let end = newton::solve(system, start.clone(), tolerance, DIRECT);
        if end.converged {
            return Some(end);
        }
        self.note(&format!("from {what}"), &end);
        let end = newton::solve_projected(system, start, Keep::Nearest, tolerance, PROJECTED);
        if end.converged {
            return Some(end);
        }
        self.note(&format!("from {what}"), &end);
        None
    }

    /// Solves at a neighbouring angle of attack and goes from there in steps.
    fn neighbouring_angles(&mut self, flow: &FlowResponse) -> Option<Converged> {
        for offset in ANGLES {
            if self.exhausted() {
                break;
            }
            let there = FlowResponse::new(&self.case.section.response, flow.alpha + offset.to_radians());
            let system = self.case.system(&there, &self.case.condition, &self.case.layout);
            let what = format!("{offset:+} degrees");
            if let Some(end) = self.quick(&system, 1e-5, &what)
                && let Some(end) = self.walk(flow, offset, end.unknowns)
            {
                return Some(end);
            }
            if self.exhausted() {
                break;
            }
        }
        None
    }

    fn walk(&mut self, flow: &FlowResponse, mut offset: f64, mut from: Unknowns) -> Option<Converged> {
        let mut step = offset.abs().min(1.0);
        while !self.exhausted() {
            let next = if offset.abs() <= step { 0.0 } else { offset - step * offset.signum() };
            let there = FlowResponse::new(&self.case.section.response, flow.alpha + next.to_radians());
            let system = self.case.system(&there, &self.case.condition, &self.case.layout);
            let tolerance = if next == 0.0 { self.case.settings.tolerance } else { 1e-5 };
            let end = newton::solve(&system, from.clone(), tolerance, DIRECT);
            if end.converged {
                if next == 0.0 {
                    return Some(end);
                }
                (offset, from) = (next, end.unknowns);
                continue;
            }
            self.note(&format!("{next:+.2} degrees from {offset:+.2}"), &end);
            step *= 0.5;
            if step < SMALLEST_STEP {
                return None;
            }
        }
        None
    }
}
