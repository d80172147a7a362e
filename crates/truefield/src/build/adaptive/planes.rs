//! What the planes of a list's triangles say of a cell.
//!
//! Where a surface is sound, the gradient of its distance is g = v / |v|, v a mean of normals n. Let all n be within a of m,
//! c = cos a. In a frame m, p, q: g.m is in c..1, and as |v| is in c..1, g.p is in the range of n.p stretched by 1 / c.
//! Let g differ from the middle of these ranges by d, at most s along each axis e of the frame. The distance at x less its
//! interpolation from the corners of a cell of edge h, of weights w, is a sum of w d.(corner - x), with a d for each corner. The
//! weights have variances h^2 t (1 - t) along the axes of the cell, so the sum of w |e.(corner - x)| is at most h / 2, and the
//! distance is at most h / 2 times the sum of the s off. Instead of s along p and q: across m, d is within sin a of 0, and both
//! make up 2^(1/2) sin a.

use super::corner::Corner;
use super::facets::{affine, ends};
use crate::bvh::tree::Slot;
use crate::geom::{DVec3, Interval};
use crate::simd::{Fuse, multiversion};
use crate::source::mesh::Surface;

/// Normals whose cosine with their mean is less are not relied on.
const STEEPEST: f64 = 0.1;

/// Triangles flatter than this have no normal to rely on.
const FLAT: f64 = 1e-6;

/// How far normals may be off that are relied on.
const ROUNDED: f64 = 1e-9;

/// The plane of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    normal: DVec3,
    point: DVec3,
    /// One over the triangle's least height; infinite where there is no normal to rely on.
    flat: f64,
    /// What keeps its edges from meeting its neighbours', where the surface is whole around it whatever is near.
    apart: Option<f64>,
}

impl Plane {
    /// Those of all triangles, by slot.
    pub fn all(surface: &Surface) -> Vec<Self> {
        let tree = surface.tree();
        let plane = |slot: u32| {
            let facet = tree.facet_at(Slot(slot));
            let cross = facet.ab.cross(facet.ac);
            let longest = facet.ab.length_squared().max(facet.ac.length_squared()).max((facet.ac - facet.ab).length_squared()).sqrt();
            let height = cross.length() / longest;
            let flat = if height > FLAT * longest { 1.0 / height } else { f64::INFINITY };
            Self { normal: cross / cross.length(), point: facet.a, flat, apart: surface.whole(tree.triangle(Slot(slot)), f64::MAX) }
        };
        (0..tree.len() as u32).map(plane).collect()
    }

    /// How far its normal is off where its edges meet its neighbours' but for rounding, `asked` where that was not found at
    /// once; `None` where it is not to be relied on.
    pub fn turned(&self, asked: impl FnOnce() -> Option<f64>) -> Option<f64> {
        let angle = self.apart.or_else(asked)? * self.flat;
        angle.is_finite().then_some(angle)
    }
}

/// Which way the distance to a sound piece of surface can change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slopes {
    /// The least cosine of a normal with their mean.
    cosine: f64,
    /// The sum of the s, by the axes of the cell.
    shares: DVec3,
}

impl Slopes {
    /// By normals that are `turned` where edges meet but for rounding; `None` where they have no direction in common.
    pub fn of(planes: &[Plane], list: &[Slot], turned: f64) -> Option<Self> {
        let off = 2.0 * turned + ROUNDED;
        let (mean, farthest, cosine) = cone(planes, list);
        let cosine = cosine - off;
        if !(cosine > STEEPEST) {
            return None;
        }
        let along = 0.5 * (1.0 - cosine);
        let round = (2.0 * (1.0 - cosine * cosine)).sqrt();
        let mut shares = 0.5 * round * (DVec3::ONE - mean * mean);
        if let Some(p) = (farthest - mean * farthest.dot(mean)).try_normalize() {
            let q = mean.cross(p);
            let [p_half, q_half] = halves(planes, list, [p, q]).map(|(low, high)| {
                let stretched = |end: f64| if end > 0.0 { end / cosine } else { end };
                0.5 * (stretched(high + off) + stretched(off - low))
            });
            if p_half + q_half < round {
                shares = p_half * p * p + q_half * q * q;
            }
        }
        Some(Self { cosine, shares: (shares + along * mean * mean) * (1.0 + 1e-12) })
    }

