//! Which crossings of a cell belong to one piece of surface: each piece gets a vertex of its own.
//!
//! On every face between two leaves crossings are paired, by the corners of the face alone, so that both leaves see the
//! same pairs. Each crossing of a leaf lies on two of its faces, so pairs join them to closed loops around the leaf: the
//! rims of the pieces of surface in it (as in Schaefer, Ju and Warren, Manifold Dual Contouring, 2007, without a table,
//! since here an edge of a leaf may be crossed many times).

use std::sync::atomic::{AtomicU32, Ordering};

use super::crossing::Crossing;
use super::skeleton::Leaf;
use crate::error::Result;
use crate::mesh::topology::Sets;
use crate::run::Run;

/// Leaves that a worker takes at a time.
const CHUNK: usize = 8192;

/// The places of all crossings by leaf: place k of crossing e is number 4 e + k.
#[derive(Debug)]
pub(super) struct Places {
    first: Vec<u32>,
    places: Vec<u32>,
}

impl Places {
    /// Sorts places by leaf.
    pub fn of(crossings: &[Crossing], leaves: usize) -> Self {
        let mut first = vec![0u32; leaves + 1];
        for crossing in crossings {
            for k in crossing.places() {
                first[crossing.leaves[k] as usize + 1] += 1;
            }
        }
        for leaf in 0..leaves {
            first[leaf + 1] += first[leaf];
        }
        let mut next = first.clone();
        let mut places = vec![0; first[leaves] as usize];
        for (e, crossing) in crossings.iter().enumerate() {
            for k in crossing.places() {
                let next = &mut next[crossing.leaves[k] as usize];
                places[*next as usize] = (4 * e + k) as u32;
                *next += 1;
            }
        }
        Self { first, places }
    }

    /// Those of a leaf, ascending.
    pub fn around(&self, leaf: usize) -> &[u32] {
        &self.places[self.first[leaf] as usize..self.first[leaf + 1] as usize]
    }

    /// Chunks of leaves.
    pub fn chunks(&self) -> usize {
        (self.first.len() - 1).div_ceil(CHUNK)
    }

    /// The leaves of a chunk.
    pub fn chunk(&self, number: usize) -> std::ops::Range<usize> {
        number * CHUNK..((number + 1) * CHUNK).min(self.first.len() - 1)
    }
}

/// What crossings are paired with on the faces beside them: face k of crossing e is number 4 e + k.
#[derive(Debug)]
pub(super) struct Pairs {
    partner: Vec<AtomicU32>,
    /// Of each face with more than one pair, one place of each pair.
    crowded: Vec<Vec<u32>>,
}

