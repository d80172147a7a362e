//! What is wrong with a mesh.

use std::borrow::Borrow;

use crate::bvh::Tree;
use crate::bvh::intersect::Meetings;
use crate::bvh::winding::{Winding, triangle};
use crate::error::Result;
use crate::geom::DVec3;
use crate::mesh::TriangleMesh;
use crate::mesh::topology::{Sets, Topology, collapsed};
use crate::run::Run;

use super::layers::Layers;
use super::pseudonormal::rounding;
use super::sum::winding;
use super::well_sized;

/// Finds that are named; the others are only counted.
const NAMED: usize = 8;

/// How many of something there are, and the first few.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found<T> {
    /// How many.
    pub count: usize,
    /// The first few, in index order.
    pub first: Vec<T>,
}

impl<T> Default for Found<T> {
    fn default() -> Self {
        Self { count: 0, first: Vec::new() }
    }
}

impl<T> Found<T> {
    fn add(&mut self, item: T) {
        self.count += 1;
        if self.first.len() < NAMED {
            self.first.push(item);
        }
    }
}

/// What is wrong with a mesh, or that nothing is.
///
/// Vertices at the same position count as one, for this report only. Edges are named by their two
/// vertices, the lowest index at each position. Nothing is repaired.
#[derive(Clone, Debug, Default)]
pub struct Check {
    /// Number of vertices in the arrays.
    pub vertices: usize,
    /// Number of different vertex positions that triangles use.
    pub positions: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Edges of one triangle only: borders of holes and cracks.
    pub open_edges: Found<[u32; 2]>,
    /// Edges of more than two triangles.
    pub non_manifold_edges: Found<[u32; 2]>,
    /// Edges of two triangles that run the same way along it: one of them is flipped.
    pub inconsistent_edges: Found<[u32; 2]>,
    /// Vertices where pieces of surface meet that share no edge there.
    pub pinched_vertices: Found<u32>,
    /// Triangles over the same corners, turning the same way: the first and a later one.
    pub duplicate_triangles: Found<[u32; 2]>,
    /// Triangles over the same corners, turning opposite ways.
    pub opposite_triangles: Found<[u32; 2]>,
    /// Triangles with no area, up to rounding; of these, `collapsed_triangles` have two equal corners.
    pub zero_area_triangles: Found<u32>,
    /// Triangles with two corners at the same position.
    pub collapsed_triangles: usize,
    /// Triangles without area whose corners are apart.
    needles: Found<u32>,
    /// Vertices that no triangle uses.
    pub unreferenced_vertices: Found<u32>,
    /// Number of pieces joined by shared edges.
    pub shells: usize,
    /// Shells without open edges whose normals point into the solid, by their lowest triangle.
    pub inside_out_shells: Found<u32>,
    /// Shells without open edges that lie inside a solid and face the same way, by their lowest triangle.
    pub nested_shells: Found<u32>,
    /// Shells without open edges for which neither could be told, by their lowest triangle: others are too near.
    pub uncertain_shells: Found<u32>,
    /// Pairs of triangles that meet beyond the corner or edge they share, or come closer than rounding
    /// can tell. Duplicates and triangles without area are not counted again here.
    pub self_intersections: Found<[u32; 2]>,
    /// False where there are so many self-intersections that not all were counted.
    pub self_intersections_complete: bool,
    /// Whether every edge belongs to two triangles, or to an even number more.
    pub watertight: bool,
    /// Whether neighbours run opposite ways along every edge, so that normals agree.
    pub consistent: bool,
    /// Signed volume in cubic model units, positive where normals point outward. A volume only if watertight.
    pub volume: f64,
    /// Area in square model units, duplicates included.
    pub area: f64,
}

impl Check {
    /// Looks at everything. O(n log n), about a microsecond a triangle; self-intersections cost
    /// more where very many triangles meet.
    pub fn of(mesh: &TriangleMesh, run: &Run<'_>) -> Result<Self> {
        let (scaled, scale) = well_sized(mesh)?;
        let mesh = scaled.as_ref().unwrap_or(mesh);
        let topology = Topology::new(mesh);
        run.cancel.check()?;
        let mut check = Self::of_edges(mesh, &topology);
        let tree = Tree::build(mesh, run)?;
        check.add_meetings(mesh, &meetings(mesh, &topology, &tree, 0.0, run)?);
        check.add_shells(mesh, &topology, || winding(mesh, &Layers::new(mesh, &topology).triangles, run), run)?;
        check.area /= scale * scale;
        check.volume /= scale * scale * scale;
        Ok(check)
    }

