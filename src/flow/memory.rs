//! Memory that is kept because every iteration needs it again.
//!
//! Fresh memory from the operating system costs as much as filling it, and the allocator hands back what an iteration
//! frees: together a tenth of the time of a point. Large lists therefore leave their memory to the next list of their
//! kind, with one store per thread. This module depends on nothing; the types say themselves that their memory is
//! [kept](kept!).

use nalgebra::DMatrix;
use std::cell::RefCell;
use std::ops::{Deref, DerefMut};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::LocalKey;

pub(crate) type Spare<T> = RefCell<Vec<Vec<T>>>;

/// The type of the items of lists whose memory is kept.
pub(crate) trait Kept: Sized + 'static {
    /// Largest number of lists of this kind whose memory is kept.
    const MOST: usize;

    fn spare() -> &'static LocalKey<Spare<Self>>;
}

/// Declares that the memory of lists of a type is kept, of four of them unless another number is given.
macro_rules! kept {
    ($kind:ty) => {
        $crate::flow::memory::kept!($kind, 4);
    };
    ($kind:ty, $most:literal) => {
        impl $crate::flow::memory::Kept for $kind {
            const MOST: usize = $most;

            fn spare() -> &'static std::thread::LocalKey<$crate::flow::memory::Spare<Self>> {
                thread_local! {
                    static SPARE: $crate::flow::memory::Spare<$kind> = const { std::cell::RefCell::new(Vec::new()) };
                }
                &SPARE
            }
        }
    };
}
pub(crate) use kept;

kept!(f64);

/// The first spare list that `fits`, with whatever it holds, or an empty list.
fn take<T: Kept>(fits: impl Fn(&Vec<T>) -> bool) -> Vec<T> {
    let spare = T::spare().try_with(|spare| {
        let mut spare = spare.borrow_mut();
        let found = spare.iter().position(fits)?;
        Some(spare.swap_remove(found))
    });
    spare.ok().flatten().unwrap_or_default()
}

fn keep<T: Kept>(list: Vec<T>) {
    // at the end of a thread its spare memory may be gone already
    let _ = T::spare().try_with(|spare| {
        let mut spare = spare.borrow_mut();
        if spare.len() >= T::MOST {
            spare.remove(0);
        }
        spare.push(list);
    });
}

/// A list whose memory goes to the next list of its kind when it is dropped.
#[derive(Debug)]
pub(crate) struct Recycled<T: Kept>(Vec<T>);

impl<T: Kept> FromIterator<T> for Recycled<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        let mut list = take(|_| true);
        list.clear();
        list.extend(items);
        Self(list)
    }
}

impl<T: Kept> Recycled<T> {
    pub fn with_capacity(count: usize) -> Self {
        let mut list = take(|list: &Vec<T>| list.capacity() >= count);
        list.clear();
        list.reserve(count);
        Self(list)
    }

    /// A list of as many equal items.
    pub fn of(item: T, count: usize) -> Self
    where
        T: Clone,
    {
        let mut list = Self::with_capacity(count);
        list.0.resize(count, item);
        list
    }

    pub fn push(&mut self, item: T) {
        self.0.push(item);
    }
}

impl<T: Kept> Extend<T> for Recycled<T> {
    fn extend<I: IntoIterator<Item = T>>(&mut self, items: I) {
        self.0.extend(items);
    }
}

impl<T: Kept> DerefMut for Recycled<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

impl<T: Kept> Deref for Recycled<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T: Kept + Clone> Clone for Recycled<T> {
    fn clone(&self) -> Self {
        let mut list = Self::with_capacity(self.len());
        list.0.extend_from_slice(self);
        list
    }
}

impl<T: Kept> Drop for Recycled<T> {
    fn drop(&mut self) {
        keep(std::mem::take(&mut self.0));
    }
}

/// A matrix of arbitrary numbers that the caller must overwrite, in memory that was [returned](give_back) earlier where
/// there is some of the right size.
pub(crate) fn large(rows: usize, columns: usize) -> DMatrix<f64> {
    let size = rows * columns;
    let mut values = take(|v: &Vec<f64>| v.capacity() >= size && v.capacity() <= size + size / 2);
    values.resize(size, 0.0);
    DMatrix::from_vec(rows, columns, values)
}

/// Keeps the memory of a matrix for the next [`large`] one.
pub(crate) fn give_back(matrix: &mut DMatrix<f64>) {
    keep::<f64>(std::mem::replace(matrix, DMatrix::zeros(0, 0)).data.into());
}

/// Results that depend on one number alone, such as the count of nodes, and are needed again for every section.
pub(crate) struct Memo<T>(Mutex<Vec<(usize, Arc<T>)>>);

/// Largest number of results that a [`Memo`] keeps; the oldest is dropped first.
const MEMORIES: usize = 16;

impl<T> Memo<T> {
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    /// The result for `key`, made by `make` where it is not known yet. No lock is held while it is made.
    pub fn get(&self, key: usize, make: impl FnOnce() -> T) -> Arc<T> {
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, value)) = known().iter().find(|(k, _)| *k == key) {
            return Arc::clone(value);
        }
        let value = Arc::new(make());
        let mut known = known();
        if known.len() >= MEMORIES {
            known.remove(0);
        }
        known.push((key, Arc::clone(&value)));
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn returned_memory_serves_matrices_of_other_shapes() {
        let mut matrix = large(3, 4);
        matrix.fill(2.0);
        give_back(&mut matrix);
        assert_eq!(large(4, 3).shape(), (4, 3));
        assert_eq!(large(40, 3).shape(), (40, 3));
    }

    #[test]
    fn results_are_made_once() {
        let memo = Memo::new();
        let made = std::cell::Cell::new(0);
        let square = |n: usize| {
            *memo.get(n, || {
                made.set(made.get() + 1);
                n * n
            })
        };
        assert_eq!((square(3), square(4), square(3), made.get()), (9, 16, 9, 2));
        (0..2 * MEMORIES).for_each(|n| assert_eq!(square(n), n * n));
        assert!(memo.0.lock().unwrap().len() <= MEMORIES);
    }

    #[test]
    fn lists_hold_what_was_put_into_them() {
        let first: Recycled<f64> = (0..5).map(f64::from).collect();
        let second = first.clone();
        drop(first);
        let mut third = Recycled::with_capacity(2);
        third.push(7.0);
        assert_eq!((&second[..], &third[..]), (&[0.0, 1.0, 2.0, 3.0, 4.0][..], &[7.0][..]));
    }
}
