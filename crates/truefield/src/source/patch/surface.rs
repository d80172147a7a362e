//! A set of patches ready to be asked.

use super::bends::Bends;
use super::bezier::Bezier;
use super::nearest::{Foot, nearest};
use super::side::Sided;
use super::tree::{Half, NONE, PART, Tree};
use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;
use crate::source::balls;

/// Halvings of a part that are tried for a whole cell.
const FINER: u32 = 4;

/// Where the way to the nearest point is no more than this many times the accuracy, its direction is not relied on.
const TOUCHING: f64 = 1e5;

/// Sizes whose sixth powers are numbers, as proofs need.
const SMALLEST: f64 = 1e-40;
const LARGEST: f64 = 1e40;

/// What decides sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// The patches close up and are oriented alike, or are refused.
    Closed,
    /// There is no inside; distances are positive.
    Unsigned,
}

/// A set of bicubic Bezier patches, and its distance to 1e-11 of its size.
///
/// A query goes through parts of patches, nearest first. Where the squared distance is convex over a part, as its control
/// numbers prove, Newton's method finds the nearest point and the slope there proves that none is nearer. Of a teapot that takes
/// one to three microseconds, with its side; of a point from which much of the surface is as near, as from an axis of
/// revolution, thousands of parts may be looked at.
///
/// Sides come from triangles: farther from the patches than the triangles are from them, both have the same side; nearer,
/// balls that certainly hold no surface lead away from it.
#[derive(Debug)]
pub struct Patches {
    tree: Tree,
    sides: Option<Sided>,
    accuracy: f64,
}

impl Patches {
    /// Fails where there are no patches, control points are not finite or beyond 1e40, patches smaller than 1e-40, or sides are wanted and the patches do not close up.
    pub fn new(patches: &[Bezier], sides: Sides, run: &Run<'_>) -> Result<Self> {
        if patches.is_empty() {
            return Err(Error::invalid("there are no patches; give an array of shape (n, 4, 4, 3)"));
        }
        if let Some(index) = patches.iter().position(|patch| patch.controls().any(|p| !p.is_finite())) {
            return Err(Error::invalid(format!("patch {index} has control points that are not finite numbers")));
        }
        let tree = Tree::new(patches);
        let across = tree.extent.size().max_element();
        if across > 0.0 && across < SMALLEST || !(tree.size <= LARGEST) {
            let size = across.max(tree.size);
            return Err(Error::invalid(format!("the patches are {size:.1e} large; give them in a unit of about their size")));
        }
        let accuracy = 1e-11 * (tree.extent.diagonal() + tree.size);
        let sides = match sides {
            Sides::Unsigned => None,
            Sides::Closed => Some(Sided::new(patches, accuracy, |p| nearest(&tree, p, accuracy), run)?),
        };
        Ok(Self { tree, sides, accuracy })
    }

    /// Whether there is an inside.
    pub fn is_closed(&self) -> bool {
        self.sides.is_some()
    }

    /// The nearest point of the patches.
    pub fn foot(&self, p: DVec3) -> DVec3 {
        self.search(p).point
    }

    fn search(&self, p: DVec3) -> Foot {
        nearest(&self.tree, p, self.accuracy)
    }

