//! Work shared out over threads.

use std::sync::{Mutex, PoisonError};

/// Number of threads that this process may run at a time.
pub(crate) fn processors() -> usize {
    std::thread::available_parallelism().map_or(1, |n| n.get())
}

/// Applies `of` to every item, in order of the results, on at most `threads` threads; each thread makes a worker for
/// itself first.
///
/// The calling thread works too, so that a system that grants fewer threads, or none, makes this slower and no worse.
pub(crate) fn in_parallel_with<T: Sync, R: Send, W>(
    threads: usize,
    items: &[T],
    make: impl Fn() -> W + Sync,
    of: impl Fn(&mut W, &T) -> R + Sync,
) -> Vec<R> {
    let mut results: Vec<Option<R>> = items.iter().map(|_| None).collect();
    let next = Mutex::new(items.iter().zip(&mut results));
    let work = || {
        let mut worker = make();
        loop {
            let job = next.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((item, place)) = job else { break };
            *place = Some(of(&mut worker, item));
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads.min(items.len()) {
            // what cannot be had now is not asked for again
            if std::thread::Builder::new().spawn_scoped(scope, work).is_err() {
                break;
            }
        }
        work();
    });
    // every place has been filled: the threads end when there is none left
    results.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_stand_in_the_order_of_the_items() {
        let items: Vec<usize> = (0..100).collect();
        for threads in [0, 1, 2, 7, 1000] {
            let made = Mutex::new(0);
            let results = in_parallel_with(threads, &items, || *made.lock().unwrap() += 1, |(), item| item * item);
            assert_eq!(results, items.iter().map(|i| i * i).collect::<Vec<_>>());
            assert!(*made.lock().unwrap() <= threads.clamp(1, 100));
        }
        assert!(in_parallel_with(3, &[] as &[u8], || (), |(), _| ()).is_empty());
    }
}
