//! The distance outside the domain of a field that holds its whole solid: the way to the nearest place of the tree that
//! may hold surface.
//!
//! Best first: a cell can hold surface where its interpolation is zero, give or take its error. An affine function near the
//! interpolation turns that into a layer between two planes, and the way to it is bounded by the way to the planes and by
//! that to the box around the part of the cell between them. Leaves are divided, as if they had children, while
//! that is coarser than their error. From above, the distance is no more than the way to any point and its own.

use std::collections::BinaryHeap;

use super::model::Model;
use super::{AdaptiveField, Cell, Leaf};
use crate::field::Continuity;
use crate::geom::{Aabb, Affine, DVec3, Interval};
use crate::source::mesh::Surface;
use crate::source::waiting::Waiting;

/// Cells looked into for one answer; what is left then is as far as it was bounded.
const LOOKS: usize = 256;

/// The same of a box, over which less can be known.
const LOOKS_OF_BOX: usize = 96;

/// How often a leaf is halved, as if it had children.
const HALVINGS: u32 = 6;

/// Points that are asked about together: a box, or a single point.
#[derive(Clone, Copy)]
pub(super) struct Target {
    pub center: DVec3,
    /// Half of its edges.
    pub half: DVec3,
    /// What is bounded is the distance minus this times the way from the centre.
    pub tilt: DVec3,
}

/// What is known outside the domain.
pub(super) struct Outside {
    /// No more than the distance minus the tilt anywhere in the target, outside the domain.
    pub lower: f64,
    /// No less than the distance at the centre.
    pub upper: f64,
    /// A point near the surface that is about as near to the centre as any.
    pub foot: DVec3,
}

/// A part of the tree that may hold surface.
#[derive(Clone, Copy)]
struct Piece<'a> {
    cell: Cell<'a>,
    part: Aabb,
    halvings: u32,
    /// How much of its bound comes from the cell's error, which no division makes smaller.
    error: f64,
}

impl Target {
    /// One point.
    pub fn point(p: DVec3) -> Self {
        Self { center: p, half: DVec3::ZERO, tilt: DVec3::ZERO }
    }

    /// All points of a box.
    pub fn of(cell: &Aabb, tilt: DVec3) -> Self {
        Self { center: cell.center(), half: 0.5 * cell.size() * (1.0 + 1e-15), tilt }
    }

    /// Least of an affine function, given by its value at the centre and its slope, minus the tilt.
    #[inline]
    fn least(&self, value: f64, slope: DVec3) -> f64 {
        Affine { value, slope: slope - self.tilt }.least(self.half)
    }

    /// No more than the way to a convex set minus the tilt, by the set's nearest point to the centre: the plane through it
    /// keeps the set on its far side.
    fn to_convex(self, nearest: DVec3) -> f64 {
        let way = self.center - nearest;
        let length = way.length();
        // Nor is any way negative.
        let none = self.least(0.0, DVec3::ZERO);
        if length > 0.0 { self.least(length, way / length).max(none) } else { none }
    }
}

/// A search on its way.
struct Search<'a> {
    field: &'a AdaptiveField,
    target: &'a Target,
    best: Outside,
    heap: BinaryHeap<Waiting<Piece<'a>>>,
    found: usize,
}

impl AdaptiveField {
    /// What is known of a target outside the domain, where the domain holds all surface.
    pub(super) fn beyond(&self, target: &Target) -> Outside {
        let start = target.center.clamp(self.root.extent.min, self.root.extent.max);
        let best = Outside { lower: f64::INFINITY, upper: f64::INFINITY, foot: start };
        let mut search = Search { field: self, target, best, heap: BinaryHeap::new(), found: 0 };
        if let Some(cell) = self.find(start) {
            search.offer(start, cell.bounds(start));
        }
        let root = self.root();
        search.add(root, root.extent(), 0);
        search.run()
    }
}

impl<'a> Search<'a> {
    fn run(mut self) -> Outside {
        let fine = 0.25 * self.target.half.length();
        let asked = self.field.accuracy().tolerance;
        let most = if self.target.half == DVec3::ZERO { LOOKS } else { LOOKS_OF_BOX };
        let mut looks = 0;
        while let Some(Waiting { bound, item: Piece { cell, part, halvings, error }, .. }) = self.heap.pop() {
            let gap = self.best.upper - bound;
            looks += 1;
            let settled =
                cell.is_leaf() && (gap <= asked.max(1.25 * error) || halvings == HALVINGS || matches!(cell.leaf(), Leaf::Exact(_)));
            // Parts much smaller than the target tell no more.
            if settled || gap <= 0.0 || looks > most || part.diagonal() < fine {
                self.best.lower = bound;
                break;
            }
            if !cell.is_leaf() {
                for octant in 0..cell.children() {
                    let child = cell.child(octant);
                    self.add(child, child.extent(), 0);
                }
                continue;
            }
            let (division, middle) = (self.field.division(), part.center());
            for octant in 0..division.children() {
                let (mut low, mut high) = (part.min, part.max);
                for axis in 0..division.axes() {
                    let end = if octant >> axis & 1 == 0 { &mut high } else { &mut low };
                    end[axis] = middle[axis];
                }
                self.add(cell, Aabb::new(low, high), halvings + 1);
            }
        }
        // In the middle the tilt is nothing: what holds for all points is not above what holds there.
        self.best.lower = self.best.lower.min(self.best.upper);
        self.best
    }

