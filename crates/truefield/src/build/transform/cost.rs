//! What one step along an axis costs: tables of squared distances, whole numbers where the spacing allows.

use super::value::Value;

/// Which part of a site's voxel distances go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// Its centre.
    Centre,
    /// Its nearest point.
    Near,
    /// The nearest point of the voxel or of one of its neighbours.
    Neighbourhood,
    /// Its farthest point.
    Far,
}

impl Reach {
    /// Distance along an axis to a voxel `steps` away, in halves of a step.
    fn halves(self, steps: usize) -> f64 {
        let halves = 2.0 * steps as f64;
        match self {
            Self::Centre => halves,
            Self::Near => (halves - 1.0).max(0.0),
            Self::Neighbourhood => (halves - 3.0).max(0.0),
            Self::Far => halves + 1.0,
        }
    }
}

/// One axis of a transform.
#[derive(Clone, Debug)]
pub(super) struct Axis<V> {
    /// Number of voxels.
    pub length: usize,
    pub periodic: bool,
    /// Squared distance to a voxel so many steps away.
    pub cost: Vec<V>,
    /// The same from the far end, so that falling slopes can be copied too.
    pub reversed: Vec<V>,
    /// What a site costs along the axes that come before this one in the order of passes.
    pub base: V,
}

/// Axes in whole numbers, if that is exact: squared distances are these times `unit` squared.
pub(super) struct Steps {
    pub factors: Vec<f64>,
    pub unit: f64,
}

/// How many steps away a site can be along an axis.
pub(super) fn reach(length: usize, periodic: bool, border: bool) -> usize {
    if periodic { length / 2 } else { length - usize::from(!border) }
}

/// The spacings as whole multiples of a unit (to rounding), if all squared distances then fit 31 bits.
pub(super) fn whole(spacing: &[f64], reaches: &[usize], to: Reach) -> Option<Steps> {
    let least = spacing.iter().copied().fold(f64::INFINITY, f64::min);
    let fractions = spacing.iter().map(|s| fraction(s / least)).collect::<Option<Vec<_>>>()?;
    let common = fractions.iter().try_fold(1u64, |all, &(_, below)| Some(all / divisor(all, below) * below).filter(|&q| q < 1 << 20))?;
    let counts: Vec<u64> = fractions.iter().map(|&(above, below)| above * (common / below)).collect();
    let shared = counts.iter().copied().fold(0, divisor);
    let mut steps = Steps {
        factors: counts.iter().map(|&count| (count / shared) as f64).collect(),
        unit: if counts.iter().all(|&count| count == shared) { least } else { least / common as f64 * shared as f64 },
    };
    if to == Reach::Centre {
        // Halves are not needed.
        steps.factors.iter_mut().for_each(|factor| *factor /= 2.0);
    } else {
        steps.unit /= 2.0;
    }
    let largest: f64 = steps.factors.iter().zip(reaches).map(|(factor, &n)| (factor * to.halves(n)).powi(2)).sum();
    (largest < f64::from(1u32 << 31)).then_some(steps)
}

/// The tables of all axes, in units.
pub(super) fn axes<V: Value>(shape: &[usize], periodic: &[bool], reaches: &[usize], factors: &[f64], to: Reach) -> Vec<Axis<V>> {
    let mut made: Vec<Axis<V>> = Vec::new();
    let mut base = V::of(0.0);
    // Passes run from the last axis to the first.
    for axis in (0..shape.len()).rev() {
        let cost: Vec<V> = (0..=reaches[axis]).map(|steps| V::of((factors[axis] * to.halves(steps)).powi(2))).collect();
        let reversed = cost.iter().rev().copied().collect();
        let first = cost[0];
        made.push(Axis { length: shape[axis], periodic: periodic[axis], cost, reversed, base });
        base = base.plus(first);
    }
    made.reverse();
    made
}

/// The simplest fraction that is `ratio` to rounding, by its continued fraction.
fn fraction(ratio: f64) -> Option<(u64, u64)> {
    let (mut before, mut now) = ((0u64, 1u64), (1u64, 0u64));
    let mut rest = ratio;
    for _ in 0..16 {
        let whole = rest.floor();
        if whole >= 1e6 {
            return None;
        }
        let term = whole as u64;
        let next = (term * now.0 + before.0, term * now.1 + before.1);
        if next.0 >= 1 << 20 || next.1 >= 1 << 20 {
            return None;
        }
        (before, now) = (now, next);
        if (now.0 as f64 / now.1 as f64 - ratio).abs() <= 4.0 * f64::EPSILON * ratio {
            return Some(now);
        }
        rest = (rest - whole).recip();
    }
    None
}

fn divisor(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { divisor(b, a % b) }
}
