//! What a part of a cell says, as a trilinear function, and how far the distance may be from it.

use super::cell::aged_error;
use super::page::{Record, Samples};
use super::{Cell, Leaf, cubic};
use crate::geom::{Aabb, Affine, DVec3, Interval};

/// A trilinear function on a box, given at its corners.
pub(super) struct Model {
    pub corners: [f64; 8],
    /// Contains the distance minus the function, everywhere in the box, after all edits.
    pub error: Interval,
}

impl Model {
    /// Of a part of a cell; of inner cells and exact leaves by what the corners say.
    pub fn of(cell: &Cell<'_>, part: &Aabb) -> Self {
        let record = cell.record();
        let extent = cell.extent();
        let error = record.error();
        let (corners, error) = match cell.leaf() {
            Leaf::Cubic(samples) => Self::of_cubic(samples, &extent, part, error),
            _ if *part == extent => (record.corners.map(f64::from), error),
            Leaf::Linear | Leaf::Exact(_) => (Self::of_record(record, &extent, part), error),
        };
        let fresh = Self { corners, error };
        if cell.is_fresh() {
            return fresh;
        }
        let said = fresh.said();
        let before = said.plus(error);
        Self { error: aged_error(error, said, before, cell.age(before, part)), ..fresh }
    }

    fn of_record(record: &Record, extent: &Aabb, part: &Aabb) -> [f64; 8] {
        let cut = local(extent, part);
        std::array::from_fn(|corner| record.value(cut.corner(corner)))
    }

    /// Between corners a cubic is off by no more than an eighth of each second derivative.
    fn of_cubic(samples: &Samples, extent: &Aabb, part: &Aabb, error: Interval) -> ([f64; 8], Interval) {
        let cut = local(extent, part);
        let size = cut.size();
        let off = 0.125 * cubic::bends(samples).dot(size * size) * (1.0 + 1e-12);
        (std::array::from_fn(|corner| cubic::value(samples, cut.corner(corner))), error.widen(off))
    }

    fn said(&self) -> Interval {
        let fold = |f: fn(f64, f64) -> f64| self.corners.iter().copied().fold(self.corners[0], f);
        Interval { lower: fold(f64::min), upper: fold(f64::max) }
    }

    /// Contains the distance in the whole box.
    pub fn range(&self) -> Interval {
        self.said().plus(self.error)
    }

    /// Contains the distance at a point of the box.
    pub fn at(&self, part: &Aabb, p: DVec3) -> Interval {
        let at = ((p - part.min) / part.size()).clamp(DVec3::ZERO, DVec3::ONE);
        let c = &self.corners;
        let along = |low: f64, high: f64, part: f64| low + (high - low) * part;
        let row = |a: usize| along(c[a], c[a + 1], at.x);
        self.error.plus(Interval::exact(along(along(row(0), row(2), at.y), along(row(4), row(6), at.y), at.z)))
    }

    /// The affine function of the mean slopes, and what contains the distance minus it, in a box of this size.
    pub fn affine(&self, size: DVec3) -> (Affine, Interval) {
        let c = &self.corners;
        let rise = |axis: usize| {
            let step = 1 << axis;
            (0..8).filter(|corner| corner & step == 0).map(|low| c[low + step] - c[low]).sum::<f64>() * 0.25
        };
        let rises = DVec3::new(rise(0), rise(1), rise(2));
        let value = c.iter().sum::<f64>() * 0.125;
        // The difference is trilinear: largest and least at corners.
        let mut off = Interval { lower: f64::INFINITY, upper: f64::NEG_INFINITY };
        for (corner, said) in c.iter().enumerate() {
            let half = |axis: usize| if corner >> axis & 1 == 1 { 0.5 } else { -0.5 };
            off = off.hull(Interval::exact(said - (value + rises.dot(DVec3::new(half(0), half(1), half(2))))));
        }
        (Affine { value, slope: rises / size }, self.error.plus(off))
    }
}

fn local(extent: &Aabb, part: &Aabb) -> Aabb {
    let at = |p: DVec3| ((p - extent.min) / extent.size()).clamp(DVec3::ZERO, DVec3::ONE);
    Aabb::new(at(part.min), at(part.max))
}
