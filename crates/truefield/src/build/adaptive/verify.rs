//! What is proven of a cell by its samples and by how the shape bends.
//!
//! Let s be the spacing of the samples, I their trilinear interpolation from one to the next and F the shape's value.
//! 1. F changes by no more than one moves, so |F - I| <= sum of weights times ways to the samples <= sqrt(axes)/2 s.
//! 2. If F bends by m at least, F - m/2 |p|^2 is convex and lies below its interpolation: F - I <= -m axes s^2 / 8.
//!    In the same way from above.
//! 3. What the leaf says, M, is compared with the samples; between them I(F) - I(M) lies in the hull of the differences,
//!    and |I(M) - M| <= s^2/8 (|M_xx| + |M_yy| + |M_zz|), which vanishes where M is trilinear.

use super::Reconstruction;
use crate::field::adaptive::{Division, Record, Samples, bends, cubic_value};
use crate::geom::{Aabb, DVec3, Interval};

/// Where the samples of a cell lie: on a lattice of so many steps along an edge.
pub(crate) struct Block {
    steps: usize,
    /// Steps along z: none in a quadtree.
    steps_z: usize,
    division: Division,
    reconstruction: Reconstruction,
}

/// What was found out about a cell.
pub(crate) struct Found {
    /// Contains the value minus the interpolated corners, which are rounded to single precision.
    pub linear: Interval,
    /// The largest difference at the samples.
    pub linear_samples: f64,
    /// The same of tricubic interpolation.
    pub cubic: Option<FoundCubic>,
    /// No point of the cell is nearer to the surface.
    pub least: f64,
}

pub(crate) struct FoundCubic {
    pub error: Interval,
    pub samples: f64,
    pub thirds: Samples,
}

impl Block {
    pub fn new(division: Division, reconstruction: Reconstruction) -> Self {
        let steps = match reconstruction {
            Reconstruction::Linear => 2,
            Reconstruction::Cubic => 6,
        };
        Self { steps, steps_z: if division == Division::Octree { steps } else { 0 }, division, reconstruction }
    }

    /// Indices of all samples, x slowest.
    fn indices(&self) -> impl Iterator<Item = [usize; 3]> {
        let (n, nz) = (self.steps, self.steps_z);
        (0..=n).flat_map(move |i| (0..=n).flat_map(move |j| (0..=nz).map(move |k| [i, j, k])))
    }

    /// The corner that a sample is, if it is one; in a quadtree the lower one of two.
    fn corner(&self, index: [usize; 3]) -> Option<usize> {
        let bit = |at: usize, steps: usize| match at {
            0 => Some(0),
            _ if at == steps => Some(1),
            _ => None,
        };
        Some(bit(index[0], self.steps)? | bit(index[1], self.steps)? << 1 | bit(index[2], self.steps_z)? << 2)
    }

    /// Samples that are no corners.
    pub fn len(&self) -> usize {
        self.indices().filter(|&index| self.corner(index).is_none()).count()
    }

    fn local(&self, index: [usize; 3]) -> DVec3 {
        let part = |at: usize, steps: usize| if steps == 0 { 0.0 } else { at as f64 / steps as f64 };
        DVec3::new(part(index[0], self.steps), part(index[1], self.steps), part(index[2], self.steps_z))
    }

    /// Adds the places of the samples that are no corners.
    pub fn points(&self, cell: &Aabb, out: &mut Vec<DVec3>) {
        for index in self.indices().filter(|&index| self.corner(index).is_none()) {
            out.push(cell.min + (cell.max - cell.min) * self.local(index));
        }
    }

    /// All samples of a cell, x slowest.
    pub fn samples(&self, corners: &[f64; 8], others: &[f64]) -> Vec<f64> {
        let mut others = others.iter();
        self.indices()
            .map(|index| self.corner(index).map_or_else(|| others.next().copied().unwrap_or(f64::NAN), |corner| corners[corner]))
            .collect()
    }

    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        (i * (self.steps + 1) + j) * (self.steps_z + 1) + k
    }

    /// The corners of a child, which are samples of the cell.
    pub fn corners_of_child(&self, samples: &[f64], octant: usize) -> [f64; 8] {
        let half = [self.steps / 2, self.steps / 2, self.steps_z / 2];
        std::array::from_fn(|corner| samples[self.number([0, 1, 2].map(|axis| ((octant >> axis & 1) + (corner >> axis & 1)) * half[axis]))])
    }

    /// Proves what can be proven.
    pub fn verify(&self, cell: &Aabb, samples: &[f64], bend: Interval, noise: f64) -> Found {
        let step = (0..self.division.axes()).map(|axis| (cell.size()[axis] / self.steps as f64).powi(2)).sum::<f64>();
        let way = 0.5 * step.sqrt() * (1.0 + 1e-12);
        let square = step / 8.0 * (1.0 + 1e-12);
        let first = way + 2.0 * noise;
        // Between the samples, minus their interpolation.
        let between = Interval {
            lower: -first.min(if bend.upper < f64::INFINITY { square * bend.upper.max(0.0) } else { f64::INFINITY }),
            upper: first.min(if bend.lower > f64::NEG_INFINITY { square * (-bend.lower).max(0.0) } else { f64::INFINITY }),
        };
        // Places of samples, and arithmetic with their values.
        let size = samples.iter().fold(cell.min.abs().max(cell.max.abs()).max_element(), |size, v| size.max(v.abs()));
        let between = between.widen(32.0 * f64::EPSILON * size);
        let least = samples.iter().fold(f64::INFINITY, |least, v| least.min(v.abs()));
        let corners = std::array::from_fn(|corner| {
            let index = [0, 1, 2].map(|axis| (corner >> axis & 1) * if axis == 2 { self.steps_z } else { self.steps });
            samples[self.number(index)] as f32
        });
        let record = Record { corners, ..Record::default() };
        let differences = |model: &dyn Fn(DVec3) -> f64| {
            let each = self.indices().zip(samples.iter()).map(|(index, &value)| Interval::exact(value - model(self.local(index))));
            each.reduce(Interval::hull).unwrap_or(Interval::ALL)
        };
        let linear = differences(&|at| record.value(at));
        let cubic = (self.reconstruction == Reconstruction::Cubic).then(|| {
            let thirds: Samples = std::array::from_fn(|n| {
                let [i, j, k] = [n / 16, n / 4 % 4, n % 4].map(|third| third * self.steps / 3);
                samples[self.number([i, j, if self.steps_z == 0 { 0 } else { k }])] as f32
            });
            let found = differences(&|at| cubic_value(&thirds, at));
            // Second derivatives are per cell squared: the spacing is one of so many steps.
            let steps = self.steps as f64;
            let curve = bends(&thirds).element_sum() / (8.0 * steps * steps) * (1.0 + 1e-9);
            FoundCubic { error: found.plus(between).widen(curve), samples: found.upper.max(-found.lower), thirds }
        });
        Found {
            linear: linear.plus(between),
            linear_samples: linear.upper.max(-linear.lower),
            cubic,
            least: (least - way - noise).max(0.0),
        }
    }
}
