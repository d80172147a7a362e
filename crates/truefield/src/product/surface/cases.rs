//! How the surface runs through a cell, for each of the 256 ways in which its corners can be inside.
//!
//! The cases are derived here and not copied from a table: on each face, the surface separates every run of inside corners
//! from the rest, so that two inside corners across a face are never joined. The rule knows the four corners of the face
//! alone, hence both cells of a face draw the same lines on it, and no hole can open between them.

use std::sync::LazyLock;

/// Most triangles of a cell.
const MOST: usize = 10;

/// The triangles of one case, as edges of the cell.
///
/// Corner c has bit 0 set at high x, bit 1 at high y, bit 2 at high z. Edge `4 a + b` runs along axis a; b counts the
/// other two axes, the lower one in bit 0, each bit set at its high end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Case {
    count: u8,
    triangles: [[u8; 3]; MOST],
}

impl Case {
    /// Counter-clockwise seen from outside, each corner on an edge of the cell.
    #[inline(always)]
    pub(super) fn triangles(&self) -> &[[u8; 3]] {
        &self.triangles[..self.count as usize]
    }
}

/// The case of each set of inside corners.
pub(super) static CASES: LazyLock<[Case; 256]> = LazyLock::new(|| std::array::from_fn(|inside| case(inside as u32)));

/// Corners of the six faces, counter-clockwise seen from outside the cell.
const FACES: [[u32; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The edge between two corners.
fn edge(a: u32, b: u32) -> usize {
    let axis = (a ^ b).trailing_zeros();
    let others = a & b;
    let (low, high) = [(1, 2), (0, 2), (0, 1)][axis as usize];
    (4 * axis + (others >> low & 1) + 2 * (others >> high & 1)) as usize
}

/// Whether two edges bound the same face of the cell.
fn share_a_face(a: u8, b: u8) -> bool {
    FACES.iter().any(|face| {
        let edges: [usize; 4] = std::array::from_fn(|i| edge(face[i], face[(i + 1) % 4]));
        edges.contains(&(a as usize)) && edges.contains(&(b as usize))
    })
}

fn case(inside: u32) -> Case {
    let is_inside = |corner: u32| inside >> corner & 1 == 1;
    // On each face, a line for each run of inside corners, from the edge where the run begins to the one where it ends.
    let mut next = [usize::MAX; 12];
    for face in FACES {
        for i in 0..4 {
            if is_inside(face[i]) && !is_inside(face[(i + 3) % 4]) {
                let mut last = i;
                while is_inside(face[(last + 1) % 4]) {
                    last += 1;
                }
                next[edge(face[(i + 3) % 4], face[i])] = edge(face[last % 4], face[(last + 1) % 4]);
            }
        }
    }
    let mut case = Case { count: 0, triangles: [[0; 3]; MOST] };
    for start in 0..12 {
        let mut ring = Vec::new();
        let mut at = start;
        while next[at] != usize::MAX {
            ring.push(at as u8);
            at = std::mem::replace(&mut next[at], usize::MAX);
        }
        if ring.len() < 3 {
            continue;
        }
        let (_, triangles) = best(&ring);
        for triangle in triangles {
            case.triangles[case.count as usize] = triangle;
            case.count += 1;
        }
    }
    case
}

/// The triangles that fill a ring with the fewest diagonals in faces of the cell, where the neighbour might have one too.
fn best(ring: &[u8]) -> (usize, Vec<[u8; 3]>) {
    let mut found = (usize::MAX, Vec::new());
    let [first, second, rest @ ..] = ring else { return (0, Vec::new()) };
    if rest.is_empty() {
        return (0, Vec::new());
    }
    // The triangle on the ring's first side has its tip at one of the others; what is left are two smaller rings.
    for (tip, &corner) in rest.iter().enumerate() {
        let (left, right): (Vec<u8>, Vec<u8>) =
            (ring[1..=tip + 2].to_vec(), std::iter::once(*first).chain(ring[tip + 2..].iter().copied()).collect());
        let diagonals = [(left.len() > 2, *second), (right.len() > 2, *first)];
        let flaws = diagonals.iter().filter(|(diagonal, from)| *diagonal && share_a_face(*from, corner)).count();
        let (left, right) = (best(&left), best(&right));
        let total = flaws + left.0 + right.0;
        if total < found.0 {
            found = (total, [vec![[*first, *second, corner]], left.1, right.1].concat());
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn no_case_has_a_diagonal_in_a_face() {
        for (inside, case) in CASES.iter().enumerate() {
            let mut sides: BTreeMap<(u8, u8), i32> = BTreeMap::new();
            for t in case.triangles() {
                for i in 0..3 {
                    *sides.entry((t[i], t[(i + 1) % 3])).or_default() += 1;
                }
            }
            for (&(a, b), &count) in &sides {
                assert_eq!(count, 1, "case {inside}: side {a}, {b}");
                let inner = sides.contains_key(&(b, a));
                assert!(inner != share_a_face(a, b), "case {inside}: side {a}, {b}");
            }
        }
    }

    #[test]
    fn every_crossed_edge_has_a_corner_and_no_other() {
        for (inside, case) in CASES.iter().enumerate() {
            for a in 0..8u32 {
                for b in [a | 1, a | 2, a | 4].into_iter().filter(|&b| b != a) {
                    let crossed = (inside >> a ^ inside >> b) & 1 == 1;
                    let used = case.triangles().iter().flatten().any(|&e| e as usize == edge(a, b));
                    assert_eq!(crossed, used, "case {inside}: corners {a}, {b}");
                }
            }
        }
    }

    #[test]
    fn complements_without_doubtful_faces_are_turned() {
        // One corner inside, and all but one: the same triangle, the other way round.
        let turned = |t: [u8; 3]| [t[0], t[2], t[1]];
        for corner in 0..8 {
            let (one, rest) = (CASES[1 << corner], CASES[255 ^ (1 << corner)]);
            assert_eq!((one.triangles().len(), rest.triangles().len()), (1, 1));
            let mut cycle = turned(rest.triangles()[0]);
            while cycle[0] != one.triangles()[0][0] {
                cycle.rotate_left(1);
            }
            assert_eq!(cycle, one.triangles()[0], "corner {corner}");
        }
    }
}
