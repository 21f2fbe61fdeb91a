//! Linearised systems that are kept from one use to the next.
//!
//! Newton's method ends with factors of a system that was linearised close to the solution. The adjoint corrects them, and a
//! flow that starts from a neighbour begins with those of the neighbour. The memory of such systems is too much to be kept with
//! every solution, which knows where its system was linearised; the last few systems are kept here, and made anew for others.
//! The numbers are the same either way.

use super::band::Band;
use super::numbering::{Grid, Unknowns};
use super::system::{Linearised, Problem};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Number of linearised systems that are kept. One takes about 40 megabytes on the usual grid.
const LINEARISED: usize = 2;
/// Number of factorised systems that are kept: those of a design at three operating points.
const FACTORISED: usize = 3;
/// Number of systems without use whose memory is kept.
const SPARE: usize = 1;

/// A flow and the unknowns at which its system was linearised.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Base {
    pub problem: Problem,
    pub unknowns: Unknowns,
}

/// A system with the place at which it was linearised.
type Kept<T> = (Arc<Base>, T);

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

/// Takes the system of a place from a list.
fn remove<T>(list: &mut Vec<Kept<T>>, base: &Arc<Base>) -> Option<T> {
    let place = list.iter().position(|(own, _)| Arc::ptr_eq(own, base) || own == base)?;
    Some(list.remove(place).1)
}

/// Keeps a linearised system.
pub(super) fn keep(base: &Arc<Base>, at: Linearised) {
    let oldest = push(&mut store().linearised, (Arc::clone(base), at), LINEARISED);
    if let Some((base, at)) = oldest {
        give_back(base.problem.grid.clone(), at.band);
    }
}

/// Keeps a factorised system, if its flow is more than a stage on the way to another.
pub(super) fn keep_factors(base: &Arc<Base>, at: Arc<Linearised>) {
    let own = (Arc::clone(base), at);
    let oldest = match base.problem.fixed_transition {
        Some(_) => Some(own),
        None => push(&mut store().factorised, own, FACTORISED),
    };
    if let Some((base, at)) = oldest
        && let Some(at) = Arc::into_inner(at)
    {
        give_back(base.problem.grid.clone(), at.band);
    }
}

/// The system factorised at a place; `None` where it is singular.
pub(super) fn factorised(base: &Arc<Base>) -> Option<Arc<Linearised>> {
    let known = remove(&mut store().factorised, base);
    let make = || {
        let known = remove(&mut store().linearised, base);
        let Base { problem, unknowns } = &**base;
        let mut at = known.or_else(|| problem.linearise_in(zeros(&problem.grid), unknowns, None))?;
        at.band.factorise().then(|| Arc::new(at))
    };
    let at = known.or_else(make)?;
    // it becomes the youngest
    keep_factors(base, Arc::clone(&at));
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
    fitting.map_or_else(|| Band::new(grid), Band::cleared)
}
