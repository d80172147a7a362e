//! Vertices and triangles of one layer of cells.

use super::bits::{Bits, Start, next};
use super::cases::CASES;
use crate::field::SampledField;

/// What one layer adds: the vertices on edges that begin in it, and the triangles of its cells.
pub(super) struct Crossed {
    pub(super) vertices: usize,
    pub(super) triangles: usize,
    /// The case of each cell that the surface crosses, row by row.
    pub(super) cases: Vec<u8>,
}

impl Crossed {
    /// Layer `i` of the samples, and the cells between it and the next.
    pub(super) fn of(bits: &Bits, i: usize) -> Self {
        let vertices = (0..bits.shape[1]).flat_map(|j| bits.crossings(i, j)).sum::<u32>() as usize;
        let (mut cases, mut triangles) = (Vec::new(), 0);
        let table = &*CASES;
        for_words(bits, i, |word| {
            each_bit(word.mixed, |bit| {
                let case = word.case(bit);
                triangles += table[case as usize].triangles().len();
                cases.push(case);
            });
        });
        Self { vertices, triangles, cases }
    }
}

/// Fills `out` with the vertices of layer `i`: row by row, the crossings along x, then y, then z.
pub(super) fn add_vertices(field: &SampledField, bits: &Bits, distance: f64, i: usize, out: &mut [[f64; 3]]) {
    let lattice = *field.lattice();
    let [_, ny, nz] = lattice.shape.map(|n| n as usize);
    let values = field.values();
    let beyond = bits.beyond as i64;
    let position =
        |axis: usize, local: i64, part: f64| lattice.origin[axis] + ((lattice.first[axis] + local) as f64 + part) * lattice.spacing[axis];
    let last: [i64; 3] = lattice.shape.map(|n| i64::from(n) - 1);
    // The part of the way along an edge, whose samples are `stride` apart.
    let part = |number: usize, stride: usize| {
        let (from, to) = (f64::from(values[number]), f64::from(values[number + stride]));
        match (from.is_finite(), to.is_finite()) {
            (true, true) => ((distance - from) / (to - from)).clamp(0.0, 1.0),
            // The whole way to infinity lies at the finite end.
            (true, false) => 0.0,
            (false, true) => 1.0,
            (false, false) => 0.5,
        }
    };
    let x = i as i64 - beyond;
    let mut out = out.iter_mut();
    let mut put = |p: [f64; 3]| {
        if let Some(slot) = out.next() {
            *slot = p;
        }
    };
    for j in 0..bits.shape[1] {
        let y = j as i64 - beyond;
        let row = bits.row(i, j);
        // Number of the row's sample at z = 0; not used where the row lies beyond the border.
        let base = (x * ny as i64 + y) * nz as i64;
        if i + 1 < bits.shape[0] {
            let half = x < 0 || x == last[0];
            let at_y = position(1, y, 0.0);
            for (w, (a, b)) in row.iter().zip(bits.row(i + 1, j)).enumerate() {
                each_bit(a ^ b, |bit| {
                    let z = (64 * w + bit) as i64 - beyond;
                    let t = if half { 0.5 } else { part((base + z) as usize, ny * nz) };
                    put([position(0, x, t), at_y, position(2, z, 0.0)]);
                });
            }
        }
        if j + 1 < bits.shape[1] {
            let half = y < 0 || y == last[1];
            let at_x = position(0, x, 0.0);
            for (w, (a, b)) in row.iter().zip(bits.row(i, j + 1)).enumerate() {
                each_bit(a ^ b, |bit| {
                    let z = (64 * w + bit) as i64 - beyond;
                    let t = if half { 0.5 } else { part((base + z) as usize, nz) };
                    put([at_x, position(1, y, t), position(2, z, 0.0)]);
                });
            }
        }
        let (at_x, at_y) = (position(0, x, 0.0), position(1, y, 0.0));
        for w in 0..bits.width {
            each_bit(bits.along(row, w), |bit| {
                let z = (64 * w + bit) as i64 - beyond;
                let t = if z < 0 || z == last[2] { 0.5 } else { part((base + z) as usize, 1) };
                put([at_x, at_y, position(2, z, t)]);
            });
        }
    }
}

