//! Balls.

use crate::distance::{Distance, Source};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::measure::{length, point, reach, rounding};

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

    /// The middle.
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// From the middle to the surface.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    fn value(&self, p: DVec3) -> f64 {
        (p - self.center).length() - self.radius
    }
}

impl Distance for Sphere {
    fn extent(&self) -> Option<Aabb> {
        Some(Aabb::new(self.center, self.center).grow(self.radius))
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact(self.value(p))
    }

    fn over(&self, cell: &Aabb) -> Interval {
        let (near, far) = reach(cell, self.center);
        Interval { lower: near - self.radius, upper: far - self.radius }.widen(self.noise())
    }
}

impl Source for Sphere {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.value(p);
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = (p - self.center).normalize_or(DVec3::X);
        }
        Ok(())
    }

    /// Straight along the radius; across it a circle around the centre.
    fn bend(&self, cell: &Aabb) -> Interval {
        Interval { lower: 0.0, upper: (1.0 + 1e-12) / reach(cell, self.center).0 }
    }

    fn noise(&self) -> f64 {
        rounding(self.extent())
    }
}