    /// Lets a part of a cell wait, if it may hold surface.
    fn add(&mut self, cell: Cell<'a>, part: Aabb, halvings: u32) {
        if let Some((bound, error)) = self.look(cell, &part)
            && bound <= self.best.upper
        {
            self.heap.push(Waiting { bound, number: self.found, item: Piece { cell, part, halvings, error } });
            self.found += 1;
        }
    }

    /// A lower bound of the way to surface in a part of a cell, and how much of it is the cell's error; `None` where there is
    /// no surface.
    fn look(&mut self, cell: Cell<'a>, part: &Aabb) -> Option<(f64, f64)> {
        let target = self.target;
        let model = Model::of(&cell, part);
        if !model.range().contains(0.0) {
            return None;
        }
        let (plane, error) = model.affine(part.size());
        // Surface lies where the affine function is between these.
        let (least, most) = (-error.upper, -error.lower);
        let near = layer(part, &plane, least, most)?;
        let corner = target.center.clamp(near.min, near.max);
        let mut bound = target.to_convex(corner);
        if let Leaf::Exact(list) = cell.leaf()
            && let Some(surface) = self.field.surface()
            && let Some((nearest, least)) = nearest_listed(surface, target, list)
        {
            let foot = nearest.clamp(part.min, part.max);
            self.offer(foot, cell.bounds(foot));
            return Some((bound.max(least), 0.0));
        }
        let length = plane.slope.length();
        if length == 0.0 {
            self.offer(corner, model.at(part, corner));
            return Some((bound, f64::INFINITY));
        }
        let (there, unit) = (plane.value + plane.slope.dot(target.center - part.center()), plane.slope / length);
        bound = bound.max(target.least((there - most) / length, unit)).max(target.least((least - there) / length, -unit));
        let foot = target.center - unit * ((there - 0.5 * (least + most)) / length);
        let foot = foot.clamp(near.min, near.max);
        self.offer(foot, model.at(part, foot));
        Some((bound, model.error.width() / length))
    }

    /// Takes a point of the domain and what is known of it: the way by it is no shorter.
    fn offer(&mut self, point: DVec3, known: Interval) {
        let distance = match self.field.continuity() {
            Continuity::Everywhere => known.upper,
            Continuity::ExceptOpenings => known.upper.max(-known.lower),
        };
        let upper = (self.target.center - point).length() + distance;
        if upper < self.best.upper {
            (self.best.upper, self.best.foot) = (upper, point);
        }
    }
}

/// The point of listed triangles that is nearest to the target's centre, and a lower bound of the way to any of them; `None`
/// for no triangles.
pub(super) fn nearest_listed(surface: &Surface, target: &Target, list: &[u32]) -> Option<(DVec3, f64)> {
    let (tree, scale) = (surface.tree(), surface.scale());
    let mut nearest: Option<(f64, DVec3)> = None;
    let mut bound = f64::INFINITY;
    for &triangle in list {
        let point = tree.facet(triangle).nearest(target.center * scale).point / scale;
        bound = bound.min(target.to_convex(point));
        let squared = (target.center - point).length_squared();
        if nearest.is_none_or(|(least, _)| squared < least) {
            nearest = Some((squared, point));
        }
    }
    nearest.map(|(_, point)| (point, bound))
}

/// The box around the part of a box where an affine function, given at its centre, lies between two values; `None` where
/// it does nowhere.
fn layer(part: &Aabb, affine: &Affine, least: f64, most: f64) -> Option<Aabb> {
    let Affine { value, slope } = *affine;
    let (center, half) = (part.center(), 0.5 * part.size());
    let reach = slope.abs() * half;
    let all = reach.element_sum();
    // For rounding: a few ulp of all that is added.
    let slip = 1e-14 * (value.abs() + all + least.abs() + most.abs());
    if value - all > most + slip || value + all < least - slip {
        return None;
    }
    let mut out = *part;
    for axis in 0..3 {
        if slope[axis] == 0.0 {
            continue;
        }
        let others = all - reach[axis] + slip;
        let ends = [(least - value - others) / slope[axis], (most - value + others) / slope[axis]];
        let ends = if slope[axis] < 0.0 { [ends[1], ends[0]] } else { ends };
        out.min[axis] = out.min[axis].max(center[axis] + ends[0]).min(part.max[axis]);
        out.max[axis] = out.max[axis].min(center[axis] + ends[1]).max(out.min[axis]);
    }
    Some(out)
}
