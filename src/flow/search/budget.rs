//! The record of what a search has tried, and how much work is left.

use super::family::End;
use crate::flow::Attempt;
use crate::flow::layer::Layout;

/// Work after which the search ends, in Newton iterations on the requested stations.
pub(super) const WORK: f64 = 420.0;

/// The account of a search. Work is counted in Newton iterations on the requested stations.
pub(super) struct Budget {
    pub attempts: Vec<Attempt>,
    /// Number of requested stations.
    wanted: usize,
    /// Work done so far.
    work: f64,
    /// Work at which the search ends.
    limit: f64,
}

impl Budget {
    /// An account for flows on `layout`, after `attempts` have been made. `hope` is the share of the usual work that is
    /// worth spending.
    pub fn new(layout: &Layout, attempts: Vec<Attempt>, hope: f64) -> Self {
        Self { attempts, wanted: layout.stations(), work: 0.0, limit: WORK * hope }
    }

    /// Work done so far.
    pub fn work(&self) -> f64 {
        self.work
    }

    /// Whether the work exceeds the limit.
    pub fn exhausted(&self) -> bool {
        self.work > self.limit
    }

    /// Allows `work` more from here on.
    pub fn grant(&mut self, work: f64) {
        self.limit = self.work + work;
    }

    /// Allows no more than `work` from here on.
    pub fn restrict(&mut self, work: f64) {
        self.limit = self.limit.min(self.work + work);
    }

    /// Notes an attempt and its work.
    pub fn note<V>(&mut self, what: &str, end: &End<V>) {
        self.attempts.push(Attempt::of(what, end.iterations, end.residual));
        self.add((end.iterations + 1) as f64, end.unknowns.stations.len());
    }

    /// Notes the work of iterations on `layout` that are no attempt of their own.
    pub fn spend(&mut self, iterations: f64, layout: &Layout) {
        self.add(iterations, layout.stations());
    }

    fn add(&mut self, iterations: f64, stations: usize) {
        self.work += iterations * (stations as f64 / self.wanted as f64).powi(2);
    }
}
