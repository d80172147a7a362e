//! The 27 corners of the parts of a cell.

use super::corner::Corner;
use crate::bvh::octants::{NODES, node};
use crate::geom::DVec3;

/// Those that the parts of a cell do not share with the cell itself, those first that differ most from what is interpolated.
pub(super) const INNER: [usize; 19] = [CENTER, 4, 10, 12, 14, 16, 22, 1, 3, 5, 7, 9, 11, 15, 17, 19, 21, 23, 25];

/// The number of the centre.
pub(super) const CENTER: usize = 13;

/// Half edges from the lowest corner of the cell.
pub(super) fn steps(number: usize) -> [i64; 3] {
    [number % 3, number / 3 % 3, number / 9].map(|step| step as i64)
}

/// Corners of parts, x fastest, as far as they have been asked for.
pub(super) struct Halves {
    corners: [Corner; NODES],
    /// A bit for each that is known; the others repeat one that is.
    known: u32,
}

impl Halves {
    pub fn new(corners: &[Corner; 8]) -> Self {
        let mut halves = Self { corners: [corners[0]; NODES], known: 0 };
        for (corner, found) in corners.iter().enumerate() {
            halves.set(node(corner, corner), *found);
        }
        halves
    }

    pub fn set(&mut self, number: usize, corner: Corner) {
        self.corners[number] = corner;
        self.known |= 1 << number;
    }

    pub fn knows(&self, number: usize) -> bool {
        self.known >> number & 1 == 1
    }

    pub fn corner(&self, number: usize) -> &Corner {
        &self.corners[number]
    }

    /// All that are known, some of them more than once.
    pub fn all(&self) -> &[Corner] {
        &self.corners
    }

    /// The corners of a part.
    pub fn corners(&self, octant: usize) -> [Corner; 8] {
        std::array::from_fn(|corner| self.corners[node(octant, corner)])
    }

    /// The nearest points of the surface.
    pub fn feet(&self) -> [DVec3; NODES] {
        self.corners.map(|corner| corner.foot)
    }
}

/// The interpolation of eight numbers at the corners of the parts.
pub(super) fn blend(told: &[f64; 8]) -> [f64; NODES] {
    let mut blended = [0.0; NODES];
    for (corner, &told) in told.iter().enumerate() {
        blended[node(corner, corner)] = told;
    }
    for (step, rows) in [(1, [0, 6, 18, 24].as_slice()), (3, &[0, 1, 2, 18, 19, 20]), (9, &[0, 1, 2, 3, 4, 5, 6, 7, 8])] {
        for &low in rows {
            blended[low + step] = 0.5 * (blended[low] + blended[low + 2 * step]);
        }
    }
    blended
}

/// What of 27 numbers belongs to the corners of a part.
pub(super) fn of_part(all: &[f64; NODES], octant: usize) -> [f64; 8] {
    std::array::from_fn(|corner| all[node(octant, corner)])
}
