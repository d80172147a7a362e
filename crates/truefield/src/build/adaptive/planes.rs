//! What the planes of a list's triangles say of a cell.
//!
//! Where a surface is sound, the gradient of its distance is g = v / |v|, v a mean of normals n. Let all n be within a of m,
//! c = cos a. In a frame m, p, q: g.m is in c..1, and as |v| is in c..1, g.p is in the range of n.p stretched by 1 / c.
//! Let g differ from the middle of these ranges by d, at most s along each axis e of the frame. The distance at x less its
//! interpolation from the corners of a cell of edge h, of weights w, is a sum of w d.(corner - x), with a d for each corner. The
//! weights have variances h^2 t (1 - t) along the axes of the cell, so the sum of w |e.(corner - x)| is at most h / 2, and the
//! distance is at most h / 2 times the sum of the s off. Instead of s along p and q: across m, d is within sin a of 0, and both
//! make up 2^(1/2) sin a.

use super::facets::{affine, ends, place_of};
use crate::bvh::tree::Slot;
use crate::error::Result;
use crate::geom::{Aabb, DVec3, Interval};
use crate::run::Run;
use crate::simd::{Fuse, multiversion};
use crate::source::mesh::Surface;

/// Normals whose cosine with their mean is less are not relied on.
const STEEPEST: f64 = 0.1;

/// Triangles flatter than this have no normal to rely on.
const FLAT: f64 = 1e-3;

/// How far rounding turns the normal of the flattest triangle that is relied on: edges are multiplied, and what is left is
/// as short as the triangle is flat.
pub(super) const TURNED: f64 = 8.0 * f64::EPSILON / FLAT;

/// How far normals may be off that are relied on.
const ROUNDED: f64 = 1e-9;

/// Triangles that a worker takes at once.
const CHUNK: usize = 4096;

/// Normals that are looked at side by side.
const LANES: usize = 8;

/// The plane of a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    normal: DVec3,
    /// Of the plane over the tree's centre, along the normal.
    height: f64,
    /// How far the normal is off where edges meet their neighbours' but for rounding.
    turned: f64,
    /// The surface is whole around the triangle up to so far from it: nowhere where the normal is not to be relied on.
    reach: f64,
}

impl Plane {
    /// None that is to be relied on.
    const NONE: Self = Self { normal: DVec3::ZERO, height: 0.0, turned: 0.0, reach: 0.0 };

    /// Those of all triangles, by slot.
    pub fn all(surface: &Surface, run: &Run<'_>) -> Result<Vec<Self>> {
        let mut planes = vec![Self::NONE; surface.tree().len()];
        run.chunks("look at the triangles", &mut planes, CHUNK, |chunk, planes| {
            for (at, plane) in planes.iter_mut().enumerate() {
                *plane = Self::new(surface, Slot((chunk * CHUNK + at) as u32));
            }
            Ok(())
        })?;
        Ok(planes)
    }

    fn new(surface: &Surface, slot: Slot) -> Self {
        let tree = surface.tree();
        let facet = tree.facet_at(slot);
        let cross = facet.ab.cross(facet.ac);
        let longest = facet.ab.length_squared().max(facet.ac.length_squared()).max((facet.ac - facet.ab).length_squared()).sqrt();
        let flattest = cross.length() / longest;
        match surface.whole(tree.triangle(slot)) {
            Some(whole) if flattest > FLAT * longest => {
                let normal = cross / cross.length();
                Self { normal, height: normal.dot(facet.a - tree.center), turned: whole.apart / flattest, reach: whole.reach }
            }
            _ => Self::NONE,
        }
    }
}

/// The planes of a list, side by side.
#[derive(Debug, Default)]
pub(super) struct Planes {
    /// Normals by their axes, and heights; the last plane fills the last group.
    groups: Vec<[[f64; LANES]; 4]>,
    sum: DVec3,
}

impl Planes {
    /// Takes up a list, of which something can be nearest up to `reach` from a cell. How far normals may be off where edges
    /// meet but for rounding; `None` where the surface is not known to be whole.
    pub fn take(&mut self, planes: &[Plane], list: &[Slot], reach: f64) -> Option<f64> {
        self.groups.clear();
        self.sum = DVec3::ZERO;
        let mut turned = 0.0;
        for group in list.chunks(LANES) {
            self.groups.push([[0.0; LANES]; 4]);
            let (Some(lanes), mut least) = (self.groups.last_mut(), f64::INFINITY) else { return None };
            for lane in 0..LANES {
                let plane = &planes[group[lane.min(group.len() - 1)].0 as usize];
                let DVec3 { x, y, z } = plane.normal;
                (lanes[0][lane], lanes[1][lane], lanes[2][lane], lanes[3][lane]) = (x, y, z, plane.height);
                self.sum += if lane < group.len() { plane.normal } else { DVec3::ZERO };
                turned = if plane.turned > turned { plane.turned } else { turned };
                least = if plane.reach < least { plane.reach } else { least };
            }
            if !(least > reach) {
                return None;
            }
        }
        (!list.is_empty()).then_some(turned)
    }

    /// The least and the largest height over a plane at each corner of a cell, relative to the tree's centre.
    pub fn heights(&self, cell: &Aabb) -> ([f64; 8], [f64; 8]) {
        heights(&self.groups, cell)
    }
}

