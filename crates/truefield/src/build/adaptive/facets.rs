//! What is proven of a cell by the triangles that can be nearest in it.
//!
//! Let u be the unsigned distance, I its interpolation from the corners c of a cell with half diagonal R, and d(T) the
//! distance to one triangle of the cell's complete list. Interpolation keeps order, and the interpolation of an affine
//! function is the function itself.
//! 1. u^2 - |p|^2 is the least of affine functions, so concave: u^2 >= I(u^2) - I(|p|^2) + |p|^2 >= I(u)^2 - S; see `below`.
//! 2. u is at most the distance to any point or triangle of the surface, which is convex: u - I is at most the largest
//!    d(T) - u at the corners. It is at most any mean of such distances too, so that where one of two is p too large at
//!    some corners, and the other q at the rest, u - I is at most p q / (p + q); see `mixed`.
//! 3. u is one of the d(T), each of which lies above its tangents, at the cell's centre and at corners, and so above any mean of
//!    them, and above the height over any plane that it is behind: u - I is at least the least over T of the least (mean - u)
//!    at the corners. Points, planes and triangles say more of parts of the cell: I is known at their corners, u need not be.
//! 4. Near a sound piece of surface, signed: let all normals n of the list be within a of their mean m. Seen along m the
//!    surface around q, which is nearest to p, is a graph of slopes g(n); it touches the plane across p - q there and
//!    stays on one side, so that the plane's slope is a mean of the g (0 is in Clarke's subdifferential at a largest
//!    value): p - q points along a mean of the normals around q, up or down, and is within a of m. Of these normals one at
//!    least, of a triangle of the list, has n.(p - q) of at least |p - q| cos a in size; it is |p - q| at most.
//! 5. There the gradient of the distance is such a mean brought to length 1: see `planes`.

use super::corner::Corner;
use super::halves::{blend, of_part};
use super::planes::{Plane, Slopes, between_planes};
use super::triangles::{SHORT, above_triangles, below_triangles};
use crate::bvh::cover::{OCTANTS, Range};
use crate::bvh::octants::NODES;
use crate::bvh::tree::Slot;
use crate::geom::{Aabb, DVec3, Interval};
use crate::simd::{Fuse, multiversion};
use crate::source::mesh::{Side, Surface};

/// Longer lists are not looked through plane by plane.
const PLANES: usize = 128;

/// What is this many times too large is not made small enough by a look at parts of a cell.
const HOPE: f64 = 2.0;

/// A cell, and what is known of it.
pub(super) struct At<'a> {
    pub cell: Aabb,
    /// Of unsigned distances in it.
    pub range: Range,
    /// The side of all its points, where that is known.
    pub side: Option<Side>,
    pub corners: &'a [Corner; 8],
    /// A point of the surface near its centre, where one is known.
    pub center: Option<DVec3>,
    /// What is said at the corners, and between them by interpolation: by the cell itself or by one that it is a part of.
    pub told: [f64; 8],
    /// Every triangle that can be nearest in it.
    pub list: &'a [Slot],
}

/// Proves cells of one surface; all lengths are in the tree's units.
pub(super) struct Prover<'a> {
    surface: &'a Surface,
    planes: &'a [Plane],
}

impl<'a> Prover<'a> {
    pub fn new(surface: &'a Surface, planes: &'a [Plane]) -> Self {
        Self { surface, planes }
    }

    /// Unsigned distances in a cell, by its corners: by 1, or as far as one moves.
    pub fn range(&self, cell: &Aabb, corners: &[Corner; 8]) -> Range {
        let (least, most) = ends(&corners.map(|corner| corner.value.abs()));
        let (radius, slack) = (cell.radius(), self.slack(cell));
        let lower = (least * least - radius * radius * (1.0 + 1e-12)).max(0.0).sqrt() - slack;
        Range { lower: lower.max(0.0), upper: most + radius + slack }
    }

