//! The nearest point of one sheet: found in plain numbers, then proven.

use super::jet::Jet;
use super::matrix::{eigenvalues, fall, penalised, times};
use super::number::Number;
use super::sheet::{Sheet, Side};
use super::tape::Tape;
use crate::geom::{Aabb, DVec3, Interval};

/// Where the surface seems nearest to a point within a box.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot {
    pub point: DVec3,
    /// `point - p + multiplier * gradient = 0`, but for axes on which the box holds the point back.
    pub multiplier: f64,
    pub gradient: DVec3,
}

impl Foot {
    /// Newton's method on the nearest point to `p` within `limits` where the value of `jet` is 0, from `start`.
    ///
    /// It ends where a step was as small as `done`, in sizes of the box. Nothing is promised of the result.
    pub(super) fn find(jet: impl Fn(DVec3) -> Jet<f64, 6>, p: DVec3, start: DVec3, limits: &Aabb, steps: usize, done: f64) -> Option<Self> {
        let mut x = start.clamp(limits.min, limits.max);
        let mut multiplier = f64::NAN;
        let mut gradient = DVec3::ZERO;
        let reach = limits.diagonal();
        for _ in 0..steps {
            let jet = jet(x);
            gradient = DVec3::from_array(jet.gradient);
            if !jet.value.is_finite() || !gradient.is_finite() {
                return None;
            }
            let (step, next) = newton(&jet.hessian, jet.value, gradient, p - x, DVec3::ONE, multiplier)?;
            let far = step.length();
            let mut target = x + if far > reach { step * (reach / far) } else { step };
            multiplier = next;
            if !limits.contains(target) {
                // Where the nearest point of the tangent plane lies on faces of the box, they hold it back.
                let (onto, with) = nearest_on_plane(p, jet.value - gradient.dot(x), gradient, limits);
                let free = DVec3::from_array(std::array::from_fn(|axis| {
                    if onto[axis] > limits.min[axis] && onto[axis] < limits.max[axis] { 1.0 } else { 0.0 }
                }));
                let base = x * free + onto * (DVec3::ONE - free);
                let value = jet.value + gradient.dot(base - x);
                let held = newton(&jet.hessian, value, gradient, p - base, free, with);
                multiplier = held.map_or(with, |(_, next)| next);
                target = held.map_or(onto, |(step, _)| base + step).clamp(limits.min, limits.max);
            }
            let moved = (target - x).length();
            x = target;
            if moved <= done * reach {
                break;
            }
        }
        Some(Self { point: x, multiplier, gradient })
    }

    /// Whether it lies on a face of its box that is no face of the domain.
    pub(super) fn is_held(&self, limits: &Aabb, domain: &Aabb) -> bool {
        (0..3).any(|axis| {
            let at = self.point[axis];
            at <= limits.min[axis] && at > domain.min[axis] || at >= limits.max[axis] && at < domain.max[axis]
        })
    }

    /// No more than the squared distance from `p` to the surface in the sheet's reach.
    ///
    /// On the surface f = 0, so |x - p|^2 equals w(x) = |x - p|^2 + 2 a f + b f^2 for any a and b. Where w is convex, it is
    /// nowhere below its tangent at the foot, and there the tangent is nearly level. `here` is what is certain at the foot.
    pub(super) fn proof(&self, here: &Jet<Interval, 0>, p: DVec3, sheet: &Sheet) -> f64 {
        let turned = 1.0 + (self.multiplier * sheet.turns.lower).min(self.multiplier * sheet.turns.upper);
        let least = turned - 1e-14 * (1.0 + self.multiplier.abs() * sheet.turns.upper.max(-sheet.turns.lower));
        let best = if least.is_finite() { self.tangent(p, sheet, here, 0.0, least) } else { f64::NEG_INFINITY };
        if least >= 0.0 {
            return best;
        }
        let square = self.gradient.length_squared();
        let along = times(&sheet.hessian.map(|h| 0.5 * (h.lower + h.upper)), self.gradient).dot(self.gradient) / square;
        let weight = (0.5 + (-self.multiplier * along).max(0.0)) / square;
        let least = eigenvalues(&penalised(&sheet.hessian, self.multiplier, weight, &sheet.gradient, sheet.value)).lower;
        if least.is_finite() { best.max(self.tangent(p, sheet, here, weight, least)) } else { best }
    }

    /// The lower bound over the box of `sheet` when half the second derivatives of w have no eigenvalue below `least`.
    fn tangent(&self, p: DVec3, sheet: &Sheet, here: &Jet<Interval, 0>, weight: f64, least: f64) -> f64 {
        let (way, reach, value) = (self.point - p, &sheet.extent, here.value);
        let (a, b) = (Interval::exact(2.0 * self.multiplier), Interval::exact(weight));
        let constant = value.mul(a).add(value.square().mul(b));
        let slope = a.add(value.mul(b).mul(Interval::exact(2.0)));
        let (mut loss, mut size) = (0.0, 0.0);
        for axis in 0..3 {
            let back = Interval::around(2.0 * way[axis], 2.0 * f64::EPSILON * way[axis].abs());
            let tilt = here.gradient[axis].mul(slope).add(back);
            let (low, high) = (reach.min[axis] - self.point[axis], reach.max[axis] - self.point[axis]);
            loss += fall(tilt.lower, least, low, high).min(fall(tilt.upper, least, low, high));
            let reach = high.max(-low);
            size += (tilt.lower.abs().max(tilt.upper.abs()) + least.abs() * reach) * reach;
        }
        let square = way.length_squared() * (1.0 - 8.0 * f64::EPSILON);
        square + constant.lower + loss - 1e-14 * size
    }

