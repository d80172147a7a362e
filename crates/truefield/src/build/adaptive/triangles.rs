//! What the triangles of a complete list say of the distance in a cell: 2 and 3 of `facets`.

use super::facets::{affine, ends, highest, mixed, place_of};
use crate::bvh::tree::{Slot, Tree};
use crate::geom::{Aabb, DVec3, Facet};
use crate::simd::{Fuse, multiversion};

/// Longer lists are not looked through triangle by triangle.
pub(super) const SHORT: usize = 32;

multiversion!(
    /// 3: the unsigned distance minus the interpolation of `told` is so much at least; where it is less than minus the `limit` no
    /// more is known.
    pub(super) fn below_triangles(tree: &Tree, cell: &Aabb, list: &[Slot], told: &[f64; 8], limit: f64) -> f64 = below_triangles_body
);

#[inline(always)]
fn below_triangles_body<F: Fuse>(tree: &Tree, cell: &Aabb, list: &[Slot], told: &[f64; 8], limit: f64) -> f64 {
    let (center, places) = (cell.center(), corners_of(cell));
    let (slope, least) = support(&places, told, cell.size());
    let (mut lower, mut rising) = (f64::INFINITY, 0);
    for &slot in list {
        let facet = tree.facet_at(slot);
        let (along, beyond) = (slope.dot(facet.ab), slope.dot(facet.ac));
        let more = if along > beyond { along } else { beyond };
        let mut under = least - (slope.dot(facet.a) + if more > 0.0 { more } else { 0.0 });
        if under < -limit {
            rising += 1;
            if rising > SHORT {
                return f64::NEG_INFINITY;
            }
            under = -above_tangents(facet, &under_tangent(facet, center, &places, told), &places, told, limit);
        }
        lower = if under < lower { under } else { lower };
        if lower < -limit {
            // No more is wanted of what fails.
            return f64::NEG_INFINITY;
        }
    }
    lower
}

multiversion!(
    /// 2: the unsigned distance minus the interpolation of `told` is so much at most; no sharper than `limit`.
    pub(super) fn above_triangles(tree: &Tree, cell: &Aabb, list: &[Slot], told: &[f64; 8], limit: f64) -> f64 = above_triangles_body
);

#[inline(always)]
fn above_triangles_body<F: Fuse>(tree: &Tree, cell: &Aabb, list: &[Slot], told: &[f64; 8], limit: f64) -> f64 {
    let places = corners_of(cell);
    let axis = |axis: usize| -> [f64; 8] { std::array::from_fn(|j| places[j][axis]) };
    let (xs, ys, zs) = (axis(0), axis(1), axis(2));
    let mut columns = [[f64::INFINITY; SHORT]; 8];
    for (number, &slot) in list.iter().enumerate().take(SHORT) {
        let (facet, mut row) = (tree.facet_at(slot), [0.0; 8]);
        for lane in 0..8 {
            row[lane] = facet.distance_squared(DVec3::new(xs[lane], ys[lane], zs[lane])).sqrt() - told[lane];
        }
        (0..8).for_each(|lane| columns[lane][number] = row[lane]);
    }
    mixed(columns.each_ref(), limit)
}

#[inline(always)]
fn corners_of(cell: &Aabb) -> [DVec3; 8] {
    std::array::from_fn(|j| cell.corner(j))
}

/// 3: a slope n of length 1 at most, as what is told rises, and the least n.c minus what is told at a corner c. A distance to what
/// lies where n.p is at most a is n.x - a at least, an affine function.
#[inline(always)]
fn support(places: &[DVec3; 8], told: &[f64; 8], size: DVec3) -> (DVec3, f64) {
    let slope = DVec3::from(affine(told).1) / size;
    let slope = slope / slope.length().max(1.0);
    (slope, ends(&std::array::from_fn(|j| slope.dot(places[j]) - told[j])).0)
}

/// Tangents of a triangle's distance that are tried.
const TANGENTS: usize = 3;

/// The largest number of a mean of a tangent's row and of those where it is largest; stops at `limit`.
#[inline(always)]
fn above_tangents(facet: &Facet, row: &[f64; 8], places: &[DVec3; 8], told: &[f64; 8], limit: f64) -> f64 {
    let (mut columns, mut least, mut high) = (row.map(|number| [number; TANGENTS]), *row, highest(row));
    for count in 1..TANGENTS {
        if high <= limit {
            break;
        }
        let found = under_tangent(facet, places[place_of(&least, highest(&least))], places, told);
        for lane in 0..8 {
            columns[lane][count] = found[lane];
            least[lane] = if found[lane] < least[lane] { found[lane] } else { least[lane] };
        }
        high = mixed(columns.each_ref(), limit);
    }
    high
}

