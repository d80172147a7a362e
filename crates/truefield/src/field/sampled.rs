//! Samples of a distance on a lattice of points.

use super::each::each;
use crate::distance::Distance;
use crate::error::{Error, Result};
use crate::geom::{Aabb, DVec3, Interval};
use crate::lattice::Lattice;
use crate::run::Run;

/// Values that are looked at together.
const CHUNK: usize = 1024;

/// Signed distances at the points of a lattice in single precision, and what is known of the truth behind them.
///
/// Between samples, the values are interpolated trilinearly. What is promised there follows from one fact alone: over a
/// way of length l a distance changes by l at most, so every sample bounds the truth around it.
#[derive(Clone, Debug)]
pub struct SampledField {
    lattice: Lattice,
    values: Vec<f32>,
    known: Known,
    continuity: Continuity,
}

/// What is known of the true distance at the samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Known {
    /// The value is the true distance rounded to the nearest single.
    Rounded {
        /// Samples whose true distance is beyond this, plus or minus, hold the band itself; infinite where none do.
        band: f64,
        /// Numbers of the samples whose side could not be decided, ascending.
        doubtful: Vec<u64>,
    },
    /// The truth lies within this length of each value; infinite where nothing is known.
    Within(f64),
    /// The truth lies between the bounds of its sample, the value too.
    Between {
        /// Rounded down.
        lower: Vec<f32>,
        /// Rounded up.
        upper: Vec<f32>,
    },
}

/// Where the sign of a distance can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// At the surface only: the signed distance is 1-Lipschitz.
    Everywhere,
    /// Also across the openings of an open mesh: only its absolute value is 1-Lipschitz.
    ExceptOpenings,
}

/// Where a point lies between the samples.
#[derive(Clone, Copy)]
struct Place {
    /// Number of the cell's lowest corner.
    base: usize,
    /// From the cell's lowest corner, each coordinate from 0 to 1.
    local: DVec3,
}

impl SampledField {
    /// Checks and takes samples, x slowest and z fastest.
    ///
    /// Values and bounds may be infinite, but must be numbers; bounds must hold their values.
    pub fn new(lattice: Lattice, values: Vec<f32>, known: Known, continuity: Continuity) -> Result<Self> {
        let lattice = lattice.checked()?;
        let [x, y, z] = lattice.shape;
        if values.len() != lattice.len() {
            return Err(Error::invalid(format!("there are {} values for {x} x {y} x {z} samples; give one each", values.len())));
        }
        // Whole chunks at once: a search that may stop anywhere takes them one by one.
        let spoilt = values.chunks(CHUNK).position(|chunk| chunk.iter().fold(false, |any, v| any | v.is_nan()));
        if let Some(number) = spoilt.and_then(|chunk| (chunk * CHUNK..values.len()).find(|&number| values[number].is_nan())) {
            return Err(Error::invalid(format!(
                "sample {:?} is not a number; replace what is not a number before it is sampled",
                index(&lattice, number)
            )));
        }
        match &known {
            Known::Rounded { band, doubtful } => {
                let good = *band > 0.0 && doubtful.is_sorted() && doubtful.last().is_none_or(|&last| last < values.len() as u64);
                if !good {
                    return Err(Error::invalid("the band must be a positive length, doubtful samples ascending and of the lattice"));
                }
            }
            Known::Within(error) => {
                if !(*error >= 0.0) {
                    return Err(Error::invalid(format!("the error of the samples is {error}; give a length, not negative")));
                }
            }
            Known::Between { lower, upper } => {
                if lower.len() != values.len() || upper.len() != values.len() {
                    return Err(Error::invalid(format!("lower and upper must have {x} x {y} x {z} samples, as the values do")));
                }
                let fits = |number: &usize| !(lower[*number] <= values[*number] && values[*number] <= upper[*number]);
                if let Some(number) = (0..values.len()).find(fits) {
                    return Err(Error::invalid(format!(
                        "the value {} of sample {:?} is not between its bounds {} and {}; give bounds that hold it",
                        values[number],
                        index(&lattice, number),
                        lower[number],
                        upper[number]
                    )));
                }
            }
        }
        Ok(Self { lattice, values, known, continuity })
    }

