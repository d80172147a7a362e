//! The question every source and field answers.

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
