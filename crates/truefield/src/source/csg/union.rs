//! Many shapes as one: what lies in any of them.

use std::sync::Arc;

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, Affine, DVec3, Interval};
use crate::source::tangent;

use super::boxes::Boxes;
use super::kept::is_exact_outside;
use super::level;
use crate::source::kink::{self, Operand, Seam};

/// The union: the least of the values.
///
/// Outside, it is the distance if those of the parts are. Inside, the surface may be farther where parts overlap; where
/// the nearest point of the deepest part lies in no other, it is not.
#[derive(Clone)]
pub struct Union {
    parts: Vec<Arc<dyn Source>>,
    extent: Option<Aabb>,
    /// Over those parts whose boxes bound their values, named by `bounded`.
    boxes: Boxes,
    bounded: Vec<u32>,
    /// All others.
    loose: Vec<u32>,
    /// Those whose values may have the wrong sign.
    doubtful: Vec<u32>,
    noise: f64,
    /// A point that is in no part, where one was looked for.
    beside: Option<DVec3>,
}

/// A part that may have the least value somewhere in a cell, and its value at the middle.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    part: usize,
    value: f64,
}

/// Up to so many parts are simply all asked.
const FEW: usize = 4;

/// So many points are worth asking all parts first which of them matter there.
const SHARED: usize = 16;

/// Points asked together, and the candidates up to which that pays.
const GROUP: usize = 64;
const TOGETHER: usize = 24;

/// More candidates than this bend in every way.
const MANY: usize = 48;

impl Union {
    /// The union of at least one shape.
    pub fn new(parts: Vec<Arc<dyn Source>>) -> Result<Self> {
        if parts.is_empty() {
            return Err(Error::invalid("no shapes were given; give at least one"));
        }
        let extent = parts.iter().map(|part| part.extent()).reduce(|a, b| Some(a?.union(b?))).flatten();
        let few = parts.len() <= FEW;
        let (bounded, loose): (Vec<u32>, Vec<u32>) = (0..parts.len() as u32).partition(|&i| !few && is_exact_outside(&*parts[i as usize]));
        let boxes = Boxes::new(bounded.iter().filter_map(|&i| parts[i as usize].extent()).collect());
        let doubtful = (0..parts.len() as u32).filter(|&i| !parts[i as usize].sided()).collect();
        let noise = parts.iter().map(|part| part.noise()).fold(0.0, f64::max);
        Ok(Self { parts, extent, boxes, bounded, loose, doubtful, noise, beside: None })
    }

    /// Looks for a point of a box that is in no part: what surrounds everything but a bounded solid has to know where that is.
    pub(super) fn look_within(mut self, extent: Option<Aabb>) -> Self {
        self.beside = extent.and_then(|extent| level::outside(&self, &extent));
        self
    }

    /// The parts that may have the least value somewhere in the cell; `None` where they are more than `most`.
    fn candidates(&self, cell: &Aabb, most: usize) -> Result<Option<Vec<Candidate>>> {
        let (center, radius) = (cell.center(), cell.radius() * (1.0 + 1e-12) + self.noise);
        let (mut found, mut limit, mut failure) = (Vec::new(), f64::INFINITY, None);
        let mut ask = |part: usize, limit: &mut f64| {
            let mut value = [0.0];
            if let Err(error) = self.parts[part].values(&[center], &mut value) {
                failure.get_or_insert(error);
                return false;
            }
            *limit = limit.min(value[0] + radius);
            found.push(Candidate { part, value: value[0] });
            found.len() <= 2 * most
        };
        if self.loose.iter().all(|&part| ask(part as usize, &mut limit)) {
            self.boxes.visit(cell, limit, |i, lowest| {
                let goes_on = ask(self.bounded[i] as usize, lowest);
                limit = *lowest;
                goes_on
            });
        }
        if let Some(error) = failure {
            return Err(error);
        }
        let asked = found.len();
        found.retain(|candidate| candidate.value - radius <= limit || candidate.value.is_nan());
        Ok((asked <= 2 * most && found.len() <= most).then_some(found))
    }

