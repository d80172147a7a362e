//! What of a mesh is smooth and what is sharp: a normal per corner, and the lines along creases.

use crate::geom::{Aabb, DVec3};

/// The least length of connected lines that are drawn, as a share of the diagonal of all of them.
const SHORTEST_LINE: f64 = 0.03;

/// Normals and creases of a mesh; vertices at the same place count as one, so a soup of triangles reads like a solid.
pub(super) struct Shape {
    /// Unit normal of each corner of each triangle, smoothed over neighbours that are not across a crease.
    pub normals: Vec<[[f32; 3]; 3]>,
    /// Vertex pairs of the sharp, open and non-manifold edges that make lines of some length.
    pub creases: Vec<[u32; 2]>,
}

impl Shape {
    pub fn of(vertices: &[DVec3], triangles: &[[u32; 3]], crease_degrees: f64) -> Self {
        let smooth = crease_degrees.to_radians().cos();
        let place = places(vertices);
        let faces: Vec<DVec3> = triangles.iter().map(|t| face_normal(t.map(|v| vertices[v as usize]))).collect();
        let creases = long_lines(vertices, creases(&place, triangles, &faces, smooth));
        Self { normals: corner_normals(vertices, &place, triangles, &faces, smooth), creases }
    }
}

/// Unit normal; zero for a triangle without area.
fn face_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    // Scaled first: the product of tiny edges would underflow.
    let scale = ab.abs().max_element().max(ac.abs().max_element());
    if scale > 0.0 { (ab / scale).cross(ac / scale).normalize_or_zero() } else { DVec3::ZERO }
}

/// For each vertex the lowest vertex at the same place.
fn places(vertices: &[DVec3]) -> Vec<u32> {
    let key = |v: u32| {
        // Adding zero makes -0 and 0 one place.
        let p = vertices[v as usize] + DVec3::ZERO;
        [p.x, p.y, p.z]
    };
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    let compare = |a: &[f64; 3], b: &[f64; 3]| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2]));
    order.sort_unstable_by(|&a, &b| compare(&key(a), &key(b)).then(a.cmp(&b)));
    let mut place = vec![0; vertices.len()];
    let mut first = 0;
    for (rank, &v) in order.iter().enumerate() {
        if rank == 0 || key(order[rank - 1]) != key(v) {
            first = v;
        }
        place[v as usize] = first;
    }
    place
}

fn creases(place: &[u32], triangles: &[[u32; 3]], faces: &[DVec3], smooth: f64) -> Vec<[u32; 2]> {
    // Lower place, higher place, triangle, and whether the triangle runs from the lower to the higher one.
    let mut edges: Vec<(u32, u32, u32, bool)> = Vec::with_capacity(3 * triangles.len());
    for (index, t) in triangles.iter().enumerate() {
        if faces[index] == DVec3::ZERO {
            continue;
        }
        for corner in 0..3 {
            let (a, b) = (place[t[corner] as usize], place[t[(corner + 1) % 3] as usize]);
            edges.push((a.min(b), a.max(b), index as u32, a < b));
        }
    }
    edges.sort_unstable();
    edges
        .chunk_by(|a, b| (a.0, a.1) == (b.0, b.1))
        .filter(|group| match group {
            [one, other] => {
                let turned = if one.3 == other.3 { -1.0 } else { 1.0 };
                faces[one.2 as usize].dot(faces[other.2 as usize]) * turned < smooth
            }
            _ => true,
        })
        .map(|group| [group[0].0, group[0].1])
        .collect()
}

/// Without the lines that are shorter than a share of the whole: a scan is full of single sharp edges that mean nothing.
fn long_lines(vertices: &[DVec3], creases: Vec<[u32; 2]>) -> Vec<[u32; 2]> {
    let mut parent: Vec<u32> = (0..vertices.len() as u32).collect();
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    for &[a, b] in &creases {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent[a.max(b) as usize] = a.min(b);
    }
    let mut length = vec![0.0; vertices.len()];
    for &[a, b] in &creases {
        length[root(&mut parent, a) as usize] += vertices[a as usize].distance(vertices[b as usize]);
    }
    let shortest = SHORTEST_LINE * Aabb::around(creases.iter().flatten().map(|&v| vertices[v as usize])).diagonal();
    creases.into_iter().filter(|[a, _]| length[root(&mut parent, *a) as usize] >= shortest).collect()
}

