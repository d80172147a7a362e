//! An affine function below the distance of a mesh over a box: the plane that no surface within reach sticks out of.
//!
//! Let c be the middle of the box, r its radius, q the surface's nearest point to c and B the ball around c of radius
//! |c - q| + 2 r: it holds the nearest point x of each point p of the box. Let n be a unit vector with n . x <= h for all surface
//! in B. Outside, the distance is |p - x| >= n . (p - x) >= n . p - h.
//!
//! B beyond the plane n . x = h holds no surface: where the side changes at the surface only it has one side, and one point
//! tells that it is outside, c itself where the ball around it that touches the surface sticks out of the plane. Then p inside
//! is not beyond the plane, and the way from it along n to the plane, h - n . p long, ends outside or leaves B, and so is no
//! shorter than the way to the surface: the distance is no less than n . p - h again. Where vertices were joined, sides are
//! open in a layer around the surface, by which all ways may be off.

use std::collections::BinaryHeap;

use super::{Side, SignKind, Surface};
use crate::bvh::Candidate;
use crate::bvh::tree::{ABSENT, LEAF, Node, Tree, WIDTH};
use crate::geom::{Aabb, Affine, DVec3, Facet};
use crate::source::waiting::Waiting;

/// Nodes looked into for one plane; what is left then is as high as it was bounded.
const LOOKS: usize = 256;

/// What a plane may lie too high by, of the box.
const GIVE: f64 = 1.0 / 1024.0;

impl Surface {
    /// [`Distance::below`](crate::distance::Distance::below).
    pub(super) fn plane_below(&self, cell: &Aabb) -> Affine {
        let (center, radius) = (cell.center() * self.scale, cell.radius() * self.scale * (1.0 + 1e-15));
        let found = self.tree.nearest(center, Candidate::within(f64::INFINITY));
        let (foot, side) = self.foot_and_side(center, found);
        let least = self.over_from(self.interval(&foot, side), cell).lower;
        let way = foot.distance_squared.sqrt();
        // For rounding, of what is added and of where the box is.
        let span = (center - self.tree.center).length() + self.tree.radius + radius + way;
        let slip = 32.0 * f64::EPSILON * span + 4.0 * f64::EPSILON * center.abs().max_element();
        // From next to the surface, where that direction is lost, any will do.
        let normal = if way > 1e-6 * radius && way > slip {
            (center - foot.point).normalize_or_zero() * side.sign()
        } else {
            self.normal(center, &foot, found.triangle, side)
        };
        let of = |height: f64| Affine { value: -(height + slip) / self.scale, slope: normal };
        if radius == 0.0 {
            return Affine { value: least, slope: normal };
        }
        let clear = way > radius + slip;
        let mut best = Affine::constant(least);
        if side == Side::Inside && clear && self.side_changes_at_surface_only() {
            // No farther from the surface than from the nearest point: the hypotenuse exceeds the longer side by no more than this.
            let (along, across) = (way - radius, radius);
            let farthest = of(way + across * across / (2.0 * along));
            best = if farthest.value > best.value { farthest } else { best };
        }
        if normal == DVec3::ZERO {
            return best;
        }
        let ball = Ball { center, radius: (way + 2.0 * radius) * (1.0 + 1e-14) + slip };
        let start = normal.dot(foot.point - center);
        let height = highest(&self.tree, normal, &ball, start, slip + GIVE * radius);
        let outside = match self.sign_rule().kind {
            SignKind::Unsigned => true,
            _ if !self.side_changes_at_surface_only() => {
                clear && self.side_of_ball(center, &foot, found.triangle, radius) == Some(Side::Outside)
            }
            _ => {
                height >= ball.radius
                    || side == Side::Outside && height < way - slip
                    || self.is_outside(center + normal * (0.5 * (height + ball.radius)))
            }
        };
        let plane = of(height + 2.0 * self.signs.blur());
        if outside && plane.value > best.value { plane } else { best }
    }

    /// In the tree's units.
    fn is_outside(&self, p: DVec3) -> bool {
        self.foot_and_side(p, self.tree.nearest(p, Candidate::within(f64::INFINITY))).1 == Side::Outside
    }
}

struct Ball {
    center: DVec3,
    radius: f64,
}

