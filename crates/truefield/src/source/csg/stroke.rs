//! A tool moved along a path.

use std::sync::Arc;

use crate::distance::{Distance, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};

use super::capsule::Capsule;
use super::kept::is_exact_outside;
use super::level;
use super::placed::{Placement, Turning};
use super::union::Union;

/// What a ball leaves along a path of points: capsules, joined.
pub fn tube(points: &[DVec3], radius: f64) -> Result<Union> {
    let ends: Vec<[DVec3; 2]> = match points {
        [] => return Err(no_points()),
        [one] => vec![[*one, *one]],
        _ => points.windows(2).map(|ends| [ends[0], ends[1]]).collect(),
    };
    let capsules = ends.into_iter().map(|[a, b]| Capsule::new(a, b, radius).map(|capsule| Arc::new(capsule) as Arc<dyn Source>));
    Union::new(capsules.collect::<Result<_>>()?)
}

/// What a convex tool leaves along a path of poses, moving straight and turning evenly from each to the next.
pub fn sweep(tool: &Arc<dyn Source>, poses: &[Placement]) -> Result<Union> {
    let strokes: Result<Vec<Arc<dyn Source>>> = match poses {
        [] => return Err(no_points()),
        [one] => Stroke::new(tool, *one, *one).map(|stroke| vec![Arc::new(stroke) as _]),
        _ => poses.windows(2).map(|ends| Ok(Arc::new(Stroke::new(tool, ends[0], ends[1])?) as _)).collect(),
    };
    Union::new(strokes?)
}

fn no_points() -> Error {
    Error::invalid("the path has no points; give at least one")
}

/// A convex tool moved from one pose to another.
///
/// The value is the least of the tool's on the way: outside the distance, inside a bound of the depth. Found by tangents: a
/// convex tool's values along the way are convex but for what turning bends them, which is known.
#[derive(Clone)]
struct Stroke {
    tool: Arc<dyn Source>,
    from: Placement,
    to: Placement,
    way: f64,
    turning: Turning,
    extent: Aabb,
    /// Values are solved to `fine`; where turning leaves them flat along the way, `open` may be left.
    fine: f64,
    open: f64,
}

/// So many sizes away a tool is asked whether it is convex.
const AWAY: f64 = 1e3;

/// Halvings and cuts: more than any minimum takes; what is left open is below rounding.
const CUTS: usize = 1000;

/// A part of the way with the values and slopes at its ends.
#[derive(Clone, Copy, Debug)]
struct Piece {
    ends: [Probe; 2],
    /// Nothing on it is less.
    low: f64,
}

/// The tool at a share of the way.
#[derive(Clone, Copy, Debug)]
struct Probe {
    share: f64,
    value: f64,
    /// By the share.
    slope: f64,
    gradient: DVec3,
}

impl Stroke {
    fn new(tool: &Arc<dyn Source>, from: Placement, to: Placement) -> Result<Self> {
        let Some(extent) = tool.extent() else {
            return Err(Error::invalid("the tool has no end; sweep a bounded shape"));
        };
        let size = extent.diagonal();
        if !(tool.bend(&extent.grow(AWAY * size)).lower >= 0.0 && is_exact_outside(&**tool)) {
            return Err(Error::invalid("the tool is not convex; sweep its convex parts one by one and unite what they leave"));
        }
        let (way, turning) = from.way_to(&to);
        let swept = from.swept(&to, &turning, &extent);
        let reach = swept.min.abs().max(swept.max.abs()).max_element();
        // Where turning leaves the values flat, so many cuts leave this open.
        let open = turning.angle * (turning.angle * (size + way) + 2.0 * way) / (CUTS * CUTS) as f64;
        let fine = 1e-14 * (size + way) + 4.0 * f64::EPSILON * reach;
        Ok(Self { tool: Arc::clone(tool), from, to, way, turning, extent: swept, fine, open })
    }

    fn pose(&self, share: f64) -> Placement {
        self.from.toward(&self.to, &self.turning, share)
    }

    fn probe(&self, p: DVec3, share: f64) -> Result<Probe> {
        let pose = self.pose(share);
        let (own, mut value, mut gradient) = ([pose.inward(p)], [0.0], [DVec3::ZERO]);
        self.tool.values(&own, &mut value)?;
        self.tool.gradients(&own, &mut gradient)?;
        let gradient = pose.turned(gradient[0]);
        // The tool moves on, and turns about its origin.
        let (shift, spin) = self.from.velocity(&self.to, &self.turning);
        let slope = -gradient.dot(shift + spin.cross(p - pose.outward(DVec3::ZERO)));
        Ok(Probe { share, value: value[0], slope, gradient })
    }

    /// How much the values along the way may bend down, by the square of the share.
    fn sag(&self, p: DVec3) -> f64 {
        if self.turning.angle == 0.0 {
            return 0.0;
        }
        let reach = (p - self.from.outward(DVec3::ZERO)).length().max((p - self.to.outward(DVec3::ZERO)).length());
        self.turning.angle * (self.turning.angle * reach + 2.0 * self.way)
    }

    fn piece(&self, ends: [Probe; 2], sag: f64) -> Piece {
        let [a, b] = ends;
        let length = b.share - a.share;
        // Less a parabola that vanishes at the ends, it is convex; its tangents cross below it.
        let (left, right) = (a.slope - 0.5 * sag * length, b.slope + 0.5 * sag * length);
        let low = if left >= 0.0 {
            a.value
        } else if right <= 0.0 {
            b.value
        } else {
            let meet = ((b.value - a.value - right * length) / (left - right)).clamp(0.0, length);
            (a.value + left * meet).max(b.value + right * (meet - length))
        };
        Piece { ends, low: low.min(a.value).min(b.value) }
    }