    /// The least value of each point and its part.
    fn each(&self, points: &[DVec3], mut keep: impl FnMut(usize, f64, usize)) -> Result<()> {
        if let [p] = points
            && self.parts.len() <= FEW
        {
            let (mut least, mut first) = (f64::INFINITY, 0);
            for (number, part) in self.parts.iter().enumerate() {
                let mut value = [0.0];
                part.values(&[*p], &mut value)?;
                if value[0] < least || value[0].is_nan() {
                    (least, first) = (value[0], number);
                }
            }
            keep(0, least, first);
            return Ok(());
        }
        let mut values = [0.0; GROUP];
        for (group, points) in points.chunks(GROUP).enumerate() {
            let together = if self.parts.len() <= FEW && points.len() < SHARED {
                Some((0..self.parts.len()).collect())
            } else if points.len() > 1 {
                // Where the middle cannot be asked, nothing is said of the points themselves.
                let found = self.candidates(&Aabb::around(points.iter().copied()), TOGETHER).unwrap_or_default();
                found.map(|found| found.iter().map(|candidate| candidate.part).collect::<Vec<_>>())
            } else {
                None
            };
            if let Some(parts) = together {
                let mut least = [(f64::INFINITY, usize::MAX); GROUP];
                for part in parts {
                    let values = &mut values[..points.len()];
                    self.parts[part].values(points, values)?;
                    for (least, &mut value) in least.iter_mut().zip(values) {
                        if value < least.0 || value == least.0 && part < least.1 || value.is_nan() {
                            *least = (value, part);
                        }
                    }
                }
                for (i, &(value, part)) in least[..points.len()].iter().enumerate() {
                    keep(group * GROUP + i, value, part);
                }
            } else {
                for (i, &p) in points.iter().enumerate() {
                    let found = self.candidates(&Aabb::new(p, p), usize::MAX / 2)?.unwrap_or_default();
                    let least = least(&found);
                    keep(group * GROUP + i, least.value, least.part);
                }
            }
        }
        Ok(())
    }

    /// Whether every part but one is farther from `p` than `reach`.
    fn alone(&self, part: usize, p: DVec3, reach: f64) -> bool {
        let far = |other: usize| other == part || level::value(&*self.parts[other], p).is_some_and(|value| value > reach);
        if !self.loose.iter().all(|&other| far(other as usize)) {
            return false;
        }
        let mut alone = true;
        self.boxes.visit(&Aabb::new(p, p), reach, |i, _| {
            alone = far(self.bounded[i] as usize);
            alone
        });
        alone
    }

    /// Candidates without those that another one stays below, by slopes and bends.
    fn thinned(&self, cell: &Aabb, mut found: Vec<Candidate>) -> Vec<Candidate> {
        let (center, half, radius) = (cell.center(), 0.5 * cell.size(), cell.radius());
        let first = least(&found);
        let facts = |part: usize| {
            let mut slope = [DVec3::ZERO];
            self.parts[part].gradients(&[center], &mut slope).ok()?;
            let bend = self.parts[part].bend(cell);
            Some((slope[0], bend)).filter(|(slope, _)| slope.is_finite())
        };
        let Some((slope, bend)) = facts(first.part).filter(|(_, bend)| bend.upper.is_finite()) else { return found };
        found.retain(|other| {
            if other.part == first.part {
                return true;
            }
            let Some((turned, other_bend)) = facts(other.part).filter(|(_, bend)| bend.lower.is_finite()) else { return true };
            // The least that the difference can be in the cell.
            let tilt = (turned - slope).abs().dot(half);
            let curve = 0.5 * radius * radius * (bend.upper - other_bend.lower).max(0.0);
            !(other.value - first.value > (tilt + curve) * (1.0 + 1e-9) + 2.0 * self.noise)
        });
        found
    }
}

/// The candidate of the least value, the first of equals.
fn least(found: &[Candidate]) -> Candidate {
    let none = Candidate { part: 0, value: f64::NAN };
    let better = |a: Candidate, b: &Candidate| {
        let wins = b.value < a.value || b.value == a.value && b.part < a.part || a.value.is_nan();
        if wins { *b } else { a }
    };
    found.iter().fold(none, better)
}

impl Distance for Union {
    fn extent(&self) -> Option<Aabb> {
        self.extent
    }

    fn enclosure(&self) -> Option<Aabb> {
        self.parts.iter().map(|part| part.enclosure()).reduce(|a, b| Some(a?.union(b?))).flatten()
    }

    fn below(&self, cell: &Aabb) -> Affine {
        tangent::below(self, cell)
    }

    fn at(&self, p: DVec3) -> Interval {
        let Ok(Some(found)) = self.candidates(&Aabb::new(p, p), usize::MAX / 2) else { return Interval::ALL };
        let Candidate { part, value } = least(&found);
        let own = self.parts[part].at(p);
        if !self.doubtful.is_empty() {
            let each = self.doubtful.iter().map(|&part| self.parts[part as usize].at(p));
            let least = each.fold(own, |a, b| Interval { lower: a.lower.min(b.lower), upper: a.upper.min(b.upper) });
            if least.lower < 0.0 {
                // Together, parts may be deeper than each.
                return Interval { lower: f64::NEG_INFINITY, ..least };
            }
            return least;
        }
        if value >= 0.0 {
            // Another part may be nearer than this one is, but not nearer than the least value.
            return Interval { lower: own.lower.min(value), ..own };
        }
        if own.lower == own.upper && self.alone(part, p, -own.lower * (1.0 + 1e-9) + self.noise) {
            return own;
        }
        let level = level::at(self, p, self.beside);
        Interval { lower: level.lower, upper: level.upper.min(own.upper).max(level.lower) }
    }

