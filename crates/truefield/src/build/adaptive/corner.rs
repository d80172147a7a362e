//! Corners of cells: their nearest points and their sides.

use crate::bvh::Candidate;
use crate::bvh::feet::Found;
use crate::bvh::tree::Slot;
use crate::field::adaptive::ListSide;
use crate::geom::DVec3;
use crate::source::mesh::{Side, Surface};

/// Nearer to the surface than this part of its size every point's side is asked by itself.
const ASKED: f64 = 1e-6;

/// A lattice point, in the tree's units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// Signed distance.
    pub value: f64,
    /// Whether its sign is.
    pub certain: bool,
    pub point: DVec3,
    /// The nearest point of the surface.
    pub foot: DVec3,
    /// Its triangle.
    pub near: Slot,
}

/// The nearest point of the surface and the side of a point, in the tree's units; `near` are points that may be near it.
pub(super) fn corner(surface: &Surface, p: DVec3, near: &[Corner], side: Option<Side>) -> Corner {
    let nearest = nearest(surface, p, near);
    found(surface, p, Found { nearest, foot: surface.tree().facet(nearest.triangle).nearest(p).point }, side)
}

/// The nearest triangle of a point; `near` are points that may be near it.
fn nearest(surface: &Surface, p: DVec3, near: &[Corner]) -> Candidate {
    let tree = surface.tree();
    let nearer = |a: &&Corner, b: &&Corner| (a.foot - p).length_squared().total_cmp(&(b.foot - p).length_squared());
    let hint = near.iter().min_by(nearer).map_or(Slot(0), |corner| corner.near);
    let start = Candidate { distance_squared: tree.facet_at(hint).distance_squared(p), triangle: tree.triangle(hint) };
    tree.nearest(p, start)
}

/// The point whose nearest triangle was found.
pub(super) fn found(surface: &Surface, p: DVec3, Found { nearest, foot }: Found, side: Option<Side>) -> Corner {
    let tree = surface.tree();
    let side = side.unwrap_or_else(|| surface.side(p, &tree.facet(nearest.triangle).nearest(p), nearest.triangle));
    Corner {
        value: side.sign() * nearest.distance_squared.sqrt(),
        certain: side.is_certain(),
        point: p,
        foot,
        near: tree.slots[nearest.triangle as usize],
    }
}

/// A point of the surface that may be nearest to `p`: that of the triangle whose nearest point to one of some other points is nearest.
pub(super) fn nearest_of(surface: &Surface, p: DVec3, near: &[Corner; 8]) -> DVec3 {
    let (mut slot, mut least) = (near[0].near, f64::INFINITY);
    for corner in near {
        let squared = (corner.foot - p).length_squared();
        (slot, least) = if squared < least { (corner.near, squared) } else { (slot, least) };
    }
    surface.tree().facet_at(slot).nearest(p).point
}

/// The one side of a cell that the surface does not touch, where the side changes at the surface only.
pub(super) fn one_side(corners: &[Corner; 8]) -> Option<Side> {
    // The one that is farthest off: rounding may put others across.
    let farther = |a: &&Corner, b: &&Corner| a.value.abs().total_cmp(&b.value.abs());
    corners.iter().filter(|corner| corner.certain).max_by(farther).map(|corner| side_of(corner.value))
}

/// The side of a point that is so far from the surface, where that of one of `near` carries as far off the surface: two balls that
/// overlap leave no room between them for it. `carries` is how far sides do.
pub(super) fn side_by(surface: &Surface, p: DVec3, distance: f64, near: &[Corner; 8], carries: &[f64; 8]) -> Option<Side> {
    let apart = ASKED * (surface.tree().radius + p.abs().max_element());
    let reaches = |corner: &Corner, carry: f64| {
        let reach = (distance + corner.value.abs()).min(carry);
        corner.value.abs() > apart && (corner.point - p).length_squared() * (1.0 + 1e-9) < reach * reach
    };
    let mut near = near.iter().zip(carries).filter(|_| distance > apart);
    near.find(|(corner, carry)| reaches(corner, **carry)).map(|(corner, _)| side_of(corner.value))
}

/// How far the side of a point carries on paths off the surface.
pub(super) fn carry(surface: &Surface, corner: &Corner) -> f64 {
    if corner.certain { surface.carry(surface.tree().triangle(corner.near), corner.value.abs()).max(0.0) } else { 0.0 }
}

/// The side of a distance that is certain.
pub(super) fn side_of(value: f64) -> Side {
    if value.is_sign_negative() { Side::Inside } else { Side::Outside }
}

/// The one side of a ball that the surface does not touch, if that is certain; `near` are points that may be near its centre.
pub(super) fn side_of_ball(surface: &Surface, center: DVec3, radius: f64, near: &[Corner]) -> Option<Side> {
    let triangle = match near {
        [same] if same.point == center => surface.tree().triangle(same.near),
        _ => nearest(surface, center, near).triangle,
    };
    surface.side_of_ball(center, &surface.tree().facet(triangle).nearest(center), triangle, radius)
}

pub(super) fn list_side(side: Option<Side>) -> ListSide {
    match side {
        Some(Side::Inside) => ListSide::Inside,
        Some(Side::Outside) => ListSide::Outside,
        _ => ListSide::Asked,
    }
}
