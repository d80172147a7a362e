//! The field of a molecule: atoms that melt into each other.

use crate::distance::{Distance, Source};
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};

use super::boxes::Boxes;
use super::level;
use super::measure::{length, point, rounding};

/// All points where the sum of Gaussians exp(-s (|p - c|^2 / r^2 - 1)), one for each atom, is at least 1.
///
/// Densities say little about lengths, but bounds can be had: with M = -log of the sum, w the share of each atom in it and n
/// the number of atoms, |grad M| <= 2s/r sqrt(sum w |p - c|^2 / r^2), r the least radius (Jensen), and sum w u = M + entropy(w) <=
/// M + log n for the exponents u. So r (sqrt(1 + (M + log n) / s) - sqrt(1 + log n / s)) changes by no more than one moves. It
/// is the value: zero on the surface, and far away nearly the distance.
#[derive(Clone, Debug)]
pub struct Molecule {
    centers: Vec<DVec3>,
    radii: Vec<f64>,
    sharpness: f64,
    /// The least and the greatest radius.
    least: f64,
    greatest: f64,
    /// log n.
    spread: f64,
    tree: Boxes,
    extent: Aabb,
}

/// Gaussians that are exp of so much smaller than the largest do not change the sum.
const NOTHING: f64 = 45.0;

impl Molecule {
    /// Atoms with their centres and radii: an atom on its own is a ball of that radius. The sharper, the less they melt.
    pub fn new(centers: Vec<DVec3>, radii: Vec<f64>, sharpness: f64) -> Result<Self> {
        if centers.is_empty() || centers.len() != radii.len() {
            let (centers, radii) = (centers.len(), radii.len());
            return Err(Error::invalid(format!(
                "there are {centers} centers and {radii} radii; give at least one center, and a radius for each"
            )));
        }
        for (i, (&center, &radius)) in centers.iter().zip(&radii).enumerate() {
            point(&format!("center {i}"), center)?;
            length(&format!("radius {i}"), radius)?;
        }
        if !(0.25..=1e3).contains(&sharpness) {
            return Err(Error::invalid(format!("sharpness is {sharpness}; give 0.25 (round) to 1000 (hardly blended)")));
        }
        let (least, greatest) = radii.iter().fold((f64::INFINITY, 0.0f64), |(a, b), &r| (a.min(r), b.max(r)));
        let spread = (centers.len() as f64).ln();
        // No sum reaches 1 where each atom is below 1 / n.
        let swell = (1.0 + spread / sharpness).sqrt() * (1.0 + 1e-12);
        let extent = centers.iter().zip(&radii).fold(Aabb::EMPTY, |all, (&c, &r)| all.union(Aabb::new(c, c).grow(r * swell)));
        let tree = Boxes::new(centers.iter().map(|&c| Aabb::new(c, c)).collect());
        Ok(Self { centers, radii, sharpness, least, greatest, spread, tree, extent })
    }

    /// 1 + (M + log n) / s, the square of the root in the value, and the gradient of M.
    fn square(&self, p: DVec3) -> (f64, DVec3) {
        let (mut lowest, mut found) = (f64::INFINITY, Vec::new());
        let reach = |lowest: f64| self.greatest * ((lowest + NOTHING) / self.sharpness).sqrt();
        self.tree.visit(&Aabb::new(p, p), f64::INFINITY, |i, limit| {
            let exponent = self.sharpness * (p - self.centers[i]).length_squared() / (self.radii[i] * self.radii[i]);
            lowest = lowest.min(exponent);
            *limit = reach(lowest);
            found.push((i, exponent));
            true
        });
        // In the order of the atoms, so that sums are the same however they were found.
        found.retain(|&(_, exponent)| exponent <= lowest + NOTHING);
        found.sort_unstable_by_key(|&(i, _)| i);
        let (mut sum, mut slope) = (0.0, DVec3::ZERO);
        for (i, exponent) in found {
            let part = (lowest - exponent).exp();
            sum += part;
            slope += (p - self.centers[i]) * (part * 2.0 * self.sharpness / (self.radii[i] * self.radii[i]));
        }
        // Neither part is negative: nothing cancels where the square is small.
        ((lowest + (self.spread - sum.ln()).max(0.0)) / self.sharpness, slope / sum)
    }

    /// The square on the surface, where M is 0.
    fn threshold(&self) -> f64 {
        1.0 + self.spread / self.sharpness
    }

    fn value(&self, square: f64) -> f64 {
        // The difference of the roots, without cancelling.
        self.least * (square - self.threshold()) / (square.sqrt() + self.threshold().sqrt())
    }
}

impl Distance for Molecule {
    fn extent(&self) -> Option<Aabb> {
        Some(self.extent)
    }

    fn at(&self, p: DVec3) -> Interval {
        let level = level::at(self, p, None);
        if level.lower < 0.0 {
            return level;
        }
        // Atoms on their own lie inside.
        let nearest = self.centers.iter().zip(&self.radii).map(|(&c, &r)| (p - c).length() - r).fold(f64::INFINITY, f64::min);
        Interval { lower: level.lower, upper: level.upper.min(nearest).max(level.lower) }
    }
}

impl Source for Molecule {
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            *out = self.value(self.square(p).0);
        }
        Ok(())
    }

    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        for (out, &p) in out.iter_mut().zip(points) {
            let (square, slope) = self.square(p);
            *out = slope * (0.5 * self.least / self.sharpness / square.sqrt().max(f64::MIN_POSITIVE));
        }
        Ok(())
    }

    fn slack(&self, cell: &Aabb) -> Interval {
        level::slack(self, cell, None, |_| false)
    }

    /// From the second derivatives of M: of the Gaussians upward, less the spread of their slopes.
    fn bend(&self, cell: &Aabb) -> Interval {
        let Some(value) = level::value(self, cell.center()) else { return Interval::ALL };
        let (middle, radius) = (self.threshold().sqrt() + value / self.least, cell.radius() * (1.0 + 1e-9) / self.least);
        let (low, high) = (middle - radius, middle + radius);
        if !(low > 0.0) {
            return Interval::ALL;
        }
        let round = 1.0 / (self.least * low);
        Interval { lower: -(2.0 * self.sharpness * high / self.least + round) * (1.0 + 1e-9), upper: round * (1.0 + 1e-9) }
    }

    fn noise(&self) -> f64 {
        rounding(Some(self.extent))
    }
}
