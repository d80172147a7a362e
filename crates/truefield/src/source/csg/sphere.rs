//! Balls.

use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
use super::measure::{convex, length, point, reach};

/// The ball around a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    center: DVec3,
    radius: f64,
}

impl Sphere {
    /// The ball of a positive radius.
    pub fn new(center: DVec3, radius: f64) -> Result<Self> {
        Ok(Self { center: point("center", center)?, radius: length("radius", radius)? })
    }
}

impl Exact for Sphere {
    fn hull(&self) -> Option<Aabb> {
        Some(Aabb::new(self.center, self.center).grow(self.radius))
    }

    fn value(&self, p: DVec3) -> f64 {
        (p - self.center).length() - self.radius
    }

    fn slope(&self, p: DVec3) -> DVec3 {
        (p - self.center).normalize_or(DVec3::X)
    }

    /// Straight along the radius; across it a circle around the centre.
    fn curving(&self, cell: &Aabb) -> Interval {
        convex(reach(cell, self.center).0)
    }

    fn range(&self, cell: &Aabb) -> Interval {
        let (near, far) = reach(cell, self.center);
        Interval { lower: near - self.radius, upper: far - self.radius }
    }
}