    /// The most that a height above a plane of a triangle is less than the distance, as a factor.
    pub fn stretch(&self) -> f64 {
        1.0 / self.cosine
    }

    /// Contains the distance minus what is told in a cell of edge `edge`, at whose corners they differ by so much.
    ///
    /// For coordinates x = 2 t - 1 the distance is off by at most E (sum of r (1 - x^2))^(1/2), r the shares of the axes. With
    /// the affine part of the differences, b.x / 2, that is at most (E^2 + sum of b^2 / 4 r)^(1/2), or along some axes |b| / 2.
    pub fn between(&self, differences: &[f64; 8], edge: f64) -> Interval {
        let sum = self.shares.element_sum();
        let off = 0.5 * edge * sum;
        let (low, high) = ends(differences);
        let (mean, rises, rest) = affine(differences);
        let (mut straight, mut square) = (rest, off * off);
        for axis in 0..3 {
            let (rise, share) = (rises[axis].abs(), self.shares[axis] / sum);
            if rise < 4.0 * share * off {
                square += rise * rise / (4.0 * share);
            } else {
                straight += 0.5 * rise;
            }
        }
        let most = straight + square.sqrt() * (1.0 + 1e-12);
        Interval { lower: (low - off).max(mean - most), upper: (high + off).min(mean + most) }
    }
}

multiversion!(
    /// The mean of the normals of a list, that which is farthest from it, and the cosine of both.
    fn cone(planes: &[Plane], list: &[Slot]) -> (DVec3, DVec3, f64) = cone_body
);

#[inline(always)]
fn cone_body<F: Fuse>(planes: &[Plane], list: &[Slot]) -> (DVec3, DVec3, f64) {
    let normals = || list.iter().map(|&slot| planes[slot.0 as usize].normal);
    let mean = normals().sum::<DVec3>().normalize_or_zero();
    let (mut farthest, mut cosine) = (mean, 1.0);
    for normal in normals() {
        let found = normal.dot(mean);
        (farthest, cosine) = if found < cosine { (normal, found) } else { (farthest, cosine) };
    }
    (mean, farthest, cosine)
}

multiversion!(
    /// The least and the largest part of the normals along two axes.
    fn halves(planes: &[Plane], list: &[Slot], axes: [DVec3; 2]) -> [(f64, f64); 2] = halves_body
);

#[inline(always)]
fn halves_body<F: Fuse>(planes: &[Plane], list: &[Slot], axes: [DVec3; 2]) -> [(f64, f64); 2] {
    let mut ends = [(f64::INFINITY, f64::NEG_INFINITY); 2];
    for &slot in list {
        let normal = planes[slot.0 as usize].normal;
        for (axis, ends) in axes.iter().zip(&mut ends) {
            let along = normal.dot(*axis);
            *ends = (if along < ends.0 { along } else { ends.0 }, if along > ends.1 { along } else { ends.1 });
        }
    }
    ends
}

multiversion!(
    /// The hull, at the corners, of what lies between the heights above the planes and `stretch` times as much, minus what is
    /// told. The larger of two multiples of a height is convex, the lesser concave: what they are at corners bounds them.
    pub(super) fn between_planes(planes: &[Plane], list: &[Slot], corners: &[Corner; 8], told: &[f64; 8], stretch: f64) -> Interval = between_planes_body
);

