//! A formula as a shape.

use super::boxes::Boxes;
use super::expression::Expression;
use super::search::{Accuracy, Effort, Found, Search, both_sides};
use super::sheet::Side;
use super::tape::Tape;
use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;

/// Bounds of the distance meet to within so many times what rounding of the formula moves the surface by.
const BLURRED: f64 = 4.0;

/// The part of a domain where a formula is negative, with its true distance.
///
/// The domain bounds the solid: where the formula is negative on a face of the domain, the face is surface, so that the
/// surface is closed. The formula is never asked outside the domain.
///
/// Its own values are no distances and are not used as such. A hierarchy of boxes holds all places where interval arithmetic
/// cannot exclude a zero. A query begins with the foot that Newton's method finds from the box that seems nearest, goes through
/// the others, nearest first, proves from second derivatives that no surface of a box is nearer than the nearest foot, and by a
/// change of sign that the surface is not farther.
#[derive(Clone, Debug)]
pub struct Implicit {
    tape: Tape,
    domain: Aabb,
    boxes: Boxes,
    accuracy: Accuracy,
    extent: Aabb,
}

impl Implicit {
    /// The part of `domain` where `expression` is negative.
    ///
    /// Fails where the domain is not a box with finite corners and a volume, where the expression is positive
    /// throughout, or has numbers in it that are not finite.
    pub fn new(expression: &Expression, domain: Aabb, run: &Run<'_>) -> Result<Self> {
        if !domain.min.is_finite() || !domain.max.is_finite() || !domain.min.cmplt(domain.max).all() || !domain.diagonal().is_finite() {
            return Err(Error::invalid(format!(
                "the domain reaches from {} to {}; give the lowest and the highest corner of a box, both finite",
                domain.min, domain.max
            )));
        }
        let tape = Tape::new(expression)?;
        let boxes = Boxes::build(&tape, &domain, run)?.checked(&tape, &domain)?;
        let size = domain.diagonal() + f64::EPSILON.sqrt() * domain.min.abs().max(domain.max.abs()).max_element();
        // No search locates the surface better than the formula is rounded: bounds stay apart by twice that, more or less.
        let blur = boxes.taylors.iter().fold(0.0_f64, |blur, taylor| blur.max(taylor.blur));
        let accuracy = Accuracy { smooth: 1e-10 * size, hard: (1e-6 * size).max(BLURRED * blur), rough: 1e-4 * size };
        let extent = boxes.solid;
        Ok(Self { tape, domain, boxes, accuracy, extent })
    }

    /// The box that bounds the solid.
    pub fn domain(&self) -> Aabb {
        self.domain
    }

    /// The number of boxes of the hierarchy that may hold surface.
    pub fn boxes(&self) -> usize {
        self.boxes.nodes.iter().filter(|node| node.count == 0).count()
    }

    /// Where the surface of the formula within the domain seems nearest to `p`; `None` where the faces of the domain are
    /// nearer, or the formula vanishes nowhere.
    pub fn foot(&self, p: DVec3) -> Option<DVec3> {
        let inner = p.clamp(self.domain.min, self.domain.max);
        let side = self.side(inner)?;
        let found = self.search(p, side, Effort::Short);
        found.foot.filter(|_| side == Side::Outside || p == inner)
    }

    /// The distance to the formula's surface within the domain, inside only where it is nearer than the faces; `side` is that
    /// of the nearest point of the domain.
    pub(super) fn search(&self, p: DVec3, side: Side, effort: Effort) -> Found {
        // The faces of the domain are surface to what is inside.
        let limit = if side == Side::Inside { self.depth(p) } else { f64::INFINITY };
        Search::new(&self.tape, &self.domain, &self.boxes, self.accuracy, p, side, limit).run(effort)
    }

    /// The side of a point of the domain, where it is certain.
    pub(super) fn side(&self, p: DVec3) -> Option<Side> {
        Side::at(&self.tape, &self.domain, p)
    }

    pub(super) fn tape(&self) -> &Tape {
        &self.tape
    }

    pub(super) fn tree(&self) -> &Boxes {
        &self.boxes
    }

    /// How deep a point of the domain lies below its faces.
    pub(super) fn depth(&self, p: DVec3) -> f64 {
        (p - self.domain.min).min(self.domain.max - p).min_element()
    }

