//! The question every source and field answers.

use crate::error::Result;
use crate::geom::{Aabb, Affine, DVec3, Interval, Nearest};

/// Anything that can be asked how far it is. Distances are in model units, negative inside.
pub trait Distance: Send + Sync {
    /// The box of the shape, or of a field's domain; `None` when unbounded.
    fn extent(&self) -> Option<Aabb>;

    /// A box beyond which all is certain to be outside, if one is known.
    fn enclosure(&self) -> Option<Aabb> {
        None
    }

    /// The interval that contains the true signed distance at `p`.
    fn at(&self, p: DVec3) -> Interval;

    /// The range of distances over a box; the default uses that distances are 1-Lipschitz.
    fn over(&self, cell: &Aabb) -> Interval {
        self.at(cell.center()).widen(cell.radius() * (1.0 + 1e-15))
    }

    /// An affine function that is nowhere in the box above the distance; the default's is the least distance.
    ///
    /// Over a box at some way from a flat or convex surface, it tells much more than the least distance does.
    fn below(&self, cell: &Aabb) -> Affine {
        Affine::constant(self.over(cell).lower)
    }

    /// [`Distance::at`] for many points; `out` is as long as `points`.
    fn at_many(&self, points: &[DVec3], out: &mut [Interval]) {
        for (p, out) in points.iter().zip(out) {
            *out = self.at(*p);
        }
    }
}

/// A distance that also knows the nearest point of the surface.
pub trait Closest: Distance {
    /// The nearest point if it lies within `within` (a plain, unsigned length) of `p`, else `None`.
    fn nearest(&self, p: DVec3, within: f64) -> Option<Nearest>;
}

/// A shape that fields can be built from: one number at every point, and what is known of it over boxes.
///
/// The value is the signed distance wherever [`Distance::at`] is exact. Where a shape knows an interval only, as a
/// difference of two shapes does beyond their common edge, it is a number that has the sign of the distance, vanishes on
/// the surface and changes by no more than one moves, but for [`Source::noise`]. [`Source::slack`] says how far the
/// distance may be from it.
pub trait Source: Distance {
    /// The values at many points; `out` is as long as `points`.
    ///
    /// Fails where the shape cannot be asked: a function of the user that raises, or says what is no number.
    fn values(&self, points: &[DVec3], out: &mut [f64]) -> Result<()>;

    /// The gradient of the value at many points, its length about 1; `out` is as long as `points`.
    ///
    /// The default takes differences across steps of some 1e-5 of the coordinates and the distance, which is good to about
    /// ten digits where the value is smooth; at ridges and valleys it lies between the slopes of their sides.
    fn gradients(&self, points: &[DVec3], out: &mut [DVec3]) -> Result<()> {
        let mut values = vec![0.0; points.len()];
        self.values(points, &mut values)?;
        let size = self.extent().map_or(1.0, |extent| extent.diagonal());
        let steps: Vec<f64> = points.iter().zip(&values).map(|(p, value)| step(*p, size).max(STEP * value.abs())).collect();
        let around: Vec<DVec3> = points
            .iter()
            .zip(&steps)
            .flat_map(|(&p, &step)| DVec3::AXES.into_iter().flat_map(move |axis| [p + axis * step, p - axis * step]))
            .collect();
        let mut values = vec![0.0; around.len()];
        self.values(&around, &mut values)?;
        for (out, (at, value)) in out.iter_mut().zip(around.as_chunks::<6>().0.iter().zip(values.as_chunks::<6>().0)) {
            // By the steps that were really taken, after rounding.
            *out = DVec3::from_array(std::array::from_fn(|axis| {
                (value[2 * axis] - value[2 * axis + 1]) / (at[2 * axis] - at[2 * axis + 1])[axis]
            }));
        }
        Ok(())
    }

    /// No less than what [`Source::gradients`] says at a point and the value's gradient differ by, where there is one;
    /// infinite where that is not known, or the value there is not known within [`Source::noise`].
    ///
    /// The default is what closed forms are good to, and what noise does to differences; how much the slope turns along the
    /// steps of those is not counted.
    fn tilt(&self, p: DVec3) -> f64 {
        1e-8 + 2.0 * self.noise() / step(p, self.extent().map_or(1.0, |extent| extent.diagonal()))
    }

    /// Contains the distance minus the value at every point of the cell; ends may be infinite.
    fn slack(&self, cell: &Aabb) -> Interval {
        let _ = cell;
        Interval::exact(0.0)
    }

    /// Contains the second derivative of the value at every point of the cell, along every line of unit speed.
    ///
    /// Where the slope jumps it is infinite: down to `-inf` at a ridge, as between two walls, and up to `inf` at a valley.
    /// With a lower end m, the value minus m/2 |p|^2 is convex in the cell; with an upper end, it is concave.
    fn bend(&self, cell: &Aabb) -> Interval {
        let _ = cell;
        Interval::ALL
    }

