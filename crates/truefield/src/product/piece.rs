//! Pieces of solids, boxes cut by a plane, and how far two of them are apart.
//!
//! In no direction u is a piece nearer to another than the least of u . p over the one less the greatest over the other. The
//! least of u . p in a box where an affine f(p) <= 0 is, by duality, no less than the least of u . p + k f(p) in the box for
//! every k >= 0.

use crate::distance::Distance;
use crate::geom::{Aabb, Affine, DVec3};

/// Steps to and fro between two pieces.
const TURNS: usize = 3;

/// What holds all that a box may hold of a solid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    hull: Aabb,
    /// Around the middle of the hull: the solid lies where this is not positive.
    plane: Affine,
}

/// How far two pieces are apart.
pub(super) struct Gap {
    /// No more than any way between them.
    pub least: f64,
    /// Points of both that are about as near as any.
    pub ends: [DVec3; 2],
}

impl Piece {
    /// `None` where the box holds nothing of the solid.
    pub fn of(solid: &dyn Distance, extent: &Aabb) -> Option<Self> {
        if solid.over(extent).lower > 0.0 {
            return None;
        }
        let (near, center, half) = (solid.below(extent), extent.center(), 0.5 * extent.size());
        if near.slope == DVec3::ZERO || !near.value.is_finite() {
            return (!(near.value > 0.0)).then_some(Self { hull: *extent, plane: Affine::constant(0.0) });
        }
        let reach = near.slope.abs() * half;
        let all = reach.element_sum();
        let slip = 1e-14 * (near.value.abs() + all) + 8.0 * f64::EPSILON * center.abs().max_element() * near.slope.length();
        if near.value - all > slip {
            return None;
        }
        let mut hull = *extent;
        for axis in 0..3 {
            // As far as the others let it.
            let end = center[axis] + (all - reach[axis] + slip - near.value) / near.slope[axis];
            if near.slope[axis] > 0.0 {
                hull.max[axis] = hull.max[axis].min(end).max(hull.min[axis]);
            } else if near.slope[axis] < 0.0 {
                hull.min[axis] = hull.min[axis].max(end).min(hull.max[axis]);
            }
        }
        let value = near.value + near.slope.dot(hull.center() - center) - slip;
        Some(Self { hull, plane: Affine { value, ..near } })
    }

    pub fn diagonal(&self) -> f64 {
        self.hull.diagonal()
    }

    /// The point of the box that is nearest to `p`, and about the nearest of the piece.
    fn nearest(&self, p: DVec3) -> DVec3 {
        let mut at = p.clamp(self.hull.min, self.hull.max);
        for _ in 0..2 {
            let above = self.plane.value + self.plane.slope.dot(at - self.hull.center());
            if above <= 0.0 {
                break;
            }
            at = (at - self.plane.slope * (above / self.plane.slope.length_squared())).clamp(self.hull.min, self.hull.max);
        }
        at
    }

    /// No more than `u . (p - middle)` anywhere in the piece.
    fn least(&self, u: DVec3) -> f64 {
        least_where(&Affine { value: 0.0, slope: u }, &self.plane, 0.5 * self.hull.size())
    }

    /// No more than an affine function on a box anywhere in the piece.
    pub fn least_of(&self, of: &Affine, extent: &Aabb) -> f64 {
        let value = of.value + of.slope.dot(self.hull.center() - extent.center());
        least_where(&Affine { value, ..*of }, &self.plane, 0.5 * self.hull.size())
    }

    /// The way to another; all that is asked for of one that is longer than `enough` is that it is.
    pub fn to(&self, other: &Self, enough: f64) -> Gap {
        let gap = (self.hull.min - other.hull.max).max(other.hull.min - self.hull.max).max(DVec3::ZERO);
        let across = other.hull.center() - self.hull.center();
        let mut found = Gap { least: gap.length() * (1.0 - 1e-15), ends: [self.hull.center(), other.hull.center()] };
        let mut along = |u: DVec3| {
            let length = u.length();
            if length > 0.0 {
                let apart = u.dot(across) + other.least(u) + self.least(-u);
                let place = self.hull.center().abs().max(other.hull.center().abs()).max_element();
                let slip = length * (1e-14 * (across.length() + self.diagonal() + other.diagonal()) + 8.0 * f64::EPSILON * place);
                found.least = found.least.max((apart - slip) / length);
            }
            found.least > enough
        };
        if along(self.plane.slope) || along(-other.plane.slope) {
            return found;
        }
        let mut ends = [self.nearest(other.hull.center()), other.hull.center()];
        for _ in 0..TURNS {
            ends[1] = other.nearest(ends[0]);
            ends[0] = self.nearest(ends[1]);
        }
        along(ends[1] - ends[0]);
        Gap { ends, ..found }
    }
}

/// No more than an affine function anywhere in a box where another one is not positive.
fn least_where(of: &Affine, positive: &Affine, half: DVec3) -> f64 {
    // Concave in the multiplier, with kinks where a slope vanishes.
    let kinks = -of.slope / positive.slope;
    let factors = [0.0].into_iter().chain(kinks.to_array().into_iter().filter(|&factor| factor > 0.0 && factor < 1e6));
    let sum = |factor: f64| Affine { value: of.value + factor * positive.value, slope: of.slope + positive.slope * factor };
    let least =
        |factor: f64| sum(factor).least(half) - 1e-14 * (of.value.abs() + factor * positive.value.abs() + (1.0 + factor) * half.length());
    factors.map(least).fold(f64::NEG_INFINITY, f64::max)
}
