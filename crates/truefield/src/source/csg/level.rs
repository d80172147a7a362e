//! Where the distance is, of a shape that is known by its values only.
//!
//! A value has the sign of the distance, vanishes on the surface and changes by no more than one moves. So the distance
//! is at least as far from zero; and a point found on the other side says how far it is at most.

use crate::distance::Source;
use crate::geom::{Aabb, DVec3, Interval};

use super::exit;

/// Directions tried besides the gradient's.
const AXES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

/// Steps of a ray: enough to cross what is worth crossing.
const STEPS: u32 = 64;

/// Rays are turned no finer than this.
const LEAST_TURN: f64 = 0.02;

/// The distance at `p`: exact where the gradient leads straight to the surface and out on its other side, else from the
/// value to the nearest point that some rays find on the other side.
///
/// `beside` is a point of one side, if one is known: rays are sent there, too.
pub fn at(shape: &dyn Source, p: DVec3, beside: Option<DVec3>) -> Interval {
    let Some(asked) = Asked::new(shape, p, beside) else { return Interval::ALL };
    asked.interval()
}

/// [`Source::slack`] of a shape that is known by its values only.
///
/// Where the gradient has length 1, as `unit` says of boxes, the distance is the value wherever the slope does not jump
/// between a cell and the surface.
pub fn slack(shape: &dyn Source, cell: &Aabb, beside: Option<DVec3>, unit: impl Fn(&Aabb) -> bool) -> Interval {
    let (center, radius) = (cell.center(), cell.radius() * (1.0 + 1e-9));
    let Some(asked) = Asked::new(shape, center, beside) else { return Interval::ALL };
    if straight(&asked, cell, unit) {
        return Interval::exact(0.0);
    }
    let (value, distance) = (asked.value, asked.interval());
    let (clear, far) = (radius + asked.rounding, 2.0 * radius + asked.rounding);
    // The distance is farther from zero than the value, on the same side of it.
    Interval {
        lower: if value > clear { 0.0 } else { (distance.lower - value).min(0.0) - far },
        upper: if value < -clear { 0.0 } else { (distance.upper - value).max(0.0) + far },
    }
}

/// Whether slopes do not jump in the box that holds a cell and the nearest points of the surface of all its points: then
/// every point goes straight to the surface, along its gradient.
fn straight(asked: &Asked<'_>, cell: &Aabb, unit: impl Fn(&Aabb) -> bool) -> bool {
    let radius = cell.radius() * (1.0 + 1e-9);
    let foot = asked.p - asked.gradient * asked.value;
    let (mut reach, mut tilt) = (radius, None);
    // Nearest points spread as far as the slope turns over the way; the box that is looked at has to hold them.
    for _ in 0..3 {
        let whole = around(cell, foot, reach);
        let bend = asked.shape.bend(&whole);
        let most = bend.upper.max(-bend.lower);
        if !most.is_finite() {
            return false;
        }
        let way = asked.value.abs();
        // A foot is as far off as the slope is, over the way; of what is not known to be steep no box is wide enough.
        let off = *tilt.get_or_insert_with(|| asked.shape.tilt(asked.p)) * way;
        let spread = radius * (1.0 + (way + radius) * most) * (1.0 + 1e-9) + off + 2.0 * asked.rounding;
        if spread <= reach {
            return unit(&whole);
        }
        if !spread.is_finite() {
            return false;
        }
        reach = 1.5 * spread;
    }
    false
}

/// A point of a box that is outside of a shape, if walking up the values from a few places finds one.
pub fn outside(shape: &dyn Source, extent: &Aabb) -> Option<DVec3> {
    (0..LOOKS).find_map(|i| {
        // Evenly spread, whatever their number.
        let share = SPREAD * f64::from(i) + 0.5;
        let mut p = extent.min + extent.size() * (share - share.floor());
        for _ in 0..WALK {
            let value = value(shape, p)?;
            if value > shape.noise() {
                return Some(p);
            }
            let mut slope = [DVec3::ZERO];
            shape.gradients(&[p], &mut slope).ok()?;
            p += slope[0] * (1.01 * value.abs());
        }
        None
    })
}

/// Powers of the inverse of the number whose fourth power is one more than it: no places crowd.
const SPREAD: DVec3 = DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_1);

/// Places from where a point outside is looked for, and steps of each walk.
const LOOKS: u32 = 64;
const WALK: usize = 6;

/// The box of a cell and a ball.
fn around(cell: &Aabb, center: DVec3, radius: f64) -> Aabb {
    cell.union(Aabb::new(center, center).grow(radius))
}

/// A shape asked at a point.
struct Asked<'a> {
    shape: &'a dyn Source,
    p: DVec3,
    value: f64,
    gradient: DVec3,
    /// What rounding and solving may do to values here.
    rounding: f64,
    beside: Option<DVec3>,
}

impl<'a> Asked<'a> {
    /// `None` where the shape cannot be asked.
    fn new(shape: &'a dyn Source, p: DVec3, beside: Option<DVec3>) -> Option<Self> {
        let (value, mut gradient) = (value(shape, p)?, [DVec3::ZERO]);
        shape.gradients(&[p], &mut gradient).ok()?;
        let rounding = shape.noise() + 64.0 * f64::EPSILON * (p.abs().max_element() + value.abs());
        Some(Self { shape, p, value, gradient: gradient[0].normalize_or(DVec3::X), rounding, beside })
    }

    /// Away from the side that the point is on.
    fn across(&self) -> DVec3 {
        if self.value < 0.0 { self.gradient } else { -self.gradient }
    }