    /// Whether searches from all points of a cell certainly end at once: near it, all parts are convex.
    fn is_simple(&self, cell: &Aabb, reach: f64) -> bool {
        let square = reach * reach * (1.0 + 1e-12);
        let near = |extent: &Aabb| (extent.min - cell.max).max(cell.min - extent.max).max(DVec3::ZERO).length_squared() <= square;
        let (center, spread) = (cell.center(), 0.5 * cell.size() * (1.0 + 1e-12));
        let beyond = (reach + cell.radius()).powi(2) * (1.0 + 1e-12);
        let mut pending = vec![self.tree.root];
        let mut halves: Vec<(Half, u32)> = Vec::new();
        while let Some(node) = pending.pop() {
            for (_, child) in self.tree.nodes[node as usize].each().filter(|(extent, _)| near(extent)) {
                if child & PART == 0 {
                    pending.push(child);
                    continue;
                }
                let part = &self.tree.parts[(child & !PART) as usize];
                if part.oriented.distance_squared(center) > beyond || part.bends.convex(center, spread).is_some() {
                    continue;
                }
                if part.node != NONE {
                    pending.push(part.node);
                } else if part.bends.at_edge(center, spread).is_none() {
                    halves.push((self.tree.half(part), FINER));
                }
            }
            while let Some((whole, levels)) = halves.pop() {
                if levels == 0 {
                    return false;
                }
                for half in whole.halves() {
                    let simple = |bends: &Bends| bends.convex(center, spread).is_some() || bends.at_edge(center, spread).is_some();
                    if near(half.piece.extent()) && !simple(&half.bends()) {
                        halves.push((half, levels - 1));
                    }
                }
            }
        }
        true
    }

    /// -1 inside, 1 outside or where there is no inside; `None` where that is not certain.
    fn side(&self, p: DVec3, found: Foot) -> Option<f64> {
        self.sides.as_ref().map_or(Some(1.0), |sided| sided.side(p, found, |p| self.search(p)))
    }

    /// The distance and its best guess, where the side is certain; and the nearest point.
    fn answer(&self, p: DVec3) -> (Interval, Option<f64>) {
        if !p.is_finite() {
            return (Interval::ALL, None);
        }
        let found = self.search(p);
        let size = Interval { lower: found.lower, upper: found.upper };
        match self.side(p, found) {
            Some(side) if side > 0.0 => (size, Some(found.value)),
            Some(_) => (size.negated(), Some(-found.value)),
            None => (Interval::either_side(found.upper), (found.upper <= 4.0 * self.accuracy).then_some(0.0)),
        }
    }
}

fn uncertain(p: DVec3) -> Error {
    Error::invalid(format!("the side of {p} next to the patches is not certain; take them unsigned, or part them there"))
}

impl Distance for Patches {
    fn extent(&self) -> Option<Aabb> {
        Some(self.tree.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        self.answer(p).0
    }
}

impl Source for Patches {
    /// Fails where the side is not certain: next to places where the patches meet themselves.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (&p, out) in points.iter().zip(out) {
            *out = self.answer(p).1.ok_or_else(|| uncertain(p))?;
        }
        Ok(())
    }

    /// Away from the nearest point; on the surface its normal, and nothing where that is not known or distances have no sign.
    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (&p, out) in points.iter().zip(out) {
            let found = self.search(p);
            *out = if found.upper > TOUCHING * self.accuracy {
                (p - found.point).normalize_or_zero() * self.side(p, found).ok_or_else(|| uncertain(p))?
            } else if self.is_closed() {
                found.place.map_or(DVec3::ZERO, |(patch, place)| self.tree.normal(patch, place))
            } else {
                DVec3::ZERO
            };
        }
        Ok(())
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let center = cell.center();
        let (at, value) = self.answer(center);
        let radius = cell.radius() * (1.0 + 1e-12);
        let reach = at.upper.max(-at.lower) + radius;
        if self.is_simple(cell, reach) {
            return Interval::around(0.0, self.noise());
        }
        // Both change by no more than one moves.
        let (value, moved) = (value.unwrap_or(0.0), 2.0 * radius + self.noise());
        Interval { lower: at.lower - value - moved, upper: at.upper - value + moved }
    }

    /// A distance bends no more than that of a point.
    fn bend(&self, cell: &Aabb) -> Interval {
        let range = self.over(cell);
        if range.lower > 0.0 {
            Interval { lower: f64::NEG_INFINITY, upper: 1.0 / range.lower }
        } else if range.upper < 0.0 {
            Interval { lower: 1.0 / range.upper, upper: f64::INFINITY }
        } else {
            Interval::ALL
        }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        balls::of_distance(self, block, out)
    }

    fn noise(&self) -> f64 {
        4.0 * self.accuracy
    }
}
