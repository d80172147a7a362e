//! Where to ask: points that are hard for a mesh.

use super::Random;
use crate::geom::DVec3;
use crate::mesh::TriangleMesh;

/// `count` points of every hard kind around `mesh`, the same for the same `seed`: uniform, near and on
/// the surface, at corners, edge midpoints and face centres, between two places of the surface (near
/// the medial axis), level with corners, and up to a thousand boxes away.
pub fn places(mesh: &TriangleMesh, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Random::new(seed);
    let extent = mesh.extent();
    let size = extent.diagonal();
    (0..count)
        .map(|index| {
            let [a, b, c] = mesh.corners(random.below(mesh.triangles().len()) as u32);
            let on = surface_point([a, b, c], &mut random);
            match index % 11 {
                0 => random.within(&extent),
                1 => random.within(&extent.grow(size)),
                2 => on + random.direction() * (size * random.length(1e-16, 1e-1)),
                3 => on,
                4 => a,
                5 => a * 0.5 + b * 0.5,
                6 => (a + b + c) / 3.0,
                7 => {
                    let other = surface_point(mesh.corners(random.below(mesh.triangles().len()) as u32), &mut random);
                    on * 0.5 + other * 0.5
                }
                8 => {
                    // In line with corners: the trap of ray casting and of edge-on faces.
                    let mut p = random.within(&extent.grow(0.5 * size));
                    let axis = random.below(3);
                    p[axis] = a[axis];
                    p[(axis + 1) % 3] = b[(axis + 1) % 3];
                    p
                }
                9 => {
                    let normal = (b - a).cross(c - a).normalize_or_zero();
                    on + normal * (size * random.between(-0.5, 0.5))
                }
                _ => extent.center() + random.direction() * (size * random.length(1.0, 1e3)),
            }
        })
        .collect()
}

fn surface_point([a, b, c]: [DVec3; 3], random: &mut Random) -> DVec3 {
    let (u, v) = (random.unit(), random.unit());
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    a + (b - a) * u + (c - a) * v
}