    /// Where the samples lie.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The distances, x slowest and z fastest.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// What is known of the truth at the samples.
    pub fn known(&self) -> &Known {
        &self.known
    }

    /// Where the sign can change.
    pub fn continuity(&self) -> Continuity {
        self.continuity
    }

    /// Distances beyond this are not stored; infinite when all are.
    pub fn band(&self) -> f64 {
        match self.known {
            Known::Rounded { band, .. } => band,
            Known::Within(_) | Known::Between { .. } => f64::INFINITY,
        }
    }

    /// The interval that contains the true distance at a sample.
    pub fn interval(&self, number: usize) -> Interval {
        let value = self.values[number];
        match &self.known {
            // Samples beyond the band hold the band itself, as rounded to a single.
            Known::Rounded { band, .. } if value.abs() >= *band as f32 => {
                let beyond = Interval { lower: f64::from((*band as f32).next_down()), upper: f64::INFINITY };
                if value > 0.0 { beyond } else { Interval { lower: -beyond.upper, upper: -beyond.lower } }
            }
            Known::Rounded { doubtful, .. } if doubtful.binary_search(&(number as u64)).is_ok() => {
                Interval::either_side(f64::from(value.abs().next_up()))
            }
            Known::Rounded { .. } => Interval { lower: f64::from(value.next_down()), upper: f64::from(value.next_up()) },
            Known::Within(error) if *error == 0.0 => Interval::exact(f64::from(value)),
            // Of an infinite value too nothing is known then.
            Known::Within(error) if error.is_infinite() => Interval { lower: f64::NEG_INFINITY, upper: f64::INFINITY },
            Known::Within(error) => Interval { lower: (f64::from(value) - error).next_down(), upper: (f64::from(value) + error).next_up() },
            Known::Between { lower, upper } => Interval { lower: f64::from(lower[number]), upper: f64::from(upper[number]) },
        }
    }

    /// All lower bounds, rounded down.
    pub fn lower(&self) -> Vec<f32> {
        (0..self.values.len()).map(|number| rounded_down(self.interval(number).lower)).collect()
    }

    /// All upper bounds, rounded up.
    pub fn upper(&self) -> Vec<f32> {
        (0..self.values.len()).map(|number| rounded_up(self.interval(number).upper)).collect()
    }

    /// Trilinear interpolation of the samples; `None` outside the lattice. [`Distance::at`] gives its bounds.
    pub fn interpolate(&self, p: DVec3) -> Option<f64> {
        let extent = self.lattice.extent();
        extent.contains(p).then(|| self.blend(self.place(p)))
    }

    /// The direction in which the interpolation grows fastest, a unit vector, zero where it grows nowhere;
    /// `None` outside the lattice.
    ///
    /// The derivative of the trilinear interpolation in the cell that holds `p`: it jumps from cell to cell.
    pub fn gradient(&self, p: DVec3) -> Option<DVec3> {
        if !self.lattice.extent().contains(p) {
            return None;
        }
        let Place { base, local } = self.place(p);
        let strides = self.lattice.strides();
        let slope = |axis: usize| {
            if strides[axis] == 0 {
                return 0.0;
            }
            let mut ends = [local; 2];
            (ends[0][axis], ends[1][axis]) = (0.0, 1.0);
            let [low, high] = ends.map(|local| self.blend(Place { base, local }));
            (high - low) / self.lattice.spacing[axis]
        };
        Some(DVec3::new(slope(0), slope(1), slope(2)).normalize_or_zero())
    }

    /// Where walking from `p` against the gradient, as far as the distance says each time, meets the surface: within a
    /// thousandth of the spacing. `None` where it does not, or would have to leave the lattice.
    pub fn foot(&self, p: DVec3) -> Option<DVec3> {
        const STEPS: usize = 64;
        let near = 1e-3 * self.lattice.spacing.min_element();
        let extent = self.lattice.extent();
        let mut at = p;
        for _ in 0..STEPS {
            let distance = self.interpolate(at)?;
            if distance.abs() <= near {
                return Some(at);
            }
            at = (at - self.gradient(at)? * distance).clamp(extent.min, extent.max);
        }
        None
    }

