//! The way of a ray through the tree, cell by cell, front to back.
//!
//! Each ray is turned so that it runs towards high coordinates along every axis (Revelles, Urena and Lastra 2000), and
//! the next cell is found by the bits of the last one's place (Laine and Karras 2010). The parameter of a plane of the
//! tree is always computed in one way, so that one cell ends where the next begins.

use super::Method;
use super::along::{bernstein, first_change, first_root, trilinear, trilinear_slopes};
use super::caster::{Caster, Child};
use super::facets::Through;
use super::lanes::{Lanes, Ray};
use crate::field::adaptive::MAX_DEPTH;
use crate::geom::DVec3;
use crate::simd::{Fuse, multiversion};

/// Edge of the root in units of the finest cells.
pub(super) const FULL: u32 = 1 << MAX_DEPTH;

/// A tricubic interpolation of a distance may change somewhat faster than the distance.
const SLOPE: f64 = 1.5;

/// What a ray meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the origin, model units.
    pub distance: f64,
    /// The place.
    pub point: DVec3,
    /// Unit gradient of the field there: outward.
    pub normal: DVec3,
}

impl Hit {
    /// No hit.
    pub const NONE: Self = Self { distance: f64::INFINITY, point: DVec3::NAN, normal: DVec3::NAN };
}

/// What rays meet, one entry for each; as [`Hit::NONE`] where that is nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hits {
    /// Distances from the origins, model units.
    pub distances: Vec<f64>,
    /// The places, x, y, z.
    pub points: Vec<[f64; 3]>,
    /// Unit gradients of the field there: outward.
    pub normals: Vec<[f64; 3]>,
}

impl Hits {
    /// What one of the rays meets.
    pub fn get(&self, ray: usize) -> Hit {
        Hit { distance: self.distances[ray], point: DVec3::from_array(self.points[ray]), normal: DVec3::from_array(self.normals[ray]) }
    }
}

/// A place where the side changes, in the frame of the walk.
struct Found {
    t: f64,
    at: At,
}

/// In which cell the gradient is to be taken.
#[derive(Clone, Copy)]
enum At {
    Linear {
        number: u32,
        place: [u32; 3],
        size: u32,
    },
    Other(u32),
    /// Between two cells without one: the face's axis, and whether the ray enters there.
    Face {
        axis: usize,
        entering: bool,
    },
}

multiversion!(
    /// Where the ray first changes sides, from `from` on.
    fn find(caster: &Caster, ray: &Ray, from: f64, length: f64, method: Method) -> Option<Found> = find_body
);

#[inline(always)]
fn find_body<F: Fuse>(caster: &Caster, ray: &Ray, from: f64, length: f64, method: Method) -> Option<Found> {
    let left = length - ray.begin;
    let found = match (caster.columns, method) {
        (false, Method::Linear) => caster.walk::<3, false>(ray, from, left),
        (false, Method::Cubic) => caster.walk::<3, true>(ray, from, left),
        (true, Method::Linear) => caster.walk::<2, false>(ray, from, left),
        (true, Method::Cubic) => caster.walk::<2, true>(ray, from, left),
    };
    found.filter(|found| ray.begin + found.t <= length)
}

/// Of a power of two, exactly.
#[inline(always)]
fn reciprocal(power: u32) -> f64 {
    f64::from_bits(u64::from(1023 - power.trailing_zeros()) << 52)
}

impl Caster {
    /// The first place within `length` at which the ray changes sides; its direction need not be of unit length, but not zero.
    ///
    /// A ray starts on the side of its origin, outside of the domain on the outside, and ends there where it leaves.
    pub fn first(&self, origin: DVec3, direction: DVec3, length: f64, method: Method) -> Option<Hit> {
        self.follow(&self.one(origin, direction, length)?, 0.0, length, method)
    }

    /// The same of a ray that is prepared, and known to meet nothing before `from`.
    pub(super) fn follow(&self, ray: &Ray, from: f64, length: f64, method: Method) -> Option<Hit> {
        let found = find(self, ray, from, length, method)?;
        let point = ray.start + ray.unit * found.t;
        Some(Hit { distance: ray.begin + found.t, point, normal: self.normal(&found, point, ray.unit) })
    }

