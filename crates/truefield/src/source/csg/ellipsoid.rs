//! Ellipsoids.

use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
use super::measure::length;

/// An ellipsoid around the origin, its axes along x, y and z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Half the axes.
    axes: DVec3,
}

impl Ellipsoid {
    /// The ellipsoid with positive half axes.
    pub fn new(axes: DVec3) -> Result<Self> {
        for axis in axes.to_array() {
            length("a half axis", axis)?;
        }
        Ok(Self { axes })
    }

    /// The nearest point of the surface.
    ///
    /// It is `a^2 p / (a^2 + t)` for each axis, for the greatest root t of the equation that puts it on the surface.
    /// With u = t + c^2, c the shortest half axis, nothing cancels where the root nears its pole; the reciprocal of the
    /// length of `a p / (a^2 + t)` is concave in u, so that Newton's method comes from the left and never passes.
    fn foot(&self, p: DVec3) -> DVec3 {
        let (a, q) = (self.axes, p.abs());
        let shortest = a.min_position();
        let apart = (a - a[shortest]) * (a + a[shortest]);
        let mut u = (a * q - apart).max_element().max(0.0);
        if u == 0.0 || q[shortest] == 0.0 {
            // Level with the middle, across the shortest axis: the nearest points may be two.
            let level = DVec3::from_array(std::array::from_fn(|i| if q[i] == 0.0 { 0.0 } else { a[i] * q[i] / apart[i] }));
            let rest = 1.0 - level.length_squared();
            if rest >= 0.0 {
                let mut foot = a * level * DVec3::ONE.copysign(p);
                foot[shortest] = a[shortest] * rest.sqrt() * 1f64.copysign(p[shortest]);
                return foot;
            }
        }
        for _ in 0..STEPS {
            let below = apart + u;
            let share = |i: usize| if q[i] == 0.0 { 0.0 } else { a[i] * q[i] / below[i] };
            let s = DVec3::new(share(0), share(1), share(2));
            let square = s.length_squared();
            let fall: f64 = (0..3).filter(|&i| s[i] != 0.0).map(|i| s[i] * s[i] / below[i]).sum();
            let next = u + (square.sqrt() - 1.0) * square / fall;
            // Rounding ends the way up.
            if !(next > u) {
                break;
            }
            u = next;
        }
        let below = apart + u;
        DVec3::from_array(std::array::from_fn(|i| if q[i] == 0.0 { 0.0 } else { a[i] * a[i] * p[i] / below[i] }))
    }

    /// Outward normal at a point of the surface.
    fn normal(&self, foot: DVec3) -> DVec3 {
        (foot / self.axes / self.axes).normalize()
    }

    fn inside(&self, p: DVec3) -> bool {
        (p / self.axes).length_squared() < 1.0
    }
}

/// More than Newton's method takes: some 5, a few more next to the middle.
const STEPS: usize = 64;

impl Exact for Ellipsoid {
    fn hull(&self) -> Option<Aabb> {
        Some(Aabb::new(-self.axes, self.axes))
    }

    fn value(&self, p: DVec3) -> f64 {
        let distance = (p - self.foot(p)).length();
        if self.inside(p) { -distance } else { distance }
    }

    fn slope(&self, p: DVec3) -> DVec3 {
        self.normal(self.foot(p))
    }

    /// Curvatures of the surface, carried along the normal.
    ///
    /// With h from the centre to the tangent plane at the foot, no curvature is above h / c^2, c the shortest half axis; at
    /// distance s that is 1 / (c^2 / h + s). h is that of the centre of the cell, and as much more as the normal can have turned.
    fn curving(&self, cell: &Aabb) -> Interval {
        let shortest = self.axes.min_position();
        let (c, longest) = (self.axes[shortest], self.axes.max_element());
        let (center, radius) = (cell.center(), cell.radius() * (1.0 + 1e-9));
        let foot = self.foot(center);
        let sign = if self.inside(center) { -1.0 } else { 1.0 };
        let least = sign * (center - foot).length() - radius;
        let bound = |h: f64| {
            let curving = c * c / h + least;
            if curving > 0.0 { (1.0 + 1e-9) / curving } else { f64::INFINITY }
        };
        let mut upper = bound(longest);
        // Level with the shortest axis' middle the nearest point may jump to the other side.
        if cell.min[shortest] > 0.0 || cell.max[shortest] < 0.0 {
            let here = (self.axes * self.normal(foot)).length();
            for share in [0.02, 0.1, 0.3] {
                let h = here + share * (longest - here);
                let upper_here = bound(h);
                if upper_here < upper && here + longest * upper_here * radius <= h {
                    upper = upper_here;
                    break;
                }
            }
        }
        Interval { lower: 0.0, upper }
    }
}