    /// All but shells and self-intersections. O(n).
    pub(crate) fn of_edges(mesh: &TriangleMesh, topology: &Topology) -> Self {
        let mut check = Self {
            vertices: mesh.vertices().len(),
            triangles: topology.triangles.len(),
            self_intersections_complete: true,
            watertight: true,
            consistent: true,
            ..Self::default()
        };
        check.count_vertices(mesh, topology);
        for sides in topology.edges() {
            let ends = sides[0].ends;
            check.watertight &= sides.len() % 2 == 0;
            check.consistent &= sides.iter().map(|s| if s.forward { 1 } else { -1 }).sum::<i32>() == 0;
            match sides {
                [_] => check.open_edges.add(ends),
                [one, other] => {
                    if one.forward == other.forward {
                        check.inconsistent_edges.add(ends);
                    }
                }
                _ => check.non_manifold_edges.add(ends),
            }
        }
        for copies in topology.copies() {
            for same in [&copies.even, &copies.odd] {
                for &later in same.iter().skip(1) {
                    check.duplicate_triangles.add([same[0], later]);
                }
            }
            if let ([one, ..], [other, ..]) = (copies.even.as_slice(), copies.odd.as_slice()) {
                check.opposite_triangles.add([*one.min(other), *one.max(other)]);
            }
        }
        let center = mesh.extent().center();
        for t in 0..topology.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(t).map(|v| v - center);
            let cross = (b - a).cross(c - a);
            check.area += 0.5 * cross.length();
            check.volume += a.dot(b.cross(c)) / 6.0;
            if flat(&[a, b, c]) {
                check.zero_area_triangles.add(t);
                if collapsed(&topology.triangles[t as usize]) {
                    check.collapsed_triangles += 1;
                } else {
                    check.needles.add(t);
                }
            }
        }
        check
    }

    fn count_vertices(&mut self, mesh: &TriangleMesh, topology: &Topology) {
        let mut used = vec![false; mesh.vertices().len()];
        for &v in mesh.triangles().iter().flatten() {
            used[v as usize] = true;
        }
        for v in (0..used.len()).filter(|&v| !used[v]) {
            self.unreferenced_vertices.add(v as u32);
        }
        let mut position = vec![false; mesh.vertices().len()];
        for &v in topology.triangles.iter().flatten() {
            position[v as usize] = true;
        }
        self.positions = position.iter().filter(|&&there| there).count();
        for (v, _) in topology.pinched().iter().enumerate().filter(|(_, pinched)| **pinched) {
            self.pinched_vertices.add(v as u32);
        }
    }

    /// Counts the shells and asks, at the largest triangle of each closed one, what is on either side; last of all.
    pub(crate) fn add_shells<W: Borrow<Winding>>(
        &mut self,
        mesh: &TriangleMesh,
        topology: &Topology,
        winding: impl FnOnce() -> Result<W>,
        run: &Run<'_>,
    ) -> Result<()> {
        let count = topology.triangles.len();
        let mut sets = Sets::new(count);
        for sides in topology.edges() {
            for side in &sides[1..] {
                sets.join(sides[0].triangle, side.triangle);
            }
        }
        let shell: Vec<u32> = (0..count as u32).map(|t| sets.find(t)).collect();
        let mut closed = vec![true; count];
        for sides in topology.edges().filter(|sides| sides.len() != 2 || sides[0].forward == sides[1].forward) {
            closed[shell[sides[0].triangle as usize] as usize] = false;
        }
        let mut largest = vec![(0.0f64, u32::MAX); count];
        for t in (0..count as u32).filter(|&t| !collapsed(&topology.triangles[t as usize])) {
            let [a, b, c] = mesh.corners(t);
            let area = (b - a).cross(c - a).length_squared();
            let best = &mut largest[shell[t as usize] as usize];
            if best.1 == u32::MAX || area > best.0 {
                *best = (area, t);
            }
        }
        let shells: Vec<(u32, u32)> =
            (0..count as u32).filter(|&s| largest[s as usize].1 != u32::MAX).map(|s| (s, largest[s as usize].1)).collect();
        self.shells = shells.len();
        // A single surface that nothing is wrong with parts space in two, and its volume tells which part is inside.
        let diagonal = mesh.extent().diagonal();
        let rounding = 4.0 * f64::EPSILON * (count + 64) as f64 * (self.area + diagonal * diagonal) * diagonal;
        if let &[(shell, _)] = &shells[..]
            && self.volume.abs() > rounding
            && self.fault().is_none()
        {
            if self.volume < 0.0 {
                self.inside_out_shells.add(shell);
            }
            return Ok(());
        }
        let winding = winding()?;
        let winding = winding.borrow();
        const CHUNK: usize = 64;
        let middles = run.blocks("shells", shells.len().div_ceil(CHUNK), |block| {
            let part = &shells[block * CHUNK..((block + 1) * CHUNK).min(shells.len())];
            let middle = |t: u32| between(winding, &mesh.corners(t), 0.05).filter(|&(_, error)| error < 0.1);
            Ok(part.iter().map(|&(s, t)| closed[s as usize].then(|| middle(t))).collect::<Vec<_>>())
        })?;
        for ((s, _), middle) in shells.into_iter().zip(middles.into_iter().flatten()) {
            match middle {
                Some(Some((w, _))) if w < 0.25 => self.inside_out_shells.add(s),
                Some(Some((w, _))) if w > 0.75 => self.nested_shells.add(s),
                Some(None) => self.uncertain_shells.add(s),
                _ => {}
            }
        }
        Ok(())
    }

    /// Counts self-intersections.
    pub(crate) fn add_meetings(&mut self, mesh: &TriangleMesh, meetings: &Meetings) {
        for &pair in meetings.pairs.iter().filter(|pair| pair.iter().all(|&t| !flat(&mesh.corners(t)))) {
            self.self_intersections.add(pair);
        }
        self.self_intersections_complete = meetings.complete;
    }

    /// The first thing that keeps angle-weighted pseudonormals from being proven, in words.
    pub(crate) fn fault(&self) -> Option<String> {
        let edge =
            |found: &Found<[u32; 2]>| (found.count, found.first.first().map(|[a, b]| format!("the first joins vertices {a} and {b}")));
        let pair = |found: &Found<[u32; 2]>| (found.count, found.first.first().map(|[a, b]| format!("the first: triangles {a} and {b}")));
        let one = |found: &Found<u32>, what: &str| (found.count, found.first.first().map(|t| format!("the first: {what} {t}")));
        let faults = [
            (edge(&self.open_edges), "open edge", "open edges"),
            (edge(&self.non_manifold_edges), "edge of more than two triangles", "edges of more than two triangles"),
            (
                edge(&self.inconsistent_edges),
                "edge between triangles that face opposite ways",
                "edges between triangles that face opposite ways",
            ),
            (pair(&self.duplicate_triangles), "duplicate triangle", "duplicate triangles"),
            (pair(&self.opposite_triangles), "pair of opposite triangles", "pairs of opposite triangles"),
            (one(&self.needles, "triangle"), "triangle without area", "triangles without area"),
            (one(&self.pinched_vertices, "vertex"), "vertex where separate pieces touch", "vertices where separate pieces touch"),
            (one(&self.inside_out_shells, "of triangle"), "inside-out shell", "inside-out shells"),
            (
                one(&self.nested_shells, "of triangle"),
                "shell inside a solid that faces the same way",
                "shells inside a solid that face the same way",
            ),
            (one(&self.uncertain_shells, "of triangle"), "shell too near others to be placed", "shells too near others to be placed"),
            (pair(&self.self_intersections), "pair of triangles that meet or nearly meet", "pairs of triangles that meet or nearly meet"),
        ];
        let Some(((count, first), singular, plural)) = faults.into_iter().find(|((count, _), ..)| *count > 0) else {
            let all = self.self_intersections_complete;
            return (!all).then(|| "so many triangles come near each other that they were not all compared".into());
        };
        let most = if self.self_intersections_complete { "" } else { "at least " };
        let what = if count == 1 { singular } else { plural };
        Some(format!("{most}{count} {what} ({})", first.unwrap_or_default()))
    }
}

