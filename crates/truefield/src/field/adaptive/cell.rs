//! One cell of a tree: a cursor.

use super::page::{Kind, ListSide, Page, Record, Samples};
use super::{AdaptiveField, Division, cubic};
use crate::bvh::Candidate;
use crate::field::sampled::{rounded_down, rounded_up};
use crate::geom::{Aabb, DVec3, Interval};
use crate::source::mesh::Side;

/// A cell of an [`AdaptiveField`], cheap to copy.
#[derive(Clone, Copy, Debug)]
pub struct Cell<'a> {
    pub(super) field: &'a AdaptiveField,
    pub(super) page: &'a Page,
    pub(super) node: usize,
    pub(super) depth: u32,
    /// Cells of its size before it along each axis.
    pub(super) index: [u32; 3],
}

/// How a leaf answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Leaf<'a> {
    /// Trilinear interpolation of the corners.
    Linear,
    /// Tricubic interpolation of samples at thirds of the edges, x slowest and z fastest.
    Cubic(&'a Samples),
    /// The distance itself: every triangle of the field's surface that can be nearest in the cell; all where empty.
    Exact(&'a [u32]),
}

impl<'a> Cell<'a> {
    /// The root of a page, where `cell` leads there.
    pub(super) fn enter(self) -> Self {
        match self.page.words[self.node].kind() {
            Kind::Portal(number) => Self { page: &self.field.pages[number as usize], node: 0, ..self },
            _ => self,
        }
    }

    /// The space it stands for.
    pub fn extent(&self) -> Aabb {
        self.field.root.cell(self.depth, self.index)
    }

    /// 0 for the root.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// How many cells of its size lie before it along x, y and z.
    pub fn index(&self) -> [u32; 3] {
        self.index
    }

    /// Whether it has no children.
    pub fn is_leaf(&self) -> bool {
        !matches!(self.page.words[self.node].kind(), Kind::Branch(_))
    }

    /// 8 or, in a quadtree, 4; none for a leaf.
    pub fn children(&self) -> usize {
        if self.is_leaf() { 0 } else { self.field.root.division.children() }
    }

    /// A child: bit 0 of its number picks high x, bit 1 high y, bit 2 high z. A leaf is its own child.
    pub fn child(&self, octant: usize) -> Self {
        let Kind::Branch(first) = self.page.words[self.node].kind() else { return *self };
        let index = self.field.root.division.child(self.index, octant);
        Self { node: first as usize + octant, depth: self.depth + 1, index, ..*self }.enter()
    }

    /// What is stored of it.
    pub fn record(&self) -> &'a Record {
        &self.page.records[self.node]
    }

    /// Values at the corners, numbered like children; inner cells have them too.
    pub fn corners(&self) -> &'a [f32; 8] {
        &self.record().corners
    }

    /// Contains the distance minus what the record says, everywhere in the cell: the interpolated corners, in inner cells
    /// and exact leaves too, or the tricubic interpolation in a leaf that has it. The distance is that of the shape after
    /// the last edit that reached the cell; [`Cell::bounds`] and [`Cell::over`] know of the others too.
    pub fn error(&self) -> Interval {
        self.record().error()
    }

    /// How it answers; inner cells by their corners.
    pub fn leaf(&self) -> Leaf<'a> {
        match self.page.words[self.node].kind() {
            Kind::Cubic(number) => Leaf::Cubic(&self.page.cubics[number as usize]),
            Kind::Exact(number) => Leaf::Exact(self.page.lists.get(number as usize).1),
            Kind::Branch(_) | Kind::Linear | Kind::Portal(_) => Leaf::Linear,
        }
    }

    /// The side of all points of an exact leaf.
    pub(crate) fn list_side(&self) -> ListSide {
        match self.page.words[self.node].kind() {
            Kind::Exact(number) => self.page.lists.get(number as usize).0,
            _ => ListSide::Asked,
        }
    }

    /// Coordinates from 0 to 1 of a point of the cell.
    #[inline]
    pub fn local(&self, p: DVec3) -> DVec3 {
        let Aabb { min, max } = self.extent();
        // Rounding may carry a point of a face beyond it.
        ((p - min) / (max - min)).clamp(DVec3::ZERO, DVec3::ONE)
    }

    /// What the field says at a point of the cell.
    #[inline]
    pub fn value(&self, p: DVec3) -> f64 {
        match self.leaf() {
            Leaf::Linear => self.record().value(self.local(p)),
            Leaf::Cubic(samples) => cubic::value(samples, self.local(p)),
            Leaf::Exact(_) => self.exact_value(p, self.nearest(p)),
        }
    }

    /// What an exact leaf says at a point whose nearest triangle is known.
    pub(super) fn exact_value(&self, p: DVec3, nearest: Candidate) -> f64 {
        self.exact(p, nearest).map_or(f64::NAN, |(distance, side)| side.sign() * distance)
    }

    /// The bounds of an exact leaf at a point whose nearest triangle is known.
    pub(super) fn exact_bounds(&self, p: DVec3, nearest: Candidate) -> Interval {
        let known = self.exact(p, nearest).map_or(Interval::ALL, |(distance, side)| {
            if side.is_certain() { Interval::exact(side.sign() * distance) } else { Interval::either_side(distance) }
        });
        self.age(known, &Aabb::new(p, p))
    }

    /// Whether it is an exact leaf without a list: its points ask all triangles.
    pub(super) fn asks_all(&self) -> bool {
        matches!(self.leaf(), Leaf::Exact([]))
    }

    /// The derivative of [`Cell::value`]; its length is near 1.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        match self.leaf() {
            Leaf::Linear => self.record().slopes(self.local(p)) / self.extent().size(),
            Leaf::Cubic(samples) => cubic::gradient(samples, self.local(p)) / self.extent().size(),
            Leaf::Exact(_) => {
                self.field.surface.as_ref().map_or(DVec3::ZERO, |surface| surface.describe(p * surface.scale(), self.nearest(p)).normal)
            }
        }
    }

    /// Contains the true distance at a point of the cell.
    pub fn bounds(&self, p: DVec3) -> Interval {
        let known = match self.leaf() {
            Leaf::Exact(_) => return self.exact_bounds(p, self.nearest(p)),
            // What a cubic leaf's record says of its interpolation is not what its corners say.
            Leaf::Cubic(samples) => self.error().plus(Interval::exact(cubic::value(samples, self.local(p)))),
            Leaf::Linear => self.error().plus(Interval::exact(self.record().value(self.local(p)))),
        };
        self.age(known, &Aabb::new(p, p))
    }

    /// Contains the true distance at every point of the cell.
    pub fn over(&self) -> Interval {
        self.over_part(&self.extent())
    }

    /// Contains the true distance at every point of the part of the cell that lies in `part`.
    pub(crate) fn over_part(&self, part: &Aabb) -> Interval {
        self.age(self.error().plus(self.said_over(part)), part)
    }

    /// Contains what the record says at every point of `part`; of an exact leaf and an inner cell, what the corners say.
    pub(crate) fn said_over(&self, part: &Aabb) -> Interval {
        match self.leaf() {
            Leaf::Cubic(samples) => {
                let (lower, upper) = cubic::range(samples);
                Interval { lower, upper }
            }
            Leaf::Linear | Leaf::Exact(_) => {
                let cut = Aabb::new(self.local(part.min), self.local(part.max));
                // Along each axis the interpolation is linear: its ends lie at corners of the cut.
                let ends = (0..8).map(|corner| Interval::exact(self.record().value(cut.corner(corner))));
                ends.reduce(Interval::hull).unwrap_or(Interval::ALL)
            }
        }
    }

    /// Contains what the leaves of the cell say at every point of `part`.
    pub(crate) fn values_over(&self, part: &Aabb) -> Interval {
        let said = self.said_over(part);
        match self.leaf() {
            // The error of a branch contains those of its leaves.
            _ if !self.is_leaf() => said.widen(self.error().width()),
            Leaf::Exact(_) => said.plus(self.error()),
            Leaf::Linear | Leaf::Cubic(_) => said,
        }
    }

    /// Contains the distance minus what the leaf says at every point of `part`, after all edits.
    pub(crate) fn error_over(&self, part: &Aabb) -> Interval {
        let (sampled, said) = match self.leaf() {
            Leaf::Exact(_) => (Interval::exact(0.0), self.values_over(part)),
            Leaf::Linear | Leaf::Cubic(_) => (self.error(), self.values_over(part)),
        };
        let before = said.plus(sampled);
        aged_error(sampled, said, before, self.age(before, part))
    }

    /// A bound of the slope of what a leaf says.
    pub(crate) fn steepest(&self) -> f64 {
        match self.leaf() {
            Leaf::Linear => self.record().steepest(self.extent().size()),
            Leaf::Cubic(samples) => (cubic::steepest(samples) / self.extent().size()).length(),
            Leaf::Exact(_) => 1.0,
        }
    }

    /// What holds in a part of the cell after all edits, where `known` held when the cell was sampled.
    #[inline]
    pub(super) fn age(&self, known: Interval, part: &Aabb) -> Interval {
        if self.field.edits.list().is_empty() { known } else { self.field.edits.age(known, part, &self.extent()) }
    }

    /// Whether nothing was edited, so that nothing has to be aged.
    pub(super) fn is_fresh(&self) -> bool {
        self.field.edits.list().is_empty()
    }

    /// Unsigned distance and side by the nearest triangle of an exact leaf's point; `None` where the field has no surface.
    fn exact(&self, p: DVec3, found: Candidate) -> Option<(f64, Side)> {
        let surface = self.field.surface.as_ref()?;
        let scale = surface.scale();
        let side = match self.list_side() {
            ListSide::Inside => Side::Inside,
            ListSide::Outside => Side::Outside,
            ListSide::Asked => surface.side(p * scale, &surface.tree().facet(found.triangle).nearest(p * scale), found.triangle),
        };
        Some((found.distance_squared.sqrt() / scale, side))
    }

    /// The nearest triangle of an exact leaf, in the surface's units.
    fn nearest(&self, p: DVec3) -> Candidate {
        let (Some(surface), Leaf::Exact(list)) = (&self.field.surface, self.leaf()) else { return Candidate::within(f64::INFINITY) };
        let (tree, at) = (surface.tree(), p * surface.scale());
        if list.is_empty() {
            // The corners tell how far to look.
            let known = self.error().plus(Interval::exact(self.record().value(self.local(p)))).widen(self.field.rounding(p));
            let within = known.upper.max(-known.lower) * surface.scale() * (1.0 + 1e-9);
            let found = tree.nearest(at, Candidate::within(within));
            return if found.found() { found } else { tree.nearest(at, Candidate::within(f64::INFINITY)) };
        }
        let mut best = Candidate::within(f64::INFINITY);
        for &triangle in list {
            best.offer(tree.facet(triangle).distance_squared(at), triangle);
        }
        best
    }
}

