//! Single-precision distances to one triangle from many points at once, with a known error.
//!
//! In its frame a triangle lies in the plane z = 0 with its longest edge on the x axis. All lengths
//! are those of unit directions, so the error is a few ulp of the coordinates also for slivers:
//! a triangle whose normal is spoilt is so thin that turning it about its longest edge moves nothing.

use crate::geom::DVec3;
use crate::simd::Fuse;

/// |single-precision distance - distance| <= `FILTER_ERROR` * (largest coordinate difference involved).
///
/// About 20 roundings of 2^-24 each lie on the longest path; the tests attack 48.
pub(crate) const FILTER_ERROR: f64 = 48.0 / 16_777_216.0;

/// A triangle in its own frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    origin: DVec3,
    x: [f32; 3],
    y: [f32; 3],
    z: [f32; 3],
    /// Length of the longest edge, from (0, 0) to (length, 0).
    length: f32,
    /// Unit direction and length of the edge from (length, 0) to the third corner.
    second: [f32; 2],
    second_length: f32,
    /// Unit direction and length of the edge from (0, 0) to the third corner.
    third: [f32; 2],
    third_length: f32,
}

/// Points relative to a base point.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(crate) struct Offsets<const N: usize> {
    pub x: [f32; N],
    pub y: [f32; N],
    pub z: [f32; N],
}

impl<const N: usize> Offsets<N> {
    pub fn from_fn(mut offset: impl FnMut(usize) -> DVec3) -> Self {
        let mut out = Self { x: [0.0; N], y: [0.0; N], z: [0.0; N] };
        for lane in 0..N {
            let [x, y, z] = offset(lane).to_array();
            (out.x[lane], out.y[lane], out.z[lane]) = (x as f32, y as f32, z as f32);
        }
        out
    }
}

impl Frame {
    pub fn new(corners: [DVec3; 3]) -> Self {
        let length = |i: usize| (corners[(i + 1) % 3] - corners[i]).length_squared();
        let first = (0..3).fold(0, |best, i| if length(i) > length(best) { i } else { best });
        let [a, b, c] = std::array::from_fn(|i| corners[(first + i) % 3]);
        let (ab, ac) = (b - a, c - a);
        let x = ab.try_normalize().unwrap_or(DVec3::X);
        // The part of ac across ab; where rounding made it, it may point along ab, and any perpendicular serves.
        let across = ac - x * ac.dot(x);
        let across = if across.length() > 1e-10 * ab.length() { across } else { x.any_orthonormal_vector() };
        let y = (across - x * across.dot(x)).normalize();
        let z = x.cross(y);
        let single = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32];
        let edge = |from: DVec3| {
            let (along, up) = ((c - from).dot(x), (c - from).dot(y));
            let length = along.hypot(up);
            if length > 0.0 { ([(along / length) as f32, (up / length) as f32], length as f32) } else { ([0.0, 1.0], 0.0) }
        };
        let ((second, second_length), (third, third_length)) = (edge(b), edge(a));
        Self { origin: a, x: single(x), y: single(y), z: single(z), length: ab.length() as f32, second, second_length, third, third_length }
    }

    /// Squared distances of `base + offsets` to the triangle.
    #[inline(always)]
    pub fn distances_squared<F: Fuse, const N: usize>(&self, base: DVec3, offsets: &Offsets<N>, out: &mut [f32; N]) {
        let w = base - self.origin;
        let w = [w.x as f32, w.y as f32, w.z as f32];
        let dot = |e: &[f32; 3]| F::mul_add(w[2], e[2], F::mul_add(w[1], e[1], w[0] * e[0]));
        let (x0, y0, z0) = (dot(&self.x), dot(&self.y), dot(&self.z));
        for lane in 0..N {
            let (ox, oy, oz) = (offsets.x[lane], offsets.y[lane], offsets.z[lane]);
            let along = |start: f32, e: &[f32; 3]| F::mul_add(oz, e[2], F::mul_add(oy, e[1], F::mul_add(ox, e[0], start)));
            let (x, y, z) = (along(x0, &self.x), along(y0, &self.y), along(z0, &self.z));
            // First edge: on the x axis.
            let t = x - clamp(x, self.length);
            let first = F::mul_add(t, t, y * y);
            // The others: along and across their unit direction.
            let (wx, [ex, ey]) = (x - self.length, self.second);
            let s = F::mul_add(wx, ex, y * ey);
            let s = s - clamp(s, self.second_length);
            let across2 = F::mul_add(wx, ey, -(y * ex));
            let second = F::mul_add(s, s, across2 * across2);
            let [ex, ey] = self.third;
            let s = F::mul_add(x, ex, y * ey);
            let s = s - clamp(s, self.third_length);
            let across3 = F::mul_add(x, ey, -(y * ex));
            let third = F::mul_add(s, s, across3 * across3);
            // Inside: above the first edge, left of the second, right of the third; strictly, since a segment has its own
            // line on the right side of all three.
            let inside = (y > 0.0) & (across2 < 0.0) & (across3 > 0.0);
            let plane = least(least(first, second), third);
            let plane = if inside { 0.0 } else { plane };
            out[lane] = F::mul_add(z, z, plane);
        }
    }
}

