//! What is proven of a cell by its samples and by how the shape bends.
//!
//! Let s be the spacing of the samples, I their trilinear interpolation from one to the next and F the shape's value.
//! 1. F changes by no more than one moves, so |F - I| <= sum of weights times ways to the samples <= sqrt(axes)/2 s.
//! 2. If F bends by m at least, F - m/2 |p|^2 is convex and lies below its interpolation: F - I <= -m axes s^2 / 8.
//!    In the same way from above. Shapes whose slope jumps know more, see [`Source::residual`](crate::Source::residual).
//! 3. What the leaf says, M, is compared with the samples, box by box; between them I(F) - I(M) lies in the hull of the
//!    differences, and |I(M) - M| <= s^2/8 (|M_xx| + |M_yy| + |M_zz|), which vanishes where M is trilinear.

use super::Reconstruction;
use crate::distance::SampleBlock;
use crate::field::adaptive::{Division, Root, Samples, bends, cubic_weights};
use crate::geom::{Aabb, DVec3, Interval};

/// Where the samples of a cell lie: on a lattice of so many steps along an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Layout {
    steps: usize,
    /// Steps along z: none in a quadtree.
    steps_z: usize,
    division: Division,
}

/// What a leaf would say at its samples.
pub(crate) struct Said {
    pub values: Vec<f64>,
    /// How much it may differ from its interpolation between the samples.
    curve: f64,
}

impl Layout {
    pub fn new(division: Division, reconstruction: Reconstruction) -> Self {
        let steps = match reconstruction {
            Reconstruction::Linear => 2,
            Reconstruction::Cubic => 6,
        };
        Self { steps, steps_z: if division == Division::Octree { steps } else { 0 }, division }
    }

    /// That of a cell's children together.
    pub fn of_children(self) -> Self {
        Self { steps: 2 * self.steps, steps_z: 2 * self.steps_z, division: self.division }
    }

    /// Samples.
    pub fn len(self) -> usize {
        (self.steps + 1) * (self.steps + 1) * (self.steps_z + 1)
    }

    /// Indices of all samples, x slowest.
    fn indices(self) -> impl Iterator<Item = [usize; 3]> {
        let (n, nz) = (self.steps, self.steps_z);
        (0..=n).flat_map(move |i| (0..=n).flat_map(move |j| (0..=nz).map(move |k| [i, j, k])))
    }

    fn number(self, [i, j, k]: [usize; 3]) -> usize {
        (i * (self.steps + 1) + j) * (self.steps_z + 1) + k
    }

    /// Whether each sample of the children is one of the cell's, too.
    pub fn are_shared(self) -> impl Iterator<Item = bool> {
        self.indices().map(|index| index.into_iter().all(|at| at.is_multiple_of(2)))
    }

    /// Adds the places of the samples of a cell; a node that is shared by cells has the same coordinates in all.
    pub fn points(self, root: &Root, depth: u32, index: [u32; 3], out: &mut Vec<DVec3>) {
        let along = |axis: usize, steps: usize| -> Vec<f64> {
            (0..=steps).map(|step| root.coordinate(axis, depth, index[axis], step as u32, steps.max(1) as u32)).collect()
        };
        let (x, y, z) = (along(0, self.steps), along(1, self.steps), along(2, self.steps_z));
        for &x in &x {
            for &y in &y {
                out.extend(z.iter().map(|&z| DVec3::new(x, y, z)));
            }
        }
    }

    /// What a child has of the samples of all children together, of which this is the layout.
    pub fn part<T: Copy>(self, all: &[T], octant: usize, out: &mut Vec<T>) {
        let (half, half_z) = (self.steps / 2, self.steps_z / 2);
        let first = |axis: usize, half: usize| (octant >> axis & 1) * half;
        for i in 0..=half {
            for j in 0..=half {
                let start = self.number([first(0, half) + i, first(1, half) + j, first(2, half_z)]);
                out.extend_from_slice(&all[start..=start + half_z]);
            }
        }
    }

    /// The samples at the corners.
    pub fn corners(self, samples: &[f64]) -> [f64; 8] {
        std::array::from_fn(|corner| {
            samples[self.number([(corner & 1) * self.steps, (corner >> 1 & 1) * self.steps, (corner >> 2) * self.steps_z])]
        })
    }

