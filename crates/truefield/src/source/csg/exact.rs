//! Shapes whose signed distance is known everywhere.

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::Result;
use crate::geom::{Aabb, Affine, DVec3, Interval};

use super::measure::rounding;
use crate::source::kink::{self, Operand, Seam};

/// A shape with an exact signed distance: all that is needed to be a [`Source`].
pub trait Exact: Send + Sync {
    /// The box of the shape; `None` when it has no end.
    fn hull(&self) -> Option<Aabb>;

    /// The signed distance.
    fn value(&self, p: DVec3) -> f64;

    /// The gradient of the distance, of length 1; on a ridge that of one of its sides.
    fn slope(&self, p: DVec3) -> DVec3;

    /// [`Source::bend`].
    fn curving(&self, cell: &Aabb) -> Interval;

    /// Smoother numbers of which the distance is the greatest one all over the cell, as inside a convex shape the
    /// distances of its faces: their values at some points, and how they bend in the cell. None where none are known.
    fn faces(&self, cell: &Aabb, points: &[DVec3]) -> Vec<(Vec<f64>, Interval)> {
        let _ = (cell, points);
        Vec::new()
    }

    /// Contains the distances over a box.
    fn range(&self, cell: &Aabb) -> Interval {
        Interval::around(self.value(cell.center()), cell.radius() * (1.0 + 1e-15))
    }

    /// What rounding moves a distance by, near the shape.
    fn rounding(&self) -> f64 {
        rounding(self.hull())
    }
}

impl<T: Exact> Distance for T {
    fn extent(&self) -> Option<Aabb> {
        self.hull()
    }

    fn enclosure(&self) -> Option<Aabb> {
        self.hull()
    }

    /// Along the tangent: exact slopes are right where they jump upward, too.
    fn below(&self, cell: &Aabb) -> Affine {
        let (center, bend, least) = (cell.center(), self.curving(cell), self.over(cell).lower);
        let radius = cell.radius() * (1.0 + 1e-12);
        // Rounding of the place turns the slope as fast as the distance bends there: any way next to an axis or an edge.
        let here = self.curving(&Aabb::new(center, center));
        let place = center.abs().max(self.hull().map_or(DVec3::ZERO, |hull| hull.min.abs().max(hull.max.abs()))).max_element();
        let turn = (64.0 * f64::EPSILON * place * here.upper.max(-here.lower)).min(2.0) + 1e-14;
        let value = self.value(center) + 0.5 * bend.lower.min(0.0) * radius * radius - turn * radius - 2.0 * self.rounding();
        let tangent = Affine { value, slope: self.slope(center) };
        tangent.or_constant(least, radius)
    }

    fn at(&self, p: DVec3) -> Interval {
        Interval::exact(self.value(p))
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.range(cell).widen(self.rounding())
    }
}

impl<T: Exact> Source for T {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.value(p);
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.slope(p);
        }
        Ok(())
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        self.curving(cell)
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        let bend = self.curving(&block.cell);
        block.residual(block.between(bend, self.rounding()), out);
        if !bend.width().is_finite() {
            let faces = self.faces(&block.cell, block.points).into_iter();
            let mut operands: Vec<Operand> = faces.map(|(values, bend)| Operand::bent(values, bend, self.rounding(), block)).collect();
            if !operands.is_empty() {
                kink::greatest(block, &mut operands, Seam::Sharp, out);
            }
        }
        Ok(())
    }

    fn noise(&self) -> f64 {
        self.rounding()
    }
}