/// `x` brought into 0 ..= `high`; plain comparisons are one instruction, `f32::clamp` minds NaN with five.
#[inline(always)]
fn clamp(x: f32, high: f32) -> f32 {
    let x = if x > 0.0 { x } else { 0.0 };
    if x < high { x } else { high }
}

#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Facet;
    use crate::laws::Random;
    use crate::simd::{Plain, multiversion};

    const LANES: usize = 16;

    multiversion!(
        /// What this machine runs.
        fn native(frame: &Frame, base: DVec3, offsets: &Offsets<LANES>, out: &mut [f32; LANES]) = native_body
    );

    #[inline(always)]
    fn native_body<F: Fuse>(frame: &Frame, base: DVec3, offsets: &Offsets<LANES>, out: &mut [f32; LANES]) {
        frame.distances_squared::<F, LANES>(base, offsets, out);
    }

    /// Slivers, segments, points and others, some of them along the axes.
    fn corners(random: &mut Random) -> [DVec3; 3] {
        let axis = |random: &mut Random| if random.below(3) == 0 { DVec3::AXES[random.below(3)] } else { random.direction() };
        let (a, x, y) = (random.direction(), axis(random), axis(random));
        let height = random.length(1e-17, 1.0);
        let mut out = match random.below(6) {
            0 => [a, a + x, a + x * random.unit() + y * height],
            1 => [a, a + x, a + x + y * height],
            2 => [a, a + x, a + x],
            3 => [a, a + x, a + x * 0.5],
            4 => [a; 3],
            _ => [a, a + random.direction(), a + random.direction()],
        };
        out.rotate_left(random.below(3));
        out
    }

    #[test]
    fn single_precision_is_off_by_no_more_than_the_filter_error() {
        let mut random = Random::new(1);
        let mut worst = 0.0f64;
        for round in 0..100_000 {
            let corners = corners(&mut random);
            let facet = Facet::new(corners[0], corners[1], corners[2]);
            let frame = Frame::new(corners);
            let base = random.direction() * random.length(1e-3, 1e2);
            let spread = random.length(1e-6, 3.0);
            let toward = corners[random.below(3)] - base;
            let offset: [DVec3; LANES] = std::array::from_fn(|lane| match (round + lane) % 4 {
                0 => random.direction() * spread,
                1 => toward + random.direction() * (spread * 1e-3),
                2 => toward + (corners[1] - corners[0]) * random.between(-1.0, 2.0),
                _ => toward + DVec3::AXES[random.below(3)] * random.between(-1.0, 1.0),
            });
            let offsets = Offsets::<LANES>::from_fn(|lane| offset[lane]);
            let (mut plain, mut quick) = ([0.0; LANES], [0.0; LANES]);
            frame.distances_squared::<Plain, LANES>(base, &offsets, &mut plain);
            native(&frame, base, &offsets, &mut quick);
            for lane in 0..LANES {
                let truth = facet.distance_squared(base + offset[lane]).sqrt();
                let size = base.length() + offset[lane].length() + 3.0;
                for found in [plain[lane], quick[lane]] {
                    let error = (f64::from(found.sqrt()) - truth).abs() / size;
                    assert!(error <= FILTER_ERROR, "{corners:?} at {:?}: {} instead of {truth}", base + offset[lane], found.sqrt());
                    worst = worst.max(error);
                }
            }
        }
        // The bound is not idle either.
        assert!(worst > FILTER_ERROR / 1000.0, "{worst:e}");
    }
}