    /// Whether the ray changes sides within `length`.
    pub fn meets(&self, origin: DVec3, direction: DVec3, length: f64, method: Method) -> bool {
        self.one(origin, direction, length).is_some_and(|ray| find(self, &ray, 0.0, length, method).is_some())
    }

    fn one(&self, origin: DVec3, direction: DVec3, length: f64) -> Option<Ray> {
        let mut lane = Lanes::<1>::EMPTY;
        lane.take(&self.extent, self.scale, &[origin], &[direction], length);
        lane.ray(0)
    }

    /// `AXES` are divided; `CUBIC` solves for the crossing of a trilinear leaf, else the way between its ends is a line.
    #[inline(always)]
    fn walk<const AXES: usize, const CUBIC: bool>(&self, prepared: &Ray, from: f64, length: f64) -> Option<Found> {
        let ray = &prepared.turned;
        let mask = if AXES == 3 { ray.mask } else { ray.mask & 3 };
        let mut stack = [0u32; MAX_DEPTH as usize + 1];
        let mut place = [0u32; 3];
        let mut size = FULL;
        let mut word = self.root;
        let mut t = from;
        // The value at the end of the last cell: infinite where only its side is known, not a number before the first.
        let mut carried = if prepared.outside() { f64::INFINITY } else { f64::NAN };
        let mut last = None;
        // From where on its side is the surface's own: the next exact leaf need not be asked.
        let mut since = None;
        loop {
            // Down to the leaf that holds the ray at t.
            while let Child::Branch(node) = Child::of(word) {
                stack[size.trailing_zeros() as usize] = node;
                size >>= 1;
                let mut octant = 0;
                for axis in 0..AXES {
                    let middle = place[axis] + size;
                    if t >= ray.at_plane(axis, f64::from(middle)) {
                        octant |= 1 << axis;
                        place[axis] = middle;
                    }
                }
                word = self.nodes[node as usize][octant ^ mask];
            }
            // Its end.
            let sizes = if AXES == 3 { [size; 3] } else { [size, size, FULL] };
            let shrink = sizes.map(reciprocal);
            let ends: [f64; 3] = std::array::from_fn(|axis| ray.at_plane(axis, f64::from(place[axis] + sizes[axis])));
            let axis_out = if ends[0] <= ends[1] {
                if ends[0] <= ends[2] { 0 } else { 2 }
            } else if ends[1] <= ends[2] {
                1
            } else {
                2
            };
            let out = ends[axis_out].max(t);
            'leaf: {
                match Child::of(word) {
                    Child::Empty(inside) => {
                        if (carried < 0.0) != inside && !carried.is_nan() {
                            // The face that was met last.
                            let starts: [f64; 3] = std::array::from_fn(|axis| ray.at_plane(axis, f64::from(place[axis])));
                            let axis = (0..3).fold(0, |last, axis| if starts[axis] > starts[last] { axis } else { last });
                            let face = At::Face { axis, entering: inside };
                            return Some(Found { t, at: last.unwrap_or(face) });
                        }
                        (carried, last, since) = (if inside { f64::NEG_INFINITY } else { f64::INFINITY }, None, None);
                    }
                    Child::Linear(number) => {
                        let corners = &self.corners[number as usize];
                        let at = At::Linear { number, place, size };
                        let value = |t: f64| trilinear(corners, ray.local(t, place, shrink)) - self.distance;
                        if CUBIC {
                            let step = (out - t) / 3.0;
                            let values = [value(t), value(t + step), value(out - step), value(out)];
                            if !carried.is_nan() && (carried < 0.0) != (values[0] < 0.0) {
                                return Some(Found { t, at });
                            }
                            if let Some(part) = first_root(bernstein(values)) {
                                return Some(Found { t: t + (out - t) * part, at });
                            }
                            carried = values[3];
                        } else {
                            let entry = if carried.is_finite() { carried } else { value(t) };
                            if carried.is_infinite() && (carried < 0.0) != (entry < 0.0) {
                                return Some(Found { t, at });
                            }
                            let exit = value(out);
                            if (entry < 0.0) != (exit < 0.0) {
                                return Some(Found { t: t + (out - t) * (entry / (entry - exit)).clamp(0.0, 1.0), at });
                            }
                            carried = exit;
                        }
                        (last, since) = (Some(at), None);
                    }
                    Child::Other(number) => {
                        let at = At::Other(number);
                        let begin = since.unwrap_or(t);
                        let way = [begin, out].map(|t| prepared.start + prepared.unit * t);
                        // What was left of the leaf before may pass triangles that this one does not know.
                        let entered = since.filter(|&since| since >= t).map(|_| carried < 0.0);
                        if let Some(Through { entered, change, until }) = self.through(&self.others[number as usize], way, entered) {
                            if !carried.is_nan() && (carried < 0.0) != entered {
                                return Some(Found { t, at });
                            }
                            if let Some(part) = change {
                                return Some(Found { t: begin + (out - begin) * part, at });
                            }
                            carried = if entered { f64::NEG_INFINITY } else { f64::INFINITY };
                            (last, since) = (Some(at), Some(begin + (out - begin) * until));
                            break 'leaf;
                        }
                        let cell = self.field.find(self.others[number as usize].center)?;
                        let extent = cell.extent();
                        let value = |t: f64| {
                            let local = ray.local(t, place, shrink);
                            cell.value(extent.min + extent.size() * DVec3::from_array(local)) - self.distance
                        };
                        let entry = value(t);
                        if !carried.is_nan() && (carried < 0.0) != (entry < 0.0) {
                            return Some(Found { t, at });
                        }
                        if let Some(part) = first_change(|s| value(t + s), out - t, SLOPE, entry < 0.0) {
                            return Some(Found { t: t + part, at });
                        }
                        (carried, last, since) = (value(out), Some(at), None);
                    }
                    Child::Branch(_) => return None,
                }
            }
            // On to the next cell.
            t = out;
            if t > length {
                return None;
            }
            let before = place[axis_out];
            let after = before + sizes[axis_out];
            if after >= FULL {
                // The domain ends here, and with it the solid.
                let face = At::Face { axis: axis_out, entering: false };
                return (carried < 0.0).then_some(Found { t, at: face });
            }
            place[axis_out] = after;
            let level = 31 - (before ^ after).leading_zeros();
            size = 1 << level;
            let mut octant = 0;
            for axis in 0..AXES {
                octant |= ((place[axis] >> level & 1) as usize) << axis;
                place[axis] &= !(size - 1);
            }
            word = self.nodes[stack[level as usize + 1] as usize][octant ^ mask];
        }
    }

    fn normal(&self, found: &Found, point: DVec3, direction: DVec3) -> DVec3 {
        let across = |axis: usize, entering: bool| {
            let mut normal = DVec3::ZERO;
            normal[axis] = if (direction[axis] > 0.0) == entering { -1.0 } else { 1.0 };
            normal
        };
        let gradient = match found.at {
            At::Face { axis, entering } => across(axis, entering),
            At::Other(number) => self.field.find(self.others[number as usize].center).map_or(DVec3::ZERO, |cell| cell.gradient(point)),
            At::Linear { number, place, size } => self.slopes(number, place, size, point, direction),
        };
        gradient.try_normalize().unwrap_or(-direction)
    }

    /// Gradient in a trilinear leaf.
    fn slopes(&self, number: u32, place: [u32; 3], size: u32, point: DVec3, direction: DVec3) -> DVec3 {
        let corners = &self.corners[number as usize];
        let whole = self.extent.size();
        let mut local = [0.0; 3];
        let mut edge = DVec3::ZERO;
        for axis in 0..3 {
            let undivided = self.columns && axis == 2;
            let size = if undivided { FULL } else { size };
            let turned = if undivided { 0 } else { place[axis] };
            let low = if direction[axis] < 0.0 { FULL - turned - size } else { turned };
            let part = whole[axis] / f64::from(FULL);
            edge[axis] = part * f64::from(size);
            local[axis] = ((point[axis] - self.extent.min[axis] - part * f64::from(low)) / edge[axis]).clamp(0.0, 1.0);
        }
        DVec3::from_array(trilinear_slopes(corners, local)) / edge
    }
}