    /// A cell, its samples and where they lie, said just as they are.
    pub fn block<'a>(self, cell: &Aabb, points: &'a [DVec3], values: &'a [f64]) -> SampleBlock<'a> {
        let square = (0..self.division.axes()).map(|axis| (cell.size()[axis] / self.steps as f64).powi(2)).sum();
        SampleBlock { cell: *cell, points, values, said: values, boxes: [self.steps, self.steps, self.steps_z], square }
    }

    /// No point of the cell is nearer to the surface, if values are within `noise` of what changes no more than one moves.
    pub fn least(block: &SampleBlock<'_>, noise: f64) -> f64 {
        let least = block.values.iter().fold(f64::INFINITY, |least, v| least.min(v.abs()));
        (least - 0.5 * block.square.sqrt() * (1.0 + 1e-12) - noise).max(0.0)
    }

    /// What no division makes less, in a cell that is as fine as the `noise` of its values.
    pub fn left_open(cell: &Aabb, noise: f64) -> f64 {
        if noise.is_finite() && noise >= 0.5 * cell.radius() { 2.0 * noise } else { 0.0 }
    }

    /// By trilinear interpolation of the corners.
    pub fn linear(self, corners: &[f32; 8]) -> Said {
        let c = corners.map(f64::from);
        let along = |low: f64, high: f64, step: usize, steps: usize| low + (high - low) * (step as f64 / steps.max(1) as f64);
        let mut values = Vec::with_capacity(self.len());
        for i in 0..=self.steps {
            let face: [f64; 4] = std::array::from_fn(|row| along(c[2 * row], c[2 * row + 1], i, self.steps));
            for j in 0..=self.steps {
                let edge = [along(face[0], face[1], j, self.steps), along(face[2], face[3], j, self.steps)];
                values.extend((0..=self.steps_z).map(|k| along(edge[0], edge[1], k, self.steps_z)));
            }
        }
        Said { values, curve: 0.0 }
    }

    /// The samples at thirds of the edges.
    pub fn thirds(self, samples: &[f64]) -> Samples {
        std::array::from_fn(|n| {
            let [i, j, k] = [n / 16, n / 4 % 4, n % 4].map(|third| third * self.steps / 3);
            samples[self.number([i, j, if self.steps_z == 0 { 0 } else { k }])] as f32
        })
    }

    /// By tricubic interpolation.
    pub fn cubic(self, thirds: &Samples) -> Said {
        let weights =
            |steps: usize| -> Vec<[f64; 4]> { (0..=steps).map(|step| cubic_weights(step as f64 / steps.max(1) as f64)).collect() };
        // Second derivatives are per cell squared: the spacing is one of so many steps.
        let steps = self.steps as f64;
        let curve = bends(thirds).element_sum() / (8.0 * steps * steps) * (1.0 + 1e-9);
        Said { values: spread(&thirds.map(f64::from), &weights(self.steps), &weights(self.steps_z)), curve }
    }
}

impl Said {
    /// The largest difference at a sample.
    pub fn worst(&self, block: &SampleBlock<'_>) -> f64 {
        block.values.iter().zip(&self.values).fold(0.0, |worst, (value, said)| f64::max(worst, (value - said).abs()))
    }

    /// Contains the value minus what is said, all over the cell, from [`Source::residual`](crate::Source::residual).
    pub fn error(&self, block: &SampleBlock<'_>, residual: &[Interval]) -> Interval {
        // Places of samples, and arithmetic with their values.
        let size = block.values.iter().fold(block.cell.min.abs().max(block.cell.max.abs()).max_element(), |size, v| size.max(v.abs()));
        let hull = residual.iter().copied().reduce(Interval::hull).unwrap_or(Interval::ALL);
        hull.widen(self.curve + 32.0 * f64::EPSILON * size)
    }
}

/// Interpolates a cube of numbers along each axis in turn, the last axis fastest.
fn spread<const N: usize>(cube: &[f64], across: &[[f64; N]], up: &[[f64; N]]) -> Vec<f64> {
    let along = |from: &[f64], stride: usize, weights: &[[f64; N]], out: &mut Vec<f64>| {
        for block in from.chunks_exact(N * stride) {
            for weights in weights {
                out.extend((0..stride).map(|at| (0..N).map(|n| weights[n] * block[n * stride + at]).sum::<f64>()));
            }
        }
    };
    let (mut x, mut y, mut z) = (Vec::new(), Vec::new(), Vec::new());
    along(cube, N * N, across, &mut x);
    along(&x, N, across, &mut y);
    along(&y, 1, up, &mut z);
    z
}
