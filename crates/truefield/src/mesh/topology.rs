//! Which triangles meet where: vertices welded by position, sides sorted by edge.

use std::sync::OnceLock;

use crate::geom::DVec3;
use crate::mesh::{Positions, TriangleMesh};

/// One side of a triangle, from corner `side` to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleSide {
    /// Welded ends, the lower first.
    pub ends: [u32; 2],
    pub triangle: u32,
    pub side: u8,
    /// Whether the triangle runs from the lower end to the higher.
    pub forward: bool,
}

/// Neighbourhoods of a mesh whose vertices count as one where their positions are equal (-0 equals 0).
///
/// The welding serves the analysis only; nothing is repaired. O(n log n).
#[derive(Clone, Debug)]
pub(crate) struct Topology {
    /// Corners of each triangle by welded vertex: the lowest index among equal positions.
    pub triangles: Vec<[u32; 3]>,
    /// Sides of all triangles with three different corners, sorted by edge, then by triangle.
    sides: Vec<TriangleSide>,
    /// Number of vertices of the mesh.
    vertices: usize,
    copies: OnceLock<Vec<Copies>>,
    pinched: OnceLock<Vec<bool>>,
}

/// Triangles over the same three welded corners.
#[derive(Clone, Debug, Default)]
pub(crate) struct Copies {
    /// Turning the same way as the lowest sorted corner order, in index order.
    pub even: Vec<u32>,
    /// Turning the other way.
    pub odd: Vec<u32>,
}

impl Topology {
    pub fn new(mesh: &TriangleMesh) -> Self {
        let weld = weld(mesh.vertices());
        let triangles: Vec<[u32; 3]> = mesh.triangles().iter().map(|t| t.map(|v| weld[v as usize])).collect();
        let mut sides = Vec::with_capacity(3 * triangles.len());
        for (index, t) in triangles.iter().enumerate() {
            if collapsed(t) {
                continue;
            }
            for side in 0..3 {
                let (from, to) = (t[side], t[(side + 1) % 3]);
                sides.push(TriangleSide {
                    ends: [from.min(to), from.max(to)],
                    triangle: index as u32,
                    side: side as u8,
                    forward: from < to,
                });
            }
        }
        let sides = by_edge(&sides, mesh.vertices().len());
        Self { triangles, sides, vertices: mesh.vertices().len(), copies: OnceLock::new(), pinched: OnceLock::new() }
    }

    /// The sides that lie on one edge, edge by edge, in the order of their ends.
    pub fn edges(&self) -> impl Iterator<Item = &[TriangleSide]> {
        self.sides.chunk_by(|a, b| a.ends == b.ends)
    }

    /// Whether every edge is run along as often one way as the other.
    pub fn is_closed(&self) -> bool {
        self.edges().all(|sides| 2 * sides.iter().filter(|side| side.forward).count() == sides.len())
    }

    /// By vertex: whether triangles meet there that are not joined by edges around it.
    pub fn pinched(&self) -> &[bool] {
        self.pinched.get_or_init(|| self.find_pinched())
    }

    fn find_pinched(&self) -> Vec<bool> {
        // Corners joined across edges make fans; a vertex with two fans is pinched.
        let mut corners = Sets::new(3 * self.triangles.len());
        for sides in self.edges() {
            for end in sides[0].ends {
                let corner_at = |t: u32| 3 * t + (0..3).find(|&k| self.triangles[t as usize][k as usize] == end).unwrap_or(0);
                for side in &sides[1..] {
                    corners.join(corner_at(sides[0].triangle), corner_at(side.triangle));
                }
            }
        }
        let mut fan = vec![u32::MAX; self.vertices];
        let mut pinched = vec![false; self.vertices];
        for (t, welded) in self.triangles.iter().enumerate().filter(|(_, welded)| !collapsed(welded)) {
            for (k, &v) in welded.iter().enumerate() {
                let root = corners.find((3 * t + k) as u32);
                pinched[v as usize] |= fan[v as usize] != u32::MAX && fan[v as usize] != root;
                fan[v as usize] = root;
            }
        }
        pinched
    }

    /// Groups of two or more triangles over the same corners.
    pub fn copies(&self) -> &[Copies] {
        self.copies.get_or_init(|| {
            let mut groups = Vec::new();
            // A triangle is found at the edge of its two lowest corners.
            for sides in self.edges().filter(|sides| sides.len() > 1) {
                let third = |side: &TriangleSide| self.triangles[side.triangle as usize][(usize::from(side.side) + 2) % 3];
                let mut here: Vec<&TriangleSide> = sides.iter().filter(|side| third(side) > side.ends[1]).collect();
                here.sort_by_key(|side| third(side));
                for group in here.chunk_by(|a, b| third(a) == third(b)).filter(|group| group.len() > 1) {
                    let turning = |forward| group.iter().filter(|side| side.forward == forward).map(|side| side.triangle).collect();
                    groups.push(Copies { even: turning(true), odd: turning(false) });
                }
            }
            groups
        })
    }
}

/// Sorts sides, given by ascending triangle, by edge: first by the lower end, which puts few in one place.
fn by_edge(sides: &[TriangleSide], vertices: usize) -> Vec<TriangleSide> {
    let mut first = vec![0u32; vertices + 1];
    for side in sides {
        first[side.ends[0] as usize + 1] += 1;
    }
    for v in 0..vertices {
        first[v + 1] += first[v];
    }
    let mut next = first.clone();
    let mut sorted = sides.to_vec();
    for side in sides {
        let at = &mut next[side.ends[0] as usize];
        sorted[*at as usize] = *side;
        *at += 1;
    }
    for place in first.windows(2) {
        sorted[place[0] as usize..place[1] as usize].sort_unstable_by_key(|side| (side.ends[1], side.triangle));
    }
    sorted
}

/// Whether two corners coincide: the triangle is a segment or a point.
pub(crate) fn collapsed(triangle: &[u32; 3]) -> bool {
    let [a, b, c] = *triangle;
    a == b || b == c || c == a
}

/// For every vertex the lowest index at the same position.
fn weld(vertices: &[DVec3]) -> Vec<u32> {
    let mut positions = Positions::default();
    let number = |(v, &p): (usize, &DVec3)| positions.number(p, v as u32, |u| vertices[u as usize]);
    vertices.iter().enumerate().map(number).collect()
}

/// Disjoint sets with path halving; the lowest member names the set.
#[derive(Clone, Debug)]
pub(crate) struct Sets(Vec<u32>);

impl Sets {
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    /// Starts anew.
    pub fn reset(&mut self, count: usize) {
        self.0.clear();
        self.0.extend(0..count as u32);
    }

    pub fn find(&mut self, mut x: u32) -> u32 {
        while self.0[x as usize] != x {
            let up = self.0[self.0[x as usize] as usize];
            self.0[x as usize] = up;
            x = up;
        }
        x
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
