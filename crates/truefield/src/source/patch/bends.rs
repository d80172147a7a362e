//! How half the squared distance to a point bends over a part of a patch.
//!
//! Over (u, v) its second derivatives are x_i x_j + (x - p) x_ij. With a centre c and q = p - c they are x_i x_j + (x - c) x_ij,
//! which does not depend on p and is bounded once, less q x_ij.

use super::bezier::Bezier;
use super::piece::Piece;
use crate::geom::{Aabb, DVec3, Interval};

/// A part's bounds, from which those for any point follow.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bends {
    center: DVec3,
    /// No more than the second derivatives along u u and v v seen from the centre.
    least: [f64; 2],
    /// Contains the one along u v.
    mixed: Interval,
    /// Boxes of x_uu, x_uv and x_vv.
    second: [Span; 3],
    /// What the slopes along u and v are seen from the centre.
    slopes: [Interval; 2],
    /// Boxes of x_u and x_v.
    first: [Span; 2],
    /// Whether the lower and the upper edge across u, and across v, are one point.
    points: [[bool; 2]; 2],
}

/// A box by its middle and half its size.
#[derive(Clone, Copy, Debug)]
struct Span {
    middle: DVec3,
    half: DVec3,
}

/// Half the squared distance bends no less than this: along u u, along v v, and no more than this, either way, along u v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Convex {
    uu: f64,
    vv: f64,
    mixed: f64,
    determinant: f64,
}

/// An end of a stretch of u or v.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum End {
    Low,
    High,
}

/// Determinants below this part of what they are the difference of are not relied on.
const CONDITION: f64 = 1e-3;

impl Bends {
    /// Of a part whose rectangle has this size.
    pub fn new(piece: &Piece, size: [f64; 2]) -> Self {
        let [at, u, v, uu, uv, vv] = piece.hulls();
        let center = at.center();
        let squares = half_squares(piece.bezier(), center);
        // What rounding did to differences of them.
        let rounding = 1e-12 * squares.as_flattened().iter().fold(0.0_f64, |most, square| most.max(square.abs()));
        let f = &squares;
        let [of_u, of_v, of_uu, of_vv, of_uv] = [
            range::<6, 7>(rounding, |i, j| 6.0 * (f[i + 1][j] - f[i][j])),
            range::<7, 6>(rounding, |i, j| 6.0 * (f[i][j + 1] - f[i][j])),
            range::<5, 7>(rounding, |i, j| 30.0 * (f[i + 2][j] - 2.0 * f[i + 1][j] + f[i][j])),
            range::<7, 5>(rounding, |i, j| 30.0 * (f[i][j + 2] - 2.0 * f[i][j + 1] + f[i][j])),
            range::<6, 6>(rounding, |i, j| 36.0 * (f[i + 1][j + 1] - f[i + 1][j] - f[i][j + 1] + f[i][j])),
        ];
        // The piece's own derivatives are by its own rectangle, from 0 to 1.
        let [x, y] = size.map(|size| 1.0 / size);
        let span = |hull: &Aabb, scale: f64| Span {
            middle: hull.center() * scale,
            half: (0.5 * hull.size() + 1e-14 * (hull.min.abs() + hull.max.abs())) * scale,
        };
        Self {
            center,
            least: [of_uu.lower * x * x, of_vv.lower * y * y],
            mixed: Interval { lower: of_uv.lower * x * y, upper: of_uv.upper * x * y },
            second: [span(uu, x * x), span(uv, x * y), span(vv, y * y)],
            slopes: [(of_u, x), (of_v, y)].map(|(slope, scale)| Interval { lower: slope.lower * scale, upper: slope.upper * scale }),
            first: [span(u, x), span(v, y)],
            points: piece.point_edges(),
        }
    }

    /// Seen from `p`, if it is certain to be convex.
    ///
    /// Rounding of q x_ij may hide bends of that size, which over the part make up some units in the last place of the distance.
    #[inline(always)]
    pub fn convex(&self, p: DVec3) -> Option<Convex> {
        let ([uu, vv], range) = self.seen_from(p);
        let mixed = range.upper.max(-range.lower);
        let determinant = uu * vv - mixed * mixed;
        (uu > 0.0 && vv > 0.0 && determinant > CONDITION * (uu * vv)).then_some(Convex { uu, vv, mixed, determinant })
    }

    /// The least along u u and v v, and what contains the one along u v.
    #[inline(always)]
    fn seen_from(&self, p: DVec3) -> ([f64; 2], Interval) {
        let q = p - self.center;
        let aside = q.abs();
        let [u, mixed, v] = &self.second;
        let least = [self.least[0] - u.most(q, aside), self.least[1] - v.most(q, aside)];
        (least, Interval { lower: self.mixed.lower - mixed.most(q, aside), upper: self.mixed.upper - mixed.least(q, aside) })
    }