/// The hull, at the corners of a cell, of what lies between heights over planes and `stretch` times as much, minus what is told.
/// The larger of two multiples of a height is convex, the lesser concave: what they are at corners bounds them.
pub(super) fn stretched((mut low, mut high): ([f64; 8], [f64; 8]), told: &[f64; 8], stretch: f64) -> Interval {
    for lane in 0..8 {
        let (least, most) = (low[lane], high[lane]);
        low[lane] = if least > 0.0 { least } else { least * stretch } - told[lane];
        high[lane] = if most > 0.0 { most * stretch } else { most } - told[lane];
    }
    Interval { lower: ends(&low).0, upper: ends(&high).1 }
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
    pub fn of(planes: &Planes, turned: f64) -> Option<Self> {
        let off = 2.0 * turned + ROUNDED;
        let mean = planes.sum.normalize_or_zero();
        let (farthest, cosine) = cone(&planes.groups, mean);
        let cosine = cosine - off;
        if !(cosine > STEEPEST) {
            return None;
        }
        let along = 0.5 * (1.0 - cosine);
        let round = (2.0 * (1.0 - cosine * cosine)).sqrt();
        let mut shares = 0.5 * round * (DVec3::ONE - mean * mean);
        if let Some(p) = (farthest - mean * farthest.dot(mean)).try_normalize() {
            let q = mean.cross(p);
            let [p_half, q_half] = halves(&planes.groups, [p, q]).map(|(low, high)| {
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
    /// The normal that is farthest from their mean, and the cosine of both.
    fn cone(groups: &[[[f64; LANES]; 4]], mean: DVec3) -> (DVec3, f64) = cone_body
);

#[inline(always)]
fn cone_body<F: Fuse>(groups: &[[[f64; LANES]; 4]], mean: DVec3) -> (DVec3, f64) {
    let (mut least, mut farthest) = ([1.0; LANES], [[mean.x; LANES], [mean.y; LANES], [mean.z; LANES]]);
    for [xs, ys, zs, _] in groups {
        for lane in 0..LANES {
            let cosine = xs[lane] * mean.x + ys[lane] * mean.y + zs[lane] * mean.z;
            let farther = cosine < least[lane];
            least[lane] = if farther { cosine } else { least[lane] };
            farthest[0][lane] = if farther { xs[lane] } else { farthest[0][lane] };
            farthest[1][lane] = if farther { ys[lane] } else { farthest[1][lane] };
            farthest[2][lane] = if farther { zs[lane] } else { farthest[2][lane] };
        }
    }
    let cosine = ends(&least).0;
    let lane = place_of(&least, cosine);
    (DVec3::new(farthest[0][lane], farthest[1][lane], farthest[2][lane]), cosine)
}

multiversion!(
    /// The least and the largest part of the normals along two axes.
    fn halves(groups: &[[[f64; LANES]; 4]], axes: [DVec3; 2]) -> [(f64, f64); 2] = halves_body
);

#[inline(always)]
fn halves_body<F: Fuse>(groups: &[[[f64; LANES]; 4]], axes: [DVec3; 2]) -> [(f64, f64); 2] {
    let (mut low, mut high) = ([[f64::INFINITY; LANES]; 2], [[f64::NEG_INFINITY; LANES]; 2]);
    for [xs, ys, zs, _] in groups {
        for (number, axis) in axes.iter().enumerate() {
            for lane in 0..LANES {
                let along = xs[lane] * axis.x + ys[lane] * axis.y + zs[lane] * axis.z;
                low[number][lane] = if along < low[number][lane] { along } else { low[number][lane] };
                high[number][lane] = if along > high[number][lane] { along } else { high[number][lane] };
            }
        }
    }
    [(ends(&low[0]).0, ends(&high[0]).1), (ends(&low[1]).0, ends(&high[1]).1)]
}

multiversion!(
    /// At each corner of a cell the least and the largest height over a plane.
    fn heights(groups: &[[[f64; LANES]; 4]], cell: &Aabb) -> ([f64; 8], [f64; 8]) = heights_body
);

#[inline(always)]
fn heights_body<F: Fuse>(groups: &[[[f64; LANES]; 4]], cell: &Aabb) -> ([f64; 8], [f64; 8]) {
    let corner = |axis: usize, j: usize| if j >> axis & 1 == 0 { cell.min[axis] } else { cell.max[axis] };
    let axis = |axis: usize| -> [f64; 8] { std::array::from_fn(|j| corner(axis, j)) };
    let (xs, ys, zs) = (axis(0), axis(1), axis(2));
    let (mut low, mut high) = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
    for group in groups {
        for plane in 0..LANES {
            let [x, y, z, height] = [group[0][plane], group[1][plane], group[2][plane], group[3][plane]];
            for j in 0..8 {
                let over = x * xs[j] + y * ys[j] + z * zs[j] - height;
                low[j] = if over < low[j] { over } else { low[j] };
                high[j] = if over > high[j] { over } else { high[j] };
            }
        }
    }
    (low, high)
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
                .map(|_| Plane { normal: near(&mut random, mean, spread), height: 0.0, turned: 0.0, reach: 1.0 })
                .collect();
            let (list, mut taken): (Vec<Slot>, _) = ((0..planes.len() as u32).map(Slot).collect(), Planes::default());
            assert_eq!(taken.take(&planes, &list, 1.0), None, "{case}: the surface is not whole that far");
            let turned = taken.take(&planes, &list, 0.5).expect("the surface is whole");
            let Some(slopes) = Slopes::of(&taken, turned) else { continue };
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
