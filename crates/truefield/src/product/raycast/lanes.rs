//! Rays in the frame of the walk, side by side: in units of the finest cells, turned towards high coordinates.

use super::walk::FULL;
use crate::geom::{Aabb, DVec3};
use crate::simd::{Fuse, multiversion};

/// Stands for the reciprocal of zero.
const STEEP: f64 = 1e100;

/// One vector a lane.
type Vectors<const N: usize> = [[f64; N]; 3];

/// Rays in the frame of the walk.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Lanes<const N: usize> {
    /// Unit directions.
    unit: Vectors<N>,
    /// Where they enter the domain, or their origins.
    start: Vectors<N>,
    /// How far from their origins that is; infinite for rays that do not meet the domain.
    begin: [f64; N],
    /// The same in the frame of the walk.
    pub origin: Vectors<N>,
    direction: Vectors<N>,
    pub inverse: Vectors<N>,
    /// Axes that were turned, a bit each.
    pub mask: [u64; N],
    /// Whether each is a ray at all: of finite origin and direction, and of a direction that is not zero.
    sound: [u64; N],
}

/// A ray that meets the domain.
pub(super) struct Ray {
    /// Of unit length.
    pub unit: DVec3,
    /// Where it enters the domain, or its origin.
    pub start: DVec3,
    /// How far from the origin that is.
    pub begin: f64,
    pub turned: Turned,
}

/// A ray in units of the finest cells, turned towards high coordinates.
pub(super) struct Turned {
    pub origin: [f64; 3],
    direction: [f64; 3],
    pub inverse: [f64; 3],
    /// Axes that were turned, a bit each.
    pub mask: usize,
}

impl Ray {
    /// Whether it comes from outside the domain.
    pub fn outside(&self) -> bool {
        self.begin > 0.0
    }
}

impl Turned {
    /// Parameter at which the ray meets a plane across an axis.
    #[inline(always)]
    pub fn at_plane(&self, axis: usize, plane: f64) -> f64 {
        (plane - self.origin[axis]) * self.inverse[axis]
    }

    /// Coordinates from 0 to 1 in a cell, turned back.
    #[inline(always)]
    pub fn local(&self, t: f64, place: [u32; 3], shrink: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            let at = (self.origin[axis] + self.direction[axis] * t - f64::from(place[axis])) * shrink[axis];
            let at = at.clamp(0.0, 1.0);
            if self.mask >> axis & 1 == 1 { 1.0 - at } else { at }
        })
    }
}

impl<const N: usize> Lanes<N> {
    pub const EMPTY: Self = {
        let zero = [[0.0; N]; 3];
        Self {
            unit: zero,
            start: zero,
            begin: [f64::INFINITY; N],
            origin: zero,
            direction: zero,
            inverse: zero,
            mask: [0; N],
            sound: [0; N],
        }
    };

    /// Whether the ray meets the domain.
    #[inline(always)]
    pub fn meets(&self, lane: usize) -> bool {
        self.begin[lane] < f64::INFINITY
    }

    /// Whether it comes from outside the domain.
    #[inline(always)]
    pub fn outside(&self, lane: usize) -> bool {
        self.begin[lane] > 0.0
    }

    /// Whether all are rays.
    pub fn are_sound(&self) -> bool {
        self.sound.iter().fold(true, |all, &sound| all & (sound == 1))
    }

    /// One of the rays, if it meets the domain.
    #[inline(always)]
    pub fn ray(&self, lane: usize) -> Option<Ray> {
        let of = |vectors: &Vectors<N>| std::array::from_fn(|axis| vectors[axis][lane]);
        let vector = |vectors: &Vectors<N>| DVec3::from_array(of(vectors));
        self.meets(lane).then(|| Ray {
            unit: vector(&self.unit),
            start: vector(&self.start),
            begin: self.begin[lane],
            turned: Turned {
                origin: of(&self.origin),
                direction: of(&self.direction),
                inverse: of(&self.inverse),
                mask: self.mask[lane] as usize,
            },
        })
    }

    /// Takes rays, of directions of any length, through a domain with so many finest cells a unit along each axis;
    /// lanes beyond them repeat the last.
    #[inline(always)]
    pub fn take(&mut self, domain: &Aabb, scale: DVec3, origins: &[DVec3], directions: &[DVec3], length: f64) {
        let (mut o, mut d) = ([[0.0; N]; 3], [[0.0; N]; 3]);
        for lane in 0..N {
            let i = lane.min(origins.len() - 1);
            for axis in 0..3 {
                (o[axis][lane], d[axis][lane]) = (origins[i][axis], directions[i][axis]);
            }
        }
        for lane in 0..N {
            // By the largest coordinate first: its square cannot overflow, nor vanish.
            let largest = greater(greater(d[0][lane].abs(), d[1][lane].abs()), d[2][lane].abs());
            let q: [f64; 3] = std::array::from_fn(|axis| d[axis][lane] / largest);
            let squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
            let finite = (0..3).fold(true, |finite, axis| finite & (o[axis][lane].abs() < f64::INFINITY));
            // One of the parts is 1, or not a number.
            self.sound[lane] = u64::from(finite & (squared >= 1.0));
            let shrink = 1.0 / squared.sqrt();
            let unit = q.map(|x| x * shrink);
            let (mut begin, mut end) = (0.0, length);
            for axis in 0..3 {
                let (from, along) = (o[axis][lane], unit[axis]);
                let (low, high) = (domain.min[axis], domain.max[axis]);
                let (near, far) = if along < 0.0 { (high, low) } else { (low, high) };
                let inverse = 1.0 / along;
                let (enter, leave) = ((near - from) * inverse, (far - from) * inverse);
                let still = along.abs() < 1.0 / STEEP;
                let beside = (from < low) | (from > high);
                let never = if beside { f64::INFINITY } else { f64::NEG_INFINITY };
                begin = greater(if still { never } else { enter }, begin);
                end = -greater(if still { never } else { -leave }, -end);
            }
            self.begin[lane] = if begin <= end { begin } else { f64::INFINITY };
            let mut mask = 0;
            for axis in 0..3 {
                // From there on, so that far origins lose nothing.
                let start = if begin > 0.0 { o[axis][lane] + unit[axis] * begin } else { o[axis][lane] };
                let (from, step) = ((start - domain.min[axis]) * scale[axis], unit[axis] * scale[axis]);
                let turn = step < 0.0;
                let from = if turn { f64::from(FULL) - from } else { from };
                let step = step.abs();
                let from = if from > 0.0 { from } else { 0.0 };
                self.unit[axis][lane] = unit[axis];
                self.start[axis][lane] = start;
                self.origin[axis][lane] = if from < f64::from(FULL) { from } else { f64::from(FULL) };
                self.direction[axis][lane] = step;
                self.inverse[axis][lane] = if step > 1.0 / STEEP { 1.0 / step } else { STEEP };
                mask |= u64::from(turn) << axis;
            }
            self.mask[lane] = mask;
        }
    }
}

/// Plain comparisons are one instruction.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Rays that are taken at once.
pub(super) const RAYS: usize = 32;

multiversion!(
    /// [`Lanes::take`] of up to [`RAYS`] rays without an end.
    pub(super) fn take_rays(lanes: &mut Lanes<RAYS>, domain: &Aabb, scale: DVec3, origins: &[DVec3], directions: &[DVec3]) = take_rays_body
);

#[inline(always)]
fn take_rays_body<F: Fuse>(lanes: &mut Lanes<RAYS>, domain: &Aabb, scale: DVec3, origins: &[DVec3], directions: &[DVec3]) {
    lanes.take(domain, scale, origins, directions, f64::INFINITY);
}
