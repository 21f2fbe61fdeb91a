//! One flow that is asked for: at an angle of attack, or at a lift coefficient.
//!
//! Angles in this file are those between the onset flow and the chord line, in radians.

use super::coupling::response::{FlowResponse, SectionResponse};
use super::coupling::system::Stream;
use super::family::PanelFamily;
use super::frame::Nodes;
use super::outputs;
use super::record::{PanelRecord, Sought, supersonic};
use crate::flow::condition::{Condition, Settings};
use crate::flow::layer::{Layout, Unknowns};
use crate::flow::solution::{Attempt, Solution, Status};
use crate::flow::surface::spline::invert;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Largest number of solutions on the way to a prescribed lift coefficient.
const LIFT_STEPS: usize = 20;
/// Largest change of the angle between two solutions on the way to a prescribed lift coefficient.
const LIFT_REACH: f64 = 0.05;
/// Largest angle at which a lift coefficient is sought.
const LARGEST_ANGLE: f64 = 0.5;
/// First and smallest step of the angle on the way to the largest lift.
const SWEEP_STEPS: [f64; 2] = [0.02, 0.002];
/// Fall below the largest lift found after which the lift counts as past its largest value.
const FALL: f64 = 0.1;

/// One flow that is asked for.
pub(super) struct Request<'a> {
    pub nodes: &'a Nodes,
    pub response: &'a Arc<SectionResponse>,
    pub condition: Condition,
    pub settings: Settings,
}

/// The end of the search for a flow at one angle, converged or not.
struct Ended {
    record: PanelRecord,
    attempts: Vec<Attempt>,
    residual: f64,
    iterations: usize,
    converged: bool,
}

impl Ended {
    fn lift(&self) -> f64 {
        self.record.coefficients().cl
    }

    fn angle(&self) -> f64 {
        self.record.flow.alpha
    }

    fn is_reliable(&self) -> bool {
        self.converged && self.record.status() == Status::Converged
    }
}