    /// Contains, for each box of a block, the value minus what is said, interpolated from the box's corners.
    ///
    /// The default knows what [`Source::bend`] says of the cell, and that values change by no more than one moves. Shapes
    /// whose slope jumps along seams of known sides can say more. Fails as [`Source::values`] does.
    fn residual(&self, block: &SampleBlock<'_>, out: &mut [Interval]) -> Result<()> {
        block.residual(block.between(self.bend(&block.cell), self.noise_over(&block.cell)), out);
        Ok(())
    }

    /// Whether the shape does not depend on z: it has the same cross-section at every height.
    fn is_flat(&self) -> bool {
        false
    }

    /// Whether the value has the sign of the distance everywhere, so that solids can be put together by values alone.
    fn sided(&self) -> bool {
        true
    }

    /// No less than how far solving or rounding can move a value from one that changes by no more than one moves.
    fn noise(&self) -> f64 {
        0.0
    }

    /// [`Source::noise`] in a cell.
    fn noise_over(&self, cell: &Aabb) -> f64 {
        let _ = cell;
        self.noise()
    }
}

/// What was sampled of a shape in a cell: on a lattice, which may be turned.
#[derive(Clone, Copy, Debug)]
pub struct SampleBlock<'a> {
    /// Contains the lattice.
    pub cell: Aabb,
    /// Its nodes, x slowest.
    pub points: &'a [DVec3],
    /// The values there.
    pub values: &'a [f64],
    /// What a field would say there.
    pub said: &'a [f64],
    /// Boxes along each axis; none along z where the shape is flat, and the lattice is taken to be the same at every height.
    pub boxes: [usize; 3],
    /// The sum of the squared edges of a box.
    pub square: f64,
}

impl<'a> SampleBlock<'a> {
    /// The same nodes with other values, for which something else is said.
    #[must_use]
    pub fn with(self, values: &'a [f64], said: &'a [f64]) -> Self {
        Self { values, said, ..self }
    }

    /// How many boxes there are.
    pub fn len(&self) -> usize {
        self.boxes[0] * self.boxes[1] * self.boxes[2].max(1)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether the lattice's axes are those of the cell.
    pub fn is_upright(&self) -> bool {
        let (Some(&first), Some(&last)) = (self.points.first(), self.points.last()) else { return false };
        let size = self.cell.min.abs().max(self.cell.max.abs()).max_element();
        let near = |a: DVec3, b: DVec3| {
            let apart = (a - b).abs();
            apart.x.max(apart.y) <= 64.0 * f64::EPSILON * size && (self.boxes[2] == 0 || apart.z <= 64.0 * f64::EPSILON * size)
        };
        near(first, self.cell.min) && near(last, self.cell.max)
    }

    /// Takes the number of each box and the nodes at its corners, x slowest; along a z without boxes the same ones twice.
    #[inline]
    pub fn each_box(&self, mut take: impl FnMut(usize, [usize; 8])) {
        let [nx, ny, nz] = self.boxes;
        let (stride_y, stride_x, up) = (nz + 1, (nz + 1) * (ny + 1), usize::from(nz > 0));
        let mut number = 0;
        for i in 0..nx {
            for j in 0..ny {
                for k in 0..nz.max(1) {
                    let low = i * stride_x + j * stride_y + k;
                    take(
                        number,
                        std::array::from_fn(|corner| low + (corner & 1) * stride_x + (corner >> 1 & 1) * stride_y + (corner >> 2) * up),
                    );
                    number += 1;
                }
            }
        }
    }

    /// The values minus what is said, where `between` contains values between samples minus their interpolation.
    pub fn residual(&self, between: Interval, out: &mut [Interval]) {
        self.each_box(|number, corners| {
            let apart = corners.map(|node| self.values[node] - self.said[node]);
            let hull = Interval {
                lower: apart.into_iter().fold(f64::INFINITY, f64::min),
                upper: apart.into_iter().fold(f64::NEG_INFINITY, f64::max),
            };
            out[number] = hull.plus(between);
        });
    }

    /// Between the samples, minus their interpolation: by how the value bends in the cell, and by how far it is to the
    /// samples, where `noise` is no less than how far a value is from one that changes by no more than one moves.
    ///
    /// If the value bends by m at least, it is m/2 |p|^2 and something convex, which lies below its interpolation.
    pub fn between(&self, bend: Interval, noise: f64) -> Interval {
        let first = 0.5 * self.square.sqrt() * (1.0 + 1e-12) + 2.0 * noise;
        let eighth = self.square / 8.0 * (1.0 + 1e-12);
        Interval {
            lower: -first.min(if bend.upper < f64::INFINITY { eighth * bend.upper.max(0.0) } else { f64::INFINITY }),
            upper: first.min(if bend.lower > f64::NEG_INFINITY { eighth * (-bend.lower).max(0.0) } else { f64::INFINITY }),
        }
    }
}

/// The step of a difference that balances its own error, of second order, and rounding.
const STEP: f64 = 6e-6;

/// No less than that step, of a shape of this size.
fn step(p: DVec3, size: f64) -> f64 {
    STEP * p.abs().max_element().max(size).max(f64::MIN_POSITIVE)
}
