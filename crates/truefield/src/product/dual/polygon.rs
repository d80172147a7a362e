//! The polygon around a crossing, in triangles.

use super::crossing::Crossing;
use crate::geom::{DVec3, Facet};

/// Two triangles of a four-sided polygon, named by their places around the crossing.
///
/// A diagonal must end in a leaf that has the crossed edge as an edge of its own: any two other leaves may be opposite each
/// other about more edges than this, and four triangles would meet in the one side that they then share.
pub(super) fn halves(crossing: &Crossing, depths: &[u32], corners: [DVec3; 4]) -> [[usize; 3]; 2] {
    let depth = crossing.leaves.map(|leaf| depths[leaf as usize]);
    let most = depth.into_iter().fold(0, u32::max);
    let [even, odd] = [[[0, 1, 2], [0, 2, 3]], [[1, 2, 3], [1, 3, 0]]];
    match [depth[0] == most || depth[2] == most, depth[1] == most || depth[3] == most] {
        [true, false] => return even,
        [false, true] => return odd,
        _ => {}
    }
    let [a, b, c, d] = corners;
    let (first, second) = (c - a, d - b);
    // How far the corners are from a plane, beside their size: where they are, the crossing tells which fold is right.
    let bulge = (b - a).dot(first.cross(second));
    let size = first.length_squared() * second.length();
    if bulge.abs() > 0.02 * size {
        let away = |two: [[usize; 3]; 2]| {
            let each = two.map(|t| Facet::new(corners[t[0]], corners[t[1]], corners[t[2]]).distance_squared(crossing.point));
            each[0].min(each[1])
        };
        let (one, other) = (away(even), away(odd));
        if one != other {
            return if one < other { even } else { odd };
        }
    }
    if first.length_squared() <= second.length_squared() { even } else { odd }
}