    /// Contains the distance minus the interpolation of what is told, without a look at the list; from above no sharper
    /// than `limit`.
    pub fn coarse(&self, at: &At<'_>, limit: f64) -> Interval {
        let corners = at.corners;
        let told = at.told;
        let (low, high) = ends(&told);
        let [lower, upper] = [at.range.lower, at.range.upper];
        let range = match at.side {
            Some(Side::Inside) => Interval { lower: -upper, upper: -lower },
            Some(Side::Outside) => Interval { lower, upper },
            _ => Interval::either_side(upper),
        };
        let mut known = Interval { lower: range.lower - high, upper: range.upper - low };
        let size = at.cell.size();
        if corners.iter().all(|corner| corner.certain) && (at.side.is_some() || self.surface.side_changes_at_surface_only()) {
            let differences = hull(std::array::from_fn(|j| corners[j].value - told[j]));
            known = known.intersection(differences.widen(0.5 * size.length() * (1.0 + 1e-12)));
        }
        if let Some(side) = at.side {
            let told = told.map(|v| side.sign() * v);
            known = known.intersection(signed(side, by_corners(corners, &feet(at), &told, size.x, limit)));
        }
        known.widen(self.slack(&at.cell))
    }

    /// Sharpens `known`, as by `coarse`, from above: by points of the surface, in parts of the cell. Nothing of these is asked.
    pub fn parts(&self, at: &At<'_>, known: Interval, limit: f64) -> Interval {
        let Some(side) = at.side else { return known };
        let above = signed(side, known).upper;
        if above <= limit || above > HOPE * limit {
            return known;
        }
        let told = at.told.map(|v| side.sign() * v);
        let upper = above_in_parts(&at.cell, &feet(at), &blend(&told), limit);
        known.intersection(signed(side, Interval { lower: f64::NEG_INFINITY, upper }).widen(self.slack(&at.cell)))
    }

    /// Sharpens `known` by the planes of the list's triangles. Also returns which way the distance can change.
    pub fn planes(&self, at: &At<'_>, known: Interval) -> (Interval, Option<Slopes>) {
        if at.list.len() > PLANES || !at.corners.iter().all(|corner| corner.certain) {
            return (known, None);
        }
        match self.by_planes(at) {
            Some((found, slopes)) => (known.intersection(found.widen(self.slack(&at.cell))), Some(slopes)),
            None => (known, None),
        }
    }

    /// Sharpens `known` by the triangles of the list, where it is not within `limit`.
    pub fn triangles(&self, at: &At<'_>, known: Interval, limit: f64) -> Interval {
        let Some(side) = at.side.filter(|_| !at.list.is_empty()) else { return known };
        let (tree, told, mut found) = (self.surface.tree(), at.told.map(|v| side.sign() * v), Interval::ALL);
        let unsigned = signed(side, known);
        if unsigned.upper > limit {
            // Of long lists little is known from above.
            if at.list.len() > SHORT {
                return known;
            }
            found.upper = above_triangles(tree, &at.cell, at.list, &told, limit);
        }
        if unsigned.lower < -limit && unsigned.upper.min(found.upper) <= limit {
            found.lower = below_triangles(tree, &at.cell, at.list, &told, limit);
        }
        known.intersection(signed(side, found).widen(self.slack(&at.cell)))
    }

    /// Sharpens `known` from below by the triangles of the list, in parts of the cell. Nothing of these is asked.
    pub fn triangles_in_parts(&self, at: &At<'_>, known: Interval, limit: f64) -> Interval {
        let Some(side) = at.side.filter(|_| !at.list.is_empty()) else { return known };
        let unsigned = signed(side, known);
        if unsigned.upper > limit || unsigned.lower >= -limit || unsigned.lower < -HOPE * limit {
            return known;
        }
        let (told, center) = (blend(&at.told.map(|v| side.sign() * v)), at.cell.center());
        let mut lower = f64::INFINITY;
        for octant in 0..OCTANTS {
            let corner = at.cell.corner(octant);
            let part = Aabb::new(corner.min(center), corner.max(center));
            lower = lower.min(below_triangles(self.surface.tree(), &part, at.list, &of_part(&told, octant), limit));
            if lower < -limit {
                return known;
            }
        }
        known.intersection(signed(side, Interval { lower, upper: f64::INFINITY }).widen(self.slack(&at.cell)))
    }

