//! Boxes along the axes, with sharp or round edges.

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};

use super::exact::Exact;
use super::measure::{convex, length, point};

/// A box: all points within `rounding` of a core box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cuboid {
    center: DVec3,
    /// Half the edges of the core; some may be 0 where edges are round.
    core: DVec3,
    rounding: f64,
}

impl Cuboid {
    /// The box of positive edge lengths.
    pub fn new(center: DVec3, size: DVec3) -> Result<Self> {
        Self::rounded(center, size, 0.0)
    }

    /// The box whose edges and corners are rounded by a radius, at most half the shortest edge; 0: sharp.
    pub fn rounded(center: DVec3, size: DVec3, radius: f64) -> Result<Self> {
        for edge in size.to_array() {
            length("an edge of the size", edge)?;
        }
        if !(radius >= 0.0 && radius <= 0.5 * size.min_element()) {
            let most = 0.5 * size.min_element();
            return Err(Error::invalid(format!("radius is {radius}; give 0 to {most}, half the shortest edge of the box")));
        }
        Ok(Self { center: point("center", center)?, core: 0.5 * size - radius, rounding: radius })
    }

    /// How far `p` lies beyond the faces of the core, per axis.
    fn beyond(&self, p: DVec3) -> DVec3 {
        (p - self.center).abs() - self.core
    }

    fn total(&self, beyond: DVec3) -> f64 {
        beyond.max(DVec3::ZERO).length() + beyond.max_element().min(0.0) - self.rounding
    }

    /// Least and greatest `beyond` over a box.
    fn span(&self, cell: &Aabb) -> (DVec3, DVec3) {
        let (low, high) = (cell.min - self.center, cell.max - self.center);
        let least = low.max(-high).max(DVec3::ZERO);
        (least - self.core, low.abs().max(high.abs()) - self.core)
    }
}

impl Exact for Cuboid {
    fn hull(&self) -> Option<Aabb> {
        let half = self.core + self.rounding;
        Some(Aabb::new(self.center - half, self.center + half))
    }

    fn value(&self, p: DVec3) -> f64 {
        self.total(self.beyond(p))
    }

    fn slope(&self, p: DVec3) -> DVec3 {
        let beyond = self.beyond(p);
        let toward = DVec3::ONE.copysign(p - self.center);
        if beyond.max_element() > 0.0 {
            return beyond.max(DVec3::ZERO).normalize() * toward;
        }
        DVec3::AXES[beyond.max_position()] * toward
    }

    /// Nothing where one face is nearest all over the cell; beyond edges and corners of the core a circle around them.
    fn curving(&self, cell: &Aabb) -> Interval {
        let (low, high) = self.span(cell);
        let face = (0..3).any(|axis| {
            let one_sided = cell.min[axis] >= self.center[axis] || cell.max[axis] <= self.center[axis];
            let others = high[(axis + 1) % 3].max(high[(axis + 2) % 3]);
            one_sided && others <= low[axis].min(0.0)
        });
        if face { Interval::exact(0.0) } else { convex(low.max(DVec3::ZERO).length()) }
    }

    /// The six planes, where no point lies beyond two of them.
    fn faces(&self, cell: &Aabb, points: &[DVec3]) -> Vec<(Vec<f64>, Interval)> {
        let high = self.span(cell).1;
        if (0..3).filter(|&axis| high[axis] > 0.0).count() > 1 {
            return Vec::new();
        }
        let planes = (0..6).map(|face| (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 }));
        let height = |p: DVec3, axis: usize, side: f64| side * (p - self.center)[axis] - self.core[axis] - self.rounding;
        planes.map(|(axis, side)| (points.iter().map(|&p| height(p, axis, side)).collect(), Interval::exact(0.0))).collect()
    }

    /// The least and the greatest distance: it grows with each coordinate's way beyond the faces.
    fn range(&self, cell: &Aabb) -> Interval {
        let (low, high) = self.span(cell);
        Interval { lower: self.total(low), upper: self.total(high) }
    }
}
