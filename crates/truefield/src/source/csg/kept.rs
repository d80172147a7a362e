//! A shape whose values are no less than the way to a box around it.

use std::sync::Arc;

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};

use super::cuboid::Cuboid;
use super::exact::Exact;
use super::level;
use crate::source::kink::{self, Operand, Seam};

/// So many boxes away a shape is asked whether its values are distances.
const AWAY: f64 = 1e3;

/// Outside a shape a value may be less than the distance; it is still no less than the way to a box.
///
/// So the points where it is below some length lie within that length of the box.
#[derive(Clone)]
pub(super) struct Kept {
    shape: Arc<dyn Source>,
    fence: Cuboid,
}

/// Whether the values of a shape are its distances wherever it is not, so that its box bounds them.
pub(super) fn is_exact_outside(shape: &dyn Source) -> bool {
    shape.extent().is_some_and(|extent| shape.slack(&extent.grow(AWAY * extent.diagonal())).upper <= 0.0)
}

/// The shape itself where its values are bounded by its box or there is no box, else the same shape with values that are
/// bounded by a box a little larger: so much that it rarely matters.
pub(super) fn kept(shape: &Arc<dyn Source>) -> Arc<dyn Source> {
    match shape.extent() {
        Some(extent) if !is_exact_outside(&**shape) => {
            let fence = extent.grow(0.05 * extent.diagonal());
            match Cuboid::new(fence.center(), fence.size()) {
                Ok(fence) => Arc::new(Kept { shape: Arc::clone(shape), fence }),
                Err(_) => Arc::clone(shape),
            }
        }
        _ => Arc::clone(shape),
    }
}

impl Distance for Kept {
    /// The box that bounds the values, too.
    fn extent(&self) -> Option<Aabb> {
        self.fence.hull()
    }

    fn at(&self, p: DVec3) -> Interval {
        self.shape.at(p)
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.shape.over(cell)
    }
}

impl Source for Kept {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        self.shape.values(points, out)?;
        for (out, &p) in out.iter_mut().zip(points) {
            *out = out.max(self.fence.value(p));
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        let mut values = vec![0.0; points.len()];
        self.shape.values(points, &mut values)?;
        self.shape.gradients(points, out)?;
        for ((out, value), &p) in out.iter_mut().zip(values).zip(points) {
            if self.fence.value(p) > value {
                *out = self.fence.slope(p);
            }
        }
        Ok(())
    }

    fn tilt(&self, p: DVec3) -> f64 {
        self.shape.tilt(p)
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let slack = self.shape.slack(cell);
        Interval { lower: slack.lower.min(0.0), upper: slack.upper.max(0.0) }
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        let bend = self.shape.bend(cell);
        let value = level::value(&*self.shape, cell.center());
        if value.is_some_and(|value| value - cell.radius() > self.fence.range(cell).upper) {
            return bend;
        }
        Interval { lower: bend.lower.min(0.0), upper: f64::INFINITY }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        block.residual(block.between(self.bend(&block.cell), self.noise()), out);
        let mut operands = [Operand::of(&*self.shape, block)?, Operand::of(&self.fence, block)?];
        kink::greatest(block, &mut operands, Seam::Sharp, out);
        Ok(())
    }

    fn is_flat(&self) -> bool {
        self.shape.is_flat()
    }

    fn sided(&self) -> bool {
        self.shape.sided()
    }

    fn noise(&self) -> f64 {
        self.shape.noise()
    }
}
