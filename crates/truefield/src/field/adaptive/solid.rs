//! A field as a shape: the tool of an edit, a part of a tree of shapes, or what another field is made of.

use std::sync::Arc;

use super::{AdaptiveField, Cell, Coverage, Division, Leaf};
use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::field::Continuity;
use crate::geom::{Aabb, Affine, DVec3, Interval};

/// Leaves of a block up to which their borders are compared.
const FEW: usize = 32;

/// The solid that a field holds.
///
/// Its value is what the field says, and the slack the errors of its leaves. Outside the domain the value is positive and
/// less than the distance, as that of a difference is.
#[derive(Clone, Debug)]
pub struct Solid {
    field: Arc<AdaptiveField>,
    extent: Aabb,
    noise: f64,
}

impl Solid {
    /// Of a field that knows all of its solid.
    pub fn new(field: Arc<AdaptiveField>) -> Result<Self> {
        if field.continuity() == Continuity::ExceptOpenings {
            return Err(Error::invalid("the field is of a mesh with openings, which has no definite inside; close the mesh first"));
        }
        if field.division() == Division::Quadtree {
            return Err(Error::invalid("the field is one of columns, the same at every height; give the polygon that it is of"));
        }
        if field.coverage() != Coverage::Whole {
            return Err(Error::invalid(
                "the field may not hold all of its solid, which reaches beyond the domain or is not known not to; give it a larger domain",
            ));
        }
        let (mut extent, mut noise) = (Aabb::EMPTY, 0.0f64);
        field.walk(&mut |cell| {
            if cell.is_leaf() {
                let whole = cell.extent();
                let slack = cell.error_over(&whole);
                noise = noise.max(slack.upper).max(-slack.lower);
                if cell.over().lower <= 0.0 {
                    extent = extent.union(whole);
                }
            }
            true
        });
        if extent == Aabb::EMPTY {
            return Err(Error::invalid("the field holds no solid: it is positive everywhere"));
        }
        Ok(Self { field, extent, noise })
    }

    /// The field.
    pub fn field(&self) -> &AdaptiveField {
        &self.field
    }

    /// What the field says; outside the domain, where nothing of the solid is, a number that grows with the way to it.
    ///
    /// That is the longer side of a right angle with the nearest value of the domain and the way to it: it changes by no
    /// more than one moves if the field does not.
    fn extended(&self, p: DVec3) -> f64 {
        let inside = self.nearest_inside(p);
        let value = self.field.interpolate(inside).unwrap_or(f64::NAN);
        if inside == p { value } else { value.max(0.0).hypot((p - inside).length()) }
    }

    fn nearest_inside(&self, p: DVec3) -> DVec3 {
        p.clamp(self.field.root.extent.min, self.field.root.extent.max)
    }

    /// Whether a box is a part of the domain.
    fn holds(&self, cell: &Aabb) -> bool {
        self.field.root.extent.contains(cell.min) && self.field.root.extent.contains(cell.max)
    }

    /// The leaves that touch a box of the domain, while they are no more than some.
    fn leaves_of(&self, part: &Aabb, most: usize) -> Option<Vec<Cell<'_>>> {
        let (mut found, mut stack) = (Vec::new(), vec![self.field.root()]);
        while let Some(cell) = stack.pop() {
            let extent = cell.extent();
            if !extent.overlaps(part) {
                continue;
            }
            if cell.is_leaf() {
                found.push(cell);
                if found.len() > most {
                    return None;
                }
            }
            stack.extend((0..cell.children()).map(|octant| cell.child(octant)));
        }
        Some(found)
    }

    /// Between nodes of a block, what the field says minus its interpolation: a way to a node crosses each leaf once, climbs
    /// no more than the leaf does, and jumps where it leaves one for another.
    fn between(&self, block: &SampleBlock<'_>) -> Option<Interval> {
        let cell = &block.cell;
        if !self.holds(cell) {
            return None;
        }
        // Those that only touch it say what the nodes of a face are.
        let leaves = self.leaves_of(cell, FEW)?;
        if leaves.iter().any(|leaf| matches!(leaf.leaf(), Leaf::Exact(_))) {
            return None;
        }
        let mut jump = 0.0f64;
        for (number, a) in leaves.iter().enumerate() {
            for b in &leaves[..number] {
                jump = jump.max(apart(a, b)?);
            }
        }
        let rounding = self.field.rounding(cell.max);
        let alone =
            leaves.iter().any(|leaf| leaf.leaf() == Leaf::Linear && leaf.extent().contains(cell.min) && leaf.extent().contains(cell.max));
        if alone && block.is_upright() {
            return Some(Interval::either_side(2.0 * jump + rounding));
        }
        let steepest = leaves.iter().map(|leaf| leaf.steepest()).fold(0.0, f64::max);
        let jumps = jump * leaves.len() as f64;
        Some(Interval::either_side((0.5 * steepest * block.square.sqrt() + jumps) * (1.0 + 1e-9) + rounding))
    }
}

