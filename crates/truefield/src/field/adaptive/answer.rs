//! What a field answers as a [`Distance`], inside its domain and outside.

use glam::BVec3;

use super::beyond::{Target, nearest_listed};
use super::model::Model;
use super::page::ListSide;
use super::{AdaptiveField, Cell, Coverage, Division, Leaf};
use crate::distance::Distance;
use crate::field::Continuity;
use crate::geom::{Aabb, Affine, DVec3, Interval};
use crate::source::mesh::Surface;

/// A leaf whose error is so much wider than the tolerance leaves the distance open.
const VAGUE: f64 = 8.0;

/// Cells that are smaller than a box by this tell no more about it than their parents.
const FINE: f64 = 0.25;

impl Distance for AdaptiveField {
    fn extent(&self) -> Option<Aabb> {
        Some(self.root.extent)
    }

    fn enclosure(&self) -> Option<Aabb> {
        (self.coverage == Coverage::Whole && self.continuity == Continuity::Everywhere).then_some(self.root.extent)
    }

    /// From the leaf's error. Outside the domain, of a field that holds its whole solid, from the nearest place that may
    /// be surface; else from the nearest point of the domain.
    fn at(&self, p: DVec3) -> Interval {
        let level = self.root.flattened(p);
        let inside = level.clamp(self.root.extent.min, self.root.extent.max);
        let Some(cell) = self.find(inside) else { return Interval::ALL };
        if inside == level {
            let known = cell.bounds(inside);
            return if matches!(cell.leaf(), Leaf::Exact(_)) { known } else { known.widen(self.rounding(p)) };
        }
        if let Some(surface) = self.unedited() {
            return surface.at(p);
        }
        match self.coverage {
            Coverage::Whole => {
                let known = self.beyond(&Target::point(level));
                let rounding = self.rounding(p);
                let upper = known.upper + rounding;
                let lower = (known.lower - rounding).clamp(0.0, upper.max(0.0));
                self.sided(Interval { lower, upper: upper.max(lower) })
            }
            Coverage::Unknown => {
                let known = cell.bounds(inside).widen(self.rounding(p));
                self.sided(known.widen((level - inside).length() * (1.0 + 1e-12)))
            }
        }
    }

    fn over(&self, cell: &Aabb) -> Interval {
        let cell = &self.flat(cell);
        let inside = self.holds(cell);
        if !inside && let Some(surface) = self.unedited() {
            return surface.over(cell);
        }
        let center = self.at(cell.center()).widen(cell.radius() * (1.0 + 1e-15));
        if !inside {
            let mut known = center;
            if self.coverage == Coverage::Whole && self.continuity == Continuity::Everywhere {
                known.lower = known.lower.max(self.least(cell, DVec3::ZERO)).min(known.upper);
            }
            return self.sided(known);
        }
        let mut range: Option<Interval> = None;
        self.each_in(cell, |at, part| {
            let part = at.over_part(part);
            range = Some(range.map_or(part, |known| known.hull(part)));
        });
        let range = range.unwrap_or(Interval::ALL).widen(self.rounding(cell.max));
        if self.continuity == Continuity::Everywhere { range.intersection(center) } else { range }
    }

    /// Of the slope that the distance has in the middle.
    fn below(&self, cell: &Aabb) -> Affine {
        let cell = &self.flat(cell);
        let known = match self.coverage {
            Coverage::Whole => self.continuity == Continuity::Everywhere,
            Coverage::Unknown => self.holds(cell),
        };
        if !known {
            return Affine::constant(self.over(cell).lower);
        }
        let center = cell.center();
        let by_search = || (center - self.beyond(&Target::point(center)).foot).normalize_or_zero();
        let Some(leaf) = self.find(center) else {
            let slope = by_search();
            return Affine { value: self.least(cell, slope), slope };
        };
        let slope = leaf.gradient(center).clamp_length_max(1.0);
        let known = Affine { value: self.least(cell, slope), slope };
        // Where values alone leave the distance open, the way to the surface may tell more.
        let open = leaf.error().width() > VAGUE * self.accuracy.tolerance;
        if self.coverage == Coverage::Whole && open && self.over(cell).lower > 0.0 {
            let slope = by_search();
            let found = Affine { value: self.beyond(&Target::of(cell, slope)).lower - self.rounding(center), slope };
            if found.value > known.value {
                return found;
            }
        }
        known
    }
}

impl AdaptiveField {
    /// The mesh, where it still is what the field is of.
    fn unedited(&self) -> Option<&Surface> {
        self.surface.as_deref().filter(|_| self.edits.list().is_empty())
    }

    /// What is known outside the domain, where the sign may jump between the domain and there.
    fn sided(&self, known: Interval) -> Interval {
        match self.continuity {
            Continuity::Everywhere => known,
            Continuity::ExceptOpenings => Interval::either_side(known.upper.max(-known.lower)),
        }
    }

    fn holds(&self, cell: &Aabb) -> bool {
        self.root.extent.contains(cell.min) && self.root.extent.contains(cell.max)
    }

    /// A box, or where columns are all one its cross-section.
    fn flat(&self, cell: &Aabb) -> Aabb {
        match self.root.division {
            Division::Octree => *cell,
            Division::Quadtree => {
                let z = self.root.flattened(cell.center()).z;
                Aabb::new(cell.min.with_z(z), cell.max.with_z(z))
            }
        }
    }

    /// Calls `visit` with cells that cover a box, and their parts of it; none is much finer than the box.
    fn each_in<'a>(&'a self, cell: &Aabb, mut visit: impl FnMut(Cell<'a>, &Aabb)) {
        let fine = FINE * cell.size().max_element();
        // Those that only touch the box know nothing of it that others do not, where no side jumps between them.
        let thick = match self.continuity {
            Continuity::Everywhere => cell.size().cmpgt(DVec3::ZERO),
            Continuity::ExceptOpenings => BVec3::FALSE,
        };
        self.walk(&mut |at| {
            let extent = at.extent();
            let part = Aabb::new(cell.min.max(extent.min), cell.max.min(extent.max));
            if part.min.cmpgt(part.max).any() || (part.min.cmpeq(part.max) & thick).any() {
                return false;
            }
            let coarse = !at.is_leaf() && extent.size().x > fine;
            if !coarse {
                visit(at, &part);
            }
            coarse
        });
    }

    /// No more than the distance minus `tilt` times the way from the middle, anywhere in a box: of a field that
    /// holds the box, or its whole solid.
    fn least(&self, cell: &Aabb, tilt: DVec3) -> f64 {
        let target = Target::of(cell, tilt);
        let mut least = if self.holds(cell) { f64::INFINITY } else { self.beyond(&target).lower };
        self.each_in(cell, |at, part| {
            let model = Model::of(&at, part);
            let tilted = |corner: usize| model.corners[corner] - tilt.dot(part.corner(corner) - target.center);
            let mut lower = (0..8).map(tilted).fold(f64::INFINITY, f64::min) + model.error.lower;
            if let (Leaf::Exact(list), ListSide::Outside, true) = (at.leaf(), at.list_side(), at.is_fresh())
                && let Some(surface) = &self.surface
                && let Some((_, bound)) = nearest_listed(surface, &target, list)
            {
                lower = lower.max(bound);
            }
            least = least.min(lower);
        });
        least - self.rounding(cell.min.abs().max(cell.max.abs()))
    }
}
