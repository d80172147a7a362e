//! Shapes grown and shrunk.

use std::sync::Arc;

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, Affine, DVec3, Interval};
use crate::source::tangent;

use super::complement::{Complement, difference};
use super::kept::kept;
use super::level;
use super::measure::length;

/// All points whose value is at most a distance: grown by it, or shrunk where it is negative.
///
/// Where the shape's values are its distances, that is all points within the distance of it. Grown, it is exact outside;
/// shrunk, inside; on the other side wherever the way to the surface is smooth.
#[derive(Clone)]
pub struct Offset {
    shape: Arc<dyn Source>,
    distance: f64,
    /// A point in it, where it was shrunk.
    inside: Option<DVec3>,
}

impl Offset {
    /// The shape grown by a distance, shrunk by a negative one.
    pub fn new(shape: &Arc<dyn Source>, distance: f64) -> Result<Self> {
        if !distance.is_finite() {
            return Err(Error::invalid(format!("the offset is {distance}; give a finite distance in model units")));
        }
        // Grown values have to stay near the shape.
        let shape = if distance > 0.0 { kept(shape) } else { Arc::clone(shape) };
        let deepest = shape.extent().map(|extent| 0.5 * extent.size().min_element());
        if deepest.is_some_and(|deepest| distance <= -deepest) {
            return Err(Error::invalid(format!(
                "the offset is {distance:?}, which leaves nothing of the shape; no point of it is so deep"
            )));
        }
        let grown = Self { shape, distance, inside: None };
        let inside = grown.extent().filter(|_| distance < 0.0).and_then(|extent| {
            let around: Arc<dyn Source> = Arc::new(grown.clone());
            level::outside(&Complement::new(around), &extent)
        });
        Ok(Self { inside, ..grown })
    }

    /// Whether the shape is exact all the way from a cell to the surface of the offset, and has no ridges there, seen from
    /// the side that it was moved to.
    fn way_is_smooth(&self, cell: &Aabb, value: f64) -> bool {
        let whole = cell.grow((value - self.distance).abs() + 2.0 * cell.radius());
        let bend = self.shape.bend(&whole);
        let end = if self.distance > 0.0 { bend.lower } else { bend.upper };
        end.is_finite() && self.shape.slack(&whole) == Interval::exact(0.0)
    }
}

/// The wall of a shape: what is in it, no deeper than a thickness.
pub fn shell(shape: &Arc<dyn Source>, thickness: f64) -> Result<Complement> {
    let core = Offset::new(shape, -length("thickness", thickness)?)?;
    difference(shape, &[Arc::new(core)])
}

impl Distance for Offset {
    fn extent(&self) -> Option<Aabb> {
        self.shape.extent().map(|extent| extent.grow(self.distance))
    }

    fn below(&self, cell: &Aabb) -> Affine {
        tangent::below(self, cell)
    }

    fn at(&self, p: DVec3) -> Interval {
        level::at(self, p, self.inside)
    }
}

impl Source for Offset {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        self.shape.values(points, out)?;
        for out in out {
            *out -= self.distance;
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        self.shape.gradients(points, out)
    }

    fn tilt(&self, p: DVec3) -> f64 {
        self.shape.tilt(p)
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let Some(value) = level::value(&*self.shape, cell.center()) else { return Interval::ALL };
        let radius = cell.radius() * (1.0 + 1e-9) + self.noise();
        let beyond = if self.distance > 0.0 { value - radius > self.distance } else { value + radius < self.distance };
        if beyond {
            return self.shape.slack(cell);
        }
        if self.way_is_smooth(cell, value) {
            return Interval::exact(0.0);
        }
        level::slack(self, cell, self.inside, |cell| self.shape.slack(cell) == Interval::exact(0.0))
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        self.shape.bend(cell)
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        let [values, said] =
            [block.values, block.said].map(|numbers| numbers.iter().map(|number| number + self.distance).collect::<Vec<f64>>());
        self.shape.residual(&block.with(&values, &said), out)
    }

    fn is_flat(&self) -> bool {
        self.shape.is_flat()
    }

    fn sided(&self) -> bool {
        self.shape.sided()
    }

    fn noise(&self) -> f64 {
        self.shape.noise() + 2.0 * f64::EPSILON * self.distance.abs()
    }
}