impl Request<'_> {
    /// The flow at an angle of attack against the x axis of the nodes.
    pub fn at_alpha(&self, alpha: f64, warm: Option<Unknowns>) -> Solution {
        self.report(self.at(self.nodes.frame.incidence(alpha), warm))
    }

    /// The flow at a lift coefficient; `warm` is a solution at an angle of attack to start from.
    pub fn at_lift(&self, lift: f64, warm: Option<(f64, Unknowns)>) -> Solution {
        let warm = warm.map(|(alpha, unknowns)| (self.nodes.frame.incidence(alpha), unknowns));
        match self.newton_on_lift(lift, warm) {
            Ok(found) => self.report(found),
            Err(last) => self.climb_to_lift(lift, *last),
        }
    }

    fn at(&self, angle: f64, warm: Option<Unknowns>) -> Ended {
        self.solve(angle, warm, self.settings)
    }

    fn solve(&self, angle: f64, warm: Option<Unknowns>, settings: Settings) -> Ended {
        let response = self.response;
        let layout = Layout::new(settings.laminar_stations, settings.turbulent_stations, response.wake_distances.len());
        let warm = warm.filter(|u| u.stations.len() == layout.stations());
        let flow = FlowResponse::new(response, angle);
        let stream = self.stream();
        let search = PanelFamily { section: response, flow: &flow, layout: &layout, stream, settings };
        let ((end, found), attempts) = search.converge(warm);
        let (residual, iterations, converged) = (end.residual, end.iterations, end.converged);
        let sought = Sought { section: Arc::clone(response), flow, layout: found, stream, nodes: self.nodes.clone() };
        Ended { record: PanelRecord::new(sought, end), attempts, residual, iterations, converged }
    }

    fn status(&self, ended: &Ended) -> Status {
        if !ended.converged {
            return self.failure(&ended.record, ended.residual);
        }
        let (found, wanted) = (ended.record.layout.laminar.len(), self.settings.laminar_stations);
        match ended.record.status() {
            Status::Converged if found != wanted => {
                let reason = format!("solved with {found} laminar stations a side, not with the {wanted} asked for");
                Status::Unresolved { reason: reason.into() }
            }
            status => status,
        }
    }

    fn report(&self, ended: Ended) -> Solution {
        let status = self.status(&ended);
        let Ended { record, attempts, residual, iterations, .. } = ended;
        let coefficients = record.coefficients();
        let cd_friction = record.friction_drag();
        Solution {
            status,
            solver: "panel",
            condition: self.condition,
            alpha: record.nodes.frame.alpha(record.flow.alpha),
            coefficients,
            cd_pressure: coefficients.cd - cd_friction,
            cd_friction,
            cd_wave: 0.0,
            stagnation: record.stagnation(),
            residual,
            iterations,
            attempts,
            record: Arc::new(record),
        }
    }

    /// Why a flow was not found, as far as the flow without boundary layer and the last state tell.
    fn failure(&self, record: &PanelRecord, residual: f64) -> Status {
        let mach = outputs::highest_mach(self.response, &record.flow.inviscid, self.condition.mach);
        if mach > 1.0 {
            return supersonic(mach, false);
        }
        Status::NotConverged { residual, reversed: record.reversed_extent() }
    }

    /// Newton's method on the angle, with the lift slope of each solution at a wake that stays where it is. The error
    /// is the last state, where the lift is not reached.
    fn newton_on_lift(&self, lift: f64, warm: Option<(f64, Unknowns)>) -> Result<Ended, Box<Ended>> {
        let (mut angle, mut unknowns) = match warm {
            Some((angle, unknowns)) => (angle, Some(unknowns)),
            None => (self.inviscid_angle(lift), None),
        };
        angle = angle.clamp(-LARGEST_ANGLE, LARGEST_ANGLE);
        let mut misled = false;
        for _ in 0..=LIFT_STEPS {
            let last = self.at(angle, unknowns.take());
            let missed = last.lift() - lift;
            if last.converged && missed.abs() <= 10.0 * self.settings.tolerance {
                return Ok(last);
            }
            let slope = if last.converged { last.record.lift_slope() } else { None };
            // past the largest lift the slope leads astray; where transition runs along a side it does so at one angle
            let slope = match slope {
                Some(slope) if slope > 0.0 => slope,
                Some(_) if !misled => {
                    misled = true;
                    TAU
                }
                _ => return Err(Box::new(last)),
            };
            angle -= (missed / slope).clamp(-LIFT_REACH, LIFT_REACH);
            if angle.abs() > LARGEST_ANGLE {
                return Err(Box::new(last));
            }
            unknowns = Some(last.record.unknowns);
        }
        Err(Box::new(self.at(angle, unknowns)))
    }

    /// Angle at which the flow without boundary layer has a lift coefficient.
    fn inviscid_angle(&self, lift: f64) -> f64 {
        let at = |angle: f64| {
            let strengths = self.response.panels.strengths(angle);
            outputs::surface_values(self.response, &strengths, angle, self.condition.mach).cl
        };
        let zero = at(0.0);
        (lift - zero) / (at(0.1) - zero) * 0.1
    }

    /// Raises the angle step by step from that of zero lift towards a lift coefficient that Newton's method did not
    /// reach, until the lift is passed or falls. `last` is where Newton's method ended.
    fn climb_to_lift(&self, lift: f64, last: Ended) -> Solution {
        let settings = Settings { retry: false, ..self.settings };
        let sign = lift.signum();
        let [mut step, least] = SWEEP_STEPS;
        let mut best = self.at(self.inviscid_angle(0.0), None);
        let mut at = (best.angle(), best.record.unknowns.clone());
        // why the last step was not taken
        let mut ended = None;
        while best.is_reliable() && step >= least {
            let next = self.solve(at.0 + sign * step, Some(at.1.clone()), settings);
            if !next.is_reliable() || next.angle().abs() > LARGEST_ANGLE {
                ended = (!next.is_reliable()).then(|| self.status(&next).to_string());
                step *= 0.5;
                continue;
            }
            at = (next.angle(), next.record.unknowns.clone());
            let gain = sign * (next.lift() - best.lift());
            if sign * (next.lift() - lift) >= 0.0 {
                match self.newton_on_lift(lift, Some(at.clone())) {
                    Ok(found) => return self.report(found),
                    Err(_) => break,
                }
            }
            if gain > 0.0 {
                best = next;
            } else if gain < -FALL {
                break;
            }
        }
        if !best.is_reliable() {
            return self.report_missed(lift, last);
        }
        // a lift that fell at the end had its largest value
        let ended = ended.filter(|_| at.0 == best.angle());
        let (largest, alpha) = (best.lift(), self.nodes.frame.alpha(best.angle()));
        Solution { status: Status::LiftOutOfReach { wanted: lift, largest, alpha, ended }, ..self.report(best) }
    }

    /// A state that Newton's method on the angle ended with; one that is a flow has another lift than the wanted one.
    fn report_missed(&self, lift: f64, last: Ended) -> Solution {
        if !last.converged {
            return self.report(last);
        }
        let (largest, alpha) = (last.lift(), self.nodes.frame.alpha(last.angle()));
        let ended = Some("not found at this lift".to_owned());
        Solution { status: Status::LiftOutOfReach { wanted: lift, largest, alpha, ended }, ..self.report(last) }
    }

    fn stream(&self) -> Stream {
        let Condition { mach, reynolds, n_critical, .. } = self.condition;
        Stream { mach, reynolds, n_critical, trips: self.trip_arcs() }
    }

    /// Arc lengths of the trips in chords, found from their x by the spline through the nodes.
    fn trip_arcs(&self) -> [Option<f64>; 2] {
        let section = self.response;
        let x: Vec<f64> = section.panels.outline.nodes.iter().map(|p| p[0]).collect();
        let nose = section.panels.outline.foremost() as f64;
        let (spline, last) = (&section.map.spline, (x.len() - 1) as f64);
        let c = spline.coefficients(&x);
        let arc = |t: f64| section.map.spline.value(&section.map.arc, t);
        let [upper, lower] = self.condition.trips.map(|trip| trip.filter(|&x| x < 1.0));
        [
            upper.map(|x| arc(invert(spline, &c, x, 0.0, nose, -1.0))),
            lower.map(|x| arc(invert(spline, &c, x, nose, last, 1.0))),
        ]
    }
}
