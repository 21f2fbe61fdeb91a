//! A flow as a system of equations: linearised at given unknowns, or evaluated in other numbers.

use super::band::{Band, Columns};
use super::equations::{Equations, Held};
use super::gas::{Flow, Parameters};
use super::geometry::{Background, Geometry, Shape};
use super::kernel::{Input, Kernel, Pass, Row, Target};
use super::moves::{ByPlaces, DISPLACING, LayerMoves, Moves, PLACES, lifted_background};
use super::numbering::{GLOBALS, Grid, Place, STAGNATION, TRANSITION, Unknowns};
use super::outputs::OUTPUTS;
use super::section_curve::SectionCurve;
use crate::differentiate::Tangent;
use crate::scalar::Scalar;

/// A flow that is sought: grid, section, parameters, and what is held.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Problem {
    pub grid: Grid,
    /// Nodes of the section in the frame of the chord line.
    pub nodes: Vec<[f64; 2]>,
    /// Places x of the trips.
    pub trips: [Option<f64>; 2],
    pub critical: f64,
    pub held: Held,
    /// Arc lengths to transition, where transition is kept.
    pub fixed_transition: Option<[f64; 2]>,
    pub parameters: Parameters,
}

/// Residuals and outputs in any kind of number.
#[derive(Debug, Clone)]
pub(super) struct Residuals<S> {
    pub stations: Vec<Vec<S>>,
    pub globals: [S; GLOBALS],
    pub outputs: [S; OUTPUTS],
}

impl<S: Scalar> Residuals<S> {
    pub fn zeros(grid: &Grid) -> Self {
        let zero = S::from(0.0);
        Self {
            stations: (0..grid.count()).map(|i| vec![zero; grid.unknowns(i)]).collect(),
            globals: [zero; GLOBALS],
            outputs: [zero; OUTPUTS],
        }
    }

    #[inline(always)]
    pub fn add(&mut self, row: Row, value: S) {
        match row {
            Row::Station(place) => self.stations[place.station][place.index] += value,
            Row::Global(g) => self.globals[g] += value,
            Row::Output(k) => self.outputs[k] += value,
        }
    }
}

impl Residuals<f64> {
    /// The largest magnitude of all residuals; NaN where there is one.
    pub fn largest(&self) -> f64 {
        let worst = |worst: f64, v: &f64| if v.is_nan() || worst.is_nan() { f64::NAN } else { worst.max(v.abs()) };
        self.stations.iter().flatten().chain(&self.globals).fold(0.0, worst)
    }
}

/// Where the numbers of the inputs are.
pub(super) struct Numbers<'a, S, U = f64> {
    pub geometry: &'a Geometry<S>,
    pub unknowns: &'a Unknowns<U>,
}

impl<S: Scalar + From<U>, U: Copy> Numbers<'_, S, U> {
    #[inline(always)]
    pub fn read(&self, input: Input) -> S {
        match input {
            Input::Node { station, line, axis } => self.geometry.node(station, line)[axis],
            Input::Unknown(place) => S::from(self.unknowns.at(place)),
            Input::Global(g) => S::from(self.unknowns.globals[g]),
            Input::Wall { side, point, axis } => self.geometry.wall.points[side.index()][point][axis],
            Input::Arc { side, point } => self.geometry.wall.arcs[side.index()][point],
            Input::Gap(number) => self.geometry.gaps[number],
            Input::Trip(side) => self.geometry.trips[side.index()],
            Input::Total => self.geometry.wall.total,
        }
    }
}

/// The pass that evaluates all terms.
pub(super) struct Evaluation<'a, S, U = f64> {
    pub numbers: Numbers<'a, S, U>,
    pub flow: &'a Flow<S>,
    pub residuals: Residuals<S>,
}

impl<S: Scalar + From<U>, U: Copy> Pass for Evaluation<'_, S, U> {
    fn term<const N: usize, const M: usize>(
        &mut self,
        kernel: &impl Kernel<N, M>,
        inputs: [Input; N],
        targets: [Target; M],
    ) {
        let results = kernel.evaluate::<S, S>(inputs.map(|input| self.numbers.read(input)), self.flow);
        for (result, target) in results.into_iter().zip(targets) {
            if let Some((row, factor)) = target {
                self.residuals.add(row, result * factor);
            }
        }
    }
}

/// The pass that differentiates all terms by the unknowns.
pub(super) struct Linearisation<'a> {
    pub numbers: Numbers<'a, f64>,
    pub moves: &'a Moves,
    pub flow: &'a Flow<f64>,
    pub residuals: Residuals<f64>,
    pub band: &'a mut Band,
}

/// Largest number of layers that one term reads.
const LAYERS: usize = 4;