impl Pairs {
    /// Pairs crossings, each face by the smaller of its leaves.
    pub fn of(crossings: &[Crossing], leaves: &[Leaf<'_>], places: &Places, distance: f64, run: &Run<'_>) -> Result<Self> {
        let partner: Vec<AtomicU32> = std::iter::repeat_with(|| AtomicU32::new(u32::MAX)).take(4 * crossings.len()).collect();
        let pair = |a: u32, b: u32| {
            partner[a as usize].store(b, Ordering::Relaxed);
            partner[b as usize].store(a, Ordering::Relaxed);
        };
        let crowded = run.blocks("pair crossings", places.chunks(), |chunk| {
            let mut crowded = Vec::new();
            let mut faces: Vec<(u8, u32)> = Vec::new();
            for number in places.chunk(chunk) {
                faces.clear();
                for &place in places.around(number) {
                    let (e, k) = (place as usize / 4, place as usize % 4);
                    let crossing = &crossings[e];
                    for (face, ahead) in [((k + 3) % 4, false), (crossing.last(k), true)] {
                        let other = crossing.leaves[if ahead { (face + 1) % 4 } else { face }] as usize;
                        let (mine, theirs) = (leaves[number].cell.depth(), leaves[other].cell.depth());
                        if mine > theirs || mine == theirs && number < other {
                            let (axis, low) = crossing.face(face);
                            faces.push(((2 * axis) as u8 + u8::from(low == ahead), (4 * e + face) as u32));
                        }
                    }
                }
                // A face has crossings in no order yet.
                faces.sort_unstable();
                for face in faces.chunk_by(|a, b| a.0 == b.0) {
                    if let [(_, a), (_, b)] = *face {
                        pair(a, b);
                        continue;
                    }
                    let found = ambiguous(&leaves[number], face, crossings, distance);
                    for &(a, b) in &found {
                        pair(a, b);
                    }
                    crowded.push(found.iter().map(|&(a, _)| a).collect::<Vec<_>>());
                }
            }
            Ok(crowded)
        })?;
        Ok(Self { partner, crowded: crowded.concat() })
    }

    /// Of each face with more than one pair, the faces of both crossings of each.
    pub fn into_crowded(self) -> Vec<Vec<(u32, u32)>> {
        let pair = |number: u32| (number, self.partner(number as usize));
        self.crowded.iter().map(|face| face.iter().map(|&number| pair(number)).collect()).collect()
    }

    /// The face of the crossing that another is paired with.
    pub fn partner(&self, face: usize) -> u32 {
        self.partner[face].load(Ordering::Relaxed)
    }
}

/// Pairs more than two crossings around one face of a leaf, all of whose edges they lie on.
///
/// Those on one edge, which smaller leaves divide, are paired along it; what is left over is at most one on each edge.
/// Of four, the inside corners are joined where bilinear interpolation joins them.
fn ambiguous(leaf: &Leaf<'_>, face: &[(u8, u32)], crossings: &[Crossing], distance: f64) -> Vec<(u32, u32)> {
    let (axis, high) = (face[0].0 as usize / 2, face[0].0 as usize % 2);
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let extent = leaf.extent();
    let mut pairs = Vec::new();
    // Edges along u at low and high v, then along v at low and high u.
    let mut left = [None; 4];
    for edge in 0..4 {
        let (along, across) = if edge < 2 { (u, v) } else { (v, u) };
        let at = if edge % 2 == 1 { extent.max[across] } else { extent.min[across] };
        let place = |number: u32| crossings[number as usize / 4].point;
        let mut on: Vec<u32> = face
            .iter()
            .map(|&(_, number)| number)
            .filter(|&number| crossings[number as usize / 4].axis as usize == along && place(number)[across] == at)
            .collect();
        on.sort_by(|&a, &b| place(a)[along].total_cmp(&place(b)[along]).then(a.cmp(&b)));
        let mut two = on.chunks_exact(2);
        pairs.extend(two.by_ref().map(|two| (two[0], two[1])));
        left[edge] = two.remainder().first().copied();
    }
    match left.into_iter().flatten().collect::<Vec<_>>()[..] {
        [a, b] => pairs.push((a, b)),
        [low_v, high_v, low_u, high_u] => {
            let corner = |i: usize, j: usize| leaf.value(high << axis | i << u | j << v) - distance;
            let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
            // The sign of the saddle.
            let joined_inside = corners[0] * corners[3] - corners[1] * corners[2];
            let low_corner_inside = leaf.inside(high << axis);
            // Arcs cut off corners (0, 0) and (1, 1), or the other two.
            let saddle_inside = (joined_inside < 0.0) != low_corner_inside;
            if saddle_inside != low_corner_inside {
                pairs.extend([(low_v, low_u), (high_v, high_u)]);
            } else {
                pairs.extend([(low_v, high_u), (high_v, low_u)]);
            }
        }
        _ => {}
    }
    pairs
}

/// Follows pairs around each leaf to loops, and numbers these by chunk of leaves: each place is told its loop's number in
/// `own`. How many loops each chunk has.
pub(super) fn number_loops(crossings: &[Crossing], places: &Places, pairs: &Pairs, own: &[AtomicU32], run: &Run<'_>) -> Result<Vec<usize>> {
    run.blocks("join crossings", places.chunks(), |chunk| {
        let mut count = 0;
        let mut sets = Sets::new(0);
        let mut numbers: Vec<u32> = Vec::new();
        for number in places.chunk(chunk) {
            let around = places.around(number);
            sets.reset(around.len());
            for (i, &place) in around.iter().enumerate() {
                let (e, k) = (place as usize / 4, place as usize % 4);
                for face in [(k + 3) % 4, crossings[e].last(k)] {
                    let other = pairs.partner(4 * e + face) / 4;
                    // Of this crossing the leaf has one place.
                    let j = around.partition_point(|place| place / 4 < other);
                    if j < around.len() {
                        sets.join(i as u32, j as u32);
                    }
                }
            }
            numbers.clear();
            for (i, &place) in around.iter().enumerate() {
                let root = sets.find(i as u32) as usize;
                let number = if root == i { count } else { numbers[root] };
                count += u32::from(root == i);
                numbers.push(number);
                own[place as usize].store(number, Ordering::Relaxed);
            }
        }
        Ok(count as usize)
    })
}
