//! The nearest point of one sheet: found in plain numbers, then proven.

use super::jet::Jet;
use super::matrix::{fall, middle, middle_of};
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

/// What is proven around a foot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Proof {
    /// The surface is no nearer, squared,
    pub bound: f64,
    /// in this box.
    pub within: Aabb,
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

    /// What is proven of the squared distance from `p` to the surface around the foot, where the formula is as `sheet` says.
    ///
    /// With x the foot, q = x + u on the surface and H a mean of second derivatives between them, f(x) + g u + u H u / 2 = 0, so
    /// that |q - p|^2 = |x - p|^2 + 2 a f(x) + 2 (x - p + a g) u + u (I + a H) u for any a. The same equation says that u leaves
    /// the tangent plane by no more than the surface bends: there the last term is nearly that of tangential directions.
    /// `here` is what is certain at the foot, `reach` holds it and is a part of where `sheet` holds.
    pub(super) fn proof(&self, here: &Jet<Interval, 0>, p: DVec3, sheet: &Sheet, reach: &Aabb) -> Proof {
        let x = self.point;
        let (slope, doubt) = middle_of(&here.gradient);
        let steepness = slope.length() - doubt;
        let way = x - p;
        // Faces of the box hold the foot back: beyond them is nothing to be nearer.
        let free =
            DVec3::from_array(std::array::from_fn(|axis| if x[axis] > reach.min[axis] && x[axis] < reach.max[axis] { 1.0 } else { 0.0 }));
        let square = (slope * free).length_squared();
        let a = if square > 0.0 { -way.dot(slope * free) / square } else { self.multiplier };
        let size = sheet.turns.upper.max(-sheet.turns.lower);
        let nothing = Proof { bound: f64::NEG_INFINITY, within: *reach };
        if !(steepness > 0.0 && a.is_finite() && size.is_finite()) {
            return nothing;
        }
        let bend = sheet.bend(a, slope / slope.length());
        let most = (reach.max - x).max(x - reach.min).length();
        let off = |most: f64| (0.5 * size * most + doubt) / steepness * (1.0 + 1e-14);
        let (mut least, mut within) = (bend.whole.max(bend.least(off(most))), *reach);
        if !(least > 0.0) {
            // Nearer to the foot, less leaves the tangent plane.
            let near = 0.9 * 2.0 * (bend.most_off() * steepness - doubt) / size;
            if near > 0.0 {
                let half = near / 3.0_f64.sqrt();
                (least, within) = (bend.least(off(near)), Aabb::new((x - half).max(reach.min), (x + half).min(reach.max)));
            }
        }
        // What the value at the foot, if not 0, moves q off the tangent plane.
        let aside = here.value.upper.max(-here.value.lower) / steepness * (1.0 + 1e-14);
        let blur = aside * (bend.mixed + bend.both() * off(most)) + a.abs() * doubt;
        let (mut loss, mut total) = (0.0, 0.0);
        for axis in 0..3 {
            let back = way[axis] + a * slope[axis];
            let open = blur + 4.0 * f64::EPSILON * (way[axis].abs() + (a * slope[axis]).abs());
            let (low, high) = (within.min[axis] - x[axis], within.max[axis] - x[axis]);
            loss += fall(2.0 * (back - open), least, low, high).min(fall(2.0 * (back + open), least, low, high));
            let reach = high.max(-low);
            total += (2.0 * (back.abs() + open) + least.abs() * reach) * reach;
        }
        let value = here.value.mul(Interval::exact(2.0 * a));
        let square = way.length_squared() * (1.0 - 8.0 * f64::EPSILON);
        Proof { bound: square + value.lower + loss - bend.both() * aside * aside - 1e-14 * total, within }
    }

    /// How far from `p` the surface is at most, which lies between `p` and a point next to the foot, on `side`.
    ///
    /// `here` is what is certain at the foot.
    pub(super) fn reached(&self, tape: &Tape, here: &Jet<Interval, 0>, p: DVec3, side: Side, sheet: &Sheet, limits: &Aabb) -> f64 {
        let (slope, doubt) = middle_of(&here.gradient);
        let (level, radius) = middle(here.value);
        let (steepness, normal) = (slope.length(), slope.normalize_or_zero());
        let size = sheet.turns.upper.max(-sheet.turns.lower);
        // Onto the tangent plane, and beyond what the formula may differ from it.
        let onto = -level / steepness;
        let least = 2.0 * f64::EPSILON * (self.point.abs().max_element() + p.abs().max_element() + limits.diagonal());
        let more = 2.0 * (radius + doubt * onto.abs() + size * onto * onto) / steepness + least;
        let far = onto + more * side.sign();
        let there = self.point + normal * far;
        let sure = more * steepness * (1.0 - 1e-14) - radius - doubt * far.abs() - 0.5 * size * far * far * (1.0 + 1e-14) > 0.0;
        if sure && sheet.extent.contains(there - least) && sheet.extent.contains(there + least) {
            return (there - p).length() * (1.0 + 4.0 * f64::EPSILON) + least;
        }
        self.beyond(tape, here, p, side, limits)
    }

    /// How far from `p` a point next to the foot is that certainly lies on `side`; infinite where none is found.
    ///
    /// Where `p` lies on the other side, the surface is not farther. `here` is what is certain at the foot.
    fn beyond(&self, tape: &Tape, here: &Jet<Interval, 0>, p: DVec3, side: Side, limits: &Aabb) -> f64 {
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
    // Along the gradient the step is given: what is added there makes the matrix positive and changes the multiplier only.
    let bent = hessian.iter().map(|h| h.abs()).sum::<f64>();
    let weight = 2.0 * multiplier.abs() * bent / square;
    let (with_away, with_slope, weight) = solve(hessian, multiplier, free, weight, slope, away)
        .filter(|(_, s)| s.dot(slope) * (1.0 + weight * square) > 1e-3 * square)
        .map_or((away, slope, 0.0), |(a, s)| (a, s, weight));
    let next = (slope.dot(with_away) + value) / slope.dot(with_slope);
    let step = with_away - with_slope * next;
    let next = next - weight * value;
    (step.is_finite() && next.is_finite()).then_some((step, next))
}

/// Solutions of (I + `scale` H + `weight` b b^T) x = a on the free axes and of the same for b, where that matrix is positive.
fn solve(hessian: &[f64; 6], scale: f64, free: DVec3, weight: f64, b: DVec3, a: DVec3) -> Option<(DVec3, DVec3)> {
    let [xx, yy, zz, xy, xz, yz] = hessian.map(|h| h * scale);
    let more = b * weight;
    let (xx, yy, zz) = (1.0 + xx * free.x + more.x * b.x, 1.0 + yy * free.y + more.y * b.y, 1.0 + zz * free.z + more.z * b.z);
    let (xy, xz, yz) = (xy * free.x * free.y + more.x * b.y, xz * free.x * free.z + more.x * b.z, yz * free.y * free.z + more.y * b.z);
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
