//! Axis-aligned boxes.

use super::DVec3;

/// The box of all points between `min` and `max`, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lowest corner.
    pub min: DVec3,
    /// Highest corner.
    pub max: DVec3,
}

impl Aabb {
    /// The box of no points, neutral in [`Aabb::union`].
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box from one corner to the opposite one.
    pub const fn new(min: DVec3, max: DVec3) -> Self {
        Self { min, max }
    }

    /// The smallest box around `points`.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |b, p| Self { min: b.min.min(p), max: b.max.max(p) })
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Grown by `margin` on all sides.
    #[must_use]
    pub fn grow(self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// The middle.
    pub fn center(&self) -> DVec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Edge lengths.
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// Half the length of the diagonal: the radius of the ball around the box.
    pub fn radius(&self) -> f64 {
        0.5 * self.diagonal()
    }

    /// Whether `p` lies in the box, its faces included.
    pub fn contains(&self, p: DVec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }

    /// Whether the boxes share a point.
    pub fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Squared distance from `p` to the box; 0 inside.
    pub fn distance_squared(&self, p: DVec3) -> f64 {
        (self.min - p).max(p - self.max).max(DVec3::ZERO).length_squared()
    }

    /// Corner 0..8: bit 0 picks max x, bit 1 max y, bit 2 max z.
    pub fn corner(&self, index: usize) -> DVec3 {
        DVec3::new(
            if index & 1 == 0 { self.min.x } else { self.max.x },
            if index & 2 == 0 { self.min.y } else { self.max.y },
            if index & 4 == 0 { self.min.z } else { self.max.z },
        )
    }
}
