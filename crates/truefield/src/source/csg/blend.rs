//! Two shapes joined without an edge.

use std::sync::Arc;

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::Result;
use crate::geom::{Aabb, Affine, DVec3, Interval};
use crate::source::tangent;

use super::kept::kept;
use super::level;
use super::measure::length;
use crate::source::kink::{self, Operand, Seam};

/// How the edge is filled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlendKind {
    /// A parabola from side to side.
    Polynomial,
    /// An arc: of the blend's radius where the shapes meet at right angles.
    Circular,
}

/// The union of two shapes, smooth within a radius of where they are equally far.
///
/// The value is that of the union, less a bulge that depends on how much farther one shape is than the other and fades
/// with that: (a + b) / 2 - f(a - b), f even, convex, |f'| <= 1/2, so that values change by no more than one moves.
#[derive(Clone)]
pub struct Blend {
    shapes: [Arc<dyn Source>; 2],
    radius: f64,
    kind: BlendKind,
}

impl Blend {
    /// The blend of two shapes; beyond `radius` of difference they are as they were.
    pub fn new(shapes: [&Arc<dyn Source>; 2], radius: f64, kind: BlendKind) -> Result<Self> {
        Ok(Self { shapes: shapes.map(kept), radius: length("radius", radius)?, kind })
    }

    /// f(m), f'(m).
    fn fill(&self, difference: f64) -> (f64, f64) {
        let (m, r) = (difference.abs(), self.radius);
        let (value, slope) = if m >= r {
            (0.5 * m, 0.5)
        } else {
            match self.kind {
                BlendKind::Polynomial => (0.25 * (m * m / r + r), 0.5 * m / r),
                BlendKind::Circular => {
                    let root = (0.5 * r * r - 0.25 * m * m).sqrt();
                    (r - root, 0.25 * m / root)
                }
            }
        };
        (value, slope.copysign(difference))
    }

    /// What is filled in where the difference of the shapes' values is at least so much.
    fn bulge(&self, difference: f64) -> f64 {
        let m = difference.max(0.0);
        if m >= self.radius { 0.0 } else { self.fill(m).0 - 0.5 * m }
    }

    /// The greatest curvature that filling adds: f'' times the square of how fast the difference can change.
    fn sharpest(&self) -> f64 {
        match self.kind {
            BlendKind::Polynomial => 2.0 / self.radius,
            BlendKind::Circular => 4.0 / self.radius,
        }
    }

    fn pairs(&self, points: &[DVec3]) -> Result<(Vec<f64>, Vec<f64>)> {
        let (mut a, mut b) = (vec![0.0; points.len()], vec![0.0; points.len()]);
        self.shapes[0].values(points, &mut a)?;
        self.shapes[1].values(points, &mut b)?;
        Ok((a, b))
    }

    /// The values of both at the middle of a cell.
    fn middle(&self, cell: &Aabb) -> Option<[f64; 2]> {
        Some([level::value(&*self.shapes[0], cell.center())?, level::value(&*self.shapes[1], cell.center())?])
    }

    /// Half of how far the difference can move in a cell.
    fn reach(&self, cell: &Aabb) -> f64 {
        cell.radius() * (1.0 + 1e-9) + self.noise()
    }
}

impl Distance for Blend {
    fn extent(&self) -> Option<Aabb> {
        let both = self.shapes[0].extent()?.union(self.shapes[1].extent()?);
        Some(both.grow(self.bulge(0.0)))
    }

    fn below(&self, cell: &Aabb) -> Affine {
        tangent::below(self, cell)
    }

    fn at(&self, p: DVec3) -> Interval {
        let level = level::at(self, p, None);
        if level.lower < 0.0 {
            return level;
        }
        // Outside, what was there before is still there.
        let before = self.shapes[0].at(p).upper.min(self.shapes[1].at(p).upper);
        Interval { lower: level.lower, upper: level.upper.min(before).max(level.lower) }
    }
}

impl Source for Blend {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        let (a, b) = self.pairs(points)?;
        for (out, (a, b)) in out.iter_mut().zip(a.into_iter().zip(b)) {
            *out = a.min(b) - self.bulge((a - b).abs());
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        let (a, b) = self.pairs(points)?;
        let mut second = vec![DVec3::ZERO; points.len()];
        self.shapes[0].gradients(points, out)?;
        self.shapes[1].gradients(points, &mut second)?;
        for (i, out) in out.iter_mut().enumerate() {
            let share = self.fill(a[i] - b[i]).1;
            *out = *out * (0.5 - share) + second[i] * (0.5 + share);
        }
        Ok(())
    }

    fn tilt(&self, p: DVec3) -> f64 {
        // Noise moves the share of each, which changes no faster than what filling adds bends.
        self.shapes[0].tilt(p).max(self.shapes[1].tilt(p)) + self.sharpest() * self.noise()
    }

    /// Outside, from the blend's value to that of the union, which the blend contains.
    fn slack(&self, cell: &Aabb) -> Interval {
        let Some([a, b]) = self.middle(cell) else { return Interval::ALL };
        let (slack, reach) = ([self.shapes[0].slack(cell), self.shapes[1].slack(cell)], self.reach(cell));
        let before = slack[0].upper.max(slack[1].upper);
        let bulge = self.bulge((a - b).abs() - 2.0 * reach);
        let upper = if before.is_finite() { bulge + before } else { f64::INFINITY };
        if a.min(b) - self.bulge((a - b).abs()) > reach {
            return Interval { lower: 0.0, upper };
        }
        // Off the blend the gradient is that of one of the shapes.
        let unit = |cell: &Aabb| {
            let apart = self.middle(cell).is_some_and(|[a, b]| (a - b).abs() - 2.0 * self.reach(cell) >= self.radius);
            apart && self.shapes.iter().all(|shape| shape.slack(cell) == Interval::exact(0.0))
        };
        let level = level::slack(self, cell, None, unit);
        Interval { lower: level.lower, upper: level.upper.min(upper).max(level.lower) }
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        let Some([a, b]) = self.middle(cell) else { return Interval::ALL };
        if (a - b).abs() - 2.0 * self.reach(cell) >= self.radius {
            return self.shapes[usize::from(b < a)].bend(cell);
        }
        let both = self.shapes[0].bend(cell).hull(self.shapes[1].bend(cell));
        Interval { lower: both.lower - self.sharpest(), upper: both.upper }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        block.residual(block.between(self.bend(&block.cell), self.noise()), out);
        let operands = [Operand::of(&*self.shapes[0], block)?, Operand::of(&*self.shapes[1], block)?];
        kink::least(block, &operands, Seam::Smooth(0.25 * self.sharpest()), out);
        Ok(())
    }

    fn is_flat(&self) -> bool {
        self.shapes.iter().all(|shape| shape.is_flat())
    }

    fn sided(&self) -> bool {
        self.shapes.iter().all(|shape| shape.sided())
    }

    fn noise(&self) -> f64 {
        self.shapes[0].noise().max(self.shapes[1].noise()) + 4.0 * f64::EPSILON * self.radius
    }
}
