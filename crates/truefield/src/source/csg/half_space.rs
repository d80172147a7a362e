//! Half-spaces.

use crate::distance::{Distance, Source};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::measure::{direction, point, rounding};

/// All points behind a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    point: DVec3,
    normal: DVec3,
}

impl HalfSpace {
    /// The points on the far side of the plane through `at`, seen from where `normal` points to.
    pub fn new(at: DVec3, normal: DVec3) -> Result<Self> {
        Ok(Self { point: point("point", at)?, normal: direction("normal", normal)? })
    }

    fn value(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal)
    }
}

impl Distance for HalfSpace {
    fn extent(&self) -> Option<Aabb> {
        None
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact(self.value(p))
    }

    fn over(&self, cell: &Aabb) -> Interval {
        let reach = (0.5 * cell.size()).dot(self.normal.abs());
        Interval::around(self.value(cell.center()), reach * (1.0 + 1e-15) + self.noise())
    }
}

impl Source for HalfSpace {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.value(p);
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        out[..points.len()].fill(self.normal);
        Ok(())
    }

    fn bend(&self, _: &Aabb) -> Interval {
        Interval::exact(0.0)
    }

    fn noise(&self) -> f64 {
        rounding(Some(Aabb::new(self.point, self.point)))
    }
}