    /// 5: contains the distance minus what is told, which differ by so much at the corners of the parts.
    pub fn by_samples(&self, at: &At<'_>, differences: &[f64; NODES], slopes: &Slopes) -> Interval {
        let spacing = 0.5 * at.cell.size().x;
        let part = |octant| slopes.between(&of_part(differences, octant), spacing);
        (1..OCTANTS).fold(part(0), |known, octant| known.hull(part(octant))).widen(self.slack(&at.cell))
    }

    /// 4 and 5: contains the signed distance minus the interpolation, and which way it can change; `None` where the surface is
    /// not known to be sound.
    fn by_planes(&self, at: &At<'_>) -> Option<(Interval, Slopes)> {
        let turned = at.list.iter().try_fold(0.0f64, |turned, &slot| {
            let asked = || self.surface.whole(self.surface.tree().triangle(slot), at.range.upper);
            self.planes[slot.0 as usize].turned(asked).map(|angle| turned.max(angle))
        })?;
        let slopes = Slopes::of(self.planes, at.list, turned)?;
        let found = between_planes(self.planes, at.list, at.corners, &at.told, slopes.stretch());
        let differences = std::array::from_fn(|j| at.corners[j].value - at.told[j]);
        Some((found.intersection(slopes.between(&differences, at.cell.size().x)), slopes))
    }

    /// Rounding of lengths within the cell and the surface.
    pub fn slack(&self, cell: &Aabb) -> f64 {
        let tree = self.surface.tree();
        // A normal of the flattest triangle that is relied on is off by 1e-9; a cell's list may reach across the surface.
        let reach = tree.extent.min.abs().max(tree.extent.max.abs()).max(cell.min.abs()).max(cell.max.abs()).max_element();
        128.0 * f64::EPSILON * reach + 1e-9 * cell.radius()
    }
}

/// How often a better mean is looked for.
const ROUNDS: usize = 8;

multiversion!(
    /// 1, and 2 for points of the surface: contains the unsigned distance minus the interpolation of what is told in a cell of
    /// edge `edge`; from above no sharper than `limit`.
    fn by_corners(corners: &[Corner; 8], feet: &[DVec3; 9], told: &[f64; 8], edge: f64, limit: f64) -> Interval = by_corners_body
);

#[inline(always)]
fn by_corners_body<F: Fuse>(corners: &[Corner; 8], feet: &[DVec3; 9], told: &[f64; 8], edge: f64, limit: f64) -> Interval {
    let distances: [f64; 8] = std::array::from_fn(|j| corners[j].value.abs());
    let difference = ends(&std::array::from_fn(|j| distances[j] - told[j])).0;
    Interval { lower: difference - below(&distances, edge, limit + difference), upper: above_feet(corners, feet, told, limit) }
}

#[inline(always)]
fn above_feet(corners: &[Corner; 8], feet: &[DVec3; 9], told: &[f64; 8], limit: f64) -> f64 {
    let mut rows = [[0.0; 8]; 9];
    let axis = |axis: usize| -> [f64; 8] { std::array::from_fn(|j| corners[j].point[axis]) };
    let (xs, ys, zs) = (axis(0), axis(1), axis(2));
    for (row, foot) in rows.iter_mut().zip(feet) {
        for lane in 0..8 {
            let (x, y, z) = (xs[lane] - foot.x, ys[lane] - foot.y, zs[lane] - foot.z);
            row[lane] = (x * x + y * y + z * z).sqrt() - told[lane];
        }
    }
    mixed(&rows, limit)
}

/// Points of the surface that are near a cell.
fn feet(at: &At<'_>) -> [DVec3; 9] {
    std::array::from_fn(|k| if k < 8 { at.corners[k].foot } else { at.center.unwrap_or(at.corners[0].foot) })
}