/// No less than `n . (x - center)` for all x of the surface in the ball; `known` is that of one of them, and as much as `give`
/// too much is no matter.
fn highest(tree: &Tree, n: DVec3, ball: &Ball, known: f64, give: f64) -> f64 {
    let (local, mut best) = (ball.center - tree.center, known);
    let mut heap = BinaryHeap::from([Waiting { bound: f64::NEG_INFINITY, number: 0, item: 0u32 }]);
    let mut number = 0;
    while let Some(Waiting { bound, item, .. }) = heap.pop() {
        if -bound <= best + give || number / WIDTH > LOOKS {
            return best.max(-bound);
        }
        if item & LEAF != 0 {
            let packet = &tree.packets[(item & !LEAF) as usize];
            for lane in 0..packet.count as usize {
                best = best.max(highest_of(&packet.facet(lane), n, ball, best));
            }
            continue;
        }
        let node = &tree.nodes[item as usize];
        for lane in 0..WIDTH {
            if node.child[lane] != ABSENT
                && let Some(top) = top(node, lane, n, local, ball.radius)
                && top > best
            {
                number += 1;
                heap.push(Waiting { bound: -top, number, item: node.child[lane] });
            }
        }
    }
    best
}

/// No less than `n . (x - center)` in the part of a child's box around the ball; `None` where that is empty.
fn top(node: &Node, lane: usize, n: DVec3, center: DVec3, radius: f64) -> Option<f64> {
    let (mut top, mut gap) = (0.0, 0.0);
    for axis in 0..3 {
        let (min, max) = (f64::from(node.min[axis][lane]) - center[axis], f64::from(node.max[axis][lane]) - center[axis]);
        let out = min.max(-max).max(0.0);
        gap += out * out;
        top += (n[axis] * min.max(-radius)).max(n[axis] * max.min(radius));
    }
    (gap <= radius * radius).then_some(top.min(radius))
}

/// The greatest `n . (x - center)` over the part of a triangle in the ball, if it is more than `known`: it is taken in the
/// plane of the triangle or on an edge.
fn highest_of(facet: &Facet, n: DVec3, ball: &Ball, known: f64) -> f64 {
    let a = facet.a - ball.center;
    let corners = [a, a + facet.ab, a + facet.ac];
    let most = corners.iter().map(|&v| n.dot(v)).fold(f64::NEG_INFINITY, f64::max);
    if most <= known {
        return known;
    }
    let size = corners.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
    if size <= ball.radius {
        return most;
    }
    let squared = (ball.radius + 8.0 * f64::EPSILON * size).powi(2);
    let mut best = known;
    for (from, to) in [(corners[0], corners[1]), (corners[1], corners[2]), (corners[2], corners[0])] {
        let edge = to - from;
        let length_squared = edge.length_squared();
        if length_squared == 0.0 {
            continue;
        }
        let middle = -from.dot(edge) / length_squared;
        let left = squared - (from + edge * middle).length_squared();
        if left < 0.0 {
            continue;
        }
        let half = (left / length_squared).sqrt();
        let (start, end) = ((middle - half).max(0.0), (middle + half).min(1.0));
        if start <= end + 1e-12 {
            best = best.max(n.dot(from + edge * start)).max(n.dot(from + edge * end));
        }
    }
    best.max(level(facet, a, n, squared, size).unwrap_or(f64::NEG_INFINITY).min(most))
}

/// The same where the disc that the ball cuts from the triangle's plane is highest; `None` where that is off the triangle.
fn level(facet: &Facet, a: DVec3, n: DVec3, squared: f64, size: f64) -> Option<f64> {
    let cross = facet.ab.cross(facet.ac);
    let sine = cross.length() / (facet.ab.length() * facet.ac.length());
    // Where a sliver has no plane to speak of, its corners tell.
    if !(sine > 1e-5) {
        return Some(f64::INFINITY);
    }
    let unit = cross.normalize();
    let slip = 16.0 * f64::EPSILON * size / sine;
    let middle = unit * unit.dot(a);
    let left = (squared.sqrt() + slip).powi(2) - middle.length_squared();
    if left < 0.0 {
        return None;
    }
    let along = n - unit * unit.dot(n);
    let steep = along.length();
    let radius = left.sqrt();
    let top = n.dot(middle) + radius * steep + slip;
    if steep < 1e-6 {
        return Some(top);
    }
    let at = middle + along * (radius / steep) - a;
    // Directions in the plane are off by what the plane is, over how steep it is.
    let off = slip / steep + slip + (radius - (squared - middle.length_squared()).max(0.0).sqrt()) * (1.0 + 1e-9);
    let inward = |from: DVec3, edge: DVec3| unit.cross(edge).dot(at - from) >= -off * edge.length();
    let on = inward(DVec3::ZERO, facet.ab) && inward(facet.ab, facet.ac - facet.ab) && inward(facet.ac, -facet.ac);
    on.then_some(top)
}