fn corner_normals(vertices: &[DVec3], place: &[u32], triangles: &[[u32; 3]], faces: &[DVec3], smooth: f64) -> Vec<[[f32; 3]; 3]> {
    // Which corners meet at each place.
    let mut start = vec![0_usize; vertices.len() + 1];
    for &v in triangles.iter().flatten() {
        start[place[v as usize] as usize + 1] += 1;
    }
    for index in 0..vertices.len() {
        start[index + 1] += start[index];
    }
    let mut corners = vec![(0_u32, DVec3::ZERO); 3 * triangles.len()];
    let mut fill = start.clone();
    for (index, t) in triangles.iter().enumerate() {
        for corner in 0..3 {
            let [p, q, r] = [0, 1, 2].map(|step| vertices[t[(corner + step) % 3] as usize]);
            let angle = (q - p).normalize_or_zero().dot((r - p).normalize_or_zero()).clamp(-1.0, 1.0).acos();
            let slot = &mut fill[place[t[corner] as usize] as usize];
            corners[*slot] = (index as u32, faces[index] * angle);
            *slot += 1;
        }
    }
    triangles
        .iter()
        .zip(faces)
        .map(|(t, own)| {
            t.map(|v| {
                let at = place[v as usize] as usize;
                let sum: DVec3 = corners[start[at]..start[at + 1]]
                    .iter()
                    .filter(|(other, _)| own.dot(faces[*other as usize]) >= smooth)
                    .map(|(_, weighted)| *weighted)
                    .sum();
                let normal = sum.try_normalize().unwrap_or(*own);
                [normal.x as f32, normal.y as f32, normal.z as f32]
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(i: usize) -> DVec3 {
        DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64)
    }

    /// A cube whose triangles share no vertices, as in an STL file.
    fn cube() -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let vertices = quads.iter().flat_map(|q| [q[0], q[1], q[2], q[0], q[2], q[3]]).map(corner).collect();
        (vertices, (0..12).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect())
    }

    #[test]
    fn a_soup_that_looks_like_a_cube_has_twelve_creases_and_flat_sides() {
        let (vertices, triangles) = cube();
        let shape = Shape::of(&vertices, &triangles, 32.0);
        assert_eq!(shape.creases.len(), 12);
        for (t, normals) in triangles.iter().zip(&shape.normals) {
            let flat = face_normal(t.map(|v| vertices[v as usize]));
            assert!(normals.iter().all(|n| DVec3::from(n.map(f64::from)).dot(flat) > 0.999_999));
        }
    }

    #[test]
    fn a_flipped_triangle_makes_no_crease_and_a_missing_one_three() {
        let (vertices, mut triangles) = cube();
        triangles[3].swap(0, 1);
        assert_eq!(Shape::of(&vertices, &triangles, 32.0).creases.len(), 12);
        triangles.remove(3);
        // Two of its sides are edges of the cube already; its diagonal is open now.
        assert_eq!(Shape::of(&vertices, &triangles, 32.0).creases.len(), 13);
    }

    #[test]
    fn a_drum_is_smooth_around_and_sharp_at_its_rims() {
        let count = 48_u32;
        let ring = |z: f64| {
            (0..count).map(move |k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / f64::from(count)).sin_cos();
                DVec3::new(cos, sin, z)
            })
        };
        let vertices: Vec<DVec3> = ring(0.0).chain(ring(2.0)).chain([DVec3::ZERO, DVec3::Z * 2.0]).collect();
        let triangles: Vec<[u32; 3]> = (0..count)
            .flat_map(|k| {
                let (a, b) = (k, (k + 1) % count);
                [[a, b, b + count], [a, b + count, a + count], [b, a, 2 * count], [a + count, b + count, 2 * count + 1]]
            })
            .collect();
        let shape = Shape::of(&vertices, &triangles, 32.0);
        assert_eq!(shape.creases.len(), 2 * count as usize);
        for (t, normals) in triangles.iter().zip(&shape.normals).filter(|(t, _)| t[2] < 2 * count) {
            for (&v, normal) in t.iter().zip(normals) {
                let radial = vertices[v as usize] * DVec3::new(1.0, 1.0, 0.0);
                assert!(DVec3::from(normal.map(f64::from)).dot(radial) > 0.999, "vertex {v}: {normal:?}");
            }
        }
    }

    #[test]
    fn single_sharp_edges_of_a_scan_are_no_lines() {
        let vertices = vec![DVec3::ZERO, DVec3::X * 10.0, DVec3::Y * 10.0, DVec3::splat(5.0), DVec3::splat(5.1)];
        assert_eq!(long_lines(&vertices, vec![[0, 1], [1, 2], [3, 4]]), [[0, 1], [1, 2]]);
        assert!(long_lines(&vertices, Vec::new()).is_empty());
    }
}
