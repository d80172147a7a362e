//! Regular grids; a block of a grid keeps the global indices of the whole.

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3};

/// Cells `first .. first + shape` of the lattice with corner `origin` and cubic cells of edge `spacing`.
///
/// Cell `(i, j, k)` spans `origin + (i, j, k) * spacing` to `origin + (i+1, j+1, k+1) * spacing`.
/// Positions are computed from global indices, so a block gives the same floats as the whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Corner of cell (0, 0, 0), in model units.
    pub origin: DVec3,
    /// Edge of a cell, in model units.
    pub spacing: f64,
    /// Global index of the block's first cell.
    pub first: [i64; 3],
    /// Number of cells along x, y and z.
    pub shape: [u32; 3],
}

impl Grid {
    /// Cubic cells over `extent`, `resolution` of them along its longest side, centred on it.
    pub fn over(extent: &Aabb, resolution: u32) -> Result<Self> {
        let size = extent.size();
        let spacing = size.max_element() / f64::from(resolution.max(1));
        if resolution == 0 || !(spacing > 0.0 && spacing.is_finite()) {
            return Err(Error::invalid(format!("resolution must be at least 1 over a box of positive size, not {resolution} over {size}")));
        }
        Ok(Self::with_spacing(extent, spacing))
    }

    /// Cubic cells of edge `spacing` that cover `extent`, centred on it.
    pub fn with_spacing(extent: &Aabb, spacing: f64) -> Self {
        let count = (extent.size() / spacing - 1e-9).ceil().max(DVec3::ONE);
        let origin = extent.center() - count * (0.5 * spacing);
        Self { origin, spacing, first: [0; 3], shape: [count.x as u32, count.y as u32, count.z as u32] }
    }

    /// Number of cells.
    pub fn len(&self) -> usize {
        self.shape.iter().map(|&n| n as usize).product()
    }

    /// Whether there is no cell.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of the lattice point with real-valued global index `index`.
    pub fn point(&self, index: DVec3) -> DVec3 {
        self.origin + index * self.spacing
    }

    /// Corner of global cell `(i, j, k)`.
    pub fn corner(&self, i: i64, j: i64, k: i64) -> DVec3 {
        self.point(DVec3::new(i as f64, j as f64, k as f64))
    }

    /// The box of a cell given by its index inside the block.
    pub fn cell(&self, index: [u32; 3]) -> Aabb {
        let [i, j, k] = std::array::from_fn(|axis| self.first[axis] + i64::from(index[axis]));
        Aabb::new(self.corner(i, j, k), self.corner(i + 1, j + 1, k + 1))
    }

    /// The box of the whole block.
    pub fn extent(&self) -> Aabb {
        let last: [i64; 3] = std::array::from_fn(|axis| self.first[axis] + i64::from(self.shape[axis]));
        Aabb::new(self.corner(self.first[0], self.first[1], self.first[2]), self.corner(last[0], last[1], last[2]))
    }
}
