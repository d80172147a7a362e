//! Shapes given by a function that somebody else computes, and that may fail.

use std::sync::{Mutex, PoisonError};

use crate::distance::{Distance, SampleBlock, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::source::balls;

/// Something that computes numbers at points: negative inside the shape.
pub trait Callback: Send + Sync {
    /// One number for each point; `out` is as long as `points`.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()>;
}

/// What the numbers of a function mean, once they are divided by its Lipschitz constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// The distance is no less.
    Bound,
    /// The distance, of a shape that lies inside the domain.
    Distance,
}

/// A function that changes by no more than `lipschitz` times as far as one moves, as a shape: where it is negative is
/// inside. With a domain, it is asked there only, and the domain bounds the solid.
pub struct Function<C> {
    callback: C,
    lipschitz: f64,
    domain: Option<Aabb>,
    meaning: Meaning,
    failure: Mutex<Option<Error>>,
}

/// Points that are handed over at a time.
const BLOCK: usize = 4096;

/// Part of its size by which a function may be off what it should be: rounding.
const ROUNDING: f64 = 1e-9;

impl<C: Callback> Function<C> {
    /// Fails where the constant is not a positive number, or the domain no box.
    pub fn new(callback: C, lipschitz: f64, domain: Option<Aabb>, meaning: Meaning) -> Result<Self> {
        if !(lipschitz > 0.0 && lipschitz < f64::INFINITY) {
            return Err(Error::invalid(format!("lipschitz is {lipschitz}; give how fast the function changes at most, a positive number")));
        }
        if let Some(domain) = domain
            && !(domain.min.is_finite() && domain.max.is_finite() && domain.min.cmplt(domain.max).all())
        {
            return Err(Error::invalid(format!(
                "the domain reaches from {} to {}; give the lowest and the highest corner of a box, both finite",
                domain.min, domain.max
            )));
        }
        Ok(Self { callback, lipschitz, domain, meaning, failure: Mutex::new(None) })
    }

    /// The numbers at points of the domain, as lengths; refuses what cannot be right.
    fn ask(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (points, out) in points.chunks(BLOCK).zip(out.chunks_mut(BLOCK)) {
            self.callback.values(points, out)?;
            for index in 0..points.len() {
                if out[index].is_nan() {
                    return Err(Error::invalid(format!(
                        "the function is not a number at {}; it must be one everywhere in the domain",
                        points[index]
                    )));
                }
                out[index] /= self.lipschitz;
                if index == 0 || !points[index].is_finite() || !points[index - 1].is_finite() {
                    continue;
                }
                let (apart, change) = ((points[index] - points[index - 1]).length(), (out[index] - out[index - 1]).abs());
                let rounding = ROUNDING * (out[index].abs() + out[index - 1].abs() + points[index].length());
                if change > apart + rounding {
                    return Err(Error::invalid(format!(
                        "the function changes by {:.6} between {} and {}, {apart:.6} apart, more than lipschitz={} allows; state a larger one",
                        change * self.lipschitz,
                        points[index - 1],
                        points[index],
                        self.lipschitz
                    )));
                }
            }
        }
        Ok(())
    }

    /// The value and the interval at a point whose nearest point of the domain has the number `own`.
    fn judge(&self, p: DVec3, own: f64) -> (Interval, f64) {
        let Some(domain) = self.domain else {
            let at = match self.meaning {
                Meaning::Distance => Interval::exact(own),
                Meaning::Bound if own < 0.0 => Interval { lower: f64::NEG_INFINITY, upper: own },
                Meaning::Bound if own > 0.0 => Interval { lower: own, upper: f64::INFINITY },
                Meaning::Bound => Interval::ALL,
            };
            return (at, own);
        };
        let inner = p.clamp(domain.min, domain.max);
        let apart = (p - inner).length();
        if apart > 0.0 {
            // The surface is as far from the domain's nearest point as that says, and farther from `p`: the domain is convex.
            let least = apart.hypot(own.max(0.0));
            let most = match self.meaning {
                _ if own < 0.0 => apart,
                Meaning::Distance => apart + own,
                Meaning::Bound => f64::INFINITY,
            };
            return (Interval { lower: least, upper: most }, least);
        }
        let depth = (p - domain.min).min(domain.max - p).min_element();
        let value = own.max(-depth);
        let at = match self.meaning {
            Meaning::Distance => Interval::exact(value),
            Meaning::Bound if own < 0.0 => Interval { lower: -depth, upper: value },
            Meaning::Bound if own > 0.0 => Interval { lower: value, upper: f64::INFINITY },
            Meaning::Bound => Interval { lower: -depth, upper: f64::INFINITY },
        };
        (at, value)
    }