/// Where a mesh, `moved` so far from the one the tree is of, meets itself.
pub(crate) fn meetings(mesh: &TriangleMesh, topology: &Topology, tree: &Tree, moved: f64, run: &Run<'_>) -> Result<Meetings> {
    let mut solid: Vec<bool> = topology.triangles.iter().map(|welded| !collapsed(welded)).collect();
    for copies in topology.copies() {
        for &t in copies.even.iter().chain(&copies.odd).skip(1) {
            solid[t as usize] = false;
        }
    }
    let reach = (mesh.extent().diagonal() * REACH).max(64.0 * rounding(mesh));
    Meetings::find(mesh, topology, tree, &solid, [reach, moved], run)
}

/// Triangles farther apart than this share of the diagonal need not be compared.
const REACH: f64 = 1.0 / 1_048_576.0;

/// Whether a triangle has no area, up to rounding.
pub(crate) fn flat(corners: &[DVec3; 3]) -> bool {
    let [a, b, c] = *corners;
    let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
    (b - a).cross(c - a).length() <= 8.0 * f64::EPSILON * longest
}

/// The mean of the winding numbers on the two sides of a triangle that counts once, at its middle, and how wrong it may
/// be, `accuracy` if it can be had: the triangle's own share there is half up, half down, so it is left out.
pub(crate) fn between(winding: &Winding, corners: &[DVec3; 3], accuracy: f64) -> Option<(f64, f64)> {
    let [a, b, c] = *corners;
    let at = a + ((b - a) + (c - a)) / 3.0;
    let own = triangle(corners, at);
    let all = winding.number(at, own.error + accuracy);
    // A triangle that is too near to count is so in the sum as well: its doubt is there, and its share is not.
    let error = if own.doubt > 0.0 { (all.error - own.error).max(0.0) } else { all.error + own.error };
    (error < 0.25).then_some((all.value - own.value, error))
}
