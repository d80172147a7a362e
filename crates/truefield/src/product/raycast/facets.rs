//! The way of a ray through an exact leaf, from triangle to triangle.
//!
//! Where the side changes at the surface only, it can change on the way through a leaf only at triangles that touch it. All
//! places where the way may pass through one of them are found, those within rounding too, and the field is asked for
//! the side behind each.

use super::caster::{Caster, Other};
use crate::bvh::cover::{Range, Scratch, gather};
use crate::bvh::tree::Slot;
use crate::field::Continuity;
use crate::field::adaptive::{AdaptiveField, Cell, Leaf};
use crate::geom::{Aabb, DVec3, Facet, triangle_overlaps_box};
use crate::source::mesh::Surface;

/// Places that are kept; ways of more are followed step by step.
const MOST: usize = 16;

/// What a few sums and products of coordinates leave, of the largest one and of the products.
const ROUNDING: f64 = 64.0 * f64::EPSILON;

/// Parts of a way that are told apart.
const APART: f64 = 1e-7;

/// A triangle along which the way runs, so that its place is not known to this part of the way, is not told from others.
const VAGUE: f64 = APART;

/// What a way through a leaf meets.
pub(super) struct Through {
    /// Whether it begins inside.
    pub entered: bool,
    /// The part of the way at which the side changes.
    pub change: Option<f64>,
    /// The part of the way up to which that is known: the last bit of it may be left to the next leaf.
    pub until: f64,
}

/// Finds the triangles that touch leaves.
pub(super) struct Touching<'a> {
    surface: &'a Surface,
    scratch: Scratch,
    list: Vec<Slot>,
}

impl<'a> Touching<'a> {
    /// Of the surface at a distance, if it is that of triangles alone.
    pub fn of(field: &'a AdaptiveField, distance: f64) -> Option<Self> {
        let surface = field.surface().filter(|_| distance == 0.0 && field.continuity() == Continuity::Everywhere)?;
        Some(Self { surface, scratch: Scratch::default(), list: Vec::new() })
    }

    /// Adds the triangles that touch an exact leaf; whether that is known.
    pub fn add(&mut self, cell: &Cell<'_>, triangles: &mut Vec<u32>) -> bool {
        let Leaf::Exact(listed) = cell.leaf() else { return false };
        let (tree, scale) = (self.surface.tree(), self.surface.scale());
        let extent = cell.extent();
        let extent = Aabb::new(extent.min * scale, extent.max * scale);
        // Ways begin where those of the leaf before were left.
        let grown = extent.grow(4.0 * APART * size(self.surface, &extent));
        let touches = |triangle: u32| {
            let Facet { a, ab, ac, .. } = *tree.facet(triangle);
            triangle_overlaps_box([a, a + ab, a + ac], &grown)
        };
        if listed.is_empty() {
            gather(tree, &grown, Slot(0), Range::ALL, &mut self.scratch, &mut self.list);
            triangles.extend(self.list.iter().map(|&slot| tree.triangle(slot)).filter(|&triangle| touches(triangle)));
        } else {
            triangles.extend(listed.iter().copied().filter(|&triangle| touches(triangle)));
        }
        true
    }
}

/// The largest coordinate of a surface and a box, in the tree's units.
fn size(surface: &Surface, extent: &Aabb) -> f64 {
    let tree = surface.tree();
    tree.radius + tree.center.abs().max_element() + extent.min.abs().max(extent.max.abs()).max_element()
}

impl Caster {
    /// What the way between two points of an exact leaf meets; `entered` is the side of the first, where that is known. `None`
    /// where the triangles do not tell.
    pub(super) fn through(&self, other: &Other, [from, to]: [DVec3; 2], entered: Option<bool>) -> Option<Through> {
        let surface = self.field.surface().filter(|_| other.count > 0)?;
        let (scale, range) = (surface.scale(), other.first as usize..(other.first + other.count) as usize);
        let facets = self.triangles[range].iter().map(|&triangle| surface.tree().facet(triangle));
        let mut places = [0.0; MOST];
        let extent = self.field.extent_box();
        let size = size(surface, &Aabb::new(extent.min * scale, extent.max * scale));
        let count = crossings(facets, [from * scale, to * scale], size, &mut places)?;
        if let (0, Some(entered)) = (count, entered) {
            return Some(Through { entered, change: None, until: 1.0 });
        }
        let cell = self.field.find(other.center)?;
        let is_inside = |part: f64| cell.value(from + (to - from) * part) < 0.0;
        let entered = entered.unwrap_or_else(|| is_inside(0.0));
        // Places that are not told apart are one, from this on.
        let mut place = places[0];
        for i in 0..count {
            let next = if i + 1 < count { places[i + 1] } else { 1.0 };
            if next - places[i] <= APART {
                continue;
            }
            if is_inside(if i + 1 < count { 0.5 * (places[i] + next) } else { 1.0 }) != entered {
                return Some(Through { entered, change: Some(place), until: place });
            }
            place = next;
        }
        let left = count > 0 && 1.0 - places[count - 1] <= APART;
        Some(Through { entered, change: None, until: if left { (place - APART).max(0.0) } else { 1.0 } })
    }
}

/// Fills `places`, ascending, with the parts of a way at which it may pass through a triangle, and tells how many there are; all
/// in the tree's units, no coordinate above `size`. `None` where one of them lies along the way, or where they are too many.
fn crossings<'a>(facets: impl Iterator<Item = &'a Facet>, [from, to]: [DVec3; 2], size: f64, places: &mut [f64; MOST]) -> Option<usize> {
    let (way, grain) = (to - from, ROUNDING * size);
    let length = way.length();
    let mut count = 0;
    for facet in facets {
        let (ab, ac) = (facet.ab, facet.ac);
        let normal = ab.cross(ac);
        let (before, after) = (normal.dot(from - facet.a), normal.dot(to - facet.a));
        let (product, fall) = (ab.length_squared() * ac.length_squared(), before - after);
        let noise = grain * grain * product;
        if before * after > 0.0 && before * before > noise && after * after > noise {
            continue;
        }
        if !(fall * fall * (VAGUE * VAGUE) > noise) {
            return None;
        }
        let part = (before / fall).clamp(0.0, 1.0);
        let off = grain + 2.0 * length * noise.sqrt() / fall.abs();
        let w = from + way * part - facet.a;
        let beyond = |edge: DVec3, w: DVec3| {
            let height = normal.cross(edge).dot(w);
            height < 0.0 && height * height > 4.0 * off * off * product * edge.length_squared()
        };
        if beyond(ab, w) || beyond(ac - ab, w - ab) || beyond(-ac, w - ac) {
            continue;
        }
        let slot = (0..count).find(|&i| places[i] > part).unwrap_or(count);
        if count == MOST {
            return None;
        }
        places.copy_within(slot..count, slot + 1);
        places[slot] = part;
        count += 1;
    }
    Some(count)
}
