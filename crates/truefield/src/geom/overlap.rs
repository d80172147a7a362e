//! Whether a triangle and a box, or a segment, share a point.

use super::{Aabb, DVec3};

/// Separating axis test of a closed triangle and a closed box, thirteen axes.
///
/// Conservative: contact within rounding counts as overlap, an overlap is never missed.
pub fn triangle_overlaps_box(corners: [DVec3; 3], cell: &Aabb) -> bool {
    let center = cell.center();
    let half = cell.size() * 0.5;
    let v = corners.map(|c| c - center);
    // What rounding of the differences, products and sums below can amount to.
    let size = v.iter().fold(half.max_element(), |m, c| m.max(c.abs().max_element())) + f64::EPSILON * center.abs().max_element();
    let slack = 16.0 * f64::EPSILON * (size + center.abs().max_element());
    let low = v[0].min(v[1]).min(v[2]);
    let high = v[0].max(v[1]).max(v[2]);
    if low.cmpgt(half + slack).any() || high.cmplt(-half - slack).any() {
        return false;
    }
    let separated = |axis: DVec3| {
        let d = v.map(|c| c.dot(axis));
        let reach = half.dot(axis.abs()) + slack * 3.0 * axis.abs().max_element();
        d[0].min(d[1]).min(d[2]) > reach || d[0].max(d[1]).max(d[2]) < -reach
    };
    let edges = [v[1] - v[0], v[2] - v[1], v[0] - v[2]];
    for e in edges {
        // Cross products with the unit axes.
        let axes = [DVec3::new(0.0, -e.z, e.y), DVec3::new(e.z, 0.0, -e.x), DVec3::new(-e.y, e.x, 0.0)];
        if axes.into_iter().any(separated) {
            return false;
        }
    }
    // A spoilt normal of a sliver separates nothing: the rounding of the cross product is allowed for.
    let n = edges[0].cross(edges[1]);
    let spoilt = 8.0 * f64::EPSILON * edges[0].length() * edges[1].length();
    let d = v[0].dot(n);
    d.abs() <= half.dot(n.abs()) + 3.0 * (spoilt * size + slack * n.abs().max_element())
}

/// Separating axis test of a closed triangle and a closed segment.
///
/// Conservative: contact within rounding counts as overlap, an overlap is never missed. Needles of no area that pass
/// a segment on all sides of its box may count too.
pub fn triangle_meets_segment(corners: [DVec3; 3], ends: [DVec3; 2]) -> bool {
    let center = (ends[0] + ends[1]) * 0.5;
    let half = (ends[1] - ends[0]) * 0.5;
    let v = corners.map(|c| c - center);
    // What rounding of the differences, products and sums below can amount to; an axis may be off by anything.
    let size = v.iter().fold(half.abs().max_element(), |m, c| m.max(c.abs().max_element()));
    let slack = 64.0 * f64::EPSILON * (size + center.abs().max_element());
    let separated = |axis: DVec3| {
        let d = v.map(|c| c.dot(axis));
        let reach = half.dot(axis).abs() + slack * 3.0 * axis.abs().max_element();
        d[0].min(d[1]).min(d[2]) > reach || d[0].max(d[1]).max(d[2]) < -reach
    };
    let edges = [v[1] - v[0], v[2] - v[1], v[0] - v[2]];
    let n = edges[0].cross(edges[1]);
    let across = edges.map(|e| half.cross(e));
    // Where the segment lies in the plane of the triangle, the axes in that plane.
    let along = edges.map(|e| n.cross(e));
    !([DVec3::X, DVec3::Y, DVec3::Z, n, n.cross(half)].into_iter().chain(across).chain(along).any(separated))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Facet;

    #[test]
    fn agrees_with_distance_where_the_answer_is_clear() {
        let mut state = 5u64;
        let mut random = move || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
        };
        let (mut hits, mut misses) = (0, 0);
        for round in 0..40_000 {
            let thin = if round % 3 == 0 { 1e-9 } else { 1.0 };
            let mut point = || DVec3::new(random(), random(), random());
            let (a, b) = (point() * 2.0, point() * 2.0);
            let c = (a + b) * 0.5 + point() * thin;
            let cell = Aabb::new(point() * 0.3 - 0.5, point() * 0.3 + 0.5);
            let overlap = triangle_overlaps_box([a, b, c], &cell);
            // A point of the triangle in the box proves overlap; a box far from the triangle its absence.
            let facet = Facet::new(a, b, c);
            let mut p = cell.center();
            for _ in 0..60 {
                p = facet.nearest(p).point.clamp(cell.min, cell.max);
            }
            let gap = facet.distance_squared(p).sqrt();
            if gap < 1e-14 {
                assert!(overlap, "missed {a} {b} {c} {cell:?}");
                hits += 1;
            } else if gap > 0.05 {
                assert!(!overlap, "gap {gap} {a} {b} {c} {cell:?}");
                misses += 1;
            }
        }
        assert!(hits > 1000 && misses > 1000);
    }
}
