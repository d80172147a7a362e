//! A set of patches ready to be asked.

use super::bezier::Bezier;
use super::nearest::{Effort, Foot, nearest, rounding};
use super::side::Sided;
use super::tree::Tree;
use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;
use crate::source::balls;

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
            Sides::Closed => Some(Sided::new(patches, accuracy, |p| nearest(&tree, p, accuracy, Effort::Short), run)?),
        };
        Ok(Self { tree, sides, accuracy })
    }

    /// Whether there is an inside.
    pub fn is_closed(&self) -> bool {
        self.sides.is_some()
    }

    /// The nearest point of the patches.
    pub fn foot(&self, p: DVec3) -> DVec3 {
        self.search(p, Effort::Short).point
    }

    fn search(&self, p: DVec3, effort: Effort) -> Foot {
        nearest(&self.tree, p, self.accuracy, effort)
    }

    /// -1 inside, 1 outside or where there is no inside; `None` where that is not certain.
    fn side(&self, p: DVec3, found: Foot) -> Option<f64> {
        self.sides.as_ref().map_or(Some(1.0), |sided| sided.side(p, found, |p| self.search(p, Effort::Short)))
    }

    /// The distance and its best guess, where the side is certain.
    fn answer(&self, p: DVec3, effort: Effort) -> (Interval, Option<f64>) {
        if !p.is_finite() {
            return (Interval::ALL, None);
        }
        let found = self.search(p, effort);
        let size = Interval { lower: found.lower, upper: found.upper };
        match self.side(p, found) {
            Some(side) if side > 0.0 => (size, Some(found.value)),
            Some(_) => (size.negated(), Some(-found.value)),
            None => (Interval::either_side(found.upper), (found.upper <= 4.0 * self.accuracy).then_some(0.0)),
        }
    }

    /// How far values are from distances at most, at points with coordinates as large as that.
    fn off(&self, size: f64) -> f64 {
        self.noise() + 4.0 * rounding(&self.tree, size)
    }
}

/// Where a search ends before bounds meet.
fn open(p: DVec3, bounds: Interval) -> Error {
    Error::invalid(format!(
        "the distance at {p} is only known to be from {} to {}: much of the patches is about as far; take bounds there, or patches \
         that are less like a ball around it",
        bounds.lower, bounds.upper
    ))
}

fn uncertain(p: DVec3) -> Error {
    Error::invalid(format!("the side of {p} next to the patches is not certain; take them unsigned, or part them there"))
}

impl Distance for Patches {
    fn extent(&self) -> Option<Aabb> {
        Some(self.tree.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        self.answer(p, Effort::Short).0
    }
}

impl Source for Patches {
    /// Fails where the side is not certain, next to places where the patches meet themselves; and where they are so much like a
    /// ball around the point that a million pieces do not tell how near they are.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (&p, out) in points.iter().zip(out) {
            let (bounds, value) = self.answer(p, Effort::Whole);
            *out = value.ok_or_else(|| uncertain(p))?;
            // The value lies between both, or is 0 next to the surface.
            if *out != 0.0 && bounds.width() > self.off(p.abs().max_element()) {
                return Err(open(p, bounds));
            }
        }
        Ok(())
    }

    /// Away from the nearest point; on the surface its normal, and nothing where that is not known or distances have no sign.
    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (&p, out) in points.iter().zip(out) {
            let found = self.search(p, Effort::Short);
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

    /// Not known: how near a nearest point is says little of where it lies.
    fn tilt(&self, _: DVec3) -> f64 {
        f64::INFINITY
    }

    /// Values are as near as that, or are none.
    fn slack(&self, cell: &Aabb) -> Interval {
        Interval::around(0.0, self.noise_over(cell))
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

    /// Far away, rounding adds to it.
    fn noise_over(&self, cell: &Aabb) -> f64 {
        self.off(cell.min.abs().max(cell.max.abs()).max_element())
    }
}
