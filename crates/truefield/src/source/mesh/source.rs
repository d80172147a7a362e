//! A mesh as a source of fields: its values are its signed distances.

use super::Surface;
use crate::bvh::Candidate;
use crate::distance::{SampleBlock, Source};
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;
use crate::source::balls;

/// Rounding of a distance, of the largest coordinate.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

impl Source for Surface {
    /// Signed distances, by the better guess where the side is doubtful: there, and only there, they may jump.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        out.copy_from_slice(&self.distances(points, &Run::with_threads(1))?);
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (out, nearest) in out.iter_mut().zip(self.nearest_many(points, &Run::with_threads(1))?) {
            *out = nearest.normal;
        }
        Ok(())
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        match self.ball(cell) {
            Ball { certain: true, .. } => Interval::exact(0.0),
            // Either may be the distance or its negative.
            Ball { distance, radius, .. } => Interval::either_side(2.0 * (distance + radius)),
        }
    }

    /// Unsigned distances bend upward by at most one over the least of them, and any valley may lie between two triangles.
    fn bend(&self, cell: &Aabb) -> Interval {
        let Ball { distance, radius, certain, inside } = self.ball(cell);
        let least = distance - radius;
        if !certain || !(least > 0.0) {
            return Interval::ALL;
        }
        let most = (1.0 + 1e-9) / least;
        if inside { Interval { lower: -most, upper: f64::INFINITY } } else { Interval { lower: f64::NEG_INFINITY, upper: most } }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        if self.side_changes_at_surface_only() {
            return balls::of_distance(self, block, out);
        }
        // Through an opening the side may jump on the way to a far sample.
        block.residual(block.between(self.bend(&block.cell), self.noise()), out);
        Ok(())
    }

    fn sided(&self) -> bool {
        self.side_changes_at_surface_only() && self.signs.blur() == 0.0
    }

    fn noise(&self) -> f64 {
        let extent = self.mesh.extent();
        ROUNDING * extent.min.abs().max(extent.max.abs()).max_element()
    }
}

/// What is known of the ball around a cell, in model units.
struct Ball {
    /// From the centre to the surface, unsigned.
    distance: f64,
    radius: f64,
    /// Whether every side in it is decided.
    certain: bool,
    /// The side of the centre.
    inside: bool,
}

impl Surface {
    fn ball(&self, cell: &Aabb) -> Ball {
        let (center, radius) = (cell.center() * self.scale, cell.radius() * self.scale * (1.0 + 1e-12));
        // Corners and centre are rounded, far from the origin by more than that.
        let radius = radius + ROUNDING * (self.tree.radius + self.tree.center.abs().max_element() + center.abs().max_element());
        let found = self.tree.nearest(center, Candidate::within(f64::INFINITY));
        let foot = self.tree.facet(found.triangle).nearest(center);
        let distance = foot.distance_squared.sqrt();
        let side = self.side(center, &foot, found.triangle);
        let clear = distance > radius;
        let certain = if self.side_changes_at_surface_only() {
            // Off the surface the side of the centre holds; across it only joined vertices leave doubt.
            if clear { side.is_certain() } else { self.signs.blur() == 0.0 }
        } else {
            clear && self.side_of_ball(center, &foot, found.triangle, radius).is_some()
        };
        Ball { distance: distance / self.scale, radius: radius / self.scale, certain, inside: side.sign() < 0.0 }
    }
}
