//! The surface in a box to second order, and how near it can be.

use super::foot::Foot;
use super::jet::{Jet, PAIRS};
use super::matrix::{eigenvalues, fall, middle, middle_of, times};
use super::sheet::Sheet;
use super::tape::Tape;
use crate::geom::{Aabb, DVec3, Interval};

/// Newton steps on the expansion, from its tangent plane.
const STEPS: usize = 3;

/// A step that small, in sizes of the box, is the last: the bound loses no more than the square of the next.
const DONE: f64 = 1e-3;

/// A part of the least tangential eigenvalue that may be given up for the normal direction.
const SHARE: f64 = 0.25;

/// Taylor's expansion around the middle of a box, in lengths: the formula over its steepness there.
///
/// With v the way from the middle, the surface in the box has |value + normal . v + v matrix v / 2| <= `remainder`, and
/// |value + normal . v| <= `thickness`. The normal has length 1 but for rounding.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taylor {
    center: DVec3,
    half: DVec3,
    value: f64,
    normal: DVec3,
    matrix: [f64; 6],
    remainder: f64,
    thickness: f64,
    /// How far rounding of the formula in the middle may move the surface.
    pub blur: f64,
    /// The middle of the tangent plane, and how far some surface of the box is from it at most: infinite where there may be none.
    onto: DVec3,
    reach: f64,
    /// Contains the eigenvalues of the matrix.
    whole: Interval,
    /// Contains those of its part along the tangent plane, and 0.
    tangential: Interval,
    /// The matrix from normal to normal, and no less than the length of what it sends from there into the tangent plane.
    along: f64,
    across: f64,
}

impl Taylor {
    /// From what is known in the middle of a box, and from its second derivatives anywhere in it.
    pub(super) fn new(at: &Jet<Interval, 0>, sheet: &Sheet) -> Self {
        let (center, half, hessian) = (sheet.extent.center(), half(&sheet.extent), &sheet.hessian);
        let (slope, spread) = middle_of(&at.gradient);
        let (level, doubt) = middle(at.value);
        let steepness = slope.length();
        let (value, normal) = (level / steepness, slope / steepness);
        let parts = hessian.map(middle);
        let matrix = parts.map(|(middle, _)| middle / steepness);
        // v H v / 2 by the sizes of the entries, with |v| below the half sizes.
        let bent = |entry: &dyn Fn(usize) -> f64| {
            (0..6).map(|k| entry(k) * half[PAIRS[k].0] * half[PAIRS[k].1] * if k < 3 { 0.5 } else { 1.0 }).sum::<f64>()
        };
        let blur = doubt / steepness;
        let doubt = doubt + spread * half.length();
        let rounding = 1e-14 * (value.abs() + half.element_sum() + bent(&|k| matrix[k].abs()));
        let remainder = (doubt + bent(&|k| parts[k].1)) / steepness * (1.0 + 1e-14) + rounding;
        let size = |k: usize| hessian[k].upper.max(-hessian[k].lower);
        let thickness = (doubt + bent(&size)) / steepness * (1.0 + 1e-14) + rounding;
        let turned = times(&matrix, normal);
        let along = turned.dot(normal);
        let rest = turned - normal * along;
        // P K P = K - n (K n)^T - (K n) n^T + n n^T (n K n), with P the projection onto the tangent plane.
        let flat = std::array::from_fn(|k| {
            let (i, j) = PAIRS[k];
            Interval::exact(matrix[k] - normal[i] * turned[j] - turned[i] * normal[j] + along * normal[i] * normal[j])
        });
        let scale = 1e-13 * matrix.iter().fold(0.0_f64, |size, entry| size.max(entry.abs()));
        let tangential = eigenvalues(&flat).widen(scale).hull(Interval::exact(0.0));
        let whole = eigenvalues(&matrix.map(Interval::exact));
        let across = rest.length() + scale;
        // Off the slab on either side, the formula has either sign; surface is between, where both places are in the box.
        let slab = thickness * (1.0 + 1e-14);
        let reach = if ((normal * value).abs() + normal.abs() * slab).cmplt(half * (1.0 - 1e-12)).all() { slab } else { f64::INFINITY };
        let onto = center - normal * value;
        Self { center, half, value, normal, matrix, remainder, thickness, blur, onto, reach, whole, tangential, along, across }
    }

