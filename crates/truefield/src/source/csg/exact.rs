//! Shapes whose signed distance is known everywhere.

use crate::distance::{Distance, Source};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::measure::rounding;

/// A shape with an exact signed distance: all that is needed to be a [`Source`].
pub trait Exact: Send + Sync {
    /// The box of the shape; `None` when it has no end.
    fn hull(&self) -> Option<Aabb>;

    /// The signed distance.
    fn value(&self, p: DVec3) -> f64;

    /// The gradient of the distance, of length 1; on a ridge that of one of its sides.
    fn slope(&self, p: DVec3) -> DVec3;

    /// [`Source::bend`].
    fn curving(&self, cell: &Aabb) -> Interval;

    /// Contains the distances over a box.
    fn range(&self, cell: &Aabb) -> Interval {
        Interval::around(self.value(cell.center()), cell.radius() * (1.0 + 1e-15))
    }

    /// What rounding moves a distance by, near the shape.
    fn rounding(&self) -> f64 {
        rounding(self.hull())
    }
}

impl<T: Exact> Distance for T {
    fn extent(&self) -> Option<Aabb> {
        self.hull()
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact(self.value(p))
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.range(cell).widen(self.rounding())
    }
}

impl<T: Exact> Source for T {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.value(p);
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.slope(p);
        }
        Ok(())
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        self.curving(cell)
    }

    fn noise(&self) -> f64 {
        self.rounding()
    }
}
