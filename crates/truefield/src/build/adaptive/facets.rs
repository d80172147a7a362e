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

use super::corner::{Corner, nearest_of};
use super::halves::{blend, of_part};
use super::planes::{Plane, Planes, Slopes, TURNED, stretched};
use super::triangles::{SHORT, above_triangles, below_triangles};
use crate::bvh::cover::{OCTANTS, Range};
use crate::bvh::octants::{NODES, node};
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
    /// What is said at the corners, and between them by interpolation: by the cell itself or by one that it is a part of.
    pub told: [f64; 8],
    /// Every triangle that can be nearest in it.
    pub list: &'a [Slot],
}

/// Proves cells of one surface; all lengths are in the tree's units.
pub(super) struct Prover<'a> {
    surface: &'a Surface,
    planes: &'a [Plane],
    taken: Planes,
    /// The largest coordinate of the surface.
    reach: f64,
}

impl<'a> Prover<'a> {
    pub fn new(surface: &'a Surface, planes: &'a [Plane]) -> Self {
        let extent = surface.tree().extent;
        Self { surface, planes, taken: Planes::default(), reach: extent.min.abs().max(extent.max.abs()).max_element() }
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
            known = known.intersection(signed(side, by_corners(&at.cell, corners, &told, limit)));
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
        let center = nearest_of(self.surface, at.cell.center(), at.corners);
        let feet = std::array::from_fn(|k| if k < 8 { at.corners[k].foot } else { center });
        let upper = above_in_parts(&at.cell, &feet, &blend(&told), limit);
        known.intersection(signed(side, Interval { lower: f64::NEG_INFINITY, upper }).widen(self.slack(&at.cell)))
    }