#[inline(always)]
fn between_planes_body<F: Fuse>(planes: &[Plane], list: &[Slot], corners: &[Corner; 8], told: &[f64; 8], stretch: f64) -> Interval {
    let axis = |axis: usize| -> [f64; 8] { std::array::from_fn(|j| corners[j].point[axis]) };
    let (xs, ys, zs) = (axis(0), axis(1), axis(2));
    let (mut low, mut high) = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
    for &slot in list {
        let Plane { normal, point, .. } = planes[slot.0 as usize];
        for lane in 0..8 {
            let height = normal.x * (xs[lane] - point.x) + normal.y * (ys[lane] - point.y) + normal.z * (zs[lane] - point.z);
            let most = height * stretch;
            let (less, more) = if height < most { (height, most) } else { (most, height) };
            low[lane] = if less < low[lane] { less } else { low[lane] };
            high[lane] = if more > high[lane] { more } else { high[lane] };
        }
    }
    let (low, high): ([f64; 8], [f64; 8]) = (std::array::from_fn(|j| low[j] - told[j]), std::array::from_fn(|j| high[j] - told[j]));
    Interval { lower: ends(&low).0, upper: ends(&high).1 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::laws::Random;

    /// A direction near another, spread along one axis more than along the other.
    fn near(random: &mut Random, mean: DVec3, spread: [f64; 2]) -> DVec3 {
        let (p, q) = mean.any_orthonormal_pair();
        (mean + p * random.between(-spread[0], spread[0]) + q * random.between(-spread[1], spread[1])).normalize()
    }

    #[test]
    fn slopes_bound_what_the_least_or_largest_of_slanted_heights_leave_of_their_interpolation() {
        let mut random = Random::new(11);
        let mut closest = 0.0;
        for case in 0..2000 {
            let (mean, spread) = (random.direction(), [random.length(1e-3, 0.8), random.length(1e-3, 0.8)]);
            let planes: Vec<Plane> = (0..2 + random.below(8))
                .map(|_| Plane { normal: near(&mut random, mean, spread), point: DVec3::ZERO, flat: 0.0, apart: Some(0.0) })
                .collect();
            let list: Vec<Slot> = (0..planes.len() as u32).map(Slot).collect();
            let Some(slopes) = Slopes::of(&planes, &list, 0.0) else { continue };
            // Means of the normals, brought to length 1, as the gradients of planes near the middle.
            let edge = random.length(1e-2, 10.0);
            let heights: Vec<(DVec3, f64)> = (0..1 + random.below(4))
                .map(|_| {
                    let mean: DVec3 = planes.iter().map(|plane| plane.normal * random.unit().powi(4)).sum();
                    (mean.normalize(), edge * random.between(-0.1, 0.1))
                })
                .collect();
            let least = random.below(2) == 0;
            let value = |p: DVec3| {
                let all = heights.iter().map(|(normal, height)| normal.dot(p) + height);
                if least { all.fold(f64::INFINITY, f64::min) } else { all.fold(f64::NEG_INFINITY, f64::max) }
            };
            let place = |j: usize| DVec3::from([0, 1, 2].map(|axis| if j >> axis & 1 == 1 { 0.5 * edge } else { -0.5 * edge }));
            let noise = edge * random.length(1e-4, 0.3);
            let differences: [f64; 8] = std::array::from_fn(|_| noise * random.between(-1.0, 1.0));
            let told: [f64; 8] = std::array::from_fn(|j| value(place(j)) - differences[j]);
            let bound = slopes.between(&differences, edge);
            for _ in 0..100 {
                let t = DVec3::new(random.unit(), random.unit(), random.unit());
                let weight = |j: usize, axis: usize| if j >> axis & 1 == 1 { t[axis] } else { 1.0 - t[axis] };
                let said: f64 = (0..8).map(|j| told[j] * weight(j, 0) * weight(j, 1) * weight(j, 2)).sum();
                let off = value(edge * (t - 0.5)) - said;
                assert!(bound.widen(1e-12 * edge).contains(off), "{case}: {off} at {t} of {bound:?}");
                closest = f64::max(closest, (off / bound.upper).max(off / bound.lower));
            }
        }
        assert!(closest > 0.8, "no more than {closest} of what is allowed occurs");
    }
}
