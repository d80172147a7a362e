//! A part of a patch, and how near it is for certain.

use super::bezier::Bezier;
use super::net::Point;
use super::oriented::Oriented;
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

    pub(super) fn bezier(&self) -> &Bezier {
        &self.bezier
    }

    /// Boxes of its points and derivatives, see [`Bezier::hulls`].
    pub(super) fn hulls(&self) -> &[Aabb; 6] {
        &self.hulls
    }

    /// Whether the edges across u, the lower and the upper, and those across v are one point each.
    pub(super) fn point_edges(&self) -> [[bool; 2]; 2] {
        let at = |i: usize, j: usize| self.bezier.0[i][j];
        let is_point = |edge: [DVec3; 4]| edge.iter().all(|p| *p == edge[0]);
        [[0, 3].map(|i| is_point([0, 1, 2, 3].map(|j| at(i, j)))), [0, 3].map(|j| is_point([0, 1, 2, 3].map(|i| at(i, j))))]
    }

    /// A box along it.
    pub(super) fn oriented(&self) -> Oriented {
        let middle = self.bezier.derivatives(0.5, 0.5);
        Oriented::around(self.bezier.controls(), [middle.u, middle.v])
    }

    /// The direction in which it is longer.
    pub(super) fn longer(&self) -> usize {
        let length = |hull: &Aabb| hull.min.abs().max(hull.max.abs()).length_squared();
        usize::from(length(&self.hulls[2]) > length(&self.hulls[1]))
    }

    /// Cut across the direction in which it is longer.
    pub(super) fn halves(&self) -> [Self; 2] {
        self.bezier.halves(self.longer()).map(Self::new)
    }

    /// The edges on which the nearest point to any point of a box lies, and no more than what half the squared distance bends
    /// along what they leave open.
    fn shape(&self, from: &Aabb) -> ([Option<f64>; 2], f64) {
        let [at, u, v, uu, uv, vv] = &self.hulls;
        let way = Aabb::new(at.min - from.max, at.max - from.min);
        let edges = [dot(&way, u), dot(&way, v)].map(edge);
        let uu = dot(u, u).plus(dot(&way, uu)).lower;
        let vv = dot(v, v).plus(dot(&way, vv)).lower;
        let uv = dot(u, v).plus(dot(&way, uv));
        let mixed = uv.lower.abs().max(uv.upper.abs());
        let least = match edges {
            [Some(_), Some(_)] => 0.0,
            [Some(_), None] => vv,
            [None, Some(_)] => uu,
            [None, None] if uu > 0.0 && vv > 0.0 && uu * vv >= mixed * mixed * (1.0 + 1e-12) => 0.0,
            [None, None] => uu.min(vv) - mixed,
        };
        (edges, least)
    }

    /// Whether the nearest point to each point of a box is certainly found at once.
    pub(super) fn is_simple(&self, from: &Aabb) -> bool {
        self.shape(from).1 >= 0.0
    }

    /// The nearest point as far as Newton's method finds it, and what is certain.
    ///
    /// Where the squared distance only grows, or only falls, along u or v, the nearest point lies on that edge; along what is
    /// left, it is below its tangent by no more than what it bends, and nowhere if it is convex.
    pub(super) fn nearest(&self, p: DVec3) -> Nearest {
        let (edges, least) = self.shape(&Aabb::new(p, p));
        let ([u, v], here) = self.newton(p, edges);
        let way = here.at - p;
        let square = way.length_squared();
        let fall = |k: usize, slope: f64, t: f64| if edges[k].is_some() { 0.0 } else { (-slope * t).min(slope * (1.0 - t)).min(0.0) };
        let reach = |k: usize, t: f64| if edges[k].is_some() { 0.0 } else { t.max(1.0 - t).powi(2) };
        let far = p.abs().max(here.at.abs()).max_element();
        let rounding = 64.0 * f64::EPSILON * far * (here.u.length() + here.v.length() + way.length());
        let bent = least.min(0.0) * (reach(0, u) + reach(1, v)) * (1.0 + 1e-12);
        let tangent = square + 2.0 * (fall(0, way.dot(here.u), u) + fall(1, way.dot(here.v), v)) + bent - rounding;
        let lower = tangent.max(self.hulls[0].distance_squared(p) * (1.0 - 8.0 * f64::EPSILON));
        Nearest { lower, point: here.at }
    }

    /// Newton's method towards the nearest point, along the directions that no edge decides.
    fn newton(&self, p: DVec3, edges: [Option<f64>; 2]) -> ([f64; 2], Point) {
        let mut t = edges.map(|edge| edge.unwrap_or(0.5));
        let mut here = self.bezier.derivatives(t[0], t[1]);
        for _ in 0..STEPS {
            let way = here.at - p;
            let slope = [way.dot(here.u), way.dot(here.v)];
            let speed = [here.u, here.v].map(|d| d.length_squared().max(f64::MIN_POSITIVE));
            let bend = [speed[0] + way.dot(here.uu), speed[1] + way.dot(here.vv)];
            let mixed = here.u.dot(here.v) + way.dot(here.uv);
            // What the last step held on an edge stays there while it would only leave.
            let held: [bool; 2] =
                std::array::from_fn(|k| edges[k].is_some() || t[k] <= 0.0 && slope[k] > 0.0 || t[k] >= 1.0 && slope[k] < 0.0);
            let alone = |k: usize| -slope[k] / if bend[k] > 0.0 { bend[k] } else { speed[k] };
            let determinant = bend[0] * bend[1] - mixed * mixed;
            let step = match held {
                [true, true] => break,
                [true, false] => [0.0, alone(1)],
                [false, true] => [alone(0), 0.0],
                [false, false] if bend[0] > 0.0 && determinant > 1e-12 * bend[0] * bend[1] => {
                    [(mixed * slope[1] - bend[1] * slope[0]) / determinant, (mixed * slope[0] - bend[0] * slope[1]) / determinant]
                }
                [false, false] => [-slope[0] / speed[0], -slope[1] / speed[1]],
            };
            let next: [f64; 2] = std::array::from_fn(|k| (t[k] + step[k]).clamp(0.0, 1.0));
            let moved = (next[0] - t[0]).abs() + (next[1] - t[1]).abs();
            if !(moved > 1e-15) {
                break;
            }
            t = next;
            here = self.bezier.derivatives(t[0], t[1]);
        }
        (t, here)
    }
}

/// The edge on which the least value lies, where the slope has one sign only.
fn edge(slope: Interval) -> Option<f64> {
    if slope.lower > 0.0 {
        Some(0.0)
    } else if slope.upper < 0.0 {
        Some(1.0)
    } else {
        None
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
