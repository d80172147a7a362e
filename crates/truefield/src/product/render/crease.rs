//! What of a mesh is smooth and what is sharp: a normal per corner, and the lines along creases.

use crate::geom::DVec3;

/// Normals and creases of a mesh; vertices at the same place count as one, so a soup of triangles reads like a solid.
pub(super) struct Shape {
    /// Unit normal of each corner of each triangle, smoothed over neighbours that are not across a crease.
    pub normals: Vec<[[f32; 3]; 3]>,
    /// Vertex pairs of the sharp, open and non-manifold edges.
    pub creases: Vec<[u32; 2]>,
}

impl Shape {
    pub fn of(vertices: &[DVec3], triangles: &[[u32; 3]], crease_degrees: f64) -> Self {
        let smooth = crease_degrees.to_radians().cos();
        let place = places(vertices);
        let faces: Vec<DVec3> = triangles.iter().map(|t| face_normal(t.map(|v| vertices[v as usize]))).collect();
        let creases = creases(&place, triangles, &faces, smooth);
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