/// Of a cell's diagonal: tangents at points nearer to a triangle are not relied on.
const NEAR: f64 = 1e-2;

/// What is told at the corners less the tangent of the distance to a triangle at `p`.
#[inline(always)]
fn under_tangent(facet: &Facet, p: DVec3, places: &[DVec3; 8], told: &[f64; 8]) -> [f64; 8] {
    let foot = facet.foot(p);
    let away = p - (facet.a + facet.ab * foot.s + facet.ac * foot.t);
    let distance = foot.distance_squared.sqrt();
    // On the triangle there is no tangent, and next to it rounding turns it; zero is below.
    let (base, slope) = if distance > NEAR * (places[7] - places[0]).length() { (distance, away / distance) } else { (0.0, DVec3::ZERO) };
    std::array::from_fn(|lane| told[lane] - (base + slope.dot(places[lane] - p)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::build::adaptive::facets::tests::{interpolate, mean_of};
    use crate::build::adaptive::facets::{above_in_parts, below};
    use crate::build::adaptive::halves::blend;
    use crate::bvh::Candidate;
    use crate::laws::Random;
    use crate::mesh::TriangleMesh;
    use crate::run::Run;

    #[test]
    fn parts_of_cells_and_triangles_bound_the_distance_to_any_soup() {
        let mut random = Random::new(13);
        let (mut over, mut beneath, mut sharper, mut closest) = (0, 0, [0; 2], [0.0f64; 2]);
        for case in 0..600 {
            let (size, reach) = (random.length(1e-2, 1.0), random.length(1e-2, 1.0));
            let count = 1 + random.below(40) as u32;
            let mut vertices = Vec::new();
            for _ in 0..count {
                let middle = random.direction() * random.between(0.8, 2.0);
                vertices.extend((0..3).map(|_| middle + random.direction() * reach));
            }
            let mesh = TriangleMesh::new(vertices, (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect()).expect("a soup");
            let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
            let list: Vec<Slot> = (0..count).map(Slot).collect();
            let nearest = |p: DVec3| tree.nearest(p, Candidate::within(f64::INFINITY));
            let cell = Aabb::new(DVec3::splat(-0.5 * size), DVec3::splat(0.5 * size));
            let distances: [f64; 8] = corners_of(&cell).map(|p| nearest(p).distance_squared.sqrt());
            let told = distances.map(|distance| distance + 1e-3 * size * random.between(-1.0, 1.0));
            let feet: [DVec3; 9] = std::array::from_fn(|k| {
                let p = if k < 8 { cell.corner(k) } else { cell.center() };
                tree.facet(nearest(p).triangle).nearest(p).point
            });
            let limit = size * random.length(1e-2, 0.5);
            let (parts, by_triangles) =
                (above_in_parts(&cell, &feet, &blend(&told), limit), above_triangles(&tree, &cell, &list, &told, limit));
            let under = below_triangles(&tree, &cell, &list, &told, limit);
            assert!(parts <= limit || parts == f64::INFINITY, "{case}: {parts}");
            assert!(under >= -limit || under == f64::NEG_INFINITY, "{case}: {under}");
            sharper[0] += usize::from(parts <= limit && spread(&cell, &feet, &told) > limit);
            sharper[1] += usize::from(under >= -limit && below(&distances, size, f64::NEG_INFINITY) > limit + 1e-3 * size);
            (over, beneath) = (over + usize::from(parts <= limit), beneath + usize::from(under >= -limit));
            for _ in 0..100 {
                let at = DVec3::new(random.unit(), random.unit(), random.unit());
                let off = nearest(cell.min + cell.size() * at).distance_squared.sqrt() - interpolate(&told, at);
                assert!(off <= parts.min(by_triangles) + 1e-12, "{case}: {off} at {at}, {parts} and {by_triangles}");
                assert!(off >= under - 1e-12, "{case}: {off} at {at}, {under}");
                closest = [closest[0].max(off / parts), closest[1].max(if under < 0.0 { off / under } else { 0.0 })];
            }
        }
        assert!(over > 100 && beneath > 100, "{over} are bounded from above, {beneath} from below");
        assert!(sharper[0] > 10 && sharper[1] > 10, "{sharper:?} more than whole and without triangles");
        assert!(closest[0] > 0.8 && closest[1] > 0.8, "{closest:?} of what is allowed occurs");
    }

    /// The bound by the same points without parts.
    fn spread(cell: &Aabb, feet: &[DVec3; 9], told: &[f64; 8]) -> f64 {
        let rows = feet.map(|foot| std::array::from_fn(|j| (cell.corner(j) - foot).length() - told[j]));
        mean_of(&rows)
    }
}
