//! Which triangles the winding number sums, and the edges that bound them.

use crate::mesh::TriangleMesh;
use crate::mesh::topology::{Sets, Topology, collapsed};

use super::check::flat;

/// What the winding sum runs over.
#[derive(Clone, Debug)]
pub(crate) struct Layers {
    /// Triangles that count.
    pub triangles: Vec<u32>,
    /// Edges that bound the sum, from the first vertex to the second, so many times over.
    pub boundary: Vec<([u32; 2], u32)>,
}

impl Layers {
    /// Chooses, patch by patch of duplicated triangles, whether duplicates count as often as they occur
    /// (two solids that share a face) or once (a face written twice): whatever leaves the shorter boundary.
    pub fn new(mesh: &TriangleMesh, topology: &Topology) -> Self {
        let count = topology.triangles.len();
        // Weight of a triangle in the sum when all duplicates count, and when they count once; opposite ones cancel.
        let mut once: Vec<i8> = topology.triangles.iter().map(|t| i8::from(!collapsed(t))).collect();
        let mut sets = Sets::new(count);
        let mut copied = vec![false; count];
        for group in topology.copies() {
            let mut seen = None;
            for &t in group.even.iter().chain(&group.odd) {
                once[t as usize] = 0;
                copied[t as usize] = true;
                sets.join(*seen.get_or_insert(t), t);
            }
            match (group.even.first(), group.odd.first()) {
                (Some(&t), None) | (None, Some(&t)) => once[t as usize] = 1,
                _ => {}
            }
        }
        for edge in topology.edges() {
            let mut seen = None;
            for side in edge.iter().filter(|s| copied[s.triangle as usize]) {
                sets.join(*seen.get_or_insert(side.triangle), side.triangle);
            }
        }
        // Boundary length that counting once saves, by patch.
        let mut saved = vec![0.0; count];
        for edge in topology.edges() {
            if let Some(side) = edge.iter().find(|s| copied[s.triangle as usize]) {
                let [a, b] = edge[0].ends.map(|v| mesh.vertices()[v as usize]);
                let open = |weight: &dyn Fn(u32) -> i64| {
                    edge.iter().map(|s| if s.forward { weight(s.triangle) } else { -weight(s.triangle) }).sum::<i64>().abs()
                };
                let difference = open(&|_| 1) - open(&|t| i64::from(once[t as usize]));
                saved[sets.find(side.triangle) as usize] += difference as f64 * (b - a).length();
            }
        }
        let weight: Vec<i64> = (0..count)
            .map(|t| {
                let counts = copied[t] && saved[sets.find(t as u32) as usize] <= 0.0;
                if counts { 1 } else { i64::from(once[t]) }
            })
            .collect();
        let mut boundary = Vec::new();
        for edge in topology.edges() {
            let times: i64 = edge.iter().map(|s| if s.forward { weight[s.triangle as usize] } else { -weight[s.triangle as usize] }).sum();
            let [a, b] = edge[0].ends;
            if times != 0 {
                boundary.push((if times > 0 { [a, b] } else { [b, a] }, times.unsigned_abs() as u32));
            }
        }
        Self { triangles: (0..count as u32).filter(|&t| weight[t as usize] != 0).collect(), boundary }
    }

    /// By triangle of the mesh: whether it counts, has an area and is alone in its place.
    pub fn alone(&self, mesh: &TriangleMesh, topology: &Topology) -> Vec<bool> {
        let mut alone = vec![false; topology.triangles.len()];
        for &t in &self.triangles {
            alone[t as usize] = !flat(&mesh.corners(t));
        }
        for copies in topology.copies() {
            for &t in copies.even.iter().chain(&copies.odd) {
                alone[t as usize] = false;
            }
        }
        alone
    }
}