    /// The direction in which the distance grows at `p`: away from the foot, or from the nearest face of the domain.
    pub(super) fn direction(&self, p: DVec3) -> DVec3 {
        let inner = p.clamp(self.domain.min, self.domain.max);
        let slope = || self.tape.gradient(inner).normalize_or_zero();
        let Some(side) = self.side(inner) else { return slope() };
        if side == Side::Inside && p != inner {
            return (p - inner).normalize_or_zero();
        }
        match self.search(p, side, Effort::Short).foot {
            Some(foot) if (p - foot).length() > 1e-6 * self.domain.diagonal() => (p - foot).normalize_or_zero() * side.sign(),
            Some(foot) if foot.cmpgt(self.domain.min).all() && foot.cmplt(self.domain.max).all() => slope(),
            Some(foot) => (p - foot).normalize_or_zero() * side.sign(),
            None => {
                let (low, high) = (p - self.domain.min, self.domain.max - p);
                let depth = self.depth(p);
                DVec3::AXES
                    .into_iter()
                    .enumerate()
                    .find_map(|(axis, unit)| match () {
                        () if low[axis] == depth => Some(-unit),
                        () if high[axis] == depth => Some(unit),
                        () => None,
                    })
                    .unwrap_or(DVec3::ZERO)
            }
        }
    }

    /// What is known of the distance, and the number that fields sample, where that is as near as the noise to the distance or
    /// to the next leaf that says itself how much farther the surface may be.
    fn answer(&self, p: DVec3, effort: Effort) -> (Interval, Option<f64>) {
        if !p.is_finite() {
            return (Interval::ALL, Some(f64::NAN));
        }
        let inner = p.clamp(self.domain.min, self.domain.max);
        let apart = (p - inner).length();
        let rounding = 4.0 * f64::EPSILON * (p.abs().max_element() + inner.abs().max_element());
        let Some(side) = self.side(inner) else {
            let far = both_sides(&self.tape, &self.domain, inner, 0.0, None);
            // The side is not known, the value is as good as rounding allows.
            return if apart == 0.0 {
                (Interval { lower: -far.min(self.depth(p).max(0.0) + rounding), upper: far }, Some(0.0))
            } else {
                (Interval { lower: apart - rounding, upper: apart + far + rounding }, Some(apart))
            };
        };
        if side == Side::Inside && apart > 0.0 {
            return (Interval::around(apart, rounding), Some(apart));
        }
        let Found { mut lower, mut upper, left, .. } = self.search(p, side, effort);
        if side == Side::Inside {
            let depth = self.depth(p);
            (lower, upper) = (lower.min(depth - rounding).max(0.0), upper.min(depth + rounding));
        } else {
            lower = lower.max(apart - rounding);
        }
        // Where the surface cannot be located, the value is the distance to where it may be.
        let value = match () {
            () if upper - lower <= 2.0 * self.noise() => Some(0.5 * lower + 0.5 * upper),
            () if left > lower => Some(lower),
            () => None,
        };
        let interval = Interval { lower, upper };
        match side {
            Side::Inside => (interval.negated(), value.map(|value| -value)),
            Side::Outside => (interval, value),
        }
    }
}

/// Where a search ends before bounds meet.
fn open(p: DVec3, bounds: Interval) -> Error {
    Error::invalid(format!(
        "the distance at {p} is only known to be from {} to {}: much of the surface is about as far, or rounding blurs it; \
         write the expression with fewer terms and smaller numbers, or take bounds there",
        bounds.lower, bounds.upper
    ))
}

impl Distance for Implicit {
    fn extent(&self) -> Option<Aabb> {
        Some(self.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        self.answer(p, Effort::Short).0
    }
}

impl Source for Implicit {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (&p, out) in points.iter().zip(out) {
            let (bounds, value) = self.answer(p, Effort::Whole);
            *out = value.ok_or_else(|| open(p, bounds))?;
            if out.is_nan() || self.tape.value(p.clamp(self.domain.min, self.domain.max)).is_nan() {
                return Err(Error::invalid(format!(
                    "the expression is not a number at {p}; give a domain in which its roots, logarithms and quotients are defined"
                )));
            }
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (&p, out) in points.iter().zip(out) {
            *out = self.direction(p);
        }
        Ok(())
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let at = self.at(cell.center());
        let radius = cell.radius() * (1.0 + 1e-15);
        let near = at.upper.max(-at.lower) + radius;
        // Where bounds meet, the value is their middle and less than the noise from the distance. Elsewhere it is nearer to zero:
        // how far a box is that may hold surface. `known` says how much farther the surface is than any point of such a box,
        // and no such box is nearer than the next of them. There are no other values: see `answer`. Which of them it is, a
        // search from the middle of the cell does not say: searches end at different boxes.
        let met = 2.0 * self.noise();
        let error = (self.boxes.known_near(cell, near) + met).min(met.max(near - self.boxes.open_beyond(cell)));
        Interval { lower: if at.lower > radius { -met } else { -error }, upper: if at.upper < -radius { met } else { error } }
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        super::bend::bend(self, cell)
    }

    fn tilt(&self, p: DVec3) -> f64 {
        super::tilt::tilt(self, p)
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        super::residual::residual(self, block, out)
    }

    fn noise(&self) -> f64 {
        let Accuracy { hard, rough, .. } = self.accuracy;
        if self.boxes.rough { rough.max(hard).max(self.boxes.widest) } else { hard }
    }
}
