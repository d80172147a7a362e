//! Samples of a distance on a lattice of points.

use crate::distance::Distance;
use crate::geom::{Aabb, DVec3, Interval};
use crate::grid::Grid;

/// Signed distances at the points `lattice.corner(i, j, k)`, node-centred, in single precision.
///
/// Each value is the exact distance rounded to the nearest single, so the truth lies between the
/// neighbouring singles. Where a band limits the field, samples beyond it hold plus or minus the band.
#[derive(Clone, Debug)]
pub struct SampledField {
    pub(crate) lattice: Grid,
    pub(crate) values: Vec<f32>,
    pub(crate) band: f64,
    /// Indices of samples whose side could not be decided, ascending.
    pub(crate) doubtful: Vec<u64>,
    /// Whether the signed distance is continuous: the side changes at the surface only.
    pub(crate) continuity: Continuity,
}

/// Where the sign of a distance can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// At the surface only: the signed distance is 1-Lipschitz.
    Everywhere,
    /// Also across the openings of an open mesh: only its absolute value is 1-Lipschitz.
    ExceptOpenings,
}

impl SampledField {
    /// The sample points: point (i, j, k) lies at `lattice.corner(i, j, k)`.
    pub fn lattice(&self) -> &Grid {
        &self.lattice
    }

    /// The distances, x slowest and z fastest.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Distances beyond this are not stored; infinite when all are.
    pub fn band(&self) -> f64 {
        self.band
    }

    /// The interval that contains the true distance at sample `index`.
    pub fn interval(&self, index: usize) -> Interval {
        let value = self.values[index];
        // Samples beyond the band hold the band itself, as rounded to a single.
        if value.abs() >= self.band as f32 {
            let beyond = Interval { lower: f64::from((self.band as f32).next_down()), upper: f64::INFINITY };
            return if value > 0.0 { beyond } else { Interval { lower: -beyond.upper, upper: -beyond.lower } };
        }
        if self.doubtful.binary_search(&(index as u64)).is_ok() {
            return Interval::either_side(f64::from(value.abs().next_up()));
        }
        Interval { lower: f64::from(value.next_down()), upper: f64::from(value.next_up()) }
    }

    /// All lower bounds, rounded down.
    pub fn lower(&self) -> Vec<f32> {
        (0..self.values.len()).map(|i| self.interval(i).lower as f32).collect()
    }

    /// All upper bounds, rounded up.
    pub fn upper(&self) -> Vec<f32> {
        (0..self.values.len()).map(|i| self.interval(i).upper as f32).collect()
    }

    /// The lattice cell that holds `p`, and where in it, each coordinate from 0 to 1.
    fn locate(&self, p: DVec3) -> Option<([usize; 3], DVec3)> {
        let index = (p - self.lattice.corner(self.lattice.first[0], self.lattice.first[1], self.lattice.first[2])) / self.lattice.spacing;
        let mut cell = [0; 3];
        for axis in 0..3 {
            let last = f64::from(self.lattice.shape[axis]) - 1.0;
            if !(index[axis] >= 0.0 && index[axis] <= last) {
                return None;
            }
            cell[axis] = (index[axis] as usize).min((self.lattice.shape[axis] as usize).saturating_sub(2));
        }
        Some((cell, index - DVec3::new(cell[0] as f64, cell[1] as f64, cell[2] as f64)))
    }

    /// The eight corners of a cell: index, and offset in cells.
    fn corners(&self, cell: [usize; 3]) -> impl Iterator<Item = (usize, DVec3)> {
        let [nx, ny, nz] = self.lattice.shape.map(|n| n as usize);
        (0..8).map(move |corner| {
            let step: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            let [i, j, k]: [usize; 3] = std::array::from_fn(|axis| (cell[axis] + step[axis]).min([nx, ny, nz][axis] - 1));
            ((i * ny + j) * nz + k, DVec3::new(step[0] as f64, step[1] as f64, step[2] as f64))
        })
    }

    /// Trilinear interpolation of the samples; `None` outside the lattice. No bound: see [`Distance::at`].
    pub fn interpolate(&self, p: DVec3) -> Option<f64> {
        let (cell, local) = self.locate(p)?;
        Some(
            self.corners(cell)
                .map(|(index, step)| {
                    let weight = |axis: usize| if step[axis] > 0.0 { local[axis] } else { 1.0 - local[axis] };
                    weight(0) * weight(1) * weight(2) * f64::from(self.values[index])
                })
                .sum(),
        )
    }
}

impl Distance for SampledField {
    fn extent(&self) -> Option<Aabb> {
        let [a, b, c] = self.lattice.first;
        let last = |axis: usize| self.lattice.first[axis] + i64::from(self.lattice.shape[axis]) - 1;
        Some(Aabb::new(self.lattice.corner(a, b, c), self.lattice.corner(last(0), last(1), last(2))))
    }

    /// From the corners of the cell by the Lipschitz bound; outside the lattice nothing is known.
    fn at(&self, p: DVec3) -> Interval {
        let unknown = Interval { lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let Some((cell, local)) = self.locate(p) else { return unknown };
        let mut known = unknown;
        let mut farthest = f64::INFINITY;
        for (index, step) in self.corners(cell) {
            // A few ulp for the position of the sample itself.
            let away = (step - local).length() * self.lattice.spacing * (1.0 + 1e-12)
                + 8.0 * f64::EPSILON * (p.abs().max_element() + self.lattice.origin.abs().max_element());
            let interval = self.interval(index).widen(away);
            known = Interval { lower: known.lower.max(interval.lower), upper: known.upper.min(interval.upper) };
            farthest = farthest.min(interval.upper.max(-interval.lower));
        }
        match self.continuity {
            Continuity::Everywhere => known,
            Continuity::ExceptOpenings => Interval::either_side(farthest),
        }
    }
}