    /// [`SampledField::foot`] for many points; not numbers where there is none.
    pub fn feet(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<DVec3>> {
        each(points, run, |p| self.foot(p).unwrap_or(DVec3::NAN))
    }

    /// [`SampledField::interpolate`] for many points; not a number outside the lattice.
    pub fn distances(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<f64>> {
        each(points, run, |p| self.interpolate(p).unwrap_or(f64::NAN))
    }

    /// The intervals that contain the true distances, outside the lattice too.
    pub fn bounds(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<Interval>> {
        each(points, run, |p| self.at(p))
    }

    /// [`SampledField::gradient`] for many points; not numbers outside the lattice.
    pub fn gradients(&self, points: &[DVec3], run: &Run<'_>) -> Result<Vec<DVec3>> {
        each(points, run, |p| self.gradient(p).unwrap_or(DVec3::NAN))
    }

    /// Where a point of the lattice's box lies between the samples.
    fn place(&self, p: DVec3) -> Place {
        let Lattice { spacing, shape, first, .. } = self.lattice;
        let index = (p - self.lattice.point(first)) / spacing;
        let strides = self.lattice.strides();
        let (mut base, mut local) = (0, DVec3::ZERO);
        for axis in 0..3 {
            let cell = (index[axis] as usize).min((shape[axis] as usize).saturating_sub(2));
            base += cell * strides[axis];
            // Rounding may carry a point of the last face beyond it.
            local[axis] = (index[axis] - cell as f64).clamp(0.0, 1.0);
        }
        Place { base, local }
    }

    /// Trilinear interpolation in a cell. A corner without weight does not count, were it infinite.
    fn blend(&self, Place { base, local }: Place) -> f64 {
        let [x, y, z] = self.lattice.strides();
        let along = |weight: f64, low: f64, high: f64| match weight {
            0.0 => low,
            1.0 => high,
            _ => low + (high - low) * weight,
        };
        let value = |number: usize| f64::from(self.values[number]);
        let row = |number: usize| along(local.z, value(number), value(number + z));
        let layer = |number: usize| along(local.y, row(number), row(number + y));
        along(local.x, layer(base), layer(base + x))
    }
}

impl Distance for SampledField {
    fn extent(&self) -> Option<Aabb> {
        Some(self.lattice.extent())
    }

    /// From the corners of the cell by the Lipschitz bound; outside the lattice from the nearest of its points.
    fn at(&self, p: DVec3) -> Interval {
        let extent = self.lattice.extent();
        let inside = p.clamp(extent.min, extent.max);
        let Place { base, local } = self.place(inside);
        let strides = self.lattice.strides();
        let mut known = Interval { lower: f64::NEG_INFINITY, upper: f64::INFINITY };
        let mut farthest = f64::INFINITY;
        // A few ulp for the position of the sample itself.
        let rounding = 8.0 * f64::EPSILON * (p.abs().max_element() + self.lattice.origin.abs().max_element());
        for corner in 0..8 {
            let step: [usize; 3] = std::array::from_fn(|axis| corner >> axis & 1);
            if (0..3).any(|axis| step[axis] == 1 && strides[axis] == 0) {
                continue;
            }
            let number = base + (0..3).map(|axis| step[axis] * strides[axis]).sum::<usize>();
            let way = (local - DVec3::from_array(step.map(|s| s as f64))) * self.lattice.spacing + (p - inside);
            let interval = self.interval(number).widen(way.length() * (1.0 + 1e-12) + rounding);
            known = Interval { lower: known.lower.max(interval.lower), upper: known.upper.min(interval.upper) };
            farthest = farthest.min(interval.upper.max(-interval.lower));
        }
        match self.continuity {
            Continuity::Everywhere => known,
            Continuity::ExceptOpenings => Interval::either_side(farthest),
        }
    }
}

/// Index of a sample, counted from the block's first.
fn index(lattice: &Lattice, number: usize) -> [usize; 3] {
    let [_, ny, nz] = lattice.shape.map(|n| n as usize);
    [number / (ny * nz), number / nz % ny, number % nz]
}

/// The largest single that is not above `value`.
pub fn rounded_down(value: f64) -> f32 {
    let single = value as f32;
    if f64::from(single) > value { single.next_down() } else { single }
}

/// The smallest single that is not below `value`.
pub fn rounded_up(value: f64) -> f32 {
    -rounded_down(-value)
}