    fn over(&self, cell: &Aabb) -> Interval {
        let Ok(Some(found)) = self.candidates(cell, MANY) else { return self.at(cell.center()).widen(cell.radius() * (1.0 + 1e-15)) };
        let radius = cell.radius() * (1.0 + 1e-12) + self.noise;
        let ranges = found.iter().map(|candidate| {
            let (part, range) = (&self.parts[candidate.part], self.parts[candidate.part].over(cell));
            // Where values are not distances, parts that are farther by value may be nearer.
            let exact = part.slack(cell).upper <= 0.0;
            Interval { lower: if exact { range.lower } else { range.lower.min(candidate.value - radius) }, ..range }
        });
        let least = ranges.reduce(|a, b| Interval { lower: a.lower.min(b.lower), upper: a.upper.min(b.upper) });
        match least {
            Some(least) if least.lower >= 0.0 && self.doubtful.is_empty() => least,
            _ => self.at(cell.center()).widen(cell.radius() * (1.0 + 1e-15)),
        }
    }
}

impl Source for Union {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        self.each(points, |i, value, _| out[i] = value)
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        let mut parts = [0; GROUP];
        for (points, out) in points.chunks(GROUP).zip(out.chunks_mut(GROUP)) {
            self.each(points, |i, _, part| parts[i] = part)?;
            for ((out, &p), &part) in out.iter_mut().zip(points).zip(&parts) {
                self.parts[part].gradients(&[p], std::slice::from_mut(out))?;
            }
        }
        Ok(())
    }

    fn tilt(&self, p: DVec3) -> f64 {
        let mut tilt = f64::INFINITY;
        let found = self.each(&[p], |_, _, part| tilt = self.parts.get(part).map_or(f64::INFINITY, |part| part.tilt(p)));
        if found.is_ok() { tilt } else { f64::INFINITY }
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let Ok(Some(mut found)) = self.candidates(cell, usize::MAX / 2) else { return Interval::ALL };
        let first = least(&found);
        for &part in &self.doubtful {
            if found.iter().all(|candidate| candidate.part != part as usize) {
                found.push(Candidate { part: part as usize, value: f64::INFINITY });
            }
        }
        let slacks: Vec<Interval> = found.iter().map(|candidate| self.parts[candidate.part].slack(cell)).collect();
        let Interval { lower, upper } = slacks.iter().copied().fold(Interval::exact(0.0), Interval::hull);
        let radius = cell.radius() * (1.0 + 1e-12) + self.noise;
        if first.value + if self.sided() { 0.0 } else { lower } > radius {
            return Interval { lower, upper };
        }
        if !self.sided() {
            return Interval { lower: f64::NEG_INFINITY, upper };
        }
        let exact = |part: usize, cell: &Aabb| self.parts[part].slack(cell) == Interval::exact(0.0);
        // No other part comes as near as the surface of the deepest one.
        let deepest = found.iter().zip(&slacks).find(|(candidate, _)| candidate.part == first.part).map(|(_, slack)| *slack);
        if let Some(slack) = deepest.filter(|slack| slack.width() <= radius)
            && self.alone(first.part, cell.center(), (radius - first.value).max(0.0) + radius + slack.upper.max(-slack.lower))
        {
            return slack;
        }
        let unit = |cell: &Aabb| {
            self.candidates(cell, MANY).is_ok_and(|found| found.is_some_and(|found| found.iter().all(|found| exact(found.part, cell))))
        };
        let level = level::slack(self, cell, self.beside, unit);
        Interval { lower: level.lower, upper: level.upper.min(upper).max(level.lower) }
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        let Ok(Some(found)) = self.candidates(cell, MANY) else { return Interval::ALL };
        let found = if found.len() > 1 { self.thinned(cell, found) } else { found };
        let bends = found.iter().map(|candidate| self.parts[candidate.part].bend(cell));
        let Some(hull) = bends.reduce(Interval::hull) else { return Interval::ALL };
        // Between two parts there is a ridge.
        if found.len() > 1 { Interval { lower: f64::NEG_INFINITY, ..hull } } else { hull }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        block.residual(block.between(Interval::ALL, self.noise), out);
        let Some(found) = self.candidates(&block.cell, MANY)? else { return Ok(()) };
        let found = if found.len() > 1 { self.thinned(&block.cell, found) } else { found };
        if let [only] = found[..] {
            return self.parts[only.part].residual(block, out);
        }
        let operands = found.iter().map(|candidate| Operand::of(&*self.parts[candidate.part], block)).collect::<Result<Vec<_>>>()?;
        kink::least(block, &operands, Seam::Sharp, out);
        Ok(())
    }

    fn is_flat(&self) -> bool {
        self.parts.iter().all(|part| part.is_flat())
    }

    fn sided(&self) -> bool {
        self.doubtful.is_empty()
    }

    fn noise(&self) -> f64 {
        self.noise
    }
}
