//! The question every source and field answers.

use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval, Nearest};

/// Anything that can be asked how far it is. Distances are in model units, negative inside.
pub trait Distance: Send + Sync {
    /// The box of the shape, or of a field's domain; `None` when unbounded.
    fn extent(&self) -> Option<Aabb>;

    /// The interval that contains the true signed distance at `p`.
    fn at(&self, p: DVec3) -> Interval;

    /// The range of distances over a box; the default uses that distances are 1-Lipschitz.
    fn over(&self, cell: &Aabb) -> Interval {
        self.at(cell.center()).widen(cell.radius() * (1.0 + 1e-15))
    }

    /// [`Distance::at`] for many points; `out` is as long as `points`.
    fn at_many(&self, points: &[DVec3], out: &mut [Interval]) {
        for (p, out) in points.iter().zip(out) {
            *out = self.at(*p);
        }
    }
}

/// A distance that also knows the nearest point of the surface.
pub trait Closest: Distance {
    /// The nearest point if it lies within `within` (a plain, unsigned length) of `p`, else `None`.
    fn nearest(&self, p: DVec3, within: f64) -> Option<Nearest>;
}

/// A shape that fields can be built from: one number at every point, and what is known of it over boxes.
///
/// The value is the signed distance wherever [`Distance::at`] is exact. Where a shape knows an interval only, as a
/// difference of two shapes does beyond their common edge, it is a number that has the sign of the distance, vanishes on
/// the surface and changes by no more than one moves, but for [`Source::noise`]. [`Source::slack`] says how far the
/// distance may be from it.
pub trait Source: Distance {
    /// The values at many points; `out` is as long as `points`.
    ///
    /// Fails where the shape cannot be asked: a function of the user that raises, or says what is no number.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()>;

    /// Contains the distance minus the value at every point of the cell; ends may be infinite.
    fn slack(&self, cell: &Aabb) -> Interval {
        let _ = cell;
        Interval::exact(0.0)
    }

    /// Contains the second derivative of the value at every point of the cell, along every line of unit speed.
    ///
    /// Where the slope jumps it is infinite: down to `-inf` at a ridge, as between two walls, and up to `inf` at a valley.
    /// With a lower end m, the value minus m/2 |p|^2 is convex in the cell; with an upper end, it is concave.
    fn bend(&self, cell: &Aabb) -> Interval {
        let _ = cell;
        Interval::ALL
    }

    /// No less than how far solving or rounding can move a value from one that changes by no more than one moves.
    fn noise(&self) -> f64 {
        0.0
    }
}