/// The error after edits, from that before, what is said, and what is known of the distance before and after.
pub(crate) fn aged_error(error: Interval, said: Interval, before: Interval, after: Interval) -> Interval {
    Interval {
        lower: if after.lower < before.lower { error.lower.min(after.lower - said.upper) } else { error.lower },
        upper: if after.upper > before.upper { error.upper.max(after.upper - said.lower) } else { error.upper },
    }
}

impl Record {
    /// From corners and an error in double precision, which is rounded outward.
    ///
    /// The error takes in 0, so that what is said lies between its own bounds, however corners are rounded. One that holds
    /// nothing, of claims that contradict each other, stays what it is.
    pub fn new(corners: [f32; 8], error: Interval) -> Self {
        let error = if error.lower <= error.upper { error.hull(Interval::exact(0.0)) } else { error };
        Self { corners, lower: rounded_down(error.lower), upper: rounded_up(error.upper) }
    }
}

/// Where a tree lies and how its cells are divided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// The root cell.
    pub extent: Aabb,
    /// Into how many parts.
    pub division: Division,
}

impl Root {
    /// A node so many of the `steps` along an edge of a cell, and the same wherever it is a node: rounding once.
    #[inline]
    pub(crate) fn coordinate(&self, axis: usize, depth: u32, index: u32, step: u32, steps: u32) -> f64 {
        let Aabb { min, max } = self.extent;
        if self.division == Division::Quadtree && axis == 2 {
            return if step == 0 { min.z } else { max.z };
        }
        let cells = f64::from(depth).exp2();
        min[axis] + (max[axis] - min[axis]) * ((f64::from(index) * f64::from(steps) + f64::from(step)) / (cells * f64::from(steps)))
    }

    /// A cell by its depth and index: the same lattice point has the same coordinates, whatever cell it is a corner of.
    #[inline]
    pub(crate) fn cell(&self, depth: u32, index: [u32; 3]) -> Aabb {
        let at = |axis: usize, step: u32| self.coordinate(axis, depth, index[axis], step, 1);
        Aabb::new(DVec3::new(at(0, 0), at(1, 0), at(2, 0)), DVec3::new(at(0, 1), at(1, 1), at(2, 1)))
    }
}