/// Derivatives of a result with respect to the displacement thickness of layers, which many nodes share.
struct ByLayers {
    count: usize,
    sums: [(usize, f64); LAYERS],
}

impl ByLayers {
    #[inline(always)]
    fn add(&mut self, layer: usize, value: f64) {
        for (known, sum) in &mut self.sums[..self.count] {
            if *known == layer {
                *sum += value;
                return;
            }
        }
        self.sums[self.count] = (layer, value);
        self.count += 1;
    }
}

/// Adds the derivatives of a result with respect to its inputs to a row.
#[inline(always)]
fn scatter<const N: usize>(
    moves: &Moves,
    geometry: &Geometry<f64>,
    row: &mut impl Columns,
    inputs: &[Input; N],
    by: &[f64; N],
    factor: f64,
) {
    // derivatives with respect to the places, which many inputs share
    let mut places = [0.0; PLACES.len()];
    let mut add = |by: &[f64; 3], value: f64| {
        for (sum, by) in places.iter_mut().zip(by) {
            *sum += value * by;
        }
    };
    let mut layers = ByLayers { count: 0, sums: [(0, 0.0); LAYERS] };
    let mut k = 0;
    while k < N {
        let value = by[k] * factor;
        match inputs[k] {
            Input::Node { station, line, axis } => {
                let node = &moves.nodes[geometry.index(station, line)];
                let mut along = value * node.direction[axis];
                add(&node.by_places[axis], value);
                // both coordinates together, where they come together
                if axis == 0 && k + 1 < N && inputs[k + 1] == (Input::Node { station, line, axis: 1 }) {
                    k += 1;
                    let value = by[k] * factor;
                    along += value * node.direction[1];
                    add(&node.by_places[1], value);
                }
                if let Some(index) = node.displacement {
                    row.add(Place { station, index }, along);
                }
                if let Some((layer, factor)) = node.by_layer {
                    layers.add(layer, along * factor);
                }
            }
            // pressures do not depend on the speeds farther upstream, for which the band has no room; a number that is
            // not finite shows in the residual
            Input::Unknown(_) if value == 0.0 || !value.is_finite() => {}
            Input::Unknown(place) => row.add(place, value),
            Input::Global(g) => row.add_global(g, value),
            Input::Wall { side, point, axis } => add(&moves.wall.points[side.index()][point][axis].eps, value),
            Input::Arc { side, point } => add(&moves.wall.arcs[side.index()][point].eps, value),
            Input::Gap(_) | Input::Trip(_) | Input::Total => {}
        }
        k += 1;
    }
    for &(layer, value) in &layers.sums[..layers.count] {
        let LayerMoves { station, first, by } = moves.layers[layer];
        for (k, by) in DISPLACING.into_iter().zip(by) {
            row.add(Place { station, index: first + k }, value * by);
        }
    }
    for (global, value) in PLACES.into_iter().zip(places) {
        row.add_global(global, value);
    }
}

impl Pass for Linearisation<'_> {
    #[inline]
    fn term<const N: usize, const M: usize>(
        &mut self,
        kernel: &impl Kernel<N, M>,
        inputs: [Input; N],
        targets: [Target; M],
    ) {
        let x = inputs.map(|input| self.numbers.read(input));
        let results = kernel.evaluate::<Tangent<N>, f64>(Tangent::variables(x), self.flow);
        for (result, target) in results.iter().zip(targets) {
            let Some((row, factor)) = target else { continue };
            self.residuals.add(row, result.re * factor);
            let (moves, geometry) = (self.moves, self.numbers.geometry);
            match row {
                Row::Station(place) => {
                    scatter(moves, geometry, &mut self.band.equation(place), &inputs, &result.eps, factor);
                }
                Row::Global(g) => scatter(moves, geometry, &mut self.band.global(g), &inputs, &result.eps, factor),
                // the system has no rows for outputs
                Row::Output(_) => {}
            }
        }
    }
}

/// A system linearised at its unknowns.
#[derive(Debug, Clone)]
pub(super) struct Linearised {
    pub residuals: Residuals<f64>,
    pub band: Band,
    /// Areas of all tubes, interval by interval.
    pub areas: Vec<f64>,
}