    /// The least value on the way, and where.
    fn least(&self, p: DVec3) -> Result<Probe> {
        let ends = [self.probe(p, 0.0)?, self.probe(p, 1.0)?];
        let mut best = if ends[1].value < ends[0].value { ends[1] } else { ends[0] };
        if self.way == 0.0 && self.turning.angle == 0.0 {
            return Ok(best);
        }
        let sag = self.sag(p);
        let mut pieces = vec![self.piece(ends, sag)];
        for _ in 0..CUTS {
            let Some(piece) = pieces.pop() else { break };
            if piece.low >= best.value - self.fine {
                continue;
            }
            let [a, b] = piece.ends;
            let length = b.share - a.share;
            let meet = (b.value - a.value - b.slope * length) / (a.slope - b.slope);
            // Where the tangents cross, but never so near an end that nothing is cut off.
            let meet = if meet.is_finite() { meet.clamp(0.02 * length, 0.98 * length) } else { 0.5 * length };
            let middle = self.probe(p, a.share + meet)?;
            if middle.value < best.value {
                best = middle;
            }
            let mut halves = [self.piece([a, middle], sag), self.piece([middle, b], sag)];
            // The lower one next.
            if halves[0].low < halves[1].low {
                halves.swap(0, 1);
            }
            pieces.extend(halves);
        }
        Ok(best)
    }

    /// The shares of the way that can be nearest to points of a ball: where the value is not above the least by twice its radius.
    fn shares(&self, p: DVec3, radius: f64, best: Probe) -> Result<[f64; 2]> {
        let (limit, sag) = (best.value + 2.0 * radius + self.fine + self.open, self.sag(p));
        let (mut first, mut last) = (best.share, best.share);
        let mut pieces = vec![(self.piece([self.probe(p, 0.0)?, self.probe(p, 1.0)?], sag), 0)];
        while let Some((piece, depth)) = pieces.pop() {
            let [a, b] = piece.ends;
            if piece.low > limit || a.share >= first && b.share <= last {
                continue;
            }
            if depth == 6 {
                (first, last) = (first.min(a.share), last.max(b.share));
                continue;
            }
            let middle = self.probe(p, 0.5 * (a.share + b.share))?;
            pieces.push((self.piece([a, middle], sag), depth + 1));
            pieces.push((self.piece([middle, b], sag), depth + 1));
        }
        Ok([first, last])
    }

    /// How the tool bends wherever it can be nearest to points of the cell.
    fn curving(&self, cell: &Aabb) -> Result<Interval> {
        let (center, radius) = (cell.center(), cell.radius() * (1.0 + 1e-9));
        let [first, last] = self.shares(center, radius, self.least(center)?)?;
        let boxes = [first, last].map(|share| self.pose(share).inward_box(cell));
        let mut swept = boxes[0].union(boxes[1]);
        if self.turning.angle > 0.0 {
            let reach = center.distance(self.pose(first).outward(DVec3::ZERO)).max(center.distance(self.pose(last).outward(DVec3::ZERO)));
            // Farther from the chord than this, between the ends, neither the way nor the turn leads.
            let angle = self.turning.angle * (last - first);
            swept = swept.grow((reach + radius) * angle + self.way * (last - first));
        }
        let bend = self.tool.bend(&swept);
        // Moved straight, what is convex leaves what is convex; turning, different poses may be equally near.
        let lower = if self.turning.angle == 0.0 { 0.0 } else { f64::NEG_INFINITY };
        Ok(Interval { lower, upper: bend.upper })
    }
}

impl Distance for Stroke {
    fn extent(&self) -> Option<Aabb> {
        Some(self.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        match self.least(p) {
            Ok(best) if best.value >= 0.0 => Interval::exact(best.value),
            Ok(_) => level::at(self, p, None),
            Err(_) => Interval::ALL,
        }
    }
}

impl Source for Stroke {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.least(p)?.value;
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.least(p)?.gradient;
        }
        Ok(())
    }

    /// A tool that does not turn leaves a convex function, which stays above its tangent. A slope at a place on the way where
    /// the tool's value is `left` too large, and bends by no more than b, is off by left / h + b h / 2 for every h.
    fn tilt(&self, p: DVec3) -> f64 {
        let left = 2.0 * self.fine + self.open;
        let reach = (left * self.extent.diagonal()).sqrt();
        match self.least(p) {
            Ok(probe) if self.turning.angle == 0.0 && reach > 0.0 => {
                let bend = self.bend(&Aabb::new(p, p).grow(reach)).upper.max(0.0);
                self.tool.tilt(self.pose(probe.share).inward(p)) + left / reach + 0.5 * bend * reach
            }
            _ => f64::INFINITY,
        }
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let Some(value) = level::value(self, cell.center()) else { return Interval::ALL };
        if value > cell.radius() * (1.0 + 1e-9) + self.noise() {
            return Interval::exact(0.0);
        }
        let level = level::slack(self, cell, None, |_| true);
        Interval { lower: level.lower, upper: 0.0 }
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        self.curving(cell).unwrap_or(Interval::ALL)
    }

    fn noise(&self) -> f64 {
        2.0 * self.fine + self.open + self.tool.noise()
    }
}
