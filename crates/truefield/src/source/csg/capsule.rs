//! Capsules.

use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
use super::measure::{convex, length, point};

/// All points within a radius of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    start: DVec3,
    end: DVec3,
    radius: f64,
}

impl Capsule {
    /// The capsule around the segment from `start` to `end`; a ball where they coincide.
    pub fn new(start: DVec3, end: DVec3, radius: f64) -> Result<Self> {
        Ok(Self { start: point("the start", start)?, end: point("the end", end)?, radius: length("radius", radius)? })
    }

    /// From the nearest point of the segment.
    fn off_axis(&self, p: DVec3) -> DVec3 {
        let (along, from) = (self.end - self.start, p - self.start);
        let share = (from.dot(along) / along.length_squared()).clamp(0.0, 1.0);
        // Not a number for a segment of no length; `max` takes the number.
        from - along * share.max(0.0)
    }
}

impl Exact for Capsule {
    fn hull(&self) -> Option<Aabb> {
        Some(Aabb::around([self.start, self.end]).grow(self.radius))
    }

    fn value(&self, p: DVec3) -> f64 {
        self.off_axis(p).length() - self.radius
    }

    fn slope(&self, p: DVec3) -> DVec3 {
        self.off_axis(p).normalize_or((self.end - self.start).try_normalize().map_or(DVec3::X, DVec3::any_orthonormal_vector))
    }

    /// Beyond an end a ball, between them a cylinder.
    fn curving(&self, cell: &Aabb) -> Interval {
        convex(self.off_axis(cell.center()).length() - cell.radius())
    }
}
