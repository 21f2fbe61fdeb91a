//! Linearised systems that are kept from one use to the next.
//!
//! Newton's method ends with a system that is linearised at the solution, and the adjoint begins with the same one. A flow
//! that starts from a neighbour begins with the factors of the neighbour's. The memory of such systems is too much to be kept
//! with every solution; the last few are kept here, and made anew for others. The numbers are the same either way.

use super::band::Band;
use super::numbering::{Grid, Unknowns};
use super::outputs::OUTPUTS;
use super::system::{Linearised, Problem};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Number of linearised systems that are kept. One takes about 40 megabytes on the usual grid.
const LINEARISED: usize = 2;
/// Number of factorised systems that are kept: those of a design at three operating points.
const FACTORISED: usize = 3;
/// Number of systems without use whose memory is kept.
const SPARE: usize = 1;

/// A system with the solution that it belongs to.
struct Kept<T> {
    problem: Problem,
    unknowns: Unknowns,
    at: T,
}

/// The oldest stand first in all lists.
struct Store {
    linearised: Vec<Kept<Linearised>>,
    factorised: Vec<Kept<Arc<Linearised>>>,
    spare: Vec<(Grid, Band)>,
}

static STORE: Mutex<Store> = Mutex::new(Store { linearised: Vec::new(), factorised: Vec::new(), spare: Vec::new() });

fn store() -> MutexGuard<'static, Store> {
    STORE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adds an item to a list; the result is the oldest one where there are more than `most`.
fn push<T>(list: &mut Vec<T>, item: T, most: usize) -> Option<T> {
    list.push(item);
    (list.len() > most).then(|| list.remove(0))
}

/// Takes the system of a solution from a list.
fn remove<T>(list: &mut Vec<Kept<T>>, problem: &Problem, unknowns: &Unknowns) -> Option<Kept<T>> {
    let place = list.iter().position(|own| own.unknowns == *unknowns && own.problem == *problem)?;
    Some(list.remove(place))
}

/// Keeps the linearised system of a solution.
pub(super) fn keep(problem: &Problem, unknowns: &Unknowns, at: Linearised) {
    let own = Kept { problem: problem.clone(), unknowns: unknowns.clone(), at };
    let oldest = push(&mut store().linearised, own, LINEARISED);
    if let Some(Kept { problem, at, .. }) = oldest {
        give_back(problem.grid, at.band);
    }
}

/// The linearised system of a solution.
pub(super) fn linearised(problem: &Problem, unknowns: &Unknowns) -> Option<Linearised> {
    let known = remove(&mut store().linearised, problem, unknowns).map(|kept| kept.at);
    known.or_else(|| problem.linearise_in(zeros(&problem.grid), unknowns))
}

/// Keeps the factorised system of a solution.
pub(super) fn keep_factors(problem: &Problem, unknowns: &Unknowns, at: Arc<Linearised>) {
    let own = Kept { problem: problem.clone(), unknowns: unknowns.clone(), at };
    let oldest = {
        let factorised = &mut store().factorised;
        // what has been kept already is the same
        drop(remove(factorised, problem, unknowns));
        push(factorised, own, FACTORISED)
    };
    if let Some(Kept { problem, at, .. }) = oldest
        && let Some(at) = Arc::into_inner(at)
    {
        give_back(problem.grid, at.band);
    }
}

/// The factorised system of a solution; `None` where it is singular.
pub(super) fn factorised(problem: &Problem, unknowns: &Unknowns) -> Option<Arc<Linearised>> {
    let known = remove(&mut store().factorised, problem, unknowns).map(|kept| kept.at);
    let at = match known {
        Some(at) => at,
        None => {
            let mut at = linearised(problem, unknowns)?;
            if !at.band.factorise() {
                return None;
            }
            Arc::new(at)
        }
    };
    // it becomes the youngest
    keep_factors(problem, unknowns, Arc::clone(&at));
    Some(at)
}

/// Keeps the memory of a system that is not needed any more.
pub(super) fn give_back(grid: Grid, band: Band) {
    // what is too much is freed without the lock
    let oldest = push(&mut store().spare, (grid, band), SPARE);
    drop(oldest);
}

/// A system of zeros for a grid, in memory that was given back where there is some. Fresh memory costs as much as filling it.
pub(super) fn zeros(grid: &Grid) -> Band {
    let fitting = {
        let spare = &mut store().spare;
        let place = spare.iter().position(|(known, _)| known == grid);
        place.map(|place| spare.remove(place).1)
    };
    fitting.map_or_else(|| Band::new(grid, OUTPUTS), Band::cleared)
}