    /// How far from `p` a point next to the foot is that certainly lies on `side`; infinite where none is found.
    ///
    /// Where `p` lies on the other side, the surface is not farther. `here` is what is certain at the foot.
    pub(super) fn beyond(&self, tape: &Tape, here: &Jet<Interval, 0>, p: DVec3, side: Side, limits: &Aabb) -> f64 {
        let mut direction = self.gradient * side.sign();
        for axis in 0..3 {
            let out = direction[axis];
            if out > 0.0 && self.point[axis] >= limits.max[axis] || out < 0.0 && self.point[axis] <= limits.min[axis] {
                direction[axis] = 0.0;
            }
        }
        let direction = direction.normalize_or_zero();
        // So far the value at the foot may be from 0.
        let doubt = 1.5 * here.value.upper.max(-here.value.lower) / self.gradient.length();
        let least = 2.0 * f64::EPSILON * (self.point.length() + p.length() + limits.diagonal());
        let mut step = if doubt.is_finite() { least.max(doubt) } else { least };
        for _ in 0..14 {
            let there = (self.point + direction * step).clamp(limits.min, limits.max);
            if Side::of(tape.certain(there)) == Some(side) {
                return (there - p).length() * (1.0 + 4.0 * f64::EPSILON);
            }
            step *= 6.0;
        }
        f64::INFINITY
    }
}

/// The point of a box nearest to `p` where `gradient . x + constant` is 0, or nearest to that, and its multiplier.
///
/// It is p - m gradient, held in the box, for the one m that meets the plane: the height falls steadily with m.
fn nearest_on_plane(p: DVec3, constant: f64, gradient: DVec3, limits: &Aabb) -> (DVec3, f64) {
    let at = |m: f64| (p - gradient * m).clamp(limits.min, limits.max);
    let height = |m: f64| gradient.dot(at(m)) + constant;
    // Where an axis is let go or held again; between two of these the height is a straight line.
    let mut turns = [0.0; 6];
    for axis in 0..3 {
        (turns[2 * axis], turns[2 * axis + 1]) =
            ((p[axis] - limits.min[axis]) / gradient[axis], (p[axis] - limits.max[axis]) / gradient[axis]);
    }
    turns.sort_unstable_by(f64::total_cmp);
    let mut before: Option<(f64, f64)> = None;
    for m in turns.into_iter().filter(|m| m.is_finite()) {
        let high = height(m);
        if high <= 0.0 {
            let m = match before {
                Some((last, above)) if above > high => last + (m - last) * (above / (above - high)),
                _ => m,
            };
            return (at(m), m);
        }
        before = Some((m, high));
    }
    let m = before.map_or(0.0, |(m, _)| m);
    (at(m), m)
}

/// One step along the free axes, and the next multiplier: (I + multiplier H) step + gradient m = away, gradient . step = -value.
fn newton(hessian: &[f64; 6], value: f64, gradient: DVec3, away: DVec3, free: DVec3, multiplier: f64) -> Option<(DVec3, f64)> {
    let (slope, away) = (gradient * free, away * free);
    let square = slope.length_squared();
    if !(square > 0.0) {
        return None;
    }
    let multiplier = if multiplier.is_nan() { slope.dot(away) / square } else { multiplier };
    let (with_away, with_slope) =
        solve(hessian, multiplier, free, away, slope).filter(|(_, s)| s.dot(slope) > 1e-3 * square).unwrap_or((away, slope));
    let next = (slope.dot(with_away) + value) / slope.dot(with_slope);
    let step = with_away - with_slope * next;
    (step.is_finite() && next.is_finite()).then_some((step, next))
}

/// Solutions for two right sides of (I + `scale` H) x = b on the free axes, where that matrix is positive.
fn solve(hessian: &[f64; 6], scale: f64, free: DVec3, a: DVec3, b: DVec3) -> Option<(DVec3, DVec3)> {
    let [xx, yy, zz, xy, xz, yz] = hessian.map(|h| h * scale);
    let (xx, yy, zz) = (1.0 + xx * free.x, 1.0 + yy * free.y, 1.0 + zz * free.z);
    let (xy, xz, yz) = (xy * free.x * free.y, xz * free.x * free.z, yz * free.y * free.z);
    // Cholesky's decomposition without roots.
    let d0 = xx;
    if !(d0 > 1e-6) {
        return None;
    }
    let (l1, l2) = (xy / d0, xz / d0);
    let d1 = yy - l1 * xy;
    if !(d1 > 1e-6) {
        return None;
    }
    let l3 = (yz - l1 * xz) / d1;
    let d2 = zz - l2 * xz - l3 * l3 * d1;
    if !(d2 > 1e-6) {
        return None;
    }
    let one = |v: DVec3| {
        let y0 = v.x;
        let y1 = v.y - l1 * y0;
        let y2 = v.z - l2 * y0 - l3 * y1;
        let z = y2 / d2;
        let y = y1 / d1 - l3 * z;
        let x = y0 / d0 - l1 * y - l2 * z;
        DVec3::new(x, y, z) * free
    };
    Some((one(a), one(b)))
}