    /// Intervals and values, or the failure, which is remembered.
    fn answers(&self, points: &[DVec3]) -> Result<Vec<(Interval, f64)>> {
        if let Some(failure) = &*self.failure.lock().unwrap_or_else(PoisonError::into_inner) {
            return Err(failure.clone());
        }
        let inner: Vec<DVec3> = match self.domain {
            Some(domain) => points.iter().map(|p| p.clamp(domain.min, domain.max)).collect(),
            None => points.to_vec(),
        };
        let mut own = vec![0.0; points.len()];
        let asked = self.ask(&inner, &mut own).and_then(|()| match self.domain {
            Some(_) if self.meaning == Meaning::Distance => match (0..points.len()).find(|&i| own[i] < 0.0 && points[i] != inner[i]) {
                Some(index) => Err(Error::invalid(format!(
                    "the function is negative at {}, on a face of the domain; give a domain that holds the shape, or values=\"bound\"",
                    inner[index]
                ))),
                None => Ok(()),
            },
            _ => Ok(()),
        });
        if let Err(error) = asked {
            self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error.clone());
            return Err(error);
        }
        Ok(points.iter().zip(own).map(|(&p, own)| self.judge(p, own)).collect())
    }
}

impl<C: Callback> Distance for Function<C> {
    fn extent(&self) -> Option<Aabb> {
        self.domain
    }

    /// Where the function fails, nothing is known; what it failed with, [`Source::values`] says.
    fn at(&self, p: DVec3) -> Interval {
        self.answers(&[p]).map_or(Interval::ALL, |found| found[0].0)
    }

    fn at_many(&self, points: &[DVec3], out: &mut [Interval]) {
        match self.answers(points) {
            Ok(found) => out.iter_mut().zip(found).for_each(|(out, (at, _))| *out = at),
            Err(_) => out.fill(Interval::ALL),
        }
    }
}

impl<C: Callback> Source for Function<C> {
    /// Fails with what the function failed with, now or before.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, (_, value)) in out.iter_mut().zip(self.answers(points)?) {
            *out = value;
        }
        Ok(())
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        let inside = self.domain.is_none_or(|domain| domain.contains(cell.min) && domain.contains(cell.max));
        if self.meaning == Meaning::Distance && inside {
            return Interval::exact(0.0);
        }
        let Ok(found) = self.answers(&[cell.center()]) else { return Interval::ALL };
        let (at, value) = found[0];
        let moved = 2.0 * cell.radius() * (1.0 + 1e-12);
        Interval { lower: at.lower - value - moved, upper: at.upper - value + moved }
    }

    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        block.residual(block.between(self.bend(&block.cell), self.noise()), out);
        // Without a domain nothing is known of where it can be asked, but where a field asks it.
        if self.domain.is_none() {
            return Ok(());
        }
        let ask = |points: &[DVec3], out: &mut [Interval]| {
            let found = self.answers(points)?;
            out.iter_mut().zip(found).for_each(|(out, (_, value))| *out = Interval::exact(value));
            Ok(())
        };
        balls::narrow(block, self.noise(), ask, out)
    }

    fn bend(&self, cell: &Aabb) -> Interval {
        // Only distances are known to bend no more than those of a point.
        let range = self.over(cell);
        match self.meaning {
            Meaning::Distance if range.lower > 0.0 => Interval { lower: f64::NEG_INFINITY, upper: 1.0 / range.lower },
            Meaning::Distance if range.upper < 0.0 => Interval { lower: 1.0 / range.upper, upper: f64::INFINITY },
            _ => Interval::ALL,
        }
    }
}