    /// That of a sheet in a box in which the formula rises.
    pub(super) fn of(tape: &Tape, sheet: &Sheet) -> Self {
        let center = sheet.extent.center();
        Self::new(&tape.jet_over(&Aabb::new(center, center)), sheet)
    }

    /// Whether no surface runs through a part of the box.
    pub(super) fn is_empty(&self, part: &Aabb) -> bool {
        let height = self.value + self.normal.dot(part.center() - self.center);
        height.abs() > (self.normal.abs().dot(half(part)) + self.thickness) * (1.0 + 1e-14)
    }

    /// No less than the distance of `p` to the surface in the box, infinite where there may be none.
    pub(super) fn most(&self, p: DVec3) -> f64 {
        let size = p.abs().max_element() + self.onto.abs().max_element();
        p.distance(self.onto) + self.reach + 8.0 * f64::EPSILON * size
    }

    /// How far the surface may be from the expansion, in lengths.
    pub(super) fn remainder(&self) -> f64 {
        self.remainder
    }

    /// The sign of the formula in the middle.
    pub(super) fn level(&self) -> f64 {
        self.value
    }

    /// No more than the squared distance of `p` to the surface in `cell`, a part of the box, infinite where there is none.
    ///
    /// The least |y|^2 over the part of the box p + y that lies in the slab is no less than that of |y|^2 plus any
    /// multiple of how far y is from reaching the slab, which splits into one easy problem for each axis.
    pub(super) fn rough(&self, p: DVec3, cell: &Aabb) -> f64 {
        if self.is_empty(cell) {
            return f64::INFINITY;
        }
        let (low, high) = (cell.min - p, cell.max - p);
        let off = p - self.center;
        let height = self.normal.dot(off) + self.value;
        let rounding = 8.0 * f64::EPSILON * (off.abs().element_sum() + self.value.abs());
        let way = (height.abs() - self.thickness - rounding).max(0.0);
        let toward = self.normal * -height.signum();
        let nearest = (toward * way).clamp(low, high);
        let parts = nearest * nearest - toward * nearest * (2.0 * way);
        let size = nearest.length_squared() + 2.0 * way * (toward * nearest).abs().element_sum() + 2.0 * way * way;
        let dual = parts.element_sum() + 2.0 * way * way - 16.0 * f64::EPSILON * size;
        dual.max(cell.distance_squared(p) * (1.0 - 8.0 * f64::EPSILON))
    }

    /// [`Taylor::rough`] by second derivatives, and a point near where the surface may be nearest.
    ///
    /// On the surface |x - p|^2 is no less than w(x) = |x - p|^2 + 2 a t + b (s^2 - thickness^2) - 2 |a| remainder, with t
    /// the expansion, s its linear part, and any a and b >= 0. From any point of the box, w is no less than its tangent
    /// there plus its least eigenvalue times the square of the way.
    pub(super) fn least(&self, p: DVec3, cell: &Aabb) -> (f64, DVec3) {
        self.least_within(p, cell, f64::INFINITY)
    }

    /// [`Taylor::least`], or any bound above `enough` where that is soon found.
    pub(super) fn least_within(&self, p: DVec3, cell: &Aabb, enough: f64) -> (f64, DVec3) {
        let local = Aabb::new(cell.min - self.center, cell.max - self.center);
        let q = p - self.center;
        let start = q - self.normal * (self.normal.dot(q) + self.value);
        let expansion = |v: DVec3| {
            let turned = times(&self.matrix, v);
            Jet {
                value: self.value + self.normal.dot(v) + 0.5 * v.dot(turned),
                gradient: (self.normal + turned).to_array(),
                hessian: self.matrix,
            }
        };
        let bound = |foot: &Foot| {
            if foot.multiplier.is_finite() { self.tangent(q, foot.point, foot.multiplier, &local) } else { f64::NEG_INFINITY }
        };
        if enough < f64::INFINITY
            && let Some(foot) = Foot::find(expansion, q, start, &local, 1, DONE)
        {
            let bound = bound(&foot);
            if bound > enough {
                return (bound, self.center + foot.point);
            }
        }
        let Some(foot) = Foot::find(expansion, q, start, &local, STEPS, DONE) else {
            return (f64::NEG_INFINITY, self.center + start.clamp(local.min, local.max));
        };
        (bound(&foot), self.center + foot.point)
    }

