//! Regular points in rows along the axes; a block of a lattice keeps the global indices of the whole.

use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3};
use crate::grid::Grid;

/// Points `first .. first + shape` of the lattice whose point `(i, j, k)` lies at `origin + (i, j, k) * spacing`.
///
/// Where cells of a [`Grid`] are cubes, points may be as far apart along each axis as a scanner puts them. Positions
/// are computed from global indices, so a block gives the same floats as the whole. Points are numbered from the
/// block's first, x slowest and z fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lattice {
    /// Point (0, 0, 0), in model units.
    pub origin: DVec3,
    /// Distance of neighbouring points along x, y and z, in model units.
    pub spacing: DVec3,
    /// Global index of the block's first point.
    pub first: [i64; 3],
    /// Number of points along x, y and z.
    pub shape: [u32; 3],
}

impl Lattice {
    /// The lattice, if it can be used: a finite origin, positive finite spacings, at least one point along each axis.
    pub fn checked(self) -> Result<Self> {
        let Self { origin, spacing, shape, .. } = self;
        if !origin.is_finite() {
            return Err(Error::invalid(format!("the origin of the lattice is {origin}; give finite coordinates")));
        }
        if !(spacing.min_element() > 0.0 && spacing.is_finite()) {
            return Err(Error::invalid(format!("the spacing of the lattice is {spacing}; give positive lengths in model units")));
        }
        if shape.contains(&0) || shape.iter().try_fold(1u64, |count, &n| count.checked_mul(u64::from(n))).is_none() {
            let [x, y, z] = shape;
            return Err(Error::invalid(format!("a lattice cannot have {x} x {y} x {z} points; give at least one along each axis")));
        }
        let size = self.extent().size();
        if !size.is_finite() {
            return Err(Error::invalid(format!("the lattice would be {size} in size; choose a smaller spacing or fewer points")));
        }
        Ok(self)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.shape.iter().map(|&n| n as usize).product()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of global point `(i, j, k)`.
    pub fn point(&self, [i, j, k]: [i64; 3]) -> DVec3 {
        self.origin + DVec3::new(i as f64, j as f64, k as f64) * self.spacing
    }

    /// Position of the point with a number.
    pub fn node(&self, number: usize) -> DVec3 {
        let [_, ny, nz] = self.shape.map(|n| n as usize);
        let index = [number / (ny * nz), number / nz % ny, number % nz];
        self.point(std::array::from_fn(|axis| self.first[axis] + index[axis] as i64))
    }

    /// The box of all points.
    pub fn extent(&self) -> Aabb {
        Aabb::new(self.point(self.first), self.point(std::array::from_fn(|axis| self.first[axis] + i64::from(self.shape[axis]) - 1)))
    }

    /// How many numbers lie between neighbours along x, y and z; 0 along an axis with one point.
    pub fn strides(&self) -> [usize; 3] {
        let [nx, ny, nz] = self.shape.map(|n| n as usize);
        [if nx > 1 { ny * nz } else { 0 }, if ny > 1 { nz } else { 0 }, usize::from(nz > 1)]
    }
}

impl From<Grid> for Lattice {
    /// The corners `grid.corner(i, j, k)`, one for each cell.
    fn from(grid: Grid) -> Self {
        Self { origin: grid.origin, spacing: DVec3::splat(grid.spacing), first: grid.first, shape: grid.shape }
    }
}