/// No less than how far two leaves differ where they touch; `None` where that is not known. Both are linear along the edges
/// of what they share, so that its corners tell.
fn apart(a: &Cell<'_>, b: &Cell<'_>) -> Option<f64> {
    let (one, other) = (a.extent(), b.extent());
    let shared = Aabb { min: one.min.max(other.min), max: one.max.min(other.max) };
    if shared.min.cmpgt(shared.max).any() {
        return Some(0.0);
    }
    let linear = matches!((a.leaf(), b.leaf()), (Leaf::Linear, Leaf::Linear));
    linear.then(|| (0..8).map(|corner| shared.corner(corner)).map(|p| (a.value(p) - b.value(p)).abs()).fold(0.0, f64::max))
}

impl Distance for Solid {
    fn extent(&self) -> Option<Aabb> {
        Some(self.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        self.field.at(p)
    }

    fn over(&self, cell: &Aabb) -> Interval {
        self.field.over(cell)
    }

    fn below(&self, cell: &Aabb) -> Affine {
        self.field.below(cell)
    }

    fn enclosure(&self) -> Option<Aabb> {
        self.field.enclosure()
    }
}

impl Source for Solid {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.extended(p);
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            let inside = self.nearest_inside(p);
            let (value, slope) = self.field.find(inside).map_or((f64::NAN, DVec3::NAN), |cell| (cell.value(inside), cell.gradient(inside)));
            let away = p - inside;
            *out = if away == DVec3::ZERO {
                slope
            } else {
                // Along a face the nearest value changes, across it the way.
                let along = DVec3::select(away.cmpeq(DVec3::ZERO), slope, DVec3::ZERO);
                (along * value.max(0.0) + away) / value.max(0.0).hypot(away.length())
            };
        }
        Ok(())
    }

    /// The errors of all leaves there; outside the domain from what is known in the middle.
    fn slack(&self, cell: &Aabb) -> Interval {
        if !self.holds(cell) {
            let (center, moved) = (cell.center(), 2.0 * cell.radius() * (1.0 + 1e-12));
            let value = self.extended(center);
            let Interval { lower, upper } = self.at(center);
            return Interval { lower: lower - value, upper: upper - value }.widen(moved + 2.0 * self.noise);
        }
        let mut slack = Interval::exact(0.0);
        self.field.walk(&mut |at| {
            let extent = at.extent();
            if !extent.overlaps(cell) {
                return false;
            }
            if at.is_leaf() {
                slack = slack.hull(at.error_over(&Aabb { min: extent.min.max(cell.min), max: extent.max.min(cell.max) }));
            }
            true
        });
        slack.widen(self.field.rounding(cell.max))
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        let between = block.between(Interval::ALL, self.noise_over(&block.cell));
        block.residual(self.between(block).map_or(between, |known| known.intersection(between)), out);
        Ok(())
    }

    /// Next to the surface an error is enough to turn the sign.
    fn sided(&self) -> bool {
        false
    }

    /// The largest error of all leaves.
    fn noise(&self) -> f64 {
        self.noise
    }

    fn noise_over(&self, cell: &Aabb) -> f64 {
        if !self.holds(cell) {
            return self.noise;
        }
        let slack = self.slack(cell);
        slack.upper.max(-slack.lower).min(self.noise)
    }
}
