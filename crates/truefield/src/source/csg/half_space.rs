//! Half-spaces.

use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
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
}

impl Exact for HalfSpace {
    fn hull(&self) -> Option<Aabb> {
        None
    }

    fn value(&self, p: DVec3) -> f64 {
        (p - self.point).dot(self.normal)
    }

    fn slope(&self, _: DVec3) -> DVec3 {
        self.normal
    }

    fn curving(&self, _: &Aabb) -> Interval {
        Interval::exact(0.0)
    }

    fn range(&self, cell: &Aabb) -> Interval {
        let reach = (0.5 * cell.size()).dot(self.normal.abs());
        Interval::around(self.value(cell.center()), reach * (1.0 + 1e-15))
    }

    fn rounding(&self) -> f64 {
        rounding(Some(Aabb::new(self.point, self.point)))
    }
}