multiversion!(
    /// 2 for points of the surface, one part of the cell after the other: the unsigned distance is at most so much more than what is
    /// told at the corners of the parts; no sharper than `limit`.
    pub(super) fn above_in_parts(cell: &Aabb, feet: &[DVec3; 9], told: &[f64; NODES], limit: f64) -> f64 = above_in_parts_body
);

#[inline(always)]
fn above_in_parts_body<F: Fuse>(cell: &Aabb, feet: &[DVec3; 9], told: &[f64; NODES], limit: f64) -> f64 {
    let along = |axis: usize| [cell.min[axis], cell.center()[axis], cell.max[axis]];
    let (xs, ys, zs) = (along(0), along(1), along(2));
    let mut rows = [[0.0; NODES]; 9];
    for (row, foot) in rows.iter_mut().zip(feet) {
        let square = |from: f64| move |at: f64| (at - from) * (at - from);
        let (x, y, z) = (xs.map(square(foot.x)), ys.map(square(foot.y)), zs.map(square(foot.z)));
        for node in 0..NODES {
            row[node] = (x[node % 3] + y[node / 3 % 3] + z[node / 9]).sqrt() - told[node];
        }
    }
    let mut high = f64::NEG_INFINITY;
    for octant in 0..OCTANTS {
        let found = mixed(&rows.map(|row| of_part(&row, octant)), limit);
        high = if found > high { found } else { high };
        if high > limit {
            break;
        }
    }
    // Of what fails nothing else is known.
    if high > limit { f64::INFINITY } else { high }
}

/// The largest number of a mean of the rows, whose weights are chosen so that it is small; stops at `limit`.
///
/// Whatever the weights are, the mean bounds what each of the rows bounds. From the row whose largest number is the least on:
/// where it is largest, another row is smallest; of both as much as makes the largest numbers equal.
#[inline(always)]
pub(super) fn mixed(rows: &[[f64; 8]], limit: f64) -> f64 {
    let (mut mean, mut high) = ([0.0; 8], f64::INFINITY);
    for row in rows {
        let highest = highest(row);
        if highest < high {
            (mean, high) = (*row, highest);
        }
    }
    let mut at = place_of(&mean, high);
    for _ in 0..ROUNDS {
        if high <= limit {
            break;
        }
        let (mut other, mut low) = (0, f64::INFINITY);
        for (number, row) in rows.iter().enumerate() {
            let lower = row[at] < low;
            (other, low) = if lower { (number, row[at]) } else { (other, low) };
        }
        let fall = high - low;
        if !(fall > 0.0 && fall < f64::INFINITY) {
            break;
        }
        let other = &rows[other];
        let mut rival = place_of(other, highest(other));
        let mut better = None;
        for _ in 0..3 {
            let weight = ((high - mean[rival]) / (fall + other[rival] - mean[rival])).clamp(0.0, 1.0);
            let mut mixed = [0.0; 8];
            for lane in 0..8 {
                mixed[lane] = mean[lane] + weight * (other[lane] - mean[lane]);
            }
            let value = highest(&mixed);
            let worst = place_of(&mixed, value);
            if value < high && better.is_none_or(|(_, _, least)| value < least) {
                better = Some((mixed, worst, value));
            }
            if worst == at || worst == rival {
                break;
            }
            rival = worst;
        }
        let Some(found) = better else { break };
        (mean, at, high) = found;
    }
    high
}

/// The largest of eight numbers, halves at a time.
#[inline(always)]
pub(super) fn highest(row: &[f64; 8]) -> f64 {
    let more = |a: f64, b: f64| if b > a { b } else { a };
    let four: [f64; 4] = std::array::from_fn(|j| more(row[j], row[j + 4]));
    let two: [f64; 2] = std::array::from_fn(|j| more(four[j], four[j + 2]));
    more(two[0], two[1])
}

/// The first place of a number in a row.
#[inline(always)]
pub(super) fn place_of(row: &[f64; 8], number: f64) -> usize {
    (0..8).rev().fold(0, |at, j| if row[j] == number { j } else { at })
}