    /// Sharpens `known` by the planes of the list's triangles. Also returns which way the distance can change.
    pub fn planes(&mut self, at: &At<'_>, known: Interval) -> (Interval, Option<Slopes>) {
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
    fn by_planes(&mut self, at: &At<'_>) -> Option<(Interval, Slopes)> {
        let turned = self.taken.take(self.planes, at.list, at.range.upper)?;
        let center = self.surface.tree().center;
        // Heights first: what was stored in single numbers is better not read as vectors at once.
        let heights = self.taken.heights(&Aabb::new(at.cell.min - center, at.cell.max - center));
        let slopes = Slopes::of(&self.taken, turned)?;
        let found = stretched(heights, &at.told, slopes.stretch());
        let differences = std::array::from_fn(|j| at.corners[j].value - at.told[j]);
        Some((found.intersection(slopes.between(&differences, at.cell.size().x)), slopes))
    }

    /// Rounding of lengths within the cell and the surface.
    pub fn slack(&self, cell: &Aabb) -> f64 {
        let reach = cell.min.abs().max(cell.max.abs()).max_element().max(self.reach);
        // A cell's list may reach across the surface, and what is meant to be over a plane goes as far.
        let tree = self.surface.tree();
        let across = (cell.center() - tree.center).length() + cell.radius() + tree.radius;
        128.0 * f64::EPSILON * reach + TURNED * across + 1e-9 * cell.radius()
    }
}

/// How often a better mean is looked for.
const ROUNDS: usize = 8;

multiversion!(
    /// 1, and 2 for points of the surface: contains the unsigned distance minus the interpolation of what is told; from above no
    /// sharper than `limit`.
    fn by_corners(cell: &Aabb, corners: &[Corner; 8], told: &[f64; 8], limit: f64) -> Interval = by_corners_body
);

#[inline(always)]
fn by_corners_body<F: Fuse>(cell: &Aabb, corners: &[Corner; 8], told: &[f64; 8], limit: f64) -> Interval {
    let (mut distances, mut differences, mut feet) = ([0.0; 8], [0.0; 8], [[0.0; 8]; 3]);
    for (k, corner) in corners.iter().enumerate() {
        distances[k] = corner.value.abs();
        differences[k] = distances[k] - told[k];
        (feet[0][k], feet[1][k], feet[2][k]) = (corner.foot.x, corner.foot.y, corner.foot.z);
    }
    let difference = ends(&differences).0;
    let lower = difference - below(&distances, cell.max.x - cell.min.x, limit + difference);
    Interval { lower, upper: above_feet(cell, &feet, told, limit) }
}

#[inline(always)]
fn above_feet(cell: &Aabb, feet: &[[f64; 8]; 3], told: &[f64; 8], limit: f64) -> f64 {
    let ends = |axis: usize| [square(cell.min[axis], &feet[axis]), square(cell.max[axis], &feet[axis])];
    let (xs, ys, zs) = (ends(0), ends(1), ends(2));
    let mut columns = [[0.0; 8]; 8];
    for (j, column) in columns.iter_mut().enumerate() {
        let (x, y, z) = (&xs[j & 1], &ys[j >> 1 & 1], &zs[j >> 2]);
        for k in 0..8 {
            column[k] = (x[k] + y[k] + z[k]).sqrt() - told[j];
        }
    }
    mixed(std::array::from_fn(|j| &columns[j]), limit)
}

/// Along an axis the squared distances from a place.
#[inline(always)]
fn square<const N: usize>(place: f64, others: &[f64; N]) -> [f64; N] {
    let mut squares = [0.0; N];
    for k in 0..N {
        squares[k] = (place - others[k]) * (place - others[k]);
    }
    squares
}

multiversion!(
    /// 2 for points of the surface, one part of the cell after the other: the unsigned distance is at most so much more than what is
    /// told at the corners of the parts; no sharper than `limit`.
    pub(super) fn above_in_parts(cell: &Aabb, feet: &[DVec3; 9], told: &[f64; NODES], limit: f64) -> f64 = above_in_parts_body
);

#[inline(always)]
fn above_in_parts_body<F: Fuse>(cell: &Aabb, feet: &[DVec3; 9], told: &[f64; NODES], limit: f64) -> f64 {
    let (mut along, center) = ([[0.0; 9]; 3], cell.center());
    for (k, foot) in feet.iter().enumerate() {
        (along[0][k], along[1][k], along[2][k]) = (foot.x, foot.y, foot.z);
    }
    let steps = |axis: usize| [cell.min[axis], center[axis], cell.max[axis]].map(|place| square(place, &along[axis]));
    let (xs, ys, zs) = (steps(0), steps(1), steps(2));
    let mut columns = [[0.0; 9]; NODES];
    for (number, column) in columns.iter_mut().enumerate() {
        let (x, y, z) = (&xs[number % 3], &ys[number / 3 % 3], &zs[number / 9]);
        for k in 0..9 {
            column[k] = (x[k] + y[k] + z[k]).sqrt() - told[number];
        }
    }
    let mut high = f64::NEG_INFINITY;
    for octant in 0..OCTANTS {
        let found = mixed(std::array::from_fn(|corner| &columns[node(octant, corner)]), limit);
        high = if found > high { found } else { high };
        if high > limit {
            break;
        }
    }
    // Of what fails nothing else is known.
    if high > limit { f64::INFINITY } else { high }
}

/// The largest number of a mean of some rows, of which a corner each has its column, whose weights are chosen so that it is
/// small; stops at `limit`.
///
/// Whatever the weights are, the mean bounds what each of the rows bounds. From the row whose largest number is the least on:
/// where it is largest, another row is smallest; of both as much as makes the largest numbers equal.
#[inline(always)]
pub(super) fn mixed<const N: usize>(columns: [&[f64; N]; 8], limit: f64) -> f64 {
    let row = |number: usize| -> [f64; 8] { std::array::from_fn(|j| columns[j][number]) };
    let mut tops = *columns[0];
    for column in &columns[1..] {
        for number in 0..N {
            tops[number] = if column[number] > tops[number] { column[number] } else { tops[number] };
        }
    }
    let (first, mut high) = lowest(&tops);
    if high <= limit {
        return high;
    }
    let mut mean = row(first);
    let mut at = place_of(&mean, high);
    for _ in 0..ROUNDS {
        let (other, low) = lowest(columns[at]);
        let fall = high - low;
        if !(fall > 0.0 && fall < f64::INFINITY) {
            break;
        }
        let other = row(other);
        let mut rival = place_of(&other, highest(&other));
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
        if high <= limit {
            break;
        }
    }
    high
}

/// The first place of the least of some numbers, and that number.
#[inline(always)]
fn lowest<const N: usize>(numbers: &[f64; N]) -> (usize, f64) {
    let (mut least, mut count) = (*numbers, N);
    while count > 1 {
        let half = count.div_ceil(2);
        for k in 0..count / 2 {
            least[k] = if least[k + half] < least[k] { least[k + half] } else { least[k] };
        }
        count = half;
    }
    (place_of(numbers, least[0]), least[0])
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
pub(super) fn place_of<const N: usize>(row: &[f64; N], number: f64) -> usize {
    (0..N).rev().fold(0, |at, j| if row[j] == number { j } else { at })
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
    // Sums and differences of the ends of all edges along x, of what these make along y, and of that along z.
    let [sums, rises]: [[f64; 4]; 2] =
        [std::array::from_fn(|k| numbers[2 * k] + numbers[2 * k + 1]), std::array::from_fn(|k| numbers[2 * k + 1] - numbers[2 * k])];
    let ([low, high], across) = ([sums[0] + sums[1], sums[2] + sums[3]], (sums[1] - sums[0]) + (sums[3] - sums[2]));
    let mean = (low + high) / 8.0;
    let rises = [((rises[0] + rises[1]) + (rises[2] + rises[3])) / 4.0, across / 4.0, (high - low) / 4.0];
    let mut off = [0.0; 8];
    for corner in 0..8 {
        let side = |axis: usize| if corner >> axis & 1 == 0 { -0.5 } else { 0.5 };
        off[corner] = (numbers[corner] - (mean + (rises[0] * side(0) + rises[1] * side(1) + rises[2] * side(2)))).abs();
    }
    (mean, rises, highest(&off))
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

    /// What a mean of rows bounds.
    pub fn mean_of(rows: &[[f64; 8]]) -> f64 {
        let columns: [[f64; 16]; 8] = std::array::from_fn(|j| std::array::from_fn(|k| rows.get(k).map_or(f64::INFINITY, |row| row[j])));
        mixed(columns.each_ref(), f64::NEG_INFINITY)
    }

    #[test]
    fn two_slopes_that_meet_cost_as_much_as_their_kink() {
        for (p, q) in [(1.0, 1.0), (0.25, 3.0), (1e-6, 1.0)] {
            let rows = [[0.0, q, 0.0, q, 0.0, q, 0.0, q], [p, 0.0, p, 0.0, p, 0.0, p, 0.0]];
            let bound = mean_of(&rows);
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
            let bound = mean_of(&rows);
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
            let feet = [0, 1, 2].map(|axis| corners.map(|corner| corner.foot[axis]));
            let bound = above_feet(&cell, &feet, &told, f64::NEG_INFINITY);
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