    /// How far the way leads beyond the surface: 0 at it, positive on the other side.
    fn beyond(&self, q: DVec3) -> Option<f64> {
        value(self.shape, q).map(|value| if self.value < 0.0 { value } else { -value })
    }

    fn interval(&self) -> Interval {
        let way = self.value.abs();
        let solved = self.shape.noise();
        if way <= self.rounding || self.leads_out() {
            return Interval::around(self.value, if solved > ROUNDED * way { solved } else { 0.0 });
        }
        let most = self.exit().filter(|exit| *exit <= NEAR * way).unwrap_or_else(|| self.farthest());
        if self.value < 0.0 {
            Interval { lower: -most, upper: self.value + solved }
        } else {
            Interval { lower: self.value - solved, upper: most }
        }
    }

    /// Whether the gradient leads to the surface in just the way the value says, and out on the other side.
    fn leads_out(&self) -> bool {
        let (way, across) = (self.value.abs(), self.across());
        let step = (1e-6 * way).max(1e3 * self.rounding);
        let (Some(there), Some(past)) = (self.beyond(self.p + across * way), self.beyond(self.p + across * (way + step))) else {
            return false;
        };
        there >= -4.0 * self.rounding && past >= 0.5 * step
    }

    /// The way to the other side by tangent planes, straight ahead and, where that is long, looking aside first.
    fn exit(&self) -> Option<f64> {
        let beyond = |step: DVec3| self.beyond(self.p + step);
        let slope = |step: DVec3| {
            if step == DVec3::ZERO {
                return Some(self.across());
            }
            let mut slope = [DVec3::ZERO];
            self.shape.gradients(&[self.p + step], &mut slope).ok()?;
            Some(if self.value < 0.0 { slope[0] } else { -slope[0] })
        };
        let clear = 2.0 * self.rounding;
        let mut best = exit::shortest(clear, DVec3::ZERO, beyond, slope).unwrap_or(f64::INFINITY);
        let way = self.value.abs();
        if best > ASIDE * way {
            let (u, w) = self.gradient.any_orthonormal_pair();
            for aside in [u, -u, w, -w] {
                best = best.min(exit::shortest(clear, aside * way, beyond, slope).unwrap_or(f64::INFINITY));
            }
        }
        best.is_finite().then_some(best * (1.0 + 4.0 * f64::EPSILON))
    }

    /// The way to the nearest point that rays find on the other side; infinite where they find none.
    fn farthest(&self) -> f64 {
        let mut best = (f64::INFINITY, DVec3::ZERO);
        if let Some(there) = self.beside.filter(|&there| self.beyond(there).is_some_and(|beyond| beyond > self.rounding)) {
            let (direction, way) = (there - self.p).normalize_and_length();
            best = (self.first(direction, self.value.abs(), way), direction);
        }
        for direction in std::iter::once(self.across()).chain(AXES) {
            self.shorten(direction, &mut best);
        }
        // Turned aside, less and less: ends of short ways lie on edges, too, where no slope leads along.
        let mut turn = 0.5;
        while best.0.is_finite() && turn > LEAST_TURN {
            let (before, ahead) = (best.0, best.1);
            let (u, w) = ahead.any_orthonormal_pair();
            for aside in [u, -u, w, -w] {
                self.shorten((ahead + aside * turn).normalize(), &mut best);
            }
            if best.0 > before * (1.0 - 0.1 * turn * turn) {
                turn *= 0.5;
            }
        }
        best.0
    }

    /// Keeps a ray if it ends nearer than the best so far.
    fn shorten(&self, direction: DVec3, best: &mut (f64, DVec3)) {
        if direction != DVec3::ZERO
            && let Some(way) = self.ray(direction, best.0)
        {
            *best = (way, direction);
        }
    }

    /// The way along a ray to the other side, if it is less than `limit`.
    fn ray(&self, direction: DVec3, limit: f64) -> Option<f64> {
        let (mut here, mut ahead) = (self.value.abs(), self.value.abs());
        let least = 0.01 * here + 4.0 * self.rounding;
        for step in 0..STEPS {
            if !(ahead < limit) {
                return None;
            }
            let beyond = self.beyond(self.p + direction * ahead)?;
            if beyond > self.rounding {
                return Some(self.first(direction, here, ahead));
            }
            here = ahead;
            // Ever longer: along a wall that parts share values stay next to nothing.
            ahead += (-beyond).max(least * f64::from(step / 2).exp2());
        }
        None
    }

    /// The end of a ray, back to where it crossed.
    fn first(&self, direction: DVec3, mut here: f64, mut across: f64) -> f64 {
        for _ in 0..20 {
            let middle = 0.5 * (here + across);
            if self.beyond(self.p + direction * middle).is_some_and(|beyond| beyond > self.rounding) {
                across = middle;
            } else {
                here = middle;
            }
        }
        across * (1.0 + 4.0 * f64::EPSILON)
    }
}

/// Ways out of a corner between two walls at right angles, or three, are shorter than so many times the value.
const ASIDE: f64 = 1.8;

/// A way out that is no longer than this many times the value is not looked for any further.
const NEAR: f64 = 16.0;

/// Noise below this part of a distance is rounding.
const ROUNDED: f64 = 1e-12;

/// One value; `None` where the shape cannot be asked.
pub fn value(shape: &dyn Source, p: DVec3) -> Option<f64> {
    let mut out = [0.0];
    shape.values(&[p], &mut out).ok()?;
    Some(out[0]).filter(|value| !value.is_nan())
}