/// 1: at most so much less than their interpolation are unsigned distances in a cell of edge h; no sharper than `enough`.
///
/// Let U be the interpolation, an affine part that falls by b along the edges from its largest corner and a rest. For coordinates
/// t the interpolation of the squares is U^2 and a variance, that of the affine part, sum of b^2 t (1 - t), but for what the
/// rest makes of it, which is at most |b| times the rest. So u^2 >= U^2 - S, S = sum of (h^2 - b^2) t (1 - t) + |b| rest, and
/// u >= U - e where S - 2 e U + e^2 <= 0: a sum over the axes that is largest where each is.
#[inline(always)]
pub(super) fn below(distances: &[f64; 8], edge: f64, enough: f64) -> f64 {
    let least = ends(distances).0;
    let (mean, falls, rest) = affine(distances);
    let squares = falls.map(|fall| fall * fall);
    let steep = (squares[0] + squares[1] + squares[2]).sqrt();
    let widest = edge * edge * (1.0 + 1e-12);
    let (mut spreads, mut more) = (squares.map(|square| (widest - square).max(0.0)), steep * rest * (1.0 + 1e-12));
    let total = |spreads: &[f64; 3], more: f64| 0.25 * (spreads[0] + spreads[1] + spreads[2]) + more;
    if total(&spreads, more) > 0.75 * widest {
        (spreads, more) = ([widest; 3], 0.0);
    }
    let square = total(&spreads, more);
    let plain = if least * least > square { least - (least * least - square).sqrt() } else { square.sqrt() };
    let falls = falls.map(f64::abs);
    let lowest = mean - 0.5 * (falls[0] + falls[1] + falls[2]) - rest;
    let excess = |e: f64| {
        let along = |axis: usize| {
            let slope = (spreads[axis] - 2.0 * e * falls[axis]).max(0.0);
            if slope > 0.0 { slope * slope / (4.0 * spreads[axis]) } else { 0.0 }
        };
        along(0) + along(1) + along(2) + more + e * e - 2.0 * e * lowest
    };
    let over = excess(plain);
    if plain <= enough || !(lowest > 0.0 && over <= 0.0) {
        return plain;
    }
    // The excess is convex: below its chord, above its tangent.
    let tangent = square / (2.0 * lowest + falls[0] + falls[1] + falls[2]);
    let ((low, above), (mut high, mut under)) = ((tangent, excess(tangent).max(0.0)), (plain, over));
    for _ in 0..3 {
        if above - under <= 0.0 {
            break;
        }
        (high, under) = {
            let chord = low + (high - low) * (above / (above - under)) * (1.0 + 1e-12);
            (chord, excess(chord))
        };
    }
    if under <= 0.0 { high } else { plain }
}

/// The affine function nearest to numbers at corners: its mean, how far it rises along each axis, and how far it is off.
#[inline(always)]
pub(super) fn affine(numbers: &[f64; 8]) -> (f64, [f64; 3], f64) {
    let mean = numbers.iter().sum::<f64>() / 8.0;
    let side = |corner: usize, axis: usize| if corner >> axis & 1 == 0 { -0.5 } else { 0.5 };
    let rises: [f64; 3] = std::array::from_fn(|axis| (0..8).map(|corner| numbers[corner] * side(corner, axis)).sum::<f64>() / 2.0);
    let affine = |corner: usize| mean + (0..3).map(|axis| rises[axis] * side(corner, axis)).sum::<f64>();
    let rest = (0..8).map(|corner| (numbers[corner] - affine(corner)).abs()).fold(0.0, f64::max);
    (mean, rises, rest)
}

#[inline(always)]
pub(super) fn ends(values: &[f64; 8]) -> (f64, f64) {
    (-highest(&values.map(|v| -v)), highest(values))
}

fn hull(values: [f64; 8]) -> Interval {
    let (lower, upper) = ends(&values);
    Interval { lower, upper }
}

