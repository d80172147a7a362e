//! The other side: next to it the surface is not farther.

use super::super::sheet::{Content, Side};
use super::super::tape::Tape;
use super::Search;
use crate::geom::{Aabb, DVec3};

impl Search<'_> {
    /// Tries whether the middle of a box, or a point behind it, is beyond the surface; then the surface is on the way.
    pub(super) fn probe(&mut self, extent: &Aabb) {
        let start = self.p.clamp(self.domain.min, self.domain.max);
        let middle = extent.center();
        let behind = middle + (middle - self.p).normalize_or_zero() * extent.diagonal();
        let beyond = |point: DVec3| Side::of(self.tape.certain(point)) == Some(self.side.other());
        for target in [middle, behind.clamp(self.domain.min, self.domain.max)] {
            if (target - self.p).length() >= self.upper + extent.diagonal() || !beyond(target) {
                continue;
            }
            // Halving finds where the side changes; the last point beyond is what counts.
            let (mut here, mut there) = (0.0, 1.0);
            let way = target - start;
            while (there - here) * way.length() > 0.1 * self.accuracy.rough {
                let half = 0.5 * (here + there);
                if beyond(start + way * half) {
                    there = half;
                } else {
                    here = half;
                }
            }
            let point = start + way * there;
            let far = (point - self.p).length() * (1.0 + 4.0 * f64::EPSILON);
            // Rounding may put it elsewhere than where it was tried.
            if far < self.upper && beyond(point) {
                self.upper = far;
                self.foot = Some(point);
            }
            break;
        }
    }

    /// Looks for the other side around a box that is as small as boxes get.
    pub(super) fn scan(&mut self, extent: &Aabb) {
        let center = extent.center();
        let far = both_sides(self.tape, self.domain, center, 0.5 * extent.size().max_element(), Some(self.side.other()));
        let reached = (center - self.p).length() + far;
        if reached < self.upper {
            self.upper = reached;
            self.foot = Some(center);
        }
    }

    /// What is left of a box without those halves, next to the point, that have no surface.
    pub(super) fn shaved(&self, extent: &Aabb) -> Aabb {
        let mut rest = *extent;
        for axis in 0..3 {
            let below = self.p[axis] < rest.min[axis];
            if !below && self.p[axis] <= rest.max[axis] {
                continue;
            }
            while rest.size()[axis] > 0.125 * self.accuracy.rough {
                let middle = rest.center()[axis];
                let (mut near, mut far) = (rest, rest);
                if below {
                    (near.max[axis], far.min[axis]) = (middle, middle);
                } else {
                    (near.min[axis], far.max[axis]) = (middle, middle);
                }
                if !matches!(Content::of(self.tape, &near), Content::Nothing(_)) {
                    break;
                }
                rest = far;
            }
        }
        rest
    }
}

/// How far from a point of the domain a side is certainly found, or both; `step` is where the search starts.
pub(in super::super) fn both_sides(tape: &Tape, domain: &Aabb, p: DVec3, step: f64, wanted: Option<Side>) -> f64 {
    let size = domain.diagonal();
    let gradient = tape.gradient(p).normalize_or_zero();
    let mut step = step.max(f64::EPSILON * (size + p.length()));
    let (mut inside, mut outside) = match wanted {
        None => (f64::INFINITY, f64::INFINITY),
        Some(Side::Inside) => (f64::INFINITY, 0.0),
        Some(Side::Outside) => (0.0, f64::INFINITY),
    };
    while step < size && !(inside.max(outside) < f64::INFINITY) {
        let around = (0..27).map(|k| DVec3::new(f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1)).normalize_or_zero());
        for direction in [gradient, -gradient].into_iter().chain(around) {
            let there = (p + direction * step).clamp(domain.min, domain.max);
            let far = (there - p).length() * (1.0 + 4.0 * f64::EPSILON);
            match Side::of(tape.certain(there)) {
                Some(Side::Inside) => inside = inside.min(far),
                Some(Side::Outside) => outside = outside.min(far),
                None => {}
            }
        }
        step *= 4.0;
    }
    inside.max(outside)
}
