//! Cylinders and cones, whole and truncated.

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
use super::measure::{convex, length};

/// A truncated cone around the z axis, from `-height / 2` to `height / 2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frustum {
    bottom: f64,
    top: f64,
    /// Half the height.
    half: f64,
    /// Length of the slanted line from rim to rim, and its unit direction, radially and up.
    slant: f64,
    along: [f64; 2],
}

/// One of the three lines of the outline, right of the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Line {
    Bottom,
    Side,
    Top,
}

impl Frustum {
    /// The cone with radii `bottom` and `top`, one of which may be 0.
    pub fn new(bottom: f64, top: f64, height: f64) -> Result<Self> {
        for (name, radius) in [("the bottom radius", bottom), ("the top radius", top)] {
            if !(radius >= 0.0 && radius.is_finite()) {
                return Err(Error::invalid(format!("{name} is {radius}; give a finite length in model units, not negative")));
            }
        }
        length("the larger radius", bottom.max(top))?;
        length("height", height)?;
        let slant = (top - bottom).hypot(height);
        Ok(Self { bottom, top, half: 0.5 * height, slant, along: [(top - bottom) / slant, height / slant] })
    }

    /// The cylinder.
    pub fn cylinder(radius: f64, height: f64) -> Result<Self> {
        Self::new(length("radius", radius)?, radius, height)
    }

    /// How far a point of the half-plane lies outside each line, in the order of [`Line`].
    fn heights(&self, radial: f64, z: f64) -> [f64; 3] {
        let side = (radial - self.bottom) * self.along[1] - (z + self.half) * self.along[0];
        [-self.half - z, side, z - self.half]
    }

    /// Whether a point of the half-plane lies level with a line.
    fn beside(&self, line: Line, radial: f64, z: f64) -> bool {
        match line {
            Line::Bottom => radial <= self.bottom,
            Line::Top => radial <= self.top,
            Line::Side => (0.0..=self.slant).contains(&self.share(radial, z)),
        }
    }

    /// How far along the slanted line.
    fn share(&self, radial: f64, z: f64) -> f64 {
        (radial - self.bottom) * self.along[0] + (z + self.half) * self.along[1]
    }

    /// Distance and its gradient, radially and up.
    fn profile(&self, radial: f64, z: f64) -> (f64, [f64; 2]) {
        let [bottom, side, top] = self.heights(radial, z);
        let out = [self.along[1], -self.along[0]];
        if bottom.max(side).max(top) <= 0.0 {
            // Nearest of the lines, all of them ahead.
            return if side >= bottom.max(top) {
                (side, out)
            } else if top >= bottom {
                (top, [0.0, 1.0])
            } else {
                (bottom, [0.0, -1.0])
            };
        }
        // From the nearest point of each line.
        let share = self.share(radial, z).clamp(0.0, self.slant);
        let from = [
            [(radial - self.bottom).max(0.0), z + self.half],
            [radial - (self.bottom + share * self.along[0]), z + self.half - share * self.along[1]],
            [(radial - self.top).max(0.0), z - self.half],
        ];
        let lengths = from.map(|[r, z]| r.hypot(z));
        let nearest = if lengths[1] <= lengths[0].min(lengths[2]) { 1 } else { 2 * usize::from(lengths[2] < lengths[0]) };
        let length = lengths[nearest];
        if nearest == 1 && (0.0..=self.slant).contains(&self.share(radial, z)) {
            return (side, out);
        }
        (length, from[nearest].map(|part| part / length.max(f64::MIN_POSITIVE)))
    }

    /// Least and greatest distance of a box from the axis.
    fn radial(cell: &Aabb) -> [f64; 2] {
        let flat = |p: DVec3| DVec3::new(p.x, p.y, 0.0);
        let near = flat(cell.min).max(-flat(cell.max)).max(DVec3::ZERO);
        [near.length(), flat(cell.min.abs().max(cell.max.abs())).length()]
    }
}

impl Exact for Frustum {
    fn hull(&self) -> Option<Aabb> {
        let reach = self.bottom.max(self.top);
        let half = DVec3::new(reach, reach, self.half);
        Some(Aabb::new(-half, half))
    }

    fn value(&self, p: DVec3) -> f64 {
        self.profile(p.x.hypot(p.y), p.z).0
    }

    fn slope(&self, p: DVec3) -> DVec3 {
        let [radial, up] = self.profile(p.x.hypot(p.y), p.z).1;
        let out = DVec3::new(p.x, p.y, 0.0).normalize_or(DVec3::X);
        out * radial + DVec3::Z * up
    }

    /// Where one line of the outline is nearest all over the cell, its circle around the axis; beyond rims a circle
    /// around the nearest point.
    fn curving(&self, cell: &Aabb) -> Interval {
        let radial = Self::radial(cell);
        let corners = [0, 1, 2, 3].map(|i| (radial[i & 1], if i < 2 { cell.min.z } else { cell.max.z }));
        for (index, line) in [Line::Bottom, Line::Side, Line::Top].into_iter().enumerate() {
            // Both regions are convex, so that corners speak for the cell: level with the line and outside it, or with
            // the other lines farther behind.
            let level = corners.iter().all(|&(r, z)| self.beside(line, r, z));
            let outside = corners.iter().all(|&(r, z)| self.heights(r, z)[index] >= 0.0);
            let first = corners.iter().all(|&(r, z)| {
                let heights = self.heights(r, z);
                heights[index] >= heights[(index + 1) % 3].max(heights[(index + 2) % 3])
            });
            if level && (outside || first) {
                return if line == Line::Side { convex(radial[0] / self.along[1]) } else { Interval::exact(0.0) };
            }
        }
        convex(self.range(cell).lower)
    }

    /// The bottom, the side and the top, where no point lies outside.
    fn faces(&self, cell: &Aabb, points: &[DVec3]) -> Vec<(Vec<f64>, Interval)> {
        let radial = Self::radial(cell);
        let outside = |height: f64| height > 0.0;
        if [0, 1, 2, 3]
            .iter()
            .any(|i| self.heights(radial[i & 1], if i / 2 == 0 { cell.min.z } else { cell.max.z }).into_iter().any(outside))
        {
            return Vec::new();
        }
        let values = |line: usize| points.iter().map(|p| self.heights(p.x.hypot(p.y), p.z)[line]).collect();
        let round = convex(radial[0] / self.along[1]);
        [Interval::exact(0.0), round, Interval::exact(0.0)].into_iter().enumerate().map(|(line, bend)| (values(line), bend)).collect()
    }

    /// From the middle of the outline of the cell.
    fn range(&self, cell: &Aabb) -> Interval {
        let [near, far] = Self::radial(cell);
        let (r, z) = (0.5 * (near + far), 0.5 * (cell.min.z + cell.max.z));
        let reach = (0.5 * (far - near)).hypot(0.5 * (cell.max.z - cell.min.z));
        Interval::around(self.profile(r, z).0, reach * (1.0 + 1e-12))
    }
}