impl Problem {
    pub fn equations(&self) -> Equations<'_> {
        Equations {
            grid: &self.grid,
            held: self.held,
            tripped: self.trips.map(|trip| trip.is_some_and(|x| x < 1.0)),
            critical: self.critical,
            fixed_transition: self.fixed_transition,
        }
    }

    pub fn flow(&self) -> Flow<f64> {
        Flow::new(&self.parameters)
    }

    /// The section in any kind of number.
    pub fn shape<S: Scalar>(&self, nodes: &[[S; 2]]) -> Option<Shape<S>> {
        Shape::new(nodes, self.trips)
    }

    /// The geometry at unknowns.
    pub fn geometry(&self, unknowns: &Unknowns) -> Option<Geometry<f64>> {
        self.geometry_in(&self.nodes, unknowns, &self.flow())
    }

    /// The geometry in any kind of number, for unknowns in the same kind or constant ones.
    pub fn geometry_in<S: Scalar + From<U>, U: Copy>(
        &self,
        nodes: &[[S; 2]],
        unknowns: &Unknowns<U>,
        flow: &Flow<S>,
    ) -> Option<Geometry<S>> {
        let shape = self.shape(nodes)?;
        let place = |g: usize| S::from(unknowns.globals[g]);
        let background = Background::new(&self.grid, &shape.curve, place(STAGNATION), TRANSITION.map(place));
        Some(Geometry::new(&self.grid, &shape, background, unknowns, &flow.stream))
    }

    /// Residuals in any kind of number, for unknowns in the same kind or constant ones.
    pub fn residuals_in<S: Scalar + From<U>, U: Copy>(
        &self,
        nodes: &[[S; 2]],
        parameters: &Parameters<S>,
        unknowns: &Unknowns<U>,
        terms: impl Fn(&mut Evaluation<S, U>),
    ) -> Option<Residuals<S>> {
        let flow = Flow::new(parameters);
        let geometry = self.geometry_in(nodes, unknowns, &flow)?;
        Some(self.residuals_at(&geometry, &flow, unknowns, terms))
    }

    /// Residuals in any kind of number, for a geometry that is known.
    pub fn residuals_at<S: Scalar + From<U>, U: Copy>(
        &self,
        geometry: &Geometry<S>,
        flow: &Flow<S>,
        unknowns: &Unknowns<U>,
        terms: impl Fn(&mut Evaluation<S, U>),
    ) -> Residuals<S> {
        let numbers = Numbers { geometry, unknowns };
        let mut pass = Evaluation { numbers, flow, residuals: Residuals::zeros(&self.grid) };
        terms(&mut pass);
        pass.residuals
    }

    /// Residuals at unknowns, whose geometry is put into `known` where it is not there already.
    pub fn residuals(&self, unknowns: &Unknowns, known: &mut Option<Geometry<f64>>) -> Option<Residuals<f64>> {
        let geometry = match known {
            Some(geometry) => geometry,
            None => known.insert(self.geometry(unknowns)?),
        };
        Some(self.residuals_at(geometry, &self.flow(), unknowns, |pass| self.equations().pass(pass)))
    }

    /// Areas of all tubes, interval by interval.
    pub fn areas(&self, geometry: &Geometry<f64>) -> Vec<f64> {
        let grid = &self.grid;
        let mut areas = Vec::with_capacity(grid.count() * grid.tubes());
        for station in 0..grid.count() - 1 {
            for tube in 0..grid.tubes() {
                let low = grid.lower_line(tube);
                let nodes = |line: usize| [geometry.node(station, line), geometry.node(station + 1, line)];
                areas.push(super::cell::Face::new(nodes(low), nodes(low + 1)).area);
            }
        }
        areas
    }

    /// Derivatives of the places with respect to the unknowns.
    pub fn moves(&self, unknowns: &Unknowns) -> Option<Moves> {
        let lifted: Vec<[ByPlaces; 2]> = self.nodes.iter().map(|p| p.map(ByPlaces::from_re)).collect();
        let curve = SectionCurve::new(&lifted)?;
        let background = lifted_background(&self.grid, &curve, unknowns);
        Some(Moves::new(&self.grid, background, unknowns, &self.flow()))
    }

    /// The system linearised at unknowns.
    #[cfg(test)]
    pub fn linearise(&self, unknowns: &Unknowns) -> Option<Linearised> {
        self.linearise_in(Band::new(&self.grid), unknowns, None)
    }

    /// The system linearised at unknowns in `band`, which holds zeros. Their geometry is `known` or made.
    pub fn linearise_in(
        &self,
        mut band: Band,
        unknowns: &Unknowns,
        known: Option<Geometry<f64>>,
    ) -> Option<Linearised> {
        let geometry = known.or_else(|| self.geometry(unknowns))?;
        let moves = self.moves(unknowns)?;
        let flow = self.flow();
        let mut pass = Linearisation {
            numbers: Numbers { geometry: &geometry, unknowns },
            moves: &moves,
            flow: &flow,
            residuals: Residuals::zeros(&self.grid),
            band: &mut band,
        };
        self.equations().pass(&mut pass);
        Some(Linearised { residuals: pass.residuals, band, areas: self.areas(&geometry) })
    }
}