/// Of unsigned distances on one side.
fn signed(side: Side, unsigned: Interval) -> Interval {
    if side.sign() < 0.0 { Interval { lower: -unsigned.upper, upper: -unsigned.lower } } else { unsigned }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::laws::Random;

    pub fn interpolate(numbers: &[f64; 8], at: DVec3) -> f64 {
        let weight = |j: usize, axis: usize| if j >> axis & 1 == 1 { at[axis] } else { 1.0 - at[axis] };
        (0..8).map(|j| numbers[j] * weight(j, 0) * weight(j, 1) * weight(j, 2)).sum()
    }

    #[test]
    fn two_slopes_that_meet_cost_as_much_as_their_kink() {
        for (p, q) in [(1.0, 1.0), (0.25, 3.0), (1e-6, 1.0)] {
            let rows = [[0.0, q, 0.0, q, 0.0, q, 0.0, q], [p, 0.0, p, 0.0, p, 0.0, p, 0.0]];
            let bound = mixed(&rows, f64::NEG_INFINITY);
            assert!((bound - p * q / (p + q)).abs() <= 1e-12 * p, "{p} {q}: {bound}");
        }
    }

    #[test]
    fn means_bound_the_least_of_all_rows_and_are_no_worse_than_any() {
        let mut random = Random::new(5);
        for case in 0..3000 {
            let zeros = random.unit();
            let count = 1 + random.below(9);
            let rows: Vec<[f64; 8]> =
                (0..count).map(|_| std::array::from_fn(|_| if random.unit() < zeros { 0.0 } else { random.between(-0.2, 1.0) })).collect();
            let bound = mixed(&rows, f64::NEG_INFINITY);
            let plain = rows.iter().map(|row| ends(row).1).fold(f64::INFINITY, f64::min);
            assert!(bound <= plain, "{case}: {bound} and {plain}");
            for _ in 0..50 {
                let at = DVec3::new(random.unit(), random.unit(), random.unit());
                let least = rows.iter().map(|row| interpolate(row, at)).fold(f64::INFINITY, f64::min);
                assert!(least <= bound + 1e-12, "{case}: {least} at {at}, {bound}");
            }
        }
    }

    #[test]
    fn corners_and_feet_bound_the_distance_to_any_cloud() {
        let mut random = Random::new(7);
        let (mut sharper, mut closest) = (0, 0.0);
        for case in 0..500 {
            let size = random.length(1e-2, 10.0);
            let cloud: Vec<DVec3> = (0..1 + random.below(20)).map(|_| random.direction() * random.between(0.5, 2.0)).collect();
            let nearest = |p: DVec3| cloud.iter().map(|q| (p - q).length()).fold(f64::INFINITY, f64::min);
            let cell = Aabb::new(DVec3::splat(-0.5 * size), DVec3::splat(0.5 * size));
            let corners: [Corner; 8] = std::array::from_fn(|j| {
                let point = cell.corner(j);
                let foot = *cloud.iter().min_by(|a, b| (point - **a).length().total_cmp(&(point - **b).length())).expect("a point");
                Corner { value: nearest(point), certain: true, point, foot, near: Slot(0) }
            });
            let told = corners.map(|corner| corner.value + random.between(-0.01, 0.01));
            let feet = std::array::from_fn(|k| corners[k % 8].foot);
            let bound = above_feet(&corners, &feet, &told, f64::NEG_INFINITY);
            let distances = corners.map(|corner| corner.value);
            let (sharp, plain) = (below(&distances, size, f64::NEG_INFINITY), below(&distances, size, f64::INFINITY));
            assert!(sharp <= plain, "{case}: {sharp} and {plain}");
            sharper += usize::from(sharp < 0.8 * plain);
            for _ in 0..100 {
                let at = DVec3::new(random.unit(), random.unit(), random.unit());
                let truth = nearest(cell.min + cell.size() * at);
                let (found, under) = (truth - interpolate(&told, at), interpolate(&distances, at) - truth);
                assert!(found <= bound + 1e-12 * size, "{case}: {found} at {at}, {bound}");
                assert!(under <= sharp + 1e-12 * size, "{case}: {under} below at {at}, {sharp}");
                closest = f64::max(closest, under / sharp);
            }
        }
        assert!(sharper > 15 && closest > 0.9, "{sharper} are sharper, {closest} of what is allowed occurs");
    }
}
