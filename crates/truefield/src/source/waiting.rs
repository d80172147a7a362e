//! What waits in a search that takes the nearest first.

use std::cmp::Ordering;

/// An item and its lower bound: the lowest comes out of a heap first, and of equals the one that went in first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Waiting<T> {
    pub bound: f64,
    /// In which order it was found: ties are settled by it.
    pub number: usize,
    pub item: T,
}

impl<T> PartialEq for Waiting<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl<T> Eq for Waiting<T> {}

impl<T> PartialOrd for Waiting<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl<T> Ord for Waiting<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        other.bound.total_cmp(&self.bound).then(other.number.cmp(&self.number))
    }
}
