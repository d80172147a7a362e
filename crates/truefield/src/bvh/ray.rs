//! First triangle that a ray meets.
//!
//! Edges are tested as Woop, Benthin and Wald do (*Watertight Ray/Triangle Intersection*, 2013):
//! two triangles that share an edge compute the same number for it with opposite signs, so a ray
//! cannot slip between them, whatever the rounding.

use super::tree::{ABSENT, LEAF, Tree, WIDTH};
use crate::geom::DVec3;
use crate::mesh::TriangleMesh;

/// Triangles that look thinner than this, height to length, are met on their longest edge.
const EDGE_ON: f64 = 1e-9;

/// A half line.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it starts.
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Hits must be farther than this.
    pub beyond: f64,
    /// A triangle that the ray passes through, usually the one it starts on; `u32::MAX` for none.
    pub ignore: u32,
}

/// What a ray meets first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the origin.
    pub distance: f64,
    /// The triangle; the lowest index where several are met at the same distance.
    pub triangle: u32,
}

/// The ray in a frame in which it runs along z.
struct Sheared {
    origin: DVec3,
    axes: [usize; 3],
    shear: [f64; 3],
}

impl Sheared {
    fn new(ray: &Ray) -> Self {
        let d = ray.direction;
        let size = d.abs();
        let z = if size.z >= size.x.max(size.y) { 2 } else { usize::from(size.y >= size.x) };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Self { origin: ray.origin, axes: [x, y, z], shear: [d[x] / d[z], d[y] / d[z], 1.0 / d[z]] }
    }

    fn apply(&self, vertex: DVec3) -> [f64; 3] {
        let v = vertex - self.origin;
        let [x, y, z] = self.axes;
        [v[x] - self.shear[0] * v[z], v[y] - self.shear[1] * v[z], self.shear[2] * v[z]]
    }

    /// Distance to the triangle along the ray, negative behind it; `None` if the line misses it or lies in its plane.
    fn meet(&self, corners: [DVec3; 3]) -> Option<f64> {
        let [a, b, c] = corners.map(|v| self.apply(v));
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        // Seen nearly edge-on the weights are all rounding; the longest edge knows better.
        let (length_squared, p, q) = [(a, b), (b, c), (c, a)]
            .map(|(p, q)| (square(q[0] - p[0]) + square(q[1] - p[1]), p, q))
            .into_iter()
            .fold((0.0, a, a), |longest, edge| if edge.0 > longest.0 { edge } else { longest });
        if sum.abs() < EDGE_ON * length_squared {
            let along = -(p[0] * (q[0] - p[0]) + p[1] * (q[1] - p[1])) / length_squared;
            return Some(p[2] + along.clamp(0.0, 1.0) * (q[2] - p[2]));
        }
        Some((u * a[2] + v * b[2] + w * c[2]) / sum)
    }
}

fn square(x: f64) -> f64 {
    x * x
}