    /// [`Taylor::least`] at once, where the surface is known to be nearest in `foot`, beside `cell`.
    pub(super) fn beside(&self, p: DVec3, foot: DVec3, cell: &Aabb) -> f64 {
        let local = Aabb::new(cell.min - self.center, cell.max - self.center);
        self.tangent(p - self.center, foot.clamp(cell.min, cell.max) - self.center, (p - foot).dot(self.normal), &local)
    }

    /// The middle of the tangent plane nearest to `p`.
    pub(super) fn onto(&self, p: DVec3) -> DVec3 {
        p - self.normal * (self.normal.dot(p - self.center) + self.value)
    }

    /// No less than the distance of `p` to the surface by a point of the box, infinite where there may be none.
    ///
    /// Along the normal the formula, in lengths, changes by half of the way at least: gradients are steady.
    pub(super) fn most_by(&self, p: DVec3, near: DVec3, cell: &Aabb) -> f64 {
        let v = near - self.center;
        let level = self.value + self.normal.dot(v) + 0.5 * v.dot(times(&self.matrix, v));
        let aside = 2.0 * (level.abs() + self.remainder) * (1.0 + 1e-9);
        if !(cell.contains(near - self.normal * aside) && cell.contains(near + self.normal * aside)) {
            return f64::INFINITY;
        }
        let size = p.abs().max_element() + near.abs().max_element();
        p.distance(near) + aside + 8.0 * f64::EPSILON * size
    }

    /// The least of the tangent of w at `v`, and its least eigenvalue, over a box; all are counted from the middle.
    fn tangent(&self, q: DVec3, v: DVec3, a: f64, within: &Aabb) -> f64 {
        let (least, weight) = self.convexity(a);
        let turned = times(&self.matrix, v);
        let linear = self.value + self.normal.dot(v);
        let way = v - q;
        let slope = (way + (self.normal + turned) * a + self.normal * (weight * linear)) * 2.0;
        let fall: f64 = (0..3).map(|axis| fall(slope[axis], least, within.min[axis] - v[axis], within.max[axis] - v[axis])).sum();
        let level = linear + 0.5 * v.dot(turned);
        let slab = weight * (linear * linear - self.thickness * self.thickness);
        let bound = way.length_squared() + 2.0 * a * level + slab - 2.0 * a.abs() * self.remainder + fall;
        // No term is larger than these, nor wrong by more than some units in their last place.
        let reach = v.length() + self.half.length();
        let bent = self.matrix.iter().map(|entry| entry.abs()).sum::<f64>();
        let height = self.value.abs() + reach + bent * reach * reach;
        let size =
            (way.length() + q.length() + reach).powi(2) + a.abs() * height + weight * (height * (height + reach) + self.thickness.powi(2));
        bound - 1e-14 * size
    }

    /// An eigenvalue that none of I + a matrix + b normal normal^T is below, and that b.
    fn convexity(&self, a: f64) -> (f64, f64) {
        let turn = |of: Interval| 1.0 + (a * of.lower).min(a * of.upper);
        let (whole, flat) = (turn(self.whole), turn(self.tangential));
        let given = SHARE * flat.abs().max(SHARE);
        let (least, weight) = if whole >= flat - given {
            (whole, 0.0)
        } else {
            // [flat, -c; -c, n] has no eigenvalue below flat - given where (n - flat + given) given >= c^2.
            let c = a.abs() * self.across;
            (flat - given, (flat - given + c * c / given - 1.0 - a * self.along).max(0.0))
        };
        (least - 1e-13 * (1.0 + a.abs() * self.whole.upper.max(-self.whole.lower) + weight), weight)
    }
}

/// Half the edge lengths, rounded up.
fn half(cell: &Aabb) -> DVec3 {
    let center = cell.center();
    (cell.max - center).max(center - cell.min) * (1.0 + f64::EPSILON)
}
