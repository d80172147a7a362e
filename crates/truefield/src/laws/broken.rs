//! What a law says when it is broken.

use std::fmt;

use crate::geom::DVec3;

/// The laws by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Law {
    /// `at` contains the true distance.
    Truth,
    /// `at_many` gives the bits of `at`.
    Many,
    /// `over` contains the true distance of every point of the cell.
    Range,
    /// Distances of two points differ by no more than the points are apart.
    Lipschitz,
    /// No surface outside the extent.
    Extent,
    /// The nearest point is as far as stated, and the distance is that of `at`.
    Stated,
    /// The nearest point lies on its element, on the stated feature.
    Element,
    /// No element is nearer, and none of a lower index is as near.
    Nearest,
    /// An answer exactly if the distance is not above `within`, and the same one.
    Within,
    /// The normal is the unit gradient of the signed distance.
    Normal,
    /// The same bits for any number of threads.
    Threads,
}

/// A broken law, where, and what was found instead.
#[derive(Clone, Debug, PartialEq)]
pub struct Broken {
    /// Which law.
    pub law: Law,
    /// The point that was asked.
    pub at: DVec3,
    /// What was found, in words and numbers.
    pub found: String,
}

impl fmt::Display for Broken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let DVec3 { x, y, z } = self.at;
        write!(f, "the law of {:?} is broken at ({x:?}, {y:?}, {z:?}): {}", self.law, self.found)
    }
}

impl std::error::Error for Broken {}

/// The law holds at `at`, or what was found there.
pub(super) fn hold(law: Law, at: DVec3, holds: bool, found: impl FnOnce() -> String) -> Result<(), Broken> {
    if holds { Ok(()) } else { Err(Broken { law, at, found: found() }) }
}