    /// How far the squared distance to `p` may be below its tangent in the middle of the rectangle, and below its expansion of
    /// second order there, by the second derivatives of half of it.
    pub fn droop(&self, p: DVec3, size: [f64; 2], [at_uu, at_vv, at_uv]: [f64; 3]) -> [f64; 2] {
        let ([uu, vv], range) = self.seen_from(p);
        let [x, y] = size.map(|size| 0.5 * size);
        let below = |uu: f64, vv: f64, uv: f64| (uu.max(0.0) * x * x + vv.max(0.0) * y * y + 2.0 * uv.max(0.0) * x * y) * (1.0 + 1e-12);
        // What is convex along u and along v balances that much of the rest.
        let mixed = range.upper.max(-range.lower);
        let rest = mixed - (uu.max(0.0) * vv.max(0.0)).sqrt();
        [below(-uu, -vv, rest), below(at_uu - uu, at_vv - vv, (range.upper - at_uv).max(at_uv - range.lower))]
    }

    /// The ends at which the nearest points lie, where along u, along v or along both the distance only grows or only falls,
    /// and how it bends along the rest; `None` where neither is so or the rest is not convex.
    #[inline(always)]
    pub fn at_edge(&self, p: DVec3) -> Option<([Option<End>; 2], Convex)> {
        let q = p - self.center;
        let aside = q.abs();
        let end = |k: usize| {
            if self.slopes[k].lower - self.first[k].most(q, aside) > 0.0 {
                Some(End::Low)
            } else if self.slopes[k].upper - self.first[k].least(q, aside) < 0.0 {
                Some(End::High)
            } else {
                None
            }
        };
        let mut ends = [end(0), end(1)];
        for k in 0..2 {
            // Of an edge that is one point, any place will do.
            if ends[k].is_some_and(|end| self.points[k][end as usize]) {
                ends[1 - k] = ends[1 - k].or(Some(End::Low));
            }
        }
        let along = |k: usize| if ends[k].is_some() { 1.0 } else { self.least[k] - self.second[2 * k].most(q, aside) };
        let (uu, vv) = (along(0), along(1));
        let decided = ends != [None; 2] && uu > 0.0 && vv > 0.0;
        decided.then_some((ends, Convex { uu, vv, mixed: 0.0, determinant: uu * vv }))
    }

    /// The determinant seen from the middle of the part, if it is convex from there.
    pub fn determinant(&self) -> f64 {
        self.convex(self.center).map_or(0.0, |convex| convex.determinant)
    }
}

impl Span {
    /// No less than the inner products of its vectors with q; `aside` is |q|.
    #[inline(always)]
    fn most(&self, q: DVec3, aside: DVec3) -> f64 {
        q.dot(self.middle) + aside.dot(self.half)
    }

    /// No more than them.
    #[inline(always)]
    fn least(&self, q: DVec3, aside: DVec3) -> f64 {
        q.dot(self.middle) - aside.dot(self.half)
    }
}

impl Convex {
    /// Half the squared distance falls by no more than this anywhere, where its slope has these sizes along u and v.
    ///
    /// Along a direction that an edge holds, its slope is none.
    #[inline(always)]
    pub fn fall(&self, [u, v]: [f64; 2]) -> f64 {
        0.5 * (self.vv * u * u + self.uu * v * v + 2.0 * self.mixed * u * v) / self.determinant * (1.0 + 1e-12)
    }
}

/// The control numbers of half the squared distance to a point, of degree 6 along u and along v.
fn half_squares(bezier: &Bezier, center: DVec3) -> [[f64; 7]; 7] {
    const OF_THREE: [f64; 4] = [1.0, 3.0, 3.0, 1.0];
    const OF_SIX: [f64; 7] = [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0];
    let weighed: [[DVec3; 4]; 4] =
        std::array::from_fn(|i| std::array::from_fn(|j| (bezier.0[i][j] - center) * (OF_THREE[i] * OF_THREE[j])));
    let mut sums = [[0.0; 7]; 7];
    for i in 0..4 {
        for k in 0..=i {
            // Rows come in pairs.
            let times = if i == k { 1.0 } else { 2.0 };
            for j in 0..4 {
                let first = weighed[i][j] * times;
                for l in 0..4 {
                    sums[i + k][j + l] += first.dot(weighed[k][l]);
                }
            }
        }
    }
    std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * sums[i][j] / (OF_SIX[i] * OF_SIX[j])))
}

/// Contains so many numbers, which may be off by so much.
fn range<const ROWS: usize, const COLUMNS: usize>(rounding: f64, of: impl Fn(usize, usize) -> f64) -> Interval {
    let mut range = Interval { lower: f64::INFINITY, upper: f64::NEG_INFINITY };
    for i in 0..ROWS {
        for j in 0..COLUMNS {
            let value = of(i, j);
            range = Interval { lower: range.lower.min(value), upper: range.upper.max(value) };
        }
    }
    range.widen(rounding)
}
