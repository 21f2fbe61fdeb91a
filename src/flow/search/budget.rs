//! What a search has tried, and how much work is left.

use super::family::End;
use crate::flow::Attempt;
use crate::flow::layer::Layout;

/// Work after which the search ends, in Newton iterations with the stations that are wanted.
pub(super) const WORK: f64 = 1150.0;

/// The account of a search. Work is counted in Newton iterations with the stations that are wanted.
pub(super) struct Budget {
    pub attempts: Vec<Attempt>,
    wanted: usize,
    work: f64,
    limit: f64,
}

impl Budget {
    /// For flows on `layout`, of which `attempts` have been made.
    pub fn new(layout: &Layout, attempts: Vec<Attempt>) -> Self {
        Self { attempts, wanted: layout.stations(), work: 0.0, limit: WORK }
    }

    pub fn work(&self) -> f64 {
        self.work
    }

    pub fn exhausted(&self) -> bool {
        self.work > self.limit
    }

    /// Grants so much more work from here on.
    pub fn grant(&mut self, work: f64) {
        self.limit = self.work + work;
    }

    /// Notes an attempt and its work.
    pub fn note<A>(&mut self, what: &str, end: &End<A>) {
        self.attempts.push(Attempt::of(what, end.iterations, end.residual));
        self.add((end.iterations + 1) as f64, end.unknowns.stations.len());
    }

    /// Notes the work of so many iterations that make no attempt of their own.
    pub fn spend(&mut self, iterations: f64, layout: &Layout) {
        self.add(iterations, layout.stations());
    }

    fn add(&mut self, iterations: f64, stations: usize) {
        self.work += iterations * (stations as f64 / self.wanted as f64).powi(2);
    }
}
