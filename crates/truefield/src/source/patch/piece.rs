//! A part of a patch, and how near it is for certain.

use super::bezier::Bezier;
use crate::geom::{Aabb, DVec3, Interval};

/// Newton steps towards the nearest point of a piece.
const STEPS: usize = 24;

/// A part of a patch over a rectangle of (u, v), with boxes around its points and derivatives.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    bezier: Bezier,
    hulls: [Aabb; 6],
}

/// What is known of the distance to a piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    /// Squared; no point of the piece is nearer.
    pub lower: f64,
    /// A point of the piece.
    pub point: DVec3,
}

impl Piece {
    pub(super) fn new(bezier: Bezier) -> Self {
        Self { bezier, hulls: bezier.hulls() }
    }

    pub(super) fn extent(&self) -> &Aabb {
        &self.hulls[0]
    }

    /// Cut across the direction in which it is longer.
    pub(super) fn halves(&self) -> [Self; 2] {
        let length = |hull: &Aabb| hull.min.abs().max(hull.max.abs()).length_squared();
        let axis = usize::from(length(&self.hulls[2]) > length(&self.hulls[1]));
        self.bezier.halves(axis).map(Self::new)
    }

    /// The nearest point as far as Newton's method finds it, and what is certain: where the squared distance is convex in
    /// (u, v), it is nowhere below its tangent plane.
    pub(super) fn nearest(&self, p: DVec3) -> Nearest {
        let (mut u, mut v) = (0.5, 0.5);
        let mut here = self.bezier.derivatives(u, v);
        for _ in 0..STEPS {
            let way = here.at - p;
            let (gu, gv) = (way.dot(here.u), way.dot(here.v));
            let (uu, uv, vv) =
                (here.u.dot(here.u) + way.dot(here.uu), here.u.dot(here.v) + way.dot(here.uv), here.v.dot(here.v) + way.dot(here.vv));
            let determinant = uu * vv - uv * uv;
            let (mut du, mut dv) = if uu > 0.0 && determinant > 1e-12 * uu * vv {
                ((uv * gv - vv * gu) / determinant, (uv * gu - uu * gv) / determinant)
            } else {
                (-gu / here.u.length_squared().max(f64::MIN_POSITIVE), -gv / here.v.length_squared().max(f64::MIN_POSITIVE))
            };
            // An edge holds one of the two; the other is then solved for by itself.
            if u + du < 0.0 || u + du > 1.0 {
                let edge = if du < 0.0 { 0.0 } else { 1.0 };
                du = edge - u;
                dv = -(gv + uv * du) / if vv > 0.0 { vv } else { here.v.length_squared().max(f64::MIN_POSITIVE) };
            }
            if v + dv < 0.0 || v + dv > 1.0 {
                let edge = if dv < 0.0 { 0.0 } else { 1.0 };
                dv = edge - v;
                du = -(gu + uv * dv) / if uu > 0.0 { uu } else { here.u.length_squared().max(f64::MIN_POSITIVE) };
            }
            let (next_u, next_v) = ((u + du).clamp(0.0, 1.0), (v + dv).clamp(0.0, 1.0));
            let moved = (next_u - u).abs() + (next_v - v).abs();
            if !(moved > 1e-15) {
                break;
            }
            (u, v) = (next_u, next_v);
            here = self.bezier.derivatives(u, v);
        }
        let way = here.at - p;
        let square = way.length_squared();
        let far = p.abs().max(here.at.abs()).max_element();
        let plain = self.hulls[0].distance_squared(p) * (1.0 - 8.0 * f64::EPSILON);
        let mut lower = plain;
        if self.is_convex(p) {
            let fall = |slope: f64, t: f64| (-slope * t).min(slope * (1.0 - t)).min(0.0);
            let rounding = 64.0 * f64::EPSILON * far * (here.u.length() + here.v.length() + way.length());
            let tangent = square + 2.0 * (fall(way.dot(here.u), u) + fall(way.dot(here.v), v)) - rounding;
            lower = lower.max(tangent);
        }
        Nearest { lower, point: here.at }
    }

    /// Whether the squared distance to `p` is certainly convex in (u, v).
    fn is_convex(&self, p: DVec3) -> bool {
        let [at, u, v, uu, uv, vv] = &self.hulls;
        let way = Aabb::new(at.min - p, at.max - p);
        let uu = dot(u, u).plus(dot(&way, uu));
        let vv = dot(v, v).plus(dot(&way, vv));
        let uv = dot(u, v).plus(dot(&way, uv));
        let mixed = uv.lower.abs().max(uv.upper.abs());
        uu.lower > 0.0 && vv.lower > 0.0 && uu.lower * vv.lower >= mixed * mixed * (1.0 + 1e-12)
    }
}

/// Contains the inner products of the vectors of two boxes; of a box with itself, those of each vector with itself.
fn dot(a: &Aabb, b: &Aabb) -> Interval {
    let mut sum = Interval::exact(0.0);
    for axis in 0..3 {
        let ([a0, a1], [b0, b1]) = ([a.min[axis], a.max[axis]], [b.min[axis], b.max[axis]]);
        let products = [a0 * b0, a0 * b1, a1 * b0, a1 * b1];
        let mut part = Interval {
            lower: products.iter().copied().fold(f64::INFINITY, f64::min),
            upper: products.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        };
        if std::ptr::eq(a, b) {
            part.lower = if a0 <= 0.0 && a1 >= 0.0 { 0.0 } else { (a0 * a0).min(a1 * a1) };
        }
        sum = sum.plus(part.widen(4.0 * f64::EPSILON * part.lower.abs().max(part.upper.abs())));
    }
    sum
}
