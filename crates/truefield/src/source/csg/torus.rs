//! Rings.

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
use super::measure::length;

/// All points within a radius of a circle around the z axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    major: f64,
    minor: f64,
}

impl Torus {
    /// The ring around the circle of radius `major`; `minor` is less, or the ring would close over its own hole.
    pub fn new(major: f64, minor: f64) -> Result<Self> {
        let (major, minor) = (length("major", major)?, length("minor", minor)?);
        if minor >= major {
            return Err(Error::invalid(format!(
                "minor is {minor} and major {major}; minor must be less than major, or the ring has no hole"
            )));
        }
        Ok(Self { major, minor })
    }
}

impl Exact for Torus {
    fn hull(&self) -> Option<Aabb> {
        let half = DVec3::new(self.major + self.minor, self.major + self.minor, self.minor);
        Some(Aabb::new(-half, half))
    }

    fn value(&self, p: DVec3) -> f64 {
        (p.x.hypot(p.y) - self.major).hypot(p.z) - self.minor
    }

    fn slope(&self, p: DVec3) -> DVec3 {
        let out = DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X);
        (p - out * self.major).normalize_or(out)
    }

    /// A circle around the nearest point of the ring's circle, and one around the axis: downward inside of the ring's
    /// circle, with a ridge on the axis.
    fn curving(&self, cell: &Aabb) -> Interval {
        let flat = |p: DVec3| DVec3::new(p.x, p.y, 0.0);
        let radial = flat(cell.min).max(-flat(cell.max)).max(DVec3::ZERO).length();
        let least = self.value(cell.center()) + self.minor - cell.radius();
        let inward = (self.major - radial).max(0.0);
        let steep = if inward < least { inward / least } else { 1.0 };
        Interval {
            lower: if inward == 0.0 { 0.0 } else { -steep * (1.0 + 1e-9) / radial },
            upper: if least > 0.0 { (1.0 + 1e-9) / least } else { f64::INFINITY },
        }
    }
}