impl Tree {
    /// The first hit of the ray on `mesh`, the mesh that the tree was built over.
    ///
    /// Triangles seen edge-on are passed through; so is `ray.ignore`. About a microsecond.
    pub fn first_hit(&self, mesh: &TriangleMesh, ray: &Ray) -> Option<Hit> {
        let sheared = Sheared::new(ray);
        let origin = ray.origin - self.center;
        // Boxes are grown by what rounding may move a hit.
        let slack = 8.0 * f64::EPSILON * (origin.abs().max_element() + self.center.abs().max_element() + self.radius);
        let inverse = DVec3::from_array(ray.direction.to_array().map(|d| if d.abs() < 1e-100 { 1e100f64.copysign(d) } else { 1.0 / d }));
        let mut best: Option<Hit> = None;
        let mut stack: Vec<(f64, u32)> = Vec::with_capacity(64);
        stack.push((0.0, 0));
        while let Some((near, index)) = stack.pop() {
            if best.is_some_and(|hit| near > hit.distance) {
                continue;
            }
            if index & LEAF != 0 {
                let packet = &self.packets[(index & !LEAF) as usize];
                for (lane, &triangle) in packet.triangle.iter().enumerate() {
                    if triangle == ray.ignore || (lane > 0 && triangle == packet.triangle[lane - 1]) {
                        continue;
                    }
                    let Some(distance) = sheared.meet(mesh.corners(triangle)) else { continue };
                    let nearer = |hit: Hit| distance < hit.distance || (distance == hit.distance && triangle < hit.triangle);
                    if distance > ray.beyond && best.is_none_or(nearer) {
                        best = Some(Hit { distance, triangle });
                    }
                }
                continue;
            }
            let node = &self.nodes[index as usize];
            let limit = best.map_or(f64::INFINITY, |hit| hit.distance);
            let start = stack.len();
            for lane in (0..WIDTH).filter(|&lane| node.child[lane] != ABSENT) {
                let (mut enter, mut leave) = (ray.beyond, limit);
                for axis in 0..3 {
                    let low = (f64::from(node.min[axis][lane]) - slack - origin[axis]) * inverse[axis];
                    let high = (f64::from(node.max[axis][lane]) + slack - origin[axis]) * inverse[axis];
                    enter = enter.max(low.min(high) * (1.0 - 4.0 * f64::EPSILON * low.min(high).signum()));
                    leave = leave.min(low.max(high) * (1.0 + 4.0 * f64::EPSILON * low.max(high).signum()));
                }
                if enter <= leave {
                    stack.push((enter, node.child[lane]));
                }
            }
            // The nearest child on top.
            stack[start..].sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(b.1.cmp(&a.1)));
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Run;

    fn random(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    fn direction(state: &mut u64) -> DVec3 {
        loop {
            let v = DVec3::new(random(state), random(state), random(state));
            if v.length() > 0.1 {
                return v.normalize();
            }
        }
    }

    /// A sphere of `n` x `2n` quads, about `center`.
    fn sphere(n: u32, center: DVec3) -> TriangleMesh {
        let at = |i: u32, j: u32| {
            let (theta, phi) = (f64::from(i) / f64::from(n) * std::f64::consts::PI, f64::from(j) / f64::from(n) * std::f64::consts::PI);
            center + DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
        };
        let vertices = (0..=n).flat_map(|i| (0..2 * n).map(move |j| at(i, j))).collect();
        let vertex = |i: u32, j: u32| i * 2 * n + j % (2 * n);
        let quads = (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j)));
        let triangles = quads
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                [[a, b, c], [a, c, d]]
            })
            .collect();
        TriangleMesh::new(vertices, triangles).expect("a sphere")
    }

    #[test]
    fn equals_the_search_over_all_triangles() {
        for (n, center) in [(3, DVec3::ZERO), (12, DVec3::new(5.0, -3.0, 1e4))] {
            let mesh = sphere(n, center);
            let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
            let mut state = 5;
            for _ in 0..3000 {
                let origin = center + 3.0 * DVec3::new(random(&mut state), random(&mut state), random(&mut state));
                let ray = Ray { origin, direction: direction(&mut state), beyond: 0.0, ignore: 17 };
                let sheared = Sheared::new(&ray);
                let mut judge: Option<Hit> = None;
                for triangle in (0..mesh.triangles().len() as u32).filter(|&t| t != 17) {
                    if let Some(distance) = sheared.meet(mesh.corners(triangle)).filter(|&d| d > 0.0)
                        && judge.is_none_or(|hit| distance < hit.distance)
                    {
                        judge = Some(Hit { distance, triangle });
                    }
                }
                assert_eq!(tree.first_hit(&mesh, &ray), judge);
            }
        }
    }

    #[test]
    fn nothing_slips_through_edges_and_corners() {
        let center = DVec3::new(0.1, 0.2, 0.3);
        let mesh = sphere(16, center);
        let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
        let mut state = 9;
        for round in 0..20_000usize {
            let triangle = round % mesh.triangles().len();
            let [a, b, _] = mesh.corners(triangle as u32);
            let target = if round.is_multiple_of(2) { a } else { a.lerp(b, random(&mut state) + 0.5) };
            let origin = center + 0.6 * DVec3::new(random(&mut state), random(&mut state), random(&mut state));
            let ray = Ray { origin, direction: (target - origin).normalize(), beyond: 0.0, ignore: u32::MAX };
            let hit = tree.first_hit(&mesh, &ray).expect("a closed mesh is hit from inside");
            assert!((hit.distance - target.distance(origin)).abs() < 1e-9, "{round}: {hit:?}");
        }
    }

    #[test]
    fn axis_directions_and_flat_boxes_are_fine() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let vertices = corners.iter().map(|&(x, y)| DVec3::new(x, y, 2.0)).collect();
        let mesh = TriangleMesh::new(vertices, vec![[0, 1, 2], [0, 2, 3]]).expect("a square");
        let tree = Tree::build(&mesh, &Run::default()).expect("a tree");
        for (x, y) in [(0.0, 0.0), (0.5, 0.5), (1.0, 0.3), (0.25, 1.0)] {
            let ray = Ray { origin: DVec3::new(x, y, 0.0), direction: DVec3::Z, beyond: 0.0, ignore: u32::MAX };
            assert_eq!(tree.first_hit(&mesh, &ray).map(|hit| hit.distance), Some(2.0));
            let away = Ray { direction: -DVec3::Z, ..ray };
            assert_eq!(tree.first_hit(&mesh, &away), None);
            let past = Ray { beyond: 2.0, ..ray };
            assert_eq!(tree.first_hit(&mesh, &past), None);
        }
    }
}