/// Fills `out` with the triangles of layer `i`, whose crossed cells have `cases`.
pub(super) fn add_triangles<I: Copy + From<u32>>(bits: &Bits, starts: &[Start], cases: &[u8], i: usize, out: &mut [[I; 3]]) {
    let table = &*CASES;
    let (mut cases, mut out) = (cases.iter(), out.iter_mut());
    let mut number = [0u32; 8];
    for_words(bits, i, |word| {
        if word.new_row {
            let ny = bits.shape[1];
            let at = [(i, word.j), (i + 1, word.j), (i, word.j + 1), (i + 1, word.j + 1)].map(|(i, j)| starts[i * ny + j]);
            number = [at[0][0], at[2][0], at[0][1], at[1][1], at[0][2], at[1][2], at[2][2], at[3][2]];
        }
        each_bit(word.mixed, |bit| {
            let mut ids = [0u32; 12];
            for row in 0..8 {
                // A crossing at this sample makes the cell a crossed one: none was passed over since the last.
                let after = number[row] + (word.crossed[row] >> bit & 1) as u32;
                if row < 4 {
                    // Along x and y the cell has an edge at this sample and one at the next.
                    let edge = 4 * (row / 2) + row % 2;
                    (ids[edge], ids[edge + 2]) = (number[row], after);
                } else {
                    ids[row + 4] = number[row];
                }
                number[row] = after;
            }
            let case = cases.next().map_or(0, |&case| case);
            for triangle in table[case as usize].triangles() {
                if let Some(slot) = out.next() {
                    *slot = triangle.map(|edge| I::from(ids[edge as usize]));
                }
            }
        });
    });
}

/// Up to 64 cells of a row.
struct Word {
    /// The row of cells lies between rows j and j + 1 of the samples.
    j: usize,
    /// Whether these are the first of the row that are looked at.
    new_row: bool,
    /// The samples of the rows (i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1).
    low: [u64; 4],
    /// The same, one sample on.
    high: [u64; 4],
    /// Where edges are crossed along x on rows j and j + 1, along y on layers i and i + 1, along z on all four rows.
    crossed: [u64; 8],
    /// The cells that the surface crosses.
    mixed: u64,
}

impl Word {
    /// Which corners of a cell are inside.
    #[inline(always)]
    fn case(&self, bit: usize) -> u8 {
        let mut case = 0;
        for corner in 0..4 {
            case |= (self.low[corner] >> bit & 1) << corner | (self.high[corner] >> bit & 1) << (corner + 4);
        }
        case as u8
    }
}

/// Visits the cells of layer `i`, a word at a time, those without a crossing left out.
#[inline(always)]
fn for_words(bits: &Bits, i: usize, mut visit: impl FnMut(&Word)) {
    if i + 1 >= bits.shape[0] {
        return;
    }
    for j in 0..bits.shape[1].saturating_sub(1) {
        let rows = [bits.row(i, j), bits.row(i + 1, j), bits.row(i, j + 1), bits.row(i + 1, j + 1)];
        let mut new_row = true;
        for w in 0..bits.width {
            let low = rows.map(|row| row[w]);
            let high = rows.map(|row| next(row, w));
            let any = low.iter().chain(&high).fold(0, |a, b| a | b);
            let all = low.iter().chain(&high).fold(u64::MAX, |a, b| a & b);
            let mixed = any & !all & bits.edges(w);
            // Where no cell is crossed, no edge of the rows is: but for those at the last sample, after which none follows.
            if mixed == 0 {
                continue;
            }
            let along: [u64; 4] = std::array::from_fn(|row| bits.along(rows[row], w));
            let crossed = [low[0] ^ low[1], low[2] ^ low[3], low[0] ^ low[2], low[1] ^ low[3], along[0], along[1], along[2], along[3]];
            visit(&Word { j, new_row, low, high, crossed, mixed });
            new_row = false;
        }
    }
}

/// Calls `visit` with the place of every set bit, lowest first.
#[inline(always)]
fn each_bit(mut word: u64, mut visit: impl FnMut(usize)) {
    while word != 0 {
        visit(word.trailing_zeros() as usize);
        word &= word - 1;
    }
}
