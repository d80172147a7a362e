//! The 27 corners of the parts of a cell.

use super::facets::Corner;

/// Those that the parts of a cell do not share with the cell itself, those first that differ most from what is interpolated.
pub(super) const INNER: [usize; 19] = [CENTER, 4, 10, 12, 14, 16, 22, 1, 3, 5, 7, 9, 11, 15, 17, 19, 21, 23, 25];

/// The number of the centre.
pub(super) const CENTER: usize = 13;

/// The number of a corner of a part.
pub(super) fn number(octant: usize, corner: usize) -> usize {
    let along = |axis: usize| (octant >> axis & 1) + (corner >> axis & 1);
    along(0) + 3 * along(1) + 9 * along(2)
}

/// Half edges from the lowest corner of the cell.
pub(super) fn steps(number: usize) -> [i64; 3] {
    [number % 3, number / 3 % 3, number / 9].map(|step| step as i64)
}

/// Corners of parts, x fastest, as far as they have been asked for.
pub(super) struct Halves(pub [Option<Corner>; 27]);

impl Halves {
    pub fn new(corners: &[Corner; 8]) -> Self {
        let mut halves = Self([None; 27]);
        for (corner, found) in corners.iter().enumerate() {
            halves.0[number(corner, corner)] = Some(*found);
        }
        halves
    }

    /// The corners of a part; `None` unless all have been asked for.
    pub fn corners(&self, octant: usize) -> Option<[Corner; 8]> {
        let mut corners = [self.0[number(octant, 0)]?; 8];
        for (corner, found) in corners.iter_mut().enumerate().skip(1) {
            *found = self.0[number(octant, corner)]?;
        }
        Some(corners)
    }
}

/// The interpolation of eight numbers at the corners of the parts.
pub(super) fn blend(told: &[f64; 8]) -> [f64; 27] {
    let mut blended = [0.0; 27];
    for (corner, &told) in told.iter().enumerate() {
        blended[number(corner, corner)] = told;
    }
    for (step, rows) in [(1, [0, 6, 18, 24].as_slice()), (3, &[0, 1, 2, 18, 19, 20]), (9, &[0, 1, 2, 3, 4, 5, 6, 7, 8])] {
        for &low in rows {
            blended[low + step] = 0.5 * (blended[low] + blended[low + 2 * step]);
        }
    }
    blended
}

/// What of 27 numbers belongs to the corners of a part.
pub(super) fn of_part(all: &[f64; 27], octant: usize) -> [f64; 8] {
    std::array::from_fn(|corner| all[number(octant, corner)])
}
